//! The temperature sensors' conversions: in turn, on their own channels, beside the control interrupt's.

use crate::bench::Bench;
use crate::devices;
use nucleo_g474re::pins::PINS;
use nucleo_g474re::temperatures::{CHANNELS, TemperatureInputs};
use stm32_metapac::adc::vals::SampleTime;
use stm32_metapac::adc::{Adc, regs};
use tractive::thermal::Ratios;

/// A conversion that is done, with its result.
pub fn done(adc: Adc, code: u16) {
    adc.cr().modify(|w| w.set_adstart(false));
    let mut flags = regs::Isr(0);
    flags.set_eoc(true);
    adc.isr().write_value(flags);
    // SAFETY: DR is word 16 of the converter's block of memory, which only the hardware writes.
    unsafe { adc.as_ptr().cast::<u32>().add(16).write_volatile(code.into()) };
}

#[test]
fn each_slot_reads_one_sensor_and_asks_for_the_other() {
    let adc = Bench::started(devices()).registers.adc1;
    let before = adc.jsqr().read();
    let mut inputs = TemperatureInputs::default();
    let mut asked = Vec::new();
    for slot in 0..6 {
        inputs.step(adc);
        assert!(adc.cr().read().adstart() && adc.cr().read().aden());
        assert_eq!(adc.sqr1().read().l(), 0);
        asked.push(adc.sqr1().read().sq(0));
        done(adc, 1_000 + slot);
    }
    let [winding, heat_sink] = CHANNELS;
    assert_eq!(asked, [winding, heat_sink, winding, heat_sink, winding, heat_sink]);
    assert_eq!(inputs.ratios(), Ratios { winding: 1_004 << 4, heat_sink: 1_003 << 4 });
    // The control interrupt's sequence is as it was.
    assert_eq!(adc.jsqr().read().0, before.0);
    // A conversion that does not come reads as shorted.
    adc.isr().write_value(regs::Isr(0));
    inputs.step(adc);
    inputs.step(adc);
    assert_eq!(inputs.ratios(), Ratios::default());
}

#[test]
fn the_channels_are_those_of_the_pins_and_have_time_to_settle() {
    let adc = Bench::started(devices()).registers.adc1;
    for (channel, purpose) in CHANNELS.into_iter().zip(["winding's", "heat sink's"]) {
        let signal = format!("ADC1_IN{channel}");
        let pin = PINS.iter().find(|pin| pin.signals == [signal.as_str()]).unwrap();
        assert!(pin.purpose.starts_with(purpose));
        assert_eq!(adc.smpr().read().smp(channel.into()), SampleTime::CYCLES247_5);
    }
}
