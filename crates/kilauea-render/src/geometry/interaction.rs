use kilauea_accel::{PrimitiveId, Ray, Visibility, offset_origin};
use kilauea_math::{Vec2, Vec3};
use kilauea_shading::Surface;
use shaders::Shader;

use super::PrimitiveRef;

/// How a point on a primitive is seen.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// The hit's parameters: weights of a triangle's second and third corner; along and across a
    /// curve.
    pub uv: Vec2,
    /// The point as the ray found it, engine space. Not read on triangles, which have it from `uv`.
    pub p_ray: Vec3,
    /// Unit vector to where the ray came from.
    pub wo: Vec3,
    /// When, in [0, 1] over the shutter.
    pub time: f32,
    /// Width of the ray; 0 asks for the finest texture level.
    pub footprint: f32,
}

/// A point on a surface, before any shader ran.
#[derive(Clone, Copy)]
pub struct Interaction<'a> {
    /// Which primitive.
    pub at: PrimitiveRef,
    /// The same, as rays name it.
    pub id: PrimitiveId,
    /// What shaders see.
    pub surface: Surface<'a>,
    /// By axis: how far `surface.p` may be from the surface that rays are tested against.
    pub p_error: Vec3,
    /// The material's shader.
    pub shader: &'a Shader,
    /// When, in [0, 1] over the shutter.
    pub time: f32,
}

impl Interaction<'_> {
    /// Whether the point and its directions are numbers.
    pub fn is_finite(&self) -> bool {
        let s = &self.surface;
        [s.p, s.ng, s.ns, s.wo].iter().all(|v| v.is_finite()) && s.barycentrics.is_finite()
    }

    /// A ray from here in the unit direction `dir`, that does not meet the primitive it leaves.
    #[inline]
    pub fn spawn_ray(&self, dir: Vec3, t_max: f32, visibility: Visibility) -> Ray {
        Ray {
            origin: self.offset_origin(dir),
            dir,
            t_min: 0.0,
            t_max,
            time: self.time,
            visibility,
            from: self.id,
        }
    }

    /// The point, moved off the surface to the side of `dir`.
    #[inline]
    pub fn offset_origin(&self, dir: Vec3) -> Vec3 {
        offset_origin(self.surface.p, self.p_error, self.surface.ng, dir)
    }
}
