//! The edges at the pins beside those that the drive makes on the host of the same inputs. The image is that which
//! `TRACTIVE_NUCLEO_IMAGE` names.

use tractive_rig::talk::System;
use tractive_twin::replay::Replay;
use tractive_twin::replay::edges::Compared;
use tractive_twin::run::{Settings, drive_beside, prepare};

/// A short pull, from standstill.
const SCRIPT: &str = "\
0.20 charge
0.50 enable
0.55 torque 300 over 0.05
0.65 expect mode async
0.65 end
";

/// The first compare of leg U: TIM1_CCR1.
const COMPARE: u32 = 0x4001_2C34;

fn compared(mistake: Option<fn(u32, u32) -> u32>) -> Compared {
    let image = std::env::var_os("TRACTIVE_NUCLEO_IMAGE").expect("TRACTIVE_NUCLEO_IMAGE");
    let settings = Settings::new(image.as_ref(), System::Pmasynrm, SCRIPT.to_owned());
    let (mut cpu, image) = prepare(&settings).unwrap();
    let mut replay = Replay::new(&settings, &image).unwrap();
    let machine = cpu.machine_mut();
    machine.mistake = mistake;
    machine.world.side.charge();
    drive_beside(&mut cpu, Some(&mut replay)).unwrap();
    replay.compare(cpu.machine())
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn the_edges_are_those_of_the_host() {
    let Compared { edges, all, worst, missed, .. } = compared(None);
    assert!(edges > 1_000 && all - edges < 10, "{edges} of {all}");
    assert_eq!((worst, missed), (0, 0));
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn a_compare_two_ticks_late_is_seen() {
    let late = |address, value| match value {
        1..0xFFFF if address == COMPARE => value + 2,
        _ => value,
    };
    let Compared { missed, first, .. } = compared(Some(late));
    assert!(missed > 100 && first.is_some_and(|(gate, _)| gate < 2), "{missed} {first:?}");
}
