use std::ops::{AddAssign, MulAssign};

use crate::Spectrum;

/// A [`Spectrum`] in 12 bytes instead of 16, for what is kept while other things are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PackedSpectrum([f32; 3]);

impl PackedSpectrum {
    /// Zero in every channel.
    pub const BLACK: Self = Self([0.0; 3]);
    /// One in every channel.
    pub const ONE: Self = Self([1.0; 3]);

    /// The spectrum to compute with.
    #[inline(always)]
    pub fn unpack(self) -> Spectrum {
        let [r, g, b] = self.0;
        Spectrum::new(r, g, b)
    }
}

impl From<Spectrum> for PackedSpectrum {
    #[inline(always)]
    fn from(spectrum: Spectrum) -> Self {
        Self(spectrum.to_array())
    }
}

impl AddAssign<Spectrum> for PackedSpectrum {
    #[inline(always)]
    fn add_assign(&mut self, rhs: Spectrum) {
        *self = (self.unpack() + rhs).into();
    }
}

impl MulAssign<Spectrum> for PackedSpectrum {
    #[inline(always)]
    fn mul_assign(&mut self, rhs: Spectrum) {
        *self = (self.unpack() * rhs).into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packing_keeps_every_bit() {
        let spectrum = Spectrum::new(1e-40, -0.0, f32::INFINITY);
        let bits = |s: Spectrum| s.to_array().map(f32::to_bits);
        let packed = PackedSpectrum::from(spectrum);
        assert_eq!(bits(packed.unpack()), bits(spectrum));
        assert_eq!(size_of_val(&packed), 12);
    }

    #[test]
    fn sums_and_products_are_those_of_the_spectrum() {
        let (a, b) = (Spectrum::new(0.1, 0.2, 0.3), Spectrum::new(0.7, 0.6, 0.5));
        let mut packed = PackedSpectrum::from(a);
        packed += b;
        packed *= a;
        assert_eq!(packed.unpack(), (a + b) * a);
    }
}
