//! Cases of the PMaSynRM drive.

mod allowed;
mod cases;
mod conditions;
mod drive_cycle;
mod faults;
pub mod random;
mod scale;
mod sensors;

pub use cases::Case;
pub use conditions::Conditions;
pub use drive_cycle::{CycleResult, DriveCycle};
pub use scale::Scale;

use super::Outcome;
use super::action::{FAULT_S, LEAD_S, Stages};
use super::outcome::{Seen, Setting};
use crate::ablation::Ablation;
use crate::bench::{self, Bench, Flaws, Limits, Simulated, Supply};
use crate::inject::Injection;
use crate::inject::traction::Kind;
use crate::machine::Machine;
use crate::options::usual_min_pulse_us;
use crate::plant::{Plant, PlantSettings, SpeedSource, Stator};
use crate::run::traction::Tasks;
use crate::run::{self, Interrupts};
use crate::scenario::System;
use crate::scenario::traction::{PatternsName, Traction, emf_v};
use crate::trace::Row;
use anyhow::Result;
use core::cell::Cell;
pub use faults::{Cause, faults};
use tractive::control::{ControlLaw, Demand, Region};
use tractive::drive::traction::Settings;
use tractive::machine::Tables;
use tractive::modulation::{Ladder, Mode, SwitchLimits};
use tractive::time::{Clock, Instant};

/// If the torque cannot step, full torque is reversed in 0.15 s; the aftermath covers several electrical turns and the link's oscillation.
const STAGES: Stages = Stages { torque_s: -0.09, turn_s: 0.1, end_s: 0.3, aftermath_s: 0.06 };
/// Time over which the torque is averaged, in s.
const MEAN_S: f64 = 0.04;
/// Step of a case's trace, in s.
const TRACE_STEP_S: f64 = 50e-6;
/// The acceleration of a rotor that is pushed from rest, in r/min per s of a machine of 6,000 r/min.
const PUSH_RPM_S: f64 = 2_000.0;
/// The acceleration of a rotor that runs away, likewise: twice what the 180 kW machine itself can do.
const RUNAWAY_RPM_S: f64 = 12_000.0;

/// The course of a run.
struct Way {
    /// The modes that it went through.
    modes: Vec<Mode>,
    /// The source of the current reference at the last control interrupt before the fault.
    region: Region,
}

/// The drive, with one protection off or none.
pub struct Drive {
    /// The machine that it drives.
    pub machine: Machine,
    scale: Scale,
    /// The largest short-circuit current of the machine if no current flowed before, in A.
    short_circuit_a: f64,
    clock: Clock,
    tables: &'static Tables,
    without: Option<Ablation>,
    ladder: Ladder,
    /// Highest frequency of the free carrier, as a share of the switches'.
    carrier_share: f32,
}

impl Drive {
    /// For the 180 kW machine.
    pub fn new(without: Option<Ablation>) -> Result<Self> {
        Self::of(Machine::load(Traction::MACHINE)?, without)
    }

    /// For any machine, with the control rate that its devices determine.
    ///
    /// # Errors
    /// A machine that the drive would refuse at start-up.
    pub fn of(machine: Machine, without: Option<Ablation>) -> Result<Self> {
        let tables = without.map_or(machine.tables, |without| without.tables(machine.tables));
        let clock = run::usual_clock(tables.ratings.max_switching_hz)?;
        let scale = Scale::of(&machine);
        let short_circuit_a =
            Stator::new(&machine.folder, &PlantSettings::default()).peak_on_flux_circle_a(0.0, 0.0);
        let (ladder, carrier_share) = (Ladder::PAPER, 1.0);
        let drive = Self { machine, scale, short_circuit_a, clock, tables, without, ladder, carrier_share };
        Settings::new(clock, drive.devices(0)).check(drive.machine.tables).map_err(run::refused)?;
        Ok(drive)
    }

    /// The highest speed at which a machine may coast if its short circuit begins with a current above the trip level, in r/min: above it, the EMF
    /// drives as much current through the diodes. `None` if the machine may coast at every speed.
    pub fn most_rpm(&self) -> Option<f64> {
        (self.short_circuit_a > self.machine.folder.parameters.trip_current_a).then(|| self.rectifying_rpm())
    }

    /// The speed above which the line-to-line EMF exceeds the nominal link, in r/min.
    pub(super) fn rectifying_rpm(&self) -> f64 {
        self.machine.folder.parameters.dc_link_nominal_v / emf_v(1.0, &self.machine)
    }

    /// The same with the modes of another ladder.
    pub fn on(self, ladder: Ladder) -> Self {
        Self { ladder, ..self }
    }

    /// The same with other pulse patterns.
    pub fn with(self, patterns: PatternsName) -> Self {
        Self { ladder: patterns.ladder(), carrier_share: patterns.free_carrier_share(), ..self }
    }

    /// Runs one case.
    pub fn run(&self, case: &Case) -> Result<Outcome> {
        match case.fault.cause {
            Cause::Sensor(place, wire) => self.run_sensor(case, place, wire),
            _ => Ok(self.run_watched(case)?.0),
        }
    }

    /// Runs one case that is not one of a temperature sensor; returns its course, too.
    fn run_watched(&self, case: &Case) -> Result<(Outcome, Way)> {
        let mut bench = self.bench(case);
        let devices = self.devices(case.conditions.dead_time_ticks);
        let tick_s = f64::from(self.clock.tick_s);
        let fault = Instant(((LEAD_S + case.at_s) / tick_s) as u32);
        let region = Cell::new(Region::Mtpa);
        let mut tasks = self.tasks(devices).doing(|law, now, _| {
            if fault.reached(now) {
                region.set(law.target().region);
            }
        });
        tasks.drive(&mut bench, |bench| {
            let safe_s = bench.observed.safe.map(|(at, _)| at as f64 * tick_s - LEAD_S);
            safe_s.is_none_or(|safe_s| bench.time_s() < safe_s + STAGES.aftermath_s)
        })?;
        let rows = bench.rows();
        let before = rows.iter().take_while(|row| row.t_s < case.at_s.max(FAULT_S));
        let observed = bench.observed;
        let seen = Seen {
            observed,
            trip: tasks.trip(),
            torque_error_nm: torque_error_nm(rows, STAGES.turn_s).max(torque_error_nm(rows, STAGES.end_s)),
            tick_s,
            carrier_s: match observed.carrier_ticks {
                0 => 2.0 * f64::from(devices.shortest_half_ticks) * tick_s,
                ticks => ticks as f64 * tick_s,
            },
        };
        let setting = Setting {
            system: "pmasynrm",
            mode: before.last().map_or(Mode::Off, |row| row.mode).name(),
            speed_rpm: case.point.speed_rpm,
            action: case.action,
        };
        let allowed = self.allowed(case, &seen, Last::of(rows));
        let mut modes: Vec<Mode> = rows.iter().map(|row| row.mode).collect();
        modes.dedup();
        Ok((Outcome::new(&setting, &case.fault, &seen, allowed), Way { modes, region: region.get() }))
    }

    fn devices(&self, dead_time_ticks: u32) -> SwitchLimits {
        let carrier_hz = self.carrier_share * self.tables.ratings.max_switching_hz;
        let min_pulse_s = 1e-6 * usual_min_pulse_us(self.machine.folder.parameters.max_switching_hz);
        let min_pulse_ticks = (min_pulse_s * f64::from(self.clock.ticks_per_s)).round() as u32;
        SwitchLimits::new(min_pulse_ticks, dead_time_ticks, carrier_hz, &self.clock)
    }

    fn tasks<'a>(&self, devices: SwitchLimits) -> Tasks<'a> {
        let settings = Settings::new(self.clock, devices);
        Tasks::new(self.tables, settings, devices.shortest_half_ticks).on(self.ladder).without(self.without)
    }

    /// A sound bench.
    fn bench_settings(&self, duration_s: f64, trace_step_s: f64) -> bench::Settings {
        bench::Settings {
            clock: self.clock,
            first_half_ticks: self.devices(0).shortest_half_ticks,
            dead_time_ticks: 0,
            lead_s: LEAD_S,
            duration_s,
            trace_step_s,
            udc_v: self.machine.folder.parameters.dc_link_nominal_v,
            link_steps: Vec::new(),
            flaws: Flaws::default(),
            supply: Supply::Line(self.scale.filter()),
            injection: Some(Injection { kind: Kind::Elsewhere, at_s: -LEAD_S }),
            limits: Limits::NONE,
        }
    }

    fn bench(&self, case: &Case) -> Bench {
        let parameters = &self.machine.folder.parameters;
        let Case { point, action, at_s, conditions, .. } = *case;
        let full_nm = (point.share * self.machine.envelope_nm(point.speed_rpm)).copysign(point.speed_rpm);
        let operator = move |t_s: f64| {
            let torque_nm = action.share(&STAGES, t_s) * full_nm;
            (Demand { torque_nm: torque_nm as f32, slew_limited: false }, true)
        };
        let steady = || {
            let rpm_s = conditions.acceleration_rpm_s;
            let at = |t_s: f64| (LEAD_S + t_s, point.speed_rpm + rpm_s * (t_s - at_s));
            if rpm_s == 0.0 { vec![(0.0, point.speed_rpm)] } else { vec![at(-LEAD_S), at(STAGES.end_s)] }
        };
        let faster = |rpm_s: f64| {
            let end_rpm = point.speed_rpm + rpm_s * (STAGES.end_s - at_s);
            vec![(LEAD_S + at_s, point.speed_rpm), (LEAD_S + STAGES.end_s, end_rpm)]
        };
        let (kind, speed) = match case.fault.cause {
            Cause::Bench(kind) if case.fault.needs_rest() => (kind, faster(PUSH_RPM_S * self.scale.speed)),
            Cause::Bench(kind) => (kind, steady()),
            Cause::Runaway => (Kind::Elsewhere, faster(RUNAWAY_RPM_S * self.scale.speed)),
            Cause::Machine(..) | Cause::Sensor(..) => (Kind::Elsewhere, steady()),
        };
        let settings = bench::Settings {
            injection: Some(Injection { kind, at_s }),
            limits: Limits {
                // In terms of what the sensors read.
                current_a: parameters.trip_current_a / (1.0 + conditions.flaws.current_gain),
                udc_v: (
                    parameters.trip_dc_under_v / (1.0 + conditions.flaws.udc_gain),
                    parameters.trip_dc_over_v / (1.0 + conditions.flaws.udc_gain),
                ),
                speed_rpm: parameters.trip_speed_rpm,
                sampling_ticks: u64::from(self.clock.control_ticks),
                ..Limits::NONE
            },
            dead_time_ticks: conditions.dead_time_ticks,
            first_half_ticks: self.devices(conditions.dead_time_ticks).shortest_half_ticks,
            flaws: conditions.flaws,
            supply: Supply::Line(conditions.filter),
            ..self.bench_settings(STAGES.end_s, TRACE_STEP_S)
        };
        let settings = bench::Settings { udc_v: conditions.line_v.unwrap_or(settings.udc_v), ..settings };
        let plant = Plant::new(&self.machine.folder, SpeedSource::profile(speed), &case.machine());
        Bench::new(plant, Box::new(operator), &settings)
    }
}

/// Mean torque less demand before an instant, in N·m.
fn torque_error_nm(rows: &[Row], before_s: f64) -> f64 {
    let window = rows.iter().filter(|row| row.t_s < before_s && row.t_s > before_s - MEAN_S);
    let (count, sum) =
        window.fold((0.0_f64, 0.0), |(count, sum), row| (count + 1.0, sum + row.te_nm - row.te_ref_nm));
    (sum / count.max(1.0)).abs()
}

/// Means over the last half of the aftermath.
#[derive(Clone, Copy, Debug)]
struct Last {
    /// Torque, in N·m.
    torque_nm: f64,
    /// Speed, in r/min.
    speed_rpm: f64,
}

impl Last {
    fn of(rows: &[Row]) -> Self {
        let end_s = rows.last().map_or(0.0, |row| row.t_s);
        let window = || rows.iter().filter(|row| row.t_s > end_s - 0.5 * STAGES.aftermath_s);
        let mean = |of: fn(&Row) -> f64| window().map(of).sum::<f64>() / (window().count() as f64).max(1.0);
        Self { torque_nm: mean(|row| row.te_nm), speed_rpm: mean(|row| row.speed_rpm) }
    }
}
