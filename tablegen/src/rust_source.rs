//! The tables as Rust, for `include!` in the target's `machine` module.

use crate::{Axis, Generated};
use std::fmt::Write as _;

impl Generated {
    /// The source of `pub static BUILT_IN: Tables`. The same tables give the same text, byte for byte; every number is
    /// the nearest f32, printed so that it reads back as itself.
    pub fn rust_source(&self) -> String {
        let mut out = String::new();
        let (rows, columns) = (&self.current_axes.0, &self.current_axes.1);
        let (psi, share) = (&self.weakening.axes.0, &self.weakening.axes.1);
        array(&mut out, "FLUX", &self.flux);
        array(&mut out, "MTPA_PARAMETERS", &self.parameters);
        array(&mut out, "MTPA_UNIVERSAL", &self.universal);
        array(&mut out, "MTPA_START", &self.start);
        array(&mut out, "WEAKENING_CURRENTS", &self.weakening.currents);
        array(&mut out, "WEAKENING_TORQUE", &self.weakening.torque);
        let universal_axis = Axis { first: 0.0, inverse_step: (self.universal.len() - 1) as f32, count: 0 };
        // The struct's own debug form is its literal, under the target's name.
        let ratings = format!("{:#?}", self.ratings).replacen("RatingsF32", "Ratings", 1);
        let ratings = ratings.replace('\n', "\n    ");
        let _ = write!(
            out,
            "/// The machine of the folder that was chosen at build time.\n\
             pub static BUILT_IN: Tables = Tables {{\n    name: {:?},\n    ratings: {ratings},\n    \
             flux: {},\n    mtpa: Mtpa {{\n        universal: {},\n        parameters: {},\n        start: {},\n    }},\n    \
             weakening: Weakening {{\n        currents: {},\n        torque: {},\n        flux_knee_wb: {:?},\n        share_knee: {:?},\n    }},\n}};\n",
            self.name,
            grid("FLUX", rows, columns),
            curve("MTPA_UNIVERSAL", &universal_axis),
            grid("MTPA_PARAMETERS", rows, columns),
            curve("MTPA_START", &self.torque_axis),
            grid("WEAKENING_CURRENTS", psi, share),
            curve("WEAKENING_TORQUE", psi),
            self.weakening.flux_knee_wb,
            self.weakening.share_knee,
        );
        out
    }
}

fn array<const N: usize>(out: &mut String, name: &str, nodes: &[[f32; N]]) {
    let _ = write!(
        out,
        "#[allow(clippy::excessive_precision, clippy::unreadable_literal)]\nstatic {name}: [[f32; {N}]; {}] = [\n",
        nodes.len()
    );
    for line in nodes.chunks((8 / N).min(4)) {
        let text: Vec<_> = line.iter().map(|node| format!("{node:?}")).collect();
        let _ = writeln!(out, "    {},", text.join(", "));
    }
    out.push_str("];\n");
}

fn curve(name: &str, axis: &Axis) -> String {
    format!("Curve {{ first: {:?}, inverse_step: {:?}, nodes: &{name} }}", axis.first, axis.inverse_step)
}

fn grid(name: &str, rows: &Axis, columns: &Axis) -> String {
    format!(
        "Grid {{\n            first_row: {:?},\n            inverse_row_step: {:?},\n            rows: {},\n            \
         first_column: {:?},\n            inverse_column_step: {:?},\n            columns: {},\n            \
         nodes: &{name},\n        }}",
        rows.first, rows.inverse_step, rows.count, columns.first, columns.inverse_step, columns.count
    )
}
