//! The operating point of the largest torque at the end of the voltage, of a machine that takes its largest current for it.

use std::path::Path;
use tractive_control::control::{Region, VoltageLimit, flux_linkage, mtpa, operating_point};
use tractive_control::frames::six_step_v;
use tractive_tablegen::MachineFolder;

/// A link that gives a little more than the point of least current needs: the circle of its flux linkage crosses that of the largest current at less torque. The
/// point is the one of least current nevertheless, not the one where both circles cross.
#[test]
fn a_little_more_voltage_does_not_move_the_largest_torque() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmsm-48v-1kw");
    let tables = MachineFolder::read(&folder).unwrap().tables();
    let (omega, torque_nm) = (1_500.0, 1.0005 * tables.ratings.max_torque_nm);
    for sign in [1.0, -1.0] {
        let least = mtpa(sign * torque_nm, &tables);
        let drop = least * tables.ratings.stator_resistance_ohm;
        let needed_v = (flux_linkage(&tables, least).j() * omega + drop).length() / six_step_v(1.0);
        let mut limited = 0;
        for percent in 0..=60_u8 {
            let udc_v = needed_v * (0.99 + 1e-3 * f32::from(percent));
            let limit = VoltageLimit { udc_v, modulation_index: 1.0, filled: false };
            let point = operating_point(sign * torque_nm, omega, &limit, &tables);
            if percent < 10 {
                limited += u32::from(point.region == Region::Limit);
                assert!(point.current.d <= least.d, "{percent}: {point:?}");
            } else if percent > 12 {
                assert!((point.current.d - least.d).abs() < 0.01, "{percent}: {point:?}");
            }
        }
        assert!(limited > 0, "never on both circles");
    }
}
