//! The ZS9's blocks: the same three streams and the same tags, other contents.

use super::{BLOCK_WORDS, Block};
use crate::board::{DualSample, GateFeedback, MotorDemand, PlayedPeriod, PowerSample};
use crate::cell::Words;
use crate::control::Demand;
use crate::drive::dual::{DualReport, scheme_from_code};
use crate::frames::{Abc, Angle};
use crate::nine_switch::GateTicks;
use crate::time::Instant;

/// What the rig tells the image before anything starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DualSetup {
    /// Carrier period, in ticks.
    pub carrier_ticks: u32,
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
}

impl DualRequest {
    /// As a block.
    pub fn to_block(self) -> Block {
        let mut block = [0; BLOCK_WORDS];
        let (tag, at, payload): (u32, Instant, &[u32]) = match &self {
            Self::Hello => (1, Instant(0), &[]),
            Self::ControlSample(at) => (2, *at, &[]),
            Self::ControlReport(at, report) => (3, *at, &report.to_words()),
            Self::PowerSample(at) => (4, *at, &[]),
            // Both ends of a pause in one word: a half has at most 65,535 compare steps.
            Self::Play(at, period) => (5, *at, &period.gates.map(|gate| gate.off_from | gate.off_to << 16)),
            Self::GatesOff(at) => (6, *at, &[]),
            Self::Dead => (7, Instant(0), &[]),
        };
        let words = [tag, at.0].into_iter().chain(payload.iter().copied());
        for (slot, word) in block.iter_mut().zip(words) {
            *slot = word;
        }
        block
    }

    /// From a block; `None` if it is none of ours.
    pub fn from_block(block: &Block) -> Option<Self> {
        let [tag, at, payload @ ..] = *block;
        let at = Instant(at);
        Some(match tag {
            1 => Self::Hello,
            2 => Self::ControlSample(at),
            3 => {
                let [a, b, c, d, e, f, g, h, i, j, k, ..] = payload;
                Self::ControlReport(at, DualReport::from_words([a, b, c, d, e, f, g, h, i, j, k]))
            }
            4 => Self::PowerSample(at),
            5 => {
                let [a, b, c, d, e, f, g, h, i, ..] = payload;
                let gates = [a, b, c, d, e, f, g, h, i]
                    .map(|word| GateTicks { off_from: word & 0xFFFF, off_to: word >> 16 });
                Self::Play(at, PlayedPeriod { gates })
            }
            6 => Self::GatesOff(at),
            7 => Self::Dead,
            _ => return None,
        })
    }
}

/// The answer to [`DualRequest::Hello`].
pub fn dual_setup_to_block(setup: DualSetup) -> Block {
    let mut block = [0; BLOCK_WORDS];
    block[0] = setup.carrier_ticks;
    block
}

/// The inverse of [`dual_setup_to_block`].
pub fn dual_setup_from_block(block: &Block) -> DualSetup {
    let [carrier_ticks, ..] = *block;
    DualSetup { carrier_ticks }
}

/// The answer to [`DualRequest::ControlSample`]; `stop` ends the run.
pub fn dual_sample_to_block(sample: &DualSample, stop: bool) -> Block {
    let [[a1, b1, c1], [a2, b2, c2]] = sample.currents_a.map(current_words);
    let [first, second] = sample.angles.map(|angle| angle.unwrap_or(Angle::ZERO).0);
    let [lost1, lost2] = sample.angles.map(|angle| u32::from(angle.is_none()));
    let [(kind1, demand1), (kind2, demand2)] = sample.demands.map(demand_words);
    let flags = u32::from(sample.enable)
        | u32::from(stop) << 1
        | lost1 << 2
        | lost2 << 3
        | kind1 << 4
        | kind2 << 6
        | (sample.scheme as u32) << 8;
    let [capacitor, inductor, source, link] =
        [sample.capacitor_v, sample.inductor_a, sample.source_v, sample.link_ref_v].map(f32::to_bits);
    [a1, b1, c1, a2, b2, c2, first, second, capacitor, inductor, source, demand1, demand2, link, flags, 0]
}

/// The inverse of [`dual_sample_to_block`].
pub fn dual_sample_from_block(block: &Block) -> (DualSample, bool) {
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
        _,
    ] = *block;
    let angle = |word, lost| (flags & lost == 0).then_some(Angle(word));
    let sample = DualSample {
        currents_a: [currents([a1, b1, c1]), currents([a2, b2, c2])],
        angles: [angle(first, 4), angle(second, 8)],
        capacitor_v: f32::from_bits(capacitor),
        inductor_a: f32::from_bits(inductor),
        source_v: f32::from_bits(source),
        demands: [demand(flags >> 4 & 3, demand1), demand(flags >> 6 & 3, demand2)],
        link_ref_v: f32::from_bits(link),
        scheme: scheme_from_code(flags >> 8),
        enable: flags & 1 != 0,
    };
    (sample, flags & 2 != 0)
}

/// The answer to [`DualRequest::PowerSample`].
pub fn power_to_block(sample: &PowerSample) -> Block {
    let [[a1, b1, c1], [a2, b2, c2]] = sample.currents_a.map(current_words);
    let gates = u32::from(sample.gates.on) | u32::from(sample.gates.off) << 16;
    let (capacitor, source) = (sample.capacitor_v.to_bits(), sample.source_v.to_bits());
    [a1, b1, c1, a2, b2, c2, capacitor, source, gates, 0, 0, 0, 0, 0, 0, 0]
}

/// The inverse of [`power_to_block`].
pub fn power_from_block(block: &Block) -> PowerSample {
    let [a1, b1, c1, a2, b2, c2, capacitor, source, gates, ..] = *block;
    PowerSample {
        currents_a: [currents([a1, b1, c1]), currents([a2, b2, c2])],
        capacitor_v: f32::from_bits(capacitor),
        source_v: f32::from_bits(source),
        gates: GateFeedback { on: gates as u16, off: (gates >> 16) as u16 },
    }
}

fn current_words(current: Abc) -> [u32; 3] {
    [current.a.to_bits(), current.b.to_bits(), current.c.to_bits()]
}

fn currents([a, b, c]: [u32; 3]) -> Abc {
    Abc { a: f32::from_bits(a), b: f32::from_bits(b), c: f32::from_bits(c) }
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
    use super::*;
    use crate::nine_switch::Scheme;

    #[test]
    fn what_is_sent_arrives() {
        let current = Abc { a: 1.5, b: -2.5, c: 1.0 };
        let sample = DualSample {
            currents_a: [current, Abc { a: 0.25, ..current }],
            angles: [Some(Angle(0x1234_5678)), None],
            capacitor_v: 533.5,
            inductor_a: -3.25,
            source_v: 400.0,
            demands: [
                MotorDemand::Speed(104.5),
                MotorDemand::Torque(Demand { torque_nm: -60.0, slew_limited: true }),
            ],
            link_ref_v: 667.0,
            scheme: Scheme::Zvo,
            enable: true,
        };
        assert_eq!(dual_sample_from_block(&dual_sample_to_block(&sample, true)), (sample, true));
        let power = PowerSample {
            currents_a: sample.currents_a,
            capacitor_v: 530.0,
            source_v: 399.0,
            gates: GateFeedback { on: 0x1A5, off: 0x05A },
        };
        assert_eq!(power_from_block(&power_to_block(&power)), power);
        let mut gates = [GateTicks { off_from: 1, off_to: 40_000 }; 9];
        gates[4] = GateTicks { off_from: 65_535, off_to: 65_535 };
        let report = DualReport { torque_nm: [1.0, -2.0], weakening: [false, true], ..DualReport::default() };
        for request in [
            DualRequest::Hello,
            DualRequest::ControlSample(Instant(7)),
            DualRequest::ControlReport(Instant(8), report),
            DualRequest::PowerSample(Instant(9)),
            DualRequest::Play(Instant(10), PlayedPeriod { gates }),
            DualRequest::GatesOff(Instant(11)),
            DualRequest::Dead,
        ] {
            assert_eq!(DualRequest::from_block(&request.to_block()), Some(request));
        }
        assert_eq!(DualRequest::from_block(&[99; BLOCK_WORDS]), None);
    }
}
