//! The emulator and its four FIFOs, whichever firmware runs in it.

use crate::platform::{make_fifo, temporary_folder};
use anyhow::{Context, Result, bail};
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use tractive::wire::{BLOCK_BYTES, BLOCK_WORDS, Block};

/// The emulator and its image.
#[derive(Clone, Debug)]
pub struct Emulator {
    /// The `qemu-system-arm` program.
    pub program: PathBuf,
    /// The firmware's ELF file.
    pub image: PathBuf,
    /// Further arguments.
    pub arguments: Vec<String>,
    /// The file of the interrupts, a line each.
    pub calls: Option<PathBuf>,
    /// `true` if the run may stand still for as long as somebody needs to type.
    pub patient: bool,
}

/// Power of two that gives the nanoseconds of virtual time per instruction: 8 ns, 125 MIPS, nearest to the real part.
const NANOSECONDS_SHIFT: u32 = 3;
/// Time without any request after which the emulator is given up.
const SILENCE: Duration = Duration::from_secs(30);
/// A request that no firmware sends: the emulator has ended.
const ENDED: u32 = u32::MAX;

/// Runs the image; `answer` gets every block that it sends, and says when the scenario is done.
pub(crate) fn emulate(
    emulator: &Emulator,
    mut answer: impl FnMut(&Block, &mut Answers) -> Result<bool>,
) -> Result<()> {
    let folder = temporary_folder()?;
    let mut link = Link::open(folder.path())?;
    let watch = Watch::start(spawn(emulator, folder.path())?, link.requests.try_clone()?, emulator.patient);
    let mut serve = || -> Result<()> {
        loop {
            let block = link.receive()?;
            watch.blocks.fetch_add(1, Ordering::Relaxed);
            if block[0] == ENDED {
                bail!("the emulator ended before the scenario did");
            }
            if answer(&block, &mut link.answers)? {
                return Ok(());
            }
        }
    };
    let outcome = serve();
    let log = watch.finish(outcome.is_ok());
    outcome.with_context(|| if log.is_empty() { "QEMU".to_owned() } else { format!("QEMU said: {log}") })
}

/// The ways back into the image.
pub(crate) struct Answers {
    control: File,
    pwm: File,
    idle: File,
}

impl Answers {
    /// To the control interrupt.
    pub(crate) fn control(&mut self, block: &Block) -> Result<()> {
        Ok(self.control.write_all(&bytes(block))?)
    }

    /// To the PWM interrupt.
    pub(crate) fn pwm(&mut self, block: &Block) -> Result<()> {
        Ok(self.pwm.write_all(&bytes(block))?)
    }

    /// To the idle loop.
    pub(crate) fn idle(&mut self, block: &Block) -> Result<()> {
        Ok(self.idle.write_all(&bytes(block))?)
    }
}

/// The four FIFOs. Both ends of each are held open, so that neither side waits for the other to open its end.
struct Link {
    requests: File,
    answers: Answers,
}

impl Link {
    fn open(folder: &Path) -> Result<Self> {
        let open = |name: &str| -> Result<File> {
            let path = folder.join(name);
            make_fifo(&path)?;
            Ok(OpenOptions::new().read(true).write(true).open(&path)?)
        };
        let answers = Answers {
            control: open("control-answers")?,
            pwm: open("pwm-answers")?,
            idle: open("idle-answers")?,
        };
        Ok(Self { requests: open("requests")?, answers })
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
        .args(&emulator.arguments)
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
    fn start(child: Child, requests: File, patient: bool) -> Self {
        let (blocks, done) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let (seen, stop) = (Arc::clone(&blocks), Arc::clone(&done));
        let thread = std::thread::spawn(move || watch(child, requests, patient, &seen, &stop));
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

fn watch(
    mut child: Child,
    mut requests: File,
    patient: bool,
    blocks: &AtomicU64,
    stop: &AtomicBool,
) -> String {
    let pause = Duration::from_millis(5);
    let (mut last, mut silent) = (0, Duration::ZERO);
    while let Ok(None) = child.try_wait() {
        std::thread::sleep(pause);
        let now = blocks.load(Ordering::Relaxed);
        silent = if now == last { silent + pause } else { Duration::ZERO };
        last = now;
        if stop.load(Ordering::Relaxed) || (silent > SILENCE && !patient) {
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
