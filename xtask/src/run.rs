//! `cargo xtask run`: set up, build, hand over to the rig.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::CommandFactory;

use crate::build::System;
use crate::setup::Setup;
use crate::{build, cli, process};

/// Options of the rig that take no value: a bare word after one of them is the scenario.
const FLAGS: [&str; 5] = ["--down", "--brake", "--json", "--no-reverse", "--edges"];

/// Where the firmware's code runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum On {
    Qemu,
    Host,
}

/// The script that is run when none is named.
const SCRIPT: &str = "rig/scripts/round-trip.talk";
/// The same for the ZS9.
const ZS9_SCRIPT: &str = "rig/scripts/zs9.talk";

/// The rig's command that is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verb {
    Run,
    Talk,
}

/// What was asked for.
#[derive(Debug, PartialEq, Eq)]
struct Request {
    /// The scenario; for a talk the script, or - for standard input.
    scenario: String,
    on: On,
    out: Option<String>,
    machine: Option<String>,
    help: bool,
    /// The rig's options, untouched and in their order.
    rest: Vec<String>,
}

impl Request {
    /// Picks out what this program knows; the rest is the rig's.
    fn parse(words: &[String], verb: Verb) -> Result<Self> {
        let mut scenario = None;
        let (mut on, mut out, mut machine) = (None, None, None);
        let (mut help, mut rest) = (false, Vec::new());
        let mut value_may_follow = false;
        let mut words = words.iter();
        while let Some(word) = words.next() {
            let (name, inline) = match word.split_once('=') {
                Some((name, value)) => (name, Some(value.to_owned())),
                None => (word.as_str(), None),
            };
            let slot = match name {
                "--on" => Some((&mut on, "qemu or host")),
                "--out" => Some((&mut out, "a folder")),
                "--machine" => Some((&mut machine, "a name or a folder")),
                _ => None,
            };
            if let Some((slot, wanted)) = slot {
                let value = inline.or_else(|| words.next().cloned());
                let Some(value) = value.filter(|value| !value.is_empty() && !value.starts_with("--")) else {
                    bail!("{name} needs a value: {wanted}");
                };
                if slot.replace(value).is_some() {
                    bail!("{name} is given twice");
                }
                value_may_follow = false;
            } else if word == "--help" || word == "-h" {
                help = true;
            } else if (word.starts_with('-') && word != "-") || value_may_follow || scenario.is_some() {
                rest.push(word.clone());
                value_may_follow = word.starts_with("--") && inline.is_none() && !FLAGS.contains(&name);
            } else {
                scenario = Some(word.clone());
            }
        }
        let on = match on.as_deref() {
            None | Some("qemu") => On::Qemu,
            Some("host") => On::Host,
            Some(other) => bail!("--on {other}: qemu or host is allowed"),
        };
        let scenario = scenario.unwrap_or_else(|| match verb {
            Verb::Run => "sweep".to_owned(),
            Verb::Talk => {
                let script = if talks_to_zs9(&rest) { ZS9_SCRIPT } else { SCRIPT };
                build::root().join(script).to_string_lossy().into_owned()
            }
        });
        Ok(Self { scenario, on, out, machine, help, rest })
    }

    fn system(&self, verb: Verb) -> System {
        match verb {
            Verb::Run => System::of_scenario(&self.scenario),
            Verb::Talk if talks_to_zs9(&self.rest) => System::Zs9,
            Verb::Talk => System::Traction,
        }
    }

    fn has(&self, option: &str) -> bool {
        self.rest.iter().any(|word| word.split('=').next() == Some(option))
    }

    /// What the rig is called with; `image` and `qemu` as far as they were made ready here.
    fn rig_args(&self, verb: Verb, out: &Path, image: Option<&Path>, qemu: Option<&Path>) -> Vec<OsString> {
        let on = match self.on {
            On::Qemu => "qemu",
            On::Host => "host",
        };
        let mut args: Vec<OsString> = match verb {
            Verb::Run => vec!["run".into(), (&self.scenario).into()],
            // The rig's own default is standard input.
            Verb::Talk if self.scenario == "-" => vec!["talk".into()],
            Verb::Talk => vec!["talk".into(), (&self.scenario).into()],
        };
        args.extend(["--on".into(), on.into(), "--out".into(), out.into()]);
        for (option, path) in [("--image", image), ("--qemu", qemu)] {
            args.extend(path.into_iter().flat_map(|path| [option.into(), path.into()]));
        }
        args.extend(self.machine.iter().flat_map(|machine| ["--machine".into(), machine.into()]));
        args.extend(self.rest.iter().map(OsString::from));
        args
    }
}

/// Whether the rig's options have it talk to the ZS9.
fn talks_to_zs9(words: &[String]) -> bool {
    words.iter().any(|word| word == "--system=zs9")
        || words.windows(2).any(|pair| pair == ["--system".to_owned(), "zs9".to_owned()])
}

/// The command; its exit code is the rig's.
pub fn run(words: &[String]) -> Result<u8> {
    hand_over(words, Verb::Run)
}

/// The same for a talk over the protocol.
pub fn talk(words: &[String]) -> Result<u8> {
    hand_over(words, Verb::Talk)
}

fn hand_over(words: &[String], verb: Verb) -> Result<u8> {
    let request = Request::parse(words, verb)?;
    let name = match verb {
        Verb::Run => "run",
        Verb::Talk => "talk",
    };
    if request.help {
        let mut top = cli::Cli::command();
        top.find_subcommand_mut(name).with_context(|| format!("no help for {name}"))?.print_help()?;
        return Ok(0);
    }
    let machine =
        request.machine.as_deref().map(|machine| machine_for_build(machine, build::root())).transpose()?;
    let out = match &request.out {
        Some(out) => PathBuf::from(out),
        None => default_out(if verb == Verb::Talk { name } else { &request.scenario })?,
    };
    let (mut image, mut qemu) = (None, None);
    if request.on == On::Qemu {
        let mut setup = Setup::default();
        if !request.has("--qemu") {
            qemu = Some(setup.qemu()?);
        }
        if !request.has("--image") {
            image = Some(build::image(&setup.toolchain()?, request.system(verb), machine.as_ref())?);
        }
    }
    let mut rig = Command::new(build::rig()?);
    rig.args(request.rig_args(verb, &out, image.as_deref(), qemu.as_deref()));
    let status = rig.status().with_context(|| process::cannot_start(&rig))?;
    match status.code() {
        Some(code) => Ok(u8::try_from(code).unwrap_or(1)),
        None => {
            eprintln!("error: the rig was stopped ({status})");
            Ok(1)
        }
    }
}

/// `target/tractive/SCENARIO`, short to read where the command is given in the root.
fn default_out(scenario: &str) -> Result<PathBuf> {
    if !scenario.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_') {
        bail!("scenario `{scenario}`: letters, digits, - and _ are allowed");
    }
    let relative = Path::new("target/tractive").join(scenario);
    let in_root = std::env::current_dir().is_ok_and(|here| here == build::root());
    Ok(if in_root { relative } else { build::root().join(relative) })
}

/// A machine as the build script of the firmware takes it: a folder of tables/ by its name, any other by its absolute path.
pub fn machine_for_build(machine: &str, root: &Path) -> Result<OsString> {
    let is_name = !machine.contains(['/', '\\']) && machine != "." && machine != "..";
    if is_name && root.join("tables").join(machine).is_dir() {
        return Ok(machine.into());
    }
    let path = Path::new(machine);
    if !path.is_dir() {
        bail!("--machine {machine}: neither a folder nor one of tables/: {}", machine_names(root).join(", "));
    }
    let path = std::path::absolute(path).with_context(|| format!("--machine {machine}"))?;
    Ok(path.into_os_string())
}

/// The folders of tables/.
pub fn machine_names(root: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(root.join("tables")).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.path().is_dir());
    let mut names: Vec<_> = folders.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<String> {
        line.split_whitespace().map(str::to_owned).collect()
    }

    fn parse(line: &str) -> Result<Request> {
        Request::parse(&words(line), Verb::Run)
    }

    #[test]
    fn nothing_means_the_sweep_in_qemu() {
        let request = parse("").unwrap();
        assert_eq!((request.scenario.as_str(), request.on), ("sweep", On::Qemu));
        assert!(
            request.out.is_none() && request.machine.is_none() && request.rest.is_empty() && !request.help
        );
    }

    #[test]
    fn own_options_are_found_anywhere() {
        let request =
            parse("--down load-steps --dt 1e-4 --on host --noise-a=0.5 --out=x/y --machine m").unwrap();
        assert_eq!((request.scenario.as_str(), request.on), ("load-steps", On::Host));
        assert_eq!((request.out.as_deref(), request.machine.as_deref()), (Some("x/y"), Some("m")));
        assert_eq!(request.rest, ["--down", "--dt", "1e-4", "--noise-a=0.5"]);
    }

    #[test]
    fn a_value_of_the_rigs_option_is_not_the_scenario() {
        let request = parse("--dt 1e-4 characteristic --torque-scale -0.5").unwrap();
        assert_eq!(request.scenario, "characteristic");
        assert_eq!(request.rest, ["--dt", "1e-4", "--torque-scale", "-0.5"]);
        assert_eq!(parse("--dt 1e-4").unwrap().scenario, "sweep");
    }

    #[test]
    fn a_second_bare_word_is_left_for_the_rig_to_refuse() {
        assert_eq!(parse("sweep load-steps").unwrap().rest, ["load-steps"]);
    }

    #[test]
    fn bad_usage_names_the_option_and_what_is_allowed() {
        for (line, message) in [
            ("--on moon", "--on moon: qemu or host is allowed"),
            ("--on", "--on needs a value: qemu or host"),
            ("--out --down", "--out needs a value: a folder"),
            ("--out=", "--out needs a value: a folder"),
            ("--machine a --machine b", "--machine is given twice"),
        ] {
            assert_eq!(parse(line).unwrap_err().to_string(), message, "{line}");
        }
        assert!(default_out("../x").is_err());
        assert!(parse("sweep --help").unwrap().help);
    }

    #[test]
    fn the_rig_gets_everything_once() {
        let request = parse("sweep --down --machine m --json").unwrap();
        let args = request.rig_args(Verb::Run, Path::new("o"), Some(Path::new("i")), Some(Path::new("q")));
        let expected = "run sweep --on qemu --out o --image i --qemu q --machine m --down --json";
        assert_eq!(args, expected.split(' ').collect::<Vec<_>>());
        let request = parse("sweep --on host").unwrap();
        assert_eq!(
            request.rig_args(Verb::Run, Path::new("o"), None, None),
            ["run", "sweep", "--on", "host", "--out", "o"]
        );
    }

    #[test]
    fn a_talk_has_the_shipped_script_unless_told_otherwise() {
        let args = |line: &str| {
            let request = Request::parse(&words(line), Verb::Talk).unwrap();
            let args = request.rig_args(Verb::Talk, Path::new("o"), None, None);
            args.into_iter().map(|arg| arg.into_string().unwrap()).collect::<Vec<_>>().join(" ")
        };
        let shipped = build::root().join(SCRIPT);
        assert!(shipped.is_file());
        assert_eq!(args(""), format!("talk {} --on qemu --out o", shipped.display()));
        let zs9 = build::root().join(ZS9_SCRIPT);
        assert!(zs9.is_file());
        for option in ["--system zs9", "--system=zs9"] {
            assert_eq!(args(option), format!("talk {} --on qemu --out o {option}", zs9.display()));
            assert_eq!(Request::parse(&words(option), Verb::Talk).unwrap().system(Verb::Talk), System::Zs9);
        }
        assert_eq!(args("- --on host"), "talk --on host --out o");
        assert_eq!(args("my.talk --inertia 5"), "talk my.talk --on qemu --out o --inertia 5");
    }

    #[test]
    fn a_ready_image_is_not_built_again() {
        assert!(parse("--image x.elf").unwrap().has("--image"));
        assert!(parse("--image=x.elf").unwrap().has("--image"));
        assert!(!parse("--images x.elf").unwrap().has("--image"));
    }

    #[test]
    fn a_machine_is_a_name_or_a_folder() {
        let root = build::root();
        for name in machine_names(root) {
            assert_eq!(machine_for_build(&name, root).unwrap(), *name);
        }
        let folder = machine_for_build("./src", root).unwrap();
        assert!(Path::new(&folder).is_absolute());
        let message = machine_for_build("no-such-machine", root).unwrap_err().to_string();
        assert!(
            message.starts_with("--machine no-such-machine: neither a folder nor one of tables/"),
            "{message}"
        );
    }
}
