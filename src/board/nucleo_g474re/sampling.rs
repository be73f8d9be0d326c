//! The converters: injected sequences that a timer's update triggers, and the zeros of the current sensors.
//!
//! ADC1 belongs to the control interrupt, ADC2 to the PWM interrupt. Both have the currents on the same pins, so each interrupt
//! has samples of its own instant. A sequence's conversions follow each other within 0.6 µs.

use super::power_stage::{AdcCode, PowerStage};
use super::start::{StartError, Wait};
use crate::frames::Abc;
use stm32_metapac::{adc, adccommon};

/// A sequence's channels, and the timer event that starts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence {
    /// Channels of the currents of U, V, W, and of the link voltage.
    pub channels: [u8; 4],
    /// How many of them are converted.
    pub count: u8,
    /// JSQR.JEXTSEL.
    pub trigger: u8,
}

/// PA1, PC1, PB11, PC0: the same numbers on ADC1 and ADC2.
const CHANNELS: [u8; 4] = [2, 7, 14, 6];

/// ADC1: currents and link voltage at TIM3's update (its TRGO).
pub const CONTROL: Sequence = Sequence { channels: CHANNELS, count: 4, trigger: 12 };

/// ADC2: currents at TIM1's update (its TRGO2).
pub const PWM: Sequence = Sequence { channels: CHANNELS, count: 3, trigger: 8 };

/// Conversions that are averaged to find a sensor's zero.
const ZERO_SAMPLES: u32 = 64;

/// Looks at the end-of-sequence flag before a sample counts as missing: some 10 µs, several times a sequence's length.
const PATIENCE: u32 = 300;

/// Codes at no current, of U, V, W.
pub type Zeros = [AdcCode; 3];

/// A converter with its sequence.
#[derive(Clone, Copy)]
pub struct Sampler {
    /// The converter.
    pub adc: adc::Adc,
    /// What it converts.
    pub sequence: Sequence,
}

impl Sampler {
    /// Out of deep sleep, calibrated, enabled.
    pub fn prepare(&self, wait: &mut dyn Wait) -> Result<(), StartError> {
        let adc = self.adc;
        adc.cr().write(|w| w.set_deeppwd(false));
        adc.cr().write(|w| w.set_advregen(true));
        wait.microseconds(20);
        adc.cr().modify(|w| w.set_adcal(true));
        wait.until(&mut || !adc.cr().read().adcal()).or(Err(StartError::ConverterCalibration))?;
        wait.microseconds(1);
        adc.isr().write(|w| w.set_adrdy(true));
        adc.cr().modify(|w| w.set_aden(true));
        wait.until(&mut || adc.isr().read().adrdy()).or(Err(StartError::Converter))?;
        // At 42.5 MHz: 12.5 cycles to sample, 12.5 to convert.
        for channel in self.sequence.channels.map(usize::from) {
            let time = adc::vals::SampleTime::CYCLES12_5;
            match channel.checked_sub(10) {
                None => adc.smpr().modify(|w| w.set_smp(channel, time)),
                Some(upper) => adc.smpr2().modify(|w| w.set_smp(upper, time)),
            }
        }
        Ok(())
    }

    /// The mean code of each current, converted on command. The gates are off, so no current flows.
    pub fn zeros(&self, stage: &PowerStage, wait: &mut dyn Wait) -> Result<Zeros, StartError> {
        let [a, b, c, _] = self.means(wait)?;
        Ok([stage.check_zero(a)?, stage.check_zero(b)?, stage.check_zero(c)?])
    }

    /// The mean code of each channel, converted on command.
    pub fn means(&self, wait: &mut dyn Wait) -> Result<[AdcCode; 4], StartError> {
        self.write_sequence(adc::vals::Exten::DISABLED);
        let mut sums = [0; 4];
        for _ in 0..ZERO_SAMPLES {
            self.arm();
            wait.until(&mut || self.is_done()).or(Err(StartError::Converter))?;
            for (sum, code) in sums.iter_mut().zip(self.take()) {
                *sum += u32::from(code.0);
            }
        }
        Ok(sums.map(|sum| AdcCode(((sum + ZERO_SAMPLES / 2) / ZERO_SAMPLES) as u16)))
    }

    /// From now on the timer starts the sequence.
    pub fn follow_timer(&self) {
        self.write_sequence(adc::vals::Exten::RISING_EDGE);
        self.arm();
    }

    /// The newest sequence, once it is complete; `None` if it does not come.
    #[inline]
    pub fn read(&self) -> Option<[AdcCode; 4]> {
        for _ in 0..PATIENCE {
            if self.is_done() {
                return Some(self.take());
            }
        }
        None
    }

    /// What is complete by now counts no more.
    #[inline]
    pub fn forget(&self) {
        self.adc.isr().write(|w| w.set_jeos(true));
    }

    fn arm(&self) {
        self.adc.isr().write(|w| w.set_jeos(true));
        self.adc.cr().modify(|w| w.set_jadstart(true));
    }

    #[inline]
    fn is_done(&self) -> bool {
        self.adc.isr().read().jeos()
    }

    /// Reads the results and acknowledges them: flags of this register are cleared by writing 1.
    #[inline]
    fn take(&self) -> [AdcCode; 4] {
        let codes = [0, 1, 2, 3].map(|rank| AdcCode(self.adc.jdr(rank).read().jdata()));
        self.adc.isr().write(|w| w.set_jeos(true));
        codes
    }

    fn write_sequence(&self, trigger: adc::vals::Exten) {
        let sequence = self.sequence;
        self.adc.jsqr().write(|w| {
            w.set_jl(sequence.count - 1);
            w.set_jextsel(sequence.trigger);
            w.set_jexten(trigger);
            for (rank, channel) in sequence.channels.into_iter().enumerate() {
                w.set_jsq(rank, channel);
            }
        });
    }
}

/// The converters' clock: a quarter of the bus, 42.5 MHz.
pub fn configure_clock(converters: adccommon::AdcCommon) {
    converters.ccr().write(|w| w.set_ckmode(adccommon::vals::Ckmode::SYNC_DIV4));
}

/// Currents in A; NaN, which the drive's protection names, where the converter gave nothing.
#[inline]
pub fn currents_a(codes: Option<[AdcCode; 4]>, zeros: &Zeros) -> Abc {
    let [za, zb, zc] = *zeros;
    match codes {
        Some([a, b, c, _]) => Abc { a: a.current_a(za), b: b.current_a(zb), c: c.current_a(zc) },
        None => Abc { a: f32::NAN, b: f32::NAN, c: f32::NAN },
    }
}
