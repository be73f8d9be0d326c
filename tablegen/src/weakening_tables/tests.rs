//! Circles of a machine without saturation compared with closed forms, values read from them by hand, and lines next to them by brute force.

use super::*;
use crate::FluxMap;
use crate::testing::{IPM, Linear, MOST_A, POLE_PAIRS, RESISTANCE_OHM, near};

const FACTOR: f64 = 1.5 * POLE_PAIRS as f64;
/// Full torque's flux linkage, an invented value.
const TOP_WB: f64 = 0.25;

fn machine() -> (MachineFolder, SmoothMap) {
    let machine = IPM.folder(&[]);
    let smooth = SmoothMap::new(&machine.map);
    (machine, smooth)
}

/// Circles that were not computed: nodes and torques that are linear from row to row, and from column to column.
fn made_up<'a>(machine: &'a MachineFolder, smooth: &'a SmoothMap) -> Circles<'a> {
    let row = |r: usize| Row {
        torque_nm: 2.0 + 0.25 * r as f64,
        nodes: (0..COLUMNS)
            .map(|c| (-3.0 - 0.01 * r as f64 - 0.02 * c as f64, 0.1 + 0.001 * r as f64 + 0.002 * c as f64))
            .collect(),
    };
    Circles {
        machine,
        smooth,
        factor: FACTOR,
        knee_wb: 0.1,
        ends: (0.5, 0.8),
        shares: (0..COLUMNS).map(|c| c as f64 / 48.0).collect(),
        margins: vec![Margins { flux: vec![0.0; COLUMNS], current: 0.0 }; ROWS],
        rows: (0..ROWS).map(row).collect(),
    }
}

#[test]
fn places_and_means() {
    for (position, expected) in
        [(0.0, (0, 0.0)), (0.3, (1, 0.2)), (1.0, (3, 1.0)), (1.25, (3, 2.0)), (-0.25, (0, -1.0))]
    {
        let (k, share) = place(position, 5);
        assert_eq!(k, expected.0);
        assert!((share - expected.1).abs() < 1e-12, "{position}: {share}");
    }
    assert_eq!((mix(2.0, 6.0, 0.25), mix(2.0, 6.0, 1.5), mix(2.0, -6.0, 0.5)), (3.0, 8.0, -2.0));
    let mtpa = MtpaCurrents {
        last_torque_nm: 30.0,
        currents_a: vec![(0.0, 1.0), (-2.0, 5.0), (-6.0, 7.0), (-9.0, 8.0)],
    };
    for (torque_nm, (id, iq)) in
        [(0.0, (0.0, 1.0)), (5.0, (-1.0, 3.0)), (22.5, (-6.75, 7.25)), (30.0, (-9.0, 8.0))]
    {
        let found = mtpa.at(torque_nm);
        assert!((found.0 - id).abs() < 1e-12 && (found.1 - iq).abs() < 1e-12, "{torque_nm}: {found:?}");
    }
}

#[test]
fn what_is_read_between_nodes() {
    let (machine, smooth) = machine();
    let circles = made_up(&machine, &smooth);
    for (r, c) in [(0.0, 0.0), (3.25, 7.5), (60.0, 20.75), (117.9, 47.9), (118.0, 48.0)] {
        let (id, iq, torque_nm) = circles.read(r / 118.0, c / 48.0);
        let x = c / 48.0 / 1.3;
        let w = 0.3 * x / (1.0 - x);
        let expected_nm = (2.0 + 0.25 * r) * (2.0 * w - w * w);
        near(id, -3.0 - 0.01 * r - 0.02 * c, 1e-12);
        near(torque_nm, expected_nm, 1e-12);
        near(iq, expected_nm / (FACTOR * (0.1 + 0.001 * r + 0.002 * c)), 1e-12);
    }
}

#[test]
fn excess_is_the_most_of_a_cells_samples() {
    let (machine, smooth) = machine();
    for (row, column, id_up) in [(0, 0, 0.0), (40, 30, 0.0), (117, 47, 0.0), (80, 47, 5.0), (60, 20, 3.9)] {
        let mut circles = made_up(&machine, &smooth);
        circles.rows.iter_mut().flat_map(|row| &mut row.nodes).for_each(|node| node.0 += id_up);
        let (mut flux, mut current) = (0.0_f64, 0.0_f64);
        for (r, c) in (0..=8).flat_map(|r| (0..=8).map(move |c| (r, c))) {
            let (r, c) = (row as f64 + f64::from(r) / 8.0, column as f64 + f64::from(c) / 8.0);
            let (id, iq, _) = circles.read(r / 118.0, c / 48.0);
            if id > 0.0 {
                continue;
            }
            let (psi_d, psi_q) = IPM.flux_wb(id, iq);
            let x = 0.5 + 0.3 * r / 118.0;
            flux = flux.max(psi_d.hypot(psi_q) / (0.1 * x / (1.0 - x)) - 1.0);
            current = current.max(id.hypot(iq) / MOST_A - 1.0);
        }
        let found = circles.excess(row, column);
        near(found.0, flux, 1e-9);
        near(found.1, current, 1e-9);
    }
}

#[test]
fn what_exceeds_makes_all_its_nodes_narrower() {
    let (machine, smooth) = machine();
    let mut circles = made_up(&machine, &smooth);
    // No torque: left unchanged.
    circles.rows[0].torque_nm = 0.5 * NO_TORQUE_NM;
    let before = circles.rows.clone();
    let excess: Vec<Vec<_>> =
        (0..ROWS - 1).map(|r| (0..COLUMNS - 1).map(|c| circles.excess(r, c)).collect()).collect();
    let cells = |at: usize, count: usize| at.saturating_sub(1)..(at + 1).min(count - 1);
    assert!(circles.narrow());
    for (k, margins) in circles.margins.iter().enumerate() {
        let rows = || cells(k, ROWS).filter(|r| *r > 0);
        let current = rows().flat_map(|r| &excess[r]).map(|cell| cell.1).fold(0.0, f64::max);
        let mut narrower = current > 1e-7;
        for (c, margin) in margins.flux.iter().enumerate() {
            let flux =
                rows().flat_map(|r| &excess[r][cells(c, COLUMNS)]).map(|cell| cell.0).fold(0.0, f64::max);
            narrower |= flux > 1e-7;
            if k > 0 {
                assert!((margin - flux).abs() < 1e-7, "{k} {c}: {margin}, not {flux}");
            }
        }
        assert!((margins.current - current).abs() < 1e-7, "{k}: {}, not {current}", margins.current);
        let changed = circles.rows[k].nodes != before[k].nodes;
        assert_eq!(changed, narrower, "{k}");
    }
}

/// The circles' ends: the lowest voltage at the highest speed, or a share of full torque's flux linkage where that is less.
#[test]
fn circles_reach_from_the_least_flux_to_more_than_full_torque_needs() {
    let turned = 3000.0 * TAU / 60.0 * 3.0;
    for (min_v, top_wb, id) in [
        (250.0, 0.25, None),
        (250.0, 0.15, None),
        (80.0, 0.25, None),
        (80.0, 0.05, None),
        (250.0, 0.25, Some(-19.0)),
        (100.0, 0.4, Some(-19.0)),
    ] {
        let mut machine = IPM.folder(&[]);
        machine.parameters.dc_link_min_v = min_v;
        machine.parameters.min_id_a = id.unwrap_or(-MOST_A);
        let smooth = SmoothMap::new(&machine.map);
        let circles = Circles::new(&machine, &smooth, top_wb);
        let least = FRAC_2_PI * min_v / turned;
        let mut low = f64::min(0.8 * least, 0.7 * top_wb);
        let mut high = f64::max(1.15 * top_wb, 1.5 * low);
        if let Some(id) = id {
            low = low.max((0.2 + 0.006 * id).min(0.999 * least));
            high = f64::max(1.15 * top_wb, 1.5 * low).min(0.999 * 0.2_f64.hypot(0.3));
        }
        near(circles.flux_wb(0.0), low, 1e-9);
        near(circles.flux_wb(1.0), high, 1e-9);
        near(circles.knee_wb, 0.3 * high, 1e-12);
        for (position, x) in [(0.0, low / (low + 0.3 * high)), (1.0, 1.0 / 1.3)] {
            near(mix(circles.ends.0, circles.ends.1, position), x, 1e-12);
        }
        for (c, share) in circles.shares.iter().enumerate() {
            let x = c as f64 / 48.0 / 1.3;
            let w = 0.3 * x / (1.0 - x);
            near(*share, 2.0 * w - w * w, 1e-9);
        }
    }
}

/// T = 1.5 n_p (ψ_m + (L_d − L_q) i_d) i_q, at every node; and the flux linkage is the row's unless less torque needs less.
#[test]
fn rows_of_a_linear_machine() {
    let (machine, smooth) = machine();
    let mut circles = Circles::new(&machine, &smooth, TOP_WB);
    circles.factor = FACTOR;
    let mut on = 0;
    for (r, row) in circles.rows.iter().enumerate().filter(|(_, row)| row.torque_nm > 0.1) {
        let psi_wb = circles.flux_wb(r as f64 / 118.0);
        for ((id, effective), share) in row.nodes.iter().zip(&circles.shares) {
            near(*effective, 0.2 - 0.009 * id, 2e-6);
            let iq = share * row.torque_nm / (FACTOR * effective);
            let (psi_d, psi_q) = IPM.flux_wb(*id, iq);
            assert!(id.hypot(iq) <= MOST_A * 1.000_001, "{r}: {id}, {iq}");
            on += usize::from((psi_d.hypot(psi_q) / psi_wb - 1.0).abs() < 1e-6);
            assert!(psi_d.hypot(psi_q) < psi_wb * 1.000_001 || *id < -MOST_A + 1.0, "{r}: {id}, {iq}");
        }
    }
    assert!(on > 1_000, "{on}");
    // A margin of a row's flux linkage and current.
    circles.margins[60] = Margins { flux: vec![0.02; COLUMNS], current: 0.1 };
    let row = circles.row(60);
    let psi_wb = 0.98 * circles.flux_wb(60.0 / 118.0);
    let mut on = 0;
    for ((id, effective), share) in row.nodes.iter().zip(&circles.shares) {
        let iq = share * row.torque_nm / (FACTOR * effective);
        let (psi_d, psi_q) = IPM.flux_wb(*id, iq);
        assert!(id.hypot(iq) <= 0.9 * MOST_A * 1.000_001);
        on += usize::from((psi_d.hypot(psi_q) / psi_wb - 1.0).abs() < 1e-6);
    }
    assert!(on > 5, "{on}");
    // The case where its own nodes have less than its last.
    let flux: Vec<_> = (0..COLUMNS).map(|c| 0.03 - 0.000_5 * c as f64).collect();
    circles.margins[60] = Margins { flux: flux.clone(), current: 0.0 };
    let row = circles.row(60);
    let mut on = 0;
    for (((id, effective), share), margin) in row.nodes.iter().zip(&circles.shares).zip(flux) {
        let iq = share * row.torque_nm / (FACTOR * effective);
        let (psi_d, psi_q) = IPM.flux_wb(*id, iq);
        let own_wb = (1.0 - margin) * circles.flux_wb(60.0 / 118.0);
        on += usize::from((psi_d.hypot(psi_q) / own_wb - 1.0).abs() < 1e-6);
    }
    assert!(on > 5, "{on}");
}

/// The same machine with another map.
fn with_map(map: Linear) -> MachineFolder {
    let mut machine = IPM.folder(&[]);
    let FluxMap { id_a, iq_a, psi_d_wb, psi_q_wb } = &mut machine.map;
    let nodes = id_a.iter().flat_map(|id| iq_a.iter().map(|iq| map.flux_wb(*id, *iq)));
    (*psi_d_wb, *psi_q_wb) = nodes.unzip();
    machine
}

/// Saturates its q axis: at the largest current by 30 %.
fn saturated(mut machine: MachineFolder) -> MachineFolder {
    let FluxMap { iq_a, psi_q_wb, .. } = &mut machine.map;
    let share = |iq: &f64| 1.0 - 0.3 * (iq / MOST_A).powi(2);
    psi_q_wb.iter_mut().zip(iq_a.iter().cycle()).for_each(|(psi, iq)| *psi *= share(iq));
    machine
}

/// A machine for which making the circles narrower once is not enough.
#[test]
fn circles_are_made_anew_until_nothing_exceeds() {
    let mut machine = with_map(Linear { ld_h: 0.002, lq_h: 0.03, psi_m_wb: 0.02 });
    machine.parameters.dc_link_min_v = 30.0;
    let smooth = SmoothMap::new(&machine.map);
    let mut circles = Circles::new(&machine, &smooth, 0.1);
    let rounds = (0..ROUNDS).take_while(|_| circles.narrow()).count();
    assert!((2..ROUNDS).contains(&rounds), "{rounds}");
    let mtpa = MtpaCurrents { last_torque_nm: 60.0, currents_a: vec![(0.0, 0.0), (-5.0, 15.0)] };
    let tables = weakening_tables(&machine, &smooth, 0.1, &mtpa);
    let nodes = circles.rows.iter().flat_map(|row| &row.nodes);
    let wanted: Vec<_> = nodes.map(|(id, effective)| [*id as f32, *effective as f32]).collect();
    assert_eq!(tables.currents.nodes, wanted);
}

/// A machine whose d axis has the larger inductance, beyond the current that cancels its magnets' flux: torque would be divided by zero, or by less.
#[test]
fn what_torque_is_divided_by_is_above_zero() {
    let machine = with_map(Linear { ld_h: 0.015, lq_h: 0.006, psi_m_wb: 0.1 });
    let smooth = SmoothMap::new(&machine.map);
    let circles = Circles::new(&machine, &smooth, 0.8);
    let effective = circles.rows.iter().flat_map(|row| &row.nodes).map(|node| node.1);
    let least = effective.fold(f64::INFINITY, f64::min);
    near(least, 1e-6 * circles.flux_wb(1.0), 1e-12);
}

/// A machine with a five-thousandth of the current, which saturates as the larger one does, has the same circles.
#[test]
fn the_machines_size_does_not_matter() {
    let row = |size: f64| {
        let mut machine = saturated(IPM.folder(&[]));
        machine.map.id_a.iter_mut().chain(&mut machine.map.iq_a).for_each(|current| *current *= size);
        machine.parameters.max_current_a *= size;
        let smooth = SmoothMap::new(&machine.map);
        let row = Circles::new(&machine, &smooth, TOP_WB).rows.swap_remove(60);
        row.nodes
            .into_iter()
            .map(|(id, effective)| (id / size, effective, row.torque_nm / size))
            .collect::<Vec<_>>()
    };
    for (large, small) in row(1.0).into_iter().zip(row(0.000_2)) {
        near(small.0, large.0, 1e-6);
        near(small.1, large.1, 1e-6);
        near(small.2, large.2, 1e-6);
    }
}

/// Moved to the same torque on another circle, exactly, or not at all, whatever the machine's size.
#[test]
fn currents_are_moved_along_their_torque() {
    for size in [1.0, 1e-5] {
        moved_along_their_torque(size);
    }
}

/// With this many times the flux linkage.
fn moved_along_their_torque(size: f64) {
    let Linear { ld_h, lq_h, psi_m_wb } = IPM;
    let own = Linear { ld_h: size * ld_h, lq_h: size * lq_h, psi_m_wb: size * psi_m_wb };
    let mut machine = with_map(own);
    machine.parameters.max_torque_nm *= size;
    machine.parameters.min_id_a = -12.0;
    let smooth = SmoothMap::new(&machine.map);
    let circles = made_up(&machine, &smooth);
    for (id, iq) in [(-11.0, 6.0), (-6.0, 10.0), (-2.0, 3.0), (-9.0, 0.5)] {
        let (psi_d, psi_q) = own.flux_wb(id, iq);
        let (from_wb, torque_nm) = (psi_d.hypot(psi_q), own.torque_nm(id, iq));
        for share in [1.0, 0.98, 1.02, 0.999_9] {
            let (moved_d, moved_q) = circles.moved((id, iq), torque_nm, from_wb, share * from_wb);
            near(own.torque_nm(moved_d, moved_q), torque_nm, 1e-8);
            let (psi_d, psi_q) = own.flux_wb(moved_d, moved_q);
            near(psi_d.hypot(psi_q), share * from_wb, 1e-11);
        }
        assert_eq!(circles.moved((id, iq), torque_nm, from_wb, from_wb), (id, iq));
        // It does not lie on such a circle.
        for share in [1.01, 0.99, 1.000_001] {
            assert_eq!(circles.moved((id, iq), torque_nm, share * from_wb, 0.98 * from_wb), (id, iq));
        }
        // On the circle itself already, but of another torque.
        let (moved_d, moved_q) = circles.moved((id, iq), 1.01 * torque_nm, from_wb, from_wb * (1.0 + 1e-14));
        near(own.torque_nm(moved_d, moved_q), 1.01 * torque_nm, 1e-8);
        // No current has that torque there.
        assert_eq!(circles.moved((id, iq), torque_nm, from_wb, 1e-4 * size), (id, iq));
        // Below the least i_d, or beyond the map.
        for share in [0.5, 1.7] {
            let (moved_d, _) = circles.moved((id, iq), torque_nm, from_wb, share * from_wb);
            assert!((-12.0..=2.0).contains(&moved_d), "{moved_d}");
        }
    }
}

#[test]
fn the_coppers_share() {
    let (machine, smooth) = machine();
    let circles = made_up(&machine, &smooth);
    for (psi_wb, torque_nm) in [(0.1, 5.0), (0.3, 20.0), (0.2, 0.0)] {
        let voltage_v = 0.8 * 2.0 / std::f64::consts::PI * 250.0;
        near(
            circles.copper_share(psi_wb, torque_nm),
            2.0 * RESISTANCE_OHM * torque_nm / (4.5 * voltage_v * psi_wb),
            1e-12,
        );
    }
}

/// Limits that rise ever faster, and fall once.
fn limits() -> Vec<f64> {
    (0..ROWS).map(|k| 1.0 + 0.05 * k as f64 + 0.001 * (k as f64 - 50.0).powi(2)).collect()
}

#[test]
fn the_slope_is_the_least_within_the_coppers_reach() {
    let (machine, smooth) = machine();
    let circles = made_up(&machine, &smooth);
    let limits = limits();
    let square = |k: usize| {
        let x = 0.5 + 0.3 * k as f64 / 118.0;
        (0.1 * x / (1.0 - x)).powi(2)
    };
    for k in [0, 1, 20, 52, 70, 117, 118] {
        let reach = 2.0 * RESISTANCE_OHM * limits[k] / (4.5 * 0.8 * FRAC_2_PI * 250.0 * square(k).sqrt());
        let mut least = f64::INFINITY;
        for cell in 0..118 {
            let (low, high) = (square(cell), square(cell + 1));
            if high >= square(k) * (1.0 - reach) && low <= square(k) * (1.0 + reach) {
                least = least.min((limits[cell + 1] - limits[cell]) / (high - low));
            }
        }
        near(circles.slope(k, &limits), least, 1e-12);
    }
}

#[test]
fn the_line_above_the_best_currents_by_brute_force() {
    let (machine, smooth) = machine();
    let circles = made_up(&machine, &smooth);
    let mtpa = MtpaCurrents {
        last_torque_nm: 40.0,
        currents_a: (0..=80).map(|k| (-0.02 * f64::from(k), 0.3 * f64::from(k))).collect(),
    };
    let limits: Vec<f64> = circles.rows.iter().map(|row| row.torque_nm).collect();
    let copper = |psi_wb: f64, torque_nm: f64| {
        2.0 * RESISTANCE_OHM * torque_nm / (4.5 * 0.8 * FRAC_2_PI * 250.0 * psi_wb)
    };
    let mut rising = 0;
    for k in [0, 5, 33, 60, 90, 117, 118] {
        let x = 0.5 + 0.3 * k as f64 / 118.0;
        let psi_wb = 0.1 * x / (1.0 - x);
        let above = |torque_nm: f64, sign: f64| {
            let left_wb = psi_wb * (1.0 - sign * copper(psi_wb, torque_nm)).max(0.0).sqrt();
            let row = f64::max(118.0 * (left_wb / (left_wb + 0.1) - 0.5) / 0.3, 0.0);
            let w = 1.0 - (1.0 - torque_nm / (2.0 + 0.25 * row)).max(0.0).sqrt();
            let (id, iq, _) = circles.read(row / 118.0, 1.3 * w / (w + 0.3));
            let (best_d, best_q) = (-0.02 * 2.0 * torque_nm, 0.3 * 2.0 * torque_nm);
            if id > best_d { 0.0 } else { (id * id + iq * iq - best_d * best_d - best_q * best_q).max(0.0) }
        };
        let without = above(0.0, 1.0);
        let per_torque = circles.slope(k, &limits) * psi_wb * psi_wb;
        let mut rise = 0.0_f64;
        for sign in [1.0, -1.0] {
            let most_nm = limits[k] / (1.0 + sign * copper(psi_wb, per_torque));
            for step in 1..=64 {
                let w = f64::from(step) / 64.0;
                rise = rise.max((above(most_nm * (2.0 * w - w * w), sign) - without) / w);
            }
        }
        let found = circles.above_mtpa(k, &limits, &mtpa);
        near(found.0, without, 1e-9);
        near(found.1, rise, 1e-9);
        rising += i32::from(rise > 0.0);
        let row = circles.torque(&mtpa)[k];
        for (value, expected) in
            row.into_iter().zip([limits[k], limits[k], circles.slope(k, &limits), without, rise])
        {
            near(value.into(), expected, 1e-6);
        }
    }
    assert!(rising > 2, "{rising}");
}

/// The limit never falls from row to row, where the circle's torque does.
#[test]
fn limits_are_the_most_so_far() {
    let (machine, smooth) = machine();
    let mut circles = made_up(&machine, &smooth);
    circles.rows[50].torque_nm = 40.0;
    let mtpa = MtpaCurrents { last_torque_nm: 60.0, currents_a: vec![(0.0, 0.0), (-5.0, 15.0)] };
    let nodes = circles.torque(&mtpa);
    assert_eq!(nodes.len(), ROWS);
    for (k, [circle, limit, ..]) in nodes.into_iter().enumerate() {
        let own = if k == 50 { 40.0 } else { 2.0 + 0.25 * k as f32 };
        assert_eq!((circle, limit), (own, if k > 50 { 40.0 } else { own }), "{k}");
    }
}
