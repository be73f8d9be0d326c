//! The architecture: two interrupts, the cells between them, a board, and the rig that plays the motor.

use super::diagram::Diagram;
use super::sheet::{BLUE, GREEN, GREY, VIOLET};
use anyhow::Result;

/// The parts and the words between them.
pub fn architecture() -> Result<String> {
    let mut all = Diagram::new(
        (1000, 470),
        "Two interrupts, lock-free cells between them, a board below, and the rig in the motor's place",
    );
    all.part((16.0, 34.0, 196.0, 150.0), "operator's slot, lowest", GREY)
        .part(
            (270.0, 34.0, 460.0, 150.0),
            "timer interrupt, low priority: which voltage, which pulses",
            GREEN,
        )
        .part((270.0, 226.0, 460.0, 118.0), "PWM interrupt, high priority: pulses in time", VIOLET)
        .part((764.0, 34.0, 220.0, 310.0), "board", BLUE);
    all.block((26.0, 66.0, 176.0, 46.0), "CAN, operator\nsession, ramps, states")
        .block((26.0, 126.0, 176.0, 44.0), "flight recorder\nread where it is frozen")
        .block((290.0, 66.0, 92.0, 54.0), "protection\nby name")
        .block((400.0, 66.0, 96.0, 54.0), "operating point\nweakening")
        .block((514.0, 66.0, 96.0, 54.0), "current loop\npredicted flux")
        .block((628.0, 66.0, 92.0, 54.0), "modulator\nmode, half")
        .block((290.0, 132.0, 420.0, 40.0), "tables of the machine, made offline from its flux map")
        .block((290.0, 264.0, 130.0, 56.0), "protection\nat the boundary")
        .block(
            (460.0, 264.0, 250.0, 56.0),
            "carrier half after the running one:\nlength, levels, toggle instants",
        )
        .block((784.0, 70.0, 180.0, 60.0), "converters, encoder\nmeasurements, instants")
        .block((784.0, 256.0, 180.0, 66.0), "timers\nshadow registers, gates")
        .block((26.0, 240.0, 176.0, 90.0), "cells\nlatest value, double\nbuffer, sequence counter")
        .part((16.0, 374.0, 968.0, 84.0), "in the motor's place", GREEN)
        .block((210.0, 392.0, 230.0, 52.0), "rig: inverter, machine, sensors\nevery edge at its instant")
        .block((490.0, 392.0, 200.0, 52.0), "QEMU's board\nthe image itself")
        .block((740.0, 392.0, 220.0, 52.0), "NUCLEO-G474RE\nits power stage and motor");
    all.flow(&[(202.0, 86.0), (290.0, 86.0)])
        .words((241.0, 76.0), "demand")
        .flow(&[(290.0, 106.0), (202.0, 106.0)])
        .words((241.0, 117.0), "report")
        .flow(&[(382.0, 93.0), (400.0, 93.0)])
        .flow(&[(496.0, 93.0), (514.0, 93.0)])
        .flow(&[(610.0, 93.0), (628.0, 93.0)])
        .flow(&[(784.0, 100.0), (730.0, 100.0)])
        .flow(&[(650.0, 184.0), (650.0, 264.0)])
        .words((706.0, 206.0), "planned halves")
        .flow(&[(590.0, 264.0), (590.0, 184.0)])
        .words((524.0, 206.0), "loaded, sampled")
        .flow(&[(420.0, 292.0), (460.0, 292.0)])
        .flow(&[(710.0, 292.0), (784.0, 292.0)])
        .words((748.0, 280.0), "half")
        .flow(&[(874.0, 322.0), (874.0, 392.0)])
        .words((906.0, 358.0), "gates")
        .flow(&[(960.0, 418.0), (974.0, 418.0), (974.0, 100.0), (964.0, 100.0)]);
    all.finish()
}
