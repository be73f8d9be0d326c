//! The ZS9's line side: contactors, precharge and discharge resistors between the source and the Z-network.
//!
//! While the main contactor is open the gates are off, and charging or discharging the capacitors is slow compared with the network's own
//! oscillation: both capacitors follow together, and the inductors carry no current.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

use crate::bench::{Switchgear, Tick};
use crate::plant::zs9::{NetworkState, Zs9Plant};
use tractive::operator::DualStatus;
use tractive::time::Clock;

pub use tractive::operator::LineTimes;

/// Time constants unless told otherwise, in s: 50 Ω and 500 Ω on both capacitors of 500 µF.
pub const TIMES: LineTimes = LineTimes { precharge_s: 0.05, discharge_s: 0.5 };

/// The line side of a bench.
pub struct LineSide {
    times: LineTimes,
    /// Contactors and slots.
    pub gear: Switchgear<(), [tractive::ports::MotorDemand; 2]>,
    discharge: bool,
    /// The operator's last status that has taken effect.
    pub status: Option<DualStatus>,
}

impl LineSide {
    /// The voltage left in empty capacitors, in V: the plant is made for a charged network.
    pub const EMPTY_V: f64 = 1.0;

    /// At tick 0, everything open.
    pub fn new(times: LineTimes, clock: &Clock) -> Self {
        Self { times, gear: Switchgear::new(clock), discharge: false, status: None }
    }

    /// Does what is due at `now`.
    pub fn act(&mut self, now: Tick) {
        if let Some(status) = self.gear.act(now) {
            self.discharge = status.switches.discharge;
            self.status = Some(status);
        }
    }

    /// `true` while the main contactor connects source and network.
    pub fn is_connected(&self) -> bool {
        self.gear.main_closed()
    }

    /// Feeds the network from the source over the next `dt_s`. Returns the energy that precharging took from the source, in J.
    pub fn feed(&self, plant: &mut Zs9Plant, source_v: f64, dt_s: f64) -> f64 {
        let feeding = Feeding {
            main: self.gear.main_closed(),
            precharge: self.gear.precharge_closed(),
            discharge: self.discharge,
        };
        feeding.feed(&self.times, plant, source_v, dt_s)
    }
}

/// The switches that connect source, network and discharge resistor; each is on if its field is true.
#[derive(Clone, Copy, Debug)]
pub struct Feeding {
    /// The main contactor.
    pub main: bool,
    /// The precharge relay.
    pub precharge: bool,
    /// The discharge resistor.
    pub discharge: bool,
}

impl Feeding {
    /// Feeds the network from the source over the next `dt_s`. Returns the energy that precharging took from the source, in J.
    pub fn feed(&self, times: &LineTimes, plant: &mut Zs9Plant, source_v: f64, dt_s: f64) -> f64 {
        if self.main {
            plant.source_v = source_v;
            return 0.0;
        }
        let mut capacitor_v = plant.network.capacitor_v();
        let mut precharging_j = 0.0;
        if self.precharge {
            let rise_v = (source_v - capacitor_v) * -libm::expm1(-dt_s / f64::from(times.precharge_s));
            capacitor_v += rise_v;
            precharging_j = 2.0 * plant.parts.capacitance_f * rise_v * source_v;
        }
        if self.discharge {
            capacitor_v *= libm::exp(-dt_s / f64::from(times.discharge_s));
        }
        let capacitor_v = capacitor_v.max(LineSide::EMPTY_V);
        plant.network = NetworkState::even(0.0, capacitor_v);
        // No current flows between a source and capacitors of equal voltage.
        plant.source_v = capacitor_v;
        precharging_j
    }
}
