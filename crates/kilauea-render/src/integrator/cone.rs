use crate::camera::RayGenerator;

/// Width of the bundle that a ray stands for: a sample's share of a pixel, spread by rough bounces.
#[derive(Clone, Copy)]
pub(crate) struct RayCone {
    /// Where the path scattered last.
    pub(super) width: f32,
    /// Growth per unit of distance.
    spread: f32,
}

/// Least width of a camera ray's bundle, in pixels.
const MIN_PIXEL_FOOTPRINT: f32 = 0.125;
/// Spread in radians of the bundle behind a fully rough bounce. Textures seen that way may be
/// blurred without harm, and then fewer of their tiles are read.
const ROUGH_SPREAD: f32 = 0.1;

impl RayCone {
    /// As wide as camera rays are apart (PBR 4ed., 10.1.1): the pixel's filter is in their
    /// positions, and a wider bundle would blur textures, and flatten normal maps, once more.
    pub(crate) fn of_camera_ray(camera: &RayGenerator, samples_per_pixel: u32) -> Self {
        let pixels = (samples_per_pixel as f32).sqrt().recip();
        let pixels = pixels.max(MIN_PIXEL_FOOTPRINT);
        Self {
            width: pixels * camera.pixel_width(0.0),
            spread: pixels * (camera.pixel_width(1.0) - camera.pixel_width(0.0)),
        }
    }

    /// Width after a distance from where the path scattered last.
    #[inline]
    pub(crate) fn width_after(self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }

    /// Arrives at the next vertex.
    #[inline]
    pub(super) fn advance(&mut self, distance: f32) {
        self.width = self.width_after(distance);
    }

    /// Scatters by a lobe that is no mirror.
    #[inline]
    pub(super) fn scatter(&mut self, roughness: f32) {
        self.spread = self.spread.max(ROUGH_SPREAD * roughness);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::DVec3;
    use kilauea_scene::Camera;

    #[test]
    fn camera_rays_are_as_wide_as_their_share_of_a_pixel() {
        let camera = Camera {
            clipping_range: [0.1, 100.0],
            ..Camera::default()
        };
        let camera = RayGenerator::new(&camera, [100, 100], DVec3::ZERO);
        let width = |samples| RayCone::of_camera_ray(&camera, samples).spread * 100.0;
        for (samples, expected) in [(1, 1.0), (16, 0.25), (10_000, 0.125)] {
            assert!((width(samples) - expected).abs() < 1e-5, "{samples}");
        }
    }
}
