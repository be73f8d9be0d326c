//! Checks that are switched off on the host.

use super::Fault;

/// Checks that are switched off, to see what is lost without them; on the host only, never in a firmware.
#[derive(Clone, Copy, Debug, Default)]
pub struct MaskedFaults {
    /// A bit for each fault's discriminant.
    #[cfg(not(target_os = "none"))]
    faults: u64,
}

impl MaskedFaults {
    /// Every check is on.
    pub const NONE: Self = Self {
        #[cfg(not(target_os = "none"))]
        faults: 0,
    };

    /// All checks on except the one that finds this fault.
    #[cfg(not(target_os = "none"))]
    pub const fn of(fault: Fault) -> Self {
        Self { faults: 1 << fault as u32 }
    }

    /// `true` if the check that finds this fault is off.
    #[cfg(not(target_os = "none"))]
    pub(crate) const fn has(&self, fault: Fault) -> bool {
        self.faults & 1 << fault as u32 != 0
    }

    #[cfg(target_os = "none")]
    pub(crate) const fn has(&self, _fault: Fault) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_that_is_off_is_no_others() {
        for off in Fault::ALL {
            let masked = MaskedFaults::of(off);
            assert!(Fault::ALL.into_iter().all(|fault| masked.has(fault) == (fault == off)), "{off:?}");
            assert!(!MaskedFaults::NONE.has(off));
        }
    }
}
