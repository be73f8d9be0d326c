//! The outcome of an experiment, and its errors against the truth.

use super::corrected::{offset_a, turned_by, without_offset};
use super::experiment;
use super::fit::{Fit, Turning};
use super::response::noise_a;
use super::signs::Signs;
use super::turn::{Rotor, turned_deg};
use crate::analysis::Figures;
use crate::machine::Machine;
use crate::pictures::sheet::number;
use crate::report::Page;
use crate::scenario::traction::Options;
use anyhow::Result;
use tractive::identification::{Observation, Stage};
use tractive_tablegen::{Optimum, SmoothMap};

/// The true machine, which a simulation knows.
pub struct Truth {
    map: SmoothMap,
    flux_scale: f64,
    /// Flux linkage of the magnets beyond the map's, in Wb.
    more_wb: f64,
    resistance_ohm: f64,
    inertia_kg_m2: f64,
    pole_pairs: f64,
    last_d_a: f64,
}

impl Truth {
    /// Made from the options.
    ///
    /// # Errors
    /// If a folder cannot be read.
    pub fn of(options: &Options, machine: &Machine, inertia_kg_m2: f64) -> Result<Self> {
        let truth = options.own.plant.as_deref().map_or_else(|| Ok(machine.clone()), Machine::load)?;
        let (parameters, plant) = (&truth.folder.parameters, options.plant());
        // Averages over the conducting device: each half of the time.
        let drops = options.own.flaws.drops();
        let slope_ohm = 0.5 * (drops.igbt_ohm + drops.diode_ohm);
        let map = SmoothMap::new(&truth.folder.map);
        let more_wb = options.own.flaws.magnets / 100.0 * map.at(0.0, 0.0).psi_d_wb;
        Ok(Self {
            map,
            flux_scale: plant.flux_scale,
            more_wb,
            resistance_ohm: parameters.stator_resistance_ohm * plant.resistance_scale + slope_ohm,
            inertia_kg_m2,
            pole_pairs: parameters.pole_pairs.into(),
            last_d_a: truth.folder.map.id_a.last().copied().unwrap_or(0.0),
        })
    }

    /// Flux linkages along d and q at a current in A, in Wb.
    pub fn flux(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        let at = self.map.at(id_a, iq_a);
        (self.flux_scale * (at.psi_d_wb + self.more_wb), self.flux_scale * at.psi_q_wb)
    }

    /// Torque at a current in A, in N·m.
    pub fn torque_nm(&self, id_a: f64, iq_a: f64) -> f64 {
        let (psi_d, psi_q) = self.flux(id_a, iq_a);
        1.5 * self.pole_pairs * (psi_d * iq_a - psi_q * id_a)
    }
}

/// The outcome of an experiment.
pub struct Outcome {
    /// The fit.
    pub fit: Fit,
    /// Inertia and friction.
    pub rotor: Rotor,
    /// The largest reading of a phase's sensor at zero current, without the part common to all phases, in A.
    pub offset_a: f64,
    /// The noise of a phase's reading at rest, root mean square, in A.
    pub noise_a: f64,
    /// The inverter's voltage error of a leg at the mean link voltage, dead time and threshold together, in V, and its standard error.
    pub lacking_v: (f64, f64),
    /// The largest deviation of the turning rotor's flux linkage from that of the pulses' map, over the map's largest flux linkage; and likewise of the
    /// torque, over the machine's largest.
    pub turning_flux_off: f64,
    /// The latter.
    pub turning_torque_off: f64,
    /// Length of the pulses before the rotor turns, in s.
    pub pulses_s: f64,
    /// The largest current over the bound.
    pub peak_share: f64,
    /// The largest current, in A.
    pub peak_a: f64,
    /// The largest mechanical turn from the beginning until the rotor is to turn, in degrees.
    pub turned_deg: f64,
    /// Root-mean-square error of the flux linkage, as a share of the largest within the circle that is judged.
    pub flux_rms: f64,
    /// The worst error, likewise.
    pub flux_worst: f64,
    /// Error of the magnets' flux linkage, as a share; not a number without magnets.
    pub magnet_error: f64,
    /// Error of the resistance, as a share.
    pub resistance_error: f64,
    /// Worst error of the torque along the map's own MTPA, as a share of the largest torque.
    pub torque_worst: f64,
    inertia_error: f64,
    /// Signs and zeros, as the observations tell them.
    pub signs: Signs,
}

/// Largest standard error of a threshold that is worth telling the drive, as a share of it. From seed to seed a threshold scatters by four to five times
/// its standard error: of sixty without any one passes, of sixty with 1.75 V fifty.
const THRESHOLD_DOUBT: f64 = 1.0 / 15.0;

/// Radius of the circle in which flux linkages are judged, as a share of the bound: 200 A of 233 A.
const JUDGED: f64 = 0.857;

impl Outcome {
    /// Made from observations, with the largest current, in A; errors are given if the truth is known.
    ///
    /// # Errors
    /// If the observations do not determine the machine.
    pub fn of(
        observations: &[Observation],
        peak_a: f64,
        machine: &Machine,
        truth: Option<&Truth>,
    ) -> Result<Self> {
        let parameters = &machine.folder.parameters;
        let (bound_a, pole_pairs) = (parameters.max_current_a, f64::from(parameters.pole_pairs));
        let half_s = 0.5 / parameters.max_switching_hz;
        let offset = offset_a(observations);
        let read = without_offset(observations, offset);
        let fit = experiment::fit(&read, bound_a, half_s)?;
        let observations = &turned_by(&read, fit.zero_rad);
        let still = |observation: &&Observation| !matches!(observation.stage, Stage::Turn | Stage::Done);
        let pulses_s = observations.iter().filter(still).map(|o| f64::from(o.length_s)).sum();
        let udc_v = observations.iter().map(|o| f64::from(o.udc_v)).sum::<f64>() / observations.len() as f64;
        let most = |off: &dyn Fn(&Turning) -> f64, of: f64| {
            fit.turning.iter().map(|turning| off(turning) / of).fold(f64::NAN, f64::max)
        };
        let largest_wb = fit.flux(0.0, bound_a).0.hypot(fit.flux(0.0, bound_a).1);
        let rotor = Rotor::of(observations, &fit, pole_pairs);
        let of = |error: fn(&Fit, &Truth, &Machine) -> f64| {
            truth.map_or(f64::NAN, |truth| error(&fit, truth, machine))
        };
        Ok(Self {
            rotor,
            lacking_v: fit.lacking_v(udc_v, half_s),
            turning_flux_off: most(&|turning| turning.off_wb(), largest_wb),
            turning_torque_off: most(&|turning| turning.off_nm(pole_pairs), parameters.max_torque_nm),
            offset_a: largest_phase_a(offset),
            noise_a: noise_a(observations, bound_a),
            pulses_s,
            peak_share: peak_a / bound_a,
            peak_a,
            turned_deg: turned_deg(observations, pole_pairs),
            flux_rms: of(|fit, truth, machine| flux_errors(fit, truth, machine).0),
            flux_worst: of(|fit, truth, machine| flux_errors(fit, truth, machine).1),
            magnet_error: of(magnet_error),
            resistance_error: of(|fit, truth, _| fit.resistance_ohm / truth.resistance_ohm - 1.0),
            torque_worst: of(torque_error),
            signs: Signs::of(observations, &fit, bound_a),
            inertia_error: truth.map_or(f64::NAN, |truth| rotor.inertia_kg_m2 / truth.inertia_kg_m2 - 1.0),
            fit,
        })
    }

    /// The devices' threshold as the number to add to the power stage's key; `None` if the pulses do not tell it from the dead time, or there is none.
    pub fn threshold_advice(&self) -> Option<String> {
        let ([.., error_v], found_v) = (self.fit.errors(), self.fit.threshold_v);
        (error_v < THRESHOLD_DOUBT * found_v)
            .then(|| format!("power stage, device_threshold_v: add about {found_v:.2}"))
    }

    /// Figures for the terminal and the page.
    pub fn figures(&self) -> Figures {
        let mut figures = Figures::default();
        let percent = |share: f64| 100.0 * share;
        let [resistance_ohm, dead_time_s, threshold_v] = self.fit.errors();
        let values = [
            ("stator_resistance_ohm", self.fit.resistance_ohm),
            ("stator_resistance_standard_error_ohm", resistance_ohm),
            ("inverter_error_v", self.lacking_v.0),
            ("inverter_error_standard_error_v", self.lacking_v.1),
            ("dead_time_us", 1e6 * self.fit.dead_time_s),
            ("dead_time_standard_error_us", 1e6 * dead_time_s),
            ("threshold_v", self.fit.threshold_v),
            ("threshold_standard_error_v", threshold_v),
            ("magnet_flux_wb", self.fit.flux(0.0, 0.0).0),
            ("rotor_inertia_kg_m2", self.rotor.inertia_kg_m2),
            ("friction_nm", self.rotor.friction_nm),
            ("current_offset_a", self.offset_a),
            ("current_noise_a", self.noise_a),
            ("angle_zero_deg", self.signs.zero_deg),
            ("residual_mwb", 1e3 * self.fit.left_wb()),
            ("turning_flux_off_percent", percent(self.turning_flux_off)),
            ("turning_torque_off_percent", percent(self.turning_torque_off)),
            ("seconds", self.pulses_s),
            ("peak_current_a", self.peak_a),
            ("peak_current_percent_of_bound", percent(self.peak_share)),
            ("rotor_turned_deg", self.turned_deg),
            ("flux_error_rms_percent", percent(self.flux_rms)),
            ("flux_error_worst_percent", percent(self.flux_worst)),
            ("torque_error_at_mtpa_percent", percent(self.torque_worst)),
            ("magnet_flux_error_percent", percent(self.magnet_error)),
            ("stator_resistance_error_percent", percent(self.resistance_error)),
            ("rotor_inertia_error_percent", percent(self.inertia_error)),
        ];
        // Without the truth no error is known, and without magnets there is no share of their flux.
        values
            .iter()
            .filter(|(_, value)| value.is_finite())
            .for_each(|(name, value)| figures.set(name, value));
        figures
    }

    /// Draws the map next to the truth, and the residual of each boundary.
    pub fn draw(&self, machine: &Machine, page: &mut Page) {
        let most = machine.folder.parameters.max_current_a;
        let along = |from: f64, to: f64| (0..=80).map(move |k| from + (to - from) * f64::from(k) / 80.0);
        let shares = [0.0, 0.4, 0.8];
        let of_d = shares.map(|share| {
            let curve = along(-most, 0.2 * most).map(|id| (id, self.fit.flux(id, share * most).0)).collect();
            (format!("iq = {} A", number(share * most)), curve)
        });
        page.draw_xy(None, "flux linkage along d over id", ("id in A", "Wb"), &of_d);
        let of_q = shares.map(|share| {
            let curve = along(0.0, most).map(|iq| (iq, self.fit.flux(-share * most, iq).1)).collect();
            (format!("id = {} A", number(-share * most)), curve)
        });
        page.draw_xy(None, "flux linkage along q over iq", ("iq in A", "Wb"), &of_q);
        self.draw_trust(most, page);
        let left = |axis: usize| -> Vec<(f64, f64)> {
            let own = self.fit.residuals.iter().enumerate();
            own.map(|(k, (_, pair))| (k as f64, 1e3 * pair[axis])).collect()
        };
        let series = [("along d".to_owned(), left(0)), ("along q".to_owned(), left(1))];
        page.draw_xy(None, "left unexplained at each boundary", ("boundary", "mWb"), &series);
    }
}

impl Outcome {
    /// Draws the reliability: standard errors of the map, and the turning rotor's flux linkages next to it.
    fn draw_trust(&self, most: f64, page: &mut Page) {
        let along = |from: f64, to: f64| (0..=80).map(move |k| from + (to - from) * f64::from(k) / 80.0);
        let errors = |at: &dyn Fn(f64) -> (f64, f64)| -> Vec<(f64, f64)> {
            let error = |share: f64| {
                let (id, iq) = at(share);
                let (d, q) = self.fit.flux_error(id, iq);
                (share * most, 1e3 * d.hypot(q))
            };
            along(0.0, 1.0).map(error).collect()
        };
        let series = [
            ("along −d".to_owned(), errors(&|share| (-share * most, 0.0))),
            ("along q".to_owned(), errors(&|share| (0.0, share * most))),
            (
                "between both".to_owned(),
                errors(&|share| (-share * most * 0.5_f64.sqrt(), share * most * 0.5_f64.sqrt())),
            ),
        ];
        page.draw_xy(None, "standard error of the flux linkage", ("|i| in A", "mWb"), &series);
        let points = |axis: fn(&Turning) -> (f64, f64)| self.fit.turning.iter().map(axis).collect::<Vec<_>>();
        let series = [
            (
                "along d".to_owned(),
                points(|turning| (turning.current.1, 1e3 * (turning.found.0 - turning.map.0))),
            ),
            (
                "along q".to_owned(),
                points(|turning| (turning.current.1, 1e3 * (turning.found.1 - turning.map.1))),
            ),
        ];
        page.draw_xy(None, "turning rotor's flux linkage off the pulses' map", ("iq in A", "mWb"), &series);
    }
}

/// The largest of three phases' parts of a current in the stationary frame, in A.
fn largest_phase_a([alpha, beta]: [f64; 2]) -> f64 {
    let half_beta = 0.75_f64.sqrt() * beta;
    [alpha, half_beta - 0.5 * alpha, -half_beta - 0.5 * alpha].map(f64::abs).into_iter().fold(0.0, f64::max)
}

/// Errors of the flux linkage within the circle and above the demagnetisation limit, as shares of the largest there: root mean square, worst.
fn flux_errors(fit: &Fit, truth: &Truth, machine: &Machine) -> (f64, f64) {
    let parameters = &machine.folder.parameters;
    let bound_a = parameters.max_current_a;
    let allowed = parameters.min_id_a..=truth.last_d_a.min(0.2 * bound_a);
    let (mut most, mut sum, mut worst, mut count) = (0.0_f64, 0.0, 0.0_f64, 0.0);
    for d in -50..=50 {
        for q in -50..=50 {
            let (id, iq) = (0.02 * f64::from(d) * bound_a, 0.02 * f64::from(q) * bound_a);
            if id.hypot(iq) > JUDGED * bound_a || !allowed.contains(&id) {
                continue;
            }
            let (found, is) = (fit.flux(id, iq), truth.flux(id, iq));
            let error = (found.0 - is.0).hypot(found.1 - is.1);
            most = most.max(is.0.hypot(is.1));
            worst = worst.max(error);
            sum += error * error;
            count += 1.0;
        }
    }
    ((sum / count).sqrt() / most, worst / most)
}

/// Error of the magnets' flux linkage, as a share; not a number if there is only the map's rounding.
fn magnet_error(fit: &Fit, truth: &Truth, machine: &Machine) -> f64 {
    let (magnets, most) =
        (truth.flux(0.0, 0.0).0, truth.flux(0.0, machine.folder.parameters.max_current_a).1);
    if magnets.abs() > 1e-9 * most { fit.flux(0.0, 0.0).0 / magnets - 1.0 } else { f64::NAN }
}

/// Worst error of the torque along the map's own MTPA, as a share of the largest torque.
fn torque_error(fit: &Fit, truth: &Truth, machine: &Machine) -> f64 {
    const POINTS: u32 = 20;
    let parameters = &machine.folder.parameters;
    let smooth = SmoothMap::new(&fit.map(parameters.max_current_a));
    let optimum = Optimum::of(&smooth, parameters.pole_pairs, parameters.max_current_a);
    let most_nm = parameters.max_torque_nm.min(optimum.most_torque_nm());
    let error = |k: u32| {
        let wanted_nm = most_nm * f64::from(k) / f64::from(POINTS);
        let (id, iq) = optimum.least_current(wanted_nm);
        (truth.torque_nm(id, iq) - wanted_nm).abs() / parameters.max_torque_nm
    };
    (1..=POINTS).map(error).fold(0.0, f64::max)
}
