//! The temperature sensors: regular conversions of ADC1, one per slot in turn, started and read by the idle loop.
//!
//! The control interrupt's sequence has priority: it interrupts a conversion, which then begins anew. A conversion takes 6 µs, so it is done a slot
//! later; if it is not, its sensor reads as shorted.

use stm32_metapac::adc::{self, Adc};
use tractive::thermal::Ratios;

/// ADC1's channels: the winding's sensor (PA0), the heat sink's (PC3).
pub const CHANNELS: [u8; 2] = [1, 9];

/// The readings, and the sensor whose turn it is.
#[derive(Clone, Copy, Debug, Default)]
pub struct TemperatureInputs {
    codes: [u16; 2],
    /// Index of the conversion under way; `None` before the first.
    converting: Option<usize>,
}

/// Gives both channels, which have source resistances of kilohms, time to settle: 247.5 cycles. Call it before anything triggers the converter.
pub fn prepare(adc: Adc) {
    for channel in CHANNELS.map(usize::from) {
        adc.smpr().modify(|w| w.set_smp(channel, adc::vals::SampleTime::CYCLES247_5));
    }
}

impl TemperatureInputs {
    /// One slot: reads the finished conversion, and starts that of the other channel.
    pub fn step(&mut self, adc: Adc) {
        if let Some(code) = self.converting.and_then(|place| self.codes.get_mut(place)) {
            // Reading the result clears its flag.
            *code = if adc.isr().read().eoc() { adc.dr().read().rdata() } else { 0 };
        }
        let place = self.converting.map_or(0, |place| 1 - place.min(1));
        self.converting = Some(place);
        let [winding, heat_sink] = CHANNELS;
        adc.sqr1().write(|w| {
            w.set_l(0);
            w.set_sq(0, if place == 0 { winding } else { heat_sink });
        });
        adc.cr().modify(|w| w.set_adstart(true));
    }

    /// The ratios of the voltages to the converter's reference, to which the sensors' series resistors are connected.
    pub fn ratios(&self) -> Ratios {
        let [winding, heat_sink] = self.codes.map(|code| code << 4);
        Ratios { winding, heat_sink }
    }
}
