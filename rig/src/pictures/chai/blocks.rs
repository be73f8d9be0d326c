//! The first paper's block diagrams, figures 2 and 5, as they are built here.

use super::super::diagram::Diagram;
use super::super::sheet::{GREEN, VIOLET};
use anyhow::Result;

/// Figure 2: control and modulation run in the timer's interrupt, and the PWM interrupt plays.
pub fn control() -> Result<String> {
    let mut all = Diagram::new((1000, 430), "Control decides which voltage, modulation which pulses");
    all.part((16.0, 34.0, 760.0, 188.0), "timer interrupt: control", GREEN)
        .part(
            (16.0, 262.0, 760.0, 140.0),
            "timer interrupt: modulation, for each carrier half; PWM interrupt: plays it",
            VIOLET,
        )
        .block((88.0, 96.0, 110.0, 60.0), "torque\nenvelope, slew")
        .block((240.0, 62.0, 140.0, 54.0), "MTPA\ntwo look-ups")
        .block((240.0, 140.0, 140.0, 60.0), "field weakening\non circles of flux")
        .block((422.0, 96.0, 110.0, 60.0), "whichever is\nfurther left\nin i_{d}")
        .block(
            (610.0, 82.0, 146.0, 88.0),
            "current loop\ndecoupled, on the\nflux predicted for\nthe next boundary",
        )
        .block((60.0, 308.0, 150.0, 62.0), "mode\nby frequency\nand voltage")
        .block((280.0, 308.0, 190.0, 62.0), "pulses of the next half\nasync, 15, 12, 7, 3, square")
        .block((550.0, 308.0, 190.0, 62.0), "PWM interrupt: length,\nstart levels, toggles")
        .block((830.0, 308.0, 130.0, 62.0), "inverter\n900 Hz at most")
        .block((830.0, 96.0, 130.0, 62.0), "PMaSynRM");
    all.flow(&[(24.0, 126.0), (88.0, 126.0)])
        .words((52.0, 114.0), "T*")
        .flow(&[(198.0, 118.0), (218.0, 118.0), (218.0, 90.0), (240.0, 90.0)])
        .flow(&[(198.0, 134.0), (218.0, 134.0), (218.0, 170.0), (240.0, 170.0)])
        .flow(&[(380.0, 90.0), (402.0, 90.0), (402.0, 114.0), (422.0, 114.0)])
        .flow(&[(380.0, 170.0), (402.0, 170.0), (402.0, 138.0), (422.0, 138.0)])
        .flow(&[(532.0, 126.0), (610.0, 126.0)])
        .words((571.0, 114.0), "i_{d}*, i_{q}*")
        .flow(&[(650.0, 170.0), (650.0, 236.0), (21.0, 236.0), (21.0, 338.0), (60.0, 338.0)])
        .words((250.0, 248.0), "voltage, angle, frequency")
        .flow(&[(210.0, 338.0), (280.0, 338.0)])
        .flow(&[(470.0, 338.0), (550.0, 338.0)])
        .flow(&[(740.0, 338.0), (830.0, 338.0)])
        .words((803.0, 326.0), "gates")
        .flow(&[(895.0, 308.0), (895.0, 158.0)])
        .words((930.0, 232.0), "u_{uvw}")
        .flow(&[(895.0, 96.0), (895.0, 56.0), (683.0, 56.0), (683.0, 82.0)])
        .words((836.0, 44.0), "i_{uvw}, θ, u_{dc}")
        .flow(&[(722.0, 262.0), (722.0, 170.0)])
        .words((648.0, 250.0), "cell: what was loaded");
    all.finish()
}

/// Figure 5: MTPA in two look-ups, with what is added here.
pub fn mtpa() -> Result<String> {
    let mut all = Diagram::new(
        (1000, 330),
        "MTPA in two look-ups; the start and the trim come from the optimum found offline",
    );
    all.part((150.0, 40.0, 380.0, 170.0), "first pass", GREEN).part(
        (570.0, 40.0, 320.0, 170.0),
        "second pass",
        VIOLET,
    );
    all.block((20.0, 226.0, 120.0, 60.0), "start table\ni_{d}, i_{q} over T")
        .block((170.0, 126.0, 110.0, 66.0), "2-D tables\nψ_{f}, L_{q} − L_{d}")
        .block((310.0, 70.0, 90.0, 122.0), "T*/t_{eb}\n(9)\n\ni_{dn} = f(t_{en})\n(12)")
        .block((430.0, 70.0, 90.0, 122.0), "× i_{b}\n(10)\n\ni_{q} of i_{d}\n(13)")
        .block((580.0, 126.0, 110.0, 66.0), "2-D tables\nat that current")
        .block((720.0, 70.0, 150.0, 122.0), "the same once more\n\nt_{en}, i_{dn}, i_{qn},\n× i_{b}")
        .block((720.0, 226.0, 150.0, 60.0), "trim table\nover T");
    all.flow(&[(20.0, 90.0), (310.0, 90.0)])
        .words((80.0, 78.0), "T*")
        .flow(&[(80.0, 90.0), (80.0, 226.0)])
        .node((80.0, 90.0))
        .flow(&[(140.0, 256.0), (225.0, 256.0), (225.0, 192.0)])
        .flow(&[(280.0, 158.0), (310.0, 158.0)])
        .flow(&[(400.0, 131.0), (430.0, 131.0)])
        .flow(&[(520.0, 158.0), (580.0, 158.0)])
        .words((550.0, 146.0), "i_{d}, i_{q}")
        .flow(&[(690.0, 158.0), (720.0, 158.0)])
        .flow(&[(250.0, 90.0), (250.0, 58.0), (690.0, 58.0), (690.0, 90.0), (720.0, 90.0)])
        .node((250.0, 90.0))
        .flow(&[(870.0, 131.0), (916.0, 131.0)])
        .block((916.0, 116.0, 30.0, 30.0), "+")
        .flow(&[(870.0, 256.0), (931.0, 256.0), (931.0, 146.0)])
        .flow(&[(80.0, 286.0), (80.0, 310.0), (795.0, 310.0), (795.0, 286.0)])
        .flow(&[(946.0, 131.0), (988.0, 131.0)])
        .words((966.0, 104.0), "i_{d}*, i_{q}*");
    all.finish()
}
