//! Materials with parameters from all over the ranges that shaders declare.

use kilauea_bsdf::Bsdf;
use kilauea_math::{Vec2, Vec3};
use kilauea_scene::{Channel, Input, Material, MeshChunk, Node};
use kilauea_shading::{Element, ElementCounts, PrimvarLayout, Surface, TextureStore};
use kilauea_testing::uniforms;
use shaders::Shader;
use shaders::describe::{Allowed, Parameter};
use std::collections::BTreeMap;

const N_LOOKS: u32 = 12;

/// What colors are.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Color {
    Any,
    White,
}

/// A shader with values for its parameters.
#[derive(Debug)]
pub(crate) struct Look {
    pub(crate) shader: &'static str,
    pub(crate) shader_idx: usize,
    values: BTreeMap<&'static str, [f32; 3]>,
    /// Shading normal; the geometric one is z.
    pub(crate) ns: Vec3,
}

/// Some looks of every shader; one in four has a shading normal that leans.
pub(crate) fn looks(color: Color) -> Vec<Look> {
    let mut looks = Vec::new();
    for (shader_idx, (shader, declaration)) in Shader::declarations().into_iter().enumerate() {
        for i in 0..N_LOOKS {
            let look_idx = shader_idx as u32 * N_LOOKS + i;
            let values = (0..)
                .zip(&declaration.parameters)
                .filter_map(|(k, parameter)| {
                    let value = value(parameter, color, uniforms(look_idx, k))?;
                    Some((parameter.name, value))
                });
            let lean = if i % 4 == 3 { 0.3 } else { 0.0 };
            looks.push(Look {
                shader,
                shader_idx,
                values: values.collect(),
                ns: Vec3::new(lean, -0.5 * lean, 1.0).normalize(),
            });
        }
    }
    looks
}

/// A value of a parameter; none leaves it at its default.
fn value(parameter: &Parameter, color: Color, u: [f32; 5]) -> Option<[f32; 3]> {
    let [choice, scalar, channels @ ..] = u;
    if parameter.type_name == "color" {
        return Some(match color {
            Color::White => [1.0; 3],
            Color::Any => channels,
        });
    }
    if parameter.width > 1 {
        return None;
    }
    let scalar = match parameter.allowed {
        // Ends of ranges are as likely as all that is between.
        Some(Allowed::Range { min, max }) => match choice {
            0.0..0.25 => min,
            0.25..0.5 => max,
            _ => min + scalar * (max - min),
        },
        Some(Allowed::Tokens(tokens)) => (scalar * tokens.len() as f32).floor(),
        // Switches, and numbers of which the shader itself must make sense.
        None => match choice {
            0.0..0.6 => return None,
            0.6..0.8 => 0.0,
            _ => 1.0,
        },
    };
    Some([scalar; 3])
}

impl Look {
    pub(crate) fn is_flat(&self) -> bool {
        self.ns == Vec3::Z
    }

    /// Whether it takes light even if it is white: half a metal loses what its interface lets in.
    pub(crate) fn absorbs(&self) -> bool {
        let metallic = self.values.get("metallic").map_or(0.0, |v| v[0]);
        let by_specular = self.values.get("useSpecularWorkflow");
        let is_metallic_workflow = by_specular.is_none_or(|v| v[0] == 0.0);
        is_metallic_workflow && metallic > 0.0 && metallic < 1.0
    }

    /// Its BSDF at a point seen from `wo`.
    pub(crate) fn bsdf(&self, wo: Vec3) -> Bsdf {
        let shader = Shader::compile(&self.material()).unwrap_or_else(|error| panic!("{error}"));
        let chunk = MeshChunk {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            ..MeshChunk::default()
        };
        let counts = ElementCounts::from(&chunk);
        let primvars = PrimvarLayout::resolve(shader.primvars(), &chunk.attributes, counts, &[]);
        let (textures, _) = TextureStore::open(&[], 0);
        shader.bsdf(&Surface {
            p: Vec3::new(0.25, 0.25, 0.0),
            ng: Vec3::Z,
            ns: self.ns,
            wo,
            corners: chunk.corners(0),
            barycentrics: Vec2::splat(0.25),
            attributes: &chunk.attributes,
            element: Element::triangle(&chunk, 0),
            primvars: &primvars,
            instance_primvars: &[],
            instance_index: 0,
            outside_ior: 1.0,
            footprint: 0.0,
            textures: &textures,
        })
    }

    fn material(&self) -> Material {
        let constants = self.values.values().map(|&[r, g, b]| Node::Constant {
            value: [r, g, b, 1.0],
        });
        let inputs = (0..).zip(self.values.keys()).map(|(node, name)| {
            let input = Input {
                node,
                channel: Channel::Rgb,
            };
            ((*name).to_owned(), input)
        });
        Material {
            path: "/Look".into(),
            shader: self.shader.into(),
            inputs: inputs.collect(),
            nodes: constants.collect(),
        }
    }
}
