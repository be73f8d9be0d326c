//! The log of the idle loop: a fault when it occurs and when it is acknowledged, followed by the flight recorder's records.

use tractive::cell::{Ring, Words};
use tractive::protection::Trip;
use tractive::recorder::{DualRecord, Record};

/// The part that has been logged so far.
#[derive(Default)]
pub struct Log {
    trip: Option<Trip>,
    records: usize,
}

/// A control period that a log can print.
pub trait LogLine {
    /// In one line.
    fn tell(&self);
}

impl Log {
    /// Nothing logged yet.
    pub const fn new() -> Self {
        Self { trip: None, records: 0 }
    }

    /// Logs the next record of a frozen recorder: one a call, because a log that is read slowly holds few.
    pub fn record<T: LogLine + Words<N>, const N: usize, const RECORDS: usize>(
        &mut self,
        recorder: &Ring<T, N, RECORDS>,
    ) {
        match recorder.read(self.records) {
            Some(record) => {
                record.tell();
                self.records += 1;
            }
            None if !recorder.is_frozen() => self.records = 0,
            None => {}
        }
    }

    /// Logs a fault when it occurs and when it is gone.
    pub fn trip(&mut self, trip: Option<Trip>) {
        if trip == self.trip {
            return;
        }
        match trip {
            Some(trip) => {
                defmt::error!("fault {}: {} beyond {}", trip.fault.name(), trip.value, trip.limit);
            }
            None => defmt::info!("fault acknowledged"),
        }
        self.trip = trip;
    }
}

impl LogLine for Record {
    fn tell(&self) {
        let Self { at, currents_a, udc_v, angle, id_a, iq_a, voltage_v, state } = *self;
        defmt::info!(
            "{} ticks: {} {} {} A, {} V, angle {=u32:#x}; wanted {} {} A, {} V; {} {}",
            at.0,
            currents_a.a,
            currents_a.b,
            currents_a.c,
            udc_v,
            angle.0,
            id_a,
            iq_a,
            voltage_v,
            state.mode.name(),
            state.fault.map_or("", |fault| fault.name()),
        );
    }
}

impl LogLine for DualRecord {
    fn tell(&self) {
        let Self { at, currents_a: [upper, lower], angles: [first, second], .. } = *self;
        defmt::info!(
            "{} ticks: {} {} {} A, {} {} {} A, angles {=u32:#x} {=u32:#x}; {} V {} V {} A; wanted {} {} N·m; {} {}",
            at.0,
            upper.a,
            upper.b,
            upper.c,
            lower.a,
            lower.b,
            lower.c,
            first.0,
            second.0,
            self.capacitor_v,
            self.source_v,
            self.inductor_a,
            self.torque_nm[0],
            self.torque_nm[1],
            self.state.scheme.name(),
            self.state.fault.map_or("", |fault| fault.name()),
        );
    }
}
