//! The numbers as the page of the documentation, `docs/cost.md`, and as plain text. The prose of the page is in the folder `page`.

use super::report::Report;
use super::system::Measured;
use super::tables;

const HEAD: &str = include_str!("page/head.md");
const PARTS: &str = include_str!("page/parts.md");
const LAWS: &str = include_str!("page/laws.md");
const BLOCKS: &str = include_str!("page/blocks.md");
const OTHERS: &str = include_str!("page/others.md");
const ENTRY: &str = include_str!("page/entry.md");

/// The whole page.
pub fn text(report: &Report) -> String {
    let mut text =
        [HEAD, &tables::modes(report).markdown(), "\n", &tables::images(report).markdown()].concat();
    text += PARTS;
    for measured in report.systems {
        text += &format!("\n{}", tables::by_parts(measured).markdown());
    }
    text += &[LAWS, &tables::laws(report).markdown(), BLOCKS, &tables::blocks(report).markdown()].concat();
    text += &[OTHERS, &tables::alike(report).markdown(), ENTRY, &tables::entries(report).markdown()].concat();
    let longest = report.systems.iter().map(|measured| {
        let cycles = measured.longest.map_or(0, |(_, cycles)| cycles);
        format!("{cycles} cycles in `{}`", measured.system.name)
    });
    text + &format!("\nControl's longest instruction: {}.\n", longest.collect::<Vec<_>>().join(", "))
}

/// For a terminal.
pub fn plain(report: &Report) -> String {
    let mut text = String::new();
    for measured in report.systems {
        text += &format!("\n{}: instructions, without the link to the rig\n\n", measured.system.name);
        for table in [tables::interrupts(measured), tables::loads(measured), tables::by_parts(measured)] {
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
    // The instruction for which the PWM interrupt may have to wait.
    if let Some((address, cycles)) = measured.longest {
        let name = measured.image.name_at(address);
        text += &format!("control's longest instruction: {cycles} cycles, at {address:#x} in {name}\n");
    }
    text
}
