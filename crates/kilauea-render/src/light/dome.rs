//! Light from all around, given by a lat-long picture and importance-sampled.

use kilauea_math::{DMat3, DVec3, Frame, INV_PI, Mat3, Spectrum, Vec2, Vec3, hypot, warp};
use kilauea_scene::{Light, LightShape, Wrap};
use kilauea_texture::TextureStore;
use std::f32::consts::{PI, TAU};
use std::sync::OnceLock;

use super::LightSample;
use super::distribution::Distribution2d;
use super::dome_picture::DomePicture;
use super::glint::MIN_CONTRAST;
use super::spot_cone::SpotCone;

/// A dome light.
#[derive(Clone, Debug)]
pub(super) struct DomeLight {
    engine_from_light: Mat3,
    light_from_engine: Mat3,
    radiance: Spectrum,
    /// None of a constant dome.
    texture: Option<u32>,
    mean: Spectrum,
    /// Around all that is by [`MIN_CONTRAST`] brighter than the mean, in the engine's space.
    spots: Option<SpotCone>,
    prominence: f32,
    /// Over (s, t), what surfaces look for: what is brighter than the mean. None where nothing is.
    direct: Option<Distribution2d>,
    /// Over (s, t), where photons come from: all light. Made when the first one leaves; none of a
    /// constant dome.
    emission: OnceLock<Option<Distribution2d>>,
    /// Multiplies what diffuse lobes reflect.
    pub diffuse: f32,
    /// Multiplies what specular lobes reflect.
    pub specular: f32,
    /// Whether camera rays see it.
    pub visible_to_camera: bool,
}

/// Share of a dome's light that it is chosen by at least, though nothing of it is brighter than its
/// mean and rays of surfaces meet all of it: both together see it with less noise than these alone.
const LEAST_PEAKEDNESS: f32 = 0.1;

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
            .and_then(|texture| DomePicture::read(texture, textures));
        let mean = match &picture {
            Some(picture) => light.radiance * picture.mean,
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
            texture: picture.as_ref().and(light.texture),
            mean,
            spots: picture.as_ref().and_then(|picture| {
                let toward =
                    |st| (engine_from_light.as_mat3() * direction(st).0).normalize_or_zero();
                let dirs: Vec<Vec3> = picture.spots(MIN_CONTRAST).map(toward).collect();
                // As texels are filtered.
                SpotCone::around(&dirs, 2.0 * picture.texel_angle())
            }),
            prominence: picture
                .as_ref()
                .map_or(0.0, DomePicture::peakedness)
                .max(LEAST_PEAKEDNESS),
            direct: picture.as_ref().and_then(DomePicture::above_mean),
            emission: OnceLock::new(),
            diffuse: light.diffuse,
            specular: light.specular,
            visible_to_camera: light.visible_to_camera,
        })
    }

    /// A direction toward what is brighter than the mean, as the rest is left to rays of surfaces
    /// (Karlík et al. 2019, "MIS Compensation"). Where nothing is, the cosine to `n` is followed.
    pub(super) fn sample(&self, n: Vec3, u: Vec2, textures: &TextureStore) -> Option<LightSample> {
        if let Some(direct) = &self.direct {
            return self.sample_picture(direct, u, textures);
        }
        let local = warp::cosine_hemisphere(u);
        let wi = Frame::from_z(n).from_local(local);
        let radiance = self.radiance_from(wi, textures);
        sample_at_infinity(wi, radiance, warp::cosine_hemisphere_pdf(local.z))
    }

    fn sample_picture(
        &self,
        distribution: &Distribution2d,
        u: Vec2,
        textures: &TextureStore,
    ) -> Option<LightSample> {
        let (st, pdf_st) = distribution.sample(u);
        let (local, sin_theta) = direction(st);
        let wi = (self.engine_from_light * local).normalize_or_zero();
        let radiance = self.radiance_at(|| place(local).0, textures);
        sample_at_infinity(wi, radiance, density_of_direction(pdf_st, sin_theta))
    }

    /// Radiance from a unit direction, and the density with which [`Self::sample`] for a surface
    /// with normal `n` chooses it.
    pub(super) fn radiance_and_pdf(
        &self,
        n: Option<Vec3>,
        dir: Vec3,
        textures: &TextureStore,
    ) -> (Spectrum, f32) {
        let Some(direct) = &self.direct else {
            let pdf = n.map_or(0.0, |n| warp::cosine_hemisphere_pdf(n.dot(dir)));
            return (self.radiance_from(dir, textures), pdf);
        };
        let (st, pdf) = self.place_and_pdf(direct, dir);
        (self.radiance_at(|| st, textures), pdf)
    }

    /// Whether there may be light from a unit direction that is by [`MIN_CONTRAST`] brighter than the
    /// mean.
    #[inline]
    pub(super) fn may_have_spot(&self, dir: Vec3) -> bool {
        self.spots.is_some_and(|spots| spots.contains(dir))
    }

    /// Whether there is any.
    pub(super) fn has_spots(&self) -> bool {
        self.spots.is_some()
    }

    /// Radiance from a unit direction.
    pub(super) fn radiance_from(&self, dir: Vec3, textures: &TextureStore) -> Spectrum {
        self.radiance_at(|| self.place(dir).0, textures)
    }

    /// Bytes of what directions are chosen by.
    pub(super) fn n_bytes(&self) -> usize {
        let emission = self.emission.get().and_then(Option::as_ref);
        let both = [self.direct.as_ref(), emission];
        both.into_iter()
            .flatten()
            .map(Distribution2d::n_bytes)
            .sum()
    }

    /// A direction from which photons come: bright parts of the picture, or any of a constant dome.
    pub(super) fn sample_emission(&self, u: Vec2, textures: &TextureStore) -> Option<LightSample> {
        match self.emission(textures) {
            Some(emission) => self.sample_picture(emission, u, textures),
            None => sample_at_infinity(warp::uniform_sphere(u), self.radiance, 0.25 * INV_PI),
        }
    }

    /// Density of [`Self::sample_emission`].
    pub(super) fn emission_pdf(&self, dir: Vec3, textures: &TextureStore) -> f32 {
        let emission = self.emission(textures);
        emission.map_or(0.25 * INV_PI, |e| self.place_and_pdf(e, dir).1)
    }

    fn emission(&self, textures: &TextureStore) -> Option<&Distribution2d> {
        let made = self.emission.get_or_init(|| {
            let picture = DomePicture::read(self.texture?, textures)?;
            Some(picture.all_light())
        });
        made.as_ref()
    }

    /// Mean radiance over the sphere.
    pub(super) fn mean_radiance(&self) -> Spectrum {
        self.mean
    }

    /// Irradiance by what surfaces have to look for, if nothing is occluded.
    pub(super) fn irradiance_to_find(&self) -> f32 {
        self.prominence * PI * self.mean.luminance()
    }

    /// How much surfaces have to look for it, beside a light that they cannot meet by themselves.
    pub(super) fn prominence(&self) -> f32 {
        self.prominence
    }

    /// Radiance where the picture is looked up, if there is one.
    fn radiance_at(&self, st: impl FnOnce() -> Vec2, textures: &TextureStore) -> Spectrum {
        let Some(texture) = self.texture else {
            return self.radiance;
        };
        let texel = textures.sample(texture, st(), 0.0, [Wrap::Repeat, Wrap::Clamp]);
        texel.map_or(Spectrum::BLACK, |[r, g, b, _]| {
            self.radiance * Spectrum::new(r, g, b)
        })
    }

    /// Where a direction is in the picture, and the density with which [`Self::sample_picture`] draws
    /// it.
    fn place_and_pdf(&self, distribution: &Distribution2d, dir: Vec3) -> (Vec2, f32) {
        let (st, sin_theta) = self.place(dir);
        let pdf = density_of_direction(distribution.pdf(st), sin_theta.max(MIN_SIN_THETA));
        (st, pdf)
    }

    /// As [`place`], of a direction in the engine's space.
    fn place(&self, dir: Vec3) -> (Vec2, f32) {
        place(self.light_from_engine * dir)
    }
}

fn sample_at_infinity(wi: Vec3, radiance: Spectrum, pdf: f32) -> Option<LightSample> {
    (pdf > 0.0 && pdf.is_finite()).then_some(LightSample {
        wi,
        distance: f32::INFINITY,
        radiance,
        pdf,
        is_delta: false,
    })
}

/// At poles, where a row of texels is a point.
const MIN_SIN_THETA: f32 = 1e-9;

/// Per solid angle, of a density over texture coordinates.
fn density_of_direction(pdf_st: f32, sin_theta: f32) -> f32 {
    pdf_st / (2.0 * PI * PI * sin_theta)
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
