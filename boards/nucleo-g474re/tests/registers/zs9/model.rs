//! As much of three up-down timers as the bridge relies on: preload, updates at peak and valley, PWM and combined modes, the
//! dead-time generators, the main outputs, breaks. Modelled on the reference manual, not on the board.

use crate::bench::{Bench, dead_cycles};
use nucleo_g474re::registers::Registers;
use nucleo_g474re::zs9::start;
use stm32_metapac as pac;
use tractive::nine_switch::LegState;

/// One gate.
#[derive(Clone, Copy, Debug, Default)]
struct Gate {
    reference: bool,
    /// Cycle of the last rising edge of the reference.
    rose: u64,
    on: bool,
    went_off: Option<u64>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Timer {
    count: u16,
    down: bool,
    reload: u16,
    compares: [u16; 4],
    status: u32,
    output: Output,
}

/// A timer's outputs, as its registers have them since the board's last call.
#[derive(Clone, Copy, Debug, Default)]
struct Output {
    /// By channel.
    modes: [u8; 4],
    /// By gate of the leg, H, M, L: with an output, and with one beside it that has the opposite level.
    enabled: [bool; 3],
    paired: [bool; 3],
    main: bool,
    dead_cycles: u64,
}

impl Output {
    fn of(timer: pac::timer::TimAdv) -> Self {
        let (main, enabled) = (timer.bdtr().read(), timer.ccer().read());
        let mode = |channel: usize| {
            let pair = timer.ccmr_output(channel / 2).read();
            assert!(pair.ocpe(channel % 2), "channel {channel} is not preloaded");
            pair.ocm(channel % 2).to_bits()
        };
        Self {
            modes: core::array::from_fn(mode),
            enabled: CHANNELS.map(|channel| enabled.cce(channel)),
            paired: CHANNELS.map(|channel| enabled.cce(channel) && enabled.ccne(channel)),
            main: main.moe(),
            dead_cycles: dead_cycles(timer).into(),
        }
    }
}

/// The channels of a leg's gates H, M, L.
const CHANNELS: [usize; 3] = [0, 2, 1];

/// Longest time for which a leg may have a node on no rail: around a valley or a peak it passes through at most three states that are
/// each too short for the dead time, and then waits out the dead time.
const MOST_FLOATING_DEAD_TIMES: u64 = 4;

/// The three timers and nine gates.
pub struct Model {
    pub registers: Registers,
    pub now: u64,
    timers: [Timer; 3],
    /// Break inputs.
    pub fault: [bool; 3],
    /// By leg: H, M, L.
    gates: [[Gate; 3]; 3],
    floating_since: [Option<u64>; 3],
    /// Cycles in which a leg was shorted: by the compares, and by the devices.
    pub shorted: [u64; 2],
    /// `true` if a leg is, likewise.
    short: [bool; 2],
}

impl Model {
    /// After a whole start.
    pub fn started() -> Self {
        let mut bench = Bench::of_other_inverter();
        let registers = bench.registers;
        start::prepare(&registers, &mut bench).unwrap();
        let mut model = Self {
            registers,
            now: 0,
            timers: [Timer::default(); 3],
            fault: [false; 3],
            gates: [[Gate::default(); 3]; 3],
            floating_since: [None; 3],
            shorted: [0; 2],
            short: [false; 2],
        };
        // Followers take over preloaded values at once, by their own update.
        for (index, timer) in model.pac().into_iter().enumerate().skip(1) {
            assert!(timer.egr().read_update(), "timer {index} starts with what a reset left");
        }
        start::run(&registers, &mut bench);
        model.settle();
        model
    }

    fn pac(&self) -> [pac::timer::TimAdv; 3] {
        start::bridge(&self.registers).timers
    }

    /// Settles the hardware after the writes since the last time. Call it after every call of the board.
    pub fn settle(&mut self) {
        for (index, timer) in self.pac().into_iter().enumerate() {
            let state = &mut self.timers[index];
            state.status &= timer.sr().read().0;
            let events = timer.egr().take();
            if events & 1 != 0 {
                (state.count, state.down) = (0, false);
                update(state, timer);
            }
            if events & 1 << 7 != 0 || (self.fault[index] && timer.bdtr().read().bke(0)) {
                timer.bdtr().modify(|w| w.set_moe(false));
                state.status |= 1 << 7;
            }
            timer.sr().write_value(pac::timer::regs::SrAdv(state.status));
        }
        // TIM1's TRGO by software has started the followers.
        let [first, followers @ ..] = self.pac();
        for timer in followers {
            let slave = timer.smcr().read();
            if first.cr1().read().cen() && slave.sms() == pac::timer::vals::Sms::TRIGGER_MODE {
                timer.cr1().modify(|w| w.set_cen(true));
            }
        }
        for (index, timer) in self.pac().into_iter().enumerate() {
            self.timers[index].output = Output::of(timer);
        }
        self.drive(true);
    }

    /// One cycle of all timers; true if TIM1 has an interrupt.
    pub fn tick(&mut self) -> bool {
        self.now += 1;
        let mut interrupt = false;
        for (index, timer) in self.pac().into_iter().enumerate() {
            let state = &mut self.timers[index];
            if state.down {
                state.count -= 1;
            } else {
                state.count += 1;
            }
            let peak = !state.down && state.count == state.reload;
            let valley = state.down && state.count == 0;
            if peak || valley {
                state.down = peak;
                update(state, timer);
                state.status |= 1;
                timer.sr().write_value(pac::timer::regs::SrAdv(state.status));
                interrupt |= index == 0;
            }
        }
        if interrupt {
            let [first, ..] = self.pac();
            let down =
                if self.timers[0].down { pac::timer::vals::Dir::DOWN } else { pac::timer::vals::Dir::UP };
            first.cr1().modify(|w| w.set_dir(down));
        }
        self.drive(false);
        interrupt
    }

    /// Cycles since the valley, in the rising half or its mirror image.
    pub fn position(&self) -> (u16, bool) {
        (self.timers[0].count, self.timers[0].down)
    }

    /// Drives the gates of every leg after a call of the board, otherwise only of those that change.
    fn drive(&mut self, called: bool) {
        let mut changed = false;
        for leg in 0..3 {
            let timer = &self.timers[leg];
            let now = Leg {
                references: references(timer),
                gates: &self.gates[leg],
                output: &timer.output,
                floats: self.floating_since[leg].is_some(),
            };
            if called || now.changes() {
                let references = now.references;
                self.drive_leg(leg, references);
                changed = true;
            }
        }
        if changed {
            let shorted = |gates: &dyn Fn(&Gate) -> bool| self.gates.iter().any(|leg| leg.iter().all(gates));
            self.short = [shorted(&|gate| gate.reference), shorted(&|gate| gate.on)];
        }
        self.shorted = core::array::from_fn(|k| self.shorted[k] + u64::from(self.short[k]));
    }

    fn drive_leg(&mut self, leg: usize, references: [bool; 3]) {
        let now = self.now;
        let Output { enabled, paired, main, dead_cycles: dead, .. } = self.timers[leg].output;
        let gates = &mut self.gates[leg];
        let before = *gates;
        for (place, (gate, reference)) in gates.iter_mut().zip(references).enumerate() {
            if reference && !gate.reference {
                gate.rose = now;
            }
            gate.reference = reference;
            let delay = if paired[place] { dead } else { 0 };
            let on = main && enabled[place] && reference && now >= gate.rose + delay;
            if gate.on && !on {
                gate.went_off = Some(now);
            }
            gate.on = on;
        }
        let gates = *gates;
        assert!(
            !gates.iter().all(|gate| gate.on) || gates.iter().all(|gate| gate.reference),
            "leg {leg} shorted beyond what is played, at {now}"
        );
        // With what a device still conducts after it went off, at most the dead time: not all three, unless it is played.
        let goes_on = gates.iter().zip(before).any(|(gate, was)| gate.on && !was.on);
        let surely_off = |gate: &Gate| !gate.on && gate.went_off.is_none_or(|off| now - off >= DEAD_CYCLES);
        assert!(
            !goes_on || gates.iter().any(surely_off) || gates.iter().all(|gate| gate.reference),
            "dead time at {now}, leg {leg}: {gates:?}"
        );
        let [h, m, l] = gates.map(|gate| gate.on);
        let pulsing = gates.iter().any(|gate| gate.reference) && main;
        if !pulsing || LegState::of_gates(h, m, l).is_some() {
            self.floating_since[leg] = None;
        } else {
            let since = *self.floating_since[leg].get_or_insert(now);
            assert!(
                now - since <= MOST_FLOATING_DEAD_TIMES * dead,
                "leg {leg} floats since {since}, at {now}: {gates:?}"
            );
        }
    }

    /// Levels that the compares ask for, in the order of the drive's gates.
    pub fn references(&self) -> [bool; 9] {
        self.by_gate(|gate| gate.reference)
    }

    /// The devices, in the order of the drive's gates.
    pub fn devices(&self) -> [bool; 9] {
        self.by_gate(|gate| gate.on)
    }

    fn by_gate(&self, value: impl Fn(&Gate) -> bool) -> [bool; 9] {
        core::array::from_fn(|gate| value(&self.gates[gate % 3][gate / 3]))
    }
}

/// 1 µs at 170 MHz: what the power stage asks for.
pub const DEAD_CYCLES: u64 = 170;

fn update(state: &mut Timer, timer: pac::timer::TimAdv) {
    state.reload = timer.arr().read().arr();
    state.compares = core::array::from_fn(|channel| timer.ccr(channel).read().ccr());
}

/// A leg beside what its timer now asks for.
struct Leg<'a> {
    references: [bool; 3],
    gates: &'a [Gate; 3],
    output: &'a Output,
    floats: bool,
}

impl Leg<'_> {
    /// `false` if a cycle without a call of the board leaves all its gates as they are, with nothing to judge.
    fn changes(&self) -> bool {
        let &Self { references, gates, output: Output { enabled, main, .. }, floats } = self;
        let waits = |place: usize| *main && enabled[place] && gates[place].reference && !gates[place].on;
        floats || (0..3).any(|place| gates[place].reference != references[place] || waits(place))
    }
}

fn references(state: &Timer) -> [bool; 3] {
    let modes = |channel: usize| state.output.modes[channel];
    // PWM mode 1: counting up active below the compare, counting down inactive above it.
    let below = |channel: usize| {
        let compare = state.compares[channel];
        if state.down { state.count <= compare } else { state.count < compare }
    };
    let plain = |channel: usize| match modes(channel) {
        6 | 12 => below(channel),
        7 | 13 => !below(channel),
        other => panic!("channel {channel} has mode {other}"),
    };
    let combined = |odd: usize| match modes(odd) {
        12 => plain(odd) || plain(odd + 1),
        13 => plain(odd) && plain(odd + 1),
        _ => plain(odd),
    };
    [combined(0), combined(2), plain(1)]
}

/// EGR is written by the board and read back by the hardware alone.
trait Events {
    fn take(&self) -> u32;
    fn read_update(&self) -> bool;
}

impl Events for pac::common::Reg<pac::timer::regs::EgrAdv, pac::common::W> {
    fn take(&self) -> u32 {
        // SAFETY: a word of the timer's block of memory, which only this thread has.
        unsafe { self.as_ptr().cast::<u32>().replace(0) }
    }

    fn read_update(&self) -> bool {
        // SAFETY: as above.
        unsafe { self.as_ptr().cast::<u32>().read() & 1 != 0 }
    }
}
