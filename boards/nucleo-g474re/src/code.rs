//! The interrupts' code: it lies in the flash memory, and is executed from the CCM SRAM, which has no wait states.
#![allow(unsafe_code)]

unsafe extern "C" {
    /// The first word in the CCM SRAM.
    static mut __sccm: u32;
    /// The end of its words there.
    static __eccm: u32;
    /// The first word in the flash memory.
    static __siccm: u32;
}

/// Copies it. Nothing of it may be called before.
pub(super) fn load() {
    // SAFETY: the linker file places both, word by word, and nothing else is between; the code is not in use yet.
    unsafe {
        let (mut from, mut to) = (&raw const __siccm, &raw mut __sccm);
        while to.cast_const() < &raw const __eccm {
            // Volatile, or the compiler makes a call of `memcpy` of it, which is itself part of the code.
            to.write_volatile(from.read_volatile());
            (from, to) = (from.add(1), to.add(1));
        }
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
