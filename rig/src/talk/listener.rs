//! The telemetry's receiver: frames in, rows of telemetry.csv out.

use super::system::System;
use tractive::modulation::Mode;
use tractive::nine_switch::Scheme;
use tractive::protection::Fault;
use tractive::protocol::e2e::{Order, Sequence, counter};
use tractive::protocol::{
    Counts, FROM_DRIVE, FROM_ZS9, Frame, Listening, Measured, Message, Outcome, ParameterAnswer, Pattern,
    Payload, Scales, StatusFrame, Zs9Measured, trip_number,
};

/// Places of the messages in the lists of both systems.
const STATUS: usize = 0;
const FAULT_VALUE: usize = 4;
const FAULT_LIMIT: usize = 5;
const COUNTERS: usize = 6;
const PARAMETER_ANSWER: usize = 7;

/// The pulse pattern of the gates, by its code.
#[derive(Clone, Copy, Debug)]
struct Code(u32);

impl Pattern for Code {
    fn code(self) -> u32 {
        self.0
    }

    fn from_code(code: u32) -> Self {
        Self(code)
    }
}

/// Everything that the telemetry has reported.
#[derive(Clone, Debug, Default)]
pub struct Listener {
    system: System,
    scales: Scales,
    sequences: [Sequence; FROM_DRIVE.len()],
    status: Option<StatusFrame<Code>>,
    /// Measurements of the PMaSynRM drive.
    measured: Measured,
    /// Measurements of the ZS9.
    zs9: Zs9Measured,
    /// The counts of the frames sent.
    pub counts: Counts,
    fault_value: Option<f32>,
    fault_limit: Option<f32>,
    answer: Option<ParameterAnswer>,
    /// Number of frames that failed the check or were out of order.
    pub errors: u32,
    /// The message about a frame on another machine's scales.
    pub foreign: Option<String>,
}

/// The reason why a message cannot be read.
fn foreign(message: &Message, scales: Scales) -> String {
    let scaled = message
        .quantities()
        .map(|quantity| format!("{} in {} of the usual steps", quantity.name(), scales.worth(quantity)));
    let scaled: Vec<_> = scaled.collect();
    format!(
        "{}: the drive counts in other steps than the machine's, {}: its image is another machine's",
        message.name,
        scaled.join(", ")
    )
}

impl Listener {
    /// A listener to a system on these scales, before its first frame.
    pub fn new(system: System, scales: Scales) -> Self {
        Self { system, scales, ..Self::default() }
    }

    /// The messages that the system sends.
    fn messages(&self) -> &'static [&'static Message] {
        match self.system {
            System::Pmasynrm => &FROM_DRIVE,
            System::Zs9 => &FROM_ZS9,
        }
    }

    /// A frame from the drive; `true` if it was a status, which makes a row.
    pub fn receive(&mut self, frame: &Frame) -> bool {
        let Some(index) = self.messages().iter().position(|message| message.id == frame.id) else {
            self.errors += 1;
            return false;
        };
        let message = self.messages()[index];
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
        let payload = message.mark(Payload(u64::from_le_bytes(frame.data)), self.scales);
        if !message.is_tidy(payload) {
            self.errors += 1;
            self.foreign.get_or_insert_with(|| foreign(message, self.scales));
            return false;
        }
        match self.system {
            System::Pmasynrm => self.measured.merge(message, payload, self.scales),
            System::Zs9 => self.zs9.merge(message, payload, self.scales),
        }
        match index {
            STATUS => {
                let status = StatusFrame::decode(payload);
                if status.fault == 0 {
                    (self.fault_value, self.fault_limit) = (None, None);
                }
                self.status = Some(status);
                return true;
            }
            COUNTERS => self.counts.merge(payload),
            FAULT_VALUE => (_, self.fault_value) = trip_number(payload),
            FAULT_LIMIT => (_, self.fault_limit) = trip_number(payload),
            PARAMETER_ANSWER => self.answer = ParameterAnswer::decode(payload),
            _ => {}
        }
        false
    }

    /// The rotors' speeds as reported, in r/min; for one rotor only the first.
    pub fn speeds_rpm(&self) -> [Option<f32>; 2] {
        match self.system {
            System::Pmasynrm => [self.measured.speed_rpm, None],
            System::Zs9 => self.zs9.motors.map(|motor| motor.speed_rpm),
        }
    }

    /// The newest row, at a time in s; columns as [`System::columns`].
    pub fn row(&self, t_s: f64) -> Vec<String> {
        let number = |value: Option<f32>| value.map_or(String::new(), |value| value.to_string());
        let text = |value: Option<&str>| value.unwrap_or_default().to_owned();
        let flag = |value: bool| u8::from(value).to_string();
        let status = self.status;
        let switches = status.map_or([false; 3], |status| status.switches);
        let listening = status.map_or(Listening::Off, |status| status.listening);
        let pattern = status.map(|status| match self.system {
            System::Pmasynrm => Mode::from_code(status.mode.0).name(),
            System::Zs9 => <Scheme as Pattern>::from_code(status.mode.0).name(),
        });
        let outcome = self.answer.map(|answer| answer.outcome);
        let mut row = vec![
            format!("{t_s:.4}"),
            text(status.and_then(|status| status.state).map(|state| state.name())),
            text(pattern),
            text(Listening::ALL.iter().find(|(code, _)| *code == listening).map(|(_, name)| *name)),
            text(status.and_then(|status| Fault::from_code(status.fault.into())).map(Fault::name)),
            number(self.fault_value),
            number(self.fault_limit),
            text(status.and_then(|status| status.refusal).map(|refusal| refusal.name())),
            status.map_or(String::new(), |status| status.refusals.to_string()),
        ];
        row.extend(switches.map(flag));
        row.push(number(status.and_then(|status| status.chopper_percent)));
        row.extend(self.measurements().into_iter().map(number));
        row.extend(self.counts.to_array().map(|count| count.to_string()));
        row.extend([
            self.answer.map_or(String::new(), |answer| answer.parameter.to_string()),
            number(self.answer.and_then(|answer| answer.value)),
            text(Outcome::ALL.iter().find(|(code, _)| Some(*code) == outcome).map(|(_, name)| *name)),
            self.errors.to_string(),
        ]);
        row
    }

    /// Measurements in the order of their columns.
    fn measurements(&self) -> Vec<Option<f32>> {
        let measured = &self.measured;
        match self.system {
            System::Pmasynrm => vec![
                measured.speed_rpm,
                measured.torque_nm,
                measured.link_v,
                measured.current_a,
                measured.id_ref_a,
                measured.iq_ref_a,
                measured.voltage_v,
                measured.frequency_hz,
                measured.temperature_c,
                measured.torque_estimate_nm,
                measured.angle_zero_deg,
                Some(measured.calibrating.into()),
            ],
            System::Zs9 => {
                let ([first, second], [zero1, zero2]) = (&self.zs9.motors, self.zs9.angle_zeros_deg);
                let [calibrates1, calibrates2] = self.zs9.calibrating.map(|flag| Some(flag.into()));
                vec![
                    first.speed_rpm,
                    first.torque_nm,
                    first.current_a,
                    second.speed_rpm,
                    second.torque_nm,
                    second.current_a,
                    self.zs9.link_v,
                    self.zs9.capacitor_v,
                    self.zs9.duty_percent,
                    zero1,
                    zero2,
                    calibrates1,
                    calibrates2,
                ]
            }
        }
    }

    /// The present value of a column.
    pub fn value(&self, column: &str) -> String {
        self.system.column(column).map_or(String::new(), |index| self.row(0.0)[index].clone())
    }
}
