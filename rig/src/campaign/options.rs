//! The options of `campaign`.

use crate::ablation::Ablation;
use crate::machine::Machine;
use crate::scenario::traction::PatternsName;
use crate::shards::Shard;
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;

/// The options of a campaign.
#[derive(Args, Clone, Debug)]
pub struct CampaignOptions {
    /// A folder of tables/, or the path of any machine folder: the two-level drive's cases with this machine alone, with speeds, currents,
    /// voltages and line scaled to it; default the 180 kW machine, and the ZS9.
    #[arg(long, value_name = "MACHINE", conflicts_with_all = ["doc", "healthy", "random", "merge"])]
    pub machine: Option<String>,
    /// Each fault of each kind once in each mode, instead of every case.
    #[arg(long)]
    pub fast: bool,
    /// Only cases whose name (system, fault, speed in r/min, the ZS9's scheme, action) has each of these words.
    #[arg(long, value_name = "WORD", num_args = 1..)]
    pub only: Vec<String>,
    /// One protection off: a fault's name, short_circuit or leg_safe_state. The cases that are then lost are listed.
    #[arg(long, value_name = "PROTECTION")]
    pub without: Option<Ablation>,
    /// The pulse patterns of the two-level drive above the free carrier; default those of --machine, or the paper's.
    #[arg(long, value_enum)]
    pub patterns: Option<PatternsName>,
    /// Folder for campaign.csv and, of the listed faults, summary.json and report.html.
    #[arg(long, default_value = "target/tractive/campaign")]
    pub out: PathBuf,
    /// A document whose generated part is rewritten: the tables of the fast campaign, the totals of the full one, the coverage of the
    /// random one, separately for each set of patterns.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["only", "without"])]
    pub doc: Option<PathBuf>,
    /// Do not write the document; the exit code tells whether it is up to date.
    #[arg(long, requires = "doc")]
    pub check_doc: bool,
    /// Instead of faults: this many minutes of hard but healthy driving at random, in which nothing may trip.
    #[arg(long, value_name = "MINUTES", value_parser = crate::options::positive)]
    pub healthy: Option<f64>,
    /// With --healthy: the gates are also blocked and released now and then.
    #[arg(long, requires = "healthy")]
    pub blocks: bool,
    /// Instead of the listed cases: this many runs with machine, line, flaws, trajectory and fault drawn at random, by a Latin hypercube.
    #[arg(long, value_name = "RUNS", conflicts_with_all = ["fast", "only", "healthy", "without"])]
    pub random: Option<usize>,
    /// With --random: this run alone, minimised as far as it still fails.
    #[arg(long, value_name = "RUN", requires = "random", conflicts_with = "shard")]
    pub run: Option<usize>,
    /// Seed of the random draws.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Shard K of N, from 0: only its runs, written to the file shard-K-of-N.csv of the folder, from which --merge makes the whole.
    #[arg(long, value_name = "K/N", conflicts_with_all = ["doc", "json"])]
    pub shard: Option<Shard>,
    /// Instead of running anything: merges the shards that were run into these folders.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["shard", "doc", "only", "fast", "without", "healthy", "random"])]
    pub merge: Vec<PathBuf>,
    /// Print the totals as JSON.
    #[arg(long)]
    pub json: bool,
}

impl CampaignOptions {
    /// The machine of --machine.
    pub fn machine(&self) -> Result<Option<Machine>> {
        self.machine.as_deref().map(Machine::load).transpose()
    }

    /// The pulse patterns: the named ones, else those of the user's own machine.
    pub fn patterns(&self, machine: Option<&Machine>) -> PatternsName {
        let own = || machine.map_or(PatternsName::Paper, |machine| machine.folder.parameters.patterns.into());
        self.patterns.unwrap_or_else(own)
    }
}
