//! The ZS9 firmware on the NUCLEO-G474RE: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// On the board the image runs; on the host it prints the command that flashes it.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware. `cargo xtask flash --system zs9` builds it for its board and flashes it."
    );
}

#[cfg(target_os = "none")]
mod firmware {
    use core::arch::global_asm;
    use core::sync::atomic::{AtomicU32, Ordering};
    use cortex_m_rt::{entry, interrupt};
    use nucleo_g474re::built_in::zs9::{BUILT_IN, BuiltIn};
    use nucleo_g474re::position::Encoder;
    use nucleo_g474re::power_stage::{AdcCode, PowerStage};
    use nucleo_g474re::registers::Registers;
    use nucleo_g474re::zs9::sampling::Zeros;
    use nucleo_g474re::zs9::stage::STAGE;
    use nucleo_g474re::zs9::{self as board, Control, POSITION, Pwm, SHARED, settings};
    use nucleo_g474re::{Interrupt as interrupt, PULSE};
    use tractive::drive::dual::{ControlTask, PwmTask};
    use tractive::protection::FailedCheck;

    /// The zeros that the start measured, written before the interrupts are unmasked.
    static ZEROS: [AtomicU32; 7] = [const { AtomicU32::new(0) }; 7];

    // The build script has already reported this by name: no image is built for a machine with which the drive would not start.
    const _: () = assert!(settings().check(&BUILT_IN).is_ok());

    fn keep(zeros: &Zeros) {
        let codes = zeros.motors.iter().flatten().chain([&zeros.inductor]);
        for (cell, zero) in ZEROS.iter().zip(codes) {
            cell.store(u32::from(zero.0), Ordering::Relaxed);
        }
    }

    fn kept() -> Zeros {
        let [u1, v1, w1, u2, v2, w2, inductor] =
            ZEROS.each_ref().map(|cell| AdcCode(cell.load(Ordering::Relaxed) as u16));
        Zeros { motors: [[u1, v1, w1], [u2, v2, w2]], inductor }
    }

    // Copies the interrupts' code word by word from the flash memory to the CCM SRAM (`ccm.x`). The runtime calls this before anything else, when
    // variables do not exist yet: therefore it is not in Rust.
    global_asm!(
        ".section .text.__pre_init, \"ax\"",
        ".global __pre_init",
        ".type __pre_init, %function",
        ".thumb_func",
        "__pre_init:",
        "ldr r0, =__sccm",
        "ldr r1, =__eccm",
        "ldr r2, =__siccm",
        "2: ldr r3, [r2], #4",
        "str r3, [r0], #4",
        "cmp r0, r1",
        "bne 2b",
        "dsb",
        "isb",
        "bx lr",
    );

    #[entry]
    fn main() -> ! {
        board::idle(start().err())
    }

    /// Starts the drive; the error says why the start is refused.
    fn start() -> Result<(), FailedCheck> {
        keep(&board::prepare().map_err(|error| error.failed())?);
        board::run();
        Ok(())
    }

    /// Deadline: the last peak before the next control interrupt. If missed: fault `control_deadline`, all gates off.
    #[interrupt]
    fn TIM2() {
        static mut BOARD: Option<Control<'static, Encoder>> = None;
        static mut TASK: ControlTask<BuiltIn> = ControlTask::new(BuiltIn, settings());
        let board = BOARD.get_or_insert_with(|| {
            let registers = Registers::CHIP;
            let [first, second] = STAGE.encoder_zeros;
            let encoder = |timer, encoder_zero| {
                let stage = PowerStage { encoder_zero, ..STAGE.common };
                Encoder::new(timer, &stage, &BUILT_IN.ratings)
            };
            let encoders = [encoder(registers.tim4, first), encoder(registers.tim3, second)];
            Control::new(registers, kept(), encoders, &POSITION)
        });
        TASK.run(board, &SHARED);
        PULSE.control_ran();
        nucleo_g474re::complete_stores();
    }

    /// Comes at peaks and valleys; the drive uses only the peaks. Deadline: the next valley, where the shadow registers take over. If missed: a
    /// break, gates off for good.
    #[interrupt]
    fn TIM1_UP_TIM16() {
        static mut BOARD: Option<Pwm> = None;
        static mut TASK: PwmTask<BuiltIn> = PwmTask::new(BuiltIn, settings());
        let board = BOARD.get_or_insert_with(|| Pwm::new(Registers::CHIP, kept()));
        if TASK.run(board, &SHARED) {
            PULSE.pwm_ran();
        }
        nucleo_g474re::complete_stores();
    }

    nucleo_g474re::last_resorts!(board::die);
}
