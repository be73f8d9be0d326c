//! The tables of what was measured, for the page of the documentation and for a terminal.

use super::blocks::error;
use super::parts::{Group, Part, together};
use super::report::{Report, net};
use super::statistics::Spread;
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

/// The longest interrupts by the groups of their parts.
pub fn targets(report: &Report) -> Table {
    let [named, beyond, around] = Group::ALL.map(|group| format!(">{}", group.name()));
    let rows = report.systems.iter().flat_map(|measured| {
        measured.parts.iter().map(move |(name, parts)| {
            let budget = format!("{}.{name}-max", measured.system.name);
            let judged = report.judged.iter().find(|judged| judged.name == budget);
            let target = judged.map_or_else(String::new, |judged| judged.budget.target.to_string());
            let of = |group| together(parts.iter().filter(|part| part.group == group)).1.to_string();
            let longest = together(parts.iter()).1.to_string();
            let [named, beyond, around] = Group::ALL.map(of);
            vec![format!("{} {name}", measured.system.name), target, longest, named, beyond, around]
        })
    });
    Table::new(&["", ">target", ">longest", &named, &beyond, &around], rows)
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

/// The counts of each interrupt in each mode, by direction where the rig names one.
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

/// The parts of an interrupt by their groups, with sums.
pub fn by_parts(name: &str, parts: &[Part]) -> Table {
    let row = |name: String, mean: f64, longest: u32| vec![name, format!("{mean:.0}"), longest.to_string()];
    let sum = |name: &str, (mean, longest)| row(format!("**{name}**"), mean, longest);
    let mut rows = Vec::new();
    for group in Group::ALL {
        let of = || parts.iter().filter(move |part| part.group == group);
        rows.push(sum(group.name(), together(of())));
        rows.extend(of().map(|part| row(part.name.to_owned(), part.mean, part.longest)));
    }
    rows.push(sum("together", together(parts.iter())));
    Table::new(&[&format!("{name}, by its parts"), ">mean", ">in the longest"], rows)
}

/// The building blocks.
pub fn blocks(report: &Report) -> Table {
    let rows = report.blocks.iter().map(|block| {
        let numbers = [block.max, net(report.blocks, block), block.cycles].map(|number| number.to_string());
        [block.name.clone()].into_iter().chain(numbers).chain([error(block)]).collect()
    });
    Table::new(&["block", ">instructions", ">net", ">cycles", ">largest error"], rows)
}

/// From where each interrupt is entered, and how long it waits.
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

/// The table of what has a budget, and of its verdicts.
pub fn budgets(report: &Report) -> Table {
    let rows = report.judged.iter().map(|judged| {
        let (value, target) = (format!("{:.0}", judged.value), judged.budget.target.to_string());
        vec![judged.name.clone(), value, target, judged.verdict().name().to_owned()]
    });
    Table::new(&["", ">value", ">target", ""], rows)
}
