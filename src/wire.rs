//! The words that a board in an emulator exchanges with the rig: fixed blocks of 16 words, little-endian.
//!
//! The firmware asks, the rig answers, and this takes no virtual time. Requests of both interrupts share one stream, because each block is written
//! whole. Answers have one stream per interrupt, because one interrupt may ask while the other still waits. Instants are the timers' nominal ones,
//! never arrival times.

#![forbid(unsafe_code)]

mod dual;

use crate::cell::Words;
use crate::control::{Demand, LinkWindow, MtpaStart};
use crate::drive::traction::Drops;
use crate::drive::{half_from_words, half_to_words};
use crate::frames::{Abc, Angle};
use crate::identification::Observation;
use crate::modulation::CarrierHalf;
use crate::operator::{self, DemandWords, Feedback, LineTimes, Status, TrainLimits};
use crate::ports::{DriveCommand, Report, Sample};
use crate::protection::{Fault, SafeState};
use crate::protocol::Frame;
use crate::recorder::Record;
use crate::time::Instant;

pub use dual::{
    DualRequest, DualSetup, dual_asked_from_block, dual_asked_to_block, dual_command_from_words,
    dual_sample_from_block, dual_sample_to_block, dual_setup_from_block, dual_setup_to_block,
    power_from_block, power_to_block,
};

/// Words in a block.
pub const BLOCK_WORDS: usize = 16;
/// Bytes in a block.
pub const BLOCK_BYTES: usize = BLOCK_WORDS * 4;
/// One block.
pub type Block = [u32; BLOCK_WORDS];

/// The timers' and the inverter's values that the rig sends before anything starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Control period, in ticks.
    pub control_ticks: u32,
    /// Shortest pulse of a device, in ticks.
    pub min_pulse_ticks: u32,
    /// Dead time, in ticks.
    pub dead_time_ticks: u32,
    /// Length of the PWM timer's first half beyond the shortest one, in ticks.
    pub pwm_delay_ticks: u32,
    /// The line side that the operator switches; `None`: no operator, the rig commands the drive directly.
    pub line: Option<LineTimes>,
    /// `true` if the operator's request comes over the protocol, in frames, and not in the words of the answers.
    pub over_protocol: bool,
    /// `true` if nothing compensates the dead time.
    pub uncompensated: bool,
    /// `true` if a line filter stands in front of the link: it is to be damped.
    pub behind_line_filter: bool,
    /// Age of the angle that the drive is told, in s.
    pub angle_late_s: f32,
    /// Step of a count of the angle, electrical, in rad; 0: none.
    pub angle_step_rad: f32,
    /// Time constant of the current sensors that the drive is told, in ticks, below 2¹⁶.
    pub current_filter_ticks: u32,
    /// Threshold of the devices that the drive is told, in mV, below 2¹⁵.
    pub threshold_mv: u32,
    /// Their slope, in hundredths of a mΩ, below 2¹⁴.
    pub slope_10uohm: u32,
    /// The share of the machine's iron loss that the drive compensates, in thousandths.
    pub iron_permille: u32,
    /// The operator's limits of line and acceleration; over the protocol the parameters apply.
    pub train: TrainLimits,
}

/// From the firmware to the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// The image has booted and wants its [`Setup`].
    Hello,
    /// The control timer's conversions.
    ControlSample(Instant),
    /// The end of a control interrupt.
    ControlReport(Instant, Report),
    /// Phase currents at a carrier boundary.
    PwmSample(Instant),
    /// Shadow registers: the half that follows the one that begins at the instant.
    Play(Instant, CarrierHalf),
    /// Gates into the safe state; `true` from the control interrupt.
    Enter(Instant, SafeState),
    /// The safe state is left.
    Leave(Instant),
    /// The question for the operator's request and the board's feedback, in the slot that began at the instant.
    Ask(Instant),
    /// The operator's status, and the frame that carries it; both hold from the instant on.
    Tell(Instant, Status, Option<Frame>),
    /// The processor has stopped in a panic or a HardFault, gates off.
    Dead,
    /// A control period from the flight recorder, the oldest first; sent after the last answer, if a fault has frozen it.
    Recorded(Record),
    /// The image has nothing more to send.
    End,
    /// The observation of an identification, sent by the control interrupt that began at the instant.
    Observed(Instant, Observation),
    /// The electrical angle where the position sensor began to count, found by the control interrupt that began at the instant.
    Align(Instant, Angle),
}

/// A request's block. Out of line, not in every caller: images are small.
#[inline(never)]
fn block(tag: u32, at: Instant, payload: &[u32]) -> Block {
    filled([tag, at.0].into_iter().chain(payload.iter().copied()))
}

/// A report's words with its last one, the sum of squares, as zero: the board's operator alone needs it, and a block has no room for it.
fn without_squares([a, b, c, d, e, f, g, h, i, j, k, l, m, n]: [u32; 14]) -> [u32; 15] {
    [a, b, c, d, e, f, g, h, i, j, k, l, m, n, 0]
}

/// A block that begins with these words; zeros after them.
fn filled(words: impl IntoIterator<Item = u32>) -> Block {
    let mut block = [0; BLOCK_WORDS];
    for (slot, word) in block.iter_mut().zip(words) {
        *slot = word;
    }
    block
}

impl Request {
    /// As a block.
    #[inline(always)]
    pub fn to_block(self) -> Block {
        match &self {
            Self::Hello => block(1, Instant(0), &[]),
            Self::ControlSample(at) => block(2, *at, &[]),
            Self::ControlReport(at, report) => block(3, *at, &report.to_words()),
            Self::PwmSample(at) => block(4, *at, &[]),
            Self::Play(at, half) => block(5, *at, &half_to_words(*half)),
            Self::Enter(at, safe) => block(6, *at, &[*safe as u32]),
            Self::Dead => block(7, Instant(0), &[]),
            Self::Recorded(record) => block(8, record.at, &record.to_words()),
            Self::End => block(9, Instant(0), &[]),
            Self::Leave(at) => block(10, *at, &[]),
            Self::Ask(at) => block(11, *at, &[]),
            Self::Tell(from, status, frame) => told_to_block(*from, status, *frame),
            Self::Observed(at, observation) => block(13, *at, &observation.to_words()),
            Self::Align(at, zero) => block(14, *at, &[zero.0]),
        }
    }

    /// From a block; `None` if it is not one of ours.
    pub fn from_block(block: &Block) -> Option<Self> {
        let [tag, at, payload @ ..] = *block;
        let (at, [first, ..]) = (Instant(at), payload);
        Some(match tag {
            1 => Self::Hello,
            2 => Self::ControlSample(at),
            3 => Self::ControlReport(at, Report::from_words(without_squares(payload))),
            4 => Self::PwmSample(at),
            5 => Self::Play(at, half_from_words(*payload.first_chunk()?)),
            6 => Self::Enter(at, SafeState::from_code(first)),
            7 => Self::Dead,
            8 => Self::Recorded(Record::from_words(*payload.first_chunk()?)),
            9 => Self::End,
            10 => Self::Leave(at),
            11 => Self::Ask(at),
            12 => {
                let (status, frame) = told_from_words(payload)?;
                Self::Tell(at, status, frame)
            }
            13 => Self::Observed(at, Observation::from_words(*payload.first_chunk()?)?),
            14 => Self::Align(at, Angle(first)),
            _ => return None,
        })
    }
}

impl Setup {
    /// The share of the machine's iron loss that the drive compensates.
    pub fn iron_share(&self) -> f32 {
        1e-3 * self.iron_permille as f32
    }

    /// The devices' drops that the drive is told.
    pub fn drops(&self) -> Drops {
        Drops { threshold_v: 1e-3 * self.threshold_mv as f32, slope_ohm: 1e-5 * self.slope_10uohm as f32 }
    }
}

/// The answer to [`Request::Hello`].
pub fn setup_to_block(setup: Setup) -> Block {
    let times = setup.dead_time_ticks | setup.current_filter_ticks << 16;
    let ticks = [setup.min_pulse_ticks, times, setup.pwm_delay_ticks];
    let flags = u32::from(setup.over_protocol)
        | u32::from(setup.uncompensated) << 1
        | u32::from(setup.behind_line_filter) << 2
        | setup.threshold_mv << 3
        | setup.slope_10uohm << 18;
    let more = [flags, setup.control_ticks, setup.angle_late_s.to_bits(), setup.angle_step_rad.to_bits()];
    let mut line = line_to_words(setup.line);
    line[0] |= setup.iron_permille << 1;
    filled(ticks.into_iter().chain(line).chain(more).chain(setup.train.to_words()))
}

/// The same block with the start of MTPA, for the image with the papers' ordinary law.
pub fn setup_with_start(setup: Setup, start: MtpaStart) -> Block {
    let mut block = setup_to_block(setup);
    let [.., last] = &mut block;
    *last = u32::from(start == MtpaStart::Zero);
    block
}

/// The start of MTPA in such a block.
pub fn start_from_block(block: &Block) -> MtpaStart {
    let [.., last] = *block;
    if last == 0 { MtpaStart::Previous } else { MtpaStart::Zero }
}

fn line_to_words(line: Option<LineTimes>) -> [u32; 3] {
    line.map_or([0; 3], |times| [1, times.precharge_s.to_bits(), times.discharge_s.to_bits()])
}

fn line_from_words([present, precharge, discharge]: [u32; 3]) -> Option<LineTimes> {
    let times = LineTimes { precharge_s: f32::from_bits(precharge), discharge_s: f32::from_bits(discharge) };
    (present & 1 == 1).then_some(times)
}

/// A status followed by a frame.
fn told_to_words<T: DemandWords>(status: &Status<T>, frame: Option<Frame>) -> [u32; 12] {
    let [a, b, c, d, e, f, g, h, i] = status.to_words();
    let [head, low, high] = frame.to_words();
    [a, b, c, d, e, f, g, h, i, head, low, high]
}

/// The block of [`Request::Tell`], or of [`DualRequest::Tell`].
pub fn told_to_block<T: DemandWords>(from: Instant, status: &Status<T>, frame: Option<Frame>) -> Block {
    block(12, from, &told_to_words(status, frame))
}

/// The inverse of [`told_to_words`].
fn told_from_words<T: DemandWords>(words: [u32; 14]) -> Option<(Status<T>, Option<Frame>)> {
    let [status @ .., head, low, high, _, _] = words;
    Some((Status::from_words(status)?, Option::from_words([head, low, high])))
}

/// The inverse of [`setup_to_block`].
pub fn setup_from_block(block: &Block) -> Setup {
    let [min_pulse_ticks, times, pwm_delay_ticks, ..] = *block;
    let [_, _, _, operated, precharge, discharge, flags, control_ticks, late, step, train @ .., _] = *block;
    let line = line_from_words([operated, precharge, discharge]);
    Setup {
        control_ticks,
        min_pulse_ticks,
        dead_time_ticks: times & 0xffff,
        pwm_delay_ticks,
        line,
        current_filter_ticks: times >> 16,
        threshold_mv: flags >> 3 & 0x7fff,
        slope_10uohm: flags >> 18,
        iron_permille: operated >> 1,
        over_protocol: flags & 1 != 0,
        uncompensated: flags & 2 != 0,
        behind_line_filter: flags & 4 != 0,
        angle_late_s: f32::from_bits(late),
        angle_step_rad: f32::from_bits(step),
        train: TrainLimits::from_words(train),
    }
}

/// The answer to [`Request::ControlSample`], with the rig's command and the count of a sensor without an angle; `stop` ends the run.
pub fn sample_to_block(sample: &Sample, command: &DriveCommand, counted: Option<Angle>, stop: bool) -> Block {
    let enable = sample.may_pulse && command.enable;
    let flags = u32::from(enable) | u32::from(command.demand.slew_limited) << 1 | u32::from(stop) << 2;
    let counted = counted.filter(|_| sample.angle.is_none());
    let flags = flags | u32::from(counted.is_some()) << 3;
    let [a, b, c] = sample.currents_a.to_bits();
    let torque = command.demand.torque_nm.to_bits();
    let hardware = sample.hardware.map_or(0, |fault| fault as u32);
    let angle = counted.unwrap_or(sample.measured().angle).0;
    [a, b, c, sample.udc_v.to_bits(), angle, torque, flags, hardware, 0, 0, 0, 0, 0, 0, 0, 0]
}

/// The inverse of [`sample_to_block`], with the command and the count as their words.
pub fn sample_from_block(block: &Block) -> (Sample, [u32; 3], bool) {
    let [a, b, c, udc, angle, torque, flags, hardware, ..] = *block;
    let sample = Sample {
        currents_a: Abc::from_bits([a, b, c]),
        udc_v: f32::from_bits(udc),
        angle: (flags & 8 == 0).then_some(Angle(angle)),
        may_pulse: flags & 1 != 0,
        hardware: Fault::from_code(hardware),
    };
    (sample, [torque, flags, angle], flags & 4 != 0)
}

/// The counted turn from such words; `None` if the sample has its angle.
pub fn counted_from_words([_, flags, angle]: [u32; 3]) -> Option<Angle> {
    (flags & 8 != 0).then_some(Angle(angle))
}

/// The command from such words.
pub fn command_from_words([torque, flags, _]: [u32; 3]) -> DriveCommand {
    DriveCommand {
        enable: flags & 1 != 0,
        demand: Demand { torque_nm: f32::from_bits(torque), slew_limited: flags & 2 != 0 },
        window: LinkWindow::OPEN,
        ..DriveCommand::NONE
    }
}

/// The answer to [`Request::Ask`]; over the protocol the request is in the frame, not in the words.
pub fn asked_to_block(asked: &operator::Request, feedback: &Feedback, frame: Option<Frame>) -> Block {
    filled(asked.to_words().into_iter().chain(feedback.to_words()).chain(frame.to_words()))
}

/// The inverse of [`asked_to_block`].
pub fn asked_from_block(block: &Block) -> (operator::Request, Feedback, Option<Frame>) {
    let [a, b, c, d, e, f, g, h, i, j, k, l, head, low, high, ..] = *block;
    let asked = operator::Request::from_words([a, b, c, d, e, f, g]);
    (asked, Feedback::from_words([h, i, j, k, l]), Option::from_words([head, low, high]))
}

/// The answer to [`Request::PwmSample`].
pub fn currents_to_block(currents_a: Abc) -> Block {
    filled(currents_a.to_bits())
}

/// The inverse of [`currents_to_block`].
pub fn currents_from_block(block: &Block) -> Abc {
    let [a, b, c, ..] = *block;
    Abc::from_bits([a, b, c])
}
