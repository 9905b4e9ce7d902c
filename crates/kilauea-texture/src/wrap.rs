use kilauea_scene::Wrap;

/// The texel that stands at index `i` of an axis of `size` texels.
///
/// `Black` repeats the edge like `Clamp`: its border is at 0 and 1 exactly, so lookups outside are
/// black whatever the mip level and those inside are not darkened by the outside.
#[inline]
pub(crate) fn wrap_index(i: i64, size: u32, wrap: Wrap) -> u32 {
    let n = i64::from(size);
    if (0..n).contains(&i) {
        return i as u32;
    }
    match wrap {
        Wrap::Black | Wrap::Clamp => i.clamp(0, n - 1) as u32,
        Wrap::Repeat => i.rem_euclid(n) as u32,
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * n);
            m.min(2 * n - 1 - m) as u32
        }
    }
}

/// Whether a lookup at `s` is beyond the border of a black surround.
#[inline]
pub(crate) fn is_black(s: f32, wrap: Wrap) -> bool {
    wrap == Wrap::Black && !(0.0..=1.0).contains(&s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_like_opengl() {
        let check = |wrap, expected: [u32; 10]| {
            let found: Vec<_> = (-4..6).map(|i| wrap_index(i, 3, wrap)).collect();
            assert_eq!(found, expected, "{wrap:?}");
        };
        let [a, b, c] = [0, 1, 2];
        check(Wrap::Clamp, [a, a, a, a, a, b, c, c, c, c]);
        check(Wrap::Repeat, [c, a, b, c, a, b, c, a, b, c]);
        check(Wrap::Mirror, [c, c, b, a, a, b, c, c, b, a]);
    }
}
