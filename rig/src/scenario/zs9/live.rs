//! The ZS9's drive that somebody drives by hand for as long as he likes: plant, contactors, operator and drive, stepped from outside.

use super::prelude::*;
use super::{Controller, Line, Settings, TRACKING_RAD_S, bench, machine_name};
use crate::bench::Simulated;
use crate::inject::zs9::Kind;
use crate::options::RunOptions;
use crate::run::{CLOCK, Interrupts};
use crate::scenario::System;
use crate::scenario::live::{ACKNOWLEDGE_S, Command, Start, TURN_S, Turning, Wanted};
use crate::zs9::bench::Bench;
use crate::zs9::run::Tasks;
use crate::zs9::trace::Edge;
use crate::zs9::{line, settings};
use anyhow::Result;
use std::sync::{Arc, Mutex, PoisonError};
use tractive::machine::Ratings;
use tractive::nine_switch::Scheme;
use tractive::operator::Wanted as MotorWanted;
use tractive::operator::{DualRequest, DualStatus, State};
use tractive::protection::Trip;
use tractive::time::Instant;

/// Slope at which a held rotor goes to another speed, in r/min per s.
const HELD_SLOPE_RPM_S: f64 = 1_000.0;
/// The acceleration of a rotor that runs away, in r/min per s, and its final speed as a share of the trip level.
const RUNAWAY: (f64, f64) = (6_000.0, 1.2);
/// Length of the bench's first recording, in s: the recording is endless, but reserves room for that many rows.
const ROOM_S: f64 = 0.1;

/// Two motors on their bench.
pub struct Live {
    bench: Bench,
    tasks: Tasks<'static>,
    request: Arc<Mutex<DualRequest>>,
    /// The present wishes.
    pub wanted: Wanted,
    /// Time until which the acknowledge is set, in s.
    acknowledged_until_s: f64,
    commands: [Command; 2],
    turnings: [Turning; 2],
    link_ref_v: f64,
    trip_rpm: f64,
    next_turn_s: f64,
}

impl Live {
    /// Switches a drive on with the options of any run, both rotors at the start's speed; the network is empty, its contactors open.
    ///
    /// # Errors
    /// Names the option that is out of its range.
    pub fn new(options: &Options, machine: &Machine, start: Start) -> Result<Self> {
        Zs9::check(options, &serde_json::Map::new(), machine)?;
        let options = Options {
            run: RunOptions { dt: Some(start.step_s), ..options.run.clone() },
            own: options.own.clone(),
        };
        // The demands are replaced by what the operator permits.
        let nothing = |_: f64, _: SeenMotors| Orders {
            demands: [MotorDemand::Speed(0.0); 2],
            loads_nm: [0.0; 2],
            enable: true,
        };
        let held = [(); 2].map(|()| SpeedSource::profile(vec![(0.0, start.speed_rpm)]));
        let plan = Plan {
            line: Some(line::TIMES),
            judged_step_s: Some(start.step_s),
            ..Plan::driven((0.0, ROOM_S), held, [start.speed_rpm; 2], nothing)
        };
        let bench = bench(plan, &options, machine)?.endless();
        let drive = settings::drive(CLOCK, options.own.carrier_hz, machine.tables);
        settings::check(&drive, machine, machine_name(&options))?;
        let link_ref_v = link_v(&options, machine);
        let ratings = Settings::operator_ratings(&machine.tables.ratings);
        let request = Arc::new(Mutex::new(DualRequest::idle(&ratings, link_ref_v as f32)));
        Ok(Self {
            bench,
            tasks: tasks(machine, drive, ratings, Arc::clone(&request)),
            request,
            wanted: Wanted::default(),
            acknowledged_until_s: 0.0,
            commands: [Command::Torque(0.0); 2],
            turnings: [Turning::Held(start.speed_rpm); 2],
            link_ref_v,
            trip_rpm: machine.folder.parameters.trip_speed_rpm,
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

    /// Rows and edges since the last time.
    pub fn take(&mut self) -> (Vec<Row>, Vec<Edge>) {
        self.bench.take()
    }

    /// The operator's last word; `None` in the first slot.
    pub fn status(&self) -> Option<DualStatus> {
        self.bench.status()
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.tasks.trip().or(self.status().and_then(|status| status.trip))
    }

    /// Speeds of the rotors, in r/min.
    pub fn speeds_rpm(&self) -> [f64; 2] {
        self.bench.speeds_rpm()
    }

    /// A new command to motor 0, the upper one, or 1.
    pub fn command(&mut self, motor: usize, command: Command) {
        self.commands[motor.min(1)] = command;
    }

    /// A rotor is held or let go of.
    pub fn turn_as(&mut self, motor: usize, turning: Turning) {
        let rotor = self.bench.motor_mut(motor).rotor_mut();
        match turning {
            Turning::Held(rpm) => rotor.hold(rpm, HELD_SLOPE_RPM_S),
            Turning::Free(inertia_kg_m2, load_nm) => rotor.release(inertia_kg_m2, load_nm),
        }
        self.turnings[motor.min(1)] = turning;
        self.bench.load(self.turnings.map(|turning| match turning {
            Turning::Held(_) => 0.0,
            Turning::Free(_, load_nm) => load_nm,
        }));
    }

    /// Voltage of the source, in V, above 0.
    pub fn set_source_v(&mut self, source_v: f64) {
        self.bench.set_source_v(source_v.max(1.0));
    }

    /// Link voltage wanted outside shoot-through, in V, and the place of the zero vectors.
    pub fn set_link(&mut self, link_ref_v: f64, scheme: Scheme) {
        self.link_ref_v = link_ref_v;
        self.bench.set_link(link_ref_v, scheme);
    }

    /// True flux linkage of both machines over the map's, above 0.
    pub fn set_flux_scale(&mut self, scale: f64) {
        self.bench.set_flux_scale(scale);
    }

    /// The fault is acknowledged, once.
    pub fn acknowledge(&mut self) {
        self.acknowledged_until_s = self.bench.time_s() + ACKNOWLEDGE_S;
    }

    /// Something goes wrong from now on; what went wrong before is mended.
    pub fn inject(&mut self, kind: Kind) {
        self.mend();
        self.bench.inject(kind);
    }

    /// A rotor runs away.
    pub fn run_away(&mut self, motor: usize) {
        let (slope_rpm_s, share) = RUNAWAY;
        let direction = if self.speeds_rpm()[motor.min(1)] < 0.0 { -1.0 } else { 1.0 };
        self.bench.motor_mut(motor).rotor_mut().hold(direction * share * self.trip_rpm, slope_rpm_s);
    }

    /// Mends all that was injected, and brings back a rotor that ran away.
    pub fn mend(&mut self) {
        self.bench.mend();
        for motor in [0, 1] {
            self.turn_as(motor, self.turnings[motor]);
        }
    }

    /// Sets the request, once a slot.
    fn turn(&mut self) {
        let state = self.status().map_or(State::Init, |status| status.state);
        let now_s = self.bench.time_s();
        let levels = self.wanted.levels(state, now_s, now_s < self.acknowledged_until_s);
        let mut request = self.request.lock().unwrap_or_else(PoisonError::into_inner);
        for (motor, command) in request.motors.iter_mut().zip(self.commands) {
            motor.wanted = match command {
                Command::Torque(torque_nm) => MotorWanted::Torque(torque_nm as f32),
                Command::Speed(rpm) => MotorWanted::Speed(rad_s(rpm) as f32),
            };
        }
        *request = DualRequest { levels, link_ref_v: self.link_ref_v as f32, ..*request };
    }
}

/// The drive's tasks, with an operator who looks at a request.
fn tasks(
    machine: &Machine,
    drive: Settings,
    ratings: Ratings,
    asked: Arc<Mutex<DualRequest>>,
) -> Tasks<'static> {
    let line = Line::rated(&ratings, line::TIMES.precharge_s, line::TIMES.discharge_s).without_chopper();
    let law = Controller::with_tracking(TRACKING_RAD_S);
    let commander = Box::new(move || *asked.lock().unwrap_or_else(PoisonError::into_inner));
    Tasks::with_law(law, Instant(0), machine.tables, drive).operated_by(commander, ratings, Some(line))
}
