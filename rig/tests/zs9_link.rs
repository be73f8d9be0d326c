//! The link of the ZS9: the firmware's control law against the network, alone and with both motors.

mod zs9;

use tractive::control::{ZSource, ZSourceDesign, ZSourceGains, ZSourceInput};
use tractive::drive::dual::Settings;
use tractive::time::Clock;
use tractive_rig::plant::zs9::{LegGates, NetworkState, Source, ZNetwork, Zs9Plant, Zs9Settings};
use zs9::{PERIOD_S, SOURCE_V, period, plant_at, regulated};

/// By itself, and the drive's own, which is quicker: the motors' power is fed forward.
const DESIGNS: [ZSourceDesign; 2] = [
    ZSourceDesign::ZS9,
    Settings::new(Clock::new(25_000_000, 2_500), 2_500, &tractive::built_in::zs9::BUILT_IN).link,
];
const LINK_V: f64 = 2000.0 / 3.0;

/// The control; its duty acts in the period after the one that begins with the sample.
struct Control {
    state: ZSource,
    design: ZSourceDesign,
    gains: ZSourceGains,
    feed_forward: bool,
    next: f64,
}

impl Control {
    fn new(design: ZSourceDesign, feed_forward: bool, duty: f64) -> Self {
        Self { state: ZSource::new(), design, gains: design.gains(), feed_forward, next: duty }
    }

    fn duty(&mut self, network: &NetworkState, power_w: f64) -> f64 {
        let input = ZSourceInput {
            capacitor_v: network.capacitor_v() as f32,
            inductor_a: network.inductor_a() as f32,
            source_v: SOURCE_V as f32,
            power_w: if self.feed_forward { power_w as f32 } else { 0.0 },
            link_ref_v: LINK_V as f32,
            duty_room: 1.0,
        };
        let now = self.next;
        self.next = f64::from(self.state.step(&input, &self.design, &self.gains).unwrap().duty);
        now
    }
}

/// The network with a load of constant power, switched.
struct Network {
    state: NetworkState,
    power_w: f64,
}

impl Network {
    /// In steady state at 667 V.
    fn loaded(power_w: f64) -> Self {
        let inductor_a = power_w / SOURCE_V;
        let capacitor_v = 0.5 * (LINK_V + SOURCE_V);
        Self { state: NetworkState::even(inductor_a, capacitor_v), power_w }
    }

    fn link_v(&self) -> f64 {
        2.0 * self.state.capacitor_v() - SOURCE_V
    }

    /// Half of the shoot-through around a quarter of the period, half around three quarters. So the pattern is symmetric
    /// about the samples, and they see the current's mean.
    fn period(&mut self, duty: f64) {
        for _ in 0..2 {
            self.advance(false, duty, 0.25 * (1.0 - duty) * PERIOD_S);
            self.advance(true, duty, 0.5 * duty * PERIOD_S);
            self.advance(false, duty, 0.25 * (1.0 - duty) * PERIOD_S);
        }
    }

    fn advance(&mut self, short: bool, duty: f64, dt_s: f64) {
        const PIECES: u32 = 4;
        let h = dt_s / f64::from(PIECES);
        let slope = |x: &NetworkState| {
            let capacitors_v = x.capacitors_v[0] + x.capacitors_v[1];
            let (feed_v, bridge_a) = if short {
                (capacitors_v, x.inductors_a[0] + x.inductors_a[1])
            } else {
                // The load draws its power while there is a link.
                (SOURCE_V, self.power_w / ((1.0 - duty) * (capacitors_v - SOURCE_V).max(50.0)))
            };
            ZNetwork::ZS9.slopes(x, feed_v, bridge_a)
        };
        let along = |x: &NetworkState, k: &NetworkState, h: f64| NetworkState {
            inductors_a: [0, 1].map(|n| x.inductors_a[n] + h * k.inductors_a[n]),
            capacitors_v: [0, 1].map(|n| x.capacitors_v[n] + h * k.capacitors_v[n]),
        };
        for _ in 0..PIECES {
            let x = self.state;
            let k1 = slope(&x);
            let k2 = slope(&along(&x, &k1, 0.5 * h));
            let k3 = slope(&along(&x, &k2, 0.5 * h));
            let k4 = slope(&along(&x, &k3, h));
            let ends = along(&along(&x, &k1, h / 6.0), &k4, h / 6.0);
            self.state = along(&along(&ends, &k2, h / 3.0), &k3, h / 3.0);
        }
    }
}

/// Lowest and highest link voltage, relative to 667 V, in V.
#[derive(Clone, Copy, Debug)]
struct Band(f64, f64);

impl Band {
    const NONE: Self = Self(f64::INFINITY, f64::NEG_INFINITY);

    fn add(&mut self, link_v: f64) {
        (self.0, self.1) = (self.0.min(link_v - LINK_V), self.1.max(link_v - LINK_V));
    }

    fn width(self) -> f64 {
        self.1 - self.0
    }
}

#[test]
fn with_a_fixed_duty_constant_power_is_stable_only_when_small() {
    // Amplitude in the second half of a second over that in the first: a small swing dies or grows.
    let growth = |power_w: f64| {
        let mut network = Network::loaded(power_w);
        network.state.capacitors_v = network.state.capacitors_v.map(|volts| volts + 1.0);
        let mut bands = [Band::NONE; 2];
        for k in 0..4000 {
            network.period(0.2);
            bands[k / 2000].add(network.link_v());
        }
        bands[1].width() / bands[0].width()
    };
    let limit_w = 0.01 * 500e-6 * LINK_V * LINK_V / (2.0 * 0.5e-3);
    let grown = [0.5, 0.9, 1.1, 1.5].map(|share| (share * limit_w, growth(share * limit_w)));
    println!("limit {limit_w:.0} W: {grown:.3?}");
    assert!(grown[0].1 < 0.8 && grown[1].1 < 1.0 && grown[2].1 > 1.0 && grown[3].1 > 1.2);
    // At full power the link leaves its range in a tenth of a second.
    let mut network = Network::loaded(20_000.0);
    network.state.capacitors_v = network.state.capacitors_v.map(|volts| volts + 1.0);
    let mut band = Band::NONE;
    for _ in 0..1000 {
        network.period(0.2);
        band.add(network.link_v());
    }
    println!("20 kW, D fixed: {band:.0?}");
    assert!(band.width() > 200.0, "{band:?}");
}

#[test]
fn the_closed_loop_is_stable_with_any_power() {
    const POWERS_W: [f64; 6] = [-22_000.0, -5_000.0, 0.0, 2_200.0, 10_000.0, 22_000.0];
    for (design, power_w) in DESIGNS.into_iter().flat_map(|design| POWERS_W.map(|power_w| (design, power_w)))
    {
        let mut network = Network::loaded(power_w);
        let mut control = Control::new(design, true, 0.2);
        network.state.capacitors_v = network.state.capacitors_v.map(|volts| volts + 20.0);
        let mut late = Band::NONE;
        for k in 0..3000 {
            let duty = control.duty(&network.state, power_w);
            network.period(duty);
            if k > 1500 {
                late.add(network.link_v());
            }
        }
        println!("{} Hz, {power_w} W: {late:.3?} V late", design.outer_hz);
        assert!(late.0 > -0.5 && late.1 < 0.5, "{power_w} W: {late:?}");
    }
}

#[test]
fn a_step_of_power_hardly_moves_the_link_with_feed_forward() {
    let run = |feed_forward: bool| {
        let mut network = Network::loaded(8_000.0);
        let [design, _] = DESIGNS;
        let mut control = Control::new(design, feed_forward, 0.2);
        let (mut band, mut late) = (Band::NONE, Band::NONE);
        for k in 0..6000 {
            if k == 3000 {
                network.power_w = 12_000.0;
            }
            let duty = control.duty(&network.state, network.power_w);
            network.period(duty);
            if k >= 3000 { &mut band } else { &mut late }.add(network.link_v());
            if k > 5500 {
                late.add(network.link_v());
            }
        }
        band
    };
    let (with, without) = (run(true), run(false));
    println!("8 to 12 kW: {with:.1?} V with feed-forward, {without:.1?} V without");
    assert!(with.0 > -12.0 && with.1 < 12.0, "{with:?}");
    assert!(without.0 < 1.5 * with.0, "{without:?}");
}

#[test]
fn the_start_up_ramp_hardly_overshoots() {
    for (design, power_w) in
        DESIGNS.into_iter().flat_map(|design| [0.0, 2_000.0].map(|power_w| (design, power_w)))
    {
        let mut network = Network { state: NetworkState::even(power_w / SOURCE_V, SOURCE_V), power_w };
        let mut control = Control::new(design, true, 0.0);
        let (mut highest_v, mut highest_a, mut arrival_s) = (0.0_f64, 0.0_f64, 0.0);
        for k in 0..4000 {
            let duty = control.duty(&network.state, power_w);
            network.period(duty);
            if network.link_v() < LINK_V - 2.0 {
                arrival_s = f64::from(k + 1) * PERIOD_S;
            }
            highest_v = highest_v.max(network.link_v());
            highest_a = highest_a.max(network.state.inductor_a());
        }
        let overshoot = highest_v / LINK_V - 1.0;
        println!(
            "{power_w} W: overshoot {:.3} % of U_in, at 667 V after {arrival_s:.3} s, at most {highest_a:.1} A",
            100.0 * overshoot
        );
        assert!(overshoot < 0.005 && arrival_s < 0.12, "{overshoot} {arrival_s}");
    }
}

/// Both motors at full torque at a speed, closed loop: highest capacitor voltage, and the link's band in the last half.
fn full_torque(rpm: f64, source: Source, seconds: f64) -> (f64, Band, Zs9Plant) {
    let mut plant = plant_at([rpm, -rpm], &Zs9Settings { source, ..Zs9Settings::default() });
    plant.network = NetworkState::even(0.0, 0.5 * (LINK_V + SOURCE_V));
    let [design, _] = DESIGNS;
    let mut control = Control::new(design, true, 0.2);
    let (mut highest, mut band) = (0.0_f64, Band::NONE);
    let periods = (seconds / PERIOD_S) as u32;
    for k in 0..periods {
        // 120 N·m, in 10 ms.
        let share = (f64::from(k) / 100.0).min(1.0);
        let references = [(-18.7 * share, 53.09 * share), (-18.7 * share, -53.09 * share)];
        let power_w: f64 = plant
            .motors
            .iter()
            .map(|motor| {
                let (id, iq) = motor.currents_dq();
                motor.torque_nm() * motor.speed_rpm() * 0.104_72 + 1.5 * 0.12 * (id * id + iq * iq)
            })
            .sum();
        let duty = control.duty(&plant.network, power_w);
        let indices = regulated(&plant, references);
        period(&mut plant, indices, duty).unwrap();
        let capacitor_v = plant.network.capacitor_v();
        highest = highest.max(capacitor_v);
        if k > periods / 2 {
            band.add(plant.link_v());
        }
        if capacitor_v > 3000.0 {
            break;
        }
    }
    (highest, band, plant)
}

#[test]
fn two_motors_at_full_torque_leave_the_link_where_it_is() {
    for rpm in [50.0, 400.0, 800.0] {
        let (highest, band, plant) = full_torque(rpm, Source::Bidirectional, 0.3);
        let torque = plant.motors[0].torque_nm();
        println!("{rpm} r/min: {torque:.1} N·m, U_c at most {highest:.1} V, U_in {band:.2?} V");
        assert!((torque - 120.0).abs() < 6.0 && band.0 > -10.0 && band.1 < 10.0, "{rpm} {torque} {band:?}");
    }
}

#[test]
fn a_diode_in_place_of_the_switch_lets_the_link_run_away_at_low_speed() {
    // Continuous conduction needs 2 i_L above the phase currents' peak, 56 A: 400 r/min, copper loss included.
    for (rpm, at_least, at_most) in [(50.0, 1900.0, 3000.0), (300.0, 600.0, 3000.0), (460.0, 530.0, 560.0)] {
        let (highest, band, plant) = full_torque(rpm, Source::Diode, 0.5);
        println!("{rpm} r/min: U_c at most {highest:.0} V, U_in {band:.0?} V from 667 V");
        assert!((at_least..at_most).contains(&highest), "{rpm} r/min: {highest} V");
        let stored_j = ZNetwork::ZS9.stored_j(&NetworkState::even(0.0, 0.5 * (LINK_V + SOURCE_V)));
        let residual = plant.residual_j(stored_j) / plant.energies.source_j;
        assert!(residual.abs() < 1e-4, "{residual}");
    }
}

#[test]
fn behind_a_diode_the_bridge_gets_no_more_than_the_inductors_have() {
    let mut plant = plant_at([0.0; 2], &Zs9Settings { source: Source::Diode, ..Zs9Settings::default() });
    plant.network = NetworkState::even(5.0, 533.0);
    let [upper, _] = &mut plant.motors;
    upper.set_currents(40.0, 0.0);
    // V1 asks for phase u's 40 A; the inductors have 10 A. Until they have 40 A, the bridge's diodes short the link.
    let gates = [LegGates::ONE, LegGates::ZERO, LegGates::ZERO];
    plant.advance(gates, 12e-6).unwrap();
    let electrical_j = plant.motors[0].energies.electrical_j;
    let rising_a = plant.network.inductor_a();
    assert!((rising_a - (5.0 + 533.0 / 0.5e-3 * 12e-6)).abs() < 0.1, "{rising_a} A");
    assert_eq!(electrical_j, 0.0);
    // Then they have what it asks for, neither more nor less, at a link voltage that keeps it so.
    for _ in 0..20 {
        plant.advance(gates, 5e-6).unwrap();
    }
    let (drawn_a, had_a) = (plant.motors[0].currents_abc()[0], 2.0 * plant.network.inductor_a());
    println!(
        "{drawn_a:.3} A drawn, {had_a:.3} A in the inductors, {} J from the source",
        plant.energies.source_j
    );
    assert!(drawn_a > 42.0 && (drawn_a - had_a).abs() < 1e-5, "{drawn_a} A, {had_a} A");
    assert!(plant.energies.source_j.abs() < 1e-12, "{:?}", plant.energies);
}

#[test]
fn behind_a_diode_braking_pumps_the_link_up() {
    let braked = |source: Source| {
        let mut plant = plant_at([700.0; 2], &Zs9Settings { source, ..Zs9Settings::default() });
        plant.network = NetworkState::even(0.0, 0.5 * (LINK_V + SOURCE_V));
        let [design, _] = DESIGNS;
        let mut control = Control::new(design, false, 0.2);
        for _ in 0..1000 {
            let duty = control.duty(&plant.network, 0.0);
            let indices = regulated(&plant, [(-5.0, -15.0); 2]);
            period(&mut plant, indices, duty).unwrap();
        }
        (plant.network.capacitor_v(), plant.energies.source_j)
    };
    let ((kept_v, returned_j), (pumped_v, given_j)) = (braked(Source::Bidirectional), braked(Source::Diode));
    println!("switch: {kept_v:.1} V, {returned_j:.0} J; diode: {pumped_v:.0} V, {given_j:.0} J");
    assert!((kept_v - 533.3).abs() < 5.0 && returned_j < -300.0);
    assert!(pumped_v > 900.0 && given_j > -1.0);
}
