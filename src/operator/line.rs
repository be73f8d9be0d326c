//! The line side: precharge, discharge, chopper.

use super::health::contactors;
use super::settings::Line;
use super::{Settings, Situation, Switches};
use crate::protection::{FailedCheck, Fault};

/// Number of time constants after which charging or discharging has failed.
const TOO_LONG: f32 = 10.0;
/// Difference between source and link, as a share of the nominal voltage, that may remain when the main contactor closes.
const GAP_SHARE: f32 = 0.02;
/// Slots over which the link's rate is taken.
const RATE_SLOTS: u32 = 20;

/// The outcome of a sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    /// Not there yet.
    Going,
    /// Done.
    Done,
    /// Failed.
    Failed(FailedCheck),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Charging {
    /// The precharge relay is closing.
    RelayCloses,
    /// The link charges.
    Charges,
    /// The main contactor is closing.
    MainCloses,
    /// The precharge relay is opening.
    RelayOpens,
}

/// Charging the link: relay, resistor, main contactor, relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Precharge {
    stage: Charging,
    /// Slots in this stage.
    slots: u32,
    /// Link voltage when the rate was last taken, in V, and slots since then.
    before_v: f32,
    since: u32,
}

impl Precharge {
    pub(super) const fn new() -> Self {
        Self { stage: Charging::RelayCloses, slots: 0, before_v: 0.0, since: 0 }
    }

    pub(super) const fn switches(&self) -> Switches {
        let main = matches!(self.stage, Charging::MainCloses | Charging::RelayOpens);
        let precharge = !matches!(self.stage, Charging::RelayOpens);
        Switches { precharge, main, discharge: false, chopper: 0.0 }
    }

    /// One slot. The main contactor closes when the source is at most [`GAP_SHARE`] away. The distance is the link's own rate times the time
    /// constant, so the source need not be measured.
    #[inline(never)]
    pub(super) fn step(&mut self, input: &Situation, line: &Line, settings: &Settings) -> Outcome {
        self.slots = self.slots.saturating_add(1);
        let passed_s = self.slots as f32 * settings.slot_s;
        let udc_v = input.observed.udc_v;
        let (wrong, next) = match self.stage {
            Charging::RelayCloses => (contactors(input, false, true), Charging::Charges),
            Charging::Charges => {
                if let Some(failed) = contactors(input, false, true) {
                    return Outcome::Failed(failed);
                }
                let lowest_v = settings.ratings.dc_link_min_v;
                if passed_s > TOO_LONG * line.precharge_s {
                    return Outcome::Failed((Fault::PrechargeTimeout, udc_v, lowest_v));
                }
                if self.is_near(input, line, settings) && udc_v >= lowest_v {
                    self.enter(Charging::MainCloses, udc_v);
                }
                return Outcome::Going;
            }
            Charging::MainCloses => (contactors(input, true, true), Charging::RelayOpens),
            Charging::RelayOpens => match contactors(input, true, false) {
                None => return Outcome::Done,
                wrong => (wrong, Charging::RelayOpens),
            },
        };
        match wrong {
            None => self.enter(next, udc_v),
            Some(failed) if passed_s > line.contactor_s => return Outcome::Failed(failed),
            Some(_) => {}
        }
        Outcome::Going
    }

    fn enter(&mut self, stage: Charging, udc_v: f32) {
        *self = Self { stage, slots: 0, before_v: udc_v, since: 0 };
    }

    /// `true` if the source is near; checked every [`RATE_SLOTS`] slots, at an observation that is fresh.
    fn is_near(&mut self, input: &Situation, line: &Line, settings: &Settings) -> bool {
        self.since = self.since.saturating_add(1);
        if !input.fresh || self.since < RATE_SLOTS {
            return false;
        }
        let udc_v = input.observed.udc_v;
        let rate_v_s = (udc_v - self.before_v) / (self.since as f32 * settings.slot_s);
        (self.before_v, self.since) = (udc_v, 0);
        (rate_v_s * line.precharge_s).abs() < GAP_SHARE * settings.ratings.dc_link_nominal_v
    }
}

/// Discharging the link: contactors open, then the resistor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Discharge {
    /// `true` once both contactors are open according to their own contacts.
    open: bool,
    slots: u32,
}

impl Discharge {
    pub(super) const fn new() -> Self {
        Self { open: false, slots: 0 }
    }

    /// The resistor is never connected to the link while a contactor may be closed.
    pub(super) const fn switches(&self) -> Switches {
        Switches { precharge: false, main: false, discharge: self.open, chopper: 0.0 }
    }

    /// One slot.
    pub(super) fn step(&mut self, input: &Situation, line: &Line, settings: &Settings) -> Outcome {
        self.slots = self.slots.saturating_add(1);
        let passed_s = self.slots as f32 * settings.slot_s;
        let udc_v = input.observed.udc_v;
        let wrong = contactors(input, false, false);
        if !self.open {
            match wrong {
                None => *self = Self { open: true, slots: 0 },
                Some(failed) if passed_s > line.contactor_s => return Outcome::Failed(failed),
                Some(_) => {}
            }
            return Outcome::Going;
        }
        if let Some(failed) = wrong {
            return Outcome::Failed(failed);
        }
        if udc_v < line.empty_v {
            return Outcome::Done;
        }
        if passed_s > TOO_LONG * line.discharge_s {
            return Outcome::Failed((Fault::DischargeTimeout, udc_v, line.empty_v));
        }
        Outcome::Going
    }
}

/// The chopper's duty at a link voltage: a straight line between its two levels. A voltage that is not a number gives none.
pub(super) fn chopper(udc_v: f32, line: &Line) -> f32 {
    if udc_v >= line.chopper_full_v {
        1.0
    } else if udc_v > line.chopper_from_v {
        (udc_v - line.chopper_from_v) / (line.chopper_full_v - line.chopper_from_v)
    } else {
        0.0
    }
}
