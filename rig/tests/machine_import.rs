//! `machine import`: maps as other tools write them come out as the machine that they are of.

#[path = "../../tablegen/tests/common/mod.rs"]
mod folders;
mod imported;

use folders::axis;
use imported::{error, import, map, truth};
use std::process::Command;

/// Values that are dense about 0 and sparse far from it.
fn uneven(first: f64, last: f64, count: usize) -> Vec<f64> {
    let place = |k: usize| 2.0 * k as f64 / (count - 1) as f64 - 1.0;
    let bent = |x: f64| 0.5 * (x + x.powi(3));
    (0..count).map(|k| 0.5 * (first + last) + 0.5 * (last - first) * bent(place(k))).collect()
}

/// Maps as other tools write them: what is odd, the file, the options that it takes, and the largest error.
fn foreign() -> [(&'static str, String, &'static str, f64); 5] {
    let root = 2.0_f64.sqrt();
    let (d, q) = (axis(-22.0, 1.0, 26), axis(0.0, 1.0, 23));
    let both = axis(-22.0, 1.0, 45);
    [
        (
            "names with units in brackets, a torque beside them, half a plane",
            map("Iq [A],Id [A],Torque [Nm],Psi_d [Vs],Psi_q [Vs]", &q, &d, |iq, id| {
                let (psi_d, psi_q) = truth(id, iq);
                format!("{iq},{id},1.5,{psi_d:.9},{psi_q:.9}")
            }),
            "",
            1e-4,
        ),
        (
            "rms and thousandths, semicolons and decimal commas, both signs of iq",
            map("id_mA rms;iq_mA rms;lambda_d (mWb);lambda_q (mWb)", &d, &both, |id, iq| {
                let (psi_d, psi_q) = truth(id, iq);
                let (id, iq) = (1e3 * id / root, 1e3 * iq / root);
                format!("{id:.6};{iq:.6};{:.6};{:.6}", 1e3 * psi_d, 1e3 * psi_q).replace('.', ",")
            }),
            "",
            1e-4,
        ),
        (
            "d along the least reluctance: this machine's −q is the map's d, with magnets along −q",
            map("# from a finite-element model\ni_d\ti_q\tFd\tFq", &q, &axis(-3.0, 1.0, 26), |id, iq| {
                let (psi_d, psi_q) = truth(-iq, id);
                format!("{id}\t{iq}\t{psi_q:.9}\t{:.9}", -psi_d)
            }),
            "--d-axis reluctance",
            1e-4,
        ),
        (
            "currents counted as a generator's, the other half of the plane, flux of one of four turns",
            map("Id,Iq,Flux Linkage D,Flux Linkage Q", &d, &q, |id, iq| {
                let (psi_d, psi_q) = truth(id, iq);
                format!("{},{},{:.10},{:.10}", -id, -iq, psi_d / 4.0, psi_q / 4.0)
            }),
            "--negate id,iq --flux-factor 4",
            1e-4,
        ),
        (
            "an uneven grid",
            map(
                "id_a,iq_a,psi_d_wb,psi_q_wb",
                &uneven(-25.0, 25.0, 41),
                &uneven(-23.0, 23.0, 37),
                |id, iq| {
                    let (psi_d, psi_q) = truth(id, iq);
                    format!("{id},{iq},{psi_d:.9},{psi_q:.9}")
                },
            ),
            "",
            3e-3,
        ),
    ]
}

/// Maps that are laid out in other ways, likewise.
fn laid_out() -> [(&'static str, String, &'static str, f64); 2] {
    let (d, q) = (axis(-22.0, 1.0, 26), axis(0.0, 1.0, 23));
    [
        (
            "units in the line below the head",
            map("I_d,I_q,Psi_d,Psi_q\n(A),(A),(mWb),(mWb)", &d, &q, |id, iq| {
                let (psi_d, psi_q) = truth(id, iq);
                format!("{id},{iq},{:.6},{:.6}", 1e3 * psi_d, 1e3 * psi_q)
            }),
            "",
            1e-4,
        ),
        (
            "blanks between columns, parts of complex numbers",
            map("  i_s_dq.real i_s_dq.imag  psi_s_dq.real psi_s_dq.imag", &d, &q, |id, iq| {
                let (psi_d, psi_q) = truth(id, iq);
                format!("{id:6}   {iq:6} {psi_d:.9}  {psi_q:.9}")
            }),
            "",
            1e-4,
        ),
    ]
}

#[test]
fn maps_of_other_tools_are_the_machine_that_they_are_of() {
    let folder = tempfile::tempdir().unwrap();
    for (k, (what, text, options, bound)) in foreign().iter().chain(&laid_out()).enumerate() {
        let (file, out) = (folder.path().join(format!("{k}.csv")), folder.path().join(format!("made-{k}")));
        std::fs::write(&file, text).unwrap();
        let output = import(&file, options, &out);
        assert_eq!(output.status.code(), Some(0), "{what}: {}", String::from_utf8_lossy(&output.stderr));
        let error = error(&out, truth);
        println!("{what}: {error:.1e}");
        assert!(error < *bound, "{what}: {error}");
    }
}

#[test]
fn what_is_wrong_with_a_map_is_named_with_file_line_and_column() {
    let (d, q) = (axis(-22.0, 2.0, 14), axis(0.0, 2.0, 12));
    let good = map("id_a,iq_a,psi_d_wb,psi_q_wb", &d, &q, |id, iq| {
        let (psi_d, psi_q) = truth(id, iq);
        format!("{id},{iq},{psi_d:.9},{psi_q:.9}")
    });
    let line = |number: usize, with: &str| -> String {
        let lines = good.lines().enumerate().map(|(k, line)| if k + 1 == number { with } else { line });
        lines.collect::<Vec<_>>().join("\n")
    };
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    for (text, options, told) in [
        (line(7, "-22,10,x,0.2"), "", "map.csv:7: psi_d_wb: x: must be a number"),
        (line(7, "-22,10,0.1"), "", "map.csv:7: psi_q_wb: : must be a number"),
        (line(7, "-22,8,0.1,0.2"), "", "map.csv:7: id -22, iq 8: must be there once: is in line 6 too"),
        (line(1, "id_a,iq_a,psi_d_wb,torque"), "", "map.csv:1: no column for psi_q"),
        (line(1, "id_a,iq_a,L_d,L_q"), "", "is id_a, iq_a, L_d, L_q; inductances are no flux linkages"),
        (line(1, "id_a,Id,psi_d_wb,psi_q"), "", "map.csv:1: Id: must be there once: id_a is id too"),
        (line(1, "id_a,iq_a,psi_d [V],psi_q"), "", "map.csv:1: psi_d [V]: unit v: must be one of wb"),
        (line(2, "-22,0,-0.01,0.09"), "", "map.csv:2: psi_q: 0.09: must be 0 at iq = 0"),
        (
            line(30, "-18,8,0.5,0.2"),
            "",
            "map.csv:31: psi_q: 0.194442719: must rise with iq, above 0.2 of line 30",
        ),
        (good.clone(), "--negate psi_q", "must rise with iq, above"),
        (good.clone(), "--negate psi_q", "; without options for axes and signs it is a machine's"),
        (good.clone(), "--negate id_a", "'--negate"),
        (good.clone(), "--flux-factor 0", "--flux-factor 0: must be above 0"),
        (
            line(7, "-22,10,0,1,0,2"),
            "",
            "map.csv:7: 6 cells: must be 4 as in the head; with decimal commas, semicolons",
        ),
        (String::new(), "", "map.csv: is empty"),
        (
            map("id_a,iq_a,psi_d,psi_q", &axis(0.0, 2.0, 14), &q, |id, iq| {
                format!("{id},{iq},{},{}", 0.1 + 0.002 * id, 0.01 * iq)
            }),
            "",
            "map.csv: id: begins at 0: must go below 0",
        ),
        (
            good.replace("id_a,", "id_ma,"),
            "",
            "--max-current 20: must be at most 0.022: map.csv ends there along −d: are its currents in A, and not in mA as its head says?",
        ),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = import(&file, options, &out);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}: {said}");
        let said = said.replace(&format!("{}/", folder.path().display()), "");
        assert!(said.contains(told), "{told}: {said}");
        assert!(!out.exists(), "{told}");
    }
}

#[test]
fn every_machine_of_the_tables_has_its_page() {
    let folder = tempfile::tempdir().unwrap();
    for (machine, mode, power) in [
        ("pmasynrm-180kw", "square", "246.4"),
        ("ipm-zs9", "async", "12.57"),
        ("pmsm-48v-1kw", "async", "1.078"),
    ] {
        let file = folder.path().join(format!("{machine}.html"));
        let mut rig = Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        let output = rig.args(["machine", "show", machine, "--out"]).arg(&file).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let page = std::fs::read_to_string(&file).unwrap();
        // Without the scripts, which have words of their own.
        let page = page.split("<script").next().unwrap();
        let plots = page.matches("<svg").count() + page.matches("class=\"plot\"").count();
        assert_eq!(plots, 10, "{machine}");
        assert!(page.contains(&format!(">{mode}</td>")) && page.contains(power), "{machine}");
        assert!(
            !page.contains("NaN") && !page.contains("inf<") && !page.contains("The paper's"),
            "{machine}"
        );
    }
}
