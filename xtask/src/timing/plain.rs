//! The numbers as plain text.

use std::fmt::Write as _;

use super::blocks::error;
use super::parts::{Group, together};
use super::report::{Report, net};
use super::statistics::Spread;
use super::system::Measured;

/// For a terminal.
pub fn text(report: &Report) -> String {
    let mut text = String::new();
    for measured in report.systems {
        interrupts(&mut text, measured);
        entries(&mut text, measured);
        parts(&mut text, measured);
    }
    let _ = writeln!(
        text,
        "\n{:<24} {:>6} {:>6} {:>8} {:>7} {:>10}",
        "block", "max", "net", "mean", "cycles", "error"
    );
    for block in report.blocks {
        let _ = writeln!(
            text,
            "{:<24} {:>6} {:>6} {:>8.1} {:>7} {:>10}",
            block.name,
            block.max,
            net(report.blocks, block),
            block.mean,
            block.cycles,
            error(block)
        );
    }
    let _ = writeln!(text, "\n{:<30} {:>9} {:>9} {:>9}", "budget", "value", "target", "ceiling");
    for judged in report.judged {
        let _ = writeln!(
            text,
            "{:<30} {:>9.1} {:>9} {:>9}  {}",
            judged.name,
            judged.value,
            judged.budget.target,
            judged.budget.bound(),
            judged.verdict().name()
        );
    }
    text
}

fn interrupts(text: &mut String, measured: &Measured) {
    let statistics = &measured.statistics;
    let _ = writeln!(
        text,
        "\n{:<8} {:<18} {:>6} {:>6} {:>8} {:>6} {:>10} {:>8} {:>7} {:>6}",
        measured.system.name,
        "mode",
        "calls",
        "min",
        "mean",
        "max",
        "cycles max",
        "latency",
        "jitter",
        "depth"
    );
    for (name, mode, row) in measured.rows() {
        let whole = (mode.to_owned(), row);
        for (mode, row) in [whole].into_iter().chain(measured.directed(name, mode)) {
            let (count, latency) = (&row.instructions, &row.latency);
            let _ = writeln!(
                text,
                "{name:<8} {mode:<18} {:>6} {:>6} {:>8.1} {:>6} {:>10} {:>8} {:>7} {:>6}",
                count.count,
                count.min,
                count.mean(),
                count.max,
                row.cycles.max,
                latency.max,
                latency.max - latency.min,
                row.depth,
            );
        }
    }
    let _ = writeln!(
        text,
        "\ninstructions, without the link to the rig; cycles: upper bound, {:.2} an instruction on the mean",
        statistics.cycles_per_instruction()
    );
    if statistics.hertz > 0.0 {
        let _ = writeln!(text, "up to {:.0} Hz stator frequency", statistics.hertz);
    }
    let _ = writeln!(text, "\n{:<18} {:>12} {:>12}", "170 MHz", "load, mean", "load, max");
    for (mode, load) in measured.loads() {
        let _ = writeln!(text, "{mode:<18} {:>10.1} % {:>10.1} %", load.mean, load.max);
    }
}

fn entries(text: &mut String, measured: &Measured) {
    let _ = writeln!(text, "\n{:<8} {:<10} {:>6} {:>6} {:>6}", "entered", "from", "times", "min", "max");
    for entry in &measured.statistics.entries {
        let Spread { min, max, count, .. } = entry.latency;
        let _ = writeln!(text, "{:<8} {:<10} {count:>6} {min:>6} {max:>6}", entry.interrupt, entry.from);
    }
    for function in &measured.masking {
        let _ = writeln!(text, "masks interrupts: {function}");
    }
    let _ = writeln!(text, "{}", longest(measured));
}

/// Which instruction the PWM interrupt may have to wait for.
fn longest(measured: &Measured) -> String {
    let Some((address, cycles)) = measured.longest else { return String::new() };
    let function = measured.image.function_at(address).and_then(|start| measured.image.functions.get(&start));
    let name = function.and_then(|function| function.names.first()).map_or("?", String::as_str);
    format!("control's longest instruction: {cycles} cycles, at {address:#x} in {name}")
}

fn parts(text: &mut String, measured: &Measured) {
    for (name, parts) in &measured.parts {
        let _ = writeln!(
            text,
            "\n{:<44} {:>8} {:>8}",
            format!("{} {name}, by its parts", measured.system.name),
            "mean",
            "longest"
        );
        for group in Group::ALL {
            let of = || parts.iter().filter(move |part| part.group == group);
            for part in of() {
                let _ = writeln!(text, "  {:<42} {:>8.1} {:>8}", part.name, part.mean, part.longest);
            }
            let (mean, longest) = together(of());
            let _ = writeln!(text, "{:<44} {mean:>8.1} {longest:>8}", group.name());
        }
        let (mean, longest) = together(parts.iter());
        let _ = writeln!(text, "{:<44} {mean:>8.1} {longest:>8}", "together");
    }
}
