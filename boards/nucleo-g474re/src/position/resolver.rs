//! A resolver, excited by the control timer and read by two converters.
//!
//! TIM3's channel 2 toggles its pin once a control period: a square wave at half the control rate, in step with the samples. An amplifier with a
//! low-pass filter turns it into the resolver's excitation. The pin toggles so much earlier than midway between two samples that, after the lag of
//! filter and resolver, the windings' voltages are sampled at their peaks, sine by ADC3 and cosine by ADC5 at the same instant. The difference of two
//! samples, taken at peaks of opposite sign, is twice the winding's amplitude without the converters' offsets, and half a period old, which the power
//! stage tells the drive.
//!
//! The combined amplitude of both windings is known. Without excitation, or with one of them shorted while the other gives less than 70 %, it is too
//! small, and there is no angle. The board that the wires come to has to pull open wires beyond the converters' range.

use super::Position;
use crate::pins::{Function, Pin, Port, is_high, pin};
use crate::power_stage::PowerStage;
use crate::registers::Registers;
use crate::sampling::{Sampler, Sequence, configure_clock};
use crate::start::{StartError, Wait};
use stm32_metapac::gpio::Gpio;
use stm32_metapac::timer::vals;
use tractive::frames::{AlphaBeta, Angle};
use tractive::machine::Ratings;

/// The channel that excites, from 0, and its pin in port B.
const CHANNEL: usize = 1;
const EXCITATION: usize = 5;
/// One conversion at TIM3's update (its TRGO), which has the same number for all converters.
const fn sequence(channel: u8) -> Sequence {
    Sequence { channels: [channel; 4], count: 1, rejected: 0, trigger: 12 }
}
/// Codes that a sound winding's voltage never reaches.
const RAIL: u16 = 32;
const TOP: u16 = 4_095 - RAIL;
/// Least amplitude of both windings, as a share of the nominal one.
const LEAST: f32 = 0.7;
const MOST: f32 = 1.3;

/// A resolver whose shaft turns while the machine has `TURNS` electrical turns for each of its own, with windings of `AMPLITUDE` codes;
/// the pin toggles `TOGGLE_TICKS` after each sample.
#[derive(Clone, Copy)]
pub struct Resolver<const TURNS: u32, const AMPLITUDE: u16, const TOGGLE_TICKS: u16> {
    sine: Sampler,
    cosine: Sampler,
    port: Gpio,
    zero: Angle,
    /// Codes of the last sample.
    last: Option<[i32; 2]>,
}

impl<const TURNS: u32, const AMPLITUDE: u16, const TOGGLE_TICKS: u16> Position
    for Resolver<TURNS, AMPLITUDE, TOGGLE_TICKS>
{
    const PINS: &'static [Pin] = &[
        pin(Port::B, 5, Function::Alternate(2), &["TIM3_CH2"], "resolver, excitation"),
        pin(Port::B, 1, Function::Analog, &["ADC3_IN1"], "resolver, sine"),
        pin(Port::A, 9, Function::Analog, &["ADC5_IN2"], "resolver, cosine"),
    ];

    fn prepare(registers: &Registers, _stage: &PowerStage, wait: &mut dyn Wait) -> Result<(), StartError> {
        let timer = registers.tim3;
        timer.ccr(CHANNEL).write(|w| w.set_ccr(TOGGLE_TICKS));
        timer.ccmr_output(0).modify(|w| w.set_ocm(CHANNEL, vals::Ocm::TOGGLE));
        timer.ccer().modify(|w| w.set_cce(CHANNEL, true));
        configure_clock(registers.adc345);
        samplers(registers).iter().try_for_each(|sampler| sampler.prepare(wait))
    }

    fn follow(registers: &Registers, wait: &mut dyn Wait) {
        for sampler in samplers(registers) {
            sampler.refresh(wait);
            sampler.follow_timer();
        }
    }

    fn of(registers: &Registers, stage: &PowerStage, _ratings: &'static Ratings) -> Self {
        let [sine, cosine] = samplers(registers);
        Self { sine, cosine, port: registers.gpiob, zero: stage.encoder_zero, last: None }
    }

    /// `None` at the first sample, and if there is no excitation or a wire is open.
    #[inline]
    fn angle(&mut self) -> Option<Angle> {
        let positive = is_high(self.port, EXCITATION);
        let codes = [code(&self.sine), code(&self.cosine)];
        let [sine, cosine] = codes;
        let now = sine.zip(cosine).map(|(sine, cosine)| [sine, cosine]);
        let ([s, c], [s0, c0]) = (now?, core::mem::replace(&mut self.last, now)?);
        let sign = if positive { 1.0 } else { -1.0 };
        let winding = AlphaBeta { alpha: sign * (c - c0) as f32, beta: sign * (s - s0) as f32 };
        let amplitude = 2.0 * f32::from(AMPLITUDE);
        let [least, most] = [LEAST * amplitude, MOST * amplitude];
        let squared = winding.alpha * winding.alpha + winding.beta * winding.beta;
        let is_sound = squared > least * least && squared < most * most;
        is_sound.then(|| Angle(winding.angle().0.wrapping_mul(TURNS)) + self.zero)
    }
}

/// The converters of sine and cosine.
const fn samplers(registers: &Registers) -> [Sampler; 2] {
    [
        Sampler { adc: registers.adc3, sequence: sequence(1) },
        Sampler { adc: registers.adc5, sequence: sequence(2) },
    ]
}

/// A winding's code; `None` if the converter gave none, or is at an end of its range.
#[inline]
fn code(sampler: &Sampler) -> Option<i32> {
    let [first, ..] = sampler.read()?;
    (RAIL..=TOP).contains(&first.0).then_some(i32::from(first.0))
}
