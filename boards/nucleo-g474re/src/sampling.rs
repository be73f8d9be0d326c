//! The converters: injected sequences that a timer's update triggers, and the zeros of the current sensors.
//!
//! ADC1 belongs to the control interrupt, ADC2 to the PWM interrupt, so each has samples of its own instant. Each current is wired to two pins, one
//! for each converter: two converters that sample the same pin at the same time would disturb each other. A sequence's conversions follow each other
//! within 0.6 µs.
//!
//! A conversion more than 1 ms after the previous one may be wrong (ES0430). ADC1 converts every 100 µs; ADC2 converts at carrier boundaries, up to
//! 2.2 ms apart, so the first conversion of its sequence is thrown away. The same holds for the first conversion of the zeros and the last one before
//! the timers take over.

use super::power_stage::{AdcCode, PowerStage};
use super::start::{StartError, Wait};
use core::sync::atomic::{AtomicU32, Ordering};
use stm32_metapac::{adc, adccommon};
use tractive::frames::Abc;

/// A sequence's channels, and the timer event that starts it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence {
    /// Channels, in the order of their conversion.
    pub channels: [u8; 4],
    /// Number of channels that are converted.
    pub count: u8,
    /// Number of conversions at the beginning that are thrown away.
    pub rejected: usize,
    /// JSQR.JEXTSEL.
    pub trigger: u8,
}

/// ADC1: currents (PA1, PB0, PB14) and link voltage (PC0) at TIM3's update (its TRGO).
pub const CONTROL: Sequence = Sequence { channels: [2, 15, 5, 6], count: 4, rejected: 0, trigger: 12 };

/// ADC2: W once as a dummy, then the currents (PA7, PC1, PB11) at TIM1's update (its TRGO2).
pub const PWM: Sequence = Sequence { channels: [14, 4, 7, 14], count: 4, rejected: 1, trigger: 8 };

/// Core cycles of a conversion: 12.5 cycles to sample and 12.5 to convert, at a quarter of the core's clock.
pub const CONVERSION_CYCLES: u32 = 100;

/// Number of conversions that are averaged to find a sensor's zero.
const ZERO_SAMPLES: u32 = 64;

/// Polls of the end-of-sequence flag before a sample counts as missing: some 10 µs, several times a sequence's length.
const PATIENCE: u32 = 300;

/// Codes at no current, of U, V, W.
pub type Zeros = [AdcCode; 3];

/// The zeros that the start measured, for an interrupt that needs them at its start. Written before the interrupts are unmasked.
#[derive(Debug)]
pub struct KeptZeros([AtomicU32; 3]);

impl KeptZeros {
    /// No zeros yet.
    pub const fn new() -> Self {
        Self([const { AtomicU32::new(0) }; 3])
    }

    /// Stores them.
    pub fn keep(&self, zeros: Zeros) {
        for (cell, zero) in self.0.iter().zip(zeros) {
            cell.store(u32::from(zero.0), Ordering::Relaxed);
        }
    }

    /// The stored zeros.
    pub fn kept(&self) -> Zeros {
        self.0.each_ref().map(|cell| AdcCode(cell.load(Ordering::Relaxed) as u16))
    }
}

/// A converter with its sequence.
#[derive(Clone, Copy)]
pub struct Sampler {
    /// The converter.
    pub adc: adc::Adc,
    /// The conversions that it makes.
    pub sequence: Sequence,
}

impl Sampler {
    /// Takes the converter out of deep sleep, calibrates and enables it.
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

    /// The mean code of each current, converted on command; the sequence begins with the currents. The gates are off, so no current flows.
    pub fn zeros(&self, stage: &PowerStage, wait: &mut dyn Wait) -> Result<Zeros, StartError> {
        let [a, b, c, _] = self.means(wait)?;
        Ok([stage.check_zero(a)?, stage.check_zero(b)?, stage.check_zero(c)?])
    }

    /// The mean code of each channel, converted on command.
    pub fn means(&self, wait: &mut dyn Wait) -> Result<[AdcCode; 4], StartError> {
        self.write_sequence(adc::vals::Exten::DISABLED);
        let mut sums = [0; 4];
        self.convert(wait)?;
        for _ in 0..ZERO_SAMPLES {
            self.convert(wait)?;
            for (sum, code) in sums.iter_mut().zip(self.take()) {
                *sum += u32::from(code.0);
            }
        }
        Ok(sums.map(|sum| AdcCode(((sum + ZERO_SAMPLES / 2) / ZERO_SAMPLES) as u16)))
    }

    /// Converts once on command, as a dummy: a conversion that the timer starts within 1 ms from now on is right.
    pub fn refresh(&self, wait: &mut dyn Wait) {
        self.write_sequence(adc::vals::Exten::DISABLED);
        // If it fails, so do the conversions that follow, and that is reported.
        let _ = self.convert(wait);
    }

    fn convert(&self, wait: &mut dyn Wait) -> Result<(), StartError> {
        self.arm();
        wait.until(&mut || self.is_done()).or(Err(StartError::Converter))
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

    /// Discards the conversions that are complete by now.
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

    /// Reads the results, those that count first, and acknowledges them: flags of this register are cleared by writing 1.
    #[inline]
    fn take(&self) -> [AdcCode; 4] {
        let rejected = self.sequence.rejected;
        let codes = [0, 1, 2, 3].map(|rank| AdcCode(self.adc.jdr((rank + rejected) % 4).read().jdata()));
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

/// Currents in A; NaN, which the drive's protection reports by name, if the converter gave nothing.
#[inline]
pub fn currents_a(codes: Option<[AdcCode; 4]>, zeros: &Zeros) -> Abc {
    let [za, zb, zc] = *zeros;
    match codes {
        Some([a, b, c, _]) => Abc { a: a.current_a(za), b: b.current_a(zb), c: c.current_a(zc) },
        None => Abc { a: f32::NAN, b: f32::NAN, c: f32::NAN },
    }
}
