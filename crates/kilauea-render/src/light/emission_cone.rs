use kilauea_math::{Frame, Vec2, Vec3, warp};
use std::f32::consts::{FRAC_PI_2, PI};

/// The directions into which a light sends photons, with their density.
#[derive(Clone, Debug)]
pub(super) struct EmissionCone {
    frame: Frame,
    density: Density,
}

#[derive(Clone, Copy, Debug)]
enum Density {
    /// In proportion to the cosine to the axis, up to an angle with this squared sine.
    Cosine { sin_sq_max: f32 },
    /// Even, up to an angle with this cosine, from one.
    Even { one_minus_cos_max: f32 },
}

impl EmissionCone {
    /// For flat lights that face the unit vector `axis`: what a diffuse emitter sends through each
    /// solid angle, up to `half_angle` radians.
    pub(super) fn cosine(axis: Vec3, half_angle: f32) -> Self {
        let sin = half_angle.clamp(0.0, FRAC_PI_2).sin();
        Self {
            frame: Frame::from_z(axis),
            density: Density::Cosine {
                sin_sq_max: sin * sin,
            },
        }
    }

    /// For lights that shine in all directions up to `half_angle` radians from the unit vector
    /// `axis`.
    pub(super) fn even(axis: Vec3, half_angle: f32) -> Self {
        let half_sin = (0.5 * half_angle.clamp(0.0, PI)).sin();
        Self {
            frame: Frame::from_z(axis),
            density: Density::Even {
                one_minus_cos_max: 2.0 * half_sin * half_sin,
            },
        }
    }

    /// A unit direction, and its density per solid angle: infinite in a cone without any.
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let (local, pdf) = match self.density {
            Density::Cosine { sin_sq_max } => {
                let disk = warp::concentric_disk(u) * sin_sq_max.sqrt();
                let cos = (1.0 - disk.length_squared()).max(0.0).sqrt();
                let pdf = warp::cosine_hemisphere_pdf(cos) / sin_sq_max;
                (disk.extend(cos), pdf)
            }
            Density::Even { one_minus_cos_max } => (
                warp::uniform_cone(u, one_minus_cos_max),
                warp::uniform_cone_pdf(one_minus_cos_max),
            ),
        };
        (self.frame.from_local(local), pdf)
    }

    /// The density of a unit direction.
    pub(super) fn pdf(&self, dir: Vec3) -> f32 {
        let cos = dir.dot(self.frame.z);
        match self.density {
            Density::Cosine { sin_sq_max } if cos > 0.0 && 1.0 - cos * cos <= sin_sq_max => {
                warp::cosine_hemisphere_pdf(cos) / sin_sq_max
            }
            Density::Even { one_minus_cos_max } if 1.0 - cos <= one_minus_cos_max => {
                warp::uniform_cone_pdf(one_minus_cos_max)
            }
            _ => 0.0,
        }
    }
}
