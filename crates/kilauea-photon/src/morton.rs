//! Places along Morton's curve (Morton 1966): points near each other mostly have near codes.

use kilauea_math::{Bounds3, Vec3};

/// Bits of a code for each axis.
const BITS: u32 = 21;

/// A cube of 2²¹ cells along each side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MortonGrid {
    origin: Vec3,
    cells_per_unit: f32,
}

impl MortonGrid {
    /// Around a box, which may be empty or a point.
    pub(crate) fn around(bounds: &Bounds3) -> Self {
        let side = bounds.diagonal().max_element();
        let n_cells = ((1 << BITS) - 1) as f32;
        Self {
            origin: bounds.min,
            cells_per_unit: if side > 0.0 { n_cells / side } else { 0.0 },
        }
    }

    /// The code of a point; of one beyond the cube, that of a near cell.
    pub(crate) fn code(&self, p: Vec3) -> u64 {
        let cell = (p - self.origin) * self.cells_per_unit;
        let spread = |v: f32| spread_bits((v as u64).min((1 << BITS) - 1));
        spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
    }
}

/// Puts two zeros between all bits of a number of 21 bits.
fn spread_bits(mut v: u64) -> u64 {
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_in_order() {
        for v in [0, 1, 0b101, (1 << BITS) - 1, 0x0015_5555] {
            let expected = (0..BITS).fold(0, |code, bit| code | (v >> bit & 1) << (3 * bit));
            assert_eq!(spread_bits(v), expected);
        }
    }

    #[test]
    fn codes_order_octants() {
        let grid = MortonGrid::around(&Bounds3 {
            min: Vec3::ZERO,
            max: Vec3::ONE,
        });
        let code = |x, y, z| grid.code(Vec3::new(x, y, z));
        assert!(code(0.9, 0.1, 0.1) < code(0.1, 0.9, 0.1));
        assert!(code(0.9, 0.9, 0.1) < code(0.1, 0.1, 0.9));
        assert_eq!(code(-5.0, 0.0, 0.0), code(0.0, 0.0, 0.0));
        assert_eq!(code(7.0, 7.0, 7.0), code(1.0, 1.0, 1.0));
    }

    #[test]
    fn a_grid_around_one_point_or_none_has_one_cell() {
        let p = Vec3::splat(3.0);
        assert_eq!(MortonGrid::around(&Bounds3::from_points([p])).code(p), 0);
        assert_eq!(MortonGrid::around(&Bounds3::EMPTY).code(p), 0);
    }
}
