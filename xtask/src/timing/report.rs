//! The report of all that was measured and judged, and the same as JSON.

use super::blocks::Block;
use super::budget::Judged;
use super::drive::DIRECTIONS;
use super::statistics::{Entry, Load, Row};
use super::system::{LawCost, Measured};
use serde_json::{Value, json};

const INTERRUPTS: [&str; 2] = ["control", "pwm"];

/// Everything that was measured and judged.
pub struct Report<'a> {
    pub systems: &'a [Measured],
    /// The control interrupt of each system under the papers' ordinary law.
    pub pi: &'a [LawCost],
    pub blocks: &'a [Block],
    pub judged: &'a [Judged],
}

/// The overhead of every block besides its own work.
pub const CALL: &str = "call/nothing";

/// Instructions of a block's work for its most expensive input.
pub fn net(blocks: &[Block], block: &Block) -> u32 {
    let call = blocks.iter().find(|block| block.name == CALL).map_or(0, |block| block.max);
    block.max.saturating_sub(call)
}

/// The values of the blocks that have a budget.
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

fn counts(row: &Row) -> Value {
    let Row { instructions, cycles, latency, depth } = row;
    json!({
        "calls": instructions.count, "min": instructions.min, "mean": instructions.mean(), "max": instructions.max,
        "cycles_mean": cycles.mean(), "cycles_max": cycles.max, "latency_min": latency.min,
        "latency_max": latency.max, "jitter": latency.max - latency.min, "depth": depth,
    })
}

impl Measured {
    /// The modes that were seen, in the order of the tables.
    pub fn modes(&self) -> Vec<&str> {
        self.statistics.modes(self.system.first_modes)
    }

    /// `true` for a part that either interrupt executes.
    pub fn has_part(&self, name: &str) -> bool {
        self.parts.iter().any(|(_, parts)| parts.iter().any(|part| part.name == name))
    }

    /// Interrupt, mode and what was counted in both directions together, in the order of the tables.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, &str, &Row)> {
        let pairs =
            INTERRUPTS.into_iter().flat_map(|name| self.modes().into_iter().map(move |mode| (name, mode)));
        pairs.filter_map(|(name, mode)| Some((name, mode, self.statistics.row(mode, None, name)?)))
    }

    /// Mode with direction, and what was counted there; nothing if the rig names no direction.
    pub fn directed(&self, interrupt: &str, mode: &str) -> impl Iterator<Item = (String, &Row)> {
        let row = move |direction| {
            Some((format!("{mode}, {direction}"), self.statistics.row(mode, Some(direction), interrupt)?))
        };
        DIRECTIONS.into_iter().filter_map(row)
    }

    /// Modes, each with its directions behind it, and the load.
    pub fn loads(&self) -> impl Iterator<Item = (String, Load)> {
        self.modes().into_iter().flat_map(move |mode| {
            let whole = self.statistics.load(mode, None).map(|load| (mode.to_owned(), load));
            let directed = DIRECTIONS.into_iter().filter_map(move |direction| {
                let load = self.statistics.load(mode, Some(direction))?;
                Some((format!("{mode}, {direction}"), load))
            });
            whole.into_iter().chain(directed)
        })
    }

    fn json_rows(&self) -> Vec<Value> {
        let row = |(name, mode, row): (&'static str, &str, &Row)| {
            let mut fields = counts(row);
            for (field, value) in [("system", self.system.name), ("name", name), ("mode", mode)] {
                fields[field] = value.into();
            }
            for direction in DIRECTIONS {
                if let Some(row) = self.statistics.row(mode, Some(direction), name) {
                    fields[direction] = counts(row);
                }
            }
            fields
        };
        self.rows().map(row).collect()
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
        let percent = |mode: &str, direction| {
            let Load { mean, max } = self.statistics.load(mode, direction)?;
            Some(json!({ "mean_percent": mean, "max_percent": max }))
        };
        let load = |mode: &str| {
            let mut load = percent(mode, None)?;
            (load["system"], load["mode"]) = (self.system.name.into(), mode.into());
            for direction in DIRECTIONS {
                if let Some(of) = percent(mode, Some(direction)) {
                    load[direction] = of;
                }
            }
            Some(load)
        };
        self.modes().into_iter().filter_map(load).collect()
    }

    fn json_parts(&self) -> Vec<Value> {
        let parts = self.parts.iter().flat_map(|(name, parts)| parts.iter().map(move |part| (name, part)));
        parts
            .map(|(name, part)| {
                json!({
                    "system": self.system.name, "interrupt": name, "part": part.name, "group": part.group.name(),
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
        let block = |block: &Block| {
            let net = net(self.blocks, block);
            json!({
                "name": block.name, "instructions": block.max, "net": net, "mean": block.mean,
                "cycles": block.cycles, "max_error": block.max_error,
            })
        };
        let judged = |judged: &Judged| {
            let Judged { name, value, budget } = judged;
            json!({ "name": name, "value": value, "budget": budget, "kept": judged.kept() })
        };
        let first = self.systems.first();
        let images = self.systems.iter().map(|measured| (measured.system.name, measured.json_image()));
        json!({
            "interrupts": all(Measured::json_rows),
            "parts": all(Measured::json_parts),
            "entries": all(Measured::json_entries),
            "load_at_170_mhz": all(Measured::json_load),
            "cycles_per_instruction": first.map(|measured| measured.statistics.cycles_per_instruction()),
            "max_stator_frequency_hz": first.map(|measured| measured.statistics.hertz),
            "core_tick": { "instructions": core_tick(self.blocks) },
            "blocks": self.blocks.iter().map(block).collect::<Vec<_>>(),
            "image": first.map(Measured::json_image),
            "images": images.collect::<std::collections::BTreeMap<_, _>>(),
            "budgets": self.judged.iter().map(judged).collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::budget::judge;
    use crate::timing::page;
    use crate::timing::system::tests::example;

    #[test]
    fn the_json_holds_what_the_contract_names() {
        let judged = judge("[pmasynrm]\ncontrol-max = 1", &[("pmasynrm.control-max", 2.0)]).unwrap();
        let name = "core_tick/tractive".to_owned();
        let block = Block { name, max: 120, mean: 110.0, cycles: 250, max_error: Some(1e-7) };
        let report = Report {
            systems: &[example()],
            pi: &[LawCost { mean: 900.0, max: 1_200 }],
            blocks: &[block],
            judged: &judged,
        };
        let json = report.json();
        let row = &json["interrupts"][0];
        assert_eq!(
            (&row["system"], &row["name"], &row["mode"]),
            (&json!("pmasynrm"), &json!("control"), &json!("mid7"))
        );
        assert_eq!((&row["min"], &row["mean"], &row["max"]), (&json!(10), &json!(15.0), &json!(20)));
        assert_eq!((&row["motoring"]["max"], &row["braking"]["min"]), (&json!(10), &json!(20)));
        assert_eq!(json["interrupts"][1]["name"], "pwm");
        assert!(json["interrupts"][1]["braking"].is_null());
        let load = &json["load_at_170_mhz"][0];
        assert!(load["max_percent"].is_number() && load["motoring"]["max_percent"].is_number());
        assert_eq!(json["core_tick"]["instructions"], 120);
        let block = &json["blocks"][0];
        assert_eq!((&block["instructions"], &block["max_error"]), (&json!(120), &json!(1e-7)));
        let image = &json["image"];
        assert_eq!([&image["code_bytes"], &image["table_bytes"], &image["ram_bytes"]], [1, 2, 4]);
        assert_eq!(image["stack_bytes"], 640);
        assert_eq!(json["parts"][0]["in_longest"], 20);
        let plain = page::plain(&report);
        assert!(plain.contains("OVER"));
        let plain = plain.split_whitespace().collect::<Vec<_>>().join(" ");
        for row in ["mid7, motoring 10 10 10 1700 0", "mid7, braking 20 20 20 1700 0"] {
            assert!(plain.contains(&format!("control {row}")), "{plain}");
        }
        assert!(plain.contains("what the papers' systems have 12 20 MTPA, two passes 12 20 "), "{plain}");
        let page = page::text(&report);
        assert!(page.contains("| pmasynrm | mid7 | 15 | 20 | 1700 | 7 | 7 | 1700 | 15 | 15 |"), "{page}");
        assert!(page.contains("| MTPA, two passes | 12 | 20 |"), "{page}");
        assert!(page.contains("| pmasynrm | 1 | 2 | 4 | 6 | 640 |"), "{page}");
    }
}
