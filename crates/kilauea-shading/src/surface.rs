use kilauea_math::{Vec2, Vec3};
use kilauea_scene::{InstanceAttribute, Interpolation, MeshChunk};

use crate::TextureStore;
use crate::graph::Channels;
use crate::primvar::{PrimvarSlot, value};

/// The surface point that a shader sees.
///
/// Directions are unit vectors and point away from the surface. Points share one space with the
/// directions, whichever the caller has chosen.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// The point.
    pub p: Vec3,
    /// Geometric normal, to the outside of the mesh.
    pub ng: Vec3,
    /// Interpolated normal, on the same side as `ng`.
    pub ns: Vec3,
    /// To where the ray came from.
    pub wo: Vec3,
    /// The corners of the triangle.
    pub corners: [Vec3; 3],
    /// Weights of the second and third corner.
    pub barycentrics: Vec2,
    /// The mesh that was hit.
    pub chunk: &'a MeshChunk,
    /// Index of the triangle in the chunk.
    pub triangle: u32,
    /// The shader's primvars on this chunk, from [`crate::PrimvarLayout::resolve`].
    pub primvars: &'a [PrimvarSlot],
    /// Per-instance primvars of the placement that was hit; empty where there are none.
    pub instance_primvars: &'a [InstanceAttribute],
    /// Which instance of that placement.
    pub instance_index: u32,
    /// Width of the ray here, in the units of `p`; 0 asks for the finest texture level.
    pub footprint: f32,
    /// Images.
    pub textures: &'a TextureStore,
}

impl Surface<'_> {
    /// The value of a primvar here; none where the surface has no such primvar.
    #[inline]
    pub fn primvar(&self, slot: u32) -> Option<Channels> {
        // What does not vary over the triangle needs no interpolation.
        match *self.primvars.get(slot as usize)? {
            PrimvarSlot::Chunk(idx) => {
                let attribute = self.chunk.attributes.get(idx as usize)?;
                if attribute.interpolation == Interpolation::Constant {
                    return value(&attribute.data, attribute.width, 0);
                }
            }
            PrimvarSlot::Missing | PrimvarSlot::Instance(_) => {}
        }
        let [a, b, c] = self.primvar_at_corners(slot)?;
        Some(self.interpolate(a, b, c))
    }

    /// The values of a primvar at the triangle's corners; none where the surface has no such
    /// primvar.
    #[inline]
    pub(crate) fn primvar_at_corners(&self, slot: u32) -> Option<[Channels; 3]> {
        match *self.primvars.get(slot as usize)? {
            PrimvarSlot::Missing => None,
            PrimvarSlot::Instance(idx) => {
                let attribute = self.instance_primvars.get(idx as usize)?;
                let v = value(
                    &attribute.data,
                    attribute.width,
                    self.instance_index as usize,
                )?;
                Some([v; 3])
            }
            PrimvarSlot::Chunk(idx) => {
                let attribute = self.chunk.attributes.get(idx as usize)?;
                let at = |i: u32| value(&attribute.data, attribute.width, i as usize);
                match attribute.interpolation {
                    Interpolation::Constant => Some([at(0)?; 3]),
                    Interpolation::Uniform => Some([at(self.triangle)?; 3]),
                    Interpolation::Vertex => {
                        let [a, b, c] = *self.chunk.triangles.get(self.triangle as usize)?;
                        Some([at(a)?, at(b)?, at(c)?])
                    }
                }
            }
        }
    }

    /// Linear interpolation over the triangle; exact where the corners agree.
    #[inline]
    pub(crate) fn interpolate(&self, a: Channels, b: Channels, c: Channels) -> Channels {
        let w = self.barycentrics;
        std::array::from_fn(|i| a[i] + w.x * (b[i] - a[i]) + w.y * (c[i] - a[i]))
    }

    /// Width of the ray in texture coordinates, where those are `st` at the triangle's corners:
    /// the footprint times the root of the ratio of the triangle's areas.
    #[inline]
    pub(crate) fn st_footprint(&self, st: [Vec2; 3]) -> f32 {
        if self.footprint <= 0.0 {
            return 0.0;
        }
        let area_st = (st[1] - st[0]).perp_dot(st[2] - st[0]).abs();
        let [a, b, c] = self.corners;
        let area_p = (b - a).cross(c - a).length();
        if area_p > 0.0 {
            self.footprint * (area_st / area_p).sqrt()
        } else {
            0.0
        }
    }
}
