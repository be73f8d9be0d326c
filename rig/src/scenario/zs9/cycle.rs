//! The whole traction cycle under torque control: the paper's figures 24 to 36.

use super::prelude::*;
use crate::options::number;
use crate::plant::zs9::ZNetwork;
use crate::scenario::drive;
use clap::ValueEnum;

/// 10 to 1,300 r/min at full torque, a cruise there, and back.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Cycle {
    /// Time for which it cruises, in s, up to 3600.
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
    /// Later, the other way round, to half the speed with half the torque; it brakes while motor 1 cruises
    Other,
    /// No torque
    Rests,
}

/// A motor's cycle, as shares of the paper's.
struct Course {
    /// It begins so much later, in s.
    from_s: f64,
    /// Direction and torque, with which its loads go; 0: it does nothing.
    share: f64,
    /// Speed up to which it goes, in r/min, and the time for which it cruises, in s.
    high_rpm: f64,
    cruise_s: f64,
}

impl Second {
    /// Motor 2's cycle beside a motor 1 that cruises for so long, in s.
    fn course(self, cruise_s: f64) -> Course {
        match self {
            Self::Same => Course { from_s: 0.0, share: 1.0, high_rpm: HIGH_RPM, cruise_s },
            Self::Other => {
                Course { from_s: 2.5, share: -0.5, high_rpm: 0.5 * HIGH_RPM, cruise_s: 0.3 * cruise_s }
            }
            Self::Rests => Course { from_s: 0.0, share: 0.0, high_rpm: HIGH_RPM, cruise_s },
        }
    }
}

const LOW_RPM: f64 = 10.0;
const HIGH_RPM: f64 = 1300.0;
const FULL_NM: f64 = 120.0;
/// Above it power is constant.
const CORNER_RPM: f64 = 850.0;
const CRUISE_NM: f64 = 60.0;
const MOVING_LOAD_NM: f64 = 20.0;
const INERTIA_KG_M2: f64 = 6.0;
const LEAD_S: f64 = 0.2;
const STEP_S: f64 = 1e-3;
/// From the cruise's beginning, and before its end, in s: there torque and weakening still move.
const SETTLING_S: f64 = 0.3;
/// Without the cruise.
const MOVING_S: f64 = 16.5;

/// The torque needs time to go, in which the speed still falls: half of `T/slew · T/J`, here with 4,000 N·m/s.
const STOPPING_RPM: f64 = 2.9;

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

/// Full torque, or full power, at a speed.
fn full_nm(rpm: f64) -> f64 {
    FULL_NM * (CORNER_RPM / rpm.abs().max(CORNER_RPM))
}

/// Torque and load of a motor at a speed in r/min.
fn orders(phase: &mut Phase, t_s: f64, rpm: f64, course: &Course) -> (f64, f64) {
    let rpm = if course.share < 0.0 { -rpm } else { rpm };
    *phase = match *phase {
        Phase::Before if t_s >= course.from_s - 1e-9 => Phase::Accelerates,
        Phase::Accelerates if rpm >= course.high_rpm => Phase::Cruises(t_s + course.cruise_s),
        Phase::Cruises(until_s) if t_s >= until_s => Phase::Brakes,
        Phase::Brakes if rpm <= LOW_RPM + STOPPING_RPM => Phase::Done,
        same => same,
    };
    let (torque_nm, load_nm) = match phase {
        Phase::Before | Phase::Done => (0.0, 0.0),
        Phase::Accelerates => (full_nm(rpm), MOVING_LOAD_NM),
        Phase::Cruises(_) => (CRUISE_NM, CRUISE_NM),
        Phase::Brakes => (-full_nm(rpm), MOVING_LOAD_NM),
    };
    (course.share * torque_nm, course.share * load_nm)
}

impl Scenario<Zs9> for Cycle {
    fn trace_step_s(&self, _own: &Zs9Options) -> f64 {
        STEP_S
    }

    fn plan(&self, _options: &Options, _machine: &Machine) -> Plan {
        let cruise_s = self.cruise;
        let courses = [Second::Same, self.second].map(|motor| motor.course(cruise_s));
        let from_rpm = [LOW_RPM, LOW_RPM * if self.second == Second::Other { -1.0 } else { 1.0 }];
        let mut phases = [Phase::Before; 2];
        let operator = move |t_s: f64, speeds: SeenMotors| {
            let [one, two] = [0, 1].map(|k| orders(&mut phases[k], t_s, speeds[k], &courses[k]));
            let torque = |torque_nm: f64| {
                MotorDemand::Torque(Demand { torque_nm: torque_nm as f32, slew_limited: true })
            };
            Orders { demands: [torque(one.0), torque(two.0)], loads_nm: [one.1, two.1], enable: true }
        };
        let times_s = (LEAD_S, MOVING_S + cruise_s);
        Plan {
            edges: self.edges,
            judged_step_s: Some(STEP_S),
            ..Plan::driven(times_s, free(INERTIA_KG_M2), from_rpm, operator)
        }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = figures::common(recording);
        let rows = &recording.rows;
        let reached = rows.iter().position(|row| row.motors[0].speed_rpm >= HIGH_RPM - 0.5);
        figures.set("accelerated_s", reached.map(|k| rows[k].t_s));
        let weakening = rows.iter().find(|row| row.motors[0].weakening);
        figures.set("weakening_from_rpm", weakening.map(|row| row.motors[0].speed_rpm));
        let brakes = rows.iter().position(|row| row.motors[0].torque_ref_nm < -1.0);
        let stops = brakes.and_then(|first| {
            let low = |row: &Row| row.motors[0].speed_rpm <= LOW_RPM + 0.2;
            rows[first..].iter().position(low).map(|k| first + k)
        });
        if let (Some(first), Some(last)) = (brakes, stops) {
            let kinetic_j = |row: &Row| -> f64 {
                row.kinetic_speed_rpm.iter().map(|rpm| 0.5 * INERTIA_KG_M2 * rad_s(*rpm).powi(2)).sum()
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
        cruise(&mut figures, rows);
        figures.set("end_speed_rpm", rows.last().map(|row| row.motors[0].speed_rpm));
        figures::link(&mut figures, rows, options.own.uin);
        let source_v = super::SOURCE_V;
        let wanted_v = 0.5 * (options.own.uin + options.udc.unwrap_or(source_v));
        let highest_v = figures::largest(rows, |row| row.capacitor_v);
        figures.set("capacitor_overshoot_percent", (highest_v / wanted_v - 1.0) * 100.0);
        figures.set("power_residual_percent", residual_percent(rows));
        figures.set("network_stored_j", ZNetwork::ZS9.capacitance_f * wanted_v * wanted_v);
        if self.second == Second::Other {
            self.independence(&mut figures, recording, options, machine);
        }
        let both = if self.second == Second::Same { 25.0 } else { f64::INFINITY };
        let apart = [
            ("motor 1's torque off that beside a resting motor 2 in N·m", "motor1_torque_apart_nm", 0.02),
            ("motor 1's speed off that in r/min", "motor1_speed_apart_rpm", 0.02),
        ];
        let bounds = [
            ("10 to 1,300 r/min in s", "accelerated_s", 9.2),
            ("kinetic energy not returned in %", "not_returned_percent", both),
            ("capacitor voltage above its reference in %", "capacitor_overshoot_percent", 0.3),
            ("link voltage off in %", "link_deviation_percent", 0.5),
        ];
        let apart = if self.second == Second::Other { &apart[..] } else { &[] };
        figures.set("verdicts", judge(&figures, options, &[&bounds[..], apart].concat()));
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        // In the paper both motors go through the same cycle.
        if self.second != Second::Same {
            page.answers_none();
        }
        let rows = figures::window(recording, 0.0, recording.rows.last().map_or(MOVING_S, |row| row.t_s));
        plot(page, ("figures 24 to 35", "link voltage U_in", "V"), rows, &VOLTAGES[..1]);
        plot(page, ("figures 24 to 35", "capacitor voltage", "V"), rows, &VOLTAGES[1..]);
        plot(page, ("figures 24 to 35", "inductor current", "A"), rows, &INDUCTOR);
        plot(page, ("figures 24 to 35", "torque", "N·m"), rows, &TORQUES);
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
    /// By how much motor 1 does something else than in the same run with a motor 2 that makes no torque.
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

/// Torque and current of motor 1 while it cruises in weakening, but for the time that its torque needs to get there and away.
fn cruise(figures: &mut Figures, rows: &[Row]) {
    let cruises = |row: &Row| row.motors[0].load_nm == CRUISE_NM;
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
    figures.set("cruise_torque_error_percent", (torque_nm / CRUISE_NM - 1.0).abs() * 100.0);
    figures.set("cruise_current_a", mean(|row| row.motors[0].id_a.hypot(row.motors[0].iq_a)));
}

/// Energy of all rows that is left unexplained, of the energy that went through the source either way, in percent.
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
    number(text, "a number above 0, at most 3600", |seconds| seconds > 0.0 && seconds <= 3600.0)
}
