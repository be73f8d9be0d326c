//! The systems, and the scenarios that they are driven through.

use super::drive::{Bench, Drive, Served, is_link};
use super::entry;
use super::parts::{self, Part};
use super::profile::{self, Profile};
use super::statistics::{INTERRUPTS, Statistics};
use super::tally::Tally;
use crate::elf::Image;
use crate::setup::Toolchain;
use crate::{build, process};
use anyhow::{Context, Result, bail};
use indicatif::ParallelProgressIterator;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Both directions of torque and of rotation through every mode, up to the highest stator frequency, with dead time that has to be compensated.
const DRIVES: [&str; 2] = ["--to=6000 --dead-time-us=3", "--to=-6000 --brake --dead-time-us=3"];
/// An operator who commands, motoring and braking.
const OPERATED: [&str; 2] = ["--to=6000 --operated", "--to=6000 --brake --operated"];
/// Then short ones: the PWM timer starts this much later relative to the control timer, in µs. Halves of the asynchronous carrier last five control
/// periods and five ninths, so they meet nine phases, 11 µs apart; these phases lie in between. A demand that is not a number ends these drives.
const PHASES_US: [f64; 3] = [3.0, 6.0, 9.0];
const SHORT_S: f64 = 0.02;
/// Time from the run's beginning to the scenario's, in control periods.
const LEAD_PERIODS: usize = 100;
const CONTROL_S: f64 = 1e-4;
/// Time from the first frozen sample to the fault, in control periods.
const FROZEN_PERIODS: f64 = 19.0;

/// The ZS9 in every scheme; each drive motors, weakens the field and brakes. Also with two carrier periods a control period, and with a fault of either
/// interrupt at the end. The faults come while both motors weaken the field at their limits.
const DUAL_DRIVES: [&str; 8] = [
    "--scheme=s",
    "--scheme=rs",
    "--scheme=rthd",
    "--scheme=zvo",
    "--scheme=s --carrier-hz=20000 --uin=800",
    "--scheme=s --inject=sensor-frozen-2@0.115",
    "--scheme=zvo --inject=leg-stuck-on@0.115",
    "--scheme=zvo --carrier-hz=20000 --uin=800 --inject=leg-stuck-on@0.115",
];

/// The number of the first of them, which have no fault.
const HEALTHY_DUAL_DRIVES: usize = 5;

/// An operator's talk up to full torque and field weakening.
const DUAL_TALK: &str = "rig/scripts/zs9-timing.talk";

/// A system of the repository.
#[derive(Clone, Copy, Debug)]
pub struct System {
    /// As in `--json`.
    pub name: &'static str,
    pub build: build::System,
    scenario: &'static str,
    /// The modes that its tables begin with; the others follow in the order in which the drives reached them.
    pub first_modes: &'static str,
}

impl System {
    pub const ALL: [Self; 2] = [
        Self { name: "pmasynrm", build: build::System::Traction, scenario: "timing", first_modes: "" },
        Self {
            name: "zs9",
            build: build::System::Zs9,
            scenario: "zs9-timing",
            first_modes: "s-motoring s-weakening s-braking rs-motoring rs-weakening rs-braking rthd-motoring \
                rthd-weakening rthd-braking zvo-motoring zvo-weakening zvo-braking",
        },
    ];

    /// Builds the image and drives it.
    pub fn measure(self, toolchain: &Toolchain, rig: &Path, qemu: &Path) -> Result<Measured> {
        let path = build::image(toolchain, self.build, None)?;
        let bench = Bench::of(rig, qemu, &["run", self.scenario], path)?;
        let mut sum = Sum::default();
        match self.build {
            build::System::Traction => traction(&bench, &mut sum)?,
            build::System::Zs9 => {
                // Commanded over the protocol.
                let talk = build::root().join(DUAL_TALK);
                let talked =
                    Bench { command: vec!["talk".to_owned(), talk.display().to_string()], ..bench.clone() };
                let driven = DUAL_DRIVES.map(|options| (&bench, options.to_owned()));
                let talked = (&talked, "--system=zs9 --inertia=0.02".to_owned());
                let drives = drive_all("zs9", &[&driven[..], &[talked]].concat())?;
                for drive in &drives {
                    sum.add(drive)?;
                }
                drives.iter().take(DUAL_DRIVES.len()).for_each(|drive| sum.profile(drive));
            }
        }
        Measured::new(self, bench.path, bench.image, sum)
    }

    /// The cost of the papers' ordinary law: motoring and braking through every mode, without a provoked fault.
    pub fn under_pi(self, toolchain: &Toolchain, rig: &Path, qemu: &Path) -> Result<LawCost> {
        let path = build::pi_image(toolchain, self.build, None)?;
        let bench = Bench::of(rig, qemu, &["run", self.scenario, "--law", "pi"], path)?;
        let drives = match self.build {
            build::System::Traction => &DRIVES[..],
            build::System::Zs9 => &DUAL_DRIVES[..HEALTHY_DUAL_DRIVES],
        };
        let plan: Vec<_> = drives.iter().map(|options| (&bench, (*options).to_owned())).collect();
        let mut statistics = Statistics::default();
        for drive in drive_all("pi", &plan)? {
            statistics.add(&drive)?;
        }
        Ok(LawCost::of(&statistics))
    }
}

/// The cost of an identification: the whole experiment, with dead time.
pub fn identification(toolchain: &Toolchain, rig: &Path, qemu: &Path) -> Result<Statistics> {
    let path = build::identify_image(toolchain, None)?;
    let bench = Bench::of(rig, qemu, &["identify"], path)?;
    let mut statistics = Statistics::default();
    for drive in drive_all("identify", &[(&bench, "--inertia=3 --dead-time-us=5".to_owned())])? {
        statistics.add(&drive)?;
    }
    Ok(statistics)
}

/// The control interrupt's instructions under a law: the mean in its most expensive mode, and the most.
#[derive(Clone, Copy, Debug, Default)]
pub struct LawCost {
    pub mean: f64,
    pub max: u32,
}

impl LawCost {
    /// By what was measured.
    pub fn of(statistics: &Statistics) -> Self {
        statistics.of("control").fold(Self::default(), |cost, row| Self {
            mean: cost.mean.max(row.instructions.mean()),
            max: cost.max.max(row.instructions.max),
        })
    }
}

fn traction(bench: &Bench, sum: &mut Sum) -> Result<()> {
    let phases =
        PHASES_US.map(|phase_us| format!("--to=6000 --pwm-delay-us={phase_us} --fault-at={SHORT_S}"));
    let plan = |options: Vec<String>| options.into_iter().map(|options| (bench, options)).collect::<Vec<_>>();
    let ordinary = DRIVES.iter().chain(&OPERATED).map(|options| (*options).to_owned());
    let drives = drive_all("pmasynrm", &plan(ordinary.chain(phases).collect()))?;
    let mut provoked = Vec::new();
    for (options, drive) in DRIVES.iter().zip(&drives) {
        // A switch of mode, a fault and full torque at the limit of the current, all in one tick. Frozen currents are detected only after a number of
        // periods, and of all faults they cost the most: the whole control law is executed as well.
        let freezes_s = switches_s(drive).into_iter().map(|switch_s| switch_s - FROZEN_PERIODS * CONTROL_S);
        provoked.extend(freezes_s.map(|freeze_s| format!("{options} --freeze-at={freeze_s:.6}")));
        // The same for the PWM interrupt: phase currents that are wrong for the first time at the boundary itself.
        let boundaries_s = switching_boundaries_s(drive).into_iter();
        provoked.extend(boundaries_s.map(|boundary_s| format!("{options} --offset-at={boundary_s:.6}")));
    }
    if provoked.is_empty() {
        bail!("the drive never switched its mode");
    }
    for drive in drives.iter().chain(&drive_all("pmasynrm", &plan(provoked))?) {
        sum.add(drive)?;
    }
    drives.iter().take(DRIVES.len()).for_each(|drive| sum.profile(drive));
    Ok(())
}

/// Runs each of them with its options, as many at once as there are processors; the results are in their order.
fn drive_all(system: &'static str, plan: &[(&Bench, String)]) -> Result<Vec<Drive>> {
    let drives = plan.par_iter().progress_with(process::bar(system, plan.len())).map(|(bench, options)| {
        let drive = bench.drive(&options.split(' ').collect::<Vec<_>>());
        drive.with_context(|| format!("{} {options}", bench.command.join(" ")))
    });
    drives.collect()
}

/// For each boundary where the modulator changes from one mode with pulses to another, an instant just after the last control sample before it, in the
/// scenario's time: there only the PWM interrupt sees what comes.
fn switching_boundaries_s(drive: &Drive) -> Vec<f64> {
    let [(_, control), _] = INTERRUPTS;
    let depths: Vec<_> =
        drive.calls.iter().filter(|call| call.exception == control).map(|call| call.depth).collect();
    let (mut samples, mut last, mut found) = (0, "off", Vec::new());
    for Served { interrupt, mode, .. } in &drive.served {
        if interrupt == "control" {
            samples += 1;
            continue;
        }
        if last != "off" && mode != "off" && mode != last {
            // The list is in the order in which the interrupts end: a control interrupt that was interrupted has sampled before.
            let sampled = samples + usize::from(depths.get(samples).is_some_and(|depth| *depth > 1));
            found.push((sampled as f64 + 0.02 - LEAD_PERIODS as f64) * CONTROL_S);
        }
        last = mode;
    }
    found
}

/// The instants at which control begins to work for another mode with pulses, coming from one with pulses, in the scenario's time: the middle of the
/// period before that tick.
fn switches_s(drive: &Drive) -> Vec<f64> {
    let served = drive.served.iter().filter(|served| served.interrupt == "control");
    let modes: Vec<_> = served.map(|served| served.mode.as_str()).collect();
    let is_switch = |pair: &[&str]| pair[0] != pair[1] && !pair.contains(&"off");
    let ends = modes.windows(2).enumerate().filter(|(_, pair)| is_switch(pair)).map(|(index, _)| index + 1);
    // The first interrupt, number 0, comes one period after the beginning.
    ends.map(|index| (index as f64 + 0.5 - LEAD_PERIODS as f64) * CONTROL_S).collect()
}

/// All drives of a system together.
#[derive(Default)]
struct Sum {
    statistics: Statistics,
    hits: Tally,
    behind: Tally,
    calls: BTreeMap<u32, usize>,
    longest: BTreeMap<u32, Vec<u32>>,
}

impl Sum {
    fn add(&mut self, drive: &Drive) -> Result<()> {
        self.statistics.add(drive)?;
        for (exception, addresses) in &drive.longest {
            let longest = self.longest.entry(*exception).or_default();
            if addresses.len() > longest.len() {
                longest.clone_from(addresses);
            }
        }
        Ok(())
    }

    /// Adds it to the profile; the short drives would shift the means.
    fn profile(&mut self, drive: &Drive) {
        self.hits.merge(&drive.hits);
        self.behind.merge(&drive.behind);
        for call in &drive.calls {
            *self.calls.entry(call.exception).or_default() += 1;
        }
    }
}

/// The results of a system's drives.
pub struct Measured {
    pub system: System,
    pub image: Image,
    pub statistics: Statistics,
    /// Of each interrupt.
    pub parts: Vec<(&'static str, Vec<Part>)>,
    /// The parts' sources that were executed.
    pub sources: BTreeSet<&'static str>,
    /// Functions that mask interrupts.
    pub masking: BTreeSet<String>,
    /// Control's longest instruction: its address and its cycles.
    pub longest: Option<(u32, u32)>,
    path: PathBuf,
    sum: Sum,
}

impl Measured {
    fn new(system: System, path: PathBuf, image: Image, sum: Sum) -> Result<Self> {
        if image.sizes.tables == 0 || image.sizes.recorder == 0 {
            bail!("{}: no table or no recorder has the name that its size is known by", path.display());
        }
        let bytes = profile::bytes(&path)?;
        let profile = Profile::new(&bytes)?;
        let (mut parts, mut sources) = (Vec::new(), BTreeSet::new());
        for (name, exception) in INTERRUPTS {
            let longest = sum.longest.get(&exception).map_or(&[][..], Vec::as_slice);
            let calls = sum.calls.get(&exception).copied().unwrap_or(0);
            parts.push((name, parts::parts(&profile, sum.hits.of(exception), calls, longest, &mut sources)?));
        }
        let masking = entry::masking(&image, is_link);
        let [(_, control), _] = INTERRUPTS;
        let longest = entry::longest(&image, &sum.hits, control);
        let statistics = sum.statistics.clone();
        Ok(Self { system, image, statistics, parts, sources, masking, longest, path, sum })
    }

    /// The most expensive functions of each interrupt.
    pub fn profile_table(&self, count: usize) -> Result<String> {
        let bytes = profile::bytes(&self.path)?;
        let profile = Profile::new(&bytes)?;
        let mut text = String::new();
        for (name, exception) in INTERRUPTS {
            let shares = profile.shares(exception, &self.sum.hits, &self.sum.behind)?;
            let calls = self.sum.calls.get(&exception).copied().unwrap_or(0);
            text += &profile::table(&format!("{} {name}", self.system.name), &shares, calls, count);
        }
        Ok(text)
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::elf::Sizes;
    use crate::timing::meter::Call;
    use crate::timing::parts::Group;

    /// A PWM interrupt and two of control, of the first system.
    pub fn example() -> Measured {
        let call =
            |exception, instructions| Call { exception, instructions, cycles: 1_700, ..Call::default() };
        let served = |interrupt: &str, direction| Served {
            interrupt: interrupt.to_owned(),
            mode: "mid7".to_owned(),
            direction: Some(direction),
            hertz: 100.0,
        };
        let drive = Drive {
            calls: vec![call(26, 7), call(24, 10), call(24, 20)],
            served: vec![
                served("pwm", "motoring"),
                served("control", "motoring"),
                served("control", "braking"),
            ],
            deepest: BTreeMap::from([(24, 440), (26, 200)]),
            ..Drive::default()
        };
        let mut statistics = Statistics::default();
        statistics.add(&drive).unwrap();
        let sizes = Sizes { code: 1, tables: 2, rodata: 3, ram: 4, recorder: 6, stack: 5 };
        let part = Part { name: "MTPA, two passes", group: Group::Paper, mean: 12.0, longest: 20 };
        Measured {
            system: System::ALL[0],
            image: Image { sizes, ..Image::default() },
            statistics,
            parts: vec![("control", vec![part])],
            sources: BTreeSet::new(),
            masking: BTreeSet::new(),
            longest: Some((0x100, 14)),
            path: PathBuf::new(),
            sum: Sum::default(),
        }
    }

    #[test]
    fn the_load_is_that_of_both_interrupts() {
        // 1,700 cycles ten thousand times a second are a tenth of 170 MHz; there is one PWM interrupt for every two of control.
        let statistics = example().statistics;
        let load = statistics.load("mid7", None).unwrap();
        assert!((load.mean - 15.0).abs() < 1e-9 && (load.max - 15.0).abs() < 1e-9);
        assert!(statistics.load("square", None).is_none());
        // Motoring, there is one for each of control; braking was never seen.
        assert!((statistics.load("mid7", Some("motoring")).unwrap().max - 20.0).abs() < 1e-9);
        assert!(statistics.load("mid7", Some("braking")).is_none());
    }

    #[test]
    fn switches_are_found_in_the_middle_of_a_period() {
        let served = |(interrupt, mode): &(&str, &str)| Served {
            interrupt: (*interrupt).to_owned(),
            mode: (*mode).to_owned(),
            ..Served::default()
        };
        let mut modes = vec![("control", "off"); 100];
        modes.extend([("pwm", "async"), ("control", "async"), ("pwm", "sync15"), ("control", "sync15")]);
        let drive = Drive { served: modes.iter().map(served).collect(), ..Drive::default() };
        // Interrupt number 101 comes 102 periods after the run's beginning, 2 after the scenario's.
        let switches_s = switches_s(&drive);
        assert!(switches_s.len() == 1 && (switches_s[0] - 1.5e-4).abs() < 1e-12, "{switches_s:?}");
    }
}
