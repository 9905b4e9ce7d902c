/// What `f` makes of each of three things: corners, channels, axes.
///
/// `array::map` does the same by way of several functions, which compilers leave as calls where `f`
/// is long, and shading has no time for these.
#[inline(always)]
pub fn each_of_three<T, U>([a, b, c]: [T; 3], mut f: impl FnMut(T) -> U) -> [U; 3] {
    [f(a), f(b), f(c)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_keep_their_places() {
        assert_eq!(each_of_three([1, 2, 3], |i| 10 * i), [10, 20, 30]);
    }
}
