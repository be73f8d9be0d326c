//! A source that cannot take current back: the instants at which the diode begins and ends to conduct.
//!
//! With `x = i1 + i2 − i_demand`, the source gives x while x > 0. While x < 0 the bridge cannot get what its gates ask for: its own diodes conduct
//! from rail to rail and short the link, which feeds the inductors from the capacitors until x = 0. Then the link takes the voltage that holds x
//! there, between 0 and its voltage under the source.
//!
//! With a bidirectional source the link can only fall to zero: if `v1 + v2` would fall below the source, the diodes of the bridge conduct from rail
//! to rail until the inductors raise it again.

use super::bridge::Bridge;
use super::step::{Feed, Trial};
use super::{NONE_V, Source, Zs9Plant};

/// Excess that counts as zero, in A.
const NONE_A: f64 = 1e-6;
/// Longest step while neither source nor diodes conduct, in s: short enough to follow the holding voltage.
const LONGEST_BLOCKED_S: f64 = 5e-6;
/// Shortest step, in s, so that time advances even if conduction changes at once.
const SHORTEST_S: f64 = 1e-10;
/// Halvings of a step in which conduction changes.
const HALVINGS: u32 = 40;

impl Zs9Plant {
    /// Makes a step of at most `longest_s`, shorter if conduction changes. Returns its length, in s.
    pub(super) fn step(&mut self, bridge: &Bridge, longest_s: f64) -> f64 {
        if *bridge == Bridge::Short {
            return self.step_with(bridge, Feed::Short, longest_s);
        }
        let feed = match self.source {
            Source::Bidirectional if self.link_v() > NONE_V || self.rising_a(bridge) > 0.0 => Feed::Source,
            Source::Bidirectional => Feed::Clamped,
            Source::Diode => self.feed(bridge),
        };
        self.step_to_change(bridge, feed, longest_s)
    }

    fn step_with(&mut self, bridge: &Bridge, feed: Feed, dt_s: f64) -> f64 {
        let trial = self.try_step(bridge, feed, dt_s);
        self.take_at(&trial, bridge, feed);
        dt_s
    }

    /// Takes a step, and stores the link's voltage after it.
    fn take_at(&mut self, trial: &Trial, bridge: &Bridge, feed: Feed) {
        self.take(trial);
        self.bridge_v = self.link_now_v(bridge, feed);
    }

    fn step_to_change(&mut self, bridge: &Bridge, feed: Feed, longest_s: f64) -> f64 {
        let longest_s = if feed == Feed::Blocked { longest_s.min(LONGEST_BLOCKED_S) } else { longest_s };
        let trial = self.try_step(bridge, feed, longest_s);
        if self.holds(bridge, feed, &trial) {
            self.take_at(&trial, bridge, feed);
            return longest_s;
        }
        // The longest step within which nothing changes, and a little more, so that the change has occurred.
        let (mut low, mut high) = (0.0, longest_s);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let stays = self.holds(bridge, feed, &self.try_step(bridge, feed, middle));
            if stays { low = middle } else { high = middle }
        }
        self.step_with(bridge, feed, high.max(SHORTEST_S.min(longest_s)))
    }

    /// The path that conducts now.
    fn feed(&self, bridge: &Bridge) -> Feed {
        let excess = self.excess_a(bridge);
        if excess > NONE_A {
            return Feed::Source;
        }
        if excess < -NONE_A {
            return Feed::Short;
        }
        match self.holding_share(bridge) {
            share if share >= 1.0 => Feed::Source,
            share if share <= 0.0 => Feed::Short,
            _ => Feed::Blocked,
        }
    }

    /// `true` if the same path still conducts after a step.
    fn holds(&self, bridge: &Bridge, feed: Feed, trial: &Trial) -> bool {
        match feed {
            Feed::Source if self.source == Source::Bidirectional => self.link_after_v(trial) >= -NONE_V,
            Feed::Clamped => self.rising_after(bridge, trial) <= NONE_A,
            Feed::Source => self.excess_after(bridge, trial) >= -0.5 * NONE_A,
            Feed::Short => self.excess_after(bridge, trial) <= 0.5 * NONE_A,
            Feed::Blocked => true,
        }
    }
}
