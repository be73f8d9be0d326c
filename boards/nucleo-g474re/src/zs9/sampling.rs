//! The ZS9's conversions: the same at every valley and every peak of the carrier, started by TIM1's update (its TRGO2).
//!
//! | rank | ADC1 | ADC2 | ADC3 |
//! |---|---|---|---|
//! | 1 | upper motor, U | upper motor, W | inductor |
//! | 2 | upper motor, V | lower motor, W | |
//! | 3 | lower motor, U | capacitors | |
//! | 4 | lower motor, V | source | |
//!
//! Each interrupt reads the conversions of its own beat: on entry, the PWM interrupt discards those of a valley that nobody read, long before its own
//! conversions are complete (2.4 µs), and control reads those taken at the peak before.

use super::stage::{STAGE, Zs9Stage};
use crate::power_stage::AdcCode;
use crate::registers::Registers;
use crate::sampling::{self, Sampler, Sequence};
use crate::start::{StartError, Wait};
use tractive::frames::Abc;

/// JSQR.JEXTSEL: TIM1_TRGO2, for all three converters.
const TRIGGER: u8 = 8;

const FIRST: Sequence = Sequence { channels: [2, 7, 15, 5], count: 4, rejected: 0, trigger: TRIGGER };
const SECOND: Sequence = Sequence { channels: [14, 4, 6, 9], count: 4, rejected: 0, trigger: TRIGGER };
const THIRD: Sequence = Sequence { channels: [1; 4], count: 1, rejected: 0, trigger: TRIGGER };

/// Codes at no current: U, V, W of the upper motor, of the lower motor, inductor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Zeros {
    /// Of the motors.
    pub motors: [[AdcCode; 3]; 2],
    /// Of the inductor.
    pub inductor: AdcCode,
}

/// The three converters.
#[derive(Clone, Copy)]
pub struct Samplers {
    first: Sampler,
    second: Sampler,
    third: Sampler,
}

/// One beat's conversions, in SI units; NaN, which the drive's protection reports by name, if a converter gave nothing.
#[derive(Clone, Copy, Debug)]
pub struct Converted {
    /// Phase currents, in A.
    pub currents_a: [Abc; 2],
    /// Capacitor voltage, in V.
    pub capacitor_v: f32,
    /// Source voltage, in V.
    pub source_v: f32,
}

impl Samplers {
    /// The chip's own, or a test's.
    pub const fn new(registers: &Registers) -> Self {
        Self {
            first: Sampler { adc: registers.adc1, sequence: FIRST },
            second: Sampler { adc: registers.adc2, sequence: SECOND },
            third: Sampler { adc: registers.adc3, sequence: THIRD },
        }
    }

    const fn all(&self) -> [Sampler; 3] {
        [self.first, self.second, self.third]
    }

    /// Clocks, calibrates and enables the converters; measures the zeros of the current sensors while no current flows.
    pub fn prepare(
        &self,
        registers: &Registers,
        stage: &Zs9Stage,
        wait: &mut dyn Wait,
    ) -> Result<Zeros, StartError> {
        sampling::configure_clock(registers.adc12);
        sampling::configure_clock(registers.adc345);
        for sampler in self.all() {
            sampler.prepare(wait)?;
        }
        let [u1, v1, u2, v2] = self.first.means(wait)?;
        let [w1, w2, ..] = self.second.means(wait)?;
        let [inductor, ..] = self.third.means(wait)?;
        let zero = |code| stage.common.check_zero(code);
        Ok(Zeros {
            motors: [[zero(u1)?, zero(v1)?, zero(w1)?], [zero(u2)?, zero(v2)?, zero(w2)?]],
            inductor: zero(inductor)?,
        })
    }

    /// Converts once on command, as a dummy; see [`Sampler::refresh`].
    pub fn refresh(&self, wait: &mut dyn Wait) {
        self.all().iter().for_each(|sampler| sampler.refresh(wait));
    }

    /// From now on the carrier starts the conversions.
    pub fn follow_timer(&self) {
        self.all().iter().for_each(Sampler::follow_timer);
    }

    /// Discards the conversions that are complete by now: they belong to an earlier beat.
    #[inline]
    pub fn forget(&self) {
        self.first.forget();
        self.second.forget();
    }

    /// This beat's conversions.
    #[inline]
    pub fn read(&self, zeros: &Zeros) -> Converted {
        let (Some([u1, v1, u2, v2]), Some([w1, w2, capacitor, source])) =
            (self.first.read(), self.second.read())
        else {
            let nothing = Abc { a: f32::NAN, b: f32::NAN, c: f32::NAN };
            return Converted { currents_a: [nothing; 2], capacitor_v: f32::NAN, source_v: f32::NAN };
        };
        let amperes = |code: AdcCode, zero: AdcCode| code.above(zero) * STAGE.common.current_a_per_code;
        let [[zu1, zv1, zw1], [zu2, zv2, zw2]] = zeros.motors;
        Converted {
            currents_a: [
                Abc { a: amperes(u1, zu1), b: amperes(v1, zv1), c: amperes(w1, zw1) },
                Abc { a: amperes(u2, zu2), b: amperes(v2, zv2), c: amperes(w2, zw2) },
            ],
            capacitor_v: f32::from(capacitor.0) * STAGE.common.udc_v_per_code,
            source_v: f32::from(source.0) * STAGE.source_v_per_code,
        }
    }

    /// The inductor current, in A.
    #[inline]
    pub fn inductor_a(&self, zeros: &Zeros) -> f32 {
        match self.third.read() {
            Some([code, ..]) => code.above(zeros.inductor) * STAGE.inductor_a_per_code,
            None => f32::NAN,
        }
    }
}
