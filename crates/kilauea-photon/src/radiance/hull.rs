//! How much of a disc is surface: next to an edge, or where a surface turns away, photons are missing
//! from a part of it, and a sum over the whole disc is too dark.

use kilauea_math::Vec2;

/// Share of the unit disc, weighed by 2 (1 - d²) / π as [`Kernel::Epanechnikov`](crate::Kernel) weighs it,
/// that is within the convex hull of the places of photons; one where they may as well be spread over
/// all of it. `places` are no farther than one from the middle, and their order is lost.
pub(super) fn covered_share(places: &mut [Vec2]) -> f32 {
    let hull = convex_hull(places);
    let corners = hull.iter().zip(hull.iter().cycle().skip(1));
    let share: f32 = corners.map(|(&a, &b)| share_of_triangle(a, b)).sum();
    (share / least_share_of_whole(places.len())).min(1.0)
}

/// The share that the triangle of two corners and the middle has, negative where it is clockwise.
fn share_of_triangle(a: Vec2, b: Vec2) -> f32 {
    let area = 0.5 * a.perp_dot(b);
    let mean_d_sq = (a.length_squared() + a.dot(b) + b.length_squared()) / 6.0;
    area * (1.0 - mean_d_sq) * std::f32::consts::FRAC_2_PI
}

/// What the hull of so many places, spread evenly over the whole disc, hardly ever falls short of. Its
/// distance from the rim is as n^(-2/3) (Rényi & Sulanke 1963), and so small there is the weight; the factor
/// is three standard deviations above the mean, which is 12.5.
fn least_share_of_whole(n: usize) -> f32 {
    (1.0 - 27.0 * (n as f32).powf(-4.0 / 3.0)).max(0.25)
}

/// Corners of the convex hull, counter-clockwise (Andrew 1979, monotone chains).
fn convex_hull(places: &mut [Vec2]) -> Vec<Vec2> {
    places.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut hull = Vec::with_capacity(places.len() + 1);
    extend_chain(&mut hull, places.iter());
    extend_chain(&mut hull, places.iter().rev());
    hull
}

/// Adds the chain from the first place to the last, which the next chain begins with.
fn extend_chain<'a>(hull: &mut Vec<Vec2>, places: impl Iterator<Item = &'a Vec2>) {
    let first = hull.len();
    for &place in places {
        while let [.., a, b] = hull[first..] {
            if (b - a).perp_dot(place - b) > 0.0 {
                break;
            }
            hull.pop();
        }
        hull.push(place);
    }
    hull.pop();
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_testing::uniforms;

    /// So many places on the part of the disc that is asked for.
    fn places(stream: u32, n: usize, is_surface: impl Fn(Vec2) -> bool) -> Vec<Vec2> {
        let all = (0..).map(|i| 2.0 * Vec2::from(uniforms(stream, i)) - 1.0);
        all.filter(|&p| p.length() < 1.0 && is_surface(p))
            .take(n)
            .collect()
    }

    fn mean_share(n: usize, is_surface: impl Fn(Vec2) -> bool + Copy) -> f32 {
        const N_DISCS: u32 = 400;
        let share = |stream| covered_share(&mut places(stream, n, is_surface));
        (0..N_DISCS).map(share).sum::<f32>() / N_DISCS as f32
    }

    #[test]
    fn the_hull_of_a_square_has_its_share() {
        // The integral of 2 (1 - x² - y²) / π over |x|, |y| < 0.5, of which the corners are all there is.
        let corner = |i: usize| Vec2::new([-0.5, 0.5][i & 1], [-0.5, 0.5][i >> 1]);
        let mut places: Vec<Vec2> = (0..4000).map(|i| corner(i % 4)).collect();
        let expected = std::f32::consts::FRAC_2_PI * (1.0 - 1.0 / 6.0);
        let found = covered_share(&mut places);
        assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
    }

    #[test]
    fn edges_and_corners_are_noticed_and_whole_discs_left_alone() {
        for n in [49, 200] {
            let whole = mean_share(n, |_| true);
            let half = mean_share(n, |p| p.x < 0.0);
            let quarter = mean_share(n, |p| p.x < 0.0 && p.y < 0.0);
            assert!(whole > 0.99, "{n}: {whole}");
            assert!((half / 0.5 - 1.0).abs() < 0.12, "{n}: {half}");
            assert!((quarter / 0.25 - 1.0).abs() < 0.15, "{n}: {quarter}");
        }
    }

    #[test]
    fn places_without_area_cover_nothing() {
        assert_eq!(covered_share(&mut []), 0.0);
        assert_eq!(covered_share(&mut [Vec2::X; 20]), 0.0);
        assert_eq!(covered_share(&mut [Vec2::X * 0.5, Vec2::ZERO]), 0.0);
    }
}
