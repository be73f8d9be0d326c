//! The sensors of the ZS9's network that go wrong.

/// The failure of a sensor of the network.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NetworkFault {
    /// The capacitor's voltage reads so many times its size.
    CapacitorScaled(f64),
    /// It stands still.
    CapacitorFrozen,
    /// The source's voltage reads so many times its size.
    SourceScaled(f64),
    /// The inductor's current reads 0.
    InductorDead,
    /// It reads with the other sign.
    InductorReversed,
    /// It reads as not a number.
    InductorNotFinite,
}

/// The sensors with their failure.
#[derive(Clone, Copy, Debug)]
pub struct NetworkSpoiler {
    fault: NetworkFault,
    /// The capacitor's last sound reading, or else the first one of all, in V.
    capacitor_v: Option<f32>,
}

impl NetworkSpoiler {
    /// Sensors that will fail like this.
    pub const fn new(fault: NetworkFault) -> Self {
        Self { fault, capacitor_v: None }
    }

    /// Readings of the capacitor's and the source's voltage, in V.
    pub fn read(&mut self, broken: bool, capacitor_v: &mut f32, source_v: &mut f32) {
        if !broken {
            self.capacitor_v = Some(*capacitor_v);
            return;
        }
        match self.fault {
            NetworkFault::CapacitorScaled(scale) => *capacitor_v *= scale as f32,
            NetworkFault::CapacitorFrozen => *capacitor_v = *self.capacitor_v.get_or_insert(*capacitor_v),
            NetworkFault::SourceScaled(scale) => *source_v *= scale as f32,
            NetworkFault::InductorDead | NetworkFault::InductorReversed | NetworkFault::InductorNotFinite => {
            }
        }
    }

    /// Reading of the inductor's current, in A.
    pub const fn read_inductor(&self, broken: bool, inductor_a: f32) -> f32 {
        match self.fault {
            NetworkFault::InductorDead if broken => 0.0,
            NetworkFault::InductorReversed if broken => -inductor_a,
            NetworkFault::InductorNotFinite if broken => f32::NAN,
            _ => inductor_a,
        }
    }
}
