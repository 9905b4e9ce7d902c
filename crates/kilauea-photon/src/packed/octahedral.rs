//! Unit vectors as points of a square that unfolds an octahedron (Meyer et al. 2010; Cigolle et
//! al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors").

use kilauea_math::{Vec2, Vec3};

/// A direction in four bytes, off by less than 0.0037 degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Direction32([u16; 2]);

/// A direction in two bytes, off by less than 0.95 degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Direction16([u8; 2]);

impl Direction32 {
    pub(crate) fn encode(direction: Vec3) -> Self {
        Self(
            to_square(direction)
                .to_array()
                .map(|v| quantize(v, u16::MAX.into()) as u16),
        )
    }

    #[inline]
    pub(crate) fn decode(self) -> Vec3 {
        from_square(Vec2::from_array(
            self.0.map(|q| dequantize(q.into(), u16::MAX.into())),
        ))
    }
}

impl Direction16 {
    pub(crate) fn encode(direction: Vec3) -> Self {
        Self(
            to_square(direction)
                .to_array()
                .map(|v| quantize(v, u8::MAX.into()) as u8),
        )
    }

    #[inline]
    pub(crate) fn decode(self) -> Vec3 {
        from_square(Vec2::from_array(
            self.0.map(|q| dequantize(q.into(), u8::MAX.into())),
        ))
    }
}

/// The point in [-1, 1]² of a direction: z > 0 within |x| + |y| < 1, the rest folded outward.
fn to_square(v: Vec3) -> Vec2 {
    let projected = Vec2::new(v.x, v.y) / (v.x.abs() + v.y.abs() + v.z.abs());
    if v.z >= 0.0 {
        projected
    } else {
        fold(projected)
    }
}

#[inline]
fn from_square(s: Vec2) -> Vec3 {
    let z = 1.0 - s.x.abs() - s.y.abs();
    let xy = if z >= 0.0 { s } else { fold(s) };
    Vec3::new(xy.x, xy.y, z).normalize()
}

/// Mirrors each corner triangle of the square at its diagonal; its own inverse.
#[inline]
fn fold(s: Vec2) -> Vec2 {
    Vec2::new(
        (1.0 - s.y.abs()).copysign(s.x),
        (1.0 - s.x.abs()).copysign(s.y),
    )
}

fn quantize(v: f32, steps: u32) -> u32 {
    ((0.5 * v + 0.5) * steps as f32).round() as u32
}

#[inline]
fn dequantize(q: u32, steps: u32) -> f32 {
    q as f32 * (2.0 / steps as f32) - 1.0
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
