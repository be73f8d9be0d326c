//! A map's own torque compared with that of its flux linkages, and the conclusions about its units.

/// Share by which the torques may differ: iron, friction and the teeth's ripple.
const DIFFERENT: f64 = 0.1;
/// The same for the deviation of a ratio from a round number.
const NEAR: f64 = 0.05;

/// The factor that converts a column's values to N·m; `None` if it is no torque.
pub fn factor(name: &str) -> Option<f64> {
    let letters: String = name.to_lowercase().chars().filter(|letter| letter.is_alphabetic()).collect();
    let (before, unit) = letters.split_once("torque")?;
    let known = ["", "shaft", "airgap", "electromagnetic", "em", "mean", "average", "avg"].contains(&before);
    let unit = unit.trim_start_matches("avg").trim_start_matches("mean");
    let sizes = [("", 1.0), ("nm", 1.0), ("mnm", 1e-3), ("knm", 1e3)];
    sizes.into_iter().find(|(one, _)| known && *one == unit).map(|(_, size)| size)
}

/// The question about a torque of the other sign.
const OPPOSITE: &str =
    "are its currents, or is its torque, counted as a generator's, or its q axis the other way round";

/// The question to ask if a map's torque differs from that of its flux linkages with this many pole pairs, in size or in sign. Rows are currents in A and
/// flux linkages in Wb in the project's frame, and the torque in N·m, which may be no number.
pub fn question(rows: impl Iterator<Item = ([f64; 4], f64)>, pole_pairs: u32) -> Option<String> {
    let (mut told, mut made, mut same) = (0.0, 0.0, 0.0);
    for ([id, iq, psi_d, psi_q], torque_nm) in rows {
        if torque_nm.is_finite() {
            let made_nm = 1.5 * f64::from(pole_pairs) * (psi_d * iq - psi_q * id);
            told += torque_nm.abs();
            made += made_nm.abs();
            same += torque_nm * made_nm;
        }
    }
    let ratio = told / made;
    // The question is not asked either if there is no torque at all.
    if told == 0.0 || !ratio.is_finite() {
        return None;
    }
    let size = size_question(ratio);
    let sign = (same < 0.0).then_some(OPPOSITE);
    let questions: Vec<_> = sign.into_iter().chain(size).collect();
    let minus = if same < 0.0 { "−" } else { "" };
    (!questions.is_empty()).then(|| {
        format!(
            "the map's own torque is {minus}{ratio:.2} times that of its currents and flux linkages with {pole_pairs} pole pairs: {}?",
            questions.join("; and ")
        )
    })
}

/// The question about the ratio of a map's torque to that of its flux linkages; `None` if they agree.
fn size_question(ratio: f64) -> Option<&'static str> {
    if (ratio - 1.0).abs() <= DIFFERENT {
        return None;
    }
    let root = 2.0_f64.sqrt();
    let questions = [
        (2.0, "are its currents and flux linkages rms (--rms)"),
        (root, "are its currents rms, or its flux linkages"),
        (1.0 / root, "are its currents peak, or its flux linkages"),
        (0.5, "are its currents and flux linkages peak"),
    ];
    let near = questions.into_iter().find(|(round, _)| (ratio / round - 1.0).abs() <= NEAR);
    Some(near.map_or("is --pole-pairs right, and --flux-factor", |(_, question)| question))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_is_told_from_other_columns() {
        for (name, size) in [
            ("Torque [Nm]", Some(1.0)),
            ("Shaft Torque", Some(1.0)),
            ("torque_kNm", Some(1e3)),
            ("Torque avg (N.m)", Some(1.0)),
            ("Torque ripple [%]", None),
            ("Torque per volume", None),
            ("max torque", None),
            ("T [°C]", None),
        ] {
            assert_eq!(factor(name), size, "{name}");
        }
    }
}
