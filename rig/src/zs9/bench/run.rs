//! The passing of time, with everything that is due on the way.

use super::{Bench, BenchError};
use crate::bench::Tick;
use crate::inject::zs9::Kind;
use crate::plant::stopwatch::in_plant;
use crate::plant::zs9::LegGates;
use crate::steps::held;
use crate::zs9::line::LineSide;
use tractive::protection::SafeState;

/// The capacitor behind the source's contactor, in F: as large as the network's.
const INPUT_F: f64 = 500e-6;
/// Longest step of its voltage and of a line filter's, in s.
const LONGEST_S: f64 = 10e-6;

impl Bench {
    /// Runs to `to`, doing all that is due on the way and at `to` itself.
    pub(super) fn advance(&mut self, to: Tick) -> Result<(), BenchError> {
        if self.time.now == self.time.origin && self.next.is_some() {
            self.begin_period()?;
        }
        while self.time.now < to {
            let now = self.time.now;
            let fault = Some(self.observed.from).filter(|from| *from > now);
            let toggle = self.toggles.last().map(|(at, _)| *at);
            let off = self.off_at.map(|(at, _)| at.max(now));
            let line = self.line.as_ref().and_then(|line| line.gear.next_event());
            let line = line.map(|tick| self.time.of_ticks(tick).max(now + 1));
            let load = self.loads.next().map(|at| at.max(now + 1));
            let events = [fault, toggle, off, line, load, self.gates.next_event()];
            let regular = [self.begun + self.period, self.control.next, self.next_row()];
            let due = events.into_iter().flatten().chain(regular).fold(to, Tick::min);
            self.integrate(due)?;
            self.act()?;
        }
        Ok(())
    }

    fn integrate(&mut self, to: Tick) -> Result<(), BenchError> {
        if to <= self.time.now {
            return Ok(());
        }
        let lost = self.spoiler.injected.kind(self.time.now_s()) == Some(Kind::SourceLost);
        if !lost && self.filter.is_none() {
            return self.integrate_fed(to).map(|_| ());
        }
        let longest = (LONGEST_S / self.time.step_s).round() as Tick;
        while self.time.now + longest < to {
            self.integrate_drawn(lost, self.time.now + longest)?;
        }
        self.integrate_drawn(lost, to)
    }

    /// With a line filter, or with the source cut off: its capacitor loses the energy that it gives.
    fn integrate_drawn(&mut self, lost: bool, to: Tick) -> Result<(), BenchError> {
        let (before_j, begun) = (self.plant.energies.source_j, self.time.now);
        let precharging_j = self.integrate_fed(to)?;
        let given_j = self.plant.energies.source_j - before_j + precharging_j;
        let dt_s = (to - begun) as f64 * self.time.step_s;
        let line_v = (!lost).then(|| self.line_v());
        match &mut self.filter {
            Some(filter) => {
                filter.advance(given_j, dt_s, line_v);
                if self.line.as_ref().is_none_or(LineSide::is_connected) {
                    self.plant.source_v = filter.udc_v;
                }
            }
            None => {
                let square = self.plant.source_v.powi(2) - 2.0 * given_j / INPUT_F;
                self.plant.source_v = square.max(1.0).sqrt();
            }
        }
        Ok(())
    }

    /// Returns the energy that went into precharging, in J.
    fn integrate_fed(&mut self, to: Tick) -> Result<f64, BenchError> {
        let steps = (to - self.time.now) as f64;
        let supply_v = self.behind_contactor_v();
        let precharging_j = self
            .line
            .as_ref()
            .map_or(0.0, |line| line.feed(&mut self.plant, supply_v, steps * self.time.step_s));
        self.plant.hold_link(self.source_f());
        let real = self.real_levels();
        let [uh, vh, wh, um, vm, wm, ul, vl, wl] = real;
        let leg = |high, middle, low| LegGates { high, middle, low };
        let gates = [leg(uh, um, ul), leg(vh, vm, vl), leg(wh, wm, wl)];
        let dt_s = steps * self.time.step_s;
        if real == self.gates.levels {
            let gates =
                if self.off { gates } else { self.gates.as_diodes_have_it(gates, || self.currents_a()) };
            in_plant(|| self.plant.advance(gates, dt_s))?;
        } else {
            self.plant.advance_any(gates, dt_s);
        }
        for (gate, on) in real.into_iter().enumerate() {
            let latch = if on { &mut self.feedback.on } else { &mut self.feedback.off };
            *latch |= 1 << gate;
        }
        let shorted = gates.contains(&LegGates::SHOOT_THROUGH);
        for spans in [Some(&mut self.rows), self.written.as_mut()].into_iter().flatten() {
            let torques_nm = (self.control.report.torque_nm, self.orders.loads_nm);
            spans.pass(steps, self.plant.source_v, torques_nm, shorted);
        }
        self.time.now = to;
        self.watch();
        Ok(precharging_j)
    }

    /// Capacitance at the source's contactor, in F; without end for a stiff source.
    fn source_f(&self) -> f64 {
        match (&self.filter, self.spoiler.injected.kind(self.time.now_s())) {
            (Some(filter), _) => filter.capacitance_f(),
            (None, Some(Kind::SourceLost)) => INPUT_F,
            (None, _) => f64::INFINITY,
        }
    }

    fn act(&mut self) -> Result<(), BenchError> {
        match self.off_at {
            Some((at, true)) if at <= self.time.now => {
                self.off_at = None;
                self.off = true;
                self.toggles.clear();
                self.gates.order(self.time.now, [false; 9]);
                self.observed.enters(self.time.now, SafeState::GatesOff, self.stored());
            }
            Some((at, false)) if at <= self.time.now => {
                self.off_at = None;
                self.off = false;
            }
            _ => {}
        }
        if let Some(line) = &mut self.line {
            line.act(self.time.tick());
        }
        while let Some(loads_nm) = self.loads.take(self.time.now) {
            self.loads_nm = Some(loads_nm);
            self.set_loads_nm(loads_nm);
        }
        let mut ordered = self.gates.ordered;
        while let Some((at, gate)) = self.toggles.last().copied()
            && at <= self.time.now
        {
            self.toggles.pop();
            ordered[usize::from(gate)] ^= true;
        }
        self.gates.order(self.time.now, ordered);
        self.gates.act(self.time.now);
        if self.time.now == self.begun + self.period {
            self.begun = self.time.now;
            self.begin_period()?;
        }
        if self.time.now == self.next_row() {
            self.record();
        }
        if self.time.now == self.control.next {
            self.take_sample()?;
        }
        Ok(())
    }

    /// The source's voltage at its contactor, with the fault's effect, in V.
    pub(super) fn behind_contactor_v(&self) -> f64 {
        let t_s = self.time.now_s();
        match (&self.filter, self.spoiler.injected.kind(t_s)) {
            (Some(filter), _) => filter.udc_v,
            (None, Some(Kind::SourceLost)) => self.plant.source_v,
            (None, _) => self.spoiler.source_v(t_s, self.nominal_source_v),
        }
    }

    /// Voltage of the line in front of a line filter, with its course, its ripple and the fault's effect, in V.
    pub(super) fn line_v(&self) -> f64 {
        let t_s = self.time.now_s();
        let healthy_v = held(&self.course.source_v, t_s).unwrap_or(self.nominal_source_v);
        self.spoiler.source_v(t_s, healthy_v + self.converter.ripple_v(t_s))
    }

    /// Phase currents of both motors, in A.
    pub(super) fn currents_a(&self) -> [[f64; 3]; 2] {
        self.plant.motors.each_ref().map(|motor| motor.currents_abc())
    }

    /// Loads of both rotors, in N·m.
    pub(super) fn set_loads_nm(&mut self, loads_nm: [f64; 2]) {
        for (motor, load_nm) in self.plant.motors.iter_mut().zip(loads_nm) {
            motor.set_load_nm(load_nm);
        }
    }
}
