use crate::graph::Texture;
use crate::{Surface, TileId};

/// The textures that the inputs of one material look up.
#[derive(Clone, Debug, Default)]
pub struct Lookups(Vec<Texture>);

impl Lookups {
    /// Textures, of which those that decide where others are looked up come first.
    pub(crate) fn new(textures: impl Iterator<Item = Texture>) -> Self {
        Self(textures.collect())
    }

    /// The tiles that the inputs need at a surface point and that are not in memory, each once.
    ///
    /// A texture whose coordinates depend on another's absent tiles is left out: where it is looked
    /// up is known only when those are there.
    pub fn absent_tiles(&self, surface: &Surface<'_>) -> Vec<TileId> {
        let mut absent = Vec::new();
        for texture in &self.0 {
            if !absent.is_empty() && texture.st.reads_texture() {
                continue;
            }
            let (st, width) = texture.place(surface);
            let store = surface.textures;
            store.for_each_absent(texture.image, st, width, texture.wrap, |tile| {
                if !absent.contains(&tile) {
                    absent.push(tile);
                }
            });
        }
        absent
    }
}

#[cfg(test)]
mod tests {
    use kilauea_math::Spectrum;
    use kilauea_scene::{Channel, Input, Material, Node, Wrap};

    use crate::testing::Fixture;
    use crate::{Lookups, ShaderInputs, TileId};

    fn texture(st: u32) -> Node {
        Node::UvTexture {
            texture: 0,
            st,
            wrap_s: Wrap::Clamp,
            wrap_t: Wrap::Clamp,
            scale: [1.0; 4],
            bias: [0.0; 4],
            fallback: [0.0; 4],
        }
    }

    /// Of a material whose inputs `a` and `b` are the node before the last, and the last.
    fn lookups(nodes: Vec<Node>) -> Lookups {
        let last = nodes.len() as u32 - 1;
        let input = |node| Input {
            node,
            channel: Channel::Rgb,
        };
        let material = Material {
            path: "/Looks/Test".into(),
            shader: "Test".into(),
            inputs: [
                ("a".to_owned(), input(last - 1)),
                ("b".to_owned(), input(last)),
            ]
            .into(),
            nodes,
        };
        let mut inputs = ShaderInputs::new(&material);
        for name in ["a", "b"] {
            inputs.get(name, Spectrum::BLACK).unwrap();
        }
        inputs.finish().lookups
    }

    fn st() -> Node {
        Node::Primvar {
            name: "st".into(),
            fallback: [0.0; 4],
        }
    }

    #[test]
    fn a_tile_that_two_inputs_need_is_named_once_until_it_is_there() {
        let fixture = Fixture::with_absent_image();
        let lookups = lookups(vec![st(), texture(0), texture(0)]);
        let absent = lookups.absent_tiles(&fixture.surface());
        assert_eq!(absent, [TileId(0)]);
        fixture.take_in(absent[0]);
        assert_eq!(lookups.absent_tiles(&fixture.surface()), []);
    }

    #[test]
    fn a_texture_of_a_texture_is_named_when_it_is_known_where_it_is_looked_up() {
        let mut fixture = Fixture::with_absent_image();
        // The inner lookup is so wide that it needs the other level.
        fixture.footprint = 100.0;
        let lookups = lookups(vec![st(), texture(0), texture(1)]);
        let inner = lookups.absent_tiles(&fixture.surface());
        assert_eq!(inner, [TileId(1)]);
        fixture.take_in(inner[0]);
        let outer = lookups.absent_tiles(&fixture.surface());
        assert_eq!(outer, [TileId(0)]);
        fixture.take_in(outer[0]);
        assert_eq!(lookups.absent_tiles(&fixture.surface()), []);
    }
}
