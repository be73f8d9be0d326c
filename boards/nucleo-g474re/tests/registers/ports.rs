//! The board as the interrupts see it.

use crate::bench::{Bench, control_update, drivers_ready, write_input};
use crate::devices;
use nucleo_g474re::built_in::traction::BUILT_IN;
use nucleo_g474re::legs::SoftwareBreak;
use nucleo_g474re::position::{Encoder, Position, PositionState};
use nucleo_g474re::power_stage::{AdcCode, POWER_STAGE};
use nucleo_g474re::registers::Registers;
use nucleo_g474re::sampling::Zeros;
use nucleo_g474re::start::{self, Wait};
use nucleo_g474re::watchdog::Pulse;
use nucleo_g474re::{Control, Pwm};
use stm32_metapac::timer::regs::SrGp16;
use tractive::frames::Angle;
use tractive::machine::Ratings;
use tractive::ports::{ControlPort, PwmPort};
use tractive::protection::{Fault, SafeState};
use tractive::time::Instant;

const NOW: Instant = Instant(0);
const ZEROS: Zeros = [AdcCode(2_048), AdcCode(2_050), AdcCode(2_040)];

/// The index passes; the angle is known from the next sample on.
fn pass_index<P: Position>(control: &mut Control<P>, registers: &Registers) {
    registers.tim4.sr().write(|w| w.set_idxif(true));
    assert!(control.sample(NOW).angle.is_none(), "its count may be older than the index");
}

/// The counts of the encoder after the trigger, while a more urgent interrupt runs, do not reach the angle.
#[test]
fn the_angle_is_that_of_the_trigger_however_late_it_is_read() {
    let registers = Bench::started(devices()).registers;
    let mut encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    registers.tim4.sr().write(|w| w.set_idxif(true));
    encoder.angle();
    for late in [0, 1, 40, 1_000] {
        registers.tim4.cnt().write(|w| w.set_cnt(256));
        control_update(&registers);
        registers.tim4.cnt().write(|w| w.set_cnt(256 + late));
        // The middle of a count of 2⁻¹⁰ turns, electrical.
        assert_eq!(encoder.angle(), Some(Angle((1 << 30) + (1 << 21))), "{late} counts later");
    }
}

/// An index between the trigger and the reading: flag and count are not of one instant.
#[test]
fn an_index_just_after_the_trigger_makes_no_false_angle() {
    let registers = Bench::started(devices()).registers;
    let mut encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    let mut at = |captured: u16, index: bool| {
        registers.tim4.cnt().write(|w| w.set_cnt(captured));
        control_update(&registers);
        registers.tim4.sr().write(|w| w.set_idxif(index));
        (encoder.angle().map(|angle| angle.0 >> 22), encoder.is_lost())
    };
    // Counted from nowhere until the index; the flag comes one capture early.
    assert_eq!(at(2_990, false), (None, false));
    assert_eq!(at(3_000, true), (None, false), "a count from before the index");
    assert_eq!(at(5, false), (Some(5), false));
    assert_eq!(at(15, false), (Some(15), false));
    // The same with counts lost on the way: told one capture later.
    assert_eq!(at(25, true), (Some(25), false));
    assert_eq!(at(1_005, false), (Some(1_005), true));
}

/// A machine of reluctance alone.
static RELUCTANCE: Ratings = Ratings { magnet_flux_wb: 0.0, ..BUILT_IN.ratings };

/// An angle that was found is an angle; what the index then shows to be wrong goes in small steps, in whichever sample its flag is seen. Half a turn stays, where
/// the machine has no magnets.
#[test]
fn an_angle_that_was_found_mends_at_the_index() {
    const UNIT: i32 = 1 << 22;
    let machines =
        [(false, &BUILT_IN.ratings, 0), (true, &BUILT_IN.ratings, 0), (true, &RELUCTANCE, i32::MIN)];
    for (late, ratings, half) in machines {
        let registers = Bench::started(devices()).registers;
        let mut encoder = Encoder::new(registers.tim4, &POWER_STAGE, ratings);
        let at = |encoder: &mut Encoder, captured: u16, index: bool| {
            registers.tim4.cnt().write(|w| w.set_cnt(captured));
            control_update(&registers);
            registers.tim4.sr().write(|w| w.set_idxif(index));
            encoder.angle().map(|angle| angle.signed().wrapping_sub(half))
        };
        assert_eq!(at(&mut encoder, 100, false), None);
        assert_eq!(at(&mut encoder, 110, false), None);
        assert_eq!(encoder.counted(), Some(Angle(110 << 22)));
        // The index is 30 counts ahead; the angle was found 10 counts too far.
        encoder.align(Angle((-130 * UNIT).wrapping_add(half) as u32));
        assert_eq!(encoder.counted(), None);
        assert_eq!(at(&mut encoder, 120, false), Some(-10 * UNIT));
        assert_eq!(at(&mut encoder, 130, false), Some(0));
        let flagged = if late { 140 } else { 0 };
        assert_eq!(at(&mut encoder, flagged, true), Some(10 * UNIT), "with the index's flag");
        assert_eq!(at(&mut encoder, 10, false), Some(20 * UNIT), "the first of the index's own");
        let mut before = 20 * UNIT;
        for _ in 0..2_000 {
            let angle = at(&mut encoder, 10, false).unwrap();
            assert!((before - UNIT / 8..=before).contains(&angle), "{angle} after {before}");
            before = angle;
        }
        assert!((before - 10 * UNIT - UNIT / 2).abs() < UNIT / 100, "{before}");
        assert!(!encoder.is_lost());
    }
}

#[test]
fn a_sample_has_currents_link_voltage_and_angle_in_si_units() {
    let mut bench = Bench::started(devices());
    let registers = bench.registers;
    let state = PositionState::new();
    let mut control =
        Control::new(registers, ZEROS, Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings), &state);
    (bench.codes[2], bench.codes[15], bench.codes[5], bench.codes[6]) =
        (2_048 + 512, 2_050 - 256, 2_040 - 256, 2_457);
    bench.finish_sequence(registers.adc1);
    pass_index(&mut control, &registers);
    bench.finish_sequence(registers.adc1);
    registers.tim4.cnt().write(|w| w.set_cnt(256));
    control_update(&registers);
    write_input(registers.gpioc, 1 << 2);
    let sample = control.sample(NOW);
    let currents = sample.currents_a;
    assert_eq!((currents.a, currents.b, currents.c), (125.0, -62.5, -62.5));
    assert!((sample.udc_v - 1_500.0).abs() < 0.5);
    // A sixteenth of a turn of the shaft and half a count, four pole pairs.
    assert_eq!(sample.angle, Some(Angle((1 << 30) + (1 << 21))));
    assert!(sample.may_pulse);
}

#[test]
fn the_gates_wait_for_the_index_the_enable_input_and_quiet_break_inputs() {
    for (index, enable, trip) in [(false, true, false), (true, false, false), (true, true, true)] {
        let mut bench = Bench::started(devices());
        let registers = bench.registers;
        let state = PositionState::new();
        let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
        let mut control = Control::new(registers, ZEROS, encoder, &state);
        registers.tim4.sr().write(|w| w.set_idxif(index));
        control.sample(NOW);
        write_input(registers.gpioc, u32::from(enable) << 2);
        if trip {
            control.enter(SafeState::GatesOff, NOW);
            bench.settle();
        }
        bench.finish_sequence(registers.adc1);
        let sample = control.sample(NOW);
        assert_eq!(sample.angle.is_some(), index, "an angle that is not known is none");
        assert_eq!(state.is_known(), index);
        assert!(!(sample.may_pulse && sample.angle.is_some()));
    }
}

/// Square wave below 83 Hz has more than 1 ms between two carrier boundaries.
#[test]
fn a_late_conversion_is_thrown_away() {
    let mut bench = Bench::started(devices());
    let registers = bench.registers;
    let mut pwm = Pwm::new(registers, [AdcCode(2_048); 3]);
    (bench.codes[4], bench.codes[7], bench.codes[14]) = (2_048 + 512, 2_048 - 256, 2_048 - 256);
    for wait_us in [500, 1_500, 2_200] {
        bench.microseconds(wait_us);
        bench.finish_sequence(registers.adc2);
        let currents = pwm.sample(NOW);
        assert_eq!((currents.a, currents.b, currents.c), (125.0, -62.5, -62.5), "after {wait_us} µs");
    }
}

#[test]
fn the_first_samples_are_right_however_long_the_start_takes() {
    let mut bench = Bench::new();
    let registers = bench.registers;
    start::prepare(&registers, &mut bench, devices()).unwrap();
    bench.microseconds(50_000);
    start::run(&registers, &mut bench);
    bench.microseconds(100);
    bench.finish_sequence(registers.adc1);
    let state = PositionState::new();
    let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    let currents = Control::new(registers, [AdcCode(2_048); 3], encoder, &state).sample(NOW).currents_a;
    assert_eq!((currents.a, currents.b, currents.c), (0.0, 0.0, 0.0));
}

#[test]
fn a_converter_that_is_silent_gives_no_number() {
    let bench = Bench::started(devices());
    let registers = bench.registers;
    // Acknowledged and nothing new.
    registers.adc2.isr().write(|_| ());
    let currents = Pwm::new(registers, ZEROS).sample(NOW);
    assert!(currents.a.is_nan() && currents.b.is_nan() && currents.c.is_nan());
}

/// Flags are cleared by writing 0 and left alone by writing 1.
#[test]
fn the_control_interrupt_is_acknowledged_and_no_other_flag() {
    let registers = Bench::started(devices()).registers;
    let state = PositionState::new();
    let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    registers.tim3.sr().write_value(SrGp16(0));
    Control::new(registers, ZEROS, encoder, &state).begin(false);
    assert_eq!(registers.tim3.sr().read().0, !1);
}

/// Signals that the drive finds the angle by.
#[test]
fn the_drive_is_told_what_is_counted_and_tells_where_the_count_began() {
    let registers = Bench::started(devices()).registers;
    let state = PositionState::new();
    let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    let mut control = Control::new(registers, ZEROS, encoder, &state);
    registers.tim4.cnt().write(|w| w.set_cnt(110));
    control_update(&registers);
    let counted = Angle(110 << 22);
    assert_eq!((control.sample(NOW).angle, control.turned()), (None, Some(counted)));
    assert!(state.is_counted() && !state.is_known());
    control.align(NOW, Angle::DEG_90);
    assert_eq!((control.sample(NOW).angle, control.turned()), (Some(Angle::DEG_90 + counted), None));
    assert!(state.is_known() && !state.is_counted());
}

/// The same interrupt comes at boundaries, which it acknowledges, and in between for a revision.
#[test]
fn a_boundary_is_told_from_a_revision_and_acknowledged() {
    let mut bench = Bench::started(devices());
    let mut pwm = Pwm::new(bench.registers, ZEROS);
    for _ in 0..3 {
        assert!(!pwm.is_boundary() && !pwm.begin());
        while !bench.tick() {}
        assert!(pwm.is_boundary() && pwm.begin());
        bench.settle();
    }
}

#[test]
fn an_overrun_is_counted_from_the_next_period() {
    let bench = Bench::started(devices());
    let registers = bench.registers;
    let state = PositionState::new();
    let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    let mut control = Control::new(registers, ZEROS, encoder, &state);
    registers.tim3.sr().write(|_| ());
    registers.tim3.cnt().write(|w| w.set_cnt(77));
    assert_eq!(control.overrun_ticks(NOW, nucleo_g474re::CLOCK.control_ticks), 0);
    registers.tim3.sr().write(|w| w.set_uif(true));
    assert_eq!(control.overrun_ticks(NOW, nucleo_g474re::CLOCK.control_ticks), 77);
    registers.tim3.cnt().write(|w| w.set_cnt(0));
    assert_eq!(control.overrun_ticks(NOW, nucleo_g474re::CLOCK.control_ticks), 1);
}

#[test]
fn the_watchdog_is_fed_only_when_both_interrupts_ran() {
    let registers = Bench::started(devices()).registers;
    // SAFETY: KR is word 0 of the watchdog's block of memory.
    let fed = || unsafe { registers.iwdg.as_ptr().cast::<u32>().replace(0) == 0xAAAA };
    assert!(fed(), "at its start");
    let pulse = Pulse::new();
    for (control, pwm, food) in [
        (false, false, false),
        (true, false, false),
        (true, false, false),
        (false, true, true),
        (false, true, false),
    ] {
        if control {
            pulse.control_ran();
        }
        if pwm {
            pulse.pwm_ran();
        }
        pulse.feed_if_both_ran(&registers);
        assert_eq!(fed(), food, "{control} {pwm}");
    }
}

/// An encoder whose index is at count 0, turning by `step` counts a control period from `from` on, 2,500 counts in all.
fn turn(encoder: &mut Encoder, registers: &Registers, from: i32, step: i32, slip: i32) {
    let (mut before, mut right) = (from, false);
    for period in 1..=2_500 / step.abs() {
        let now = from + period * step;
        let passed = now.div_euclid(4_096) != before.div_euclid(4_096);
        // The index sets the count right, whatever was lost until then.
        right |= passed;
        let count = now.rem_euclid(4_096) + if right { 0 } else { slip };
        registers.tim4.cnt().write(|w| w.set_cnt(count.rem_euclid(4_096) as u16));
        control_update(registers);
        registers.tim4.sr().write(|w| w.set_idxif(passed));
        encoder.angle();
        before = now;
    }
}

#[test]
fn an_index_must_find_the_count_where_it_is_expected() {
    for (step, slip, lost) in [
        (41, 0, false),
        (-41, 0, false),
        (7, 5, false),
        (41, 40, true),
        (-41, -40, true),
        (41, -2_000, true),
        (3, 9, true),
        (20, 12, true),
    ] {
        let registers = Bench::started(devices()).registers;
        let mut encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
        registers.tim4.sr().write(|_| ());
        assert_eq!(encoder.angle(), None, "no index yet");
        registers.tim4.sr().write(|w| w.set_idxif(true));
        registers.tim4.cnt().write(|w| w.set_cnt(2_000));
        control_update(&registers);
        assert_eq!(encoder.angle(), None, "its count may be older than the index");
        assert!(!registers.tim4.sr().read().idxif(), "acknowledged");
        assert!(encoder.angle().is_some());
        turn(&mut encoder, &registers, 2_000, step, slip);
        assert_eq!(encoder.is_lost(), lost, "{step} {slip}");
    }
}

#[test]
fn what_holds_the_gates_has_a_name() {
    type Spoil = fn(&Registers);
    let broken: Spoil = |registers| registers.legs.tim8.sr().write(|w| w.set_bif(0, true));
    let cases: [(&str, Spoil, bool, Option<Fault>); 6] = [
        ("nothing", |_| (), true, None),
        ("the ready line", broken, false, Some(Fault::GateDriver)),
        ("a comparator", broken, true, Some(Fault::HardwareOvercurrent)),
        (
            "the crystal",
            |registers| registers.legs.tim1.sr().write(|w| w.set_sbif(true)),
            true,
            Some(Fault::ClockFailure),
        ),
        (
            "a late interrupt",
            |registers| {
                registers.legs.trip_by(SoftwareBreak::Late);
                registers.legs.tim1.sr().write(|w| w.set_bif(0, true));
            },
            true,
            Some(Fault::PwmDeadline),
        ),
        (
            "the drive itself",
            |registers| {
                registers.legs.trip_by(SoftwareBreak::Drive);
                registers.legs.tim1.sr().write(|w| w.set_bif(0, true));
                registers.legs.trip_by(SoftwareBreak::Late);
            },
            true,
            None,
        ),
    ];
    for (what, spoil, ready, fault) in cases {
        let bench = Bench::started(devices());
        let registers = bench.registers;
        let state = PositionState::new();
        let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
        let mut control = Control::new(registers, ZEROS, encoder, &state);
        drivers_ready(&registers, ready);
        spoil(&registers);
        bench.finish_sequence(registers.adc1);
        assert_eq!(control.sample(NOW).hardware, fault, "{what}");
    }
}
