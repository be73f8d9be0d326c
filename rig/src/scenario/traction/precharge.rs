//! From power-up to running and back to an empty link, by command; some commands on the way are refused.

use super::line::{self, within};
use super::prelude::*;
use super::scaled::{emf_v, of_rated_rpm};
use super::setup::udc_v;
use crate::bench::LinePlan;
use crate::plant::profile_speed;
use crate::steps::held;
use core::f64::consts::TAU;
use tractive::machine::Ratings;
use tractive::operator::{Line, Request, State};

/// Power-up, self-test, precharge, main contactor, enable, run, coast, catch, stop, discharge.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Precharge;

const DURATION_S: f64 = 7.0;
/// Times during which each command is set; refusals are noted beside them.
const ENABLE: [(f64, f64); 4] = [
    (0.1, 0.15), /* link_not_charged */
    (0.5, 0.55), /* again */
    (1.8, 1.85), /* torque_not_zero */
    (2.0, 4.0),
];
const CHARGE: [(f64, f64); 2] = [(0.2, 0.3), (2.3, 2.4) /* already_charged */];
const DISCHARGE: [(f64, f64); 3] =
    [(2.5, 2.6) /* not_stopped */, (4.05, 4.1) /* machine_turning */, (4.6, 4.7)];
const COAST: (f64, f64) = (3.0, 3.25);
const REFUSALS: [&str; 6] = [
    "link_not_charged",
    "link_not_charged",
    "torque_not_zero",
    "already_charged",
    "not_stopped",
    "machine_turning",
];
/// The last refusal on a machine whose EMF leaves the link empty: the first command already discharges its link, the second is refused.
const LAST_OF_WEAK: &str = "discharging";
/// Share of the largest torque that is demanded from these times on.
const TORQUE: [(f64, f64); 4] = [(1.75, 0.01), (1.9, 0.0), (2.1, 0.65), (3.6, 0.0)];
const SPEED: [(f64, f64); 5] = [(2.1, 0.0), (3.0, 600.0), (3.6, 600.0), (4.4, 0.0), (DURATION_S, 0.0)];

fn request(t_s: f64, ratings: &Ratings) -> Request {
    Request {
        enable: within(&ENABLE, t_s),
        charge: within(&CHARGE, t_s),
        discharge: within(&DISCHARGE, t_s),
        coast: within(&[COAST], t_s),
        torque_nm: held(&TORQUE, t_s).unwrap_or(0.0) as f32 * ratings.max_torque_nm,
        ..Request::idle(ratings)
    }
}

/// The speeds of this machine.
fn speed(machine: &Machine) -> Vec<(f64, f64)> {
    SPEED.iter().map(|(t_s, rpm)| (*t_s, of_rated_rpm(*rpm, machine))).collect()
}

/// Link voltage below which it counts as empty, in V.
fn empty_v(machine: &Machine) -> f64 {
    Line::rated(&machine.tables.ratings, 0.0, 0.0).empty_v.into()
}

/// The refusals of this machine.
fn refusals(machine: &Machine) -> [&'static str; 6] {
    let (at_s, _) = DISCHARGE[1];
    let turning = emf_v(profile_speed(&speed(machine), at_s) * 60.0 / TAU, machine) > empty_v(machine);
    let mut refusals = REFUSALS;
    if !turning {
        refusals[REFUSALS.len() - 1] = LAST_OF_WEAK;
    }
    refusals
}

impl Scenario<Traction> for Precharge {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let ratings = &machine.tables.ratings;
        let line = LinePlan::new(line::fed(options, machine), Box::new(|t_s| request(t_s, ratings)));
        Plan::operated(DURATION_S, speed(machine), line)
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let closes_s = recording.slots.iter().find(|slot| slot.status.switches.main).map(|slot| slot.t_s);
        let source_v = udc_v(options, machine);
        let gap_v = closes_s.map_or(f64::NAN, |closes_s| {
            let at = recording.rows.partition_point(|row| row.t_s < closes_s);
            source_v - recording.rows.get(at).map_or(0.0, |row| row.udc_v)
        });
        let ends_v = recording.rows.last().map_or(f64::NAN, |row| row.udc_v);
        let ends = recording.slots.last().is_some_and(|slot| slot.status.state == State::Ready);
        let torque = analysis::window(recording, 2.6, 2.9);
        let torque_nm = mean(torque, |row| row.te_nm);
        let error = (torque_nm / (0.65 * machine.folder.parameters.max_torque_nm) - 1.0).abs();
        let mut verdicts = line::verdicts(recording, &refusals(machine));
        verdicts.extend([
            Verdict::at_most(
                "source over link when the main contactor closes (share)",
                gap_v / source_v,
                0.025,
            ),
            Verdict::at_most("link at the end, V", ends_v, empty_v(machine)),
            Verdict::never("not ready at the end", !ends),
            Verdict::at_most("mean torque off the demand while running (share)", error, 0.01),
        ]);
        line::figures(&mut figures, recording);
        figures.set("verdicts", verdicts);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        line::plots(page, recording);
        page.zoom("coasting and catching", recording, (COAST.0, COAST.1 + 0.3));
    }
}
