//! The published DBC file, parsed by a library of others, against the code's encoders and decoders.

use can_dbc::{
    ByteOrder, Dbc, MessageId, MultiplexIndicator, NumericValue, SignalExtendedValueType, ValueType,
};
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use tractive::modulation::MODE_CODES;
use tractive::protocol::{
    COUNTER, CRC, FROM_DRIVE, FROM_IDENTIFICATION, FROM_ZS9, Kind, Message, Pattern, Payload, STATUS, Signal,
    StatusFrame, TO_DRIVE, TO_ZS9, ZS9_STATUS,
};

fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tractive.dbc")
}

fn published() -> String {
    std::fs::read_to_string(path()).unwrap_or_default()
}

fn parsed() -> Dbc {
    Dbc::try_from(published().as_str()).unwrap()
}

fn messages() -> impl Iterator<Item = (&'static Message, bool)> {
    let to = TO_DRIVE.into_iter().chain(TO_ZS9).map(|message| (message, true));
    let from =
        FROM_DRIVE.into_iter().chain(FROM_IDENTIFICATION).chain(FROM_ZS9).map(|message| (message, false));
    // One drive after the other.
    let zs9 = |message: &(&Message, bool)| message.0.name.starts_with("ZS9_");
    let mut all: Vec<_> = to.chain(from).collect();
    all.sort_by_key(|message| zs9(message));
    all.into_iter()
}

/// The drive's node.
fn node(message: &Message) -> &'static str {
    if message.name.starts_with("ZS9_") { "ZS9" } else { "DRIVE" }
}

fn signals(message: &Message) -> Vec<Signal> {
    [CRC, COUNTER].into_iter().chain(message.signals.iter().copied()).collect()
}

fn float(value: &NumericValue) -> f64 {
    match value {
        NumericValue::Uint(value) => *value as f64,
        NumericValue::Int(value) => *value as f64,
        NumericValue::Double(value) => *value,
    }
}

/// A number of the file as the code holds it.
fn same(found: f64, code: f32) -> bool {
    found as f32 == code
}

#[test]
fn every_signal_is_described_as_it_is_encoded() {
    let dbc = parsed();
    assert_eq!(dbc.messages.len(), messages().count());
    let drive = TO_DRIVE.len() + FROM_DRIVE.len() + FROM_IDENTIFICATION.len();
    assert_eq!(messages().count(), drive + TO_ZS9.len() + FROM_ZS9.len());
    for (message, to_drive) in messages() {
        let found = dbc.messages.iter().find(|found| found.id == MessageId::Standard(message.id)).unwrap();
        assert_eq!((found.name.as_str(), found.size), (message.name, 8));
        assert_eq!(found.signals.len(), signals(message).len(), "{}", message.name);
        for signal in signals(message) {
            let name = format!("{}.{}", message.name, signal.name);
            let found = found.signals.iter().find(|found| found.name == signal.name).expect(&name);
            assert_eq!((found.start_bit, found.size), (signal.start.into(), signal.bits.into()), "{name}");
            assert_eq!(found.byte_order, ByteOrder::LittleEndian, "{name}");
            let signed = signal.kind != Kind::Unsigned;
            assert_eq!(found.value_type == ValueType::Signed, signed, "{name}");
            assert!(same(found.factor, signal.scale) && same(found.offset, signal.offset), "{name}");
            assert!(same(float(&found.min), signal.min) && same(float(&found.max), signal.max), "{name}");
            assert_eq!(found.unit, signal.unit, "{name}");
            let page = match signal.page {
                Some(page) => MultiplexIndicator::MultiplexedSignal(page.into()),
                None if signal.name == "page" => MultiplexIndicator::Multiplexor,
                None => MultiplexIndicator::Plain,
            };
            assert_eq!(found.multiplexer_indicator, page, "{name}");
            assert_eq!(found.receivers, [if to_drive { node(message) } else { "SUPERVISOR" }], "{name}");
            let is_float = dbc.signal_extended_value_type_list.iter().any(|list| {
                list.message_id == MessageId::Standard(message.id)
                    && list.signal_name == signal.name
                    && list.signal_extended_value_type == SignalExtendedValueType::IEEEfloat32Bit
            });
            assert_eq!(is_float, signal.kind == Kind::Float, "{name}");
        }
    }
}

/// No two signals of a message, on one page, share a bit; none leaves the frame.
#[test]
fn signals_do_not_overlap() {
    for (message, _) in messages() {
        for page in 0..3 {
            let mut used = 0_u64;
            for signal in signals(message) {
                assert!(signal.bits > 0 && signal.start + signal.bits <= 64);
                if signal.page.is_none_or(|own| own == page) {
                    assert_eq!(used & signal.mask(), 0, "{}.{}", message.name, signal.name);
                    used |= signal.mask();
                }
            }
        }
    }
}

/// A pulse pattern by its code alone.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Code(u32);

impl Pattern for Code {
    fn code(self) -> u32 {
        self.0
    }

    fn from_code(code: u32) -> Self {
        Self(code)
    }
}

#[test]
fn the_status_has_room_for_every_code_of_a_mode() {
    let mut status = StatusFrame { refusals: 0x1F, ..StatusFrame::decode(Payload(0)) };
    for code in 0..MODE_CODES {
        status.mode = Code(code);
        assert_eq!(StatusFrame::decode(status.encode()), status);
        for (message, name) in [(&STATUS, "mode"), (&ZS9_STATUS, "scheme")] {
            let signal = message.signals.iter().find(|signal| signal.name == name).unwrap();
            assert_eq!(signal.get(status.encode()), Some(code as f32), "{}", message.name);
        }
    }
}

/// A signal's raw bits by the file's description alone, bit by bit.
fn raw_by_file(data: [u8; 8], signal: &can_dbc::Signal) -> i64 {
    let bit = |n: u64| i64::from(data[n as usize / 8] >> (n % 8) & 1);
    let value = (0..signal.size).fold(0, |value, n| value | bit(signal.start_bit + n) << n);
    let negative = signal.value_type == ValueType::Signed && value >> (signal.size - 1) & 1 == 1;
    if negative { value - (1 << signal.size) } else { value }
}

fn set_by_file(data: &mut [u8; 8], signal: &can_dbc::Signal, raw: i64) {
    for n in 0..signal.size {
        let at = signal.start_bit + n;
        let mask = 1 << (at % 8);
        let byte = &mut data[at as usize / 8];
        *byte = if raw >> n & 1 == 1 { *byte | mask } else { *byte & !mask };
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Ours in, the file's description out, and the other way round, over the whole range of every signal and beside other bits.
    #[test]
    fn both_ways_give_the_same_value(share in 0.0_f32..=1.0, around: u64) {
        let dbc = parsed();
        for (message, _) in messages() {
            let described = dbc.messages.iter().find(|m| m.id == MessageId::Standard(message.id)).unwrap();
            for signal in signals(message) {
                let by_file = described.signals.iter().find(|found| found.name == signal.name).unwrap();
                if signal.kind == Kind::Float {
                    let value = (share - 0.5) * 1e6;
                    let mut payload = Payload(around);
                    signal.put(&mut payload, value).unwrap();
                    let raw = raw_by_file(payload.0.to_le_bytes(), by_file) as u32;
                    prop_assert_eq!(f32::from_bits(raw), value);
                    prop_assert_eq!(signal.get(payload), Some(value));
                    continue;
                }
                let value = signal.min + share * (signal.max - signal.min);
                let mut payload = Payload(around);
                signal.put(&mut payload, value).unwrap();
                prop_assert_eq!(payload.0 & !signal.mask(), around & !signal.mask(), "only its own bits");
                let decoded = raw_by_file(payload.0.to_le_bytes(), by_file) as f64 * by_file.factor + by_file.offset;
                // Half a step, and what two roundings in single precision add to a value that lies on the half.
                let rounding = f64::from(f32::EPSILON) * (f64::from(value) - by_file.offset).abs();
                let most = 0.5 * by_file.factor + rounding;
                prop_assert!((decoded - f64::from(value)).abs() <= most, "{} {value} {decoded}", signal.name);
                let raw = (decoded / by_file.factor).round() as i64;
                let mut data = around.to_le_bytes();
                set_by_file(&mut data, by_file, raw);
                let ours = signal.get(Payload(u64::from_le_bytes(data))).unwrap();
                prop_assert!((f64::from(ours) - decoded).abs() <= 1e-6 * decoded.abs().max(1.0), "{}", signal.name);
            }
        }
    }

    /// The values that the file's range excludes are none, whatever their bits.
    #[test]
    fn nothing_outside_the_files_range_is_decoded(bits: u64) {
        let dbc = parsed();
        for (message, _) in messages() {
            let described = dbc.messages.iter().find(|m| m.id == MessageId::Standard(message.id)).unwrap();
            for signal in signals(message).into_iter().filter(|signal| signal.kind != Kind::Float) {
                let by_file = described.signals.iter().find(|found| found.name == signal.name).unwrap();
                let value = raw_by_file(bits.to_le_bytes(), by_file) as f64 * by_file.factor + by_file.offset;
                let slack = 0.25 * by_file.factor;
                let inside = value >= float(&by_file.min) - slack && value <= float(&by_file.max) + slack;
                prop_assert_eq!(signal.get(Payload(bits)).is_some(), inside, "{} {}", signal.name, value);
            }
        }
    }
}

#[test]
fn what_cannot_be_carried_is_refused_and_what_is_not_measured_says_so() {
    for (message, _) in messages() {
        for signal in signals(message).into_iter().filter(|signal| signal.kind != Kind::Unsigned) {
            for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut payload = Payload(0);
                assert!(signal.put(&mut payload, value).is_err());
                assert_eq!(payload, Payload(0), "nothing is half-written");
                signal.put_measured(&mut payload, Some(value));
                assert_eq!(signal.get(payload), None, "{}.{}", message.name, signal.name);
            }
        }
    }
}
