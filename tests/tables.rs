//! The tables built into the firmware, judged on the smooth flux map: torque, current, flux linkage.
#![allow(missing_docs)]

use std::path::Path;
use tractive::built_in::traction::BUILT_IN;
use tractive::control::{Region, VoltageLimit, operating_point};
use tractive::machine::Tables;
use tractive_tablegen::{MachineFolder, SmoothMap, rust_source};

/// The machine that is built in, in f64.
struct Judge {
    folder: MachineFolder,
    map: SmoothMap,
}

impl Judge {
    fn new() -> Self {
        let folder = MachineFolder::read(&folder()).unwrap();
        let map = SmoothMap::new(&folder.map);
        Self { folder, map }
    }

    fn torque_nm(&self, id: f64, iq: f64) -> f64 {
        let at = self.map.at(id, iq);
        1.5 * f64::from(self.folder.parameters.pole_pairs) * (at.psi_d_wb * iq - at.psi_q_wb * id)
    }

    /// iq that gives a torque at an id; `None` where the current limit comes first.
    fn iq_for(&self, torque_nm: f64, id: f64) -> Option<f64> {
        let (mut low, mut high) = (0.0, self.folder.parameters.max_current_a);
        if self.torque_nm(id, high) < torque_nm {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.torque_nm(id, middle) < torque_nm { low = middle } else { high = middle }
        }
        Some(high)
    }

    /// Least current for a torque: every id of a fine raster.
    fn least_current_a(&self, torque_nm: f64) -> f64 {
        let raster = (0..=1000).map(|k| -0.001 * f64::from(k) * self.folder.parameters.max_current_a);
        raster
            .filter_map(|id| self.iq_for(torque_nm, id).map(|iq| id.hypot(iq)))
            .fold(f64::INFINITY, f64::min)
    }
}

fn folder() -> std::path::PathBuf {
    // The same choice as the build script's.
    let machine = option_env!("TRACTIVE_MACHINE").unwrap_or("pmasynrm-180kw");
    let named = Path::new(env!("CARGO_MANIFEST_DIR")).join("tables").join(machine);
    if named.is_dir() { named } else { machine.into() }
}

/// The firmware's two passes, equations (7) to (13), on the target's own types.
fn two_passes(torque: f32, tables: &Tables) -> (f32, f32) {
    let [mut id, mut iq, id_trim, iq_trim] = tables.mtpa.start.at(torque);
    let per_flux = torque / (1.5 * tables.ratings.pole_pairs);
    for _ in 0..2 {
        let [psi_f, saliency] = tables.mtpa.parameters.at(id, iq);
        let s = (per_flux * saliency).sqrt() / psi_f;
        let [share] = tables.mtpa.universal.at(s / (1.0 + s));
        id = -(psi_f / saliency) * s * share;
        iq = per_flux / (psi_f - saliency * id);
    }
    (id + id_trim, iq + iq_trim)
}

#[test]
fn two_passes_give_the_torque_with_the_least_current() {
    let judge = Judge::new();
    let (mut worst_torque, mut worst_share, mut worst_excess) = (0.0_f64, 0.0_f64, f64::MIN);
    let largest = judge.folder.parameters.max_torque_nm;
    for step in 1..=200 {
        // From 2 % on: 25 to 1,235 N·m.
        let torque = largest * (0.02 + 0.98 * f64::from(step) / 200.0);
        let (id, iq) = two_passes(torque as f32, &BUILT_IN);
        let error = (judge.torque_nm(id.into(), iq.into()) - torque).abs();
        worst_torque = worst_torque.max(error / (0.003 * torque).max(0.5));
        worst_share = worst_share.max(error / torque);
        let excess = f64::from(id).hypot(iq.into()) / judge.least_current_a(torque) - 1.0;
        worst_excess = worst_excess.max(excess);
    }
    println!("torque: worst {:.3} %, {worst_torque:.3} of the bound", 100.0 * worst_share);
    println!("current: worst {:.4} % above the optimum", 100.0 * worst_excess);
    assert!(worst_torque < 1.0, "torque {worst_torque} of the bound, 0.3 % or 0.5 N·m");
    assert!(worst_excess < 5e-4, "current {worst_excess} above the optimum");
}

/// The page on the papers says what the start table is worth alone, and what the passes add to it.
#[test]
fn the_page_says_what_the_passes_add_to_the_start_table() {
    const PAGE: &str = include_str!("../docs/papers.md");
    let judge = Judge::new();
    if judge.folder.parameters.name != "pmasynrm-180kw" {
        return;
    }
    // Torque off in percent: from 100, from 20 and from 2 N·m on with the table alone; with the passes.
    let mut off = [0.0_f64; 4];
    for step in 4..=2 * judge.folder.parameters.max_torque_nm as u32 {
        let torque = 0.5 * f64::from(step);
        let percent =
            |(id, iq): (f32, f32)| 100.0 * (judge.torque_nm(id.into(), iq.into()) / torque - 1.0).abs();
        let [id, iq, ..] = BUILT_IN.mtpa.start.at(torque as f32);
        let alone = percent((id, iq));
        for (worst, from_nm) in off.iter_mut().zip([100.0, 20.0, 2.0]) {
            *worst = if torque >= from_nm { worst.max(alone) } else { *worst };
        }
        off[3] = off[3].max(percent(two_passes(torque as f32, &BUILT_IN)));
    }
    println!("{off:.4?} %");
    // Within so much: rounded up.
    let up = |percent: f64, grain: f64| (percent / grain).ceil() * grain;
    let [from_100, from_20, from_2, passes] = off;
    let told = format!(
        "With the table alone torque is within {:.2} % from 100 N·m on, within {:.1} % from 20 and within {:.1} % from 2 N·m; \
         with the passes within {:.3} % everywhere.",
        up(from_100, 0.01),
        up(from_20, 0.1),
        up(from_2, 0.1),
        up(passes, 0.001)
    );
    assert!(
        PAGE.split_whitespace().collect::<Vec<_>>().join(" ").contains(&told),
        "docs/papers.md does not say: {told}"
    );
}

/// Share of the largest torque below which flux linkage may be less than asked for.
const FLUX_FLOOR: f64 = 0.02;
/// Of single precision: an index among the rows is off by a few units of its last place, 2⁻¹⁷ cells of 1.6 % of flux each.
const ROUNDING: f64 = 5e-7;

/// Flux linkage at a position of the weakening tables' rows.
fn flux_wb(place: f32) -> f32 {
    BUILT_IN.weakening.flux_knee_wb * place / (1.0 - place)
}

/// All circles and torques whose currents have id ≤ 0. Above it lies only square wave at small torque, with more voltage than
/// the torque needs; there the currents end at the map's edge and the flux linkage is what it is.
#[test]
fn weakening_keeps_torque_flux_and_the_current_limit() {
    let judge = Judge::new();
    let weakening = &BUILT_IN.weakening;
    let (largest, factor) = (f64::from(BUILT_IN.ratings.max_torque_nm), 1.5 * BUILT_IN.ratings.pole_pairs);
    let (low, high) = (weakening.torque.first, weakening.torque.last());
    let (mut share, mut absolute, mut current) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut above, mut below) = (f64::MIN, 0.0_f64);
    for row in 0..=1200 {
        let place = low + (high - low) * row as f32 / 1200.0;
        let [circle, limit, ..] = weakening.torque.at(place);
        for step in 1..=100 {
            let torque = limit * step as f32 / 100.0;
            if torque > circle {
                continue;
            }
            let w = 1.0 - (1.0 - torque / circle).sqrt();
            let [id, effective] = weakening.currents.at(place, w / (w + weakening.share_knee));
            let iq = torque / (factor * effective);
            if id > 0.0 {
                continue;
            }
            current = current.max(f64::from(id).hypot(iq.into()));
            let error = (judge.torque_nm(id.into(), iq.into()) - f64::from(torque)).abs();
            let at = judge.map.at(id.into(), iq.into());
            let off = at.psi_d_wb.hypot(at.psi_q_wb) / f64::from(flux_wb(place)) - 1.0;
            absolute = absolute.max(error);
            share = share.max(error / f64::from(torque));
            above = above.max(off);
            if f64::from(torque) >= FLUX_FLOOR * largest {
                below = below.max(-off);
            }
        }
    }
    println!("torque: worst {:.4} %, {absolute:.3} N·m", 100.0 * share);
    println!("flux linkage: at most {above:.2e} more than asked for, {below:.2e} less");
    println!("current: most {current:.4} A of {}", BUILT_IN.ratings.max_current_a);
    assert!(share < 0.003 && absolute < 1e-3 * largest, "torque {share}, {absolute} N·m");
    assert!(above < ROUNDING && below < 0.003, "flux linkage {above}, {below}");
    let most = (1.0 + ROUNDING) * f64::from(BUILT_IN.ratings.max_current_a);
    assert!(current < most, "current {current} A");
}

/// No torque above the table's limit may be found on the smooth map, on or inside a circle.
#[test]
fn the_limit_is_all_the_torque_there_is() {
    let judge = Judge::new();
    let torque_table = &BUILT_IN.weakening.torque;
    let (low, high) = (torque_table.first, torque_table.last());
    let most_current = judge.folder.parameters.max_current_a;
    let step = most_current / 467.0;
    let raster: Vec<(f64, f64)> = (0..=467)
        .flat_map(|d| (0..=467).map(move |q| (step * f64::from(d) - most_current, step * f64::from(q))))
        .filter(|(id, iq)| id.hypot(*iq) <= most_current)
        .map(|(id, iq)| {
            let at = judge.map.at(id, iq);
            (at.psi_d_wb.hypot(at.psi_q_wb), judge.torque_nm(id, iq))
        })
        .collect();
    let (mut above, mut below) = (0.0_f64, 0.0_f64);
    for row in 0..=120 {
        let place = low + (high - low) * row as f32 / 120.0;
        let [_, limit, ..] = torque_table.at(place);
        let inside = raster.iter().filter(|(flux, _)| *flux <= f64::from(flux_wb(place)));
        let found = inside.map(|(_, torque)| *torque).fold(0.0, f64::max);
        above = above.max(found / f64::from(limit) - 1.0);
        below = below.max(1.0 - found / f64::from(limit));
    }
    println!("limit: at most {:.3} % less than a raster finds, {:.3} % more", 100.0 * above, 100.0 * below);
    assert!(above < 2e-3, "the raster finds {above} more");
    // The raster misses the circle's edge by as much as its cells are wide, 0.5 A; that is most on the smallest circle.
    assert!(below < 0.03, "the raster finds {below} less");
}

#[test]
fn the_built_in_tables_are_what_the_folder_gives_byte_for_byte() {
    let text = || rust_source(&MachineFolder::read(&folder()).unwrap().tables(), "tractive_control::machine");
    let first = text();
    assert!(first == text());
    assert!(first == include_str!(concat!(env!("OUT_DIR"), "/machine_tables.rs")));
}

#[test]
fn the_largest_torque_of_least_current_is_none_that_is_limited() {
    let limit = VoltageLimit { udc_v: 1_500.0, modulation_index: 1.0, filled: false };
    for tables in [&BUILT_IN, &tractive::built_in::zs9::BUILT_IN] {
        let most_nm = tables.mtpa.start.last();
        for (torque_nm, region) in [(most_nm, Region::Mtpa), (1.001 * most_nm, Region::Limit)] {
            for sign in [1.0, -1.0] {
                let point = operating_point(sign * torque_nm, 0.0, &limit, tables);
                assert_eq!((point.region, point.torque_nm), (region, sign * most_nm));
            }
        }
    }
}
