//! What machine and link differ by from what they are taken for: found by the control law in front of such a machine, and made use of.

use std::path::Path;
use tractive_control::control::{
    AimInput, Boundary, ControlLaw, Controller, Demand, Gains, Law, ModeLimits, Regulated, RotorSample,
    Warmth, flux_linkage, torque_nm,
};
use tractive_control::frames::{AlphaBeta, Angle, Dq};
use tractive_control::machine::Tables;
use tractive_control::time::Clock;
use tractive_tablegen::MachineFolder;

/// A machine whose flux linkage is so much larger, more so across the magnets, whose magnets have so many Wb and whose windings so many Ω more.
#[derive(Clone, Copy, Debug)]
struct Off {
    share: f32,
    across: f32,
    wb: f32,
    ohm: f32,
}

const AS_RATED: Off = Off { share: 0.0, across: 0.0, wb: 0.0, ohm: 0.0 };

impl Off {
    fn flux(self, flux: Dq) -> Dq {
        Dq { d: (1.0 + self.share) * flux.d + self.wb, q: (1.0 + self.share + self.across) * flux.q }
    }
}

/// A drive in front of a machine that has whatever current is aimed at.
struct Run {
    law: Controller,
    tables: Tables,
    clock: Clock,
    off: Off,
    warmth: Warmth,
    turned: f64,
    period: u32,
    last: Option<AlphaBeta>,
    link_scale: f32,
}

const LIMITS: ModeLimits = ModeLimits {
    follows: Regulated::Mean,
    index_limit: 1.0,
    steady_share: 1.0,
    filled: false,
    ripple_share: 0.05,
    settled: true,
};

impl Run {
    fn new(off: Off) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
        let tables = MachineFolder::read(&folder).unwrap().tables();
        let clock = Clock::new(25_000_000, 2_500);
        let (law, warmth) = (Controller::new(), Warmth::NONE);
        Self { law, tables, clock, off, warmth, turned: 0.0, period: 0, last: None, link_scale: 1.0 }
    }

    /// So many seconds at a speed in rad/s with a torque in N·m asked for; a carrier half is five control periods.
    fn drive(&mut self, omega: f32, torque_nm: f32, seconds: f32) {
        let demand = Demand { torque_nm, slew_limited: true };
        let constants = Law { gains: &Gains::DEFAULT, clock: &self.clock, tables: &self.tables };
        for _ in 0..(seconds * 1e4) as u32 {
            self.turned += f64::from(omega) * 1e-4 / std::f64::consts::TAU;
            let angle = Angle::from_turns(self.turned.rem_euclid(1.0) as f32);
            self.law.track(angle, &self.clock);
            let current = self.law.target().current;
            let sample = RotorSample::new(current.unpark(angle.sin_cos()).abc(), angle, &self.tables);
            self.law.observe(&sample, &self.tables);
            self.period += 1;
            if self.period.is_multiple_of(5) {
                let there = self.off.flux(sample.flux).unpark(sample.frame);
                let half_way = Angle::from_radians(omega * -0.25e-3).sin_cos();
                let ohm = self.tables.ratings.stator_resistance_ohm + self.off.ohm;
                let drop = current.unpark(sample.frame.turned(half_way)) * (ohm * 0.5e-3);
                let acted = self.last.map(|last| (there - last + drop) * self.link_scale);
                self.last = Some(there);
                let boundary = Boundary { volt_seconds: acted, length_s: 0.5e-3 };
                self.law.learn(&boundary, &sample, Regulated::Mean, &constants);
                let aim = AimInput {
                    demand: &demand,
                    window: None,
                    udc_v: 1_500.0,
                    link_scale: self.link_scale,
                    swing: None,
                    limits: &LIMITS,
                };
                self.law.aim(&aim, &constants);
                self.link_scale = self.law.link_scale();
            } else {
                if self.warmth != Warmth::NONE {
                    self.law.warm(self.warmth, &constants);
                }
                self.law.explain(&constants);
            }
        }
    }

    /// The machine's torque, in N·m.
    fn torque_nm(&self) -> f32 {
        let current = self.law.target().current;
        torque_nm(&self.tables, self.off.flux(flux_linkage(&self.tables, current)), current)
    }

    /// By how much the torque that is told is off, as a share of the largest.
    fn told_off(&self) -> f32 {
        (self.law.flowing_nm() - self.torque_nm()) / self.tables.ratings.max_torque_nm
    }
}

/// Up to a torque by steps, and half a second there.
fn driven(off: Off, omega: f32, torque_nm: f32) -> Run {
    let mut run = Run::new(off);
    run.drive(omega, 0.0, 0.2);
    for share in [0.25, 0.5, 0.75, 1.0] {
        run.drive(omega, share * torque_nm, 0.2);
    }
    run
}

/// Four unknowns of two components: what tells them apart is what was seen at other torques.
#[test]
fn torque_is_known_whatever_is_off() {
    for (omega, torque_nm) in [(84.0, 900.0), (170.0, 900.0), (-170.0, -600.0), (500.0, 400.0)] {
        for off in [
            AS_RATED,
            Off { share: 0.1, ..AS_RATED },
            Off { share: -0.15, ..AS_RATED },
            Off { wb: -0.08, ..AS_RATED },
            Off { wb: 0.05, ..AS_RATED },
            Off { across: 0.1, ..AS_RATED },
            Off { ohm: 0.05, ..AS_RATED },
            Off { wb: -0.045, ohm: 0.05, ..AS_RATED },
            Off { share: -0.1, ohm: 0.05, ..AS_RATED },
        ] {
            let run = driven(off, omega, torque_nm);
            let told = run.told_off();
            println!("{off:?} at {omega} rad/s: told {told:.4} off, {:.1} N·m", run.torque_nm());
            assert!(told.abs() < 0.02, "{told} of the largest torque at {omega} rad/s, {off:?}");
        }
    }
}

#[test]
fn torque_is_corrected_for_magnets_from_a_fifth_of_rated_speed_on() {
    for (omega, torque_nm) in
        [(170.0, 400.0), (170.0, 900.0), (-170.0, 900.0), (500.0, 400.0), (500.0, -900.0)]
    {
        for wb in [-0.08, 0.05] {
            let run = driven(Off { wb, ..AS_RATED }, omega, torque_nm);
            let off = run.torque_nm() / torque_nm - 1.0;
            assert!(off.abs() < 0.02, "{off} with {wb} Wb at {omega} rad/s, {torque_nm} N·m");
        }
    }
}

#[test]
fn what_was_learnt_is_kept_where_it_turns_too_slowly_to_tell() {
    let mut run = driven(Off { wb: -0.08, ..AS_RATED }, 500.0, 900.0);
    run.drive(500.0, 0.0, 0.2);
    let known = run.law.map_error();
    run.law.idle();
    (run.last, run.off.ohm) = (None, 0.05);
    run.drive(0.0, 900.0, 1.0);
    let off = run.torque_nm() / 900.0 - 1.0;
    assert!(off.abs() < 0.02, "{off} at standstill");
    run.drive(42.0, 900.0, 1.0);
    let off = run.torque_nm() / 900.0 - 1.0;
    assert!(off.abs() < 0.02, "{off} at a twentieth of rated speed");
    assert!(known < -0.1, "{known}");
}

#[test]
fn a_machine_and_a_link_without_an_error_are_used_as_they_are() {
    let run = driven(Off { share: 0.002, wb: 0.002, ohm: 0.01, ..AS_RATED }, 300.0, 900.0);
    assert_eq!((run.law.link_scale(), run.law.map_scale()), (1.0, 1.0));
    assert_ne!(run.law.map_error(), 0.0);
    assert!((run.torque_nm() / 900.0 - 1.0).abs() < 0.01);
}

/// The loop's volt-seconds are scaled whole; of the torque as much is left as a link sensor may be off, and nothing from twice that on.
#[test]
fn what_a_link_sensor_may_be_off_is_no_torque_and_what_is_far_beyond_is() {
    for (share, left) in [(0.02, 0.02), (-0.02, -0.02), (0.1, 0.0), (-0.1, 0.0)] {
        let run = driven(Off { share, ..AS_RATED }, 500.0, 900.0);
        let scale = run.law.link_scale() * (1.0 + share);
        assert!((scale - 1.0).abs() < 0.7 * share.abs(), "{share}: link {}", run.law.link_scale());
        let off = run.torque_nm() / 900.0 - 1.0;
        assert!((off - left).abs() < 0.015, "{off} for {share}");
    }
}

/// Temperatures say what the magnets have: torque follows at once, and what was an error is none.
#[test]
fn what_temperatures_explain_is_no_error() {
    let mut run = Run::new(Off { wb: -0.08, ..AS_RATED });
    let magnets = -0.08 / run.tables.ratings.magnet_flux_wb;
    run.warmth = Warmth::new(1.0, magnets);
    run.drive(500.0, 0.0, 0.1);
    run.drive(500.0, 900.0, 0.1);
    let off = run.torque_nm() / 900.0 - 1.0;
    assert!(off.abs() < 0.01, "{off}");
    assert!((run.law.link_scale() - 1.0).abs() < 0.01, "{}", run.law.link_scale());
    run.drive(500.0, 0.0, 1.0);
    let seen = run.law.map_error();
    assert!((seen / magnets - 1.0).abs() < 0.05, "{seen}, {magnets}");
}
