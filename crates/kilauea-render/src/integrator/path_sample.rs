use kilauea_film::PixelSample;
use kilauea_math::{PackedSpectrum, Spectrum, Vec3};

/// What a path has found so far: of a [`PixelSample`] what cannot be told from the rest, packed, as
/// there is one for each path that waits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathSample {
    pub(crate) emission: PackedSpectrum,
    pub(crate) direct_diffuse: PackedSpectrum,
    pub(crate) direct_specular: PackedSpectrum,
    pub(crate) indirect_diffuse: PackedSpectrum,
    pub(crate) indirect_specular: PackedSpectrum,
    pub(crate) albedo: PackedSpectrum,
    pub(crate) n: Vec3,
    pub(crate) p: Vec3,
    /// Distance of the first hit along the ray in units of its direction; infinite where nothing is
    /// hit.
    pub(crate) t: f32,
    pub(crate) prim_id: i32,
    pub(crate) instance_id: i32,
}

impl PathSample {
    /// A path that hits nothing and sees no light.
    pub(super) fn new() -> Self {
        Self {
            emission: PackedSpectrum::BLACK,
            direct_diffuse: PackedSpectrum::BLACK,
            direct_specular: PackedSpectrum::BLACK,
            indirect_diffuse: PackedSpectrum::BLACK,
            indirect_specular: PackedSpectrum::BLACK,
            albedo: PackedSpectrum::BLACK,
            n: Vec3::ZERO,
            p: Vec3::ZERO,
            t: f32::INFINITY,
            prim_id: -1,
            instance_id: -1,
        }
    }

    /// All light.
    #[inline]
    pub(crate) fn light(&self) -> Spectrum {
        self.emission.unpack()
            + self.direct_diffuse.unpack()
            + self.direct_specular.unpack()
            + self.indirect_diffuse.unpack()
            + self.indirect_specular.unpack()
    }

    /// What a pixel gets of a path whose ray goes `distance_per_depth` along its direction for each
    /// unit along the view axis, through a point at the squared distance `offset_sq` from the
    /// pixel's center.
    #[inline]
    pub(crate) fn at_pixel(&self, distance_per_depth: f32, offset_sq: f32) -> PixelSample {
        let has_hit = self.t != f32::INFINITY;
        PixelSample {
            beauty: self.light(),
            alpha: if has_hit { 1.0 } else { 0.0 },
            direct_diffuse: self.direct_diffuse.unpack(),
            indirect_diffuse: self.indirect_diffuse.unpack(),
            direct_specular: self.direct_specular.unpack(),
            indirect_specular: self.indirect_specular.unpack(),
            emission: self.emission.unpack(),
            albedo: self.albedo.unpack(),
            n: self.n,
            p: self.p,
            z: if has_hit {
                self.t / distance_per_depth
            } else {
                f32::INFINITY
            },
            prim_id: self.prim_id,
            instance_id: self.instance_id,
            offset_sq,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_hits_nothing_is_transparent_and_infinitely_far() {
        let sample = PathSample::new().at_pixel(2.0, 0.25);
        let expected = PixelSample {
            offset_sq: 0.25,
            ..PixelSample::default()
        };
        assert_eq!(sample, expected);
    }

    #[test]
    fn depth_is_measured_along_the_axis_and_light_adds_up() {
        let path = PathSample {
            t: 6.0,
            emission: Spectrum::splat(1.0).into(),
            direct_diffuse: Spectrum::splat(2.0).into(),
            indirect_specular: Spectrum::splat(4.0).into(),
            ..PathSample::new()
        };
        let sample = path.at_pixel(2.0, 0.0);
        assert_eq!((sample.alpha, sample.z), (1.0, 3.0));
        assert_eq!(sample.beauty, Spectrum::splat(7.0));
    }
}
