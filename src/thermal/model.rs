//! The rise of parts without a sensor above a measured temperature: one state each, with a thermal resistance and a time constant.

/// The rise of a part above the measured one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rise {
    /// Thermal resistance, in K/W.
    pub k_per_w: f32,
    /// Time constant, in s, well above a slot.
    pub time_s: f32,
}

/// Losses of one device, IGBT with its diode.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DeviceLosses {
    /// Threshold of its voltage while it conducts, in V.
    pub threshold_v: f32,
    /// Slope of that voltage, in ohm.
    pub slope_ohm: f32,
    /// Energy of switching on and off, with the other device's recovery, times the switching frequency, per ampere and volt of the link.
    pub switching_share: f32,
}

/// Share of the time in which a device conducts: that at standstill with half duty; when turning it is less.
const CONDUCTS: f32 = 0.5;

impl DeviceLosses {
    /// The loss at the largest phase current in A and the link's voltage in V, in W.
    pub fn watts(&self, current_a: f32, udc_v: f32) -> f32 {
        let conducting_v = self.threshold_v + self.slope_ohm * current_a;
        current_a * (CONDUCTS * conducting_v + self.switching_share * udc_v)
    }
}

/// Ratio of copper's resistance at a temperature in °C to that at 20 °C.
pub fn copper_factor(celsius: f32) -> f32 {
    1.0 + 3.93e-3 * (celsius - 20.0)
}

/// The rise of a part, in K.
#[derive(Clone, Copy, Debug)]
pub(super) struct RiseState(f32);

impl RiseState {
    pub const NONE: Self = Self(0.0);

    pub const fn kelvin(self) -> f32 {
        let Self(kelvin) = self;
        kelvin
    }

    /// One slot with a loss, in W; a NaN loss has its own fault, and leaves the rise unchanged.
    pub fn step(&mut self, loss_w: f32, rise: &Rise, slot_s: f32) -> f32 {
        let Self(kelvin) = self;
        if loss_w.is_finite() {
            *kelvin += slot_s / rise.time_s * (rise.k_per_w * loss_w - *kelvin);
        }
        *kelvin
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rise_takes_its_time_constant_and_ends_at_its_resistance() {
        let rise = Rise { k_per_w: 0.01, time_s: 30.0 };
        let mut state = RiseState::NONE;
        for slot in 1..=300_000 {
            state.step(5_000.0, &rise, 1e-3);
            if slot == 30_000 {
                assert!((state.kelvin() / 50.0 - (1.0 - (-1.0_f32).exp())).abs() < 1e-3);
            }
        }
        assert!((state.kelvin() - 50.0).abs() < 0.1, "{}", state.kelvin());
        state.step(f32::NAN, &rise, 1e-3);
        assert!((state.kelvin() - 50.0).abs() < 0.1);
    }

    #[test]
    fn a_device_loses_by_conduction_and_by_switching() {
        let losses = DeviceLosses { threshold_v: 1.0, slope_ohm: 5e-3, switching_share: 1e-3 };
        assert_eq!(losses.watts(200.0, 1_500.0), 200.0 * (0.5 * 2.0 + 1.5));
        assert_eq!(losses.watts(0.0, 1_500.0), 0.0);
    }
}
