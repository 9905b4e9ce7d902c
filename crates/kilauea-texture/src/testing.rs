//! Writes tile files for tests.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::{env, fs, process};

use half::f16;
use kilauea_scene::{TextureFile, TextureSource};

use crate::header::{FIXED_BYTES, LEVEL_BYTES, MAGIC, TILE_SIZE, VERSION};
use crate::store::TextureStore;
use crate::texel::Element;

/// A linear tile file; every level *l* beyond the finest is *l* in all channels.
pub(crate) struct TileFile {
    size: [u32; 2],
    channels: u8,
    element: Element,
    n_levels: u32,
    texel: Box<dyn Fn(u32, u32) -> [f32; 4]>,
}

impl TileFile {
    pub(crate) fn new(width: u32, height: u32, channels: u8, element: Element) -> Self {
        Self {
            size: [width, height],
            channels,
            element,
            n_levels: 1,
            texel: Box::new(|_, _| [0.0; 4]),
        }
    }

    pub(crate) fn with_mips(self, n_levels: u32) -> Self {
        Self { n_levels, ..self }
    }

    pub(crate) fn with_texels(self, texel: impl Fn(u32, u32) -> [f32; 4] + 'static) -> Self {
        Self {
            texel: Box::new(texel),
            ..self
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let [width, height] = self.size;
        let mut bytes = MAGIC.to_vec();
        let element = self.element as u32;
        let channels = u32::from(self.channels);
        for number in [
            VERSION,
            width,
            height,
            channels,
            element,
            0,
            0,
            0,
            self.n_levels,
            0,
        ] {
            bytes.extend(number.to_le_bytes());
        }
        let mut levels = Vec::new();
        let mut offset = FIXED_BYTES + self.n_levels as usize * LEVEL_BYTES;
        for level in 0..self.n_levels {
            let size = [(width >> level).max(1), (height >> level).max(1)];
            bytes.extend(size[0].to_le_bytes());
            bytes.extend(size[1].to_le_bytes());
            bytes.extend((offset as u64).to_le_bytes());
            let texels = self.level_bytes(level, size);
            offset += texels.len();
            levels.push(texels);
        }
        bytes.extend(levels.into_iter().flatten());
        bytes
    }

    fn level_bytes(&self, level: u32, [width, height]: [u32; 2]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for tile_y in (0..height).step_by(TILE_SIZE as usize) {
            for tile_x in (0..width).step_by(TILE_SIZE as usize) {
                for y in tile_y..(tile_y + TILE_SIZE).min(height) {
                    for x in tile_x..(tile_x + TILE_SIZE).min(width) {
                        let texel = if level == 0 {
                            (self.texel)(x, y)
                        } else {
                            [level as f32; 4]
                        };
                        for &value in &texel[..self.channels as usize] {
                            match self.element {
                                Element::U8 => bytes.push((value * 255.0) as u8),
                                Element::F16 => bytes.extend(f16::from_f32(value).to_le_bytes()),
                                Element::F32 => bytes.extend(value.to_le_bytes()),
                            }
                        }
                    }
                }
            }
        }
        bytes
    }
}

/// A temporary folder of tile files.
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new() -> Self {
        static N_FOLDERS: AtomicU32 = AtomicU32::new(0);
        let number = N_FOLDERS.fetch_add(1, Ordering::Relaxed);
        let folder = env::temp_dir().join(format!("kilauea-texture-{}-{number}", process::id()));
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    pub(crate) fn write(&self, file: &TileFile) -> TextureSource {
        TextureSource {
            path: "image.png".into(),
            files: vec![self.write_file(0, file)],
        }
    }

    pub(crate) fn udim(&self, tiles: &[(u32, TileFile)]) -> TextureSource {
        TextureSource {
            path: "image.<UDIM>.png".into(),
            files: tiles
                .iter()
                .map(|(udim, file)| self.write_file(*udim, file))
                .collect(),
        }
    }

    pub(crate) fn store(&self, files: &[TileFile], budget_bytes: u64) -> TextureStore {
        let sources: Vec<_> = files.iter().map(|file| self.write(file)).collect();
        let (store, errors) = TextureStore::open(&sources, budget_bytes);
        assert!(errors.is_empty(), "{errors:?}");
        store
    }

    pub(crate) fn truncate_all(&self, n_bytes: u64) {
        for entry in fs::read_dir(&self.0).unwrap() {
            let file = fs::File::options()
                .write(true)
                .open(entry.unwrap().path())
                .unwrap();
            file.set_len(n_bytes).unwrap();
        }
    }

    pub(crate) fn remove_files(&self) {
        for entry in fs::read_dir(&self.0).unwrap() {
            fs::remove_file(entry.unwrap().path()).unwrap();
        }
    }

    fn write_file(&self, udim: u32, file: &TileFile) -> TextureFile {
        static N_FILES: AtomicU32 = AtomicU32::new(0);
        let number = N_FILES.fetch_add(1, Ordering::Relaxed);
        let path = self.0.join(format!("{number}.tiles"));
        fs::write(&path, file.bytes()).unwrap();
        TextureFile {
            udim,
            tiles: path.to_str().unwrap().into(),
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
