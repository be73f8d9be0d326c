//! The drive in QEMU: the image's own interrupts, in lockstep with the bench over three FIFOs.

use super::Progress;
use crate::bench::Bench;
use crate::trace::Recording;
use anyhow::{Context, Result, bail};
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use tractive::link::{self, BLOCK_BYTES, BLOCK_WORDS, Block, Request, Setup};

/// Which emulator runs which image.
#[derive(Clone, Debug)]
pub struct Emulator {
    /// The `qemu-system-arm` program.
    pub program: PathBuf,
    /// The firmware's ELF file.
    pub image: PathBuf,
}

/// Two to this many nanoseconds of virtual time per instruction: 8 ns, 125 MIPS, nearest to the real part.
const NANOSECONDS_SHIFT: u32 = 3;
/// The emulator is given up when it has not asked for anything for this long.
const SILENCE: Duration = Duration::from_secs(30);
/// A request that no firmware sends: the emulator has ended.
const ENDED: u32 = u32::MAX;

/// Runs until the recording is complete.
pub fn run_in_qemu(name: &str, mut bench: Bench, setup: Setup, emulator: &Emulator) -> Result<Recording> {
    let folder = tempfile::tempdir().context("no temporary folder for the link")?;
    let mut link = Link::open(folder.path())?;
    let watch = Watch::start(spawn(emulator, folder.path())?, link.requests_writer()?);
    let mut progress = Progress::new(name);
    let outcome = serve(&mut link, &mut bench, setup, &watch.blocks, &mut progress);
    let log = watch.finish(outcome.is_ok());
    outcome.with_context(|| if log.is_empty() { "QEMU".to_owned() } else { format!("QEMU said: {log}") })?;
    Ok(super::record(bench))
}

fn serve(
    link: &mut Link,
    bench: &mut Bench,
    setup: Setup,
    blocks: &AtomicU64,
    progress: &mut Progress,
) -> Result<()> {
    loop {
        let block = link.receive()?;
        blocks.fetch_add(1, Ordering::Relaxed);
        if block[0] == ENDED {
            bail!("the emulator ended before the scenario did");
        }
        let Some(request) = Request::from_block(&block) else {
            bail!("the firmware sent a request that is none: {block:?}");
        };
        match request {
            Request::Hello => link.control.write_all(&bytes(&link::setup_to_block(setup)))?,
            Request::ControlSample(at) => {
                let sample = bench.control_sample(at)?;
                let done = bench.is_done();
                link.control.write_all(&bytes(&link::sample_to_block(&sample, done)))?;
                if done {
                    return Ok(());
                }
            }
            Request::ControlReport(at, report) => bench.control_report(at, report),
            Request::PwmSample(at) => {
                let currents = bench.pwm_sample(at)?;
                link.pwm.write_all(&bytes(&link::currents_to_block(currents)))?;
            }
            Request::Play(at, half) => bench.play(at, half),
            Request::Enter(at, safe) => bench.enter(at, safe),
            Request::Dead => bail!("the firmware stopped in a panic or a HardFault, gates off"),
        }
        progress.show(bench.progress());
    }
}

/// The three FIFOs. Both ends of each are held open, so that nobody waits for the other to open its end.
struct Link {
    requests: File,
    control: File,
    pwm: File,
}

impl Link {
    fn open(folder: &Path) -> Result<Self> {
        let open = |name: &str| -> Result<File> {
            let path = folder.join(name);
            rustix::fs::mknodat(
                rustix::fs::CWD,
                &path,
                rustix::fs::FileType::Fifo,
                rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR,
                0,
            )
            .with_context(|| format!("cannot make the FIFO {}", path.display()))?;
            Ok(OpenOptions::new().read(true).write(true).open(&path)?)
        };
        Ok(Self { requests: open("requests")?, control: open("control-answers")?, pwm: open("pwm-answers")? })
    }

    fn requests_writer(&self) -> Result<File> {
        Ok(self.requests.try_clone()?)
    }

    fn receive(&mut self) -> Result<Block> {
        let mut bytes = [0; BLOCK_BYTES];
        self.requests.read_exact(&mut bytes)?;
        let mut block = [0; BLOCK_WORDS];
        for (word, chunk) in block.iter_mut().zip(bytes.chunks_exact(4)) {
            *word = chunk.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
        }
        Ok(block)
    }
}

fn bytes(block: &Block) -> [u8; BLOCK_BYTES] {
    let mut out = [0; BLOCK_BYTES];
    for (chunk, word) in out.chunks_exact_mut(4).zip(block) {
        chunk.copy_from_slice(&word.to_le_bytes());
    }
    out
}

fn spawn(emulator: &Emulator, folder: &Path) -> Result<Child> {
    let image =
        emulator.image.canonicalize().with_context(|| format!("image {}", emulator.image.display()))?;
    Command::new(&emulator.program)
        .args(["-M", "mps2-an386", "-cpu", "cortex-m4", "-nographic", "-monitor", "none", "-serial", "null"])
        .args(["-icount", &format!("shift={NANOSECONDS_SHIFT},align=off,sleep=off")])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start {}", emulator.program.display()))
}

/// Watches the emulator: tells the bench when it ends, and ends it when it falls silent.
struct Watch {
    blocks: Arc<AtomicU64>,
    done: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<String>,
}

impl Watch {
    fn start(child: Child, requests: File) -> Self {
        let (blocks, done) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let (seen, stop) = (Arc::clone(&blocks), Arc::clone(&done));
        let thread = std::thread::spawn(move || watch(child, requests, &seen, &stop));
        Self { blocks, done, thread }
    }

    /// Waits for the emulator's end; returns what it said on its standard error.
    fn finish(self, success: bool) -> String {
        if !success {
            self.done.store(true, Ordering::Relaxed);
        }
        self.thread.join().unwrap_or_default()
    }
}

fn watch(mut child: Child, mut requests: File, blocks: &AtomicU64, stop: &AtomicBool) -> String {
    let pause = Duration::from_millis(5);
    let (mut last, mut silent) = (0, Duration::ZERO);
    while let Ok(None) = child.try_wait() {
        std::thread::sleep(pause);
        let now = blocks.load(Ordering::Relaxed);
        silent = if now == last { silent + pause } else { Duration::ZERO };
        last = now;
        if stop.load(Ordering::Relaxed) || silent > SILENCE {
            let _ = child.kill();
        }
    }
    let mut ended = [0; BLOCK_WORDS];
    ended[0] = ENDED;
    let _ = requests.write_all(&bytes(&ended));
    let mut log = String::new();
    if let Some(mut errors) = child.stderr.take() {
        let _ = errors.read_to_string(&mut log);
    }
    log.trim().to_owned()
}
