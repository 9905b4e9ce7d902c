use kilauea_scene::Wrap;

/// The texel that stands at index `i` of an axis of `size` texels; none where it is black.
#[inline]
pub(crate) fn wrap_index(i: i64, size: u32, wrap: Wrap) -> Option<u32> {
    let n = i64::from(size);
    if (0..n).contains(&i) {
        return Some(i as u32);
    }
    match wrap {
        Wrap::Black => None,
        Wrap::Clamp => Some(i.clamp(0, n - 1) as u32),
        Wrap::Repeat => Some(i.rem_euclid(n) as u32),
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * n);
            Some(m.min(2 * n - 1 - m) as u32)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_like_opengl() {
        let check = |wrap, expected: [Option<u32>; 10]| {
            let found: Vec<_> = (-4..6).map(|i| wrap_index(i, 3, wrap)).collect();
            assert_eq!(found, expected, "{wrap:?}");
        };
        let inside = [Some(0), Some(1), Some(2)];
        let [a, b, c] = inside;
        let n = None;
        check(Wrap::Black, [n, n, n, n, a, b, c, n, n, n]);
        check(Wrap::Clamp, [a, a, a, a, a, b, c, c, c, c]);
        check(Wrap::Repeat, [c, a, b, c, a, b, c, a, b, c]);
        check(Wrap::Mirror, [c, c, b, a, a, b, c, c, b, a]);
    }
}
