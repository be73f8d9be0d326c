//! `nine-switch` on the command line: what it writes for a good file, and what it says about a bad one.

use std::path::Path;
use std::process::{Command, Output};

const HEAD: &str = "scheme,theta1_deg,m1,theta2_deg,m2,d_sh";

fn rig(input: &Path, output: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
    command.arg("nine-switch").arg(input).arg(output).output().unwrap()
}

/// The rows of the output for these lines of input, by column.
fn rows(lines: &str) -> Vec<std::collections::HashMap<String, String>> {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    std::fs::write(&input, lines).unwrap();
    let done = rig(&input, &output);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2, "no temporary file is left");
    csv::Reader::from_path(&output).unwrap().deserialize().collect::<Result<_, _>>().unwrap()
}

#[test]
fn every_gate_has_its_level_and_its_toggles() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    std::fs::write(&input, format!("# two motors\n{HEAD}\nrthd,20,0.4,-320,3e-1,0.2\n")).unwrap();
    assert_eq!(rig(&input, &output).status.code(), Some(0));
    let text = std::fs::read_to_string(&output).unwrap();
    let (head, row) = text.trim_end().split_once('\n').unwrap();
    let gates = "UH VH WH UM VM WM UL VL WL".split(' ').map(|g| format!("{g}_init,{g}_edges"));
    let gates = gates.collect::<Vec<_>>().join(",");
    assert_eq!(head, format!("{HEAD},{gates},feasible,m1_applied,m2_applied"));
    // By hand: T1 = 0.2227, T2 = 0.1185, T3 = 0.0889, T4 = 0.1670; each border of V14 and V15 gives D T/4 = 0.05.
    let expected = [
        (1, vec![0.42057, 0.57943], 0.05),
        (1, vec![0.30924, 0.69076], 0.0),
        (1, vec![0.25, 0.75], 0.0),
        (1, vec![0.25, 0.42057, 0.57943, 0.75], 0.0),
        (1, vec![0.20557, 0.30924, 0.69076, 0.79443], 0.0),
        (1, vec![0.12207, 0.25, 0.75, 0.87793], 0.0),
        (0, vec![0.25, 0.75], 0.0),
        (0, vec![0.20557, 0.79443], 0.0),
        (0, vec![0.12207, 0.87793], -0.05),
    ];
    let cells: Vec<&str> = row.split(',').collect();
    assert_eq!(cells[..6], ["rthd", "20", "0.4", "-320", "3e-1", "0.2"]);
    for (pair, (level, edges, later)) in cells[6..24].chunks(2).zip(expected) {
        assert_eq!(pair[0], level.to_string());
        let got: Vec<f64> = pair[1].split(';').map(|t| t.parse().unwrap()).collect();
        assert_eq!(got.len(), edges.len(), "{row}");
        for (got, edge) in got.iter().zip(edges) {
            let edge = if edge < 0.5 { edge + later } else { edge - later };
            assert!((got - edge).abs() < 1e-5, "{got} for {edge}: {row}");
        }
    }
    assert_eq!(cells[24..], ["1", "0.4", "0.3"]);
}

#[test]
fn columns_may_stand_in_any_order_and_every_scheme_runs() {
    let schemes = ["s", "rs", "rthd", "zvo", "rthd-central", "rthd-slide"];
    let lines: Vec<String> =
        schemes.iter().map(|scheme| format!("0.1,note,0.5,{scheme},100,0.4,1e3")).collect();
    let rows = rows(&format!("d_sh,comment,m1,scheme,theta1_deg,m2,theta2_deg\n{}\n", lines.join("\n")));
    assert_eq!(rows.len(), schemes.len());
    for (row, scheme) in rows.iter().zip(schemes) {
        assert_eq!((row["scheme"].as_str(), row["feasible"].as_str()), (scheme, "1"));
        assert_eq!((row["theta1_deg"].as_str(), row["m2"].as_str()), ("100", "0.4"));
    }
}

#[test]
fn what_does_not_fit_is_limited_and_said() {
    let rows = rows(&format!("{HEAD}\nrthd,30,0.7,0,0.1,0.2\nrthd-slide,30,0.7,0,0.1,0.2\nrs,5,0,5,0,0\n"));
    let told = |k: usize| ["feasible", "m1_applied", "m2_applied"].map(|name| rows[k][name].as_str());
    assert_eq!((told(0)[0], told(0)[2]), ("0", "0.1"));
    // (1 − D)/√3.
    assert!((told(0)[1].parse::<f64>().unwrap() - 0.461_880).abs() < 1e-5);
    assert_eq!(told(1), ["1", "0.7", "0.1"]);
    // No voltage, no shoot-through: V13 for ever.
    assert_eq!(told(2), ["1", "0", "0"]);
    for gate in ["UH", "UM", "UL"] {
        assert_eq!(rows[2][&format!("{gate}_init")], if gate == "UM" { "0" } else { "1" });
        assert_eq!(rows[2][&format!("{gate}_edges")], "");
    }
}

#[test]
fn bad_input_is_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    let refused = |words: &[&str]| {
        let done = rig(&input, &output);
        let errors = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{errors}");
        assert_eq!(errors.trim_end().lines().count(), 1, "{errors}");
        for word in words {
            assert!(errors.contains(word), "no {word} in: {errors}");
        }
        assert!(!output.exists(), "{errors}");
    };
    refused(&["in.csv", "cannot be read"]);
    let good = "rthd,20,0.4,40,0.3,0.2";
    for (bad, words) in [
        ("rthx,20,0.4,40,0.3,0.2", ["scheme: rthx", "s, rs, rthd, zvo, rthd-central, rthd-slide"]),
        ("rthd,nan,0.4,40,0.3,0.2", ["theta1_deg: nan", "a finite number"]),
        ("rthd,20,-0.4,40,0.3,0.2", ["m1: -0.4", "0 or more"]),
        ("rthd,20,0.4,x,0.3,0.2", ["theta2_deg: x", "a finite number"]),
        ("rthd,20,0.4,40,1e39,0.2", ["m2: 1e39", "a finite number"]),
        ("rthd,20,0.4,40,0.3,1.1", ["d_sh: 1.1", "from 0 to 1"]),
        ("rthd,20,0.4,40,0.3,-0.1", ["d_sh: -0.1", "from 0 to 1"]),
        ("rthd,20,0.4,40,0.3,", ["d_sh: ", "from 0 to 1"]),
        ("rthd,20,0.4,40,0.3", ["5 fields", "must be 6"]),
        ("\"rt\nhd\",20,0.4,40,0.3,0.2", ["scheme: rt\\nhd", "must be s"]),
    ] {
        std::fs::write(&input, format!("{HEAD}\n{good}\n{bad}\n{good}\n")).unwrap();
        refused(&["in.csv:3: ", words[0], words[1]]);
    }
    std::fs::write(&input, "scheme,theta1_deg,m1,theta2_deg,m2\nrthd,1,0.1,2,0.1\n").unwrap();
    refused(&["in.csv:1: ", "d_sh is missing", HEAD]);
    std::fs::write(&input, b"scheme,theta1_deg,m1,theta2_deg,m2,d_sh\nrthd,\xff,0.1,2,0.1,0\n").unwrap();
    refused(&["in.csv:2: "]);
    std::fs::write(&input, "").unwrap();
    refused(&["in.csv:1: ", "scheme is missing"]);
    // What was there before stays.
    std::fs::write(&input, format!("{HEAD}\nrthd,inf,0,0,0,0\n")).unwrap();
    std::fs::write(&output, "old").unwrap();
    assert_eq!(rig(&input, &output).status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&output).unwrap(), "old");
}
