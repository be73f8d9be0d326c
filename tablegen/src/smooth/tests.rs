//! The spline's slopes: exact for cubics, and central differences if there are too few values.

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

/// A surface of cubics along both axes, with its slopes, is reproduced within the grid; beyond it the edge's tangent continues.
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
}

/// Beyond the grid the slopes are those of the flux linkage, go on as they are at the edge, and are far away its mean: no saturation, however deep, is turned over.
#[test]
fn a_map_that_saturates_goes_on_rising_beyond_its_grid() {
    // Of the co-energy 0.3 id + 2 √(1 + (id² + iq²)/100), whose flux linkage stops rising.
    let axis = |count: i32| (0..count).map(|k| -20.0 + 2.0 * f64::from(k)).collect::<Vec<_>>();
    let (id_a, iq_a) = (axis(14), axis(21));
    let nodes = |of: &dyn Fn(f64, f64) -> f64| {
        id_a.iter().flat_map(|d| iq_a.iter().map(move |q| of(*d, *q))).collect::<Vec<_>>()
    };
    let root = |d: f64, q: f64| 50.0 * (1.0 + (d * d + q * q) / 100.0).sqrt();
    let (psi_d_wb, psi_q_wb) = (nodes(&|d, q| 0.3 + d / root(d, q)), nodes(&|d, q| q / root(d, q)));
    let map = SmoothMap::new(&FluxMap { id_a: id_a.clone(), iq_a: iq_a.clone(), psi_d_wb, psi_q_wb });
    let near = |found: f64, expected: f64, within: f64| {
        assert!((found - expected).abs() <= within, "{found}, not {expected}");
    };
    const H: f64 = 1e-5;
    for step in 0..4_000 {
        let (id, iq) = (f64::from(step % 67) * 9.1 - 300.0, f64::from(step / 67) * 10.3 - 300.0);
        let at = map.at(id, iq);
        let [right, left] = [H, -H].map(|h| map.at(id + h, iq));
        let [above, below] = [H, -H].map(|h| map.at(id, iq + h));
        near(at.ldd_h, (right.psi_d_wb - left.psi_d_wb) / (2.0 * H), 1e-8);
        near(at.lqd_h, (right.psi_q_wb - left.psi_q_wb) / (2.0 * H), 1e-8);
        near(at.ldq_h, (above.psi_d_wb - below.psi_d_wb) / (2.0 * H), 1e-8);
        near(at.lqq_h, (above.psi_q_wb - below.psi_q_wb) / (2.0 * H), 1e-8);
        let det = at.ldd_h * at.lqq_h - at.ldq_h * at.lqd_h;
        assert!(at.ldd_h > 0.0 && at.lqq_h > 0.0 && det > 0.0, "({id}, {iq}): {at:?}");
    }
    for edge in [map.edges_d[0], map.edges_d[1], map.edges_q[0]] {
        let [before, after] = [1.0 - 1e-9, 1.0 + 1e-9].map(|by| edge.along(by * edge.straight));
        near(before.near, after.near, 1e-7);
        near(before.share, after.share, 1e-7);
        // The turn's own way later a quarter of the tangent's slope is left.
        near(edge.along(1.3 * edge.straight).share, 0.25, 1e-9);
    }
    let [inside, outside] = [-1e-9, 1e-9].map(|by| map.at(6.0 + by, 20.0 + by));
    near(inside.ldd_h, outside.ldd_h, 1e-9);
    near(inside.lqq_h, outside.lqq_h, 1e-9);
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
