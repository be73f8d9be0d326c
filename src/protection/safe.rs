//! The safe states, and the choice between them by speed.

use super::{FailedCheck, Fault, LegFaults};
use crate::frames::{Abc, SQRT_3};
use crate::machine::Ratings;

/// The inverter's safe states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum SafeState {
    /// All gates off.
    GatesOff,
    /// The three lower devices on: the machine's short-circuit current stays inside its limit, and its EMF does not
    /// reach the link through the diodes.
    ShortCircuit,
    /// The three upper devices on: the same for a leg that is stuck at the upper rail.
    UpperShortCircuit,
}

impl SafeState {
    /// The state with this discriminant; gates off for any other number.
    pub const fn from_code(code: u32) -> Self {
        match code {
            1 => Self::ShortCircuit,
            2 => Self::UpperShortCircuit,
            _ => Self::GatesOff,
        }
    }
}

/// Margin below the speed at which the diodes begin to rectify.
const RECTIFYING_MARGIN: f32 = 0.9;

/// The safe state for an electrical angular speed in rad/s: gates off below `0.9 udc/(√3 ψ_f)`, short circuit above. A value that is not finite
/// counts as slow: a short circuit at speed zero would be safe as well, but open gates need no gate supply. A link above its nominal voltage counts
/// as nominal, since it will not stay there.
#[inline(never)]
pub fn safe_state(omega: f32, udc_v: f32, ratings: &Ratings) -> SafeState {
    if emf_v(omega, ratings) > RECTIFYING_MARGIN * standing_v(udc_v, ratings) {
        SafeState::ShortCircuit
    } else {
        SafeState::GatesOff
    }
}

/// Share of the link above which the EMF can keep a current alive through the diodes.
const GENERATING_SHARE: f32 = 0.5;
/// Phase current above which current counts as flowing, as a share of the largest.
const FLOWING_SHARE: f32 = 0.05;

/// The watch for a machine that keeps generating through the diodes once the gates are off.
///
/// A machine whose d and q axes differ in inductance can sustain a current through the diodes at an EMF that could not start one: a load of power
/// factor 1, such as the diodes, raises its voltage to `k = ξ/(2√(ξ − 1))` times the EMF, where `ξ` is the larger inductance divided by the smaller,
/// and the diodes conduct with a fundamental of `2 udc/π`. So from `2√3/(πk)` of `udc/(√3 ψ_f)` on, a current that flows when the gates go off may
/// persist: Jahns and Caliskan, "Uncontrolled generator operation of interior PM synchronous machines following high-speed inverter shutdown", IEEE
/// Trans. Ind. Appl. 35(6), 1999. Up to `ξ` = 18 that is above half the link, with saturation and hot or cold magnets.
///
/// If no current is sustained, it is gone within an electrical turn. A current that enters a machine by one phase leaves it by another: a current
/// that only one phase shows comes from its sensor, and a short circuit because of it would brake. If two sensors are left, they show none at the
/// zero crossings; their duration is subtracted again from the turn counted. An empty link counts as one at the trip level of its voltage.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiodeWatch {
    /// Turn of the rotor while current flowed less its turn while none did, in electrical rad.
    turned_rad: f32,
}

impl DiodeWatch {
    /// The watch of gates that have just gone off.
    pub const fn new() -> Self {
        Self { turned_rad: 0.0 }
    }

    /// A period after a trip into the state `safe`. Returns the short circuit once gates that are off should become it, because a current that the
    /// EMF may sustain has flowed for an electrical turn. NaN is no current.
    pub fn step(
        &mut self,
        safe: SafeState,
        open: &OpenGates,
        legs: &LegFaults,
        ratings: &Ratings,
    ) -> Option<SafeState> {
        let OpenGates { currents_a: Abc { a, b, c }, udc_v, omega, period_s } = *open;
        let least_a = FLOWING_SHARE * ratings.max_current_a;
        let flows = [a, b, c].iter().filter(|current| current.abs() > least_a).count() > 1;
        let (standing_v, least_v) = (standing_v(udc_v, ratings), ratings.trip_dc_under_v);
        let charged_v = if standing_v > least_v { standing_v } else { least_v };
        let held = emf_v(omega, ratings) > GENERATING_SHARE * charged_v;
        let generates = safe == SafeState::GatesOff && flows && held;
        let turn_rad = omega.abs() * period_s;
        let turned_rad = self.turned_rad + if generates { turn_rad } else { -turn_rad };
        self.turned_rad = if turned_rad > 0.0 { turned_rad } else { 0.0 };
        let shorted = legs.in_place_of(SafeState::ShortCircuit, omega, ratings);
        (self.turned_rad > core::f32::consts::TAU && shorted != safe).then_some(shorted)
    }
}

/// A period with the gates off, as either interrupt sees it.
#[derive(Clone, Copy, Debug)]
pub struct OpenGates {
    /// Phase currents, in A.
    pub currents_a: Abc,
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// Length of the period, in s.
    pub period_s: f32,
}

/// The fault of a machine that generates with its gates off although nothing has tripped: its largest phase current.
pub fn generating(open: &OpenGates, ratings: &Ratings) -> FailedCheck {
    (Fault::CurrentOffset, open.currents_a.peak(), FLOWING_SHARE * ratings.max_current_a)
}

/// The link's voltage, in V, at most its nominal voltage: a higher one will not last.
fn standing_v(udc_v: f32, ratings: &Ratings) -> f32 {
    let nominal_v = ratings.dc_link_nominal_v;
    if udc_v < nominal_v { udc_v } else { nominal_v }
}

/// Peak of the EMF between two phases without current, in V.
pub(super) fn emf_v(omega: f32, ratings: &Ratings) -> f32 {
    omega.abs() * SQRT_3 * ratings.magnet_flux_wb
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    /// After a turn of current the state is not yet the short circuit; after more than one it is.
    #[test]
    fn gates_that_are_off_wait_for_a_whole_turn() {
        let ratings = &BUILT_IN.ratings;
        let currents_a = Abc { a: ratings.max_current_a, b: -ratings.max_current_a, c: 0.0 };
        for (period_s, shorted) in [(0.0, None), (1e-3, Some(SafeState::ShortCircuit))] {
            let open = OpenGates { currents_a, udc_v: 500.0, omega: ratings.max_speed_rad_s, period_s };
            let mut watch = DiodeWatch { turned_rad: core::f32::consts::TAU };
            let got = watch.step(SafeState::GatesOff, &open, &LegFaults::default(), ratings);
            assert_eq!(got, shorted, "{period_s} s");
        }
    }

    #[test]
    fn a_machine_that_generates_is_told_by_its_largest_current_and_what_counts_as_one() {
        let ratings = &BUILT_IN.ratings;
        let currents_a = Abc { a: 40.0, b: -70.0, c: 30.0 };
        let open = OpenGates { currents_a, udc_v: 500.0, omega: ratings.max_speed_rad_s, period_s: 1e-4 };
        let (fault, found_a, limit_a) = generating(&open, ratings);
        assert_eq!((fault, found_a), (Fault::CurrentOffset, 70.0));
        assert_eq!(limit_a, FLOWING_SHARE * ratings.max_current_a);
    }
}
