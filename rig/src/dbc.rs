//! The description of the protocol as a DBC file, with the steps of a machine.

use crate::machine::Machine;
use crate::talk::System;
use crate::{files, say};
use anyhow::Result;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use tractive::identification::Stage;
use tractive::machine::Ratings;
use tractive::modulation::Mode;
use tractive::nine_switch::Scheme;
use tractive::operator::{Refusal, State};
use tractive::protection::Fault;
use tractive::protocol::{
    COUNTER, CRC, FROM_DRIVE, FROM_IDENTIFICATION, FROM_ZS9, Kind, Listening, Message, Outcome, Scales,
    Signal, TO_DRIVE, TO_ZS9,
};

/// The protocol's description for CAN tools, a DBC file: signals in the steps that follow from a machine's ratings.
#[derive(Clone, Debug, clap::Args)]
pub struct DbcOptions {
    /// A folder of tables/, or the path of any machine folder.
    #[arg(long, default_value = "pmasynrm-180kw")]
    machine: String,
    /// The file to write; without it the text is printed.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the file.
pub fn run(options: &DbcOptions) -> Result<()> {
    let text = text(&Machine::load(&options.machine)?.tables.ratings);
    match &options.out {
        Some(path) => files::write_text(path, &text),
        None => {
            say!("{}", text.trim_end());
            Ok(())
        }
    }
}

/// All messages, with `true` for those to a drive: first those of one drive, then those of the other.
pub fn messages() -> Vec<(&'static Message, bool)> {
    let to = TO_DRIVE.into_iter().chain(TO_ZS9).map(|message| (message, true));
    let from =
        FROM_DRIVE.into_iter().chain(FROM_IDENTIFICATION).chain(FROM_ZS9).map(|message| (message, false));
    let mut all: Vec<_> = to.chain(from).collect();
    all.sort_by_key(|(message, _)| is_zs9(message));
    all
}

fn is_zs9(message: &Message) -> bool {
    message.name.starts_with("ZS9_")
}

/// The scales of a message for a machine of these ratings.
pub fn scales(message: &Message, ratings: &Ratings) -> Scales {
    let system = if is_zs9(message) { System::Zs9 } else { System::Pmasynrm };
    system.scales(ratings)
}

/// The signals of a message on a machine's scales.
pub fn signals(message: &Message, scales: Scales) -> Vec<Signal> {
    let own = message.signals.iter().copied();
    [CRC, COUNTER].into_iter().chain(message.mark_signal(scales)).chain(own).collect()
}

/// A signal's number on a machine's scales.
fn number(value: f32, signal: &Signal, scales: Scales) -> String {
    let exponent = scales.exponent(signal.quantity);
    if value.abs() > 1e9 {
        format!("{value:e}")
    } else if exponent == 0 {
        value.to_string()
    } else {
        // The number as it would be written, not as single precision holds it.
        let shown: f64 = format!("{value}e{exponent}").parse().unwrap_or_default();
        shown.to_string()
    }
}

/// Names of a signal's values, if it has any.
fn names(signal: &Signal) -> BTreeMap<u32, &'static str> {
    let numbered = |(code, name): (usize, &'static str)| (code as u32, name);
    match signal.name {
        "state" => State::ALL.iter().map(|state| state.name()).enumerate().map(numbered).collect(),
        "fault" => {
            let faults = (1..256).filter_map(Fault::from_code).map(|fault| (fault as u32, fault.name()));
            faults.chain([(0, "none")]).collect()
        }
        "refusal" => {
            let refusals = Refusal::ALL.iter().map(|refusal| (u32::from(refusal.code()) + 1, refusal.name()));
            refusals.chain([(0, "none")]).collect()
        }
        "scheme" => Scheme::ALL.iter().map(|scheme| scheme.name()).enumerate().map(numbered).collect(),
        "stage" => Stage::ALL.iter().map(|stage| stage.name()).enumerate().map(numbered).collect(),
        // The optimised patterns come last, and are in images with their feature only.
        "mode" => {
            let modes = Mode::ALL.iter().filter(|mode| **mode as u32 <= Mode::Mid5 as u32);
            modes.map(|mode| (*mode as u32, mode.name())).collect()
        }
        "listening" => Listening::ALL.iter().map(|(code, name)| (*code as u32, *name)).collect(),
        "result" => Outcome::ALL.iter().map(|(code, name)| (*code as u32, *name)).collect(),
        _ => BTreeMap::new(),
    }
}

/// The file for a machine of these ratings.
pub fn text(ratings: &Ratings) -> String {
    let mut text = String::from("VERSION \"1\"\n\nNS_ :\n\nBS_:\n\nBU_: DRIVE ZS9 SUPERVISOR\n");
    for (message, to_drive) in messages() {
        describe(&mut text, message, to_drive, scales(message, ratings));
    }
    text +=
        "\nCM_ \"Every message carries end-to-end protection after AUTOSAR profile 2: see protocol.md.\";\n";
    text += "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_ BO_ \"DataIdNumber\" INT 1 31;\n";
    text += "BA_DEF_DEF_ \"GenMsgCycleTime\" 0;\nBA_DEF_DEF_ \"DataIdNumber\" 1;\n";
    for (message, _) in messages() {
        let _ = writeln!(text, "BA_ \"GenMsgCycleTime\" BO_ {} {};", message.id, message.period_ms);
        let _ = writeln!(text, "BA_ \"DataIdNumber\" BO_ {} {};", message.id, message.number);
    }
    for (message, _) in messages() {
        for signal in message.signals {
            let names = names(signal);
            if !names.is_empty() {
                let list: String = names.iter().map(|(code, name)| format!(" {code} \"{name}\"")).collect();
                let _ = writeln!(text, "VAL_ {} {}{list} ;", message.id, signal.name);
            }
        }
    }
    for (message, _) in messages() {
        for signal in message.signals.iter().filter(|signal| signal.kind == Kind::Float) {
            let _ = writeln!(text, "SIG_VALTYPE_ {} {} : 1;", message.id, signal.name);
        }
    }
    text
}

/// A message's lines.
fn describe(text: &mut String, message: &Message, to_drive: bool, scales: Scales) {
    let node = if is_zs9(message) { "ZS9" } else { "DRIVE" };
    let (sender, receiver) = if to_drive { ("SUPERVISOR", node) } else { (node, "SUPERVISOR") };
    let _ = write!(text, "\nBO_ {} {}: 8 {sender}\n", message.id, message.name);
    for signal in signals(message, scales) {
        let page = match signal.page {
            _ if signal.name == "page" => " M".to_owned(),
            Some(page) => format!(" m{page}"),
            None => String::new(),
        };
        let sign = if signal.kind == Kind::Unsigned { '+' } else { '-' };
        let [scale, offset, min, max] =
            [signal.scale, signal.offset, signal.min, signal.max].map(|value| number(value, &signal, scales));
        let (start, bits) = (signal.start, signal.bits);
        let _ = writeln!(
            text,
            " SG_ {}{page} : {start}|{bits}@1{sign} ({scale},{offset}) [{min}|{max}] \"{}\" {receiver}",
            signal.name, signal.unit,
        );
    }
}
