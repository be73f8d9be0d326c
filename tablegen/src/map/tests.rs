//! Cells by value, and the line that they come from.

use super::*;

fn node(line: u64, id: f64, iq: f64) -> Node {
    Node { line, id, iq, psi_d: 0.0, psi_q: 0.0 }
}

#[test]
fn a_cell_comes_from_its_own_line_or_its_images() {
    let nodes = [node(2, -1.0, 0.0), node(3, -1.0, 2.0), node(4, 0.0, 0.0), node(5, 0.0, 2.0)];
    let cell = |id: f64, iq: f64| Cell { id, iq, ldd: 0.0, ldq: 0.0, lqd: 0.0, lqq: 0.0 };
    for (id, iq, line) in [
        (-1.0, 0.0, Some(2)),
        (-1.0, 2.0, Some(3)),
        (0.0, 2.0, Some(5)),
        (-1.0, -2.0, Some(3)),
        (0.0, -2.0, Some(5)),
        (1.0, 2.0, None),
    ] {
        assert_eq!(line_at(&nodes, &cell(id, iq)), line, "{id}, {iq}");
    }
}

/// Flux linkage with a part that grows with the product of both currents: a cell's means are those at its middle.
fn bilinear(d_by_q: f64, q_by_d: f64) -> FluxMap {
    let (id_a, iq_a) = (vec![-3.0, -1.0, 1.0], vec![-1.5, 0.0, 1.5, 3.0]);
    let nodes = || id_a.iter().flat_map(|d| iq_a.iter().map(move |q| (*d, *q)));
    let psi_d_wb = nodes().map(|(d, q)| 2.0 * d + d_by_q * q + 0.1 * d * q).collect();
    let psi_q_wb = nodes().map(|(d, q)| 3.0 * q + q_by_d * d + 0.2 * d * q).collect();
    FluxMap { id_a: id_a.clone(), iq_a: iq_a.clone(), psi_d_wb, psi_q_wb }
}

#[test]
fn cells_have_the_inductances_at_their_middle() {
    let map = bilinear(0.5, 0.25);
    let cells: Vec<_> = map.cells().collect();
    assert_eq!(cells.len(), 6);
    for (k, cell) in cells.iter().enumerate() {
        let (id, iq) = (map.id_a[k / 3], map.iq_a[k % 3]);
        assert_eq!((cell.id, cell.iq), (id, iq));
        let (d, q) = (id + 1.0, iq + 0.75);
        for (found, expected) in [
            (cell.ldd, 2.0 + 0.1 * q),
            (cell.ldq, 0.5 + 0.1 * d),
            (cell.lqd, 0.25 + 0.2 * q),
            (cell.lqq, 3.0 + 0.2 * d),
        ] {
            assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
        }
    }
}

/// 5 % of the largest self inductance, here 3.0: of both, the q axis's, in the cells from id −1 on.
#[test]
fn cross_inductances_agree_within_a_share_of_the_largest() {
    let nodes = [node(7, 1.0, 1.5)];
    let file = Path::new("flux_map.csv");
    let of = |gap: f64| {
        let mut map = bilinear(0.0, 0.0);
        let places: Vec<_> = map.id_a.iter().flat_map(|d| map.iq_a.iter().map(|q| (*d, *q))).collect();
        for (k, (d, q)) in places.into_iter().enumerate() {
            (map.psi_d_wb[k], map.psi_q_wb[k]) = (2.0 * d + gap * q, 3.0 * q);
        }
        map
    };
    assert!(of(0.149).check_reciprocity(&nodes, file).is_ok());
    assert!(of(-0.149).check_reciprocity(&nodes, file).is_ok());
    assert!(of(0.151).check_reciprocity(&nodes, file).is_err());
    assert!(of(-0.151).check_reciprocity(&nodes, file).is_err());
}

/// Cross inductances whose product is below that of 2 H and 3 H.
#[test]
fn one_current_for_one_flux_linkage() {
    let file = Path::new("flux_map.csv");
    let of = |d_by_q: f64, q_by_d: f64| {
        let mut map = bilinear(0.0, 0.0);
        let places: Vec<_> = map.id_a.iter().flat_map(|d| map.iq_a.iter().map(|q| (*d, *q))).collect();
        for (k, (d, q)) in places.into_iter().enumerate() {
            (map.psi_d_wb[k], map.psi_q_wb[k]) = (2.0 * d + d_by_q * q, 3.0 * q + q_by_d * d);
        }
        map.check_invertible(&[], file).is_ok()
    };
    assert!(of(2.4, 2.4) && of(-2.4, -2.4) && of(4.0, -4.0) && of(0.1, 59.0));
    assert!(!of(2.5, 2.5) && !of(-2.5, -2.5) && !of(0.1, 61.0) && !of(2.0, 3.0));
}

#[test]
fn the_grid_reaches_the_largest_current() {
    let file = Path::new("flux_map.csv");
    let map = |id: [f64; 2], q: f64| FluxMap {
        id_a: id.into(),
        iq_a: vec![-q, q],
        psi_d_wb: Vec::new(),
        psi_q_wb: Vec::new(),
    };
    for (id, q, good) in [
        ([-20.0, 0.0], 20.0, true),
        ([-20.0, 5.0], 20.5, true),
        ([-19.9, 5.0], 20.0, false),
        ([-20.0, -0.1], 20.0, false),
        ([-20.0, 0.0], 19.9, false),
    ] {
        assert_eq!(map(id, q).check_range(20.0, file).is_ok(), good, "{id:?} {q}");
    }
}

#[test]
fn nodes_in_order() {
    let [a, b, c] = [node(1, 0.0, 1.0), node(2, 0.0, 2.0), node(3, 1.0, 0.0)];
    assert!(a.place(&b).is_lt() && b.place(&c).is_lt() && c.place(&a).is_gt() && a.place(&a).is_eq());
    let nodes = [
        Node { line: 1, id: 0.0, iq: 0.0, psi_d: -3.0, psi_q: 1.0 },
        Node { line: 2, id: 0.0, iq: 1.0, psi_d: 0.5, psi_q: 2.0 },
    ];
    assert_eq!((largest(&nodes), largest(&nodes[1..]), largest(&[])), (3.0, 2.0, 0.0));
}
