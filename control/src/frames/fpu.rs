//! The processor's own arithmetic that Rust's `core` does not offer.

/// Square root of a number that is not negative, correctly rounded; NaN stays NaN.
#[cfg(target_arch = "arm")]
#[inline(always)]
pub(super) fn sqrt(x: f32) -> f32 {
    sqrtf(x)
}

/// C's function. The compiler knows what a pure function of this name does and puts the processor's instruction where it is called,
/// from register to register; assembly has to go through the core's registers, because Rust does not offer it the others.
#[cfg(target_arch = "arm")]
#[allow(unsafe_code)]
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn sqrtf(x: f32) -> f32 {
    let root: u32;
    // SAFETY: from register to register by way of s0, which is declared lost; the target has a floating-point unit
    // (thumbv7em-none-eabihf).
    unsafe {
        core::arch::asm!(
            "vmov s0, {x}",
            "vsqrt.f32 s0, s0",
            "vmov {root}, s0",
            x = in(reg) x.to_bits(),
            root = lateout(reg) root,
            out("s0") _,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    f32::from_bits(root)
}

/// The same where the processor is not known: the same bits.
#[cfg(not(target_arch = "arm"))]
#[inline]
pub(super) fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}
