//! Light that photons bring straight to pixels.

use kilauea_math::{PackedSpectrum, Spectrum};
use kilauea_scene::DataWindow;

/// What one photon brings to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Splat {
    /// Column and row.
    pub(crate) pixel: [i32; 2],
    /// Number of the path of light.
    pub(crate) path_idx: u32,
    /// By diffuse lobes where the camera sees it, of one of all the paths of a pass.
    pub(crate) diffuse: Spectrum,
    /// By all others.
    pub(crate) specular: Spectrum,
    /// Share of the light that is left to paths from the camera.
    pub(crate) left: f32,
}

/// What photons bring to the samples of a pass.
///
/// Each sample has its own paths of light, as many as any other, so that samples are as independent as they
/// are without: what is told of their noise holds, and a pass may be left at any sample.
pub(crate) struct Splats {
    window: DataWindow,
    /// First of those of a pixel, by number in the window; and the end of all.
    starts: Vec<u32>,
    /// By pixel; of one, in the order of their paths.
    of_samples: Vec<OfSample>,
}

/// What a photon brings to a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OfSample {
    sample_idx: u32,
    pub(crate) diffuse: PackedSpectrum,
    pub(crate) specular: PackedSpectrum,
}

/// The paths of light of a pass, and for which samples of each pixel they are.
#[derive(Clone, Copy)]
pub(super) struct PassPaths {
    pub(super) first_sample: u32,
    pub(super) n_samples: u32,
    pub(super) n_paths: u32,
}

impl PassPaths {
    /// The sample that a path is for: those of one follow each other, as their numbers are even then.
    fn sample_of(self, path_idx: u32) -> u32 {
        let number = u64::from(path_idx) * u64::from(self.n_samples) / u64::from(self.n_paths);
        self.first_sample + number as u32
    }
}

impl Splats {
    /// Of splats in the order of their paths, within the window.
    pub(super) fn sorted(splats: &[Splat], window: DataWindow, paths: PassPaths) -> Self {
        let DataWindow { min, max } = window;
        let [width, height] = [0, 1].map(|axis| (max[axis] - min[axis]) as usize);
        // Count, then place.
        let mut starts = vec![0; width * height + 1];
        let number = |splat: &Splat| number_in(window, splat.pixel);
        for splat in splats {
            starts[number(splat) + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let nothing = OfSample {
            sample_idx: 0,
            diffuse: PackedSpectrum::BLACK,
            specular: PackedSpectrum::BLACK,
        };
        let mut of_samples = vec![nothing; splats.len()];
        let scale = paths.n_samples as f32;
        for splat in splats {
            let place = &mut next[number(splat)];
            of_samples[*place as usize] = OfSample {
                sample_idx: paths.sample_of(splat.path_idx),
                diffuse: (splat.diffuse * scale).into(),
                specular: (splat.specular * scale).into(),
            };
            *place += 1;
        }
        Self {
            window,
            starts,
            of_samples,
        }
    }

    /// What a sample of a pixel in the window gets.
    #[inline]
    pub(crate) fn of_sample(
        &self,
        pixel: [i32; 2],
        sample_idx: u32,
    ) -> impl Iterator<Item = &OfSample> {
        let number = number_in(self.window, pixel);
        let [first, end] = [number, number + 1].map(|n| self.starts[n] as usize);
        let of_pixel = &self.of_samples[first..end];
        of_pixel
            .iter()
            .filter(move |splat| splat.sample_idx == sample_idx)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.of_samples.len()
    }

    /// Bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + size_of_val(&self.of_samples[..])
    }
}

fn number_in(DataWindow { min, max }: DataWindow, [x, y]: [i32; 2]) -> usize {
    let [column, row] = [x - min[0], y - min[1]].map(|i| i as usize);
    row * (max[0] - min[0]) as usize + column
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sample_gets_what_its_paths_bring_to_its_pixel() {
        let window = DataWindow {
            min: [-1, 2],
            max: [2, 4],
        };
        let paths = PassPaths {
            first_sample: 4,
            n_samples: 4,
            n_paths: 8,
        };
        let splat = |pixel, path_idx: u32| Splat {
            pixel,
            path_idx,
            diffuse: Spectrum::splat(path_idx as f32),
            specular: Spectrum::ONE,
            left: 0.5,
        };
        let all = [
            splat([1, 3], 0),
            splat([-1, 2], 1),
            splat([1, 3], 1),
            splat([1, 3], 5),
            splat([0, 3], 7),
        ];
        let splats = Splats::sorted(&all, window, paths);
        let of = |pixel, sample_idx| -> Vec<f32> {
            let found = splats.of_sample(pixel, sample_idx);
            found.map(|s| s.diffuse.unpack()[0] / 4.0).collect()
        };
        assert_eq!(of([1, 3], 4), [0.0, 1.0]);
        assert_eq!((of([1, 3], 5), of([1, 3], 6)), (vec![], vec![5.0]));
        assert_eq!((of([-1, 2], 4), of([0, 3], 7)), (vec![1.0], vec![7.0]));
        assert_eq!((of([0, 2], 4), splats.len()), (vec![], 5));
    }
}
