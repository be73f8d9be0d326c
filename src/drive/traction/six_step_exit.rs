//! Voltage and torque after square wave, and the voltage after a carrier.

use super::slot::Decision;
use crate::control::Regulated;
use crate::frames::six_step_v;
use crate::machine::Ratings;
use crate::modulation::Mode;
use crate::time::Instant;

/// Sectors of 60° in which the load angle follows the voltage when one pattern takes over from another. Chosen by trial: with one sector, 12 N·m are
/// missing at the end of square wave; with four, 2.
const TRANSITION_SECTORS: u32 = 4;

/// Rate at which the voltage falls from square wave to the voltage that the torque needs, and rises after a carrier, in shares of six-step per
/// second.
const EXIT_PER_S: f32 = 12.0;

/// Ratio of the flux linkage that the voltage forces to the magnets', above which torque does not pass through zero.
const ONE_SIDED_FLUX: f32 = 1.1;

/// Remainder of a torque that keeps its sign, as a share of the largest.
const ONE_SIDED_SHARE: f32 = 0.001;

/// Length of the pause in which torque changes its sign in square wave, in s: two committed halves, then the machine's currents
/// decay against the link.
const CROSSING_S: f32 = 2e-3;

/// The exit ramp from square wave: voltage and torque on their way to what the torque needs.
pub(super) struct SixStepExit {
    /// Fundamental to which the voltage has fallen after square wave, as a share of six-step; 0 otherwise.
    filled_to: f32,
    /// Fundamental up to which a pattern after a carrier has opened, likewise.
    opened_to: f32,
    /// The last torque, in N·m, where zero counts as the least positive one; 0 before the first. Its sign is the side of the flux circle on which the
    /// machine is: there, zero torque lies with the positive ones.
    side_nm: f32,
    /// Mode that the newest command was made for, and the number of halves in which its load angle still changes with the voltage.
    unsettled: (Mode, u32),
    /// The boundary that was counted last.
    counted: Instant,
    /// Time for which the gates remain off for torque to change its sign, in s.
    crossing_s: f32,
}

impl SixStepExit {
    pub(super) const fn new() -> Self {
        Self {
            filled_to: 0.0,
            opened_to: 1.0,
            side_nm: 0.0,
            unsettled: (Mode::Off, 0),
            counted: Instant(0),
            crossing_s: 0.0,
        }
    }

    /// A control period without pulses: no torque, and no side. What the voltage was filled to is kept while torque changes its sign; for pulses that
    /// begin later, at another speed, it means nothing.
    pub(super) fn rest(&mut self, period_s: f32) {
        if !self.crosses() {
            *self = Self::new();
        }
        self.side_nm = 0.0;
        self.crossing_s -= period_s;
    }

    /// True while the gates are to be off until torque has the other sign.
    pub(super) fn crosses(&self) -> bool {
        self.crossing_s > 0.0
    }

    /// Remembers the side of a torque, in N·m.
    pub(super) fn drove(&mut self, torque_nm: f32) {
        self.side_nm = if torque_nm == 0.0 { f32::MIN_POSITIVE } else { torque_nm };
    }

    /// The largest fundamental as a share of six-step, and whether it is to be used whatever the torque needs. That is the case in square wave; after
    /// it while the voltage falls from there to what the torque `needed` in the last period, once the load angle has followed; and while that need is
    /// below the `least` near the frequency at which only square wave remains.
    pub(super) fn fill(
        &mut self,
        decided: Mode,
        [least, largest]: [f32; 2],
        needed: f32,
        period_s: f32,
    ) -> (f32, bool) {
        if decided.is_whole() {
            self.filled_to = 1.0;
            return (largest, true);
        }
        let step = EXIT_PER_S * period_s;
        let before = self.filled_to;
        if self.unsettled.1 == 0 {
            self.filled_to -= step;
        }
        // Not before the first operating point, when nothing is known of it.
        if self.filled_to < least && needed > 0.0 {
            let more = step + if before > needed { before } else { needed };
            self.filled_to = if more < least { more } else { least };
        }
        if !(decided.is_pattern() || decided.is_optimal()) || self.filled_to < needed {
            self.filled_to = 0.0;
            return (largest, false);
        }
        (if self.filled_to < largest { self.filled_to } else { largest }, true)
    }

    /// The fundamental that an operating point may use, as a share of six-step: the whole `largest`, except for a pattern that follows a carrier,
    /// which begins with the carrier's and opens from there, and below a `ceiling` near the frequency at which a free carrier takes over. Otherwise a
    /// machine weakened by the carrier would change its current within one half: of three such machines two tripped, and a car's took 12 % more
    /// current than in either mode; now the three take 4 % more at most.
    pub(super) fn open(&mut self, follows: Regulated, [ceiling, largest]: [f32; 2], period_s: f32) -> f32 {
        let most = if ceiling < 1.0 { ceiling } else { 1.0 };
        let opened = self.opened_to + EXIT_PER_S * period_s;
        let is_whole = follows == Regulated::Angle;
        self.opened_to = match follows {
            Regulated::Mean => largest,
            _ if is_whole || opened > most => most,
            _ => opened,
        };
        if self.opened_to < largest && !is_whole { self.opened_to } else { largest }
    }

    /// The part of a modulation index that has been opened, by which the mode is chosen: a carrier gives way to the pattern that begins where it
    /// ends.
    pub(super) fn opened(&self, modulation_index: f32) -> f32 {
        if modulation_index < self.opened_to { modulation_index } else { self.opened_to }
    }

    /// The demanded torque, in N·m, which keeps its sign (at first the demand's) for as long as the voltage forces more flux upon the machine than
    /// its magnets have, whose EMF is given in V. Near zero torque the two signs then lie far apart on the circle of flux linkage, and the way
    /// between them passes through currents beyond the largest. So once no torque is left the gates pause: the flux falls to that of the magnets, and
    /// the pattern catches the machine on the other side.
    pub(super) fn one_sided(&mut self, torque_nm: f32, emf_v: f32, udc_v: f32, ratings: &Ratings) -> f32 {
        let least_nm = ONE_SIDED_SHARE * ratings.max_torque_nm;
        let side_nm = if self.side_nm == 0.0 { torque_nm } else { self.side_nm };
        let sided_nm = least_nm.copysign(side_nm);
        let ends = torque_nm * sided_nm < least_nm * least_nm;
        let forced_v = self.filled_to * six_step_v(udc_v);
        if !ends || forced_v <= ONE_SIDED_FLUX * emf_v {
            return torque_nm;
        }
        let turns_over = torque_nm * sided_nm < -least_nm * least_nm;
        if turns_over && self.side_nm.abs() <= least_nm {
            self.crossing_s = CROSSING_S;
        }
        sided_nm
    }

    /// True once the load angle has followed a pattern that took over from another; called when a decision is made.
    pub(super) fn is_settled(&mut self, decision: &Decision) -> bool {
        let Decision { boundary, mode: decided, .. } = *decision;
        let (mode, halves) = &mut self.unsettled;
        if decided != *mode {
            let grows = decided.is_pattern() && mode.is_pattern();
            *halves = if grows { TRANSITION_SECTORS * decided.sector_halves() } else { 0 };
            *mode = decided;
        } else if self.counted != boundary {
            *halves = halves.saturating_sub(1);
        }
        self.counted = boundary;
        *halves == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    /// With a least torque of 3 N·m.
    const RATINGS: Ratings = Ratings { max_torque_nm: 3_000.0, ..BUILT_IN.ratings };

    /// The exit out of square wave.
    fn exit(side_nm: Option<f32>) -> SixStepExit {
        let mut exit = SixStepExit::new();
        assert_eq!(exit.fill(Mode::Square, [-1.0, 0.97], 0.4, 1.0), (0.97, true));
        side_nm.into_iter().for_each(|side_nm| exit.drove(side_nm));
        exit
    }

    #[test]
    fn the_voltage_falls_to_what_the_torque_needs() {
        let mut exit = exit(None);
        // 12 a second: a quarter in each of these periods.
        let period_s = 1.0 / 48.0;
        assert_eq!(
            exit.fill(Mode::Mid3, [-1.0, 0.97], 0.75, period_s),
            (0.75, true),
            "what is needed is still there"
        );
        assert_eq!(
            exit.fill(Mode::Mid3, [-1.0, 0.45], 0.4, period_s),
            (0.45, true),
            "no more than the largest"
        );
        assert_eq!(exit.fill(Mode::Mid3, [-1.0, 0.97], 0.4, period_s), (0.97, false));
        assert_eq!(exit.fill(Mode::Mid3, [-1.0, 0.97], 0.0, 0.0), (0.0, true), "and nothing is left of it");
        let mut exit = self::exit(None);
        assert_eq!(
            exit.fill(Mode::Sync12, [-1.0, 0.9], 0.1, period_s),
            (0.9, false),
            "a carrier needs no ramp"
        );
    }

    #[test]
    fn the_voltage_rises_to_the_least_and_falls_with_it() {
        let period_s = 1.0 / 96.0;
        for mode in [Mode::Mid3, Mode::Mid7] {
            let mut exit = SixStepExit::new();
            let mut fill = |least, needed| exit.fill(mode, [least, 0.97], needed, period_s);
            assert_eq!(fill(0.5, 0.0), (0.97, false), "no operating point yet");
            assert_eq!(fill(0.5, 0.75), (0.97, false), "more is needed");
            // 12 a second: an eighth in each of these periods, from what is needed on.
            assert_eq!(fill(1.0, 0.25), (0.375, true));
            assert_eq!(fill(1.0, 0.25), (0.5, true));
            assert_eq!(fill(0.5, 0.25), (0.5, true));
            assert_eq!(fill(0.4375, 0.25), (0.4375, true));
            assert_eq!(fill(-1.0, 0.25), (0.3125, true), "and falls as after square wave");
            assert_eq!(fill(-1.0, 0.25), (0.97, false));
        }
    }

    #[test]
    fn a_pattern_opens_from_where_its_carrier_ends() {
        // 12 a second: a quarter in each of these periods.
        let period_s = 1.0 / 48.0;
        let mut exit = SixStepExit::new();
        assert_eq!(exit.open(Regulated::Fundamental, [2.0, 0.75], 0.0), 0.75, "out of rest");
        assert_eq!(exit.opened(1.25), 1.0);
        assert_eq!(exit.open(Regulated::Mean, [2.0, 0.25], period_s), 0.25, "a carrier may use what it has");
        assert_eq!([0.125, 0.5].map(|index| exit.opened(index)), [0.125, 0.25]);
        assert_eq!(exit.open(Regulated::Fundamental, [2.0, 0.75], period_s), 0.5);
        assert_eq!(exit.open(Regulated::Fundamental, [2.0, 0.75], 0.5 * period_s), 0.625);
        assert_eq!([0.5, 1.25].map(|index| exit.opened(index)), [0.5, 0.625]);
        assert_eq!(exit.open(Regulated::Fundamental, [2.0, 0.75], period_s), 0.75);
        assert_eq!(exit.open(Regulated::Fundamental, [2.0, 0.75], period_s), 0.75);
        assert_eq!(exit.opened(1.25), 1.0, "no more than six-step");
        let _ = exit.open(Regulated::Mean, [2.0, 0.25], period_s);
        assert_eq!(exit.open(Regulated::Angle, [2.0, 1.0], period_s), 1.0, "the voltage is what it is");
        assert_eq!(exit.open(Regulated::Fundamental, [2.0, 0.75], 0.0), 0.75);
    }

    /// Near the free carrier's frequency a pattern has at once no more than the ceiling, and square wave gives way by it, although its own voltage is
    /// fixed.
    #[test]
    fn a_pattern_closes_to_where_the_free_carrier_begins() {
        let period_s = 1.0 / 48.0;
        let mut exit = SixStepExit::new();
        assert_eq!(exit.open(Regulated::Angle, [0.96875, 1.0], period_s), 1.0);
        assert_eq!(exit.opened(1.25), 0.96875);
        assert_eq!(exit.open(Regulated::Fundamental, [0.9375, 0.99], period_s), 0.9375);
        assert_eq!(exit.opened(1.25), 0.9375);
        let _ = exit.open(Regulated::Mean, [0.9375, 0.5], period_s);
        assert_eq!(exit.open(Regulated::Fundamental, [0.9375, 0.99], period_s), 0.75, "as slowly as ever");
    }

    #[test]
    fn it_falls_once_the_pattern_has_grown() {
        let mut exit = exit(None);
        let at = |boundary, mode| Decision { boundary: Instant(boundary), mode, before: mode, after: mode };
        assert!(exit.is_settled(&at(0, Mode::Square)), "out of none");
        let halves = TRANSITION_SECTORS * Mode::Mid3.sector_halves();
        assert!(halves > 1);
        for boundary in 0..halves {
            assert!(!exit.is_settled(&at(boundary, Mode::Mid3)), "{boundary}");
            assert!(!exit.is_settled(&at(boundary, Mode::Mid3)), "{boundary}, once more");
            assert_eq!(exit.fill(Mode::Mid3, [-1.0, 0.97], 0.1, 1.0 / 48.0), (0.97, true));
        }
        assert!(exit.is_settled(&at(halves, Mode::Mid3)));
        assert_eq!(exit.fill(Mode::Mid3, [-1.0, 0.97], 0.1, 1.0 / 48.0), (0.75, true));
        assert!(exit.is_settled(&at(halves + 1, Mode::Sync12)), "a carrier needs no growth");
        assert!(exit.is_settled(&at(halves + 2, Mode::Mid7)), "nor does a pattern out of one");
    }

    /// Side of the circle, torque demanded, torque that is given, and whether the gates pause for its sign; six-step is 955 V.
    #[test]
    fn torque_keeps_its_side_while_voltage_forces_flux() {
        for (side_nm, demand_nm, given_nm, crosses) in [
            (Some(50.0), 5.0, 5.0, false),
            (Some(50.0), 3.0, 3.0, false),
            (Some(50.0), 2.5, 3.0, false),
            (Some(50.0), -2.5, 3.0, false),
            (Some(50.0), -500.0, 3.0, false),
            (Some(3.0), 2.5, 3.0, false),
            (Some(3.0), -2.5, 3.0, false),
            (Some(3.0), -3.5, 3.0, true),
            (Some(-3.0), 3.5, -3.0, true),
            (Some(-50.0), -5.0, -5.0, false),
            (Some(-50.0), -2.5, -3.0, false),
            // None is as the least positive one; before the first it is the demand's.
            (Some(0.0), -5.0, 3.0, true),
            (None, -5.0, -5.0, false),
            (None, 2.5, 3.0, false),
        ] {
            let mut forced = exit(side_nm);
            let got_nm = forced.one_sided(demand_nm, 500.0, 1_500.0, &RATINGS);
            assert!((got_nm - given_nm).abs() < 1e-5, "{side_nm:?} {demand_nm}: {got_nm}");
            assert_eq!(forced.crosses(), crosses, "{side_nm:?} {demand_nm}");
            // 1.1 times this EMF is more than the voltage.
            let mut free = exit(side_nm);
            assert_eq!(free.one_sided(demand_nm, 900.0, 1_500.0, &RATINGS), demand_nm);
            assert!(!free.crosses());
        }
    }

    #[test]
    fn a_pause_lasts_two_milliseconds_and_leaves_no_side() {
        let mut exit = exit(Some(3.0));
        exit.one_sided(-5.0, 500.0, 1_500.0, &RATINGS);
        exit.rest(1.9e-3);
        assert!(exit.crosses());
        exit.rest(0.2e-3);
        assert!(!exit.crosses());
        assert_eq!(exit.one_sided(-5.0, 500.0, 1_500.0, &RATINGS), -5.0);
    }
}
