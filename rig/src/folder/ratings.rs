//! The ratings that follow from a flux map and the limits, and the `machine.toml` made of both.

use super::given::Given;
use super::ripple::{MOST_TRIP, ROOM, trip_current_a};
use super::write::{Contents, digits, toml};
use crate::machine::Machine;
use anyhow::{Result, ensure};
use core::f64::consts::TAU;
use std::fmt::Write as _;
use tractive::time::Clock;
use tractive_tablegen::{FluxMap, MachineFolder, Optimum, SmoothMap};

/// The resulting ratings.
#[derive(serde::Serialize)]
pub struct Ratings {
    max_torque_nm: f64,
    max_power_w: f64,
    /// Speed up to which the nominal link gives the largest torque, in r/min.
    corner_rpm: f64,
    rated_torque_nm: f64,
    rated_speed_rpm: f64,
    /// Flux linkage at zero current, in Wb.
    magnet_wb: f64,
    /// The current at which the drive trips, in A, if the ripple leaves no room with the usual one.
    trip_current_a: Option<f64>,
}

/// Rated torque, as a share of the largest, and rated speed over the corner of the largest: a machine's usual proportions.
const RATED_TORQUE: f64 = 0.7;
const RATED_SPEED: f64 = 1.05;
/// Share of the largest speed below which no machine's full torque ends: then its values are in other units.
const ODD_CORNER: f64 = 0.02;
/// Share of the largest speed below which a machine's values are probably in other units if it cannot hold more.
const ODD_SPEED: f64 = 0.1;
/// The question that accompanies such values.
const UNITS: &str = "are inductances in H, flux linkages in Wb (a column psi_d [mWb] has thousandths)?";
/// A rotor may take at most ten minutes of full torque to reach its largest speed.
const LONGEST_S: f64 = 600.0;

impl Ratings {
    /// Made from a map within the limits.
    ///
    /// # Errors
    /// The option that leaves the machine no torque, or no way to hold its largest speed.
    pub fn of(map: &FluxMap, given: &Given) -> Result<Self> {
        let smooth = SmoothMap::new(map);
        check_speed(&smooth, given)?;
        let optimum = Optimum::of(&smooth, given.pole_pairs, given.max_current);
        // Below the generator's own rounding.
        let max_torque_nm = rounded_down((1.0 - 1e-6) * optimum.most_torque_nm());
        ensure!(
            max_torque_nm > 1e-9,
            "--max-current {}: must give some torque with this flux map",
            given.max_current
        );
        let corner_rpm = corner_rpm(&smooth, optimum.least_current(max_torque_nm), given);
        let max_power_w = rounded_down(max_torque_nm * corner_rpm * TAU / 60.0);
        if let Some(inertia) = given.inertia {
            let most = LONGEST_S * max_torque_nm / (given.max_speed_rpm * TAU / 60.0);
            ensure!(
                inertia <= most,
                "--inertia {inertia}: must be at most {} kg·m²: {max_torque_nm} N·m takes ten minutes to --max-speed-rpm {} with it",
                rounded_down(most),
                given.max_speed_rpm
            );
        }
        Ok(Self {
            max_torque_nm,
            max_power_w,
            corner_rpm,
            rated_torque_nm: rounded_down(RATED_TORQUE * max_torque_nm),
            rated_speed_rpm: rounded_down((RATED_SPEED * corner_rpm).min(given.max_speed_rpm)),
            magnet_wb: smooth.at(0.0, 0.0).psi_d_wb,
            trip_current_a: None,
        })
    }

    /// The two files of a folder with this `flux_map.csv`; `command` is the command line that made it. The ripple of the machine's pulses is checked, and
    /// if it needs room, a separate trip level is chosen.
    ///
    /// # Errors
    /// A ripple for which no trip level leaves room.
    pub fn contents(&mut self, given: &Given, command: &str, map: String) -> Result<Contents> {
        // Whatever the generator or the drive refuses is reported when it is written.
        let folder = MachineFolder::parse(&self.toml(given, command), &map).ok();
        let machine = folder.map(Machine::of).filter(|machine| machine.tables.check().is_ok());
        self.trip_current_a = machine.and_then(|machine| trip_current_a(&machine)).map(rounded_down);
        let (hz, most_a) = (given.max_switching_hz, digits(MOST_TRIP * given.max_current));
        if let Some(trip_a) = self.trip_current_a {
            ensure!(
                trip_a <= most_a,
                "--max-switching-hz {hz}: with the ripple of these pulses the current is up to {:.0} A, and a trip with room above that, {trip_a} A, is more than 4 × --max-current, {most_a} A",
                trip_a / (1.0 + ROOM)
            );
        }
        Ok(Contents { toml: self.toml(given, command), map })
    }

    /// `machine.toml`.
    fn toml(&self, given: &Given, command: &str) -> String {
        let [least_v, nominal_v, most_v] = given.link_v().map(digits);
        let of_source = |key| given.zs9_source.map_or(key, |_| "derived: of zs9_source_v");
        let lines: [(&str, f64, &str); 16] = [
            ("pole_pairs", f64::from(given.pole_pairs), "given"),
            ("stator_resistance_ohm", given.rs, "given"),
            ("max_torque_nm", self.max_torque_nm, "derived: the most within max_current_a"),
            ("max_power_w", self.max_power_w, "derived: that torque as far as the nominal link gives it"),
            ("max_current_a", given.max_current, "given; peak"),
            ("max_speed_rpm", given.max_speed_rpm, "given"),
            ("rated_torque_nm", self.rated_torque_nm, "chosen: 0.7 of max_torque_nm"),
            ("rated_speed_rpm", self.rated_speed_rpm, self.rated_speed_from(given)),
            ("zs9_source_v", given.zs9_source.unwrap_or(f64::NAN), "given"),
            (
                "zs9_link_v",
                given.zs9_source.map_or(f64::NAN, |source_v| digits(5.0 / 3.0 * source_v)),
                "chosen: a shoot-through duty of 0.2",
            ),
            ("dc_link_min_v", least_v, of_source(of(given.udc_min, "chosen: 0.8 of the nominal one"))),
            ("dc_link_nominal_v", nominal_v, of_source("given")),
            ("dc_link_max_v", most_v, of_source(of(given.udc_max, "chosen: 1.2 of the nominal one"))),
            ("max_switching_hz", given.max_switching_hz, "given"),
            (
                "trip_current_a",
                self.trip_current_a.unwrap_or(f64::NAN),
                "chosen: 0.15 above the ripple's highest current at full torque",
            ),
            ("rotor_inertia_kg_m2", given.inertia.unwrap_or(f64::NAN), "given"),
        ];
        toml(&given.name(), &format!("machine {command}"), &lines)
    }

    /// The origin of the rated speed.
    fn rated_speed_from(&self, given: &Given) -> &'static str {
        if self.corner_rpm >= given.max_speed_rpm {
            "chosen: max_speed_rpm, up to which nothing is weakened"
        } else if RATED_SPEED * self.corner_rpm >= given.max_speed_rpm {
            "chosen: max_speed_rpm, a little above the speed where weakening begins"
        } else {
            "chosen: a little above the speed where weakening begins"
        }
    }

    /// Prints a description of the machine, and notes on its map: a few lines, or JSON if requested.
    pub fn say(&self, given: &Given, notes: &[String]) -> Result<()> {
        if given.json {
            let mut ratings = serde_json::to_value(self)?;
            ratings["folder"] = serde_json::json!(given.out);
            ratings["name"] = given.name().into();
            ratings["notes"] = notes.into();
            crate::say!("{ratings}");
        } else {
            crate::say!("{}", [&[self.told(given)], notes].concat().join("\n"));
        }
        Ok(())
    }

    /// The ratings in a few lines, and their consequences for the inverter.
    fn told(&self, given: &Given) -> String {
        let Self { max_torque_nm, max_power_w, corner_rpm, magnet_wb, .. } = self;
        let mut text = format!(
            "{}: {max_torque_nm} N·m up to {corner_rpm:.*} r/min, {max_power_w} W, {} r/min at most",
            given.out.display(),
            usize::from(*corner_rpm < 100.0),
            given.max_speed_rpm
        );
        if *corner_rpm < ODD_CORNER * given.max_speed_rpm {
            let _ = write!(
                text,
                "\nfull torque ends at {:.1} % of the largest speed: {UNITS}",
                100.0 * corner_rpm / given.max_speed_rpm
            );
        }
        let control_hz = Clock::control_hz(given.max_switching_hz as f32);
        if given.max_switching_hz > f64::from(control_hz) {
            let _ = write!(
                text,
                "\na carrier of {} Hz wants control as often, which is {control_hz} Hz unless it is told: run and identify with --control-hz {:.0}",
                given.max_switching_hz,
                given.max_switching_hz.ceil()
            );
        }
        // Line to line, peak: the voltage that the diodes rectify.
        let emf_v = 3.0_f64.sqrt() * given.omega(given.max_speed_rpm) * magnet_wb;
        let highest_v = digits(given.highest_v());
        let whose = given.zs9_source.map_or(("the link's", "it"), |_| ("the capacitors'", "them"));
        if emf_v > highest_v {
            let _ = write!(
                text,
                "\nwithout current the machine makes {emf_v:.1} V peak between lines at {} r/min, above {} {highest_v} V: gates off, the diodes charge {}",
                given.max_speed_rpm, whose.0, whose.1
            );
        }
        if let Some(trip_a) = self.trip_current_a {
            let _ = write!(
                text,
                "\nwith the ripple of {} Hz the current is up to {:.*} A at full torque: the drive trips at {trip_a} A, which the devices must bear",
                given.max_switching_hz,
                usize::from(trip_a < 100.0),
                trip_a / (1.0 + ROOM)
            );
        }
        text
    }
}

fn of(said: Option<f64>, otherwise: &'static str) -> &'static str {
    if said.is_some() { "given" } else { otherwise }
}

/// Four digits, not above the value.
pub fn rounded_down(value: f64) -> f64 {
    let unit = 10.0_f64.powi(value.abs().log10().floor() as i32 - 3);
    digits((value / unit + 1e-9).floor() * unit)
}

/// Voltage in steady state, peak phase, in V.
fn voltage_v(map: &SmoothMap, (id, iq): (f64, f64), omega: f64, rs: f64) -> f64 {
    let at = map.at(id, iq);
    (rs * id - omega * at.psi_q_wb).hypot(rs * iq + omega * at.psi_d_wb)
}

/// Speed up to which a current needs no more than the nominal link's voltage, in r/min, at most the largest.
fn corner_rpm(map: &SmoothMap, current: (f64, f64), given: &Given) -> f64 {
    let (mut low, mut high) = (0.0, given.max_speed_rpm);
    let fits = |rpm: f64| voltage_v(map, current, given.omega(rpm), given.rs) <= given.voltage_v();
    if fits(high) {
        return high;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

/// Current along d, in A, with the least flux linkage; for inductances that are a thousand times too large it lies between two steps of any scan.
fn weakened_a(map: &SmoothMap, max_current_a: f64) -> f64 {
    let (mut low, mut high) = (-max_current_a, 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if map.at(middle, 0.0).psi_d_wb < 0.0 { low = middle } else { high = middle }
    }
    high
}

/// Checks that some current at the largest speed needs no more voltage than the nominal link gives.
fn check_speed(map: &SmoothMap, given: &Given) -> Result<()> {
    const STEPS: i32 = 200;
    let weakened_a = weakened_a(map, given.max_current);
    let least_v = |rpm: f64| {
        let along_d = (0..=STEPS).map(|k| -given.max_current * f64::from(k) / f64::from(STEPS));
        along_d
            .chain([weakened_a])
            .map(|id| voltage_v(map, (id, 0.0), given.omega(rpm), given.rs))
            .fold(f64::INFINITY, f64::min)
    };
    if least_v(given.max_speed_rpm) <= given.voltage_v() {
        return Ok(());
    }
    let (mut low, mut high) = (0.0, given.max_speed_rpm);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if least_v(middle) <= given.voltage_v() { low = middle } else { high = middle }
    }
    let hint = if low < ODD_SPEED * given.max_speed_rpm { format!("; {UNITS}") } else { String::new() };
    anyhow::bail!(
        "--max-speed-rpm {}: must be at most {:.0}: above it no current within --max-current {} brings the machine's voltage down to what {} gives{hint}",
        given.max_speed_rpm,
        low.floor(),
        given.max_current,
        given.voltage_option()
    )
}
