//! The picture of a dome, as directions are chosen by it.

use kilauea_math::{Spectrum, Vec2};
use kilauea_texture::TextureStore;
use std::f32::consts::PI;

use super::distribution::Distribution2d;

/// Pictures are reduced to at most this width.
const MAX_WIDTH: u32 = 2048;
/// Of the mean luminance, what all directions have at least where all light is looked for.
const FLOOR: f32 = 1e-3;

/// A lat-long picture in texels; t = 0, the bottom, comes first.
pub(super) struct DomePicture {
    width: usize,
    height: usize,
    /// Of each texel, with a share of the brightest one around it: filtering spreads light over
    /// neighbours, which must not have low densities.
    luminance: Vec<f32>,
    /// Radiance over the sphere.
    pub(super) mean: Spectrum,
}

impl DomePicture {
    /// None of a picture that is black or cannot be read.
    pub(super) fn read(texture: u32, textures: &TextureStore) -> Option<Self> {
        let [width, _] = textures.resolution(texture)?;
        let reduction = width.div_ceil(MAX_WIDTH);
        let level = reduction.next_power_of_two().trailing_zeros();
        let picture = textures.read_level(texture, level)?;
        Self::of_texels(picture.width as usize, &picture.texels)
    }

    fn of_texels(width: usize, texels: &[[f32; 4]]) -> Option<Self> {
        let height = texels.len() / width;
        let mean = mean(width, height, texels);
        (mean.luminance() > 0.0 && mean.is_finite()).then(|| Self {
            width,
            height,
            luminance: spread_luminance(width, height, texels),
            mean,
        })
    }

    /// A density that follows all light.
    pub(super) fn all_light(&self) -> Distribution2d {
        let floor = FLOOR * self.mean.luminance();
        self.following(|luminance| luminance + floor)
    }

    /// A density that follows what is brighter than the mean, and is zero elsewhere; none of a
    /// picture without contrast.
    pub(super) fn above_mean(&self) -> Option<Distribution2d> {
        let stands_out = self.luminance.iter().any(|&l| self.excess(l) > 0.0);
        stands_out.then(|| self.following(|luminance| self.excess(luminance)))
    }

    /// How much of the light stands out, in [0, 1]: the root mean square of what is above the mean,
    /// over that of all.
    pub(super) fn peakedness(&self) -> f32 {
        let (mut of_excess, mut of_all) = (0.0, 0.0);
        for (y, row) in self.luminance.chunks_exact(self.width).enumerate() {
            let solid_angle = f64::from(sin_theta(y, self.height));
            for &luminance in row {
                of_excess += solid_angle * f64::from(self.excess(luminance)).powi(2);
                of_all += solid_angle * f64::from(luminance).powi(2);
            }
        }
        (of_excess / of_all).sqrt() as f32
    }

    /// Texels that are so many times brighter than the mean: where their middles are.
    pub(super) fn spots(&self, contrast: f32) -> impl Iterator<Item = Vec2> {
        let min_luminance = contrast * self.mean.luminance();
        let size = Vec2::new(self.width as f32, self.height as f32);
        let texels = self.luminance.iter().enumerate();
        texels
            .filter(move |(_, l)| **l > min_luminance)
            .map(move |(idx, _)| {
                let (x, y) = (idx % self.width, idx / self.width);
                (Vec2::new(x as f32, y as f32) + 0.5) / size
            })
    }

    /// The angle that texels are high, in radians.
    pub(super) fn texel_angle(&self) -> f32 {
        PI / self.height as f32
    }

    fn excess(&self, luminance: f32) -> f32 {
        // Sums are rounded: what is no more than that is no contrast.
        (luminance - (1.0 + 1e-4) * self.mean.luminance()).max(0.0)
    }

    fn following(&self, weight: impl Fn(f32) -> f32) -> Distribution2d {
        let rows = self.luminance.chunks_exact(self.width).enumerate();
        let weights: Vec<f32> = rows
            .flat_map(|(y, row)| {
                let solid_angle = sin_theta(y, self.height);
                row.iter().map(move |&l| (l, solid_angle))
            })
            .map(|(luminance, solid_angle)| weight(luminance) * solid_angle)
            .collect();
        Distribution2d::new(self.width, self.height, &weights)
    }
}

/// What the solid angle of texels of a row is in proportion to.
fn sin_theta(y: usize, height: usize) -> f32 {
    (PI * (y as f32 + 0.5) / height as f32).sin()
}

fn mean(width: usize, height: usize, texels: &[[f32; 4]]) -> Spectrum {
    let mut sum = [0.0_f64; 3];
    let mut weight_sum = 0.0_f64;
    for (y, row) in texels.chunks_exact(width).enumerate() {
        let weight = f64::from(sin_theta(y, height));
        for texel in row {
            weight_sum += weight;
            for (sum, &value) in sum.iter_mut().zip(texel) {
                *sum += weight * f64::from(value);
            }
        }
    }
    Spectrum::from(sum.map(|s| (s / weight_sum) as f32))
}

fn spread_luminance(width: usize, height: usize, texels: &[[f32; 4]]) -> Vec<f32> {
    let luminance = |x: usize, y: usize| {
        let [r, g, b, _] = texels[y * width + x];
        Spectrum::new(r, g, b).luminance().max(0.0)
    };
    (0..height)
        .flat_map(|y| {
            (0..width).map(move |x| {
                let (left, right) = ((x + width - 1) % width, (x + 1) % width);
                let (below, above) = (y.saturating_sub(1), (y + 1).min(height - 1));
                let brightest = [y, below, above]
                    .into_iter()
                    .flat_map(|y| [luminance(left, y), luminance(x, y), luminance(right, y)])
                    .fold(0.0, f32::max);
                0.9 * luminance(x, y) + 0.1 * brightest
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 16;

    fn picture(luminance: impl Fn(usize, usize) -> f32) -> DomePicture {
        let places = (0..WIDTH / 2).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
        let texels: Vec<_> = places
            .map(|(x, y)| {
                let l = luminance(x, y);
                [l, l, l, 1.0]
            })
            .collect();
        DomePicture::of_texels(WIDTH, &texels).expect("there is light")
    }

    /// Density at the middle of a texel.
    fn density(distribution: &Distribution2d, x: usize, y: usize) -> f32 {
        let [s, t] = [x, y].map(|i| (i as f32 + 0.5) / WIDTH as f32);
        distribution.pdf(Vec2::new(s, 2.0 * t))
    }

    #[test]
    fn nothing_stands_out_of_a_picture_of_one_color() {
        let grey = picture(|_, _| 0.7);
        assert!((grey.mean.luminance() - 0.7).abs() < 1e-6);
        assert_eq!(grey.peakedness(), 0.0);
        assert!(grey.above_mean().is_none());
    }

    #[test]
    fn a_sun_stands_out() {
        let sunny = picture(|x, y| if (x, y) == (11, 5) { 1e4 } else { 1.0 });
        assert!(sunny.peakedness() > 0.98, "{}", sunny.peakedness());
        let sky = picture(|_, y| if y < 4 { 0.5 } else { 1.5 });
        assert!(
            (0.2..0.6).contains(&sky.peakedness()),
            "{}",
            sky.peakedness()
        );
    }

    #[test]
    fn surfaces_look_for_what_is_brighter_than_the_mean_alone() {
        let gradient = picture(|x, y| (1 + x % 5 + y) as f32);
        let (direct, all) = (gradient.above_mean(), gradient.all_light());
        let direct = direct.expect("some is above the mean");
        for (idx, &luminance) in gradient.luminance.iter().enumerate() {
            let (x, y) = (idx % WIDTH, idx / WIDTH);
            let is_bright = luminance > gradient.mean.luminance();
            assert_eq!(density(&direct, x, y) > 0.0, is_bright, "{x}, {y}");
            assert!(density(&all, x, y) > 0.0, "{x}, {y}");
        }
    }

    #[test]
    fn texels_beside_a_sun_are_looked_for() {
        let sunny = picture(|x, y| if (x, y) == (15, 5) { 1e4 } else { 1.0 });
        let direct = sunny.above_mean().expect("the sun is above the mean");
        for (x, y) in [(0, 4), (0, 5), (0, 6), (14, 5), (15, 4)] {
            assert!(density(&direct, x, y) > 0.0, "{x}, {y}");
        }
        assert_eq!(density(&direct, 2, 5), 0.0);
    }

    #[test]
    fn a_black_picture_is_none() {
        let black = [[0.0, 0.0, 0.0, 1.0]; 8];
        assert!(DomePicture::of_texels(4, &black).is_none());
    }
}
