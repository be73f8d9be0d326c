//! Arbitrary inputs to both drives: any words as measurements and demands, interrupts in any order. No panic, no NaN or infinity in a report, no illegal gate
//! state, no pulses with a fault, no compare value out of its range, no half of a length that the timer cannot count, no link shorted for longer than
//! was asked for.

use crate::bytes::Bytes;
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

/// An interrupt, and what is wrong with its samples: a field and the bits that it has.
#[derive(Clone, Copy, Debug)]
pub enum Call {
    /// Control's.
    Control(Option<(u8, u32)>),
    /// The PWM timer's.
    Pwm(Option<(u8, u32)>),
    /// The revision that control requests at the beginning of its interrupt, whether it wants one or not.
    Revise,
    /// The operator acknowledges, whatever the state; then as [`Call::Healthy`].
    Acknowledge(u16),
    /// Both in their order, so many of them.
    Healthy(u16),
    /// The same with the samples of both spoilt.
    Spoilt((u8, u32), u16),
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
    /// With the largest shoot-through duty that it may have.
    periods: Option<(PlayedPeriod, f32)>,
    entered: bool,
    trip: Option<Trip>,
    /// A NaN or infinity in a report without a fault.
    odd: Option<String>,
    /// The newest shoot-through duties that control gave: as many as its mailbox keeps.
    duties: [f32; 2],
}

impl Call {
    /// The number of interrupts in the regular order.
    fn count(self) -> u16 {
        match self {
            Self::Healthy(count) | Self::Acknowledge(count) | Self::Spoilt(_, count) => count,
            Self::Control(_) | Self::Pwm(_) | Self::Revise => 0,
        }
    }

    /// Spoils the board, or acknowledges, before its interrupts.
    fn prepare(self, board: &mut Board) {
        board.acknowledge = board.acknowledge.wrapping_add(u8::from(matches!(self, Self::Acknowledge(_))));
        board.spoilt = match self {
            Self::Control(spoilt) | Self::Pwm(spoilt) => spoilt,
            Self::Spoilt(spoilt, _) => Some(spoilt),
            Self::Revise | Self::Acknowledge(_) | Self::Healthy(_) => None,
        };
    }
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
            duties: [0.0; 2],
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

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> Report) {
        let report = report();
        let Report { torque_nm, id_a, iq_a, voltage_v, omega, map_error, .. } = report;
        self.see(&[torque_nm, id_a, iq_a, voltage_v, omega, map_error], report.trip, &report);
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

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> DualReport) {
        let report = report();
        let DualReport { torque_nm: [t1, t2], voltage_v: [v1, v2], duty, inductor_ref_a, .. } = report;
        self.see(&[t1, t2, v1, v2, duty, inductor_ref_a], report.trip, &report);
        self.duties.rotate_right(1);
        self.duties[0] = duty;
    }
}

impl PwmPort<Dual> for Board {
    fn sample(&mut self, now: Instant) -> PowerSample {
        let mut sample = PowerSample {
            currents_a: [currents(self.omega, now.0, Dq { d: -5.0, q: 25.0 }); 2],
            capacitor_v: 533.5,
            source_v: 400.0,
            // Each gate is reported to have been on and off.
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
        self.periods = Some((*next, self.duties.into_iter().fold(0.0, f32::max)));
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.entered = false;
        true
    }
}

/// Shortest pulse of the two-level inverter's devices, in ticks; a carrier half may hold half of it.
const MIN_PULSE_TICKS: u32 = 250;
const DEAD_TIME_TICKS: u32 = 100;
/// The longest half that a 16-bit timer of the board's clock could count is shorter than this; none may stop the drive for longer.
const LONGEST_HALF_TICKS: u32 = 100_000;

fn check_half(board: &Board, trip: Option<Trip>, pwm_trip: Option<Trip>) {
    assert!(board.odd.is_none(), "{:?}", board.odd);
    let Some(half) = board.played else { return };
    let period = half.period_ticks;
    assert!((CLOCK.control_ticks..=LONGEST_HALF_TICKS).contains(&period), "{half:?}");
    assert!(pwm_trip.is_none() || half.mode == Mode::Off, "pulses with {pwm_trip:?}");
    assert!(!board.entered || trip.is_some() || pwm_trip.is_some(), "safe state without a fault: {half:?}");
    for compare in half.compare_ticks {
        // Against the dead time, an edge is commanded earlier.
        let whole = (MIN_PULSE_TICKS / 2 - DEAD_TIME_TICKS..=period - MIN_PULSE_TICKS / 2).contains(&compare);
        assert!(whole || compare == 0 || compare >= period, "{half:?}");
    }
}

/// The two-level inverter's interrupts from an instant on, at an electrical speed in rad/s.
pub fn check_traction(omega: f32, first: u32, calls: &[Call]) {
    let devices = SwitchLimits::new(MIN_PULSE_TICKS, DEAD_TIME_TICKS, 900.0, &CLOCK);
    let settings = traction::Settings::new(CLOCK, devices);
    let shared = traction::Shared::new();
    let mut control = traction::ControlTask::new(&BUILT_IN, settings, Instant(first).after(2_500));
    let mut pwm =
        traction::PwmTask::new(&BUILT_IN, settings, Instant(first).after(devices.shortest_half_ticks));
    let mut board = Board::new(omega);
    for call in calls {
        call.prepare(&mut board);
        match call {
            Call::Control(_) => control.run(&mut board, &shared),
            Call::Pwm(_) => {
                pwm.run(&mut board, &shared);
            }
            Call::Revise => pwm.revise(&mut board, &shared),
            Call::Healthy(_) | Call::Acknowledge(_) | Call::Spoilt(..) => {}
        }
        for _ in 0..call.count() {
            if control.next_call().reached(pwm.next_call()) {
                pwm.run(&mut board, &shared);
            } else {
                control.run(&mut board, &shared);
            }
            check_half(&board, control.trip(), pwm.trip());
        }
        check_half(&board, control.trip(), pwm.trip());
    }
}

/// A carrier period of the ZS9 in steps of the compare units: no leg whose node has no potential, and the link not shorted for longer than asked for.
fn check_period(played: &PlayedPeriod, half: u32, duty: f32) {
    // Between two edges nothing changes.
    let mut edges: Vec<u32> = played.gates.iter().flat_map(|gate| [gate.off_from, gate.off_to]).collect();
    assert!(edges.iter().all(|edge| *edge <= half), "{played:?}");
    edges.extend([0, half]);
    edges.sort_unstable();
    let mut shorted = 0;
    for span in edges.windows(2).filter(|span| span[0] < span[1]) {
        let legs = [0, 1, 2].map(|leg| {
            let [high, middle, low] = [0, 3, 6].map(|row| played.gates[row + leg].is_on(span[0]));
            LegState::of_gates(high, middle, low)
        });
        assert!(legs.iter().all(Option::is_some), "step {}: {played:?}", span[0]);
        if legs.contains(&Some(LegState::ShootThrough)) {
            shorted += span[1] - span[0];
        }
    }
    // Each of the six ends of a shoot-through is rounded to a step.
    assert!(
        f64::from(shorted) <= f64::from(duty) * f64::from(half) + 6.0,
        "{shorted} of {half}, {duty}: {played:?}"
    );
}

/// The ZS9's interrupts, with a carrier of so many ticks.
pub fn check_zs9(omega: f32, carrier_ticks: u32, calls: &[Call]) {
    let settings = dual::Settings::new(CLOCK, carrier_ticks, &zs9::BUILT_IN);
    let half = settings.half_steps();
    let shared = dual::Shared::new();
    let mut control = dual::ControlTask::new(&zs9::BUILT_IN, settings);
    let mut pwm = dual::PwmTask::new(&zs9::BUILT_IN, settings);
    let mut board = Board::new(omega);
    for call in calls {
        call.prepare(&mut board);
        for _ in 0..call.count().max(1) {
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
            assert!(board.odd.is_none(), "{:?}", board.odd);
            assert!(
                !board.entered || control.trip().is_some() || pwm.trip().is_some(),
                "gates held without a fault"
            );
            let Some((played, duty)) = &board.periods else { continue };
            if *played != PlayedPeriod::off(half) {
                assert!(pwm.trip().is_none(), "pulses with {:?}", pwm.trip());
                assert!(*duty <= settings.limits.duty_max, "{duty}");
                check_period(played, half, *duty);
            }
        }
    }
}

/// Any bytes: the system, its speed, the instant or the carrier, then calls.
pub fn check(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let (Some(system), Some(omega), Some(first)) = (bytes.byte(), bytes.short(), bytes.word()) else {
        return;
    };
    let share = f32::from(omega as i16) / f32::from(i16::MAX);
    let calls = calls(&mut bytes);
    match system % 4 {
        0 => check_zs9(700.0 * share, 2_500, &calls),
        1 => check_zs9(700.0 * share, 1_250, &calls),
        _ => check_traction(2_600.0 * share, first, &calls),
    }
}

/// Calls of any bytes, at most so many interrupts.
fn calls(bytes: &mut Bytes) -> Vec<Call> {
    const MOST: u16 = 4_000;
    let mut left = MOST;
    let mut next = || {
        let call = match bytes.byte()? % 8 {
            0 => Call::Control(spoilt(bytes)),
            1 => Call::Pwm(spoilt(bytes)),
            2 => Call::Revise,
            3 => Call::Acknowledge((bytes.byte()? % 8).into()),
            4 => Call::Healthy(bytes.short()? % 1_000),
            5 => Call::Healthy((bytes.byte()? % 32).into()),
            _ => Call::Spoilt(spoilt(bytes)?, (bytes.byte()? % 16).into()),
        };
        left = left.checked_sub(call.count().max(1))?;
        Some(call)
    };
    std::iter::from_fn(&mut next).collect()
}

/// A field, and its bits: one of the odd numbers, one of a usual size, or any.
fn spoilt(bytes: &mut Bytes) -> Option<(u8, u32)> {
    let kind = bytes.byte()?;
    let bits = match kind >> 4 {
        0..4 => ODD[usize::from(bytes.byte()?) % ODD.len()].to_bits(),
        4..8 => (f32::from(bytes.short()? as i16) * 0.1).to_bits(),
        8..12 => bytes.short()?.into(),
        _ => bytes.word()?,
    };
    Some((kind & 15, bits))
}

/// Numbers that are likely to cause trouble.
pub const ODD: [f32; 8] = [0.0, -0.0, 1e-38, 1e38, -1e38, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
