//! Control records as bytes: the one place that knows bincode, which is no longer maintained.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// No record is longer; nothing more is allocated for what bytes promise.
const MAX_BYTES: usize = 4 << 20;

type Config = Configuration<LittleEndian, Fixint, Limit<MAX_BYTES>>;

const CONFIG: Config = bincode::config::standard()
    .with_little_endian()
    .with_fixed_int_encoding()
    .with_limit::<MAX_BYTES>();

/// The bytes of a record.
pub(super) fn encode(record: &impl Serialize) -> Vec<u8> {
    bincode::serde::encode_to_vec(record, CONFIG).expect("records of messages can be written")
}

/// A record that takes all of these bytes; an error in words otherwise.
pub(super) fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    match bincode::serde::decode_from_slice(bytes, CONFIG) {
        Ok((record, n_read)) if n_read == bytes.len() => Ok(record),
        Ok((_, n_read)) => Err(format!("{} bytes too many", bytes.len() - n_read)),
        Err(error) => Err(error.to_string()),
    }
}
