use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A surface shader with its inputs: a small graph of [`Node`]s read by named [`Input`]s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Source prim.
    pub path: String,
    /// Name of the surface shader, as in the shader list: `UsdPreviewSurface`, `Matte`.
    pub shader: String,
    /// Authored inputs by name; absent ones have the shader's default.
    pub inputs: BTreeMap<String, Input>,
    /// Nodes; each refers only to earlier ones.
    pub nodes: Vec<Node>,
}

/// Index into [`Material::nodes`].
pub type NodeIdx = u32;

/// A shader input: the output of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The node.
    pub node: NodeIdx,
    /// Which of its four channels.
    pub channel: Channel,
}

/// Channels of a node's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// First.
    R,
    /// Second.
    G,
    /// Third.
    B,
    /// Fourth.
    A,
    /// The first three; for scalar inputs the first.
    Rgb,
}

/// A pattern node; its value is four floats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Node {
    /// A value; unused channels are 0, the fourth is 1.
    Constant {
        /// The value.
        value: [f32; 4],
    },
    /// A primvar of the surface.
    Primvar {
        /// Name without the `primvars:` prefix.
        name: String,
        /// Value where the surface has no such primvar.
        fallback: [f32; 4],
    },
    /// UsdTransform2d: scale, then rotate, then translate the input's first two channels.
    Transform2d {
        /// What is transformed.
        input: NodeIdx,
        /// Factor per axis.
        scale: [f32; 2],
        /// Counter-clockwise degrees.
        rotation_degrees: f32,
        /// Added last.
        translation: [f32; 2],
    },
    /// UsdUVTexture: a texture lookup, then `scale * texel + bias`.
    UvTexture {
        /// Index into [`crate::Scene::textures`].
        texture: u32,
        /// Texture coordinates, (0, 0) at the lower left of the image.
        st: NodeIdx,
        /// Outside [0, 1] horizontally.
        wrap_s: Wrap,
        /// Outside [0, 1] vertically.
        wrap_t: Wrap,
        /// Per channel.
        scale: [f32; 4],
        /// Per channel.
        bias: [f32; 4],
        /// Value where the image is missing; scale and bias apply to it too.
        fallback: [f32; 4],
    },
}

/// What a texture is outside [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Wrap {
    /// Transparent black.
    Black,
    /// The edge texel.
    Clamp,
    /// Periodic.
    Repeat,
    /// Periodic, every other period reversed.
    Mirror,
}

/// An image prepared for lookup.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextureSource {
    /// The image as authored, for messages; `<UDIM>` stands for the tile number.
    pub path: String,
    /// Prepared tile files: one with `udim` 0 for a plain image, one per tile for UDIM, none
    /// where the image is missing.
    pub files: Vec<TextureFile>,
}

/// A prepared tile file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextureFile {
    /// 1001 to 1100 for a UDIM tile, 0 otherwise.
    pub udim: u32,
    /// Where the tile file is.
    pub tiles: String,
}
