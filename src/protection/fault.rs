//! The faults, by name and code, and the record of one.

use super::SafeState;
use crate::time::Instant;
use tractive_control::named;

named! {
    /// The fault that trips the drive.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[repr(u8)]
    #[non_exhaustive]
    pub enum Fault {
        /// A phase current above its trip level, in A.
        Overcurrent = 1 => "overcurrent",
        /// DC link above its trip level, in V.
        DcOvervoltage => "dc_overvoltage",
        /// DC link below its trip level, in V.
        DcUndervoltage => "dc_undervoltage",
        /// Rotor faster than its trip level, in mechanical rad/s.
        Overspeed => "overspeed",
        /// The three phase currents do not add up to zero, in A.
        PhaseSum => "phase_sum",
        /// A measurement or a result is NaN or infinite.
        NotFinite => "not_finite",
        /// Measurements repeat themselves to the last bit although current flows or the rotor turns, in control periods.
        Frozen => "frozen",
        /// The control interrupt ended after its period, in s.
        ControlDeadline => "control_deadline",
        /// The newest voltage command is too old, in s.
        StaleCommand => "stale_command",
        /// ZS9: the source is shorted or too low, in V.
        SourceUndervoltage => "source_undervoltage",
        /// ZS9: a capacitor of the network above its trip level, in V.
        CapacitorOvervoltage => "capacitor_overvoltage",
        /// ZS9: a shoot-through duty outside what the network is made for.
        DutyRange => "duty_range",
        /// ZS9: the upper motor's angle is far off what its speed tells, or stands still while it should turn, in electrical rad; or
        /// its sensor says so itself: then the value is 1 and the limit 0.
        SensorLost1 => "sensor_lost_1",
        /// ZS9: the same of the lower motor.
        SensorLost2 => "sensor_lost_2",
        /// Gates did not do what they were told. The value has a bit for each: of the ZS9 in the order of
        /// [`crate::nine_switch::GATES`], of the PMaSynRM drive from u on for the legs.
        LegStuck => "leg_stuck",
        /// A gate driver is not ready, or its wire is broken: the hardware holds the gates off. The value of a break in hardware, this one's and the
        /// next two's, is 1; of the ZS9's it says where it was seen.
        GateDriver => "gate_driver",
        /// A comparator has seen a phase current beyond its threshold.
        HardwareOvercurrent => "hardware_overcurrent",
        /// The chip's own break: crystal stopped, processor locked up, or a memory word with a two-bit error.
        ClockFailure => "clock_failure",
        /// A carrier half ended before its interrupt did, or control saw none come, in s.
        PwmDeadline => "pwm_deadline",
        /// The board did not leave the safe state when it was told to, or for so long after an acknowledge, in s.
        GatesHeld => "gates_held",
        /// A current where there should be none, in A: a sensor shows it, or a machine with its gates off generates through the diodes.
        CurrentOffset => "current_offset",
        /// The link's voltage cannot be what it is measured as, in V.
        LinkImplausible => "link_implausible",
        /// The position sensor does not answer, or the rotor's speed does not settle while it should stand still. The value is 0, of 1.
        PositionSensor => "position_sensor",
        /// The configuration was refused, or nobody has checked it. The value is 2 or 0, of 1.
        Configuration => "configuration",
        /// The link did not reach its voltage in time, in V.
        PrechargeTimeout => "precharge_timeout",
        /// A contactor does not do what it is told; the value is 1 for the main contactor, 2 for the precharge relay.
        Contactor => "contactor",
        /// The link did not lose its voltage in time, in V.
        DischargeTimeout => "discharge_timeout",
        /// The angle is far off what the speed makes of the one before, in electrical rad.
        AngleLost => "angle_lost",
        /// Drivers found their devices short-circuited and block them; the value has a bit for each, from bit 0 on uh ul vh vl wh wl.
        DriverBlocked => "driver_blocked",
        /// The board refused to start; the value is the number of its reason.
        StartRefused => "start_refused",
        /// The winding's temperature sensor is unplugged, shorted or out of its range; the value is what it shows, in °C.
        WindingSensor => "winding_sensor",
        /// The same of the heat sink's.
        HeatSinkSensor => "heat_sink_sensor",
        /// The winding is hotter than where derating ends, in °C.
        WindingTemperature => "winding_temperature",
        /// The devices' junctions are, in °C.
        JunctionTemperature => "junction_temperature",
        /// The machine's voltage is far from what its currents, its angle and its map make it, in V·s: the position sensor stands still, counts the wrong
        /// way or is off; or pole pairs, the order of the phases or the machine are others than the drive was told.
        VoltageUnexplained => "voltage_unexplained",
    }
}

impl Fault {
    /// The fault with this code; `None` for 0 or an unknown number.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.get((code as usize).wrapping_sub(1)).copied()
    }
}

/// A fault with its circumstances.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Trip {
    /// The fault.
    pub fault: Fault,
    /// The value that broke the limit, in the fault's unit.
    pub value: f32,
    /// The limit, in the same unit.
    pub limit: f32,
    /// The instant of the measurement.
    pub at: Instant,
    /// The state into which the gates were put.
    pub safe: SafeState,
}

/// The first limit that a fault breaks, with its value: (fault, value, limit).
pub type FailedCheck = (Fault, f32, f32);
