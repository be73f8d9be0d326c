//! Values of cells, and the line that they come from.

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

/// Flux linkage with a part proportional to the product of both currents: a cell's means are the values at its middle.
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

/// 5 % of the largest self inductance, here 3.0: the larger one of the two axes, the q axis's, in the cells from id −1 on.
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

/// A deviation equal to the tolerance counts as measurement error, a larger one does not: 1 % of 100 Wb, a thousandth of a step of 1,000 A.
#[test]
fn what_is_even_within_the_tolerance() {
    let file = Path::new("flux_map.csv");
    let of = |off_a: f64, off_d: f64, off_q: f64| {
        let iq = [-1_000.0 + off_a, 0.0, 1_000.0];
        let psi = [(100.0 - off_d, -50.0 + off_q), (80.0, 0.0), (100.0, 50.0)];
        let nodes: Vec<_> = (2..)
            .zip(iq.into_iter().zip(psi))
            .map(|(line, (iq, (psi_d, psi_q)))| Node { line, id: 0.0, iq, psi_d, psi_q })
            .collect();
        check_even(&nodes, &iq, file)
    };
    for (off_d, off_q, good) in [
        (0.0, 0.0, true),
        (1.0, 0.0, true),
        (-0.9, 0.9, true),
        (0.0, 1.0, true),
        (0.0, -1.0, true),
        (1.01, 0.0, false),
        (0.0, 1.01, false),
        (0.0, -1.01, false),
    ] {
        assert_eq!(of(0.0, off_d, off_q).is_ok(), good, "{off_d} {off_q}");
    }
    let map = of(0.0, 0.5, 0.25).unwrap();
    assert_eq!(map.psi_d_wb, [99.75, 80.0, 99.75]);
    assert_eq!(map.psi_q_wb, [-49.875, 0.0, 49.875]);
    // The first step is the reference: it has the deviation, too.
    assert!(of(0.9, 0.0, 0.0).is_ok() && of(-1.0, 0.0, 0.0).is_ok() && of(1.1, 0.0, 0.0).is_err());
    assert!(of(-1.1, 0.0, 0.0).is_err());
    let shifted = [-999.5, 0.5, 1_000.5];
    let nodes = shifted.map(|iq| Node { line: 2, id: 0.0, iq, psi_d: 1.0, psi_q: 0.001 * (iq - 0.5) });
    assert!(check_even(&nodes, &shifted, file).is_ok(), "a span of a thousandth of the step");
}

#[test]
fn one_sign_of_iq_is_mirrored() {
    let file = Path::new("flux_map.csv");
    let iq = [0.0, 1.0, 2.0];
    let of = |centre: f64| {
        let psi = [(100.0, centre), (90.0, 20.0), (70.0, 30.0)];
        let nodes: Vec<_> = iq
            .into_iter()
            .zip(psi)
            .map(|(iq, (psi_d, psi_q))| Node { line: 2, id: 0.0, iq, psi_d, psi_q })
            .collect();
        mirror(&nodes, &iq, file)
    };
    for (centre, good) in [(1.0, true), (-1.0, true), (1.01, false), (-1.01, false)] {
        assert_eq!(of(centre).is_ok(), good, "{centre}");
    }
    let map = of(0.5).unwrap();
    assert_eq!(map.iq_a, [-2.0, -1.0, 0.0, 1.0, 2.0]);
    assert_eq!(map.psi_d_wb, [70.0, 90.0, 100.0, 90.0, 70.0]);
    assert_eq!(map.psi_q_wb, [-30.0, -20.0, 0.0, 20.0, 30.0]);
}

/// A thousandth of a step: 1 A for a mean step of 1,000 A.
#[test]
fn an_axis_is_even_within_a_thousandth_of_its_step() {
    let file = Path::new("flux_map.csv");
    let of = |off: f64| {
        let id = [-3_000.0, -2_000.0 + off, -1_000.0, 0.0];
        let nodes: Vec<_> =
            id.into_iter().flat_map(|id| [0.0, 1.0, 2.0, 3.0].map(|iq| node(9, id, iq))).collect();
        axes(&nodes, file)
    };
    assert_eq!(of(1.0).unwrap(), (vec![-3_000.0, -1_999.0, -1_000.0, 0.0], vec![0.0, 1.0, 2.0, 3.0]));
    assert!(of(-1.0).is_ok() && of(1.01).is_err() && of(-1.01).is_err());
    let from = |first: f64| {
        let nodes: Vec<_> = (0..16).map(|k| node(9, f64::from(k / 4), first + f64::from(k % 4))).collect();
        axes(&nodes, file).is_ok()
    };
    assert!(from(0.0) && from(-1.5) && !from(0.1));
    // The one to report is the first that is off by more than that.
    let id = [-3_000.0, -2_000.0, -999.0, 500.0];
    let nodes: Vec<_> = (2..).zip(id).map(|(line, id)| node(line, id, 0.0)).collect();
    let said = axes(&nodes, file).unwrap_err().to_string();
    assert!(said.contains("csv:5: id_a: 500: must be 0, on an even grid of step 1000"), "{said}");
}

/// The same flux linkage twice is not allowed either.
#[test]
fn flux_rises_with_its_own_current() {
    let file = Path::new("flux_map.csv");
    let of = |psi_d: [f64; 4], psi_q: [f64; 4]| {
        let nodes: Vec<_> = (0..4_u32)
            .map(|k| Node {
                line: 2 + u64::from(k),
                id: f64::from(k / 2),
                iq: f64::from(k % 2),
                psi_d: psi_d[k as usize],
                psi_q: psi_q[k as usize],
            })
            .collect();
        check_monotone(&nodes, 2, file).err().map(|error| error.to_string())
    };
    assert_eq!(of([0.0, 0.5, 1.0, 0.6], [0.0, 1.0, -3.0, -2.0]), None);
    let said = of([0.0, 0.5, 1.0, 0.5], [0.0, 1.0, -3.0, -2.0]).unwrap();
    assert!(said.contains("csv:5: psi_d_wb: 0.5: must rise with id_a, above 0.5 of line 3"), "{said}");
    let said = of([0.0, 0.5, 1.0, 0.6], [0.0, 1.0, -3.0, -3.0]).unwrap();
    assert!(said.contains("csv:5: psi_q_wb: -3: must rise with iq_a, above -3 of line 4"), "{said}");
}
