//! The chip's interrupts, in the order of their numbers; two of them are used.

use cortex_m::interrupt::InterruptNumber;

/// The interrupts that are used.
#[derive(Clone, Copy)]
pub enum Interrupt {
    /// The PWM timer's.
    Pwm = 25,
    /// The control timer's.
    Control = 28,
}

// SAFETY: these numbers never change, and each is the place of its handler in the table below.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// An entry of the vector table.
#[derive(Clone, Copy)]
pub union Vector {
    handler: unsafe extern "C" fn(),
    reserved: usize,
}

unsafe extern "C" {
    fn TIM1_UP();
    fn TIM2();
}

/// Interrupts of the chip.
const COUNT: usize = 82;

/// The vector table after the processor's own exceptions.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [Vector; COUNT] = {
    let mut vectors = [Vector { reserved: 0 }; COUNT];
    vectors[Interrupt::Pwm as usize] = Vector { handler: TIM1_UP };
    vectors[Interrupt::Control as usize] = Vector { handler: TIM2 };
    vectors
};
