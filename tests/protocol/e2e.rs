//! CRC and protection against the specification's values and against other implementations.

use autosar_e2e::profile22::{Profile22, Profile22Config};
use autosar_e2e::{E2EProfile, E2EStatus};
use proptest::prelude::*;
use tractive::protocol::crc::crc8_h2f;
use tractive::protocol::e2e::{Counter, MAX_DELTA, Order, Sequence, data_ids, is_intact, protect};
use tractive::protocol::{FROM_DRIVE, FROM_IDENTIFICATION, FROM_ZS9, Message, TO_DRIVE, TO_ZS9};

/// AUTOSAR's Specification of CRC Routines, table of `Crc_CalculateCRC8H2F`.
#[test]
fn the_crc_gives_the_specifications_values() {
    for (bytes, check) in [
        (&[0x00, 0x00, 0x00, 0x00][..], 0x12),
        (&[0xF2, 0x01, 0x83], 0xC2),
        (&[0x0F, 0xAA, 0x00, 0x55], 0xC6),
        (&[0x00, 0xFF, 0x55, 0x11], 0x77),
        (&[0x33, 0x22, 0x55, 0xAA, 0xBB, 0xCC, 0xDD, 0xEE, 0xFF], 0x11),
        (&[0x92, 0x6B, 0x55], 0x33),
        (&[0xFF, 0xFF, 0xFF, 0xFF], 0x6C),
        (b"123456789", 0xDF),
    ] {
        assert_eq!(crc8_h2f(bytes.iter().copied()), check, "{bytes:02X?}");
    }
}

/// AUTOSAR's E2E Protocol Specification, example of profile 22, which profile 2 is compatible with: 8 bytes of zeros, data
/// identifiers 1 to 16.
#[test]
fn the_protection_gives_the_specifications_values() {
    let ids = core::array::from_fn(|k| k as u8 + 1);
    let checks =
        [0x1B, 0x98, 0x31, 0x0D, 0x18, 0x9B, 0x65, 0x08, 0x1D, 0x9E, 0x37, 0x0B, 0x1E, 0x9D, 0xCD, 0x0E];
    for (k, check) in checks.into_iter().enumerate() {
        let counter = (k as u8 + 1) % 16;
        let mut data = [0; 8];
        protect(&mut data, counter, &ids);
        assert_eq!(data, [check, counter, 0, 0, 0, 0, 0, 0]);
    }
}

fn all() -> impl Iterator<Item = &'static Message> {
    TO_DRIVE.into_iter().chain(FROM_DRIVE).chain(FROM_IDENTIFICATION).chain(TO_ZS9).chain(FROM_ZS9)
}

#[test]
fn no_two_messages_share_a_data_identifier_at_one_counter() {
    let mut seen = std::collections::BTreeSet::new();
    for message in all() {
        assert!((1..=31).contains(&message.number) && message.id < 0x800, "{}", message.name);
        assert_eq!(*message.data_ids(), data_ids(message.number));
        let ids = message.data_ids().iter().enumerate();
        assert!(ids.into_iter().all(|place| seen.insert((place.0, *place.1))), "{}", message.name);
    }
    let ids: std::collections::BTreeSet<_> = all().map(|message| message.id).collect();
    assert_eq!(ids.len(), all().count());
}

#[test]
fn a_counter_goes_round() {
    let mut counter = Counter::new();
    let taken: Vec<_> = (0..34).map(|_| counter.take()).collect();
    assert!(taken.iter().enumerate().all(|(k, counter)| usize::from(*counter) == k % 16));
}

#[test]
fn every_step_of_the_counter_is_judged() {
    for last in 0..16_u8 {
        for delta in 0..16_u8 {
            let mut sequence = Sequence::new();
            assert_eq!(sequence.judge(last), Order::First);
            let order = sequence.judge((last + delta) % 16);
            let wanted = match delta {
                0 => Order::Repeated,
                1..=MAX_DELTA => Order::Next { lost: delta - 1 },
                _ => Order::Wrong,
            };
            assert_eq!(order, wanted, "{last} {delta}");
            // What was wrong has changed nothing: the frame that is due is still taken.
            if matches!(order, Order::Repeated | Order::Wrong) {
                assert_eq!(sequence.judge((last + 1) % 16), Order::Next { lost: 0 });
            }
        }
    }
}

proptest! {
    #[test]
    fn the_crc_is_that_of_the_catalogue(bytes: Vec<u8>) {
        let catalogue = crc::Crc::<u8>::new(&crc::CRC_8_AUTOSAR);
        prop_assert_eq!(crc8_h2f(bytes.iter().copied()), catalogue.checksum(&bytes));
    }

    #[test]
    fn another_implementation_takes_our_frames_and_we_take_its(content: [u8; 8], number in 1_u8..=31) {
        let ids = data_ids(number);
        let settings = Profile22Config { data_id_list: ids, ..Profile22Config::default() };
        let mut other = Profile22::new(settings.clone()).unwrap();
        let mut data = content;
        protect(&mut data, 1, &ids);
        prop_assert_eq!(other.check(&data).unwrap(), E2EStatus::Ok);
        let mut data = content;
        Profile22::new(settings).unwrap().protect(&mut data).unwrap();
        prop_assert!(is_intact(&data, &ids));
    }

    /// The CRC's Hamming distance over this length is 4.
    #[test]
    fn up_to_three_wrong_bits_are_found(
        content: [u8; 8],
        counter in 0_u8..16,
        flips in prop::collection::hash_set(0_usize..64, 1..=3),
    ) {
        let ids = data_ids(7);
        let mut data = content;
        protect(&mut data, counter, &ids);
        prop_assert!(is_intact(&data, &ids));
        for bit in &flips {
            data[bit / 8] ^= 1 << (bit % 8);
        }
        // A wrong counter bit also picks another data identifier, which adds one more wrong byte: two of its bits may cancel out.
        let in_counter = flips.iter().any(|bit| (8..12).contains(bit));
        prop_assert!(in_counter || !is_intact(&data, &ids));
    }

    #[test]
    fn a_frame_under_another_messages_identifier_is_found(content: [u8; 8], counter in 0_u8..16) {
        for message in TO_DRIVE.into_iter().chain(TO_ZS9) {
            let mut data = content;
            protect(&mut data, counter, message.data_ids());
            for other in all() {
                prop_assert_eq!(is_intact(&data, other.data_ids()), other.id == message.id);
            }
        }
    }
}
