//! Tiles by number: asked for before a lookup needs them, and handed from store to store.

use kilauea_math::Vec2;
use kilauea_scene::Wrap;

use crate::TextureStore;
use crate::cache::Tile;
use crate::image::{Image, Level, TileAddress};
use crate::lookup::{Place, Taps};

/// A tile of a [`TextureStore`], by its number: the same in each store of the same images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TileId(pub u32);

impl TextureStore {
    /// Calls `see` for each tile that [`Self::sample`] would have to wait for; not for those of
    /// images that cannot be read.
    pub fn for_each_absent(
        &self,
        texture: u32,
        st: Vec2,
        width: f32,
        wrap: [Wrap; 2],
        mut see: impl FnMut(TileId),
    ) {
        let Some(Place::Image { image, st, wrap }) = self.place(texture, st, wrap) else {
            return;
        };
        if image.has_failed() {
            return;
        }
        let (fine, fraction) = image.mip_level(width);
        let coarse = if fraction == 0.0 { fine } else { fine + 1 };
        for level in &image.levels[fine..=coarse] {
            let taps = Taps::new(level, st, wrap);
            let [near, far] = taps.rows.map(|(row, _)| {
                taps.columns
                    .map(|(column, _)| level.locate(column, row).0.slot)
            });
            let slots = [near[0], near[1], far[0], far[1]];
            for (i, slot) in slots.iter().enumerate() {
                if !slots[..i].contains(slot) && !self.cache.is_resident(*slot) {
                    see(TileId(*slot));
                }
            }
        }
    }

    /// Reads a tile into memory, unless it is there. An error is kept as that of a lookup.
    pub fn fetch(&self, tile: TileId) {
        if let Some((image, level, address)) = self.find(tile) {
            self.cache
                .fetch(tile.0, || self.report(image.read_tile(level, address)));
        }
    }

    /// The texels of a tile as its file has them, for a store that has no files; none where it
    /// cannot be read. It does not stay in memory on account of this.
    pub fn read_texels(&self, tile: TileId) -> Option<Box<[u8]>> {
        let (image, level, address) = self.find(tile)?;
        Some(self.report(image.read_tile(level, address))?.0)
    }

    /// Takes in the texels of a tile from [`Self::read_texels`] of another store. Nothing happens
    /// if they are not as many as the tile has.
    pub fn take_in(&self, tile: TileId, texels: Box<[u8]>) {
        if let Some((image, level, address)) = self.find(tile)
            && texels.len() == image.tile_bytes(level, address)
        {
            self.cache.take_in(tile.0, Tile(texels));
        }
    }

    fn find(&self, tile: TileId) -> Option<(&Image, &Level, TileAddress)> {
        let after = self
            .images
            .partition_point(|image| image.end_slot() <= tile.0);
        let image = self.images.get(after)?;
        let (level, address) = image.find(tile.0)?;
        Some((image, level, address))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Folder, TileFile};
    use crate::texel::Element;

    const CLAMP: [Wrap; 2] = [Wrap::Clamp; 2];

    fn images() -> [TileFile; 2] {
        [[200, 129], [70, 64]].map(|[width, height]| {
            TileFile::new(width, height, 4, Element::F32)
                .with_mips(3)
                .with_texels(|x, y| [x as f32, y as f32, 0.5, 1.0])
        })
    }

    fn absent(store: &TextureStore, texture: u32, st: Vec2, width: f32) -> Vec<TileId> {
        let mut tiles = Vec::new();
        store.for_each_absent(texture, st, width, CLAMP, |tile| tiles.push(tile));
        tiles
    }

    #[test]
    fn lookups_need_the_tiles_that_are_absent_before_them_and_no_others() {
        let folder = Folder::new();
        for (i, j) in (0..40).flat_map(|i| [(i, 0), (i, 1), (i, 2)]) {
            let store = folder.store(&images(), 1 << 30);
            let st = Vec2::new(i as f32 / 39.0, (i * 7 % 40) as f32 / 39.0);
            let width = [0.0, 0.013, 0.3][j];
            let tiles = absent(&store, i % 2, st, width);
            assert!(!tiles.is_empty());
            store.sample(i % 2, st, width, CLAMP).unwrap();
            assert_eq!(store.stats().tiles_loaded, tiles.len() as u64, "{st}");
            assert_eq!(absent(&store, i % 2, st, width), []);
        }
    }

    #[test]
    fn fetched_tiles_are_those_that_lookups_find() {
        let folder = Folder::new();
        let store = folder.store(&images(), 1 << 30);
        let st = Vec2::new(0.64, 0.5);
        let tiles = absent(&store, 0, st, 0.02);
        for &tile in &tiles {
            store.fetch(tile);
        }
        store.sample(0, st, 0.02, CLAMP).unwrap();
        let stats = store.stats();
        assert_eq!(stats.tiles_fetched, tiles.len() as u64);
        assert_eq!(stats.tiles_loaded, stats.tiles_fetched);
    }

    #[test]
    fn a_store_without_files_lives_on_the_tiles_of_another() {
        let folder = Folder::new();
        let near = folder.store(&images(), 1 << 30);
        let far = folder.store(&images(), 1 << 30);
        let n_tiles = near.stats().tiles_total as u32;
        let texels: Vec<_> = (0..n_tiles)
            .map(|number| far.read_texels(TileId(number)).unwrap())
            .collect();
        let st = Vec2::new(0.751, 0.778);
        let expected = far.sample(0, st, 0.0, CLAMP);
        folder.remove_files();
        for (number, texels) in (0..n_tiles).zip(texels) {
            near.take_in(TileId(number), texels[1..].into());
            assert_eq!(near.stats().tiles_fetched, u64::from(number), "too short");
            near.take_in(TileId(number), texels);
        }
        assert!(expected.is_some());
        assert_eq!(near.sample(0, st, 0.0, CLAMP), expected);
        assert!(near.take_errors().is_empty());
        assert_eq!(near.stats().tiles_loaded, 0);
    }

    #[test]
    fn an_image_that_cannot_be_read_is_named_once_and_not_asked_for_again() {
        let folder = Folder::new();
        let store = folder.store(&images(), 1 << 30);
        folder.remove_files();
        let tiles = absent(&store, 1, Vec2::splat(0.5), 0.0);
        assert!(!tiles.is_empty());
        for &tile in &tiles {
            store.fetch(tile);
            assert_eq!(store.read_texels(tile), None);
        }
        let errors: Vec<String> = store
            .take_errors()
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert!(errors[0].contains("cannot read"), "{}", errors[0]);
        assert_eq!(absent(&store, 1, Vec2::splat(0.5), 0.0), []);
        assert_eq!(store.sample(1, Vec2::splat(0.5), 0.0, CLAMP), None);
    }

    #[test]
    fn numbers_of_no_tile_are_passed_over() {
        let folder = Folder::new();
        let store = folder.store(&images(), 1 << 30);
        let beyond = TileId(store.stats().tiles_total as u32);
        for tile in [beyond, TileId(u32::MAX)] {
            store.fetch(tile);
            store.take_in(tile, Box::new([0]));
            assert_eq!(store.read_texels(tile), None);
        }
        assert_eq!(store.stats().tiles_fetched, 0);
    }
}
