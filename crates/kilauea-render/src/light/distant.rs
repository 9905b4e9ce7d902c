//! Light from infinitely far, within a cone of directions.

use kilauea_math::{DVec3, Frame, Spectrum, Vec2, Vec3, warp};
use kilauea_scene::{Light, LightShape};
use std::f32::consts::PI;

use super::LightSample;

/// A distant light.
#[derive(Clone, Debug)]
pub(super) struct DistantLight {
    /// Toward the light.
    frame: Frame,
    /// One minus the cosine of the cone's half angle; zero for parallel light.
    one_minus_cos: f32,
    radiance: Spectrum,
    /// Multiplies what diffuse lobes reflect.
    pub diffuse: f32,
    /// Multiplies what specular lobes reflect.
    pub specular: f32,
    /// Whether camera rays see it.
    pub visible_to_camera: bool,
}

impl DistantLight {
    /// None if `light` has another shape.
    pub(super) fn new(light: &Light) -> Option<Self> {
        let LightShape::Distant { angle_degrees } = light.shape else {
            return None;
        };
        let toward = light.world_from_light.transform_vector3(DVec3::Z).as_vec3();
        let half_angle = (angle_degrees.to_radians() * 0.5).clamp(0.0, std::f64::consts::PI);
        // sin²(x/2) form: exact for the half degree of a sun.
        let one_minus_cos = (2.0 * (half_angle * 0.5).sin().powi(2)) as f32;
        Some(Self {
            frame: Frame::from_z(toward.normalize_or(Vec3::Z)),
            one_minus_cos,
            radiance: light.radiance,
            diffuse: light.diffuse,
            specular: light.specular,
            visible_to_camera: light.visible_to_camera,
        })
    }

    /// A direction toward the light.
    pub(super) fn sample(&self, u: Vec2) -> LightSample {
        let is_delta = self.is_delta();
        let (wi, pdf) = if is_delta {
            (self.frame.z, 1.0)
        } else {
            let local = warp::uniform_cone(u, self.one_minus_cos);
            (
                self.frame.from_local(local),
                warp::uniform_cone_pdf(self.one_minus_cos),
            )
        };
        LightSample {
            wi,
            distance: f32::INFINITY,
            radiance: self.radiance,
            pdf,
            is_delta,
        }
    }

    /// Radiance and density of a unit direction; None outside the cone.
    pub(super) fn radiance_and_pdf(&self, dir: Vec3) -> Option<(Spectrum, f32)> {
        // |dir - z|² / 2 = 1 - cos, without cancellation near the axis.
        let one_minus_cos = 0.5 * dir.distance_squared(self.frame.z);
        (!self.is_delta() && one_minus_cos <= self.one_minus_cos)
            .then(|| (self.radiance, warp::uniform_cone_pdf(self.one_minus_cos)))
    }

    /// Radiance within the cone.
    pub(super) fn radiance(&self) -> Spectrum {
        self.radiance
    }

    /// Irradiance on a surface that faces the light.
    pub(super) fn irradiance(&self) -> Spectrum {
        if self.is_delta() {
            return self.radiance;
        }
        let cos = 1.0 - self.one_minus_cos;
        self.radiance * (PI * (1.0 - cos * cos)).max(PI * self.one_minus_cos.min(1.0))
    }

    /// Toward the light.
    pub(super) fn direction(&self) -> Vec3 {
        self.frame.z
    }

    /// Whether all light is parallel.
    pub(super) fn is_delta(&self) -> bool {
        self.one_minus_cos < 1e-12
    }
}
