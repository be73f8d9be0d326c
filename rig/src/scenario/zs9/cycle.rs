//! The whole traction cycle under torque control: the paper's figures 24 to 36.

use super::prelude::*;
use crate::options::number;
use crate::scenario::{System, drive};
use clap::ValueEnum;

/// From near standstill to the rated speed at full torque (the paper's machine from 10 to 1,300 r/min), a cruise there, and back.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Cycle {
    /// Length of the cruise, in s, from 0.7 to 3600.
    #[arg(long, default_value_t = 20.0, value_parser = cruise_s, allow_negative_numbers = true)]
    cruise: f64,
    /// Motor 2's own cycle.
    #[arg(long, value_enum, default_value = "same")]
    second: Second,
    /// Write edges.csv.
    #[serde(skip)]
    #[arg(long)]
    edges: bool,
}

/// The cycle of motor 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Second {
    /// As motor 1
    Same,
    /// Later, in the other direction, to half the speed with half the torque; it brakes while motor 1 cruises
    Other,
    /// No torque
    Rests,
}

/// A motor's cycle, as shares of the paper's.
struct Course {
    /// Delay of its beginning, in s.
    from_s: f64,
    /// Factor of the torque and of the loads, with the direction as its sign; 0: the motor does nothing.
    share: f64,
    /// Highest speed, in r/min, and length of the cruise, in s.
    high_rpm: f64,
    cruise_s: f64,
}

impl Second {
    /// Motor 2's cycle beside a motor 1 that cruises for a time in s at a speed in r/min.
    fn course(self, cruise_s: f64, high_rpm: f64) -> Course {
        match self {
            Self::Same => Course { from_s: 0.0, share: 1.0, high_rpm, cruise_s },
            Self::Other => {
                Course { from_s: 2.5, share: -0.5, high_rpm: 0.5 * high_rpm, cruise_s: 0.3 * cruise_s }
            }
            Self::Rests => Course { from_s: 0.0, share: 0.0, high_rpm, cruise_s },
        }
    }
}

const LEAD_S: f64 = 0.2;
const STEP_S: f64 = 1e-3;
/// Time left out after the cruise's beginning and before its end, in s: torque and field weakening still change there.
const SETTLING_S: f64 = 0.3;
/// Shortest cruise, of which something is left then, in s.
const LEAST_CRUISE_S: f64 = 0.7;

/// Phase of the cycle in which a motor is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Before,
    Accelerates,
    /// Until an instant, in s.
    Cruises(f64),
    Brakes,
    Done,
}

/// Torque and load of a motor at a speed in r/min.
fn orders(phase: &mut Phase, t_s: f64, rpm: f64, course: &Course, of: &Measures) -> (f64, f64) {
    let rpm = if course.share < 0.0 { -rpm } else { rpm };
    *phase = match *phase {
        Phase::Before if t_s >= course.from_s - 1e-9 => Phase::Accelerates,
        Phase::Accelerates if rpm >= course.high_rpm => Phase::Cruises(t_s + course.cruise_s),
        Phase::Cruises(until_s) if t_s >= until_s => Phase::Brakes,
        Phase::Brakes if rpm <= of.low_rpm + of.stopping_rpm => Phase::Done,
        same => same,
    };
    let (torque_nm, load_nm) = match phase {
        Phase::Before | Phase::Done => (0.0, 0.0),
        Phase::Accelerates => (of.at_most_nm(rpm), of.moving_load_nm),
        Phase::Cruises(_) => (of.cruise_nm, of.cruise_nm),
        Phase::Brakes => (-of.at_most_nm(rpm), of.moving_load_nm),
    };
    (course.share * torque_nm, course.share * load_nm)
}

impl Scenario<Zs9> for Cycle {
    fn trace_step_s(&self, _own: &Zs9Options) -> f64 {
        STEP_S
    }

    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let (cruise_s, of) = (self.cruise, Measures::of(machine));
        let courses = [Second::Same, self.second].map(|motor| motor.course(cruise_s, of.high_rpm));
        let from_rpm = [of.low_rpm, of.low_rpm * if self.second == Second::Other { -1.0 } else { 1.0 }];
        let mut phases = [Phase::Before; 2];
        let operator = move |t_s: f64, speeds: SeenMotors| {
            let [one, two] = [0, 1].map(|k| orders(&mut phases[k], t_s, speeds[k], &courses[k], &of));
            let torque = |torque_nm: f64| {
                MotorDemand::Torque(Demand { torque_nm: torque_nm as f32, slew_limited: true })
            };
            Orders { demands: [torque(one.0), torque(two.0)], loads_nm: [one.1, two.1], enable: true }
        };
        let times_s = (LEAD_S, of.moving_s + cruise_s);
        Plan {
            edges: self.edges,
            judged_step_s: Some(STEP_S),
            ..Plan::driven(times_s, free(of.inertia_kg_m2), from_rpm, operator)
        }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = figures::common(recording);
        let (rows, of) = (&recording.rows, Measures::of(machine));
        let reached = rows.iter().position(|row| row.motors[0].speed_rpm >= of.high_rpm - of.near_rpm);
        figures.set("accelerated_s", reached.map(|k| rows[k].t_s));
        figures.set("weakening_from_rpm", weakening_from_rpm(rows));
        returned(&mut figures, rows, &of);
        cruise(&mut figures, rows, of.cruise_nm);
        figures.set("end_speed_rpm", rows.last().map(|row| row.motors[0].speed_rpm));
        figures::link(&mut figures, rows, link_v(options, machine));
        let wanted_v = super::capacitor_v(options, machine);
        let highest_v = figures::largest(rows, |row| row.capacitor_v);
        figures.set("capacitor_overshoot_percent", (highest_v / wanted_v - 1.0) * 100.0);
        figures.set("power_residual_percent", residual_percent(rows));
        figures.set("network_stored_j", machine.folder.parameters.zs9_capacitance_f * wanted_v * wanted_v);
        if self.second == Second::Other {
            self.independence(&mut figures, recording, options, machine);
        }
        figures.set("verdicts", self.verdicts(&figures, options, machine));
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        // In the paper both motors go through the same cycle.
        if self.second != Second::Same {
            page.answers_none();
        }
        let rows = figures::window(recording, 0.0, recording.rows.last().map_or(0.0, |row| row.t_s));
        plot(page, ("figures 24 to 35", "link voltage U_in", "V"), rows, &VOLTAGES[..1]);
        plot(page, ("figures 24 to 35", "capacitor voltage", "V"), rows, &VOLTAGES[1..]);
        plot(page, ("figures 24 to 35", "inductor current", "A"), rows, &INDUCTOR);
        plot(page, ("figures 24 to 35", "torque", "N·m"), rows, &[TORQUES, DEMANDS].concat());
        plot(page, ("figures 24 to 35", "speed", "r/min"), rows, &SPEEDS);
        let currents: [Curve; 2] = [("id", |row| row.motors[0].id_a), ("iq", |row| row.motors[0].iq_a)];
        plot(page, ("figures 24 to 35", "d and q currents of motor 1", "A"), rows, &currents);
        let voltage: [Curve; 1] = [("motor 1", |row| row.motors[0].voltage_v)];
        plot(page, ("figures 24 to 35", "phase voltage, peak", "V"), rows, &voltage);
        figures::over_speed(page, ("figure 36", "torque over speed", "N·m"), &recording.rows, &TORQUES[0]);
        let title = ("figure 36", "phase voltage over speed", "V");
        figures::over_speed(page, title, &recording.rows, &voltage[0]);
    }
}

impl Cycle {
    /// Bounds of the paper's machine, or of any other one.
    fn verdicts(&self, figures: &Figures, options: &Options, machine: &Machine) -> Vec<Verdict> {
        let of = Measures::of(machine);
        let speeds =
            if machine.is(Zs9::MACHINE) { "10 to 1,300 r/min in s" } else { "to the rated speed in s" };
        let both =
            if self.second == Second::Same { known(machine, 25.0, f64::INFINITY) } else { f64::INFINITY };
        let (moved_nm, moved_rpm) = (scaled_nm(0.6, machine), scaled_rpm(1.0, machine));
        let beside = "motor 1's torque off that beside a resting motor 2 in N·m";
        let apart = [
            (beside, "motor1_torque_apart_nm", known(machine, 0.02, moved_nm)),
            ("motor 1's speed off that in r/min", "motor1_speed_apart_rpm", known(machine, 0.02, moved_rpm)),
        ];
        let (overshoot, link) =
            (known(machine, 0.3, LINK_OFF_PERCENT), known(machine, 0.5, LINK_OFF_PERCENT));
        let bounds = [
            (speeds, "accelerated_s", known(machine, 9.2, of.accelerated_s)),
            ("kinetic energy not returned in %", "not_returned_percent", both),
            ("mean torque off in the cruise in %", "cruise_torque_error_percent", known(machine, 0.1, 1.0)),
            ("capacitor voltage above its reference in %", "capacitor_overshoot_percent", overshoot),
            ("link voltage off in %", "link_deviation_percent", link),
        ];
        let apart = if self.second == Second::Other { &apart[..] } else { &[] };
        judge(figures, options, machine, &[&bounds[..], apart].concat())
    }

    /// Sets the deviations of motor 1 from the same run with a motor 2 that makes no torque.
    fn independence(
        &self,
        figures: &mut Figures,
        recording: &Recording,
        options: &Options,
        machine: &Machine,
    ) {
        let alone = Self { second: Second::Rests, ..*self };
        let Ok(alone) = drive("zs9-cycle", &alone, options, machine) else { return };
        let off = |value: fn(&Row) -> f64| {
            let pairs = recording.rows.iter().zip(&alone.rows);
            pairs.map(|(with, without)| (value(with) - value(without)).abs()).fold(0.0, f64::max)
        };
        figures.set("motor1_torque_apart_nm", off(|row| row.motors[0].torque_nm));
        figures.set("motor1_speed_apart_rpm", off(|row| row.motors[0].speed_rpm));
    }
}

/// The cycle of a machine, with the same shares of its quantities as the cycle of the paper's machine.
#[derive(Clone, Copy)]
struct Measures {
    low_rpm: f64,
    high_rpm: f64,
    /// Amount by which the highest speed may be missed, in r/min.
    near_rpm: f64,
    full_nm: f64,
    /// Speed above which power is constant.
    corner_rpm: f64,
    cruise_nm: f64,
    moving_load_nm: f64,
    inertia_kg_m2: f64,
    /// Amount by which the speed still falls while the torque takes time to go: half of `T/slew · T/J`.
    stopping_rpm: f64,
    /// Length of the cycle without the cruise, and the longest time to the highest speed, in s.
    moving_s: f64,
    accelerated_s: f64,
}

/// The paper's speeds up to which first torque, then power is full, in r/min.
const CORNER_RPM: f64 = 850.0;
const HIGH_RPM: f64 = 1_300.0;
/// Highest corner, as a share of the speed up to which the largest power allows the largest torque.
const CORNER_SHARE: f64 = 0.85;
/// Load while the motor accelerates and brakes, as a share of full torque.
const MOVING_LOAD_SHARE: f64 = 20.0 / 120.0;

impl Measures {
    fn of(machine: &Machine) -> Self {
        let parameters = &machine.folder.parameters;
        let (rpm, nm) = (|rpm: f64| scaled_rpm(rpm, machine), |nm: f64| scaled_nm(nm, machine));
        let power_rpm = parameters.max_power_w / parameters.max_torque_nm / rad_s(1.0);
        let corner_rpm = rpm(CORNER_RPM).min(CORNER_SHARE * power_rpm);
        let (high_rpm, full_nm) = (rpm(HIGH_RPM), nm(120.0));
        let slew = parameters.max_torque_nm / parameters.torque_slew_nm_per_s / 0.03;
        let slower = moving(corner_rpm / high_rpm) / moving(CORNER_RPM / HIGH_RPM);
        Self {
            low_rpm: rpm(10.0),
            high_rpm,
            near_rpm: rpm(0.5),
            full_nm,
            corner_rpm,
            cruise_nm: nm(60.0).min(0.9 * full_nm * corner_rpm / high_rpm),
            moving_load_nm: nm(20.0),
            inertia_kg_m2: scaled_kg_m2(6.0, machine),
            stopping_rpm: rpm(2.9) * slew,
            moving_s: 16.5 * slower,
            accelerated_s: 9.2 * slower + 0.1 * slew,
        }
    }

    /// Full torque, or full power, at a speed.
    fn at_most_nm(&self, rpm: f64) -> f64 {
        self.full_nm * (self.corner_rpm / rpm.abs().max(self.corner_rpm))
    }
}

/// Time to the highest speed against the load, with full torque up to a share of that speed and full power beyond it, as a multiple of the
/// time that full torque alone takes without a load.
fn moving(corner: f64) -> f64 {
    const STEPS: u32 = 1_000;
    let shares = (0..STEPS).map(|step| (f64::from(step) + 0.5) / f64::from(STEPS));
    let torque = |share: f64| (corner / share).min(1.0) - MOVING_LOAD_SHARE;
    shares.map(|share| torque(share).max(0.05).recip()).sum::<f64>() / f64::from(STEPS)
}

/// The speed of motor 1 from which the voltage limits its operating point, in r/min: the drive reports a limit, which may be the
/// current's, and most of the voltage is used.
fn weakening_from_rpm(rows: &[Row]) -> Option<f64> {
    const MOST_OF_IT: f64 = 0.9;
    let most_v = |row: &Row| row.capacitor_v / 12.0_f64.sqrt();
    let weakens = |row: &&Row| row.motors[0].weakening && row.motors[0].voltage_v > MOST_OF_IT * most_v(row);
    rows.iter().find(weakens).map(|row| row.motors[0].speed_rpm)
}

/// Energy that comes back while both motors brake, provided that motor 1 brakes to its lowest speed.
fn returned(figures: &mut Figures, rows: &[Row], of: &Measures) {
    let brakes = rows.iter().position(|row| row.motors[0].torque_ref_nm < -of.full_nm / 120.0);
    let stops = brakes.and_then(|first| {
        let low = |row: &Row| row.motors[0].speed_rpm <= of.low_rpm + 0.02 * of.low_rpm;
        rows[first..].iter().position(low).map(|k| first + k)
    });
    let (Some(first), Some(last)) = (brakes, stops) else { return };
    let kinetic_j = |row: &Row| -> f64 {
        row.kinetic_speed_rpm.iter().map(|rpm| 0.5 * of.inertia_kg_m2 * rad_s(*rpm).powi(2)).sum()
    };
    let start = first.saturating_sub(1);
    let (had_j, left_j) = (kinetic_j(&rows[start]), kinetic_j(&rows[last]));
    let returned_j = rows[start].source_j - rows[last].source_j;
    figures.set("braked_s", rows[last].t_s - rows[start].t_s);
    figures.set("kinetic_energy_kj", (had_j - left_j) * 1e-3);
    figures.set("returned_to_source_kj", returned_j * 1e-3);
    let returned_percent = returned_j / (had_j - left_j) * 100.0;
    figures.set("returned_percent", returned_percent);
    figures.set("not_returned_percent", 100.0 - returned_percent);
}

/// Torque and current of motor 1 while it cruises with a torque in N·m, except while that torque builds up and falls.
fn cruise(figures: &mut Figures, rows: &[Row], cruise_nm: f64) {
    let cruises = |row: &Row| (row.motors[0].load_nm / cruise_nm - 1.0).abs() < 1e-9;
    let first = rows.iter().find(|row| cruises(row)).map(|row| row.t_s + SETTLING_S);
    let last = rows.iter().rfind(|row| cruises(row)).map(|row| row.t_s - SETTLING_S);
    let steady: Vec<_> = match (first, last) {
        (Some(first), Some(last)) => rows.iter().filter(|row| (first..last).contains(&row.t_s)).collect(),
        _ => Vec::new(),
    };
    if steady.is_empty() {
        return;
    }
    let mean =
        |value: fn(&Row) -> f64| steady.iter().map(|row| value(row)).sum::<f64>() / steady.len() as f64;
    let torque_nm = mean(|row| row.motors[0].torque_nm);
    figures.set("cruise_torque_error_percent", (torque_nm / cruise_nm - 1.0).abs() * 100.0);
    figures.set("cruise_current_a", mean(|row| row.motors[0].id_a.hypot(row.motors[0].iq_a)));
}

/// Energy over all rows that remains unexplained, in percent of the energy that passed through the source in either direction.
fn residual_percent(rows: &[Row]) -> f64 {
    let through_j: f64 = rows.windows(2).map(|pair| (pair[1].source_j - pair[0].source_j).abs()).sum();
    match (rows.first(), rows.last()) {
        (Some(first), Some(last)) => {
            let taken_j = last.source_j - first.source_j;
            let explained_j = last.explained_j - first.explained_j;
            (taken_j - explained_j).abs() / through_j * 100.0
        }
        _ => 0.0,
    }
}

fn cruise_s(text: &str) -> Result<f64, String> {
    let allowed = format!("a number from {LEAST_CRUISE_S} to 3600: a shorter cruise does not settle");
    number(text, &allowed, |seconds| (LEAST_CRUISE_S..=3600.0).contains(&seconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::zs9::trace::MotorRow;
    use tractive::nine_switch::Scheme;

    fn row(speed_rpm: f64, voltage_v: f64) -> Row {
        let motor = MotorRow {
            speed_rpm,
            torque_ref_nm: 0.0,
            torque_nm: 0.0,
            id_a: 0.0,
            iq_a: 0.0,
            phases_a: [0.0; 3],
            load_nm: 0.0,
            voltage_v,
            weakening: true,
        };
        Row {
            t_s: 0.0,
            motors: [motor; 2],
            link_v: 667.0,
            capacitor_v: 533.5,
            inductor_a: 0.0,
            source_v: 400.0,
            line_a: None,
            duty: 0.2,
            scheme: Scheme::Rthd,
            trip: None,
            source_j: 0.0,
            kinetic_speed_rpm: [speed_rpm; 2],
            explained_j: 0.0,
        }
    }

    /// At most 154 V are available.
    #[test]
    fn a_limit_at_low_voltage_is_the_currents_and_no_weakening() {
        let rows = [row(100.0, 20.0), row(800.0, 130.0), row(900.0, 149.0)];
        assert_eq!(weakening_from_rpm(&rows), Some(900.0));
        assert_eq!(weakening_from_rpm(&rows[..2]), None);
    }

    #[test]
    fn the_papers_machine_has_the_papers_cycle() {
        let of = Measures::of(&Machine::load(Zs9::MACHINE).unwrap());
        assert_eq!([of.low_rpm, of.high_rpm, of.corner_rpm], [10.0, 1_300.0, 850.0]);
        assert_eq!([of.full_nm, of.cruise_nm, of.moving_load_nm], [120.0, 60.0, 20.0]);
        assert_eq!([of.inertia_kg_m2, of.stopping_rpm, of.moving_s], [6.0, 2.9, 16.5]);
    }
}
