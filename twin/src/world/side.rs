//! The power side of each system: inverter, link, motors, as the rig has them, and its rows of the trace.

use super::wiring::Sensor;
use crate::stage::PowerStage;
use tractive::modulation::Mode;
use tractive::nine_switch::Scheme;
use tractive::operator::{LineTimes, State, Status, Switches};
use tractive::ports::GateFeedback;
use tractive::protection::{Fault, SafeState, Trip};
use tractive::time::Instant;
use tractive_rig::plant::zs9::{LegGates, NetworkState, Zs9Plant};
use tractive_rig::plant::{DcLink, Leg, LinkSwitches, Motor, Plant};
use tractive_rig::talk::Listener;
use tractive_rig::trace::{Row, SlotRow};
use tractive_rig::zs9;

/// The power side.
pub enum Side {
    /// The PMaSynRM on its link.
    Traction(Box<Traction>),
    /// Two motors on the Z-source inverter.
    Zs9(Box<Zs9>),
}

/// The PMaSynRM on its link.
pub struct Traction {
    /// The machine.
    pub plant: Plant,
    /// The link.
    pub link: DcLink,
    /// The trace.
    pub rows: Vec<Row>,
    /// The operator's words.
    pub slots: Vec<SlotRow>,
}

/// Two motors on the Z-source inverter.
pub struct Zs9 {
    /// The inverter with its motors.
    pub plant: Zs9Plant,
    /// The source's voltage, in V.
    pub source_v: f64,
    /// The line side's times.
    pub times: LineTimes,
    /// The line side's switches.
    pub switches: LinkSwitches,
    /// The gates that the driver board has seen on, and off, since it was last selected.
    pub seen: GateFeedback,
    /// Loads, in N·m.
    pub loads_nm: [f64; 2],
    /// Time with a leg shorted, and total time, in the present row.
    shorted_s: (f64, f64),
    /// The trace.
    pub rows: Vec<zs9::trace::Row>,
}

impl Zs9 {
    /// At rest and empty.
    pub fn new(mut plant: Zs9Plant, times: LineTimes) -> Self {
        let source_v = plant.source_v;
        plant.network = NetworkState::even(0.0, zs9::line::LineSide::EMPTY_V);
        plant.source_v = zs9::line::LineSide::EMPTY_V;
        Self {
            plant,
            source_v,
            times,
            switches: LinkSwitches::default(),
            seen: GateFeedback::default(),
            loads_nm: [0.0; 2],
            shorted_s: (0.0, 0.0),
            rows: Vec::new(),
        }
    }

    fn advance(&mut self, gates: &[bool], pulsing: bool, dt_s: f64) -> Result<(), String> {
        for (gate, on) in gates.iter().enumerate() {
            let latch = if *on { &mut self.seen.on } else { &mut self.seen.off };
            *latch |= 1 << gate;
        }
        let switches = self.switches;
        let line = zs9::line::Feeding {
            main: switches.main,
            precharge: switches.precharge,
            discharge: switches.discharge,
        };
        line.feed(&self.times, &mut self.plant, self.source_v, dt_s);
        let leg = |k: usize| LegGates { high: gates[k], middle: gates[k + 3], low: gates[k + 6] };
        let legs = [leg(0), leg(1), leg(2)];
        self.shorted_s.1 += dt_s;
        if legs.contains(&LegGates::SHOOT_THROUGH) {
            self.shorted_s.0 += dt_s;
        }
        let currents = || [0, 1].map(|k| self.plant.motors[k].currents_abc());
        let real = if pulsing { zs9::bench::as_diodes_have_it(legs, currents) } else { legs };
        self.plant.advance(real, dt_s).map_err(|error| {
            self.plant.advance_any(real, dt_s);
            error.to_string()
        })
    }

    fn row(&mut self, t_s: f64, heard: &Listener) {
        let number = |column: &str| heard.value(column).parse().unwrap_or(0.0);
        let motor = |k: usize| {
            let (motor, n) = (&self.plant.motors[k], k + 1);
            let (id_a, iq_a) = motor.currents_dq();
            zs9::trace::MotorRow {
                speed_rpm: motor.speed_rpm(),
                torque_ref_nm: number(&format!("torque{n}_nm")),
                torque_nm: motor.torque_nm(),
                id_a,
                iq_a,
                phases_a: motor.currents_abc(),
                load_nm: self.loads_nm[k],
                voltage_v: 0.0,
                weakening: false,
            }
        };
        let motors = [motor(0), motor(1)];
        let (shorted_s, all_s) = std::mem::take(&mut self.shorted_s);
        let pattern = heard.value("scheme");
        self.rows.push(zs9::trace::Row {
            t_s,
            motors,
            link_v: self.plant.link_v(),
            capacitor_v: self.plant.network.capacitor_v(),
            inductor_a: self.plant.network.inductor_a(),
            source_v: self.plant.source_v,
            line_a: None,
            duty: if all_s > 0.0 { shorted_s / all_s } else { 0.0 },
            scheme: Scheme::ALL.into_iter().find(|scheme| scheme.name() == pattern).unwrap_or(Scheme::S),
            trip: trip(heard),
            source_j: self.plant.energies.source_j,
            kinetic_speed_rpm: motors.map(|motor| motor.speed_rpm),
            explained_j: 0.0,
        });
    }
}

impl Traction {
    fn advance(&mut self, gates: &[bool], dt_s: f64) {
        let legs = [0, 2, 4].map(|upper| match (gates[upper], gates[upper + 1]) {
            (true, _) => Leg::Upper,
            (_, true) => Leg::Lower,
            _ => Leg::Open,
        });
        self.plant.advance_on(&mut self.link, legs, dt_s);
    }

    fn row(&mut self, t_s: f64, heard: &Listener) {
        let number = |column: &str| heard.value(column).parse().unwrap_or(0.0);
        let motor = &self.plant.motor;
        let ((id_a, iq_a), [ia_a, ib_a, ic_a]) = (motor.currents_dq(), motor.currents_abc());
        let status = status(heard);
        if let Some(status) = status {
            self.slots.push(SlotRow { t_s, status });
        }
        self.rows.push(Row {
            t_s,
            speed_rpm: motor.speed_rpm(),
            te_ref_nm: number("torque_nm"),
            te_nm: motor.torque_nm(),
            id_ref_a: number("id_ref_a"),
            iq_ref_a: number("iq_ref_a"),
            id_a,
            iq_a,
            ia_a,
            ib_a,
            ic_a,
            u_v: number("voltage_v"),
            udc_v: self.link.udc_v,
            f1_hz: number("frequency_hz"),
            flowing_nm: number("torque_estimate_nm"),
            mode: Mode::named(&heard.value("mode")).unwrap_or(Mode::Off),
            trip: trip(heard),
            status,
            ..Row::default()
        });
    }
}

/// The fault as told.
fn trip(heard: &Listener) -> Option<Trip> {
    let name = heard.value("fault");
    let fault = Fault::ALL.into_iter().find(|fault| fault.name() == name)?;
    let number = |column: &str| heard.value(column).parse().unwrap_or(0.0);
    let (value, limit) = (number("fault_value"), number("fault_limit"));
    Some(Trip { fault, value, limit, at: Instant(0), safe: SafeState::GatesOff })
}

/// The operator's status as told; `None` before the first word.
fn status(heard: &Listener) -> Option<Status> {
    let state = heard.value("state");
    let number = |column: &str| heard.value(column).parse().unwrap_or(0.0_f32);
    let refusal = heard.value("refusal");
    let on = |column: &str| heard.value(column) == "1";
    Some(Status {
        state: State::ALL.into_iter().find(|known| known.name() == state)?,
        trip: trip(heard),
        refusal: tractive::operator::Refusal::ALL.into_iter().find(|known| known.name() == refusal),
        refusals: number("refusals") as u32,
        torque_nm: number("torque_nm"),
        switches: Switches {
            precharge: on("precharge"),
            main: on("main"),
            discharge: on("discharge"),
            chopper: number("chopper_percent") / 100.0,
        },
        temperatures: None,
    })
}

impl Side {
    /// The motors.
    pub fn motors(&self) -> &[Motor] {
        match self {
            Self::Traction(side) => std::slice::from_ref(&side.plant.motor),
            Self::Zs9(side) => &side.plant.motors,
        }
    }

    /// The same, to be held and loaded.
    pub fn motors_mut(&mut self) -> &mut [Motor] {
        match self {
            Self::Traction(side) => std::slice::from_mut(&mut side.plant.motor),
            Self::Zs9(side) => &mut side.plant.motors,
        }
    }

    /// Lets time pass. The error says which gates must not be.
    pub fn advance(&mut self, gates: &[bool], pulsing: bool, dt_s: f64) -> Result<(), String> {
        match self {
            Self::Traction(side) => {
                side.advance(gates, dt_s);
                Ok(())
            }
            Self::Zs9(side) => side.advance(gates, pulsing, dt_s),
        }
    }

    /// The link's switches stand so.
    pub fn switch(&mut self, switches: LinkSwitches) {
        match self {
            Self::Traction(side) => side.link.switches = switches,
            Self::Zs9(side) => side.switches = switches,
        }
    }

    /// The machines' loads, in N·m.
    pub fn load(&mut self, loads_nm: [f64; 2]) {
        for (motor, load_nm) in self.motors_mut().iter_mut().zip(loads_nm) {
            motor.set_load_nm(load_nm);
        }
        if let Self::Zs9(side) = self {
            side.loads_nm = loads_nm;
        }
    }

    /// The link stands at its source's voltage.
    pub fn charge(&mut self) {
        match self {
            Self::Traction(side) => side.link.udc_v = side.link.settings.source.voltage_v,
            Self::Zs9(side) => {
                side.plant.network = NetworkState::even(0.0, side.source_v);
                side.plant.source_v = side.source_v;
            }
        }
    }

    /// The voltage that a sensor gives, in V.
    pub fn volts(&self, sensor: Sensor, stage: &PowerStage, ready: bool) -> f64 {
        match (sensor, self) {
            (Sensor::Current(motor, phase), _) => {
                stage.current_volts(self.motors()[motor].currents_abc()[phase])
            }
            (Sensor::Ready, _) => crate::chip::adc::REFERENCE_V * f64::from(u8::from(ready)),
            (_, Self::Traction(side)) => stage.link_volts(side.link.udc_v),
            (Sensor::Source, Self::Zs9(side)) => stage.source_volts(side.source_v),
            (Sensor::Inductor, Self::Zs9(side)) => stage.inductor_volts(side.plant.network.inductor_a()),
            (Sensor::Link, Self::Zs9(side)) => stage.link_volts(side.plant.network.capacitor_v()),
        }
    }

    /// One row of the trace.
    pub fn row(&mut self, t_s: f64, heard: &Listener) {
        match self {
            Self::Traction(side) => side.row(t_s, heard),
            Self::Zs9(side) => side.row(t_s, heard),
        }
    }
}
