//! `machine import`: a map that is read the wrong way is refused, and the way that makes it a machine's is named.

#[path = "../../tablegen/tests/common/mod.rs"]
mod folders;
mod imported;

use folders::axis;
use imported::{error, import, map, truth};

/// A machine of reluctance alone.
fn reluctance(id: f64, iq: f64) -> (f64, f64) {
    (0.012 * id, 0.05 * iq / (1.0 + (iq / 15.0).powi(2)).sqrt() + 0.012 * iq)
}

/// A machine whose L_d without current is `over` times L_q.
fn inverse(over: f64) -> impl Fn(f64, f64) -> (f64, f64) {
    move |id, iq| (0.2 + over * 0.008 * id, 0.008 * iq)
}

/// The machine in the axes of reluctance, its d and q swapped and turned as `signs` say.
fn across(id: f64, iq: f64, flux: fn(f64, f64) -> (f64, f64)) -> (f64, f64) {
    let (psi_d, psi_q) = flux(-iq, id);
    (psi_q, -psi_d)
}

/// A map of a flux over both signs of both currents.
fn plane(flux: impl Fn(f64, f64) -> (f64, f64)) -> String {
    let both = axis(-22.0, 2.0, 23);
    map("id,iq,psi_d,psi_q", &both, &both, |id, iq| {
        let (psi_d, psi_q) = flux(id, iq);
        format!("{id},{iq},{psi_d:.9},{psi_q:.9}")
    })
}

#[test]
fn the_reading_that_makes_a_map_a_machines_is_named_and_does() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("map.csv");
    let polar =
        map("I [A],gamma [deg],psi_d,psi_q", &axis(0.0, 2.0, 12), &axis(90.0, 5.0, 19), |i, angle| {
            let (sin, cos) = angle.to_radians().sin_cos();
            let (psi_d, psi_q) = truth(i * cos, i * sin);
            format!("{i},{angle},{psi_d:.9},{psi_q:.9}")
        });
    for (k, (text, told, flux)) in [
        (plane(|id, iq| across(id, iq, reluctance)), "--d-axis reluctance", reluctance as imported::Flux),
        (plane(|id, iq| across(id, iq, truth)), "--d-axis reluctance", truth),
        (
            plane(|id, iq| {
                let (psi_d, psi_q) = across(id, -iq, truth);
                (psi_d, -psi_q)
            }),
            "--d-axis reluctance --negate iq,psi_q",
            truth,
        ),
        (plane(|id, iq| truth(-id, -iq)), "--negate id,iq", truth),
        (
            plane(|id, iq| {
                let (psi_d, psi_q) = truth(-id, iq);
                (-psi_d, psi_q)
            }),
            "--negate id,psi_d",
            truth,
        ),
        (plane(|id, iq| truth(-id, iq)), "--negate id", truth),
        (plane(|id, iq| truth(id, -iq)), "--negate iq", truth),
        (plane(|id, iq| (-truth(id, iq).0, truth(id, iq).1)), "--negate psi_d", truth),
        (plane(|id, iq| (-truth(id, -iq).0, truth(id, -iq).1)), "--negate iq,psi_d", truth),
        (plane(|id, iq| (-truth(-id, -iq).0, truth(-id, -iq).1)), "--negate id,iq,psi_d", truth),
        (plane(|id, iq| across(id, -iq, truth)), "--d-axis reluctance --negate iq", truth),
        (polar, "--angle-from d", truth),
    ]
    .into_iter()
    .enumerate()
    {
        let out = folder.path().join(format!("{k}"));
        std::fs::write(&file, text).unwrap();
        let refused = import(&file, "", &out);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{told}: {said}");
        assert!(said.trim_end().ends_with(&format!("; it is a machine's with {told}")), "{told}: {said}");
        assert!(!out.exists(), "{told}");
        let taken = import(&file, told, &out);
        assert_eq!(taken.status.code(), Some(0), "{told}: {}", String::from_utf8_lossy(&taken.stderr));
        assert!(error(&out, flux) < 2e-3, "{told}: {}", error(&out, flux));
    }
}

/// Start-up looks for d where inductance is least: an L_d that is larger by less than start-up can tell apart, 6 %, does not matter to it.
#[test]
fn an_inductance_that_is_hardly_larger_along_the_magnets_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    std::fs::write(&file, plane(inverse(1.07))).unwrap();
    let refused = import(&file, "", &out);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("L_d 8.5600e-3 H and L_q 8.0000e-3 H without current"), "{said}");
    assert!(!said.contains("it is a machine's"), "{said}");
    let saturates = |id: f64, iq: f64| (0.2 + 0.008 * id, 0.0082 * iq / (1.0 + (iq / 40.0).powi(2)).sqrt());
    std::fs::write(&file, plane(saturates)).unwrap();
    let taken = import(&file, "", &out);
    assert_eq!(taken.status.code(), Some(0), "{}", String::from_utf8_lossy(&taken.stderr));
}

#[test]
fn a_likely_mistake_of_units_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    let scaled = |current: f64, flux: f64, ends: f64| {
        let both = axis(-ends, ends / 11.0, 23);
        map("id,iq,psi_d,psi_q", &both, &both, |id, iq| {
            let (psi_d, psi_q) = truth(id, iq);
            format!("{},{},{:.9},{:.9}", current * id, current * iq, flux * psi_d, flux * psi_q)
        })
    };
    for (text, told) in [
        (scaled(1e3, 1.0, 22.0), "goes to 22000 along −d: are its currents in mA (a head such as id [mA])?"),
        (scaled(1e-3, 1.0, 22.0), "ends there along −d: are its currents in kA (a head such as id [kA])?"),
        (scaled(0.5_f64.sqrt(), 1.0, 22.0), "ends there along −d: if its currents are rms, --rms"),
        (
            scaled(1e4, 1.0, 22.0),
            "id: -220000: must be a number, in A or Wb at most 100000 (is the unit another, id [mA]?)",
        ),
        (scaled(1.0, 1e3, 22.0), "flux linkages in Wb (a column psi_d [mWb] has thousandths)?"),
        (
            map("Is,gamma,psi_d,psi_q", &axis(0.0, 1.0, 23), &axis(0.0, 0.1, 17), |_, _| {
                "1,1,1,1".to_owned()
            }),
            "map.csv: gamma: at most 1: must have its unit, as gamma [deg] or gamma [rad]",
        ),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = import(&file, "", &out);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}: {said}");
        assert!(said.contains(told), "{told}: {said}");
    }
}

/// A unit that the head states is the one that the question doubts.
#[test]
fn the_unit_of_a_current_is_doubted_where_the_head_states_it() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    let with = |units: [&str; 2], scales: [f64; 2]| {
        let both = axis(-22.0, 2.0, 23);
        let head = format!("id [{}],iq [{}],psi_d,psi_q", units[0], units[1]);
        map(&head, &both, &both, |id, iq| {
            let (psi_d, psi_q) = truth(id, iq);
            format!("{},{},{psi_d:.9},{psi_q:.9}", scales[0] * id, scales[1] * iq)
        })
    };
    for (text, options, told) in [
        (
            with(["mA", "A"], [1.0, 1.0]),
            "",
            "along −d: are its currents in A, and not in mA as its head says?",
        ),
        (
            with(["A", "mA"], [1.0, 1.0]),
            "",
            "along q: are its currents in A, and not in mA as its head says?",
        ),
        (
            with(["mA", "A"], [1.0, 1.0]),
            "--d-axis reluctance",
            "along q: are its currents in A, and not in mA as its head says?",
        ),
        (with(["A", "A"], [1e-3, 1e-3]), "", "are its currents in kA, and not in A as its head says?"),
        (with(["kA", "kA"], [1.0, 1.0]), "", "are its currents in A, and not in kA as its head says?"),
        (with(["A", "A"], [1e3, 1e3]), "", "are its currents in mA, and not in A as its head says?"),
        // There is no smaller unit to ask about.
        (with(["mA", "mA"], [1e6, 1e6]), "", "goes to 22000 along −d"),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = import(&file, options, &out);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}: {said}");
        assert!(said.contains(told), "{told}: {said}");
    }
}

/// An angle needs a map in polar coordinates.
#[test]
fn the_angles_axis_of_a_map_without_angles_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    std::fs::write(&file, plane(truth)).unwrap();
    let output = import(&file, "--angle-from d", &out);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(
        said.trim_end(),
        "--angle-from d has no effect without currents given by magnitude and angle, as columns Is and gamma"
    );
    assert!(!out.exists());
}

/// A map's own torque reveals what its numbers do not: rms from peak, and other pole pairs.
#[test]
fn a_torque_beside_the_flux_linkages_is_held_against_them() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("map.csv"), folder.path().join("made"));
    let both = axis(-44.0, 4.0, 23);
    let with = |current: f64, flux: f64, torque: f64| {
        map("id,iq,psi_d,psi_q,Torque [Nm],Torque ripple [%]", &both, &both, |id, iq| {
            let (psi_d, psi_q) = truth(id, iq);
            let torque_nm = torque * 1.5 * 3.0 * (psi_d * iq - psi_q * id);
            format!("{},{},{:.9},{:.9},{torque_nm},7", current * id, current * iq, flux * psi_d, flux * psi_q)
        })
    };
    let half = 0.5_f64.sqrt();
    for (text, options, told) in [
        (with(1.0, 1.0, 1.0), "", None),
        (with(1.0, 1.0, 0.93), "", None),
        (
            with(half, half, 1.0),
            "",
            Some(
                "2.00 times that of its currents and flux linkages with 3 pole pairs: are its currents and flux linkages rms (--rms)?",
            ),
        ),
        (with(half, half, 1.0), "--rms", None),
        (with(half, 1.0, 1.0), "", Some("1.41 times")),
        (
            with(1.0, 1.0, -1.0),
            "",
            Some(
                "−1.00 times that of its currents and flux linkages with 3 pole pairs: are its currents, or is its torque, counted as a generator's, or its q axis the other way round?",
            ),
        ),
        (
            with(half, half, -1.0),
            "",
            Some("the other way round; and are its currents and flux linkages rms (--rms)?"),
        ),
        // The same machine seen in a mirror, with the torque of the mirror.
        (with(1.0, 1.0, -1.0), "--negate iq,psi_q", None),
        (
            with(1.0, 1.0, 1.0),
            "--flux-factor 1.25",
            Some(
                "0.80 times that of its currents and flux linkages with 3 pole pairs: is --pole-pairs right, and --flux-factor?",
            ),
        ),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = import(&file, options, &out);
        let said = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(said.contains("the map's own torque"), told.is_some(), "{said}");
        assert!(told.is_none_or(|told| said.contains(told)), "{told:?}: {said}");
    }
}
