//! Temperatures of machine and inverter: two nodes of the stator, a heat sink, a junction of each phase, magnets; and the resistive sensors on them.
//!
//! The devices' losses only produce heat: they are not taken from the link.

use super::Plant;
use tractive::thermal::{DeviceLosses, Element, Ratios, Sensor};

/// A node's heat capacity and its resistance to the next colder one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Heat capacity, in J/K.
    pub j_per_k: f64,
    /// Thermal resistance to the next, in K/W.
    pub k_per_w: f64,
}

impl Node {
    /// A node that warms by this many K per W with a time constant in s.
    pub fn new(k_per_w: f64, time_s: f64) -> Self {
        Self { j_per_k: time_s / k_per_w, k_per_w }
    }
}

/// The properties of the parts that warm.
#[derive(Clone, Copy, Debug)]
pub struct HeatSettings {
    /// Coolant temperature, in °C: the initial temperature of everything.
    pub coolant_c: f64,
    /// The winding's hottest place, to the stator at the sensor.
    pub hottest: Node,
    /// The stator at the sensor, to the coolant.
    pub stator: Node,
    /// A junction, to the heat sink.
    pub junction: Node,
    /// The heat sink, to the coolant.
    pub heat_sink: Node,
    /// Losses of one device.
    pub losses: DeviceLosses,
    /// Change of the magnets' flux linkage from 20 °C on, per K.
    pub magnets_per_k: f64,
    /// Temperature of the magnets, in °C.
    pub magnets_c: f64,
    /// The sensors on stator and heat sink.
    pub sensors: [Sensor; 2],
}

/// Wire of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wire {
    /// Sound.
    Sound,
    /// Off.
    Unplugged,
    /// Both ends connected.
    Shorted,
    /// The sensor shows another temperature, in °C.
    Shows(f64),
}

/// Wires of both sensors from a time on, in s.
pub type Wired = (f64, [Wire; 2]);

/// Temperatures of machine and inverter.
#[derive(Clone, Debug)]
pub struct Heat {
    settings: HeatSettings,
    wires: Vec<Wired>,
    /// The winding's hottest place, in °C.
    pub hottest_c: f64,
    /// The stator at its sensor, in °C.
    pub stator_c: f64,
    /// The junctions of each phase, in °C.
    pub junctions_c: [f64; 3],
    /// The heat sink, in °C.
    pub heat_sink_c: f64,
    /// Highest temperatures so far of winding and junctions, in °C.
    pub highest_c: [f64; 2],
    copper_j: f64,
}

impl Heat {
    /// Everything at the coolant's temperature.
    pub fn new(settings: HeatSettings) -> Self {
        let cold = settings.coolant_c;
        Self {
            settings,
            wires: Vec::new(),
            hottest_c: cold,
            stator_c: cold,
            junctions_c: [cold; 3],
            heat_sink_c: cold,
            highest_c: [cold; 2],
            copper_j: 0.0,
        }
    }

    /// The same with wires that are faulty from these times on.
    pub fn wired(mut self, wires: Vec<Wired>) -> Self {
        self.wires = wires;
        self
    }

    /// Adds the losses of `dt_s`; the machine's resistance, rated at 20 °C, and its magnets follow.
    pub fn step(&mut self, plant: &mut Plant, udc_v: f64, dt_s: f64) {
        let HeatSettings { coolant_c, hottest, stator, junction, heat_sink, ref losses, .. } = self.settings;
        let copper_j = plant.motor.energies.copper_j - self.copper_j;
        self.copper_j = plant.motor.energies.copper_j;
        let between_j = (self.hottest_c - self.stator_c) / hottest.k_per_w * dt_s;
        self.hottest_c += (copper_j - between_j) / hottest.j_per_k;
        let out_j = (self.stator_c - coolant_c) / stator.k_per_w * dt_s;
        self.stator_c += (between_j - out_j) / stator.j_per_k;
        let mut sunk_j = 0.0;
        for (celsius, current_a) in self.junctions_c.iter_mut().zip(plant.motor.currents_abc()) {
            let loss_j = f64::from(losses.watts(current_a.abs() as f32, udc_v as f32)) * dt_s;
            let down_j = (*celsius - self.heat_sink_c) / junction.k_per_w * dt_s;
            *celsius += (loss_j - down_j) / junction.j_per_k;
            // For two devices.
            sunk_j += 2.0 * down_j;
        }
        let cooled_j = (self.heat_sink_c - coolant_c) / heat_sink.k_per_w * dt_s;
        self.heat_sink_c += (sunk_j - cooled_j) / heat_sink.j_per_k;
        let junction_c = self.junctions_c.into_iter().fold(f64::MIN, f64::max);
        let [winding, devices] = &mut self.highest_c;
        (*winding, *devices) = (winding.max(self.hottest_c), devices.max(junction_c));
        // The resistance is that of the whole winding, warmer than at its sensor and colder than at its hottest place.
        let winding_c = 0.5 * (self.hottest_c + self.stator_c);
        plant.set_resistance_scale(1.0 + 3.93e-3 * (winding_c - 20.0));
        plant.set_magnet_scale(1.0 + self.settings.magnets_per_k * (self.settings.magnets_c - 20.0));
    }

    /// The converters' counts at a time in s.
    pub fn ratios(&self, t_s: f64) -> Ratios {
        let wires = self.wires.iter().rev().find(|(from_s, _)| *from_s <= t_s);
        let [winding_wire, sink_wire] = wires.map_or([Wire::Sound; 2], |(_, wires)| *wires);
        let [winding, heat_sink] = &self.settings.sensors;
        Ratios {
            winding: ratio(winding, winding_wire, self.stator_c),
            heat_sink: ratio(heat_sink, sink_wire, self.heat_sink_c),
        }
    }
}

/// The counts of a 12-bit converter, in 65,536ths.
fn ratio(sensor: &Sensor, wire: Wire, celsius: f64) -> u16 {
    let share = match wire {
        Wire::Unplugged => 1.0,
        Wire::Shorted => 0.0,
        Wire::Sound | Wire::Shows(_) => {
            let shown_c = if let Wire::Shows(shown_c) = wire { shown_c } else { celsius };
            let ohm = resistance_ohm(sensor.element, shown_c);
            ohm / (ohm + f64::from(sensor.series_ohm))
        }
    };
    ((share * 4_096.0) as u16).min(4_095) << 4
}

/// The resistance by the element's law: IEC 60751, or the thermistor's.
fn resistance_ohm(element: Element, celsius: f64) -> f64 {
    match element {
        Element::Ntc { at_25_ohm, beta_k } => {
            f64::from(at_25_ohm) * libm::exp(f64::from(beta_k) * (1.0 / (celsius + 273.15) - 1.0 / 298.15))
        }
        Element::Pt1000 => {
            let cubic = if celsius < 0.0 { -4.183e-12 * (celsius - 100.0) * celsius.powi(3) } else { 0.0 };
            1e3 * (1.0 + 3.9083e-3 * celsius - 5.775e-7 * celsius * celsius + cubic)
        }
    }
}
