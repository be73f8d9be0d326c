//! The effects of a fault: the extremes of currents and voltages until the gates are safe and after that.

use super::Tick;
use crate::plant::Motor;
use tractive::protection::SafeState;

/// Extremes, of an instant or over a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// Phase current, in A.
    pub current_a: f64,
    /// Lowest i_d, at most 0, in A; the ZS9's of both motors.
    pub lowest_id_a: f64,
    /// Link voltage, in V; the ZS9's outside shoot-through.
    pub udc_v: f64,
    /// The ZS9's capacitor voltage, in V.
    pub uc_v: f64,
}

impl Peaks {
    /// The extremes of an instant.
    pub fn at(currents_a: &[f64], id_a: f64, udc_v: f64, uc_v: f64) -> Self {
        let current_a = currents_a.iter().fold(0.0, |most, current| larger(most, current.abs()));
        Self { current_a, lowest_id_a: id_a.min(0.0), udc_v, uc_v }
    }

    fn note(&mut self, now: &Self) {
        self.current_a = larger(self.current_a, now.current_a);
        self.lowest_id_a = self.lowest_id_a.min(now.lowest_id_a);
        self.udc_v = larger(self.udc_v, now.udc_v);
        self.uc_v = larger(self.uc_v, now.uc_v);
    }
}

/// The larger one; a value that is not a number stays, so that it is noticed.
fn larger(most: f64, now: f64) -> f64 {
    if most.is_nan() || now <= most { most } else { now }
}

/// The limits within which a healthy plant stays: beyond them a fault makes a difference.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest phase current, in A.
    pub current_a: f64,
    /// Lowest and highest link voltage, in V.
    pub udc_v: (f64, f64),
    /// Highest capacitor voltage of the ZS9, in V.
    pub uc_v: f64,
    /// Lowest voltage of the ZS9's source, in V.
    pub source_v: f64,
    /// Highest speed, in r/min.
    pub speed_rpm: f64,
    /// Time between two samples, in ticks: an excess that is shorter need not be seen by anybody.
    pub sampling_ticks: Tick,
}

impl Limits {
    /// Limits that nothing exceeds.
    pub const NONE: Self = Self {
        current_a: f64::INFINITY,
        udc_v: (f64::NEG_INFINITY, f64::INFINITY),
        uc_v: f64::INFINITY,
        source_v: f64::NEG_INFINITY,
        speed_rpm: f64::INFINITY,
        sampling_ticks: 0,
    };

    fn holds(&self, now: &Peaks, speed_rpm: f64) -> bool {
        let (lowest_v, highest_v) = self.udc_v;
        now.current_a <= self.current_a
            && (lowest_v..=highest_v).contains(&now.udc_v)
            && now.uc_v <= self.uc_v
            && speed_rpm.abs() <= self.speed_rpm
    }
}

/// The stored energy when the gates become safe, which must go somewhere.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stored {
    /// The highest voltage from then on if the bridge were absent, in V: of the link, or of the ZS9's capacitors.
    pub unloaded_v: f64,
    /// Energy of the machines' fields, in J.
    pub field_j: f64,
    /// Energy that the rotors still give while the flux decays against the link, in J.
    pub braked_j: f64,
    /// Largest current of a machine that is short-circuited with its present flux linkage, in A.
    pub short_circuit_a: f64,
}

impl Stored {
    /// The stored energy of motors opposed by this voltage (V) when the gates are blocked.
    pub fn of(motors: &[Motor], against_v: f64, unloaded_v: f64) -> Self {
        Self {
            unloaded_v,
            field_j: motors.iter().map(Motor::field_j).sum(),
            braked_j: motors.iter().map(|motor| motor.braked_j(against_v)).sum(),
            short_circuit_a: motors.iter().map(Motor::short_circuit_peak_a).fold(0.0, f64::max),
        }
    }
}

/// The events from a fault's instant on.
#[derive(Clone, Copy, Debug)]
pub struct Observed {
    /// The fault's instant.
    pub from: Tick,
    /// The time at which the fault first made more than a small difference, if known.
    pub effect: Option<Tick>,
    /// Length of a carrier at the fault's instant, in ticks.
    pub carrier_ticks: Tick,
    /// The time at which the gates were safe, and their safe state.
    pub safe: Option<(Tick, SafeState)>,
    /// The stored energy at that time.
    pub stored: Stored,
    /// Extremes up to that time.
    pub until: Peaks,
    /// Extremes after that time.
    pub after: Peaks,
    limits: Limits,
    /// The times from which and until which something was last beyond its limits; a return within the limits for less than the time between two samples still
    /// counts as beyond.
    beyond: Option<(Tick, Tick)>,
}

impl Observed {
    /// Nothing observed yet.
    pub fn new(from: Tick, limits: Limits) -> Self {
        Self {
            from,
            effect: None,
            carrier_ticks: 0,
            safe: None,
            stored: Stored::default(),
            until: Peaks::default(),
            after: Peaks::default(),
            limits,
            beyond: None,
        }
    }

    /// Takes the plant's values at an instant.
    pub fn note(&mut self, now: Tick, peaks: &Peaks, speed_rpm: f64) {
        if now < self.from {
            return;
        }
        if !self.limits.holds(peaks, speed_rpm) {
            let since = self.beyond_lately(now).unwrap_or(now);
            self.beyond = Some((since, now));
            if now - since >= self.limits.sampling_ticks {
                self.makes_a_difference(since);
            }
        }
        if self.safe.is_some() { &mut self.after } else { &mut self.until }.note(peaks);
    }

    /// The time since which something is beyond its limits, or was until the last sample.
    fn beyond_lately(&self, now: Tick) -> Option<Tick> {
        let (since, until) = self.beyond?;
        (now.saturating_sub(until) <= self.limits.sampling_ticks).then_some(since)
    }

    /// Records that the fault makes a difference now.
    pub fn makes_a_difference(&mut self, now: Tick) {
        if now >= self.from {
            self.effect.get_or_insert(now);
        }
    }

    /// Records that the gates are safe from now on.
    pub fn enters(&mut self, now: Tick, safe: SafeState, stored: Stored) {
        if self.safe.is_none() {
            self.effect = self.effect.or(self.beyond_lately(now));
            self.safe = Some((now, safe));
            self.stored = stored;
        }
    }

    /// Time from the fault's first effect, or from the fault if no effect is known, until the gates were safe, in ticks.
    pub fn ticks_to_safe(&self) -> Option<Tick> {
        let (safe, _) = self.safe?;
        let effect = self.effect.filter(|effect| *effect <= safe).unwrap_or(self.from);
        Some(safe.saturating_sub(effect))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A peak shorter than a sampling period need not be seen; a peak followed by a trip has been seen.
    #[test]
    fn a_limit_counts_from_where_a_sample_sees_it() {
        let limits =
            Limits { udc_v: (900.0, 2_000.0), current_a: 300.0, sampling_ticks: 100, ..Limits::NONE };
        let observed = |seen: &[(Tick, f64, f64)]| {
            let mut observed = Observed::new(10, limits);
            for (now, udc_v, current_a) in seen {
                observed.note(*now, &Peaks { udc_v: *udc_v, current_a: *current_a, ..Peaks::default() }, 0.0);
            }
            observed
        };
        for beyond in [(899.9, 0.0), (2_000.1, 0.0), (1_500.0, 301.0), (1_500.0, f64::NAN)] {
            let at = |now: Tick| (now, beyond.0, beyond.1);
            let within = |now: Tick| (now, 1_500.0, 0.0);
            assert_eq!(observed(&[at(20), at(119), within(130)]).effect, None);
            assert_eq!(observed(&[at(20), within(21), at(122)]).effect, None, "another one");
            assert_eq!(observed(&[at(20), within(60), at(120)]).effect, Some(20), "{beyond:?}");
            for (tripped, took) in [(120, 100), (121, 111)] {
                let mut observed = observed(&[at(20), within(21)]);
                observed.enters(tripped, SafeState::GatesOff, Stored::default());
                assert_eq!(observed.ticks_to_safe(), Some(took), "since the last peak, or since the fault");
            }
        }
    }
}
