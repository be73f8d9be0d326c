//! A resistive sensor to ground, in series with a resistor to the converter's reference: a temperature from the ratio of the voltages.

use crate::frames::limit;

/// The sensor's element.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Element {
    /// A thermistor whose resistance falls: R = R₂₅ exp(B (1/T − 1/298.15 K)).
    Ntc {
        /// Resistance at 25 °C, in ohm.
        at_25_ohm: f32,
        /// B, in K.
        beta_k: f32,
    },
    /// Platinum, 1,000 Ω at 0 °C, after IEC 60751.
    Pt1000,
}

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sensor {
    /// Its element.
    pub element: Element,
    /// Resistor between sensor and reference, in ohm.
    pub series_ohm: f32,
    /// Lowest and highest temperature that it can show, in °C: a value beyond them means a faulty wire.
    pub range_c: [f32; 2],
}

/// Converter's counts at its reference.
const FULL: f32 = 65_536.0;
/// Highest temperature that is reported, in °C.
const HOTTEST_C: f32 = 1_000.0;
const ZERO_C_K: f32 = 273.15;
/// Ratios beyond which the element counts as shorted, or unplugged.
const SHORTED: f32 = 1e-3;
const OPEN: f32 = 1.0 - 1e-3;

impl Sensor {
    /// The temperature at a ratio, in °C; out of its range, that temperature and the limit that it broke.
    pub fn read(&self, ratio: u16) -> Result<f32, (f32, f32)> {
        let [lowest_c, highest_c] = self.range_c;
        let share = limit(f32::from(ratio) / FULL, SHORTED, OPEN);
        let celsius = self.element.celsius(self.series_ohm * share / (1.0 - share));
        let celsius = limit(celsius, -ZERO_C_K, HOTTEST_C);
        if celsius < lowest_c {
            Err((celsius, lowest_c))
        } else if celsius > highest_c {
            Err((celsius, highest_c))
        } else {
            Ok(celsius)
        }
    }
}

impl Element {
    /// The temperature at a resistance in ohm above 0, in °C.
    fn celsius(&self, ohm: f32) -> f32 {
        match *self {
            Self::Ntc { at_25_ohm, beta_k } => {
                let per_k = 1.0 / (25.0 + ZERO_C_K) + ln(ohm / at_25_ohm) / beta_k;
                1.0 / per_k - ZERO_C_K
            }
            // The inverse of the standard's parabola through 0, 100 and 200 °C: within 0.1 K from −40 to 250 °C.
            Self::Pt1000 => {
                let excess = ohm / 1_000.0 - 1.0;
                excess * (255.634 + 10.578 * excess)
            }
        }
    }
}

/// Natural logarithm of a normal number above 0, within 3e-7 of it: the exponent, and of the mantissa the series of the inverse hyperbolic tangent.
fn ln(x: f32) -> f32 {
    const MANTISSA: u32 = 0x7F_FFFF;
    let bits = x.to_bits();
    let (mut exponent, mut mantissa) =
        ((bits >> 23) as i32 - 127, f32::from_bits(bits & MANTISSA | 1.0_f32.to_bits()));
    if mantissa > core::f32::consts::SQRT_2 {
        (mantissa, exponent) = (0.5 * mantissa, exponent + 1);
    }
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let squared = s * s;
    let series = 1.0 + squared * (1.0 / 3.0 + squared * (0.2 + squared / 7.0));
    exponent as f32 * core::f32::consts::LN_2 + 2.0 * s * series
}

#[cfg(test)]
mod tests {
    use super::*;

    const NTC: Sensor = Sensor {
        element: Element::Ntc { at_25_ohm: 10e3, beta_k: 3_435.0 },
        series_ohm: 4.7e3,
        range_c: [-40.0, 150.0],
    };
    const PT1000: Sensor = Sensor { element: Element::Pt1000, series_ohm: 1e3, range_c: [-40.0, 250.0] };

    fn ratio(ohm: f64, series_ohm: f32) -> u16 {
        (ohm / (ohm + f64::from(series_ohm)) * 65_536.0).round() as u16
    }

    /// Resistance according to the law, in double precision.
    fn ohm(sensor: &Sensor, celsius: f64) -> f64 {
        match sensor.element {
            Element::Ntc { at_25_ohm, beta_k } => {
                let law = f64::from(beta_k) * (1.0 / (celsius + 273.15) - 1.0 / 298.15);
                f64::from(at_25_ohm) * law.exp()
            }
            Element::Pt1000 => {
                // IEC 60751, with the term of the third power below zero.
                let cubic =
                    if celsius < 0.0 { -4.183e-12 * (celsius - 100.0) * celsius.powi(3) } else { 0.0 };
                1e3 * (1.0 + 3.9083e-3 * celsius - 5.775e-7 * celsius * celsius + cubic)
            }
        }
    }

    #[test]
    fn the_laws_are_read_back_over_the_whole_range() {
        for (sensor, most_k) in [(NTC, 0.06), (PT1000, 0.12)] {
            let [lowest, highest] = sensor.range_c.map(|celsius| celsius as i32);
            for celsius in lowest + 1..highest {
                let ratio = ratio(ohm(&sensor, celsius.into()), sensor.series_ohm);
                let error_k = sensor.read(ratio).unwrap() - celsius as f32;
                assert!(error_k.abs() < most_k, "{celsius} °C: {error_k} K off");
            }
        }
    }

    #[test]
    fn unplugged_shorted_and_out_of_range_are_told_with_the_limit() {
        for sensor in [NTC, PT1000] {
            let [lowest, highest] = sensor.range_c;
            let falls = matches!(sensor.element, Element::Ntc { .. });
            let (unplugged, shorted) = if falls { (lowest, highest) } else { (highest, lowest) };
            assert_eq!(sensor.read(u16::MAX).unwrap_err().1, unplugged);
            assert_eq!(sensor.read(0).unwrap_err().1, shorted);
            for limit in [lowest, highest] {
                let beyond = f64::from(limit) + if limit == lowest { -3.0 } else { 3.0 };
                let ratio = ratio(ohm(&sensor, beyond), sensor.series_ohm);
                let (value, broken) = sensor.read(ratio).unwrap_err();
                assert!(broken == limit && (f64::from(value) - beyond).abs() < 0.3, "{value} for {beyond}");
            }
            // Every ratio gives a number.
            for ratio in 0..=u16::MAX {
                assert!(sensor.read(ratio).unwrap_or_else(|(value, _)| value).is_finite());
            }
        }
    }

    #[test]
    fn the_logarithm_is_one() {
        for step in 1..20_000 {
            let x = 1e-3 * step as f32 * step as f32;
            let error = f64::from(ln(x)) - f64::from(x).ln();
            assert!(error.abs() < 3e-7 * f64::from(x).ln().abs().max(1.0), "{x}: {error}");
        }
    }
}
