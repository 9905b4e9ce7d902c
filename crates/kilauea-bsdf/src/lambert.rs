use kilauea_math::{INV_PI, Spectrum, Vec2, Vec3, warp};

use crate::side::Side;
use crate::{BsdfEval, BsdfSample};

/// Ideal diffuse reflection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lambert {
    pub(crate) albedo: Spectrum,
}

impl Lambert {
    #[inline(always)]
    pub(crate) fn eval(&self, side: &Side, wi: Vec3) -> BsdfEval {
        side.reflected_cos(wi).map_or(BsdfEval::ZERO, |cos_i| {
            let pdf = cos_i * INV_PI;
            BsdfEval {
                diffuse: self.albedo * pdf,
                specular: Spectrum::BLACK,
                pdf,
            }
        })
    }

    #[inline(always)]
    pub(crate) fn sample(&self, side: &Side, u: [f32; 3]) -> Option<BsdfSample> {
        if self.albedo.is_black() {
            return None;
        }
        let wi = side
            .frame
            .from_local(warp::cosine_hemisphere(Vec2::new(u[1], u[2])));
        let cos_i = side.reflected_cos(wi)?;
        Some(BsdfSample {
            wi,
            diffuse: self.albedo,
            specular: Spectrum::BLACK,
            pdf: cos_i * INV_PI,
            is_delta: false,
            is_transmission: false,
            is_diffuse: true,
            roughness: 1.0,
        })
    }
}
