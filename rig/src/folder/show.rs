//! `machine show`: a page about a machine, its inverter's limits, and the cost of each.

use crate::analysis::Figures;
use crate::files::write_text;
use crate::machine::Machine;
use crate::options::usual_min_pulse_us;
use crate::pictures::chai::machine as plane;
use crate::pictures::sheet::number;
use crate::report::Page;
use crate::run;
use anyhow::{Context, Result};
use clap::Args;
use core::f64::consts::{FRAC_2_PI, TAU};
use serde::Serialize;
use std::path::PathBuf;
use tractive::control::{OperatingPoint, VoltageLimit, operating_point};
use tractive::frames::Angle;
use tractive::modulation::{Mode, Reference, Schedule, SwitchLimits, index_limit};
use tractive::time::{Clock, Instant};
use tractive_tablegen::{Optimum, SmoothMap};

/// Points of a curve.
type Curve = Vec<(f64, f64)>;
/// Curves, each with its name.
type Series = Vec<(String, Curve)>;

/// A machine to show.
#[derive(Clone, Debug, Args)]
pub struct Show {
    /// A folder of tables/, or the path of any machine folder.
    #[arg(value_name = "DIR")]
    pub machine: String,
    /// The page to write; default target/tractive/machine-NAME.html.
    #[arg(long, value_name = "FILE.html")]
    pub out: Option<PathBuf>,
    /// Print the page's figures as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Points of a curve over speed.
const SPEEDS: u32 = 240;
/// Rows of the table of limits.
const ROWS: u32 = 12;

/// A speed, and the largest torque there: motoring, at the nominal link.
#[derive(Clone, Debug, Serialize)]
struct Limits {
    speed_rpm: f64,
    /// The drive's mode at the largest torque.
    mode: &'static str,
    /// The largest torque within current and voltage, in N·m, and its power, in kW.
    most_torque_nm: f64,
    most_power_kw: f64,
    /// The torque missing from the machine's largest, lost to the voltage, then to `max_power_w`, in percent of the largest.
    lost_to_voltage_percent: f64,
    lost_to_max_power_percent: f64,
    /// Torque that the mode loses against square wave through its smaller fundamental, in percent of the largest.
    lost_to_mode_percent: f64,
    current_a: f64,
    /// The highest current of a phase with the ripple of the mode's pulses, in A; `None` if the mode has none.
    peak_current_a: Option<f64>,
    voltage_v: f64,
}

/// The use of a mode at the largest torque: the speed up to which it is used, and the reason for its end.
#[derive(Clone, Debug, Serialize)]
struct ModeLimits {
    mode: &'static str,
    from_rpm: f64,
    to_rpm: f64,
    to_frequency_hz: f64,
    /// Turn-ons of a device per second at that speed.
    turn_ons_per_s: f64,
    /// The speed at which its turn-ons reach `max_switching_hz`: no mode with these pulses goes beyond; `None` for a free carrier.
    switching_allows_rpm: Option<f64>,
    /// Its largest fundamental at that speed, in percent of square wave's.
    largest_voltage_percent: f64,
}

/// A machine with data that is used again and again.
pub struct View<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Its map.
    pub map: SmoothMap,
    /// Its inverter's devices.
    pub devices: SwitchLimits,
    clock: Clock,
}

impl Show {
    /// Writes the page.
    pub fn write(&self) -> Result<()> {
        let machine = Machine::load(&self.machine)?;
        let name = &machine.folder.parameters.name;
        let file = self.out.clone().unwrap_or_else(|| usual_page("machine", name));
        if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).with_context(|| format!("--out {}", file.display()))?;
        }
        write_text(&file, &page(&machine)?)?;
        if self.json {
            let figures = View::of(&machine).figures();
            let told = serde_json::json!({ "page": file, "machine": name, "figures": figures.values() });
            crate::say!("{told}");
        } else {
            crate::say!("{}", file.display());
        }
        Ok(())
    }
}

/// The usual place of a page about a machine, whatever its name contains.
pub fn usual_page(what: &str, name: &str) -> PathBuf {
    let plain = |letter: char| if letter.is_alphanumeric() { letter } else { '-' };
    format!("target/tractive/{what}-{}.html", name.chars().map(plain).collect::<String>()).into()
}

/// The page of a machine.
///
/// # Errors
/// If a plot cannot be drawn.
pub fn page(machine: &Machine) -> Result<String> {
    let view = View::of(machine);
    let mut page = Page::new(&machine.folder.parameters.name, "no figure: machine and limits");
    view.over_speed(&mut page);
    page.picture(None, "current loci", plane::loci(machine));
    view.flux(&mut page);
    page.picture(None, "Ld over id, for several iq", plane::inductance(machine, true));
    page.picture(None, "Lq over iq, for several id", plane::inductance(machine, false));
    let subtitle = format!("tractive {}, from the tables that the drive runs on", env!("CARGO_PKG_VERSION"));
    page.finish(&subtitle, &view.figures())
}

impl<'a> View<'a> {
    /// View of a machine.
    pub fn of(machine: &'a Machine) -> Self {
        let max_switching_hz = machine.tables.ratings.max_switching_hz;
        let clock = run::clock(Clock::control_hz(max_switching_hz));
        let min_pulse_s = 1e-6 * usual_min_pulse_us(max_switching_hz.into());
        let min_pulse_ticks = (min_pulse_s * f64::from(clock.ticks_per_s)).round() as u32;
        let devices = SwitchLimits::new(min_pulse_ticks, 0, max_switching_hz, &clock);
        Self { machine, map: SmoothMap::new(&machine.folder.map), devices, clock }
    }

    fn omega(&self, speed_rpm: f64) -> f64 {
        speed_rpm * TAU / 60.0 * f64::from(self.machine.folder.parameters.pole_pairs)
    }

    /// The operating point for a torque at a speed, with a link in V of which a mode uses this share.
    pub fn point(&self, torque_nm: f64, speed_rpm: f64, udc_v: f64, modulation_index: f32) -> OperatingPoint {
        let limit = VoltageLimit { udc_v: udc_v as f32, modulation_index, filled: false };
        operating_point(torque_nm as f32, self.omega(speed_rpm) as f32, &limit, self.machine.tables)
    }

    /// Voltage of a point, peak phase, in V.
    fn voltage_v(&self, point: &OperatingPoint, speed_rpm: f64) -> f64 {
        let (id, iq) = (f64::from(point.current.d), f64::from(point.current.q));
        let (at, omega) = (self.map.at(id, iq), self.omega(speed_rpm));
        let resistance = self.machine.folder.parameters.stator_resistance_ohm;
        (resistance * id - omega * at.psi_q_wb).hypot(resistance * iq + omega * at.psi_d_wb)
    }

    fn speeds(&self, count: u32) -> impl Iterator<Item = f64> {
        let most = self.machine.folder.parameters.max_speed_rpm;
        (1..=count).map(move |k| most * f64::from(k) / f64::from(count))
    }

    /// Curves over speed: torque, power, current, voltage, modes.
    fn over_speed(&self, page: &mut Page) {
        let parameters = &self.machine.folder.parameters;
        let most_nm = parameters.max_torque_nm;
        let links = [parameters.dc_link_min_v, parameters.dc_link_nominal_v, parameters.dc_link_max_v];
        let omega = |rpm: f64| rpm * TAU / 60.0;
        let over = |value: &dyn Fn(f64) -> f64| -> Curve {
            self.speeds(SPEEDS).map(|rpm| (rpm, value(rpm))).collect()
        };
        let torque_nm = |rpm: f64, udc_v: f64| f64::from(self.point(most_nm, rpm, udc_v, 1.0).torque_nm);
        let series = |power: bool| -> Series {
            let scaled = |rpm: f64, nm: f64| if power { 1e-3 * nm * omega(rpm) } else { nm };
            let of_link =
                |udc_v: &f64| (format!("{udc_v} V"), over(&|rpm| scaled(rpm, torque_nm(rpm, *udc_v))));
            let limit = over(&|rpm| scaled(rpm, self.machine.envelope_nm(rpm)));
            links.iter().map(of_link).chain([("max_torque_nm and max_power_w".to_owned(), limit)]).collect()
        };
        let speed = "speed in r/min";
        page.draw_xy(
            None,
            "most torque within current and voltage, over speed",
            (speed, "N·m"),
            &series(false),
        );
        page.draw_xy(None, "most power within current and voltage, over speed", (speed, "kW"), &series(true));
        let nominal_v = parameters.dc_link_nominal_v;
        let point = |rpm: f64| self.point(self.machine.envelope_nm(rpm), rpm, nominal_v, 1.0);
        let current = over(&|rpm| f64::from(point(rpm).current.d).hypot(point(rpm).current.q.into()));
        let limit = over(&|_| parameters.max_current_a);
        let currents =
            [("at full torque and power".to_owned(), current), ("max_current_a".to_owned(), limit)];
        page.draw_xy(None, "current over speed, nominal link", (speed, "A, peak"), &currents);
        let voltage = over(&|rpm| self.voltage_v(&point(rpm), rpm));
        let carrier = over(&|_| nominal_v / 3.0_f64.sqrt());
        let square = over(&|_| FRAC_2_PI * nominal_v);
        let emf = over(&|rpm| self.omega(rpm) * f64::from(self.machine.tables.ratings.magnet_flux_wb));
        let voltages = [
            ("at full torque and power".to_owned(), voltage),
            ("most of a carrier".to_owned(), carrier),
            ("square wave".to_owned(), square),
            ("without current".to_owned(), emf),
        ];
        page.draw_xy(None, "voltage over speed, nominal link", (speed, "V, peak phase"), &voltages);
        let turn_ons = |rpm: f64, mode: Mode| self.turn_ons_s(rpm, mode);
        let used = self.modes(nominal_v);
        let strategy: Series = used
            .iter()
            .filter_map(|(mode, from, to)| {
                let own = self.speeds(SPEEDS).filter(|rpm| (*from..=*to).contains(rpm));
                let points: Curve = own.map(|rpm| (rpm, turn_ons(rpm, *mode))).collect();
                (points.len() > 1).then(|| (mode.name().to_owned(), points))
            })
            .collect();
        page.draw_xy(
            None,
            "turn-ons of a device per second, by mode, at full torque and power",
            (speed, "1/s"),
            &strategy,
        );
    }

    /// Flux linkages over their own current, for several values of the other one.
    fn flux(&self, page: &mut Page) {
        let largest = self.machine.folder.parameters.max_current_a;
        let last_d = self.machine.folder.map.id_a.last().map_or(0.0, |last| last.min(largest));
        let along = |from: f64, to: f64| (0..=80).map(move |k| from + (to - from) * f64::from(k) / 80.0);
        let shares = [0.0, 0.33, 0.67, 1.0];
        let psi_d: Series = shares
            .iter()
            .map(|share| {
                let points =
                    along(-largest, last_d).map(|id| (id, self.map.at(id, share * largest).psi_d_wb));
                (format!("iq = {} A", number((share * largest).round())), points.collect())
            })
            .collect();
        let psi_q: Series = shares
            .iter()
            .map(|share| {
                let points = along(0.0, largest).map(|iq| (iq, self.map.at(-share * largest, iq).psi_q_wb));
                (format!("id = {} A", number((-share * largest).round())), points.collect())
            })
            .collect();
        page.draw_xy(None, "flux linkage along d over id", ("id in A", "Wb"), &psi_d);
        page.draw_xy(None, "flux linkage along q over iq", ("iq in A", "Wb"), &psi_q);
    }

    fn turn_ons_s(&self, speed_rpm: f64, mode: Mode) -> f64 {
        match mode.turn_ons() {
            0 => self.machine.folder.parameters.max_switching_hz,
            locked => f64::from(locked) * self.omega(speed_rpm) / TAU,
        }
    }

    /// Rate of the stator's angle at a mechanical speed, in turns of 2³² a tick.
    pub fn rate(&self, speed_rpm: f64) -> f32 {
        (self.omega(speed_rpm) / TAU / f64::from(self.clock.ticks_per_s) * 4_294_967_296.0) as f32
    }

    /// The modes that the drive's own schedule wants with a link in V with rising speed at full torque and power, each with its first and last speed.
    pub fn modes(&self, udc_v: f64) -> Vec<(Mode, f64, f64)> {
        let mut schedule = Schedule::new(&self.clock);
        let mut used: Vec<(Mode, f64, f64)> = Vec::new();
        let mut mode = Mode::Async;
        for rpm in self.speeds(20 * SPEEDS) {
            let point = self.point(self.machine.envelope_nm(rpm), rpm, udc_v, 1.0);
            let voltage_v = self.voltage_v(&point, rpm) as f32;
            let seen = Reference::turning(voltage_v, Angle::ZERO, self.rate(rpm), Instant(0), udc_v as f32);
            mode = schedule.wanted(Instant(0), mode, &seen, &self.devices);
            match used.last_mut() {
                Some((last, _, to)) if *last == mode => *to = rpm,
                _ => used.push((mode, rpm, rpm)),
            }
        }
        used
    }

    fn figures(&self) -> Figures {
        let parameters = &self.machine.folder.parameters;
        let optimum = Optimum::of(&self.map, parameters.pole_pairs, parameters.max_current_a);
        let less = Optimum::of(&self.map, parameters.pole_pairs, 0.9 * parameters.max_current_a);
        let (id, iq) = optimum.least_current(parameters.max_torque_nm);
        let mut figures = Figures::default();
        let ratings = [
            ("max_torque_nm", parameters.max_torque_nm),
            ("max_power_kw", 1e-3 * parameters.max_power_w),
            ("max_current_a", parameters.max_current_a),
            ("trip_current_a", parameters.trip_current_a),
            ("max_speed_rpm", parameters.max_speed_rpm),
            ("max_switching_hz", parameters.max_switching_hz),
            ("dc_link_nominal_v", parameters.dc_link_nominal_v),
            ("current_of_largest_torque_a", id.hypot(iq)),
            ("most_torque_of_largest_current_nm", optimum.most_torque_nm()),
            ("most_torque_of_10_percent_less_current_nm", less.most_torque_nm()),
            ("largest_torque_up_to_rpm", self.corner_rpm(parameters.dc_link_nominal_v)),
            ("the_same_of_10_percent_less_link_rpm", self.corner_rpm(0.9 * parameters.dc_link_nominal_v)),
        ];
        ratings.iter().for_each(|(name, value)| figures.set(name, value));
        let rest_wb = f64::from(self.machine.tables.ratings.magnet_flux_wb);
        let emf_v = 3.0_f64.sqrt() * self.omega(parameters.max_speed_rpm) * rest_wb;
        figures.set("voltage_without_current_at_max_speed_between_lines_v", emf_v);
        figures.set("modes", self.mode_limits());
        figures.set("limits", self.limits());
        figures
    }

    /// The highest speed at which a link in V gives the largest torque, in r/min.
    fn corner_rpm(&self, udc_v: f64) -> f64 {
        let most_nm = self.machine.folder.parameters.max_torque_nm;
        let gives = |rpm: &f64| f64::from(self.point(most_nm, *rpm, udc_v, 1.0).torque_nm) > 0.999 * most_nm;
        self.speeds(20 * SPEEDS).take_while(gives).last().unwrap_or(0.0)
    }

    fn mode_limits(&self) -> Vec<ModeLimits> {
        let parameters = &self.machine.folder.parameters;
        let of = |(mode, from_rpm, to_rpm): (Mode, f64, f64)| ModeLimits {
            mode: mode.name(),
            from_rpm,
            to_rpm,
            to_frequency_hz: self.omega(to_rpm) / TAU,
            turn_ons_per_s: self.turn_ons_s(to_rpm, mode),
            switching_allows_rpm: (mode.turn_ons() > 0).then(|| {
                let hz = parameters.max_switching_hz / f64::from(mode.turn_ons());
                60.0 * hz / f64::from(parameters.pole_pairs)
            }),
            largest_voltage_percent: 100.0 * f64::from(index_limit(mode, self.rate(to_rpm), &self.devices)),
        };
        self.modes(parameters.dc_link_nominal_v).into_iter().map(of).collect()
    }

    fn limits(&self) -> Vec<Limits> {
        let parameters = &self.machine.folder.parameters;
        let (most_nm, udc_v) = (parameters.max_torque_nm, parameters.dc_link_nominal_v);
        let used = self.modes(udc_v);
        let of = |rpm: f64| {
            let mode = used.iter().find(|(_, from, to)| (*from..=*to).contains(&rpm));
            let mode = mode.map_or(Mode::Async, |(mode, ..)| *mode);
            let point = self.point(most_nm, rpm, udc_v, 1.0);
            let torque_nm = f64::from(point.torque_nm);
            let modulation_index = index_limit(mode, self.rate(rpm), &self.devices);
            let in_mode_nm = f64::from(self.point(most_nm, rpm, udc_v, modulation_index).torque_nm);
            let envelope_nm = self.machine.envelope_nm(rpm);
            // To a thousandth: smaller values come from the tables' own rounding.
            let percent = |nm: f64| (1e5 * nm.max(0.0) / most_nm).round() / 1e3;
            Limits {
                speed_rpm: rpm,
                mode: mode.name(),
                most_torque_nm: torque_nm,
                most_power_kw: 1e-3 * torque_nm * rpm * TAU / 60.0,
                lost_to_voltage_percent: percent(most_nm - torque_nm),
                lost_to_max_power_percent: percent(torque_nm - envelope_nm),
                lost_to_mode_percent: percent(torque_nm.min(envelope_nm) - in_mode_nm),
                current_a: f64::from(point.current.d).hypot(point.current.q.into()),
                peak_current_a: self.peak_a(mode, rpm, udc_v),
                voltage_v: self.voltage_v(&point, rpm),
            }
        };
        self.speeds(ROWS).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_stays_in_its_folder_whatever_the_machine_is_called() {
        assert_eq!(
            usual_page("identify", "my hub/../1"),
            PathBuf::from("target/tractive/identify-my-hub----1.html")
        );
    }
}
