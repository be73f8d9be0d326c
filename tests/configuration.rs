//! Each scalar of the configuration at 0, NaN, ±∞, negative and 1000-fold: refused by its own name, or 0 is a value that it may have.
//! The lists below take the structures apart whole: a new field does not compile until it is listed, and fails until it is checked.

use tractive::built_in::{traction::BUILT_IN, zs9};
use tractive::configuration::Refused;
use tractive::control::{Gains, SpeedDesign, ZSourceDesign, ZSourceGains};
use tractive::drive::{dual, traction};
use tractive::machine::{Curve, Grid, IronLoss, Mtpa, Ratings, Tables, Weakening};
use tractive::modulation::SwitchLimits;
use tractive::protection::LinkLimits;
use tractive::time::Clock;

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

fn settings() -> traction::Settings {
    let devices = SwitchLimits::new(250, 100, BUILT_IN.ratings.max_switching_hz, &CLOCK);
    traction::Settings::new(CLOCK, devices)
}

fn zs9_settings() -> dual::Settings {
    dual::Settings::new(CLOCK, 2_500, &zs9::BUILT_IN)
}

/// A scalar by its name, and the way to it.
type Field<T, V> = (&'static str, fn(&mut T) -> &mut V);

/// All fields of a structure, in lists by their types. Those behind the bar are listed elsewhere.
macro_rules! fields {
    ($type:ty as $pattern:path { $($field:ident),* | $($other:ident),* }: $value:ty) => {{
        #[allow(dead_code, reason = "for the compiler to see that nothing is left out")]
        fn is_whole($pattern { $($field: _,)* $($other: _,)* }: $type) {}
        const FIELDS: &[Field<$type, $value>] = &[$((stringify!($field), |it| &mut it.$field)),*];
        FIELDS
    }};
}

/// The values that can be put into a scalar, and those of them that are refused whatever the scalar means.
trait Scalar: Copy + PartialEq + core::fmt::Debug {
    const ZERO: Self;
    fn nonsense(self) -> Vec<Self>;
}

impl Scalar for f32 {
    const ZERO: Self = 0.0;
    fn nonsense(self) -> Vec<Self> {
        let negative = if self == 0.0 { -1.0 } else { -self };
        vec![0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, negative, 1e3 * self]
    }
}

macro_rules! whole_scalars {
    ($($whole:ty),*) => {$(
        impl Scalar for $whole {
            const ZERO: Self = 0;
            fn nonsense(self) -> Vec<Self> {
                vec![0, Self::MAX, self.wrapping_neg(), self.saturating_mul(1_000)]
            }
        }
    )*};
}
whole_scalars!(u32, usize);

/// Scalars for which 0 is a value like any other: what is ideal, what is not there, where an axis begins.
const MAY_BE_ZERO: [&str; 11] = [
    "ratings.min_id_a",
    "ratings.stator_resistance_ohm",
    "ratings.magnet_flux_wb",
    "ratings.trip_dc_under_v",
    "ratings.iron.hysteresis",
    "ratings.iron.eddy",
    "devices.min_pulse_ticks",
    "devices.dead_time_ticks",
    "link.resistance_ohm",
    "gains.sixth_turn_rad",
    "gains.link_damping",
];

/// Puts all nonsense into the fields of a part, one at a time.
fn try_all<C: Copy, T, V: Scalar>(
    whole: C,
    path: &str,
    fields: &[Field<T, V>],
    part: fn(&mut C) -> &mut T,
    check: impl Fn(&C) -> Result<(), Refused>,
) {
    for (name, field) in fields {
        let name = format!("{path}{name}");
        let good = *field(part(&mut whole.clone()));
        for bad in good.nonsense() {
            let zero_is_good = bad == V::ZERO && (good == V::ZERO || MAY_BE_ZERO.contains(&name.as_str()));
            if bad == good || zero_is_good {
                continue;
            }
            let mut spoilt = whole;
            *field(part(&mut spoilt)) = bad;
            let refused = check(&spoilt).expect_err(&format!("{name} = {bad:?} is let through"));
            assert_eq!(refused.name, name, "{name} = {bad:?}: {refused}");
        }
    }
}

fn try_tables(good: &'static Tables, check: impl Fn(&Tables) -> Result<(), Refused> + Copy) {
    check(good).unwrap_or_else(|refused| panic!("{}: {refused}", good.name));
    let ratings = fields!(Ratings as Ratings {
        pole_pairs, stator_resistance_ohm, max_torque_nm, max_power_w, max_current_a, min_id_a, max_speed_rad_s, magnet_flux_wb,
        dc_link_min_v, dc_link_nominal_v, dc_link_max_v, max_switching_hz, trip_current_a, trip_dc_over_v,
        trip_dc_under_v, trip_speed_rad_s, torque_slew_nm_s, max_acceleration_rad_s2, iron_share | iron
    }: f32);
    try_all(*good, "ratings.", ratings, |tables| &mut tables.ratings, check);
    let iron = fields!(IronLoss as IronLoss { hysteresis, eddy | }: f32);
    try_all(*good, "ratings.iron.", iron, |tables| &mut tables.ratings.iron, check);
    #[allow(dead_code, reason = "for the compiler to see that no table is left out")]
    fn is_whole(Tables { name: _, ratings: _, flux: _, mtpa, weakening, z_source: _ }: Tables) {
        let Mtpa { universal: _, parameters: _, start: _, curvature: _ } = mtpa;
        let Weakening { currents: _, torque: _, flux_knee_wb: _, share_knee: _ } = weakening;
    }
    let knees: [Field<Weakening, f32>; 2] =
        [("flux_knee_wb", |part| &mut part.flux_knee_wb), ("share_knee", |part| &mut part.share_knee)];
    try_all(*good, "weakening.", &knees, |tables| &mut tables.weakening, check);
    try_grid(good, "flux.", |tables| &mut tables.flux, check);
    try_grid(good, "mtpa.parameters.", |tables| &mut tables.mtpa.parameters, check);
    try_grid(good, "weakening.currents.", |tables| &mut tables.weakening.currents, check);
    try_curve(good, "mtpa.universal.", |tables| &mut tables.mtpa.universal, check);
    try_curve(good, "mtpa.start.", |tables| &mut tables.mtpa.start, check);
    try_curve(good, "mtpa.curvature.", |tables| &mut tables.mtpa.curvature, check);
    try_curve(good, "weakening.torque.", |tables| &mut tables.weakening.torque, check);
}

fn try_grid<const N: usize>(
    good: &Tables,
    path: &str,
    part: fn(&mut Tables) -> &mut Grid<N>,
    check: impl Fn(&Tables) -> Result<(), Refused> + Copy,
) {
    let scalars = fields!(Grid<2> as Grid {
        first_row, inverse_row_step, first_column, inverse_column_step | rows, columns, nodes
    }: f32);
    assert_eq!(scalars.len(), 4);
    let scalars: [Field<Grid<N>, f32>; 4] = [
        ("first_row", |grid| &mut grid.first_row),
        ("inverse_row_step", |grid| &mut grid.inverse_row_step),
        ("first_column", |grid| &mut grid.first_column),
        ("inverse_column_step", |grid| &mut grid.inverse_column_step),
    ];
    try_all(*good, path, &scalars, part, check);
    let counts: [Field<Grid<N>, usize>; 2] =
        [("rows", |grid| &mut grid.rows), ("columns", |grid| &mut grid.columns)];
    try_all(*good, path, &counts, part, check);
    try_nodes(good, path, |tables| &mut part(tables).nodes, check);
}

fn try_curve<const N: usize>(
    good: &Tables,
    path: &str,
    part: fn(&mut Tables) -> &mut Curve<N>,
    check: impl Fn(&Tables) -> Result<(), Refused> + Copy,
) {
    let _ = fields!(Curve<2> as Curve { first, inverse_step | nodes }: f32);
    let scalars: [Field<Curve<N>, f32>; 2] =
        [("first", |curve| &mut curve.first), ("inverse_step", |curve| &mut curve.inverse_step)];
    try_all(*good, path, &scalars, part, check);
    try_nodes(good, path, |tables| &mut part(tables).nodes, check);
}

/// A table that is too short, and one with a node that is no number.
fn try_nodes<const N: usize>(
    good: &Tables,
    path: &str,
    nodes: impl Fn(&mut Tables) -> &mut &'static [[f32; N]],
    check: impl Fn(&Tables) -> Result<(), Refused>,
) {
    let name = format!("{path}nodes");
    let mut tables = *good;
    let values = *nodes(&mut tables);
    for (at, part) in [(0, 0), (values.len() / 2, N - 1), (values.len() - 1, 0)] {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut spoilt = values.to_vec();
            spoilt[at][part] = bad;
            *nodes(&mut tables) = spoilt.leak();
            let refused = check(&tables).expect_err(&format!("{name}[{at}] = {bad} is let through"));
            assert_eq!(refused.name, name, "{refused}");
        }
    }
    for length in [0, 1] {
        *nodes(&mut tables) = &values[..length];
        assert!(check(&tables).expect_err("is let through").name.starts_with(path), "{name}");
    }
}

#[test]
fn every_scalar_of_the_traction_drive() {
    let settings = settings();
    settings.check(&BUILT_IN).unwrap();
    try_tables(&BUILT_IN, |tables| settings.check(tables));
    let check = |settings: &traction::Settings| settings.check(&BUILT_IN);
    let own = fields!(traction::Settings as traction::Settings { angle_late_s, angle_step_rad, iron_share | clock, devices, gains, current_filter_ticks, drops }: f32);
    let floats = fields!(Clock as Clock { tick_s, ticks_per_s, control_s | control_ticks }: f32);
    try_all(settings, "clock.", floats, |settings| &mut settings.clock, check);
    let ticks: [Field<Clock, u32>; 1] = [("control_ticks", |clock| &mut clock.control_ticks)];
    try_all(settings, "clock.", &ticks, |settings| &mut settings.clock, check);
    let devices = fields!(SwitchLimits as SwitchLimits { min_pulse_ticks, dead_time_ticks, shortest_half_ticks | }: u32);
    try_all(settings, "devices.", devices, |settings| &mut settings.devices, check);
    let gains = fields!(Gains as Gains { carrier, pattern_rad, square_damping, observer, sixth_turn_rad, resistance_doubt, link_damping | }: f32);
    try_all(settings, "gains.", gains, |settings| &mut settings.gains, check);
    try_all(settings, "", own, |settings| settings, check);
    let drops = fields!(traction::Drops as traction::Drops { threshold_v, slope_ohm | }: f32);
    try_all(settings, "drops.", drops, |settings| &mut settings.drops, check);
    let late: [Field<traction::Settings, u32>; 1] =
        [("current_filter_ticks", |settings| &mut settings.current_filter_ticks)];
    try_all(settings, "", &late, |settings| settings, check);
}

#[test]
fn every_scalar_of_the_zs9() {
    let settings = zs9_settings();
    settings.check(&zs9::BUILT_IN).unwrap();
    zs9_settings_of(1_250).check(&zs9::BUILT_IN).unwrap();
    try_tables(&zs9::BUILT_IN, |tables| settings.check(tables));
    let check = |settings: &dual::Settings| settings.check(&zs9::BUILT_IN);
    let own = fields!(dual::Settings as dual::Settings {
        carrier_ticks, dead_time_ticks | clock, gains, speed, link, link_gains, limits
    }: u32);
    try_all(settings, "", own, |settings| settings, check);
    let gains = fields!(Gains as Gains { carrier, pattern_rad, square_damping, observer, sixth_turn_rad, resistance_doubt, link_damping | }: f32);
    try_all(settings, "gains.", gains, |settings| &mut settings.gains, check);
    let speed = fields!(SpeedDesign as SpeedDesign { inertia_kg_m2, natural_rad_s, period_s | }: f32);
    try_all(settings, "speed.", speed, |settings| &mut settings.speed, check);
    let link = fields!(ZSourceDesign as ZSourceDesign {
        inductance_h, resistance_ohm, capacitance_f, period_s, inner_hz, outer_hz, link_slew_v_s, duty_max, inductor_max_a,
        damping_s |
    }: f32);
    try_all(settings, "link.", link, |settings| &mut settings.link, check);
    let link_gains = fields!(ZSourceGains as ZSourceGains { inner_ohm, outer_s, integral_share | }: f32);
    try_all(settings, "link_gains.", link_gains, |settings| &mut settings.link_gains, check);
    let limits = fields!(LinkLimits as LinkLimits { source_min_v, capacitor_max_v, duty_max | }: f32);
    try_all(settings, "limits.", limits, |settings| &mut settings.limits, check);
}

fn zs9_settings_of(carrier_ticks: u32) -> dual::Settings {
    dual::Settings::new(CLOCK, carrier_ticks, &zs9::BUILT_IN)
}

/// The only loop of an interrupt whose length is configured runs over these, and they are divided by.
#[test]
fn carriers_are_a_whole_part_of_the_control_period() {
    for carrier_ticks in 0..=6_000 {
        let good = zs9_settings_of(carrier_ticks).check(&zs9::BUILT_IN);
        let is_part = carrier_ticks > 0 && 2_500 % carrier_ticks == 0 && carrier_ticks % 2 == 0;
        assert_eq!(good.is_ok(), is_part && 2_500 / carrier_ticks <= 8, "{carrier_ticks}: {good:?}");
    }
}

#[test]
fn relations_are_told_by_name() {
    let refused = |spoil: fn(&mut Ratings)| {
        let mut tables = BUILT_IN;
        spoil(&mut tables.ratings);
        settings().check(&tables).unwrap_err().to_string()
    };
    let text = refused(|ratings| ratings.trip_current_a = ratings.max_current_a);
    assert!(text.starts_with("ratings.max_current_a: 233.345: must be from 0"), "{text}");
    assert!(refused(|ratings| ratings.pole_pairs = 2.5).starts_with("ratings.pole_pairs: 2.5"));
    assert!(refused(|ratings| ratings.dc_link_min_v = 1600.0).starts_with("ratings.dc_link_min_v: 1600"));
    assert!(refused(|ratings| ratings.max_torque_nm = 1300.0).starts_with("ratings.max_torque_nm: 1300"));
    assert!(refused(|ratings| ratings.magnet_flux_wb = 0.2).starts_with("ratings.magnet_flux_wb: 0.2"));
    assert!(
        refused(|ratings| ratings.trip_dc_under_v = 1_000.0).starts_with("ratings.trip_dc_under_v: 1000")
    );
}
