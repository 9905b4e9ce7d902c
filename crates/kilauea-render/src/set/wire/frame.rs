//! Bodies on the wire, packed or as they are.

use std::borrow::Cow;

use kilauea_spot::WireError;
use serde::{Deserialize, Serialize};

/// How bodies go over the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Packing {
    /// As they are: on links faster than packing is.
    #[default]
    Plain,
    /// LZ4 blocks.
    Lz4,
}

const PLAIN: u8 = 0;
const LZ4: u8 = 1;
/// No body is larger.
const MAX_BODY: usize = 4 << 20;

/// A body with a byte that says how it is packed; LZ4 is preceded by the length of what comes out.
pub(crate) fn pack(mut body: Vec<u8>, packing: Packing) -> Vec<u8> {
    match packing {
        Packing::Plain => {
            // Bodies have room for it.
            body.insert(0, PLAIN);
            body
        }
        Packing::Lz4 => {
            let packed = lz4_flex::compress(&body);
            [&[LZ4][..], &(body.len() as u32).to_le_bytes(), &packed].concat()
        }
    }
}

/// The body of what [`pack`] made. Its length is checked before any memory is taken.
pub(crate) fn unpack(bytes: &[u8]) -> Result<Cow<'_, [u8]>, WireError> {
    match bytes.split_first().ok_or(WireError::Short)? {
        (&PLAIN, body) if body.len() > MAX_BODY => Err(WireError::Long(body.len() - MAX_BODY)),
        (&PLAIN, body) => Ok(Cow::Borrowed(body)),
        (&LZ4, rest) => {
            let (length, packed) = rest.split_first_chunk().ok_or(WireError::Short)?;
            let length = u32::from_le_bytes(*length) as usize;
            if length > MAX_BODY {
                return Err(WireError::Long(length - MAX_BODY));
            }
            let body = lz4_flex::decompress(packed, length).map_err(|_| WireError::Packed)?;
            if body.len() == length {
                Ok(Cow::Owned(body))
            } else {
                Err(WireError::Packed)
            }
        }
        (&other, _) => Err(WireError::Variant(other)),
    }
}
