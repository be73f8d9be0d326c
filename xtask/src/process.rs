//! Running other programs.

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Runs it with this process's own input and output; returns whether it succeeded.
pub fn succeeds(command: &mut Command) -> Result<bool> {
    Ok(command.status().with_context(|| cannot_start(command))?.success())
}

/// Runs it silently; `false` also when it cannot be started.
pub fn quietly(command: &mut Command) -> bool {
    let silent = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    silent.status().is_ok_and(|status| status.success())
}

/// The program's standard output, trimmed; `None` if it fails or cannot be started.
pub fn output_of(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    let text = output.status.success().then_some(output.stdout)?;
    Some(String::from_utf8_lossy(&text).trim().to_owned())
}

/// Tells what begins now, on a line of its own.
pub fn say(what: &str) {
    eprintln!("xtask: {what}");
}

/// Prints the findings; having none is good.
pub fn is_good(findings: &[String]) -> bool {
    findings.iter().for_each(|finding| println!("{finding}"));
    findings.is_empty()
}

/// Processor time of this process and of all that it has waited for, in s; 0 if the system does not report it.
pub fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets: utime, stime, cutime and cstime, in hundredths of a second.
    let fields = stat.rsplit_once(") ").map_or("", |(_, fields)| fields).split(' ');
    fields.skip(11).take(4).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// The message for a program that does not start.
pub fn cannot_start(command: &Command) -> String {
    format!("cannot start {}", command.get_program().to_string_lossy())
}

/// A bar for so many runs, on a terminal; in a pipe indicatif draws none.
pub fn bar(name: &'static str, runs: usize) -> ProgressBar {
    let bar = ProgressBar::new(runs as u64).with_message(name);
    match ProgressStyle::with_template("{msg:16} [{bar:40}] {pos}/{len} {elapsed} (left {eta})") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
    .with_finish(indicatif::ProgressFinish::AndClear)
}

/// The place of a program on the PATH.
pub fn find(program: &str) -> Option<PathBuf> {
    find_in(program, &std::env::var_os("PATH")?)
}

fn find_in(program: &str, path: &OsStr) -> Option<PathBuf> {
    let name = format!("{program}{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(path).map(|folder| folder.join(&name)).find(|file| file.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_found_where_the_path_leads() {
        let test = std::env::current_exe().unwrap();
        let name = test.file_stem().unwrap().to_str().unwrap();
        let folder = test.parent().unwrap();
        assert_eq!(find_in(name, folder.as_os_str()), Some(test.clone()));
        assert_eq!(find_in("no-such-program", folder.as_os_str()), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_time_of_children_counts() {
        let before = processor_s();
        assert!(quietly(
            Command::new("sh").args(["-c", "i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done"])
        ));
        assert!(processor_s() > before);
    }

    #[test]
    fn what_cannot_start_is_a_failure_not_a_panic() {
        assert!(!quietly(&mut Command::new("no-such-program")));
        assert_eq!(output_of(&mut Command::new("no-such-program")), None);
        let error = succeeds(&mut Command::new("no-such-program")).unwrap_err();
        assert_eq!(error.to_string(), "cannot start no-such-program");
    }
}
