//! A short drive of each image: what no other place can show of it. The images are those which `TRACTIVE_NUCLEO_IMAGE` and
//! `TRACTIVE_NUCLEO_ZS9_IMAGE` name.

mod prepared;

use prepared::{is_sound, prepared};
use tractive_rig::talk::System;
use tractive_twin::core::cpu::{Cpu, Longest};
use tractive_twin::image::Image;
use tractive_twin::instants::{Instants, Range};
use tractive_twin::run::drive;
use tractive_twin::time::{MILLISECOND, SECOND, Time};

/// Charged at once, enabled, pulling.
const SCRIPT: &str = "\
0.10 charge
0.26 enable
0.31 torque 300 over 0.05
0.66 expect state running
     expect fault none
0.66 end
";
const SCRIPT_ZS9: &str = "\
0.10 charge
0.26 enable
0.56 torque 20 -20 over 0.05
0.76 expect state running
     expect fault none
0.76 end
";
/// A cycle of the core.
const CYCLE: Time = SECOND / 170_000_000;
/// The control interrupts of the PMaSynRM and of the ZS9 and the PWM's, as exceptions.
const CONTROL: usize = 45;
const CONTROL_ZS9: usize = 44;
const PWM: usize = 41;

fn driven(system: System, mistake: Option<fn(u32, u32) -> u32>) -> (Cpu, Image) {
    let (_, mut cpu, image) = prepared(system, [SCRIPT, SCRIPT_ZS9], mistake);
    cpu.count_waits().unwrap();
    drive(&mut cpu).unwrap();
    is_sound(&cpu);
    (cpu, image)
}

/// The instants of a converter, which has converted.
fn instants(cpu: &Cpu, number: usize) -> Instants {
    let machine = cpu.machine();
    let adc = &machine.chip.adcs[number];
    let told = Instants::of(adc.name(), &adc.samplings, &machine.world.edges);
    println!("{told}");
    assert!(told.sequences > 1_000, "{told}");
    told
}

/// So many cycles, always.
fn always(cycles: Time) -> Range {
    Range { least: cycles * CYCLE, most: cycles * CYCLE }
}

/// The ends of a sequence's samplings, in cycles: 12.5 cycles to sample and 12.5 to convert, of a clock of a quarter of the core's.
fn ends(count: usize) -> Vec<Range> {
    (0..count as Time).map(|rank| always(50 + 100 * rank)).collect()
}

/// No gate is on, and no contactor, resistor or chopper switched, before it is commanded.
fn nothing_is_driven_before(cpu: &Cpu, charged: Time, enabled: Time) {
    let world = &cpu.machine().world;
    let (gate, line) = (world.edges[0], world.line_edges[0]);
    assert!(world.edges.len() > 1_000 && gate.at > enabled && gate.on, "{gate:?}");
    assert!(line.at > charged && line.on, "{line:?}");
}

/// The stack stays far from what has a place of its own.
fn the_stack_suffices(cpu: &Cpu, image: &Image) {
    let room = cpu.stack_room(image.statics_end);
    let used = cpu.stack_bytes(image.statics_end).unwrap();
    assert!(used > 500 && used < room / 16, "{used} bytes of {room}");
}

/// Each interrupt ends before its deadline, in cycles, with every wait state and those of the tables; and the PWM's preempts everything: it comes
/// after the block of instructions that is running.
fn interrupts_are_in_time(cpu: &Cpu, deadlines: &[(usize, u64)]) {
    for (exception, deadline) in deadlines {
        let longest = cpu.longest[exception];
        println!("{exception}: {longest:?}");
        let Longest { cycles, prefetched, waited } = longest;
        assert!(
            cycles > 500 && prefetched > 500 && (cycles.max(prefetched)..*deadline).contains(&waited),
            "{exception}: {longest:?}"
        );
    }
    let waited = cpu.machine().nvic.waited(PWM);
    assert!(waited < 170 * CYCLE, "{} cycles", waited / CYCLE);
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn the_pmasynrm_s_image_is_in_order() {
    let (cpu, image) = driven(System::Pmasynrm, None);
    nothing_is_driven_before(&cpu, 100 * MILLISECOND, 260 * MILLISECOND);
    the_stack_suffices(&cpu, &image);
    // Control until its next call, the PWM's until the next boundary: half a carrier period at 900 Hz.
    interrupts_are_in_time(&cpu, &[(CONTROL, 17_000), (PWM, 94_000)]);
    let [control, pwm] = [0, 1].map(|number| instants(&cpu, number));
    // At the control timer's update, each 100 µs.
    assert_eq!((&control.apart, &control.ends), (&always(17_000), &ends(4)), "{control}");
    // At each boundary of the carrier: whole ticks of eight cycles apart.
    assert_eq!(pwm.ends, ends(4), "{pwm}");
    assert!(pwm.apart.least > 0 && pwm.apart.least.is_multiple_of(8 * CYCLE), "{pwm}");
    assert!(pwm.apart.most < MILLISECOND && pwm.apart.most.is_multiple_of(8 * CYCLE), "{pwm}");
    // In asynchronous modulation a boundary lies in the middle of a zero vector.
    assert_eq!(pwm.edged, 0, "{pwm}");
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn the_zs9_s_image_is_in_order() {
    let (cpu, image) = driven(System::Zs9, None);
    nothing_is_driven_before(&cpu, 100 * MILLISECOND, 260 * MILLISECOND);
    the_stack_suffices(&cpu, &image);
    // Both until the carrier's next valley or peak.
    interrupts_are_in_time(&cpu, &[(CONTROL_ZS9, 8_500), (PWM, 8_500)]);
    for (number, count) in [4, 4, 1].into_iter().enumerate() {
        let told = instants(&cpu, number);
        // At every valley and every peak, and in no edge of a gate.
        assert_eq!((&told.apart, &told.ends), (&always(8_500), &ends(count)), "{told}");
        assert_eq!(told.edged, 0, "{told}");
    }
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn a_longer_sampling_time_is_seen() {
    // SMPR1 of ADC2, channel 4: 24.5 cycles, not 12.5.
    let longer = |address, value| match address {
        0x5000_0114 => value & !(7 << 12) | 3 << 12,
        _ => value,
    };
    let (cpu, _) = driven(System::Pmasynrm, Some(longer));
    assert_ne!(instants(&cpu, 1).ends, ends(4));
}
