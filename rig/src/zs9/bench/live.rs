//! The changes made on the ZS9's bench while it runs, and the rows taken from it.

use super::Bench;
use crate::bench::{Limits, Observed, Tick};
use crate::inject::Injection;
use crate::inject::zs9::{Kind, Levels, Spoiler};
use crate::plant::Motor;
use crate::plant::zs9::Source;
use crate::zs9::trace::{Edge, Row};
use tractive::nine_switch::Scheme;
use tractive::operator::DualStatus;

impl Bench {
    /// The same without an end.
    pub fn endless(mut self) -> Self {
        self.rows.end_never();
        self
    }

    /// The rows and edges since the last time.
    pub fn take(&mut self) -> (Vec<Row>, Vec<Edge>) {
        let edges = std::mem::take(&mut self.gates.edges);
        let seconds = |(at, gate, on)| Edge { t_s: self.time.seconds(at), gate, on };
        (self.rows.take(), edges.into_iter().map(seconds).collect())
    }

    /// The operator's last status; `None` in the first slot.
    pub fn status(&self) -> Option<DualStatus> {
        self.line.as_ref().and_then(|line| line.status)
    }

    /// A motor, 0 the upper one, 1 the lower one.
    pub fn motor_mut(&mut self, motor: usize) -> &mut Motor {
        &mut self.plant.motors[motor.min(1)]
    }

    /// Loads of both rotors from now on, in N·m.
    pub fn load(&mut self, loads_nm: [f64; 2]) {
        self.loads_nm = Some(loads_nm);
        self.set_loads_nm(loads_nm);
    }

    /// Voltage of the source, in V, above 0.
    pub fn set_source_v(&mut self, source_v: f64) {
        self.nominal_source_v = source_v;
    }

    /// Demanded link voltage, in V, and the place of the zero vectors.
    pub fn set_link(&mut self, link_ref_v: f64, scheme: Scheme) {
        self.settings.link_ref_v = link_ref_v;
        self.settings.scheme = scheme;
    }

    /// True flux linkage of both machines over the map's, above 0.
    pub fn set_flux_scale(&mut self, flux_scale: f64) {
        self.plant.set_flux_scale(flux_scale);
    }

    /// Injects a fault from the next instant on. An earlier fault is mended first.
    pub fn inject(&mut self, kind: Kind) {
        self.mend();
        let from = self.time.now + 1;
        let injection = Injection { kind, at_s: self.time.seconds(from) };
        self.spoiler = Spoiler::new(Some(injection), self.levels());
        self.observed = Observed::new(from, Limits::NONE);
    }

    fn levels(&self) -> Levels {
        Levels::new(self.plant.motors[0].largest_a, &self.settings.drive.limits)
    }

    /// Mends the injected fault; what the drive has latched stays latched.
    pub fn mend(&mut self) {
        self.spoiler = Spoiler::new(None, self.levels());
        self.observed = Observed::new(Tick::MAX, Limits::NONE);
        self.plant.source = Source::Bidirectional;
        self.plant.mend_network();
    }
}
