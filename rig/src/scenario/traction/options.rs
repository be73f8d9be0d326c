//! Options of the drive's runs.

use super::ablated::Part;
use super::flaws::{Beside, Filled, FlawOptions};
use crate::bench::Wiring;
use crate::bound::PulseLimits;
use crate::law::LawName;
use crate::machine::Machine;
use crate::options::{finite, needs, not_negative};
use crate::plant::LineFilter;
use crate::run::ticks;
use anyhow::Result;
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use tractive::control::MtpaStart;
use tractive::modulation::{FREE_CARRIER_SHARE, Ladder};
use tractive::named;
use tractive_tablegen::Patterns;

/// The point whose inductances the first pass of MTPA takes under `--law pi`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StartName {
    /// The operating point before
    Previous,
    /// No current, as we read the paper
    Zero,
}

impl StartName {
    /// As the law takes it.
    pub(super) const fn of(self) -> MtpaStart {
        match self {
            Self::Previous => MtpaStart::Previous,
            Self::Zero => MtpaStart::Zero,
        }
    }
}

named! {
    /// The pulse patterns that the drive uses above the free carrier.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum PatternsName {
        /// The paper's modes
        Paper => "paper",
        /// Optimised patterns of 15 to 3 pulses
        Optimal => "optimal",
    }
}

impl From<Patterns> for PatternsName {
    fn from(patterns: Patterns) -> Self {
        match patterns {
            Patterns::Paper => Self::Paper,
            Patterns::Optimal => Self::Optimal,
        }
    }
}

impl PatternsName {
    /// The patterns of a run: those that its options name, else the machine's.
    pub fn of(options: &TractionOptions, machine: &Machine) -> Self {
        options.patterns.unwrap_or_else(|| machine.folder.parameters.patterns.into())
    }

    /// As the modulator's schedule takes them.
    pub(crate) const fn ladder(self) -> Ladder {
        match self {
            Self::Paper => Ladder::PAPER,
            Self::Optimal => Ladder::OPTIMAL,
        }
    }

    /// Highest frequency of the free carrier, as a share of the switches'.
    pub(crate) const fn free_carrier_share(self) -> f32 {
        match self {
            Self::Paper => 1.0,
            Self::Optimal => FREE_CARRIER_SHARE,
        }
    }
}

/// Options of all its scenarios.
#[derive(Clone, Debug, Args, Serialize)]
pub struct TractionOptions {
    /// With --law pi: the point whose inductances the first of the two passes of MTPA takes.
    #[arg(long, value_enum, default_value = "previous", value_name = "POINT")]
    pub mtpa_start: StartName,
    /// The pulse patterns above the free carrier; default those that machine.toml names, else the paper's.
    #[arg(long, value_enum)]
    pub patterns: Option<PatternsName>,
    /// A part of the project's own law to take away, to show its benefit; on the host.
    #[arg(long, value_enum, value_name = "PART")]
    pub ablate: Option<Part>,
    /// Leave the dead time uncompensated: the pulses are not corrected, and the sixth harmonic of the voltage is not followed.
    #[arg(long)]
    pub uncompensated: bool,
    /// Rate of the control interrupt, in Hz; default 10,000, or 20,000 for a machine whose devices switch faster than 10 kHz.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1_000..=100_000))]
    pub control_hz: Option<u32>,
    /// Line filter between a stiff source and the link: choke, link capacitor and the resistance of both, written L_MH,C_MF,R_MOHM;
    /// without it the link itself is stiff.
    #[arg(long, value_name = "L_MH,C_MF,R_MOHM", allow_negative_numbers = true)]
    pub line: Option<LineFilter>,
    /// Drives behind that line filter: all alike with the same demand, but each further one has wheels larger by a percent, so a lower speed.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4), value_name = "NUMBER")]
    pub drives: u32,
    /// Error of the angle sensor that occurs once per electrical turn, amplitude in electrical degrees.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "DEG")]
    pub angle_1f_deg: f64,
    /// Error of the angle sensor that occurs twice per electrical turn, amplitude in electrical degrees.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "DEG")]
    pub angle_2f_deg: f64,
    /// Age of the angle when it is read, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "US")]
    pub angle_late_us: f64,
    /// Lines of the position encoder per turn of the shaft, four counts each; without it the angle has no steps.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), value_name = "LINES")]
    pub encoder_lines: Option<u32>,
    /// Time constant of the current sensors, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "US")]
    pub current_filter_us: f64,
    /// The drive knows --angle-late-us and the mean of --angle-jitter-us, as from its power stage's key, and compensates for them.
    #[arg(long)]
    pub angle_late_known: bool,
    /// The drive knows --current-filter-us and the mean of --adc-skew-us, as from its power stage's key, and compensates for them.
    #[arg(long)]
    pub current_filter_known: bool,
    /// The drive knows --iron-loss, as from its machine's key, and compensates for it, up to 100 %; --law pi does not.
    #[arg(long)]
    pub iron_loss_known: bool,
    /// The true machine, if it differs from the one that control knows: a folder of tables/, or the path of any machine folder.
    #[arg(long, value_name = "DIR")]
    pub plant: Option<String>,
    /// Excess of the current readings over the true currents, in percent.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "PERCENT")]
    pub current_gain: f64,
    /// Excess of the DC link's reading over its true voltage, in percent.
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, value_name = "PERCENT")]
    pub udc_gain: f64,
    /// The phase that each of the three current sensors reads, with - if its leads are exchanged.
    #[arg(long, default_value_t, allow_hyphen_values = true, value_name = "U,V,W")]
    pub current_sensors: Wiring,
    /// The angle sensor counts the wrong way.
    #[arg(long)]
    pub angle_reversed: bool,
    /// Friction torque of a free rotor in either direction, in N·m.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, value_name = "NM")]
    pub friction: f64,
    /// Time by which the PWM timer starts later, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true, hide = true)]
    pub pwm_delay_us: f64,
    /// Further flaws.
    #[serde(flatten)]
    #[command(flatten)]
    pub flaws: FlawOptions,
}

impl TractionOptions {
    /// Age of the angle that the drive is told, in s.
    pub(super) fn known_late_s(&self) -> f32 {
        let mean_us = self.angle_late_us - 0.5 * self.flaws.angle_jitter_us;
        if self.angle_late_known { (1e-6 * mean_us) as f32 } else { 0.0 }
    }

    /// Delay of the currents that the drive is told, in ticks: the sensors' time constant and the mean time by which the phases are sampled early.
    pub(super) fn known_filter_ticks(&self) -> u32 {
        if self.current_filter_known { ticks(self.current_filter_us + self.flaws.mean_skew_us()) } else { 0 }
    }

    /// The check that no option goes without the one that gives it a meaning. The error names both.
    pub(super) fn check_needs(&self, law: LawName) -> Result<()> {
        let flaws = &self.flaws;
        let has = |value: f64| value != 0.0;
        let (filtered, early) = (has(self.current_filter_us), flaws.adc_skew_us.is_some());
        let late = has(self.angle_late_us) || has(flaws.angle_jitter_us);
        needs(&[("--mtpa-start", self.mtpa_start != StartName::Previous, "--law pi", law == LawName::Pi)])?;
        if flaws.real {
            return Ok(());
        }
        needs(&[
            ("--angle-late-known", self.angle_late_known, "--angle-late-us or --angle-jitter-us", late),
            (
                "--current-filter-known",
                self.current_filter_known,
                "--current-filter-us or --adc-skew-us",
                filtered || early,
            ),
            ("--iron-loss-known", self.iron_loss_known, "--iron-loss", has(flaws.iron_loss)),
            ("--device-drop-known", flaws.device_drop_known, "--device-drop", flaws.device_drop.is_some()),
            ("--angle-1f-phase-deg", has(flaws.angle_1f_phase_deg), "--angle-1f-deg", has(self.angle_1f_deg)),
            ("--angle-2f-phase-deg", has(flaws.angle_2f_phase_deg), "--angle-2f-deg", has(self.angle_2f_deg)),
        ])
    }

    /// Share of the iron loss that the drive is told, in thousandths.
    pub(super) fn known_iron_permille(&self, machine: &Machine) -> u32 {
        let known = if self.iron_loss_known {
            self.flaws.iron_loss / 100.0
        } else {
            machine.folder.parameters.iron_loss_share
        };
        (1e3 * known).round() as u32
    }
}

/// Options of a run.
pub type Options = crate::options::Options<TractionOptions>;

impl Options {
    /// The limits of a run's pulses on a machine.
    pub fn pulse_limits(&self, machine: &Machine) -> PulseLimits {
        let min_pulse_us = self.min_pulse_us(machine.folder.parameters.max_switching_hz);
        PulseLimits { min_pulse_us, control_hz: self.own.control_hz }
    }
}

/// The options with everything that `--real` stands for.
pub(super) fn filled(options: &Options, machine: &Machine) -> Options {
    let own = &options.own;
    if !own.flaws.real {
        return options.clone();
    }
    let TractionOptions { udc_gain, current_filter_us, angle_1f_deg, angle_2f_deg, .. } = *own;
    let beside = Beside { udc_gain, current_filter_us, angle_deg: [angle_1f_deg, angle_2f_deg] };
    let Filled { run, beside, flaws } = Filled::of(&options.run, beside, &own.flaws, machine);
    let Beside { udc_gain, current_filter_us, angle_deg: [angle_1f_deg, angle_2f_deg] } = beside;
    let own = TractionOptions {
        udc_gain,
        current_filter_us,
        current_filter_known: true,
        angle_late_known: true,
        iron_loss_known: true,
        angle_1f_deg,
        angle_2f_deg,
        flaws,
        ..own.clone()
    };
    Options { run, own }
}
