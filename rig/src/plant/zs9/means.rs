//! Mean values over a span, for traces.

use super::Vector;

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

/// A motor at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Current, in A.
    pub vector: Vector,
    /// Speed, in r/min.
    pub speed_rpm: f64,
}

/// Sums of values times their time, over a span.
#[derive(Clone, Copy, Debug, Default)]
pub struct Adder {
    span_s: f64,
    /// d and q currents of both motors, both inductors' currents, both capacitors' voltages, times time.
    areas: [f64; 8],
    impulses_nm_s: [f64; 2],
    vectors: [Vector; 2],
    speeds: [f64; 2],
}

impl Adder {
    /// Adds a step: its integrals of states and torques; phase currents and speeds change linearly.
    #[inline]
    pub fn add(
        &mut self,
        dt_s: f64,
        area: &[f64; 8],
        impulses: [f64; 2],
        before: &[Seen; 2],
        after: &[Seen; 2],
    ) {
        self.span_s += dt_s;
        for (sum, part) in self.areas.iter_mut().zip(area) {
            *sum += part;
        }
        let half_s = 0.5 * dt_s;
        for k in 0..2 {
            let (a, b) = (&before[k], &after[k]);
            self.impulses_nm_s[k] += impulses[k];
            self.vectors[k].alpha += half_s * (a.vector.alpha + b.vector.alpha);
            self.vectors[k].beta += half_s * (a.vector.beta + b.vector.beta);
            self.speeds[k] += half_s * (a.speed_rpm + b.speed_rpm);
        }
    }

    /// Adds the sums of a span that follows this one.
    pub fn append(&mut self, later: &Self) {
        self.span_s += later.span_s;
        for (sum, part) in self.areas.iter_mut().zip(later.areas) {
            *sum += part;
        }
        for k in 0..2 {
            self.impulses_nm_s[k] += later.impulses_nm_s[k];
            self.vectors[k].alpha += later.vectors[k].alpha;
            self.vectors[k].beta += later.vectors[k].beta;
            self.speeds[k] += later.speeds[k];
        }
    }

    /// The means so far; `None` if no time has passed.
    pub fn means(&self, source_v: f64) -> Option<Means> {
        if self.span_s <= 0.0 {
            return None;
        }
        let over_span = |sum: f64| sum / self.span_s;
        let mean = self.areas.map(over_span);
        let motor = |k: usize| MotorMeans {
            phases_a: self.vectors[k].phases().map(over_span),
            id_a: mean[2 * k],
            iq_a: mean[2 * k + 1],
            speed_rpm: over_span(self.speeds[k]),
            torque_nm: over_span(self.impulses_nm_s[k]),
        };
        let [inductor_a, capacitor_v] = [0.5 * (mean[4] + mean[5]), 0.5 * (mean[6] + mean[7])];
        let link_v = 2.0 * capacitor_v - source_v;
        Some(Means { motors: [motor(0), motor(1)], inductor_a, capacitor_v, link_v })
    }
}
