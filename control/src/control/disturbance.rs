//! The integral part of the current loop.
//!
//! Between two carrier boundaries the flux should change by the volt-seconds that really acted, less the resistive
//! drop. The part that the committed voltages leave unexplained is integrated into a disturbance voltage in the rotor frame: its mean
//! (resistance, a wrong map) and, under a carrier, its parts at six times the stator frequency, forward and backward
//! (dead time: the fifth and seventh harmonic). Because it compares with the voltages that acted, not with those that were asked
//! for, limits and reference steps do not wind it up.

use super::{Boundary, Gains, RotorSample};
use crate::frames::{AlphaBeta, Angle, Dq, SinCos};

/// The disturbance voltage and the state it is learnt from.
#[derive(Clone, Copy, Debug)]
pub struct Observer {
    /// Flux linkage at the last boundary, stationary frame, in Wb.
    last_flux: Option<AlphaBeta>,
    mean: Dq,
    /// Amplitudes of the cosine and the sine of six times the rotor angle, in V: the parts that turn with it and against it.
    cosine: Dq,
    sine: Dq,
    follows_sixth: bool,
    /// The whole estimate at the last boundary, in V.
    latest: Dq,
}

/// A boundary, and what was seen there.
pub struct Input<'a> {
    pub boundary: &'a Boundary,
    pub sample: &'a RotorSample,
    /// Electrical, in rad/s.
    pub omega: f32,
    /// The drop of the current in the resistance, in V.
    pub drop_v: Dq,
    /// `true` if the sixth harmonic is slow enough to be followed.
    pub sixth: bool,
}

impl Observer {
    /// No disturbance known yet.
    pub const fn new() -> Self {
        const ZERO: Dq = Dq { d: 0.0, q: 0.0 };
        Self { last_flux: None, mean: ZERO, cosine: ZERO, sine: ZERO, follows_sixth: false, latest: ZERO }
    }

    /// Takes a mean disturbance, in V, that is known beforehand.
    pub fn expect(&mut self, mean: Dq) {
        self.mean = mean;
    }

    /// The mean disturbance, in V, rotor frame: flux rises by it although nobody asked.
    pub fn mean(&self) -> Dq {
        self.mean
    }

    /// The whole disturbance that was expected at the last boundary, in V. For a rotor that seems to stand, its mean and its sixth harmonic
    /// are one.
    pub fn latest(&self) -> Dq {
        self.latest
    }

    /// The disturbance with the rotor at the angle of a direction, in V.
    #[inline]
    pub fn voltage(&self, rotor: SinCos) -> Dq {
        if !self.follows_sixth {
            return self.mean;
        }
        self.at(rotor.sixfold())
    }

    fn at(&self, sixth: SinCos) -> Dq {
        self.mean + self.cosine * sixth.cos + self.sine * sixth.sin
    }

    /// Takes a boundary that has passed; the voltage of its half that nothing explains, in V, rotor frame, if it is known what acted.
    #[inline(always)]
    pub(super) fn step(&mut self, input: &Input, gains: &Gains) -> Option<Dq> {
        let Input { boundary, sample, omega, .. } = *input;
        let flux = sample.flux.unpark(sample.frame);
        let half_turn = Angle::within_half_turn(0.5 * omega * boundary.length_s).sin_cos();
        let per_length = 1.0 / boundary.length_s;
        let last = self.last_flux.replace(flux);
        let (last, volt_seconds) = last.zip(boundary.volt_seconds)?;
        let middle = sample.frame.turned(half_turn.back());
        let voltage = (flux - last - volt_seconds).park(middle) * per_length + input.drop_v;
        self.learn(voltage, middle, input.sixth, gains.observer);
        Some(voltage)
    }

    #[inline(always)]
    fn learn(&mut self, voltage: Dq, rotor: SinCos, follow_sixth: bool, gain: f32) {
        self.follows_sixth = follow_sixth;
        if !follow_sixth {
            self.cosine = Dq::default();
            self.sine = Dq::default();
            self.mean = self.mean + (voltage - self.mean) * gain;
            self.latest = self.mean;
            return;
        }
        let sixth = rotor.sixfold();
        self.latest = self.at(sixth);
        let error = (voltage - self.latest) * gain;
        self.mean = self.mean + error;
        // Both parts move by the error: the one that turns with the angle, and the one against it.
        self.cosine = self.cosine + error * (2.0 * sixth.cos);
        self.sine = self.sine + error * (2.0 * sixth.sin);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::{Committed, ModeLimits, Target, current_loop};
    use super::*;
    use std::vec::Vec;

    /// Length of a half, in s; the disturbance, in V; the reference of the flux linkage, in Wb.
    const HALF_S: f32 = 0.5e-3;
    const DISTURBANCE_V: f32 = 20.0;
    const REFERENCE_WB: f32 = 1.0;

    /// The input as seen at standstill, without resistance.
    fn seen<'a>(boundary: &'a Boundary, sample: &'a RotorSample) -> Input<'a> {
        Input { boundary, sample, omega: 0.0, drop_v: Dq::default(), sixth: false }
    }

    /// The loop at standstill without resistance, with a flux linkage of 0.9 Wb at first: for each half the error in Wb, the unlimited voltage
    /// asked for, the voltage that acts and the estimate before it, in V.
    fn driven(halves: usize, limit_v: f32) -> Vec<[f32; 4]> {
        let (mut observer, mut flux, mut acted_v) = (Observer::new(), 0.9, None);
        let at_rest = Angle::ZERO.sin_cos();
        let mut found = Vec::new();
        for _ in 0..halves {
            let along_d = |wb: f32| Dq { d: wb, q: 0.0 };
            let sample = RotorSample { frame: at_rest, current: Dq::default(), flux: along_d(flux) };
            let volt_seconds = acted_v.map(|volts: f32| AlphaBeta { alpha: volts * HALF_S, beta: 0.0 });
            let boundary = Boundary { volt_seconds, length_s: HALF_S };
            let seen = seen(&boundary, &sample);
            observer.step(&seen, &Gains::DEFAULT);
            let none = Some(AlphaBeta::default());
            let committed =
                Committed { horizon_s: 0.0, volt_seconds: none, ripple_wb: None, interval_s: HALF_S };
            let target = Target { flux: along_d(REFERENCE_WB), voltage_limit_v: limit_v, ..Target::NONE };
            let output = current_loop::step(
                &current_loop::Input {
                    ahead: &current_loop::ahead(&sample, at_rest, &committed, &observer, Dq::default()),
                    disturbance: &observer,
                    target: &target,
                    omega: 0.0,
                    committed: &committed,
                    limits: &ModeLimits::carrier(0.9),
                    drop_v: Dq::default(),
                    max_switching_hz: 900.0,
                },
                &Gains::DEFAULT,
            );
            let (error, estimate) = (flux - REFERENCE_WB, observer.mean().d);
            let acts_v = output.voltage.vector.d;
            found.push([error, -Gains::DEFAULT.carrier / HALF_S * error - estimate, acts_v, estimate]);
            flux += (acts_v + DISTURBANCE_V) * HALF_S;
            acted_v = Some(acts_v);
        }
        found
    }

    /// The voltage is that of a PI on the error, its integral held back by the voltage that did not act.
    fn is_a_pi(halves: &[[f32; 4]]) {
        let Gains { carrier: g, observer: k, .. } = Gains::DEFAULT;
        let (first, mut integral_v) = (halves[0][0], 0.0);
        for (number, [error, wanted_v, acts_v, _]) in halves.iter().enumerate() {
            let pi_v = -(g + k) / HALF_S * error - integral_v + k / HALF_S * first;
            assert!((wanted_v - pi_v).abs() < 0.05, "half {number}: {wanted_v} V, a PI {pi_v} V");
            integral_v += k * g / HALF_S * error - k * (acts_v - wanted_v);
        }
    }

    #[test]
    fn with_the_loop_it_is_a_pi() {
        let halves = driven(400, 1e6);
        is_a_pi(&halves);
        let last = halves[399];
        assert!(last[0].abs() < 1e-4 && (last[3] - DISTURBANCE_V).abs() < 0.05, "{last:?}");
    }

    #[test]
    fn at_a_limit_it_is_one_with_back_calculation() {
        let halves = driven(400, 10.0);
        is_a_pi(&halves);
        // 11.5 V against 20 V: the error grows for ever, and the estimate remains that of the disturbance.
        assert!(halves[399][0] > 1.0 && halves[399][3] < DISTURBANCE_V + 0.05, "{:?}", halves[399]);
    }

    /// The estimates at standstill for a voltage that is present, in V, at each of so many boundaries.
    fn estimates(voltages: impl Iterator<Item = f32>, gains: &Gains) -> Vec<f32> {
        let (mut observer, mut flux) = (Observer::new(), 0.0);
        let none = Some(AlphaBeta::default());
        let boundary = Boundary { volt_seconds: none, length_s: HALF_S };
        let step = |volts: f32| {
            flux += volts * HALF_S;
            let sample = RotorSample {
                frame: Angle::ZERO.sin_cos(),
                current: Dq::default(),
                flux: Dq { d: flux, q: 0.0 },
            };
            let seen = seen(&boundary, &sample);
            observer.step(&seen, gains);
            observer.mean().d
        };
        voltages.map(step).collect()
    }

    /// The integral part learns half of a step within 50 halves, a seventh of a turn at 900 Hz and 10 Hz; of values that are random from half to
    /// half, like the ripple that a sample does not resolve, an eighth comes through at most.
    #[test]
    fn it_is_quick_enough_for_a_step_and_slow_enough_for_noise() {
        let step = estimates(std::iter::repeat_n(1.0, 51), &Gains::DEFAULT);
        assert!(step[50] > 0.5, "{}", step[50]);
        let mut state = 1_u32;
        let noise: Vec<f32> = (0..20_000)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / 8_388_608.0 - 1.0
            })
            .collect();
        let rms = |of: &[f32]| (of.iter().map(|value| value * value).sum::<f32>() / of.len() as f32).sqrt();
        let through = rms(&estimates(noise.iter().copied(), &Gains::DEFAULT)) / rms(&noise);
        assert!(through < 0.125, "{through}");
    }
}
