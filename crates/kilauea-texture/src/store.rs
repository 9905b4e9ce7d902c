use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use kilauea_math::Vec2;
use kilauea_scene::{TextureSource, Wrap};

use crate::cache::{HeldTile, TileCache};
use crate::image::{Image, Level};
use crate::lookup::{Place, Taps};
use crate::{TextureError, TextureStats};

const FIRST_UDIM: u32 = 1001;
pub(crate) const N_UDIM_COLUMNS: u32 = 10;
pub(crate) const N_UDIMS: u32 = 100;
const NO_IMAGE: u32 = u32::MAX;

/// All images of a scene, for lookup from any number of threads.
///
/// Lookups give the image that the tile files hold, whatever has been evicted in between. A tile
/// that cannot be read reads as missing, as do all others of its image that are not resident; the
/// error is kept for [`TextureStore::take_errors`].
#[derive(Debug)]
pub struct TextureStore {
    pub(crate) textures: Vec<Texture>,
    pub(crate) images: Vec<Image>,
    pub(crate) cache: TileCache,
    /// At most one per image.
    read_errors: Mutex<Vec<TextureError>>,
}

#[derive(Debug)]
pub(crate) enum Texture {
    Missing,
    Plain(u32),
    /// Image of each tile, or `NO_IMAGE`.
    Udim(Box<[u32; N_UDIMS as usize]>),
}

/// A whole mip level, for building distributions.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelTexels {
    /// Texels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear red, green, blue and alpha, row by row from the lowest (t = 0) up.
    pub texels: Vec<[f32; 4]>,
}

impl TextureStore {
    /// Opens the tile files of `sources` and reads their headers; texture *i* is source *i*.
    ///
    /// Tiles take at most `budget_bytes`. Files that cannot be used are reported and read as
    /// missing; so are those that hold what was not finite in their image, which are used.
    pub fn open(sources: &[TextureSource], budget_bytes: u64) -> (Self, Vec<TextureError>) {
        let mut images: Vec<Image> = Vec::new();
        let mut errors = Vec::new();
        let mut textures = Vec::with_capacity(sources.len());
        for source in sources {
            let mut texture = Texture::Missing;
            for file in &source.files {
                if file.udim != 0 && !(FIRST_UDIM..FIRST_UDIM + N_UDIMS).contains(&file.udim) {
                    errors.push(TextureError::Udim {
                        image: source.path.clone(),
                        udim: file.udim,
                    });
                    continue;
                }
                let first_slot = images.last().map_or(0, Image::end_slot);
                match Image::open(&source.path, PathBuf::from(&file.tiles), first_slot) {
                    Ok(image) => {
                        if image.n_replaced > 0 {
                            errors.push(TextureError::NotFinite {
                                image: source.path.clone(),
                                n_values: image.n_replaced,
                            });
                        }
                        texture.add(file.udim, images.len() as u32);
                        images.push(image);
                    }
                    Err(error) => errors.push(error),
                }
            }
            textures.push(texture);
        }
        let n_slots = images.last().map_or(0, Image::end_slot);
        let store = Self {
            textures,
            images,
            cache: TileCache::new(n_slots as usize, budget_bytes),
            read_errors: Mutex::default(),
        };
        (store, errors)
    }

    /// Linear red, green, blue and alpha at `st`, where (0, 0) is the lower left of the image.
    ///
    /// Bilinear in the finest mip level for `width` 0, else trilinear for a footprint of `width`
    /// in units of st. None where the image or the UDIM tile is missing. UDIM tiles do not wrap:
    /// each is clamped at its border. `Wrap::Black` is transparent black outside [0, 1] and
    /// clamped inside.
    pub fn sample(&self, texture: u32, st: Vec2, width: f32, wrap: [Wrap; 2]) -> Option<[f32; 4]> {
        match self.place(texture, st, wrap)? {
            Place::Black => Some([0.0; 4]),
            Place::Image { image, st, wrap } => self.filtered(image, st, width, wrap),
        }
    }

    /// Width and height of the finest mip level; of the lowest tile for UDIM. None where the image
    /// is missing.
    pub fn resolution(&self, texture: u32) -> Option<[u32; 2]> {
        let finest = self.first_image(texture)?.levels[0];
        Some([finest.width, finest.height])
    }

    /// Number of mip levels; of the lowest tile for UDIM. None where the image is missing.
    pub fn n_levels(&self, texture: u32) -> Option<u32> {
        Some(self.first_image(texture)?.levels.len() as u32)
    }

    /// A whole mip level, 0 the finest; of the lowest tile for UDIM. None where the image or the
    /// level is missing. Its tiles do not stay in memory on account of this.
    pub fn read_level(&self, texture: u32, level: u32) -> Option<LevelTexels> {
        let image = self.first_image(texture)?;
        let level = image.levels.get(level as usize)?;
        let mut texels = vec![[0.0; 4]; level.width as usize * level.height as usize];
        for tile_y in (0..level.height).step_by(crate::TILE_SIZE as usize) {
            for tile_x in (0..level.width).step_by(crate::TILE_SIZE as usize) {
                let (address, _) = level.locate(tile_x, tile_y);
                let tile = self.report(image.read_tile(level, address))?;
                for y in tile_y..(tile_y + crate::TILE_SIZE).min(level.height) {
                    for x in tile_x..(tile_x + crate::TILE_SIZE).min(level.width) {
                        let (_, idx) = level.locate(x, y);
                        texels[y as usize * level.width as usize + x as usize] =
                            image.format.decode(&tile.0, idx);
                    }
                }
            }
        }
        Some(LevelTexels {
            width: level.width,
            height: level.height,
            texels,
        })
    }

    /// What has been read and is held.
    pub fn stats(&self) -> TextureStats {
        let images = self.images.iter();
        TextureStats {
            values_replaced: images.map(|image| u64::from(image.n_replaced)).sum(),
            ..self.cache.stats()
        }
    }

    /// Errors met in lookups since the last call, one per image.
    pub fn take_errors(&self) -> Vec<TextureError> {
        let mut errors = self
            .read_errors
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut errors)
    }

    fn first_image(&self, texture: u32) -> Option<&Image> {
        match self.textures.get(texture as usize)? {
            Texture::Missing => None,
            Texture::Plain(image) => self.images.get(*image as usize),
            Texture::Udim(images) => {
                let lowest = images.iter().find(|&&image| image != NO_IMAGE)?;
                self.images.get(*lowest as usize)
            }
        }
    }

    fn filtered(&self, image: &Image, st: Vec2, width: f32, wrap: [Wrap; 2]) -> Option<[f32; 4]> {
        let (fine, fraction) = image.mip_level(width);
        let a = self.bilinear(image, &image.levels[fine], st, wrap)?;
        if fraction == 0.0 {
            return Some(a);
        }
        let b = self.bilinear(image, &image.levels[fine + 1], st, wrap)?;
        Some(std::array::from_fn(|c| a[c] + fraction * (b[c] - a[c])))
    }

    fn bilinear(
        &self,
        image: &Image,
        level: &Level,
        st: Vec2,
        wrap: [Wrap; 2],
    ) -> Option<[f32; 4]> {
        let taps = Taps::new(level, st, wrap);
        let mut sum = [0.0; 4];
        let mut held: Option<(u32, HeldTile)> = None;
        for (row, weight_y) in taps.rows {
            for (column, weight_x) in taps.columns {
                let weight = weight_x * weight_y;
                let (address, idx) = level.locate(column, row);
                let tile = match held {
                    Some((slot, ref tile)) if slot == address.slot => tile,
                    _ => {
                        let tile = self.cache.get(address.slot, || {
                            self.report(image.read_tile(level, address))
                        })?;
                        &held.insert((address.slot, tile)).1
                    }
                };
                let texel = image.format.decode(&tile.as_ref()?.0, idx);
                for (s, t) in sum.iter_mut().zip(texel) {
                    *s += weight * t;
                }
            }
        }
        Some(sum)
    }

    pub(crate) fn report<T>(&self, result: Result<T, Option<TextureError>>) -> Option<T> {
        result
            .map_err(|error| {
                if let Some(error) = error {
                    self.read_errors
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .push(error);
                }
            })
            .ok()
    }
}

impl Texture {
    fn add(&mut self, udim: u32, image: u32) {
        if udim == 0 {
            *self = Self::Plain(image);
            return;
        }
        let tile = (udim - FIRST_UDIM) as usize;
        if let Self::Udim(images) = self {
            images[tile] = image;
        } else {
            let mut images = Box::new([NO_IMAGE; N_UDIMS as usize]);
            images[tile] = image;
            *self = Self::Udim(images);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;
    use crate::testing::{Folder, TileFile};
    use crate::texel::Element;

    const CLAMP: [Wrap; 2] = [Wrap::Clamp; 2];

    fn at(store: &TextureStore, s: f32, t: f32, width: f32, wrap: [Wrap; 2]) -> [f32; 4] {
        store.sample(0, Vec2::new(s, t), width, wrap).unwrap()
    }

    fn assert_near(found: [f32; 4], expected: [f32; 4]) {
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-4, "{found:?} != {expected:?}");
        }
    }

    /// Texel (x, y) is (x, y, x + y, 1).
    fn ramp(width: u32, height: u32) -> TileFile {
        TileFile::new(width, height, 4, Element::F32)
            .with_texels(|x, y| [x as f32, y as f32, (x + y) as f32, 1.0])
    }

    #[test]
    fn texel_centres_and_midpoints() {
        let folder = Folder::new();
        for size in [[3, 2], [64, 64], [130, 65], [200, 129]] {
            let (w, h) = (size[0] as f32, size[1] as f32);
            let store = folder.store(&[ramp(size[0], size[1])], 1 << 30);
            assert_eq!(store.resolution(0), Some(size));
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let (x, y) = (x as f32, y as f32);
                    let texel = at(&store, (x + 0.5) / w, (y + 0.5) / h, 0.0, CLAMP);
                    assert_near(texel, [x, y, x + y, 1.0]);
                }
            }
            // Across a tile border where there is one: halfway between texels.
            let (x, y) = (w - 2.0, h - 2.0);
            let corner = at(&store, (x + 1.0) / w, (y + 1.0) / h, 0.0, CLAMP);
            assert_near(corner, [x + 0.5, y + 0.5, x + y + 1.0, 1.0]);
        }
    }

    #[test]
    fn wraps_at_the_border() {
        let folder = Folder::new();
        let store = folder.store(&[ramp(4, 4)], 1 << 20);
        let check = |wrap: Wrap, s: f32, expected: f32| {
            let found = at(&store, s, 0.125, 0.0, [wrap, Wrap::Clamp])[0];
            assert!((found - expected).abs() < 1e-5, "{wrap:?} {s}: {found}");
            let texel = store.sample(0, Vec2::new(0.125, s), 0.0, [Wrap::Clamp, wrap]);
            assert!((texel.unwrap()[1] - expected).abs() < 1e-5, "t {wrap:?}");
        };
        check(Wrap::Clamp, 1.0, 3.0);
        check(Wrap::Clamp, 7.0, 3.0);
        check(Wrap::Clamp, -7.0, 0.0);
        check(Wrap::Repeat, 1.0, 1.5);
        check(Wrap::Repeat, 2.125, 0.0);
        check(Wrap::Repeat, -0.125, 3.0);
        check(Wrap::Mirror, 1.125, 3.0);
        check(Wrap::Mirror, 1.375, 2.0);
        check(Wrap::Mirror, -0.375, 1.0);
        check(Wrap::Mirror, 2.125, 0.0);
        check(Wrap::Black, 1.0, 3.0);
        check(Wrap::Black, 0.75, 2.5);
        check(Wrap::Black, 1.001, 0.0);
        check(Wrap::Black, -5.0, 0.0);
        for s in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30] {
            for wrap in [Wrap::Black, Wrap::Clamp, Wrap::Repeat, Wrap::Mirror] {
                let texel = at(&store, s, s, 0.0, [wrap; 2]);
                assert!(texel.iter().all(|v| v.is_finite()), "{wrap:?} {s}");
            }
        }
    }

    #[test]
    fn coarser_levels_for_wider_footprints() {
        let folder = Folder::new();
        // Level l is l everywhere.
        let file = TileFile::new(128, 64, 1, Element::F16).with_mips(8);
        let store = folder.store(&[file], 1 << 20);
        let check = |width_texels: f32, expected: f32| {
            let found = at(&store, 0.3, 0.3, width_texels / 128.0, CLAMP)[0];
            assert!((found - expected).abs() < 1e-4, "{width_texels}: {found}");
        };
        check(0.0, 0.0);
        check(1.0, 0.0);
        check(2.0, 1.0);
        check(f32::sqrt(8.0), 1.5);
        check(128.0, 7.0);
        check(1e6, 7.0);
        check(f32::INFINITY, 7.0);
        check(f32::NAN, 0.0);
        assert_eq!(store.n_levels(0), Some(8));
        let level = store.read_level(0, 6).unwrap();
        assert_eq!((level.width, level.height), (2, 1));
        assert_eq!(level.texels, vec![[6.0, 6.0, 6.0, 1.0]; 2]);
        assert_eq!(store.read_level(0, 8), None);
    }

    #[test]
    fn reads_whole_levels() {
        let folder = Folder::new();
        let store = folder.store(&[ramp(130, 70)], 1 << 20);
        let level = store.read_level(0, 0).unwrap();
        for y in 0..70 {
            for x in 0..130 {
                let texel = level.texels[y * 130 + x];
                assert_eq!(texel, [x as f32, y as f32, (x + y) as f32, 1.0]);
            }
        }
        assert_eq!(store.stats().bytes_resident, 0);
    }

    #[test]
    fn udim_tiles_are_addressed_by_the_integer_part() {
        let folder = Folder::new();
        let tile = |value: f32| {
            TileFile::new(2, 2, 1, Element::F32).with_texels(move |x, _| [value + x as f32; 4])
        };
        let source = folder.udim(&[(1001, tile(10.0)), (1012, tile(20.0)), (1100, tile(30.0))]);
        let (store, errors) = TextureStore::open(&[source], 1 << 20);
        assert!(errors.is_empty());
        let check = |s: f32, t: f32, expected: Option<f32>| {
            let found = store.sample(0, Vec2::new(s, t), 0.0, [Wrap::Black; 2]);
            assert_eq!(found.map(|texel| texel[0]), expected, "{s} {t}");
        };
        check(0.25, 0.25, Some(10.0));
        check(0.0, 0.0, Some(10.0));
        check(1.75, 1.75, Some(21.0));
        check(9.5, 9.5, Some(30.5));
        check(1.5, 0.5, None);
        check(-0.5, 0.5, None);
        check(10.5, 0.5, None);
        check(0.5, 10.5, None);
        check(f32::INFINITY, 0.5, None);
        assert_eq!(store.resolution(0), Some([2, 2]));
    }

    #[test]
    fn missing_images_are_none() {
        let folder = Folder::new();
        let mut source = folder.udim(&[(999, ramp(2, 2))]);
        source.files.push(kilauea_scene::TextureFile {
            udim: 0,
            tiles: "no such file".into(),
        });
        let (store, errors) = TextureStore::open(&[source], 1 << 20);
        assert!(matches!(
            errors[..],
            [
                TextureError::Udim { udim: 999, .. },
                TextureError::Io { .. }
            ]
        ));
        for texture in [0, 1] {
            assert_eq!(store.sample(texture, Vec2::ZERO, 0.0, CLAMP), None);
            assert_eq!(store.resolution(texture), None);
            assert_eq!(store.read_level(texture, 0), None);
        }
    }

    #[test]
    fn only_touched_tiles_are_read() {
        let folder = Folder::new();
        let store = folder.store(&[ramp(640, 640)], 1 << 30);
        assert_eq!(store.stats().bytes_read, 0);
        at(&store, 0.01, 0.01, 0.0, CLAMP);
        let stats = store.stats();
        assert_eq!(stats.tiles_total, 100);
        assert_eq!(stats.tiles_loaded, 1);
        assert_eq!(stats.bytes_read, 64 * 64 * 16);
        // The corner of four tiles.
        at(&store, 0.1, 0.1, 0.0, CLAMP);
        assert_eq!(store.stats().tiles_loaded, 4);
    }

    #[test]
    fn neither_eviction_nor_threads_change_a_value() {
        let folder = Folder::new();
        let roomy = folder.store(&[ramp(640, 640)], 1 << 30);
        let tile_bytes = 64 * 64 * 16;
        let tight = folder.store(&[ramp(640, 640)], 3 * tile_bytes);
        let lookups = |store: &TextureStore, seed: u64| -> Vec<[f32; 4]> {
            let mut state = seed;
            (0..4000)
                .map(|_| {
                    state = state
                        .wrapping_mul(6364136223846793005)
                        .wrapping_add(1442695040888963407);
                    let s = (state >> 40) as f32 / (1 << 24) as f32;
                    let t = (state >> 16 & 0xFF_FFFF) as f32 / (1 << 24) as f32;
                    at(store, s, t, 0.0, [Wrap::Repeat; 2])
                })
                .collect()
        };
        let expected = [lookups(&roomy, 1), lookups(&roomy, 2)];
        thread::scope(|scope| {
            let runs = [1, 2].map(|seed| {
                let tight = &tight;
                scope.spawn(move || lookups(tight, seed))
            });
            for (run, expected) in runs.into_iter().zip(&expected) {
                assert_eq!(&run.join().unwrap(), expected);
            }
        });
        let stats = tight.stats();
        assert!(stats.bytes_peak <= 3 * tile_bytes, "{stats:?}");
        assert!(stats.tiles_loaded > 1000, "it did evict: {stats:?}");
    }

    #[test]
    fn a_read_error_is_reported_once() {
        let folder = Folder::new();
        let store = folder.store(&[ramp(128, 128)], 1 << 30);
        at(&store, 0.1, 0.1, 0.0, CLAMP);
        folder.truncate_all(100);
        for _ in 0..3 {
            assert_eq!(store.sample(0, Vec2::ONE, 0.0, CLAMP), None);
        }
        assert_eq!(store.take_errors().len(), 1);
        assert!(store.take_errors().is_empty());
        at(&store, 0.1, 0.1, 0.0, CLAMP);
    }

    #[test]
    fn damaged_files_are_errors() {
        let folder = Folder::new();
        for n_bytes in [0, 20, 48, 63, 64, 1000] {
            let source = folder.write(&ramp(100, 100));
            folder.truncate_all(n_bytes);
            let (store, errors) = TextureStore::open(&[source], 1 << 20);
            assert!(
                matches!(errors[..], [TextureError::Corrupt { .. }]),
                "{n_bytes}"
            );
            assert_eq!(store.sample(0, Vec2::ZERO, 0.0, CLAMP), None);
        }
    }
}
