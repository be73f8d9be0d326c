//! What was measured and judged, and the same as JSON.

use serde_json::{Value, json};

use super::blocks::Block;
use super::budget::Judged;
use super::statistics::{Entry, Row};
use super::system::Measured;

const INTERRUPTS: [&str; 2] = ["control", "pwm"];

/// What was measured and judged.
pub struct Report<'a> {
    pub systems: &'a [Measured],
    pub blocks: &'a [Block],
    pub judged: &'a [Judged],
}

/// What every block has besides its work.
pub const CALL: &str = "call/nothing";

/// Instructions of a block's work on its dearest input.
pub fn net(blocks: &[Block], block: &Block) -> u32 {
    let call = blocks.iter().find(|block| block.name == CALL).map_or(0, |block| block.max);
    block.max.saturating_sub(call)
}

/// What has a budget among the blocks.
pub fn blocks(blocks: &[Block]) -> Vec<(String, f64)> {
    let ours = |work: &str| blocks.iter().find(|block| block.name == format!("{work}/tractive"));
    let count =
        |block: Option<&Block>, of: &dyn Fn(&Block) -> u32| block.map_or(f64::NAN, |block| of(block).into());
    vec![
        ("bench.core-tick".to_owned(), count(ours("core_tick"), &|block| block.max)),
        ("bench.sin-cos".to_owned(), count(ours("sin_cos"), &|block| block.max)),
        ("bench.lookup-2d-net".to_owned(), count(ours("lookup_2d"), &|block| net(blocks, block))),
    ]
}

/// Instructions of our own core tick.
pub fn core_tick(blocks: &[Block]) -> Option<u32> {
    blocks.iter().find(|block| block.name == "core_tick/tractive").map(|block| block.max)
}

impl Measured {
    /// Interrupt, mode and what was counted, in the order of the tables.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, &'static str, &Row)> {
        let pairs =
            INTERRUPTS.into_iter().flat_map(|name| self.system.modes.iter().map(move |mode| (name, *mode)));
        pairs.filter_map(|(name, mode)| Some((name, mode, self.statistics.row(mode, name)?)))
    }

    fn json_rows(&self) -> Vec<Value> {
        let system = self.system.name;
        self.rows()
            .map(|(name, mode, row)| {
                json!({
                    "system": system, "name": name, "mode": mode, "calls": row.instructions.count,
                    "min": row.instructions.min, "mean": row.instructions.mean(), "max": row.instructions.max,
                    "cycles_mean": row.cycles.mean(), "cycles_max": row.cycles.max,
                    "latency_min": row.latency.min, "latency_max": row.latency.max,
                    "jitter": row.latency.max - row.latency.min, "depth": row.depth,
                })
            })
            .collect()
    }

    fn json_entries(&self) -> Vec<Value> {
        let entry = |entry: &Entry| {
            json!({
                "system": self.system.name, "interrupt": entry.interrupt, "from": entry.from,
                "times": entry.latency.count, "min": entry.latency.min, "max": entry.latency.max,
            })
        };
        self.statistics.entries.iter().map(entry).collect()
    }

    fn json_load(&self) -> Vec<Value> {
        let load = |mode: &&'static str| {
            let load = self.statistics.load(mode)?;
            let system = self.system.name;
            Some(
                json!({ "system": system, "mode": mode, "mean_percent": load.mean, "max_percent": load.max }),
            )
        };
        self.system.modes.iter().filter_map(load).collect()
    }

    fn json_parts(&self) -> Vec<Value> {
        let parts = self.parts.iter().flat_map(|(name, parts)| parts.iter().map(move |part| (name, part)));
        parts
            .map(|(name, part)| {
                json!({
                    "system": self.system.name, "interrupt": name, "part": part.name,
                    "mean": part.mean, "in_longest": part.longest,
                })
            })
            .collect()
    }

    fn json_image(&self) -> Value {
        let sizes = &self.image.sizes;
        json!({
            "code_bytes": sizes.code, "table_bytes": sizes.tables, "ram_bytes": sizes.ram,
            "recorder_bytes": sizes.recorder,
            "stack_bytes": self.statistics.stack_bytes(), "stack_left_bytes": sizes.stack,
        })
    }
}

impl Report<'_> {
    /// As the contract of `timing --json` has it, and more. `image` is the first system's.
    pub fn json(&self) -> Value {
        let all = |of: fn(&Measured) -> Vec<Value>| self.systems.iter().flat_map(of).collect::<Vec<_>>();
        let blocks: Vec<Value> = self
            .blocks
            .iter()
            .map(|block| {
                json!({
                    "name": block.name, "instructions": block.max, "net": net(self.blocks, block), "mean": block.mean, "cycles": block.cycles,
                    "max_error": block.max_error,
                })
            })
            .collect();
        let budgets: Vec<Value> = self
            .judged
            .iter()
            .map(|judged| {
                json!({
                    "name": judged.name, "value": judged.value, "target": judged.budget.target,
                    "ceiling": judged.budget.bound(), "verdict": judged.verdict().name(),
                })
            })
            .collect();
        let first = self.systems.first();
        let images = self.systems.iter().map(|measured| (measured.system.name, measured.json_image()));
        let images: serde_json::Map<String, Value> =
            images.map(|(name, image)| (name.to_owned(), image)).collect();
        json!({
            "interrupts": all(Measured::json_rows),
            "parts": all(Measured::json_parts),
            "entries": all(Measured::json_entries),
            "load_at_170_mhz": all(Measured::json_load),
            "cycles_per_instruction": first.map(|measured| measured.statistics.cycles_per_instruction()),
            "max_stator_frequency_hz": first.map(|measured| measured.statistics.hertz),
            "core_tick": { "instructions": core_tick(self.blocks) },
            "blocks": blocks,
            "image": first.map(Measured::json_image),
            "images": images,
            "budgets": budgets,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::budget::judge;
    use crate::timing::system::tests::example;
    use crate::timing::table;

    #[test]
    fn the_json_holds_what_the_contract_names() {
        let judged = judge("[a]\nb = { target = 1 }", &[("a.b", 2.0)]).unwrap();
        let name = "core_tick/tractive".to_owned();
        let block = Block { name, max: 120, mean: 110.0, cycles: 250, max_error: Some(1e-7) };
        let report = Report { systems: &[example()], blocks: &[block], judged: &judged };
        let json = report.json();
        let row = &json["interrupts"][0];
        assert_eq!(
            (&row["system"], &row["name"], &row["mode"]),
            (&json!("pmasynrm"), &json!("control"), &json!("mid7"))
        );
        assert_eq!((&row["min"], &row["mean"], &row["max"]), (&json!(10), &json!(15.0), &json!(20)));
        assert_eq!(json["interrupts"][1]["name"], "pwm");
        assert_eq!(json["core_tick"]["instructions"], 120);
        let block = &json["blocks"][0];
        assert_eq!((&block["instructions"], &block["max_error"]), (&json!(120), &json!(1e-7)));
        let image = &json["image"];
        assert_eq!([&image["code_bytes"], &image["table_bytes"], &image["ram_bytes"]], [1, 2, 4]);
        assert_eq!(image["stack_bytes"], 640);
        assert_eq!(json["parts"][0]["in_longest"], 20);
        assert!(table::plain(&report).contains("OVER"));
        assert!(table::page(&report).contains("| control | mid7 | 15 | 20 | 1700 | 0 |"));
    }
}
