//! The PMaSynRM's whole image on the board in memory, with a machine, an encoder, contactors and a vehicle's computer around it.

use crate::bench::{Bench, control_update, drivers_ready, turn_encoder, write_input};
use crate::bus::{Bus, Sender};
use crate::devices;
use nucleo_g474re::built_in::traction::BUILT_IN;
use nucleo_g474re::position::{Encoder, PositionState};
use nucleo_g474re::power_stage::{POWER_STAGE, PowerStage};
use nucleo_g474re::serve::Serve;
use nucleo_g474re::watchdog::Pulse;
use nucleo_g474re::{CLOCK, Control, Pwm, start};
use tractive::control::{flux_linkage, torque_nm};
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, AlphaBeta, Angle, Dq};
use tractive::modulation::{CarrierHalf, Mode};
use tractive::operator::{self, Configuration, Line, Refusal, Slot, State, slot_s};
use tractive::ports::PwmPort;
use tractive::protection::{Fault, SafeState};
use tractive::protocol::{
    COMMAND, CanEndpoint, Command, Frame, LIMITS, Payload, STATUS, Scales, StatusFrame, TO_DRIVE,
};
use tractive::time::Instant;

const SOURCE_V: f32 = 1_500.0;
/// Time constants of the line side, in s.
const PRECHARGE_S: f32 = 0.05;
const DISCHARGE_S: f32 = 0.1;
/// Time in which a contactor answers, in control periods.
const CONTACTOR_PERIODS: u64 = 200;
/// Longest time between two meals of the watchdog, in control periods: 20 ms.
const HUNGER: u64 = 200;
/// Ticks of a step of the machine, a whole number of them in a control period.
const STEP_TICKS: u64 = 25;
const _: () = assert!((CLOCK.control_ticks as u64).is_multiple_of(STEP_TICKS));

/// The rotor, its windings, and the encoder on its shaft.
struct Machine {
    /// Mechanical position from the index on, in turns; and speed, in r/min.
    turns: f64,
    rpm: f64,
    /// Electrical angle at the index.
    zero: Angle,
    /// Position at the last control period, and the counts of the encoder since the reset, or since the index set them to 0.
    counted: f64,
    count: f64,
    flux: AlphaBeta,
    current: Dq,
    /// Level of each leg, summed up over a step.
    levels: [u64; 3],
    pulsed: bool,
    /// Torque, in N·m, summed up over steps with pulses, and their number.
    torque_sum: f64,
    steps: u32,
}

impl Machine {
    fn angle(&self) -> Angle {
        let turns = self.turns * f64::from(BUILT_IN.ratings.pole_pairs);
        Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32) + self.zero
    }

    fn torque_nm(&self) -> f32 {
        torque_nm(&BUILT_IN, flux_linkage(&BUILT_IN, self.current), self.current)
    }

    /// Moves the shaft and the windings by a step: the legs make the flux, and the current is the one that has this flux on the machine's own map.
    fn step(&mut self, udc_v: f32, seconds: f32) {
        self.turns += self.rpm / 60.0 * f64::from(seconds);
        let frame = self.angle().sin_cos();
        let rest = flux_linkage(&BUILT_IN, Dq::default());
        if !self.pulsed {
            (self.flux, self.current) = (rest.unpark(frame), Dq::default());
            return;
        }
        let [u, v, w] = self.levels.map(|on| on as f32 / STEP_TICKS as f32 * udc_v);
        let voltage = Abc { a: u, b: v, c: w }.clarke();
        let resistive = self.current.unpark(frame) * BUILT_IN.ratings.stator_resistance_ohm;
        self.flux = self.flux + (voltage - resistive) * seconds;
        self.current = current_of(self.flux.park(frame), self.current);
        self.torque_sum += f64::from(self.torque_nm());
        self.steps += 1;
    }

    fn phases(&self) -> [f32; 3] {
        let Abc { a, b, c } = self.current.unpark(self.angle().sin_cos()).abc();
        [a, b, c]
    }
}

/// The current with a flux linkage on the map, by Newton's method from a current nearby.
fn current_of(flux: Dq, mut near: Dq) -> Dq {
    const STEP_A: f32 = 0.5;
    for _ in 0..2 {
        let here = flux_linkage(&BUILT_IN, near);
        let along_d = flux_linkage(&BUILT_IN, Dq { d: near.d - STEP_A, ..near });
        let along_q = flux_linkage(&BUILT_IN, Dq { q: near.q + STEP_A, ..near });
        let [dd, qd] = [(here.d - along_d.d) / STEP_A, (here.q - along_d.q) / STEP_A];
        let [dq, qq] = [(along_q.d - here.d) / STEP_A, (along_q.q - here.q) / STEP_A];
        let (off_d, off_q) = (flux.d - here.d, flux.q - here.q);
        let determinant = dd * qq - dq * qd;
        near.d += (qq * off_d - dq * off_q) / determinant;
        near.q += (dd * off_q - qd * off_d) / determinant;
    }
    near
}

/// The PWM interrupt's port, which lets the hardware act after each write. Status flags are cleared by writing 0 and left alone by writing 1,
/// and a break's flag stays set while its input is active (RM0440, TIMx_SR: rc_w0); an event acts before the next write. In plain memory a
/// flag would hold what was written, and an event would wait.
struct Port<'a> {
    pwm: &'a mut Pwm,
    bench: &'a mut Bench,
}

impl PwmPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> Abc {
        self.pwm.sample(now)
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        self.pwm.play(now, next);
        self.bench.settle();
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.pwm.enter(safe, now);
        self.bench.settle();
    }

    fn is_late(&mut self) -> bool {
        self.pwm.is_late()
    }

    fn leave(&mut self, now: Instant) -> bool {
        let left = self.pwm.leave(now);
        self.bench.settle();
        left && !self.bench.registers.legs.is_tripped()
    }
}

/// The status that the vehicle's computer has heard last.
type Heard = StatusFrame<Mode>;

struct Image {
    bench: Bench,
    machine: Machine,
    udc_v: f32,
    /// Precharge relay and main contactor: told, and since when.
    told: [(bool, Option<u64>); 2],
    drivers_ready: bool,
    /// The offset of the sensor of phase U, in A.
    offset_a: f32,
    shared: Shared<'static>,
    position: &'static PositionState,
    control: Control<'static, Encoder>,
    pwm: Pwm,
    control_task: ControlTask<&'static tractive::machine::Tables>,
    pwm_task: PwmTask<&'static tractive::machine::Tables>,
    serve: Serve<'static>,
    slot: Slot,
    pulse: Pulse,
    bus: Bus,
    commands: Sender,
    command: Command,
    heard: Option<Heard>,
    periods: u64,
    fed: u64,
    /// Control periods between two passes of the idle loop.
    idle_every: u64,
    /// `true` if the vehicle's computer is on the bus.
    speaks: bool,
    /// The frame that a babbling node sends as often as the bus carries it, and the control periods from one to the next.
    babble: Option<(Frame, u64)>,
}

impl Image {
    /// The image from a reset on, with the rotor at this position and speed.
    fn reset(turns: f64, rpm: f64, zero: Angle) -> Self {
        let mut bench = Bench::new();
        let registers = bench.registers;
        let found = start::prepare(&registers, &mut bench, devices()).unwrap();
        let bus = Bus::new(&TO_DRIVE, &registers, &mut bench);
        start::run(&registers, &mut bench);
        bench.settle();
        let position: &'static PositionState = Box::leak(Box::new(PositionState::new()));
        let stage = PowerStage { encoder_zero: zero, ..POWER_STAGE };
        let encoder = Encoder::new(registers.tim4, &stage, &BUILT_IN.ratings);
        let settings = Settings::new(CLOCK, devices());
        let station = CanEndpoint::new(&BUILT_IN.ratings);
        let mut image = Self {
            machine: Machine {
                turns,
                rpm,
                zero,
                counted: turns,
                count: 0.0,
                flux: AlphaBeta::default(),
                current: Dq::default(),
                levels: [0; 3],
                pulsed: false,
                torque_sum: 0.0,
                steps: 0,
            },
            udc_v: 0.0,
            told: [(false, None); 2],
            drivers_ready: true,
            offset_a: 0.0,
            shared: Shared::new(),
            position,
            control: Control::new(registers, found.control_zeros, encoder, position),
            pwm: Pwm::new(registers, found.pwm_zeros),
            control_task: ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks)),
            pwm_task: PwmTask::new(&BUILT_IN, settings, Instant(devices().shortest_half_ticks)),
            serve: Serve::new(registers, bus.can, station, position, Configuration::Good),
            slot: Slot::new(),
            pulse: Pulse::new(),
            bus,
            commands: Sender::of(&COMMAND),
            command: Command::AT_REST,
            heard: None,
            periods: 0,
            fed: 0,
            idle_every: 1,
            speaks: true,
            babble: None,
            bench,
        };
        image.wire();
        image
    }

    /// The inputs' levels, and the converters' codes.
    fn wire(&mut self) {
        let registers = self.bench.registers;
        let closed = |(told, since): (bool, Option<u64>)| {
            since.is_some_and(|since| told == (self.periods >= since + CONTACTOR_PERIODS))
        };
        let [precharge, main] = self.told.map(|contact| u32::from(closed(contact)));
        drivers_ready(&registers, self.drivers_ready);
        write_input(registers.gpioc, 1 << 2 | precharge << 4 | main << 5);
        self.bench.fault = [!self.drivers_ready; 2];
        self.sense();
    }

    /// The converters' codes.
    fn sense(&mut self) {
        let [u, v, w] = self.machine.phases();
        // Each current is wired to a pin of either converter.
        for (channels, current_a) in [([2, 4], u + self.offset_a), ([15, 7], v), ([5, 14], w)] {
            for channel in channels {
                self.bench.codes[channel] =
                    (2_048.0 + current_a / POWER_STAGE.current_a_per_code).round() as u16;
            }
        }
        self.bench.codes[6] = (self.udc_v / POWER_STAGE.udc_v_per_code).round() as u16;
    }

    /// The line side over a control period. Memory keeps only the last of several writes to a set-and-reset register, so the contactors follow
    /// the drive's own status here; the tests of the switchgear look at the pins.
    fn line(&mut self) {
        let [precharge, main, discharge] = self.heard.map_or([false; 3], |heard| heard.switches);
        for (contact, told) in self.told.iter_mut().zip([precharge, main]) {
            if contact.0 != told {
                *contact = (told, Some(self.periods));
            }
        }
        let (period_s, [precharge, main]) = (CLOCK.control_s(), [precharge, main]);
        if main {
            self.udc_v = SOURCE_V;
        } else if precharge {
            self.udc_v += (SOURCE_V - self.udc_v) * period_s / PRECHARGE_S;
        } else if discharge {
            self.udc_v -= self.udc_v * period_s / DISCHARGE_S;
        }
    }

    /// The timer that counts the shaft's encoder, at the end of a control period.
    fn turn(&mut self) {
        let before = core::mem::replace(&mut self.machine.counted, self.machine.turns);
        let turned = [before, self.machine.turns];
        let registers = self.bench.registers;
        turn_encoder(registers.tim4, POWER_STAGE.encoder_counts, turned, &mut self.machine.count);
        control_update(&registers);
    }

    /// A control period: the timers' ticks with the carrier's interrupts, the control interrupt, the idle loop.
    fn period(&mut self) {
        let mut phases = self.machine.phases();
        for tick in 1..=u64::from(CLOCK.control_ticks) {
            if self.bench.tick() {
                self.pwm.acknowledge();
                self.bench.settle();
                self.pwm.begin_half();
                self.bench.settle();
                self.sense();
                self.bench.finish_sequence(self.bench.registers.adc2);
                let mut port = Port { pwm: &mut self.pwm, bench: &mut self.bench };
                self.pwm_task.run(&mut port, &self.shared);
                self.pulse.pwm_ran();
                self.bench.settle();
            }
            for ((sum, leg), current_a) in self.machine.levels.iter_mut().zip(&self.bench.legs).zip(phases) {
                let (upper, lower) = leg.gates();
                self.machine.pulsed |= upper || lower;
                // During the dead time the current flows through its diode.
                *sum += u64::from(upper || !lower && current_a < 0.0);
            }
            if tick % STEP_TICKS == 0 {
                self.machine.step(self.udc_v, STEP_TICKS as f32 * CLOCK.tick_s);
                (self.machine.levels, self.machine.pulsed) = ([0; 3], false);
                phases = self.machine.phases();
            }
        }
        self.periods += 1;
        self.turn();
        self.line();
        self.wire();
        self.bench.settle();
        self.bench.finish_sequence(self.bench.registers.adc1);
        self.control_task.run(&mut self.control, &self.shared);
        self.pulse.control_ran();
        self.bench.settle();
        if let Some((frame, every)) = self.babble
            && self.periods.is_multiple_of(every)
        {
            self.bus.arrive(frame);
        }
        if self.speaks && self.periods.is_multiple_of(100) {
            let frame = self.commands.frame(self.command.encode(Scales::USUAL).unwrap());
            self.bus.arrive(frame);
        }
        if self.periods.is_multiple_of(self.idle_every) {
            self.idle();
        }
        assert!(self.periods < self.fed + HUNGER, "the watchdog bites");
    }

    fn idle(&mut self) {
        let line = Line::rated(&BUILT_IN.ratings, PRECHARGE_S, DISCHARGE_S);
        let rated = operator::Settings::rated(&BUILT_IN.ratings, slot_s(&CLOCK), Some(line));
        self.serve.pass(&mut self.slot, &self.shared.operator, &rated);
        if let Some(Frame { id, data, .. }) = self.bus.settle()
            && id == STATUS.id
        {
            self.heard = Some(StatusFrame::decode(Payload(u64::from_le_bytes(data))));
        }
        if self.pulse.feed_if_both_ran(&self.bench.registers) {
            self.fed = self.periods;
        }
    }

    fn run_ms(&mut self, ms: u64) {
        (0..ms * 10).for_each(|_| self.period());
    }

    fn state(&self) -> Option<State> {
        self.heard.and_then(|heard| heard.state)
    }

    /// Commands and waits for a state.
    fn until(&mut self, command: Command, wanted: State, ms: u64) {
        self.command = command;
        for _ in 0..ms {
            self.run_ms(1);
            if self.state() == Some(wanted) {
                return;
            }
        }
        panic!("{wanted:?} not reached: {:?}, {:?}", self.heard, self.control_task.trip());
    }

    fn fault(&self) -> Option<Fault> {
        self.heard.and_then(|heard| Fault::from_code(heard.fault.into()))
    }

    fn gates_are_off(&self) -> bool {
        self.bench.legs.iter().all(|leg| leg.gates() == (false, false))
    }
}

const REST: Command = Command::AT_REST;
const CHARGE: Command = Command { charge: true, ..REST };
const ENABLE: Command = Command { enable: true, ..REST };
const PULL: Command = Command { torque_nm: 200.0, ..ENABLE };
const ACKNOWLEDGE: Command = Command { acknowledge: true, ..REST };

/// From enable to torque.
fn pulls(image: &mut Image) {
    image.until(ENABLE, State::Enabled, 100);
    image.until(PULL, State::Running, 100);
    image.run_ms(100);
    (image.machine.torque_sum, image.machine.steps) = (0.0, 0);
    image.run_ms(40);
    let torque_nm = image.machine.torque_sum / f64::from(image.machine.steps);
    assert!((198.0..202.0).contains(&torque_nm), "{torque_nm} N·m");
}

/// A fault, which stays until it is acknowledged and cannot be acknowledged while its cause lasts; then torque again.
fn fails(image: &mut Image, fault: Fault, spoil: fn(&mut Image), mend: fn(&mut Image)) {
    spoil(image);
    image.run_ms(1);
    assert!(image.gates_are_off(), "{fault:?}");
    image.until(PULL, State::Fault, 30);
    assert_eq!(image.fault(), Some(fault));
    image.command = ACKNOWLEDGE;
    image.run_ms(50);
    let heard = image.heard.unwrap();
    assert_eq!((heard.state, heard.refusal), (Some(State::Fault), Some(Refusal::CauseStillPresent)));
    mend(image);
    image.command = PULL;
    image.run_ms(50);
    assert!(image.gates_are_off() && image.fault() == Some(fault), "until it is acknowledged");
    image.until(ACKNOWLEDGE, State::Ready, 300);
    assert_eq!(image.control_task.trip(), None);
    assert!(image.gates_are_off(), "and enabled");
    image.until(CHARGE, State::Charged, 2_000);
    pulls(image);
}

/// Everything that a drive does from its first enable on.
fn works(image: &mut Image) {
    pulls(image);
    fails(image, Fault::GateDriver, |image| image.drivers_ready = false, |image| image.drivers_ready = true);
    fails(image, Fault::PhaseSum, |image| image.offset_a = 30.0, |image| image.offset_a = 0.0);
    image.until(REST, State::Charged, 500);
    image.run_ms(2);
    assert!(image.gates_are_off() && image.fault().is_none());
}

#[test]
fn a_drive_that_is_reset_while_its_machine_turns_works() {
    for (rpm, zero) in [(1_500.0, Angle::ZERO), (-300.0, Angle::DEG_90), (600.0, Angle(0xB123_4567))] {
        let mut image = Image::reset(0.3, rpm, zero);
        image.until(REST, State::Ready, 200);
        image.until(CHARGE, State::Charged, 2_000);
        assert!(image.position.is_known());
        if rpm == 600.0 { works(&mut image) } else { pulls(&mut image) }
    }
}

#[test]
fn a_drive_that_is_reset_at_standstill_finds_its_angle() {
    for (turns, zero) in [(0.6, Angle::ZERO), (0.13, Angle::DEG_90)] {
        let mut image = Image::reset(turns, 0.0, zero);
        image.until(REST, State::Ready, 200);
        image.until(CHARGE, State::Charged, 2_000);
        assert!(!image.position.is_known() && image.position.is_counted());
        image.until(ENABLE, State::Enabled, 100);
        assert!(!image.position.is_known());
        image.run_ms(400);
        assert!(image.position.is_known() && !image.position.is_counted());
        pulls(&mut image);
        // The index passes under torque, and shows a little error.
        image.machine.rpm = 30.0;
        image.run_ms(2_000);
        assert_eq!((image.state(), image.fault()), (Some(State::Running), None));
        pulls(&mut image);
        image.until(REST, State::Charged, 500);
    }
}

/// Somebody pushes the vehicle while the drive waits for its rotor to stand still: the index comes, and with it the angle.
#[test]
fn a_drive_whose_machine_is_pushed_waits_for_its_index() {
    let mut image = Image::reset(0.6, 30.0, Angle::ZERO);
    image.until(REST, State::Ready, 200);
    image.command = CHARGE;
    image.run_ms(300);
    image.until(CHARGE, State::Charged, 2_000);
    image.until(ENABLE, State::Enabled, 100);
    image.run_ms(1_000);
    assert!(image.position.is_known());
    pulls(&mut image);
}

#[test]
fn an_idle_loop_that_is_slow_takes_torque_and_gates_in_time() {
    let mut image = Image::reset(0.3, 600.0, Angle::ZERO);
    image.until(REST, State::Ready, 200);
    image.until(CHARGE, State::Charged, 2_000);
    image.until(ENABLE, State::Enabled, 100);
    image.until(PULL, State::Running, 100);
    image.run_ms(100);
    (image.idle_every, image.speaks) = (50, false);
    let told = |image: &Image| image.shared.operator.observed().unwrap();
    let silent_ms = (0..1_000).find(|_| {
        image.run_ms(1);
        told(&image).report.torque_nm.abs() < 150.0
    });
    assert!((40..90).contains(&silent_ms.unwrap()), "torque after {silent_ms:?} ms");
    let off_ms = (silent_ms.unwrap()..2_000).find(|_| {
        image.run_ms(1);
        image.gates_are_off()
    });
    assert!((480..560).contains(&off_ms.unwrap()), "gates after {off_ms:?} ms");
}

#[test]
fn five_messages_back_to_back_are_all_taken() {
    use tractive::protocol::{LINK_LIMITS, LinkLimits, PARAMETER_REQUEST, ParameterRequest, TorqueLimits};
    let mut image = Image::reset(0.3, 600.0, Angle::ZERO);
    image.run_ms(20);
    let torque = TorqueLimits { motoring_nm: 500.0, braking_nm: 400.0, speed_rpm: 2_000.0 }
        .encode(Scales::USUAL)
        .unwrap();
    let link = LinkLimits { low_v: 1_100.0, high_v: 1_750.0 }.encode(Scales::USUAL).unwrap();
    let request = ParameterRequest { parameter: 3, write: None }.encode().unwrap();
    let mut senders = [&LIMITS, &LINK_LIMITS, &PARAMETER_REQUEST, &LIMITS, &LINK_LIMITS].map(Sender::of);
    for _ in 0..20 {
        let before = *image.serve.station.counts();
        // 111 bits each at 500 kbit/s, two control periods and a little.
        for (sender, content) in senders.iter_mut().zip([torque, link, request, torque, link]) {
            let frame = sender.frame(content);
            image.bus.arrive(frame);
            image.period();
            image.period();
        }
        image.run_ms(2);
        let counts = image.serve.station.counts();
        assert!(counts.received - before.received >= 5 && image.bus.lost == 0, "{counts:?}");
    }
}

/// Five frames of eight bytes in a millisecond, or ten without a byte: the most that 500 kbit/s carry, ahead of the vehicle's computer's.
#[test]
fn a_drive_on_a_bus_that_is_full_goes_on() {
    let mut image = Image::reset(0.3, 600.0, Angle::ZERO);
    image.until(REST, State::Ready, 200);
    image.until(CHARGE, State::Charged, 2_000);
    let stuck = Sender::of(&LIMITS).frame(Payload(1 << 16 | 1 << 32 | 1 << 48));
    let empty = Frame { length: 0, data: [0; 8], ..stuck };
    for (frame, every) in [(stuck, 2), (empty, 1)] {
        image.until(REST, State::Charged, 500);
        image.babble = Some((frame, every));
        pulls(&mut image);
        let before = image.serve.station.counts().received;
        image.run_ms(100);
        let received = image.serve.station.counts().received - before;
        // The vehicle's computer sends ten.
        assert!(u64::from(received).abs_diff(1_000 / every + 10) <= 11, "{received} frames");
        assert_eq!(image.bus.lost, 0);
        assert_eq!((image.state(), image.fault()), (Some(State::Running), None));
    }
}

#[test]
fn a_start_that_is_refused_is_told_on_the_bus_and_every_command_is_answered() {
    use nucleo_g474re::start::StartError;
    let mut image = Image::reset(0.3, 0.0, Angle::ZERO);
    let line = Line::rated(&BUILT_IN.ratings, PRECHARGE_S, DISCHARGE_S);
    let rated = operator::Settings::rated(&BUILT_IN.ratings, slot_s(&CLOCK), Some(line));
    let why = StartError::WatchdogReset.failed();
    let mut value = None;
    for (command, refusal) in [
        (REST, None),
        (ENABLE, Some(Refusal::FaultNotAcknowledged)),
        (CHARGE, Some(Refusal::FaultNotAcknowledged)),
        (ACKNOWLEDGE, Some(Refusal::CauseStillPresent)),
    ] {
        for slot in 0..200_u32 {
            if slot % 10 == 0 {
                let frame = image.commands.frame(command.encode(Scales::USUAL).unwrap());
                image.bus.arrive(frame);
            }
            image.serve.refuse(&mut image.slot, why, &rated);
            let Some(Frame { id, data, .. }) = image.bus.settle() else { continue };
            let payload = Payload(u64::from_le_bytes(data));
            if id == STATUS.id {
                image.heard = Some(StatusFrame::decode(payload));
            } else if id == tractive::protocol::FAULT_VALUE.id {
                value = tractive::protocol::trip_number(payload).1;
            }
        }
        let heard = image.heard.expect("it speaks");
        assert_eq!((heard.state, image.fault()), (Some(State::Fault), Some(Fault::StartRefused)));
        assert_eq!((heard.refusal, heard.switches), (refusal, [false; 3]));
        image.command = REST;
    }
    assert_eq!(value, Some(1.0), "the watchdog's reset");
}
