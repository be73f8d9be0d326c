//! What a fault did: the extremes of currents and link until the gates are safe and after that.

use super::Tick;
use crate::plant::Plant;
use tractive::protection::SafeState;

/// Extremes over a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// Largest phase current, in A.
    pub current_a: f64,
    /// Largest link voltage, in V.
    pub udc_v: f64,
}

impl Peaks {
    fn note(&mut self, currents_a: [f64; 3], udc_v: f64) {
        let current_a = currents_a.into_iter().fold(0.0_f64, |most, current| most.max(current.abs()));
        self.current_a = self.current_a.max(current_a);
        self.udc_v = self.udc_v.max(udc_v);
    }
}

/// What a sound plant keeps to: beyond it a fault makes a difference.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest phase current, in A.
    pub current_a: f64,
    /// Lowest and highest link voltage, in V.
    pub udc_v: (f64, f64),
    /// Highest speed, in r/min.
    pub speed_rpm: f64,
}

impl Limits {
    /// Everything is sound.
    pub const NONE: Self = Self {
        current_a: f64::INFINITY,
        udc_v: (f64::NEG_INFINITY, f64::INFINITY),
        speed_rpm: f64::INFINITY,
    };
}

/// What happened from a fault's instant on.
#[derive(Clone, Copy, Debug)]
pub struct Observed {
    /// The fault's instant.
    pub from: Tick,
    /// When the fault first made a difference that is more than small, if that is known.
    pub effect: Option<Tick>,
    /// Length of a carrier at the fault's instant, in ticks.
    pub carrier_ticks: Tick,
    /// When the gates were safe, and how.
    pub safe: Option<(Tick, SafeState)>,
    /// The highest link voltage from then on if the inverter were gone, in V.
    pub unloaded_v: f64,
    /// Energy of the machine's field then, in J.
    pub field_at_safe_j: f64,
    /// Energy that the rotor then still gives while the machine's flux decays against the link, in J.
    pub braked_at_safe_j: f64,
    /// Largest current of the short-circuited machine with the flux linkage that it has then, in A.
    pub forced_a: f64,
    limits: Limits,
    /// Extremes until then.
    pub until: Peaks,
    /// And after that.
    pub after: Peaks,
}

impl Observed {
    /// Nothing yet.
    pub fn new(from: Tick, limits: Limits) -> Self {
        Self {
            from,
            effect: None,
            carrier_ticks: 0,
            safe: None,
            unloaded_v: 0.0,
            field_at_safe_j: 0.0,
            braked_at_safe_j: 0.0,
            forced_a: 0.0,
            limits,
            until: Peaks::default(),
            after: Peaks::default(),
        }
    }

    /// The plant at an instant.
    pub fn note(&mut self, now: Tick, currents_a: [f64; 3], udc_v: f64, speed_rpm: f64) {
        if now >= self.from {
            let Limits { current_a, udc_v: (lowest_v, highest_v), speed_rpm: fastest_rpm } = self.limits;
            if currents_a.iter().any(|current| current.abs() > current_a)
                || !(lowest_v..=highest_v).contains(&udc_v)
                || speed_rpm.abs() > fastest_rpm
            {
                self.makes_a_difference(now);
            }
            let peaks = if self.safe.is_some() { &mut self.after } else { &mut self.until };
            peaks.note(currents_a, udc_v);
        }
    }

    /// The fault makes a difference now.
    pub fn makes_a_difference(&mut self, now: Tick) {
        if now >= self.from {
            self.effect.get_or_insert(now);
        }
    }

    /// The gates are safe from now on, at a link of `udc_v`; without the inverter it would reach `unloaded_v`.
    pub fn enters(&mut self, now: Tick, safe: SafeState, unloaded_v: f64, udc_v: f64, plant: &Plant) {
        if self.safe.is_none() {
            self.safe = Some((now, safe));
            self.unloaded_v = unloaded_v;
            self.braked_at_safe_j = plant.braked_j(udc_v);
            (self.field_at_safe_j, self.forced_a) = (plant.field_j(), plant.short_circuit_peak_a());
        }
    }

    /// From the fault's first effect, or from the fault where none is known, until the gates were safe, in ticks.
    pub fn ticks_to_safe(&self) -> Option<Tick> {
        let (safe, _) = self.safe?;
        let effect = self.effect.filter(|effect| *effect <= safe).unwrap_or(self.from);
        Some(safe.saturating_sub(effect))
    }
}
