//! Where one law ends and another begins: at the border itself, by value.

use std::path::Path;
use tractive_control::control::{ControlLaw, MtpaStart, PiLaw, Region, VoltageLimit, operating_point};
use tractive_control::frames::Angle;
use tractive_control::machine::Tables;
use tractive_control::time::Clock;
use tractive_tablegen::MachineFolder;

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

fn tables(name: &str) -> Tables {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables").join(name);
    MachineFolder::read(&folder).unwrap().tables()
}

#[test]
fn the_largest_torque_of_least_current_is_none_that_is_limited() {
    let limit = VoltageLimit { udc_v: 1_500.0, modulation_index: 1.0, filled: false };
    for name in ["ipm-zs9", "pmasynrm-180kw", "pmsm-48v-1kw"] {
        let tables = tables(name);
        let most_nm = tables.mtpa.start.last();
        for (torque_nm, region) in [(most_nm, Region::Mtpa), (1.001 * most_nm, Region::Limit)] {
            for sign in [1.0, -1.0] {
                let point = operating_point(sign * torque_nm, 0.0, &limit, &tables);
                assert_eq!((point.region, point.torque_nm), (region, sign * most_nm), "{name}");
            }
        }
    }
}

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
