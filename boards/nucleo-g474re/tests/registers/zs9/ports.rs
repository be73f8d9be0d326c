//! The board as the interrupts see it.

use super::model::Model;
use crate::bench::{Bench, control_update, drivers_ready, take_written, write_input};
use nucleo_g474re::built_in::zs9::BUILT_IN;
use nucleo_g474re::outputs::SoftwareBreak;
use nucleo_g474re::position::{Encoder, PositionState};
use nucleo_g474re::power_stage::AdcCode;
use nucleo_g474re::registers::Registers;
use nucleo_g474re::start::Wait;
use nucleo_g474re::zs9::sampling::Zeros;
use nucleo_g474re::zs9::stage::STAGE;
use nucleo_g474re::zs9::{CLOCK, Control, Pwm, start};
use stm32_metapac::adc::regs::Isr;
use stm32_metapac::spi::vals::{Br, Cpha, Cpol, Ds, Mstr};
use stm32_metapac::timer::regs::SrGp16;
use stm32_metapac::timer::vals::Dir;
use tractive::control::Demand;
use tractive::frames::{Abc, Angle};
use tractive::ports::DualDriveCommand;
use tractive::ports::{ControlPort, GateFeedback, MotorDemand, PwmPort};
use tractive::protection::{Fault, MaskedFaults, SafeState};
use tractive::time::Instant;

/// The converters' codes do not follow the voltage of the gates.
pub const UNEXPLAINED: MaskedFaults = MaskedFaults::of(Fault::VoltageUnexplained);

const NOW: Instant = Instant(0);

pub fn zeros() -> Zeros {
    Zeros { motors: [[AdcCode(2_048); 3]; 2], inductor: AdcCode(2_048) }
}

pub fn control<'a>(registers: Registers, state: &'a PositionState) -> Control<'a, Encoder> {
    let encoders =
        [registers.tim4, registers.tim3].map(|timer| Encoder::new(timer, &STAGE.common, &BUILT_IN.ratings));
    Control::new(registers, zeros(), encoders, state)
}

/// Gates may pulse.
pub fn permitted(torques_nm: [f32; 2], link_ref_v: f32) -> DualDriveCommand {
    let torque = |torque_nm| MotorDemand::Torque(Demand { torque_nm, slew_limited: true });
    DualDriveCommand { enable: true, demands: torques_nm.map(torque), link_ref_v, ..DualDriveCommand::NONE }
}

/// Enable input, drivers and indices.
pub fn make_ready(registers: &Registers) {
    write_input(registers.gpioc, 1 << 4);
    drivers_ready(registers, true);
    for timer in [registers.tim3, registers.tim4] {
        timer.sr().write(|w| w.set_idxif(true));
    }
}

/// A bench whose converters hold these codes by channel.
pub fn converted(codes: &[(usize, u16)], registers: Registers) {
    let mut bench = Bench::of_other_inverter();
    for (channel, code) in codes {
        bench.codes[*channel] = *code;
    }
    for adc in [registers.adc1, registers.adc2, registers.adc3] {
        bench.finish_sequence(adc);
    }
}

#[test]
fn a_sample_has_both_motors_and_the_link_in_si_units() {
    let registers = Model::started().registers;
    let state = PositionState::new();
    let mut control = control(registers, &state);
    // Channels of U, V, W: 2, 7, 14 and 15, 5, 4; capacitors 6, source 9, inductor 1.
    let codes = [
        (2, 2_148),
        (7, 1_948),
        (14, 2_048),
        (15, 1_848),
        (5, 2_048),
        (4, 2_248),
        (6, 2_184),
        (9, 1_638),
        (1, 3_048),
    ];
    converted(&codes, registers);
    make_ready(&registers);
    control.sample(NOW);
    registers.tim4.cnt().write(|w| w.set_cnt(256));
    registers.tim3.cnt().write(|w| w.set_cnt(512));
    control_update(&registers);
    // What is counted after the trigger does not reach the angles.
    registers.tim4.cnt().write(|w| w.set_cnt(299));
    registers.tim3.cnt().write(|w| w.set_cnt(599));
    converted(&codes, registers);
    let sample = control.sample(NOW);
    let unit = 150.0 / 2_048.0;
    let [upper, lower] = sample.currents_a;
    assert_eq!([upper.a, upper.b, upper.c], [100.0 * unit, -100.0 * unit, 0.0]);
    assert_eq!([lower.a, lower.b, lower.c], [-200.0 * unit, 0.0, 200.0 * unit]);
    assert!((sample.capacitor_v - 533.0).abs() < 0.5 && (sample.source_v - 400.0).abs() < 0.5);
    assert_eq!(sample.inductor_a, 1_000.0 * unit);
    // With half a count, 2⁻¹¹ turns, electrical.
    assert_eq!(sample.angles, [Some(Angle((1 << 30) + (1 << 21))), Some(Angle((1 << 31) + (1 << 21)))]);
    assert!(sample.may_pulse);
}

#[test]
fn the_gates_wait_for_both_indices_the_enable_input_and_quiet_breaks() {
    type Spoil = fn(&Registers);
    let cases: [(bool, Spoil); 5] = [
        (true, |_| ()),
        (false, |registers| registers.tim3.sr().write(|w| w.set_idxif(false))),
        (false, |registers| registers.tim4.sr().write(|w| w.set_idxif(false))),
        (false, |registers| write_input(registers.gpioc, 0)),
        (false, |registers| registers.tim20.sr().write(|w| w.set_bif(0, true))),
    ];
    for (enabled, spoil) in cases {
        let registers = Model::started().registers;
        let state = PositionState::new();
        let mut control = control(registers, &state);
        converted(&[], registers);
        make_ready(&registers);
        spoil(&registers);
        control.sample(NOW);
        converted(&[], registers);
        let sample = control.sample(NOW);
        let known = sample.angles.iter().all(Option::is_some);
        assert_eq!(sample.may_pulse && known, enabled);
        assert_eq!(state.is_known(), known, "an angle that is not known is none");
    }
}

#[test]
fn an_index_at_the_wrong_count_is_a_lost_sensor() {
    let registers = Model::started().registers;
    let state = PositionState::new();
    let mut control = control(registers, &state);
    let mut sample = |count, index| {
        registers.tim3.cnt().write(|w| w.set_cnt(count));
        control_update(&registers);
        registers.tim3.sr().write(|w| w.set_idxif(index));
        converted(&[], registers);
        control.sample(NOW).angles.map(|angle| angle.is_some())
    };
    registers.tim4.sr().write(|w| w.set_idxif(true));
    assert_eq!(sample(0, true), [false, false], "its count may be older than the index");
    assert_eq!(sample(0, false), [true, true]);
    assert_eq!(sample(4_000, false), [true, true]);
    assert_eq!(sample(3_904, false), [true, true]);
    assert_eq!(sample(5, true), [true, false], "96 counts back, then 197 forward");
    assert_eq!(sample(0, false), [true, false], "for good");
    assert!(state.is_lost() && !state.is_known());
}

#[test]
fn converters_that_are_silent_give_no_number() {
    let registers = Model::started().registers;
    for adc in [registers.adc1, registers.adc2, registers.adc3] {
        adc.isr().write(|_| ());
    }
    let sample = Pwm::new(registers, zeros()).sample(NOW);
    assert!(sample.currents_a.iter().all(|current| current.a.is_nan()) && sample.source_v.is_nan());
    let state = PositionState::new();
    assert!(control(registers, &state).sample(NOW).inductor_a.is_nan());
}

#[test]
fn the_first_peak_forgets_nothing_and_a_later_one_what_a_valley_has_left() {
    let registers = Bench::of_other_inverter().registers;
    let turn = |dir| registers.legs.tim1.cr1().modify(|w| w.set_dir(dir));
    let mut pwm = Pwm::new(registers, zeros());
    // The drive is built in the first interrupt: its own conversions may be complete by now.
    turn(Dir::DOWN);
    registers.adc1.isr().write_value(Isr(0));
    assert!(pwm.begin());
    assert_eq!(registers.adc1.isr().read().0, 0);
    turn(Dir::UP);
    assert!(!pwm.begin());
    turn(Dir::DOWN);
    assert!(pwm.begin());
    assert!(registers.adc1.isr().read().jeos(), "a flag is taken back by writing 1");
}

#[test]
fn the_driver_boards_latches_are_two_marked_words() {
    let read = |words: &[u16]| {
        let registers = Model::started().registers;
        let feedback = start::feedback(&registers);
        feedback.begin();
        // One word at a time: in memory the second read sees the same register, so each pair is given its own.
        registers.spi3.sr().write(|w| w.set_rxne(true));
        registers.spi3.dr16().write_value(words[0]);
        (feedback, registers)
    };
    // The same word twice has one mark wrong: nothing counts as seen.
    for word in [0b1010101 << 9 | 0x1FF, 0b0101010 << 9 | 0x1FF, 0xFFFF, 0] {
        let (feedback, _) = read(&[word]);
        assert_eq!(feedback.end(), GateFeedback::default());
    }
    // And none at all.
    let (feedback, registers) = read(&[0]);
    registers.spi3.sr().write(|w| w.set_rxne(false));
    assert_eq!(feedback.end(), GateFeedback::default());
}

#[test]
fn two_words_are_what_the_gates_did_and_one_is_nothing() {
    use nucleo_g474re::zs9::feedback::decoded;
    let (on, off) = (0x1A5, 0x05A);
    let [first, second] = [0b1010101 << 9 | on, 0b0101010 << 9 | off].map(Some);
    assert_eq!(decoded([first, second]), GateFeedback { on, off });
    for words in [[first, None], [None, second], [None; 2]] {
        assert_eq!(decoded(words), GateFeedback::default());
    }
}

/// Master, 16 bits, at a sixteenth of 170 MHz, a bit read at the edge that ends it, with a select line of its own.
#[test]
fn the_driver_board_is_asked_for_two_words_while_it_is_selected() {
    let registers = Model::started().registers;
    let (settings, feedback) = (registers.spi3.cr1().read(), start::feedback(&registers));
    assert_eq!(registers.spi3.cr2().read().ds(), Ds::BITS16);
    assert_eq!((settings.mstr(), settings.br()), (Mstr::MASTER, Br::DIV16));
    assert_eq!((settings.cpol(), settings.cpha()), (Cpol::IDLE_LOW, Cpha::SECOND_EDGE));
    assert!(settings.ssm() && settings.ssi() && settings.spe());
    let written = || take_written(registers.gpioa);
    written();
    registers.spi3.dr16().write_value(0x1234);
    feedback.begin();
    assert_eq!((written(), registers.spi3.dr16().read()), (1 << 31, 0), "low, and words under way");
    registers.spi3.dr16().write_value(0x1234);
    registers.spi3.sr().write(|w| w.set_rxne(true));
    assert_eq!(feedback.word(), Some(0x1234));
    feedback.end();
    assert_eq!(written(), 1 << 15, "high again");
    registers.spi3.sr().write(|w| w.set_rxne(false));
    assert_eq!(feedback.word(), None);
}

#[test]
fn the_first_samples_are_right_however_long_the_start_takes() {
    let mut bench = Bench::of_other_inverter();
    let registers = bench.registers;
    start::prepare(&registers, &mut bench).unwrap();
    bench.microseconds(50_000);
    start::run(&registers, &mut bench);
    bench.microseconds(100);
    for adc in [registers.adc1, registers.adc2, registers.adc3] {
        bench.finish_sequence(adc);
    }
    let state = PositionState::new();
    let sample = control(registers, &state).sample(NOW);
    assert_eq!(sample.currents_a, [Abc::default(); 2]);
    assert_eq!(sample.inductor_a, 0.0);
}

/// Flags are cleared by writing 0 and left alone by writing 1.
#[test]
fn the_control_interrupt_is_acknowledged_and_no_other_flag() {
    let registers = Model::started().registers;
    let state = PositionState::new();
    registers.tim2.sr().write_value(SrGp16(0));
    control(registers, &state).begin(false);
    assert_eq!(registers.tim2.sr().read().0, !1);
}

#[test]
fn a_fault_that_control_names_turns_the_gates_off() {
    let mut model = Model::started();
    let state = PositionState::new();
    control(model.registers, &state).enter(SafeState::GatesOff, NOW);
    model.settle();
    let outputs = start::bridge(&model.registers).outputs();
    assert!(outputs.is_tripped());
    assert_eq!(outputs.software_break(), Some(SoftwareBreak::Drive));
}

#[test]
fn an_overrun_is_counted_from_the_deadline() {
    let registers = Model::started().registers;
    let state = PositionState::new();
    let mut control = control(registers, &state);
    let deadline = CLOCK.control_ticks / 2;
    for (count, again, late) in [(deadline, false, 0), (deadline + 7, false, 7), (3, true, deadline + 3)] {
        registers.tim2.cnt().write_value(count);
        registers.tim2.sr().write(|w| w.set_uif(again));
        assert_eq!(control.overrun_ticks(NOW, deadline), late);
    }
}

#[test]
fn the_link_is_the_boards_until_the_operator_names_a_voltage() {
    let state = PositionState::new();
    let mut control = control(Model::started().registers, &state);
    let command = control.command(NOW, || DualDriveCommand::NONE);
    assert_eq!(command, DualDriveCommand { link_ref_v: STAGE.link_ref_v, ..DualDriveCommand::NONE });
    let named = permitted([50.0, -20.0], 600.0);
    assert_eq!(control.command(NOW, || named), named);
}
