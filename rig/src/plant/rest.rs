//! A machine behind open legs whose diodes block: it has no current; its rotor may turn.
//!
//! While its current is near zero in all phases, an open leg acts as a resistor, and stator and legs settle within microseconds. After that no current is left.
//! In a dead time, which is shorter, the current changes as slowly as speed and link do: one implicit step follows it up to the next event, where explicit
//! steps would have to be microseconds long.

use super::legs::LONGEST_STEP_S;
use super::runge_kutta::rotated;
use super::{Frame, Leg, Plant, State, Vector};

/// Change of the current within a step below which it has settled, as a share of the linear zone's width.
const SETTLED_SHARE: f64 = 0.01;

/// A step at rest.
pub(super) struct Rest {
    /// Its length, in s.
    pub dt_s: f64,
    /// The state at its end.
    pub state: State,
    /// Current that the legs take from the link, in A.
    pub link_a: f64,
}

impl Plant {
    /// The step of at most `left_s` that the machine makes at rest; `None` if it is not at rest.
    pub(super) fn rest(&self, legs: [Leg; 3], udc_v: f64, left_s: f64) -> Option<Rest> {
        let small_a = self.clamp.small_current_a();
        let is_within = |(d, q): (f64, f64), most_a: f64| d * d + q * q <= most_a * most_a;
        let (id, iq) = self.motor.currents_dq();
        if legs != [Leg::Open; 3] || !is_within((id, iq), small_a) {
            return None;
        }
        let dt_s = left_s.min(LONGEST_STEP_S);
        let rotor = &self.motor.rotor;
        let turning = rotor.turning(|| self.motor.torque_nm(), dt_s);
        let omega = turning.omega(dt_s);
        let end = Frame { sin_cos: rotated(rotor.sin_cos(), libm::sincos(turning.turned(dt_s))), omega };
        let is_without = (id, iq) == (0.0, 0.0) || self.clamp.takes_away(udc_v, left_s);
        if is_without && self.emf_between_lines_v(end) <= udc_v + 2.0 * self.drops.diode_v {
            let ([.., torque_nm], _) = self.slope((0.0, 0.0), legs, udc_v, end);
            return Some(Rest { dt_s, state: [0.0, 0.0, 0.0, 0.0, dt_s * torque_nm], link_a: 0.0 });
        }
        let ([id_a_s, iq_a_s, ..], _) = self.slope((id, iq), legs, udc_v, end);
        let leg_ohm = (0.5 * udc_v + self.drops.diode_v) / small_a + self.drops.diode_ohm;
        let (by_d, by_q) = self.motor.stator.settles((id, iq), leg_ohm, omega, (id_a_s, iq_a_s), dt_s);
        let after = (id + by_d, iq + by_q);
        if !is_within((by_d, by_q), SETTLED_SHARE * small_a) || !is_within(after, small_a) {
            return None;
        }
        let ([.., electrical_w, copper_w, torque_nm], link_a) = self.slope(after, legs, udc_v, end);
        let state = [after.0, after.1, dt_s * electrical_w, dt_s * copper_w, dt_s * torque_nm];
        Some(Rest { dt_s, state, link_a })
    }

    /// Largest voltage between two lines of the machine without current at an instant, in V.
    fn emf_between_lines_v(&self, Frame { sin_cos, omega }: Frame) -> f64 {
        let emf_v = Vector::from_rotor(self.motor.stator.emf_v(omega, sin_cos), sin_cos).phases();
        let [most, least] = [f64::max, f64::min].map(|of| emf_v.into_iter().fold(emf_v[0], of));
        most - least
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{DcLink, DcLinkSettings, DeviceDrops, PlantSettings, Source, SpeedSource};
    use tractive_tablegen::MachineFolder;

    const OPEN: [Leg; 3] = [Leg::Open; 3];

    /// A machine, and its own voltage in V.
    fn plant(name: &str, speed_rpm: f64, settings: &PlantSettings) -> (Plant, f64) {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables").join(name);
        let speed = SpeedSource::profile(vec![(0.0, speed_rpm), (0.02, 1.1 * speed_rpm)]);
        let folder = MachineFolder::read(&folder).unwrap();
        (Plant::new(&folder, speed, settings), folder.parameters.dc_link_nominal_v)
    }

    fn link(voltage_v: f64) -> DcLink {
        let source =
            Source { voltage_v, resistance_ohm: 0.1, inductance_h: 0.0, reversible: false, live: false };
        let settings = DcLinkSettings {
            capacitance_f: 4e-3,
            source,
            precharge_ohm: 10.0,
            discharge_ohm: 100.0,
            auxiliary_ohm: 1e4,
            chopper_ohm: 5.0,
        };
        DcLink { udc_v: voltage_v, ..DcLink::new(settings) }
    }

    /// Compares the method at rest with steps of 0.1 µs throughout: the same currents, energies and link, for a machine that is released with nearly
    /// all of the linear zone's current.
    fn does_what_small_steps_say(name: &str, settings: &PlantSettings) {
        const DT_S: f64 = 2e-6;
        let [mut rests, mut steps] = [(); 2].map(|()| {
            let (mut plant, udc_v) = plant(name, 1_000.0, settings);
            let small_a = plant.clamp.small_current_a();
            plant.motor.set_currents(-0.7 * small_a, 0.7 * small_a);
            (plant, link(udc_v))
        });
        let mut steps_at_rest = 0;
        for _ in 0..5_000 {
            let (plant, link) = &mut rests;
            steps_at_rest += u32::from(plant.rest(OPEN, link.udc_v, DT_S).is_some());
            plant.advance_on(link, OPEN, DT_S);
            let (plant, link) = &mut steps;
            for _ in 0..20 {
                plant.step_on(link, OPEN, 0.05 * DT_S);
            }
        }
        let [(a, link_a), (b, link_b)] = [&rests, &steps];
        let small_a = a.clamp.small_current_a();
        let near = |x: f64, y: f64, within: f64| assert!((x - y).abs() < within, "{name}: {x} {y}");
        near(a.motor.id_a, b.motor.id_a, 1e-4 * small_a);
        near(a.motor.iq_a, b.motor.iq_a, 1e-4 * small_a);
        let (mine, theirs) = (a.motor.energies, b.motor.energies);
        near(mine.electrical_j, theirs.electrical_j, 1e-3 * theirs.electrical_j.abs());
        near(mine.mechanical_j, theirs.mechanical_j, 1e-3 * theirs.mechanical_j.abs());
        near(link_a.udc_v, link_b.udc_v, 1e-7 * link_b.udc_v);
        assert!(steps_at_rest > 4_500, "{name}: {steps_at_rest}");
    }

    #[test]
    fn machines_at_rest_do_what_small_steps_say() {
        let drops = DeviceDrops { igbt_v: 2.0, igbt_ohm: 5e-3, diode_v: 1.5, diode_ohm: 3e-3 };
        let flawed = PlantSettings { slots_share: 0.08, drops, ..PlantSettings::default() };
        does_what_small_steps_say("pmasynrm-180kw", &PlantSettings::default());
        does_what_small_steps_say("pmasynrm-180kw", &flawed);
        does_what_small_steps_say("pmsm-48v-1kw", &PlantSettings::default());
    }

    /// A machine whose EMF exceeds the link's voltage charges the link: it is not at rest.
    #[test]
    fn a_machine_that_charges_the_link_is_not_at_rest() {
        let (mut plant, _) = plant("pmasynrm-180kw", 6_000.0, &PlantSettings::default());
        plant.advance(OPEN, 300.0, 5e-3);
        assert!(plant.rest(OPEN, 300.0, 1e-5).is_none());
    }

    /// The largest current in the last 15 ms of 20, in A, of a machine released with a fifth of its largest current, on a link of this multiple of its EMF
    /// between lines at the end.
    fn current_left_a(name: &str, settings: &PlantSettings, over_emf: f64) -> f64 {
        let (mut plant, _) = plant(name, 1_000.0, settings);
        let most_a = if name == "pmasynrm-180kw" { 233.0 } else { 30.0 };
        let omega = 1_100.0 / 60.0 * core::f64::consts::TAU * plant.motor.stator.pole_pairs;
        let emf_v = 3.0_f64.sqrt() * plant.motor.stator.emf_v(omega, (0.0, 1.0)).1;
        let udc_v = over_emf * emf_v - 2.0 * settings.drops.diode_v;
        plant.motor.set_currents(-0.14 * most_a, 0.14 * most_a);
        plant.advance(OPEN, udc_v, 5e-3);
        (0..150).fold(0.0_f64, |most, _| {
            plant.advance(OPEN, udc_v, 1e-4);
            let (id, iq) = plant.motor.currents_dq();
            most.max(id.hypot(iq))
        })
    }

    /// Diodes block up to the link's voltage and conduct above it.
    #[test]
    fn a_machine_behind_open_legs_has_no_current_unless_its_emf_is_above_the_link() {
        let drops = DeviceDrops { igbt_v: 0.4, igbt_ohm: 5e-3, diode_v: 0.3, diode_ohm: 3e-3 };
        for name in ["pmasynrm-180kw", "pmsm-48v-1kw"] {
            for settings in [PlantSettings::default(), PlantSettings { drops, ..PlantSettings::default() }] {
                assert_eq!(current_left_a(name, &settings, 1.001), 0.0, "{name}");
                let above_a = current_left_a(name, &settings, 0.95);
                assert!(above_a > 0.1, "{name}: {above_a} A");
            }
        }
    }

    /// Only the iron takes energy from its rotor.
    #[test]
    fn a_machine_at_rest_gives_nothing_and_takes_what_its_iron_does() {
        for iron_share in [0.0, 1.0] {
            let (mut plant, udc_v) =
                plant("pmasynrm-180kw", 500.0, &PlantSettings { iron_share, ..PlantSettings::default() });
            plant.advance(OPEN, udc_v, 1e-2);
            let energies = plant.motor.energies;
            assert_eq!((energies.electrical_j, energies.copper_j), (0.0, 0.0));
            assert_eq!(energies.mechanical_j < 0.0, iron_share > 0.0, "{energies:?}");
        }
    }
}
