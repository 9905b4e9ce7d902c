//! Integer hashes that key random numbers by what they are for.

/// A well-mixed 32-bit permutation (Wellons' `lowbias32`).
#[inline]
pub const fn mix32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A well-mixed 64-bit permutation (Steele et al. 2014, `SplitMix64` finaliser).
#[inline]
pub const fn mix64(mut x: u64) -> u64 {
    x ^= x >> 30;
    x = x.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x ^= x >> 27;
    x = x.wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Hash of a pair of keys.
#[inline]
pub const fn combine(a: u32, b: u32) -> u32 {
    mix32(a ^ mix32(b.wrapping_add(0x9e37_79b9)))
}

/// The 24 highest bits as a number in [0, 1).
#[inline]
pub fn unit_f32(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / (1 << 24) as f32)
}
