//! The edges at the pins beside those that the drive makes on the host from the same inputs. The images are those which
//! `TRACTIVE_NUCLEO_IMAGE` and `TRACTIVE_NUCLEO_ZS9_IMAGE` name.

mod prepared;

use prepared::{is_sound, prepared};
use tractive_rig::talk::System;
use tractive_twin::replay::Replay;
use tractive_twin::replay::edges::Compared;
use tractive_twin::run::drive_beside;
use tractive_twin::time::{SECOND, Time};

/// A short pull, from standstill.
const SCRIPT: &str = "\
0.10 charge
0.26 enable
0.31 torque 300 over 0.05
0.41 expect mode async
0.41 end
";
/// The same of both motors.
const SCRIPT_ZS9: &str = "\
0.10 charge
0.26 enable
0.56 torque 20 -20 over 0.02
0.66 expect state running
0.66 end
";

/// The first compare of leg U: TIM1_CCR1; and the compare at which M of leg V goes on again: TIM8_CCR4.
const COMPARE: u32 = 0x4001_2C34;
const COMPARE_ZS9: u32 = 0x4001_3440;
/// A cycle of the core.
const CYCLE: Time = SECOND / 170_000_000;

fn compared(system: System, mistake: Option<fn(u32, u32) -> u32>) -> Compared {
    let (settings, mut cpu, image) = prepared(system, [SCRIPT, SCRIPT_ZS9], mistake);
    let mut replay = Replay::new(&settings, &image).unwrap();
    drive_beside(&mut cpu, Some(&mut replay)).unwrap();
    is_sound(&cpu);
    replay.compare(cpu.machine())
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn the_edges_are_those_of_the_host() {
    let Compared { edges, all, worst, missed, .. } = compared(System::Pmasynrm, None);
    assert!(edges > 1_000 && all - edges < 10, "{edges} of {all}");
    assert_eq!((worst, missed), (0, 0));
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn the_edges_of_the_zs9_are_those_of_the_host() {
    let found = compared(System::Zs9, None);
    let Compared { edges, all, worst, missed, .. } = found;
    println!("{found:?}");
    assert!(edges > 50_000 && all == edges, "{found:?}");
    assert!(worst <= CYCLE && missed == 0, "{found:?}");
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn a_compare_two_ticks_late_is_seen() {
    let late = |address, value| match value {
        1..0xFFFF if address == COMPARE => value + 2,
        _ => value,
    };
    let Compared { missed, first, .. } = compared(System::Pmasynrm, Some(late));
    assert!(missed > 100 && first.is_some_and(|(gate, _)| gate < 2), "{missed} {first:?}");
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn a_compare_of_the_zs9_two_cycles_late_is_seen() {
    let late = |address, value| match value {
        1..8_490 if address == COMPARE_ZS9 => value + 2,
        _ => value,
    };
    let Compared { missed, first, .. } = compared(System::Zs9, Some(late));
    // M of leg V is the fifth gate. It also trips the drive, which sees its gates.
    assert!(missed > 10 && first.is_some_and(|(gate, _)| gate == 4), "{missed} {first:?}");
}
