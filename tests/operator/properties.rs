//! The rules that no sequence of requests, measurements and misbehaviour may break.

use crate::world::{World, trip};
use proptest::prelude::*;
use std::cell::RefCell;
use std::collections::BTreeSet;
use tractive::operator::{Configuration, Feedback, Output, State};
use tractive::protection::Fault;

/// Something that happens between two slots.
#[derive(Clone, Copy, Debug)]
enum Event {
    Enable(bool),
    Off(bool),
    Coast(bool),
    Charge(bool),
    Discharge(bool),
    Acknowledge(bool),
    WithTorque(bool),
    Torque(f32),
    BrakingLimit(f32),
    Driver(bool),
    EnableInput(bool),
    Sensor(bool),
    Position(bool),
    ParametersOpen(bool),
    Configuration(bool),
    Hardware(bool),
    Stuck(bool),
    Deaf(bool),
    MainContact(bool),
    Source(f32),
    Link(f32),
    Omega(f32),
    Current(f32),
    Trip(bool),
    Persistent(bool),
    /// Everything healthy again.
    Heal,
    /// Commands of a usual start, one after the other, with time between them.
    Start,
    /// Slots that pass.
    Wait(u32),
}

/// Numbers as they come from broken sensors, too.
fn number(range: std::ops::Range<f32>) -> impl Strategy<Value = f32> {
    prop_oneof![8 => range, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)]
}

fn event() -> impl Strategy<Value = Event> {
    let level = any::<bool>();
    prop_oneof![
        3 => level.prop_map(Event::Enable),
        1 => level.prop_map(Event::Off),
        1 => level.prop_map(Event::Coast),
        2 => level.prop_map(Event::Charge),
        2 => level.prop_map(Event::Discharge),
        3 => level.prop_map(Event::Acknowledge),
        1 => level.prop_map(Event::WithTorque),
        2 => number(-1_500.0..1_500.0).prop_map(Event::Torque),
        1 => number(-100.0..1_500.0).prop_map(Event::BrakingLimit),
        1 => level.prop_map(Event::Driver),
        1 => level.prop_map(Event::EnableInput),
        1 => level.prop_map(Event::Sensor),
        1 => level.prop_map(Event::Position),
        1 => level.prop_map(Event::ParametersOpen),
        1 => level.prop_map(Event::Configuration),
        1 => level.prop_map(Event::Hardware),
        1 => level.prop_map(Event::Stuck),
        1 => level.prop_map(Event::Deaf),
        1 => level.prop_map(Event::MainContact),
        1 => number(0.0..2_200.0).prop_map(Event::Source),
        1 => number(-100.0..2_200.0).prop_map(Event::Link),
        2 => number(-3_000.0..3_000.0).prop_map(Event::Omega),
        1 => number(0.0..400.0).prop_map(Event::Current),
        1 => level.prop_map(Event::Trip),
        1 => level.prop_map(Event::Persistent),
        4 => Just(Event::Heal),
        8 => Just(Event::Start),
        12 => (1_u32..120).prop_map(Event::Wait),
    ]
}

/// The knowledge of an onlooker: it has its own idea of what a command is.
struct Onlooker {
    enable: bool,
    /// An enabling edge has come, and neither a fault nor the end of a stop since.
    armed: bool,
    /// The stop has begun.
    stopping: bool,
    last: Option<Output>,
    seen: BTreeSet<&'static str>,
    /// Slots for which each contact, of precharge relay and main contactor, has read as it does.
    lasted: [(bool, u32); 2],
}

/// Slots in which a contact that reads wrongly may be bouncing.
const BOUNCE: u32 = 10;

impl Onlooker {
    fn watch(&mut self, world: &mut World) -> Result<(), TestCaseError> {
        let (request, observed, feedback) = (world.request, world.observed, world.feedback);
        self.look_at_contacts(&feedback);
        let [precharge_closed, main_closed] = [0, 1].map(|contact| self.may_be(contact, true));
        let contacts_open = self.may_be(0, false) && self.may_be(1, false);
        let edge = request.enable && !self.enable;
        self.enable = request.enable;
        let before = self.last;
        let output = world.slot();
        let (permit, status, switches) = (output.command, output.status, output.status.switches);
        self.seen.insert(status.state.name());
        if edge {
            (self.armed, self.stopping) = (true, false);
        }
        if request.off || !feedback.enable_input || observed.trip.is_some() || status.trip.is_some() {
            self.armed = false;
        }
        self.stopping |= !request.enable;
        if self.stopping && !permit.enable {
            self.armed = false;
        }
        // Gates.
        prop_assert!(!permit.enable || self.armed, "enabled without a command: {output:?}");
        let enabled_before = before.is_some_and(|before| before.command.enable);
        if permit.enable {
            prop_assert!(feedback.driver_ready && feedback.hardware.is_none() && observed.trip.is_none());
            prop_assert!(feedback.sensor_alive && feedback.position_known && main_closed);
        }
        let coasted = before.is_some_and(|before| before.status.state == State::Coasting);
        if permit.enable && !enabled_before && !coasted {
            prop_assert!(feedback.configuration == Configuration::Good && !feedback.parameters_open);
            prop_assert!(observed.udc_v >= 1_000.0 && observed.udc_v <= 2_070.0, "{}", observed.udc_v);
            prop_assert!(feedback.offsets_a.peak() <= 0.02 * 233.4);
            prop_assert!(request.torque_nm == 0.0 || request.with_torque);
        }
        // Contactors.
        let main_before = before.is_some_and(|before| before.status.switches.main);
        if switches.main && !main_before {
            let precharging = before.is_some_and(|before| before.status.switches.precharge);
            prop_assert!(precharging && precharge_closed && observed.udc_v >= 1_000.0, "{output:?}");
        }
        if switches.discharge {
            prop_assert!(!switches.main && !switches.precharge && !permit.enable);
            prop_assert!(contacts_open);
        }
        if status.state == State::Fault {
            prop_assert!(!permit.enable && !switches.main && !switches.precharge && !switches.discharge);
            prop_assert!(status.trip.is_some());
        }
        // Numbers.
        prop_assert!((0.0..=1.0).contains(&switches.chopper));
        prop_assert!(permit.demand.torque_nm.abs() <= 1_236.0 && permit.demand.slew_limited);
        prop_assert!(permit.window.motoring_none_v < permit.window.motoring_full_v);
        prop_assert!(permit.window.braking_full_v < permit.window.braking_none_v);
        prop_assert!(permit.window.braking_none_v < 2_070.0 && permit.window.motoring_none_v > 850.0);
        prop_assert!(permit.enable || permit.demand.torque_nm == 0.0);
        self.last = Some(output);
        Ok(())
    }

    fn look_at_contacts(&mut self, feedback: &Feedback) {
        let now = [feedback.precharge_closed, feedback.main_closed];
        for ((reads, slots), now) in self.lasted.iter_mut().zip(now) {
            (*reads, *slots) = (now, if now == *reads { *slots + 1 } else { 1 });
        }
    }

    /// A contact may be closed, or open, if it reads so or has not read otherwise for long.
    fn may_be(&self, contact: usize, closed: bool) -> bool {
        let (reads, slots) = self.lasted[contact];
        reads == closed || slots <= BOUNCE
    }

    fn wait(&mut self, world: &mut World, slots: u32) -> Result<(), TestCaseError> {
        (0..slots).try_for_each(|_| self.watch(world))
    }

    fn happen(&mut self, event: Event, world: &mut World) -> Result<(), TestCaseError> {
        let World { request, feedback, observed, .. } = world;
        match event {
            Event::Enable(level) => request.enable = level,
            Event::Off(level) => request.off = level,
            Event::Coast(level) => request.coast = level,
            Event::Charge(level) => request.charge = level,
            Event::Discharge(level) => request.discharge = level,
            Event::Acknowledge(level) => request.acknowledge = level,
            Event::WithTorque(level) => request.with_torque = level,
            Event::Torque(torque_nm) => request.torque_nm = torque_nm,
            Event::BrakingLimit(torque_nm) => request.limits.braking_nm = torque_nm,
            Event::Driver(ready) => feedback.driver_ready = ready,
            Event::EnableInput(high) => feedback.enable_input = high,
            Event::Sensor(alive) => feedback.sensor_alive = alive,
            Event::Position(known) => feedback.position_known = known,
            Event::ParametersOpen(open) => feedback.parameters_open = open,
            Event::Configuration(good) => {
                feedback.configuration = if good { Configuration::Good } else { Configuration::Bad };
            }
            Event::Hardware(held) => feedback.hardware = held.then_some(Fault::ClockFailure),
            Event::Stuck(stuck) => world.stuck = stuck,
            Event::Deaf(deaf) => world.deaf = deaf,
            Event::MainContact(closed) => feedback.main_closed = closed,
            Event::Source(source_v) => world.source_v = source_v,
            Event::Link(udc_v) => observed.udc_v = udc_v,
            Event::Omega(omega) => observed.omega = omega,
            Event::Current(current_a) => observed.current_a = current_a,
            Event::Trip(tripped) => observed.trip = tripped.then_some(trip(Fault::Overcurrent)),
            Event::Persistent(returns) => world.persistent = returns.then_some(trip(Fault::PhaseSum)),
            Event::Heal => {
                let healthy = World::new();
                let acknowledged = world.observed.acknowledged;
                let (udc_v, closed) = (world.observed.udc_v, feedback_contacts(world));
                (world.observed, world.feedback) = (healthy.observed, healthy.feedback);
                (world.observed.acknowledged, world.source_v) = (acknowledged, healthy.source_v);
                world.observed.udc_v = if udc_v.is_finite() { udc_v } else { 0.0 };
                (world.feedback.main_closed, world.feedback.precharge_closed) = closed;
                (world.stuck, world.deaf, world.persistent) = (false, false, None);
            }
            Event::Start => {
                for set in [
                    (|world: &mut World| world.request.acknowledge = true) as fn(&mut World),
                    |world| world.request.charge = true,
                    |world| world.request.enable = true,
                ] {
                    let torque_nm = world.request.torque_nm;
                    let limits = World::new().request.limits;
                    world.request = World::new().request;
                    (world.request.limits, world.request.with_torque) = (limits, true);
                    self.wait(world, 30)?;
                    world.request.torque_nm = torque_nm;
                    set(world);
                    self.wait(world, if world.request.charge { 900 } else { 60 })?;
                }
            }
            Event::Wait(slots) => self.wait(world, slots)?,
        }
        self.watch(world)
    }
}

fn feedback_contacts(world: &World) -> (bool, bool) {
    (world.feedback.main_closed, world.feedback.precharge_closed)
}

#[test]
fn no_sequence_leaves_what_the_state_machine_promises() {
    let seen = RefCell::new(BTreeSet::new());
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let events = proptest::collection::vec(event(), 1..80);
    runner
        .run(&events, |events| {
            let mut onlooker = Onlooker {
                enable: true,
                armed: false,
                stopping: false,
                last: None,
                seen: BTreeSet::new(),
                lasted: [(false, 0); 2],
            };
            let mut world = World::new();
            let outcome = events.into_iter().try_for_each(|event| onlooker.happen(event, &mut world));
            seen.borrow_mut().extend(onlooker.seen);
            outcome
        })
        .unwrap();
    // The sequences reach every state; the world's configuration is checked from the beginning, so the first is left at once.
    let all: BTreeSet<_> =
        State::ALL.iter().map(|state| state.name()).filter(|name| *name != "init").collect();
    assert_eq!(*seen.borrow(), all);
}
