//! A file on the host machine, and the emulator's command line.

use core::sync::atomic::{AtomicU16, AtomicU32, Ordering};
use cortex_m_semihosting::syscall;

/// A file to write into.
pub struct File(AtomicU32);

impl File {
    /// A file that discards what is written.
    pub const fn closed() -> Self {
        Self(AtomicU32::new(u32::MAX))
    }

    /// Creates it under this path.
    pub fn create(&self, path: &str) {
        const WRITE: usize = 5;
        self.0.store(open(path, WRITE), Ordering::Relaxed);
    }

    /// Appends a record.
    pub fn write(&self, record: &[u32; 5]) {
        let handle = self.0.load(Ordering::Relaxed);
        if handle != u32::MAX {
            // SAFETY: SYS_WRITE reads exactly the record, which outlives the call.
            unsafe { syscall!(WRITE, handle, record.as_ptr(), size_of_val(record)) };
        }
    }
}

/// The handle of a file; `u32::MAX` where there is none.
fn open(path: &str, mode: usize) -> u32 {
    let mut name = [0; 256];
    let Some(room) = name.get_mut(..path.len()).filter(|_| path.len() < 256) else { return u32::MAX };
    room.copy_from_slice(path.as_bytes());
    // SAFETY: SYS_OPEN reads a NUL-terminated name of the given length; the last byte is still 0.
    unsafe { syscall!(OPEN, name.as_ptr(), mode, path.len()) as u32 }
}

/// Reads a file's half-words, as far as there is room.
pub fn read_half_words(path: &str, room: &[AtomicU16]) {
    const READ: usize = 1;
    let handle = open(path, READ);
    if handle != u32::MAX {
        // SAFETY: SYS_READ writes at most as many bytes as there is room for, and atomics may be written by way of a shared reference;
        // no interrupt is unmasked yet.
        unsafe { syscall!(READ, handle, room.as_ptr(), size_of_val(room)) };
    }
}

/// The emulator's command line: the image's name and what follows it; empty if it does not fit.
pub fn command_line(room: &mut [u8; 256]) -> &str {
    // SAFETY: SYS_GET_CMDLINE writes at most as many bytes as it is told, NUL-terminated.
    let failed = unsafe { syscall!(GET_CMDLINE, room.as_mut_ptr(), room.len()) };
    let length = room.iter().position(|byte| *byte == 0).unwrap_or(0);
    let line = room.get(..length).filter(|_| failed == 0).unwrap_or_default();
    core::str::from_utf8(line).unwrap_or_default()
}
