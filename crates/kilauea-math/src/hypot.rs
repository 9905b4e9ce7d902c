/// The length of a vector, as the C library has it: squares of `f32` are exact in `f64`, and never
/// too large.
#[inline]
pub fn hypot(x: f32, y: f32) -> f32 {
    let (x, y) = (f64::from(x), f64::from(y));
    (x * x + y * y).sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::mix32;

    #[test]
    fn lengths_are_rounded_once_at_all_scales() {
        for i in 0..100_000 {
            let number = |of: u32| f32::from_bits(mix32(2 * i + of) & 0x7fff_ffff);
            let (x, y) = (number(0), number(1));
            if x.is_finite() && y.is_finite() {
                let exact = f64::from(x).hypot(f64::from(y));
                let error = f64::from(hypot(x, -y)) - exact;
                let ulp = exact.max(f64::from(f32::MIN_POSITIVE)) * f64::from(f32::EPSILON);
                assert!(
                    error.abs() <= 0.5001 * ulp || exact > f64::from(f32::MAX),
                    "{x} {y}"
                );
            }
        }
    }
}
