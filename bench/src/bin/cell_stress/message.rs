//! The message: a number, words that follow from it, and their checksum.

use tractive::cell::Words;

/// `N` words: the number, what follows from it, the checksum.
#[derive(Clone, Copy)]
pub struct Message<const N: usize>([u32; N]);

impl<const N: usize> Message<N> {
    /// Before the first one.
    pub const BLANK: Self = Self([0; N]);

    /// The message with this number.
    pub fn number(number: u32) -> Self {
        let mut words = [0; N];
        let mut word = number;
        for slot in &mut words {
            *slot = word;
            word = word.rotate_left(5).wrapping_mul(0x9E37_79B1) ^ number;
        }
        let sum = checksum(&words);
        if let Some(last) = words.last_mut() {
            *last = sum;
        }
        Self(words)
    }

    /// Its number, if it is whole.
    pub fn whole(&self) -> Option<u32> {
        let last = self.0.last().copied();
        (last == Some(checksum(&self.0))).then(|| self.0.first().copied()).flatten()
    }

    /// The number it claims, whole or not.
    pub fn claimed(&self) -> u32 {
        self.0.first().copied().unwrap_or(0)
    }
}

/// Over all words but the last.
fn checksum(words: &[u32]) -> u32 {
    let body = words.split_last().map_or(&[][..], |(_, body)| body);
    body.iter().fold(0x811C_9DC5, |sum: u32, word| (sum ^ word).wrapping_mul(0x0100_0193).rotate_left(7))
}

impl<const N: usize> Words<N> for Message<N> {
    fn to_words(self) -> [u32; N] {
        self.0
    }

    fn from_words(words: [u32; N]) -> Self {
        Self(words)
    }
}
