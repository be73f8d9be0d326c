//! Register blocks in ordinary memory, and as much of the hardware behind them as the board relies on: preload, update events,
//! the combined PWM modes, the dead-time generator, the main output, breaks. Modelled on the reference manual, not on the board.

use nucleo_g474re::legs::Legs;
use nucleo_g474re::registers::Registers;
use nucleo_g474re::start::{Timeout, Wait};
use std::cell::Cell;
use stm32_metapac as pac;

/// PWR_CR5 after a reset, R1MODE set: range 1 is without boost (RM0440).
pub const PWR_CR5_AFTER_RESET: u32 = 0x100;

/// A block of registers that is never freed, so that handles to it stay good.
fn block() -> *mut () {
    Box::leak(vec![0_u32; 0x100].into_boxed_slice()).as_mut_ptr().cast()
}

/// Sets a port's inputs, which only the hardware writes.
pub fn write_input(port: pac::gpio::Gpio, levels: u32) {
    // SAFETY: IDR is word 4 of the port's block of memory.
    unsafe { port.as_ptr().cast::<u32>().add(4).write_volatile(levels) };
}

/// The gate drivers' ready wire at both break inputs.
pub fn drivers_ready(registers: &Registers, ready: bool) {
    write_input(registers.gpiob, u32::from(ready) << 12);
    write_input(registers.gpioa, u32::from(ready) << 6);
}

/// The last write to a port's set-and-reset register.
pub fn written(port: pac::gpio::Gpio) -> u32 {
    // SAFETY: BSRR is word 6 of the port's block of memory.
    unsafe { port.as_ptr().cast::<u32>().add(6).read_volatile() }
}

/// The same; clears the memory.
pub fn take_written(port: pac::gpio::Gpio) -> u32 {
    // SAFETY: as above.
    unsafe { port.as_ptr().cast::<u32>().add(6).replace(0) }
}

/// Counts an encoder whose shaft has turned (turns from its index on) as its timer does: from 0 behind the index, whose flag it sets where the
/// drive looks for it.
pub fn turn_encoder(timer: pac::timer::TimGp16, per_turn: u32, [before, now]: [f64; 2], count: &mut f64) {
    let counts = f64::from(per_turn);
    let passed = before.floor() != now.floor();
    *count = if passed { now.rem_euclid(1.0) * counts } else { *count + (now - before) * counts };
    timer.cnt().write(|w| w.set_cnt(count.rem_euclid(counts) as u16));
    // Flags are cleared by writing 0; writing 1 does nothing. The hardware sets them.
    let mut status = pac::timer::regs::SrGp16(0);
    status.set_idxif(passed && timer.ecr().read().ie());
    timer.sr().write_value(status);
}

/// The dead time of a timer's code, in cycles.
pub fn dead_cycles(timer: pac::timer::TimAdv) -> u32 {
    let code = u32::from(timer.bdtr().read().dtg());
    let periods = match code {
        0..0x80 => code,
        0x80..0xC0 => (64 + (code & 63)) * 2,
        0xC0..0xE0 => (32 + (code & 31)) * 8,
        _ => (32 + (code & 31)) * 16,
    };
    periods << timer.cr1().read().ckd().to_bits()
}

/// The control timer's update, TIM3's or, with the ZS9, TIM2's: its TRGO captures the count of an encoder timer whose channel 3 is mapped on
/// TRC and enabled, and whose TS selects that timer. Internal triggers by the reference manual: 0, 1, 2, 3 are TIM1, TIM2, TIM3,
/// TIM4 for each of TIM3 and TIM4, its own number left out.
pub fn control_update(registers: &Registers) {
    use pac::timer::vals::{CcmrInputCcs, Mms, Sms};
    let Registers { tim2, tim3, tim4, .. } = *registers;
    let (number, master) =
        if tim2.dier().read().uie() { (2, tim2.cr2().read()) } else { (3, tim3.cr2().read()) };
    if master.mms() != Mms::UPDATE {
        return;
    }
    for (timer, own) in [(tim3, 3), (tim4, 4)] {
        let (slave, input) = (timer.smcr().read(), timer.ccmr_input(1).read());
        let selected = own != number && slave.ts().to_bits() == number - 1;
        let maps = input.ccs(0) == CcmrInputCcs::TRC && timer.ccer().read().cce(2);
        if selected && maps && slave.sms() == Sms::ENCODER_MODE_3 && timer.cr1().read().cen() {
            let count = timer.cnt().read().cnt();
            timer.ccr(2).write(|w| w.set_ccr(count));
        }
    }
}

macro_rules! at_memory {
    ($kind:ty) => {
        // SAFETY: a block is aligned, larger than every peripheral used here, never freed, and only this thread has it.
        unsafe { <$kind>::from_ptr(block()) }
    };
}

/// One device: whether it is on, and since when (tick).
#[derive(Clone, Copy, Debug, Default)]
struct Device {
    on: bool,
    went_off: Option<u64>,
}

/// One leg behind the timer's output stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct Leg {
    upper: Device,
    lower: Device,
    reference: bool,
    since: u64,
}

impl Leg {
    /// (upper on, lower on).
    pub fn gates(&self) -> (bool, bool) {
        (self.upper.on, self.lower.on)
    }

    /// The level the timer wants.
    pub fn reference(&self) -> bool {
        self.reference
    }
}

/// Shadow registers of a timer.
#[derive(Clone, Copy, Debug, Default)]
struct Shadow {
    reload: u16,
    compares: [u16; 4],
}

/// The board's peripherals and the hardware behind them.
pub struct Bench {
    pub registers: Registers,
    /// U, V, W.
    pub legs: [Leg; 3],
    /// Ticks since the counters started.
    pub now: u64,
    /// The converters' codes by channel.
    pub codes: [u16; 19],
    /// A break input of TIM1, of TIM8, is active.
    pub fault: [bool; 2],
    /// The clock, or a converter, does not come up.
    pub broken: bool,
    status: [u32; 2],
    shadows: [Shadow; 2],
    count: [u32; 2],
    /// The timers play a two-level inverter; otherwise the bench drives only their break inputs.
    pub two_level: bool,
    /// Time, in ns: ticks of the timers, and waits.
    pub time_ns: u64,
    /// Instant at which the break inputs become quiet, in ns.
    pub quiet_from_ns: Option<u64>,
    /// Instant of the last conversion of ADC1, ADC2, ADC3, ADC5, in ns.
    converted_ns: [Cell<u64>; 4],
    /// Called at each wait.
    pub watch: fn(&Registers),
}

impl Bench {
    pub fn new() -> Self {
        let legs = Legs { tim1: at_memory!(pac::timer::TimAdv), tim8: at_memory!(pac::timer::TimAdv) };
        let registers = Registers {
            rcc: at_memory!(pac::rcc::Rcc),
            pwr: at_memory!(pac::pwr::Pwr),
            flash: at_memory!(pac::flash::Flash),
            syscfg: at_memory!(pac::syscfg::Syscfg),
            dbgmcu: at_memory!(pac::dbgmcu::Dbgmcu),
            gpioa: at_memory!(pac::gpio::Gpio),
            gpiob: at_memory!(pac::gpio::Gpio),
            gpioc: at_memory!(pac::gpio::Gpio),
            gpiod: at_memory!(pac::gpio::Gpio),
            legs,
            tim20: at_memory!(pac::timer::TimAdv),
            tim17: at_memory!(pac::timer::Tim1chCmp),
            tim2: at_memory!(pac::timer::TimGp32),
            tim3: at_memory!(pac::timer::TimGp16),
            tim4: at_memory!(pac::timer::TimGp16),
            adc1: at_memory!(pac::adc::Adc),
            adc2: at_memory!(pac::adc::Adc),
            adc3: at_memory!(pac::adc::Adc),
            adc5: at_memory!(pac::adc::Adc),
            adc345: at_memory!(pac::adccommon::AdcCommon),
            dma1: at_memory!(pac::bdma::Dma),
            dmamux1: at_memory!(pac::dmamux::Dmamux),
            spi1: at_memory!(pac::spi::Spi),
            spi3: at_memory!(pac::spi::Spi),
            adc12: at_memory!(pac::adccommon::AdcCommon),
            comparators: core::array::from_fn(|_| at_memory!(pac::comp::Comp)),
            dac3: at_memory!(pac::dac::Dac),
            dac4: at_memory!(pac::dac::Dac),
            iwdg: at_memory!(pac::iwdg::Iwdg),
        };
        // Pins are analog after a reset, but for the debug port's (RM0440, GPIOx_MODER and GPIOx_PUPDR).
        for (port, mode, pulls) in [
            (registers.gpioa, 0xABFF_FFFF, 0x6400_0000),
            (registers.gpiob, 0xFFFF_FEBF, 0x0000_0100),
            (registers.gpioc, u32::MAX, 0),
            (registers.gpiod, u32::MAX, 0),
        ] {
            port.moder().write_value(pac::gpio::regs::Moder(mode));
            port.pupdr().write_value(pac::gpio::regs::Pupdr(pulls));
        }
        registers.pwr.cr5().write(|w| w.0 = PWR_CR5_AFTER_RESET);
        Self {
            registers,
            legs: [Leg::default(); 3],
            now: 0,
            codes: [2_048; 19],
            fault: [false; 2],
            broken: false,
            status: [0; 2],
            shadows: [Shadow::default(); 2],
            count: [0; 2],
            two_level: true,
            time_ns: 0,
            quiet_from_ns: None,
            converted_ns: Default::default(),
            watch: |_| (),
        }
    }

    /// A bench for timers that play another inverter.
    pub fn of_other_inverter() -> Self {
        Self { two_level: false, ..Self::new() }
    }

    /// The bench after a whole start.
    pub fn started(devices: tractive::modulation::SwitchLimits) -> Self {
        use nucleo_g474re::start;
        let mut bench = Self::new();
        let registers = bench.registers;
        start::prepare(&registers, &mut bench, devices).unwrap();
        start::run(&registers, &mut bench);
        bench.settle();
        bench
    }

    fn timers(&self) -> [pac::timer::TimAdv; 2] {
        [self.registers.legs.tim1, self.registers.legs.tim8]
    }

    /// Settles the hardware after the writes since the last time. Call it after every call of the board.
    pub fn settle(&mut self) {
        for (index, timer) in self.timers().into_iter().enumerate() {
            // Flags are cleared by writing 0; writing 1 does nothing.
            self.status[index] &= timer.sr().read().0;
            if !self.two_level {
                self.status[index] |= u32::from(self.fault[index]) << 7;
                timer.sr().write_value(pac::timer::regs::SrAdv(self.status[index]));
                continue;
            }
            // SAFETY: EGR is a word of the timer's block; the hardware alone reads it back.
            let egr = unsafe { &mut *timer.as_ptr().cast::<u32>().add(5) };
            let events = core::mem::take(egr);
            if events & 1 != 0 {
                self.update(index);
                // URS: an update by software raises no interrupt, but it does raise TRGO.
                if index == 0 && timer.cr2().read().mms() == pac::timer::vals::Mms::UPDATE {
                    self.trigger();
                }
            }
            if events & 1 << 7 != 0 || (self.fault[index] && timer.bdtr().read().bke(0)) {
                timer.bdtr().modify(|w| w.set_moe(false));
                self.status[index] |= 1 << 7;
            }
            timer.sr().write_value(pac::timer::regs::SrAdv(self.status[index]));
        }
        if self.two_level {
            self.drive_legs();
        }
    }

    /// TIM1's TRGO arrives at TIM8 and TIM3.
    fn trigger(&mut self) {
        use pac::timer::vals::{Sms, Ts};
        let Registers { tim3, legs: Legs { tim8, .. }, .. } = self.registers;
        let slave = tim8.smcr().read();
        if slave.ts() == Ts::ITR0 && slave.sms() == Sms::COMBINED_RESET_TRIGGER {
            self.update(1);
            tim8.cr1().modify(|w| w.set_cen(true));
        }
        let slave = tim3.smcr().read();
        if slave.ts() == Ts::ITR0 && slave.sms() == Sms::TRIGGER_MODE {
            tim3.cr1().modify(|w| w.set_cen(true));
        }
    }

    fn update(&mut self, index: usize) {
        let timer = self.timers()[index];
        self.count[index] = 0;
        self.shadows[index] = Shadow {
            reload: timer.arr().read().arr(),
            compares: core::array::from_fn(|channel| timer.ccr(channel).read().ccr()),
        };
    }

    /// One tick of both PWM timers; true if TIM1 has had an update that raises an interrupt.
    pub fn tick(&mut self) -> bool {
        self.settle();
        self.now += 1;
        self.time_ns += 47;
        let mut updated = false;
        // TIM8 first: a counter that TIM1 resets has not counted in the same tick.
        for (index, timer) in self.timers().into_iter().enumerate().rev() {
            if !timer.cr1().read().cen() {
                continue;
            }
            let preloaded = timer.cr1().read().arpe();
            let reload = if preloaded { self.shadows[index].reload } else { timer.arr().read().arr() };
            if self.count[index] < u32::from(reload) {
                self.count[index] += 1;
                continue;
            }
            self.update(index);
            if index == 0 {
                self.status[0] |= 1;
                timer.sr().write_value(pac::timer::regs::SrAdv(self.status[0]));
                updated = timer.dier().read().uie();
                self.trigger();
            }
        }
        self.drive_legs();
        updated
    }

    /// Counter of TIM1.
    pub fn count(&self) -> u32 {
        self.count[0]
    }

    fn drive_legs(&mut self) {
        let before = self.legs;
        for (index, (timer, pair)) in [(0, 0), (0, 1), (1, 0)].into_iter().enumerate() {
            self.drive(index, timer, pair);
        }
        for (leg, before) in self.legs.iter().zip(before) {
            let (upper, lower) = leg.gates();
            assert!(!(upper && lower), "both devices of a leg on at {}: {:?}", self.now, self.legs);
            let dead = u64::from(self.dead_time_ticks());
            let dead_enough = |off: Option<u64>| off.is_none_or(|off| self.now >= off + dead);
            if upper && !before.upper.on {
                assert!(dead_enough(leg.lower.went_off), "dead time at {}: {leg:?}", self.now);
            }
            if lower && !before.lower.on {
                assert!(dead_enough(leg.upper.went_off), "dead time at {}: {leg:?}", self.now);
            }
        }
    }

    fn drive(&mut self, leg: usize, index: usize, pair: usize) {
        let timer = self.timers()[index];
        let reference = self.reference(timer, index, pair);
        // In whole ticks.
        let (now, dead_ticks) = (self.now, dead_cycles(timer) / (u32::from(timer.psc().read()) + 1));
        let leg = &mut self.legs[leg];
        if leg.reference != reference {
            (leg.reference, leg.since) = (reference, now);
        }
        let settled = now >= leg.since + u64::from(dead_ticks);
        let (main, enabled) = (timer.bdtr().read(), timer.ccer().read());
        assert!(
            main.moe() || main.ossi() == pac::timer::vals::Ossi::IDLE_LEVEL || timer.ccer().read().0 == 0
        );
        let upper = main.moe() && enabled.cce(2 * pair) && reference && settled;
        let lower = main.moe() && enabled.ccne(2 * pair) && !reference && settled;
        for (device, on) in [(&mut leg.upper, upper), (&mut leg.lower, lower)] {
            if device.on && !on {
                device.went_off = Some(now);
            }
            device.on = on;
        }
    }

    /// OCxREFC of a pair's odd channel.
    fn reference(&self, timer: pac::timer::TimAdv, index: usize, pair: usize) -> bool {
        let modes = timer.ccmr_output(pair).read();
        let compare = |n: usize| {
            let channel = 2 * pair + n;
            let preloaded = modes.ocpe(n);
            let shadow = self.shadows[index].compares[channel];
            u32::from(if preloaded { shadow } else { timer.ccr(channel).read().ccr() })
        };
        let count = self.count[index];
        match (modes.ocm(0).to_bits(), modes.ocm(1).to_bits()) {
            (12, 13) => count < compare(0) || count >= compare(1),
            (4, _) | (0, 0) => false,
            other => panic!("modes {other:?}"),
        }
    }

    /// Dead time that the power stage asks for: 5 µs at 21.25 MHz, not rounded up.
    fn dead_time_ticks(&self) -> u32 {
        106
    }
}

impl Wait for Bench {
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout> {
        (self.watch)(&self.registers);
        if self.broken {
            return Err(Timeout);
        }
        let Registers { rcc, adc1, adc2, adc3, adc5, .. } = self.registers;
        rcc.cr().modify(|w| {
            w.set_hserdy(w.hseon());
            w.set_pllrdy(w.pllon());
        });
        rcc.cfgr().modify(|w| w.set_sws(w.sw()));
        for adc in [adc1, adc2, adc3, adc5] {
            self.convert(adc);
        }
        self.settle();
        if done() { Ok(()) } else { Err(Timeout) }
    }

    fn microseconds(&mut self, us: u32) {
        (self.watch)(&self.registers);
        self.time_ns += u64::from(us) * 1_000;
        if self.quiet_from_ns.is_some_and(|from| self.time_ns >= from) {
            self.fault = [false; 2];
        }
        self.settle();
    }
}

impl Bench {
    /// A converter does what its control register asks for.
    fn convert(&self, adc: pac::adc::Adc) {
        let (control, sequence) = (adc.cr().read(), adc.jsqr().read());
        adc.cr().modify(|w| w.set_adcal(false));
        adc.isr().write(|w| w.set_adrdy(control.aden()));
        if control.jadstart() && sequence.jexten() == pac::adc::vals::Exten::DISABLED {
            self.finish_sequence(adc);
            adc.cr().modify(|w| w.set_jadstart(false));
        }
    }

    /// A sequence has ended. Its first conversion is wrong if the last one was more than 1 ms ago (ES0430, "wrong ADC result if
    /// conversion done late after calibration or previous conversion").
    pub fn finish_sequence(&self, adc: pac::adc::Adc) {
        let sequence = adc.jsqr().read();
        let Registers { adc1, adc2, adc3, adc5, .. } = self.registers;
        let index = [adc1, adc2, adc3, adc5].iter().position(|own| own.as_ptr() == adc.as_ptr());
        let last_ns = index.map(|index| self.converted_ns[index].replace(self.time_ns));
        let late = last_ns.is_some_and(|last_ns| self.time_ns > last_ns + 1_000_000);
        for rank in 0..usize::from(sequence.jl()) + 1 {
            let code =
                self.codes[usize::from(sequence.jsq(rank))] ^ if late && rank == 0 { 0x100 } else { 0 };
            // SAFETY: JDR1 is word 32 of the converter's block; the board only reads it.
            unsafe { adc.as_ptr().cast::<u32>().add(32 + rank).write_volatile(u32::from(code)) };
        }
        adc.isr().write(|w| w.set_jeos(true));
    }
}
