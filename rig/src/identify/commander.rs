//! The commander of an experiment over the protocol: charges the link, enables, waits for the end, and collects the observations.

use crate::bench::Wiring;
use crate::run::{Supervisor, Turn, bar};
use crate::talk::sender::{Sender, Spoken};
use crate::talk::{Listener, System};
use anyhow::{Result, anyhow, bail};
use indicatif::ProgressBar;
use std::fmt::Write as _;
use tractive::identification::{Observation, PACKED_WORDS, Packed, Stage, Units};
use tractive::machine::Ratings;
use tractive::protocol::{
    EXPERIMENT, ExperimentFrame, FROM_IDENTIFICATION, Frame, OBSERVATION, ObservationFrame, Payload,
};

/// The current part of the commander's work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// At rest until the drive is ready: before that no level counts.
    Wait,
    Charge,
    /// Enabled until the experiment is over.
    Experiment,
    /// No longer enabled, until the gates are off.
    Stop,
    Gather,
    Discharge,
    Over,
}

impl Phase {
    /// The longest time for it, in s, and the name of what is missing after that.
    const fn most(self) -> (u64, &'static str) {
        match self {
            Self::Wait => (5, "the drive is not ready"),
            Self::Charge => (30, "the link is not charged"),
            Self::Experiment => (60, "the experiment does not end"),
            Self::Stop => (10, "the drive does not stop"),
            Self::Gather => (300, "observations are missing"),
            Self::Discharge | Self::Over => (60, "the link is not discharged"),
        }
    }
}

/// A fault that has ended an experiment, as reported by the drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ended {
    /// Its name.
    pub fault: String,
    /// The value that has passed the limit.
    pub value: String,
    /// The limit.
    pub limit: String,
    /// The correction of the angle's zero, electrical, in degrees, if the rotor has turned away and the pulses determine it.
    pub zero_deg: Option<f64>,
    /// The wiring of the current sensors, if the currents do not follow the voltage and the first pulses determine it.
    pub wiring: Option<Wiring>,
}

/// The commander's state.
pub struct Commander {
    sender: Sender,
    command: Spoken,
    listener: Listener,
    units: Units,
    phase: Phase,
    /// Slots so far, and the slot in which the phase began.
    slot: u64,
    since: u64,
    /// The drive's newest report about the experiment.
    told: ExperimentFrame,
    /// `true` once the experiment has been seen under way; and its number of frames since then that say it is over, with something observed: an experiment
    /// that ends with its first pulses may pass between two frames.
    went: bool,
    over: u32,
    words: Vec<[Option<u32>; PACKED_WORDS]>,
    gathered: usize,
    ended: Option<Ended>,
    shown: ProgressBar,
    /// Lines in candump's log format.
    pub frames: String,
}

/// Number of frames of an experiment that is over: the first may belong to an earlier one.
const OVER_FRAMES: u32 = 2;
/// Slots in a second.
const SLOTS_S: u64 = 1_000;
/// Slots to wait for the fault's value and limit.
const FAULT_SLOTS: u64 = 250;

impl Commander {
    /// Before the first slot, for a drive of these ratings.
    pub fn new(ratings: &Ratings) -> Self {
        let scales = System::Pmasynrm.scales(ratings);
        Self {
            sender: Sender::new(System::Pmasynrm, scales),
            command: Spoken::default(),
            listener: Listener::new(System::Pmasynrm, scales),
            units: Units::of(ratings),
            phase: Phase::Wait,
            slot: 0,
            since: 0,
            told: ExperimentFrame { stage: Stage::Done, observations: 0 },
            went: false,
            over: 0,
            words: Vec::new(),
            gathered: 0,
            ended: None,
            shown: bar(1, "{msg:10} [{bar:40}] {pos} of {len} observations {elapsed}"),
            frames: String::new(),
        }
    }

    /// The observations, in their order; or the fault that has ended the experiment.
    pub fn finish(self) -> std::result::Result<Vec<Observation>, Ended> {
        self.shown.finish_and_clear();
        match self.ended {
            Some(ended) => Err(ended),
            None => Ok(self
                .words
                .iter()
                .map(|words| self.units.unpack(Packed(words.map(Option::unwrap_or_default))))
                .collect()),
        }
    }

    /// A frame of the experiment.
    fn take(&mut self, frame: &Frame) {
        let message = FROM_IDENTIFICATION.into_iter().find(|message| message.id == frame.id);
        let Some(message) = message.filter(|message| frame.length == 8 && message.is_intact(frame)) else {
            return;
        };
        let payload = Payload(u64::from_le_bytes(frame.data));
        if message.id == EXPERIMENT.id {
            if let Some(told) = ExperimentFrame::decode(payload) {
                self.told = told;
                if self.phase == Phase::Experiment {
                    self.went |= told.stage != Stage::Done;
                    self.over += u32::from(told.stage == Stage::Done && told.observations > 0);
                }
            }
        } else if message.id == OBSERVATION.id && self.phase == Phase::Gather {
            let found = ObservationFrame::decode(payload);
            let slot = found.and_then(|found| {
                self.words
                    .get_mut(usize::from(found.index))?
                    .get_mut(usize::from(found.part))?
                    .replace(found.word)
            });
            self.gathered += usize::from(slot.is_none() && found.is_some());
        }
    }

    fn enter(&mut self, phase: Phase) {
        (self.phase, self.since) = (phase, self.slot);
    }

    /// The work that is due in this slot.
    fn advance(&mut self) -> Result<()> {
        let [state, fault, refusal] = ["state", "fault", "refusal"].map(|name| self.listener.value(name));
        let levels = &mut self.command.levels;
        // A drive without contactors is charged by switching on its supply.
        let ready = state == "charged" || (state == "ready" && refusal == "no_contactors");
        match self.phase {
            Phase::Wait if state == "ready" && self.slot > 100 => self.enter(Phase::Charge),
            Phase::Charge => {
                levels.charge = !ready;
                if ready {
                    levels.enable = true;
                    self.enter(Phase::Experiment);
                }
            }
            Phase::Experiment
                if self.told.stage == Stage::Done && (self.went || self.over >= OVER_FRAMES) =>
            {
                levels.enable = false;
                self.words = vec![[None; PACKED_WORDS]; self.told.observations.into()];
                self.enter(Phase::Stop);
            }
            Phase::Stop if state == "charged" || state == "ready" => self.enter(Phase::Gather),
            Phase::Gather if self.gathered == self.words.len() * PACKED_WORDS => {
                levels.discharge = state == "charged";
                self.enter(Phase::Discharge);
            }
            Phase::Discharge if state == "ready" => {
                levels.discharge = false;
                self.enter(Phase::Over);
            }
            _ => {}
        }
        if !fault.is_empty() && self.ended.is_none() {
            let [value, limit] = ["fault_value", "fault_limit"].map(|name| self.listener.value(name));
            let told = !value.is_empty() && !limit.is_empty();
            self.command = Spoken::default();
            if self.phase != Phase::Over {
                self.enter(Phase::Over);
            }
            if told || self.slot > self.since + FAULT_SLOTS {
                self.ended = Some(Ended { fault, value, limit, ..Ended::default() });
            }
        }
        let (most_s, lacking) = self.phase.most();
        if self.slot > self.since + most_s * SLOTS_S {
            bail!(
                "{lacking}: state {state}, {} of {} observations",
                self.told.observations,
                self.words.len()
            );
        }
        Ok(())
    }

    fn show(&self) {
        let total = self.words.len().max(self.told.observations.into()).max(1);
        let (name, done) = match self.phase {
            Phase::Experiment => (self.told.stage.name(), usize::from(self.told.observations)),
            _ => ("", self.gathered / PACKED_WORDS),
        };
        self.shown.set_length(total as u64);
        self.shown.set_position(done as u64);
        self.shown.set_message(name);
    }

    /// In candump's log format: time, channel, identifier and bytes, T for frames sent to the drive, R for frames from it.
    fn log(&mut self, t_s: f64, frame: &Frame, direction: char) {
        let bytes: String = frame.data.iter().map(|byte| format!("{byte:02X}")).collect();
        let _ = writeln!(self.frames, "({t_s:.6}) can0 {:03X}#{bytes} {direction}", frame.id);
    }
}

impl Supervisor for Commander {
    fn hear(&mut self, t_s: f64, frame: &Frame) {
        self.log(t_s, frame, 'R');
        if FROM_IDENTIFICATION.iter().any(|message| message.id == frame.id) {
            self.take(frame);
        } else {
            self.listener.receive(frame);
        }
    }

    fn slot(&mut self, t_s: f64) -> Result<Turn> {
        if let Some(foreign) = &self.listener.foreign {
            bail!("{foreign}");
        }
        self.advance()?;
        if self.slot.is_multiple_of(100) {
            self.show();
        }
        let frame = self.sender.step(self.slot, &self.command);
        let frame = frame.map_err(|_| anyhow!("a value is beyond what its signal can carry"))?;
        if let Some(frame) = &frame {
            self.log(t_s, frame, 'T');
        }
        self.slot += 1;
        let done = if self.phase == Phase::Over {
            self.ended.is_some() || self.listener.value("fault").is_empty()
        } else {
            false
        };
        Ok(Turn { frame, loads_nm: [0.0; 2], done })
    }
}
