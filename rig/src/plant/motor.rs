//! A machine with its rotor, as used by all plants.

use super::{PlantSettings, Rotor, SpeedSource, Stator, Vector};
use core::f64::consts::TAU;
use tractive_tablegen::MachineFolder;

/// A motor: stator, rotor, currents.
#[derive(Clone, Debug)]
pub struct Motor {
    pub(super) stator: Stator,
    pub(super) rotor: Rotor,
    pub(super) id_a: f64,
    pub(super) iq_a: f64,
    /// Largest current of the machine, by its folder, in A.
    pub largest_a: f64,
    /// Energies since the beginning.
    pub energies: MotorEnergies,
}

/// A motor's energies since the beginning, in J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorEnergies {
    /// Taken from the legs.
    pub electrical_j: f64,
    /// Turned into heat in the stator.
    pub copper_j: f64,
    /// Given to the rotor by the air-gap torque.
    pub mechanical_j: f64,
}

impl Motor {
    /// Without current, angle zero, turning as the speed source says.
    pub(super) fn new(machine: &MachineFolder, speed: SpeedSource, settings: &PlantSettings) -> Self {
        let stator = Stator::new(machine, settings);
        let rotor = Rotor::new(speed, stator.pole_pairs).on_shaft(settings.shaft);
        Self {
            stator,
            rotor,
            id_a: 0.0,
            iq_a: 0.0,
            largest_a: machine.parameters.max_current_a,
            energies: MotorEnergies::default(),
        }
    }

    /// Sets the currents, in A.
    pub fn set_currents(&mut self, id_a: f64, iq_a: f64) {
        (self.id_a, self.iq_a) = (id_a, iq_a);
    }

    /// Lets a free rotor turn at a speed in r/min; a prescribed speed stays as it is.
    pub fn set_speed_rpm(&mut self, speed_rpm: f64) {
        self.rotor.set_speed_rpm(speed_rpm);
    }

    /// Loads a free rotor with a torque against forward rotation, in N·m; a prescribed speed stays as it is.
    pub fn set_load_nm(&mut self, load_nm: f64) {
        self.rotor.set_load_nm(load_nm);
    }

    /// The rotor, for holding or releasing it between two steps.
    pub fn rotor_mut(&mut self) -> &mut Rotor {
        &mut self.rotor
    }

    /// The stator.
    pub fn stator(&self) -> &Stator {
        &self.stator
    }

    /// Currents in the rotor frame, in A.
    pub fn currents_dq(&self) -> (f64, f64) {
        (self.id_a, self.iq_a)
    }

    /// Phase currents, positive into the motor, in A.
    pub fn currents_abc(&self) -> [f64; 3] {
        Vector::from_rotor((self.id_a, self.iq_a), self.rotor.sin_cos()).phases()
    }

    /// Air-gap torque, minus the iron's part, in N·m.
    pub fn torque_nm(&self) -> f64 {
        let current = (self.id_a, self.iq_a);
        let slots_nm = self.stator.slot_torque_nm(current, self.rotor.sin_cos());
        let torque_nm = self.stator.torque_nm(self.id_a, self.iq_a) + slots_nm;
        if self.stator.loses_in_iron() {
            torque_nm - self.stator.iron_torque_nm(current, TAU * self.turns_s())
        } else {
            torque_nm
        }
    }

    /// Electrical rotor angle, in turns, 0 ≤ x < 1.
    pub fn angle_turns(&self) -> f64 {
        self.rotor.angle_turns()
    }

    /// Mechanical speed, in r/min.
    pub fn speed_rpm(&self) -> f64 {
        self.rotor.speed_rpm()
    }

    /// Electrical speed, in turns per s.
    pub fn turns_s(&self) -> f64 {
        self.speed_rpm() / 60.0 * self.stator.pole_pairs
    }

    /// Largest current vector of the motor if it is short-circuited now and turns on without losses, in A.
    pub fn short_circuit_peak_a(&self) -> f64 {
        self.stator.peak_on_flux_circle_a(self.id_a, self.iq_a)
    }

    /// The same, or, if it is larger, that after the current has decayed.
    pub fn later_short_circuit_peak_a(&self) -> f64 {
        self.short_circuit_peak_a().max(self.stator.peak_on_flux_circle_a(0.0, 0.0))
    }

    /// Energy of the field, above that at zero current, in J.
    pub fn field_j(&self) -> f64 {
        self.stator.field_j(self.id_a, self.iq_a)
    }

    /// Energy that the rotor gives if the gates are blocked now, in J, while this voltage (V) removes the flux linkage.
    pub fn braked_j(&self, against_v: f64) -> f64 {
        let speed_rad_s = self.rotor.speed_rpm() * TAU / 60.0;
        self.stator.braked_j((self.id_a, self.iq_a), speed_rad_s, against_v)
    }

    /// Ends a step of `dt_s` with the resulting currents, and its energies: electrical, copper loss, the torque's impulse.
    pub(super) fn finish(&mut self, [id_a, iq_a]: [f64; 2], energies: [f64; 3], dt_s: f64) {
        let [electrical_j, copper_j, impulse_nm_s] = energies;
        (self.id_a, self.iq_a) = (id_a, iq_a);
        self.energies.electrical_j += electrical_j;
        self.energies.copper_j += copper_j;
        self.energies.mechanical_j += self.rotor.finish(impulse_nm_s, dt_s);
    }
}
