//! The transition from one pattern to another.
//!
//! In each sector of 60° the flux goes along one edge of a hexagon, the shorter the more zero voltage there is in the sector. If the edges
//! changed their length at once, the hexagon would be left off its centre, by a flux that turns in the machine until it has
//! decayed: every change of length moves the centre towards the corner where it happens. Three changes of a third, at corners
//! 120° apart, leave it where it is.
//!
//! Meanwhile the centre is off by a third of the change, which is ahead of the flux while the hexagon grows and behind while it shrinks; so the
//! pulses lag or lead by as much. That also is what lets a notch be left out that would be too short: a sector without one is over sooner,
//! the next ones have longer notches, and every edge has its length.

/// Share of the whole change that the hexagon has, and lead of the pulses at the sector's end over that change in zero voltage, sector by
/// sector. The first sector's lead is half of what its end would have, since its notch comes before that: chosen by trial, with all of it
/// braking at half torque has 1.7 % of current too much at 7 to 3 pulses, with none of it 30 N·m are missing at the end of square wave.
const SECTORS: [(f32, f32); 4] =
    [(1.0 / 3.0, 0.5 * LEAD), (1.0 / 3.0, LEAD), (2.0 / 3.0, LEAD), (2.0 / 3.0, 0.0)];

/// sin 60° of a third, of twice the half that the zero voltage is counted in.
const LEAD: f32 = 0.577_35;

/// Sectors until the new pattern has its size.
pub const TRANSITION_SECTORS: u32 = SECTORS.len() as u32;

#[derive(Clone, Copy, Debug)]
pub struct PatternTransition {
    /// Half the zero voltage of a sector of the old pattern, as an angle in rad.
    old_zero_rad: f32,
    /// The link that it had, in V.
    old_udc_v: f32,
    /// `true` while the present carrier has a notch.
    notched: bool,
    /// Halves since the switch.
    halves: u32,
}

/// The target of a sector while its pattern grows.
pub struct Sector {
    /// Half its zero voltage, as an angle in rad.
    pub zero_rad: f32,
    /// Angle by which it should end too early, in rad.
    pub lead_rad: f32,
}

impl PatternTransition {
    /// A pattern of its own size.
    pub const DONE: Self = Self { old_zero_rad: 0.0, old_udc_v: 0.0, notched: false, halves: u32::MAX };

    /// Out of a pattern with half a sector's zero voltage of `old_zero_rad`, on a link of `old_udc_v`.
    pub const fn begun(old_zero_rad: f32, old_udc_v: f32) -> Self {
        Self { old_zero_rad, old_udc_v, notched: false, halves: 0 }
    }

    /// The present sector on the way to `new_zero_rad`, with so many halves a sector, on a link of `udc_v`; `None` once the pattern has grown.
    pub fn sector(&self, new_zero_rad: f32, sector_halves: u32, udc_v: f32) -> Option<Sector> {
        let (share, lead) = SECTORS.get(self.halves.checked_div(sector_halves)? as usize)?;
        // An edge of the old length, in flux, on this link.
        let edge_rad = core::f32::consts::FRAC_PI_6 - self.old_zero_rad;
        let old_zero_rad = self.old_zero_rad + edge_rad * (1.0 - self.old_udc_v / udc_v);
        let old_zero_rad = if old_zero_rad > 0.0 { old_zero_rad } else { 0.0 };
        let change_rad = new_zero_rad - old_zero_rad;
        Some(Sector { zero_rad: old_zero_rad + share * change_rad, lead_rad: lead * change_rad })
    }

    /// One half more is made, which has `left_ticks` beside its edge where others like it have `zero_ticks`. Returns for how many of them its
    /// voltage is zero; `None`: its carrier has no notch, because that would be shorter than half the shortest.
    pub fn notch(&mut self, left_ticks: f32, zero_ticks: f32, shortest_ticks: f32) -> Option<f32> {
        let least = 0.5 * shortest_ticks;
        if self.halves & 1 == 0 {
            self.notched = left_ticks + zero_ticks > least;
        }
        self.halves += 1;
        self.notched.then_some(if left_ticks > least { left_ticks } else { least })
    }
}
