//! Sums of light that are the same in any order, and so however the photons of a map are divided.

use kilauea_math::Spectrum;

use crate::Kernel;

/// Bits below those of the brightest photon in the middle of a disc: what is smaller is nothing. A
/// sum has room for 2³³ such photons.
const BITS_BELOW: i32 = 30;
/// A number to which others are added to be rounded: the last of its bits stands for one.
const ROUNDER: f64 = 6755399441055744.0;
/// Most units that are rounded so.
const MOST_UNITS: f64 = 2251799813685247.0;

/// The unit in which a look-up counts light: a power of two, by the brightest photon that there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightUnit {
    per_watt: f64,
}

impl LightUnit {
    /// For photons of up to `brightest` watts in a channel, of which each look-up within `radius`
    /// finds some.
    pub fn of(brightest: f32, kernel: Kernel, radius: f32) -> Self {
        let most = f64::from(brightest) * f64::from(kernel.weight(0.0, radius * radius));
        let is_any = most > 0.0 && most.is_finite();
        let exponent = if is_any {
            most.log2().floor() as i32
        } else {
            0
        };
        Self {
            per_watt: f64::exp2(f64::from(BITS_BELOW - exponent)),
        }
    }
}

/// Light that is added up in whole units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightSum {
    units: [i64; 3],
    is_spoiled: bool,
}

impl LightSum {
    /// Adds light.
    #[inline]
    pub fn add(&mut self, light: Spectrum, unit: LightUnit) {
        self.is_spoiled |= !light.is_finite();
        for (sum, value) in self.units.iter_mut().zip(light.to_array()) {
            // A conversion would take longer.
            let units = (f64::from(value) * unit.per_watt).min(MOST_UNITS) + ROUNDER;
            let units = units.to_bits().cast_signed() - ROUNDER.to_bits().cast_signed();
            *sum = sum.saturating_add(units);
        }
    }

    /// The sum; no number if something of it was none.
    #[inline]
    pub fn total(self, unit: LightUnit) -> Spectrum {
        if self.is_spoiled {
            return Spectrum::splat(f32::NAN);
        }
        let [r, g, b] = self.units.map(|n| (n as f64 / unit.per_watt) as f32);
        Spectrum::new(r, g, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::hash::{combine, unit_f32};

    /// Light of many sizes.
    fn light(i: u32) -> Spectrum {
        let random = |channel| unit_f32(combine(i, channel));
        let size = f32::exp2(-20.0 * random(3));
        Spectrum::new(random(0), random(1), random(2)) * size
    }

    fn sum(order: impl Iterator<Item = u32>, unit: LightUnit) -> Spectrum {
        let mut sum = LightSum::default();
        order.for_each(|i| sum.add(light(i), unit));
        sum.total(unit)
    }

    #[test]
    fn the_order_does_not_matter_to_any_bit() {
        let unit = LightUnit::of(1.0, Kernel::Epanechnikov, 0.7);
        let forth = sum(0..1000, unit);
        let by_parts =
            (0..3).flat_map(|part| (0..1000).filter(move |i| combine(*i, 9) % 3 == part));
        assert_eq!(forth, sum((0..1000).rev(), unit));
        assert_eq!(forth, sum(by_parts, unit));
        let plain: Spectrum = (0..1000).map(light).sum();
        for (a, b) in forth.to_array().iter().zip(plain.to_array()) {
            assert!((a / b - 1.0).abs() < 1e-5, "{a} for {b}");
        }
    }

    #[test]
    fn light_of_any_size_is_itself() {
        for size in [1e-30, 1e-3, 1.0, 1e20] {
            let unit = LightUnit::of(size, Kernel::Constant, 0.01);
            let mut sum = LightSum::default();
            let light = Spectrum::new(3.0, 200.0, 7e3) * size;
            sum.add(light, unit);
            for (a, b) in sum.total(unit).to_array().iter().zip(light.to_array()) {
                assert!((a / b - 1.0).abs() < 1e-5, "{a} for {b}");
            }
        }
        let none = LightUnit::of(0.0, Kernel::Constant, 0.01);
        assert!(LightSum::default().total(none).is_black());
    }

    #[test]
    fn what_is_no_number_spoils_the_sum() {
        let unit = LightUnit::of(1.0, Kernel::Constant, 1.0);
        for bad in [f32::NAN, f32::INFINITY] {
            let mut sum = LightSum::default();
            sum.add(Spectrum::new(1.0, bad, 0.0), unit);
            sum.add(Spectrum::ONE, unit);
            assert!(!sum.total(unit).is_finite());
        }
    }
}
