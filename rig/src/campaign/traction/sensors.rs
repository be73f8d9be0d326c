//! Cases of the temperature sensors: the operator reads these sensors, so only these cases run with an operator.

use super::cases::Case;
use super::{Drive, Last, TRACE_STEP_S};
use crate::bench::{self, Bench, Limits, LinePlan, Observed, Simulated, Supply};
use crate::campaign::Outcome;
use crate::campaign::action::Action;
use crate::campaign::outcome::{Seen, Setting};
use crate::inject::Injection;
use crate::inject::traction::Kind;
use crate::plant::{DcLinkSettings, Heat, LineFilter, Plant, PlantSettings, Source, SpeedSource, Wire};
use crate::run::Interrupts;
use crate::trace::Recording;
use crate::warmth::{HEAT, THERMAL};
use anyhow::Result;
use tractive::control::Demand;
use tractive::modulation::Mode;
use tractive::operator::{Line, Request};
use tractive::protection::{SafeState, Trip};

/// Time before the recording, in s: the operator tests itself, charges, enables, and gives torque.
const LEAD_S: f64 = 0.6;
const CHARGE_S: f64 = -0.5;
const ENABLE_S: f64 = -0.3;
const TORQUE_S: f64 = -0.2;
/// Length of the recording, in s.
const END_S: f64 = 0.06;
/// Time for which a sensor must read wrong, in s, as the guide states.
const PERSISTENCE_S: f64 = 0.01;
/// Operator slots from a reading until the gates are off, in s: the one already begun, its own, and the one in which its order holds.
const SLOTS_S: f64 = 3e-3;

/// The longest time from a sensor's fault until the gates are off, in s; the planned pulses end first. If the machine goes on generating,
/// it is shorted an electrical turn later.
pub(super) fn longest_s(carrier_s: f64, safe: Option<SafeState>, turn_s: f64) -> f64 {
    let off_s = PERSISTENCE_S + SLOTS_S + carrier_s;
    if safe == Some(SafeState::ShortCircuit) { off_s + turn_s } else { off_s }
}

impl Drive {
    /// One case of a sensor's wire: of the winding (0) or of the heat sink (1).
    pub(super) fn run_sensor(&self, case: &Case, place: usize, wire: Wire) -> Result<Outcome> {
        let devices = self.devices(0);
        let ratings = &self.machine.tables.ratings;
        let DcLinkSettings { capacitance_f, precharge_ohm, discharge_ohm, .. } = self.sensor_link();
        let line = Line::rated(
            ratings,
            (precharge_ohm * capacitance_f) as f32,
            (discharge_ohm * capacitance_f) as f32,
        );
        let mut bench = self.sensor_bench(case, place, wire);
        let mut tasks = self.tasks(devices).operated_on(Some(line)).warmed_by(Some(&THERMAL));
        tasks.drive(&mut bench, |_| true)?;
        let before = bench.observed;
        let recording = bench.into_recording(Vec::new());
        let safe = tasks.trip().map_or(SafeState::GatesOff, |trip| trip.safe);
        let (trip, observed) = told(&recording, before, safe);
        let tick_s = recording.tick_s;
        let rows = &recording.rows;
        let mode = rows.iter().take_while(|row| row.t_s < case.at_s).last().map_or(Mode::Off, |row| row.mode);
        let carrier_s = match observed.carrier_ticks {
            0 => 2.0 * f64::from(devices.shortest_half_ticks) * tick_s,
            ticks => ticks as f64 * tick_s,
        };
        let seen = Seen { observed, trip, torque_error_nm: f64::NAN, tick_s, carrier_s };
        let (speed_rpm, action) = (case.point.speed_rpm, case.action);
        let setting = Setting { system: "pmasynrm", mode: mode.name(), speed_rpm, action };
        let allowed = self.allowed(case, &seen, Last::of(rows));
        Ok(Outcome::new(&setting, &case.fault, &seen, allowed))
    }

    fn sensor_bench(&self, case: &Case, place: usize, wire: Wire) -> Bench {
        let (point, action, ratings) = (case.point, case.action, &self.machine.tables.ratings);
        let full_nm = (point.share * self.machine.envelope_nm(point.speed_rpm)).copysign(point.speed_rpm);
        let commander = move |t_s: f64| Request {
            charge: (CHARGE_S..CHARGE_S + 0.1).contains(&t_s),
            enable: t_s >= ENABLE_S,
            torque_nm: if t_s >= TORQUE_S { (Action::sign(action) * full_nm) as f32 } else { 0.0 },
            ..Request::idle(ratings)
        };
        let mut wires = [Wire::Sound; 2];
        if let Some(of) = wires.get_mut(place) {
            *of = wire;
        }
        let heat = Heat::new(HEAT).wired(vec![(case.at_s, wires)]);
        let plan = LinePlan {
            starts_charged: true,
            heat: Some(heat),
            ..LinePlan::new(self.sensor_link(), Box::new(commander))
        };
        let settings = bench::Settings {
            lead_s: LEAD_S,
            injection: Some(Injection { kind: Kind::Elsewhere, at_s: case.at_s }),
            supply: Supply::Stiff,
            limits: Limits::NONE,
            ..self.bench_settings(END_S, TRACE_STEP_S)
        };
        let speed = SpeedSource::profile(vec![(0.0, point.speed_rpm)]);
        let plant = Plant::new(&self.machine.folder, speed, &PlantSettings::default());
        let nothing = |_: f64| (Demand::default(), true);
        Bench::new(plant, Box::new(nothing), &settings).with_line(Some(plan))
    }

    /// The campaign's line behind contactors.
    fn sensor_link(&self) -> DcLinkSettings {
        let LineFilter { inductance_h, resistance_ohm, capacitance_f } = self.scale.filter();
        let voltage_v = self.machine.folder.parameters.dc_link_nominal_v;
        DcLinkSettings {
            capacitance_f,
            source: Source { voltage_v, resistance_ohm, inductance_h, reversible: true, live: true },
            precharge_ohm: PRECHARGE_OHM * self.scale.impedance,
            discharge_ohm: DISCHARGE_OHM * self.scale.impedance,
            auxiliary_ohm: f64::INFINITY,
            chopper_ohm: CHOPPER_OHM * self.scale.impedance,
        }
    }
}

/// Resistors for precharge, discharge and braking of the 180 kW machine's link, in ohm.
const PRECHARGE_OHM: f64 = 50.0;
const DISCHARGE_OHM: f64 = 100.0;
const CHOPPER_OHM: f64 = 12.0;

/// The operator's fault with the safe state that the drive found itself, if any, and the observations from the last edge on: if nobody orders
/// a safe state, the pulses end.
fn told(recording: &Recording, before: Observed, safe: SafeState) -> (Option<Trip>, Observed) {
    let trip = recording.slots.iter().find_map(|slot| slot.status.trip).map(|trip| Trip { safe, ..trip });
    let last = recording.edges.iter().rfind(|edge| !edge.on).map(|edge| edge.tick);
    let still_on = recording.rows.last().is_none_or(|row| row.mode != Mode::Off);
    let mut observed = before;
    if let (Some(last), Some(_), false) = (last, trip, still_on) {
        observed.enters(last, safe, observed.stored);
    }
    (trip, observed)
}
