//! Drives the image in the emulator and follows its log while it runs.

use super::log::{ARGUMENTS, Log};
use super::meter::{Call, Meter, Path as Executed};
use super::tally::Tally;
use crate::elf::Image;
use crate::{image, process};
use anyhow::{Context, Result, bail};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Modules whose functions are the link to the rig.
const LINK: [&str; 2] = ["tractive::board::qemu::exchange::", "tractive::wire::"];
/// Ends of the names of functions that the idle loop runs all the time.
const IDLE: [&str; 2] = ["main", "board::qemu::idle"];
/// Ends the log when the emulator has.
const END: &[u8] = b"end of the log";

/// Everything that is needed to drive.
#[derive(Clone)]
pub struct Bench {
    pub rig: PathBuf,
    pub qemu: PathBuf,
    /// The rig's command: its scenario, or its partner in the talk.
    pub command: Vec<String>,
    pub path: PathBuf,
    pub image: Image,
    /// `true` if the instructions that each interrupt executed are wanted.
    pub keeps_paths: bool,
}

/// The results of one drive.
#[derive(Debug, Default)]
pub struct Drive {
    pub calls: Vec<Call>,
    /// The instructions that each of them executed; empty unless they were wanted.
    pub paths: Vec<Executed>,
    pub hits: Tally,
    pub behind: Tally,
    /// Bytes of stack that each exception takes at most.
    pub deepest: BTreeMap<u32, i32>,
    /// Of each exception the addresses that its longest interrupt executed.
    pub longest: BTreeMap<u32, Vec<u32>>,
    /// In the order in which the rig served them.
    pub served: Vec<Served>,
}

/// The rig's account of an interrupt.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Served {
    pub interrupt: String,
    pub mode: String,
    /// `None` if the mode implies it, and without pulses.
    pub direction: Option<&'static str>,
    /// Stator frequency; 0 where it is not told.
    pub hertz: f64,
}

/// The directions of the mechanical power, as the rig and the tables call them: the sign of torque times speed. If the power is zero, the previous
/// direction holds.
pub const DIRECTIONS: [&str; 2] = ["motoring", "braking"];

impl Bench {
    /// For an image and the arguments of the rig's command; the instructions that each interrupt executed are not wanted.
    pub fn of(rig: &Path, qemu: &Path, command: &[&str], path: PathBuf) -> Result<Self> {
        let (rig, qemu, image) = (rig.to_owned(), qemu.to_owned(), image::read(&path)?);
        let command = command.iter().map(|word| (*word).to_owned()).collect();
        Ok(Self { rig, qemu, command, path, image, keeps_paths: false })
    }

    /// Runs the scenario with these options.
    pub fn drive(&self, options: &[&str]) -> Result<Drive> {
        let folder = tempfile::tempdir().context("no temporary folder")?;
        self.drive_in(folder.path(), options)
    }

    fn drive_in(&self, folder: &Path, options: &[&str]) -> Result<Drive> {
        let (log, served) = (folder.join("log"), folder.join("calls"));
        let (reader, mut end) = fifo(&log)?;
        let mut rig = Command::new(&self.rig);
        rig.args(&self.command).args(["--on", "qemu", "--dt", "1e-3", "--out"]).arg(folder.join("out"));
        rig.arg("--image").arg(&self.path).arg("--qemu").arg(&self.qemu).arg("--calls").arg(&served);
        let (filter, log) = (filter(&self.image, self.keeps_paths), log.to_string_lossy().into_owned());
        for argument in ARGUMENTS.into_iter().chain(["-dfilter", &filter, "-D", &log]) {
            rig.arg(format!("--qemu-arg={argument}"));
        }
        rig.args(options).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let child = rig.spawn().with_context(|| process::cannot_start(&rig))?;
        let waiter = std::thread::spawn(move || {
            let output = child.wait_with_output();
            let _ = end.write_all(&[b"\n", END, b"\n"].concat());
            output
        });
        let drive = self.follow(reader);
        let Ok(output) = waiter.join() else { bail!("the rig could not be waited for") };
        let output = output?;
        // 1: the drive tripped, which some runs are for.
        if !matches!(output.status.code(), Some(0 | 1)) {
            bail!("the rig failed: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        let text = std::fs::read_to_string(&served).with_context(|| served.display().to_string())?;
        Ok(Drive { served: read_served(&text)?, ..drive? })
    }

    /// Reads to the end whatever happens, so that no writer waits for a reader.
    fn follow(&self, log: File) -> Result<Drive> {
        let link = self.image.functions.iter();
        let link: BTreeSet<u32> =
            link.filter(|(_, function)| is_link(&function.names)).map(|(start, _)| *start).collect();
        if link.is_empty() {
            let link = LINK.join(" or ");
            bail!("the image has no function of {link}, which would be left out of the counts");
        }
        let mut meter = Meter::new(&self.image, link);
        meter.keeps_paths = self.keeps_paths;
        let mut lines = BufReader::with_capacity(1 << 20, Unhurried(log));
        let (mut log, mut line, mut outcome) = (Log::new(&self.image), Vec::new(), Ok(()));
        while lines.read_until(b'\n', &mut line)? > 0 {
            if line.starts_with(END) {
                break;
            }
            if outcome.is_ok() {
                outcome = log.take(&line, |event| meter.take(event));
            }
            line.clear();
        }
        outcome?;
        let Meter { calls, paths, hits, behind, deepest, longest, .. } = meter;
        Ok(Drive { calls, paths, hits, behind, deepest, longest, served: Vec::new() })
    }
}

/// Lets the emulator write for a while before it reads: otherwise each of them wakes the other for every line.
struct Unhurried(File);

impl Read for Unhurried {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        std::thread::sleep(Duration::from_millis(2));
        self.0.read(buffer)
    }
}

/// `true` if a function of these names is the link to the rig.
pub fn is_link(names: &[String]) -> bool {
    names.iter().any(|name| LINK.iter().any(|module| name.contains(module)))
}

/// The addresses to log: all but the idle loop, which is most of the time, and the link if it is not wanted.
fn filter(image: &Image, link: bool) -> String {
    let idles = |name: &String| IDLE.iter().any(|end| name.ends_with(end));
    let skipped = |names: &[String]| (is_link(names) && !link) || names.iter().any(idles);
    let logged = image.functions.iter().filter(|(_, function)| !skipped(&function.names));
    let ranges: Vec<_> =
        logged.map(|(start, function)| format!("{start:#x}+{:#x}", function.size.max(1))).collect();
    ranges.join(",")
}

/// A FIFO's reading end, and a writing end that keeps it open.
fn fifo(path: &Path) -> Result<(File, File)> {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)
        .with_context(|| format!("cannot make the FIFO {}", path.display()))?;
    let both = OpenOptions::new().read(true).write(true).open(path)?;
    // As large as the system allows without privileges; a smaller one only takes longer.
    let _ = rustix::pipe::fcntl_setpipe_size(&both, 1 << 20);
    let writer = both.try_clone()?;
    Ok((both, writer))
}

fn read_served(text: &str) -> Result<Vec<Served>> {
    let served = |line: &str| {
        let [interrupt, mode, direction, hertz] = line.split(',').collect::<Vec<_>>()[..] else {
            bail!("the rig's list of interrupts holds `{line}`");
        };
        let known = DIRECTIONS.into_iter().find(|known| *known == direction);
        if known.is_none() && !direction.is_empty() {
            bail!("the rig's list of interrupts holds the direction `{direction}`");
        }
        Ok(Served {
            interrupt: interrupt.to_owned(),
            mode: mode.to_owned(),
            direction: known,
            hertz: hertz.parse().unwrap_or(0.0),
        })
    };
    text.lines().map(served).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    #[test]
    fn neither_the_idle_loop_nor_the_link_is_logged() {
        let functions: [(&str, u32, &[u16]); 5] = [
            ("TIMER0", 0x100, &[0x4770]),
            ("main", 0x110, &[0x4770]),
            ("tractive::board::qemu::exchange::play", 0x120, &[0x4770]),
            ("memcpy", 0x130, &[0x4770, 0xBF00]),
            ("tractive::board::qemu::idle", 0x140, &[0xBF00, 0x4770]),
        ];
        let image = Image::parse(&small_elf(0x100, &functions)).unwrap();
        assert_eq!(filter(&image, false), "0x100+0x2,0x130+0x4");
        assert_eq!(filter(&image, true), "0x100+0x2,0x120+0x2,0x130+0x4");
    }

    #[test]
    fn the_rigs_list_is_read() {
        let served = read_served("control,async,braking,12.5\npwm,square,,\n").unwrap();
        let (interrupt, mode) = ("control".to_owned(), "async".to_owned());
        assert_eq!(served[0], Served { interrupt, mode, direction: Some("braking"), hertz: 12.5 });
        assert_eq!((served[1].direction, served[1].hertz), (None, 0.0));
        assert!(read_served("control").is_err());
        assert!(read_served("control,async,sideways,").is_err());
    }
}
