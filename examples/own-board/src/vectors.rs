//! The chip's interrupts, in the order of their numbers; two of them are used.

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
    vectors[25] = Vector { handler: TIM1_UP };
    vectors[28] = Vector { handler: TIM2 };
    vectors
};
