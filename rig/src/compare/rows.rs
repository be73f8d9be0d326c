//! The rows of the PMaSynRM drive: their runs, the numbers taken from these, and the way they are printed.

use super::outcome::{Cell, Outcomes, Row, cell, field, trips, verdict};
use crate::analysis::Figures;
use crate::mtpa_methods;
use crate::verdict::worst;

/// A row to be made.
pub struct Plan {
    pub quantity: &'static str,
    read: Read,
    /// The paper's statement on it.
    paper: &'static str,
    /// The reason if ours is not ahead.
    why: &'static str,
}

/// The way to a row's numbers.
enum Read {
    /// The runs by their words, and a law's numbers from them; if it has none, the fault that tripped it.
    Runs(fn() -> Vec<String>, fn(&Outcomes) -> Result<Cell, &'static str>),
    /// Figures of one run by their names, each with its decimals and its unit.
    Figures(&'static str, &'static [Figure]),
}

/// A figure's name, its decimals and its unit.
pub(super) type Figure = (&'static str, usize, &'static str);

impl Plan {
    /// A row of these runs on which the paper says nothing and in which ours is ahead.
    pub const fn of(
        quantity: &'static str,
        lines: fn() -> Vec<String>,
        read: fn(&Outcomes) -> Result<Cell, &'static str>,
    ) -> Self {
        Self { quantity, read: Read::Runs(lines, read), paper: "", why: "" }
    }

    /// The same for figures of one run.
    pub const fn figures(quantity: &'static str, line: &'static str, wanted: &'static [Figure]) -> Self {
        Self { quantity, read: Read::Figures(line, wanted), paper: "", why: "" }
    }

    /// The same with the paper's statement.
    pub const fn paper(self, paper: &'static str) -> Self {
        Self { paper, ..self }
    }

    /// The same with the reason why ours is not ahead.
    pub const fn why(self, why: &'static str) -> Self {
        Self { why, ..self }
    }

    /// The runs by their words.
    pub fn lines(&self) -> Vec<String> {
        match self.read {
            Read::Runs(lines, _) => lines(),
            Read::Figures(line, _) => words(&[line]),
        }
    }

    /// A law's numbers; if it has none, the fault that tripped it.
    pub fn read(&self, law: &Outcomes) -> Result<Cell, &'static str> {
        match self.read {
            Read::Runs(_, read) => read(law),
            Read::Figures(line, wanted) => figures(law, line, wanted),
        }
    }

    /// Both laws' results, and who is ahead.
    pub fn judge(&self, outcomes: &[Outcomes; 2]) -> Row {
        let [own, pi] = outcomes.each_ref().map(|law| self.read(law).unwrap_or_else(trips));
        let pairs = own.values.iter().zip(&pi.values);
        let ahead =
            own.values.iter().all(|value| value.is_finite()) && pairs.into_iter().all(|(own, pi)| own < pi);
        Row { quantity: self.quantity, found: [own.text, pi.text], paper: self.paper, ahead, why: self.why }
    }
}

/// A number with a given number of decimals.
pub(super) fn decimals(value: f64, count: usize) -> String {
    format!("{value:.count$}")
}

/// Figures of one run by their names, each with its decimals and its unit.
pub(super) fn figures(law: &Outcomes, line: &str, wanted: &[Figure]) -> Result<Cell, &'static str> {
    let found = law.figures(line)?;
    let values = wanted.iter().map(|(name, _, _)| found.number(name).ok_or("not seen"));
    let values = values.collect::<Result<Vec<_>, _>>()?;
    let texts = values.iter().zip(wanted).map(|(value, (_, count, unit))| {
        let gap = if unit.is_empty() { "" } else { " " };
        format!("{}{gap}{unit}", decimals(*value, *count))
    });
    Ok(Cell { text: texts.collect::<Vec<_>>().join(", "), values })
}

/// The numbers of one verdict over runs, each a number of its own.
fn of_verdict(outcomes: &Outcomes, lines: &[&str], what: &str) -> Result<Vec<f64>, &'static str> {
    outcomes.read(lines, |figures| verdict(figures, what))
}

pub(super) fn words(lines: &[&str]) -> Vec<String> {
    lines.iter().map(|line| (*line).to_owned()).collect()
}

const CHARACTERISTIC: &str = "characteristic";
const LOAD_STEPS: &str = "load-steps";
const SWEEPS: [&str; 3] =
    ["sweep --down", "sweep --down --brake --to 2300", "sweep --down --torque-scale 0.5 --to 6000"];
const SQUARE: &str = "sweep --to 6000";
const DEAD_TIME: &str = "steady --speed 200 --torque 100 --dead-time-us 5";
const RESTART: &str = "restart";
const LINK: &str = "link-steps";
const MAP: [&str; 2] = ["sweep --to 3000 --map-error 10", "sweep --to 3000 --map-error -10"];

/// Instants of the step within the carrier, in µs.
fn full_steps() -> Vec<String> {
    let delays = (0..550).step_by(50).chain([25, 75, 290, 310, 545]);
    delays.map(|delay_us| format!("full-step --pwm-delay-us {delay_us}")).collect()
}

/// All rows.
pub const ROWS: [Plan; 12] = [
    Plan::of(
        "torque at the characteristic points (figure 10)",
        || words(&[CHARACTERISTIC]),
        |law| {
            let error = |figures: &Figures| {
                worst(field(figures, "points", "torque_error_percent").into_iter().map(f64::abs))
            };
            let found = law.read(&[CHARACTERISTIC], error)?;
            Ok(Cell { text: format!("within {} %", decimals(found[0], 2)), values: found })
        },
    ).paper("within 5 %"),
    Plan::of(
        "efficiency there at 1,235 N·m and 200 r/min, at 1,174.6 N·m and 2,000 r/min, with 0.1 Ω and the losses of `machine.toml`",
        || words(&[CHARACTERISTIC]),
        |law| {
            let all = field(law.figures(CHARACTERISTIC)?, "points", "efficiency_percent");
            let (Some(slow), Some(fast)) = (all.first(), all.last()) else { return Err("not seen") };
            let text = format!("{} %, {} %", decimals(*slow, 2), decimals(*fast, 2));
            Ok(Cell { text, values: vec![100.0 - slow, 100.0 - fast] })
        },
    ).paper("at least 95 % at each"),
    Plan::of(
        "load steps at 200 r/min (figure 8), torque averaged over a carrier: t90, overshoot",
        || words(&[LOAD_STEPS]),
        |law| {
            let [t90, over] = ["t90 in ms", "overshoot"].map(|what| of_verdict(law, &[LOAD_STEPS], what));
            let values = [t90?, over?].concat();
            let text = format!("{} ms, {} %", decimals(values[0], 2), decimals(values[1], 1));
            Ok(Cell { text, values })
        },
    ).paper("no time; of the current no overshoot"),
    Plan::of(
        "full torque in one step at 200 r/min: t90, by where in the carrier it comes",
        full_steps,
        |law| {
            let lines = full_steps();
            let lines: Vec<_> = lines.iter().map(String::as_str).collect();
            let found = law.read(&lines, |figures| field(figures, "steps", "t90_ms").first().copied())?;
            let least = found.iter().copied().fold(f64::INFINITY, f64::min);
            let most = found.iter().copied().fold(0.0, f64::max);
            let text = format!("{} to {} ms", decimals(least, 2), decimals(most, 2));
            Ok(Cell { text, values: vec![least, most] })
        },
    ),
    Plan::of(
        "current when the mode changes, over the steady envelope (figure 9): motoring, braking, at half torque",
        || words(&SWEEPS),
        |law| Ok(cell(of_verdict(law, &SWEEPS, "current over the larger steady envelope")?, 1, "%")),
    ).paper("\"no shock\""),
    Plan::of(
        "torque when the mode changes, beyond its ripple: motoring, braking, at half torque",
        || words(&SWEEPS),
        |law| Ok(cell(of_verdict(law, &SWEEPS, "torque beyond the steady ripple band")?, 0, "N·m")),
    ),
    Plan::of(
        "square wave, 246.4 kW from 1,905 to 6,000 r/min: mean torque",
        || words(&[SQUARE]),
        |law| {
            let found = of_verdict(law, &[SQUARE], "mean torque error in square wave")?;
            Ok(Cell { text: format!("within {} %", decimals(found[0], 2)), values: found })
        },
    ),
    Plan::of(
        "MTPA in two passes at 200, 600, 859 and 1,235 N·m: torque, current above the least",
        Vec::new,
        mtpa,
    ),
    Plan::of(
        "dead time of 5 µs at 200 r/min and 100 N·m: 5th, 7th harmonic",
        || words(&[DEAD_TIME]),
        |law| {
            let of = |what: &str| of_verdict(law, &[DEAD_TIME], what);
            let harmonics = ["harmonic 5 in %", "harmonic 7 in %"].map(of);
            let [fifth, seventh] = harmonics;
            Ok(cell([fifth?, seventh?].concat(), 2, "%"))
        },
    ),
    Plan::of(
        "coasting caught at 2,000, 3,000 and 4,500 r/min, the last in square wave: current, and by how much torque is off a quarter of a second later",
        || words(&[RESTART]),
        |law| {
            let of = |name: &str| {
                let all = field(law.figures(RESTART)?, "catches", name);
                all.get(5..8).map(<[f64]>::to_vec).ok_or("not seen")
            };
            let off_nm = worst(of("final_error_nm")?.into_iter().map(f64::abs)).ok_or("not seen")?;
            let Cell { text, values } = cell(of("catching_current_a")?, 0, "A");
            Ok(Cell { text: format!("{text}; {} N·m", decimals(off_nm, 1)), values })
        },
    ).why("at 4,500 r/min the PIs take less current, and are late with the torque"),
    Plan::of(
        "link 200 V up and down at full torque, trip level 303 A: current",
        || words(&[LINK]),
        |law| {
            let peak = |figures: &Figures| figures.get("peak_current_a")?.as_f64();
            Ok(cell(law.read(&[LINK], peak)?, 0, "A"))
        },
    ),
    Plan::of(
        "flux map wrong by 10 %, −10 %: noticed as; current at most",
        || words(&MAP),
        |law| {
            let told = |figures: &Figures| figures.get("map_error_estimate_percent")?.as_f64();
            let peak = |figures: &Figures| figures.get("peak_current_a")?.as_f64();
            let (told, peak) = (law.read(&MAP, told)?, law.read(&MAP, peak)?);
            let noticed = if told.iter().all(|told| *told == 0.0) {
                "not at all".to_owned()
            } else {
                format!("{} %, {} %", decimals(told[0], 1), decimals(told[1], 1)).replace('-', "−")
            };
            let text = format!("{noticed}; {} A, {} A", decimals(peak[0], 0), decimals(peak[1], 0));
            Ok(Cell { text, values: peak })
        },
    ),
];

/// The method that the law runs; for the ordinary law also its method started from no current.
fn mtpa(law: &Outcomes) -> Result<Cell, &'static str> {
    let figures = mtpa_methods::compare(law.machine);
    let of = |method: &str| {
        let own = || figures.iter().filter(|one| one.method == method);
        let torque = worst(own().map(|one| one.torque_error_percent.abs())).ok_or("not seen")?;
        let current = worst(own().map(|one| one.excess_current_percent)).ok_or("not seen")?;
        Ok::<_, &'static str>([torque, current])
    };
    if law.law == 0 {
        return Ok(cell(of(mtpa_methods::OURS)?.to_vec(), 3, "%"));
    }
    let [previous, zero] = [of(mtpa_methods::PREVIOUS)?, of(mtpa_methods::ZERO)?];
    let text = format!(
        "{} %, {} %; from L(0, 0), as we read the paper, {} %, {} %",
        decimals(previous[0], 2),
        decimals(previous[1], 2),
        decimals(zero[0], 1),
        decimals(zero[1], 1)
    );
    Ok(Cell { text, values: previous.to_vec() })
}
