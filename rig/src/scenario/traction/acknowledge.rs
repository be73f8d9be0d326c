//! A gate driver fails under torque: the fault, the commands refused meanwhile, the acknowledge, and the machine caught again.

use super::line::{self, within};
use super::prelude::*;
use super::scaled::{emf_v, of_rated_rpm};
use super::setup::udc_v;
use crate::bench::LinePlan;
use crate::steps::held;
use tractive::machine::Ratings;
use tractive::operator::Request;
use tractive::protection::Fault;

/// See the module.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Acknowledge {
    /// Speed, in r/min.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    speed: Option<f64>,
}

const SPEED_RPM: f64 = 1_500.0;
const FAULT: Fault = Fault::GateDriver;
const FAILS_S: (f64, f64) = (1.0, 1.5);
/// The time between fault and enable without pulses.
const DEAD_S: (f64, f64) = (1.05, 2.3);
const CHARGE: [(f64, f64); 3] = [(0.1, 0.2), (1.35, 1.38) /* fault_not_acknowledged */, (1.9, 2.0)];
const ENABLE: [(f64, f64); 3] = [(0.5, 1.25), (1.3, 1.33) /* fault_not_acknowledged */, (2.3, 3.0)];
const ACKNOWLEDGE: [(f64, f64); 3] =
    [(0.7, 0.75) /* no_fault */, (1.2, 1.25) /* cause_still_present */, (1.7, 1.75)];
const REFUSALS: [&str; 4] =
    ["no_fault", "cause_still_present", "fault_not_acknowledged", "fault_not_acknowledged"];
const STATES: &str = "self_test ready precharge charged enabled running fault \
    self_test ready precharge charged enabled running";
const TORQUE: [(f64, f64); 3] = [(0.6, 0.5), (1.1, 0.0), (2.4, 0.5)];
const DURATION_S: f64 = 3.0;

fn request(t_s: f64, ratings: &Ratings) -> Request {
    Request {
        enable: within(&ENABLE, t_s),
        charge: within(&CHARGE, t_s),
        acknowledge: within(&ACKNOWLEDGE, t_s),
        torque_nm: held(&TORQUE, t_s).unwrap_or(0.0) as f32 * ratings.max_torque_nm,
        ..Request::idle(ratings)
    }
}

/// Share of the link beyond which an EMF counts as near it; and times of standstill and speed, in s, with which such a rotor turns only from
/// enable on and until the acknowledge: while the gates are off, its current would count as an offset of the sensors.
const NEAR: f64 = 0.5;
const TURNS: [(f64, f64); 6] = [(0.52, 0.0), (0.91, 1.0), (1.25, 1.0), (1.64, 0.0), (2.32, 0.0), (2.71, 1.0)];

/// `true` if the safe state after the fault is a short circuit: gates that stay on.
fn is_shorted(recording: &Recording) -> bool {
    let mut on = [false; 6];
    for edge in recording.edges.iter().filter(|edge| recording.seconds(edge.tick) < DEAD_S.0) {
        on[usize::from(edge.gate)] = edge.on;
    }
    on.contains(&true)
}

impl Acknowledge {
    /// The rotor's speed over time, in r/min.
    fn speed(&self, options: &Options, machine: &Machine) -> Vec<(f64, f64)> {
        let speed_rpm = self.speed.unwrap_or(of_rated_rpm(SPEED_RPM, machine));
        if emf_v(speed_rpm, machine) <= NEAR * udc_v(options, machine) {
            return vec![(0.0, speed_rpm)];
        }
        TURNS.map(|(t_s, share)| (t_s, share * speed_rpm)).to_vec()
    }
}

impl Scenario<Traction> for Acknowledge {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let ratings = &machine.tables.ratings;
        let line = LinePlan {
            starts_charged: true,
            hardware: vec![(FAILS_S.0, FAILS_S.1, FAULT)],
            ..LinePlan::new(line::fed(options, machine), Box::new(|t_s| request(t_s, ratings)))
        };
        Plan::operated(DURATION_S, self.speed(options, machine), line)
    }

    fn figures(&self, recording: &Recording, _options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let states = line::states(recording);
        let others = states.iter().map(|entered| entered.state).ne(STATES.split(' '));
        let named = recording.trip().is_some_and(|trip| trip.fault == FAULT);
        // Current continues to flow through the diodes until the field is empty.
        let dead = analysis::window(recording, DEAD_S.0, DEAD_S.1);
        let (dead_what, dead_most) = if is_shorted(recording) {
            (
                "current between fault and enable (of the largest), not judged: the short circuit's",
                f64::INFINITY,
            )
        } else {
            ("current between fault and enable (of the largest)", 0.02)
        };
        let largest_a = machine.folder.parameters.max_current_a;
        let current = worst(dead.iter().map(|row| row.peak_current_a() / largest_a));
        let after = analysis::window(recording, 2.8, DURATION_S);
        let torque_nm = mean(after, |row| row.te_nm);
        let speed_rpm = mean(after, |row| row.speed_rpm);
        let wanted_nm = (0.5 * machine.folder.parameters.max_torque_nm).min(machine.envelope_nm(speed_rpm));
        let error = (torque_nm / wanted_nm - 1.0).abs();
        let mut verdicts = line::verdicts(recording, &REFUSALS);
        verdicts.extend([
            Verdict::never("states that are not the expected ones", others),
            Verdict::never("fault with another name", !named),
            Verdict::at_most(dead_what, current, dead_most),
            Verdict::at_most("mean torque off the demand at the end (share)", error, 0.01),
        ]);
        line::figures(&mut figures, recording);
        figures.set("verdicts", verdicts);
        figures
    }

    fn fault(&self) -> Option<Fault> {
        Some(FAULT)
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        line::plots(page, recording);
        let fails = (FAILS_S.0 - 0.02, FAILS_S.0 + 0.05);
        page.zoom("the gate driver fails", recording, fails);
        page.zoom("the machine is caught", recording, (2.28, 2.6));
    }
}
