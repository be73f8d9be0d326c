//! The exchange between the ZS9's operator and the board, and the name and the end of a break.

use super::model::Model;
use super::ports::{control, converted, make_ready, zeros};
use crate::bench::{Bench, drivers_ready, take_written, write_input, written};
use crate::bus::Bus;
use nucleo_g474re::built_in::zs9::BUILT_IN;
use nucleo_g474re::can::Can;
use nucleo_g474re::outputs::SoftwareBreak;
use nucleo_g474re::position::PositionState;
use nucleo_g474re::registers::Registers;
use nucleo_g474re::start::StartError;
use nucleo_g474re::switchgear;
use nucleo_g474re::zs9::hardware::{held_by, latched_by};
use nucleo_g474re::zs9::serve::DualServe;
use nucleo_g474re::zs9::{self, CLOCK, Pwm, RATINGS, settings, start};
use tractive::drive::dual::{ControlTask, Shared};
use tractive::nine_switch::Scheme;
use tractive::operator::{Configuration, DualSlot, Feedback, Line, Settings, State, Switches, slot_s};
use tractive::ports::{ControlPort, HardwareBreak, PwmPort};
use tractive::protection::Fault;
use tractive::protocol::{Payload, StatusFrame, TO_ZS9, ZS9_STATUS, Zs9CanEndpoint};
use tractive::time::Instant;

const NOW: Instant = Instant(0);

fn crosses(registers: &Registers, number: usize, crossed: bool) {
    let comparator = registers.comparators[number - 1];
    comparator.csr().modify(|w| w.set_value(crossed));
}

#[test]
fn a_break_has_the_name_of_its_cause_and_where_it_was_seen() {
    let registers = Model::started().registers;
    drivers_ready(&registers, true);
    assert_eq!(latched_by(&registers), None);
    let timers = [registers.legs.tim1, registers.legs.tim8, registers.tim20];
    // A comparator that has seen its overcurrent end: the timers' latches are left.
    for (bit, timer) in timers.into_iter().enumerate() {
        timer.sr().modify(|w| w.set_bif(0, true));
        let found = HardwareBreak { fault: Fault::HardwareOvercurrent, seen: 1 << bit };
        assert_eq!(latched_by(&registers), Some(found));
        timer.sr().modify(|w| w.set_bif(0, false));
    }
    timers[1].sr().modify(|w| w.set_bif(0, true));
    // One that sees it still.
    for number in [1, 2, 3, 4, 6, 7] {
        crosses(&registers, number, true);
        let seen = 0b010 | 1 << (2 + number);
        assert_eq!(latched_by(&registers), Some(HardwareBreak { fault: Fault::HardwareOvercurrent, seen }));
        assert_eq!(held_by(&registers), Some(Fault::HardwareOvercurrent));
        crosses(&registers, number, false);
    }
    // The drivers' ready wire, by its comparator and by the break inputs.
    crosses(&registers, 5, true);
    assert_eq!(latched_by(&registers), Some(HardwareBreak { fault: Fault::GateDriver, seen: 0b1000_0010 }));
    crosses(&registers, 5, false);
    drivers_ready(&registers, false);
    assert_eq!(latched_by(&registers).map(|found| found.fault), Some(Fault::GateDriver));
    drivers_ready(&registers, true);
    timers[2].sr().modify(|w| w.set_sbif(true));
    assert_eq!(latched_by(&registers), Some(HardwareBreak { fault: Fault::ClockFailure, seen: 0b110 }));
}

#[test]
fn softwares_own_breaks_are_told_apart_and_are_left() {
    for (software, name) in [(SoftwareBreak::Drive, None), (SoftwareBreak::Late, Some(Fault::PwmDeadline))] {
        let mut model = Model::started();
        let registers = model.registers;
        drivers_ready(&registers, true);
        let outputs = start::bridge(&registers).outputs();
        outputs.trip_by(software);
        model.settle();
        assert!(outputs.is_tripped());
        assert_eq!(latched_by(&registers).map(|found| found.fault), name);
        // The first account stays.
        outputs.trip_by(SoftwareBreak::Drive);
        model.settle();
        assert_eq!(latched_by(&registers).map(|found| found.fault), name);
        assert!(Pwm::new(registers, zeros()).leave(NOW));
        model.settle();
        assert!(!outputs.is_tripped() && !outputs.is_on());
        assert_eq!((latched_by(&registers), outputs.software_break()), (None, None));
    }
}

#[test]
fn the_control_interrupt_is_told_of_a_break() {
    let registers = Model::started().registers;
    let state = PositionState::new();
    let mut control = control(registers, &state);
    make_ready(&registers);
    converted(&[], registers);
    assert_eq!(control.sample(NOW).hardware, None);
    registers.tim20.sr().modify(|w| w.set_bif(0, true));
    let sample = control.sample(NOW);
    let found = HardwareBreak { fault: Fault::HardwareOvercurrent, seen: 0b100 };
    assert_eq!((sample.hardware, sample.may_pulse), (Some(found), false));
}

#[test]
fn the_operator_hears_of_contacts_drivers_and_inputs() {
    let registers = Model::started().registers;
    let state = PositionState::new();
    // The bus is not touched by what is tested here.
    let station = Zs9CanEndpoint::new(&RATINGS);
    let serve = DualServe::new(registers, Can::CHIP, station, &state, Configuration::Good);
    drivers_ready(&registers, true);
    let healthy = Feedback {
        driver_ready: true,
        sensor_alive: true,
        configuration: Configuration::Good,
        ..Feedback::default()
    };
    let inputs = |levels| write_input(registers.gpioc, levels);
    for (levels, wanted) in [
        (0, healthy),
        (1 << 4, Feedback { enable_input: true, ..healthy }),
        (1 << 5, Feedback { precharge_closed: true, ..healthy }),
        (1 << 12, Feedback { main_closed: true, ..healthy }),
    ] {
        inputs(levels);
        assert_eq!(serve.feedback(), wanted, "{levels:#b}");
    }
    // The position is known one sample after both indices have passed, and stays so when control has cleared their flags.
    inputs(0);
    let mut control = control(registers, &state);
    for (timer, knows) in [(registers.tim3, [false; 3]), (registers.tim4, [false, true, true])] {
        timer.sr().write(|w| w.set_idxif(true));
        for known in knows {
            converted(&[], registers);
            control.sample(NOW);
            assert_eq!(serve.feedback().position_known, known);
        }
    }
    drivers_ready(&registers, false);
    let feedback = serve.feedback();
    assert_eq!((feedback.driver_ready, feedback.hardware), (false, Some(Fault::GateDriver)));
}

/// The operator's side of the board in memory, with its bus.
struct Idle {
    registers: Registers,
    bus: Bus,
    serve: DualServe<'static>,
    slot: DualSlot,
    rated: Settings<'static>,
}

impl Idle {
    fn new() -> Self {
        let registers = Model::started().registers;
        let bus = Bus::new(&TO_ZS9, &registers, &mut Bench::of_other_inverter());
        let state: &'static PositionState = Box::leak(Box::new(PositionState::new()));
        let station = Zs9CanEndpoint::new(&RATINGS);
        let serve = DualServe::new(registers, bus.can, station, state, Configuration::Good);
        let line = Line::rated(&RATINGS, 0.1, 0.1).without_chopper();
        let rated = Settings::rated(&RATINGS, slot_s(&CLOCK), Some(line));
        Self { registers, bus, serve, slot: DualSlot::new(), rated }
    }

    /// The status on the bus, if one was sent.
    fn heard(&mut self) -> Option<StatusFrame<Scheme>> {
        let frame = self.bus.settle().filter(|frame| frame.id == ZS9_STATUS.id)?;
        Some(StatusFrame::decode(Payload(u64::from_le_bytes(frame.data))))
    }
}

/// Ten periods to a slot, ten slots to a status.
#[test]
fn each_slot_is_done_once_and_its_status_is_sent_and_its_switches_are_set() {
    let mut idle = Idle::new();
    let shared = Shared::new();
    assert!(!idle.serve.pass(&mut idle.slot, &shared.operator, &idle.rated), "nothing is observed yet");
    let state = PositionState::new();
    let mut control = control(idle.registers, &state);
    let mut task = ControlTask::new(&BUILT_IN, settings());
    let (mut slots, mut told) = (0, Vec::new());
    for _ in 0..1_000 {
        converted(&[], idle.registers);
        task.run(&mut control, &shared);
        slots += u32::from(idle.serve.pass(&mut idle.slot, &shared.operator, &idle.rated));
        assert!(!idle.serve.pass(&mut idle.slot, &shared.operator, &idle.rated), "once");
        told.extend(idle.heard());
    }
    assert_eq!((slots, told.len()), (100, 10));
    assert_eq!(told[0].state, Some(State::SelfTest));
    assert_eq!(written(idle.registers.gpioc), 1 << 25, "the discharge resistor is off");
}

#[test]
fn a_start_that_is_refused_is_told_on_the_bus() {
    let mut idle = Idle::new();
    let why = StartError::WatchdogReset.failed();
    let mut told = Vec::new();
    for _ in 0..100 {
        idle.serve.refuse(&mut idle.slot, why, &idle.rated);
        told.extend(idle.heard());
    }
    let faults = told.iter().map(|status| (status.state, Fault::from_code(status.fault.into())));
    assert_eq!(faults.collect::<Vec<_>>(), [(Some(State::Fault), Some(Fault::StartRefused)); 10]);
}

#[test]
fn each_switch_has_its_pin() {
    let registers = Model::started().registers;
    for (switches, [b, c]) in [
        (Switches { precharge: true, ..Switches::default() }, [1 << 10, 1 << 25]),
        (Switches { main: true, ..Switches::default() }, [1 << 15, 1 << 25]),
        (Switches { discharge: true, ..Switches::default() }, [1 << 31, 1 << 9]),
    ] {
        let _ = [registers.gpiob, registers.gpioc].map(take_written);
        switchgear::set_wires(&registers, &zs9::pins::SWITCHGEAR, &switches);
        assert_eq!([registers.gpiob, registers.gpioc].map(take_written), [b, c], "{switches:?}");
    }
}
