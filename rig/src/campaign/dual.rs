//! Cases of the ZS9.

use super::judge::{self, Bounded, CURRENT_SHARE, Rule};
use super::without::Without;
use super::{Action, Outcome};
use crate::bench::{Flaws, Limits, Observed, Tick};
use crate::machine::Machine;
use crate::plant::zs9::{NetworkState, ZNetwork, Zs9Plant, Zs9Settings};
use crate::plant::{PlantSettings, SpeedSource, profile_speed};
use crate::run::CLOCK;
use crate::sensor_faults::{AngleFault, CurrentFault};
use crate::steps::held;
use crate::zs9::bench::{Bench, BenchSettings, Course};
use crate::zs9::inject::{Injection, Kind};
use crate::zs9::run::Tasks;
use crate::zs9::scenario::{INERTIA_KG_M2, SOURCE_V};
use crate::zs9::trace::Row;
use crate::zs9::{Orders, SeenMotors, command, settings};
use anyhow::Result;
use core::f64::consts::TAU;
use tractive::board::MotorDemand;
use tractive::control::Demand;
use tractive::drive::dual::Settings;
use tractive::machine::Tables;
use tractive::nine_switch::{GATES, Scheme};
use tractive::protection::{Fault, Trip};
use tractive::time::Instant;

/// Speeds of the upper and the lower motor, in r/min.
#[derive(Clone, Copy, Debug)]
struct Point {
    speeds_rpm: [f64; 2],
    fast: bool,
}

const fn point(upper_rpm: f64, lower_rpm: f64, fast: bool) -> Point {
    Point { speeds_rpm: [upper_rpm, lower_rpm], fast }
}

const POINTS: [Point; 5] = [
    point(100.0, 100.0, false),
    point(700.0, 700.0, false),
    point(1000.0, 1000.0, true),
    point(1000.0, -600.0, false),
    point(1300.0, 1300.0, true),
];

/// Schemes of the fast campaign, one after the other; the full one has every scheme.
const SCHEMES: [Scheme; 4] = [Scheme::S, Scheme::Rs, Scheme::Rthd, Scheme::Zvo];

const LINK_V: f64 = 667.0;
const CARRIER_HZ: u32 = 10_000;
/// Share of the torque envelope that is asked for.
const SHARE: f64 = 0.6;
const FAULT_S: f64 = 0.005_037;
const LATER_S: f64 = 0.000_173;
const LATER_STEPS: usize = 23;
/// When another torque is wanted, in s.
const TURN_S: f64 = 0.07;
const END_S: f64 = 0.16;
const LEAD_S: f64 = 0.12;
const TORQUE_S: f64 = -0.08;
/// How long the aftermath is watched, in s: twelve periods of the network's oscillation.
const AFTERMATH_S: f64 = 0.04;
const MEAN_S: f64 = 0.03;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Cause {
    Bench(Kind),
    /// True flux linkage over the map's.
    Flux(f64),
    /// The rotor of motor 0 or 1 runs away.
    Runaway(usize),
}

#[derive(Clone, Debug)]
struct Named {
    name: String,
    cause: Cause,
    rule: Rule,
    fast: bool,
}

/// One run.
#[derive(Clone, Debug)]
pub struct Case {
    fault: Named,
    point: Point,
    action: Action,
    scheme: Scheme,
    at_s: f64,
}

impl Case {
    /// What a filter searches.
    pub fn name(&self) -> String {
        let Self { fault, point, action, scheme, .. } = self;
        format!("zs9 {} {} {} {}", fault.name, point.speeds_rpm[0], scheme.name(), action.name())
    }
}

/// Mean torque error where a fault must not be felt, where a sensor bends the torque, and where the machine differs by a fifth from
/// its map; shares of the largest torque. At 1,000 r/min a fifth more flux needs more voltage than there is; the torque is then what is
/// left.
const UNFELT: f64 = 0.03;
const BENT: f64 = 0.1;
const ANOTHER_MACHINE: f64 = 0.45;

fn faults() -> Vec<Named> {
    let mut list = Vec::new();
    let mut add =
        |name: &str, cause: Cause, names: &'static [Fault], torque_share: Option<f64>, fast: bool| {
            list.push(Named { name: name.to_owned(), cause, rule: Rule { names, torque_share }, fast });
        };
    add("none", Cause::Bench(Kind::Elsewhere), &[], Some(UNFELT), true);
    const SUM: &[Fault] = &[Fault::PhaseSum];
    const TOO_MUCH: &[Fault] = &[Fault::PhaseSum, Fault::Overcurrent];
    const LOST: [&[Fault]; 2] = [&[Fault::SensorLost1], &[Fault::SensorLost2]];
    for (motor, lost) in LOST.into_iter().enumerate() {
        for phase in 0..3 {
            let letter = ["u", "v", "w"][phase];
            let mut sensor = |what: &str, fault, names, share, fast| {
                let cause = Cause::Bench(Kind::Current(motor, phase, fault));
                let fast = fast && motor == phase;
                add(&format!("current-{letter}{}-{what}", motor + 1), cause, names, share, fast);
            };
            sensor("stuck", CurrentFault::Stuck, SUM, Some(BENT), true);
            sensor("open", CurrentFault::Open, SUM, Some(BENT), true);
            sensor("offset", CurrentFault::Offset(25.0), SUM, None, true);
            sensor("scaled", CurrentFault::Scaled(1.6), TOO_MUCH, Some(BENT), true);
            sensor("noisy", CurrentFault::Noisy(12.0), SUM, None, true);
            sensor("railed", CurrentFault::Railed(-RANGE_A), &[Fault::Overcurrent], None, true);
        }
        let angle = |fault| Cause::Bench(Kind::Angle(motor, fault));
        let number = motor + 1;
        let mut sensor = |what: &str, fault, names, share| {
            add(&format!("angle-{number}-{what}"), angle(fault), names, share, true);
        };
        sensor("frozen", AngleFault::Frozen, lost, None);
        sensor("jump", AngleFault::Jump(90.0), lost, None);
        sensor("glitches", AngleFault::Glitches(60.0, 50), lost, None);
        sensor("reversed", AngleFault::Reversed, lost, None);
        sensor("late", AngleFault::Late(10), lost, Some(BENT));
    }
    add("angle-1-lost", Cause::Bench(Kind::SensorLost1), LOST[0], None, true);
    add("angle-2-lost", Cause::Bench(Kind::SensorLost2), LOST[1], None, true);
    add("current-v2-not-finite", Cause::Bench(Kind::NotFinite), &[Fault::NotFinite], None, true);
    let small = |fault| Cause::Bench(Kind::Current(1, 1, fault));
    add("current-v2-offset-2A", small(CurrentFault::Offset(2.0)), &[], Some(BENT), true);
    add("current-v2-noisy-0.5A", small(CurrentFault::Noisy(0.5)), &[], Some(UNFELT), true);
    const SOURCE: &[Fault] = &[Fault::SourceUndervoltage];
    add("source-low", Cause::Bench(Kind::SourceLow), SOURCE, None, true);
    const HIGH: &[Fault] = &[Fault::CapacitorOvervoltage, Fault::DutyRange];
    add("source-high", Cause::Bench(Kind::SourceHigh), HIGH, None, true);
    const CUT: &[Fault] = &[Fault::SourceUndervoltage, Fault::CapacitorOvervoltage, Fault::DutyRange];
    // Where a motor gives what the other losses take, nothing changes.
    add("source-lost", Cause::Bench(Kind::SourceLost), CUT, Some(UNFELT), true);
    add("source-shorted", Cause::Bench(Kind::SourceShort), SOURCE, None, true);
    add("source-swings", Cause::Bench(Kind::SourceSwings(30.0, 50.0)), HIGH, Some(UNFELT), true);
    add("source-switch-open", Cause::Bench(Kind::SourceSwitchOpen), HIGH, Some(UNFELT), true);
    add("capacitors-halved", Cause::Bench(Kind::CapacitorsHalved), HIGH, Some(UNFELT), true);
    add("link-out-of-range", Cause::Bench(Kind::LinkOutOfRange), &[Fault::DutyRange], None, true);
    const STUCK: &[Fault] = &[Fault::LegStuck];
    for (gate, name) in (0_u8..).zip(GATES) {
        let name = name.to_lowercase();
        let fast = usize::from(gate).is_multiple_of(4);
        add(&format!("{name}-stuck-on"), Cause::Bench(Kind::Gate(gate, true)), STUCK, None, fast);
        add(&format!("{name}-stuck-off"), Cause::Bench(Kind::Gate(gate, false)), STUCK, None, fast);
    }
    for (leg, letter) in (0_u8..).zip(["u", "v", "w"]) {
        let cause = Cause::Bench(Kind::ShootThrough(leg));
        add(&format!("shoot-through-{letter}"), cause, STUCK, None, leg == 1);
    }
    add("leg-v-feedback", Cause::Bench(Kind::LegStuckOn), STUCK, None, true);
    add("leg-w-feedback", Cause::Bench(Kind::LegStuckOff), STUCK, None, true);
    let late = Cause::Bench(Kind::ControlLate(100));
    add("control-late", late, &[Fault::ControlDeadline], None, true);
    add("commands-lost", Cause::Bench(Kind::ControlStopped), &[Fault::StaleCommand], None, true);
    add("demand-not-finite", Cause::Bench(Kind::DemandNotFinite), &[Fault::NotFinite], None, true);
    for motor in [0, 1] {
        let name = format!("overspeed-{}", motor + 1);
        add(&name, Cause::Runaway(motor), &[Fault::Overspeed], None, true);
    }
    const CURRENT: &[Fault] = &[Fault::Overcurrent];
    add("flux-20%-more", Cause::Flux(1.2), CURRENT, Some(ANOTHER_MACHINE), true);
    add("flux-20%-less", Cause::Flux(0.8), CURRENT, Some(ANOTHER_MACHINE), true);
    list
}

/// Range of the current converters, in A: a quarter above the trip level.
const RANGE_A: f64 = 138.1;

/// Every case; of the fast ones each fault of each kind.
pub fn cases(fast: bool) -> Vec<Case> {
    let mut list = Vec::new();
    for fault in faults() {
        for point in POINTS {
            for action in Action::ALL {
                let count = list.len();
                if (matches!(fault.cause, Cause::Runaway(_)) && point.speeds_rpm[0] < RUNAWAY_FROM_RPM)
                    || (fast && !(fault.fast && point.fast))
                {
                    continue;
                }
                let schemes = if fast { &SCHEMES[count % SCHEMES.len()..][..1] } else { &Scheme::ALL[..] };
                for (number, scheme) in (count..).zip(schemes) {
                    let at_s = match fault.cause {
                        Cause::Flux(_) => -LEAD_S,
                        _ => FAULT_S + LATER_S * (number % LATER_STEPS) as f64,
                    };
                    list.push(Case { fault: fault.clone(), point, action, scheme: *scheme, at_s });
                }
            }
        }
    }
    list
}

/// From where a rotor runs away, in r/min, and how fast it gets faster, in r/min per s.
const RUNAWAY_FROM_RPM: f64 = 1_200.0;
const RUNAWAY_RPM_S: f64 = 6_000.0;

/// What one motor does, times in s from the recording's beginning.
#[derive(Clone, Debug)]
pub enum Script {
    /// It follows torques, each from its time on (N·m, and whether the rate is limited), at a prescribed speed.
    Torque {
        /// In r/min, straight lines between.
        speed_rpm: Vec<(f64, f64)>,
        /// Demands.
        torque_nm: Vec<(f64, (f64, bool))>,
    },
    /// It follows a speed, its rotor free and loaded.
    Speed {
        /// Wanted, in r/min, straight lines between.
        wanted_rpm: Vec<(f64, f64)>,
        /// Against forward rotation, each from its time on.
        load_nm: Vec<(f64, f64)>,
    },
}

impl Script {
    /// The demand at a time, and the load in N·m.
    fn order(&self, t_s: f64) -> (MotorDemand, f64) {
        match self {
            Self::Torque { torque_nm, .. } => {
                let (torque_nm, slew_limited) = held(torque_nm, t_s).unwrap_or((0.0, true));
                (MotorDemand::Torque(Demand { torque_nm: torque_nm as f32, slew_limited }), 0.0)
            }
            Self::Speed { wanted_rpm, load_nm } => {
                let wanted_rad_s = profile_speed(wanted_rpm, t_s);
                (MotorDemand::Speed(wanted_rad_s as f32), held(load_nm, t_s).unwrap_or(0.0))
            }
        }
    }
}

/// A drive written down as what happens when.
#[derive(Clone, Debug)]
pub struct Ride {
    /// The upper motor, the lower one.
    pub motors: [Script; 2],
    /// Source and schemes.
    pub course: Course,
    /// Length, in s.
    pub duration_s: f64,
}

/// What a ride left.
pub struct Ridden {
    /// The trace.
    pub rows: Vec<Row>,
    /// What was seen.
    pub observed: Observed,
    /// The latched fault.
    pub trip: Option<Trip>,
    /// When the ride ended, in s.
    pub ended_s: f64,
}

/// The drive, with one protection off or none.
pub struct Drive {
    machine: Machine,
    tables: &'static Tables,
    settings: Settings,
    without: Option<Without>,
}

struct Seen {
    observed: Observed,
    trip: Option<Trip>,
    torque_error_nm: f64,
}

impl Drive {
    /// For two of the ZS9's machines.
    ///
    /// # Errors
    /// Where their folder is not there.
    pub fn new(without: Option<Without>) -> Result<Self> {
        let machine = Machine::load(command::MACHINE)?;
        let mut settings = settings::drive(CLOCK, CARRIER_HZ);
        let mut tables = machine.tables;
        if let Some(without) = without {
            settings.limits = without.link_limits(settings.limits);
            tables = without.tables(tables);
        }
        Ok(Self { machine, tables, settings, without })
    }

    /// Runs one case.
    ///
    /// # Errors
    /// A drive that breaks the bench's rules.
    pub fn run(&self, case: &Case) -> Result<Outcome> {
        let mut bench = self.bench(case);
        let mut tasks = Tasks::new(self.tables, self.settings);
        if let Some(without) = self.without {
            tasks = tasks.without(without);
        }
        tasks.drive(&mut bench, |bench| {
            let safe_s = bench.observed().safe.map(|(at, _)| at as f64 * bench.step_s() - LEAD_S);
            safe_s.is_none_or(|safe_s| bench.time_s() < safe_s + AFTERMATH_S)
        })?;
        let rows = bench.rows();
        let seen = Seen {
            observed: *bench.observed(),
            trip: tasks.trip(),
            torque_error_nm: torque_error_nm(rows, TURN_S).max(torque_error_nm(rows, END_S)),
        };
        Ok(self.judged(case, &seen, bench.step_s()))
    }

    fn bench(&self, case: &Case) -> Bench {
        let parameters = &self.machine.folder.parameters;
        let Case { point, action, at_s, scheme, .. } = *case;
        let full_nm = point.speeds_rpm.map(|speed_rpm| {
            let omega = speed_rpm.abs() * TAU / 60.0;
            let envelope_nm = (parameters.max_power_w / omega.max(1.0)).min(parameters.max_torque_nm);
            (SHARE * envelope_nm).copysign(speed_rpm)
        });
        let turned = 0.5 * if action == Action::Motoring { -1.0 } else { 1.0 };
        let operator = move |t_s: f64, _: SeenMotors| {
            let share = match t_s {
                t_s if t_s < TORQUE_S => 0.0,
                t_s if t_s < TURN_S => action.sign(),
                _ => turned,
            };
            let demand = |full_nm: f64| Demand { torque_nm: (share * full_nm) as f32, slew_limited: true };
            Orders {
                demands: full_nm.map(|full_nm| MotorDemand::Torque(demand(full_nm))),
                loads_nm: [0.0; 2],
                enable: true,
            }
        };
        let (kind, flux_scale) = match case.fault.cause {
            Cause::Bench(kind) => (kind, 1.0),
            Cause::Flux(flux_scale) => (Kind::Elsewhere, flux_scale),
            Cause::Runaway(_) => (Kind::Elsewhere, 1.0),
        };
        let speeds = [0, 1].map(|motor| {
            let from_rpm = point.speeds_rpm[motor];
            let faster = (case.fault.cause == Cause::Runaway(motor))
                .then_some((LEAD_S + END_S, from_rpm + RUNAWAY_RPM_S * (END_S - at_s)));
            SpeedSource::profile([(LEAD_S + at_s, from_rpm)].into_iter().chain(faster).collect())
        });
        let motor = PlantSettings { flux_scale, ..PlantSettings::default() };
        let limits = settings::drive(CLOCK, CARRIER_HZ).limits;
        let bench = BenchSettings {
            scheme,
            injection: Some(Injection { kind, at_s }),
            limits: Limits {
                current_a: parameters.trip_current_a,
                uc_v: f64::from(limits.capacitor_max_v),
                source_v: f64::from(limits.source_min_v),
                speed_rpm: parameters.trip_speed_rpm,
                ..Limits::NONE
            },
            ..self.bench_settings(END_S, Flaws::default())
        };
        Bench::new(self.plant(speeds, motor), Box::new(operator), bench)
    }

    /// Both motors on a network that is charged.
    fn plant(&self, speeds: [SpeedSource; 2], motor: PlantSettings) -> Zs9Plant {
        let settings = Zs9Settings { source_v: SOURCE_V, motors: [motor; 2], ..Zs9Settings::default() };
        let mut plant = Zs9Plant::new([&self.machine.folder; 2], speeds, &settings);
        plant.set_network(NetworkState::even(0.0, 0.5 * (LINK_V + SOURCE_V)));
        plant
    }

    /// A sound bench.
    fn bench_settings(&self, duration_s: f64, flaws: Flaws) -> BenchSettings {
        BenchSettings {
            clock: CLOCK,
            carrier_ticks: settings::carrier_ticks(&CLOCK, CARRIER_HZ),
            lead_s: LEAD_S,
            duration_s,
            trace_step_s: f64::from(CARRIER_HZ).recip(),
            link_ref_v: LINK_V,
            scheme: SCHEMES[0],
            flaws,
            injection: Some(Injection { kind: Kind::Elsewhere, at_s: -LEAD_S }),
            limits: Limits::NONE,
            edges: false,
            dead_time_s: 0.0,
        }
    }

    /// Drives a script instead of a case; the timers start at a tick.
    ///
    /// # Errors
    /// A drive that breaks the bench's rules.
    pub fn ride(&self, ride: Ride, flaws: Flaws, trace_step_s: f64, origin: Tick) -> Result<Ridden> {
        let Ride { motors, course, duration_s } = ride;
        let later = |steps: &[(f64, f64)]| -> Vec<_> {
            steps.iter().map(|(t_s, rpm)| (t_s + LEAD_S, *rpm)).collect()
        };
        let speeds = motors.each_ref().map(|motor| match motor {
            Script::Torque { speed_rpm, .. } => SpeedSource::profile(later(speed_rpm)),
            Script::Speed { .. } => SpeedSource::Inertia { inertia_kg_m2: INERTIA_KG_M2, load_nm: 0.0 },
        });
        let operator = move |t_s: f64, _: SeenMotors| {
            let orders = motors.each_ref().map(|motor| motor.order(t_s));
            Orders {
                demands: orders.map(|(demand, _)| demand),
                loads_nm: orders.map(|(_, load_nm)| load_nm),
                enable: true,
            }
        };
        let settings = BenchSettings { trace_step_s, ..self.bench_settings(duration_s, flaws) };
        let bench = Bench::new(self.plant(speeds, PlantSettings::default()), Box::new(operator), settings);
        let mut bench = bench.following(course).beginning_at(origin);
        let mut tasks = Tasks::beginning_at(Instant(origin as u32), self.tables, self.settings);
        if let Some(without) = self.without {
            tasks = tasks.without(without);
        }
        // Once it has stopped there is nothing to see.
        tasks.drive(&mut bench, |bench| bench.observed().safe.is_none())?;
        Ok(Ridden {
            observed: *bench.observed(),
            trip: tasks.trip(),
            ended_s: bench.time_s(),
            rows: bench.rows().to_vec(),
        })
    }

    /// The machine's folder.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    fn judged(&self, case: &Case, seen: &Seen, step_s: f64) -> Outcome {
        let Seen { observed, trip, torque_error_nm } = seen;
        let parameters = &self.machine.folder.parameters;
        let time_s = observed.ticks_to_safe().map(|ticks| ticks as f64 * step_s);
        let carrier_s = f64::from(CARRIER_HZ).recip();
        let trip_a = parameters.trip_current_a;
        let current_limit_a = match case.fault.cause {
            // The diodes of a bridge on a shorted source short the motors, whatever the gates do.
            Cause::Bench(Kind::SourceShort) => {
                (CURRENT_SHARE * trip_a).max(FORCED * observed.stored.short_circuit_a)
            }
            _ => CURRENT_SHARE * trip_a,
        };
        let highest_v = f64::from(settings::drive(CLOCK, CARRIER_HZ).limits.capacitor_max_v);
        let uc_limit_v = forced_uc_v(observed).max(highest_v);
        // The source is what it is; the capacitors decide.
        let udc_limit_v = 2.0 * uc_limit_v;
        let stopped = [
            Bounded::new("ms until the gates are safe", time_s.map_or(f64::NAN, |time_s| time_s * 1e3), {
                self.longest_s(case, carrier_s) * 1e3
            }),
            Bounded::new("A until the gates are safe", observed.until.current_a, current_limit_a),
            Bounded::new("A with safe gates", observed.after.current_a, current_limit_a),
            Bounded::new(
                "V at a capacitor until the gates are safe",
                observed.until.uc_v,
                highest_v + RISE_V,
            ),
            Bounded::new("V at a capacitor with safe gates", observed.after.uc_v, uc_limit_v),
        ];
        let torque_share = case.fault.rule.torque_share.unwrap_or(0.0);
        let went_on = [
            Bounded::new("A", observed.until.current_a, trip_a),
            Bounded::new("V at a capacitor", observed.until.uc_v, highest_v),
            Bounded::new("N·m off", *torque_error_nm, torque_share * parameters.max_torque_nm),
        ];
        let named = trip.map(|trip| trip.fault);
        let (verdict, why) = judge::verdict(&case.fault.rule, named, &stopped, &went_on);
        Outcome {
            system: "zs9",
            fault: case.fault.name.clone(),
            mode: case.scheme.name().to_owned(),
            speed_rpm: case.point.speeds_rpm[0],
            action: case.action,
            verdict,
            named: named.map_or("", Fault::name).to_owned(),
            safe_state: if observed.safe.is_some() { "gates off" } else { "" }.to_owned(),
            carrier_periods: time_s.map(|time_s| time_s / carrier_s),
            time_ms: time_s.map(|time_s| time_s * 1e3),
            since_fault_ms: observed
                .safe
                .map(|(safe, _)| (safe as f64 - observed.from as f64) * step_s * 1e3),
            current_until_a: observed.until.current_a,
            current_after_a: observed.after.current_a,
            current_limit_a,
            udc_until_v: observed.until.udc_v,
            udc_after_v: observed.after.udc_v,
            udc_limit_v,
            uc_until_v: Some(observed.until.uc_v),
            uc_after_v: Some(observed.after.uc_v),
            uc_limit_v: Some(uc_limit_v),
            torque_error_nm: *torque_error_nm,
            why,
        }
    }

    /// The longest time from a fault's first effect until the gates are safe, in s: three carriers, or, where a fault shows with the
    /// rotor's angle, half an electrical turn; a capacitor that is overcharged and a rotor that runs away are found by their levels.
    fn longest_s(&self, case: &Case, carrier_s: f64) -> f64 {
        let carriers_s = 3.0 * carrier_s;
        let pole_pairs = f64::from(self.machine.folder.parameters.pole_pairs);
        let turn_s = |motor: usize| (case.point.speeds_rpm[motor].abs() / 60.0 * pole_pairs).recip();
        match case.fault.cause {
            Cause::Bench(Kind::Current(motor, ..) | Kind::Angle(motor, _)) => {
                carriers_s.max((0.5 * turn_s(motor)).min(0.1))
            }
            Cause::Bench(Kind::Gate(..)) => STUCK_S,
            Cause::Bench(Kind::ControlStopped) => carriers_s + STALE_S,
            Cause::Runaway(_) => carriers_s + TRACKING_S,
            _ => carriers_s,
        }
    }
}

/// Until a gate that is stuck has made a difference to the feedback, in s: five carriers.
const STUCK_S: f64 = 5e-4;
/// How old a command may become, in s.
const STALE_S: f64 = 5e-4;
/// How far the speed tracker lags behind, in s: 2/4000 rad/s.
const TRACKING_S: f64 = 0.5e-3;
/// How far a capacitor rises between a sample at its trip level and gates that are off, in V: 300 A for 175 µs.
const RISE_V: f64 = 300.0 * 175e-6 / ZNetwork::ZS9.capacitance_f;
/// Room for rounding, and for what happens between two instants at which it is looked at.
const FORCED: f64 = 1.01;

/// The highest capacitor voltage that must be expected once the gates are off, in V: the network's own oscillation with the energies of
/// the motors on top.
fn forced_uc_v(observed: &Observed) -> f64 {
    let stored = &observed.stored;
    // Both capacitors share it.
    let charged_v = ((stored.field_j + stored.braked_j) / ZNetwork::ZS9.capacitance_f).sqrt();
    FORCED * stored.unloaded_v.hypot(charged_v)
}

/// Mean torque less demand before an instant, in N·m, of the motor that is worse off.
fn torque_error_nm(rows: &[Row], before_s: f64) -> f64 {
    let window: Vec<_> =
        rows.iter().filter(|row| row.t_s < before_s && row.t_s > before_s - MEAN_S).collect();
    let error = |motor: usize| {
        let off = |row: &&Row| row.motors[motor].torque_nm - row.motors[motor].torque_ref_nm;
        (window.iter().map(off).sum::<f64>() / window.len().max(1) as f64).abs()
    };
    error(0).max(error(1))
}
