use std::ops::{Add, Mul};

use kilauea_bsdf::SeenBsdf;
use kilauea_math::Spectrum;

use crate::Surface;

/// What the code of a shader sees of the renderer while it shades a point.
///
/// Light is asked for and arrives later; questions are sent at once, so ask first and await later.
pub trait Shade {
    /// The point.
    fn surface(&self) -> &Surface<'_>;

    /// Asks for the light that comes straight from the lights.
    fn direct_light(
        &mut self,
        bsdf: &SeenBsdf,
    ) -> impl Future<Output = Scattered> + Unpin + use<Self>;

    /// Asks for all other light. It comes along one path, which goes on from here but once.
    fn indirect(self, bsdf: &SeenBsdf) -> impl Future<Output = Scattered> + Unpin + use<Self>;
}

/// Light that a surface scatters toward the viewer.
///
/// Sums and multiples of it are light again. What the path is still to bring is a part of it, by
/// the factor that it will be multiplied by: a shader is done before the path is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattered {
    /// By diffuse lobes.
    pub diffuse: Spectrum,
    /// By all other lobes.
    pub specular: Spectrum,
    /// Factor of what the path brings.
    pub path: Spectrum,
}

impl Scattered {
    /// No light.
    pub const NOTHING: Self = Self {
        diffuse: Spectrum::BLACK,
        specular: Spectrum::BLACK,
        path: Spectrum::BLACK,
    };

    /// All that the path brings.
    pub const BY_PATH: Self = Self {
        path: Spectrum::ONE,
        ..Self::NOTHING
    };
}

impl Add for Scattered {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            diffuse: self.diffuse + other.diffuse,
            specular: self.specular + other.specular,
            path: self.path + other.path,
        }
    }
}

impl Mul<Spectrum> for Scattered {
    type Output = Self;

    #[inline]
    fn mul(self, factor: Spectrum) -> Self {
        Self {
            diffuse: self.diffuse * factor,
            specular: self.specular * factor,
            path: self.path * factor,
        }
    }
}

impl Mul<f32> for Scattered {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f32) -> Self {
        self * Spectrum::splat(factor)
    }
}
