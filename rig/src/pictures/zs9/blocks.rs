//! The second paper's circuit and block diagrams: figures 1, 10 and 11.

use super::super::diagram::Diagram;
use super::super::sheet::{BLUE, GREEN, RED, VIOLET};
use anyhow::Result;

/// Figure 1: source, Z-network, nine switches, two motors.
pub fn circuit() -> Result<String> {
    const RAILS: (f64, f64) = (70.0, 390.0);
    let mut all = Diagram::new((980, 460), "Z-source nine-switch inverter with two motors");
    let (top, bottom) = RAILS;
    all.part((150.0, 40.0, 260.0, 380.0), "Z-network", GREEN).part(
        (430.0, 40.0, 280.0, 380.0),
        "nine switches",
        BLUE,
    );
    // The source and its switch, which carries current in both directions.
    all.wire(&[(40.0, 210.0), (40.0, top), (70.0, top)])
        .block((70.0, top - 16.0, 60.0, 32.0), "S_{1} ⇄")
        .wire(&[(130.0, top), (190.0, top)])
        .wire(&[(40.0, 250.0), (40.0, bottom), (190.0, bottom)])
        .block((14.0, 210.0, 52.0, 40.0), "U_{dc}")
        .words((100.0, 108.0), "both ways");
    // Inductors in the rails, capacitors crosswise.
    for (y, name) in [(top, "L_{1}"), (bottom, "L_{2}")] {
        all.block((230.0, y - 13.0, 100.0, 26.0), name);
        all.wire(&[(190.0, y), (230.0, y)]).wire(&[(330.0, y), (370.0, y)]).wire(&[(370.0, y), (660.0, y)]);
    }
    for (left, right, name, at) in [(top, bottom, "C_{1}", 0.3), (bottom, top, "C_{2}", 0.3)] {
        let point = |share: f64| (190.0 + 180.0 * share, left + (right - left) * share);
        let (from, to) = (point(at - 0.03), point(at + 0.03));
        all.wire(&[(190.0, left), from]).wire(&[to, (370.0, right)]);
        let length = (180.0_f64).hypot(right - left);
        let (dx, dy) = (14.0 * (right - left) / length, -14.0 * 180.0 / length);
        for (x, y) in [from, to] {
            all.wire(&[(x - dx, y - dy), (x + dx, y + dy)]);
        }
        let y = if left < right { -24.0 } else { 24.0 };
        all.words((from.0 + 38.0, from.1 + y * 0.3), name);
    }
    all.words((419.0, 58.0), "U_{in}");
    for (k, leg) in ["U", "V", "W"].into_iter().enumerate() {
        let x = 470.0 + 90.0 * k as f64;
        all.wire(&[(x, top), (x, bottom)]).node((x, top)).node((x, bottom));
        for (row, name) in ["H", "M", "L"].into_iter().enumerate() {
            all.block((x - 24.0, 92.0 + 107.0 * row as f64, 48.0, 44.0), &format!("{leg}{name}"));
        }
        // The upper motor hangs on the H–M nodes, the lower one on the M–L nodes.
        let step = 12.0 * k as f64;
        let (upper, lower) = (154.0 + step, 262.0 + step);
        all.node((x, upper)).wire(&[(x, upper), (790.0, upper)]);
        all.node((x, lower)).wire(&[(x, lower), (790.0, lower)]);
    }
    all.block((790.0, 136.0, 150.0, 60.0), "upper motor\nPMSM_{1}")
        .block((790.0, 244.0, 150.0, 60.0), "lower motor\nPMSM_{2}");
    all.note((726.0, 340.0), "H–M nodes feed the upper motor,")
        .note((726.0, 356.0), "M–L nodes the lower one.");
    all.note((726.0, 380.0), "All three switches of a leg on:")
        .note((726.0, 396.0), "shoot-through, which raises the link.");
    all.finish()
}

/// Figure 10: control of the whole system.
pub fn control() -> Result<String> {
    let mut all = Diagram::new(
        (1000, 480),
        "Control of link and both motors: one PWM interrupt loads the nine gates of the next period",
    );
    all.part((16.0, 34.0, 546.0, 126.0), "link", GREEN)
        .part((16.0, 174.0, 546.0, 126.0), "motor 1", BLUE)
        .part((16.0, 318.0, 546.0, 130.0), "motor 2", RED)
        .part((626.0, 34.0, 354.0, 414.0), "inverter", VIOLET);
    all.block((150.0, 70.0, 170.0, 62.0), "v_{C} and i_{L} loops\n(figure 11)")
        .block((400.0, 70.0, 150.0, 62.0), "kept first: motors\nhave what is left");
    all.flow(&[(40.0, 101.0), (150.0, 101.0)])
        .words((90.0, 89.0), "U_{in}*")
        .flow(&[(320.0, 101.0), (400.0, 101.0)]);
    all.words((360.0, 89.0), "D");
    for (k, top) in [170.0, 318.0].into_iter().enumerate() {
        let motor = k + 1;
        all.block((84.0, top + 36.0, 96.0, 70.0), "speed loop,\nor torque as\ndemanded")
            .block((226.0, top + 36.0, 126.0, 70.0), "MTPA, weakening\nlimit filtered\nat 10 Hz")
            .block((420.0, top + 36.0, 130.0, 70.0), "current loop\non predicted\nflux");
        all.flow(&[(28.0, top + 71.0), (84.0, top + 71.0)])
            .words((52.0, top + 58.0), &format!("n_{{{motor}}}*, T_{{{motor}}}*"))
            .flow(&[(180.0, top + 71.0), (226.0, top + 71.0)])
            .words((203.0, top + 60.0), &format!("T_{{{motor}}}"))
            .flow(&[(352.0, top + 71.0), (420.0, top + 71.0)])
            .words((386.0, top + 58.0), "i_{d}, i_{q}");
    }
    all.block(
        (644.0, 186.0, 120.0, 118.0),
        "sequence of\nthe scheme,\n÷ U_{in} in the\nmiddle of the\nperiod",
    )
    .block((840.0, 70.0, 120.0, 62.0), "Z-network,\nsource")
    .block((840.0, 206.0, 120.0, 76.0), "nine\nswitches")
    .block((644.0, 366.0, 110.0, 54.0), "PMSM_{1}")
    .block((840.0, 366.0, 110.0, 54.0), "PMSM_{2}");
    all.flow(&[(550.0, 101.0), (668.0, 101.0), (668.0, 186.0)])
        .words((594.0, 89.0), "D")
        .flow(&[(550.0, 241.0), (644.0, 241.0)])
        .words((594.0, 229.0), "V_{ref1}")
        .flow(&[(550.0, 389.0), (606.0, 389.0), (606.0, 280.0), (644.0, 280.0)])
        .words((594.0, 402.0), "V_{ref2}")
        .flow(&[(764.0, 245.0), (840.0, 245.0)])
        .words((802.0, 233.0), "9 gates")
        .flow(&[(900.0, 132.0), (900.0, 206.0)])
        .words((925.0, 170.0), "U_{in}")
        .flow(&[(870.0, 282.0), (870.0, 332.0), (699.0, 332.0), (699.0, 366.0)])
        .flow(&[(900.0, 282.0), (900.0, 366.0)])
        .note((640.0, 436.0), "back to all three: currents, angles, v_{C}, i_{L}, U_{dc}")
        .flow(&[(840.0, 101.0), (720.0, 101.0), (720.0, 148.0), (235.0, 148.0), (235.0, 132.0)])
        .words((778.0, 89.0), "v_{C}, i_{L}, U_{dc}");
    all.finish()
}

/// Figure 11: control of the link's voltage by means of the capacitors'.
pub fn link() -> Result<String> {
    let mut all = Diagram::new(
        (1000, 270),
        "Control of the link: the capacitors' voltage outside, the inductors' current inside",
    );
    all.block((90.0, 80.0, 130.0, 60.0), "(U_{in}* + U_{dc})/2")
        .block((290.0, 95.0, 30.0, 30.0), "−")
        .block((370.0, 80.0, 90.0, 60.0), "PI")
        .block((510.0, 95.0, 30.0, 30.0), "+")
        .block((590.0, 95.0, 30.0, 30.0), "−")
        .block((670.0, 72.0, 200.0, 76.0), "(v_{C} − U_{dc}\n+ ω_{i} L Δi + r i_{L})\n÷ (2 v_{C} − U_{dc})")
        .block((440.0, 190.0, 170.0, 50.0), "motors' power ÷ U_{dc}");
    all.flow(&[(20.0, 110.0), (90.0, 110.0)])
        .words((52.0, 98.0), "U_{in}*")
        .flow(&[(220.0, 110.0), (290.0, 110.0)])
        .words((252.0, 98.0), "v_{C}*")
        .flow(&[(320.0, 110.0), (370.0, 110.0)])
        .flow(&[(460.0, 110.0), (510.0, 110.0)])
        .flow(&[(525.0, 190.0), (525.0, 125.0)])
        .flow(&[(540.0, 110.0), (590.0, 110.0)])
        .words((565.0, 98.0), "i_{L}*")
        .flow(&[(620.0, 110.0), (670.0, 110.0)])
        .words((645.0, 98.0), "Δi")
        .flow(&[(870.0, 110.0), (970.0, 110.0)])
        .words((920.0, 98.0), "D")
        .flow(&[(305.0, 60.0), (305.0, 95.0)])
        .words((322.0, 56.0), "v_{C}")
        .flow(&[(605.0, 60.0), (605.0, 95.0)])
        .words((622.0, 56.0), "i_{L}")
        .note((626.0, 216.0), "fed forward: the paper has the two loops alone");
    all.finish()
}
