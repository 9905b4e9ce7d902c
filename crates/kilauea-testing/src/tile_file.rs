use kilauea_scene::{TextureFile, TextureSource};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::{env, fs, process};

/// A linear picture of 32-bit RGB in a tile file (version 1) of one level; removed when dropped.
#[derive(Debug)]
pub struct TileFile {
    path: PathBuf,
}

const TILE_SIZE: u32 = 64;
const HEADER_BYTES: u64 = 48 + 16;

impl TileFile {
    /// Writes the picture of `texel(column, row)`, row 0 the lowest.
    pub fn new(size: [u32; 2], texel: impl Fn(u32, u32) -> [f32; 3]) -> Self {
        static N_FILES: AtomicU32 = AtomicU32::new(0);
        let number = N_FILES.fetch_add(1, Ordering::Relaxed);
        let name = format!("kilauea-test-{}-{number}.tiles", process::id());
        let path = env::temp_dir().join(name);

        let [width, height] = size;
        let mut bytes = b"KLTILES\0".to_vec();
        // Version, size, channels, 32-bit floats, linear, no wrap modes, one level, reserved.
        for field in [1, width, height, 3, 2, 0, 0, 0, 1, 0, width, height] {
            bytes.extend(u32::to_le_bytes(field));
        }
        bytes.extend(HEADER_BYTES.to_le_bytes());
        for tile_y in (0..height).step_by(TILE_SIZE as usize) {
            for tile_x in (0..width).step_by(TILE_SIZE as usize) {
                for y in tile_y..(tile_y + TILE_SIZE).min(height) {
                    for x in tile_x..(tile_x + TILE_SIZE).min(width) {
                        bytes.extend(texel(x, y).into_iter().flat_map(f32::to_le_bytes));
                    }
                }
            }
        }
        fs::write(&path, bytes).expect("the temporary folder is writable");
        Self { path }
    }

    /// The picture as a scene refers to it.
    pub fn source(&self) -> TextureSource {
        let file = TextureFile {
            udim: 0,
            tiles: self.path.to_string_lossy().into_owned(),
        };
        TextureSource {
            path: "picture.exr".into(),
            files: vec![file],
        }
    }
}

impl Drop for TileFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}
