//! Emissive meshes: every triangle is a light that emits from both sides.

use kilauea_math::{Bounds3, Spectrum, Vec2, Vec3, warp};
use kilauea_texture::TextureStore;

use super::LightSample;
use super::tree::LightBounds;
use crate::geometry::{Geometry, TriangleRef};

/// The triangles of all emissive chunks, numbered through.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshLights {
    /// Emissive chunks, in the order of their lights.
    groups: Vec<Group>,
    /// By placement: the entry of `groups` of its first emissive chunk.
    first_group: Vec<u32>,
    /// Number of the first triangle light.
    first_light: u32,
    n_triangles: u32,
}

#[derive(Clone, Copy, Debug)]
struct Group {
    placement: u32,
    chunk: u32,
    first_triangle: u32,
    /// Luminance of the mean emission.
    luminance: f32,
    /// Radiance, where it is the same everywhere.
    constant: Option<Spectrum>,
}

impl MeshLights {
    /// `first_light` is the number of the first triangle light.
    pub(super) fn new(geometry: &Geometry, textures: &TextureStore, first_light: u32) -> Self {
        let mut lights = Self {
            first_light,
            ..Self::default()
        };
        if !geometry.shaders().iter().any(shaders::Shader::is_emissive) {
            return lights;
        }
        for placement in 0..geometry.n_placements() as u32 {
            lights.first_group.push(lights.groups.len() as u32);
            for (chunk_idx, chunk) in geometry.chunks(placement).iter().enumerate() {
                let shader = &geometry.shaders()[chunk.material as usize];
                if shader.is_emissive() {
                    lights.groups.push(Group {
                        placement,
                        chunk: chunk_idx as u32,
                        first_triangle: lights.n_triangles,
                        luminance: shader.mean_emission(textures).luminance().max(1e-6),
                        constant: shader.constant_emission().filter(|_| shader.is_opaque()),
                    });
                    lights.n_triangles += chunk.triangles.len() as u32;
                }
            }
        }
        lights
    }

    /// Number of triangles.
    pub(super) fn len(&self) -> usize {
        self.n_triangles as usize
    }

    /// Bytes held.
    pub(super) fn n_bytes(&self) -> usize {
        size_of_val(&self.groups[..]) + size_of_val(&self.first_group[..])
    }

    /// The number of the light that a triangle is, if it emits.
    #[inline]
    pub(super) fn light_of(&self, at: TriangleRef) -> Option<u32> {
        let first = *self.first_group.get(at.placement as usize)? as usize;
        let group = self.groups[first..]
            .iter()
            .take_while(|g| g.placement == at.placement)
            .find(|g| g.chunk == at.chunk)?;
        Some(self.first_light + group.first_triangle + at.triangle)
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
            LightBounds {
                bounds: Bounds3::from_points([a, b, c]),
                power: group.luminance * area_vector.length(),
                axis: area_vector.normalize_or(Vec3::Z),
                cos_normals: 1.0,
                cos_emission: 0.0,
                is_two_sided: true,
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
        let weights = warp::uniform_triangle(u);
        let corners = geometry.corners(at);
        let [a, b, c] = corners;
        let q = a + weights.x * (b - a) + weights.y * (c - a);
        let to_light = q - p;
        let distance = to_light.length();
        let wi = to_light / distance;
        let pdf = pdf(&corners, -wi, distance);
        if !pdf.is_finite() || pdf <= 0.0 {
            return None;
        }
        let radiance = group.constant.unwrap_or_else(|| {
            let interaction = geometry.interaction(at, weights, -wi, 0.0, textures);
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

    fn triangle(&self, idx: u32) -> (TriangleRef, &Group) {
        let group = &self.groups[self.groups.partition_point(|g| g.first_triangle <= idx) - 1];
        let at = TriangleRef {
            placement: group.placement,
            chunk: group.chunk,
            triangle: idx - group.first_triangle,
        };
        (at, group)
    }
}

/// Density per solid angle of a point chosen evenly on a triangle, at a distance, where the unit
/// direction `wo` leaves it.
#[inline]
pub(super) fn pdf(corners: &[Vec3; 3], wo: Vec3, distance: f32) -> f32 {
    let [a, b, c] = *corners;
    let area_cosine = 0.5 * (b - a).cross(c - a).dot(wo).abs();
    distance * distance / area_cosine
}
