//! `cargo rig figures`: the figures of both papers, each as this project makes it.

use crate::files::{make_folder, write_text};
use crate::machine::Machine;
use crate::options::positive;
use crate::pictures::architecture::architecture;
use crate::pictures::{chai, patterns, zs9};
use crate::run::bar;
use crate::scenario::catalogue::{of_traction, of_zs9};
use crate::scenario::traction::characteristic;
use crate::trace::Recording;
use crate::zs9::trace::Recording as Zs9Recording;
use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;
use tractive::nine_switch::Scheme;

/// The options of `figures`.
#[derive(clap::Args, Clone, Debug)]
pub struct FigureOptions {
    /// Folder for the pictures.
    #[arg(long, default_value = "target/tractive/figures")]
    pub out: PathBuf,
    /// Only these: names of pictures (zs9-24-35), figures by paper and number (chai-9), or a paper (zs9).
    #[arg(long, value_name = "NAME", num_args = 1..)]
    pub only: Vec<String>,
    /// Print the pictures' names and what they show, and draw none.
    #[arg(long)]
    pub list: bool,
    /// Write these next to each SVG, by rsvg-convert (Debian: librsvg2-bin).
    #[arg(long, value_enum, value_name = "FORMAT", num_args = 1.., value_delimiter = ',')]
    pub also: Vec<Format>,
    /// Pixels of a PNG for one of the SVG.
    #[arg(long, default_value_t = 2.0, value_parser = positive)]
    pub zoom: f64,
    /// Print the pictures as JSON: names, what they show, files.
    #[arg(long)]
    pub json: bool,
}

/// A format beside SVG.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Pixels.
    Png,
    /// Vectors, for a paper.
    Pdf,
}

impl Format {
    const fn name(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Pdf => "pdf",
        }
    }

    /// Makes the file of this format beside an SVG.
    fn convert(self, svg: &Path, zoom: f64) -> Result<()> {
        let mut convert = Command::new("rsvg-convert");
        convert.args(["--format", self.name(), "--keep-aspect-ratio", "--background-color", "white"]);
        // For vectors a zoom would only change the size on paper.
        if self == Self::Png {
            convert.args(["--zoom", &zoom.to_string()]);
        }
        let done = convert.arg("--output").arg(svg.with_extension(self.name())).arg(svg).output();
        let done =
            done.context("--also: rsvg-convert cannot be started (Debian: apt-get install librsvg2-bin)")?;
        ensure!(done.status.success(), "{}: {}", svg.display(), String::from_utf8_lossy(&done.stderr).trim());
        Ok(())
    }
}

/// The maker of a picture.
#[derive(Clone, Copy)]
pub enum Source {
    /// From tables and modulator alone.
    Drawn(fn(&Machines) -> Result<String>),
    /// From a run of this scenario, of the first paper's drive.
    Traction(&'static str, fn(&Recording, &Machine) -> Result<String>),
    /// From a run of this scenario, of the second paper's.
    Zs9(&'static str, fn(&Zs9Recording) -> Result<String>),
}

impl Source {
    /// The scenario with its options, if there is a run.
    pub const fn scenario(&self) -> Option<&'static str> {
        match self {
            Self::Drawn(_) => None,
            Self::Traction(line, _) | Self::Zs9(line, _) => Some(line),
        }
    }
}

/// The papers' two machines.
pub struct Machines {
    /// The first paper's.
    pub pmasynrm: Machine,
    /// One of the second paper's.
    pub ipm: Machine,
}

impl Machines {
    /// Both, from tables/.
    pub fn load() -> Result<Self> {
        Ok(Self { pmasynrm: Machine::load("pmasynrm-180kw")?, ipm: Machine::load("ipm-zs9")? })
    }
}

/// A picture: name, what it shows, and its maker.
pub struct Picture {
    /// Paper and number, `chai-9`; for a group that the paper's text refers to, its first and last, `zs9-24-35`. Without a paper if it is in none.
    pub name: &'static str,
    /// Its description in a list.
    pub what: &'static str,
    /// The maker.
    pub source: Source,
}

impl Picture {
    const fn of(name: &'static str, what: &'static str, source: Source) -> Self {
        Self { name, what, source }
    }

    /// The paper with the first and the last of its figures; `None` if it is in none.
    pub fn figures(&self) -> Option<(&'static str, u32, u32)> {
        let (paper, numbers) = self.name.split_once('-')?;
        let (first, last) = numbers.split_once('-').unwrap_or((numbers, numbers));
        Some((paper, first.parse().ok()?, last.parse().ok()?))
    }

    /// `true` if a word of `--only` refers to it.
    fn is_meant(&self, word: &str) -> bool {
        let within = |(paper, first, last): (&str, u32, u32)| {
            word == paper || (first..=last).any(|number| word == format!("{paper}-{number}"))
        };
        word == self.name || self.figures().is_some_and(within)
    }

    /// Its file's name.
    pub fn file(&self) -> String {
        format!("{}.svg", self.name)
    }
}

use Source::{Drawn, Traction, Zs9};

/// Every picture, in the papers' order.
pub const PICTURES: [Picture; 35] = [
    Picture::of("architecture", "Interrupts, cells, board and rig", Drawn(|_| architecture())),
    Picture::of("modes", "Line voltage of every mode", Drawn(|of| chai::modes::every_mode(&of.pmasynrm))),
    Picture::of("chai-1", "Current loci", Drawn(|of| chai::machine::loci(&of.pmasynrm))),
    Picture::of("chai-2", "Block diagram", Drawn(|_| chai::blocks::control())),
    Picture::of(
        "chai-3",
        "L_d over both currents",
        Drawn(|of| chai::machine::inductance(&of.pmasynrm, true)),
    ),
    Picture::of(
        "chai-4",
        "L_q over both currents",
        Drawn(|of| chai::machine::inductance(&of.pmasynrm, false)),
    ),
    Picture::of("chai-5", "MTPA in two look-ups", Drawn(|_| chai::blocks::mtpa())),
    Picture::of("chai-6", "Modes over frequency", Traction("sweep --to 3000", chai::modes::strategy)),
    Picture::of("chai-7", "Middle-60° pulses, 7 and 3", Drawn(|of| chai::modes::figure7(&of.pmasynrm))),
    Picture::of(
        "chai-8",
        "Load steps at 200 r/min",
        Traction("load-steps", |run, _| chai::runs::load_steps(run)),
    ),
    Picture::of(
        "chai-9",
        "Changes of mode at full torque",
        Traction("sweep --to 3000", |run, _| chai::runs::changes(run)),
    ),
    Picture::of("chai-10", "Torque accuracy, efficiency and current", Traction("characteristic", accuracy)),
    Picture::of("zs9-1", "Z-network, nine switches, two motors", Drawn(|_| zs9::blocks::circuit())),
    Picture::of("zs9-2", "Time-sharing", Drawn(|_| zs9::sequences::figure2())),
    Picture::of("zs9-3", "Vectors of either motor", Drawn(|_| zs9::vectors::figure3())),
    Picture::of("zs9-4", "S-SVPWM", Drawn(|_| zs9::sequences::figure4())),
    Picture::of("zs9-5", "RS-SVPWM", Drawn(|_| zs9::sequences::figure5_or_6(Scheme::Rs))),
    Picture::of("zs9-6", "RTHD-SVPWM", Drawn(|_| zs9::sequences::figure5_or_6(Scheme::Rthd))),
    Picture::of("zs9-7", "ZVO-SVPWM: which zero vector where", Drawn(|_| zs9::vectors::figure7())),
    Picture::of("zs9-8", "ZVO-SVPWM: sequences", Drawn(|_| zs9::sequences::figure8())),
    Picture::of(
        "zs9-9",
        "Shoot-through, and the link that it pulses",
        Drawn(|_| zs9::sequences::shoot_through(Scheme::Rthd)),
    ),
    Picture::of("zs9-10", "Control of the whole", Drawn(|_| zs9::blocks::control())),
    Picture::of("zs9-11", "Control of the link", Drawn(|_| zs9::blocks::link())),
    Picture::of("zs9-12", "Voltage ellipses and current circle", Drawn(|of| zs9::loci::limits(&of.ipm))),
    Picture::of("zs9-13", "Current loci", Drawn(|of| zs9::loci::ways(&of.ipm))),
    Picture::of("zs9-14-19", "Motor 2's load steps", Zs9("zs9-load-step", zs9::runs::load_step)),
    Picture::of("zs9-17", "Speed of motor 2 in it", Zs9("zs9-load-step", zs9::runs::load_step_speed)),
    Picture::of("zs9-20-23", "Motor 2 reverses", Zs9("zs9-reverse", zs9::runs::reverse)),
    Picture::of("zs9-23", "Speed of motor 2 in it", Zs9("zs9-reverse", zs9::runs::reverse_speed)),
    Picture::of("zs9-24-35", "The whole cycle", Zs9("zs9-cycle", zs9::runs::cycle)),
    Picture::of("zs9-36", "Torque and voltage over speed", Zs9("zs9-cycle", zs9::runs::over_speed)),
    Picture::of(
        "different-cycles",
        "Motors in different cycles",
        Zs9("zs9-cycle --second other --cruise 8", zs9::runs::cycle),
    ),
    Picture::of(
        "optimal-pulses",
        "Pulses of the optimised patterns",
        Drawn(|of| patterns::every_pulse(&of.pmasynrm)),
    ),
    Picture::of("optimal-spectra", "Their spectra", Drawn(|of| patterns::every_spectrum(&of.pmasynrm))),
    Picture::of(
        "optimal-distortion",
        "Their distortion beside that of the paper's modes",
        Drawn(|of| patterns::every_distortion(&of.pmasynrm)),
    ),
];

fn accuracy(recording: &Recording, machine: &Machine) -> Result<String> {
    let points = characteristic::points(recording, machine);
    chai::runs::accuracy(&points, machine.folder.parameters.rated_torque_nm)
}

/// The pictures that the words refer to; all if there are no words. The error names a word that refers to none.
fn chosen(only: &[String]) -> Result<Vec<&'static Picture>> {
    for word in only {
        let known = PICTURES.iter().any(|picture| picture.is_meant(word));
        let names: Vec<_> = PICTURES.iter().map(|picture| picture.name).collect();
        ensure!(known, "--only {word}: must be one of {}", names.join(", "));
    }
    let meant = |picture: &&Picture| only.is_empty() || only.iter().any(|word| picture.is_meant(word));
    Ok(PICTURES.iter().filter(meant).collect())
}

/// Pictures of the same run, or of none.
type Job = (Option<&'static str>, Vec<&'static Picture>);

/// The pictures by the runs that they need, the longest run first; those without one are jobs of their own.
fn jobs(pictures: &[&'static Picture]) -> Vec<Job> {
    let mut jobs: Vec<Job> = Vec::new();
    for picture in pictures {
        let scenario = picture.source.scenario();
        match jobs.iter_mut().find(|(known, _)| scenario.is_some() && *known == scenario) {
            Some((_, of)) => of.push(picture),
            None => jobs.push((scenario, vec![picture])),
        }
    }
    jobs.sort_by_key(|(scenario, _)| scenario.is_none());
    jobs
}

/// Draws the pictures of a job, each with its SVG.
fn draw(job: &Job, machines: &Machines) -> Result<Vec<(&'static Picture, String)>> {
    let mut runs: (Option<Recording>, Option<Zs9Recording>) = (None, None);
    let one = |picture: &&'static Picture| {
        let svg = match picture.source {
            Drawn(draw) => draw(machines)?,
            Traction(line, draw) => {
                if runs.0.is_none() {
                    runs.0 = Some(of_traction(line)?.drive(&machines.pmasynrm)?);
                }
                runs.0.as_ref().map(|run| draw(run, &machines.pmasynrm)).transpose()?.unwrap_or_default()
            }
            Zs9(line, draw) => {
                if runs.1.is_none() {
                    runs.1 = Some(of_zs9(line)?.drive(&machines.ipm)?);
                }
                runs.1.as_ref().map(draw).transpose()?.unwrap_or_default()
            }
        };
        Ok((*picture, svg))
    };
    job.1.iter().map(one).collect()
}

/// The pictures without a run, each with its SVG.
pub fn drawn() -> Result<Vec<(&'static Picture, String)>> {
    let machines = Machines::load()?;
    let without: Vec<_> = PICTURES.iter().filter(|picture| picture.source.scenario().is_none()).collect();
    let all: Vec<_> = jobs(&without).par_iter().map(|job| draw(job, &machines)).collect::<Result<_>>()?;
    Ok(all.into_iter().flatten().collect())
}

/// Writes the requested pictures.
pub fn run(options: &FigureOptions) -> Result<()> {
    let pictures = chosen(&options.only)?;
    if options.list {
        return tell(options, &pictures, |_| Vec::new());
    }
    make_folder(&options.out)?;
    let machines = Machines::load()?;
    let bar = bar(pictures.len() as u64, "figures [{bar:40}] {pos}/{len} {elapsed}");
    jobs(&pictures).par_iter().try_for_each(|job| {
        for (picture, svg) in draw(job, &machines)? {
            let file = options.out.join(picture.file());
            write_text(&file, &svg)?;
            options.also.iter().try_for_each(|format| format.convert(&file, options.zoom))?;
            bar.inc(1);
        }
        Ok::<(), anyhow::Error>(())
    })?;
    bar.finish_and_clear();
    let svg = |picture: &Picture| options.out.join(picture.file());
    tell(options, &pictures, |picture| {
        let also = options.also.iter().map(|format| svg(picture).with_extension(format.name()));
        std::iter::once(svg(picture)).chain(also).collect()
    })
}

/// Prints what was drawn, or with `--list` what is available.
fn tell(
    options: &FigureOptions,
    pictures: &[&Picture],
    files: impl Fn(&Picture) -> Vec<PathBuf>,
) -> Result<()> {
    if options.json {
        let row = |picture: &&Picture| {
            let figures = picture.figures().map(|(paper, first, last)| json!([paper, first, last]));
            json!({ "name": picture.name, "what": picture.what, "figures": figures, "files": files(picture) })
        };
        crate::say!("{}", serde_json::to_string(&pictures.iter().map(row).collect::<Vec<_>>())?);
    } else if options.list {
        pictures.iter().for_each(|picture| crate::say!("{:<12} {}", picture.name, picture.what));
    } else {
        crate::say!("{} figures: {}", pictures.len(), options.out.display());
    }
    Ok(())
}
