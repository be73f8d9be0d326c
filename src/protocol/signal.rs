//! Signals: numbers and flags in a frame's 64 bits, according to the description that the DBC file publishes.

use super::scales::{Quantity, Scales};

/// The eight bytes of a frame as one number: bit 0 is the lowest bit of the first byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Payload(pub u64);

/// The meaning of a signal's bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// A number without a sign.
    Unsigned,
    /// Two's complement.
    Signed,
    /// IEEE 754, 32 bits.
    Float,
}

/// A value that its signal cannot carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct OutOfRange;

impl core::fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut core::fmt::Formatter) -> core::fmt::Result {
        f.write_str("the value lies beyond what its signal can carry")
    }
}

impl core::error::Error for OutOfRange {}

/// A signal. Little-endian; its value is `raw · scale + offset`, on the usual [scales](super::Scales). Its methods stay out of line: nothing here is
/// time-critical, and sixty signals would otherwise be sixty copies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Name, with the unit if it has one.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Number of the lowest bit.
    pub start: u32,
    /// The number of bits.
    pub bits: u32,
    /// Their meaning.
    pub kind: Kind,
    /// Value of the lowest bit.
    pub scale: f32,
    /// Value of raw zero.
    pub offset: f32,
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// The page on which the signal is, in messages of several pages.
    pub page: Option<u32>,
    /// The quantity whose [scale](super::Scales) multiplies scale and range.
    pub quantity: Quantity,
}

impl Signal {
    /// A raw number from `start` on, 0 ..= `max`.
    pub const fn number(name: &'static str, start: u32, bits: u32, max: u32) -> Self {
        let max = max as f32;
        let (unit, kind, page, quantity) = ("", Kind::Unsigned, None, Quantity::Fixed);
        Self { name, unit, start, bits, kind, scale: 1.0, offset: 0.0, min: 0.0, max, page, quantity }
    }

    /// A flag.
    pub const fn flag(name: &'static str, start: u32) -> Self {
        Self::number(name, start, 1, 1)
    }

    /// A physical value in 16 bits, signed if its smallest value is below zero. A raw number beyond its range is free to say that there is no value.
    pub const fn physical(
        name: &'static str,
        unit: &'static str,
        start: u32,
        scale: f32,
        [min, max]: [f32; 2],
    ) -> Self {
        let kind = if min < 0.0 { Kind::Signed } else { Kind::Unsigned };
        let (offset, page, quantity) = (0.0, None, Quantity::Fixed);
        Self { name, unit, start, bits: 16, kind, scale, offset, min, max, page, quantity }
    }

    /// Any finite number, unscaled.
    pub const fn float(name: &'static str, start: u32) -> Self {
        let (unit, kind, page) = ("", Kind::Float, None);
        Self {
            name,
            unit,
            start,
            bits: 32,
            kind,
            scale: 1.0,
            offset: 0.0,
            min: f32::MIN,
            max: f32::MAX,
            page,
            quantity: Quantity::Fixed,
        }
    }

    /// The same signal on one page of several.
    pub const fn on_page(self, page: u32) -> Self {
        Self { page: Some(page), ..self }
    }

    /// The same signal, in steps that follow from the machine.
    pub const fn of(self, quantity: Quantity) -> Self {
        Self { quantity, ..self }
    }

    /// The bits that the signal occupies.
    pub const fn mask(&self) -> u64 {
        self.ones().wrapping_shl(self.start)
    }

    const fn ones(&self) -> u64 {
        if self.bits >= 64 { u64::MAX } else { 1_u64.wrapping_shl(self.bits) - 1 }
    }

    /// The raw bits.
    #[inline(never)]
    pub const fn raw(&self, payload: Payload) -> u32 {
        (payload.0.wrapping_shr(self.start) & self.ones()) as u32
    }

    /// Sets the raw bits; excess bits are cut off.
    #[inline(never)]
    pub const fn put_raw(&self, payload: &mut Payload, raw: u32) {
        payload.0 = payload.0 & !self.mask() | (raw as u64 & self.ones()).wrapping_shl(self.start);
    }

    /// `true` if a flag is set.
    pub const fn is_set(&self, payload: Payload) -> bool {
        self.raw(payload) != 0
    }

    /// The value; `None` outside its range, which is also the way "not available" is written.
    #[inline]
    pub fn get(&self, payload: Payload) -> Option<f32> {
        self.get_on(Scales::USUAL, payload)
    }

    /// The same on other scales.
    #[inline(never)]
    pub fn get_on(&self, scales: Scales, payload: Payload) -> Option<f32> {
        let raw = self.raw(payload);
        let steps = match self.kind {
            Kind::Float => {
                let value = f32::from_bits(raw);
                return value.is_finite().then_some(value);
            }
            Kind::Unsigned => raw as i32,
            Kind::Signed => {
                let unused = 32_u32.saturating_sub(self.bits);
                (raw.wrapping_shl(unused) as i32).wrapping_shr(unused)
            }
        };
        let inside = (self.steps(self.min)..=self.steps(self.max)).contains(&steps);
        inside.then_some((steps as f32 * self.scale + self.offset) * scales.worth(self.quantity))
    }

    /// Sets the value, rounded to the nearest step; an error if it is outside its range or not finite.
    #[inline]
    pub fn put(&self, payload: &mut Payload, value: f32) -> Result<(), OutOfRange> {
        self.put_on(Scales::USUAL, payload, value)
    }

    /// The same on other scales.
    #[inline(never)]
    pub fn put_on(&self, scales: Scales, payload: &mut Payload, value: f32) -> Result<(), OutOfRange> {
        let value = scales.to_usual(self.quantity, value);
        let within = value >= self.min && value <= self.max;
        if !within {
            return Err(OutOfRange);
        }
        let raw = if self.kind == Kind::Float { value.to_bits() } else { self.steps(value) as u32 };
        self.put_raw(payload, raw);
        Ok(())
    }

    /// Sets a measured value; if there is none, or it is outside the range, the raw number that says so.
    #[inline]
    pub fn put_measured(&self, payload: &mut Payload, value: Option<f32>) {
        self.put_measured_on(Scales::USUAL, payload, value);
    }

    /// The same on other scales.
    #[inline(never)]
    pub fn put_measured_on(&self, scales: Scales, payload: &mut Payload, value: Option<f32>) {
        if value.is_none_or(|value| self.put_on(scales, payload, value).is_err()) {
            self.put_raw(payload, self.not_available());
        }
    }

    /// The raw number that says "not available": all ones; for two's complement the most negative number; for floats NaN.
    pub const fn not_available(&self) -> u32 {
        match self.kind {
            Kind::Unsigned => self.ones() as u32,
            Kind::Signed => 1_u32.wrapping_shl(self.bits.wrapping_sub(1)),
            Kind::Float => f32::NAN.to_bits(),
        }
    }

    fn steps(&self, value: f32) -> i32 {
        let steps = (value - self.offset) / self.scale;
        (if steps < 0.0 { steps - 0.5 } else { steps + 0.5 }) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_physical_value_is_signed_where_it_can_be_negative() {
        for (min, signed) in [(-1.0, true), (0.0, false), (1.0, false)] {
            let Signal { kind, .. } = Signal::physical("X", "V", 0, 0.1, [min, 100.0]);
            assert_eq!(matches!(kind, Kind::Signed), signed, "from {min}");
        }
    }
}
