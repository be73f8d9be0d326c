//! The numbers as a table and as JSON.

use serde_json::{Value, json};

use super::blocks::Block;
use super::budget::Judged;
use super::statistics::{Row, Statistics};
use crate::elf::Sizes;

/// The modes in which pulses are made, and gates off, in the order of the table.
const MODES: [&str; 7] = ["async", "sync15", "sync12", "mid7", "mid3", "square", "off"];
const INTERRUPTS: [&str; 2] = ["control", "pwm"];

/// What was measured and judged.
pub struct Report<'a> {
    pub statistics: &'a Statistics,
    pub blocks: &'a [Block],
    pub sizes: &'a Sizes,
    pub judged: &'a [Judged],
}

/// Instructions of our own core tick.
pub fn core_tick(blocks: &[Block]) -> Option<u32> {
    blocks.iter().find(|block| block.name == "core_tick/tractive").map(|block| block.max)
}

impl Report<'_> {
    fn rows(&self) -> impl Iterator<Item = (&'static str, &'static str, &Row)> {
        let pairs = INTERRUPTS.into_iter().flat_map(|name| MODES.into_iter().map(move |mode| (mode, name)));
        pairs.filter_map(|(mode, name)| Some((mode, name, self.statistics.row(mode, name)?)))
    }

    /// As the contract of `timing --json` has it, and more.
    pub fn json(&self) -> Value {
        let interrupts: Vec<Value> = self
            .rows()
            .map(|(mode, name, row)| {
                json!({
                    "system": "pmasynrm", "name": name, "mode": mode, "calls": row.instructions.count,
                    "min": row.instructions.min, "mean": row.instructions.mean(), "max": row.instructions.max,
                    "cycles_mean": row.cycles.mean(), "cycles_max": row.cycles.max,
                    "latency_min": row.latency.min, "latency_max": row.latency.max,
                    "jitter": row.latency.max - row.latency.min, "depth": row.depth,
                })
            })
            .collect();
        let load: Vec<Value> = MODES
            .into_iter()
            .filter_map(|mode| {
                let load = self.statistics.load(mode)?;
                Some(json!({ "system": "pmasynrm", "mode": mode, "mean_percent": load.mean, "max_percent": load.max }))
            })
            .collect();
        let blocks: Vec<Value> = self
            .blocks
            .iter()
            .map(|block| {
                json!({
                    "name": block.name, "instructions": block.max, "mean": block.mean, "max_error": block.max_error,
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
        json!({
            "interrupts": interrupts,
            "load_at_170_mhz": load,
            "cycles_per_instruction": self.statistics.cycles_per_instruction(),
            "max_stator_frequency_hz": self.statistics.hertz,
            "core_tick": { "instructions": core_tick(self.blocks) },
            "blocks": blocks,
            "image": {
                "code_bytes": self.sizes.code, "table_bytes": self.sizes.tables, "ram_bytes": self.sizes.ram,
                "recorder_bytes": self.sizes.recorder, "stack_bytes": self.statistics.stack_bytes, "stack_left_bytes": self.sizes.stack,
            },
            "budgets": budgets,
        })
    }

    /// For people.
    pub fn table(&self) -> String {
        let mut text = format!(
            "{:<8} {:<7} {:>6} {:>6} {:>8} {:>6} {:>10} {:>8} {:>7} {:>6}\n",
            "", "mode", "calls", "min", "mean", "max", "cycles max", "latency", "jitter", "depth"
        );
        for (mode, name, row) in self.rows() {
            let (count, latency) = (&row.instructions, &row.latency);
            text += &format!(
                "{name:<8} {mode:<7} {:>6} {:>6} {:>8.1} {:>6} {:>10} {:>8} {:>7} {:>6}\n",
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
        text += &format!(
            "\ninstructions, without the link to the rig; up to {:.0} Hz stator frequency\n\
             cycles: upper bound, {:.2} an instruction on the mean\n\n{:<8} {:>12} {:>12}\n",
            self.statistics.hertz,
            self.statistics.cycles_per_instruction(),
            "170 MHz",
            "load, mean",
            "load, max"
        );
        for mode in MODES {
            if let Some(load) = self.statistics.load(mode) {
                text += &format!("{mode:<8} {:>10.1} % {:>10.1} %\n", load.mean, load.max);
            }
        }
        text += &format!("\n{:<24} {:>6} {:>8} {:>10}\n", "block", "max", "mean", "error");
        for block in self.blocks {
            let error = block.max_error.map_or_else(String::new, |error| format!("{error:.1e}"));
            text += &format!("{:<24} {:>6} {:>8.1} {error:>10}\n", block.name, block.max, block.mean);
        }
        text += &format!("\n{:<30} {:>9} {:>9} {:>9}\n", "budget", "value", "target", "ceiling");
        for judged in self.judged {
            text += &format!(
                "{:<30} {:>9.1} {:>9} {:>9}  {}\n",
                judged.name,
                judged.value,
                judged.budget.target,
                judged.budget.bound(),
                judged.verdict().name()
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::budget::judge;
    use crate::timing::drive::Drive;
    use crate::timing::meter::Call;

    fn statistics() -> Statistics {
        let call =
            |exception, instructions| Call { exception, instructions, cycles: 1_700, ..Call::default() };
        let served = |name: &str| (name.to_owned(), "mid7".to_owned(), 100.0);
        let drive = Drive {
            calls: vec![call(26, 7), call(24, 10), call(24, 20)],
            modes: vec![served("pwm"), served("control"), served("control")],
            stack_bytes: 640,
            ..Drive::default()
        };
        let mut statistics = Statistics::default();
        statistics.add(&drive).unwrap();
        statistics
    }

    #[test]
    fn the_json_holds_what_the_contract_names() {
        let statistics = statistics();
        let sizes = Sizes { code: 1, tables: 2, rodata: 3, ram: 4, recorder: 6, stack: 5 };
        let judged = judge("[a]\nb = { target = 1 }", &[("a.b", 2.0)]).unwrap();
        let block =
            Block { name: "core_tick/tractive".to_owned(), max: 120, mean: 110.0, max_error: Some(1e-7) };
        let report = Report { statistics: &statistics, blocks: &[block], sizes: &sizes, judged: &judged };
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
        assert!(report.table().contains("OVER"));
    }

    #[test]
    fn the_load_is_that_of_both_interrupts() {
        // 1,700 cycles ten thousand times a second are a tenth of 170 MHz; one PWM interrupt comes for two of control.
        let load = statistics().load("mid7").unwrap();
        assert!((load.mean - 15.0).abs() < 1e-9 && (load.max - 15.0).abs() < 1e-9);
        assert!(statistics().load("square").is_none());
    }
}
