//! One protection switched off, to show its value: the campaign must then report the cases that it loses.

use std::str::FromStr;
use tractive::machine::{Ratings, Tables};
use tractive::protection::{Fault, LegFaults, LinkLimits, MaskedFaults};

/// The part that is switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ablation {
    /// The check that finds this fault.
    Check(Fault),
    /// The short circuit as a safe state: always gates off.
    ShortCircuit,
    /// The drivers' report about the safe state: a stuck leg is treated like any other fault.
    LegSafeState,
}

impl Ablation {
    /// Every protection that the campaign tries.
    pub fn all() -> impl Iterator<Item = Self> {
        /// The rest is found by boards, which have their own benches.
        const CHECKS: [Fault; 18] = [
            Fault::Overcurrent,
            Fault::DcOvervoltage,
            Fault::DcUndervoltage,
            Fault::Overspeed,
            Fault::PhaseSum,
            Fault::NotFinite,
            Fault::Frozen,
            Fault::ControlDeadline,
            Fault::StaleCommand,
            Fault::SourceUndervoltage,
            Fault::CapacitorOvervoltage,
            Fault::DutyRange,
            Fault::LinkImplausible,
            Fault::SensorLost1,
            Fault::SensorLost2,
            Fault::LegStuck,
            Fault::AngleLost,
            Fault::DriverBlocked,
        ];
        CHECKS.into_iter().map(Self::Check).chain([Self::ShortCircuit, Self::LegSafeState])
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Check(fault) => fault.name(),
            Self::ShortCircuit => "short_circuit",
            Self::LegSafeState => "leg_safe_state",
        }
    }

    /// Ratings whose levels are out of reach, if the protection is a level.
    pub fn ratings(self, ratings: &Ratings) -> Ratings {
        let mut changed = *ratings;
        match self {
            Self::Check(Fault::Overcurrent) => changed.trip_current_a = f32::INFINITY,
            Self::Check(Fault::DcOvervoltage) => changed.trip_dc_over_v = f32::INFINITY,
            Self::Check(Fault::DcUndervoltage) => changed.trip_dc_under_v = f32::NEG_INFINITY,
            Self::Check(Fault::Overspeed) => changed.trip_speed_rad_s = f32::INFINITY,
            Self::ShortCircuit => changed.magnet_flux_wb = 0.0,
            _ => {}
        }
        changed
    }

    /// The ZS9's limits, likewise.
    pub fn link_limits(self, limits: LinkLimits) -> LinkLimits {
        let mut changed = limits;
        match self {
            Self::Check(Fault::SourceUndervoltage) => changed.source_min_v = f32::NEG_INFINITY,
            Self::Check(Fault::CapacitorOvervoltage) => changed.capacitor_max_v = f32::INFINITY,
            _ => {}
        }
        changed
    }

    /// Tables with such ratings; they live as long as the program.
    pub fn tables(self, tables: &'static Tables) -> &'static Tables {
        Box::leak(Box::new(Tables { ratings: self.ratings(&tables.ratings), ..*tables }))
    }

    /// The checks that the tasks omit.
    pub fn masked(self) -> MaskedFaults {
        match self {
            // These are levels: out of reach.
            Self::Check(
                Fault::Overcurrent | Fault::DcOvervoltage | Fault::DcUndervoltage | Fault::Overspeed,
            ) => MaskedFaults::NONE,
            Self::Check(fault) => MaskedFaults::of(fault),
            Self::ShortCircuit | Self::LegSafeState => MaskedFaults::NONE,
        }
    }

    /// The reports that the power stage still makes.
    pub fn leg_faults(self, found: LegFaults) -> LegFaults {
        match self {
            Self::Check(Fault::DriverBlocked) => LegFaults { blocked: 0, ..found },
            Self::Check(Fault::LegStuck) => LegFaults { low: 0, high: 0, ..found },
            // A fault of no leg in particular.
            Self::LegSafeState => LegFaults {
                blocked: if found.blocked != 0 { 0b11_1111 } else { 0 },
                low: found.low | found.high,
                high: 0,
            },
            _ => found,
        }
    }
}

impl FromStr for Ablation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::all().find(|without| without.name() == text).ok_or_else(|| {
            let names: Vec<_> = Self::all().map(Self::name).collect();
            format!("must be one of {}", names.join(", "))
        })
    }
}
