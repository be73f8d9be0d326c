//! Building blocks of the drive, and the same from crates one could pick instead, on the same inputs. `cargo xtask timing`
//! counts their instructions in the emulator and takes their errors from the host.
//!
//! Every block has one form, input and output by reference, so that what it costs to call is the same for all: the
//! loads and stores are counted with it.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod blocks;
pub mod exact;

/// What every block reads; each picks what it needs.
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

/// What a block computes.
pub type Output = [f32; 2];

/// A function under test.
#[derive(Clone, Copy)]
pub struct Block {
    /// What it does and who makes it, as `sin_cos/tractive`.
    pub name: &'static str,
    /// The function; stands out of line.
    pub run: fn(&Input, &mut Output),
    /// What it should compute, in double precision; nothing where the results are not comparable.
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
