//! The DC link, as the operating point sees it.
//!
//! Operating point and mode follow the link slowly: a rectifier's ripple must neither shake the one nor toggle the other. Slow ripple
//! passes, so the mode follows the link down at once, and up over many periods of the slowest ripple. The modulator
//! divides by the link as it is. Square wave divides by nothing: a link that jumps up would throw the flux outward at
//! once, so until the operating point has followed, no more of the link is used than before.

/// Bandwidth at which the link is followed, in rad/s.
const LINK_RAD_S: f32 = 100.0;

/// Ratio of the link to its slow value above which it has jumped, and down to which the jump lasts: a ripple stays below the former, a notch of the shortest
/// pulse takes the latter.
const JUMPED: (f32, f32) = (1.04, 1.015);

/// Rate of leaving the lowest link, in rad/s: a tenth in a period of the 33 Hz that a line of 16.7 Hz puts on the link.
const LOWEST_RAD_S: f32 = 3.5;

#[derive(Clone, Copy, Debug)]
pub struct LinkFilter {
    /// In V; `None` before the first step.
    slow_v: Option<f32>,
    /// Ratio of the link to that above which it has jumped.
    jump: f32,
    /// The lowest slow value, in V.
    lowest_v: f32,
}

/// The link, in V.
pub struct Link {
    /// Without its ripple.
    pub slow_v: f32,
    /// The usable voltage: the whole link, unless it has jumped up.
    pub usable_v: f32,
}

impl LinkFilter {
    pub const fn new() -> Self {
        Self { slow_v: None, jump: JUMPED.0, lowest_v: f32::MAX }
    }

    /// One control period, with the measured link and its expected rise by the time a voltage acts, in V.
    #[inline(never)]
    pub fn step(&mut self, udc_v: f32, change_v: f32, period_s: f32) -> Link {
        let before = self.slow_v.unwrap_or(udc_v);
        let slow_v = before + LINK_RAD_S * period_s * (udc_v - before);
        self.slow_v = Some(slow_v);
        let rise_v = slow_v - self.lowest_v;
        self.lowest_v = if rise_v < 0.0 { slow_v } else { self.lowest_v + LOWEST_RAD_S * period_s * rise_v };
        let (from, until) = JUMPED;
        let jumped = udc_v > self.jump * slow_v;
        self.jump = if jumped { until } else { from };
        Link { slow_v, usable_v: if jumped { slow_v } else { udc_v + change_v } }
    }

    /// The lowest link without its ripple, in V; left slowly.
    pub const fn lowest_v(&self) -> f32 {
        self.lowest_v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A link that stands at 1,000 V and then jumps to this voltage, with a volt more to come: the usable voltage.
    fn usable_v(udc_v: f32) -> f32 {
        let mut filter = LinkFilter::new();
        filter.step(1_000.0, 0.0, 0.0);
        filter.step(udc_v, 1.0, 0.0).usable_v
    }

    #[test]
    fn only_beyond_the_border_a_link_has_jumped() {
        let border_v = JUMPED.0 * 1_000.0;
        assert_eq!([usable_v(border_v), usable_v(border_v + 0.1)], [border_v + 1.0, 1_000.0]);
    }
}
