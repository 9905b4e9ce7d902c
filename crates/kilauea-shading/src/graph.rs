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
            Self::Texture(texture) => texture.finish(mean_texel(textures, texture.image)),
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

    /// Whether a texture decides the value.
    pub(crate) fn reads_texture(&self) -> bool {
        match self {
            Self::Texture(_) => true,
            Self::Affine2d { input, .. } => input.reads_texture(),
            Self::Constant(_) | Self::Primvar { .. } => false,
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
        let (st, width) = self.place(surface);
        self.finish(surface.textures.sample(self.image, st, width, self.wrap))
    }

    /// Where the texture is looked up, and the width of the lookup.
    #[inline]
    pub(crate) fn place(&self, surface: &Surface<'_>) -> (Vec2, f32) {
        match self.st.at_corners(surface) {
            Some([a, b, c]) => (
                st_of(surface.interpolate(a, b, c)),
                surface.st_footprint([a, b, c].map(st_of)),
            ),
            None => (st_of(self.st.eval(surface)), 0.0),
        }
    }

    /// Scale and bias; they apply to the fallback of a missing image too, as in Storm.
    fn finish(&self, texel: Option<Channels>) -> Channels {
        let texel = texel.unwrap_or(self.fallback);
        std::array::from_fn(|i| self.scale[i] * texel[i] + self.bias[i])
    }
}

/// Mean of the coarsest level; none where the image is missing.
fn mean_texel(textures: &TextureStore, image: u32) -> Option<Channels> {
    let coarsest = textures.n_levels(image)?.checked_sub(1)?;
    let level = textures.read_level(image, coarsest)?;
    let n = level.texels.len().max(1) as f32;
    Some(std::array::from_fn(|c| {
        level.texels.iter().map(|t| t[c]).sum::<f32>() / n
    }))
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
    /// Every texture that was compiled, by its node.
    pub(crate) textures: BTreeMap<NodeIdx, Texture>,
}

impl<'m> GraphCompiler<'m> {
    pub(crate) fn new(material: &'m Material) -> Self {
        Self {
            material,
            slots: BTreeMap::new(),
            primvars: Vec::new(),
            textures: BTreeMap::new(),
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
                } => {
                    let texture = Texture {
                        image: *texture,
                        st: earlier(*st)?,
                        wrap: [*wrap_s, *wrap_t],
                        scale: *scale,
                        bias: *bias,
                        fallback: *fallback,
                    };
                    self.textures.insert(node, texture.clone());
                    Pattern::Texture(Box::new(texture))
                }
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

#[cfg(test)]
mod tests {
    use kilauea_math::Spectrum;
    use kilauea_scene::{Attribute, Channel, Input as MaterialInput, InstanceAttribute};
    use kilauea_scene::{Interpolation, Node};

    use super::*;
    use crate::testing::Fixture;
    use crate::{Input, InputValue, ShaderInputs};

    const TEXELS: [Channels; 4] = [
        [1.0, 0.0, 0.0, 0.1],
        [0.0, 1.0, 0.0, 0.2],
        [0.0, 0.0, 1.0, 0.3],
        [1.0, 1.0, 1.0, 0.4],
    ];

    fn st() -> Node {
        Node::Primvar {
            name: "st".into(),
            fallback: [0.0, 0.0, 0.0, 1.0],
        }
    }

    fn texture(texture: u32, st: NodeIdx) -> Node {
        Node::UvTexture {
            texture,
            st,
            wrap_s: Wrap::Clamp,
            wrap_t: Wrap::Clamp,
            scale: [1.0; 4],
            bias: [0.0; 4],
            fallback: [0.25, 0.5, 0.75, 1.0],
        }
    }

    fn material(nodes: Vec<Node>, channel: Channel) -> Material {
        let node = nodes.len() as u32 - 1;
        Material {
            path: "/Looks/Test".into(),
            shader: "Test".into(),
            inputs: [("x".to_owned(), MaterialInput { node, channel })].into(),
            nodes,
        }
    }

    fn compile<T: InputValue>(material: &Material, default: T) -> (Input<T>, Vec<String>) {
        let mut inputs = ShaderInputs::new(material);
        let input = inputs.get("x", default).unwrap();
        (input, inputs.finish().primvars)
    }

    fn value(nodes: Vec<Node>, fixture: &mut Fixture) -> Channels {
        let material = material(nodes, Channel::Rgb);
        let mut compiler = GraphCompiler::new(&material);
        let pattern = compiler.compile(material.nodes.len() as u32 - 1).unwrap();
        fixture.slots = fixture.resolve(&compiler.primvars, &[]);
        pattern.eval(&fixture.surface())
    }

    fn assert_close(found: Channels, expected: Channels) {
        let close = found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(close, "{found:?}, expected {expected:?}");
    }

    #[test]
    fn transform_scales_then_rotates_then_translates() {
        let transform = Node::Transform2d {
            input: 0,
            scale: [2.0, 3.0],
            rotation_degrees: 90.0,
            translation: [10.0, 20.0],
        };
        // st is (0.25, 0.5): scaled (0.5, 1.5), turned counter-clockwise (-1.5, 0.5).
        let found = value(
            vec![st(), transform.clone()],
            &mut Fixture::tilted_triangle(),
        );
        assert_close(found, [8.5, 20.5, 0.0, 1.0]);
        // The same from a constant, at compile time.
        let constant = Node::Constant {
            value: [0.25, 0.5, 0.0, 1.0],
        };
        let material = material(vec![constant, transform], Channel::G);
        let (input, primvars) = compile(&material, 0.0_f32);
        assert!((input.constant().unwrap() - 20.5).abs() < 1e-5);
        assert!(primvars.is_empty());
    }

    #[test]
    fn channels_select() {
        let nodes = || {
            vec![Node::Constant {
                value: [1.0, 2.0, 3.0, 4.0],
            }]
        };
        let scalar = |channel| compile(&material(nodes(), channel), 0.0_f32).0.constant();
        assert_eq!(scalar(Channel::R), Some(1.0));
        assert_eq!(scalar(Channel::G), Some(2.0));
        assert_eq!(scalar(Channel::B), Some(3.0));
        assert_eq!(scalar(Channel::A), Some(4.0));
        assert_eq!(scalar(Channel::Rgb), Some(1.0));
        let color = |channel| {
            let material = material(nodes(), channel);
            compile(&material, Spectrum::BLACK).0.constant()
        };
        assert_eq!(color(Channel::Rgb), Some(Spectrum::new(1.0, 2.0, 3.0)));
        assert_eq!(color(Channel::A), Some(Spectrum::splat(4.0)));
    }

    #[test]
    fn texture_is_looked_up_at_its_coordinates() {
        // (0.25, 0.5) is on the left column, halfway between the rows.
        let found = value(vec![st(), texture(0, 0)], &mut Fixture::with_image(TEXELS));
        assert_close(found, [0.5, 0.0, 0.5, 0.2]);
    }

    #[test]
    fn scale_and_bias_apply_to_texels_and_to_the_fallback() {
        let node = |image| Node::UvTexture {
            texture: image,
            st: 0,
            wrap_s: Wrap::Clamp,
            wrap_t: Wrap::Clamp,
            scale: [2.0, 2.0, 2.0, 1.0],
            bias: [-1.0, -1.0, -1.0, 0.5],
            fallback: [0.25, 0.5, 0.75, 1.0],
        };
        let mut fixture = Fixture::with_image(TEXELS);
        assert_close(
            value(vec![st(), node(0)], &mut fixture),
            [0.0, -1.0, 0.0, 0.7],
        );
        assert_close(
            value(vec![st(), node(1)], &mut fixture),
            [-0.5, 0.0, 0.5, 1.5],
        );
    }

    #[test]
    fn footprint_widens_with_the_ray() {
        let fixture = Fixture::with_image(TEXELS);
        let mut s = fixture.surface();
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
        assert_eq!(s.st_footprint(corners), 0.0);
        // Legs of length 2 span one unit of st.
        s.footprint = 0.5;
        assert!((s.st_footprint(corners) - 0.25).abs() < 1e-6);
        s.footprint = 100.0;
        let material = material(vec![st(), texture(0, 0)], Channel::Rgb);
        let (input, _) = compile(&material, Spectrum::BLACK);
        assert_eq!(input.at(&s), Spectrum::splat(0.5));
    }

    #[test]
    fn texture_of_a_texture_is_looked_up_sharply() {
        let fixture = &mut Fixture::with_image([[0.25, 0.25, 0.0, 1.0]; 4]);
        assert_close(
            value(vec![st(), texture(0, 0), texture(0, 1)], fixture),
            [0.25, 0.25, 0.0, 1.0],
        );
    }

    #[test]
    fn mean_is_the_textures_own_and_unknown_for_primvars() {
        let fixture = Fixture::with_image(TEXELS);
        let mean = |nodes| {
            let material = material(nodes, Channel::Rgb);
            compile(&material, Spectrum::BLACK)
                .0
                .mean(&fixture.textures)
        };
        assert_eq!(mean(vec![st(), texture(0, 0)]), Some(Spectrum::splat(0.5)));
        assert_eq!(mean(vec![st()]), None);
    }

    #[test]
    fn primvars_interpolate_as_declared() {
        let mut fixture = Fixture::tilted_triangle();
        let add = |fixture: &mut Fixture, name: &str, interpolation, width, data: &[f32]| {
            fixture.chunk.attributes.push(Attribute {
                name: name.into(),
                width,
                interpolation,
                data: data.to_vec(),
            });
        };
        add(&mut fixture, "constant", Interpolation::Constant, 1, &[7.0]);
        let wide = [1.0, 2.0, 3.0, 4.0];
        add(&mut fixture, "wide", Interpolation::Constant, 4, &wide);
        add(
            &mut fixture,
            "uniform",
            Interpolation::Uniform,
            3,
            &[1.0, 2.0, 3.0],
        );
        add(
            &mut fixture,
            "vertex",
            Interpolation::Vertex,
            1,
            &[1.0, 2.0, 5.0],
        );
        add(&mut fixture, "short", Interpolation::Vertex, 1, &[1.0, 2.0]);
        let mut check = |name: &str, expected: Channels| {
            let node = Node::Primvar {
                name: name.into(),
                fallback: [9.0; 4],
            };
            assert_close(value(vec![node], &mut fixture), expected);
        };
        check("constant", [7.0, 0.0, 0.0, 1.0]);
        check("wide", wide);
        check("uniform", [1.0, 2.0, 3.0, 1.0]);
        check("vertex", [3.25, 0.0, 0.0, 1.0]);
        check("short", [9.0; 4]);
        check("absent", [9.0; 4]);
    }

    #[test]
    fn instance_primvars_stand_in() {
        let mut fixture = Fixture::tilted_triangle();
        let material = material(vec![st()], Channel::Rgb);
        let (input, primvars) = compile(&material, Spectrum::BLACK);
        let instances = [InstanceAttribute {
            name: "st".into(),
            width: 2,
            data: vec![1.0, 2.0, 3.0, 4.0],
        }];
        fixture.slots = fixture.resolve(&primvars, &instances);
        let mut s = fixture.surface();
        s.instance_primvars = &instances;
        s.instance_index = 1;
        assert_eq!(input.at(&s), Spectrum::new(3.0, 4.0, 0.0));
    }

    #[test]
    fn nodes_that_refer_forward_are_an_error() {
        let material = material(vec![texture(0, 0)], Channel::Rgb);
        let error = ShaderInputs::new(&material).get("x", 0.0_f32).unwrap_err();
        assert!(error.to_string().contains("/Looks/Test"), "{error}");
    }
}
