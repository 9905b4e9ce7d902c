//! Light from all around, given by a lat-long picture and importance-sampled.

use kilauea_math::{DMat3, DVec3, Frame, INV_PI, Mat3, Spectrum, Vec2, Vec3, hypot, warp};
use kilauea_scene::{Light, LightShape, Wrap};
use kilauea_texture::TextureStore;
use std::f32::consts::{PI, TAU};

use super::LightSample;
use super::distribution::Distribution2d;

/// A dome light.
#[derive(Clone, Debug)]
pub(super) struct DomeLight {
    engine_from_light: Mat3,
    light_from_engine: Mat3,
    radiance: Spectrum,
    /// Texture and its sampling distribution over (s, t); absent for a constant dome.
    picture: Option<(u32, Distribution2d)>,
    mean: Spectrum,
    /// Multiplies what diffuse lobes reflect.
    pub diffuse: f32,
    /// Multiplies what specular lobes reflect.
    pub specular: f32,
    /// Whether camera rays see it.
    pub visible_to_camera: bool,
}

/// Pictures are reduced to at most this width before the distribution is built.
const MAX_DISTRIBUTION_WIDTH: u32 = 2048;

impl DomeLight {
    /// None if `light` has another shape.
    pub(super) fn new(light: &Light, textures: &TextureStore) -> Option<Self> {
        if !matches!(light.shape, LightShape::Dome) {
            return None;
        }
        // Scale has no meaning at infinity: keep the rotation (and mirroring) alone.
        let m = light.world_from_light;
        let axis = |v: DVec3, fallback: DVec3| m.transform_vector3(v).normalize_or(fallback);
        let engine_from_light = DMat3::from_cols(
            axis(DVec3::X, DVec3::X),
            axis(DVec3::Y, DVec3::Y),
            axis(DVec3::Z, DVec3::Z),
        );
        let picture = light
            .texture
            .and_then(|t| Some((t, picture_distribution(t, textures)?)));
        let mean = match &picture {
            Some((_, (_, mean))) => light.radiance * *mean,
            // A dome whose texture is missing is black, as a missing picture holds no light.
            None if light.texture.is_some() => Spectrum::BLACK,
            None => light.radiance,
        };
        Some(Self {
            engine_from_light: engine_from_light.as_mat3(),
            light_from_engine: engine_from_light.inverse().as_mat3(),
            radiance: if mean.is_black() {
                Spectrum::BLACK
            } else {
                light.radiance
            },
            picture: picture.map(|(t, (distribution, _))| (t, distribution)),
            mean,
            diffuse: light.diffuse,
            specular: light.specular,
            visible_to_camera: light.visible_to_camera,
        })
    }

    /// A direction toward bright parts of the dome. For a constant dome the cosine to `n` is
    /// followed instead.
    pub(super) fn sample(&self, n: Vec3, u: Vec2, textures: &TextureStore) -> Option<LightSample> {
        let (wi, radiance, pdf) = match &self.picture {
            None => {
                let local = warp::cosine_hemisphere(u);
                let wi = Frame::from_z(n).from_local(local);
                (wi, self.radiance, warp::cosine_hemisphere_pdf(local.z))
            }
            Some((_, distribution)) => {
                let (st, pdf_st) = distribution.sample(u);
                let (local, sin_theta) = direction(st);
                let wi = (self.engine_from_light * local).normalize_or_zero();
                let pdf = pdf_st / (2.0 * PI * PI * sin_theta);
                (wi, self.radiance_at(place(local).0, textures), pdf)
            }
        };
        (pdf > 0.0 && pdf.is_finite()).then_some(LightSample {
            wi,
            distance: f32::INFINITY,
            radiance,
            pdf,
            is_delta: false,
        })
    }

    /// Radiance from a unit direction, and the density with which [`Self::sample`] for a surface
    /// with normal `n` chooses it.
    pub(super) fn radiance_and_pdf(
        &self,
        n: Option<Vec3>,
        dir: Vec3,
        textures: &TextureStore,
    ) -> (Spectrum, f32) {
        let Some((_, distribution)) = &self.picture else {
            let pdf = n.map_or(0.0, |n| warp::cosine_hemisphere_pdf(n.dot(dir)));
            return (self.radiance, pdf);
        };
        let local = self.light_from_engine * dir;
        let (st, sin_theta) = place(local);
        let pdf = distribution.pdf(st) / (2.0 * PI * PI * sin_theta.max(1e-9));
        (self.radiance_at(st, textures), pdf)
    }

    /// Bytes of what directions are chosen by.
    pub(super) fn n_bytes(&self) -> usize {
        self.picture.as_ref().map_or(0, |(_, d)| d.n_bytes())
    }

    /// A direction from which photons come: bright parts of the picture, or any of a constant dome.
    pub(super) fn sample_emission(&self, u: Vec2, textures: &TextureStore) -> Option<LightSample> {
        if self.picture.is_some() {
            // Where the surface looks that is lit makes no difference.
            return self.sample(Vec3::Z, u, textures);
        }
        Some(LightSample {
            wi: warp::uniform_sphere(u),
            distance: f32::INFINITY,
            radiance: self.radiance,
            pdf: 0.25 * INV_PI,
            is_delta: false,
        })
    }

    /// Density of [`Self::sample_emission`].
    pub(super) fn emission_pdf(&self, dir: Vec3, textures: &TextureStore) -> f32 {
        if self.picture.is_some() {
            self.radiance_and_pdf(None, dir, textures).1
        } else {
            0.25 * INV_PI
        }
    }

    /// Mean radiance over the sphere.
    pub(super) fn mean_radiance(&self) -> Spectrum {
        self.mean
    }

    fn radiance_at(&self, st: Vec2, textures: &TextureStore) -> Spectrum {
        let Some((texture, _)) = self.picture else {
            return self.radiance;
        };
        let texel = textures.sample(texture, st, 0.0, [Wrap::Repeat, Wrap::Clamp]);
        texel.map_or(Spectrum::BLACK, |[r, g, b, _]| {
            self.radiance * Spectrum::new(r, g, b)
        })
    }
}

/// Texture coordinates of a light-space direction: +z is the centre, +x a quarter turn to the
/// left, +y the top (UsdLuxDomeLight, `latlong`); and the sine of its angle to the pole.
fn place(local: Vec3) -> (Vec2, f32) {
    let s = 0.5 - local.x.atan2(local.z) / TAU;
    // atan2 keeps its precision at the poles, where acos loses it.
    let sin_theta = hypot(local.x, local.z);
    let theta = sin_theta.atan2(local.y);
    (Vec2::new(s, 1.0 - theta / PI), sin_theta)
}

/// The direction of texture coordinates, and the sine of its angle to the pole.
fn direction(st: Vec2) -> (Vec3, f32) {
    let (sin_phi, cos_phi) = ((0.5 - st.x) * TAU).sin_cos();
    let (sin_theta, cos_theta) = ((1.0 - st.y) * PI).sin_cos();
    (
        Vec3::new(sin_theta * sin_phi, cos_theta, sin_theta * cos_phi),
        sin_theta,
    )
}

/// A distribution over (s, t) that follows luminance times solid angle, and the mean radiance.
fn picture_distribution(
    texture: u32,
    textures: &TextureStore,
) -> Option<(Distribution2d, Spectrum)> {
    let [width, _] = textures.resolution(texture)?;
    let reduction = width.div_ceil(MAX_DISTRIBUTION_WIDTH);
    let level = reduction.next_power_of_two().trailing_zeros();
    let picture = textures.read_level(texture, level)?;
    let (w, h, texels) = (
        picture.width as usize,
        picture.height as usize,
        picture.texels,
    );
    let luminance = |x: usize, y: usize| {
        let [r, g, b, _] = texels[y * w + x];
        Spectrum::new(r, g, b).luminance().max(0.0)
    };
    let sin_theta = |y: usize| (PI * (y as f32 + 0.5) / h as f32).sin();
    let mut sum = [0.0_f64; 3];
    let mut weight_sum = 0.0_f64;
    for y in 0..h {
        for x in 0..w {
            let weight = sin_theta(y) as f64;
            weight_sum += weight;
            for (sum, &texel) in sum.iter_mut().zip(&texels[y * w + x]) {
                *sum += weight * texel as f64;
            }
        }
    }
    let mean = sum.map(|s| (s / weight_sum) as f32);
    let mean = Spectrum::from(mean);
    if mean.luminance() <= 0.0 || !mean.is_finite() {
        return None;
    }
    // Filtering spreads a bright texel over its neighbours: they must not have low densities.
    let floor = 1e-3 * mean.luminance();
    let weights: Vec<f32> = (0..h)
        .flat_map(|y| {
            (0..w).map(move |x| {
                let (left, right) = ((x + w - 1) % w, (x + 1) % w);
                let (below, above) = (y.saturating_sub(1), (y + 1).min(h - 1));
                let brightest = [y, below, above]
                    .into_iter()
                    .flat_map(|y| [luminance(left, y), luminance(x, y), luminance(right, y)])
                    .fold(0.0, f32::max);
                (0.9 * luminance(x, y) + 0.1 * brightest + floor) * sin_theta(y)
            })
        })
        .collect();
    Some((Distribution2d::new(w, h, &weights), mean))
}
