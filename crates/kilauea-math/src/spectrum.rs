use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Neg, Sub};

use glam::Vec3A;
use serde::{Deserialize, Serialize};

/// Light or reflectance in linear Rec. 709 / D65 red, green and blue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f32; 3]", into = "[f32; 3]")]
pub struct Spectrum(Vec3A);

impl Spectrum {
    /// No light.
    pub const BLACK: Self = Self(Vec3A::ZERO);
    /// One in every channel.
    pub const ONE: Self = Self(Vec3A::ONE);

    /// A spectrum of the three channels.
    #[inline]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3A::new(r, g, b))
    }

    /// The same value in every channel.
    #[inline]
    pub const fn splat(value: f32) -> Self {
        Self(Vec3A::splat(value))
    }

    /// Rec. 709 luminance.
    #[inline]
    pub fn luminance(self) -> f32 {
        self.0.dot(Vec3A::new(0.2126, 0.7152, 0.0722))
    }

    /// The largest channel.
    #[inline]
    pub fn max_channel(self) -> f32 {
        self.0.max_element()
    }

    /// The mean of the channels.
    #[inline]
    pub fn mean(self) -> f32 {
        self.0.element_sum() / 3.0
    }

    /// Whether every channel is exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == Vec3A::ZERO
    }

    /// Whether no channel is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Channel-wise clamp.
    #[must_use]
    #[inline]
    pub fn clamp(self, low: f32, high: f32) -> Self {
        Self(self.0.clamp(Vec3A::splat(low), Vec3A::splat(high)))
    }

    /// Channel-wise maximum with a number.
    #[must_use]
    #[inline]
    pub fn max(self, low: f32) -> Self {
        Self(self.0.max(Vec3A::splat(low)))
    }

    /// Channel-wise square root.
    #[must_use]
    #[inline]
    pub fn sqrt(self) -> Self {
        Self::new(self.0.x.sqrt(), self.0.y.sqrt(), self.0.z.sqrt())
    }

    /// Linear blend: `self` at `t` = 0, `other` at `t` = 1.
    #[must_use]
    #[inline]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        Self(self.0 * (1.0 - t) + other.0 * t)
    }

    /// The channels in order red, green, blue.
    #[inline]
    pub fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }
}

impl From<[f32; 3]> for Spectrum {
    fn from(rgb: [f32; 3]) -> Self {
        Self(Vec3A::from_array(rgb))
    }
}

impl From<Spectrum> for [f32; 3] {
    fn from(s: Spectrum) -> Self {
        s.to_array()
    }
}

macro_rules! channelwise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Spectrum {
            type Output = Self;
            #[inline]
            fn $method(self, rhs: Self) -> Self {
                Self(self.0 $op rhs.0)
            }
        }
    };
}
channelwise!(Add, add, +);
channelwise!(Sub, sub, -);
channelwise!(Mul, mul, *);
channelwise!(Div, div, /);

impl Mul<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: f32) -> Self {
        Self(self.0 * rhs)
    }
}

impl Mul<Spectrum> for f32 {
    type Output = Spectrum;
    #[inline]
    fn mul(self, rhs: Spectrum) -> Spectrum {
        rhs * self
    }
}

impl Div<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, rhs: f32) -> Self {
        Self(self.0 / rhs)
    }
}

impl Neg for Spectrum {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        self.0 += rhs.0;
    }
}

impl MulAssign for Spectrum {
    #[inline]
    fn mul_assign(&mut self, rhs: Self) {
        self.0 *= rhs.0;
    }
}

impl MulAssign<f32> for Spectrum {
    #[inline]
    fn mul_assign(&mut self, rhs: f32) {
        self.0 *= rhs;
    }
}

impl Sum for Spectrum {
    fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::BLACK, Add::add)
    }
}

impl Index<usize> for Spectrum {
    type Output = f32;
    fn index(&self, channel: usize) -> &f32 {
        &self.0[channel]
    }
}
