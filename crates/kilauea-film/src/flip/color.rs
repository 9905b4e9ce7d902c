//! Color spaces of FLIP; linear Rec. 709 is the only one outside of this file and `ldr`.

use kilauea_math::{Mat3, Vec3};

/// Rows give X, Y and Z of linear Rec. 709 light.
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [0.412_386_56, 0.357_591_5, 0.180_450_48],
    [0.212_636_82, 0.715_183, 0.072_180_2],
    [0.019_330_62, 0.119_197_16, 0.950_372_6],
];

/// Conversions between color spaces, all for D65.
pub(super) struct Colors {
    /// To X, Y and Z relative to white.
    xyz_from_rgb: Mat3,
    rgb_from_xyz: Mat3,
}

impl Colors {
    pub(super) fn new() -> Self {
        let white_is_one = XYZ_FROM_RGB.map(|row| {
            let white: f32 = row.iter().sum();
            Vec3::from_array(row) / white
        });
        let [x, y, z] = white_is_one;
        let xyz_from_rgb = Mat3::from_cols(x, y, z).transpose();
        Self {
            xyz_from_rgb,
            rgb_from_xyz: xyz_from_rgb.inverse(),
        }
    }

    /// Y, X − Y, Y − Z: YCxCz (the linearized CIELAB of Flohr et al. 1993) without its constant
    /// factors, which a filter of unit sum leaves as they are.
    pub(super) fn opponent(&self, rgb: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = (self.xyz_from_rgb * Vec3::from_array(rgb)).to_array();
        [y, x - y, y - z]
    }

    /// The inverse of [`Self::opponent`], brought into the range of a display.
    pub(super) fn displayable(&self, opponent: [f32; 3]) -> [f32; 3] {
        let [y, x_minus_y, y_minus_z] = opponent;
        let xyz = Vec3::new(y + x_minus_y, y, y - y_minus_z);
        (self.rgb_from_xyz * xyz)
            .clamp(Vec3::ZERO, Vec3::ONE)
            .to_array()
    }

    /// CIELAB with a* and b* scaled by the lightness: colors look paler in the dark (Hunt 1952).
    pub(super) fn hunt_lab(&self, rgb: [f32; 3]) -> [f32; 3] {
        const DELTA: f32 = 6.0 / 29.0;
        let compress = |t: f32| {
            if t > DELTA.powi(3) {
                t.cbrt()
            } else {
                t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
            }
        };
        let xyz = self.xyz_from_rgb * Vec3::from_array(rgb);
        let [x, y, z] = xyz.to_array().map(compress);
        let lightness = 116.0 * y - 16.0;
        let hunt = 0.01 * lightness;
        [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
    }
}

/// Distance of two Lab colors, for large differences too (Abasi et al. 2020).
pub(super) fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_near(found: [f32; 3], expected: [f32; 3]) {
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-3, "{found:?} instead of {expected:?}");
        }
    }

    #[test]
    fn known_colors() {
        let colors = Colors::new();
        check_near(colors.hunt_lab([1.0; 3]), [100.0, 0.0, 0.0]);
        check_near(colors.hunt_lab([0.0; 3]), [0.0; 3]);
        let gray = colors.hunt_lab([0.184_187; 3]);
        check_near(gray, [50.0, 0.0, 0.0]);
        check_near(colors.opponent([0.4; 3]), [0.4, 0.0, 0.0]);
    }

    #[test]
    fn opponents_and_back() {
        let colors = Colors::new();
        for rgb in [[0.1, 0.5, 0.9], [1.0, 0.0, 0.0], [0.3, 0.3, 0.2]] {
            check_near(colors.displayable(colors.opponent(rgb)), rgb);
        }
        check_near(
            colors.displayable(colors.opponent([2.0, -1.0, 0.5])),
            [1.0, 0.0, 0.5],
        );
    }
}
