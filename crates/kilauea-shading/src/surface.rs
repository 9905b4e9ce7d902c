use kilauea_math::{Vec2, Vec3};
use kilauea_scene::{Attribute, InstanceAttribute, Interpolation, MeshChunk};

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
    /// The corners of the triangle; of what is not flat, a triangle in the tangent plane with the
    /// point as its first corner.
    pub corners: [Vec3; 3],
    /// Weights of the second and third corner.
    pub barycentrics: Vec2,
    /// Primvars of the chunk that was hit.
    pub attributes: &'a [Attribute],
    /// Which of their values belong to the point.
    pub element: Element,
    /// The shader's primvars on this chunk, from [`crate::PrimvarLayout::resolve`].
    pub primvars: &'a [PrimvarSlot],
    /// Per-instance primvars of the placement that was hit; empty where there are none.
    pub instance_primvars: &'a [InstanceAttribute],
    /// Which instance of that placement.
    pub instance_index: u32,
    /// Index of refraction of what is on the outside of the mesh here: 1 for air, or that of the
    /// [`crate::Medium`] in which the mesh lies.
    pub outside_ior: f32,
    /// Width of the ray here, in the units of `p`; 0 asks for the finest texture level.
    pub footprint: f32,
    /// Images.
    pub textures: &'a TextureStore,
}

/// Which values of a chunk's attributes belong to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Element {
    /// Of a triangle.
    Triangle {
        /// Its number in the chunk.
        face: u32,
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// Of a curve's segment.
    Segment {
        /// Its number in the chunk.
        segment: u32,
        /// Its first control point; the others follow.
        first: u32,
        /// How much of each control point is here; zero beyond the last.
        weights: [f32; 4],
        /// Derivatives of the weights along [`Surface::corners`]' first edge.
        slopes: [f32; 4],
    },
    /// Of a point in a cloud of points.
    Point(u32),
}

impl Element {
    /// A triangle of a mesh.
    #[inline]
    pub fn triangle(chunk: &MeshChunk, face: u32) -> Self {
        Self::Triangle {
            face,
            vertices: chunk.triangles[face as usize],
        }
    }
}

impl Surface<'_> {
    /// The value of a primvar here; none where the surface has no such primvar.
    #[inline]
    pub fn primvar(&self, slot: u32) -> Option<Channels> {
        // What does not vary over the triangle needs no interpolation.
        match *self.primvars.get(slot as usize)? {
            PrimvarSlot::Chunk(idx) => {
                let attribute = self.attributes.get(idx as usize)?;
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
                let attribute = self.attributes.get(idx as usize)?;
                let at = |i: u32| value(&attribute.data, attribute.width, i as usize);
                match (attribute.interpolation, self.element) {
                    (Interpolation::Constant, _) => Some([at(0)?; 3]),
                    (
                        Interpolation::Uniform,
                        Element::Triangle { face: i, .. } | Element::Segment { segment: i, .. },
                    )
                    | (_, Element::Point(i)) => Some([at(i)?; 3]),
                    (Interpolation::Vertex, Element::Triangle { vertices, .. }) => {
                        let [a, b, c] = vertices;
                        Some([at(a)?, at(b)?, at(c)?])
                    }
                    (
                        Interpolation::Vertex,
                        Element::Segment {
                            first,
                            weights,
                            slopes,
                            ..
                        },
                    ) => {
                        let here = weighted(first, weights, at)?;
                        let along = weighted(first, slopes, at)?;
                        let next = std::array::from_fn(|i| here[i] + along[i]);
                        Some([here, next, here])
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

/// A weighted sum of up to four consecutive values.
#[inline]
fn weighted(
    first: u32,
    weights: [f32; 4],
    at: impl Fn(u32) -> Option<Channels>,
) -> Option<Channels> {
    let mut sum = [0.0; 4];
    for (i, weight) in (first..).zip(weights).filter(|(_, weight)| *weight != 0.0) {
        let value = at(i)?;
        sum.iter_mut()
            .zip(value)
            .for_each(|(s, v)| *s += weight * v);
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Fixture;

    #[test]
    fn primvars_along_a_segment_follow_its_weights() {
        let mut fixture = Fixture::tilted_triangle();
        fixture.chunk.attributes[0].data = vec![9.0, 9.0, 1.0, 10.0, 2.0, 20.0, 4.0, 40.0];
        let mut s = fixture.surface();
        s.barycentrics = Vec2::ZERO;
        s.element = Element::Segment {
            segment: 0,
            first: 1,
            weights: [0.5, 0.25, 0.25, 0.0],
            slopes: [-1.0, 0.0, 1.0, 0.0],
        };
        assert_eq!(s.primvar(0).map(|v| [v[0], v[1]]), Some([2.0, 20.0]));
        let [_, next, side] = s.primvar_at_corners(0).unwrap();
        assert_eq!([next[0], next[1]], [5.0, 50.0]);
        assert_eq!([side[0], side[1]], [2.0, 20.0]);
        s.element = Element::Point(2);
        assert_eq!(s.primvar(0).map(|v| [v[0], v[1]]), Some([2.0, 20.0]));
        // Outside of the array.
        s.element = Element::Point(4);
        assert_eq!(s.primvar(0), None);
    }
}
