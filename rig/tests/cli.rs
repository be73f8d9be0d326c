//! The command line: what it refuses, and what it leaves behind.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use tractive::modulation::Mode;

fn rig(line: &str) -> Output {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    Command::new(env!("CARGO_BIN_EXE_tractive-rig"))
        .current_dir(root)
        .args(line.split_whitespace())
        .output()
        .unwrap()
}

/// Exit code 2, and standard error that holds these words.
fn refused(line: &str, words: &[&str]) -> String {
    let output = rig(line);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{line}: {errors}");
    for word in words {
        assert!(errors.contains(word), "{line}: no {word} in: {errors}");
    }
    errors.into_owned()
}

/// The same, and nothing but one line.
fn refused_in_one_line(line: &str, words: &[&str]) {
    assert_eq!(refused(line, words).trim().lines().count(), 1, "{line}");
}

#[test]
fn a_reader_who_leaves_changes_nothing() {
    let out = tempfile::tempdir().unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_tractive-rig"))
        .args(["run", "sweep", "--to", "100", "--out"])
        .arg(out.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(out.path().join("report.html").exists());
}

#[test]
fn the_page_says_what_was_run() {
    let folder = tempfile::tempdir().unwrap();
    rig(&format!("run sweep --to 100 --udc 1400 --seed 7 --out {}", folder.path().display()));
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    let git = ["-C", env!("CARGO_MANIFEST_DIR"), "rev-parse", "--short=12", "HEAD"];
    let git = Command::new("git").args(git).output().ok().filter(|output| output.status.success());
    let commit = git.map_or(String::new(), |output| String::from_utf8(output.stdout).unwrap());
    let version = env!("CARGO_PKG_VERSION");
    let lines =
        [("machine", "pmasynrm-180kw"), ("DC source", "1400 V"), ("--seed", "7"), ("version", version)];
    for (what, value) in lines.into_iter().chain((!commit.is_empty()).then_some(("commit", commit.trim()))) {
        assert!(page.contains(&format!("<dt>{what}</dt><dd>{value}")), "{what}: no {value}");
    }
}

#[test]
fn bad_usage_is_refused() {
    refused_in_one_line("run nonsense", &["nonsense", "load-steps, sweep, characteristic, "]);
    refused_in_one_line("run sweep --machine nowhere", &["nowhere", "must be"]);
    refused("run sweep --udc-ripple 30", &["30", "V@HZ"]);
    refused("run sweep --dt -1", &["-1"]);
    refused("run sweep --dt nan", &["nan"]);
    refused("run sweep --noise-a inf", &["inf"]);
    refused("run sweep --adc-bits 99", &["99"]);
    refused_in_one_line("run sweep --to 1e9", &["--to 1000000000", "-18000 to 18000"]);
    refused_in_one_line("run sweep --dt 1e-9", &["--dt", "0.00000004 to 0.1"]);
    refused_in_one_line("run sweep --udc 1e9", &["--udc", "must be from"]);
    refused_in_one_line("run steady --speed 1e12", &["--speed", "must be from"]);
    refused_in_one_line("run sweep --map-error -100", &["--map-error -100", "-90"]);
    refused_in_one_line(
        "run sweep --device-drop-told 21,0",
        &["--device-drop-told 21", "must be from 0 to 20"],
    );
    refused_in_one_line("run sweep --slope 1e-6", &["--slope", "must be from 12.5 to 25000"]);
    refused("run sweep --udc -5", &["'-5'", "'--udc <UDC>'", "must be a number above 0"]);
    for (bad, word) in [
        ("--f1 100 --cycles 0", "--cycles 0"),
        ("--f1 100 --cycles 10001", "1 to 10000"),
        ("--f1 1e-9", "--f1 0.000000001"),
        ("--f1 1e5", "--f1 100000"),
        ("--f1 100 --dead-time-us 1e6", "dead_time_ticks: 25000000"),
        ("--f1 100 --min-pulse-us 1e6", "(--min-pulse-us), 25 a µs"),
    ] {
        refused_in_one_line(&format!("pattern --mode mid7 --u 1 --udc 2 {bad} --out x"), &[word, "must be"]);
    }
    refused("pattern --mode mid9 --u 1 --udc 2 --f1 3 --out x", &["mid9"]);
}

/// A file in the place where the files are to go is reported before anything has run.
#[test]
fn a_place_that_is_taken_is_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "mine").unwrap();
    for command in [
        "run sweep",
        "campaign",
        "campaign --random 1000",
        "campaign --random 9 --shard 0/3",
        "compare",
        "figures",
        "identify",
    ] {
        for out in [file.clone(), file.join("deeper")] {
            let line = format!("{command} --out {}", out.display());
            refused_in_one_line(
                &line,
                &[&format!("{} is a file: must be a folder, or nothing yet", file.display())],
            );
        }
    }
    refused_in_one_line("campaign --random 0", &["--random 0: must be at least 1"]);
    let (file, place) = (file.display(), folder.path().display());
    refused_in_one_line(
        &format!("machine show pmsm-48v-1kw --out {place}"),
        &["is a folder: must be a file"],
    );
    refused_in_one_line(&format!("dbc --out {place}/no/x.dbc"), &[&format!("there is no folder {place}/no")]);
    assert_eq!(std::fs::read_to_string(format!("{file}")).unwrap(), "mine");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A run of the second system has no overview: that of an earlier run does not stay.
#[test]
fn no_picture_of_another_run_stays() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("overview.svg");
    std::fs::write(&picture, "of another run").unwrap();
    rig(&format!("run zs9-steady --out {}", folder.path().display()));
    assert!(folder.path().join("report.html").exists() && !picture.exists());
}

/// A folder of which a file never ends.
#[test]
fn an_endless_machine_is_refused() {
    for name in ["machine.toml", "flux_map.csv"] {
        let folder = tempfile::tempdir().unwrap();
        for file in ["machine.toml", "flux_map.csv"] {
            let good = concat!(env!("CARGO_MANIFEST_DIR"), "/../tables/pmasynrm-180kw");
            let from = if file == name { "/dev/zero".to_owned() } else { format!("{good}/{file}") };
            std::os::unix::fs::symlink(from, folder.path().join(file)).unwrap();
        }
        let line = format!("run sweep --machine {}", folder.path().display());
        refused_in_one_line(&line, &[name, "must be a regular file"]);
    }
}

/// An option that would change nothing is refused, and what it needs is named.
#[test]
fn options_that_go_alone_are_refused() {
    for (line, needed) in [
        ("sweep --mtpa-start zero", "--law pi"),
        ("sweep --angle-late-known", "--angle-jitter-us"),
        ("sweep --current-filter-known", "--adc-skew-us"),
        ("sweep --iron-loss-known", "--iron-loss"),
        ("sweep --device-drop-known", "--device-drop"),
        ("sweep --angle-1f-phase-deg 20 --angle-2f-deg 1", "--angle-1f-deg"),
        ("sweep --angle-2f-phase-deg 20 --angle-1f-deg 1", "--angle-2f-deg"),
        ("sweep --friction 3", "a free rotor"),
        ("sweep --iron-loss 100 --machine pmsm-48v-1kw", "loss_rated_w"),
        ("sweep --ablate damping", "--line"),
        ("zs9-steady --uncompensated", "--dead-time-us"),
    ] {
        let option = line.split(' ').nth(1).unwrap();
        refused_in_one_line(&format!("run {line}"), &[option, "has no effect without", needed]);
    }
    // Of all flaws at once, a machine has those that it can have.
    let folder = tempfile::tempdir().unwrap();
    let line = format!("run steady --real --machine pmsm-48v-1kw --out {}", folder.path().display());
    assert_ne!(rig(&line).status.code(), Some(2));
}

/// A flaw that cannot be is refused, and named.
#[test]
fn flaws_that_cannot_be_are_refused() {
    refused_in_one_line("run load-steps --slots 200", &["--slots", "200", "-100 to 100"]);
    refused_in_one_line("run load-steps --current-offset 0,101,0", &["--current-offset", "101"]);
    refused_in_one_line("run load-steps --current-gains 0,0,-60", &["--current-gains", "-60"]);
    refused_in_one_line("run load-steps --device-drop 200,5,1.5,3", &["--device-drop", "200"]);
    refused_in_one_line("run load-steps --angle-1f-phase-deg 400", &["--angle-1f-phase-deg", "400"]);
    refused_in_one_line("run load-steps --angle-jitter-us 1e5", &["--angle-jitter-us", "100000"]);
    for line in ["--current-offset 2,0", "--current-gains 1,2,x", "--device-drop 2,5,-1,3", "--slots nan"] {
        let output = rig(&format!("run load-steps {line}"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(said.contains(line.split(' ').next().unwrap()) && said.contains("must be"), "{line}: {said}");
    }
}

/// Options that would change nothing, or never happen, are refused.
#[test]
fn options_that_do_nothing_are_refused() {
    refused_in_one_line("run load-steps --down", &["--down", "load-steps"]);
    refused_in_one_line("run zs9-load-step --torque-scale 0.5", &["--torque-scale", "zs9-load-step"]);
    refused_in_one_line("run zs9-reverse --step 40", &["--step", "zs9-reverse"]);
    refused_in_one_line("run sweep --uin 667", &["--uin", "sweep"]);
    refused_in_one_line("run sweep --step 40", &["--step", "sweep"]);
    refused_in_one_line("run zs9-load-step --ablate trim", &["--ablate", "zs9-load-step"]);
    refused_in_one_line("run zs9-load-step --inject source-short@1.3", &["--inject", "1.3 s", "1.2 s"]);
    refused_in_one_line(
        "run zs9-load-step --inject overcurrent@-0.1",
        &["--inject", "-0.1 s", "from 0 to 1.18 s"],
    );
    refused("run zs9-cycle --cruise 0.5", &["0.5", "--cruise", "from 0.7 to 3600"]);
    // Too late to show.
    refused_in_one_line(
        "run zs9-load-step --inject overcurrent@1.2",
        &["--inject", "1.18 s", "ends at 1.2 s"],
    );
    refused_in_one_line("run zs9-steady --min-pulse-us 3", &["--min-pulse-us", "ZS9"]);
    refused("run zs9-steady --seed -1", &["--seed", "must be a whole number from 0"]);
}

/// Each scenario's help has its own options and no others.
#[test]
fn help_shows_what_the_scenario_takes() {
    let help = |line: &str| {
        let output = rig(line);
        assert_eq!(output.status.code(), Some(0), "{line}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let sweep = help("run sweep --help");
    assert!(sweep.contains("--torque-scale") && sweep.contains("figure 9: sweep"), "{sweep}");
    assert!(!sweep.contains("--step") && !sweep.contains("--scheme"), "{sweep}");
    let zs9 = help("run zs9-load-step -h");
    assert!(zs9.contains("--step") && zs9.contains("--scheme") && !zs9.contains("--down"), "{zs9}");
    assert!(zs9.contains("the paper's 400") && !zs9.contains("--min-pulse-us"), "{zs9}");
    let all = help("run --help");
    assert!(all.contains("zs9-cycle") && all.contains("--dead-time-us") && !all.contains("--down"), "{all}");
}

/// Options stand before or after the scenario's name, which is found among their values; without one it is the sweep.
#[test]
fn the_scenario_is_found_wherever_it_stands() {
    for (line, wanted) in [
        (
            "--uncompensated load-steps",
            r#"{"system":"pmasynrm","law":"tractive","patterns":"paper","on":"host","#,
        ),
        (
            "--down --to 100 --law pi --on qemu",
            r#"{"system":"pmasynrm","law":"pi","patterns":"paper","on":"qemu","#,
        ),
        (
            "--dt 1e-4 zs9-cycle --cruise 1",
            r#"{"system":"zs9","law":"tractive","patterns":"paper","on":"host","#,
        ),
        ("zs9-reverse --law pi --on qemu", r#"{"system":"zs9","law":"pi","patterns":"paper","on":"qemu","#),
    ] {
        let output = rig(&format!("needs run {line}"));
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.starts_with(wanted), "{line}: {said}{}", String::from_utf8_lossy(&output.stderr));
    }
    refused_in_one_line("run --dt 1e-4 --down load-steps", &["--down", "load-steps"]);
    refused_in_one_line("needs run a/b", &["scenario a/b", "must be one of"]);
    refused("needs run --on moon", &["moon", "qemu"]);
}

#[test]
fn a_machine_names_its_patterns() {
    let folder = tempfile::tempdir().unwrap();
    let given = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    std::fs::copy(given.join("flux_map.csv"), folder.path().join("flux_map.csv")).unwrap();
    let keys = std::fs::read_to_string(given.join("machine.toml")).unwrap();
    std::fs::write(folder.path().join("machine.toml"), keys + "\npatterns = \"optimal\"\n").unwrap();
    for (more, patterns) in [("", "optimal"), ("--patterns paper", "paper")] {
        let output = rig(&format!("needs run sweep --machine {} {more}", folder.path().display()));
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(said["patterns"], patterns, "{more}");
    }
}

#[test]
fn a_run_ends_with_a_headline_and_a_table_with_units() {
    let folder = tempfile::tempdir().unwrap();
    let output = rig(&format!("run load-steps --out {}", folder.path().display()));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.starts_with("PASS: 4 of 4 bounds kept · load-steps · figure 8"), "{said}");
    let row = said.lines().find(|line| line.contains(" t90 ")).unwrap();
    assert!(row.trim_start().starts_with("pass") && row.contains(" ms  2.500 ms"), "{said}");
    let peak = said.lines().find(|line| line.contains("peak current")).unwrap();
    assert!(peak.trim_end().ends_with(" A"), "{said}");
}

#[test]
fn the_zs9_refuses_flaws_out_of_range_too() {
    refused_in_one_line("run zs9-load-step --map-error -100", &["--map-error -100", "-90"]);
    refused_in_one_line("run zs9-load-step --udc-ripple 500@300", &["--udc-ripple 500", "400"]);
    // More than shoot-through makes of the source.
    refused_in_one_line("run zs9-load-step --uin 1020", &["--uin 1020", "400 V to 1000 V", "duty of 0.3"]);
    refused_in_one_line("run zs9-load-step --udc 500 --uin 1201", &["--uin 1201", "500 V to 1200 V"]);
}

/// A window shorter than a turn of the field is taken as it is; it used to be lengthened into the time before.
#[test]
fn a_machine_that_stands_has_its_torque() {
    let folder = tempfile::tempdir().unwrap();
    let output = rig(&format!("run steady --speed 0 --json --out {}", folder.path().display()));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let torque_nm = summary["figures"]["point"][0]["torque_nm"].as_f64().unwrap();
    assert!((torque_nm - 1235.0).abs() < 2.0, "{torque_nm}");
    for verdict in summary["figures"]["verdicts"].as_array().unwrap() {
        assert_ne!(verdict["verdict"], "pass", "{verdict}");
    }
}

#[test]
fn a_pattern_beyond_its_mode_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("p.csv");
    let line = |mode: &str, u: f64| {
        format!("pattern --mode {mode} --u {u} --udc 1500 --f1 50 --out {}", out.display())
    };
    refused_in_one_line(&line("sync15", 900.0), &["900", "sync15", "at most 866"]);
    assert!(!out.exists());
    assert_eq!(rig(&line("sync15", 800.0)).status.code(), Some(0));
    assert!(std::fs::read_to_string(&out).unwrap().starts_with("t_s,leg,level\n0.000000000,u,"));
}

#[test]
fn the_pattern_of_every_mode_can_be_had_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("p.csv");
    let line =
        |mode: &str| format!("pattern --mode {mode} --u 500 --udc 1500 --f1 50 --out {}", out.display());
    for mode in Mode::ALL {
        let wanted = if mode == Mode::Off { 2 } else { 0 };
        assert_eq!(rig(&line(mode.name())).status.code(), Some(wanted), "{}", mode.name());
    }
    // A number of pulses stands for the branch that the drive plays at this index.
    for (pulses, branch) in [("opp13", "opp13a"), ("opp9", "opp9a"), ("opp7", "opp7a"), ("opp5", "opp5a")] {
        let [of_pulses, of_branch] = [pulses, branch].map(|mode| {
            assert_eq!(rig(&line(mode)).status.code(), Some(0), "{mode}");
            std::fs::read(&out).unwrap()
        });
        assert!(of_pulses == of_branch, "{pulses}");
    }
}

#[test]
fn a_line_filter_adds_its_current_to_the_trace_and_patterns_are_named_by_their_pulses() {
    let folder = tempfile::tempdir().unwrap();
    let words = "run steady --speed 1600 --torque 1235 --line 3,4,30 --patterns optimal";
    assert_eq!(rig(&format!("{words} --out {}", folder.path().display())).status.code(), Some(0));
    let trace = std::fs::read_to_string(folder.path().join("trace.csv")).unwrap();
    let line_a: Vec<f64> = column(&trace, "line_a").iter().map(|value| value.parse().unwrap()).collect();
    let mean_a = line_a.iter().sum::<f64>() / line_a.len() as f64;
    assert!((100.0..200.0).contains(&mean_a), "{mean_a} A of some 207 kW at 1,500 V");
    assert!(column(&trace, "mode").iter().all(|mode| mode == "opp7"));
}

#[test]
fn points_come_back_with_their_regions() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    let line = format!("points {} {}", input.display(), output.display());
    // The last one is beyond the largest speed, where tables are some percent off; a current keeps both limits there.
    let points = "1235,1000,1500\n392,6000,1500\n1235,6000,1500\n5,7000,1500\n";
    std::fs::write(&input, format!("torque_nm,speed_rpm,udc_v\n{points}")).unwrap();
    assert_eq!(rig(&line).status.code(), Some(0));
    let text = std::fs::read_to_string(&output).unwrap();
    let regions: Vec<_> = text.lines().skip(1).map(|line| line.rsplit(',').next().unwrap()).collect();
    assert_eq!(regions, ["mtpa", "fw", "limit", "fw"], "{text}");
    // All columns stay, in their order and as they are written; what an earlier run has found is found anew.
    std::fs::write(&input, "name,udc_v,region,speed_rpm,torque_nm\n\"a, b\",1500.0,old,1e3,1235\n").unwrap();
    assert_eq!(rig(&line).status.code(), Some(0));
    let kept = std::fs::read_to_string(&output).unwrap();
    let (head, row) = kept.trim_end().split_once('\n').unwrap();
    assert_eq!(head, "name,udc_v,speed_rpm,torque_nm,id_a,iq_a,region");
    let found = text.lines().nth(1).unwrap().strip_prefix("1235,1000,1500").unwrap();
    assert_eq!(row, format!("\"a, b\",1500.0,1e3,1235{found}"));
    std::fs::remove_file(&output).unwrap();
    for (bad, words) in [
        ("torque_nm,speed_rpm\n1,2\n", ["udc_v", ":1:"]),
        ("torque_nm,speed_rpm,udc_v\n1,2,3\n1,nan,3\n", [":3:", "speed_rpm"]),
        ("torque_nm,speed_rpm,udc_v\n1,2,0\n", [":2:", "udc_v"]),
        ("torque_nm,speed_rpm,udc_v\n1,x,3\n", [":2:", "must be"]),
        (
            "torque_nm,speed_rpm,udc_v\n9,6000,1500\n9,1e6,1500\n",
            [":3: speed_rpm: 1e6", "no more voltage than 1500 V"],
        ),
    ] {
        std::fs::write(&input, bad).unwrap();
        refused_in_one_line(&line, &words);
        assert!(!output.exists(), "{bad}");
    }
}

#[test]
fn a_run_leaves_whole_files_with_the_columns_promised() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("deep/er");
    let output = rig(&format!("run sweep --to 100 --dt 1e-4 --json --out {}", out.display()));
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let written: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    assert_eq!(written["machine"], "pmasynrm-180kw");
    let trace = std::fs::read_to_string(out.join("trace.csv")).unwrap();
    let mut lines = trace.lines();
    assert_eq!(
        lines.next(),
        Some(
            "t_s,speed_rpm,te_ref_nm,te_nm,id_ref_a,iq_ref_a,id_a,iq_a,ia_a,ib_a,ic_a,u_v,udc_v,f1_hz,mode,fault"
        )
    );
    assert_eq!(lines.count(), 14_001, "1.4 s at 0.1 ms, both ends");
    assert!(std::fs::read_to_string(out.join("edges.csv")).unwrap().starts_with("t_s,gate,level\n"));
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("igure 9") && !page.contains("http://www.example") && !page.contains("src="));
    let others = std::fs::read_dir(&out).unwrap().count();
    assert_eq!(others, 5, "no temporary file is left");
}

#[test]
fn a_bound_that_is_not_kept_is_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    // The link's voltage allows no such step in 2.5 ms.
    let output = rig(&format!("run full-step --udc 1000 --out {}", folder.path().display()));
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stdout).contains("falls short"));
    assert!(folder.path().join("report.html").exists(), "the report says what");
}

#[test]
fn a_trip_is_exit_code_1_with_its_name_value_and_limit() {
    let folder = tempfile::tempdir().unwrap();
    let output = rig(&format!("run sweep --to 100 --udc 2200 --out {}", folder.path().display()));
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        errors.contains("dc_overvoltage") && errors.contains("2200") && errors.contains("2070"),
        "{errors}"
    );
}

/// Columns of a CSV by name.
fn column(text: &str, name: &str) -> Vec<String> {
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let index = lines.next().unwrap().iter().position(|head| *head == name).unwrap();
    lines.map(|fields| fields[index].to_owned()).collect()
}

#[test]
fn a_fault_leaves_the_flight_recorder_and_a_good_run_takes_it_away() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().display();
    let recorder = folder.path().join("recorder.csv");
    let bad = rig(&format!("run timing --to 2000 --fault-at 0.05 --out {out}"));
    assert_eq!(bad.status.code(), Some(1));
    let text = std::fs::read_to_string(&recorder).unwrap();
    let times: Vec<f64> = column(&text, "t_s").iter().map(|t_s| t_s.parse().unwrap()).collect();
    assert_eq!(times.len(), tractive::recorder::RECORDS);
    assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 1e-4).abs() < 1e-9), "control periods in a row");
    let faults = column(&text, "fault");
    let first = faults.iter().position(|fault| !fault.is_empty()).unwrap();
    assert_eq!(times.len() - first, tractive::recorder::Recorder::AFTER);
    assert!(faults[first..].iter().all(|fault| fault == "not_finite"));
    assert!((times[first] - 0.05).abs() < 1.5e-4, "{}", times[first]);
    let pulsing = column(&text, "pulsing");
    assert!(pulsing[..first].iter().all(|on| on == "1") && pulsing[first..].iter().all(|on| on == "0"));
    // The same samples as the drive's: the trace has the true currents at these instants.
    let trace = std::fs::read_to_string(folder.path().join("trace.csv")).unwrap();
    let truth: Vec<(f64, f64)> = column(&trace, "t_s")
        .iter()
        .zip(column(&trace, "ia_a"))
        .map(|(t_s, ia)| (t_s.parse().unwrap(), ia.parse().unwrap()))
        .collect();
    for (t_s, ia) in times.iter().zip(column(&text, "ia_a")) {
        let (_, wanted) = truth.iter().find(|(at_s, _)| (at_s - t_s).abs() < 1e-8).unwrap();
        let recorded: f64 = ia.parse().unwrap();
        assert!((recorded - wanted).abs() < 1e-2, "at {t_s}: {recorded} A, true {wanted} A");
    }
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("Flight recorder · around not_finite at 0.05"));
    let good = rig(&format!("run timing --to 300 --torque-scale 0.1 --out {out}"));
    assert_eq!(good.status.code(), Some(0), "{}", String::from_utf8_lossy(&good.stderr));
    assert!(!recorder.exists());
}

#[test]
fn completions_know_the_scenarios_and_the_options_of_each() {
    for shell in ["bash", "zsh", "fish"] {
        let output = rig(&format!("completions {shell}"));
        let text = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{shell}");
        for word in ["zs9-load-step", "torque-scale", "carrier-hz", "compare"] {
            assert!(text.contains(word), "{shell}: {word}");
        }
    }
    assert_eq!(rig("completions tcsh").status.code(), Some(2));
}

#[test]
fn what_is_printed_for_machines_is_one_line_of_json() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().display();
    let read = |line: &str| -> serde_json::Value {
        let output = rig(line);
        assert_eq!(output.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(output.stdout.iter().filter(|byte| **byte == b'\n').count(), 1, "{line}");
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let figures = read(&format!("figures --only chai-7 zs9-3 --json --out {place}"));
    assert_eq!(figures[0]["name"], "chai-7");
    assert!(std::path::Path::new(figures[1]["files"][0].as_str().unwrap()).is_file(), "{figures}");
    let shown = read(&format!("machine show pmsm-48v-1kw --json --out {place}/page.html"));
    assert!(shown["figures"]["max_torque_nm"].as_f64() > Some(1.0), "{shown}");
    let made = read(&format!(
        "machine new --pole-pairs 4 --rs 0.05 --ld 3e-4 --lq 5e-4 --psi-f 0.02 --max-current 60 --udc 96 --max-speed-rpm 3000 --max-switching-hz 10000 --json --out {place}/machine"
    ));
    assert!(made["max_torque_nm"].as_f64() > Some(1.0) && made["name"] == "machine", "{made}");
    let rows = read("compare --only MTPA --json");
    assert!(rows.as_array().is_some_and(|rows| !rows.is_empty() && rows[0]["ahead"] == true), "{rows}");
}

#[test]
fn a_figure_is_drawn_in_pixels_and_for_a_paper_too() {
    if std::process::Command::new("rsvg-convert").arg("--version").output().is_err() {
        println!("skipped: rsvg-convert is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output =
        rig(&format!("figures --only chai-7 --also png,pdf --zoom 1 --out {}", folder.path().display()));
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let begins = |end: &str| std::fs::read(folder.path().join(format!("chai-7.{end}"))).unwrap();
    assert!(begins("svg").starts_with(b"<svg") && begins("pdf").starts_with(b"%PDF"));
    let png = begins("png");
    assert!(png.starts_with(b"\x89PNG"));
    // The sheet's own size.
    let width = u32::from_be_bytes(png[16..20].try_into().unwrap());
    let svg = String::from_utf8(begins("svg")).unwrap();
    assert!(svg.contains(&format!("width=\"{width}\"")), "{width}: {}", &svg[..80]);
}
