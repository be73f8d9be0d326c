//! The torque of the ZS9's motors is the one that is asked for, whatever resistance, devices and dead time take of their voltage.

use rayon::prelude::*;
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::Recorded;

/// Bins of the speed, in r/min: from the first to the last, and how wide.
const FROM_RPM: f64 = 50.0;
const UNTIL_RPM: f64 = 1_250.0;
const WIDE_RPM: f64 = 50.0;
/// Share of the demand by which a bin's mean torque may be off.
const MOST: f64 = 0.01;

/// While both motors speed up with full torque. The voltage of the resistance and the devices was once learnt as flux linkage, and up to a third of
/// the torque was missing at 50 r/min; so was the residue of a dead time that is told, by up to 40 % at 300 r/min, or it was a fault at 20 kHz.
#[test]
fn torque_is_the_demand_from_standstill_on() {
    let flaws = [
        "--real --device-drop 1.5,10,1.5,10 --dead-time-us 2",
        "--rs-error -50 --dead-time-us 5",
        "--rs-error 50 --dead-time-us 3 --carrier-hz 20000",
    ];
    flaws.into_par_iter().for_each(|flaws| {
        let chosen = catalogue::of_zs9(&format!("zs9-cycle --cruise 1 {flaws}")).unwrap();
        let recording = chosen.drive(&chosen.machine().unwrap()).unwrap();
        assert!(recording.trip().is_none(), "{flaws}: {:?}", recording.trip());
        for motor in 0..2 {
            let mut bins = [(0.0, 0.0); ((UNTIL_RPM - FROM_RPM) / WIDE_RPM) as usize];
            for row in
                recording.rows.iter().map(|row| &row.motors[motor]).filter(|row| row.torque_ref_nm > 10.0)
            {
                let bin = (row.speed_rpm - FROM_RPM) / WIDE_RPM;
                if bin >= 0.0 && (bin as usize) < bins.len() {
                    let (asked, made) = &mut bins[bin as usize];
                    (*asked, *made) = (*asked + row.torque_ref_nm, *made + row.torque_nm);
                }
            }
            for (bin, (asked, made)) in bins.into_iter().enumerate() {
                let (from_rpm, off) = (FROM_RPM + WIDE_RPM * bin as f64, made / asked - 1.0);
                assert!(
                    asked > 0.0 && off.abs() < MOST,
                    "{flaws}: motor {motor} from {from_rpm} r/min: {off}"
                );
            }
        }
    });
}
