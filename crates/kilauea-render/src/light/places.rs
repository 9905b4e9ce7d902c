//! Boxes at which light from infinity is aimed.

use kilauea_math::{Bounds3, Vec2, Vec3};

use super::aim::UsefulRay;
use super::lit_box::LitBox;

/// Boxes around what earlier light met, each with a share of the light.
#[derive(Clone, Debug)]
pub(super) struct Places {
    /// The first is around all others.
    boxes: Vec<Place>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    bounds: LitBox,
    share: f32,
}

/// What photons have met is a part of what there is to meet: the box around it grows by this much of
/// its size to each side.
const BOX_GROWTH: f32 = 0.05;
/// All are looked at for each photon, and where light that paths find is weighed against photons.
const MAX_BOXES: usize = 32;
/// Share of the box around all, which knows nothing but that.
const WHOLE_SHARE: f32 = 0.25;

impl Places {
    /// Where rays met something first; none where that is nowhere.
    pub(super) fn of(rays: &[UsefulRay]) -> Option<Self> {
        let mut rays = rays.to_vec();
        let whole = box_around(&rays)?;
        let least = UsefulRay::MIN_TO_AIM.max(rays.len().div_ceil(MAX_BOXES));
        let mut parts = Vec::new();
        divide(&mut rays, least, &mut parts);
        let total: f32 = parts.iter().map(|part| part.share).sum();
        let is_divided = parts.len() > 1 && total > 0.0 && total.is_finite();
        let mut boxes = vec![Place {
            bounds: whole,
            share: if is_divided { WHOLE_SHARE } else { 1.0 },
        }];
        if is_divided {
            boxes.extend(parts.into_iter().map(|part| Place {
                share: (1.0 - WHOLE_SHARE) * part.share / total,
                ..part
            }));
        }
        Some(Self { boxes })
    }

    /// Where light along the unit vector `dir` enters one of the boxes.
    pub(super) fn entry(&self, dir: Vec3, u: Vec2) -> Vec3 {
        let mut rest = u.x;
        let mut chosen = self.boxes[0];
        for &place in &self.boxes {
            chosen = place;
            if rest < place.share {
                break;
            }
            rest -= place.share;
        }
        let x = (rest / chosen.share).min(1.0 - 0.5 * f32::EPSILON);
        chosen.bounds.entry(dir, Vec2::new(x, u.y))
    }

    /// The density of [`Self::entry`] per area perpendicular to `dir`, for the line through `p`.
    pub(super) fn density_per_area(&self, p: Vec3, dir: Vec3) -> f32 {
        let met = self.boxes.iter().filter(|b| b.bounds.is_met(p, dir));
        met.map(|place| place.share / place.bounds.cross_section(dir))
            .sum()
    }
}

/// Boxes around halves of halves of the rays, of `least` rays each or more; each has the luminance
/// of its rays for its share.
fn divide(rays: &mut [UsefulRay], least: usize, boxes: &mut Vec<Place>) {
    if rays.len() < 2 * least {
        boxes.extend(box_around(rays).map(|bounds| Place {
            bounds,
            share: rays.iter().map(|ray| ray.luminance).sum(),
        }));
        return;
    }
    let extent = Bounds3::from_points(rays.iter().map(|ray| ray.p_met)).diagonal();
    let axis = extent.max_position();
    let middle = rays.len() / 2;
    rays.select_nth_unstable_by(middle, |a, b| a.p_met[axis].total_cmp(&b.p_met[axis]));
    let (first, second) = rays.split_at_mut(middle);
    divide(first, least, boxes);
    divide(second, least, boxes);
}

fn box_around(rays: &[UsefulRay]) -> Option<LitBox> {
    let met = Bounds3::from_points(rays.iter().map(|ray| ray.p_met));
    let growth = BOX_GROWTH * met.diagonal();
    LitBox::new(Bounds3 {
        min: met.min - growth,
        max: met.max + growth,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::hash::{combine, unit_f32};

    /// Rays that met one of two small squares, far apart.
    fn rays(n: u32) -> Vec<UsefulRay> {
        let ray = |i| {
            let x = if i % 2 == 0 { 0.0 } else { 100.0 };
            UsefulRay {
                light: 0,
                dir: -Vec3::Y,
                p_met: Vec3::new(x + unit_f32(combine(i, 1)), 0.0, unit_f32(combine(i, 2))),
                luminance: 1.0,
                density: 1.0,
            }
        };
        (0..n).map(ray).collect()
    }

    fn entries(places: &Places, n: u32) -> impl Iterator<Item = (Vec3, f32)> {
        (0..n).map(move |i| {
            let u = Vec2::new(unit_f32(combine(i, 3)), unit_f32(combine(i, 4)));
            let p = places.entry(-Vec3::Y, u);
            (p, places.density_per_area(p, -Vec3::Y))
        })
    }

    #[test]
    fn most_light_goes_where_earlier_light_went() {
        let is_near = |p: Vec3| p.x < 1.5 || p.x > 99.5;
        let share = |n_rays| {
            let places = Places::of(&rays(n_rays)).expect("there are rays");
            let near = entries(&places, 10_000).filter(|&(p, _)| is_near(p));
            near.count() as f64 / 10_000.0
        };
        assert!(share(400) > 0.75, "{}", share(400));
        // Too few to tell places apart.
        assert!(share(20) < 0.2, "{}", share(20));
    }

    /// The mean of 1 / density is the area that entries cover.
    #[test]
    fn entries_have_the_density_that_is_told() {
        let places = Places::of(&rays(400)).expect("there are rays");
        let whole = places.boxes[0].bounds.cross_section(-Vec3::Y);
        let n = 100_000;
        let area: f64 = entries(&places, n)
            .map(|(_, density)| 1.0 / f64::from(density))
            .sum();
        let ratio = area / f64::from(n) / f64::from(whole);
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    }
}
