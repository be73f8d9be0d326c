//! Lets time pass, and does what is due on the way.

use super::dc_side::{DcSide, line_v};
use super::{Bench, BenchError, LineSide, Peaks, Stored, Stuck, Terminal, Tick};
use crate::inject::traction::Kind;
use tractive::protection::LegFaults;

impl Bench {
    /// Runs to `tick`, doing everything that is due on the way, including at `tick` itself.
    pub(super) fn advance(&mut self, tick: Tick) -> Result<(), BenchError> {
        while self.time.now < tick {
            let due = self.due(tick);
            self.turn_on(self.seconds_to(due));
            self.pass(due);
            self.act()?;
        }
        Ok(())
    }

    /// The next tick after now at which something is due, but not later than `tick`.
    pub(crate) fn due(&self, tick: Tick) -> Tick {
        let now = self.time.now;
        let fault = Some(self.observed.from).filter(|from| *from > now);
        let line = self.dc.operated().and_then(LineSide::next_event);
        let load = self.loads.next().map(|at| at.max(now));
        let [for_control, at_boundary] = &self.holds;
        let held = for_control.next_event(now, self.control.next);
        let held_at_boundary = at_boundary.next_event(now, self.inverter.half_end());
        let inverter = self.inverter.next_event();
        let events = [fault, inverter, self.orders.next(), load, line, held, held_at_boundary];
        let regular = [self.inverter.half_end(), self.control.next, self.next_row()];
        events.into_iter().flatten().chain(regular).fold(tick, Tick::min)
    }

    /// Time from now to a tick, in s.
    pub(crate) fn seconds_to(&self, tick: Tick) -> f64 {
        tick.saturating_sub(self.time.now) as f64 * self.time.step_s
    }

    /// Lets plant and link run on for a time; returns the energy that the legs have taken from the link, in J.
    pub(crate) fn turn_on(&mut self, dt_s: f64) -> f64 {
        if dt_s <= 0.0 {
            return 0.0;
        }
        let t_s = self.time.now_s();
        let (sensors, spoiler) = (&self.sensors, &self.spoiler);
        if let Some(line) = self.dc.operated_mut() {
            line.ripple_v = sensors.ripple_v(t_s);
        }
        let before_j = self.plant.motor.energies.electrical_j;
        self.dc.advance(&mut self.plant, self.inverter.legs(), dt_s, || {
            (sensors.supply_v(t_s), spoiler.supply(t_s))
        });
        self.plant.motor.energies.electrical_j - before_j
    }

    /// Voltage of a line behind a shared link, in V; `None` if it is disconnected.
    pub(crate) fn line_now(&self) -> Option<f64> {
        let t_s = self.time.now_s();
        line_v((self.sensors.supply_v(t_s), self.spoiler.supply(t_s)))
    }

    /// Arrives at `tick` with a shared link, after [`Self::turn_on`], and does what is due.
    pub(crate) fn arrive(&mut self, tick: Tick, terminal: Terminal) -> Result<(), BenchError> {
        self.dc = DcSide::Shared(terminal);
        self.pass(tick);
        self.act()
    }

    /// Records the plant as seen at `tick`, to which it has run.
    fn pass(&mut self, tick: Tick) {
        let now = self.time.now;
        if tick > now {
            let dt_s = self.seconds_to(tick);
            self.sensors.pass(&self.plant.motor, dt_s);
            self.inverter.monitor(self.plant.motor.currents_abc(), now, tick);
            if self.inverter.leg_faults() != LegFaults::default() {
                self.observed.makes_a_difference(now);
            }
            self.time.now = tick;
            let udc_v = self.udc_v(self.time.now_s());
            let currents_a = self.plant.motor.currents_abc();
            let (id_a, _) = self.plant.motor.currents_dq();
            if (self.time.lead..self.rows.next).contains(&tick) {
                self.extremes = self.extremes.with(currents_a, self.plant.motor.torque_nm(), id_a);
            }
            let peaks = Peaks::at(&currents_a, id_a, udc_v, 0.0);
            self.observed.note(tick, &peaks, self.plant.motor.speed_rpm());
        }
    }

    /// The link's true voltage, in V.
    pub(super) fn udc_v(&self, t_s: f64) -> f64 {
        self.dc.udc_v(|| self.sensors.supply_v(t_s))
    }

    /// The stored energy, and the part of it that the link must take.
    fn stored(&self) -> Stored {
        let now_s = self.time.now_s();
        let unloaded_v = self.dc.unloaded_v(|ahead_s| {
            let t_s = now_s + ahead_s;
            (self.sensors.supply_v(t_s), self.spoiler.supply(t_s))
        });
        let udc_v = self.udc_v(now_s);
        // Two thirds of the link voltage remove the flux linkage.
        Stored::of(std::slice::from_ref(&self.plant.motor), 2.0 / 3.0 * udc_v, unloaded_v.max(udc_v))
    }

    fn act(&mut self) -> Result<(), BenchError> {
        let now = self.time.now;
        let t_s = self.time.now_s();
        let conversions = [self.control.next, self.inverter.half_end()];
        for (holds, at) in self.holds.iter_mut().zip(conversions) {
            holds.act(now, at, || self.sensors.behind(&self.plant.motor));
        }
        if let Some(row) = self.dc.operated_mut().and_then(|line| line.act(now, t_s))
            && now >= self.time.lead
            && now <= self.end
        {
            self.slots.push(row);
        }
        if now == self.observed.from {
            self.observed.carrier_ticks = 2 * Tick::from(self.inverter.half().period_ticks);
            // Its instant has come, though it may lie between this tick and the next.
            match self.spoiler.injected.0.map(|injection| injection.kind) {
                Some(Kind::Gate(gate, on)) => {
                    self.inverter.stick(gate, if on { Stuck::On } else { Stuck::Off })
                }
                Some(Kind::Device(gate)) => self.inverter.stick(gate, Stuck::Shorted),
                _ => {}
            }
        }
        while let Some(order) = self.orders.take(now) {
            match order {
                Some(safe) => {
                    // Case of a sensor whose error is detected while it still makes no difference that counts.
                    if let Some(Kind::Current(..)) = self.spoiler.injected.kind(self.time.now_s()) {
                        self.observed.makes_a_difference(now);
                    }
                    self.inverter.enter(safe, now);
                    self.observed.enters(now, safe, self.stored());
                }
                None => self.inverter.leave(now),
            }
        }
        while let Some(load_nm) = self.loads.take(now) {
            self.plant.motor.set_load_nm(load_nm);
        }
        self.inverter.act(now);
        if now == self.inverter.half_end() {
            let nothing = BenchError::NothingToPlay { what: "carrier half", at_s: t_s };
            let next = self.next.take().ok_or(nothing)?;
            self.note_switch(&next);
            self.inverter.begin(next, now);
        }
        if now == self.control.next {
            self.take_sample()?;
        }
        if now == self.next_row() {
            self.record();
        }
        Ok(())
    }
}
