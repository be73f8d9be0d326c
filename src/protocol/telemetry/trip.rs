//! The latched fault, with its value and its limit.

use crate::protection::Trip;
use crate::protocol::message::Message;
use crate::protocol::signal::{Payload, Signal};

pub(in crate::protocol) const TRIP_FAULT: Signal = Signal::number("fault", 16, 8, 0xFF);
pub(in crate::protocol) const TRIP_VALUE: Signal = Signal::float("value", 32);
pub(in crate::protocol) const TRIP_LIMIT: Signal = Signal::float("limit", 32);

/// The latched fault and its value; sent while there is one.
pub const FAULT_VALUE: Message = Message::new("FAULT_VALUE", 0x185, 9, 100, &[TRIP_FAULT, TRIP_VALUE]);
/// The latched fault and its limit; sent while there is one.
pub const FAULT_LIMIT: Message = Message::new("FAULT_LIMIT", 0x186, 10, 100, &[TRIP_FAULT, TRIP_LIMIT]);

/// Contents of [`FAULT_VALUE`] and [`FAULT_LIMIT`].
pub fn trip_frames(trip: &Trip) -> [Payload; 2] {
    [(&TRIP_VALUE, trip.value), (&TRIP_LIMIT, trip.limit)].map(|(signal, number)| {
        let mut payload = Payload::default();
        TRIP_FAULT.put_raw(&mut payload, trip.fault as u32);
        signal.put_measured(&mut payload, Some(number));
        payload
    })
}

/// Code of the fault and number of a [`FAULT_VALUE`] or a [`FAULT_LIMIT`]; `None` for a number that is not finite.
pub fn trip_number(payload: Payload) -> (u8, Option<f32>) {
    (TRIP_FAULT.raw(payload) as u8, TRIP_VALUE.get(payload))
}
