//! The processor: instructions by the emulator, exceptions as ARMv7-M has them (DDI 0403E, B1.5).

use super::cost;
use crate::chip::rcc::IWDGRSTF;
use crate::image::{FLASH, Image};
use crate::machine::{Machine, Waits, What};
use crate::time::Time;
use anyhow::{Result, anyhow, bail};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Permission, RegisterARM as R, UcHookId, Unicorn, uc_error,
};

/// RAM: its address, and the length of SRAM1, SRAM2 and the CCM SRAM's alias (RM0440, memory map).
const RAM: (u32, u32) = (0x2000_0000, 128 * 1024);
/// The CCM SRAM, by the address at which the core fetches from it. An image that has code there does without the alias.
pub const CCM: (u32, u32) = (0x1000_0000, 32 * 1024);
/// The alias.
const CCM_ALIAS: u32 = RAM.0 + RAM.1 - CCM.1;
/// The regions of the peripherals.
const PERIPHERALS: [(u32, u32); 5] = [
    (0x4000_0000, 0x3_0000),
    (0x4800_0000, 0x2000),
    (0x5000_0000, 0x7_0000),
    (0xE000_0000, 0x1_0000),
    (0xE004_2000, 0x1000),
];
/// The emulator's word for a return from an exception.
const EXCEPTION_RETURN: u32 = 8;
/// EXC_RETURN: to a handler or a thread on the main stack, without a floating-point frame.
const TO_HANDLER: u32 = 0xFFFF_FFF1;
const TO_THREAD: u32 = 0xFFFF_FFF9;
/// Its bit that is clear where there is a floating-point frame.
const NO_FLOAT: u32 = 1 << 4;
/// EPSR.IT in xPSR.
const IT_STATE: u32 = 0x0600_FC00;
/// The memory's content before the program writes.
const PAINT: u8 = 0xA5;
/// Cycles from one look to the next while the core stands still.
const STALL_CYCLES: u32 = 17;
/// The flag of a reset by the pin, which every reset drives.
const PIN_RESET: u32 = 1 << 26;
/// CONTROL.FPCA, and the bit beside it, SFPA of ARMv8-M: the emulator takes the core to be in its secure state, and without that bit creates a new
/// floating-point context, with new FPSCR and flags, at the next floating-point instruction.
const FLOAT_CONTEXT: u32 = 0b11 << 2;
/// Words of a frame, and of the floating-point registers in it.
const FRAME: u32 = 8;
const FLOATS: u32 = 18;
/// Cycles of entry and return, and those that the floating-point frame adds.
const ENTRY: u32 = 12;
const FLOAT_CYCLES: u32 = 17;

/// The reason why the emulator has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// An interrupt is to be taken.
    Interrupt,
    /// A handler returns.
    Return,
    /// The time is over.
    Done,
    /// The chip is reset.
    Reset,
    /// Another exception of the processor.
    Exception(u32),
}

/// The longest run of a handler, in cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Longest {
    /// With no wait for the flash memory.
    pub cycles: u64,
    /// With the prefetch alone, and with every wait state for the words of tables and literals; a branch counts by whether it was taken. 0 unless waits
    /// are counted.
    pub prefetched: u64,
    /// With every wait state; 0 unless waits are counted.
    pub waited: u64,
}

/// The processor, with the machine around it.
pub struct Cpu {
    engine: Unicorn<'static, Machine>,
    /// The costs of the handlers, by exception.
    pub longest: BTreeMap<usize, Longest>,
    entered: Vec<(Time, Option<Waits>)>,
    /// The vector table's first two words.
    start: (u32, u32),
    /// The hook that tells of writes to the CCM SRAM, while it can be written.
    code_writes: Option<UcHookId>,
}

fn failed(error: uc_error) -> anyhow::Error {
    anyhow!("the emulator: {error:?}")
}

impl Cpu {
    /// Out of reset, with this image in the flash memory.
    pub fn new(image: &Image, machine: Machine) -> Result<Self> {
        let mode = Mode::THUMB | Mode::MCLASS | Mode::LITTLE_ENDIAN;
        let mut engine = Unicorn::new_with_data(Arch::ARM, mode, machine).map_err(failed)?;
        engine.ctl_set_cpu_model(ArmCpuModel::UC_CPU_ARM_CORTEX_M4 as i32).map_err(failed)?;
        // The alias at 0 (boot from flash), and the flash memory itself.
        for origin in [0, FLASH.0] {
            engine
                .mem_map(origin.into(), FLASH.1 as usize, Permission::READ | Permission::EXEC)
                .map_err(failed)?;
            engine.mem_write(origin.into(), &image.flash).map_err(failed)?;
        }
        let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| image.flash[at + byte]));
        // The stack ends where the RAM does.
        let ram_end = if word(0) > CCM_ALIAS { RAM.0 + RAM.1 } else { CCM_ALIAS };
        let ram = (RAM.0, ram_end - RAM.0);
        engine.mem_map(ram.0.into(), ram.1 as usize, Permission::READ | Permission::WRITE).map_err(failed)?;
        if ram_end == CCM_ALIAS {
            engine.mem_map(CCM.0.into(), CCM.1 as usize, Permission::ALL).map_err(failed)?;
        }
        for (origin, length) in PERIPHERALS {
            let read = move |engine: &mut Unicorn<Machine>, offset: u64, size: usize| {
                let machine = engine.get_data_mut();
                u64::from(machine.read(origin + offset as u32, size))
            };
            let write = move |engine: &mut Unicorn<Machine>, offset: u64, size: usize, value: u64| {
                engine.get_data_mut().write(origin + offset as u32, size, value as u32);
            };
            engine.mmio_map(origin.into(), length as usize, Some(read), Some(write)).map_err(failed)?;
        }
        hook(&mut engine).map_err(failed)?;
        // After power-up nobody knows what the memory holds.
        engine.mem_write(ram.0.into(), &vec![PAINT; ram.1 as usize]).map_err(failed)?;
        let mut cpu = Self {
            engine,
            longest: BTreeMap::new(),
            entered: Vec::new(),
            start: (word(0), word(4)),
            code_writes: None,
        };
        cpu.open_code()?;
        cpu.begin()?;
        Ok(cpu)
    }

    /// Out of reset; the memory keeps what it holds.
    fn begin(&mut self) -> Result<()> {
        self.entered.clear();
        let (stack, entry) = self.start;
        for (register, value) in
            [(R::CONTROL, 0), (R::PRIMASK, 0), (R::XPSR_NZCVQG, 1 << 24), (R::MSP, stack)]
        {
            self.set(register, value)?;
        }
        self.set(R::LR, u32::MAX)?;
        self.jump(entry)
    }

    /// From now on a finding's place is the exact instruction, not the beginning of its block. This makes the emulator slower.
    pub fn trace(&mut self) -> Result<()> {
        self.engine
            .add_code_hook(1, 0, |engine, address, _| engine.get_data_mut().findings.now.1 = address as u32)
            .map_err(failed)?;
        self.engine.ctl_flush_tb().map_err(failed)
    }

    /// From now on the waits for the flash memory are counted. This makes the emulator take a quarter longer.
    pub fn count_waits(&mut self) -> Result<()> {
        self.machine_mut().waits = Some(Waits::default());
        hook_loads(&mut self.engine).and_then(|()| self.engine.ctl_flush_tb()).map_err(failed)
    }

    /// The CCM SRAM can be written, and the emulator tells of it, if the image has code there.
    fn open_code(&mut self) -> Result<()> {
        if self.start.0 > CCM_ALIAS || self.code_writes.is_some() {
            return Ok(());
        }
        self.engine.mem_protect(CCM.0.into(), CCM.1 as usize, Permission::ALL).map_err(failed)?;
        self.code_writes = Some(hook_code(&mut self.engine).map_err(failed)?);
        self.engine.ctl_flush_tb().map_err(failed)
    }

    /// Once all of the CCM SRAM is protected, nothing needs to report writes: with such a hook the emulator looks for it at each access of any memory,
    /// which takes a third longer.
    fn close_code(&mut self) -> Result<()> {
        if !self.machine().chip.system.is_all_protected() {
            return Ok(());
        }
        let Some(hook) = self.code_writes.take() else { return Ok(()) };
        let closed = self.engine.remove_hook(hook).and_then(|()| {
            self.engine.mem_protect(CCM.0.into(), CCM.1 as usize, Permission::READ | Permission::EXEC)?;
            self.engine.ctl_flush_tb()
        });
        closed.map_err(failed)
    }

    /// A reset with these flags of its cause.
    pub fn reset(&mut self, cause: u32) -> Result<()> {
        self.machine_mut().reset(cause);
        self.open_code()?;
        self.begin()
    }

    /// The bytes between the end of the static data, which is given, and the end of RAM.
    pub fn stack_room(&self, statics_end: u32) -> u32 {
        self.start.0 - statics_end
    }

    /// The bytes of the stack that have been written at any time, above the end of the static data.
    pub fn stack_bytes(&self, statics_end: u32) -> Result<u32> {
        let top = self.start.0;
        let bytes =
            self.engine.mem_read_as_vec(statics_end.into(), (top - statics_end) as usize).map_err(failed)?;
        let untouched = bytes.iter().take_while(|byte| **byte == PAINT).count() as u32;
        Ok(top - statics_end - untouched)
    }

    /// Time passes while the core executes nothing: it hangs, or a debugger has halted it.
    pub fn stall(&mut self, until: Time) -> Result<()> {
        while self.machine().now() < until && !self.machine().wants_reset() {
            self.machine_mut().pass(STALL_CYCLES);
        }
        self.bite()
    }

    /// The reset, if the watchdog has bitten.
    fn bite(&mut self) -> Result<()> {
        if self.machine().wants_reset() { self.reset(IWDGRSTF | PIN_RESET) } else { Ok(()) }
    }

    /// The machine.
    pub fn machine(&self) -> &Machine {
        self.engine.get_data()
    }

    /// The same, to be changed between two runs.
    pub fn machine_mut(&mut self) -> &mut Machine {
        self.engine.get_data_mut()
    }

    fn get(&self, register: R) -> Result<u32> {
        self.engine.reg_read(register).map(|value| value as u32).map_err(failed)
    }

    fn set(&mut self, register: R, value: u32) -> Result<()> {
        self.engine.reg_write(register, value.into()).map_err(failed)
    }

    fn jump(&mut self, to: u32) -> Result<()> {
        if to & 1 == 0 {
            bail!("a jump to {to:#010x}, which is not Thumb code");
        }
        self.set(R::PC, to)
    }

    /// Executes until the machine's time has come to `until`.
    pub fn run(&mut self, until: Time) -> Result<()> {
        self.machine_mut().until = until;
        while self.machine().now() < until && !self.machine().world.done {
            self.bite()?;
            if self.machine().wants_interrupt() && self.take_interrupt()? {
                continue;
            }
            self.close_code()?;
            self.machine_mut().stop = None;
            let from = u64::from(self.get(R::PC)? | 1);
            let outcome = self.engine.emu_start(from, u64::from(u32::MAX), 0, 0);
            let pc = self.get(R::PC)?;
            if let Err(error) = outcome {
                bail!("{} at {pc:#010x}: {error:?}", self.machine().told());
            }
            match self.machine().stop {
                Some(Stop::Return) => self.leave(pc)?,
                Some(Stop::Exception(number)) => {
                    bail!("{} at {pc:#010x}: the processor's exception {number}", self.machine().told());
                }
                Some(Stop::Interrupt | Stop::Done | Stop::Reset) | None => {}
            }
        }
        Ok(())
    }

    fn take_interrupt(&mut self) -> Result<bool> {
        // Between two blocks that one IT instruction spans: the emulator cannot give its state back.
        if self.get(R::XPSR)? & IT_STATE != 0 {
            let machine = self.machine_mut();
            (machine.masked, machine.deferred) = (true, true);
            return Ok(false);
        }
        let primask = self.get(R::PRIMASK)? & 1 != 0;
        let Some(exception) = self.machine().nvic.next(primask) else {
            self.machine_mut().masked = true;
            return Ok(false);
        };
        self.enter(exception)?;
        Ok(true)
    }

    fn enter(&mut self, exception: usize) -> Result<()> {
        // The emulator's own flag for this, CONTROL.FPCA, lags behind where a block goes on after a return: what is saved is never too little.
        let floats = self.machine().nvic.has_fpu();
        let (sp, xpsr) = (self.get(R::SP)?, self.get(R::XPSR)?);
        let words = FRAME + if floats { FLOATS } else { 0 };
        // Aligned to eight bytes; bit 9 of the stacked word says whether the alignment took a word.
        let frame = (sp - 4 * words) & !7;
        let odd = u32::from(sp & 4 != 0) << 9;
        let mut stack = Vec::new();
        for register in [R::R0, R::R1, R::R2, R::R3, R::R12, R::LR, R::PC] {
            stack.push(self.get(register)?);
        }
        stack.push(xpsr & !(1 << 9) | 1 << 24 | odd);
        if floats {
            for single in 0..16 {
                stack.push(self.single(single)?);
            }
            stack.extend([self.get(R::FPSCR)?, 0]);
        }
        let bytes: Vec<u8> = stack.iter().flat_map(|word| word.to_le_bytes()).collect();
        self.engine.mem_write(frame.into(), &bytes).map_err(failed)?;
        let to = if self.machine().nvic.active.is_empty() { TO_THREAD } else { TO_HANDLER };
        self.set(R::LR, if floats { to & !NO_FLOAT } else { to })?;
        self.set(R::CONTROL, 0)?;
        self.set(R::SP, frame)?;
        self.set(R::XPSR_NZCVQG, 1 << 24 | exception as u32)?;
        let cycles = ENTRY + if floats { FLOAT_CYCLES } else { 0 };
        let machine = self.machine_mut();
        let (vector, now) = (machine.nvic.vectors() + 4 * exception as u32, machine.now());
        machine.nvic.enter(exception, now);
        machine.keep(What::Entry);
        machine.pass(cycles);
        let entered = (machine.now(), machine.waits);
        self.entered.push(entered);
        let mut target = [0; 4];
        self.engine.mem_read(vector.into(), &mut target).map_err(failed)?;
        self.jump(u32::from_le_bytes(target))
    }

    fn leave(&mut self, to: u32) -> Result<()> {
        // The emulator has taken the lowest bit away.
        let (to, floats) = (to | 1, to & NO_FLOAT == 0);
        let now = self.machine().now();
        let Some(left) = self.machine_mut().nvic.leave(now) else {
            bail!("a return to {to:#010x} from no exception")
        };
        let waits = self.machine().waits;
        let (since, before) = self.entered.pop().unwrap_or((now, waits));
        let cycles = (now - since) / self.machine().cycle();
        let longest = self.longest.entry(left).or_default();
        longest.cycles = longest.cycles.max(cycles);
        if let (Some(waits), Some(before)) = (waits, before) {
            let prefetched = cycles.saturating_add_signed(waits.prefetched - before.prefetched);
            longest.prefetched = longest.prefetched.max(prefetched);
            longest.waited = longest.waited.max(cycles + waits.all - before.all);
        }
        if (to | NO_FLOAT == TO_THREAD) != self.machine().nvic.active.is_empty() {
            bail!("the exception {left} returns to {to:#010x}");
        }
        let frame = self.get(R::SP)?;
        let words = FRAME + if floats { FLOATS } else { 0 };
        let bytes = self.engine.mem_read_as_vec(frame.into(), 4 * words as usize).map_err(failed)?;
        let stack: Vec<u32> = bytes
            .chunks_exact(4)
            .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
            .collect();
        for (register, value) in [R::R0, R::R1, R::R2, R::R3, R::R12, R::LR].into_iter().zip(&stack) {
            self.set(register, *value)?;
        }
        let xpsr = stack[7];
        if floats {
            for single in 0..16 {
                self.set_single(single, stack[8 + single])?;
            }
            self.set(R::FPSCR, stack[24])?;
        }
        let outer = self.machine().nvic.active.last().copied().unwrap_or(0) as u32;
        self.set(R::XPSR_NZCVQG, xpsr & !0x3FF | outer)?;
        self.set(R::CONTROL, if floats { FLOAT_CONTEXT } else { 0 })?;
        self.set(R::SP, frame + 4 * words + if xpsr & 1 << 9 != 0 { 4 } else { 0 })?;
        self.machine_mut().pass(ENTRY + if floats { FLOAT_CYCLES } else { 0 });
        self.jump(stack[6] | 1)
    }

    fn single(&self, number: usize) -> Result<u32> {
        self.engine.reg_read(R::S0 as i32 + number as i32).map(|value| value as u32).map_err(failed)
    }

    fn set_single(&mut self, number: usize, value: u32) -> Result<()> {
        self.engine.reg_write(R::S0 as i32 + number as i32, value.into()).map_err(failed)
    }

    /// A word of the memory.
    pub fn word(&self, address: u32) -> Result<u32> {
        let mut bytes = [0; 4];
        self.engine.mem_read(address.into(), &mut bytes).map_err(failed)?;
        Ok(u32::from_le_bytes(bytes))
    }
}

/// The emulator tells of writes to code in the CCM SRAM.
fn hook_code(engine: &mut Unicorn<'static, Machine>) -> Result<UcHookId, uc_error> {
    let last = u64::from(CCM.0 + CCM.1 - 1);
    engine.add_mem_hook(HookType::MEM_WRITE, CCM.0.into(), last, |engine, _, address, _, _| {
        engine.get_data_mut().write_code(address as u32);
        true
    })
}

/// The emulator tells of every basic block, of exceptions, and of accesses to nowhere or to what is protected.
fn hook(engine: &mut Unicorn<'static, Machine>) -> Result<(), uc_error> {
    let mut costs = FxHashMap::default();
    engine.add_block_hook(1, 0, move |engine, address, size| {
        let code = || engine.mem_read_as_vec(address, size as usize).unwrap_or_default();
        let is_ccm = is_ccm(address as u32);
        let cost = *costs.entry(address).or_insert_with(|| match is_ccm {
            true => cost::unwaited(&code()),
            false => cost::of(address as usize, &code()),
        });
        if engine.get_data_mut().block(address as u32, size, cost) {
            // It stops before the block, whose cost is not counted twice.
            let _ = engine.emu_stop();
        }
    })?;
    engine.add_intr_hook(|engine, number| {
        let stop = if number == EXCEPTION_RETURN { Stop::Return } else { Stop::Exception(number) };
        engine.get_data_mut().stop = Some(stop);
        let _ = engine.emu_stop();
    })?;
    engine.add_mem_hook(HookType::MEM_INVALID, 1, 0, |engine, kind, address, size, _| {
        let machine = engine.get_data_mut();
        let is_code = kind == MemType::WRITE_PROT && is_ccm(address as u32);
        if is_code {
            machine.write_code(address as u32);
        } else {
            machine.findings.add(format!("{kind:?} of {size} bytes at {address:#010x}, where nothing is"));
        }
        // Such a write has no effect, and the program continues.
        is_code
    })?;
    Ok(())
}

/// The emulator reports loads from memory that makes them wait.
fn hook_loads(engine: &mut Unicorn<'static, Machine>) -> Result<(), uc_error> {
    // Tables and literals: each word takes every wait state, as without the data cache. A literal beside the code in the CCM SRAM: the fetch of the same
    // cycle waits for it.
    for ((origin, length), wait) in [((0, FLASH.1), cost::WAIT_STATES), (FLASH, cost::WAIT_STATES), (CCM, 1)]
    {
        let (from, to) = (u64::from(origin), u64::from(origin + length - 1));
        engine.add_mem_hook(HookType::MEM_READ, from, to, move |engine, _, _, _, _| {
            engine.get_data_mut().wait(wait.into(), wait);
            true
        })?;
    }
    Ok(())
}

/// `true` for an address in the CCM SRAM.
fn is_ccm(address: u32) -> bool {
    (CCM.0..CCM.0 + CCM.1).contains(&address)
}
