//! Building blocks of the drive, and the same blocks from crates that one could use instead, on the same inputs. `cargo xtask timing` counts their
//! instructions in the emulator and takes their errors from the host.
//!
//! Every block has one form, input and output by reference, so that the cost of a call is the same for all: its loads and stores are included in the
//! count.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod blocks;
pub mod exact;

/// The input of every block; each picks what it needs.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// A phase angle, 2⁻³² turn.
    pub turn: u32,
    /// The same, in radians, −π ..= π.
    pub radians: f32,
    /// A vector of any direction.
    pub vector: [f32; 2],
    /// The same, 2⁻³⁰ of full scale.
    pub integers: [i32; 2],
    /// A current in the rotor frame, in A.
    pub current_a: [f32; 2],
    /// A positive number.
    pub positive: f32,
}

/// The result of a block.
pub type Output = [f32; 2];

/// A function under test.
#[derive(Clone, Copy)]
pub struct Block {
    /// Its work and its maker, as `sin_cos/tractive`.
    pub name: &'static str,
    /// The function; never inlined.
    pub run: fn(&Input, &mut Output),
    /// The exact result, in double precision; nothing where the results are not comparable.
    pub exact: Option<fn(&Input) -> [f64; 2]>,
}

/// Inputs of every run.
pub const INPUTS: u32 = 64;

/// The n-th input, spread evenly and never on an axis.
pub fn input(n: u32) -> Input {
    let turn = (n.wrapping_mul(2) + 1) << 25;
    let radians = turn as i32 as f32 * (core::f32::consts::PI / 2_147_483_648.0);
    let share = (n as f32 + 0.5) / INPUTS as f32;
    let length = 0.1 + 0.8 * share;
    let vector = [length * libm::cosf(3.0 * radians), length * libm::sinf(3.0 * radians)];
    Input {
        turn,
        radians,
        vector,
        integers: vector.map(|x| (x * 1_073_741_824.0) as i32),
        current_a: [-200.0 * share, 400.0 * (share - 0.5)],
        positive: 1000.0 * share * share,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest absolute error over all inputs.
    fn error(name: &str) -> f64 {
        let block = blocks::ALL.into_iter().find(|block| block.name == name).unwrap();
        let exact = block.exact.unwrap();
        let errors = (0..INPUTS).map(input).flat_map(|input| {
            let mut output = [0.0; 2];
            (block.run)(&input, &mut output);
            let exact = exact(&input);
            (0..2).map(move |k| (f64::from(output[k]) - exact[k]).abs())
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn our_blocks_are_as_exact_as_they_say() {
        assert!(error("sin_cos/tractive") < 1.5e-7);
        assert!(error("atan2/tractive") < 1e-6);
        // Half a unit in the last place of 31.6.
        assert!(error("sqrt/tractive") < 1e-6);
        assert!(error("lookup_2d/tractive") < 1e-6);
    }

    #[test]
    fn the_others_get_what_they_expect() {
        for block in blocks::ALL.into_iter().filter(|block| block.exact.is_some()) {
            let bound = if block.name.starts_with("sqrt") { 2.0 } else { 5e-3 };
            assert!(error(block.name) < bound, "{}", block.name);
        }
    }

    #[test]
    fn no_two_blocks_share_a_name() {
        for (k, block) in blocks::ALL.iter().enumerate() {
            assert!(blocks::ALL.iter().skip(k + 1).all(|other| other.name != block.name));
        }
    }
}
