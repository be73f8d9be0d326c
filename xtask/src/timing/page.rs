//! The numbers as the page of the documentation, `docs/cost.md`. What it says in words stands in the folder `page`.

use std::fmt::Write as _;

use super::blocks::error;
use super::parts::{Group, Part, together};
use super::report::{Report, net};
use super::statistics::Spread;
use super::system::Measured;

const HEAD: &str = include_str!("page/head.md");
const TARGETS: &str = include_str!("page/targets.md");
const GROUPS: &str = include_str!("page/groups.md");
const BLOCKS: &str = include_str!("page/blocks.md");
const ENTRY: &str = include_str!("page/entry.md");

/// The whole of it.
pub fn text(report: &Report) -> String {
    let mut text = [HEAD, TARGETS].concat();
    targets(&mut text, report);
    text += GROUPS;
    for measured in report.systems {
        interrupts(&mut text, measured);
        loads(&mut text, measured);
        for (name, parts) in &measured.parts {
            by_parts(&mut text, name, parts);
        }
    }
    text += BLOCKS;
    blocks(&mut text, report);
    text += ENTRY;
    entries(&mut text, report);
    budgets(&mut text, report);
    text
}

/// The longest interrupts by the groups of their parts.
fn targets(text: &mut String, report: &Report) {
    let [named, beyond, around] = Group::ALL.map(Group::name);
    let _ = writeln!(
        text,
        "| | target | longest | {named} | {beyond} | {around} |\n|---|---:|---:|---:|---:|---:|"
    );
    for measured in report.systems {
        for (name, parts) in &measured.parts {
            let budget = format!("{}.{name}-max", measured.system.name);
            let judged = report.judged.iter().find(|judged| judged.name == budget);
            let target = judged.map_or_else(String::new, |judged| judged.budget.target.to_string());
            let of = |group| together(parts.iter().filter(|part| part.group == group)).1;
            let (_, longest) = together(parts.iter());
            let [named, beyond, around] = Group::ALL.map(of);
            let _ = writeln!(
                text,
                "| {} {name} | {target} | {longest} | {named} | {beyond} | {around} |",
                measured.system.name
            );
        }
    }
}

fn interrupts(text: &mut String, measured: &Measured) {
    let _ = writeln!(
        text,
        "\n## Interrupts of `{}`\n\n| interrupt | mode | min | mean | max | cycles, max | waits at most |\n\
         |---|---|---:|---:|---:|---:|---:|",
        measured.system.name
    );
    for (name, mode, row) in measured.rows() {
        let mut rows: Vec<_> = measured.directed(name, mode).collect();
        if rows.is_empty() {
            rows.push((mode.to_owned(), row));
        }
        for (mode, row) in rows {
            let Spread { min, max, .. } = row.instructions;
            let (mean, cycles, latency) = (row.instructions.mean(), row.cycles.max, row.latency.max);
            let _ = writeln!(text, "| {name} | {mode} | {min} | {mean:.0} | {max} | {cycles} | {latency} |");
        }
    }
}

fn loads(text: &mut String, measured: &Measured) {
    *text += "\n| mode | load, % | at most |\n|---|---:|---:|\n";
    for (mode, load) in measured.loads() {
        let _ = writeln!(text, "| {mode} | {:.0} | {:.0} |", load.mean, load.max);
    }
}

fn by_parts(text: &mut String, name: &str, parts: &[Part]) {
    let _ = writeln!(text, "\n| {name}, by its parts | mean | in the longest |\n|---|---:|---:|");
    for group in Group::ALL {
        let of = || parts.iter().filter(move |part| part.group == group);
        let (mean, longest) = together(of());
        let _ = writeln!(text, "| **{}** | {mean:.0} | {longest} |", group.name());
        for part in of() {
            let _ = writeln!(text, "| {} | {:.0} | {} |", part.name, part.mean, part.longest);
        }
    }
    let (mean, longest) = together(parts.iter());
    let _ = writeln!(text, "| **together** | {mean:.0} | {longest} |");
}

fn blocks(text: &mut String, report: &Report) {
    *text += "| block | instructions | net | cycles | largest error |\n|---|---:|---:|---:|---:|\n";
    for block in report.blocks {
        let (name, max, net, cycles) = (&block.name, block.max, net(report.blocks, block), block.cycles);
        let _ = writeln!(text, "| {name} | {max} | {net} | {cycles} | {} |", error(block));
    }
}

fn entries(text: &mut String, report: &Report) {
    *text +=
        "| | interrupt | comes into | times | waits at least | at most |\n|---|---|---|---:|---:|---:|\n";
    for measured in report.systems {
        for entry in &measured.statistics.entries {
            let (system, Spread { min, max, count, .. }) = (measured.system.name, entry.latency);
            let (interrupt, from) = (entry.interrupt, entry.from);
            let _ = writeln!(text, "| {system} | {interrupt} | {from} | {count} | {min} | {max} |");
        }
    }
    *text += "\n";
    for measured in report.systems {
        let (system, cycles) = (measured.system.name, measured.longest.map_or(0, |(_, cycles)| cycles));
        let _ = writeln!(text, "- `{system}`: control's longest instruction takes {cycles} cycles.");
    }
}

fn budgets(text: &mut String, report: &Report) {
    *text += "\n## Budgets\n\n| | value | target | |\n|---|---:|---:|---|\n";
    for judged in report.judged {
        let (name, target) = (&judged.name, judged.budget.target);
        let _ = writeln!(text, "| {name} | {:.0} | {target} | {} |", judged.value, judged.verdict().name());
    }
}
