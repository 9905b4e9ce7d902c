use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use crate::TextureError;
use crate::cache::Tile;
use crate::header::{FIXED_BYTES, Header, LEVEL_BYTES, LevelHeader, TILE_SIZE};
use crate::texel::TexelFormat;

/// Files kept open; the tiles of further images cost an open and a close each.
const MAX_OPEN_FILES: u32 = 256;

static N_OPEN_FILES: AtomicU32 = AtomicU32::new(0);

/// A tile file whose header has been read.
#[derive(Debug)]
pub(crate) struct Image {
    /// As authored, for messages.
    authored: String,
    tiles: PathBuf,
    file: OnceLock<KeptFile>,
    /// Reading failed once; it is not tried again.
    failed: AtomicBool,
    pub(crate) format: TexelFormat,
    /// Values that its writer replaced, as they were not finite.
    pub(crate) n_replaced: u32,
    pub(crate) levels: Vec<Level>,
}

/// A mip level and the cache slots of its tiles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    pub(crate) width: u32,
    pub(crate) height: u32,
    offset: u64,
    first_slot: u32,
    n_tiles_x: u32,
}

/// A tile of a level, found by one of its texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileAddress {
    pub(crate) slot: u32,
    tile_x: u32,
    tile_y: u32,
}

/// Counts itself among the open files.
#[derive(Debug)]
struct KeptFile(File);

impl Image {
    /// Opens a tile file and reads its header; its tiles take the slots from `first_slot` on.
    pub(crate) fn open(image: &str, tiles: PathBuf, first_slot: u32) -> Result<Self, TextureError> {
        let io_error = |source| TextureError::Io {
            image: image.to_owned(),
            tiles: tiles.clone(),
            source,
        };
        let corrupt = |reason: String| TextureError::Corrupt {
            image: image.to_owned(),
            tiles: tiles.clone(),
            reason,
        };
        let file = File::open(&tiles).map_err(io_error)?;
        let file_bytes = file.metadata().map_err(io_error)?.len();
        let mut fixed = [0; FIXED_BYTES];
        if file_bytes < FIXED_BYTES as u64 {
            return Err(corrupt("shorter than its header".into()));
        }
        file.read_exact_at(&mut fixed, 0).map_err(io_error)?;
        let n_levels = Header::n_levels(&fixed).map_err(corrupt)?;
        let table_bytes = n_levels * LEVEL_BYTES;
        if file_bytes < (FIXED_BYTES + table_bytes) as u64 {
            return Err(corrupt("shorter than its header".into()));
        }
        let mut level_table = vec![0; table_bytes];
        file.read_exact_at(&mut level_table, FIXED_BYTES as u64)
            .map_err(io_error)?;
        let header = Header::parse(&fixed, &level_table, file_bytes).map_err(corrupt)?;
        let levels = place_levels(&header.levels, first_slot)
            .ok_or_else(|| corrupt("too many tiles".into()))?;
        Ok(Self {
            authored: image.to_owned(),
            format: header.format,
            n_replaced: header.n_replaced,
            levels,
            tiles,
            file: OnceLock::new(),
            failed: AtomicBool::new(false),
        })
    }

    /// One past the last slot of its tiles.
    pub(crate) fn end_slot(&self) -> u32 {
        self.levels.last().map_or(0, Level::end_slot)
    }

    /// Whether its tiles cannot be read.
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// The level and the address of the tile with that slot, which is one of its own.
    pub(crate) fn find(&self, slot: u32) -> Option<(&Level, TileAddress)> {
        let after = self
            .levels
            .partition_point(|level| level.first_slot <= slot);
        let level = self.levels.get(after.checked_sub(1)?)?;
        let number = slot - level.first_slot;
        let address = TileAddress {
            slot,
            tile_x: number % level.n_tiles_x,
            tile_y: number / level.n_tiles_x,
        };
        (slot < level.end_slot()).then_some((level, address))
    }

    /// Bytes of a tile's texels.
    pub(crate) fn tile_bytes(&self, level: &Level, address: TileAddress) -> usize {
        let (width, height) = level.tile_size(address);
        width as usize * height as usize * self.format.n_bytes()
    }

    /// Reads a tile; an error is returned the first time only, none later.
    pub(crate) fn read_tile(
        &self,
        level: &Level,
        address: TileAddress,
    ) -> Result<Tile, Option<TextureError>> {
        if self.has_failed() {
            return Err(None);
        }
        let texel_bytes = self.format.n_bytes() as u64;
        let (_, height) = level.tile_size(address);
        // Tiles before this one: whole rows of tiles, then those to the left, which are all as
        // high as this one.
        let texels_before = u64::from(address.tile_y * TILE_SIZE) * u64::from(level.width)
            + u64::from(address.tile_x * TILE_SIZE) * u64::from(height);
        let mut texels = vec![0; self.tile_bytes(level, address)].into_boxed_slice();
        let read = self.with_file(|file| {
            file.read_exact_at(&mut texels, level.offset + texels_before * texel_bytes)
        });
        match read {
            Ok(()) => Ok(Tile(texels)),
            Err(_) if self.failed.swap(true, Ordering::Relaxed) => Err(None),
            Err(source) => Err(Some(TextureError::Io {
                image: self.authored.clone(),
                tiles: self.tiles.clone(),
                source,
            })),
        }
    }

    fn with_file<T>(&self, read: impl FnOnce(&File) -> io::Result<T>) -> io::Result<T> {
        if let Some(kept) = self.file.get() {
            return read(&kept.0);
        }
        let file = File::open(&self.tiles)?;
        let result = read(&file)?;
        if N_OPEN_FILES.fetch_add(1, Ordering::Relaxed) < MAX_OPEN_FILES {
            // Where another thread was faster, this file closes again and is not counted.
            let _ = self.file.set(KeptFile(file));
        } else {
            N_OPEN_FILES.fetch_sub(1, Ordering::Relaxed);
        }
        Ok(result)
    }
}

impl Drop for KeptFile {
    fn drop(&mut self) {
        N_OPEN_FILES.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Level {
    /// The tile that holds a texel, and the texel's index in it.
    #[inline]
    pub(crate) fn locate(&self, x: u32, y: u32) -> (TileAddress, usize) {
        let (tile_x, tile_y) = (x / TILE_SIZE, y / TILE_SIZE);
        let address = TileAddress {
            slot: self.first_slot + tile_y * self.n_tiles_x + tile_x,
            tile_x,
            tile_y,
        };
        let tile_width = TILE_SIZE.min(self.width - tile_x * TILE_SIZE);
        let idx = (y % TILE_SIZE) * tile_width + x % TILE_SIZE;
        (address, idx as usize)
    }

    /// Tiles at the upper and right border end where the level ends.
    fn tile_size(&self, address: TileAddress) -> (u32, u32) {
        (
            TILE_SIZE.min(self.width - address.tile_x * TILE_SIZE),
            TILE_SIZE.min(self.height - address.tile_y * TILE_SIZE),
        )
    }

    fn end_slot(&self) -> u32 {
        self.first_slot + self.n_tiles_x * self.height.div_ceil(TILE_SIZE)
    }
}

fn place_levels(headers: &[LevelHeader], first_slot: u32) -> Option<Vec<Level>> {
    let mut next_slot = first_slot;
    headers
        .iter()
        .map(|header| {
            let n_tiles_x = header.width.div_ceil(TILE_SIZE);
            let level = Level {
                width: header.width,
                height: header.height,
                offset: header.offset,
                first_slot: next_slot,
                n_tiles_x,
            };
            let n_tiles = n_tiles_x.checked_mul(header.height.div_ceil(TILE_SIZE))?;
            next_slot = next_slot.checked_add(n_tiles)?;
            Some(level)
        })
        .collect()
}
