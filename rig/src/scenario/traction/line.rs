//! Parts and verdicts that all scenarios with a line side share.

use super::Options;
use super::setup::udc_v;
use crate::analysis::Figures;
use crate::machine::Machine;
use crate::plant::{DcLinkSettings, Source};
use crate::report::{Curve, Page};
use crate::trace::{Recording, SlotRow, Tick};
use crate::verdict::Verdict;
use serde::Serialize;
use tractive::operator::State;

/// A 1,500 V line behind a rectifier, with parts of the size that a drive of 250 kW has.
pub const LINK: DcLinkSettings = DcLinkSettings {
    capacitance_f: 6e-3,
    source: Source {
        voltage_v: 1_500.0,
        resistance_ohm: 0.05,
        inductance_h: 0.0,
        reversible: false,
        live: true,
    },
    precharge_ohm: 50.0,
    discharge_ohm: 100.0,
    auxiliary_ohm: f64::INFINITY,
    chopper_ohm: 12.0,
};

/// Largest power of the drive that these parts are for, in W.
const POWER_W: f64 = 246.4e3;

/// True if a time lies in one of the windows (from, until).
pub fn within(windows: &[(f64, f64)], t_s: f64) -> bool {
    windows.iter().any(|(from, until)| (from - 1e-9..until - 1e-9).contains(&t_s))
}

/// Beginning of a state.
#[derive(Clone, Debug, Serialize)]
pub struct Entered {
    /// Time, in s.
    pub at_s: f64,
    /// The state.
    pub state: &'static str,
    /// The fault in it.
    pub fault: &'static str,
}

/// Every change of state.
pub fn states(recording: &Recording) -> Vec<Entered> {
    let mut entered: Vec<Entered> = Vec::new();
    for SlotRow { t_s, status } in &recording.slots {
        let (state, fault) = (status.state.name(), status.trip.map_or("", |trip| trip.fault.name()));
        // Having torque or not is no state of its own here.
        if entered.last().is_none_or(|last| last.state != state) {
            entered.push(Entered { at_s: *t_s, state, fault });
        }
    }
    entered
}

/// A command that was not followed.
#[derive(Clone, Debug, Serialize)]
pub struct Refused {
    /// Time, in s.
    pub at_s: f64,
    /// Reason.
    pub reason: &'static str,
}

/// Every refusal.
pub fn refused(recording: &Recording) -> Vec<Refused> {
    let mut count = 0;
    let mut refused = Vec::new();
    for SlotRow { t_s, status } in &recording.slots {
        if status.refusals != count {
            count = status.refusals;
            let reason = status.refusal.map_or("", |refusal| refusal.name());
            refused.push(Refused { at_s: *t_s, reason });
        }
    }
    refused
}

/// Verdicts that hold wherever there is a line side.
pub fn verdicts(recording: &Recording, expected_refusals: &[&str]) -> Vec<Verdict> {
    let reasons: Vec<_> = refused(recording).iter().map(|refusal| refusal.reason).collect();
    let unlike = reasons.iter().zip(expected_refusals).filter(|(found, wanted)| found != wanted).count()
        + reasons.len().abs_diff(expected_refusals.len());
    let both = recording.slots.iter().filter(|slot| {
        let switches = slot.status.switches;
        switches.discharge && (switches.main || switches.precharge)
    });
    vec![
        Verdict::at_most("gates switched on while none was permitted", stray_edges(recording) as f64, 0.0),
        Verdict::at_most("refusals that are not the expected ones", unlike as f64, 0.0),
        Verdict::at_most("slots with discharge resistor and a contactor", both.count() as f64, 0.0),
        Verdict::at_most("energy of the link not accounted for (share)", unaccounted(recording), 1e-4),
    ]
}

/// Gates that were switched on in a state without pulses; the last pulses may end in the slot after a state that has them.
fn stray_edges(recording: &Recording) -> usize {
    let pulsing =
        |state: State| matches!(state, State::Enabled | State::Running | State::Stopping | State::Coasting);
    let slots = &recording.slots;
    let on = recording.edges.iter().filter(|edge| edge.on && edge.tick >= recording.lead as Tick);
    on.filter(|edge| {
        let t_s = recording.seconds(edge.tick);
        let after = slots.partition_point(|slot| slot.t_s <= t_s);
        // Two slots: the permit is seen in the next control period, and the committed half is still played.
        let recent = &slots[after.saturating_sub(3)..after];
        !recent.iter().any(|slot| pulsing(slot.status.state))
    })
    .count()
}

/// Energy that the link received and neither passed on nor kept, as a share of the energy moved.
fn unaccounted(recording: &Recording) -> f64 {
    let Some(balance) = recording.link else { return f64::NAN };
    balance.missing_j.abs() / balance.moved_j.max(1.0)
}

/// The figures that all have.
pub fn figures(figures: &mut Figures, recording: &Recording) {
    figures.set("states", states(recording));
    figures.set("refusals", refused(recording));
    if let Some(balance) = recording.link {
        figures.set("energy_from_source_kj", balance.energies.source_j / 1e3);
        figures.set("energy_in_precharge_and_source_kj", balance.energies.path_j / 1e3);
        figures.set("energy_in_discharge_resistor_kj", balance.energies.discharge_j / 1e3);
        figures.set("energy_in_braking_resistor_kj", balance.energies.chopper_j / 1e3);
        figures.set("energy_to_inverter_kj", balance.energies.inverter_j / 1e3);
    }
}

/// The plots that all have.
pub fn plots(page: &mut Page, recording: &Recording) {
    page.plot("DC link", "V", recording, &[("udc", |row| row.udc_v)]);
    let torques: [Curve; 3] = [
        ("demand", |row| row.status.map_or(0.0, |status| status.torque_nm.into())),
        ("after limits", |row| row.te_ref_nm),
        ("torque", |row| row.te_nm),
    ];
    page.plot("torque: demanded, after the link's limits, given", "N·m", recording, &torques);
    let switches: [Curve; 4] = [
        ("chopper", |row| row.status.map_or(0.0, |status| status.switches.chopper.into())),
        ("precharge", |row| switched(row.status.map(|status| status.switches.precharge))),
        ("main", |row| switched(row.status.map(|status| status.switches.main))),
        ("discharge", |row| switched(row.status.map(|status| status.switches.discharge))),
    ];
    page.plot("contactors (1: on), chopper duty", "–", recording, &switches);
    let names: Vec<_> = State::ALL.iter().map(|state| state.name()).collect();
    let state: Curve = ("state", |row| row.status.map_or(0.0, |of| f64::from(of.state.code())));
    page.plot_states("state", &names, recording, state);
    page.plot("speed", "r/min", recording, &[("speed", |row| row.speed_rpm)]);
}

fn switched(on: Option<bool>) -> f64 {
    f64::from(u8::from(on.unwrap_or(false)))
}

/// The line side's link of a run: a machine's, behind a source of the voltage that the options name.
pub fn fed(options: &Options, machine: &Machine) -> DcLinkSettings {
    let link = scaled(machine);
    DcLinkSettings { source: Source { voltage_v: udc_v(options, machine), ..link.source }, ..link }
}

/// The line side's link for a machine, with the same shares of its voltage and power as the reference machine has.
pub fn scaled(machine: &Machine) -> DcLinkSettings {
    let parameters = &machine.folder.parameters;
    let volts = parameters.dc_link_nominal_v / LINK.source.voltage_v;
    let ohms = volts * volts * POWER_W / parameters.max_power_w;
    DcLinkSettings {
        capacitance_f: LINK.capacitance_f / ohms,
        source: Source {
            voltage_v: parameters.dc_link_nominal_v,
            resistance_ohm: LINK.source.resistance_ohm * ohms,
            ..LINK.source
        },
        precharge_ohm: LINK.precharge_ohm * ohms,
        discharge_ohm: LINK.discharge_ohm * ohms,
        auxiliary_ohm: LINK.auxiliary_ohm * ohms,
        chopper_ohm: LINK.chopper_ohm * ohms,
    }
}
