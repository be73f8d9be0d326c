//! The ZS9's whole image on the board in memory, with two turning encoders, contactors and a vehicle's computer around it. No current flows: what
//! is looked at is how the parts work together.

use super::model::Model;
use super::ports::{UNEXPLAINED, converted};
use crate::bench::{Bench, control_update, drivers_ready, turn_encoder, write_input};
use crate::bus::{Bus, Sender};
use nucleo_g474re::built_in::zs9::BUILT_IN;
use nucleo_g474re::position::{Encoder, PositionState};
use nucleo_g474re::power_stage::PowerStage;
use nucleo_g474re::watchdog::Pulse;
use nucleo_g474re::zs9::serve::DualServe;
use nucleo_g474re::zs9::stage::STAGE;
use nucleo_g474re::zs9::{CLOCK, CYCLES_PER_TICK, Control, Pwm, RATINGS, settings, start};
use tractive::drive::dual::{ControlTask, PwmTask, Shared};
use tractive::frames::Angle;
use tractive::nine_switch::Scheme;
use tractive::operator::{self, Configuration, DualSlot, Levels, Line, Refusal, State, slot_s};
use tractive::ports::{Dual, GateFeedback, PlayedPeriod, PowerSample, PwmPort};
use tractive::protection::Fault;
use tractive::protection::SafeState;
use tractive::protocol::{
    Frame, Payload, Scales, StatusFrame, TO_ZS9, ZS9_COMMAND, ZS9_STATUS, Zs9CanEndpoint, Zs9Command,
    Zs9Demands,
};
use tractive::time::Instant;

const SOURCE_V: f64 = 400.0;
/// Time constant of the precharge, in s.
const PRECHARGE_S: f64 = 0.005;
/// Time in which a contactor answers, in control periods.
const CONTACTOR_PERIODS: u64 = 50;
/// Longest time between two meals of the watchdog, in control periods: 20 ms.
const HUNGER: u64 = 200;

/// The PWM interrupt's port, with the driver board's latches in place of the serial words, which memory cannot shift. It lets the hardware
/// act after each write, as in the other image.
struct Port<'a> {
    pwm: &'a mut Pwm,
    model: &'a mut Model,
    seen: GateFeedback,
}

impl PwmPort<Dual> for Port<'_> {
    fn sample(&mut self, now: Instant) -> PowerSample {
        PowerSample { gates: self.seen, ..self.pwm.sample(now) }
    }

    fn play(&mut self, now: Instant, next: &PlayedPeriod) {
        self.pwm.play(now, next);
        self.model.settle();
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.pwm.enter(safe, now);
        self.model.settle();
    }

    fn leave(&mut self, now: Instant) -> bool {
        let left = self.pwm.leave(now);
        self.model.settle();
        left && !start::bridge(&self.model.registers).outputs().is_tripped()
    }
}

struct Image {
    model: Model,
    pwm: Pwm,
    seen: GateFeedback,
    shared: Shared<'static>,
    position: &'static PositionState,
    control: Control<'static, Encoder>,
    control_task: ControlTask<&'static tractive::machine::Tables>,
    pwm_task: PwmTask<&'static tractive::machine::Tables>,
    serve: DualServe<'static>,
    slot: DualSlot,
    pulse: Pulse,
    bus: Bus,
    commands: Sender,
    command: Zs9Command,
    heard: Option<StatusFrame<Scheme>>,
    /// Shafts from their indices on, in turns; their speeds, in r/min; and the encoders' counts.
    turns: [f64; 2],
    rpm: [f64; 2],
    counts: [f64; 2],
    capacitor_v: f64,
    drivers_ready: bool,
    /// The offset of the sensor of the upper motor's phase U, in codes.
    offset: u16,
    told: [(bool, Option<u64>); 2],
    periods: u64,
    fed: u64,
}

impl Image {
    /// From a reset on.
    fn reset(turns: [f64; 2], rpm: [f64; 2], zeros: [Angle; 2]) -> Self {
        let model = Model::started();
        let registers = model.registers;
        let bus = Bus::new(&TO_ZS9, &registers, &mut Bench::of_other_inverter());
        let position: &'static PositionState = Box::leak(Box::new(PositionState::new()));
        let encoder = |timer, encoder_zero| {
            Encoder::new(timer, &PowerStage { encoder_zero, ..STAGE.common }, &BUILT_IN.ratings)
        };
        let [first, second] = zeros;
        let encoders = [encoder(registers.tim4, first), encoder(registers.tim3, second)];
        let station = Zs9CanEndpoint::new(&RATINGS);
        Self {
            model,
            pwm: Pwm::new(registers, super::ports::zeros()),
            seen: GateFeedback::default(),
            shared: Shared::new(),
            position,
            control: Control::new(registers, super::ports::zeros(), encoders, position),
            control_task: ControlTask::new(&BUILT_IN, settings()).without(UNEXPLAINED),
            pwm_task: PwmTask::new(&BUILT_IN, settings()),
            serve: DualServe::new(registers, bus.can, station, position, Configuration::Good),
            slot: DualSlot::new(),
            pulse: Pulse::new(),
            bus,
            commands: Sender::of(&ZS9_COMMAND),
            command: Zs9Command::AT_REST,
            heard: None,
            turns,
            rpm,
            counts: [0.0; 2],
            capacitor_v: 0.0,
            drivers_ready: true,
            offset: 0,
            told: [(false, None); 2],
            periods: 0,
            fed: 0,
        }
    }

    fn convert(&self) {
        let code = |volts: f64| (volts / f64::from(STAGE.source_v_per_code)).round() as u16;
        let codes = [(6, code(self.capacitor_v)), (9, code(SOURCE_V)), (2, 2_048 + self.offset)];
        converted(&codes, self.model.registers);
    }

    /// The inputs' levels, and the link over a control period. As in the other image the contactors go by the status.
    fn line(&mut self) {
        let [precharge, main, _] = self.heard.map_or([false; 3], |heard| heard.switches);
        for (contact, told) in self.told.iter_mut().zip([precharge, main]) {
            if contact.0 != told {
                *contact = (told, Some(self.periods));
            }
        }
        if precharge || main {
            self.capacitor_v += (SOURCE_V - self.capacitor_v) * f64::from(CLOCK.control_s()) / PRECHARGE_S;
        }
        // The shoot-through of the last slot boosts it.
        let duty = self.shared.operator.observed().map_or(0.0, |observed| f64::from(observed.report.duty));
        if duty > 0.0 {
            self.capacitor_v = (1.0 - duty) / (1.0 - 2.0 * duty) * SOURCE_V;
        }
        let [precharge, main] = self.told.map(|(told, since)| {
            u32::from(since.is_some_and(|since| told == (self.periods >= since + CONTACTOR_PERIODS)))
        });
        let registers = self.model.registers;
        write_input(registers.gpioc, 1 << 4 | precharge << 5 | main << 12);
        drivers_ready(&registers, self.drivers_ready);
        self.model.fault = [!self.drivers_ready; 3];
    }

    /// Both shafts over a control period, and the timers that count their encoders.
    fn turn(&mut self) {
        let timers = [self.model.registers.tim4, self.model.registers.tim3];
        for (index, timer) in timers.into_iter().enumerate() {
            let moved = self.rpm[index] / 60.0 * f64::from(CLOCK.control_s());
            let before = self.turns[index];
            self.turns[index] += moved;
            let turned = [before, self.turns[index]];
            turn_encoder(timer, STAGE.common.encoder_counts, turned, &mut self.counts[index]);
        }
        control_update(&self.model.registers);
    }

    fn period(&mut self) {
        for cycle in 1..=u64::from(CLOCK.control_ticks * CYCLES_PER_TICK) {
            let beat = self.model.tick();
            for (gate, is_on) in self.model.devices().into_iter().enumerate() {
                let latch = if is_on { &mut self.seen.on } else { &mut self.seen.off };
                *latch |= 1 << gate;
            }
            if !beat {
                continue;
            }
            self.pwm.acknowledge();
            self.model.settle();
            let peak = self.pwm.begin_half();
            self.model.settle();
            if peak {
                self.convert();
                let seen = core::mem::take(&mut self.seen);
                let mut port = Port { pwm: &mut self.pwm, model: &mut self.model, seen };
                self.pwm_task.run(&mut port, &self.shared);
                self.pulse.pwm_ran();
                self.model.settle();
            } else if cycle == u64::from(CLOCK.control_ticks * CYCLES_PER_TICK) {
                self.control();
            }
        }
    }

    /// The control interrupt and a pass of the idle loop.
    fn control(&mut self) {
        self.periods += 1;
        self.turn();
        self.line();
        self.convert();
        self.control_task.run(&mut self.control, &self.shared);
        self.pulse.control_ran();
        self.model.settle();
        if self.periods.is_multiple_of(100) {
            let frame = self.commands.frame(self.command.encode(Scales::USUAL).unwrap());
            self.bus.arrive(frame);
        }
        let line = Line::rated(&RATINGS, PRECHARGE_S as f32, 0.1).without_chopper();
        let rated = operator::Settings::rated(&RATINGS, slot_s(&CLOCK), Some(line));
        self.serve.pass(&mut self.slot, &self.shared.operator, &rated);
        if let Some(Frame { id, data, .. }) = self.bus.settle()
            && id == ZS9_STATUS.id
        {
            self.heard = Some(StatusFrame::decode(Payload(u64::from_le_bytes(data))));
        }
        if self.pulse.feed_if_both_ran(&self.model.registers) {
            self.fed = self.periods;
        }
        assert!(self.periods < self.fed + HUNGER, "the watchdog bites");
    }

    fn run_ms(&mut self, ms: u64) {
        (0..ms * 10).for_each(|_| self.period());
    }

    fn state(&self) -> Option<State> {
        self.heard.and_then(|heard| heard.state)
    }

    fn until(&mut self, command: Zs9Command, wanted: State, ms: u64) {
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
        !self.model.devices().contains(&true)
    }
}

const fn asking(levels: Levels, torque_nm: f32) -> Zs9Command {
    Zs9Command { levels, demands: Zs9Demands::Torques([torque_nm, -torque_nm]) }
}

const REST: Zs9Command = Zs9Command::AT_REST;
const CHARGE: Zs9Command = asking(Levels { charge: true, ..Levels::NONE }, 0.0);
const ENABLE: Zs9Command = asking(Levels { enable: true, ..Levels::NONE }, 0.0);
const PULL: Zs9Command = asking(Levels { enable: true, ..Levels::NONE }, 10.0);
const ACKNOWLEDGE: Zs9Command = asking(Levels { acknowledge: true, ..Levels::NONE }, 0.0);

/// From enable to torque of both motors, the other way round each.
fn pulls(image: &mut Image) {
    image.until(ENABLE, State::Enabled, 40);
    image.until(PULL, State::Running, 40);
    image.run_ms(60);
    assert!(!image.gates_are_off());
    let [upper, lower] = image.shared.operator.observed().unwrap().report.torque_nm;
    assert!((upper - 10.0).abs() < 0.1 && (lower + 10.0).abs() < 0.1, "{upper} and {lower} N·m");
}

/// A fault, which stays until it is acknowledged and cannot be acknowledged while its cause lasts; then torque again.
fn fails(image: &mut Image, fault: Fault, spoil: fn(&mut Image), mend: fn(&mut Image)) {
    spoil(image);
    image.run_ms(1);
    assert!(image.gates_are_off(), "{fault:?}");
    image.until(PULL, State::Fault, 30);
    assert_eq!(image.fault(), Some(fault));
    image.command = ACKNOWLEDGE;
    image.run_ms(25);
    let heard = image.heard.unwrap();
    assert_eq!((heard.state, heard.refusal), (Some(State::Fault), Some(Refusal::CauseStillPresent)));
    mend(image);
    image.command = PULL;
    image.run_ms(25);
    assert!(image.gates_are_off() && image.fault() == Some(fault), "until it is acknowledged");
    image.until(ACKNOWLEDGE, State::Ready, 300);
    assert_eq!(image.control_task.trip(), None);
    assert!(image.gates_are_off(), "and enabled");
    image.until(CHARGE, State::Charged, 200);
    pulls(image);
}

#[test]
fn a_drive_that_is_reset_with_one_motor_turning_waits_for_the_others_index_and_works() {
    let mut image = Image::reset([0.3, 0.95], [1_200.0, 0.0], [Angle::DEG_90, Angle(0xB123_4567)]);
    image.until(REST, State::Ready, 100);
    image.until(CHARGE, State::Charged, 200);
    image.command = PULL;
    image.run_ms(30);
    assert_eq!(image.heard.unwrap().refusal, Some(Refusal::PositionUnknown));
    assert_eq!(image.state(), Some(State::Charged));
    // The other one begins to turn, the lever still set: its index comes, and nothing else.
    image.rpm[1] = -900.0;
    image.run_ms(70);
    assert!(image.position.is_known() && image.gates_are_off());
    assert_eq!((image.state(), image.control_task.trip()), (Some(State::Charged), None));
    image.command = REST;
    image.run_ms(15);
    pulls(&mut image);
    fails(
        &mut image,
        Fault::GateDriver,
        |image| image.drivers_ready = false,
        |image| image.drivers_ready = true,
    );
    fails(&mut image, Fault::PhaseSum, |image| image.offset = 300, |image| image.offset = 0);
    // Until it is slow: the EMFs of both would rectify.
    for _ in 0..100 {
        image.rpm = image.rpm.map(|rpm| 0.985 * rpm);
        image.run_ms(1);
    }
    image.until(REST, State::Charged, 100);
    image.run_ms(2);
    assert!(image.gates_are_off() && image.fault().is_none());
}
