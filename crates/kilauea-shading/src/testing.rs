//! A surface for tests.

use std::sync::atomic::{AtomicU32, Ordering};

use kilauea_math::{Vec2, Vec3};
use kilauea_scene::{
    Attribute, InstanceAttribute, Interpolation, MeshChunk, TextureFile, TextureSource, Wrap,
};

use crate::{Element, ElementCounts, PrimvarLayout, PrimvarSlot, Surface, TextureStore, TileId};

/// Owns what a [`Surface`] borrows.
pub(crate) struct Fixture {
    pub(crate) chunk: MeshChunk,
    pub(crate) slots: Vec<PrimvarSlot>,
    pub(crate) textures: TextureStore,
    pub(crate) footprint: f32,
}

impl Fixture {
    /// A right triangle in no axis plane, legs of length 2, with `st` (0, 0), (1, 0), (0, 1).
    pub(crate) fn tilted_triangle() -> Self {
        let x = Vec3::new(2.0, 1.0, -2.0).normalize();
        let y = Vec3::new(1.0, 2.0, 2.0).normalize();
        let origin = Vec3::new(5.0, -3.0, 1.0);
        let chunk = MeshChunk {
            positions: [origin, origin + 2.0 * x, origin + 2.0 * y]
                .map(|p| p.to_array())
                .to_vec(),
            triangles: vec![[0, 1, 2]],
            attributes: vec![Attribute {
                name: "st".into(),
                width: 2,
                interpolation: Interpolation::Vertex,
                data: vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
            }],
            ..MeshChunk::default()
        };
        let mut fixture = Self {
            slots: Vec::new(),
            chunk,
            textures: TextureStore::open(&[], 0).0,
            footprint: 0.0,
        };
        fixture.slots = fixture.resolve(&["st".into()], &[]);
        fixture
    }

    /// The same with texture 0 a 2 by 2 image, rows from the lowest up, and texture 1 missing.
    pub(crate) fn with_image(texels: [[f32; 4]; 4]) -> Self {
        Self::with_tiles(texels, |textures| {
            // Both levels fit the budget and stay when the file is gone.
            for width in [0.0, 10.0] {
                let texel = textures.sample(0, Vec2::ZERO, width, [Wrap::Clamp; 2]);
                assert!(texel.is_some());
            }
        })
    }

    /// The same, of which no tile is in memory: tile 0 is the image, tile 1 its other level.
    pub(crate) fn with_absent_image() -> Self {
        Self::with_tiles([[0.0; 4]; 4], |_| ())
    }

    /// Makes a tile of the image resident, as black.
    pub(crate) fn take_in(&self, tile: TileId) {
        let n_texels = [4, 1][tile.0 as usize];
        self.textures.take_in(tile, vec![0; 16 * n_texels].into());
    }

    fn with_tiles(texels: [[f32; 4]; 4], load: impl FnOnce(&TextureStore)) -> Self {
        static N_FILES: AtomicU32 = AtomicU32::new(0);
        let number = N_FILES.fetch_add(1, Ordering::Relaxed);
        let name = format!("kilauea-shading-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, tile_file(texels)).unwrap();
        let image = TextureSource {
            path: "image.exr".into(),
            files: vec![TextureFile {
                udim: 0,
                tiles: path.to_str().unwrap().into(),
            }],
        };
        let missing = TextureSource {
            path: "missing.exr".into(),
            files: Vec::new(),
        };
        let (textures, errors) = TextureStore::open(&[image, missing], 1 << 20);
        assert!(errors.is_empty(), "{errors:?}");
        load(&textures);
        std::fs::remove_file(path).unwrap();
        Self {
            textures,
            ..Self::tilted_triangle()
        }
    }

    /// Slots of primvars by their names.
    pub(crate) fn resolve(
        &self,
        names: &[String],
        instances: &[InstanceAttribute],
    ) -> Vec<PrimvarSlot> {
        let counts = ElementCounts::from(&self.chunk);
        PrimvarLayout::resolve(names, &self.chunk.attributes, counts, instances)
    }

    pub(crate) fn surface(&self) -> Surface<'_> {
        let corners = self.chunk.corners(0);
        let [a, b, c] = corners;
        let ng = (b - a).cross(c - a).normalize();
        let barycentrics = Vec2::new(0.25, 0.5);
        Surface {
            p: a + 0.25 * (b - a) + 0.5 * (c - a),
            ng,
            ns: ng,
            wo: ng,
            corners,
            barycentrics,
            attributes: &self.chunk.attributes,
            element: Element::triangle(&self.chunk, 0),
            primvars: &self.slots,
            instance_primvars: &[],
            instance_index: 0,
            outside_ior: 1.0,
            footprint: self.footprint,
            textures: &self.textures,
        }
    }
}

/// A tile file of two levels: 2 by 2 linear `f32` texels, and their mean.
fn tile_file(texels: [[f32; 4]; 4]) -> Vec<u8> {
    let mean: [f32; 4] = std::array::from_fn(|c| texels.iter().map(|t| t[c]).sum::<f32>() / 4.0);
    let mut bytes = b"KLTILES\0".to_vec();
    let fixed = [1, 2, 2, 4, 2, 0, 0, 0, 2, 0];
    let levels = [2, 2, 80, 0, 1, 1, 144, 0];
    for number in fixed.into_iter().chain(levels) {
        bytes.extend(u32::to_le_bytes(number));
    }
    for value in texels.into_iter().flatten().chain(mean) {
        bytes.extend(value.to_le_bytes());
    }
    bytes
}
