//! Power in four bytes: three mantissas of nine bits with one exponent of five, as in the texture
//! format RGB9E5, but rounded at random so that the expectation is exact, and with exponents that
//! reach down from the brightest photon of a map.

use kilauea_math::Spectrum;
use kilauea_math::hash::{combine, unit_f32};

const MANTISSA_BITS: u32 = 9;
const MAX_MANTISSA: u32 = (1 << MANTISSA_BITS) - 1;
const N_EXPONENTS: usize = 32;
/// Exponent of the smallest positive `f32`.
const SMALLEST_EXPONENT: i32 = -149;

/// The 32 units in which the powers of one map are counted, each twice the one before.
///
/// A channel is off by less than one unit, which is at most 1/255 of the photon's largest channel
/// (or 2⁻³⁹ of the map's largest, if that is more), and right in expectation.
#[derive(Clone, Debug)]
pub(crate) struct PowerScale {
    smallest_exponent: i32,
    units: [f32; N_EXPONENTS],
}

impl PowerScale {
    /// A scale for channels up to `max_channel`.
    pub(crate) fn up_to(max_channel: f32) -> Self {
        let largest_exponent = unit_exponent(max_channel);
        let smallest_exponent =
            (largest_exponent - (N_EXPONENTS as i32 - 1)).max(SMALLEST_EXPONENT);
        Self {
            smallest_exponent,
            units: std::array::from_fn(|e| exp2(smallest_exponent + e as i32) as f32),
        }
    }

    /// Rounds each channel up or down at random, keyed by `key`.
    pub(crate) fn encode(&self, power: Spectrum, key: u32) -> u32 {
        let exponent = (unit_exponent(power.max_channel()) - self.smallest_exponent)
            .clamp(0, N_EXPONENTS as i32 - 1);
        let per_unit = exp2(-(exponent + self.smallest_exponent));
        let mut code = (exponent as u32) << (3 * MANTISSA_BITS);
        for (channel, value) in (0..).zip(power.to_array()) {
            let exact = f64::from(value) * per_unit;
            let round_up = f64::from(unit_f32(combine(key, channel))) < exact.fract();
            code |= (exact as u32 + u32::from(round_up)) << (channel * MANTISSA_BITS);
        }
        code
    }

    /// The power that a code stands for.
    #[inline]
    pub(crate) fn decode(&self, code: u32) -> Spectrum {
        let unit = self.units[(code >> (3 * MANTISSA_BITS)) as usize];
        let mantissa = |channel: u32| (code >> (channel * MANTISSA_BITS) & MAX_MANTISSA) as f32;
        Spectrum::new(mantissa(0), mantissa(1), mantissa(2)) * unit
    }
}

/// Exponent of the smallest unit of which `value` is at most `MAX_MANTISSA`.
fn unit_exponent(value: f32) -> i32 {
    let unit = f64::from(value) / f64::from(MAX_MANTISSA);
    let bits = unit.to_bits();
    let floor = (bits >> 52) as i32 - 1023;
    let is_power_of_two = bits & ((1 << 52) - 1) == 0;
    floor + i32::from(!is_power_of_two)
}

/// A power of two in the range of normal numbers.
fn exp2(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_testing::{Family, Moments};

    /// Codes of one power under many keys.
    fn decoded(scale: &PowerScale, power: Spectrum, n_keys: u32) -> Vec<Spectrum> {
        let code = |key| scale.decode(scale.encode(power, kilauea_math::hash::mix32(key)));
        (0..n_keys).map(code).collect()
    }

    #[test]
    fn each_channel_is_less_than_a_unit_off() {
        let scale = PowerScale::up_to(7.0);
        for power in [
            Spectrum::new(7.0, 0.3, 1e-5),
            Spectrum::new(1e-4, 3e-4, 2e-4),
            Spectrum::new(2.0, 2.0, 2.0),
        ] {
            let bound = power.max_channel() / 255.0;
            for found in decoded(&scale, power, 200) {
                for (a, b) in power.to_array().iter().zip(found.to_array()) {
                    assert!((a - b).abs() <= bound, "{a} became {b}");
                }
            }
        }
    }

    #[test]
    fn the_expectation_is_exact_over_the_whole_range() {
        let scale = PowerScale::up_to(1000.0);
        let mut family = Family::new("rounded powers");
        for power in [
            Spectrum::new(999.3, 0.017, 311.1),
            Spectrum::new(0.123, 0.0007, 0.0451),
            // Below the smallest unit, where most become black.
            Spectrum::new(3e-10, 1e-10, 2e-10),
        ] {
            let found = decoded(&scale, power, 20_000);
            for (channel, expected) in power.to_array().into_iter().enumerate() {
                let values: Vec<f64> = found.iter().map(|s| f64::from(s[channel])).collect();
                let p = Moments::of(&values).p_value(f64::from(expected), 0.0);
                family.add(format!("{power:?} {channel}"), p);
            }
        }
        family.check();
    }

    #[test]
    fn what_is_a_whole_number_of_units_stays_exact() {
        let scale = PowerScale::up_to(511.0);
        for power in [
            Spectrum::new(511.0, 1.0, 0.0),
            Spectrum::BLACK,
            Spectrum::splat(0.25),
        ] {
            assert!(
                decoded(&scale, power, 50)
                    .iter()
                    .all(|&found| found == power)
            );
        }
    }

    #[test]
    fn extreme_maps_neither_overflow_nor_vanish() {
        for max in [1e30, 1e-30, f32::MIN_POSITIVE] {
            let found = PowerScale::up_to(max).encode(Spectrum::splat(max), 1);
            let decoded = PowerScale::up_to(max).decode(found)[0];
            assert!(
                (decoded / max - 1.0).abs() < 1.0 / 255.0,
                "{max} became {decoded}"
            );
        }
        assert!(
            PowerScale::up_to(0.0)
                .decode(PowerScale::up_to(0.0).encode(Spectrum::BLACK, 1))
                .is_black()
        );
    }
}
