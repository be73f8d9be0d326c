//! The steps of a commissioning.

use super::options::Commission;
use super::record::{Record, Step};
use crate::bench::Wiring;
use crate::can;
use crate::folder::write_folder;
use crate::identify::{
    CURRENT_NOISE, CURRENT_SENSORS, Ended, Identify, ROTOR_TURNED, Signs, contents, identified,
};
use crate::machine::Machine;
use crate::options::On;
use crate::scenario::System as _;
use crate::scenario::traction::{Options, Traction};
use crate::talk::{self, Lines, System, Talk};
use anyhow::{Result, bail};
use core::f64::consts::TAU;
use tractive::identification::PROBED_NOISE_SHARE;
use tractive::protection::Fault;

/// A step, and its demands on the person who does it.
pub struct Stage {
    /// Its name.
    pub name: &'static str,
    /// The state in which everything has to be.
    pub asks: &'static str,
    /// The step itself.
    pub run: fn(&Commission, &Machine, &Record) -> Result<Step>,
}

/// All of them, in their order.
pub const ALL: &[Stage] = &[
    Stage {
        name: "wiring",
        asks: "The image that identifies is on the board, the machine is connected, its rotor stands. Gates stay off; the link is charged \
               and discharged.",
        run: wiring,
    },
    Stage {
        name: "identification",
        asks: "The rotor is free: no load, nothing in its way. It swings by some degrees, then turns slowly. Stay away from it. The machine \
               folder is written.",
        run: identification,
    },
    Stage {
        name: "tables",
        asks: "The table generator reads the machine folder; on a board the drive's image is flashed with it now: \
               cargo xtask flash --machine FOLDER.",
        run: tables,
    },
    Stage {
        name: "first torque",
        asks: "The drive's image with these tables is on the board. A twentieth of the largest torque turns the free rotor for a moment, or less, where that would take it beyond half of its largest speed.",
        run: first_torque,
    },
];

/// The first torque as a share of the largest, and its times: up, held, in s.
const TORQUE_SHARE: f64 = 0.05;
const HELD_S: f64 = 0.3;
const RAMP_S: f64 = 0.1;
/// Largest offset of a current sensor that the drive takes off by itself, as a share of the largest current: its own bound, beyond which it has the fault
/// `current_offset`. What the experiment may find left of it; error of the angle's zero from which it is to be corrected, and the largest with which
/// the machine is identified, in degrees; deviation of the torque from what was asked for, as a share of the largest.
const OFFSET_SHARE: f64 = 0.05;
const LEFT_SHARE: f64 = 0.02;
const ZERO_DEG: f64 = 1.0;
const MOST_ZERO_DEG: f64 = 20.0;
const RESPONSE_DEG: f64 = 20.0;
const TORQUE_OFF_SHARE: f64 = 0.02;

/// Least error of the angle's zero that makes a free rotor turn away, in degrees.
const LEAST_ZERO_DEG: f64 = 2.0;
/// Name of the drive's fault for currents whose sum is not zero.
const PHASE_SUM: &str = Fault::PhaseSum.name();
/// Name of the drive's fault for a current sensor whose offset it does not take off.
const CURRENT_OFFSET: &str = Fault::CurrentOffset.name();
const ADVICE_OFFSET: &str = "current sensors: without current they read more than the drive takes off by itself: check their supply, their reference and \
    the range that the power stage's file states, and that the rotor stands";
const ADVICE_NOISE: &str = "current sensors: their readings at rest scatter too much to tell a machine by small pulses: screen their leads, and filter or \
    average what they read";
const ADVICE_SUM: &str = "current sensors: one or two have the wrong sign, so that what they read does not add up to zero: exchange the leads of \
    one after the other and begin anew";
const ADVICE_TURNED: &str = "a load turns the rotor; or it is light and swings under the pulses: couple it to what it drives; or its angle counts the wrong way: with the gates off turn the rotor forward, and where \
    speed_rpm is below 0 exchange the encoder's channels A and B or two phases; or its zero is far off: set the power stage's \
    encoder_zeros_deg anew";

/// A talk of these lines: on the bench with the machine that the drive knows, or with whoever is on the bus.
fn talk(commission: &Commission, options: &Options, machine: &Machine, script: &str) -> Result<Talk> {
    let identify = &commission.identify;
    let parameters = &machine.folder.parameters;
    let inertia = identify.inertia.unwrap_or(parameters.rotor_inertia_kg_m2);
    let lines = Lines::of_text(script, System::Pmasynrm)?;
    let mut talk = Talk::new(System::Pmasynrm, lines, inertia, &machine.tables.ratings);
    match &identify.can {
        Some(interface) => can::command(interface, &mut talk)?,
        None => {
            talk::with_traction(options, inertia, talk::LONGEST_S, machine, &mut talk)?;
        }
    }
    Ok(talk)
}

/// The values of a column in the rows with a named state.
fn told(talk: &Talk, state: &str, column: &str) -> Vec<f64> {
    let place = |name| System::Pmasynrm.column(name).unwrap_or_default();
    let (states, values) = (place("state"), place(column));
    talk.rows.iter().filter(|row| row[states] == state).filter_map(|row| row[values].parse().ok()).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NAN, f64::max)
}

fn fault(talk: &Talk, step: &mut Step) {
    let fault = talk.listener.value("fault");
    if !fault.is_empty() {
        step.fail(format!(
            "fault {fault}: {} (limit {})",
            talk.listener.value("fault_value"),
            talk.listener.value("fault_limit")
        ));
    }
}

fn wiring(commission: &Commission, machine: &Machine, _record: &Record) -> Result<Step> {
    let script =
        "wait 0.3\nexpect state ready\ncharge\nwait 4\nexpect state charged\ndischarge\nwait 6\nend\n";
    let talk = talk(commission, &commission.identify.options, machine, script)?;
    let parameters = &machine.folder.parameters;
    let mut step = Step::new("wiring");
    let link_v = largest(&told(&talk, "charged", "link_v"));
    step.within("link_charged_v", link_v, [parameters.dc_link_min_v, parameters.dc_link_max_v]);
    let read = ["ready", "charged"].map(|state| told(&talk, state, "current_a")).concat();
    at_rest(&read, parameters.max_current_a, &mut step);
    talk.failures.iter().for_each(|failure| step.fail(failure.clone()));
    fault(&talk, &mut step);
    Ok(step)
}

/// Judges readings of the largest phase current without current, in A: their mean as an offset, which the drive takes off, and their scatter as noise,
/// which nobody does.
fn at_rest(read_a: &[f64], max_current_a: f64, step: &mut Step) {
    let mean =
        |of: &dyn Fn(f64) -> f64| read_a.iter().map(|read| of(*read)).sum::<f64>() / read_a.len() as f64;
    let offset_a = mean(&|read| read);
    let noise_a = mean(&|read| (read - offset_a).powi(2)).sqrt();
    if !step.within("current_at_rest_a", offset_a, [0.0, OFFSET_SHARE * max_current_a]) {
        step.advise(ADVICE_OFFSET.to_owned());
    }
    let most_a = f64::from(PROBED_NOISE_SHARE) * max_current_a;
    if !step.within("current_noise_at_rest_a", noise_a, [0.0, most_a]) {
        step.advise(ADVICE_NOISE.to_owned());
    }
}

fn identification(commission: &Commission, machine: &Machine, _record: &Record) -> Result<Step> {
    let mut step = Step::new("identification");
    let identify = Identify { over_protocol: true, ..commission.identify.clone() };
    let outcome = match identified(&identify, machine)? {
        Ok(outcome) => outcome,
        Err(Ended { fault, value, limit, zero_deg, wiring }) => {
            match fault.as_str() {
                ROTOR_TURNED => step.advise(turned_away(zero_deg)),
                CURRENT_SENSORS => step.advise(sensors_wrong(wiring)),
                CURRENT_NOISE => step.advise(ADVICE_NOISE.to_owned()),
                CURRENT_OFFSET => step.advise(ADVICE_OFFSET.to_owned()),
                PHASE_SUM => step.advise(ADVICE_SUM.to_owned()),
                _ => {}
            }
            step.fail(format!("fault {fault}: {value} (limit {limit})"));
            return Ok(step);
        }
    };
    step.within("current_answers_voltage_deg", outcome.signs.response_deg, [-RESPONSE_DEG, RESPONSE_DEG]);
    step.within("angle_zero_deg", outcome.signs.zero_deg, [-MOST_ZERO_DEG, MOST_ZERO_DEG]);
    let offset_a = LEFT_SHARE * machine.folder.parameters.max_current_a;
    step.within("current_offset_a", outcome.offset_a, [0.0, offset_a]);
    advise(&outcome.signs, &mut step);
    outcome.threshold_advice().into_iter().for_each(|advice| step.advise(advice));
    step.within("turned_by_pulses_deg", outcome.turned_deg, [0.0, 5.0]);
    step.within("largest_current_of_the_bound", outcome.peak_share, [0.0, 1.1]);
    step.find("stator_resistance_ohm", outcome.fit.resistance_ohm);
    step.find("inverter_error_v", outcome.lacking_v.0);
    step.find("dead_time_us", 1e6 * outcome.fit.dead_time_s);
    step.find("threshold_v", outcome.fit.threshold_v);
    if outcome.turning_flux_off.is_finite() {
        step.find("turning_flux_off_percent", 100.0 * outcome.turning_flux_off);
    }
    step.find("magnet_flux_wb", outcome.fit.flux(0.0, 0.0).0);
    step.find("rotor_inertia_kg_m2", outcome.rotor.inertia_kg_m2);
    step.find("friction_nm", outcome.rotor.friction_nm);
    if let (true, Some(out)) = (step.passed, &commission.identify.options.out) {
        write_folder(out, &contents(&outcome, machine))?;
    }
    Ok(step)
}

/// Advice on the angle's zero: the key with the number to add.
fn advise(signs: &Signs, step: &mut Step) {
    if signs.zero_deg.abs() > MOST_ZERO_DEG {
        step.advise(format!("{}; then flash this image anew and begin anew", zero_off(signs.zero_deg)));
    } else if signs.zero_deg.abs() > ZERO_DEG {
        step.advise(format!(
            "{}, before the drive's image is made: the tables are those of a zero that is right",
            zero_off(signs.zero_deg)
        ));
    }
}

fn zero_off(zero_deg: f64) -> String {
    format!("power stage, encoder_zeros_deg: add about {zero_deg:.1}")
}

/// Advice on current sensors that do not read their own phases.
fn sensors_wrong(wiring: Option<Wiring>) -> String {
    match wiring {
        Some(wiring) => format!(
            "current sensors: those of u,v,w read {wiring}: exchange the leads of those with a -, and put the others in order"
        ),
        None => {
            "current sensors: no order and no signs of them explain what they read; check each phase alone"
                .to_owned()
        }
    }
}

/// Advice on an angle with which the rotor turns away.
fn turned_away(zero_deg: Option<f64>) -> String {
    match zero_deg {
        Some(zero_deg) if zero_deg.abs() > LEAST_ZERO_DEG => {
            format!("{}; then flash this image anew and begin anew", zero_off(zero_deg))
        }
        _ => ADVICE_TURNED.to_owned(),
    }
}

/// The machine folder that was made.
fn made(commission: &Commission) -> Result<Machine> {
    match &commission.identify.options.out {
        Some(out) => Machine::load(&out.to_string_lossy()),
        None => bail!("--out: must name the machine folder to make"),
    }
}

fn tables(commission: &Commission, _machine: &Machine, _record: &Record) -> Result<Step> {
    let made = made(commission)?;
    let mut step = Step::new("tables");
    step.find("max_torque_nm", made.folder.parameters.max_torque_nm);
    step.find("magnet_flux_wb", made.tables.ratings.magnet_flux_wb.into());
    Ok(step)
}

fn first_torque(commission: &Commission, machine: &Machine, record: &Record) -> Result<Step> {
    let identify = &commission.identify;
    let mut step = Step::new("first torque");
    let mut options = identify.options.clone();
    if identify.can.is_none() && options.on == On::Qemu {
        let Some(image) = &commission.drive_image else {
            step.fail("--drive-image: must name the drive's image with the tables that were made".to_owned());
            return Ok(step);
        };
        options.run.image = Some(image.clone());
    }
    // The rig makes the correction that a person makes in the power stage's file.
    if let (None, Some(zero_deg)) = (&identify.can, record.found("angle_zero_deg"))
        && zero_deg.abs() > ZERO_DEG
    {
        options.run.angle_error += zero_deg;
        step.find("encoder_zero_added_deg", zero_deg);
    }
    let known = options.machine.clone().unwrap_or_else(|| Traction::MACHINE.to_owned());
    options.own.plant.get_or_insert(known);
    let made = made(commission)?;
    let most_nm = made.folder.parameters.max_torque_nm;
    let parameters = &machine.folder.parameters;
    let [inertia, friction_nm] =
        ["rotor_inertia_kg_m2", "friction_nm"].map(|name| record.found(name).unwrap_or(f64::NAN));
    let half_nm = friction_nm + 0.5 * parameters.max_speed_rpm * TAU / 60.0 * inertia / HELD_S;
    // If inertia or friction is not known, the minimum is the other value.
    let torque_nm = (TORQUE_SHARE * most_nm).min(half_nm);
    let script = format!(
        "wait 0.3\ncharge\nwait 4\nexpect state charged\nenable\nwait 0.2\nexpect state enabled\ntorque {torque_nm} over {RAMP_S}\nwait {HELD_S}\n\
         torque 0 over {RAMP_S}\nwait 0.3\ndisable\nwait 0.5\nend\n"
    );
    let talk = talk(commission, &options, &made, &script)?;
    talk.failures.iter().for_each(|failure| step.fail(failure.clone()));
    fault(&talk, &mut step);
    let [asked, flowed, speed] =
        ["torque_nm", "torque_estimate_nm", "speed_rpm"].map(|column| told(&talk, "running", column));
    let off = asked.iter().zip(&flowed).map(|(asked, flowed)| flowed - asked).collect::<Vec<_>>();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    step.within("torque_asked_nm", largest(&asked), [0.5 * torque_nm, 1.5 * torque_nm]);
    let most_off = TORQUE_OFF_SHARE * most_nm;
    step.within("torque_off_on_average_nm", mean, [-most_off, most_off]);
    step.within("speed_reached_rpm", largest(&speed), [0.01, parameters.max_speed_rpm]);
    let expected_rpm = (torque_nm - friction_nm) * HELD_S / inertia * 60.0 / TAU;
    step.find("speed_expected_rpm", expected_rpm);
    let current_a = largest(&told(&talk, "running", "current_a"));
    step.within("largest_current_a", current_a, [0.0, 0.5 * parameters.max_current_a]);
    Ok(step)
}
