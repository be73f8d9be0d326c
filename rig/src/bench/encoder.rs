//! An incremental encoder: it counts from power-up, and has no angle until it is given one or its index passes.

use tractive::frames::Angle;
use tractive::machine::Ratings;
use tractive::start_up::axis_error;

/// Share of an error found at an index that is left after each sample, as a number of bits: the angle is corrected over some hundreds of samples,
/// without a visible step.
const MENDING_BITS: u32 = 7;

/// The reading of a position sensor.
#[derive(Clone, Copy, Debug)]
pub struct Position {
    /// The electrical angle, if it is known.
    pub angle: Option<Angle>,
    /// The electrical turn since the sensor was switched on, if the angle is not known.
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
    /// The angle that the first sample is stated to have had.
    zero: Option<Angle>,
    indexed: bool,
}

impl Encoder {
    /// Made for a machine whose rotor is this many mechanical turns after an index, 0 ..= 1, at power-up.
    pub fn new(ratings: &'static Ratings, turns: f64) -> Self {
        let pole_pairs = f64::from(ratings.pole_pairs);
        let turns = turns * pole_pairs;
        Self { ratings, pole_pairs, turns, last: None, first: Angle::ZERO, zero: None, indexed: false }
    }

    /// Electrical turns from the index to the rotor's position when the encoder was switched on.
    pub fn turns(&self) -> f64 {
        self.turns
    }

    /// Takes the angle of the first sample, found by the drive; returns by how many degrees it is ahead: for a machine without magnets, modulo half a
    /// turn.
    pub fn align(&mut self, zero: Angle) -> f64 {
        self.zero = self.zero.or(Some(zero));
        f64::from(axis_error(self.ratings, zero - self.first).signed()) / 4_294_967_296.0 * 360.0
    }

    /// The reading when the rotor has this angle.
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
