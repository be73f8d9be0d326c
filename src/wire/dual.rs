//! The ZS9's blocks: the same three streams and the same tags, with other contents.

use super::{Block, block, filled, line_from_words, line_to_words, told_from_words, told_to_block};
use crate::cell::Words;
use crate::control::Demand;
use crate::frames::{Abc, Angle};
use crate::nine_switch::{GateTicks, Scheme};
use crate::operator::{DualStatus, Feedback, LineTimes};
use crate::ports::{
    DualDriveCommand, DualReport, DualSample, GateFeedback, HardwareBreak, MotorDemand, PlayedPeriod,
    PowerSample,
};
use crate::protection::Fault;
use crate::protocol::Frame;
use crate::recorder::DualRecord;
use crate::time::Instant;

/// The values that the rig sends to the image before anything starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DualSetup {
    /// Carrier period, in ticks.
    pub carrier_ticks: u32,
    /// Dead time between two gates of a leg, in ticks.
    pub dead_time_ticks: u32,
    /// The line side that the operator switches; `None`: no operator, the rig commands the drive directly.
    pub line: Option<LineTimes>,
    /// `true` if the source is behind a line filter that the drive has to damp.
    pub behind_line_filter: bool,
}

/// From the firmware to the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DualRequest {
    /// The image has booted and wants its [`DualSetup`].
    Hello,
    /// The control timer's conversions.
    ControlSample(Instant),
    /// The end of a control interrupt.
    ControlReport(Instant, DualReport),
    /// The conversions at a peak of the carrier.
    PowerSample(Instant),
    /// Shadow registers: the carrier period that begins at the valley after this peak.
    Play(Instant, PlayedPeriod),
    /// All nine gates off.
    GatesOff(Instant),
    /// The processor has stopped in a panic or a HardFault, gates off.
    Dead,
    /// A control period from the flight recorder, the oldest first; sent after the last answer, if a fault has frozen it.
    Recorded(DualRecord),
    /// The image has nothing more to send.
    End,
    /// The gates may be played again.
    Leave(Instant),
    /// The question for a received frame and the board's feedback, in the slot that began at the instant.
    Ask(Instant),
    /// The operator's status, and the frame that carries it; both hold from the instant on.
    Tell(Instant, DualStatus, Option<Frame>),
}

impl DualRequest {
    /// As a block.
    #[inline(always)]
    pub fn to_block(self) -> Block {
        match &self {
            Self::Hello => block(1, Instant(0), &[]),
            Self::ControlSample(at) => block(2, *at, &[]),
            Self::ControlReport(at, report) => block(3, *at, &told_of(report)),
            Self::PowerSample(at) => block(4, *at, &[]),
            // Both ends of a pause in one word: a half has at most 65,535 compare steps.
            Self::Play(at, period) => {
                block(5, *at, &period.gates.map(|gate| gate.off_from | gate.off_to << 16))
            }
            Self::GatesOff(at) => block(6, *at, &[]),
            Self::Dead => block(7, Instant(0), &[]),
            // Its first word is the instant.
            Self::Recorded(record) => block(8, record.at, record.to_words().split_at(1).1),
            Self::End => block(9, Instant(0), &[]),
            Self::Leave(at) => block(10, *at, &[]),
            Self::Ask(at) => block(11, *at, &[]),
            Self::Tell(from, status, frame) => told_to_block(*from, status, *frame),
        }
    }

    /// From a block; `None` if it is not one of ours.
    pub fn from_block(block: &Block) -> Option<Self> {
        let [tag, at, payload @ ..] = *block;
        let at = Instant(at);
        Some(match tag {
            1 => Self::Hello,
            2 => Self::ControlSample(at),
            3 => {
                let [a, b, c, d, e, f, g, h, i, j, ..] = payload;
                let report = [a, b, c, d, e, f, g, h, i, j, 0, 0, 0, 0, 0, 0, 0, 0];
                Self::ControlReport(at, DualReport::from_words(report))
            }
            4 => Self::PowerSample(at),
            5 => {
                let ticks = |word: u32| GateTicks { off_from: word & 0xFFFF, off_to: word >> 16 };
                Self::Play(at, PlayedPeriod { gates: payload.first_chunk()?.map(ticks) })
            }
            6 => Self::GatesOff(at),
            7 => Self::Dead,
            // The instant is its first word.
            8 => Self::Recorded(DualRecord::from_words(*block.last_chunk()?)),
            9 => Self::End,
            10 => Self::Leave(at),
            11 => Self::Ask(at),
            12 => {
                let (status, frame) = told_from_words(payload)?;
                Self::Tell(at, status, frame)
            }
            _ => return None,
        })
    }
}

/// The words of a report that are sent to the rig: without those that it has measured itself.
fn told_of(report: &DualReport) -> [u32; 10] {
    let [a, b, c, d, e, f, g, h, i, j, ..] = report.to_words();
    [a, b, c, d, e, f, g, h, i, j]
}

/// The answer to [`DualRequest::Hello`].
pub fn dual_setup_to_block(setup: DualSetup) -> Block {
    let DualSetup { carrier_ticks, dead_time_ticks, line, behind_line_filter } = setup;
    let [present, precharge, discharge] = line_to_words(line);
    let flags = present | u32::from(behind_line_filter) << 1;
    filled([carrier_ticks, dead_time_ticks, flags, precharge, discharge])
}

/// The inverse of [`dual_setup_to_block`].
pub fn dual_setup_from_block(block: &Block) -> DualSetup {
    let [carrier_ticks, dead_time_ticks, flags, precharge, discharge, ..] = *block;
    let line = line_from_words([flags, precharge, discharge]);
    DualSetup { carrier_ticks, dead_time_ticks, line, behind_line_filter: flags & 2 != 0 }
}

/// The answer to [`DualRequest::Ask`].
pub fn dual_asked_to_block(feedback: &Feedback, frame: Option<Frame>) -> Block {
    filled(feedback.to_words().into_iter().chain(frame.to_words()))
}

/// The inverse of [`dual_asked_to_block`].
pub fn dual_asked_from_block(block: &Block) -> (Feedback, Option<Frame>) {
    let [a, b, c, d, e, head, low, high, ..] = *block;
    (Feedback::from_words([a, b, c, d, e]), Option::from_words([head, low, high]))
}

/// The answer to [`DualRequest::ControlSample`], with the rig's command; `stop` ends the run.
pub fn dual_sample_to_block(sample: &DualSample, command: &DualDriveCommand, stop: bool) -> Block {
    let [[a1, b1, c1], [a2, b2, c2]] = sample.currents_a.map(Abc::to_bits);
    let [first, second] = sample.angles.map(|angle| angle.unwrap_or(Angle::ZERO).0);
    let [lost1, lost2] = sample.angles.map(|angle| u32::from(angle.is_none()));
    let [(kind1, demand1), (kind2, demand2)] = command.demands.map(demand_words);
    let flags = u32::from(sample.may_pulse && command.enable)
        | u32::from(stop) << 1
        | lost1 << 2
        | lost2 << 3
        | kind1 << 4
        | kind2 << 6
        | (command.scheme as u32) << 8;
    let hardware = sample.hardware.map_or(0, |found| found.fault as u32 | u32::from(found.seen) << 16);
    let [capacitor, inductor, source, link] =
        [sample.capacitor_v, sample.inductor_a, sample.source_v, command.link_ref_v].map(f32::to_bits);
    [
        a1, b1, c1, a2, b2, c2, first, second, capacitor, inductor, source, demand1, demand2, link, flags,
        hardware,
    ]
}

/// The inverse of [`dual_sample_to_block`], with the command as its words.
pub fn dual_sample_from_block(block: &Block) -> (DualSample, [u32; 4], bool) {
    let [
        a1,
        b1,
        c1,
        a2,
        b2,
        c2,
        first,
        second,
        capacitor,
        inductor,
        source,
        demand1,
        demand2,
        link,
        flags,
        hardware,
    ] = *block;
    let angle = |word, lost| (flags & lost == 0).then_some(Angle(word));
    let sample = DualSample {
        currents_a: [Abc::from_bits([a1, b1, c1]), Abc::from_bits([a2, b2, c2])],
        angles: [angle(first, 4), angle(second, 8)],
        capacitor_v: f32::from_bits(capacitor),
        inductor_a: f32::from_bits(inductor),
        source_v: f32::from_bits(source),
        may_pulse: flags & 1 != 0,
        hardware: Fault::from_code(hardware & 0xFFFF)
            .map(|fault| HardwareBreak { fault, seen: (hardware >> 16) as u16 }),
    };
    (sample, [demand1, demand2, link, flags], flags & 2 != 0)
}

/// The command from such words.
pub fn dual_command_from_words([demand1, demand2, link, flags]: [u32; 4]) -> DualDriveCommand {
    DualDriveCommand {
        enable: flags & 1 != 0,
        demands: [demand(flags >> 4 & 3, demand1), demand(flags >> 6 & 3, demand2)],
        speed_torque_nm: DualDriveCommand::UNLIMITED_NM,
        link_ref_v: f32::from_bits(link),
        scheme: Scheme::from_code(flags >> 8 & 0xFF),
        acknowledge: 0,
        calibrate: false,
    }
}

/// The answer to [`DualRequest::PowerSample`].
pub fn power_to_block(sample: &PowerSample) -> Block {
    let [[a1, b1, c1], [a2, b2, c2]] = sample.currents_a.map(Abc::to_bits);
    let gates = u32::from(sample.gates.on) | u32::from(sample.gates.off) << 16;
    let (capacitor, source) = (sample.capacitor_v.to_bits(), sample.source_v.to_bits());
    [a1, b1, c1, a2, b2, c2, capacitor, source, gates, 0, 0, 0, 0, 0, 0, 0]
}

/// The inverse of [`power_to_block`].
pub fn power_from_block(block: &Block) -> PowerSample {
    let [a1, b1, c1, a2, b2, c2, capacitor, source, gates, ..] = *block;
    PowerSample {
        currents_a: [Abc::from_bits([a1, b1, c1]), Abc::from_bits([a2, b2, c2])],
        capacitor_v: f32::from_bits(capacitor),
        source_v: f32::from_bits(source),
        gates: GateFeedback { on: gates as u16, off: (gates >> 16) as u16 },
    }
}

/// Kind (0 torque, 1 torque with slew, 2 speed) and value.
fn demand_words(demand: MotorDemand) -> (u32, u32) {
    match demand {
        MotorDemand::Torque(demand) => (u32::from(demand.slew_limited), demand.torque_nm.to_bits()),
        MotorDemand::Speed(speed_rad_s) => (2, speed_rad_s.to_bits()),
    }
}

fn demand(kind: u32, value: u32) -> MotorDemand {
    let value = f32::from_bits(value);
    match kind {
        2 => MotorDemand::Speed(value),
        kind => MotorDemand::Torque(Demand { torque_nm: value, slew_limited: kind == 1 }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::BLOCK_WORDS;
    use super::*;
    use crate::nine_switch::Scheme;
    use crate::operator::{State, Switches};
    use crate::recorder::DualState;

    fn sample() -> DualSample {
        let current = Abc { a: 1.5, b: -2.5, c: 1.0 };
        DualSample {
            currents_a: [current, Abc { a: 0.25, ..current }],
            angles: [Some(Angle(0x1234_5678)), None],
            capacitor_v: 533.5,
            inductor_a: -3.25,
            source_v: 400.0,
            may_pulse: true,
            hardware: Some(HardwareBreak { fault: Fault::GateDriver, seen: 0x3FF }),
        }
    }

    fn command() -> DualDriveCommand {
        DualDriveCommand {
            enable: true,
            demands: [
                MotorDemand::Speed(104.5),
                MotorDemand::Torque(Demand { torque_nm: -60.0, slew_limited: true }),
            ],
            link_ref_v: 667.0,
            scheme: Scheme::Zvo,
            speed_torque_nm: DualDriveCommand::UNLIMITED_NM,
            acknowledge: 0,
            calibrate: false,
        }
    }

    #[test]
    fn samples_and_set_up_arrive() {
        let (sample, command) = (sample(), command());
        let block = dual_sample_to_block(&sample, &command, true);
        let (arrived, words, stop) = dual_sample_from_block(&block);
        assert_eq!((arrived, dual_command_from_words(words), stop), (sample, command, true));
        let power = PowerSample {
            currents_a: sample.currents_a,
            capacitor_v: 530.0,
            source_v: 399.0,
            gates: GateFeedback { on: 0x1A5, off: 0x05A },
        };
        assert_eq!(power_from_block(&power_to_block(&power)), power);
        let setup =
            DualSetup { carrier_ticks: 2_500, dead_time_ticks: 125, line: None, behind_line_filter: false };
        let line = Some(LineTimes { precharge_s: 0.05, discharge_s: 0.5 });
        for setup in [setup, DualSetup { line, ..setup }, DualSetup { behind_line_filter: true, ..setup }] {
            assert_eq!(dual_setup_from_block(&dual_setup_to_block(setup)), setup);
        }
        let feedback = Feedback { main_closed: true, ..Feedback::default() };
        for frame in [None, FRAME] {
            assert_eq!(dual_asked_from_block(&dual_asked_to_block(&feedback, frame)), (feedback, frame));
        }
    }

    const FRAME: Option<Frame> = Some(Frame { id: 0x111, length: 8, data: [1, 2, 3, 4, 5, 6, 7, 8] });

    #[test]
    fn requests_arrive() {
        let mut gates = [GateTicks { off_from: 1, off_to: 40_000 }; 9];
        gates[4] = GateTicks { off_from: 65_535, off_to: 65_535 };
        let report = DualReport { torque_nm: [1.0, -2.0], weakening: [false, true], ..DualReport::default() };
        let status = DualStatus {
            state: State::Running,
            trip: None,
            refusal: None,
            refusals: 1,
            torque_nm: command().demands,
            switches: Switches { main: true, ..Switches::default() },
            temperatures: None,
        };
        let record = DualRecord {
            at: Instant(12),
            currents_a: sample().currents_a,
            angles: [Angle(1), Angle(2)],
            capacitor_v: 533.0,
            source_v: 400.0,
            inductor_a: 1.0,
            torque_nm: [2.0, 3.0],
            duty: 0.25,
            state: DualState::default(),
        };
        for request in [
            DualRequest::Hello,
            DualRequest::ControlSample(Instant(7)),
            DualRequest::ControlReport(Instant(8), report),
            DualRequest::PowerSample(Instant(9)),
            DualRequest::Play(Instant(10), PlayedPeriod { gates }),
            DualRequest::GatesOff(Instant(11)),
            DualRequest::Dead,
            DualRequest::Recorded(record),
            DualRequest::End,
            DualRequest::Leave(Instant(13)),
            DualRequest::Ask(Instant(14)),
            DualRequest::Tell(Instant(15), status, FRAME),
        ] {
            assert_eq!(DualRequest::from_block(&request.to_block()), Some(request));
        }
        assert_eq!(DualRequest::from_block(&[99; BLOCK_WORDS]), None);
    }
}
