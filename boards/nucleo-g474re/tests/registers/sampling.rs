//! The converters: their clock, the means that are their zeros, and where these are kept.

use crate::bench::Bench;
use crate::devices;
use nucleo_g474re::position::{Position, Resolver};
use nucleo_g474re::power_stage::{AdcCode, POWER_STAGE};
use nucleo_g474re::sampling::KeptZeros;
use nucleo_g474re::start::{Timeout, Wait, control_sampler};
use nucleo_g474re::zs9;
use stm32_metapac::adccommon::{AdcCommon, vals::Ckmode};

/// Currents whose codes change from one conversion to the next.
struct Rippling<'a> {
    bench: &'a mut Bench,
    conversions: u16,
}

impl Wait for Rippling<'_> {
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout> {
        self.conversions += 1;
        for (channel, every) in [(2, 4), (15, 2), (5, 1)] {
            self.bench.codes[channel] = 2_048 + u16::from(self.conversions.is_multiple_of(every));
        }
        self.bench.until(done)
    }

    fn microseconds(&mut self, us: u32) {
        self.bench.microseconds(us);
    }
}

#[test]
fn a_zero_is_the_nearest_code_to_the_mean() {
    let mut bench = Bench::started(devices());
    let sampler = control_sampler(&bench.registers);
    let zeros = sampler.zeros(&POWER_STAGE, &mut Rippling { bench: &mut bench, conversions: 0 });
    // A quarter, a half and all of the conversions are one code higher.
    assert_eq!(zeros, Ok([AdcCode(2_048), AdcCode(2_049), AdcCode(2_049)]));
}

#[test]
fn zeros_are_kept_for_an_interrupt_that_begins_with_them() {
    let kept = KeptZeros::new();
    assert_eq!(kept.kept(), [AdcCode(0); 3]);
    let zeros = [AdcCode(2_040), AdcCode(2_050), AdcCode(2_100)];
    kept.keep(zeros);
    assert_eq!(kept.kept(), zeros);
}

/// The clock that the times of sampling and conversion are reckoned with.
#[test]
fn the_converters_have_a_quarter_of_the_cores_clock() {
    let quartered = |converters: AdcCommon| converters.ccr().read().ckmode() == Ckmode::SYNC_DIV4;
    let mut bench = Bench::started(devices());
    let registers = bench.registers;
    assert!(quartered(registers.adc12));
    assert!(!quartered(registers.adc345), "nobody has them");
    <Resolver<1, 1, 1>>::prepare(&registers, &POWER_STAGE, &mut bench).unwrap();
    assert!(quartered(registers.adc345));
    let mut bench = Bench::of_other_inverter();
    let registers = bench.registers;
    zs9::start::prepare(&registers, &mut bench).unwrap();
    assert!(quartered(registers.adc12) && quartered(registers.adc345));
}
