//! The rows of the ZS9.

use super::outcome::Cell;
use super::rows::{Figure, Plan, figures, words};

const LOAD_STEP: &str = "zs9-load-step";
const FAST: &str = "zs9-load-step --carrier-hz 20000 --uin 800";
const REVERSE: &str = "zs9-reverse";
const CYCLE: &str = "zs9-cycle";
const TIMING: &str = "zs9-timing";
const SCHEMES: [&str; 4] = ["s", "rs", "rthd", "zvo"];
const LINK: Figure = ("link_deviation_percent", 2, "%");

fn steady() -> Vec<String> {
    SCHEMES.iter().map(|scheme| format!("zs9-steady --scheme {scheme}")).collect()
}

/// All rows.
pub const ROWS: [Plan; 9] = [
    Plan::figures(
        "ZS9, motor 2's load 60 → 100 N·m (figures 14 to 19): motor 1's torque moves by, its speed by",
        LOAD_STEP,
        &[("motor1_torque_deviation_nm", 4, "N·m"), ("motor1_speed_deviation_rpm", 5, "r/min")],
    )
    .paper("undisturbed"),
    Plan::figures(
        "ZS9, the same step: motor 2's speed falls by; its torque, 120 N·m allowed, reaches; its speed within 0.2 % again after",
        LOAD_STEP,
        &[
            ("motor2_speed_deviation_rpm", 1, "r/min"),
            ("motor2_peak_torque_nm", 1, "N·m"),
            ("motor2_back_within_0p2_percent_ms", 1, "ms"),
        ],
    )
    .why("the torque that the PIs make beyond what is allowed brings the speed back sooner"),
    Plan::of(
        "ZS9, the same step: link voltage within, at 10 kHz and 667 V; at 20 kHz and 800 V",
        || words(&[LOAD_STEP, FAST]),
        |law| {
            let (slow, fast) = (figures(law, LOAD_STEP, &[LINK])?, figures(law, FAST, &[LINK])?);
            let text = format!("{}, {}", slow.text, fast.text);
            Ok(Cell { text, values: [slow.values, fast.values].concat() })
        },
    )
    .paper("steady"),
    Plan::figures(
        "ZS9, motor 2 reverses (figures 20 to 23): speed off, rms, of motor 1, of motor 2",
        REVERSE,
        &[("motor1_speed_error_rms_rpm", 6, "r/min"), ("motor2_speed_error_rms_rpm", 4, "r/min")],
    )
    .why("the speed loop is the same, and the torque follows its ramp either way"),
    Plan::figures("ZS9, the same reversal: link voltage within", REVERSE, &[LINK]),
    Plan::figures(
        "ZS9, cycle (figures 24 to 36): link voltage within, capacitors above their reference, kinetic energy not returned",
        CYCLE,
        &[LINK, ("capacitor_overshoot_percent", 2, "%"), ("not_returned_percent", 2, "%")],
    ),
    Plan::figures(
        "ZS9, cruise at 1,300 r/min in weakening, 60 N·m: torque off, current",
        CYCLE,
        &[("cruise_torque_error_percent", 3, "%"), ("cruise_current_a", 2, "A")],
    ),
    Plan::figures(
        "ZS9, full torque at 1,450 r/min in weakening, 5 ms after a ramp there, then reversed (zs9-timing): torque off, motoring, braking",
        TIMING,
        &[("motoring_torque_error_percent", 2, "%"), ("braking_torque_error_percent", 2, "%")],
    )
    .why("motoring, ours still settles after the ramp, with more torque than its demand; the PIs are off as the torque reverses"),
    Plan::of(
        "ZS9, THD of the currents at 60 N·m and 1,000, 700 r/min, upper, lower motor: S, RS, RTHD, ZVO",
        steady,
        |law| {
            let lines = steady();
            let cells = lines
                .iter()
                .map(|line| figures(law, line, &[("thd1_percent", 2, "%"), ("thd2_percent", 2, "%")]));
            let cells = cells.collect::<Result<Vec<_>, _>>()?;
            let texts: Vec<_> = cells.iter().map(|cell| cell.text.as_str()).collect();
            let values = cells.iter().flat_map(|cell| cell.values.clone()).collect();
            Ok(Cell { text: texts.join("; "), values })
        },
    ).why("at 1,000 r/min the PIs already weaken the upper motor: less voltage makes less ripple, and takes more current"),
];
