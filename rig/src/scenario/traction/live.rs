//! A drive that somebody drives by hand for as long as he likes: plant, contactors, operator and drive as in every scenario, stepped from outside.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub use crate::scenario::live::{Command, Start, Turning, Wanted};

use super::host::bench;
use super::prelude::*;
use super::setup::{setup, tasks};
use super::{drives, fed_link};
use crate::bench::{Bench, LinePlan, Simulated};
use crate::inject::traction::{Kind, SupplyFault};
use crate::plant::Source;
use crate::run::Interrupts;
use crate::run::traction::Tasks;
use crate::scenario::live::{ACKNOWLEDGE_S, TURN_S};
use crate::speed_loop::SpeedLoop;
use crate::trace::Edge;
use anyhow::Result;
use core::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};
use tractive::control::Controller;
use tractive::operator::{Request, State, Status};
use tractive::protection::Trip;

/// Slope at which a held rotor goes to another speed, in r/min per s.
const HELD_SLOPE_RPM_S: f64 = 2_000.0;
/// Slope at which the speed loop's reference goes to another speed, in r/min per s.
const LOOP_SLOPE_RPM_S: f64 = 500.0;
/// The acceleration of a rotor that runs away, in r/min per s, and its final speed as a share of the trip level.
const RUNAWAY: (f64, f64) = (12_000.0, 1.2);
/// Length of the bench's first recording, in s: the recording is endless, but reserves room for that many rows.
const ROOM_S: f64 = 0.1;
/// Resistance of a line that is cut off, in ohm.
const CUT_OFF_OHM: f64 = 1e9;

/// A drive on its bench.
pub struct Live {
    bench: Bench,
    tasks: Tasks<'static>,
    request: Arc<Mutex<Request>>,
    /// The present wishes.
    pub wanted: Wanted,
    /// Time until which the acknowledge is set, in s.
    acknowledged_until_s: f64,
    command: Command,
    speed_loop: SpeedLoop,
    turning: Turning,
    largest_nm: f64,
    /// True resistance over the rating, as long as nothing is wrong.
    resistance_scale: f64,
    source: Source,
    supply: Option<(SupplyFault, f64)>,
    trip_rpm: f64,
    next_turn_s: f64,
}

impl Live {
    /// Switches a drive on with the options of any run; the link is at its voltage, with its contactors open.
    ///
    /// # Errors
    /// Names the option that is out of its range.
    pub fn new(options: &Options, machine: &Machine, start: Start) -> Result<Self> {
        <Traction as crate::scenario::System>::check(options, &serde_json::Map::new(), machine)?;
        drives::alone(options.own.drives)?;
        let request = Arc::new(Mutex::new(Request::idle(&machine.tables.ratings)));
        let asked = Arc::clone(&request);
        let commander = Box::new(move |_: f64| *asked.lock().unwrap_or_else(PoisonError::into_inner));
        let mut link = fed_link(options, machine);
        link.source.reversible = true;
        let line = LinePlan { starts_charged: true, ..LinePlan::new(link, commander) };
        let plan = Plan::operated(ROOM_S, vec![(0.0, start.speed_rpm)], line).behind(options.own.line);
        let plan = Plan { judged_step_s: start.step_s, ..plan };
        let source = plan.line.as_ref().map_or(link.source, |line| line.link.source);
        let setup = setup(&plan, options, machine, false);
        let tasks = tasks(Controller::new(), &setup, options, machine)?;
        let parameters = &machine.folder.parameters;
        Ok(Self {
            bench: bench(plan, &setup, options, (machine, machine)).endless(),
            tasks,
            request,
            wanted: Wanted::default(),
            acknowledged_until_s: 0.0,
            command: Command::Torque(0.0),
            speed_loop: SpeedLoop::new(1.0, parameters.max_torque_nm, start.speed_rpm, 0.0),
            turning: Turning::Held(start.speed_rpm),
            largest_nm: parameters.max_torque_nm,
            resistance_scale: options.plant().resistance_scale,
            source,
            supply: None,
            trip_rpm: parameters.trip_speed_rpm,
            next_turn_s: 0.0,
        })
    }

    /// Lets a time in s pass.
    ///
    /// # Errors
    /// Says why the bench cannot go on.
    pub fn run(&mut self, seconds: f64) -> Result<()> {
        let until_s = self.bench.time_s() + seconds;
        while self.bench.time_s() < until_s {
            if self.bench.time_s() >= self.next_turn_s {
                self.next_turn_s += TURN_S;
                self.turn();
            }
            let to_s = self.next_turn_s.min(until_s);
            self.tasks.drive(&mut self.bench, |bench| bench.time_s() < to_s)?;
        }
        Ok(())
    }

    /// Time since it was switched on, in s.
    pub fn time_s(&self) -> f64 {
        self.bench.time_s()
    }

    /// Rows since the last time, and edges with their times in s.
    pub fn take(&mut self) -> (Vec<Row>, Vec<(f64, Edge)>) {
        let (rows, edges) = self.bench.take();
        let seconds = |edge: Edge| (self.bench.seconds(edge.tick), edge);
        (rows, edges.into_iter().map(seconds).collect())
    }

    /// The operator's last word; `None` in the first slot.
    pub fn status(&self) -> Option<Status> {
        self.bench.line().and_then(|line| line.status)
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.tasks.trip().or(self.status().and_then(|status| status.trip))
    }

    /// Speed of the rotor, in r/min.
    pub fn speed_rpm(&self) -> f64 {
        self.bench.motor().speed_rpm()
    }

    /// A new command.
    pub fn command(&mut self, command: Command) {
        if let Command::Speed(rpm) = command {
            if !matches!(self.command, Command::Speed(_)) {
                self.begin_loop();
            }
            self.speed_loop.aim(rpm, LOOP_SLOPE_RPM_S);
        }
        self.command = command;
    }

    /// The rotor is held or let go of.
    pub fn turn_as(&mut self, turning: Turning) {
        let rotor = self.bench.plant_mut().motor.rotor_mut();
        match turning {
            Turning::Held(rpm) => rotor.hold(rpm, HELD_SLOPE_RPM_S),
            Turning::Free(inertia_kg_m2, load_nm) => rotor.release(inertia_kg_m2, load_nm),
        }
        self.turning = turning;
        self.begin_loop();
        self.command(self.command);
    }

    /// Voltage of the line without load, in V.
    pub fn set_source_v(&mut self, voltage_v: f64) {
        self.source.voltage_v = voltage_v;
    }

    /// True flux linkage over the map's, above 0.
    pub fn set_flux_scale(&mut self, scale: f64) {
        self.bench.plant_mut().set_flux_scale(scale);
    }

    /// True resistance over the rating, until all is mended.
    pub fn set_resistance_scale(&mut self, scale: f64) {
        self.bench.plant_mut().set_resistance_scale(scale);
    }

    /// The fault is acknowledged, once.
    pub fn acknowledge(&mut self) {
        self.acknowledged_until_s = self.bench.time_s() + ACKNOWLEDGE_S;
    }

    /// Something goes wrong from now on; what went wrong before is mended.
    pub fn inject(&mut self, kind: Kind) {
        self.mend();
        match kind {
            Kind::Supply(fault) => self.supply = Some((fault, self.bench.time_s())),
            kind => self.bench.inject(kind),
        }
    }

    /// The rotor runs away.
    pub fn run_away(&mut self) {
        let (slope_rpm_s, share) = RUNAWAY;
        let direction = if self.speed_rpm() < 0.0 { -1.0 } else { 1.0 };
        self.bench.plant_mut().motor.rotor_mut().hold(direction * share * self.trip_rpm, slope_rpm_s);
    }

    /// Mends all that was injected, and brings back a rotor that ran away.
    pub fn mend(&mut self) {
        self.bench.mend();
        self.supply = None;
        self.set_resistance_scale(self.resistance_scale);
        self.turn_as(self.turning);
    }

    /// The loop begins where the rotor is.
    fn begin_loop(&mut self) {
        let inertia_kg_m2 = match self.turning {
            Turning::Free(inertia_kg_m2, _) => inertia_kg_m2,
            // The loop cannot move a rotor that is held.
            Turning::Held(_) => 1.0,
        };
        self.speed_loop = SpeedLoop::new(inertia_kg_m2, self.largest_nm, self.speed_rpm(), 0.0);
    }

    /// Sets the line's voltage and the request, once a slot.
    fn turn(&mut self) {
        self.feed();
        let torque_nm = match self.command {
            Command::Torque(torque_nm) => torque_nm,
            Command::Speed(_) => self.speed_loop.step(self.speed_rpm(), TURN_S),
        };
        let state = self.status().map_or(State::Init, |status| status.state);
        let now_s = self.bench.time_s();
        let levels = self.wanted.levels(state, now_s, now_s < self.acknowledged_until_s);
        let mut request = self.request.lock().unwrap_or_else(PoisonError::into_inner);
        *request = Request {
            enable: levels.enable,
            with_torque: levels.with_torque,
            coast: levels.coast,
            charge: levels.charge,
            discharge: levels.discharge,
            acknowledge: levels.acknowledge,
            torque_nm: torque_nm as f32,
            ..*request
        };
    }

    /// The line, and what is wrong with it.
    fn feed(&mut self) {
        let now_s = self.bench.time_s();
        let mut source = self.source;
        match self.supply {
            None => {}
            Some((SupplyFault::Lost, _)) => source.resistance_ohm = CUT_OFF_OHM,
            Some((SupplyFault::To(line_v), _)) => source.voltage_v = line_v,
            Some((SupplyFault::Swinging(amplitude_v, hz), since_s)) => {
                source.voltage_v += amplitude_v * libm::sin(TAU * hz * (now_s - since_s));
            }
        }
        if let Some(link) = self.bench.link_mut() {
            link.settings.source = source;
        }
    }
}
