//! Which texels a lookup needs: the image, the mip levels, the four neighbours.

use kilauea_math::Vec2;
use kilauea_scene::Wrap;

use crate::TextureStore;
use crate::image::{Image, Level};
use crate::store::{N_UDIM_COLUMNS, N_UDIMS, Texture};
use crate::wrap::{is_black, wrap_index};

/// Where a lookup is.
pub(crate) enum Place<'a> {
    /// Beyond the border of an image that ends there.
    Black,
    /// In an image, at coordinates of its own.
    Image {
        image: &'a Image,
        st: Vec2,
        wrap: [Wrap; 2],
    },
}

/// The columns and rows of a bilinear lookup, each with its weight.
pub(crate) struct Taps {
    pub(crate) columns: [(u32, f32); 2],
    pub(crate) rows: [(u32, f32); 2],
}

impl TextureStore {
    /// Where `st` is in a texture; none where the image or the UDIM tile is missing.
    #[inline]
    pub(crate) fn place(&self, texture: u32, st: Vec2, wrap: [Wrap; 2]) -> Option<Place<'_>> {
        // Keeps texel indices far inside `i64`; NaN is looked up at 0.
        let bounded = |x: f32| if x.is_nan() { 0.0 } else { x.clamp(-1e9, 1e9) };
        let st = Vec2::new(bounded(st.x), bounded(st.y));
        match self.textures.get(texture as usize)? {
            Texture::Missing => None,
            Texture::Plain(image) => {
                if is_black(st.x, wrap[0]) || is_black(st.y, wrap[1]) {
                    return Some(Place::Black);
                }
                let image = &self.images[*image as usize];
                Some(Place::Image { image, st, wrap })
            }
            Texture::Udim(images) => {
                let tile = st.floor();
                let columns = 0.0..N_UDIM_COLUMNS as f32;
                let rows = 0.0..(N_UDIMS / N_UDIM_COLUMNS) as f32;
                if !columns.contains(&tile.x) || !rows.contains(&tile.y) {
                    return None;
                }
                let image = images[tile.y as usize * N_UDIM_COLUMNS as usize + tile.x as usize];
                Some(Place::Image {
                    image: self.images.get(image as usize)?,
                    st: st - tile,
                    wrap: [Wrap::Clamp; 2],
                })
            }
        }
    }
}

impl Image {
    /// The finer mip level for a footprint of `width` in units of st, and how far the right one is
    /// towards the next; 0 where the next is not needed.
    #[inline]
    pub(crate) fn mip_level(&self, width: f32) -> (usize, f32) {
        let finest = self.levels[0];
        let width_texels = width * finest.width.max(finest.height) as f32;
        if width_texels.is_nan() || width_texels <= 1.0 {
            return (0, 0.0);
        }
        let coarsest = self.levels.len() - 1;
        let lod = width_texels.log2().min(coarsest as f32);
        let fine = (lod as usize).min(coarsest);
        (fine, lod - fine as f32)
    }
}

impl Taps {
    #[inline]
    pub(crate) fn new(level: &Level, st: Vec2, wrap: [Wrap; 2]) -> Self {
        let (x0, fx) = texel_position(st.x, level.width);
        let (y0, fy) = texel_position(st.y, level.height);
        let column = |x| wrap_index(x, level.width, wrap[0]);
        let row = |y| wrap_index(y, level.height, wrap[1]);
        Self {
            columns: [(column(x0), 1.0 - fx), (column(x0 + 1), fx)],
            rows: [(row(y0), 1.0 - fy), (row(y0 + 1), fy)],
        }
    }
}

/// The texel whose centre is at or before `s`, and how far `s` is towards the next one.
#[inline]
fn texel_position(s: f32, size: u32) -> (i64, f32) {
    let x = s * size as f32 - 0.5;
    let x0 = x.floor();
    (x0 as i64, x - x0)
}
