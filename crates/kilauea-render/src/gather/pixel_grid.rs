use kilauea_math::hash::combine;
use kilauea_scene::DataWindow;
use kilauea_spot::{RunError, Wire};

use crate::follow::{Follow, Workforce, follow_some};
use crate::frame::Frame;
use crate::integrator::RayTracer;
use crate::share::{PathKind, PathPass, follow_shared};

/// Square blocks of pixels, of which one pixel each is looked at, by chance.
pub(super) struct PixelGrid {
    min: [i32; 2],
    max: [i32; 2],
    /// Pixels on the side of a block.
    stride: i32,
    n_columns: u32,
    pub(super) n_blocks: u32,
    seed: u32,
}

impl PixelGrid {
    /// A grid of about `n_blocks`, spread evenly over the picture.
    pub(super) fn new(frame: &Frame, n_blocks: f64, seed: u32) -> Self {
        let DataWindow { min, max } = frame.film.data_window();
        let pixels_per_block = frame.n_pixels as f64 / n_blocks.max(1.0);
        let stride = pixels_per_block.sqrt().ceil().max(1.0) as i32;
        let n_columns = ((max[0] - min[0]) as u32).div_ceil(stride as u32);
        let n_rows = ((max[1] - min[1]) as u32).div_ceil(stride as u32);
        Self {
            min,
            max,
            stride,
            n_columns,
            n_blocks: n_columns * n_rows,
            seed,
        }
    }

    /// Follows the paths of all blocks, together with those who render the same frame.
    pub(super) fn follow<F: Follow<Left: Wire>, const CUTOUTS: bool>(
        &self,
        paths: &F,
        kind: PathKind,
        frame: &Frame,
        tracer: &RayTracer<'_, CUTOUTS>,
    ) -> Result<Vec<F::Left>, RunError> {
        let pass = PathPass {
            kind,
            seed: self.seed,
            n_paths: self.n_blocks,
        };
        let workforce = Workforce::inline(frame.n_threads);
        follow_shared(frame.path_share(), pass, |blocks| {
            follow_some(paths, blocks, tracer, workforce)
        })
    }

    /// Column and row of the pixel of a block.
    pub(super) fn pixel(&self, block: u32) -> [i32; 2] {
        let corner = [block % self.n_columns, block / self.n_columns];
        std::array::from_fn(|axis| {
            let offset = combine(combine(self.seed, block), axis as u32) % self.stride as u32;
            let pixel = self.min[axis] + corner[axis] as i32 * self.stride + offset as i32;
            pixel.min(self.max[axis] - 1)
        })
    }
}
