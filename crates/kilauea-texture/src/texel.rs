use std::sync::LazyLock;

use half::f16;

/// How a texel is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TexelFormat {
    /// 1 to 4.
    pub(crate) channels: u8,
    pub(crate) element: Element,
    pub(crate) transfer: Transfer,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Element {
    U8,
    F16,
    F32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Transfer {
    Linear,
    Srgb,
}

impl TexelFormat {
    /// Bytes of a texel.
    pub(crate) fn n_bytes(self) -> usize {
        let element = match self.element {
            Element::U8 => 1,
            Element::F16 => 2,
            Element::F32 => 4,
        };
        element * self.channels as usize
    }

    /// Linear red, green, blue and alpha of the texel at index `idx`; grey is replicated, missing
    /// alpha is 1.
    #[inline]
    pub(crate) fn decode(self, texels: &[u8], idx: usize) -> [f32; 4] {
        let n = self.channels as usize;
        match self.element {
            Element::U8 => {
                let unit = |byte: u8| f32::from(byte) * (1.0 / 255.0);
                let texel = &texels[idx * n..][..n];
                match self.transfer {
                    Transfer::Linear => expand(texel, unit, unit),
                    // Alpha has no transfer curve.
                    Transfer::Srgb => expand(texel, |byte| SRGB_TO_LINEAR[byte as usize], unit),
                }
            }
            Element::F16 => {
                let number = |bytes| f16::from_le_bytes(bytes).to_f32();
                expand(&texels.as_chunks().0[idx * n..][..n], number, number)
            }
            Element::F32 => {
                let texel = &texels.as_chunks().0[idx * n..][..n];
                expand(texel, f32::from_le_bytes, f32::from_le_bytes)
            }
        }
    }
}

#[inline]
fn expand<T: Copy>(texel: &[T], color: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) -> [f32; 4] {
    match *texel {
        [v] => [color(v), color(v), color(v), 1.0],
        [v, a] => [color(v), color(v), color(v), alpha(a)],
        [r, g, b] => [color(r), color(g), color(b), 1.0],
        [r, g, b, a] => [color(r), color(g), color(b), alpha(a)],
        _ => [0.0; 4],
    }
}

static SRGB_TO_LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f64 / 255.0) as f32));

/// IEC 61966-2-1.
fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(channels: u8, element: Element, transfer: Transfer, bytes: &[u8], expected: [f32; 4]) {
        let format = TexelFormat {
            channels,
            element,
            transfer,
        };
        // Stands second, behind a texel of other bytes.
        let mut texels = vec![0xA5; format.n_bytes()];
        texels.extend_from_slice(bytes);
        let found = format.decode(&texels, 1);
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-6, "{channels} {element:?}: {found:?}");
        }
    }

    #[test]
    fn decodes_each_format() {
        use Element::{F16, F32, U8};
        use Transfer::{Linear, Srgb};
        let half = 128.0 / 255.0;
        // 128 in sRGB is 0.2158605 linear.
        let srgb_half = 0.215_860_5;
        check(1, U8, Linear, &[128], [half, half, half, 1.0]);
        check(2, U8, Linear, &[255, 0], [1.0, 1.0, 1.0, 0.0]);
        check(3, U8, Linear, &[0, 128, 255], [0.0, half, 1.0, 1.0]);
        check(4, U8, Linear, &[0, 255, 255, 128], [0.0, 1.0, 1.0, half]);
        check(1, U8, Srgb, &[128], [srgb_half, srgb_half, srgb_half, 1.0]);
        check(
            2,
            U8,
            Srgb,
            &[128, 128],
            [srgb_half, srgb_half, srgb_half, half],
        );
        check(3, U8, Srgb, &[128, 0, 255], [srgb_half, 0.0, 1.0, 1.0]);
        check(
            4,
            U8,
            Srgb,
            &[128, 0, 255, 128],
            [srgb_half, 0.0, 1.0, half],
        );
        let halves: Vec<u8> = [-0.5, 2.0, 0.25, 1000.0]
            .iter()
            .flat_map(|&v| f16::from_f32(v).to_le_bytes())
            .collect();
        check(4, F16, Linear, &halves, [-0.5, 2.0, 0.25, 1000.0]);
        check(2, F16, Linear, &halves[..4], [-0.5, -0.5, -0.5, 2.0]);
        let floats: Vec<u8> = [1e6f32, 0.1, -3.0]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        check(3, F32, Linear, &floats, [1e6, 0.1, -3.0, 1.0]);
        check(1, F32, Linear, &floats[4..8], [0.1, 0.1, 0.1, 1.0]);
    }
}
