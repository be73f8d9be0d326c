//! The tables of what was measured, for the page of the documentation and for a terminal.

use super::blocks::error;
use super::parts::{self, Group, Part, together};
use super::report::{Report, net};
use super::statistics::{Row, Spread};
use super::system::{LawCost, Measured};

/// A table of text.
pub struct Table {
    /// The names of its columns; one that begins with `>` holds numbers.
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        Self { head: head.iter().map(|&name| name.to_owned()).collect(), rows: rows.into_iter().collect() }
    }

    /// As Markdown, and whatever is emphasised there.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | ")).replace("|  |", "| |");
        let names: Vec<_> = self.head.iter().map(|name| name.trim_start_matches('>').to_owned()).collect();
        let rule = |name: &String| if name.starts_with('>') { "---:" } else { "---" };
        let rules: Vec<_> = self.head.iter().map(rule).collect();
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("{}|{}|\n{rows}", line(&names), rules.join("|"))
    }

    /// Aligned by spaces.
    pub fn plain(&self) -> String {
        let bare = |cell: &String| cell.replace("**", "").trim_start_matches('>').to_owned();
        let rows: Vec<Vec<String>> =
            [&self.head].into_iter().chain(&self.rows).map(|row| row.iter().map(bare).collect()).collect();
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: Vec<_> = (0..self.head.len()).map(width).collect();
        let cell = |(column, text): (usize, &String)| {
            let width = widths[column];
            if self.head[column].starts_with('>') {
                format!("{text:>width$}")
            } else {
                format!("{text:<width$}")
            }
        };
        let line = |row: &Vec<String>| row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ");
        rows.iter().map(|row| format!("{}\n", line(row).trim_end())).collect()
    }
}

/// Both interrupts of all systems in each mode, instructions next to cycles, and the processor load they cause.
pub fn modes(report: &Report) -> Table {
    let row = |(measured, mode): (&Measured, &str)| {
        let of = |interrupt| measured.statistics.row(mode, None, interrupt);
        let counts = |row: &Row| {
            let Row { instructions, cycles, .. } = row;
            [format!("{:.0}", instructions.mean()), instructions.max.to_string(), cycles.max.to_string()]
        };
        let (control, pwm) = (counts(of("control")?), counts(of("pwm")?));
        let load = measured.statistics.load(mode, None)?;
        let load = [load.mean, load.max].map(|percent| format!("{percent:.0}"));
        let names = [measured.system.name, mode].map(str::to_owned);
        Some(names.into_iter().chain(control).chain(pwm).chain(load).collect())
    };
    let modes = |measured| Measured::modes(measured).into_iter().map(move |mode| (measured, mode));
    let head = ["", "mode", ">control, mean", ">at most", ">cycles", ">PWM, mean", ">at most", ">cycles"];
    let head = [&head[..], &[">load, %", ">at most"]].concat();
    Table::new(&head, report.systems.iter().flat_map(modes).filter_map(row))
}

/// Bytes that each image takes, and the longest waits of its interrupts.
pub fn images(report: &Report) -> Table {
    let rows = report.systems.iter().map(|measured| {
        let sizes = &measured.image.sizes;
        let stack = u64::from(measured.statistics.stack_bytes().unsigned_abs());
        let bytes = [sizes.code, sizes.tables, sizes.ram, sizes.recorder, stack].map(|size| size.to_string());
        [measured.system.name.to_owned()].into_iter().chain(bytes).collect()
    });
    Table::new(&["bytes", ">code", ">tables", ">RAM", ">flight recorder", ">stack"], rows)
}

/// The work that a tick of a plain field-oriented controller takes in this drive: parts of the mean control interrupt, and the block.
pub fn alike(report: &Report) -> Table {
    let parts = ["entry and board", "protection", "speed from the angle"];
    let mut sum = 0.0;
    let mut rows = Vec::new();
    let control = report.systems.first().and_then(|measured| measured.parts.first());
    for part in control.iter().flat_map(|(_, all)| all).filter(|part| parts.contains(&part.name)) {
        sum += part.mean;
        rows.push(vec![part.name.to_owned(), format!("{:.0}", part.mean)]);
    }
    for block in report.blocks.iter().filter(|block| block.name == "duty_tick/tractive") {
        sum += block.mean;
        rows.push(vec![format!("`{}`", block.name), format!("{:.0}", block.mean)]);
    }
    rows.push(vec!["**together**".to_owned(), format!("{sum:.0}")]);
    Table::new(&["part", ">instructions, mean"], rows)
}

/// The control interrupt of each system under either law.
pub fn laws(report: &Report) -> Table {
    let rows = report.systems.iter().zip(report.pi).flat_map(|(measured, pi)| {
        let row = |law: &str, cost: &LawCost| {
            let name = measured.system.name.to_owned();
            vec![name, law.to_owned(), format!("{:.0}", cost.mean), cost.max.to_string()]
        };
        let own = LawCost::of(&measured.statistics);
        [row("ours", &own), row("the papers' ordinary one, `--law pi`", pi)]
    });
    Table::new(&["", "law", ">mean in the dearest mode", ">longest"], rows)
}

/// The counts of each interrupt in each mode, by direction if the rig names one.
pub fn interrupts(measured: &Measured) -> Table {
    let rows = measured.rows().flat_map(|(name, mode, row)| {
        let mut rows: Vec<_> = measured.directed(name, mode).collect();
        if rows.is_empty() {
            rows.push((mode.to_owned(), row));
        }
        rows.into_iter().map(move |(mode, row)| {
            let Spread { min, max, .. } = row.instructions;
            let numbers = [row.cycles.max, row.latency.max].map(|number| number.to_string());
            let mean = format!("{:.0}", row.instructions.mean());
            let [cycles, latency] = numbers;
            vec![name.to_owned(), mode, min.to_string(), mean, max.to_string(), cycles, latency]
        })
    });
    Table::new(&["interrupt", "mode", ">min", ">mean", ">max", ">cycles, max", ">waits at most"], rows)
}

/// The load of the processor in each mode.
pub fn loads(measured: &Measured) -> Table {
    let rows = measured
        .loads()
        .map(|(mode, load)| vec![mode, format!("{:.0}", load.mean), format!("{:.0}", load.max)]);
    Table::new(&["mode", ">load, %", ">at most"], rows)
}

/// The parts of a system's interrupts by their groups, with sums.
pub fn by_parts(measured: &Measured) -> Table {
    let cells = |name: String, within: &dyn Fn(&Part) -> bool| {
        let sums = measured.parts.iter().map(|(_, parts)| together(parts.iter().filter(|part| within(part))));
        let sums = sums.flat_map(|(mean, longest)| [format!("{mean:.0}"), longest.to_string()]);
        [name].into_iter().chain(sums).collect::<Vec<_>>()
    };
    let mut rows = Vec::new();
    for group in Group::ALL {
        rows.push(cells(format!("**{}**", group.name()), &|part| part.group == group));
        for name in parts::names(group).filter(|name| measured.has_part(name)) {
            rows.push(cells(name.to_owned(), &|part| part.name == name));
        }
    }
    rows.push(cells("**together**".to_owned(), &|_| true));
    let columns =
        measured.parts.iter().flat_map(|(name, _)| [format!(">{name}, mean"), ">in the longest".to_owned()]);
    let head: Vec<_> = [measured.system.name.to_owned()].into_iter().chain(columns).collect();
    Table::new(&head.iter().map(String::as_str).collect::<Vec<_>>(), rows)
}

/// The building blocks.
pub fn blocks(report: &Report) -> Table {
    let rows = report.blocks.iter().map(|block| {
        let numbers = [block.max, net(report.blocks, block), block.cycles].map(|number| number.to_string());
        [block.name.clone()].into_iter().chain(numbers).chain([error(block)]).collect()
    });
    Table::new(&["block", ">instructions", ">net", ">cycles", ">largest error"], rows)
}

/// The places from which each interrupt is entered, and how long it waits.
pub fn entries(report: &Report) -> Table {
    let entries = report.systems.iter().flat_map(|measured| {
        measured.statistics.entries.iter().map(move |entry| (measured.system.name, entry))
    });
    let rows = entries.map(|(system, entry)| {
        let Spread { min, max, count, .. } = entry.latency;
        let words = [system, entry.interrupt, entry.from].map(str::to_owned);
        words.into_iter().chain([count.to_string(), min.to_string(), max.to_string()]).collect()
    });
    Table::new(&["", "interrupt", "comes into", ">times", ">waits at least", ">at most"], rows)
}

/// The table of values that have a budget, and whether it is kept.
pub fn budgets(report: &Report) -> Table {
    let rows = report.judged.iter().map(|judged| {
        let (value, budget) = (judged.value.ceil().to_string(), judged.budget.to_string());
        let verdict = if judged.kept() { "ok" } else { "OVER" };
        vec![judged.name.clone(), value, budget, verdict.to_owned()]
    });
    Table::new(&["", ">value", ">budget", ""], rows)
}
