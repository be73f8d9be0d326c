//! Gaps in the line, as at a section insulator. When motoring, the rotor's energy holds the link until the line is back; when braking, the
//! chopper takes what the line no longer takes. The line filter is 3 mH, 4 mF and 30 mΩ unless another one is chosen.

use super::line::{self, within};
use super::prelude::*;
use super::scaled::scaled_rpm;
use super::setup::udc_v;
use crate::bench::LinePlan;
use crate::plant::{DcLinkSettings, LineFilter, Source};
use tractive::machine::Ratings;
use tractive::operator::Request;

/// See the module.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Gaps;

/// A gap: speed in r/min, torque as a share of the largest, length in s.
const GAPS: [(f64, f64, f64); 11] = [
    (300.0, 1.0, 0.1),
    (1_000.0, 1.0, 0.5),
    (1_500.0, 1.0, 0.02),
    (1_500.0, 1.0, 0.1),
    (1_500.0, 1.0, 0.5),
    (1_500.0, 0.0, 0.5),
    (1_500.0, -1.0, 0.02),
    (1_500.0, -1.0, 0.5),
    (3_000.0, 1.0, 0.02),
    (3_000.0, 1.0, 0.5),
    (3_000.0, -1.0, 0.5),
];
/// Beginning of the first gap's stretch, in s; and times from each beginning until the speed is reached, torque is demanded, the line is lost.
const BEGIN_S: f64 = 1.3;
const SPEED_S: f64 = 0.3;
const TORQUE_S: f64 = 0.3;
const GAP_S: f64 = 0.7;
/// Times after a gap by which the torque is back, and at which the next stretch begins, in s.
const BACK_S: f64 = 0.3;
const AFTER_S: f64 = 0.5;
/// The usual line filter at 1,500 V.
const FILTER: LineFilter = LineFilter { inductance_h: 3e-3, resistance_ohm: 0.03, capacitance_f: 4e-3 };

/// Auxiliaries and losses of the inverter, 5 kW at 1,500 V.
const AUXILIARY_OHM: f64 = 450.0;

/// A gap in the run.
#[derive(Clone, Debug, Serialize)]
struct Gap {
    speed_rpm: f64,
    torque_share: f64,
    length_s: f64,
    /// Instant at which the line is lost, in s.
    at_s: f64,
    /// The lowest and the highest link voltage until the next gap's torque.
    link_least_v: f64,
    link_peak_v: f64,
    /// Largest braking torque, while the line is away, of a drive that was not to brake, in N·m.
    holding_nm: f64,
    /// Time from the line's return until the torque is back to its earlier value within a tenth of the largest torque, in s.
    back_s: f64,
    /// The mean torque afterwards less that before, over the largest torque.
    torque_error: f64,
    line_peak_a: f64,
}

/// The gaps with the times at which their stretches begin, in s.
fn stretches() -> impl Iterator<Item = (f64, (f64, f64, f64))> {
    GAPS.into_iter().scan(BEGIN_S, |begin_s, gap| {
        let at_s = *begin_s;
        *begin_s += GAP_S + gap.2 + AFTER_S;
        Some((at_s, gap))
    })
}

fn duration_s() -> f64 {
    BEGIN_S + GAPS.iter().map(|(.., length_s)| GAP_S + length_s + AFTER_S).sum::<f64>() + 0.2
}

fn request(t_s: f64, ratings: &Ratings) -> Request {
    let asked = stretches().find(|(begin_s, (.., length_s))| {
        within(&[(begin_s + TORQUE_S, begin_s + GAP_S + length_s + AFTER_S)], t_s)
    });
    Request {
        enable: t_s >= 1.0,
        charge: t_s >= 0.1,
        torque_nm: asked.map_or(0.0, |(_, (_, share, _))| share as f32 * ratings.max_torque_nm),
        ..Request::idle(ratings)
    }
}

/// The link behind the usual filter, with the same times and the same shares of voltage and power as the reference machine's.
pub(super) fn link(machine: &Machine, nominal_v: f64) -> DcLinkSettings {
    let link = line::scaled(machine);
    let ohms = link.precharge_ohm / line::LINK.precharge_ohm;
    DcLinkSettings {
        capacitance_f: FILTER.capacitance_f / ohms,
        auxiliary_ohm: AUXILIARY_OHM * ohms,
        source: Source {
            voltage_v: nominal_v,
            inductance_h: FILTER.inductance_h * ohms,
            resistance_ohm: FILTER.resistance_ohm * ohms,
            ..link.source
        },
        ..link
    }
}

fn gaps(recording: &Recording, machine: &Machine) -> Vec<Gap> {
    let largest_nm = machine.folder.parameters.max_torque_nm;
    stretches()
        .map(|(begin_s, (rpm, torque_share, length_s))| {
            let at_s = begin_s + GAP_S;
            let back_s = at_s + length_s;
            let all = analysis::window(recording, at_s, back_s + AFTER_S);
            let away = analysis::window(recording, at_s, back_s);
            let before_nm = mean(analysis::window(recording, at_s - 0.1, at_s), |row| row.te_nm);
            let after = analysis::window(recording, back_s + BACK_S, back_s + AFTER_S - 0.01);
            let off = |row: &&Row| (row.te_ref_nm - before_nm).abs() > 0.1 * largest_nm;
            let last_off = analysis::window(recording, back_s, back_s + AFTER_S - 0.01).iter().rfind(off);
            Gap {
                speed_rpm: scaled_rpm(rpm, machine),
                torque_share,
                length_s,
                at_s,
                link_least_v: all.iter().map(|row| row.udc_v).fold(f64::INFINITY, f64::min),
                link_peak_v: worst(all.iter().map(|row| row.udc_v)).unwrap_or(f64::NAN),
                holding_nm: if torque_share < 0.0 {
                    0.0
                } else {
                    away.iter().map(|row| -row.te_ref_nm).fold(0.0, f64::max)
                },
                back_s: last_off.map_or(0.0, |row| row.t_s - back_s),
                torque_error: (mean(after, |row| row.te_nm) - before_nm) / largest_nm,
                line_peak_a: worst(all.iter().map(|row| row.line_a.unwrap_or(0.0).abs())).unwrap_or(f64::NAN),
            }
        })
        .collect()
}

impl Scenario<Traction> for Gaps {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let speed = stretches()
            .flat_map(|(begin_s, (rpm, _, length_s))| {
                let rpm = scaled_rpm(rpm, machine);
                [(begin_s + SPEED_S, rpm), (begin_s + GAP_S + length_s + AFTER_S, rpm)]
            })
            .collect();
        let live = stretches()
            .flat_map(|(begin_s, (.., length_s))| {
                [(begin_s + GAP_S, false), (begin_s + GAP_S + length_s, true)]
            })
            .collect();
        let ratings = &machine.tables.ratings;
        let line = LinePlan {
            starts_charged: true,
            live,
            ..LinePlan::new(link(machine, udc_v(options, machine)), Box::new(|t_s| request(t_s, ratings)))
        };
        Plan::operated(duration_s(), speed, line)
    }

    fn figures(&self, recording: &Recording, _options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let ratings = &machine.tables.ratings;
        let gaps = gaps(recording, machine);
        let (trip_v, highest_v) = (f64::from(ratings.trip_dc_over_v), f64::from(ratings.dc_link_max_v));
        let (under_v, lowest_v) = (f64::from(ratings.trip_dc_under_v), f64::from(ratings.dc_link_min_v));
        let rise = worst(gaps.iter().map(|gap| (gap.link_peak_v - highest_v) / (trip_v - highest_v)));
        let fall = worst(gaps.iter().map(|gap| (lowest_v - gap.link_least_v) / (lowest_v - under_v)));
        let trip_a = machine.folder.parameters.trip_current_a;
        let peak = worst(recording.rows.iter().map(|row| row.peak_current_a() / trip_a));
        let largest_nm = machine.folder.parameters.max_torque_nm;
        let mut verdicts = line::verdicts(recording, &[]);
        verdicts.extend([
            Verdict::never("drive tripped", recording.trip().is_some()),
            Verdict::at_most("link's fall, of the way to its trip", fall, 0.9),
            Verdict::at_most("link's rise, of the way to its trip", rise, 0.95),
            Verdict::at_most(
                "braking that holds the link (share of the largest torque)",
                worst(gaps.iter().map(|gap| gap.holding_nm / largest_nm)),
                0.11,
            ),
            Verdict::at_most(
                "torque back after a gap in (s)",
                worst(gaps.iter().map(|gap| gap.back_s)),
                0.25,
            ),
            Verdict::at_most(
                "torque after a gap and before it (share)",
                worst(gaps.iter().map(|gap| gap.torque_error.abs())),
                0.01,
            ),
            Verdict::at_most("peak current over the trip level", peak, 1.0),
        ]);
        line::figures(&mut figures, recording);
        figures.set("gaps", gaps);
        figures.set("verdicts", verdicts);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        line::plots(page, recording);
        for (begin_s, (rpm, share, length_s)) in stretches() {
            let window = (begin_s + GAP_S - 0.02, begin_s + GAP_S + length_s + 0.2);
            let of = format!(
                "{rpm} r/min, {:.0} % of torque, {:.0} ms without line",
                100.0 * share,
                1e3 * length_s
            );
            let link: [Curve; 1] = [("udc", |row| row.udc_v)];
            page.plot_window((&of, "DC link", "V"), recording, window, &link);
            let torque: [Curve; 2] = [("after limits", |row| row.te_ref_nm), ("torque", |row| row.te_nm)];
            page.plot_window((&of, "torque", "N·m"), recording, window, &torque);
        }
    }
}
