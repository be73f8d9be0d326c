//! Arbitrary text as a talk's script: no panic, and a refusal names its line.

use crate::talk::System;
use crate::talk::script::script;

/// Any bytes, with whatever is not text replaced.
pub fn check(bytes: &[u8]) {
    check_text(&String::from_utf8_lossy(bytes));
}

/// Any text, for both systems.
pub fn check_text(text: &str) {
    for system in [System::Pmasynrm, System::Zs9] {
        match script(text, system) {
            Ok(lines) => {
                assert!(lines.len() <= text.lines().count());
                assert!(lines.iter().all(|line| line.at_s.is_none_or(f64::is_finite)), "{lines:?}");
            }
            Err(error) => assert!(format!("{error:#}").contains("line "), "{error:#}"),
        }
    }
}
