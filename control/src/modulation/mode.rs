//! The modes: one row of a table each.
//!
//! A new pattern is a new row at the table's end, and its tests. Everything that asks about modes (modulator, schedule, control, wire,
//! traces, reports and command line) reads the rows; for the drive to use the pattern, name it in a [`Ladder`](super::Ladder).

#[cfg(feature = "optimal")]
use super::optimal::{self, Branch};
use super::schedule::Border;

/// The maker of a mode's pulses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// No pulses: all gates off.
    Rest,
    /// A triangular carrier: the mean voltage of each of its halves follows the command.
    Carrier,
    /// Middle 60°: whole edges of a flux hexagon, with a notch in each carrier.
    Pattern,
    /// Edges at angles from a table.
    #[cfg(feature = "optimal")]
    Optimal,
}

/// The quantities that control can regulate with a mode's pulses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Regulation {
    /// The mean voltage of each carrier half.
    Mean,
    /// Amplitude and angle of the fundamental, by the notches' width and the boundaries' instants.
    Fundamental,
    /// The angle alone: the amplitude is whatever the link gives.
    Angle,
    /// The flux along the pattern's own path, by moving its next edges.
    #[cfg(feature = "optimal")]
    Path,
}

/// A mode's flux ripple as a share of the fundamental flux, by the share of six-step that its fundamental lacks.
#[derive(Clone, Copy, Debug)]
pub(super) struct RippleShare {
    /// At six-step.
    pub least: f32,
    /// Per missing share.
    pub linear: f32,
    /// Per missing share squared.
    pub square: f32,
}

/// A mode as data, found in the table by one shift.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Row {
    name: &'static str,
    kind: Kind,
    pub regulation: Regulation,
    carriers: u8,
    turn_ons: u8,
    /// Largest fundamental without a notch, as a share of six-step: (1/√3)/(2/π) of a carrier.
    pub largest: f32,
    /// Loss of the fundamental as a share of six-step per sin(β/2), `2 Σ sin` of the notches' phase angles; 0 without notches.
    pub notch_sum: f32,
    /// The flux ripple that the pulses leave.
    pub ripple: RippleShare,
    /// The border at which the mode ends on the way up.
    pub until: Border,
    /// The angles of an optimised pattern.
    #[cfg(feature = "optimal")]
    pub branch: Option<&'static Branch>,
}

/// Ripple of square wave, and of every pattern whose notches have gone.
const WHOLE_RIPPLE: f32 = 0.046_4;

impl Row {
    /// A row of no pulses.
    const REST: Self = Self {
        name: "off",
        kind: Kind::Rest,
        regulation: Regulation::Mean,
        carriers: 0,
        turn_ons: 0,
        largest: 0.906_899_7,
        notch_sum: 0.0,
        ripple: RippleShare { least: 0.045_3, linear: 0.0, square: 0.0 },
        until: Border::NEVER,
        #[cfg(feature = "optimal")]
        branch: None,
    };

    /// A triangular carrier with min-max zero sequence, whose fundamental ends at udc/√3, with so many carriers a turn, 0 for a free
    /// one. Its ripple counts as that of 12.
    const fn carrier(name: &'static str, carriers: u8, until: Border) -> Self {
        Self { name, kind: Kind::Carrier, carriers, turn_ons: carriers, until, ..Self::REST }
    }

    /// Middle 60° with so many notches a sector, each in the middle of its carrier; the length of a carrier half must be a multiple
    /// of 5°.
    const fn middle60(
        name: &'static str,
        notches: u8,
        notch_sum: f32,
        [linear, square]: [f32; 2],
        until: Border,
    ) -> Self {
        assert!(60 / 5 % (2 * notches) == 0);
        Self {
            name,
            kind: Kind::Pattern,
            regulation: Regulation::Fundamental,
            carriers: 6 * notches,
            turn_ons: 2 * notches + 1,
            largest: 1.0,
            notch_sum,
            ripple: RippleShare { least: WHOLE_RIPPLE, linear, square },
            until,
            #[cfg(feature = "optimal")]
            branch: None,
        }
    }

    /// An optimised pattern.
    #[cfg(feature = "optimal")]
    const fn optimal(name: &'static str, branch: &'static Branch, until: Border) -> Self {
        let [least, linear, square] = branch.ripple;
        Self {
            name,
            kind: Kind::Optimal,
            regulation: Regulation::Path,
            carriers: (6 * branch.halves) as u8,
            turn_ons: (2 * branch.angles + 1) as u8,
            largest: branch.last,
            ripple: RippleShare { least, linear, square },
            until,
            branch: Some(branch),
            ..Self::REST
        }
    }
}

/// The modes and their rows, from one list. A mode's place in it is its code on every wire: rows are added at the end. Those behind
/// `optimal` exist with that feature only, in the ladder's order.
macro_rules! modes {
    (
        $($(#[$about:meta])* $mode:ident: $row:expr;)*
        @optimal { $($(#[$also:meta])* $optimal:ident: $name:literal, $branch:ident, $until:expr;)* }
    ) => {
        /// The pulse mode.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        #[non_exhaustive]
        pub enum Mode { $($(#[$about])* $mode,)* $(#[cfg(feature = "optimal")] $(#[$also])* $optimal,)* }

        #[cfg(not(feature = "optimal"))]
        impl Mode {
            /// Every mode, in the order of their codes.
            pub const ALL: [Self; [$(Self::$mode),*].len()] = [$(Self::$mode),*];
        }

        #[cfg(feature = "optimal")]
        impl Mode {
            /// Every mode, in the order of their codes.
            pub const ALL: [Self; [$(Self::$mode,)* $(Self::$optimal),*].len()] = [$(Self::$mode,)* $(Self::$optimal),*];

            /// The optimised patterns, from many pulses to few, and for each number of pulses from a small modulation index to a large one.
            pub(super) const OPTIMAL: [Self; [$(Self::$optimal),*].len()] = [$(Self::$optimal),*];
        }

        #[cfg(not(feature = "optimal"))]
        static ROWS: [Row; Mode::ALL.len()] = [$($row),*];
        #[cfg(feature = "optimal")]
        static ROWS: [Row; Mode::ALL.len()] = [$($row,)* $(Row::optimal($name, &optimal::$branch, $until)),*];
    };
}

// The borders' frequencies lie a little below what devices of 900 Hz allow (60, 75, 128.6, 180, 300 Hz), so that waiting for a legal
// angle on the steepest ramp stays within it. The modulation index alone does not end the asynchronous mode: at a low frequency a pattern of few
// pulses would leave more ripple than its additional tenth of voltage is worth.
modes! {
    /// All gates off.
    #[default]
    Off: Row::REST;
    /// Asynchronous SPWM with zero sequence at the highest switching frequency.
    Async: Row::carrier("async", 0, Border::new((40.0, 38.0), (f32::INFINITY, f32::INFINITY)));
    /// Synchronous, 15 carriers per turn.
    Sync15: Row::carrier("sync15", 15, Border::new((59.5, 57.0), (0.88, 0.84)));
    /// Synchronous, 12 carriers per turn.
    Sync12: Row::carrier("sync12", 12, Border::new((74.5, 72.0), (0.88, 0.84)));
    /// Middle 60°, 7 pulses: 18 carriers per turn with one notch each; 4 sin 70° + 2 of equation (17).
    Mid7: Row::middle60("mid7", 3, 5.758_77, [0.0, 0.079], Border::new((126.0, 121.0), (0.913, 0.885)));
    /// Middle 60°, 3 pulses: 6 carriers per turn with one notch each; 2 of equation (15).
    Mid3: Row::middle60("mid3", 1, 2.0, [0.01, 0.408], Border::new((297.0, 290.0), (0.990, 0.978)));
    /// Square wave: 6 carriers per turn without a notch, or with one if a link has jumped and less voltage is asked for.
    Square: Row {
        regulation: Regulation::Angle,
        turn_ons: 1,
        ..Row::middle60("square", 1, 2.0, [0.0, 0.0], Border::NEVER)
    };
    /// Middle 60°, 5 pulses: 12 carriers per turn with one notch each; 4 sin 75°. Not one of the paper's.
    Mid5: Row::middle60("mid5", 2, 3.863_703, [0.0, 0.15], Border::new((176.0, 171.0), (0.955, 0.935)));
    @optimal {
        /// Optimised, 15 pulses.
        Opp15: "opp15", OPP15, Border::new((59.5, 57.0), (0.57, 0.55));
        /// Optimised, 13 pulses, at a small modulation index.
        Opp13a: "opp13a", OPP13A, Border::new((68.5, 66.0), (0.635, 0.622));
        /// Optimised, 13 pulses, at a larger one.
        Opp13b: "opp13b", OPP13B, Border::new((68.5, 66.0), (0.78, 0.76));
        /// Optimised, 11 pulses.
        Opp11: "opp11", OPP11, Border::new((81.0, 78.5), (0.725, 0.705));
        /// Optimised, 9 pulses, at a small modulation index.
        Opp9a: "opp9a", OPP9A, Border::new((99.0, 96.0), (0.535, 0.52));
        /// Optimised, 9 pulses, at a larger one.
        Opp9b: "opp9b", OPP9B, Border::new((99.0, 96.0), (0.81, 0.79));
        /// Optimised, 7 pulses, at a small modulation index.
        Opp7a: "opp7a", OPP7A, Border::new((129.3, 128.4), (0.675, 0.66));
        /// Optimised, 7 pulses, at a medium one.
        Opp7b: "opp7b", OPP7B, Border::new((129.3, 128.4), (0.882, 0.867));
        /// Optimised, 7 pulses, at a large one.
        Opp7c: "opp7c", OPP7C, Border::new((129.3, 128.4), (0.945, 0.94));
        /// Optimised, 7 pulses, near six-step. The free carrier's share of the switching frequency makes 128.0 Hz of these 129.3.
        Opp7d: "opp7d", OPP7D, Border::new((129.3, 128.4), (0.967, 0.963));
        /// Optimised, 7 pulses, as near to six-step as they reach: where the drive weakens.
        Opp7e: "opp7e", OPP7E, Border::new((129.3, 128.4), (f32::INFINITY, f32::INFINITY));
        /// Optimised, 5 pulses, at a small modulation index.
        Opp5a: "opp5a", OPP5A, Border::new((177.0, 172.0), (0.81, 0.795));
        /// Optimised, 5 pulses, at a larger one.
        Opp5b: "opp5b", OPP5B, Border::new((177.0, 172.0), (0.932, 0.918));
        /// Optimised, 5 pulses, near six-step.
        Opp5c: "opp5c", OPP5C, Border::new((177.0, 172.0), (f32::INFINITY, f32::INFINITY));
        /// Optimised, 3 pulses.
        Opp3a: "opp3a", OPP3A, Border::new((297.0, 290.0), (0.935, 0.915));
        /// Optimised, 3 pulses, near six-step.
        Opp3b: "opp3b", OPP3B, Border::new((297.0, 290.0), (f32::INFINITY, f32::INFINITY));
    }
}

/// Room for modes on every wire: their codes have six bits.
pub const MODE_CODES: u32 = 64;
const _: () = assert!(Mode::ALL.len() <= MODE_CODES as usize);

impl Mode {
    #[inline(always)]
    pub(super) const fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }

    /// The mode with this code; `Off` for any other number.
    #[inline]
    pub fn from_code(code: u32) -> Self {
        Self::ALL.get(code as usize).copied().unwrap_or_default()
    }

    /// The mode with this name; `None` for any other text.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }

    /// The name in reports and on the command line.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// The common name of all branches with the same number of pulses: `opp7` of `opp7a` to `opp7e`; for any other mode its own.
    pub fn family(self) -> &'static str {
        if self.is_optimal() {
            self.name().trim_end_matches(|letter: char| letter.is_ascii_lowercase())
        } else {
            self.name()
        }
    }

    /// The mode with this name or, if it is a family's name, the branch that the drive plays at a modulation index on the way up;
    /// `None` for any other text.
    pub fn named_at(name: &str, index: f32) -> Option<Self> {
        let mut branches = Self::ALL.into_iter().filter(|mode| mode.family() == name);
        Self::named(name).or_else(|| {
            branches.clone().find(|mode| index < mode.row().until.highest_index()).or(branches.next_back())
        })
    }

    /// Carriers per turn of the pulse angle; 0 if the carrier is not locked to it.
    #[inline]
    pub const fn carriers(self) -> u32 {
        self.row().carriers as u32
    }

    /// Turn-ons of a device per turn of the pulse angle; 0 if the carrier is not locked to it.
    pub const fn turn_ons(self) -> u32 {
        self.row().turn_ons as u32
    }

    /// The quantities that control can regulate with its pulses.
    #[inline]
    pub const fn regulation(self) -> Regulation {
        self.row().regulation
    }

    /// `true` if its fundamental is all that the link gives.
    #[inline]
    pub const fn is_whole(self) -> bool {
        matches!(self.regulation(), Regulation::Angle)
    }

    /// `true` for a pattern of whole edges of a flux hexagon: middle 60° or square wave.
    #[inline]
    pub const fn is_pattern(self) -> bool {
        matches!(self.row().kind, Kind::Pattern)
    }

    /// The angles of an optimised pattern.
    #[cfg(feature = "optimal")]
    pub(super) const fn branch(self) -> Option<&'static Branch> {
        self.row().branch
    }

    /// `true` for an optimised pattern; none is built in without the feature `optimal`.
    #[inline(always)]
    pub const fn is_optimal(self) -> bool {
        #[cfg(feature = "optimal")]
        return matches!(self.row().kind, Kind::Optimal);
        #[cfg(not(feature = "optimal"))]
        return false;
    }

    /// Halves in a sector of 60° of a pattern.
    #[inline]
    pub const fn sector_halves(self) -> u32 {
        self.carriers() / 3
    }

    /// Carriers in a sector of 60° of a pattern, each with a notch or with room for one.
    pub(super) const fn notches(self) -> u32 {
        self.carriers() / 6
    }

    /// `true` for a mode whose flux differs from its fundamental at the boundaries: all patterns.
    #[inline(always)]
    pub const fn has_path(self) -> bool {
        self.is_pattern() || self.is_optimal()
    }

    /// `true` if the mean voltage of each carrier half follows the command: the modes with a triangular carrier.
    #[inline]
    pub const fn is_carrier(self) -> bool {
        matches!(self.row().kind, Kind::Carrier)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_of_the_paper_turns_on_as_often_as_its_name_says() {
        let paper = [("async", 0), ("sync15", 15), ("sync12", 12), ("mid7", 7), ("mid3", 3), ("square", 1)];
        for (name, turn_ons) in paper {
            let mode = Mode::named(name).unwrap();
            assert_eq!((mode.name(), mode.turn_ons()), (name, turn_ons));
        }
    }

    /// At the index at which a branch gives way on the way up, the next one is played.
    #[cfg(feature = "optimal")]
    #[test]
    fn at_its_border_a_branch_has_given_way() {
        let family = || Mode::ALL.into_iter().filter(|mode| mode.family() == "opp7");
        for (below, above) in family().zip(family().skip(1)) {
            let border = below.row().until.highest_index();
            assert_eq!(Mode::named_at("opp7", border), Some(above));
            assert_eq!(Mode::named_at("opp7", border * 0.999_999), Some(below));
        }
    }
}
