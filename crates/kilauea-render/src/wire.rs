//! Lists and records as bytes, of what paths leave for those who did not follow them.

use kilauea_gather::{Arrival, GatherRecord};
use kilauea_math::Vec3;
use kilauea_spot::{Wire, WireError};

pub(crate) fn put_list<T>(items: &[T], put: impl Fn(&T, &mut Vec<u8>), bytes: &mut Vec<u8>) {
    (items.len() as u32).encode(bytes);
    for item in items {
        put(item, bytes);
    }
}

/// Memory grows with what is read, not with what is promised.
pub(crate) fn take_list<T>(
    take: impl Fn(&mut &[u8]) -> Result<T, WireError>,
    bytes: &mut &[u8],
) -> Result<Vec<T>, WireError> {
    let n = u32::decode(bytes)?;
    let mut items = Vec::new();
    for _ in 0..n {
        items.push(take(bytes)?);
    }
    Ok(items)
}

pub(crate) fn put_vec(v: Vec3, bytes: &mut Vec<u8>) {
    v.to_array().encode(bytes);
}

pub(crate) fn take_vec(bytes: &mut &[u8]) -> Result<Vec3, WireError> {
    Ok(Vec3::from_array(Wire::decode(bytes)?))
}

pub(crate) fn put_pixel(pixel: [i32; 2], bytes: &mut Vec<u8>) {
    for coordinate in pixel {
        coordinate.encode(bytes);
    }
}

pub(crate) fn take_pixel(bytes: &mut &[u8]) -> Result<[i32; 2], WireError> {
    Ok([i32::decode(bytes)?, i32::decode(bytes)?])
}

pub(crate) fn put_record(record: &GatherRecord, bytes: &mut Vec<u8>) {
    put_vec(record.p, bytes);
    put_vec(record.n, bytes);
    let Arrival {
        wi,
        irradiance,
        pdf,
    } = record.arrival;
    put_vec(wi, bytes);
    [irradiance, pdf].encode(bytes);
    put_pixel(record.pixel, bytes);
    record.brought.encode(bytes);
}

pub(crate) fn take_record(bytes: &mut &[u8]) -> Result<GatherRecord, WireError> {
    Ok(GatherRecord {
        p: take_vec(bytes)?,
        n: take_vec(bytes)?,
        arrival: Arrival {
            wi: take_vec(bytes)?,
            irradiance: f32::decode(bytes)?,
            pdf: f32::decode(bytes)?,
        },
        pixel: take_pixel(bytes)?,
        brought: f32::decode(bytes)?,
    })
}
