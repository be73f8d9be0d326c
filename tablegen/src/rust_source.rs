//! The tables as Rust, for `include!` in a module of a firmware.

use std::fmt::Write as _;
use tractive_control::machine::{Curve, Grid, Tables};

/// The source of a machine's tables: `pub static BUILT_IN: Tables`, and `pub struct BuiltIn`, through which the compiler knows every number of them
/// where a task is generic over its machine. `types` is the path of tractive-control's module `machine`, for example `tractive::machine`. The same
/// tables give the same text, byte for byte; every number is the nearest f32, printed so that parsing gives the same value.
pub fn rust_source(tables: &Tables, types: &str) -> String {
    let Tables { name, ratings, flux, mtpa, weakening, z_source } = tables;
    let mut out = format!(
        "use {types}::{{Curve, Grid, IronLoss, Machine, Mtpa, Ratings, Tables, Weakening, ZSourceNetwork}};\n\n"
    );
    let flux = grid(&mut out, "FLUX", flux);
    let parameters = grid(&mut out, "MTPA_PARAMETERS", &mtpa.parameters);
    let universal = curve(&mut out, "MTPA_UNIVERSAL", &mtpa.universal);
    let start = curve(&mut out, "MTPA_START", &mtpa.start);
    let curvature = curve(&mut out, "MTPA_CURVATURE", &mtpa.curvature);
    let currents = grid(&mut out, "WEAKENING_CURRENTS", &weakening.currents);
    let torque = curve(&mut out, "WEAKENING_TORQUE", &weakening.torque);
    let (flux_knee_wb, share_knee) = (weakening.flux_knee_wb, weakening.share_knee);
    // A struct's own debug format is its literal.
    let [ratings, z_source] =
        [format!("{ratings:#?}"), format!("{z_source:#?}")].map(|text| text.replace('\n', "\n    "));
    let _ = write!(
        out,
        "/// The tables of the machine that was chosen at build time.
pub static BUILT_IN: Tables = Tables {{
    name: {name:?},
    ratings: {ratings},
    flux: {flux},
    mtpa: Mtpa {{
        universal: {universal},
        parameters: {parameters},
        start: {start},
        curvature: {curvature},
    }},
    weakening: Weakening {{
        currents: {currents},
        torque: {torque},
        flux_knee_wb: {flux_knee_wb:?},
        share_knee: {share_knee:?},
    }},
    z_source: {z_source},
}};

/// The machine of [`BUILT_IN`].
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn;

impl Machine for BuiltIn {{
    #[inline(always)]
    fn tables(self) -> &'static Tables {{
        &BUILT_IN
    }}
}}
"
    );
    out
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

fn curve<const N: usize>(out: &mut String, name: &str, curve: &Curve<N>) -> String {
    array(out, name, curve.nodes);
    format!("Curve {{ first: {:?}, inverse_step: {:?}, nodes: &{name} }}", curve.first, curve.inverse_step)
}

fn grid<const N: usize>(out: &mut String, name: &str, grid: &Grid<N>) -> String {
    array(out, name, grid.nodes);
    let Grid { first_row, inverse_row_step, rows, first_column, inverse_column_step, columns, nodes: _ } =
        grid;
    format!(
        "Grid {{
            first_row: {first_row:?},
            inverse_row_step: {inverse_row_step:?},
            rows: {rows},
            first_column: {first_column:?},
            inverse_column_step: {inverse_column_step:?},
            columns: {columns},
            nodes: &{name},
        }}"
    )
}
