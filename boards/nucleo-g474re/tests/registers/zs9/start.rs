//! The start: its order, what it writes, what it refuses.

use crate::bench::Bench;
use nucleo_g474re::pins::Pin;
use nucleo_g474re::registers::Registers;
use nucleo_g474re::start::StartError;
use nucleo_g474re::zs9::pins::PINS;
use nucleo_g474re::zs9::sampling::Zeros;
use nucleo_g474re::zs9::stage::STAGE;
use nucleo_g474re::zs9::start::{STEPS, Start, bridge, prepare};
use nucleo_g474re::zs9::{CARRIER_TICKS, CLOCK, HALF_CYCLES};
use stm32_metapac::{adc, gpio, timer};

fn mode(registers: &Registers, pin: &Pin) -> gpio::vals::Moder {
    pin.port.of(registers).moder().read().moder(usize::from(pin.number))
}

/// Nothing drives a gate high: the outputs are off, driven low where a timer has the pin, and nothing counts.
fn gates_are_off(registers: &Registers) {
    let given = PINS.iter().any(|pin| pin.is_gate() && mode(registers, pin) == gpio::vals::Moder::ALTERNATE);
    for timer in bridge(registers).timers {
        let main = timer.bdtr().read();
        assert!(!main.moe() && !main.aoe(), "main output");
        assert!(!timer.cr1().read().cen(), "a PWM timer counts");
        assert_eq!((0..4).filter(|n| timer.cr2().read().ois(*n) || timer.cr2().read().oisn(*n)).count(), 0);
        if given {
            assert_eq!(main.ossi(), timer::vals::Ossi::IDLE_LEVEL, "a gate pin before its off level");
            assert_eq!(main.lock(), timer::vals::Lock::LEVEL2, "a gate pin before the lock");
            assert!(main.bke(0) && main.dtg() > 0, "a gate pin before break and dead time");
        }
    }
    if given {
        let watching = registers.comparators.iter().filter(|c| c.csr().read().en()).count();
        assert_eq!(watching, 7, "a gate pin before the comparators");
    }
}

#[test]
fn the_gates_are_off_until_everything_is_configured() {
    let mut bench = Bench::of_other_inverter();
    bench.watch = gates_are_off;
    let registers = bench.registers;
    let mut start = Start { registers: &registers, wait: &mut bench, stage: &STAGE, zeros: Zeros::default() };
    for (name, step) in STEPS {
        step(&mut start).unwrap();
        println!("{name}");
        gates_are_off(&registers);
    }
    assert!(
        PINS.iter()
            .filter(|pin| pin.is_gate())
            .all(|pin| mode(&registers, pin) == gpio::vals::Moder::ALTERNATE)
    );
    assert_eq!(registers.syscfg.swpr().read().0, u32::MAX, "nobody writes to the interrupts' code");
}

#[test]
fn the_three_timers_are_alike_but_for_their_breaks() {
    let registers = super::model::Model::started().registers;
    for (index, timer) in bridge(&registers).timers.into_iter().enumerate() {
        let control = timer.cr1().read();
        assert!(control.arpe() && control.cen());
        assert_eq!(control.cms(), timer::vals::Cms::CENTER_ALIGNED1);
        assert_eq!(
            (timer.psc().read(), timer.arr().read().arr(), timer.rcr().read().rep()),
            (0, HALF_CYCLES, 0)
        );
        // Outputs of channels 1, 2 and 3 with their complementary ones: the dead-time generators need both.
        assert_eq!(timer.ccer().read().0, 0x555);
        let main = timer.bdtr().read();
        // 1 µs of 170 MHz.
        assert_eq!((main.dtg(), control.ckd()), (0x80 | (170 / 2 - 64), timer::vals::Ckd::DIV1));
        let sources = timer.af1().read();
        assert_eq!(sources.bkine(), index < 2, "TIM20 has no break pin");
        assert!((0..7).all(|n| sources.bkcmpe(n)));
        assert!(main.bke(0));
    }
    let [first, ..] = bridge(&registers).timers;
    assert_eq!(first.cr2().read().mms(), timer::vals::Mms::UPDATE);
    assert_eq!(first.cr2().read().mms2(), timer::vals::Mms2::UPDATE);
    assert!(first.dier().read().uie());
}

#[test]
fn the_control_timer_keeps_step_with_the_carrier() {
    let registers = super::model::Model::started().registers;
    let control = registers.tim2;
    let cycles = (u32::from(control.psc().read()) + 1) * (control.arr().read() + 1);
    assert_eq!(cycles, 17_000, "10 kHz of 170 MHz");
    assert_eq!(cycles % (2 * u32::from(HALF_CYCLES)), 0);
    assert_eq!(CLOCK.control_ticks % CARRIER_TICKS, 0);
    let slave = control.smcr().read();
    assert_eq!((slave.ts(), slave.sms()), (timer::vals::Ts::ITR0, timer::vals::Sms::TRIGGER_MODE));
    assert!(control.dier().read().uie());
    assert_eq!(control.cr2().read().mms(), timer::vals::Mms::UPDATE, "it captures the encoders");
}

#[test]
fn every_beat_starts_the_conversions() {
    let registers = super::model::Model::started().registers;
    let plan: [(adc::Adc, &[u8]); 3] =
        [(registers.adc1, &[2, 7, 15, 5]), (registers.adc2, &[14, 4, 6, 9]), (registers.adc3, &[1])];
    for (converter, channels) in plan {
        let sequence = converter.jsqr().read();
        assert_eq!((sequence.jextsel(), sequence.jexten()), (8, adc::vals::Exten::RISING_EDGE));
        let converted: Vec<_> = (0..usize::from(sequence.jl()) + 1).map(|rank| sequence.jsq(rank)).collect();
        assert_eq!(converted, channels);
        assert!(converter.cr().read().jadstart());
    }
}

#[test]
fn the_comparators_watch_six_currents_and_the_ready_line() {
    use stm32_metapac::comp::vals::{Inm, Polarity};
    let registers = super::model::Model::started().registers;
    let (_, upper) = STAGE.common.break_codes();
    for number in [1, 2, 3, 4, 6, 7] {
        let settings = registers.comparators[number - 1].csr().read();
        assert!(settings.en() && settings.lock() && settings.polarity() != Polarity::INVERTED);
        assert_eq!((settings.inmsel(), settings.inpsel()), (Inm::DACA, number == 3));
    }
    let ready = registers.comparators[4].csr().read();
    assert!(ready.en() && ready.lock() && ready.scalen() && ready.polarity() == Polarity::INVERTED);
    assert_eq!((ready.inmsel(), ready.inpsel()), (Inm::VREF, false));
    for converter in [registers.dac3, registers.dac4] {
        assert_eq!([0, 1].map(|channel| converter.dhr12r(channel).read().dhr()), [upper; 2]);
    }
}

#[test]
fn a_gate_driver_may_be_late() {
    for (quiet_ms, tripped) in [(Some(50), false), (None, true)] {
        let mut bench = Bench::of_other_inverter();
        bench.fault = [true; 2];
        bench.quiet_from_ns = quiet_ms.map(|ms: u64| ms * 1_000_000);
        bench.watch = gates_are_off;
        let registers = bench.registers;
        prepare(&registers, &mut bench).unwrap();
        assert_eq!(bridge(&registers).outputs().is_tripped(), tripped);
    }
}

#[test]
fn what_is_not_in_order_is_told_and_leaves_the_gates_off() {
    type Spoil = fn(&mut Bench);
    let cases: [(Spoil, StartError); 4] = [
        (|bench| bench.registers.rcc.csr().write(|w| w.set_iwdgrstf(true)), StartError::WatchdogReset),
        (|bench| bench.broken = true, StartError::FlashLatency),
        (|bench| bench.codes[15] = 3_000, StartError::CurrentSensor { code: 3_000 }),
        (|bench| bench.codes[1] = 0, StartError::CurrentSensor { code: 0 }),
    ];
    for (spoil, error) in cases {
        let mut bench = Bench::of_other_inverter();
        spoil(&mut bench);
        let registers = bench.registers;
        assert_eq!(prepare(&registers, &mut bench), Err(error));
        gates_are_off(&registers);
    }
}
