//! The guide's table of latencies against the code, on this board and in QEMU.

use nucleo_g474re::built_in::traction::BUILT_IN;
use nucleo_g474re::power_stage::{CORE_HZ, POWER_STAGE, cycles_to_ticks, ns_to_cycles};
use nucleo_g474re::{PRESCALER, sampling};
use std::path::Path;
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierHalf, Mode, SwitchLimits};
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

/// A machine at rest, which is enabled at one sample.
struct Bench {
    clock: Clock,
    enabled_at: Instant,
    /// Length of the half that begins at the boundary that is served.
    running_ticks: u32,
    next_ticks: u32,
    /// The instant at which the first half with pulses begins.
    pulses_at: Option<Instant>,
}

impl ControlPort for Bench {
    fn sample(&mut self, now: Instant) -> Sample {
        // Slowly turning, so that the speed is known.
        let turns = f64::from(now.0) / f64::from(self.clock.ticks_per_s) * 2.0;
        let angle = Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u32);
        Sample {
            currents_a: Abc::default(),
            udc_v: 1_500.0,
            angle: Some(angle),
            may_pulse: true,
            hardware: None,
        }
    }

    fn command(&mut self, now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        DriveCommand { enable: now.reached(self.enabled_at), ..DriveCommand::NONE }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> Report) {
        assert_eq!(report().trip, None);
    }
}

impl PwmPort for Bench {
    fn sample(&mut self, _now: Instant) -> Abc {
        Abc::default()
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        self.running_ticks = self.next_ticks;
        self.next_ticks = next.period_ticks;
        if next.mode != Mode::Off && self.pulses_at.is_none() {
            self.pulses_at = Some(now.after(self.running_ticks));
        }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}
}

/// Ticks from a sample at which the gates are enabled to the first half with pulses: least and most over the carrier's phases, with
/// the shortest half.
fn measured(clock: Clock, min_pulse_ticks: u32, dead_time_ticks: u32) -> [u32; 3] {
    let max_hz = BUILT_IN.ratings.max_switching_hz;
    let devices = SwitchLimits::new(min_pulse_ticks, dead_time_ticks, max_hz, &clock);
    let first = devices.shortest_half_ticks;
    let settings = Settings::new(clock, devices);
    let (mut least, mut most) = (u32::MAX, 0);
    for phase in 0..100 {
        let shared = Shared::new();
        let mut control = ControlTask::new(&BUILT_IN, settings, Instant(clock.control_ticks));
        let mut pwm = PwmTask::new(&BUILT_IN, settings, Instant(first));
        let enabled_at = Instant(clock.control_ticks * (400 + phase));
        let mut bench = Bench { clock, enabled_at, running_ticks: first, next_ticks: first, pulses_at: None };
        while bench.pulses_at.is_none() {
            if control.next_call().reached(pwm.next_call()) {
                pwm.run(&mut bench, &shared);
            } else {
                control.run(&mut bench, &shared);
            }
        }
        let took = bench.pulses_at.unwrap().since(enabled_at) as u32;
        (least, most) = (least.min(took), most.max(took));
    }
    [first, least, most]
}

#[test]
fn the_latency_is_what_the_guide_says() {
    let board = nucleo_g474re::CLOCK;
    let ticks = |ns| cycles_to_ticks(ns_to_cycles(ns), PRESCALER);
    let on_board = measured(board, ticks(POWER_STAGE.min_pulse_ns), ticks(POWER_STAGE.dead_time_ns));
    // QEMU's clock; 10 µs is the rig's shortest pulse.
    let emulated = Clock::new(25_000_000, 2_500);
    let in_qemu = measured(emulated, 250, 0);
    let microseconds = |ticks: u32| f64::from(ticks) / f64::from(board.ticks_per_s) * 1e6;
    let both = |ticks: u32| format!("{:.1} µs, {ticks} ticks", microseconds(ticks));
    let nanoseconds = |clock: &Clock| format!("{:.2} ns", 1e9 / f64::from(clock.ticks_per_s));
    let conversions_us = f64::from(4 * sampling::CONVERSION_CYCLES) / f64::from(CORE_HZ) * 1e6;
    let mut rows = vec![
        format!("| a tick | {} | {} |", nanoseconds(&board), nanoseconds(&emulated)),
        format!("| conversions | {conversions_us:.1} µs | 0 ticks |"),
        format!(
            "| sample to valid command | {} | {} ticks |",
            both(board.control_ticks),
            emulated.control_ticks
        ),
    ];
    let names = ["shortest carrier half", "sample to first pulse, least", "sample to first pulse, most"];
    for ((name, board), qemu) in names.into_iter().zip(on_board).zip(in_qemu) {
        rows.push(format!("| {name} | {} | {qemu} ticks |", both(board)));
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/latency.md");
    let text = std::fs::read_to_string(page).unwrap();
    let section = text.split("\n## ").next().unwrap();
    let told: Vec<_> = section.lines().filter(|line| line.starts_with("| ")).skip(1).collect();
    assert_eq!(told, rows, "the table should be:\n{}", rows.join("\n"));
}
