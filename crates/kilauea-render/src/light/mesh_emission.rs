//! Photons of emissive meshes.

use kilauea_math::{Frame, Vec2, Vec3, warp};
use kilauea_texture::TextureStore;
use std::f32::consts::PI;

use super::aim::Target;
use super::emit::LightRay;
use super::mesh::MeshLights;
use crate::geometry::{Geometry, Interaction, View};

impl MeshLights {
    /// A ray that leaves a triangle to either side, along a direction that `target` may choose; none
    /// where it has no area.
    pub(super) fn emit<'a>(
        &self,
        light: u32,
        target: &Target,
        u_direction: Vec2,
        u_point: Vec2,
        geometry: &'a Geometry,
        textures: &'a TextureStore,
    ) -> Option<(LightRay, Interaction<'a>)> {
        let (at, group) = self.triangle(light - self.first_light);
        let [a, b, c] = geometry.corners(at);
        let area_vector = 0.5 * (b - a).cross(c - a);
        let normal = area_vector.try_normalize()?;
        let (dir, pdf_direction) = target.direction(
            u_direction,
            |u| cosine_to_either_side(normal, u),
            |dir| cosine_to_either_side_pdf(normal, dir),
        );

        let weights = warp::uniform_triangle(u_point);
        let view = View {
            uv: weights,
            p_ray: a + weights.x * (b - a) + weights.y * (c - a),
            wo: dir,
            time: 0.0,
            footprint: 0.0,
        };
        let interaction = geometry.interaction(at, &view, textures);
        let surface = &interaction.surface;
        let radiance = group.constant.unwrap_or_else(|| {
            interaction.shader.emission(surface) * interaction.shader.opacity(surface)
        });
        let ray = LightRay {
            p: surface.p,
            dir,
            radiance,
            cross_section: area_vector.dot(dir).abs(),
            pdf_direction,
            is_delta: false,
            clearance: 0.0,
        };
        Some((ray, interaction))
    }

    /// The emissive mesh that a triangle light is of, by number.
    pub(super) fn group_of(&self, light: u32) -> u32 {
        let triangle = light - self.first_light;
        self.groups
            .partition_point(|g| g.first_triangle <= triangle) as u32
            - 1
    }

    /// A point before the outside of each emissive mesh.
    pub(super) fn points_before<'a>(
        &'a self,
        geometry: &'a Geometry,
    ) -> impl Iterator<Item = Vec3> + 'a {
        self.groups.iter().map(move |group| {
            let [a, b, c] = self.corners(self.first_light + group.first_triangle, geometry);
            let area_vector = 0.5 * (b - a).cross(c - a);
            let above = 1e-3 * area_vector.length().sqrt() * area_vector.normalize_or(Vec3::Z);
            (a + b + c) / 3.0 + above
        })
    }

    /// Luminance of the power in watts of each triangle, in order.
    pub(super) fn fluxes<'a>(&'a self, geometry: &'a Geometry) -> impl Iterator<Item = f32> + 'a {
        // Both sides shine.
        self.light_bounds(geometry).map(|b| 2.0 * PI * b.power)
    }
}

/// A unit direction; the first number chooses the side, and what it leaves the direction.
fn cosine_to_either_side(normal: Vec3, u: Vec2) -> Vec3 {
    let (side, u_x) = if u.x < 0.5 {
        (1.0, 2.0 * u.x)
    } else {
        (-1.0, 2.0 * u.x - 1.0)
    };
    let local = warp::cosine_hemisphere(Vec2::new(u_x, u.y));
    Frame::from_z(side * normal).from_local(local)
}

/// The density with which a triangle with the unit normal `normal` emits along `dir`.
pub(super) fn cosine_to_either_side_pdf(normal: Vec3, dir: Vec3) -> f32 {
    0.5 * warp::cosine_hemisphere_pdf(normal.dot(dir).abs())
}
