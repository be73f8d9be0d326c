//! Operating points by the firmware's own code, judged on the smooth map.

use tractive::control::{OperatingPoint, Region, VoltageLimit, operating_point};
use tractive_rig::machine::Machine;
use tractive_tablegen::{Optimum, SmoothMap};

struct Judge {
    machine: Machine,
    map: SmoothMap,
}

/// What a point really is.
struct Truth {
    torque_nm: f64,
    voltage_v: f64,
    current_a: f64,
}

impl Judge {
    fn new() -> Self {
        let machine = Machine::load("pmasynrm-180kw").unwrap();
        let map = SmoothMap::new(&machine.folder.map);
        Self { machine, map }
    }

    fn point(&self, torque_nm: f64, speed_rpm: f64, udc_v: f64) -> OperatingPoint {
        let omega = (speed_rpm * std::f64::consts::TAU / 60.0 * 4.0) as f32;
        let limit = VoltageLimit { udc_v: udc_v as f32, depth: 1.0, filled: false };
        operating_point(torque_nm as f32, omega, &limit, self.machine.tables)
    }

    fn truth(&self, id: f64, iq: f64, speed_rpm: f64) -> Truth {
        let omega = speed_rpm * std::f64::consts::TAU / 60.0 * 4.0;
        let flux = self.map.at(id, iq);
        let (ud, uq) = (0.1 * id - omega * flux.psi_q_wb, 0.1 * iq + omega * flux.psi_d_wb);
        Truth {
            torque_nm: 6.0 * (flux.psi_d_wb * iq - flux.psi_q_wb * id),
            voltage_v: ud.hypot(uq),
            current_a: id.hypot(iq),
        }
    }

    /// Least current for a torque within the voltage, by brute force over id; `None` where there is none.
    fn least_current(&self, torque_nm: f64, speed_rpm: f64, udc_v: f64) -> Option<f64> {
        let most_v = udc_v * std::f64::consts::FRAC_2_PI;
        let largest = self.machine.folder.parameters.max_current_a;
        let mut best: Option<f64> = None;
        for k in 0..=2800 {
            let id = -largest + 0.1 * f64::from(k);
            let (mut low, mut high) = (0.0, largest);
            let sign = torque_nm.signum();
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if self.truth(id, sign * middle, speed_rpm).torque_nm.abs() < torque_nm.abs() {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let found = self.truth(id, sign * high, speed_rpm);
            let reached = (found.torque_nm - torque_nm).abs() < 0.01;
            if reached && found.voltage_v <= most_v && found.current_a <= largest {
                best = Some(best.map_or(found.current_a, |other| other.min(found.current_a)));
            }
        }
        best
    }
}

#[test]
fn mtpa_gives_its_torque_with_the_least_current() {
    let judge = Judge::new();
    let optimum = Optimum::new(&judge.map, &judge.machine.folder.parameters);
    let (mut worst_torque, mut worst_current) = (0.0_f64, 0.0_f64);
    for step in 1..=49 {
        let torque = 25.2 * f64::from(step);
        let best = optimum.least_current(torque);
        for sign in [1.0, -1.0] {
            let point = judge.point(sign * torque, 0.0, 1500.0);
            assert_eq!(point.region, Region::Mtpa);
            let truth = judge.truth(point.current.d.into(), point.current.q.into(), 0.0);
            let error = (truth.torque_nm - sign * torque).abs();
            worst_torque = worst_torque.max(error / (0.003 * torque).max(0.5));
            worst_current = worst_current.max(truth.current_a / best.0.hypot(best.1) - 1.0);
        }
    }
    println!(
        "torque error: {worst_torque:.3} of 0.3 % or 0.5 N·m; current above the optimum: {worst_current:.2e}"
    );
    assert!(worst_torque < 1.0);
    assert!(worst_current < 5e-4);
}

#[test]
fn weakening_keeps_the_limits_and_gives_what_there_is() {
    let judge = Judge::new();
    let (mut torque, mut voltage, mut current, mut excess) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    for udc in [1000.0, 1500.0, 1800.0] {
        for speed in (1..=12).map(|k| 500.0 * f64::from(k)) {
            for wanted in [-1235.0, -800.0, -400.0, -150.0, -50.0, 50.0, 150.0, 400.0, 800.0, 1235.0] {
                let point = judge.point(wanted, speed, udc);
                let truth = judge.truth(point.current.d.into(), point.current.q.into(), speed);
                voltage = voltage.max(truth.voltage_v / (udc * std::f64::consts::FRAC_2_PI) - 1.0);
                current = current.max(truth.current_a / 233.345 - 1.0);
                torque = torque.max((truth.torque_nm / f64::from(point.torque_nm) - 1.0).abs());
                let case = format!("{wanted} N·m, {speed} r/min, {udc} V: {point:?}");
                match judge.least_current(wanted, speed, udc) {
                    Some(least) => {
                        assert_ne!(point.region, Region::Limit, "feasible: {case}");
                        excess = excess.max(truth.current_a / least - 1.0);
                    }
                    None => assert_eq!(point.region, Region::Limit, "not feasible: {case}"),
                }
            }
        }
    }
    println!(
        "torque {torque:.2e}, voltage {voltage:.2e}, current {current:.2e}, above the least {excess:.2e}"
    );
    assert!(torque < 5e-3);
    assert!(voltage < 5e-3);
    assert!(current < 1e-4);
    assert!(excess < 5e-3);
}
