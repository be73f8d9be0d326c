//! Anything into both drives: any words for measurements and demands, interrupts in any order. No panic, no number that is none in a
//! report, no gate state that is not legal, no pulses with a fault, no half of a length that the timer cannot count.
//!
//! `TRACTIVE_FUZZ_CASES=100000 cargo test --release --test fuzz` tries longer.

use proptest::prelude::*;
use tractive::built_in::{traction::BUILT_IN, zs9};
use tractive::control::Demand;
use tractive::drive::dual::{self};
use tractive::drive::traction;
use tractive::frames::{Abc, Angle, Dq};
use tractive::modulation::{CarrierHalf, Mode, SwitchLimits};
use tractive::nine_switch::{LegState, Scheme};
use tractive::ports::DualReport;
use tractive::ports::Report;
use tractive::ports::{
    ControlPort, DriveCommand, Dual, DualDriveCommand, DualSample, GateFeedback, MotorDemand, PlayedPeriod,
    PowerSample, PwmPort, Sample,
};
use tractive::protection::{Fault, SafeState, Trip};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

fn config() -> ProptestConfig {
    let cases =
        std::env::var("TRACTIVE_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(1_000);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// An interrupt, and what is wrong with its samples: a field and the bits that it has.
#[derive(Clone, Copy, Debug)]
enum Call {
    Control(Option<(u8, u32)>),
    Pwm(Option<(u8, u32)>),
    /// The revision that control asks for first thing in its interrupt, whether it wants it or not.
    Revise,
    /// The operator acknowledges, whatever there is; then as [`Call::Healthy`].
    Acknowledge(u16),
    /// Both in their order, so many of them.
    Healthy(u16),
    /// The same with the samples of both spoilt.
    Spoilt((u8, u32), u16),
}

/// Bits of a number: any at all, or one that is likely to matter.
fn bits() -> impl Strategy<Value = u32> {
    prop_oneof![
        any::<u32>(),
        prop::sample::select(vec![
            0.0_f32,
            -0.0,
            1e-38,
            1e38,
            -1e38,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY
        ])
        .prop_map(f32::to_bits),
        (-2e3_f32..2e3).prop_map(f32::to_bits),
    ]
}

fn call() -> impl Strategy<Value = Call> {
    let spoilt = || prop::option::of((0..16_u8, bits()));
    prop_oneof![
        1 => spoilt().prop_map(Call::Control),
        1 => spoilt().prop_map(Call::Pwm),
        1 => Just(Call::Revise),
        6 => (0..8_u16).prop_map(Call::Acknowledge),
        4 => prop_oneof![3 => 1..20_u16, 1 => 300..900_u16].prop_map(Call::Healthy),
        6 => ((0..16_u8, bits()), 1..12_u16).prop_map(|(spoilt, calls)| Call::Spoilt(spoilt, calls)),
    ]
}

/// Mostly a drive that has pulsed for a while before anything befalls it.
fn calls() -> impl Strategy<Value = Vec<Call>> {
    (prop_oneof![1 => Just(0_u16), 3 => Just(900)], prop::collection::vec(call(), 1..30)).prop_map(
        |(before, mut calls)| {
            calls.insert(0, Call::Healthy(before));
            calls
        },
    )
}

fn angle(omega: f32, at: u32) -> Angle {
    let turns = f64::from(omega) * f64::from(at) / 25e6 / std::f64::consts::TAU;
    Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32)
}

fn currents(omega: f32, at: u32, current: Dq) -> Abc {
    let ripple = (at % 7919) as f32 * 1e-4;
    (current + Dq { d: ripple, q: -ripple }).unpark(angle(omega, at).sin_cos()).abc()
}

/// Timers, converters and gates of either drive.
struct Board {
    omega: f32,
    spoilt: Option<(u8, u32)>,
    acknowledge: u8,
    played: Option<CarrierHalf>,
    periods: Option<PlayedPeriod>,
    entered: bool,
    trip: Option<Trip>,
    /// A number that is none in a report without a fault.
    odd: Option<String>,
}

impl Board {
    fn new(omega: f32) -> Self {
        Self {
            omega,
            spoilt: None,
            acknowledge: 0,
            played: None,
            periods: None,
            entered: false,
            trip: None,
            odd: None,
        }
    }

    fn see(&mut self, numbers: &[f32], trip: Option<Trip>, report: &dyn std::fmt::Debug) {
        self.trip = trip;
        if trip.is_none() && !numbers.iter().all(|number| number.is_finite()) {
            self.odd = Some(format!("{report:?}"));
        }
    }
}

impl ControlPort for Board {
    fn sample(&mut self, now: Instant) -> Sample {
        let mut sample = Sample {
            currents_a: currents(self.omega, now.0, Dq { d: -30.0, q: 40.0 }),
            udc_v: 1500.0,
            angle: Some(angle(self.omega, now.0)),
            may_pulse: true,
            hardware: None,
        };
        let Some((field, bits)) = self.spoilt else { return sample };
        let value = f32::from_bits(bits);
        match field {
            0 => sample.currents_a.a = value,
            1 => sample.currents_a.b = value,
            2 => sample.currents_a.c = value,
            3 => sample.udc_v = value,
            4 => sample.angle = (bits % 5 != 0).then_some(Angle(bits)),
            9 => sample.hardware = Fault::from_code(bits % 40),
            _ => {}
        }
        sample
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        let demand = Demand { torque_nm: 200.0, slew_limited: false };
        let acknowledge = self.acknowledge;
        let mut command = DriveCommand { enable: true, demand, acknowledge, ..DriveCommand::NONE };
        let Some((field, bits)) = self.spoilt else { return command };
        match field {
            5 => command.demand.torque_nm = f32::from_bits(bits),
            6 => command.demand.slew_limited = true,
            7 => command.enable = false,
            8 => command.acknowledge = bits as u8,
            _ => {}
        }
        command
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.spoilt.filter(|(field, _)| *field == 10).map_or(0, |(_, bits)| bits)
    }

    fn report(&mut self, _now: Instant, report: &Report) {
        let Report { torque_nm, id_a, iq_a, voltage_v, omega, map_error, .. } = *report;
        self.see(&[torque_nm, id_a, iq_a, voltage_v, omega, map_error], report.trip, report);
    }
}

impl PwmPort for Board {
    fn sample(&mut self, now: Instant) -> Abc {
        let mut sampled = currents(self.omega, now.0, Dq { d: -30.0, q: 40.0 });
        if let Some((field, bits)) = self.spoilt {
            match field % 3 {
                0 => sampled.a = f32::from_bits(bits),
                1 => sampled.b = f32::from_bits(bits),
                _ => sampled.c = f32::from_bits(bits),
            }
        }
        sampled
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.played = Some(*next);
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.entered = false;
        true
    }
}

impl ControlPort<Dual> for Board {
    fn sample(&mut self, now: Instant) -> DualSample {
        let mut sample = DualSample {
            currents_a: [currents(self.omega, now.0, Dq { d: -5.0, q: 25.0 }); 2],
            angles: [Some(angle(self.omega, now.0)); 2],
            capacitor_v: 533.5,
            inductor_a: 20.0,
            source_v: 400.0,
            may_pulse: true,
            hardware: None,
        };
        let Some((field, bits)) = self.spoilt else { return sample };
        let value = f32::from_bits(bits);
        match field {
            0 => sample.currents_a[0].a = value,
            1 => sample.currents_a[1].b = value,
            2 => sample.angles[0] = Some(Angle(bits)),
            3 => sample.angles[1] = None,
            4 => sample.capacitor_v = value,
            5 => sample.inductor_a = value,
            6 => sample.source_v = value,
            _ => {}
        }
        sample
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        let mut command = DualDriveCommand {
            enable: true,
            demands: [MotorDemand::Torque(Demand { torque_nm: 50.0, slew_limited: true }); 2],
            speed_torque_nm: DualDriveCommand::UNLIMITED_NM,
            link_ref_v: 667.0,
            acknowledge: self.acknowledge,
            ..DualDriveCommand::NONE
        };
        let Some((field, bits)) = self.spoilt else { return command };
        let value = f32::from_bits(bits);
        match field {
            7 => command.demands[0] = MotorDemand::Speed(value),
            8 => command.demands[1] = MotorDemand::Torque(Demand { torque_nm: value, slew_limited: false }),
            9 => command.link_ref_v = value,
            10 => command.scheme = Scheme::ALL[bits as usize % Scheme::ALL.len()],
            11 => command.enable = false,
            _ => {}
        }
        command
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.spoilt.filter(|(field, _)| *field == 12).map_or(0, |(_, bits)| bits)
    }

    fn report(&mut self, _now: Instant, report: &DualReport) {
        let DualReport { torque_nm: [t1, t2], voltage_v: [v1, v2], duty, inductor_ref_a, .. } = *report;
        self.see(&[t1, t2, v1, v2, duty, inductor_ref_a], report.trip, report);
    }
}

impl PwmPort<Dual> for Board {
    fn sample(&mut self, now: Instant) -> PowerSample {
        let mut sample = PowerSample {
            currents_a: [currents(self.omega, now.0, Dq { d: -5.0, q: 25.0 }); 2],
            capacitor_v: 533.5,
            source_v: 400.0,
            // Each gate has been on and off, as far as anybody asks.
            gates: GateFeedback { on: 0x1FF, off: 0x1FF },
        };
        let Some((field, bits)) = self.spoilt else { return sample };
        let value = f32::from_bits(bits);
        match field % 6 {
            0 => sample.currents_a[0].c = value,
            1 => sample.currents_a[1].a = value,
            2 => sample.capacitor_v = value,
            3 => sample.source_v = value,
            4 => sample.gates.on = bits as u16,
            _ => sample.gates.off = bits as u16,
        }
        sample
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.periods = Some(*next);
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.entered = false;
        true
    }
}

/// Longest half that a 16-bit timer of the board's clock could count is shorter; none may stop the drive for longer.
const LONGEST_HALF_TICKS: u32 = 100_000;

fn check_half(board: &Board, trip: Option<Trip>, pwm_trip: Option<Trip>) -> Result<(), TestCaseError> {
    prop_assert!(board.odd.is_none(), "{:?}", board.odd);
    let Some(half) = board.played else { return Ok(()) };
    prop_assert!(half.period_ticks >= 2 * CLOCK.control_ticks / 2, "{half:?}");
    prop_assert!(half.period_ticks <= LONGEST_HALF_TICKS, "{half:?}");
    prop_assert!(pwm_trip.is_none() || half.mode == Mode::Off, "pulses with {pwm_trip:?}");
    prop_assert!(
        !board.entered || trip.is_some() || pwm_trip.is_some(),
        "safe state without a fault: {half:?}"
    );
    Ok(())
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn traction_takes_anything(
        omega in prop_oneof![Just(0.0_f32), -2600.0_f32..2600.0],
        first in any::<u32>(),
        calls in calls(),
    ) {
        let devices = SwitchLimits::new(250, 100, 900.0, &CLOCK);
        let settings = traction::Settings::new(CLOCK, devices);
        let shared = traction::Shared::new();
        let mut control = traction::ControlTask::new(&BUILT_IN, settings, Instant(first).after(2_500));
        let mut pwm = traction::PwmTask::new(&BUILT_IN, settings, Instant(first).after(devices.shortest_half_ticks));
        let mut board = Board::new(omega);
        for call in calls {
            let healthy = if let Call::Healthy(count) | Call::Acknowledge(count) | Call::Spoilt(_, count) = call { count } else { 0 };
            board.acknowledge = board.acknowledge.wrapping_add(u8::from(matches!(call, Call::Acknowledge(_))));
            board.spoilt = match call { Call::Control(spoilt) | Call::Pwm(spoilt) => spoilt, Call::Spoilt(spoilt, _) => Some(spoilt), _ => None };
            match call {
                Call::Control(_) => control.run(&mut board, &shared),
                Call::Pwm(_) => {
                    pwm.run(&mut board, &shared);
                }
                Call::Revise => pwm.revise(&mut board, &shared),
                Call::Healthy(_) | Call::Acknowledge(_) | Call::Spoilt(..) => {}
            }
            for _ in 0..healthy {
                if control.next_call().reached(pwm.next_call()) {
                    pwm.run(&mut board, &shared);
                } else {
                    control.run(&mut board, &shared);
                }
                check_half(&board, control.trip(), pwm.trip())?;
            }
            check_half(&board, control.trip(), pwm.trip())?;
        }
    }

    #[test]
    fn the_zs9_takes_anything(
        omega in prop_oneof![Just(0.0_f32), -700.0_f32..700.0],
        carrier_ticks in prop::sample::select(vec![2_500_u32, 1_250]),
        calls in calls(),
    ) {
        let settings = dual::Settings::new(CLOCK, carrier_ticks);
        let half = settings.half_steps();
        let shared = dual::Shared::new();
        let mut control = dual::ControlTask::new(&zs9::BUILT_IN, settings);
        let mut pwm = dual::PwmTask::new(&zs9::BUILT_IN, settings);
        let mut board = Board::new(omega);
        for call in calls {
            let healthy = if let Call::Healthy(count) | Call::Acknowledge(count) | Call::Spoilt(_, count) = call { count } else { 1 };
            board.acknowledge = board.acknowledge.wrapping_add(u8::from(matches!(call, Call::Acknowledge(_))));
            board.spoilt = match call { Call::Control(spoilt) | Call::Pwm(spoilt) => spoilt, Call::Spoilt(spoilt, _) => Some(spoilt), _ => None };
            for _ in 0..healthy {
                match call {
                    Call::Control(_) => control.run(&mut board, &shared),
                    Call::Pwm(_) => {
                    pwm.run(&mut board, &shared);
                }
                    _ if control.next_call().reached(pwm.next_call()) => {
                    pwm.run(&mut board, &shared);
                }
                    _ => control.run(&mut board, &shared),
                }
                prop_assert!(board.odd.is_none(), "{:?}", board.odd);
                prop_assert!(!board.entered || control.trip().is_some() || pwm.trip().is_some(), "gates held without a fault");
                let Some(played) = &board.periods else { continue };
                let off = *played == PlayedPeriod::off(half);
                prop_assert!(off || pwm.trip().is_none(), "pulses with {:?}", pwm.trip());
                for step in (0..half).step_by(997) {
                    for leg in 0..3 {
                        let [high, middle, low] = [0, 3, 6].map(|row| played.gates[row + leg].is_on(step));
                        let legal = off || LegState::of_gates(high, middle, low).is_some();
                        prop_assert!(legal, "leg {leg}, step {step}: {high} {middle} {low}");
                    }
                }
            }
        }
    }
}
