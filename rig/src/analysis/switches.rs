//! Changes of mode, and a check for unnecessary ones.

use super::{carrier_averaged, most_turn_ons, window};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::trace::{Recording, Row, Switch};
use crate::verdict::{Verdict, bound, worst};
use serde::Serialize;
use tractive::modulation::Mode;

/// The effect of a mode change on the current.
#[derive(Clone, Debug, Serialize)]
pub struct SwitchFigures {
    /// The time, in s.
    pub t_s: f64,
    /// The mode that ended.
    pub from: &'static str,
    /// The mode that began.
    pub to: &'static str,
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Pulse angle, in degrees; absent if the old carrier was not locked.
    pub pulse_angle_deg: Option<f64>,
    /// Largest |phase current| from 2 ms before to 30 ms after, in A.
    pub peak_current_a: f64,
    /// Larger of the largest |phase current| 100 to 20 ms before and 60 to 140 ms after, in A.
    pub steady_current_a: f64,
    /// Excess of the first over the second, in percent.
    pub excess_percent: f64,
    /// Torque beyond the steady ripple band of the same windows, from 2 ms before to 30 ms after, in N·m.
    pub torque_excursion_nm: f64,
    /// The same for torque averaged over 1/900 s. That is not a whole number of ripple periods in every mode, so if the ripple changes its shape the
    /// value is too large.
    pub averaged_torque_excursion_nm: f64,
    /// The excess of current with the extremes at every gate edge, in percent: the extremes in rows vary by 1 to 2 % from turn to turn at a small
    /// torque. It is reported and not judged.
    pub edge_excess_percent: f64,
    /// The excursion of torque with these extremes, in N·m.
    pub edge_torque_excursion_nm: f64,
}

/// Time over which the torque of `averaged_torque_excursion_nm` is averaged, in s.
const CARRIER_S: f64 = 1.0 / 900.0;

/// Every switch between pulsing modes in the recording.
pub fn mode_switches(recording: &Recording) -> Vec<SwitchFigures> {
    recording
        .switches
        .iter()
        .filter(|switch| switch.is_between_pulses())
        .map(|switch| at_switch(recording, switch))
        .collect()
}

fn at_switch(recording: &Recording, switch: &Switch) -> SwitchFigures {
    let peak = |from_s: f64, to_s: f64| {
        let rows = window(recording, switch.t_s + from_s, switch.t_s + to_s);
        let larger =
            |(a, b): (f64, f64), row: &Row| (a.max(row.peak_current_a()), b.max(row.extremes.current_a));
        rows.iter().fold((0.0, 0.0), larger)
    };
    let (before, after, during) = (peak(-0.1, -0.02), peak(0.06, 0.14), peak(-0.002, 0.03));
    let (steady, now) = (before.0.max(after.0), during.0);
    let edges = during.1 / before.1.max(after.1);
    let instantaneous = |from_s: f64, to_s: f64| {
        let rows = window(recording, switch.t_s + from_s, switch.t_s + to_s);
        rows.iter().map(|row| row.te_nm - row.te_ref_nm).collect()
    };
    let at_edges = |from_s: f64, to_s: f64| {
        let rows = window(recording, switch.t_s + from_s, switch.t_s + to_s);
        let of = |row: &Row| [row.extremes.lowest_nm, row.extremes.highest_nm].map(|nm| nm - row.te_ref_nm);
        rows.iter().flat_map(of).collect()
    };
    let averaged = |from_s: f64, to_s: f64| {
        let window = (switch.t_s + from_s, switch.t_s + to_s);
        carrier_averaged(recording, window, CARRIER_S, |row| row.te_nm - row.te_ref_nm)
            .into_iter()
            .map(|(_, error)| error)
            .collect()
    };
    SwitchFigures {
        t_s: switch.t_s,
        from: switch.from.name(),
        to: switch.to.name(),
        speed_rpm: switch.speed_rpm,
        pulse_angle_deg: switch.pulse_angle_deg,
        peak_current_a: now,
        steady_current_a: steady,
        excess_percent: (now / steady - 1.0) * 100.0,
        torque_excursion_nm: excursion(instantaneous),
        averaged_torque_excursion_nm: excursion(averaged),
        edge_excess_percent: (edges - 1.0) * 100.0,
        edge_torque_excursion_nm: excursion(at_edges),
    }
}

/// The excursion of a torque error at a switch beyond its steady band before and after.
fn excursion(error_nm: impl Fn(f64, f64) -> Vec<f64>) -> f64 {
    let extent = |from_s: f64, to_s: f64| {
        let errors = error_nm(from_s, to_s);
        let low = errors.iter().copied().fold(f64::INFINITY, f64::min);
        (low, errors.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    };
    let (before, after, during) = (extent(-0.1, -0.02), extent(0.06, 0.14), extent(-0.002, 0.03));
    let (low, high) = (before.0.min(after.0), before.1.max(after.1));
    (low - during.0).max(during.1 - high).max(0.0)
}

/// Largest torque beyond the steady ripple band, as a share of the largest torque.
const EXCURSION: f64 = 25.0 / 1235.0;

/// The verdicts on every switch of mode.
pub fn switch_verdicts(
    switches: &[SwitchFigures],
    recording: &Recording,
    options: &RunOptions,
    machine: &Machine,
) -> Vec<Verdict> {
    let largest_nm = machine.folder.parameters.max_torque_nm;
    let excess = worst(switches.iter().map(|switch| switch.excess_percent));
    // With a wrong map the only requirement is that nothing trips.
    let most_excess = if options.map_error == 0.0 { bound(options, 1.5, 3.0) } else { f64::INFINITY };
    let torque_nm = worst(switches.iter().map(|switch| switch.torque_excursion_nm));
    let most_nm = bound(options, EXCURSION * largest_nm, f64::INFINITY);
    let (hunts, turn_ons) = (hunts(recording) as f64, most_turn_ons(recording, 0.1) as f64);
    // One more than the number of carriers, a fraction of one counted as one: turn-ons move within their carriers.
    let most_turn_ons = (machine.folder.parameters.max_switching_hz / 10.0).ceil() + 1.0;
    let current = "current over the larger steady envelope in %";
    let torque = "torque beyond the steady ripple band in N·m";
    let hunting = "hunting: switches back without a cause";
    vec![
        Verdict::at_most(current, excess, most_excess),
        Verdict::at_most(torque, torque_nm, most_nm),
        Verdict::at_most(hunting, hunts, 0.0),
        Verdict::at_most("turn-ons in 100 ms", turn_ons, most_turn_ons),
    ]
}

/// `true` if a switch goes up the ladder: the number of turn-ons decreases; a free carrier, which counts none, is at its foot. Patterns of as many turn-ons
/// follow each other in the order of their codes, to a larger modulation index.
fn is_up(from: Mode, to: Mode) -> bool {
    let turn_ons = |mode: Mode| mode.turn_ons().wrapping_sub(1);
    (turn_ons(to), from as u32) < (turn_ons(from), to as u32)
}

/// Switches that reverse the previous one although neither speed nor demand has gone back in between. At the power limit the demand falls while the
/// speed rises: that is no cause.
fn hunts(recording: &Recording) -> usize {
    const SPEED_SHARE: f64 = 0.005;
    const DEMAND_SHARE: f64 = 0.01;
    // The same from a point at which the demand turned in between.
    const TURNED_SHARE: f64 = 0.03;
    let counted: Vec<_> = recording.switches.iter().filter(|switch| switch.is_between_pulses()).collect();
    let taken_back = counted.windows(2).filter(|pair| pair[0].from == pair[1].to);
    let without_cause = taken_back.filter(|pair| {
        let between = window(recording, pair[0].t_s, pair[1].t_s);
        let (Some(first), Some(last)) = (between.first(), between.last()) else { return true };
        // Share by which each has moved in the direction of the second switch.
        let sign = if is_up(pair[1].from, pair[1].to) { 1.0 } else { -1.0 };
        let gone = |value: fn(&Row) -> f64| sign * (value(last) / value(first) - 1.0);
        let (speed, demand) = (gone(|row| row.speed_rpm.abs()), gone(|row| row.te_ref_nm));
        let turned = |row: &Row| sign * (last.te_ref_nm / row.te_ref_nm - 1.0);
        let turned = between.iter().map(turned).fold(demand, f64::max);
        let has_gone = demand > DEMAND_SHARE || turned > TURNED_SHARE;
        let demand_alone = has_gone && speed > -SPEED_SHARE;
        speed <= SPEED_SHARE && !demand_alone
    });
    without_cause.count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every mode of a ladder is above those before it, those with equal turn-ons as well.
    #[test]
    fn a_switch_goes_up_or_down_the_ladder() {
        let paper = [Mode::Async, Mode::Sync15, Mode::Sync12, Mode::Mid7, Mode::Mid3, Mode::Square];
        let patterns = Mode::ALL.into_iter().filter(|mode| mode.is_optimal());
        let optimal: Vec<_> = [Mode::Async].into_iter().chain(patterns).chain([Mode::Square]).collect();
        assert!(optimal.len() > 10);
        for ladder in [&paper[..], &optimal[..]] {
            for (k, lower) in ladder.iter().enumerate() {
                for higher in &ladder[k + 1..] {
                    assert!(is_up(*lower, *higher) && !is_up(*higher, *lower), "{lower:?}, {higher:?}");
                }
            }
        }
    }
}
