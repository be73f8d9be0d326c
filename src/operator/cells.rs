//! Between the operator in the idle loop and the control interrupt: words with instants, so that the same control period sees the same
//! permit wherever the idle loop stood.

use super::{Observation, Permit, SLOT_PERIODS};
use crate::cell::{Downlink, Uplink, Words};
use crate::control::{Demand, LinkWindow};
use crate::drive::{Report, trip_from_words, trip_to_words};
use crate::time::{Clock, Instant};
use core::sync::atomic::{AtomicU32, Ordering};

/// A permit and from when on it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Timed {
    permit: Permit,
    from: Instant,
}

/// The word of [`Timed`] that says from when on it holds.
const FROM: usize = 6;

impl Words<7> for Timed {
    fn to_words(self) -> [u32; 7] {
        let Permit { enable, demand, window, acknowledge } = self.permit;
        let flags = u32::from(enable) | u32::from(demand.slew_limited) << 1 | u32::from(acknowledge) << 8;
        [
            flags,
            demand.torque_nm.to_bits(),
            window.motoring_none_v.to_bits(),
            window.motoring_full_v.to_bits(),
            window.braking_full_v.to_bits(),
            window.braking_none_v.to_bits(),
            self.from.0,
        ]
    }

    fn from_words(words: [u32; 7]) -> Self {
        let [flags, torque, motoring_none, motoring_full, braking_full, braking_none, from] = words;
        Self {
            permit: Permit {
                enable: flags & 1 != 0,
                demand: Demand { torque_nm: f32::from_bits(torque), slew_limited: flags & 2 != 0 },
                window: LinkWindow {
                    motoring_none_v: f32::from_bits(motoring_none),
                    motoring_full_v: f32::from_bits(motoring_full),
                    braking_full_v: f32::from_bits(braking_full),
                    braking_none_v: f32::from_bits(braking_none),
                },
                acknowledge: (flags >> 8) as u8,
            },
            from: Instant(from),
        }
    }
}

impl Words<9> for Observation {
    fn to_words(self) -> [u32; 9] {
        let [code, value, limit, tripped_at] = trip_to_words(self.trip);
        let code = code | u32::from(self.acknowledged) << 16 | u32::from(self.speed_known) << 24;
        let measured = [self.udc_v, self.current_a, self.omega, self.torque_nm].map(f32::to_bits);
        let [udc, current, omega, torque] = measured;
        [self.at.0, udc, current, omega, torque, code, value, limit, tripped_at]
    }

    fn from_words(words: [u32; 9]) -> Self {
        let [at, udc, current, omega, torque, code, value, limit, tripped_at] = words;
        Self {
            at: Instant(at),
            udc_v: f32::from_bits(udc),
            current_a: f32::from_bits(current),
            omega: f32::from_bits(omega),
            speed_known: code >> 24 & 1 != 0,
            torque_nm: f32::from_bits(torque),
            trip: trip_from_words([code, value, limit, tripped_at]),
            acknowledged: (code >> 16) as u8,
        }
    }
}

/// Permit down, observation up.
pub struct Desk {
    permit: Downlink<Timed, 7>,
    observed: Uplink<Observation, 9>,
    /// Control periods until the next slot.
    left: AtomicU32,
}

impl Desk {
    /// Nothing permitted, nothing seen.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self { permit: Downlink::new(), observed: Uplink::new(), left: AtomicU32::new(0) }
    }

    /// In the control interrupt: what is permitted at `now`; nothing before the first permit.
    #[inline]
    pub fn permit(&self, now: Instant) -> Permit {
        match self.permit.newest(|timed| now.reached(Instant(timed.word::<FROM>()))) {
            Some(timed) => timed.permit,
            None => Permit::NONE,
        }
    }

    /// In the control interrupt: what it did at `now`. The first of every [`SLOT_PERIODS`] begins a slot.
    #[inline]
    pub fn tell(&self, now: Instant, report: &Report) {
        let left = self.left.load(Ordering::Relaxed);
        if left > 0 {
            self.left.store(left - 1, Ordering::Relaxed);
            return;
        }
        self.left.store(SLOT_PERIODS - 1, Ordering::Relaxed);
        self.observed.publish(Observation {
            at: now,
            udc_v: report.udc_v,
            current_a: report.current_a,
            omega: report.frequency_hz * core::f32::consts::TAU,
            speed_known: report.speed_known,
            torque_nm: report.torque_nm,
            trip: report.trip,
            acknowledged: report.acknowledged,
        });
    }

    /// In the idle loop: the newest slot's words; `None` before the first, or when every try was overtaken.
    pub fn observed(&self) -> Option<Observation> {
        self.observed.read()
    }

    /// In the idle loop, once a slot: what is permitted from the next slot's beginning on. Returns that instant.
    pub fn allow(&self, permit: Permit, observed: &Observation, clock: &Clock) -> Instant {
        let from = next_slot(observed.at, clock);
        self.permit.publish(Timed { permit, from });
        from
    }
}

#[cfg(not(loom))]
impl Default for Desk {
    fn default() -> Self {
        Self::new()
    }
}

/// The slot after the one that begins at `at`.
fn next_slot(at: Instant, clock: &Clock) -> Instant {
    at.after(SLOT_PERIODS.wrapping_mul(clock.control_ticks))
}
