use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_scene::Channel;

use crate::graph::{Channels, Pattern};
use crate::{Surface, TextureStore};

/// An input of a shader: one value everywhere, or a pattern.
#[derive(Clone, Debug)]
pub struct Input<T>(Kind<T>);

#[derive(Clone, Debug)]
enum Kind<T> {
    Constant(T),
    Pattern { pattern: Pattern, channel: Channel },
}

/// Types that an [`Input`] can have.
pub trait InputValue: Copy {
    /// Name of the type, for documentation.
    const TYPE_NAME: &'static str;

    /// How many channels it has.
    const WIDTH: usize;

    /// Reads the value from the channels of a pattern.
    fn from_channels(channels: Channels, channel: Channel) -> Self;

    /// The value as channels; unused ones are 0, the fourth is 1.
    fn to_channels(self) -> Channels;
}

/// A single channel; none for the first three together.
#[inline]
fn single(channels: Channels, channel: Channel) -> Option<f32> {
    match channel {
        Channel::R => Some(channels[0]),
        Channel::G => Some(channels[1]),
        Channel::B => Some(channels[2]),
        Channel::A => Some(channels[3]),
        Channel::Rgb => None,
    }
}

impl InputValue for f32 {
    const TYPE_NAME: &'static str = "float";
    const WIDTH: usize = 1;

    #[inline]
    fn from_channels(channels: Channels, channel: Channel) -> Self {
        single(channels, channel).unwrap_or(channels[0])
    }

    fn to_channels(self) -> Channels {
        [self, 0.0, 0.0, 1.0]
    }
}

impl InputValue for i32 {
    const TYPE_NAME: &'static str = "int";
    const WIDTH: usize = 1;

    #[inline]
    fn from_channels(channels: Channels, channel: Channel) -> Self {
        f32::from_channels(channels, channel).round() as Self
    }

    fn to_channels(self) -> Channels {
        (self as f32).to_channels()
    }
}

impl InputValue for Vec3 {
    const TYPE_NAME: &'static str = "float3";
    const WIDTH: usize = 3;

    #[inline]
    fn from_channels(channels: Channels, channel: Channel) -> Self {
        let [r, g, b, _] = channels;
        single(channels, channel).map_or(Self::new(r, g, b), Self::splat)
    }

    fn to_channels(self) -> Channels {
        let [r, g, b] = self.to_array();
        [r, g, b, 1.0]
    }
}

impl InputValue for Spectrum {
    const TYPE_NAME: &'static str = "color";
    const WIDTH: usize = 3;

    #[inline]
    fn from_channels(channels: Channels, channel: Channel) -> Self {
        let [r, g, b, _] = channels;
        single(channels, channel).map_or(Self::new(r, g, b), Self::splat)
    }

    fn to_channels(self) -> Channels {
        let [r, g, b] = self.to_array();
        [r, g, b, 1.0]
    }
}

impl<T: InputValue> Input<T> {
    /// The same value everywhere.
    pub const fn from_constant(value: T) -> Self {
        Self(Kind::Constant(value))
    }

    pub(crate) fn from_pattern(pattern: Pattern, channel: Channel) -> Self {
        Self(match pattern {
            Pattern::Constant(value) => Kind::Constant(T::from_channels(value, channel)),
            pattern => Kind::Pattern { pattern, channel },
        })
    }

    /// The value at a surface point.
    #[inline]
    pub fn at(&self, surface: &Surface<'_>) -> T {
        match &self.0 {
            Kind::Constant(value) => *value,
            Kind::Pattern { pattern, channel } => T::from_channels(pattern.eval(surface), *channel),
        }
    }

    /// The value, where it is the same everywhere.
    #[inline]
    pub fn constant(&self) -> Option<T> {
        match self.0 {
            Kind::Constant(value) => Some(value),
            Kind::Pattern { .. } => None,
        }
    }

    /// An estimate of the mean over all surfaces: a texture's own mean; none where a primvar
    /// decides.
    pub fn mean(&self, textures: &TextureStore) -> Option<T> {
        match &self.0 {
            Kind::Constant(value) => Some(*value),
            Kind::Pattern { pattern, .. } if pattern.reads_primvar_directly() => None,
            Kind::Pattern { pattern, channel } => {
                Some(T::from_channels(pattern.mean(textures), *channel))
            }
        }
    }

    /// Where the input is a texture: its coordinates at the triangle's corners.
    pub fn texture_st(&self, surface: &Surface<'_>) -> Option<[Vec2; 3]> {
        match &self.0 {
            Kind::Constant(_) => None,
            Kind::Pattern { pattern, .. } => pattern.texture_st(surface),
        }
    }
}
