//! The system that is talked to, and the columns of its telemetry.

use tractive::named;

named! {
    /// The system that is talked to.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
    pub enum System {
        /// The PMaSynRM drive.
        #[default]
        Pmasynrm => "pmasynrm",
        /// Two motors on a Z-source nine-switch inverter.
        Zs9 => "zs9",
    }
}

impl System {
    /// Columns of its telemetry.csv.
    pub fn columns(self) -> Vec<&'static str> {
        let (pattern, measured) = match self {
            Self::Pmasynrm => ("mode", MEASURED),
            Self::Zs9 => ("scheme", ZS9_MEASURED),
        };
        let parts = ["t_s state", pattern, STATUS, measured, COUNTS];
        parts.iter().flat_map(|part| part.split(' ')).collect()
    }

    /// The place of a column.
    pub fn column(self, name: &str) -> Option<usize> {
        self.columns().iter().position(|column| *column == name)
    }

    /// The machine's and its load's inertia unless told otherwise, in kg·m².
    pub const fn inertia_kg_m2(self) -> f64 {
        match self {
            Self::Pmasynrm => 10.0,
            Self::Zs9 => 0.1,
        }
    }
}

/// Columns of the status behind the pulse pattern, of what each system measures, and of what became of frames and parameters.
const STATUS: &str =
    "listening fault fault_value fault_limit refusal refusals precharge main discharge chopper_percent";
const MEASURED: &str = "speed_rpm torque_nm link_v current_a id_ref_a iq_ref_a voltage_v frequency_hz temperature_c \
    torque_estimate_nm angle_zero_deg calibrating";
const ZS9_MEASURED: &str = "speed1_rpm torque1_nm current1_a speed2_rpm torque2_nm current2_a \
    link_v capacitor_v duty_percent angle_zero1_deg angle_zero2_deg calibrating1 calibrating2";
const COUNTS: &str = "received taken lost unknown truncated corrupted repeated disordered out_of_range \
    parameter parameter_value parameter_result telemetry_errors";
