use kilauea_math::hash::{combine, unit_f32};

/// Independent uniform numbers in [0, 1): those of draw `i` in a stream.
pub fn uniforms<const N: usize>(stream: u32, i: u32) -> [f32; N] {
    let key = combine(stream, i);
    std::array::from_fn(|k| unit_f32(combine(key, k as u32)))
}
