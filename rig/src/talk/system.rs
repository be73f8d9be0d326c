//! The system that is talked to, and the columns of its telemetry.

/// The system that is talked to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum System {
    /// The PMaSynRM drive.
    #[default]
    Pmasynrm,
    /// Two motors on a Z-source nine-switch inverter.
    Zs9,
}

impl System {
    /// Columns of its telemetry.csv.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Pmasynrm => &COLUMNS,
            Self::Zs9 => &ZS9_COLUMNS,
        }
    }

    /// As on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pmasynrm => "pmasynrm",
            Self::Zs9 => "zs9",
        }
    }

    /// The machine's and its load's inertia unless told otherwise, in kg·m².
    pub const fn inertia_kg_m2(self) -> f64 {
        match self {
            Self::Pmasynrm => 10.0,
            Self::Zs9 => 0.1,
        }
    }
}

/// The columns of telemetry.csv of the ZS9.
pub const ZS9_COLUMNS: [&str; 35] = columns(
    "scheme",
    [
        "speed1_rpm",
        "torque1_nm",
        "current1_a",
        "speed2_rpm",
        "torque2_nm",
        "current2_a",
        "link_v",
        "capacitor_v",
        "duty_percent",
    ],
);

/// The columns of telemetry.csv.
pub const COLUMNS: [&str; 35] = columns(
    "mode",
    [
        "speed_rpm",
        "torque_nm",
        "link_v",
        "current_a",
        "id_ref_a",
        "iq_ref_a",
        "voltage_v",
        "frequency_hz",
        "temperature_c",
    ],
);

/// The columns with a system's name of how the gates are played, and what it measures.
const fn columns(pattern: &'static str, measured: [&'static str; 9]) -> [&'static str; 35] {
    let [a, b, c, d, e, f, g, h, i] = measured;
    [
        "t_s",
        "state",
        pattern,
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
        a,
        b,
        c,
        d,
        e,
        f,
        g,
        h,
        i,
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
    ]
}
