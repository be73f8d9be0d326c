//! The angle of a rotor at rest, from pulses whose commands have no whole number of halves: its axis, its poles, and none where there are none.

use std::path::Path;
use std::sync::OnceLock;
use tractive_control::frames::{AlphaBeta, Angle, Dq};
use tractive_control::machine::{Grid, Ratings, Tables};
use tractive_control::start_up::{PULSE_SHARE, StartUp, StartUpInput, StartUpStep, axis_error};
use tractive_tablegen::MachineFolder;

const HALF_S: f32 = 50e-6;

/// Commands after which a command's halves change from one to two, or from two to one. Pulses have three commands, in twelve directions of four pulses: every
/// other command; those of every other quarter turn, so that the longer pulses have an axis; those of every other half turn, so that they have a side.
const MIXED: usize = 1;
const BY_AXIS: usize = 36;
const BY_SIDE: usize = 72;

/// A rotor that stands.
#[derive(Clone, Copy)]
struct Rotor {
    at: Angle,
    inductance_h: Dq,
    /// Growth of the current along +d over its flux linkage, per Wb: magnets saturate the iron there.
    bend: f32,
}

impl Rotor {
    fn current(&self, flux: AlphaBeta) -> AlphaBeta {
        let flux = flux.park(self.at.sin_cos());
        let Dq { d, q } = self.inductance_h;
        Dq { d: flux.d / d * (1.0 + self.bend * flux.d), q: flux.q / q }.unpark(self.at.sin_cos())
    }
}

/// The reference machine's tables, with magnets or as those of reluctance alone.
fn tables(magnets: bool) -> Tables {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    static MADE: OnceLock<Tables> = OnceLock::new();
    let tables = MADE.get_or_init(|| MachineFolder::read(&folder).unwrap().tables());
    let ratings = Ratings { magnet_flux_wb: if magnets { 0.2 } else { 0.0 }, ..tables.ratings };
    Tables { ratings, ..*tables }
}

/// The law's answer, the largest flux linkage of its pulses, in Wb, and whether it has pushed the rotor: its pulses alone take some three hundred commands.
fn answer(rotor: &Rotor, tables: &Tables, alike: usize) -> (StartUpStep, f32, bool) {
    let (mut law, mut flux, mut largest_wb) = (StartUp::new(), AlphaBeta::default(), 0.0_f32);
    law.turn(Angle::ZERO, 0.2);
    for command in 0..10_000 {
        let input = StartUpInput {
            limit_v: 1_600.0,
            interval_s: 1.5 * HALF_S,
            committed: AlphaBeta::default(),
            tables,
        };
        let step = law.step(&input);
        let StartUpStep::Pulse(voltage) = step else { return (step, largest_wb, command > 400) };
        let halves = 1 + command / alike % 2;
        let acted = voltage * (halves as f32 * HALF_S);
        flux = flux + acted;
        largest_wb = largest_wb.max(flux.squared().sqrt());
        law.observe(rotor.current(flux), Some(acted));
    }
    panic!("no answer");
}

/// The angle that was found, off the rotor's, in electrical degrees.
fn off_deg(step: StartUpStep, rotor: &Rotor) -> f32 {
    let StartUpStep::Found(found) = step else { panic!("{step:?}") };
    (found - rotor.at).signed_radians().to_degrees()
}

const SALIENT: Dq = Dq { d: 2e-3, q: 5e-3 };
const ROUND: Dq = Dq { d: 3e-3, q: 3e-3 };
const EVERY: [usize; 3] = [MIXED, BY_AXIS, BY_SIDE];
const DEGREES: [f32; 5] = [0.0, 50.0, 123.0, 200.0, 311.0];

fn rotors(inductance_h: Dq, bend: f32) -> impl Iterator<Item = Rotor> {
    DEGREES.into_iter().map(move |degrees| Rotor {
        at: Angle::from_radians(degrees.to_radians()),
        inductance_h,
        bend,
    })
}

/// Flux linkage of a pulse, in Wb.
fn pulse_wb(tables: &Tables) -> f32 {
    let at = |id_a: f32| tables.flux.at(id_a, 0.0)[0];
    at(0.0) - at(-PULSE_SHARE * tables.ratings.max_current_a)
}

/// Each command makes up for what earlier halves made of earlier commands: no pulse is longer than the longest command makes it, and saturation shows
/// the poles.
#[test]
fn saturation_shows_the_poles_though_pulses_are_of_unequal_length() {
    let tables = tables(true);
    for (rotor, alike) in rotors(SALIENT, 2.0).flat_map(|rotor| EVERY.map(|alike| (rotor, alike))) {
        let (step, largest_wb, _) = answer(&rotor, &tables, alike);
        assert!(off_deg(step, &rotor).abs() < 1.0, "{step:?}");
        let pulse_wb = pulse_wb(&tables);
        assert!((1.2..1.7).contains(&(largest_wb / pulse_wb)), "{}", largest_wb / pulse_wb);
    }
}

/// Saturation along −d that the map already has masks the poles: they are not believed, and the start fails if the rotor does not move.
#[test]
fn poles_are_not_believed_where_the_map_saturates_the_other_way() {
    let tables = tables(true);
    // The map goes on straight along +d, so that what is added along −d alone is missing there.
    let bent: Vec<[f32; 2]> = {
        let Grid { rows, columns, first_row, inverse_row_step, nodes, .. } = tables.flux;
        let id_a = |row: usize| first_row + row as f32 / inverse_row_step;
        let node = |place: usize| {
            let [psi_d, psi_q] = nodes[place];
            let beyond_a = -id_a(place / columns).min(0.0);
            [psi_d + 4e-6 * beyond_a * beyond_a, psi_q]
        };
        (0..rows * columns).map(node).collect()
    };
    let bent = Tables { flux: Grid { nodes: bent.leak(), ..tables.flux }, ..tables };
    for (rotor, alike) in rotors(SALIENT, 2.0).flat_map(|rotor| EVERY.map(|alike| (rotor, alike))) {
        let (step, _, pushed) = answer(&rotor, &bent, alike);
        assert_eq!((step, pushed), (StartUpStep::Failed, true), "{alike}");
    }
}

/// Iron that saturates alike on both sides shows no poles: the rotor has to be pushed, and the start fails if it does not move.
#[test]
fn iron_without_poles_shows_none_and_a_rotor_that_is_held_has_failed() {
    let tables = tables(true);
    for (rotor, alike) in rotors(SALIENT, 0.0).flat_map(|rotor| EVERY.map(|alike| (rotor, alike))) {
        let (step, _, pushed) = answer(&rotor, &tables, alike);
        assert_eq!((step, pushed), (StartUpStep::Failed, true), "{alike}");
    }
}

/// A machine of reluctance alone has an axis and no poles, and its pulses have the flux linkage of a current.
#[test]
fn a_machine_of_reluctance_alone_is_found_but_for_half_a_turn() {
    let tables = tables(false);
    for (rotor, alike) in rotors(SALIENT, 0.0).flat_map(|rotor| EVERY.map(|alike| (rotor, alike))) {
        let (step, largest_wb, _) = answer(&rotor, &tables, alike);
        let StartUpStep::Found(found) = step else { panic!("{step:?}") };
        let error = axis_error(&tables.ratings, found - rotor.at);
        assert!(error.signed_radians().to_degrees().abs() < 0.1, "{error:?}");
        let pulse_wb = pulse_wb(&tables);
        assert!((1.2..1.7).contains(&(largest_wb / pulse_wb)), "{}", largest_wb / pulse_wb);
    }
}

/// Pulses of unequal lengths by themselves look like an axis, along the longer ones.
#[test]
fn a_machine_without_saliency_has_no_axis() {
    let tables = tables(true);
    for (rotor, alike) in rotors(ROUND, 0.0).flat_map(|rotor| EVERY.map(|alike| (rotor, alike))) {
        let (step, _, pushed) = answer(&rotor, &tables, alike);
        assert_eq!((step, pushed), (StartUpStep::Failed, false), "{alike}");
    }
}

/// Half a turn is no error for a machine without magnets, and is wholly an error for a machine with them.
#[test]
fn half_a_turn_is_an_error_of_magnets_alone() {
    let [with, without] = [true, false].map(|magnets| tables(magnets).ratings);
    assert!(with.has_magnets() && !without.has_magnets());
    for units in [0, 1, -1, 1 << 20, -(1 << 29)] {
        let error = Angle(units as u32);
        assert_eq!((axis_error(&with, error), axis_error(&without, error)), (error, error));
        let turned = Angle((units as u32) ^ 1 << 31);
        assert_eq!((axis_error(&with, turned), axis_error(&without, turned)), (turned, error));
    }
}
