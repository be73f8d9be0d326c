//! The mutant that is in force: none, one by its number, or all of them watched for being reached.
//!
//! Stands in the copy of the sources alone. The environment decides, once, before `main`.
#![feature(core_intrinsics, const_eval_select)]
#![allow(internal_features)]

use std::sync::atomic::{AtomicBool, Ordering};

/// `ACTIVE` while what is reached is written down.
const WATCHING: u32 = u32::MAX;

/// The number in force; 0: none. Written before `main`, read after.
static mut ACTIVE: u32 = 0;

static REACHED: [AtomicBool; COUNT] = [const { AtomicBool::new(false) }; COUNT];

/// Mutants and one more.
const COUNT: usize = include!("count.rs");

/// `true` if this mutant is in force; never while compiling.
#[inline(always)]
pub const fn is(number: u32) -> bool {
    const fn never(_: u32) -> bool {
        false
    }
    core::intrinsics::const_eval_select((number,), never, now)
}

#[inline(always)]
fn now(number: u32) -> bool {
    // SAFETY: written before `main` alone.
    let active = unsafe { ACTIVE };
    active == number || (active == WATCHING && reached(number))
}

#[cold]
#[inline(never)]
fn reached(number: u32) -> bool {
    REACHED[number as usize].store(true, Ordering::Relaxed);
    false
}

/// A value that lives for ever.
pub fn leak<T>(value: T) -> &'static mut T {
    Box::leak(Box::new(value))
}

#[used]
#[unsafe(link_section = ".init_array")]
static INIT: extern "C" fn() = init;

unsafe extern "C" {
    fn atexit(callback: extern "C" fn()) -> i32;
    fn setrlimit(resource: i32, limit: *const [u64; 2]) -> i32;
}

extern "C" fn init() {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    if let Some(seconds) = number("MUTANT_SECONDS") {
        // SAFETY: RLIMIT_CPU, a pair of numbers.
        unsafe { setrlimit(0, &[seconds, seconds + 1]) };
    }
    if let Some(active) = number("MUTANT") {
        // SAFETY: nobody else is there yet. RLIMIT_AS: a mutant that asks for all memory gets 4 GiB.
        unsafe {
            ACTIVE = active as u32;
            setrlimit(9, &[4 << 30, 4 << 30]);
        }
    }
    if std::env::var_os("MUTANT_TIME").is_some() {
        // SAFETY: a function of the C library, called before `main`.
        unsafe { atexit(time) };
    }
    if std::env::var_os("MUTANT_REACHED").is_some() {
        // SAFETY: as above.
        unsafe {
            ACTIVE = WATCHING;
            atexit(write);
        }
    }
}

/// The count that the system kept of this process and of those that it waited for.
extern "C" fn time() {
    if let Some(file) = std::env::var_os("MUTANT_TIME") {
        let stat = std::fs::read("/proc/self/stat").unwrap_or_default();
        let _ = std::fs::write(file, stat);
    }
}

extern "C" fn write() {
    let bytes: Vec<u8> = REACHED.iter().map(|reached| reached.load(Ordering::Relaxed).into()).collect();
    if let Some(folder) = std::env::var_os("MUTANT_REACHED") {
        let _ = std::fs::write(std::path::Path::new(&folder).join(std::process::id().to_string()), bytes);
    }
}
