//! The PMaSynRM firmware on the NUCLEO-G474RE: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// On the board the image runs; on the host it prints the command that flashes it.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("This is the firmware. `cargo xtask flash` builds it for its board and flashes it.");
}

#[cfg(target_os = "none")]
mod firmware {
    use cortex_m_rt::{entry, interrupt};
    use nucleo_g474re::built_in::traction::{BUILT_IN, BuiltIn};
    use nucleo_g474re::patterns::chosen;
    use nucleo_g474re::position::{Position, Sensor};
    use nucleo_g474re::power_stage::POWER_STAGE;
    use nucleo_g474re::registers::Registers;
    use nucleo_g474re::sampling::KeptZeros;
    use nucleo_g474re::{
        self as board, CLOCK, Control, Interrupt as interrupt, POSITION, PULSE, Pwm, SHARED,
    };
    use tractive::drive::traction::{ControlTask, PwmTask, Settings};
    use tractive::protection::FailedCheck;
    use tractive::time::Instant;

    /// The zeros that the start measured, written before the interrupts are unmasked.
    static CONTROL_ZEROS: KeptZeros = KeptZeros::new();
    static PWM_ZEROS: KeptZeros = KeptZeros::new();

    const fn settings() -> Settings {
        POWER_STAGE.settings(&BUILT_IN.ratings)
    }

    // The build script has already reported this by name: no image is built for a machine with which the drive would not start.
    const _: () = assert!(settings().check(&BUILT_IN).is_ok());

    #[entry]
    fn main() -> ! {
        board::idle(start().err())
    }

    /// Starts the drive; the error says why the start is refused.
    fn start() -> Result<(), FailedCheck> {
        let found = board::prepare(settings().devices).map_err(|error| error.failed())?;
        CONTROL_ZEROS.keep(found.control_zeros);
        PWM_ZEROS.keep(found.pwm_zeros);
        board::run();
        Ok(())
    }

    /// Deadline: the next control interrupt. If missed: fault `control_deadline`, gates into the safe state.
    #[interrupt]
    fn TIM3() {
        static mut BOARD: Option<Control<'static, Sensor>> = None;
        static mut TASK: ControlTask<BuiltIn> =
            chosen(ControlTask::new(BuiltIn, settings(), Instant(CLOCK.control_ticks)), &CLOCK);
        let board = BOARD.get_or_insert_with(|| {
            let registers = Registers::CHIP;
            let sensor = Sensor::of(&registers, &POWER_STAGE, &BUILT_IN.ratings);
            Control::new(registers, CONTROL_ZEROS.kept(), sensor, &POSITION)
        });
        TASK.run(board, &SHARED);
        PULSE.control_ran();
        nucleo_g474re::complete_stores();
    }

    /// Deadline: the next carrier boundary, where the shadow registers take over. If missed: a break, gates off for good.
    #[interrupt]
    fn TIM1_UP_TIM16() {
        static mut BOARD: Option<Pwm> = None;
        static mut TASK: PwmTask<BuiltIn> =
            PwmTask::new(BuiltIn, settings(), Instant(settings().devices.shortest_half_ticks));
        let board = BOARD.get_or_insert_with(|| Pwm::new(Registers::CHIP, PWM_ZEROS.kept()));
        if TASK.run(board, &SHARED) {
            PULSE.pwm_ran();
        }
        nucleo_g474re::complete_stores();
    }

    nucleo_g474re::last_resorts!(board::die);
}
