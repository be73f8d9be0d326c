//! Plots that pages of the PMaSynRM drive share.

use super::scope::{Band, Over, Series, Style};
use super::{Curve, Page, Panel};
use crate::rows::centred_means;
use crate::trace::{Recording, Row};
use tractive::modulation::Mode;
use tractive::recorder::Record;

/// The three phase currents.
const PHASES: [Curve; 3] = [("ia", |row| row.ia_a), ("ib", |row| row.ib_a), ("ic", |row| row.ic_a)];

/// The heading of plots over a whole run.
const WHOLE: &str = "the whole run";

impl Page {
    /// Curves over the whole recording.
    pub fn plot(&mut self, title: &str, unit: &str, recording: &Recording, curves: &[Curve]) {
        let series = self.series(&recording.rows, curves);
        self.whole(recording, (title, unit), series);
    }

    /// States over the whole recording: a value is its name's place in the list.
    pub fn plot_states(&mut self, title: &str, names: &[&str], recording: &Recording, curve: Curve) {
        self.plot(title, "", recording, &[curve]);
        self.name_levels(names);
    }

    /// Curves over a part of the recording.
    pub fn plot_window(
        &mut self,
        (heading, title, unit): (&str, &str, &str),
        recording: &Recording,
        window: (f64, f64),
        curves: &[Curve],
    ) {
        let series = self.series(&recording.rows, curves);
        self.part(heading, recording, window, (title, unit), series);
    }

    /// Torque, its mean over a carrier, and the demand.
    pub fn torque(&mut self, recording: &Recording) {
        let series = self.torques(recording);
        self.whole(recording, ("torque", "N·m"), series);
    }

    /// The current of phase u.
    pub fn phase_current(&mut self, recording: &Recording) {
        self.plot("phase current u", "A", recording, &PHASES[..1]);
    }

    /// Currents in the rotor's frame, and what is wanted of them.
    pub fn rotor_currents(&mut self, recording: &Recording) {
        let curves: [Curve; 4] = [
            ("id", |row| row.id_a),
            ("iq", |row| row.iq_a),
            ("id*", |row| row.id_ref_a),
            ("iq*", |row| row.iq_ref_a),
        ];
        self.plot("currents in the rotor's frame", "A", recording, &curves);
    }

    /// The whole run: torque, phase current, line voltage and its fundamental, speed; with the modes.
    pub fn overview(&mut self, recording: &Recording) {
        self.torque(recording);
        self.phase_current(recording);
        let series = self.line_voltages(recording);
        self.whole(recording, ("line voltage u-v", "V"), series);
        self.plot("commanded fundamental, peak phase", "V", recording, &[("u", |row| row.u_v)]);
        self.plot("speed", "r/min", recording, &[("speed", |row| row.speed_rpm)]);
        self.plot("DC link", "V", recording, &[("udc", |row| row.udc_v)]);
    }

    /// A part of the run: line voltage from the gates' edges, phase currents, torque.
    pub fn zoom(&mut self, heading: &str, recording: &Recording, window: (f64, f64)) {
        let series = self.line_voltages(recording);
        self.part(heading, recording, window, ("line voltage u-v", "V"), series);
        let series = self.series(&recording.rows, &PHASES);
        self.part(heading, recording, window, ("phase currents", "A"), series);
        let series = self.torques(recording);
        self.part(heading, recording, window, ("torque", "N·m"), series);
    }

    /// Current out of the line; none without a line filter.
    pub fn line(&mut self, recording: &Recording) {
        if recording.rows.iter().any(|row| row.line_a.is_some()) {
            self.plot("DC link", "V", recording, &[("udc", |row| row.udc_v)]);
            let curves: [Curve; 1] = [("line current", |row| row.line_a.unwrap_or(0.0))];
            self.plot("current out of the line", "A", recording, &curves);
        }
    }

    /// The flight recorder's records of a fault; none without a fault.
    pub fn recorder(&mut self, recording: &Recording) {
        let panels: [Panel<Record>; 3] = [
            (
                "phase currents as sampled",
                "A",
                &[("ia", |of| of.currents_a.a), ("ib", |of| of.currents_a.b), ("ic", |of| of.currents_a.c)],
            ),
            ("current references", "A", &[("id", |of| of.id_a), ("iq", |of| of.iq_a)]),
            (
                "DC link as sampled and commanded voltage",
                "V",
                &[("udc", |of| of.udc_v), ("u", |of| of.voltage_v)],
            ),
        ];
        self.recorded(&recording.recorded, |record| record.state.fault, &panels);
    }

    /// The modes of a run as bands, with its changes of mode and its faults as marks.
    pub fn events(&mut self, recording: &Recording) {
        for switch in recording.switches.iter().filter(|switch| switch.t_s > 0.0) {
            self.mark(switch.t_s, &format!("{} → {}", switch.from.name(), switch.to.name()), false);
        }
        let mut before = None;
        for row in &recording.rows {
            if let Some(trip) = row.trip.filter(|_| row.trip != before) {
                self.mark(row.t_s, trip.fault.name(), true);
            }
            before = row.trip;
            match self.document.bands.last_mut() {
                Some(band) if band.name == row.mode.name() => band.to = row.t_s,
                last => {
                    last.into_iter().for_each(|band| band.to = row.t_s);
                    self.document.bands.push(Band { from: row.t_s, to: row.t_s, name: row.mode.name() });
                }
            }
        }
    }

    fn whole(&mut self, recording: &Recording, named: (&str, &str), series: Vec<Series>) {
        let over = Over::Rows(recording.rows.as_ptr() as usize, recording.rows.len());
        self.show(over, WHOLE, None, named, series);
    }

    fn part(
        &mut self,
        heading: &str,
        recording: &Recording,
        window: (f64, f64),
        named: (&str, &str),
        series: Vec<Series>,
    ) {
        let over = Over::Window(recording.rows.as_ptr() as usize, window.0, window.1);
        self.show(over, heading, Some(window), named, series);
    }

    fn torques(&mut self, recording: &Recording) -> Vec<Series> {
        let address = recording.rows.as_ptr() as usize;
        if let Some((_, series)) = self.torques.as_ref().filter(|(of, _)| *of == address) {
            return series.clone();
        }
        let torque = self.series(&recording.rows, &[("torque", |row| row.te_nm)]);
        let means = carrier_means(&recording.rows, self.carrier_hz);
        let mean = self.document.data.add(torque[0].place.0, &means);
        let demand = self.series(&recording.rows, &[("demand", |row| row.te_ref_nm)]);
        let series = [torque, vec![Series::new("carrier mean", mean, 1)], demand].concat();
        self.torques = Some((address, series.clone()));
        series
    }

    /// Line voltage between phases u and v from the gates' edges at their exact times: a level, to be multiplied by the link's voltage.
    fn line_voltages(&mut self, recording: &Recording) -> Vec<Series> {
        let address = recording.rows.as_ptr() as usize;
        if let Some((_, series)) = self.line_voltage.as_ref().filter(|(of, _)| *of == address) {
            return vec![series.clone()];
        }
        let (ticks, levels) = levels(recording);
        let link = self.series(&recording.rows, &[("udc", |row| row.udc_v)]);
        let place = self.document.data.edges(&ticks, recording.tick_s, &levels);
        let (style, scale) = (Style::Edges, link.first().map(|link| link.place));
        let series = Series { style, scale, ..Series::new("u-v", place, 0) };
        self.line_voltage = Some((address, series.clone()));
        vec![series]
    }
}

/// The ticks, from the recording's beginning, at which the line voltage u-v changes, each with its level from there on: −1, 0 or 1.
fn levels(recording: &Recording) -> (Vec<i64>, Vec<i64>) {
    let mut on = [false; crate::trace::GATES.len()];
    let (mut ticks, mut levels) = (vec![0], vec![0]);
    for edge in &recording.edges {
        on[usize::from(edge.gate)] = edge.on;
        let level = i64::from(on[0]) - i64::from(on[2]);
        let tick = edge.tick as i64 - recording.lead as i64;
        if levels.last() == Some(&level) {
            continue;
        }
        if tick <= ticks.last().copied().unwrap_or(0) {
            // Before the recording, or two edges at once: the last one counts.
            levels.pop();
            ticks.pop();
        }
        ticks.push(tick.max(0));
        levels.push(level);
    }
    (ticks, levels)
}

/// Torque averaged over a carrier around each row: for a locked carrier over its part of a turn, for a pattern over the sixth of a turn in
/// which its ripple repeats, otherwise over the free carrier's period.
fn carrier_means(rows: &[Row], carrier_hz: f64) -> Vec<f64> {
    let step_s = match rows {
        [first, second, ..] => second.t_s - first.t_s,
        _ => return rows.iter().map(|row| row.te_nm).collect(),
    };
    let torques: Vec<_> =
        rows.iter().map(|row| if row.te_nm.is_finite() { row.te_nm } else { 0.0 }).collect();
    centred_means(&torques, |k| 0.5 * carrier_s(rows[k].mode, rows[k].f1_hz.abs(), carrier_hz) / step_s)
}

/// The period over which a mode's ripple is averaged, in s, at a stator frequency in Hz.
fn carrier_s(mode: Mode, f1_hz: f64, carrier_hz: f64) -> f64 {
    let carriers = if mode.is_pattern() { 6 } else { mode.carriers() };
    if carriers == 0 || f1_hz < 1.0 { 1.0 / carrier_hz } else { 1.0 / (f64::from(carriers) * f1_hz) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_carrier_has_no_ripple_of_that_carrier() {
        let row = |k: u32| {
            let t_s = f64::from(k) * 5e-5;
            let ripple = 50.0 * (core::f64::consts::TAU * 900.0 * t_s).sin();
            Row { t_s, te_nm: 400.0 + ripple, mode: Mode::Async, ..Row::default() }
        };
        let rows: Vec<_> = (0..2000).map(row).collect();
        let means = carrier_means(&rows, 900.0);
        for mean in &means[50..1950] {
            assert!((mean - 400.0).abs() < 0.5, "{mean}");
        }
        assert_eq!(carrier_s(Mode::Square, 100.0, 900.0), 1.0 / 600.0);
        assert_eq!(carrier_s(Mode::Sync15, 50.0, 900.0), 1.0 / 750.0);
    }
}
