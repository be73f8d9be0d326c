//! The spline's slopes: exact for cubics, and central differences where there are too few values.

use super::*;

#[test]
fn slopes_of_few_values() {
    assert_eq!(derivatives(&[0.0, 1.0, 4.0]), [1.0, 2.0, 3.0]);
    assert_eq!(derivatives(&[2.0, 7.0]), [5.0, 5.0]);
    assert!(derivatives(&[]).is_empty());
}

#[test]
fn slopes_of_a_cubic_are_exact() {
    for count in 4..9 {
        let cubic = |x: f64| 0.3 - 1.1 * x + 0.7 * x * x - 0.2 * x * x * x;
        let slopes = derivatives(&(0..count).map(|k| cubic(f64::from(k))).collect::<Vec<_>>());
        assert_eq!(slopes.len(), count as usize);
        for (k, slope) in (0..count).zip(slopes) {
            let x = f64::from(k);
            assert!((slope + 1.1 - 1.4 * x + 0.6 * x * x).abs() < 1e-12, "{count}, {k}: {slope}");
        }
    }
}

#[test]
fn places_on_an_axis() {
    for (position, expected) in [
        (0.0, (0, 0.0, 0.0)),
        (2.25, (2, 0.25, 0.0)),
        (4.0, (3, 1.0, 0.0)),
        (-1.5, (0, 0.0, -1.5)),
        (5.5, (3, 1.0, 1.5)),
    ] {
        assert_eq!(place(position, 4), expected, "{position}");
    }
}

/// A surface of cubics along both axes, with its slopes, within the grid; beyond it the edge's tangent.
#[test]
fn a_bicubic_surface_is_kept() {
    let along_d =
        |x: f64| (0.5 + 0.03 * x - 0.000_4 * x * x + 1e-6 * x * x * x, 0.03 - 0.000_8 * x + 3e-6 * x * x);
    let along_q =
        |y: f64| (1.0 + 0.02 * y + 0.000_3 * y * y - 2e-6 * y * y * y, 0.02 + 0.000_6 * y - 6e-6 * y * y);
    let axis = |first: f64, step: f64, count: i32| {
        (0..count).map(|k| first + step * f64::from(k)).collect::<Vec<_>>()
    };
    let (id_a, iq_a) = (axis(-20.0, 5.0, 6), axis(-8.0, 4.0, 5));
    let nodes: Vec<_> =
        id_a.iter().flat_map(|d| iq_a.iter().map(|q| along_d(*d).0 * along_q(*q).0)).collect();
    let psi_q_wb = nodes.iter().map(|psi| -2.0 * psi).collect();
    let map = SmoothMap::new(&FluxMap { id_a, iq_a, psi_d_wb: nodes, psi_q_wb });
    for (id, iq) in [(-20.0, -8.0), (-17.3, 1.1), (-5.0, 4.0), (3.3, 7.7), (5.0, 8.0)] {
        let at = map.at(id, iq);
        let ((d, by_d), (q, by_q)) = (along_d(id), along_q(iq));
        for (found, expected) in [(at.psi_d_wb, d * q), (at.ldd_h, by_d * q), (at.ldq_h, d * by_q)] {
            assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
        }
        for (found, other) in [(at.psi_q_wb, at.psi_d_wb), (at.lqd_h, at.ldd_h), (at.lqq_h, at.ldq_h)] {
            assert!((found + 2.0 * other).abs() < 1e-12, "{found}, not {other}");
        }
    }
    for (id, iq) in [(-26.0, 2.0), (9.0, -11.0), (0.5, 12.0), (12.0, 13.0)] {
        let (edge_d, edge_q) = (f64::clamp(id, -20.0, 5.0), f64::clamp(iq, -8.0, 8.0));
        let ((d, by_d), (q, by_q)) = (along_d(edge_d), along_q(edge_q));
        let (own_d, own_q) = (d + (id - edge_d) * by_d, q + (iq - edge_q) * by_q);
        assert!((map.at(id, iq).psi_d_wb - own_d * own_q).abs() < 1e-12);
    }
}

/// The one current for a flux linkage is found from anywhere, but for starts that are too far.
#[test]
fn the_inverse_of_a_straight_map() {
    let machine = crate::testing::IPM.folder(&[]);
    let map = SmoothMap::new(&machine.map);
    for start in [(0.0, 0.0), (-20.0, 15.0), (60.0, -80.0)] {
        let (id, iq) = map.inverse(0.11, 0.2, start).unwrap();
        assert!((id + 15.0).abs() < 1e-9 && (iq - 0.2 / 0.015).abs() < 1e-9, "{id}, {iq}");
    }
    // 60 steps of four cells do not reach that far.
    assert_eq!(map.inverse(0.11, 0.2, (600.0, 0.0)), None);
    assert!(map.inverse(0.11, 0.2, (440.0, 0.0)).is_some());
}
