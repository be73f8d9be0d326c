//! The numbers as the page of the documentation, `docs/cost.md`, and as plain text. What the page says in words stands in the folder
//! `page`.

use super::report::Report;
use super::system::Measured;
use super::tables;

const HEAD: &str = include_str!("page/head.md");
const TARGETS: &str = include_str!("page/targets.md");
const GROUPS: &str = include_str!("page/groups.md");
const LAWS: &str = include_str!("page/laws.md");
const BLOCKS: &str = include_str!("page/blocks.md");
const ENTRY: &str = include_str!("page/entry.md");

/// The whole page.
pub fn text(report: &Report) -> String {
    let mut text = [HEAD, TARGETS, &tables::targets(report).markdown(), GROUPS].concat();
    for measured in report.systems {
        text += &format!("\n## Interrupts of `{}`\n", measured.system.name);
        let parts = measured.parts.iter().map(|(name, parts)| tables::by_parts(name, parts));
        for table in [tables::interrupts(measured), tables::loads(measured)].into_iter().chain(parts) {
            text += &format!("\n{}", table.markdown());
        }
    }
    text += &[LAWS, &tables::laws(report).markdown()].concat();
    text += &[BLOCKS, &tables::blocks(report).markdown(), ENTRY, &tables::entries(report).markdown(), "\n"]
        .concat();
    for measured in report.systems {
        let (system, cycles) = (measured.system.name, measured.longest.map_or(0, |(_, cycles)| cycles));
        text += &format!("- `{system}`: control's longest instruction takes {cycles} cycles.\n");
    }
    text + "\n## Budgets\n\n" + &tables::budgets(report).markdown()
}

/// For a terminal.
pub fn plain(report: &Report) -> String {
    let mut text = String::new();
    for measured in report.systems {
        let parts = measured.parts.iter().map(|(name, parts)| tables::by_parts(name, parts));
        text += &format!("\n{}: instructions, without the link to the rig\n\n", measured.system.name);
        for table in [tables::interrupts(measured), tables::loads(measured)].into_iter().chain(parts) {
            text += &format!("{}\n", table.plain());
        }
        text += &remarks(measured);
    }
    for table in
        [tables::laws(report), tables::entries(report), tables::blocks(report), tables::budgets(report)]
    {
        text += &format!("\n{}", table.plain());
    }
    text
}

fn remarks(measured: &Measured) -> String {
    let statistics = &measured.statistics;
    let mut text =
        format!("{:.2} cycles an instruction on the mean, at most\n", statistics.cycles_per_instruction());
    if statistics.hertz > 0.0 {
        text += &format!("up to {:.0} Hz stator frequency\n", statistics.hertz);
    }
    for function in &measured.masking {
        text += &format!("masks interrupts: {function}\n");
    }
    // Which instruction the PWM interrupt may have to wait for.
    if let Some((address, cycles)) = measured.longest {
        let name = measured.image.name_at(address);
        text += &format!("control's longest instruction: {cycles} cycles, at {address:#x} in {name}\n");
    }
    text
}
