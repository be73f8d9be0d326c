//! Drive cycles written as lists of timed events, instead of cases.

use super::Drive;
use crate::bench::{Flaws, Observed, Simulated, Tick};
use crate::campaign::action::LEAD_S;
use crate::plant::{PlantSettings, SpeedSource, profile_speed};
use crate::run::Interrupts;
use crate::scenario::zs9::INERTIA_KG_M2;
use crate::steps::held;
use crate::zs9::bench::{Bench, BenchSettings, Course};
use crate::zs9::trace::Row;
use crate::zs9::{Orders, SeenMotors};
use anyhow::Result;
use tractive::control::Demand;
use tractive::ports::MotorDemand;
use tractive::protection::Trip;
use tractive::time::Instant;

/// The demand on one motor, times in s from the recording's beginning.
#[derive(Clone, Debug)]
pub enum Script {
    /// It follows torques, each from its time on (N·m, and whether the rate is limited), at a prescribed speed.
    Torque {
        /// In r/min, linear in between.
        speed_rpm: Vec<(f64, f64)>,
        /// Demands.
        torque_nm: Vec<(f64, (f64, bool))>,
    },
    /// It follows a speed, its rotor free and loaded.
    Speed {
        /// Demanded speeds, in r/min, linear in between.
        wanted_rpm: Vec<(f64, f64)>,
        /// Loads against forward rotation, each from its time on.
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

/// A drive cycle written as timed events.
#[derive(Clone, Debug)]
pub struct DriveCycle {
    /// The upper motor, the lower one.
    pub motors: [Script; 2],
    /// Source and schemes.
    pub course: Course,
    /// Length, in s.
    pub duration_s: f64,
}

/// The results of a cycle.
pub struct CycleResult {
    /// The trace.
    pub rows: Vec<Row>,
    /// The observations of the fault.
    pub observed: Observed,
    /// The latched fault.
    pub trip: Option<Trip>,
    /// The end of the cycle, in s.
    pub ended_s: f64,
}

impl Drive {
    /// Drives a script instead of a case; the timers start at a tick.
    pub fn cycle(
        &self,
        cycle: DriveCycle,
        flaws: Flaws,
        trace_step_s: f64,
        origin: Tick,
    ) -> Result<CycleResult> {
        let DriveCycle { motors, course, duration_s } = cycle;
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
        let mut tasks = self.tasks(Instant(origin as u32));
        // After the drive has stopped there is nothing to see.
        tasks.drive(&mut bench, |bench| bench.observed.safe.is_none())?;
        Ok(CycleResult {
            observed: bench.observed,
            trip: tasks.trip(),
            ended_s: bench.time_s(),
            rows: bench.take().0,
        })
    }
}
