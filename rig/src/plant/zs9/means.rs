//! Mean values over a span, for traces.

/// Mean values over a span.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Means {
    /// The upper motor's, then the lower one's.
    pub motors: [MotorMeans; 2],
    /// Inductor current, mean of both, in A.
    pub inductor_a: f64,
    /// Capacitor voltage, mean of both, in V.
    pub capacitor_v: f64,
    /// `v1 + v2 − U_dc`, the link's voltage outside shoot-through, in V.
    pub link_v: f64,
}

/// A motor's mean values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorMeans {
    /// Phase currents, in A.
    pub phases_a: [f64; 3],
    /// d current, in A.
    pub id_a: f64,
    /// q current, in A.
    pub iq_a: f64,
    /// Speed, in r/min.
    pub speed_rpm: f64,
    /// Air-gap torque, in N·m.
    pub torque_nm: f64,
}

/// A motor's part of [`Observed`].
const OF_MOTOR: usize = 6;
/// Values at an instant. Of each motor: three phase currents, d, q, speed; then inductor current and capacitor voltage.
pub type Observed = [f64; 2 * OF_MOTOR + 2];

/// Adds up values between two reports: straight lines between a step's ends, the torque by its impulse.
#[derive(Clone, Copy, Debug, Default)]
pub struct Adder {
    span_s: f64,
    sums: Observed,
    impulses_nm_s: [f64; 2],
}

impl Adder {
    /// A step.
    #[inline]
    pub fn add(&mut self, dt_s: f64, before: &Observed, after: &Observed, impulses_nm_s: [f64; 2]) {
        self.span_s += dt_s;
        for ((sum, a), b) in self.sums.iter_mut().zip(before).zip(after) {
            *sum += 0.5 * dt_s * (a + b);
        }
        for (sum, impulse) in self.impulses_nm_s.iter_mut().zip(impulses_nm_s) {
            *sum += impulse;
        }
    }

    /// The means so far; `None` if no time has passed.
    pub fn means(&self, source_v: f64) -> Option<Means> {
        if self.span_s <= 0.0 {
            return None;
        }
        let mean = self.sums.map(|sum| sum / self.span_s);
        let motor = |k: usize| {
            let at = OF_MOTOR * k;
            MotorMeans {
                phases_a: [mean[at], mean[at + 1], mean[at + 2]],
                id_a: mean[at + 3],
                iq_a: mean[at + 4],
                speed_rpm: mean[at + 5],
                torque_nm: self.impulses_nm_s[k] / self.span_s,
            }
        };
        let [inductor_a, capacitor_v] = [mean[2 * OF_MOTOR], mean[2 * OF_MOTOR + 1]];
        let link_v = 2.0 * capacitor_v - source_v;
        Some(Means { motors: [motor(0), motor(1)], inductor_a, capacitor_v, link_v })
    }
}
