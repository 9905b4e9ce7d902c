use std::collections::BTreeMap;

use kilauea_math::{Mat2, Vec2};
use kilauea_scene::{Material, Node, NodeIdx, Wrap};

use crate::{ShaderError, Surface, TextureStore};

/// The value of a pattern: four floats.
pub type Channels = [f32; 4];

/// A compiled pattern: evaluated by walking down from the root, without allocating.
///
/// Patterns are trees of a handful of nodes; a node that two inputs share is evaluated for each.
#[derive(Clone, Debug)]
pub(crate) enum Pattern {
    Constant(Channels),
    Primvar {
        slot: u32,
        fallback: Channels,
    },
    /// `matrix * st + translation` on the first two channels.
    Affine2d {
        input: Box<Pattern>,
        matrix: Mat2,
        translation: Vec2,
    },
    Texture(Box<Texture>),
}

#[derive(Clone, Debug)]
pub(crate) struct Texture {
    pub(crate) image: u32,
    pub(crate) st: Pattern,
    pub(crate) wrap: [Wrap; 2],
    pub(crate) scale: Channels,
    pub(crate) bias: Channels,
    pub(crate) fallback: Channels,
}

/// Wide enough for the coarsest level of any texture.
const WHOLE_TEXTURE: f32 = 1.0e9;

impl Pattern {
    /// The value at a surface point.
    pub(crate) fn eval(&self, surface: &Surface<'_>) -> Channels {
        match self {
            Self::Constant(value) => *value,
            Self::Primvar { slot, fallback } => surface.primvar(*slot).unwrap_or(*fallback),
            Self::Affine2d {
                input,
                matrix,
                translation,
            } => affine(*matrix, *translation, input.eval(surface)),
            Self::Texture(texture) => texture.eval(surface),
        }
    }

    /// The value at the triangle's corners where it is linear over the triangle; none below a
    /// texture.
    pub(crate) fn at_corners(&self, surface: &Surface<'_>) -> Option<[Channels; 3]> {
        match self {
            Self::Constant(value) => Some([*value; 3]),
            Self::Primvar { slot, fallback } => {
                Some(surface.primvar_at_corners(*slot).unwrap_or([*fallback; 3]))
            }
            Self::Affine2d {
                input,
                matrix,
                translation,
            } => Some(
                input
                    .at_corners(surface)?
                    .map(|v| affine(*matrix, *translation, v)),
            ),
            Self::Texture(_) => None,
        }
    }

    /// A value for the whole surface: textures by their mean, primvars by their fallback.
    pub(crate) fn mean(&self, textures: &TextureStore) -> Channels {
        match self {
            Self::Constant(value) => *value,
            Self::Primvar { fallback, .. } => *fallback,
            Self::Affine2d {
                input,
                matrix,
                translation,
            } => affine(*matrix, *translation, input.mean(textures)),
            Self::Texture(texture) => {
                let middle = Vec2::splat(0.5);
                texture.finish(textures.sample(
                    texture.image,
                    middle,
                    WHOLE_TEXTURE,
                    [Wrap::Clamp; 2],
                ))
            }
        }
    }

    /// Whether the mean is a guess because a primvar decides the value.
    pub(crate) fn reads_primvar_directly(&self) -> bool {
        match self {
            Self::Primvar { .. } => true,
            Self::Affine2d { input, .. } => input.reads_primvar_directly(),
            Self::Constant(_) | Self::Texture(_) => false,
        }
    }

    /// The texture coordinates of the texture at the root, at the triangle's corners.
    pub(crate) fn texture_st(&self, surface: &Surface<'_>) -> Option<[Vec2; 3]> {
        match self {
            Self::Texture(texture) => Some(texture.st.at_corners(surface)?.map(st_of)),
            _ => None,
        }
    }
}

impl Texture {
    fn eval(&self, surface: &Surface<'_>) -> Channels {
        let (st, width) = match self.st.at_corners(surface) {
            Some([a, b, c]) => (
                st_of(surface.interpolate(a, b, c)),
                surface.st_footprint([a, b, c].map(st_of)),
            ),
            None => (st_of(self.st.eval(surface)), 0.0),
        };
        self.finish(surface.textures.sample(self.image, st, width, self.wrap))
    }

    /// Scale and bias; they apply to the fallback of a missing image too, as in Storm.
    fn finish(&self, texel: Option<Channels>) -> Channels {
        let texel = texel.unwrap_or(self.fallback);
        std::array::from_fn(|i| self.scale[i] * texel[i] + self.bias[i])
    }
}

fn st_of(value: Channels) -> Vec2 {
    Vec2::new(value[0], value[1])
}

fn affine(matrix: Mat2, translation: Vec2, value: Channels) -> Channels {
    let st = matrix * st_of(value) + translation;
    [st.x, st.y, value[2], value[3]]
}

/// Compiles the nodes of one material; collects the primvars they read.
pub(crate) struct GraphCompiler<'m> {
    material: &'m Material,
    slots: BTreeMap<&'m str, u32>,
    /// In slot order.
    pub(crate) primvars: Vec<String>,
}

impl<'m> GraphCompiler<'m> {
    pub(crate) fn new(material: &'m Material) -> Self {
        Self {
            material,
            slots: BTreeMap::new(),
            primvars: Vec::new(),
        }
    }

    /// The tree below a node, constants folded.
    pub(crate) fn compile(&mut self, node: NodeIdx) -> Result<Pattern, ShaderError> {
        let material = self.material;
        let dangling = || ShaderError::Node {
            material: material.path.clone(),
            node,
        };
        // Nodes refer to earlier ones only, so this ends.
        let mut earlier = |input: NodeIdx| {
            if input < node {
                self.compile(input)
            } else {
                Err(dangling())
            }
        };
        Ok(
            match material.nodes.get(node as usize).ok_or_else(dangling)? {
                Node::Constant { value } => Pattern::Constant(*value),
                Node::Primvar { name, fallback } => Pattern::Primvar {
                    slot: self.slot(name),
                    fallback: *fallback,
                },
                Node::Transform2d {
                    input,
                    scale,
                    rotation_degrees,
                    translation,
                } => {
                    let matrix = Mat2::from_angle(rotation_degrees.to_radians())
                        * Mat2::from_diagonal(Vec2::from_array(*scale));
                    let translation = Vec2::from_array(*translation);
                    match earlier(*input)? {
                        Pattern::Constant(value) => {
                            Pattern::Constant(affine(matrix, translation, value))
                        }
                        input => Pattern::Affine2d {
                            input: Box::new(input),
                            matrix,
                            translation,
                        },
                    }
                }
                Node::UvTexture {
                    texture,
                    st,
                    wrap_s,
                    wrap_t,
                    scale,
                    bias,
                    fallback,
                } => Pattern::Texture(Box::new(Texture {
                    image: *texture,
                    st: earlier(*st)?,
                    wrap: [*wrap_s, *wrap_t],
                    scale: *scale,
                    bias: *bias,
                    fallback: *fallback,
                })),
            },
        )
    }

    fn slot(&mut self, name: &'m str) -> u32 {
        let primvars = &mut self.primvars;
        *self.slots.entry(name).or_insert_with(|| {
            primvars.push(name.to_owned());
            primvars.len() as u32 - 1
        })
    }
}
