//! The temperature sensors: regular conversions of ADC1, one a slot in turn, asked for and read by the idle loop.
//!
//! The control interrupt's sequence comes first: it breaks into a conversion, which then begins anew. A conversion takes 6 µs, so a slot later it is
//! done; where it is not, its sensor reads as shorted.

use stm32_metapac::adc::{self, Adc};
use tractive::thermal::Ratios;

/// ADC1's channels: the winding's sensor (PA0), the heat sink's (PC3).
pub const CHANNELS: [u8; 2] = [1, 9];

/// The readings, and whose turn it is.
#[derive(Clone, Copy, Debug, Default)]
pub struct TemperatureInputs {
    codes: [u16; 2],
    /// The place of the conversion under way; `None` before the first.
    converting: Option<usize>,
}

/// Gives both channels time to settle behind kilohms: 247.5 cycles. Before anything triggers the converter.
pub fn prepare(adc: Adc) {
    for channel in CHANNELS.map(usize::from) {
        adc.smpr().modify(|w| w.set_smp(channel, adc::vals::SampleTime::CYCLES247_5));
    }
}

impl TemperatureInputs {
    /// One slot: reads what has been converted, and has the other channel converted.
    pub fn step(&mut self, adc: Adc) {
        if let Some(code) = self.converting.and_then(|place| self.codes.get_mut(place)) {
            // Reading the result takes its flag back.
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

    /// The ratios of the voltages to the converter's reference, of which the sensors' series resistors hang.
    pub fn ratios(&self) -> Ratios {
        let [winding, heat_sink] = self.codes.map(|code| code << 4);
        Ratios { winding, heat_sink }
    }
}
