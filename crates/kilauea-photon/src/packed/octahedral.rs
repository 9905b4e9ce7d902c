//! Unit vectors in a few bytes, by the octahedral map (Cigolle et al. 2014, "A Survey of Efficient
//! Representations for Independent Unit Vectors").

use kilauea_math::octahedral::{direction_from_square, square_from_direction};
use kilauea_math::{Vec2, Vec3};

/// A direction in four bytes, off by less than 0.0037 degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Direction32([u16; 2]);

/// A direction in two bytes, off by less than 0.95 degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Direction16([u8; 2]);

impl Direction32 {
    const STEPS: f32 = u16::MAX as f32;

    pub(crate) fn encode(direction: Vec3) -> Self {
        let square = square_from_direction(direction).to_array();
        Self(square.map(|v| (v * Self::STEPS).round() as u16))
    }

    #[inline]
    pub(crate) fn decode(self) -> Vec3 {
        let square = self.0.map(|q| f32::from(q) * (1.0 / Self::STEPS));
        direction_from_square(Vec2::from_array(square))
    }
}

impl Direction16 {
    const STEPS: f32 = u8::MAX as f32;

    pub(crate) fn encode(direction: Vec3) -> Self {
        let square = square_from_direction(direction).to_array();
        Self(square.map(|v| (v * Self::STEPS).round() as u8))
    }

    #[inline]
    pub(crate) fn decode(self) -> Vec3 {
        let square = self.0.map(|q| f32::from(q) * (1.0 / Self::STEPS));
        direction_from_square(Vec2::from_array(square))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::warp;
    use kilauea_testing::uniforms;

    fn directions() -> impl Iterator<Item = Vec3> {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z]
            .into_iter()
            .flat_map(|v| [v, -v]);
        let uniform = (0..50_000).map(|i| warp::uniform_sphere(Vec2::from_array(uniforms(3, i))));
        axes.chain(uniform)
    }

    /// The angle by its chord, which loses no digits near zero.
    fn degrees_between(a: Vec3, b: Vec3) -> f32 {
        (2.0 * (0.5 * a.distance(b)).asin()).to_degrees()
    }

    #[test]
    fn errors_stay_below_their_bounds() {
        for v in directions() {
            let fine = degrees_between(Direction32::encode(v).decode(), v);
            let coarse = degrees_between(Direction16::encode(v).decode(), v);
            assert!(fine < 0.0037, "{v}: {fine}");
            assert!(coarse < 0.95, "{v}: {coarse}");
        }
    }
}
