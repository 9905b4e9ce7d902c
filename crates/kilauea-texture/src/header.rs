use crate::texel::{Element, TexelFormat, Transfer};

/// Width and height of a tile, in texels.
pub const TILE_SIZE: u32 = 64;

pub(crate) const MAGIC: [u8; 8] = *b"KLTILES\0";
pub(crate) const VERSION: u32 = 1;
pub(crate) const FIXED_BYTES: usize = 48;
pub(crate) const LEVEL_BYTES: usize = 16;

/// Far beyond any image; keeps sizes within `u64`.
const MAX_SIZE: u32 = 1 << 20;

/// The start of a tile file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) format: TexelFormat,
    /// Values of the image that were not finite, and that its writer replaced.
    pub(crate) n_replaced: u32,
    /// Finest first; never empty.
    pub(crate) levels: Vec<LevelHeader>,
}

/// Where a mip level is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevelHeader {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) offset: u64,
}

impl Header {
    /// Number of mip levels that the fixed part announces, checked so that the level table may be
    /// read.
    pub(crate) fn n_levels(fixed: &[u8; FIXED_BYTES]) -> Result<usize, String> {
        if fixed[..8] != MAGIC {
            return Err("wrong magic number".into());
        }
        let version = u32_at(fixed, 8);
        if version != VERSION {
            return Err(format!("version {version}, expected {VERSION}"));
        }
        let (width, height) = (u32_at(fixed, 12), u32_at(fixed, 16));
        if !(1..=MAX_SIZE).contains(&width) || !(1..=MAX_SIZE).contains(&height) {
            return Err(format!("{width} by {height} texels"));
        }
        let n_levels = u32_at(fixed, 40);
        let most = width.max(height).ilog2() + 1;
        if !(1..=most).contains(&n_levels) {
            return Err(format!("{n_levels} mip levels, expected 1 to {most}"));
        }
        Ok(n_levels as usize)
    }

    /// Reads the fixed part and the level table, and checks that every level lies in the file.
    pub(crate) fn parse(
        fixed: &[u8; FIXED_BYTES],
        level_table: &[u8],
        file_bytes: u64,
    ) -> Result<Self, String> {
        let n_levels = Self::n_levels(fixed)?;
        if level_table.len() != n_levels * LEVEL_BYTES {
            return Err("level table too short".into());
        }
        let format = texel_format(u32_at(fixed, 20), u32_at(fixed, 24), u32_at(fixed, 28))?;
        let (width, height) = (u32_at(fixed, 12), u32_at(fixed, 16));
        let mut levels = Vec::with_capacity(n_levels);
        for (idx, entry) in level_table.chunks_exact(LEVEL_BYTES).enumerate() {
            let level = LevelHeader {
                width: u32_at(entry, 0),
                height: u32_at(entry, 4),
                offset: u64::from(u32_at(entry, 8)) | u64::from(u32_at(entry, 12)) << 32,
            };
            let expected = ((width >> idx).max(1), (height >> idx).max(1));
            if (level.width, level.height) != expected {
                return Err(format!("mip level {idx} is of the wrong size"));
            }
            let n_bytes =
                u64::from(level.width) * u64::from(level.height) * format.n_bytes() as u64;
            let inside = level
                .offset
                .checked_add(n_bytes)
                .is_some_and(|end| end <= file_bytes);
            if !inside {
                return Err(format!(
                    "mip level {idx} reaches beyond the end of the file"
                ));
            }
            levels.push(level);
        }
        Ok(Self {
            format,
            n_replaced: u32_at(fixed, 44),
            levels,
        })
    }
}

fn texel_format(channels: u32, element: u32, transfer: u32) -> Result<TexelFormat, String> {
    if !(1..=4).contains(&channels) {
        return Err(format!("{channels} channels"));
    }
    let element = match element {
        0 => Element::U8,
        1 => Element::F16,
        2 => Element::F32,
        other => return Err(format!("element type {other}")),
    };
    let transfer = match transfer {
        0 => Transfer::Linear,
        1 if element == Element::U8 => Transfer::Srgb,
        other => return Err(format!("transfer {other} for {element:?} texels")),
    };
    Ok(TexelFormat {
        channels: channels as u8,
        element,
        transfer,
    })
}

/// The caller guarantees the four bytes.
fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TileFile;

    fn parse(bytes: &[u8]) -> Result<Header, String> {
        let fixed: [u8; FIXED_BYTES] = bytes[..FIXED_BYTES].try_into().unwrap();
        let n = Header::n_levels(&fixed)?;
        Header::parse(
            &fixed,
            &bytes[FIXED_BYTES..][..n * LEVEL_BYTES],
            bytes.len() as u64,
        )
    }

    #[test]
    fn reads_what_was_written() {
        let file = TileFile::new(100, 70, 3, Element::U8).with_mips(7);
        let header = parse(&file.bytes()).unwrap();
        assert_eq!(header.levels.len(), 7);
        assert_eq!((header.levels[6].width, header.levels[6].height), (1, 1));
        assert_eq!((header.levels[1].width, header.levels[1].height), (50, 35));
        assert_eq!(header.format.channels, 3);
        assert_eq!(header.n_replaced, 0);
    }

    #[test]
    fn refuses_damage() {
        let check = |at: usize, value: u32, expected: &str| {
            let mut bytes = TileFile::new(100, 70, 3, Element::F32).with_mips(2).bytes();
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
            let message = parse(&bytes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        };
        check(0, 0, "magic");
        check(8, 9, "version 9");
        check(12, 0, "0 by 70");
        check(12, u32::MAX, "by 70");
        check(20, 5, "5 channels");
        check(24, 3, "element type 3");
        check(28, 1, "transfer 1");
        check(40, 0, "0 mip levels");
        check(40, u32::MAX, "mip levels");
        check(48, 99, "level 0 is of the wrong size");
        check(56, 1 << 30, "level 0 reaches beyond");
        check(60, u32::MAX, "level 0 reaches beyond");
    }

    #[test]
    fn refuses_a_truncated_file() {
        let mut bytes = TileFile::new(100, 70, 3, Element::F32).bytes();
        bytes.pop();
        assert!(parse(&bytes).unwrap_err().contains("beyond the end"));
    }
}
