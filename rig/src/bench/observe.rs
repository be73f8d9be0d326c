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
    /// Of an instant.
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

/// The larger one; what is no number stays, so that somebody sees it.
fn larger(most: f64, now: f64) -> f64 {
    if most.is_nan() || now <= most { most } else { now }
}

/// The limits that a sound plant keeps to: beyond them a fault makes a difference.
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
}

impl Limits {
    /// Everything is sound.
    pub const NONE: Self = Self {
        current_a: f64::INFINITY,
        udc_v: (f64::NEG_INFINITY, f64::INFINITY),
        uc_v: f64::INFINITY,
        source_v: f64::NEG_INFINITY,
        speed_rpm: f64::INFINITY,
    };

    fn holds(&self, now: &Peaks, speed_rpm: f64) -> bool {
        let (lowest_v, highest_v) = self.udc_v;
        now.current_a <= self.current_a
            && (lowest_v..=highest_v).contains(&now.udc_v)
            && now.uc_v <= self.uc_v
            && speed_rpm.abs() <= self.speed_rpm
    }
}

/// The energy that is stored when the gates become safe, and must go somewhere.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stored {
    /// The highest voltage from then on if the bridge were gone, in V: of the link, or of the ZS9's capacitors.
    pub unloaded_v: f64,
    /// Energy of the machines' fields, in J.
    pub field_j: f64,
    /// Energy that the rotors still give while the flux decays against the link, in J.
    pub braked_j: f64,
    /// Largest current of a machine that is short-circuited with the flux linkage that it has, in A.
    pub short_circuit_a: f64,
}

impl Stored {
    /// Of motors against which this voltage (V) stands when the gates are blocked.
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
    /// The time at which the fault first made a difference that is more than small, if that is known.
    pub effect: Option<Tick>,
    /// Length of a carrier at the fault's instant, in ticks.
    pub carrier_ticks: Tick,
    /// The time at which the gates were safe, and their safe state.
    pub safe: Option<(Tick, SafeState)>,
    /// The energy that was stored then.
    pub stored: Stored,
    /// Extremes until then.
    pub until: Peaks,
    /// And after that.
    pub after: Peaks,
    limits: Limits,
}

impl Observed {
    /// Nothing yet.
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
        }
    }

    /// The plant at an instant.
    pub fn note(&mut self, now: Tick, peaks: &Peaks, speed_rpm: f64) {
        if now < self.from {
            return;
        }
        if !self.limits.holds(peaks, speed_rpm) {
            self.makes_a_difference(now);
        }
        if self.safe.is_some() { &mut self.after } else { &mut self.until }.note(peaks);
    }

    /// The fault makes a difference now.
    pub fn makes_a_difference(&mut self, now: Tick) {
        if now >= self.from {
            self.effect.get_or_insert(now);
        }
    }

    /// The gates are safe from now on.
    pub fn enters(&mut self, now: Tick, safe: SafeState, stored: Stored) {
        if self.safe.is_none() {
            self.safe = Some((now, safe));
            self.stored = stored;
        }
    }

    /// From the fault's first effect, or from the fault where none is known, until the gates were safe, in ticks.
    pub fn ticks_to_safe(&self) -> Option<Tick> {
        let (safe, _) = self.safe?;
        let effect = self.effect.filter(|effect| *effect <= safe).unwrap_or(self.from);
        Some(safe.saturating_sub(effect))
    }
}
