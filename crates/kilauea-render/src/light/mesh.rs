//! Emissive meshes: every triangle is a light that emits from both sides, of which one may be hidden.
//!
//! Those that move are no lights, nor are emissive curves and points: rays that meet them carry
//! their light, but none are aimed at them. Neither are those that scattered rays do not meet.

use kilauea_math::{Bounds3, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::Visibility;
use kilauea_texture::TextureStore;
use std::collections::BTreeSet;

use super::LightSample;
use super::lit_sides::LitSides;
use super::spherical_triangle::{SphericalTriangle, TrianglePoint};
use super::tree::LightBounds;
use crate::geometry::{Geometry, PrimitiveRef, View};

/// The triangles of all emissive chunks, numbered through.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshLights {
    /// Emissive chunks, in the order of their lights.
    pub(super) groups: Vec<Group>,
    /// By placement: the entry of `groups` of its first emissive chunk.
    first_group: Vec<u32>,
    /// Number of the first triangle light.
    pub(super) first_light: u32,
    n_triangles: u32,
    /// By triangle.
    lit_sides: Vec<LitSides>,
    /// Prims whose emission is met by chance only.
    unsampled: BTreeSet<u32>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    placement: u32,
    chunk: u32,
    pub(super) first_triangle: u32,
    /// Luminance of the mean emission.
    luminance: f32,
    /// Radiance, where it is the same everywhere.
    pub(super) constant: Option<Spectrum>,
}

impl MeshLights {
    /// `first_light` is the number of the first triangle light; `p_camera` is where paths begin, in
    /// engine space.
    pub(super) fn new(
        geometry: &Geometry,
        textures: &TextureStore,
        first_light: u32,
        p_camera: Vec3,
    ) -> Self {
        let mut lights = Self {
            first_light,
            ..Self::default()
        };
        if !geometry.shaders().iter().any(shaders::Shader::is_emissive) {
            return lights;
        }
        for placement in 0..geometry.n_placements() as u32 {
            lights.first_group.push(lights.groups.len() as u32);
            let is_still = !geometry.is_moving(placement);
            for (chunk_idx, chunk) in geometry.meshes(placement).iter().enumerate() {
                let shader = &geometry.shaders()[chunk.material as usize];
                let rays = chunk.visibility & geometry.visibility(placement);
                if !shader.is_emissive() || rays & Visibility::INDIRECT == Visibility::NONE {
                    continue;
                }
                if is_still && chunk.later_keys.is_empty() {
                    let chunk_idx = chunk_idx as u32;
                    lights.groups.push(Group {
                        placement,
                        chunk: chunk_idx,
                        first_triangle: lights.n_triangles,
                        luminance: shader.mean_emission(textures).luminance().max(1e-6),
                        constant: shader.constant_emission().filter(|_| shader.is_opaque()),
                    });
                    let n_triangles = chunk.triangles.len() as u32;
                    lights.n_triangles += n_triangles;
                    let corners = (0..n_triangles).map(|primitive| {
                        geometry.corners(PrimitiveRef {
                            placement,
                            chunk: chunk_idx,
                            primitive,
                        })
                    });
                    lights.lit_sides.extend(if shader.is_opaque() {
                        LitSides::of_mesh(&corners.collect::<Vec<_>>(), p_camera)
                    } else {
                        vec![LitSides::Both; n_triangles as usize]
                    });
                } else {
                    lights.unsampled.insert(chunk.prim_idx);
                }
            }
        }
        lights
    }

    /// Number of triangles.
    pub(super) fn len(&self) -> usize {
        self.n_triangles as usize
    }

    /// Prims that emit and move: their light is met by chance only.
    pub(super) fn unsampled(&self) -> impl Iterator<Item = u32> {
        self.unsampled.iter().copied()
    }

    /// Bytes held.
    pub(super) fn n_bytes(&self) -> usize {
        size_of_val(&self.groups[..])
            + size_of_val(&self.first_group[..])
            + size_of_val(&self.lit_sides[..])
    }

    /// The number of the light that a triangle is, if it emits.
    #[inline]
    pub(super) fn light_of(&self, at: PrimitiveRef) -> Option<u32> {
        let first = *self.first_group.get(at.placement as usize)? as usize;
        let group = self.groups[first..]
            .iter()
            .take_while(|g| g.placement == at.placement)
            .find(|g| g.chunk == at.chunk)?;
        Some(self.first_light + group.first_triangle + at.primitive)
    }

    /// What the light tree needs to know, in order.
    pub(super) fn light_bounds<'a>(
        &'a self,
        geometry: &'a Geometry,
    ) -> impl Iterator<Item = LightBounds> + 'a {
        (0..self.n_triangles).map(move |i| {
            let (at, group) = self.triangle(i);
            let [a, b, c] = geometry.corners(at);
            let area_vector = 0.5 * (b - a).cross(c - a);
            let lit_sides = self.lit_sides[i as usize];
            let axis = match lit_sides {
                LitSides::Both | LitSides::Front => area_vector,
                LitSides::Back => -area_vector,
            };
            LightBounds {
                bounds: Bounds3::from_points([a, b, c]),
                power: group.luminance * area_vector.length(),
                axis: axis.normalize_or(Vec3::Z),
                cos_normals: 1.0,
                cos_emission: 0.0,
                is_two_sided: lit_sides == LitSides::Both,
            }
        })
    }

    /// A direction from `p` toward a point of the triangle.
    pub(super) fn sample(
        &self,
        light: u32,
        p: Vec3,
        u: Vec2,
        geometry: &Geometry,
        textures: &TextureStore,
    ) -> Option<LightSample> {
        let (at, group) = self.triangle(light - self.first_light);
        let corners = geometry.corners(at);
        if !self.lit_sides(light).face(&corners, p) {
            return None;
        }
        let near = SphericalTriangle::new(&corners, p);
        let TrianglePoint { weights, to_point } = match &near {
            Some(near) => near.sample(u),
            None => point_by_area(&corners, p, u),
        };
        let distance = to_point.length();
        let wi = to_point / distance;
        let pdf = match near {
            Some(near) => near.pdf(),
            None => pdf_by_area(&corners, -wi, distance),
        };
        if !pdf.is_finite() || pdf <= 0.0 {
            return None;
        }
        let radiance = group.constant.unwrap_or_else(|| {
            let view = View {
                uv: weights,
                p_ray: p + to_point,
                wo: -wi,
                time: 0.0,
                footprint: 0.0,
            };
            let interaction = geometry.interaction(at, &view, textures);
            let surface = &interaction.surface;
            interaction.shader.emission(surface) * interaction.shader.opacity(surface)
        });
        Some(LightSample {
            wi,
            distance,
            radiance,
            pdf,
            is_delta: false,
        })
    }

    /// Density per solid angle with which [`Self::sample`] at `p` chooses the direction from which the
    /// unit direction `wo` leaves a triangle light with these corners, over a distance.
    #[inline]
    pub(super) fn pdf(
        &self,
        light: u32,
        corners: &[Vec3; 3],
        p: Vec3,
        wo: Vec3,
        distance: f32,
    ) -> f32 {
        if !self.lit_sides(light).face(corners, p) {
            return 0.0;
        }
        match SphericalTriangle::new(corners, p) {
            Some(near) => near.pdf(),
            None => pdf_by_area(corners, wo, distance),
        }
    }

    /// Corner points of a triangle light.
    pub(super) fn corners(&self, light: u32, geometry: &Geometry) -> [Vec3; 3] {
        let (at, _) = self.triangle(light - self.first_light);
        geometry.corners(at)
    }

    /// Whether light is looked for on one side only of some, that of the camera.
    pub(super) fn has_hidden_sides(&self) -> bool {
        self.lit_sides.iter().any(|&sides| sides != LitSides::Both)
    }

    fn lit_sides(&self, light: u32) -> LitSides {
        self.lit_sides[(light - self.first_light) as usize]
    }

    pub(super) fn triangle(&self, idx: u32) -> (PrimitiveRef, &Group) {
        let group = &self.groups[self.group(idx)];
        let at = PrimitiveRef {
            placement: group.placement,
            chunk: group.chunk,
            primitive: idx - group.first_triangle,
        };
        (at, group)
    }

    /// The entry of `groups` that a triangle is in.
    pub(super) fn group(&self, triangle: u32) -> usize {
        let n_begun = self
            .groups
            .partition_point(|g| g.first_triangle <= triangle);
        n_begun - 1
    }
}

/// A point chosen evenly on a triangle, seen from `p`.
fn point_by_area(corners: &[Vec3; 3], p: Vec3, u: Vec2) -> TrianglePoint {
    let [a, b, c] = *corners;
    let weights = warp::uniform_triangle(u);
    let q = a + weights.x * (b - a) + weights.y * (c - a);
    TrianglePoint {
        weights,
        to_point: q - p,
    }
}

/// Density per solid angle of a point chosen evenly on a triangle.
fn pdf_by_area(corners: &[Vec3; 3], wo: Vec3, distance: f32) -> f32 {
    let [a, b, c] = *corners;
    let area_cosine = 0.5 * (b - a).cross(c - a).dot(wo).abs();
    distance * distance / area_cosine
}
