//! Laws of control by value, at their borders: the tracker of the PI drive, the end of a half, names of modes.

use tractive_control::control::{ControlLaw, MtpaStart, PiLaw};
use tractive_control::frames::Angle;
use tractive_control::modulation::{CarrierHalf, Mode};
use tractive_control::time::Clock;

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

/// The PI drive's law follows an angle with the tracker that it tells, and knows nothing of the link's sensor.
#[test]
fn the_pi_drives_law_tells_its_tracker() {
    let mut law = PiLaw::starting(MtpaStart::Zero);
    for step in 0..300_u16 {
        law.track(Angle::from_turns(0.01 * f32::from(step)), &CLOCK);
    }
    let wanted = 0.01 * core::f32::consts::TAU / CLOCK.control_s();
    assert!((law.tracker().omega() / wanted - 1.0).abs() < 1e-3, "{}", law.tracker().omega());
    assert_eq!(law.tracker().omega(), law.omega());
    assert_eq!(law.link_scale(), 1.0);
}

/// A locked half ends where the next boundary of its turn stands.
#[test]
fn a_half_ends_at_a_boundary_of_its_turn() {
    for mode in Mode::ALL {
        let halves = u64::from(mode.carriers()) * 2;
        for half in [0, 1, 5] {
            let end = CarrierHalf { mode, half, ..CarrierHalf::off(1_000) }.end_angle();
            if halves == 0 {
                assert_eq!(end, None, "{mode:?}");
                continue;
            }
            let wanted = Angle(((u64::from(half) + 1) * (1 << 32) / halves) as u32);
            let off = end.map(|end| (end - wanted).signed().abs());
            assert!(off.is_some_and(|off| off < 2), "{mode:?} {half}: {off:?}");
        }
    }
}

#[test]
fn a_mode_is_found_by_its_name_and_by_its_familys() {
    for mode in Mode::ALL {
        assert_eq!(Mode::named_at(mode.name(), 0.5), Some(mode));
        assert!(mode.name().starts_with(mode.family()) && mode.family().len() > 2, "{mode:?}");
        assert!(mode.is_optimal() || mode.family() == mode.name(), "{mode:?}");
    }
    assert_eq!(Mode::named_at("none", 0.5), None);
}

/// The branch that is played on the way up: the first whose highest index is above, at last the last.
#[cfg(feature = "optimal")]
#[test]
fn of_a_family_it_is_the_branch_that_is_played() {
    let named = |index| Mode::named_at("opp7", index).map(Mode::name);
    assert_eq!(named(0.0), Some("opp7a"));
    assert_eq!(named(2.0), Some("opp7e"));
    let mut last = "opp7a";
    for step in 0..=1_000_u16 {
        let name = named(0.001 * f32::from(step)).unwrap();
        assert!(name >= last, "{name} after {last}");
        last = name;
    }
}
