//! Cases of the PMaSynRM drive.

use super::judge::{self, Bounded, CURRENT_SHARE, Rule};
use super::without::Without;
use super::{Action, Outcome};
use crate::bench::inject::{Injection, Kind, SupplyFault};
use crate::bench::{self, Bench, Flaws, Limits, LineFilter, Observed, Supply};
use crate::machine::Machine;
use crate::plant::{Plant, PlantSettings, SpeedSource};
use crate::run::{CLOCK, Tasks};
use crate::sensor_faults::{AngleFault, CurrentFault};
use crate::steps::held;
use crate::trace::Row;
use anyhow::Result;
use core::f64::consts::TAU;
use tractive::control::{Demand, Gains};
use tractive::drive::traction::Settings;
use tractive::machine::Tables;
use tractive::modulation::{Devices, Mode};
use tractive::protection::{Fault, SafeState, Trip};

/// A speed, and how much of the torque envelope is asked for there.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// In r/min.
    pub speed_rpm: f64,
    /// Share of the envelope, motoring and braking.
    pub share: f64,
    /// Whether it is one of the fast campaign's.
    pub fast: bool,
}

const fn point(speed_rpm: f64, share: f64, fast: bool) -> Point {
    Point { speed_rpm, share, fast }
}

/// Where the faults come: every mode at several speeds. Patterns of square wave need torque below 4,455 r/min.
const POINTS: [Point; 18] = [
    point(0.0, 0.8, false),
    point(100.0, 0.8, false),
    point(300.0, 0.8, true),
    point(550.0, 0.8, false),
    point(640.0, 0.8, false),
    point(850.0, 0.8, true),
    point(930.0, 0.5, false),
    point(1080.0, 0.5, true),
    point(1200.0, 0.5, false),
    point(1700.0, 0.5, true),
    point(-1700.0, 0.5, false),
    point(1950.0, 0.4, false),
    point(2800.0, 0.4, true),
    point(2000.0, 1.0, false),
    point(3000.0, 0.8, false),
    point(4500.0, 0.8, false),
    point(5500.0, 0.8, false),
    point(6000.0, 0.8, true),
];

/// When the fault comes, in s from the recording's beginning: not at a sample.
const FAULT_S: f64 = 0.005_037;
/// Every case a little later than the one before, in s, so that faults come at all angles.
const LATER_S: f64 = 0.000_173;
const LATER_STEPS: usize = 23;
/// When another torque is wanted, in s: a fault that has not shown must not hide for ever.
const TURN_S: f64 = 0.1;
/// End, in s: full torque is reversed in 0.15 s where it cannot step.
const END_S: f64 = 0.3;
/// Before the recording, in s; the torque comes 90 ms before its end.
const LEAD_S: f64 = 0.12;
const TORQUE_S: f64 = -0.09;
/// How long the aftermath is watched, in s: several electrical turns, and the link's oscillation.
const AFTERMATH_S: f64 = 0.06;
/// Means of the torque are over this much time, in s.
const MEAN_S: f64 = 0.04;
/// How fast a rotor that is pushed off gets faster, in r/min per s.
const PUSH_RPM_S: f64 = 2_000.0;
/// From where a rotor runs away, in r/min: it must be above 6,600 in time.
const RUNAWAY_FROM_RPM: f64 = 5_000.0;
/// How fast a rotor that runs away gets faster, in r/min per s: twice what the machine itself can do.
const RUNAWAY_RPM_S: f64 = 12_000.0;

/// What a fault is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cause {
    /// Something on the bench.
    Bench(Kind),
    /// True flux linkage over the map's, resistance over the rating.
    Machine(f64, f64),
    /// The rotor runs away.
    Runaway,
}

/// A fault with its name and its rule.
#[derive(Clone, Debug)]
struct Named {
    name: String,
    cause: Cause,
    rule: Rule,
    /// One of its kind is enough for the fast campaign.
    fast: bool,
}

impl Named {
    /// Whether it comes at rest, and the rotor is pushed off.
    fn needs_rest(&self) -> bool {
        self.name.ends_with("at-rest")
    }

    /// Whether it can come there.
    fn fits(&self, point: &Point) -> bool {
        let speed_rpm = point.speed_rpm.abs();
        match self.cause {
            Cause::Runaway => speed_rpm >= RUNAWAY_FROM_RPM,
            Cause::Bench(Kind::Angle(AngleFault::Frozen | AngleFault::Reversed)) => {
                self.needs_rest() == (speed_rpm == 0.0)
            }
            _ => true,
        }
    }
}

/// One run.
#[derive(Clone, Debug)]
pub struct Case {
    fault: Named,
    point: Point,
    action: Action,
    /// When the fault comes, in s.
    at_s: f64,
}

impl Case {
    /// What a filter searches.
    pub fn name(&self) -> String {
        format!("pmasynrm {} {} {}", self.fault.name, self.point.speed_rpm, self.action.name())
    }
}

/// Range of the current converters, in A: a quarter above the trip level.
const RANGE_A: f64 = 379.2;

/// Mean torque error where a fault must not be felt, as a share of the largest torque.
const UNFELT: f64 = 0.03;
/// Where a current sensor's error bends the torque.
const BENT: f64 = 0.1;
/// Where the machine differs by a fifth from its map.
const ANOTHER_MACHINE: f64 = 0.25;

fn faults() -> Vec<Named> {
    let mut list = Vec::new();
    let mut add =
        |name: &str, cause: Cause, names: &'static [Fault], torque_share: Option<f64>, fast: bool| {
            list.push(Named { name: name.to_owned(), cause, rule: Rule { names, torque_share }, fast });
        };
    add("none", Cause::Bench(Kind::Elsewhere), &[], Some(UNFELT), true);
    const SUM: &[Fault] = &[Fault::PhaseSum];
    const TOO_MUCH: &[Fault] = &[Fault::PhaseSum, Fault::Overcurrent];
    const RAILED: &[Fault] = &[Fault::Overcurrent];
    for (phase, letter) in ["u", "v", "w"].into_iter().enumerate() {
        let first = phase == 0;
        let mut sensor = |what: &str, fault, names, share| {
            let cause = Cause::Bench(Kind::Current(phase, fault));
            add(&format!("current-{letter}-{what}"), cause, names, share, first);
        };
        sensor("stuck", CurrentFault::Stuck, SUM, Some(BENT));
        sensor("open", CurrentFault::Open, SUM, Some(BENT));
        sensor("offset", CurrentFault::Offset(60.0), SUM, None);
        sensor("scaled", CurrentFault::Scaled(1.5), TOO_MUCH, Some(BENT));
        sensor("noisy", CurrentFault::Noisy(30.0), SUM, None);
        sensor("railed", CurrentFault::Railed(-RANGE_A), RAILED, None);
        sensor("not-finite", CurrentFault::NotFinite, &[Fault::NotFinite], None);
    }
    let small = |fault| Cause::Bench(Kind::Current(1, fault));
    add("current-v-offset-5A", small(CurrentFault::Offset(5.0)), &[], Some(BENT), true);
    add("current-v-scaled-3%", small(CurrentFault::Scaled(1.03)), &[], Some(BENT), true);
    add("current-v-noisy-2A", small(CurrentFault::Noisy(2.0)), &[], Some(UNFELT), true);
    const LOST: &[Fault] = &[Fault::AngleLost, Fault::Frozen];
    const PUSHED: &[Fault] = &[Fault::AngleLost, Fault::Frozen, Fault::Overcurrent];
    let angle = |fault| Cause::Bench(Kind::Angle(fault));
    add("angle-frozen", angle(AngleFault::Frozen), LOST, None, true);
    add("angle-jump", angle(AngleFault::Jump(90.0)), LOST, None, true);
    add("angle-glitches", angle(AngleFault::Glitches(40.0, 50)), LOST, None, true);
    add("angle-reversed", angle(AngleFault::Reversed), LOST, None, true);
    // At rest these cannot be told from a rotor that stands: they come with one that is pushed off.
    add("angle-frozen-at-rest", angle(AngleFault::Frozen), PUSHED, None, true);
    add("angle-reversed-at-rest", angle(AngleFault::Reversed), PUSHED, None, true);
    add("angle-late", angle(AngleFault::Late(5)), LOST, Some(BENT), true);
    add("angle-off-2deg", angle(AngleFault::Jump(2.0)), &[], Some(BENT), true);
    let supply = |fault| Cause::Bench(Kind::Supply(fault));
    const LINK: &[Fault] = &[Fault::DcOvervoltage, Fault::DcUndervoltage];
    add("link-lost", supply(SupplyFault::Lost), LINK, Some(UNFELT), true);
    const OVER: &[Fault] = &[Fault::DcOvervoltage, Fault::Overcurrent];
    add("link-over", supply(SupplyFault::To(2300.0)), OVER, None, true);
    add("link-under", supply(SupplyFault::To(600.0)), &[Fault::DcUndervoltage], None, true);
    const SWINGS: &[Fault] = &[Fault::DcOvervoltage, Fault::DcUndervoltage, Fault::Overcurrent];
    add("link-swings", supply(SupplyFault::Swinging(300.0, 40.0)), SWINGS, Some(UNFELT), true);
    add("link-sways", supply(SupplyFault::Swinging(150.0, 16.7)), &[], Some(BENT), true);
    add("overspeed", Cause::Runaway, &[Fault::Overspeed], None, true);
    for (gate, name) in (0_u8..).zip(bench::GATES) {
        let gate_fault = |on| Cause::Bench(Kind::Gate(gate, on));
        let first = gate < 2;
        add(&format!("{name}-stuck-on"), gate_fault(true), &[Fault::DriverBlocked], None, first);
        add(&format!("{name}-stuck-off"), gate_fault(false), &[Fault::LegStuck], Some(UNFELT), first);
        add(
            &format!("{name}-shorted"),
            Cause::Bench(Kind::Device(gate)),
            &[Fault::DriverBlocked],
            None,
            first,
        );
    }
    for (leg, letter) in ["u", "v", "w"].into_iter().enumerate() {
        let cause = Cause::Bench(Kind::Feedback(leg));
        add(&format!("leg-{letter}-feedback"), cause, &[Fault::LegStuck], None, leg == 0);
    }
    let late = Cause::Bench(Kind::ControlLate(100));
    add("control-late", late, &[Fault::ControlDeadline], None, true);
    add("commands-lost", Cause::Bench(Kind::ControlStopped), &[Fault::StaleCommand], None, true);
    add("demand-not-finite", Cause::Bench(Kind::DemandNotFinite), &[Fault::NotFinite], None, true);
    const CURRENT: &[Fault] = &[Fault::Overcurrent];
    add("flux-20%-more", Cause::Machine(1.2, 1.0), CURRENT, Some(ANOTHER_MACHINE), true);
    add("flux-20%-less", Cause::Machine(0.8, 1.0), CURRENT, Some(ANOTHER_MACHINE), true);
    add("resistance-doubled", Cause::Machine(1.0, 2.0), CURRENT, Some(BENT), true);
    list
}

/// Every case; of the fast ones each fault of each kind in each mode.
pub fn cases(fast: bool) -> Vec<Case> {
    let mut list = Vec::new();
    for fault in faults() {
        for point in POINTS {
            for action in Action::ALL {
                let slow = fault.needs_rest() || fault.cause == Cause::Runaway;
                if !fault.fits(&point) || (fast && !(fault.fast && (point.fast || slow))) {
                    continue;
                }
                let at_s = match fault.cause {
                    // The machine is another one from the beginning.
                    Cause::Machine(..) => -LEAD_S,
                    _ => FAULT_S + LATER_S * (list.len() % LATER_STEPS) as f64,
                };
                list.push(Case { fault: fault.clone(), point, action, at_s });
            }
        }
    }
    list
}

/// The drive, with one protection off or none.
pub struct Drive {
    machine: Machine,
    tables: &'static Tables,
    without: Option<Without>,
}

/// A drive written down as what happens when; times in s from the recording's beginning.
#[derive(Clone, Debug, Default)]
pub struct Ride {
    /// Speeds in r/min, straight lines between.
    pub speed: Vec<(f64, f64)>,
    /// Torques in N·m, each from its time on, and whether the demand's rate is limited.
    pub torque: Vec<(f64, (f64, bool))>,
    /// Whether the drive is enabled, each from its time on.
    pub enable: Vec<(f64, bool)>,
    /// Voltages of the line, each from its time on.
    pub line: Vec<(f64, f64)>,
    /// What goes wrong.
    pub injection: Option<Injection>,
    /// Length, in s.
    pub duration_s: f64,
}

/// What a ride left.
pub struct Ridden {
    /// The trace.
    pub rows: Vec<Row>,
    /// What a fault did.
    pub observed: Observed,
    /// The latched fault.
    pub trip: Option<Trip>,
}

/// What a run left.
struct Seen {
    observed: Observed,
    trip: Option<Trip>,
    mode: Mode,
    torque_error_nm: f64,
    /// Mean torque at the end of the aftermath, in N·m.
    safe_torque_nm: f64,
}

impl Drive {
    /// For the 180 kW machine.
    ///
    /// # Errors
    /// Where its folder is not there.
    pub fn new(without: Option<Without>) -> Result<Self> {
        let machine = Machine::load("pmasynrm-180kw")?;
        let tables = without.map_or(machine.tables, |without| without.tables(machine.tables));
        Ok(Self { machine, tables, without })
    }

    /// Runs one case.
    ///
    /// # Errors
    /// A drive that breaks the bench's rules.
    pub fn run(&self, case: &Case) -> Result<Outcome> {
        let seen = self.drive(case)?;
        Ok(self.judged(case, &seen))
    }

    fn drive(&self, case: &Case) -> Result<Seen> {
        let mut bench = self.bench(case);
        let devices = self.devices();
        let settings = Settings { clock: CLOCK, devices, gains: Gains::DEFAULT };
        let mut tasks = Tasks::new(self.tables, settings, devices.shortest_half_ticks);
        if let Some(without) = self.without {
            tasks = tasks.without(without);
        }
        let tick_s = f64::from(CLOCK.tick_s);
        tasks.drive(&mut bench, |bench| {
            let safe_s = bench.observed().safe.map(|(at, _)| at as f64 * tick_s - LEAD_S);
            safe_s.is_none_or(|safe_s| bench.time_s() < safe_s + AFTERMATH_S)
        })?;
        let rows = bench.rows();
        let before = rows.iter().take_while(|row| row.t_s < case.at_s.max(FAULT_S));
        Ok(Seen {
            observed: *bench.observed(),
            trip: tasks.trip(),
            mode: before.last().map_or(Mode::Off, |row| row.mode),
            torque_error_nm: torque_error_nm(rows, TURN_S).max(torque_error_nm(rows, END_S)),
            safe_torque_nm: last_torque_nm(rows),
        })
    }

    fn devices(&self) -> Devices {
        Devices::new(250, 0, self.tables.ratings.max_switching_hz, &CLOCK)
    }

    fn bench(&self, case: &Case) -> Bench {
        let parameters = &self.machine.folder.parameters;
        let Case { point, action, at_s, .. } = *case;
        let omega = point.speed_rpm.abs() * TAU / 60.0;
        let envelope_nm = (parameters.max_power_w / omega.max(1.0)).min(parameters.max_torque_nm);
        let full_nm = point.share * envelope_nm * if point.speed_rpm < 0.0 { -1.0 } else { 1.0 };
        let wanted_nm = full_nm * action.sign();
        let turned_nm = 0.5 * full_nm * if action == Action::Motoring { -1.0 } else { 1.0 };
        let operator = move |t_s: f64| {
            let torque_nm = match t_s {
                t_s if t_s < TORQUE_S => 0.0,
                t_s if t_s < TURN_S => wanted_nm,
                _ => turned_nm,
            };
            (Demand { torque_nm: torque_nm as f32, slew_limited: false }, true)
        };
        let (kind, machine, speed) = match case.fault.cause {
            Cause::Bench(kind) if case.fault.needs_rest() => {
                let speed = vec![(LEAD_S + at_s, 0.0), (LEAD_S + END_S, PUSH_RPM_S * (END_S - at_s))];
                (kind, PlantSettings::default(), speed)
            }
            Cause::Bench(kind) => (kind, PlantSettings::default(), vec![(0.0, point.speed_rpm)]),
            Cause::Machine(flux_scale, resistance_scale) => {
                let settings = PlantSettings { flux_scale, resistance_scale };
                (Kind::Elsewhere, settings, vec![(0.0, point.speed_rpm)])
            }
            Cause::Runaway => {
                let faster_rpm = point.speed_rpm + RUNAWAY_RPM_S * (END_S - at_s);
                let speed = vec![(LEAD_S + at_s, point.speed_rpm), (LEAD_S + END_S, faster_rpm)];
                (Kind::Elsewhere, PlantSettings::default(), speed)
            }
        };
        let settings = bench::Settings {
            clock: CLOCK,
            first_half_ticks: self.devices().shortest_half_ticks,
            dead_time_ticks: 0,
            lead_s: LEAD_S,
            duration_s: END_S,
            trace_step_s: 50e-6,
            udc_v: parameters.dc_link_nominal_v,
            link_steps: Vec::new(),
            flaws: Flaws::default(),
            supply: Supply::Line(LineFilter::TRACTION),
            injection: Some(Injection { kind, at_s, seed: 1 }),
            limits: Limits {
                current_a: parameters.trip_current_a,
                udc_v: (parameters.trip_dc_under_v, parameters.trip_dc_over_v),
                speed_rpm: parameters.trip_speed_rpm,
                ..Limits::NONE
            },
        };
        let plant = Plant::new(&self.machine.folder, SpeedSource::profile(speed), &machine);
        Bench::new(plant, Box::new(operator), &settings)
    }

    /// Drives a script instead of a case.
    ///
    /// # Errors
    /// A drive that breaks the bench's rules.
    pub fn ride(&self, ride: Ride, flaws: Flaws) -> Result<Ridden> {
        let Ride { speed, torque, enable, line, injection, duration_s } = ride;
        let parameters = &self.machine.folder.parameters;
        let devices = self.devices();
        let operator = move |t_s: f64| {
            let (torque_nm, slew_limited) = held(&torque, t_s).unwrap_or((0.0, true));
            let demand = Demand { torque_nm: torque_nm as f32, slew_limited };
            (demand, held(&enable, t_s).unwrap_or(true))
        };
        let speed = speed.into_iter().map(|(t_s, rpm)| (t_s + LEAD_S, rpm)).collect();
        let settings = bench::Settings {
            clock: CLOCK,
            first_half_ticks: devices.shortest_half_ticks,
            dead_time_ticks: 0,
            lead_s: LEAD_S,
            duration_s,
            trace_step_s: 100e-6,
            udc_v: parameters.dc_link_nominal_v,
            link_steps: line,
            flaws,
            supply: Supply::Line(LineFilter::TRACTION),
            injection: Some(injection.unwrap_or(Injection { kind: Kind::Elsewhere, at_s: -LEAD_S, seed: 1 })),
            limits: Limits::NONE,
        };
        let plant = Plant::new(&self.machine.folder, SpeedSource::profile(speed), &PlantSettings::default());
        let mut bench = Bench::new(plant, Box::new(operator), &settings);
        let drive = Settings { clock: CLOCK, devices, gains: Gains::DEFAULT };
        let mut tasks = Tasks::new(self.tables, drive, devices.shortest_half_ticks);
        if let Some(without) = self.without {
            tasks = tasks.without(without);
        }
        let mut tripped_s = None;
        tasks.drive(&mut bench, |bench| {
            // Once it has stopped there is little to see.
            if bench.observed().safe.is_some() {
                tripped_s.get_or_insert(bench.time_s());
            }
            tripped_s.is_none_or(|tripped_s| bench.time_s() < tripped_s + AFTERMATH_S)
        })?;
        Ok(Ridden { rows: bench.rows().to_vec(), observed: *bench.observed(), trip: tasks.trip() })
    }

    /// The machine's folder.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    fn judged(&self, case: &Case, seen: &Seen) -> Outcome {
        let Seen { observed, trip, mode, torque_error_nm, safe_torque_nm } = seen;
        let parameters = &self.machine.folder.parameters;
        let tick_s = f64::from(CLOCK.tick_s);
        let time_s = observed.ticks_to_safe().map(|ticks| ticks as f64 * tick_s);
        let carrier_s = match observed.carrier_ticks {
            0 => 2.0 * f64::from(self.devices().shortest_half_ticks) * tick_s,
            ticks => ticks as f64 * tick_s,
        };
        let (trip_a, over_v) = (parameters.trip_current_a, parameters.trip_dc_over_v);
        let current_limit_a = match case.fault.cause {
            // Flux linkage that is there when a device fails cannot leave a machine that is shorted; nothing the gates do is better.
            Cause::Bench(Kind::Device(_)) => {
                (CURRENT_SHARE * trip_a).max(FORCED * observed.stored.short_circuit_a)
            }
            _ => CURRENT_SHARE * trip_a,
        };
        let udc_limit_v = self.forced_udc_v(case, observed);
        let stopped = [
            Bounded::new("ms until the gates are safe", time_s.map_or(f64::NAN, |time_s| time_s * 1e3), {
                self.longest_s(case, carrier_s) * 1e3
            }),
            Bounded::new("A until the gates are safe", observed.until.current_a, current_limit_a),
            Bounded::new("A with safe gates", observed.after.current_a, current_limit_a),
            Bounded::new("V until the gates are safe", observed.until.udc_v, over_v + self.link_rise_v()),
            Bounded::new("V with safe gates", observed.after.udc_v, udc_limit_v),
            Bounded::new("N·m with safe gates", safe_torque_nm.abs(), self.safe_torque_limit_nm(case)),
        ];
        let torque_share = case.fault.rule.torque_share.unwrap_or(0.0);
        let went_on = [
            Bounded::new("A", observed.until.current_a, BETWEEN_SAMPLES * trip_a),
            Bounded::new("V", observed.until.udc_v, over_v),
            Bounded::new("N·m off", *torque_error_nm, torque_share * parameters.max_torque_nm),
        ];
        let named = trip.map(|trip| trip.fault);
        let (verdict, why) = judge::verdict(&case.fault.rule, named, &stopped, &went_on);
        Outcome {
            system: "pmasynrm",
            fault: case.fault.name.clone(),
            mode: mode.name().to_owned(),
            speed_rpm: case.point.speed_rpm,
            action: case.action,
            verdict,
            named: named.map_or("", Fault::name).to_owned(),
            safe_state: observed.safe.map_or("", |(_, safe)| safe_state_name(safe)).to_owned(),
            carrier_periods: time_s.map(|time_s| time_s / carrier_s),
            time_ms: time_s.map(|time_s| time_s * 1e3),
            since_fault_ms: observed
                .safe
                .map(|(safe, _)| (safe as f64 - observed.from as f64) * tick_s * 1e3),
            current_until_a: observed.until.current_a,
            current_after_a: observed.after.current_a,
            current_limit_a,
            udc_until_v: observed.until.udc_v,
            udc_after_v: observed.after.udc_v,
            udc_limit_v,
            uc_until_v: None,
            uc_after_v: None,
            uc_limit_v: None,
            torque_error_nm: *torque_error_nm,
            why,
        }
    }

    /// The longest time from a fault's first effect until the gates are safe, in s: three carriers, or, where a fault shows with the
    /// rotor's angle, half an electrical turn.
    fn longest_s(&self, case: &Case, carrier_s: f64) -> f64 {
        let carriers_s = 3.0 * carrier_s;
        if case.fault.needs_rest() {
            return END_S;
        }
        match case.fault.cause {
            Cause::Bench(Kind::Current(..) | Kind::Angle(_)) => {
                let turns_s =
                    case.point.speed_rpm.abs() / 60.0 * f64::from(self.machine.folder.parameters.pole_pairs);
                carriers_s.max((0.5 / turns_s).min(0.1))
            }
            Cause::Runaway => carriers_s + TRACKING_S,
            _ => carriers_s,
        }
    }

    /// The most torque that safe gates may leave, in N·m: a tenth of the largest, so that nobody is braked who did not ask for it. A
    /// leg that is stuck has no such choice, and the short circuit's torque has its peak at a few per cent of the speed.
    fn safe_torque_limit_nm(&self, case: &Case) -> f64 {
        match case.fault.cause {
            // A line that goes on falling after the gates are off comes below the EMF in the end.
            Cause::Bench(Kind::Gate(..) | Kind::Device(_) | Kind::Supply(_)) => f64::INFINITY,
            _ => 0.1 * self.machine.folder.parameters.max_torque_nm,
        }
    }

    /// How far the link can rise between a sample at the trip level and safe gates, in V.
    fn link_rise_v(&self) -> f64 {
        let LineFilter { capacitance_f, .. } = LineFilter::TRACTION;
        let most_a = 2.0 * CURRENT_SHARE * self.machine.folder.parameters.trip_current_a;
        let time_s = f64::from(CLOCK.control_s()) + SAFE_STATE_S;
        most_a / capacitance_f * time_s
    }

    /// The highest link voltage that must be expected once the gates are safe, in V: where the line and its choke take the capacitor,
    /// with the energy on top that is in the machine's field, and that its rotor gives while the field decays; or what the diodes
    /// rectify. Below its trip level the link may do what it likes.
    fn forced_udc_v(&self, case: &Case, observed: &Observed) -> f64 {
        let pole_pairs = f64::from(self.machine.folder.parameters.pole_pairs);
        let omega = case.point.speed_rpm.abs() * TAU / 60.0 * pole_pairs;
        let rectified_v = 3.0_f64.sqrt() * omega * f64::from(self.machine.tables.ratings.magnet_flux_wb);
        let capacitance_f = LineFilter::TRACTION.capacitance_f;
        let field_v = (2.0 * observed.stored.field_j / capacitance_f).sqrt();
        let braked_v = (2.0 * observed.stored.braked_j / capacitance_f).sqrt();
        let charged_v = observed.stored.unloaded_v.hypot(field_v).hypot(braked_v);
        let highest_v = self.machine.folder.parameters.trip_dc_over_v;
        (FORCED * charged_v.max(rectified_v)).max(highest_v)
    }
}

/// How far the speed tracker lags behind, in s: 2/500 rad/s.
const TRACKING_S: f64 = 4e-3;
/// What a current that no sample finds above the trip level may reach between two samples, over that level.
const BETWEEN_SAMPLES: f64 = 1.1;
/// Room for the rounding of what is forced, and for what happens between two instants at which it is looked at.
const FORCED: f64 = 1.01;
/// From an interrupt's instant to the gates, in s.
const SAFE_STATE_S: f64 = 25e-6;

/// Mean torque less demand before an instant, in N·m.
fn torque_error_nm(rows: &[Row], before_s: f64) -> f64 {
    let window = rows.iter().filter(|row| row.t_s < before_s && row.t_s > before_s - MEAN_S);
    let (count, sum) =
        window.fold((0.0_f64, 0.0), |(count, sum), row| (count + 1.0, sum + row.te_nm - row.te_ref_nm));
    (sum / count.max(1.0)).abs()
}

/// Mean torque over the last half of the aftermath, in N·m.
fn last_torque_nm(rows: &[Row]) -> f64 {
    let end_s = rows.last().map_or(0.0, |row| row.t_s);
    let window = rows.iter().filter(|row| row.t_s > end_s - 0.5 * AFTERMATH_S);
    let (count, sum) = window.fold((0.0_f64, 0.0), |(count, sum), row| (count + 1.0, sum + row.te_nm));
    sum / count.max(1.0)
}

/// The name in tables.
fn safe_state_name(safe: SafeState) -> &'static str {
    match safe {
        SafeState::GatesOff => "gates off",
        SafeState::ShortCircuit => "short circuit, lower",
        SafeState::UpperShortCircuit => "short circuit, upper",
    }
}
