//! Reset and clock control (RM0440, chapter 7).

use crate::finding::Findings;
use crate::time::{MICROSECOND, MILLISECOND, Time, cycle};
use std::collections::HashMap;

const CR: u32 = 0x00;
const CFGR: u32 = 0x08;
const PLLCFGR: u32 = 0x0C;
const CCIPR: u32 = 0x88;
const CSR: u32 = 0x94;
/// The other registers that are modelled, as words that are kept: the enables of the buses.
const KEPT: [u32; 6] = [0x48, 0x4C, 0x50, 0x58, 0x5C, 0x60];

const HSEON: u32 = 1 << 16;
const HSERDY: u32 = 1 << 17;
const CSSON: u32 = 1 << 19;
const PLLON: u32 = 1 << 24;
const PLLRDY: u32 = 1 << 25;
/// The flag of a reset by the independent watchdog, and RMVF, which clears the flags.
pub const IWDGRSTF: u32 = 1 << 29;
const RMVF: u32 = 1 << 23;
/// The flags after power-up: brown-out and pin.
pub const POWER_ON: u32 = 0b11 << 26;

/// The internal oscillator and the board's crystal, in Hz.
const HSI_HZ: u32 = 16_000_000;
const HSE_HZ: u32 = 24_000_000;
/// The time that the crystal takes to start, and that of the PLL.
const HSE_STARTS: Time = 2 * MILLISECOND;
const PLL_LOCKS: Time = 100 * MICROSECOND;
/// The time for which the buses pass through half the frequency.
const HALF_SPEED: Time = MICROSECOND;

/// The clocks.
#[derive(Debug)]
pub struct Rcc {
    words: HashMap<u32, u32>,
    crystal_ready: Time,
    pll_ready: Time,
    core_hz: u32,
    /// The instant at which the core was switched to a fast clock.
    switched: Time,
    /// The crystal is there; a broken one does not start, and one that stops is a failure.
    pub crystal: bool,
}

/// The conditions of a fast clock: wait states of the flash memory, and a boosted core voltage.
#[derive(Clone, Copy, Debug)]
pub struct Supply {
    /// Wait states.
    pub latency: u32,
    /// The core voltage is boosted.
    pub boosted: bool,
}

impl Default for Rcc {
    fn default() -> Self {
        let reset = [(CR, 0x0500), (CFGR, 0x05), (PLLCFGR, 0x1000), (CCIPR, 0), (CSR, POWER_ON)];
        let kept = KEPT.map(|offset| {
            (
                offset,
                match offset {
                    0x48 => 0x100,
                    0x58 => 0x400,
                    _ => 0,
                },
            )
        });
        Self {
            words: reset.into_iter().chain(kept).collect(),
            crystal_ready: Time::MAX,
            pll_ready: Time::MAX,
            core_hz: HSI_HZ,
            switched: 0,
            crystal: true,
        }
    }
}

impl Rcc {
    /// A register as it stands.
    pub fn word(&self, offset: u32) -> u32 {
        self.words.get(&offset).copied().unwrap_or(0)
    }

    /// A register is read.
    pub fn read(&self, offset: u32) -> Option<u32> {
        self.words.get(&offset).copied()
    }

    /// The core's cycle, which is also that of the timers: no bus clock is divided.
    pub fn cycle(&self) -> Time {
        cycle(self.core_hz)
    }

    /// The core's clock, in Hz.
    pub fn core_hz(&self) -> u32 {
        self.core_hz
    }

    /// The CAN controller's clock in Hz, if it runs.
    pub fn can_clock(&self) -> Option<u32> {
        let ready = self.word(CR) & HSERDY != 0;
        (self.word(CCIPR) >> 24 & 0b11 == 0 && ready).then_some(HSE_HZ)
    }

    /// `true` if the clock security system has seen the crystal stop.
    pub fn has_failed(&self) -> bool {
        self.word(CR) & CSSON != 0 && !self.crystal
    }

    /// The crystal stops. With the clock security system the core continues on the internal oscillator, and the result is `true`: an exception follows
    /// (RM0440, clock security system).
    pub fn lose_crystal(&mut self) -> bool {
        self.crystal = false;
        (self.crystal_ready, self.pll_ready) = (Time::MAX, Time::MAX);
        if self.word(CR) & CSSON == 0 {
            return false;
        }
        let control = self.word(CR) & !(HSEON | HSERDY | PLLON | PLLRDY);
        let configuration = self.word(CFGR) & !0b1111 | 0b0101;
        self.words.insert(CR, control);
        self.words.insert(CFGR, configuration);
        self.core_hz = HSI_HZ;
        true
    }

    /// The flags of the last reset's cause.
    pub fn set_cause(&mut self, flags: u32) {
        self.words.insert(CSR, flags);
    }

    /// The next change.
    pub fn next_event(&self) -> Time {
        self.crystal_ready.min(self.pll_ready)
    }

    /// Does what is due.
    pub fn act(&mut self, now: Time) {
        if self.crystal_ready <= now {
            self.crystal_ready = Time::MAX;
            self.set(CR, HSERDY);
        }
        if self.pll_ready <= now {
            self.pll_ready = Time::MAX;
            self.set(CR, PLLRDY);
        }
    }

    fn set(&mut self, offset: u32, bits: u32) {
        *self.words.entry(offset).or_default() |= bits;
    }

    /// A register is written; `false` if the twin has no such register. The flash memory's wait states and the core voltage are checked when the core becomes
    /// faster.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: Time,
        supply: Supply,
        findings: &mut Findings,
    ) -> bool {
        match offset {
            CR => self.write_control(value, now, findings),
            PLLCFGR => {
                let running = self.word(CR) & PLLON != 0 && value != self.word(PLLCFGR);
                findings.expect(!running, || "RCC.PLLCFGR is written while the PLL runs".into());
                self.words.insert(PLLCFGR, value);
            }
            CFGR => self.write_configuration(value, now, supply, findings),
            CSR => {
                let flags = if value & RMVF != 0 { 0 } else { self.word(CSR) & 0xFF80_0000 };
                self.words.insert(CSR, flags);
            }
            CCIPR => {
                self.words.insert(CCIPR, value);
            }
            _ if KEPT.contains(&offset) => {
                self.words.insert(offset, value);
            }
            _ => return false,
        }
        true
    }

    fn write_control(&mut self, value: u32, now: Time, findings: &mut Findings) {
        let before = self.word(CR);
        let ready = before & (HSERDY | PLLRDY | 1 << 10);
        self.words.insert(CR, value & !(HSERDY | PLLRDY | 1 << 10) | ready);
        if value & HSEON != 0 && before & HSEON == 0 && self.crystal {
            self.crystal_ready = now + HSE_STARTS;
        }
        if value & PLLON != 0 && before & PLLON == 0 {
            let source = self.word(PLLCFGR) & 0b11;
            findings.expect(source != 0b11 || before & HSERDY != 0, || {
                "the PLL is started before its crystal is ready".into()
            });
            findings.expect(source >= 0b10, || "the PLL is started without a source".into());
            self.pll_ready = now + PLL_LOCKS;
        }
        let off = before & PLLON != 0 && value & PLLON == 0 && self.word(CFGR) & 0b1100 == 0b1100;
        findings.expect(!off, || "the PLL is stopped while the core runs on it".into());
    }

    /// The PLL's output R, in Hz.
    fn pll_hz(&self) -> u32 {
        let word = self.word(PLLCFGR);
        let source = if word & 0b11 == 0b11 { HSE_HZ } else { HSI_HZ };
        let (m, n, r) = ((word >> 4 & 0xF) + 1, word >> 8 & 0x7F, ((word >> 25 & 0b11) + 1) * 2);
        if word & 1 << 24 == 0 { 0 } else { source / m * n / r }
    }

    fn write_configuration(&mut self, value: u32, now: Time, supply: Supply, findings: &mut Findings) {
        let (before, ready) = (self.word(CFGR), self.word(CR));
        let source = value & 0b11;
        let is_ready = match source {
            0b01 => true,
            0b10 => ready & HSERDY != 0,
            0b11 => ready & PLLRDY != 0 && self.word(PLLCFGR) & 1 << 24 != 0,
            _ => false,
        };
        findings.expect(is_ready, || format!("RCC.CFGR switches to clock {source}, which is not ready"));
        let source_hz = match source {
            0b01 => HSI_HZ,
            0b10 => HSE_HZ,
            _ => self.pll_hz(),
        };
        let prescaler = value >> 4 & 0xF;
        let divided =
            if prescaler & 8 == 0 { 1 } else { [2, 4, 8, 16, 64, 128, 256, 512][(prescaler & 7) as usize] };
        let hz = source_hz / divided;
        findings.expect(value >> 8 & 0b11_1111 == 0, || "a divided peripheral bus is not modelled".into());
        if source_hz > 80_000_000 && before & 0b11 != source {
            findings.expect(divided == 2, || {
                "the core is switched to a clock above 80 MHz without passing through half of it".into()
            });
            self.switched = now;
        } else if hz > 80_000_000 && hz > self.core_hz {
            findings.expect(now >= self.switched + HALF_SPEED, || {
                "half the frequency lasted less than a microsecond".into()
            });
        }
        check_speed(hz, supply, findings);
        self.words.insert(CFGR, value & !0b1100 | source << 2);
        self.core_hz = hz.max(1);
    }
}

/// Wait states in range 1: one per 30 MHz without boost, one per 34 MHz with it; above 150 MHz only with it (RM0440, 3.3.3, 6.1.5).
fn check_speed(hz: u32, Supply { latency, boosted }: Supply, findings: &mut Findings) {
    let step_hz = if boosted { 34_000_000 } else { 30_000_000 };
    findings.expect(boosted || hz <= 150_000_000, || {
        format!("{hz} Hz without the voltage that it needs (PWR_CR5.R1MODE)")
    });
    findings.expect(hz <= 170_000_000, || format!("{hz} Hz is more than the chip's 170 MHz"));
    let needed = hz.div_ceil(step_hz).saturating_sub(1);
    findings.expect(latency >= needed, || {
        format!("{hz} Hz with {latency} wait states of the flash memory, which needs {needed}")
    });
}
