//! The line side in the timers' time: contactors, a switching chopper, and the sender of the drive's commands.

use super::switchgear::Held;
use super::{Switchgear, Tick};
use crate::plant::{DcLink, DcLinkSettings, Heat, Leg, LineFilter, LinkEnergies, LinkSwitches, Plant};
use crate::steps::held;
use crate::trace::{LinkBalance, SlotRow};
use tractive::operator::{Feedback, Request, Status, Switches};
use tractive::protection::Fault;
use tractive::thermal::Ratios;
use tractive::time::Clock;

/// The sender of commands: the request at `t_s` seconds after the recording begins.
pub type Commander = Box<dyn Fn(f64) -> Request + Send>;

/// The line side, and the events on it.
pub struct LinePlan {
    /// The link.
    pub link: DcLinkSettings,
    /// `true` if the link is at the source's voltage, with the main contactor open, when the run begins.
    pub starts_charged: bool,
    /// The sender of commands.
    pub commander: Commander,
    /// Causes in hardware that keep the gates off: start and end (s from the recording's beginning), and the cause.
    pub hardware: Vec<(f64, f64, Fault)>,
    /// Times (s) from which on the braking resistor has this resistance, in ohm.
    pub chopper_ohm: Vec<(f64, f64)>,
    /// Times (s) from which on the source takes energy back, or does not.
    pub reversible: Vec<(f64, bool)>,
    /// Times (s) from which on the source is present, or is not: gaps in the line.
    pub live: Vec<(f64, bool)>,
    /// Temperatures of machine and inverter, with their sensors; `None`: they stay constant, and there are no sensors.
    pub heat: Option<Heat>,
}

impl LinePlan {
    /// An empty link on which nothing happens.
    pub fn new(link: DcLinkSettings, commander: Commander) -> Self {
        Self {
            link,
            starts_charged: false,
            commander,
            hardware: Vec::new(),
            chopper_ohm: Vec::new(),
            reversible: Vec::new(),
            live: Vec::new(),
            heat: None,
        }
    }
}

impl LinePlan {
    /// The choke between source and link, and the link's capacitor.
    pub fn filter(&self) -> LineFilter {
        let DcLinkSettings { capacitance_f, source, .. } = self.link;
        LineFilter { inductance_h: source.inductance_h, resistance_ohm: source.resistance_ohm, capacitance_f }
    }
}

/// The line side of a bench.
pub struct LineSide {
    /// The link itself.
    pub link: DcLink,
    stored_before_j: f64,
    /// Ripple of the source at present, in V.
    pub ripple_v: f64,
    plan: LinePlan,
    slot_ticks: Tick,
    gear: Switchgear<Request, f32>,
    discharge: bool,
    duty: f64,
    /// The end of the running chopper period, and the time in it at which the chopper goes off.
    chopper_period: Tick,
    chopper_off: Option<Tick>,
    /// The operator's last status that has taken effect.
    pub status: Option<Status>,
}

impl LineSide {
    /// At tick 0, everything open.
    pub fn new(plan: LinePlan, clock: &Clock) -> Self {
        let mut link = DcLink::new(plan.link);
        if plan.starts_charged {
            link.udc_v = plan.link.source.voltage_v;
        }
        Self {
            stored_before_j: link.stored_j(),
            link,
            ripple_v: 0.0,
            plan,
            slot_ticks: Tick::from(clock.millisecond_periods() * clock.control_ticks),
            gear: Switchgear::new(clock),
            discharge: false,
            duty: 0.0,
            chopper_period: 0,
            chopper_off: None,
            status: None,
        }
    }

    /// Lets the plant run on the link for `dt_s`.
    pub fn advance(&mut self, plant: &mut Plant, legs: [Leg; 3], dt_s: f64) {
        let smooth_v = self.link.settings.source.voltage_v;
        self.link.settings.source.voltage_v += self.ripple_v;
        plant.advance_on(&mut self.link, legs, dt_s);
        self.link.settings.source.voltage_v = smooth_v;
    }

    /// Current in the choke, in A; `None` if there is none.
    pub fn choke_a(&self) -> Option<f64> {
        (self.link.settings.source.inductance_h > 0.0).then_some(self.link.choke_a)
    }

    /// The balance of the link's energy since tick 0.
    pub fn balance(&self) -> LinkBalance {
        let energies = self.link.energies;
        let LinkEnergies { source_j, path_j, discharge_j, chopper_j, inverter_j } = energies;
        let kept_j = self.link.stored_j() - self.stored_before_j;
        LinkBalance {
            energies,
            moved_j: source_j.abs() + inverter_j.abs() + self.stored_before_j,
            missing_j: source_j - path_j - discharge_j - chopper_j - inverter_j - kept_j,
        }
    }

    /// The cause that keeps the gates off in hardware at `t_s`.
    pub fn hardware(&self, t_s: f64) -> Option<Fault> {
        let held = self.plan.hardware.iter().find(|(from, until, _)| (*from..*until).contains(&t_s));
        held.map(|(.., fault)| *fault)
    }

    /// A control sample at `now`, `t_s`, with the rotor's angle known or not: the first one of every millisecond begins a slot. Returns whether the operator
    /// has fallen behind.
    pub fn sampled(&mut self, now: Tick, t_s: f64, position_known: bool) -> bool {
        let hardware = self.hardware(t_s);
        let temperatures = self.plan.heat.as_ref().map_or(Ratios::default(), |heat| heat.ratios(t_s));
        let Self { gear, plan, .. } = self;
        let held = Held { hardware, position_known, temperatures };
        gear.sampled(now, held, || (plan.commander)(t_s))
    }

    /// Warms machine and inverter by the losses of `dt_s`, if temperatures are modelled; the machine's resistance and magnets follow.
    pub fn warm(&mut self, plant: &mut Plant, dt_s: f64) {
        let udc_v = self.link.udc_v;
        if let Some(heat) = &mut self.plan.heat {
            heat.step(plant, udc_v, dt_s);
        }
    }

    /// Temperatures of machine and inverter.
    pub fn heat(&self) -> Option<&Heat> {
        self.plan.heat.as_ref()
    }

    /// The request in the slot that began at `tick`, and the board's feedback.
    pub fn ask(&mut self, tick: Tick) -> Option<(Request, Feedback)> {
        self.gear.ask(tick)
    }

    /// Takes the operator's status; it holds from `from` on.
    pub fn tell(&mut self, from: Tick, status: Status) {
        self.gear.tell(from, status);
    }

    /// The next instant at which something changes.
    pub fn next_event(&self) -> Option<Tick> {
        let period = (self.duty > 0.0 || self.chopper_off.is_some()).then_some(self.chopper_period);
        [self.gear.next_event(), period, self.chopper_off].into_iter().flatten().min()
    }

    /// Does what is due at `now`, `t_s`; returns the operator's status if it takes effect here.
    pub fn act(&mut self, now: Tick, t_s: f64) -> Option<SlotRow> {
        let row = self.gear.act(now).map(|status| SlotRow { t_s, status });
        if let Some(SlotRow { status, .. }) = row {
            self.status = Some(status);
            let Switches { discharge, chopper, .. } = status.switches;
            self.discharge = discharge;
            self.duty = f64::from(chopper);
            // The chopper's period equals the slot.
            self.chopper_period = now;
        }
        if self.chopper_off.is_some_and(|at| at <= now) {
            self.chopper_off = None;
        }
        if self.chopper_period <= now && self.duty > 0.0 {
            self.chopper_period = now + self.slot_ticks;
            let on = (self.duty * self.slot_ticks as f64).round() as Tick;
            self.chopper_off = (on > 0).then_some(now + on);
        }
        self.link.switches = LinkSwitches {
            precharge: self.gear.precharge_closed(),
            main: self.gear.main_closed(),
            discharge: self.discharge,
            chopper: self.chopper_off.is_some(),
        };
        if let Some(ohm) = held(&self.plan.chopper_ohm, t_s) {
            self.link.settings.chopper_ohm = ohm;
        }
        if let Some(reversible) = held(&self.plan.reversible, t_s) {
            self.link.settings.source.reversible = reversible;
        }
        if let Some(live) = held(&self.plan.live, t_s) {
            self.link.settings.source.live = live;
        }
        row
    }
}
