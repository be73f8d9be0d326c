//! The DC link: a capacitor between source, resistors and inverter.
//!
//! `C du/dt = i_source − u/R_discharge − u/R_chopper − i_inverter`, with `i_source = (U − u)/R` through the closed contactor or, if there is a choke,
//! `L di_source/dt = U − u − R i_source` through the main one; a rectifier only gives current, a reversible source also takes it back.

use super::LineFilter;
use super::runge_kutta::stepped;

/// Runge–Kutta step, as a share of a line filter's shortest time constant: stable up to 2.7.
const CHOKED_SHARE: f64 = 0.4;

/// The source of the link's energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Voltage without load, in V.
    pub voltage_v: f64,
    /// Inner resistance, in ohm.
    pub resistance_ohm: f64,
    /// Choke between it and the link, in H; 0: none.
    pub inductance_h: f64,
    /// `true` if it takes energy back; a rectifier does not.
    pub reversible: bool,
    /// `true` if the source is present; during a gap of the line it is not.
    pub live: bool,
}

/// The parts of the link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DcLinkSettings {
    /// Capacitance, in F.
    pub capacitance_f: f64,
    /// Source.
    pub source: Source,
    /// Precharge resistor, in ohm.
    pub precharge_ohm: f64,
    /// Discharge resistor, in ohm.
    pub discharge_ohm: f64,
    /// Resistance, in ohm, that represents auxiliaries and losses on the link.
    pub auxiliary_ohm: f64,
    /// Braking resistor behind the chopper, in ohm.
    pub chopper_ohm: f64,
}

/// The switches on the link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkSwitches {
    /// The precharge relay is closed.
    pub precharge: bool,
    /// The main contactor is closed.
    pub main: bool,
    /// The discharge resistor is on the link.
    pub discharge: bool,
    /// The chopper conducts.
    pub chopper: bool,
}

/// Energies since the beginning, in J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkEnergies {
    /// Given by the source's voltage, before its resistance; negative if it took more.
    pub source_j: f64,
    /// Turned into heat in the source's and the precharge resistor.
    pub path_j: f64,
    /// Likewise in the discharge resistor and the auxiliaries.
    pub discharge_j: f64,
    /// Likewise in the braking resistor.
    pub chopper_j: f64,
    /// Given to the inverter; negative if braking returned more.
    pub inverter_j: f64,
}

/// Capacitor and energy balance.
#[derive(Clone, Debug)]
pub struct DcLink {
    /// Its parts; change them, like everything here, between two steps.
    pub settings: DcLinkSettings,
    /// The switches that are closed.
    pub switches: LinkSwitches,
    /// Voltage, in V.
    pub udc_v: f64,
    /// Current in the choke, in A; 0 without one.
    pub choke_a: f64,
    /// Energies since the beginning.
    pub energies: LinkEnergies,
}

/// Rates of change: the voltage, the choke's current and the energies in their order.
pub(super) type LinkSlopes = [f64; 7];

impl DcLink {
    /// Discharged, all switches open.
    pub fn new(settings: DcLinkSettings) -> Self {
        Self {
            settings,
            switches: LinkSwitches::default(),
            udc_v: 0.0,
            choke_a: 0.0,
            energies: LinkEnergies::default(),
        }
    }

    /// Energy in capacitor and choke, in J.
    pub fn stored_j(&self) -> f64 {
        0.5 * self.settings.capacitance_f * self.udc_v * self.udc_v + self.choke_j()
    }

    fn choke_j(&self) -> f64 {
        0.5 * self.settings.source.inductance_h * self.choke_a * self.choke_a
    }

    /// `true` if the source's current flows through the choke; behind the precharge resistor, which far outweighs it, the choke does not count.
    fn is_choked(&self) -> bool {
        self.switches.main && self.settings.source.live && self.settings.source.inductance_h > 0.0
    }

    /// Longest integration step that resolves the oscillation between choke and capacitor, in s.
    pub(super) fn longest_step_s(&self) -> f64 {
        let DcLinkSettings { capacitance_f, source, .. } = self.settings;
        let Source { inductance_h, resistance_ohm, .. } = source;
        let filter = LineFilter { inductance_h, resistance_ohm, capacitance_f };
        if self.is_choked() { CHOKED_SHARE * filter.shortest_s() } else { f64::INFINITY }
    }

    /// Rate of the choke's current at a link voltage, in A/s.
    fn choke_slope(&self, udc_v: f64, choke_a: f64) -> f64 {
        let Source { voltage_v, resistance_ohm, inductance_h, reversible, .. } = self.settings.source;
        if !self.is_choked() {
            return 0.0;
        }
        let slope = (voltage_v - udc_v - resistance_ohm * choke_a) / inductance_h;
        if reversible || choke_a > 0.0 { slope } else { slope.max(0.0) }
    }

    /// Current from the source at a link voltage, and the resistance that it flows through.
    fn source(&self, udc_v: f64, choke_a: f64) -> (f64, f64) {
        let Source { voltage_v, resistance_ohm, reversible, live, .. } = self.settings.source;
        if !live {
            return (0.0, resistance_ohm);
        }
        if self.is_choked() {
            return (choke_a, resistance_ohm);
        }
        let resistance = match self.switches {
            LinkSwitches { main: true, .. } => resistance_ohm,
            LinkSwitches { precharge: true, .. } => resistance_ohm + self.settings.precharge_ohm,
            _ => return (0.0, 0.0),
        };
        let current = (voltage_v - udc_v) / resistance;
        (if reversible { current } else { current.max(0.0) }, resistance)
    }

    pub(super) fn slopes(&self, udc_v: f64, choke_a: f64, inverter_a: f64) -> LinkSlopes {
        let DcLinkSettings { capacitance_f, discharge_ohm, auxiliary_ohm, chopper_ohm, source, .. } =
            self.settings;
        let (source_a, path_ohm) = self.source(udc_v, choke_a);
        let through = |on: bool, ohm: f64| if on { udc_v / ohm } else { 0.0 };
        let discharge_a = through(self.switches.discharge, discharge_ohm) + udc_v / auxiliary_ohm;
        let chopper_a = through(self.switches.chopper, chopper_ohm);
        [
            (source_a - discharge_a - chopper_a - inverter_a) / capacitance_f,
            self.choke_slope(udc_v, choke_a),
            source.voltage_v * source_a,
            path_ohm * source_a * source_a,
            udc_v * discharge_a,
            udc_v * chopper_a,
            udc_v * inverter_a,
        ]
    }

    /// Lets time pass while the inverter takes a constant current, in A.
    pub(super) fn advance(&mut self, inverter_a: f64, dt_s: f64) {
        let y0 = [self.udc_v, self.choke_a, 0.0, 0.0, 0.0, 0.0, 0.0];
        let [udc_v, choke_a, energies @ ..] =
            stepped(&y0, [(); 3], dt_s, |y, ()| self.slopes(y[0], y[1], inverter_a));
        self.finish(udc_v, choke_a, energies);
    }

    pub(super) fn finish(&mut self, udc_v: f64, choke_a: f64, energies: [f64; 5]) {
        self.udc_v = udc_v;
        self.choke_a = if self.settings.source.reversible { choke_a } else { choke_a.max(0.0) };
        if !self.is_choked() {
            // The arc of the contactor, or of the current collector.
            self.energies.path_j += self.choke_j();
            self.choke_a = 0.0;
        }
        let [source, path, discharge, chopper, inverter] = energies;
        self.energies.source_j += source;
        self.energies.path_j += path;
        self.energies.discharge_j += discharge;
        self.energies.chopper_j += chopper;
        self.energies.inverter_j += inverter;
    }
}
