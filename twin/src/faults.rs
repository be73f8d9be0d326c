//! The hardware's faults, each while the drive starts, rests, is charged, is enabled or makes torque: the time until every gate is off, and what the
//! drive reports of it.

use crate::chip::rcc::POWER_ON;
use crate::core::cpu::{Cpu, Longest};
use crate::core::nvic::HARD_FAULT;
use crate::machine::What;
use crate::run::{Settings, prepare};
use crate::time::{MICROSECOND, MILLISECOND, Time};
use crate::world::Edge;
use anyhow::{Result, ensure};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use tractive::protocol::{Frame, Scales};
use tractive_rig::talk::{Listener, System};

/// The drive that is disturbed, each command as soon as the one before has had its effect.
const SCRIPT: &str = "\
0.10 charge
0.26 enable
0.31 torque 300 over 0.05
3.00 end
";
/// The same of the ZS9.
const SCRIPT_ZS9: &str = "\
0.10 charge
0.26 enable
0.31 torque 20 20 over 0.05
3.00 end
";
/// The frames that are shown.
const FRAMES: usize = 8;
/// The babbling node's frame: 47 bits with the space behind it.
const EMPTY: Frame = Frame { id: 0x102, length: 0, data: [0; 8] };
const EMPTY_TIME: Time = 47 * 2 * MICROSECOND;
/// The time for which the drive is observed afterwards, and where the fault comes in the start.
const AFTER: Time = 300 * MILLISECOND;
/// In the start, before the script charges.
const AFTER_STARTING: Time = 80 * MILLISECOND;

/// The time in which any start has come to its end.
const STARTED: Time = 25 * MILLISECOND;
/// The least time between two first accesses.
const APART: Time = 30 * MICROSECOND;
/// The enable register of the bus of the timers with gates, an offset in RCC.
const APB2ENR: u32 = 0x60;

/// The state of the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// The start is under way: this long after the release of reset.
    Starting(Time),
    /// Nothing commanded.
    Ready,
    /// The link is charged.
    Charged,
    /// Pulses without torque.
    Enabled,
    /// Torque.
    Running,
}

impl When {
    fn instant(self) -> Time {
        let ms = match self {
            Self::Starting(at) => return at,
            Self::Ready => 95,
            Self::Charged => 250,
            Self::Enabled => 300,
            Self::Running => 510,
        };
        // Not at a control interrupt.
        ms * MILLISECOND + MILLISECOND / 30
    }
}

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// A gate driver is not ready.
    Drivers,
    /// A phase current beyond the comparators' threshold.
    Overcurrent,
    /// The encoder's wires are cut.
    Encoder,
    /// The processor hangs.
    Hang,
    /// The crystal stops.
    Crystal,
    /// The supply falls below the detector's threshold, then below that of the reset, and comes back.
    BrownOut,
    /// A debugger halts the processor.
    Debugger,
    /// A hard fault.
    HardFault,
    /// The CAN controller leaves the bus.
    BusOff,
    /// A node fills the bus with frames without a byte, under an identifier that the drive listens to.
    Babble,
}

impl Cause {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Drivers,
        Self::Overcurrent,
        Self::Encoder,
        Self::Hang,
        Self::Crystal,
        Self::BrownOut,
        Self::Debugger,
        Self::HardFault,
        Self::BusOff,
        Self::Babble,
    ];
}

/// The outcome.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The time from the cause until the last gate went off for good; `None` if one is on at the end.
    pub off_after: Option<Time>,
    /// The same of contactors, discharge resistor and chopper.
    pub lines_off_after: Option<Time>,
    /// The state as told just before.
    pub state: String,
    /// Gates were on just before.
    pub pulsed: bool,
    /// The timers had their clocks just before; without them the pins float as from the reset on, and switching off does nothing.
    pub clocked: bool,
    /// Frames heard in the last third of the time.
    pub heard: u64,
    /// The resets.
    pub resets: u32,
    /// State and fault as told at the end.
    pub told: String,
    /// `true` if the drive listens to commands at the end, as told.
    pub listening: String,
    /// The last frames of the drive, as logged.
    pub frames: Vec<String>,
    /// The costs of the handlers from the cause on, by exception; with their waits if the bus is full.
    pub longest: BTreeMap<usize, Longest>,
    /// Frames that found the receive FIFO full.
    pub lost: u32,
    /// The other findings.
    pub findings: Vec<String>,
}

/// The instants of an undisturbed start at which a register is accessed for the first time, and the instants half-way between them, which lie in its
/// waits. Accesses that are not [`APART`] count as one. An image that does not run is the error.
pub fn starting(image: &Path, system: System) -> Result<Vec<Time>> {
    let mut cpu = drive(image, system)?;
    cpu.machine_mut().record = Some(Vec::new());
    cpu.run(STARTED)?;
    let mut seen = HashSet::new();
    let accesses = cpu.machine_mut().record.take().unwrap_or_default();
    let first = accesses.into_iter().filter(|access| match access.what {
        What::Read(address, _) | What::Write(address, _) => seen.insert(address),
        What::Entry => false,
    });
    let mut instants = vec![0];
    for access in first {
        let before = instants.last().copied().unwrap_or_default();
        if access.at >= before + APART {
            instants.extend([before.midpoint(access.at), access.at]);
        }
    }
    Ok(instants)
}

/// Drives the image into a state, injects the fault, and observes what follows.
pub fn look(image: &Path, system: System, cause: Cause, when: When) -> Result<Seen> {
    let mut cpu = drive(image, system)?;
    cpu.machine_mut().world.side.charge();
    cpu.run(when.instant())?;
    let machine = cpu.machine();
    ensure!(machine.findings.all.is_empty(), "{}", machine.findings.all[0]);
    let (from, pulsed) = (machine.now(), machine.world.any_gate());
    let state = machine.world.talk.listener.value("state");
    let clocked = machine.chip.rcc.word(APB2ENR) != 0;
    let before = [machine.world.edges.len(), machine.world.line_edges.len()];
    let after = if matches!(when, When::Starting(_)) { AFTER_STARTING } else { AFTER };
    let lost = machine.chip.can.lost;
    cpu.longest.clear();
    if matches!(cause, Cause::Babble) {
        cpu.count_waits()?;
    }
    disturb(&mut cpu, system, cause, from + after)?;
    cpu.run(from + 2 * after / 3)?;
    let received = cpu.machine().world.talk.received;
    cpu.run(from + after)?;
    let machine = cpu.machine();
    let world = &machine.world;
    let [gates, lines] = before;
    let last = |edges: &[Edge]| edges.last().map_or(0, |edge| edge.at.saturating_sub(from));
    let say = |column: &str| world.talk.listener.value(column);
    Ok(Seen {
        off_after: (!world.any_gate()).then(|| last(&world.edges[gates..])),
        lines_off_after: (!world.any_line()).then(|| last(&world.line_edges[lines..])),
        state,
        pulsed,
        clocked,
        heard: world.talk.received - received,
        resets: machine.resets,
        told: format!("{} {}", say("state"), say("fault")).trim().to_owned(),
        frames: last_frames(&world.talk.frames),
        listening: say("listening"),
        longest: cpu.longest.clone(),
        lost: machine.chip.can.lost - lost,
        findings: machine.findings.all.iter().map(|finding| finding.text.clone()).collect(),
    })
}

fn drive(image: &Path, system: System) -> Result<Cpu> {
    let script = match system {
        System::Pmasynrm => SCRIPT,
        System::Zs9 => SCRIPT_ZS9,
    };
    Ok(prepare(&Settings::new(image, system, script.to_owned()))?.0)
}

fn last_frames(log: &str) -> Vec<String> {
    log.lines().rev().filter(|line| line.ends_with('R')).take(FRAMES).map(str::to_owned).collect()
}

fn disturb(cpu: &mut Cpu, system: System, cause: Cause, until: Time) -> Result<()> {
    let machine = cpu.machine_mut();
    machine.may_bite = true;
    // A drive that restarts counts its frames anew: a listener that starts now follows it.
    machine.world.talk.listener = Listener::new(system, Scales::USUAL);
    match cause {
        Cause::Drivers => machine.world.ready = false,
        Cause::Overcurrent => machine.world.excess_a = (0, 0, 600.0),
        Cause::Encoder => machine.world.cut = true,
        Cause::Hang => cpu.stall(until)?,
        Cause::Crystal => machine.stop_crystal(),
        Cause::BrownOut => {
            machine.chip.system.low_supply = true;
            machine.settle();
            let reset = cpu.machine().now() + MILLISECOND;
            cpu.run(reset)?;
            cpu.reset(POWER_ON)?;
        }
        Cause::Debugger => {
            let now = machine.now();
            machine.chip.halt(now);
            machine.settle();
            cpu.stall(until)?;
        }
        Cause::HardFault => machine.nvic.pend(HARD_FAULT),
        Cause::BusOff => machine.chip.can.leave_bus(),
        Cause::Babble => machine.world.babble = Some((EMPTY, EMPTY_TIME)),
    }
    cpu.machine_mut().settle();
    Ok(())
}
