//! The start: its order, what it writes, what it refuses.

use crate::bench::{Bench, PWR_CR5_AFTER_RESET};
use crate::devices;
use nucleo_g474re::pins::PINS;
use nucleo_g474re::registers::Registers;
use nucleo_g474re::start::{Found, STEPS, Start, StartError, prepare, run};
use nucleo_g474re::{CLOCK, PRESCALER, power_stage::POWER_STAGE};
use stm32_metapac::{adc, gpio, rcc, timer};
use tractive::modulation::SwitchLimits;

/// Nothing drives a gate high: the outputs are off, driven low where a timer has the pin, and nothing counts.
fn gates_are_off(registers: &Registers) {
    for timer in [registers.legs.tim1, registers.legs.tim8] {
        assert!(!timer.bdtr().read().moe(), "main output");
        assert!(!timer.bdtr().read().aoe(), "automatic output");
        assert!(!timer.cr1().read().cen(), "a PWM timer counts");
        assert_eq!((0..4).filter(|n| timer.cr2().read().ois(*n) || timer.cr2().read().oisn(*n)).count(), 0);
    }
    let given =
        PINS.iter().filter(|pin| pin.is_gate() && mode(registers, pin) == gpio::vals::Moder::ALTERNATE);
    if given.count() > 0 {
        for timer in [registers.legs.tim1, registers.legs.tim8] {
            let main = timer.bdtr().read();
            assert_eq!(main.ossi(), timer::vals::Ossi::IDLE_LEVEL, "a gate pin before its off level");
            assert_eq!(main.lock(), timer::vals::Lock::LEVEL2, "a gate pin before the lock");
            assert!(main.bke(0) && main.dtg() > 0, "a gate pin before break and dead time");
        }
        let watching = registers.comparators.iter().filter(|c| c.csr().read().en()).count();
        assert_eq!(watching, 6, "a gate pin before the comparators");
    }
}

fn mode(registers: &Registers, pin: &nucleo_g474re::pins::Pin) -> gpio::vals::Moder {
    let port = pin.port.of(registers);
    port.moder().read().moder(usize::from(pin.number))
}

#[test]
fn the_gates_are_off_until_everything_is_configured() {
    let mut bench = Bench::new();
    bench.watch = gates_are_off;
    let registers = bench.registers;
    let mut start = Start {
        registers: &registers,
        wait: &mut bench,
        stage: &POWER_STAGE,
        devices: devices(),
        found: Found::default(),
    };
    for (name, step) in STEPS {
        step(&mut start).unwrap();
        println!("{name}");
        gates_are_off(&registers);
    }
    run(&registers, &mut bench);
    bench.settle();
    for timer in [registers.legs.tim1, registers.legs.tim8] {
        assert!(timer.cr1().read().cen());
        assert!(!timer.bdtr().read().moe(), "counting alone turns no gate on");
    }
    assert!(registers.tim3.cr1().read().cen(), "the control timer starts with the PWM timer");
    assert!(
        PINS.iter()
            .filter(|pin| pin.is_gate())
            .all(|pin| mode(&registers, pin) == gpio::vals::Moder::ALTERNATE)
    );
}

#[test]
fn the_pwm_timers_are_shadowed_dead_timed_and_breakable() {
    let registers = Bench::started(devices()).registers;
    for timer in [registers.legs.tim1, registers.legs.tim8] {
        let control = timer.cr1().read();
        assert!(control.arpe() && !control.udis());
        assert_eq!(control.cms(), timer::vals::Cms::EDGE_ALIGNED);
        assert_eq!(timer.psc().read(), PRESCALER - 1);
        let main = timer.bdtr().read();
        // 5 µs of 170 MHz are 850 cycles; the nearest code from there on stands for 2 (64 + 43) · 4 = 856.
        assert_eq!((main.dtg(), control.ckd()), (0x80 | 43, timer::vals::Ckd::DIV4));
        assert!(main.bke(0));
        assert_eq!(main.bkf(0), timer::vals::FilterValue::NO_FILTER, "a break needs no clock");
        assert_eq!(main.bkp(0), timer::vals::Bkp::ACTIVE_HIGH);
        let sources = timer.af1().read();
        assert!(sources.bkine());
        assert_eq!(sources.bkinp(), timer::vals::Bkinp::INVERTED);
        let comparators: Vec<_> = (0..7).filter(|n| sources.bkcmpe(*n)).map(|n| n + 1).collect();
        assert_eq!(comparators, [1, 2, 3, 4, 6, 7]);
        assert!(!timer.cr2().read().ccpc());
        assert_eq!(timer.ccer().read().0 & 0xAAAA, 0, "active high");
    }
    for (timer, pairs, enabled) in [(registers.legs.tim1, 2, 0x505), (registers.legs.tim8, 1, 0x5)] {
        assert_eq!(timer.ccer().read().0, enabled);
        for pair in 0..pairs {
            let modes = timer.ccmr_output(pair).read();
            assert!(modes.ocpe(0) && modes.ocpe(1));
            assert_eq!(modes.ocm(0), timer::vals::Ocm::COMBINED_PWM_MODE_1);
            assert_eq!(modes.ocm(1), timer::vals::Ocm::COMBINED_PWM_MODE_2);
        }
    }
    let tim1 = registers.legs.tim1;
    assert_eq!(u32::from(tim1.arr().read().arr()), devices().shortest_half_ticks - 1);
    assert_eq!(tim1.cr2().read().mms(), timer::vals::Mms::UPDATE);
    assert_eq!(tim1.cr2().read().mms2(), timer::vals::Mms2::UPDATE);
    assert_eq!(tim1.rcr().read().rep(), 0);
    assert!(tim1.dier().read().uie());
}

#[test]
fn the_control_timer_has_its_period_and_triggers_its_converter() {
    let registers = Bench::started(devices()).registers;
    let tim3 = registers.tim3;
    let cycles = (u32::from(tim3.psc().read()) + 1) * (u32::from(tim3.arr().read().arr()) + 1);
    assert_eq!(cycles, 17_000, "10 kHz of 170 MHz");
    assert_eq!(CLOCK.control_ticks, 2_125);
    assert_eq!(tim3.cr2().read().mms(), timer::vals::Mms::UPDATE);
    assert!(tim3.dier().read().uie());
    for (converter, trigger, channels) in
        [(registers.adc1, 12, &[2, 15, 5, 6][..]), (registers.adc2, 8, &[14, 4, 7, 14][..])]
    {
        let sequence = converter.jsqr().read();
        assert_eq!((sequence.jextsel(), sequence.jexten()), (trigger, adc::vals::Exten::RISING_EDGE));
        let converted: Vec<_> = (0..usize::from(sequence.jl()) + 1).map(|rank| sequence.jsq(rank)).collect();
        assert_eq!(converted, channels);
        assert!(converter.cr().read().jadstart());
    }
}

/// The watchdog bites 20 ms after its last meal: later than several of the slowest carrier halves, and soon enough that a contactor is not
/// held for long by a processor that stands.
#[test]
fn the_watchdog_bites_after_twenty_milliseconds() {
    let registers = Bench::started(devices()).registers;
    let divider = 4 << registers.iwdg.pr().read().pr().to_bits();
    let counts = f64::from(registers.iwdg.rlr().read().rl());
    let bites_s = counts * f64::from(divider) / 32_000.0;
    let slowest_half_s = f64::from(devices().shortest_half_ticks) * f64::from(CLOCK.tick_s);
    assert!(bites_s > 10.0 * slowest_half_s && bites_s <= 0.021, "{bites_s} s, halves of {slowest_half_s} s");
}

#[test]
fn the_clock_tree_is_170_mhz() {
    let registers = Bench::started(devices()).registers;
    let pll = registers.rcc.pllcfgr().read();
    assert_eq!(pll.pllsrc(), rcc::vals::Pllsrc::HSE);
    let divider = u32::from(pll.pllm().to_bits()) + 1;
    let multiplier = u32::from(pll.plln().to_bits());
    let output = 2 * (u32::from(pll.pllr().to_bits()) + 1);
    assert_eq!(24_000_000 / divider * multiplier / output, 170_000_000);
    let tree = registers.rcc.cfgr().read();
    assert_eq!((tree.sw(), tree.hpre()), (rcc::vals::Sw::PLL1_R, rcc::vals::Hpre::DIV1));
    assert_eq!((tree.ppre1().to_bits(), tree.ppre2().to_bits()), (0, 0));
    assert!(registers.rcc.cr().read().csson());
    assert_eq!(registers.flash.acr().read().latency(), stm32_metapac::flash::vals::Latency::WS4);
    assert_eq!(registers.pwr.cr5().read().0, 0, "boost");
    let supply = registers.pwr.cr2().read();
    assert!(supply.pvde() && supply.pls() == 6, "2.9 V");
    let breaking = registers.syscfg.cfgr2().read();
    assert!(breaking.pvdl() && breaking.cll() && breaking.eccl(), "a low supply breaks the timers");
}

#[test]
fn each_comparator_watches_one_sign_of_one_current() {
    let registers = Bench::started(devices()).registers;
    let (low, high) = POWER_STAGE.break_codes();
    // Inverting inputs by the reference manual: (number, converter's channel).
    let threshold = |number: usize| match number {
        1 | 3 => registers.dac3.dhr12r(0),
        2 | 4 => registers.dac3.dhr12r(1),
        6 => registers.dac4.dhr12r(1),
        _ => registers.dac4.dhr12r(0),
    };
    for (number, inverted) in [(1, false), (3, false), (6, false), (2, true), (4, true), (7, true)] {
        let settings = registers.comparators[number - 1].csr().read();
        assert!(settings.en() && settings.lock());
        assert_eq!(settings.inmsel(), stm32_metapac::comp::vals::Inm::DACA);
        assert_eq!(settings.polarity() == stm32_metapac::comp::vals::Polarity::INVERTED, inverted);
        assert_eq!(settings.inpsel(), number == 3, "PC1 is COMP3's second input, all others are first ones");
        assert_eq!(threshold(number).read().dhr(), if inverted { low } else { high }, "COMP{number}");
    }
    assert!(!registers.comparators[4].csr().read().en());
}

#[test]
fn what_is_not_in_order_is_told_and_leaves_the_gates_off() {
    type Spoil = fn(&mut Bench);
    let cases: [(Spoil, StartError); 4] = [
        (|bench| bench.registers.rcc.csr().write(|w| w.set_iwdgrstf(true)), StartError::WatchdogReset),
        (|bench| bench.broken = true, StartError::FlashLatency),
        (|bench| bench.codes[14] = 3_000, StartError::CurrentSensor { code: 3_000 }),
        (|bench| bench.codes[2] = 0, StartError::CurrentSensor { code: 0 }),
    ];
    for (spoil, error) in cases {
        let mut bench = Bench::new();
        spoil(&mut bench);
        let registers = bench.registers;
        assert_eq!(prepare(&registers, &mut bench, devices()), Err(error));
        gates_are_off(&registers);
    }
    let too_long = SwitchLimits { shortest_half_ticks: 16_384, ..devices() };
    let mut bench = Bench::new();
    let registers = bench.registers;
    let error = StartError::Carrier { longest_ticks: 65_536 };
    assert_eq!(prepare(&registers, &mut bench, too_long), Err(error));
}

/// Gate drivers come up some time after the chip, and one that never does needs no reset by hand.
#[test]
fn a_gate_driver_may_be_late() {
    for (quiet_ms, tripped) in [(Some(50), false), (Some(150), false), (None, true)] {
        let mut bench = Bench::new();
        bench.fault = [true; 2];
        bench.quiet_from_ns = quiet_ms.map(|ms: u64| ms * 1_000_000);
        bench.watch = gates_are_off;
        let registers = bench.registers;
        prepare(&registers, &mut bench, devices()).unwrap();
        run(&registers, &mut bench);
        bench.settle();
        assert_eq!(registers.legs.is_tripped(), tripped, "{quiet_ms:?}");
        // The latch holds the gates; once the driver is ready it is left as any fault is.
        registers.legs.switch_on();
        bench.settle();
        assert_eq!(registers.legs.is_on(), !tripped);
        bench.fault = [false; 2];
        assert!(registers.legs.leave());
        bench.settle();
        registers.legs.switch_on();
        assert!(registers.legs.is_on());
    }
}

#[test]
fn a_refusal_can_be_told_over_the_bus() {
    let mut bench = Bench::new();
    let registers = bench.registers;
    registers.rcc.csr().write(|w| w.set_iwdgrstf(true));
    assert_eq!(prepare(&registers, &mut bench, devices()), Err(StartError::WatchdogReset));
    assert!(registers.rcc.cr().read().hseon(), "the bus's clock");
    assert!(registers.rcc.ahb2enr().read().gpioaen(), "its pins'");
}

#[test]
fn a_peripheral_is_written_to_only_after_its_clock_has_come() {
    thread_local! {
        static SEEN: std::cell::Cell<[bool; 2]> = const { std::cell::Cell::new([false; 2]) };
    }
    let mut bench = Bench::new();
    let registers = bench.registers;
    bench.watch = |registers| {
        let [power, system] = SEEN.get();
        let untouched =
            !registers.pwr.cr3().read().ucpd1_dbdis() && registers.pwr.cr5().read().0 == PWR_CR5_AFTER_RESET;
        SEEN.set([
            power || (registers.rcc.apb1enr1().read().pwren() && untouched),
            system || (registers.rcc.apb2enr().read().syscfgen() && registers.syscfg.cfgr2().read().0 == 0),
        ]);
    };
    prepare(&registers, &mut bench, devices()).unwrap();
    assert_eq!(SEEN.get(), [true; 2], "a wait between clock and first write, of PWR and SYSCFG");
}

#[test]
fn the_zeros_are_means_of_what_each_converter_sees() {
    let mut bench = Bench::new();
    (bench.codes[2], bench.codes[15], bench.codes[5]) = (2_040, 2_050, 2_100);
    (bench.codes[4], bench.codes[7], bench.codes[14]) = (2_041, 2_051, 2_101);
    let registers = bench.registers;
    let found = prepare(&registers, &mut bench, devices()).unwrap();
    assert_eq!(found.control_zeros.map(|zero| zero.0), [2_040, 2_050, 2_100]);
    assert_eq!(found.pwm_zeros.map(|zero| zero.0), [2_041, 2_051, 2_101]);
}
