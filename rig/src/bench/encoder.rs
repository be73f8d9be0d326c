//! An incremental encoder: it counts from where it is switched on, and has no angle before somebody tells it one, or its index passes.

use tractive::frames::Angle;
use tractive::machine::Ratings;
use tractive::start_up::axis_error;

/// Share of what an index has shown to be wrong that is left after each sample, as a number of bits: the angle mends in some
/// hundreds of samples, and nobody sees a step.
const MENDING_BITS: u32 = 7;

/// The reading of a position sensor.
#[derive(Clone, Copy, Debug)]
pub struct Position {
    /// The electrical angle, if it is known.
    pub angle: Option<Angle>,
    /// The turn since the sensor was switched on, electrical, where it is not.
    pub counted: Option<Angle>,
}

/// The encoder.
#[derive(Clone, Copy, Debug)]
pub struct Encoder {
    ratings: &'static Ratings,
    pole_pairs: f64,
    /// The rotor's electrical turns since an index.
    turns: f64,
    /// Angle of the last sample, and of the first.
    last: Option<Angle>,
    first: Angle,
    /// The angle that the first sample is said to have had.
    zero: Option<Angle>,
    indexed: bool,
}

impl Encoder {
    /// Of a machine, its rotor so many mechanical turns behind an index, 0 ..= 1, when it is switched on.
    pub fn new(ratings: &'static Ratings, turns: f64) -> Self {
        let pole_pairs = f64::from(ratings.pole_pairs);
        let turns = turns * pole_pairs;
        Self { ratings, pole_pairs, turns, last: None, first: Angle::ZERO, zero: None, indexed: false }
    }

    /// Electrical turns from the index to where the rotor stood when the encoder was switched on.
    pub fn turns(&self) -> f64 {
        self.turns
    }

    /// Takes the angle of the first sample from somebody who has found it; returns by how much that is ahead, in degrees: of a machine without magnets but
    /// for half a turn.
    pub fn align(&mut self, zero: Angle) -> f64 {
        self.zero = self.zero.or(Some(zero));
        f64::from(axis_error(self.ratings, zero - self.first).signed()) / 4_294_967_296.0 * 360.0
    }

    /// The reading where the rotor has this angle.
    pub fn read(&mut self, angle: Angle) -> Position {
        let Some(last) = self.last.replace(angle) else {
            self.first = angle;
            return Position { angle: None, counted: Some(Angle::ZERO) };
        };
        let before = (self.turns / self.pole_pairs).floor();
        self.turns += f64::from((angle - last).signed()) / 4_294_967_296.0;
        self.indexed |= before != (self.turns / self.pole_pairs).floor();
        let counted = angle - self.first;
        if self.indexed {
            let zero = self.zero.get_or_insert(self.first);
            let left = axis_error(self.ratings, *zero - self.first).signed();
            *zero = Angle((zero.signed().wrapping_sub(left >> MENDING_BITS)) as u32);
        }
        let angle = self.zero.map(|zero| zero + counted);
        Position { angle, counted: angle.is_none().then_some(counted) }
    }
}
