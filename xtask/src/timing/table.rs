//! The numbers for people: as plain text, and as the page of the documentation.

use std::fmt::Write as _;

use super::blocks::Block;
use super::report::{Report, net};
use super::statistics::Spread;
use super::system::Measured;

/// For a terminal.
pub fn plain(report: &Report) -> String {
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

fn error(block: &Block) -> String {
    block.max_error.map_or_else(String::new, |error| format!("{error:.1e}"))
}

fn interrupts(text: &mut String, measured: &Measured) {
    let statistics = &measured.statistics;
    let _ = writeln!(
        text,
        "\n{:<8} {:<15} {:>6} {:>6} {:>8} {:>6} {:>10} {:>8} {:>7} {:>6}",
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
        let (count, latency) = (&row.instructions, &row.latency);
        let _ = writeln!(
            text,
            "{name:<8} {mode:<15} {:>6} {:>6} {:>8.1} {:>6} {:>10} {:>8} {:>7} {:>6}",
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
    let _ = writeln!(
        text,
        "\ninstructions, without the link to the rig; cycles: upper bound, {:.2} an instruction on the mean",
        statistics.cycles_per_instruction()
    );
    if statistics.hertz > 0.0 {
        let _ = writeln!(text, "up to {:.0} Hz stator frequency", statistics.hertz);
    }
    let _ = writeln!(text, "\n{:<15} {:>12} {:>12}", "170 MHz", "load, mean", "load, max");
    for mode in measured.system.modes {
        if let Some(load) = statistics.load(mode) {
            let _ = writeln!(text, "{mode:<15} {:>10.1} % {:>10.1} %", load.mean, load.max);
        }
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
        for part in parts {
            let _ = writeln!(text, "{:<44} {:>8.1} {:>8}", part.name, part.mean, part.longest);
        }
        let (mean, longest) = totals(parts);
        let _ = writeln!(text, "{:<44} {mean:>8.1} {longest:>8}", "together");
    }
}

fn totals(parts: &[super::parts::Part]) -> (f64, u32) {
    (parts.iter().map(|part| part.mean).sum(), parts.iter().map(|part| part.longest).sum())
}

/// `docs/cost.md`.
pub fn page(report: &Report) -> String {
    let mut text = String::from(PAGE);
    text += "\n## Building blocks\n\n| block | instructions | net | cycles | largest error |\n|---|---:|---:|---:|---:|\n";
    for block in report.blocks {
        let net = net(report.blocks, block);
        let _ = writeln!(
            text,
            "| {} | {} | {net} | {} | {} |",
            block.name,
            block.max,
            block.cycles,
            error(block)
        );
    }
    for measured in report.systems {
        let _ = writeln!(
            text,
            "\n## Interrupts of `{}`\n\n| interrupt | mode | mean | max | cycles, max | waits at most |\n\
             |---|---|---:|---:|---:|---:|",
            measured.system.name
        );
        for (name, mode, row) in measured.rows() {
            let count = &row.instructions;
            let _ = writeln!(
                text,
                "| {name} | {mode} | {:.0} | {} | {} | {} |",
                count.mean(),
                count.max,
                row.cycles.max,
                row.latency.max
            );
        }
        for (name, parts) in &measured.parts {
            let _ = writeln!(text, "\n| {name}, by its parts | mean | in the longest |\n|---|---:|---:|");
            for part in parts {
                let _ = writeln!(text, "| {} | {:.0} | {} |", part.name, part.mean, part.longest);
            }
            let (mean, longest) = totals(parts);
            let _ = writeln!(text, "| together | {mean:.0} | {longest} |");
        }
    }
    text += ENTRY;
    text +=
        "\n| | interrupt | comes into | times | waits at least | at most |\n|---|---|---|---:|---:|---:|\n";
    for measured in report.systems {
        for entry in &measured.statistics.entries {
            let (system, Spread { min, max, count, .. }) = (measured.system.name, entry.latency);
            let _ = writeln!(
                text,
                "| {system} | {} | {} | {count} | {min} | {max} |",
                entry.interrupt, entry.from
            );
        }
    }
    text += "\n";
    for measured in report.systems {
        let cycles = measured.longest.map_or(0, |(_, cycles)| cycles);
        let _ = writeln!(
            text,
            "- `{}`: control's longest instruction takes {cycles} cycles.",
            measured.system.name
        );
    }
    text += "\n## Budgets\n\n| | value | target | |\n|---|---:|---:|---|\n";
    for judged in report.judged {
        let (name, target) = (&judged.name, judged.budget.target);
        let _ = writeln!(text, "| {name} | {:.0} | {target} | {} |", judged.value, judged.verdict().name());
    }
    text
}

const ENTRY: &str = "
## Entry

Instructions from the timer's event, when the interrupt becomes pending, to the first of the handler.

- The PWM interrupt waits for none, wherever it comes: `pwm-entry-spread`, the difference between its latest and its earliest entry, and
  `pwm-latency-max` are 0, or the command fails. It has the highest priority that is used, so it is never chained behind another handler.
- Nothing holds it off: no function of the image outside the link to the rig has an instruction that masks interrupts (CPSID, or MSR to
  PRIMASK, BASEPRI or FAULTMASK). `masking-functions` counts them; one is enough to fail.
- What is left is the instruction under way, which QEMU does not see, since an instruction is its unit of time: on a processor the entry
  moves by up to the cycles of the longest one less one, below. A load or store of several registers is broken off or continued later.
  `cargo xtask test --only landings` has it come at every instruction of control.
- Control waits where a PWM interrupt runs or comes at the same instant: at most the whole of it, and that is its jitter. In the ZS9
  control comes at valleys and the PWM interrupt at peaks, so they never meet there.
";

const PAGE: &str = "# What a tick costs

Written by `cargo xtask timing --write`; `cargo xtask timing` fails when a number has moved by more than 5 %.

Instructions are counted in QEMU from the first of a handler to its return, without the link to the rig and without what a
higher interrupt executed in between. Cycles are the Cortex-M4's documented timings applied to what was executed, each at its
worst: no load pipelined behind another, three cycles for every branch that is taken, every result of the floating-point unit
wanted by the next instruction.

The worst cases are provoked: a switch of mode, a fault and the limit of the current in one control interrupt; phase currents that are
wrong for the first time at the very boundary where the modulator switches, at every switch of the drive; in the ZS9 a fault of either
interrupt with both motors at their limits in field weakening; an operator who commands. The flight recorder is always on. A scheme of
the ZS9 is a number in each command, so its change is nothing of its own.

Preemption is two deep: idle, control, PWM; [Entry](#entry) says who waits for whom. The stack is what control takes at most and what the
PWM interrupt takes at most, as if one came where the other is deepest.

Blocks stand beside those of crates one could pick instead, built into the same image and run on the same inputs. Of
`core_tick` ours has a saturated flux map in it (three duties from phase currents and angle); `foc` is fixed point, and neither
it nor `fluxkit` has a map. `call/nothing` is what every block has besides its work, the net number is without it; a `lookup_2d` is two
bilinear look-ups at one point, which in the interrupts are never calls.

## What stands between the interrupts and their targets

The targets of the control interrupt are about three core ticks. What it does besides is in the tables by parts, and each line of
them is a thing that the drive would have to give up:

- the least current for the torque, in two passes over 2-D maps of saturated parameters, with its voltage to know whether the field
  must be weakened, and the points of the voltage limit where it must;
- the flux predicted for the boundary where a voltage can act, from the pulses that are committed until then: records of the
  modulator, volt-seconds of the rest of the running half and of the next one, the pattern's ripple at two boundaries;
- the disturbance that the pulses leave unexplained, with its sixth harmonic, and the map's error;
- the trim of mean torque, the envelope, the link's window;
- the protections, the flight recorder, and cells that no preemption tears.

What is left is without detours: the tables are constants of the image that the compiler knows, directions come from a table with
one turn to the very angle, half-way angles and six times an angle are turned instead of computed anew, a point's flux is looked up
once, as is a boundary that is the sample, records are read where they lie, where a mode leads no ripple none is made, what changes at
a carrier's boundary alone is computed there, square roots go from register to register, and a voltage comes with its length. The
longest control interrupt is one at the current limit in field weakening in which the mode changes.

The worst cases are provoked: wrong phase currents at every boundary where the mode switches, faults of the ZS9 in weakening, an operator
who commands. The longest so provoked was 2,293 and 4,197 of the ZS9 before these detours were gone; 2,276 and 3,668 are left.

In the ZS9 the same law runs twice, once a motor, beside the link's control. What both interrupts make is made in the tasks' own memory,
and what is told afterwards is put together out of line: so the stack holds either the control law or the report.
";
