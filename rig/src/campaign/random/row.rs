//! A random run as a row of a CSV: its outcome, then what was drawn.

use crate::campaign::Outcome;
use crate::campaign::drawn::{Drawn, Run};
use crate::campaign::traction::random::DIMENSIONS;
use crate::shards::{Merged, csv_row};
use anyhow::{Context, Result, bail};

impl Run {
    /// The head of the CSV.
    pub fn columns() -> String {
        let names = DIMENSIONS.map(|dimension| format!("drawn_{}", dimension.name)).join(",");
        format!("{},seed,modes,region,{names}", Outcome::COLUMNS)
    }

    /// Its row.
    pub fn row(&self) -> Result<String> {
        let Drawn { seed, modes, region, values, .. } = &self.drawn;
        let values = values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        Ok(format!("{},{seed},{modes},{region},{values}", csv_row(&self.outcome)?))
    }

    /// The runs of a whole campaign.
    pub fn of(merged: &Merged) -> Result<Vec<Self>> {
        let outcomes: Vec<Outcome> = merged.read()?;
        let runs = (0..).zip(outcomes).zip(&merged.rows);
        runs.map(|((run, outcome), row)| Ok(Self { outcome, drawn: Drawn::read(run, row)? })).collect()
    }
}

impl Drawn {
    /// The last columns of a row.
    fn read(run: usize, row: &str) -> Result<Self> {
        let mut last: Vec<&str> = row.rsplitn(DIMENSIONS.len() + 4, ',').collect();
        last.reverse();
        let [_, seed, modes, region, values @ ..] = last.as_slice() else {
            bail!("run {run}: too few columns")
        };
        let values = values.iter().map(|value| value.parse()).collect::<Result<_, _>>();
        Ok(Self {
            run,
            seed: seed.parse().with_context(|| format!("run {run}: {seed}"))?,
            modes: (*modes).to_owned(),
            region: (*region).to_owned(),
            values: values.with_context(|| format!("run {run}"))?,
        })
    }
}
