//! The torque demand: slew, then envelope and link. The torque that was given is remembered, so the next slew begins where the drive is.

use crate::frames::limit;
use crate::machine::Ratings;

/// The operator's demand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Demand {
    /// Torque, in N·m; positive turns the rotor forward.
    pub torque_nm: f32,
    /// `true` if the demand's rate of change is limited to the machine's slew rate.
    pub slew_limited: bool,
}

/// DC-link voltages between which torque is given: motoring torque ends at a low link voltage, braking torque at a high one,
/// each along a straight line between two voltages. By default there is no such limit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinkWindow {
    /// Link voltage at and below which a thousandth of the motoring torque is left, in V.
    pub motoring_none_v: f32,
    /// Link voltage at and above which all of it is given, in V; above `motoring_none_v`.
    pub motoring_full_v: f32,
    /// Link voltage at and below which all braking torque is given, in V; below `braking_none_v`.
    pub braking_full_v: f32,
    /// Link voltage above which none of it is left, in V: who then brakes is given a thousandth of motoring torque, which takes from the link what
    /// nothing else does.
    pub braking_none_v: f32,
}

impl LinkWindow {
    /// No limit.
    pub const OPEN: Self = Self {
        motoring_none_v: 0.0,
        motoring_full_v: 0.0,
        braking_full_v: f32::MAX,
        braking_none_v: f32::MAX,
    };

    /// Lowest and highest torque at a link voltage, for a largest torque in N·m and an electrical angular speed. Slower than `standing`, torque takes
    /// power in either direction, for its copper loss: a full link does not let a train roll back.
    fn bounds_nm(&self, udc_v: f32, largest_nm: f32, omega: f32, standing: f32) -> (f32, f32) {
        let (mut motoring, mut braking) = (largest_nm, largest_nm);
        if udc_v < self.motoring_full_v {
            motoring *= share(udc_v - self.motoring_none_v, self.motoring_full_v - self.motoring_none_v);
        }
        if omega.abs() < standing {
            braking = motoring;
        } else if udc_v > self.braking_full_v {
            let left = self.braking_none_v - udc_v;
            let share = share(left, self.braking_none_v - self.braking_full_v);
            braking *= if left < 0.0 { -share } else { share };
        }
        if omega < 0.0 { (-motoring, braking) } else { (-braking, motoring) }
    }
}

impl Default for LinkWindow {
    fn default() -> Self {
        Self::OPEN
    }
}

/// `x` as a share of `span`; if there is less, or none, so little that a torque just keeps its sign: in square wave the operating points of no torque
/// and of hardly any lie far apart.
fn share(x: f32, span: f32) -> f32 {
    if x > KEPT_SHARE * span { x / span } else { KEPT_SHARE }
}

/// Share of a torque that the link's window leaves at least.
const KEPT_SHARE: f32 = 0.001;

/// Torque while the gates are off and the diodes do not rectify, as a share of the largest: it counts as none.
const LEAKAGE_SHARE: f32 = 0.01;

#[derive(Clone, Copy, Debug)]
pub struct Shaper {
    /// `None` until pulses are made.
    torque_nm: Option<f32>,
}

/// The inputs that shape a demand.
pub struct Input<'a> {
    pub demand: &'a Demand,
    pub window: Option<&'a LinkWindow>,
    pub udc_v: f32,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// Torque that flows already, in N·m: the starting point of a machine that is caught while turning.
    pub flowing_nm: f32,
    /// `true` if a carrier follows the demand: a carrier can step.
    pub can_step: bool,
    pub period_s: f32,
}

impl Shaper {
    pub const fn new() -> Self {
        Self { torque_nm: None }
    }

    pub const fn without_torque() -> Self {
        Self { torque_nm: Some(0.0) }
    }

    /// The shaped demand, in N·m.
    #[inline(always)]
    pub fn step(&mut self, input: &Input, ratings: &Ratings) -> f32 {
        let wanted = input.demand.torque_nm;
        let last = match self.torque_nm {
            Some(last) => last,
            None if input.can_step => 0.0,
            None if input.flowing_nm.abs() < LEAKAGE_SHARE * ratings.max_torque_nm => 0.0,
            None => input.flowing_nm,
        };
        // A pattern of few pulses cannot follow a step: its flux hexagon has to be turned against the rotor, and if turned faster
        // it would be thrown off its centre.
        let shaped = if input.demand.slew_limited || !input.can_step {
            let step = ratings.torque_slew_nm_s * input.period_s;
            limit(wanted, last - step, last + step)
        } else {
            wanted
        };
        let largest = envelope_nm(input.omega, ratings);
        // The limit by the link is not slewed: the link's capacitor fills in milliseconds. A pattern follows torque towards zero at any rate.
        let (lowest, highest) = match input.window {
            Some(window) => {
                let standing = ratings.standing_rad_s() * ratings.pole_pairs;
                window.bounds_nm(input.udc_v, largest, input.omega, standing)
            }
            None => (-largest, largest),
        };
        let shaped = if shaped == 0.0 { 0.0 } else { limit(shaped, lowest, highest) };
        self.torque_nm = Some(shaped);
        shaped
    }
}

/// Largest torque of the rating's envelope, in N·m: constant torque, then constant power.
fn envelope_nm(omega: f32, ratings: &Ratings) -> f32 {
    let (speed, power) = (omega.abs(), ratings.max_power_w * ratings.pole_pairs);
    if ratings.max_torque_nm * speed > power { power / speed } else { ratings.max_torque_nm }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::IronLoss;

    #[test]
    fn the_link_ends_motoring_and_braking_whichever_way_it_turns() {
        let window = LinkWindow {
            motoring_none_v: 900.0,
            motoring_full_v: 1000.0,
            braking_full_v: 1800.0,
            braking_none_v: 1900.0,
        };
        for (udc_v, motoring, braking) in [
            (850.0, 0.1, 100.0),
            (900.05, 0.1, 100.0),
            (950.0, 50.0, 100.0),
            (1500.0, 100.0, 100.0),
            (1850.0, 100.0, 50.0),
            (1900.0, 100.0, 0.1),
            (2000.0, 100.0, -0.1),
        ] {
            let bounds_nm = |omega| window.bounds_nm(udc_v, 100.0, omega, 2.0);
            for omega in [2.0, 300.0] {
                assert_eq!(bounds_nm(omega), (-braking, motoring), "{udc_v} V forward");
                assert_eq!(bounds_nm(-omega), (-motoring, braking), "{udc_v} V backward");
            }
            for omega in [-1.9, 0.0, 1.9] {
                assert_eq!(bounds_nm(omega), (-motoring, motoring), "{udc_v} V at rest");
            }
        }
        for udc_v in [0.0, 1e6, f32::MAX] {
            assert_eq!(LinkWindow::OPEN.bounds_nm(udc_v, 100.0, 300.0, 2.0), (-100.0, 100.0), "{udc_v} V");
        }
    }

    #[test]
    fn what_flows_before_the_first_pulse_is_where_a_pattern_begins_unless_it_is_hardly_any() {
        let ratings = Ratings {
            pole_pairs: 4.0,
            stator_resistance_ohm: 0.1,
            max_torque_nm: 1_000.0,
            max_power_w: 180e3,
            max_current_a: 230.0,
            min_id_a: -230.0,
            max_speed_rad_s: 2_500.0,
            magnet_flux_wb: 0.6,
            dc_link_min_v: 1_000.0,
            dc_link_nominal_v: 1_500.0,
            dc_link_max_v: 1_800.0,
            max_switching_hz: 900.0,
            trip_current_a: 300.0,
            trip_dc_over_v: 2_000.0,
            trip_dc_under_v: 900.0,
            trip_speed_rad_s: 2_700.0,
            torque_slew_nm_s: 8_000.0,
            max_acceleration_rad_s2: 2_500.0,
            iron: IronLoss::NONE,
            iron_share: 0.0,
        };
        let begins_nm = |flowing_nm: f32, can_step: bool| {
            let demand = Demand { torque_nm: 0.0, slew_limited: true };
            let (window, udc_v, omega, period_s) = (None, 1_500.0, 600.0, 1e-4);
            let input = Input { demand: &demand, window, udc_v, omega, flowing_nm, can_step, period_s };
            Shaper::new().step(&input, &ratings)
        };
        let slew_nm = ratings.torque_slew_nm_s * 1e-4;
        for sign in [1.0, -1.0] {
            // The diodes rectify into a link below the EMF: the torque goes on from where it is.
            for share in [LEAKAGE_SHARE, 0.02, 0.05, 0.3] {
                let flowing_nm = sign * share * ratings.max_torque_nm;
                assert_eq!(begins_nm(flowing_nm, false), flowing_nm - sign * slew_nm, "{share}");
                assert_eq!(begins_nm(flowing_nm, true), 0.0, "a carrier can step");
            }
            // Less is what the sensors' noise shows without current.
            assert_eq!(begins_nm(sign * 0.005 * ratings.max_torque_nm, false), 0.0);
        }
        // On a full link the copper loss decides, of 7,935 W: half of it is 1,000 N·m at 15.87 electrical rad/s.
        let window = LinkWindow { braking_full_v: 1_300.0, braking_none_v: 1_400.0, ..LinkWindow::OPEN };
        for (omega, given_nm) in [(15.8, -500.0), (-15.8, -500.0), (15.9, 1.0), (-15.9, -500.0)] {
            let demand = Demand { torque_nm: -500.0, slew_limited: false };
            let (udc_v, flowing_nm, window) = (1_500.0, 0.0, Some(&window));
            let input =
                Input { demand: &demand, window, udc_v, omega, flowing_nm, can_step: true, period_s: 1e-4 };
            assert_eq!(Shaper::new().step(&input, &ratings), given_nm, "{omega}");
        }
    }
}
