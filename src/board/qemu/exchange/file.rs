//! A file of this machine's, and the emulator's command line.

use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_semihosting::syscall;

/// A file to write into.
pub struct File(AtomicU32);

impl File {
    /// One that swallows what is written.
    pub const fn closed() -> Self {
        Self(AtomicU32::new(u32::MAX))
    }

    /// Creates it under this path.
    pub fn create(&self, path: &str) {
        const WRITE: usize = 5;
        let mut name = [0; 256];
        let Some(room) = name.get_mut(..path.len()).filter(|_| path.len() < 256) else { return };
        room.copy_from_slice(path.as_bytes());
        // SAFETY: SYS_OPEN reads a NUL-terminated name of the given length; the last byte is still 0.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), WRITE, path.len()) };
        self.0.store(handle as u32, Ordering::Relaxed);
    }
}

impl core::fmt::Write for &File {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        let handle = self.0.load(Ordering::Relaxed);
        if handle != u32::MAX {
            // SAFETY: SYS_WRITE reads exactly the text, which outlives the call.
            unsafe { syscall!(WRITE, handle, text.as_ptr(), text.len()) };
        }
        Ok(())
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
