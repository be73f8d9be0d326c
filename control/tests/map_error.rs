//! The deviation of machine and link from their assumed values: found by the control law that drives such a machine, and made use of.

use std::path::Path;
use std::sync::LazyLock;
use tractive_control::control::{
    AimInput, Boundary, ControlLaw, Controller, DeadTime, Demand, Gains, Law, ModeLimits, Regulated,
    RotorSample, Warmth, flux_linkage, torque_nm,
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

/// The machine as it is rated.
static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    MachineFolder::read(&folder).unwrap().tables()
});

/// A drive with a machine whose current is always the reference.
struct Run {
    law: Controller,
    tables: &'static Tables,
    clock: Clock,
    off: Off,
    warmth: Warmth,
    dead: DeadTime,
    /// Voltage along q that is not the machine's, in V.
    fault_v: f32,
    turned: f64,
    period: u32,
    last: Option<AlphaBeta>,
    link_scale: f32,
}

const LIMITS: ModeLimits = ModeLimits::carrier(1.0);

impl Run {
    fn new(off: Off) -> Self {
        let clock = Clock::new(25_000_000, 2_500);
        let (law, warmth, dead) =
            (Controller::new(), Warmth::NONE, DeadTime { voltage_v: 0.0, left_share: 0.2, time_s: 0.0 });
        Self {
            law,
            tables: &TABLES,
            clock,
            off,
            warmth,
            dead,
            fault_v: 0.0,
            turned: 0.0,
            period: 0,
            last: None,
            link_scale: 1.0,
        }
    }

    /// Drives so many seconds at a speed in rad/s with a torque demand in N·m; a carrier half is five control periods.
    fn drive(&mut self, omega: f32, torque_nm: f32, seconds: f32) {
        let demand = Demand { torque_nm, slew_limited: true };
        let constants = Law { gains: &Gains::DEFAULT, clock: &self.clock, tables: self.tables };
        for _ in 0..(seconds * 1e4) as u32 {
            self.turned += f64::from(omega) * 1e-4 / std::f64::consts::TAU;
            let angle = Angle::from_turns(self.turned.rem_euclid(1.0) as f32);
            self.law.track(angle, &self.clock);
            let current = self.law.target().current;
            let sample = RotorSample::new(current.unpark(angle.sin_cos()).abc(), angle, self.tables);
            self.law.observe(&sample, self.tables);
            self.period += 1;
            if self.period.is_multiple_of(5) {
                let there = self.off.flux(sample.flux).unpark(sample.frame);
                let half_way = Angle::from_radians(omega * -0.25e-3).sin_cos();
                let ohm = self.tables.ratings.stator_resistance_ohm + self.off.ohm;
                let drop = current.unpark(sample.frame.turned(half_way)) * (ohm * 0.5e-3);
                let fault = Dq { d: 0.0, q: self.fault_v * 0.5e-3 }.unpark(sample.frame.turned(half_way));
                let acted = self.last.map(|last| (there - last + drop + fault) * self.link_scale);
                self.last = Some(there);
                let boundary = Boundary { volt_seconds: acted, length_s: 0.5e-3 };
                self.law.learn(&boundary, &sample, Regulated::Mean, &constants);
                let plain = AimInput::plain(&demand, 1_500.0, &LIMITS);
                self.law.aim(&AimInput { link_scale: self.link_scale, ..plain }, &constants);
                self.link_scale = self.law.link_scale();
            } else {
                if self.warmth != Warmth::NONE {
                    self.law.warm(self.warmth);
                }
                self.law.explain(self.dead, &constants);
            }
        }
    }

    /// The machine's torque, in N·m.
    fn torque_nm(&self) -> f32 {
        let current = self.law.target().current;
        torque_nm(self.tables, self.off.flux(flux_linkage(self.tables, current)), current)
    }

    /// Error of the reported torque, as a share of the largest.
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

/// Three unknowns from two components: observations at other torques tell them apart.
#[test]
fn torque_is_known_whatever_is_off() {
    for (omega, torque_nm) in [(84.0, 900.0), (170.0, 900.0), (-170.0, -600.0), (500.0, 400.0)] {
        for off in [
            AS_RATED,
            Off { share: 0.1, ..AS_RATED },
            Off { share: -0.15, ..AS_RATED },
            Off { wb: -0.08, ..AS_RATED },
            Off { wb: 0.05, ..AS_RATED },
            Off { ohm: 0.05, ..AS_RATED },
            Off { wb: -0.045, ohm: 0.05, ..AS_RATED },
            Off { share: -0.1, ohm: 0.05, ..AS_RATED },
        ] {
            let run = driven(off, omega, torque_nm);
            let told = run.told_off();
            println!("{off:?} at {omega} rad/s: told {told:.4} off, {:.1} N·m", run.torque_nm());
            assert!(told.abs() < 0.012, "{told} of the largest torque at {omega} rad/s, {off:?}");
        }
    }
}

/// An error of the iron across the magnets is none of the three, but at each operating point two of them reproduce it.
#[test]
fn iron_that_is_off_is_known_as_far_as_two_others_make_it() {
    for across in [0.1, -0.1] {
        for (omega, torque_nm, most) in [(170.0, 400.0, 0.01), (500.0, 400.0, 0.01), (500.0, 900.0, 0.02)] {
            let told = driven(Off { across, ..AS_RATED }, omega, torque_nm).told_off();
            println!("{across} at {omega} rad/s, {torque_nm} N·m: told {told:.4} off");
            assert!(told.abs() < most, "{told} of the largest torque");
        }
    }
}

#[test]
fn torque_is_corrected_from_a_fifth_of_rated_speed_on() {
    for (omega, torque_nm) in
        [(170.0, 400.0), (170.0, 900.0), (-170.0, 900.0), (500.0, 400.0), (500.0, -900.0)]
    {
        for off in [
            Off { wb: -0.08, ..AS_RATED },
            Off { wb: 0.05, ..AS_RATED },
            Off { share: 0.1, ..AS_RATED },
            Off { share: -0.15, ..AS_RATED },
        ] {
            let run = driven(off, omega, torque_nm);
            let missing = run.torque_nm() / torque_nm - 1.0;
            println!("{off:?} at {omega} rad/s, {torque_nm} N·m: {missing:.4}");
            assert!(missing.abs() < 0.015, "{missing} with {off:?} at {omega} rad/s, {torque_nm} N·m");
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
    for off in [AS_RATED, Off { share: 0.002, wb: 0.004, ohm: 0.01, ..AS_RATED }] {
        let [as_rated, run] = [AS_RATED, off].map(|off| driven(off, 300.0, 900.0));
        assert_eq!(run.law.link_scale(), 1.0);
        assert_eq!(run.law.target().current, as_rated.law.target().current, "{off:?}");
        assert_eq!(run.law.map_error().abs() > 1e-6, off.share != 0.0, "{}", run.law.map_error());
    }
}

/// The loop's volt-seconds and the torque: an error that a link sensor may have is wholly ascribed to it, and nothing of an error twice as large.
#[test]
fn what_a_link_sensor_may_be_off_is_its_own_and_far_beyond_the_maps() {
    for (share, links, torque) in
        [(0.02, 0.02, 0.0), (-0.03, -0.03, 0.0), (0.045, 0.015, 0.03), (0.1, 0.0, 0.1), (-0.1, 0.0, -0.1)]
    {
        let run = driven(Off { share, ..AS_RATED }, 500.0, 900.0);
        let scale = run.law.link_scale() * (1.0 + links);
        assert!((scale - 1.0).abs() < 3e-3, "{share}: link {}", run.law.link_scale());
        let made = run.torque_nm() / 900.0 / (1.0 + share);
        assert!((made * (1.0 + torque) - 1.0).abs() < 6e-3, "{made} for {share}");
        // The reported torque agrees.
        let told = run.law.flowing_nm() / run.torque_nm() * (1.0 + share) / (1.0 + torque) - 1.0;
        assert!(told.abs() < 6e-3, "{told} for {share}");
    }
}

/// A voltage that the dead time may take says nothing about the magnets, and a turn that its edges may cause says nothing about the link.
#[test]
fn what_a_dead_time_may_look_like_is_left_alone() {
    let dead = DeadTime { voltage_v: 6.75, left_share: 0.2, time_s: 5e-6 };
    let learnt = |dead: DeadTime, off: Off, (omega, torque_nm): (f32, f32)| {
        let mut run = Run::new(off);
        run.dead = dead;
        run.drive(omega, torque_nm, 0.5);
        (run.law.map_error(), run.law.link_scale())
    };
    let none = DeadTime { voltage_v: 0.0, left_share: 0.2, time_s: 0.0 };
    // A quarter of it, at a speed where the magnets' EMF is twelve times all of it; and a sixth of their EMF with a slower rotor.
    for (wb, omega, tells) in [(-0.008, 180.0, false), (-0.08, 180.0, true), (-0.08, 40.0, false)] {
        let off = Off { wb, ..AS_RATED };
        assert_eq!(learnt(dead, off, (omega, 0.0)).0.abs() > 1e-4, tells, "{wb} Wb at {omega} rad/s");
        assert!(learnt(none, off, (omega, 0.0)).0.abs() > 1e-3);
    }
    let off = Off { share: 0.01, ..AS_RATED };
    let [with, without] = [dead, none].map(|dead| learnt(dead, off, (2_000.0, 100.0)).1);
    assert!(with == 1.0 && (without - 0.99).abs() < 1e-3, "{with}, {without}");
}

/// A winding that is as warm as reported is no error, from the start or while it drives.
#[test]
fn a_resistance_that_is_told_is_no_error() {
    let more = |run: &Run, ratio: f32| (ratio - 1.0) * run.tables.ratings.stator_resistance_ohm;
    for ratios in [[1.4, 1.4], [1.0, 1.4], [1.4, 0.9]] {
        let mut run = Run::new(AS_RATED);
        for (ratio, omega) in ratios.into_iter().zip([84.0, 42.0]) {
            run.warmth = Warmth::new(ratio);
            run.off.ohm = more(&run, run.warmth.resistance_ratio());
            run.drive(omega, 900.0, 2.0);
            let told = run.told_off();
            println!("{ratio} of the resistance: told {told:.5} off, map {:.5}", run.law.map_error());
            assert!(told.abs() < 2e-3 && run.law.map_error().abs() < 5e-3, "{ratio}: {told}");
            assert_eq!(run.law.link_scale(), 1.0);
        }
    }
}

/// Errors found with a fast rotor stay known where the dead time takes much of the EMF, with a current and without.
#[test]
fn what_is_known_stays_where_a_dead_time_hides_it() {
    for (wb, omega) in [(-0.08, 60.0), (-0.08, 30.0), (0.05, 60.0)] {
        let mut run = Run::new(Off { wb, ..AS_RATED });
        run.dead = DeadTime { voltage_v: 6.75, left_share: 0.2, time_s: 5e-6 };
        for torque_nm in [0.0, 300.0, 900.0] {
            run.drive(500.0, torque_nm, 0.3);
        }
        run.drive(omega, 0.0, 0.5);
        run.drive(omega, 100.0, 4.0);
        let slow = run.torque_nm() / 100.0 - 1.0;
        // Nor was it put into the resistance.
        run.drive(84.0, 100.0, 0.3);
        let off = run.torque_nm() / 100.0 - 1.0;
        println!("{wb} Wb, {omega} rad/s: {slow:.4}, then {off:.4}");
        assert!(slow.abs() < 0.005 && off.abs() < 0.005, "{slow}, {off} with {wb} Wb at {omega} rad/s");
    }
}

/// At standstill a constant current shows the resistance alone; it is known once the rotor turns, and the error in the EMF is the flux linkage's.
#[test]
fn a_standing_rotor_shows_the_resistance() {
    let off = Off { ohm: 0.05, wb: -0.045, ..AS_RATED };
    let told = |standing_s: f32| {
        let mut run = Run::new(off);
        run.drive(0.0, 900.0, standing_s);
        let shown = run.law.map_error();
        run.drive(84.0, 900.0, 0.1);
        (shown, run.told_off().abs())
    };
    let [(shown, stood), (_, not)] = [1.0, 0.0].map(told);
    assert_eq!(shown, 0.0, "of the flux linkage a standing rotor shows nothing");
    assert!(stood < 0.5 * not, "{stood} of the largest torque, {not} without");
}

/// An unlikely mean, as an inverter or a link with a fault gives it, moves the known error no further than a likely one: 33 % of torque otherwise.
#[test]
fn a_voltage_that_is_hardly_likely_teaches_no_more_than_one_that_is() {
    let mut run = Run::new(AS_RATED);
    run.drive(84.0, 900.0, 0.01);
    run.fault_v = 150.0;
    run.drive(84.0, 900.0, 0.04);
    run.fault_v = 0.0;
    run.drive(84.0, 900.0, 0.5);
    let off = run.torque_nm() / 900.0 - 1.0;
    println!("{off:.4}");
    assert!(off.abs() < 0.16, "{off}");
}

#[test]
fn nothing_that_is_no_number_stays() {
    let mut run = driven(AS_RATED, 300.0, 900.0);
    let (seen, constants) =
        (run.law.map_error(), Law { gains: &Gains::DEFAULT, clock: &run.clock, tables: run.tables });
    let sample = RotorSample::new(
        run.law.target().current.unpark(Angle::ZERO.sin_cos()).abc(),
        Angle::ZERO,
        run.tables,
    );
    for volts in [f32::NAN, f32::INFINITY] {
        let volt_seconds = Some(AlphaBeta { alpha: volts, beta: volts });
        run.law.learn(&Boundary { volt_seconds, length_s: 0.03 }, &sample, Regulated::Mean, &constants);
        for _ in 0..4 {
            run.law.explain(run.dead, &constants);
        }
        assert_eq!(run.law.map_error(), seen);
    }
}
