//! The telemetry's receiver: frames in, rows of telemetry.csv out.

use tractive::protection::Fault;
use tractive::protocol::e2e::{Order, Sequence, counter};
use tractive::protocol::{
    COUNTERS, Counts, FAULT_LIMIT, FAULT_VALUE, FROM_DRIVE, Frame, Listening, Measured, Outcome,
    PARAMETER_ANSWER, ParameterAnswer, Payload, STATUS, StatusFrame, trip_number,
};

/// The columns of telemetry.csv.
pub const COLUMNS: [&str; 35] = [
    "t_s",
    "state",
    "mode",
    "listening",
    "fault",
    "fault_value",
    "fault_limit",
    "refusal",
    "refusals",
    "precharge",
    "main",
    "discharge",
    "chopper_percent",
    "speed_rpm",
    "torque_nm",
    "link_v",
    "current_a",
    "id_ref_a",
    "iq_ref_a",
    "voltage_v",
    "frequency_hz",
    "temperature_c",
    "received",
    "taken",
    "lost",
    "unknown",
    "truncated",
    "corrupted",
    "repeated",
    "disordered",
    "out_of_range",
    "parameter",
    "parameter_value",
    "parameter_result",
    "telemetry_errors",
];

/// All that the telemetry has said.
#[derive(Clone, Debug, Default)]
pub struct Listener {
    sequences: [Sequence; FROM_DRIVE.len()],
    status: Option<StatusFrame>,
    /// Measurements.
    pub measured: Measured,
    /// What became of the frames sent.
    pub counts: Counts,
    fault_value: Option<f32>,
    fault_limit: Option<f32>,
    answer: Option<ParameterAnswer>,
    /// Frames that did not check, or were not in order.
    pub errors: u32,
}

impl Listener {
    /// A frame from the drive; `true` if it was a status, which makes a row.
    pub fn receive(&mut self, frame: &Frame) -> bool {
        let Some(index) = FROM_DRIVE.iter().position(|message| message.id == frame.id) else {
            self.errors += 1;
            return false;
        };
        let message = FROM_DRIVE[index];
        let intact = frame.length == 8 && message.is_intact(frame);
        let in_order = intact
            && matches!(
                self.sequences[index].judge(counter(&frame.data)),
                Order::First | Order::Next { lost: 0 }
            );
        if !in_order {
            self.errors += 1;
            return false;
        }
        let payload = Payload(u64::from_le_bytes(frame.data));
        self.measured.merge(message, payload);
        match frame.id {
            id if id == STATUS.id => {
                let status = StatusFrame::decode(payload);
                if status.fault == 0 {
                    (self.fault_value, self.fault_limit) = (None, None);
                }
                self.status = Some(status);
                return true;
            }
            id if id == COUNTERS.id => self.counts.merge(payload),
            id if id == FAULT_VALUE.id => (_, self.fault_value) = trip_number(payload),
            id if id == FAULT_LIMIT.id => (_, self.fault_limit) = trip_number(payload),
            id if id == PARAMETER_ANSWER.id => self.answer = ParameterAnswer::decode(payload),
            _ => {}
        }
        false
    }

    /// The newest row, at a time in s; columns as [`COLUMNS`].
    pub fn row(&self, t_s: f64) -> [String; COLUMNS.len()] {
        let number = |value: Option<f32>| value.map_or(String::new(), |value| value.to_string());
        let text = |value: Option<&str>| value.unwrap_or_default().to_owned();
        let flag = |value: bool| u8::from(value).to_string();
        let status = self.status;
        let [precharge, main, discharge] = status.map_or([false; 3], |status| status.switches);
        let listening = status.map_or(Listening::Off, |status| status.listening);
        let measured = &self.measured;
        let [received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range] =
            self.counts.to_array().map(|count| count.to_string());
        let outcome = self.answer.map(|answer| answer.outcome);
        [
            format!("{t_s:.4}"),
            text(status.and_then(|status| status.state).map(|state| state.name())),
            text(status.map(|status| status.mode.name())),
            text(Listening::ALL.iter().find(|(code, _)| *code == listening).map(|(_, name)| *name)),
            text(status.and_then(|status| Fault::from_code(status.fault.into())).map(Fault::name)),
            number(self.fault_value),
            number(self.fault_limit),
            text(status.and_then(|status| status.refusal).map(|refusal| refusal.name())),
            status.map_or(String::new(), |status| status.refusals.to_string()),
            flag(precharge),
            flag(main),
            flag(discharge),
            number(status.and_then(|status| status.chopper_percent)),
            number(measured.speed_rpm),
            number(measured.torque_nm),
            number(measured.link_v),
            number(measured.current_a),
            number(measured.id_ref_a),
            number(measured.iq_ref_a),
            number(measured.voltage_v),
            number(measured.frequency_hz),
            number(measured.temperature_c),
            received,
            taken,
            lost,
            unknown,
            truncated,
            corrupted,
            repeated,
            disordered,
            out_of_range,
            self.answer.map_or(String::new(), |answer| answer.parameter.to_string()),
            number(self.answer.and_then(|answer| answer.value)),
            text(Outcome::ALL.iter().find(|(code, _)| Some(*code) == outcome).map(|(_, name)| *name)),
            self.errors.to_string(),
        ]
    }

    /// What a column says now.
    pub fn value(&self, column: &str) -> String {
        let index = COLUMNS.iter().position(|name| *name == column);
        index.map_or(String::new(), |index| self.row(0.0)[index].clone())
    }
}
