//! The processor's own arithmetic that Rust's `core` does not offer.

/// Square root of a number that is not negative, correctly rounded; NaN stays NaN.
#[cfg(target_arch = "arm")]
#[inline(always)]
#[allow(unsafe_code)]
pub fn sqrt(x: f32) -> f32 {
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
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}
