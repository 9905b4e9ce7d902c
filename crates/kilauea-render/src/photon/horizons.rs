use kilauea_math::{INV_PI, Vec2, Vec3, warp};

/// Directions above the geometric horizon and below that of the shading normal.
///
/// Camera paths come from there too and see what is lit, since weights have the cosine of the
/// direction to the light alone. No BSDF samples them from the light's side, so photons have to be
/// sent there beside it.
#[derive(Clone, Copy, Debug)]
pub(super) struct BetweenHorizons {
    ng: Vec3,
    /// Away from where the shading normal leans, perpendicular to `ng`.
    away: Vec3,
    /// Cosine between the normals.
    cos_tilt: f32,
}

/// What is between the horizons of normals that are closer than this cosine, a millionth of all
/// light, is left out.
const MAX_COS_TILT: f32 = 1.0 - 2e-6;

impl BetweenHorizons {
    /// Unit normals on one side of a surface; none where they are nearly the same.
    pub(super) fn of(ng: Vec3, ns: Vec3) -> Option<Self> {
        let cos_tilt = ng.dot(ns);
        if cos_tilt >= MAX_COS_TILT {
            return None;
        }
        let away = (ng * cos_tilt - ns).try_normalize()?;
        Some(Self { ng, away, cos_tilt })
    }

    /// The part of the projected solid angle that they fill: a half disk without a half ellipse.
    pub(super) fn share(&self) -> f32 {
        0.5 * (1.0 - self.cos_tilt.max(0.0))
    }

    /// The density of [`Self::sample`].
    pub(super) fn pdf(&self, dir: Vec3) -> f32 {
        let ns = self.ng * self.cos_tilt - self.away * (1.0 - self.cos_tilt * self.cos_tilt).sqrt();
        if dir.dot(self.ng) > 0.0 && dir.dot(ns) < 0.0 {
            dir.dot(self.ng) * INV_PI / self.share()
        } else {
            0.0
        }
    }

    /// A direction, and its density per solid angle: in proportion to the cosine to the geometric
    /// normal.
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let disk = warp::concentric_disk(u);
        let y = disk.y;
        let rim = (1.0 - y * y).max(0.0).sqrt();
        let cos_tilt = self.cos_tilt.max(0.0);
        let x = cos_tilt * rim + (1.0 - cos_tilt) * disk.x.abs();
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        let across = self.ng.cross(self.away);
        let dir = self.away * x + across * y + self.ng * z;
        (dir, z * INV_PI / self.share())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_testing::{Directions, Draw, Family, compare, uniforms};

    #[test]
    fn directions_are_between_the_horizons_and_follow_the_cosine() {
        let ng = Vec3::new(0.2, -0.4, 0.9).normalize();
        let mut family = Family::new("between horizons");
        for tilt in [0.1, 0.6] {
            let ns = (ng + tilt * ng.any_orthonormal_vector()).normalize();
            let between = BetweenHorizons::of(ng, ns).unwrap();
            let draw = |i| {
                let [x, y] = uniforms(family.len() as u32, i);
                Draw::At(between.sample(Vec2::new(x, y)).0)
            };
            let density = |dir: Vec3| {
                let is_between = dir.dot(ng) > 0.0 && dir.dot(ns) < 0.0;
                // On the horizon itself, roundings of the normal decide.
                let is_on_horizon = dir.dot(ns).abs() < 1e-5;
                let density = between.pdf(dir);
                assert!((density > 0.0) == is_between || is_on_horizon, "{dir}");
                f64::from(density)
            };
            let domain = Directions::around(between.away + 0.1 * ng, 1.0);
            let found = compare(&domain, 8_000, draw, density);
            family.add(format!("{tilt}: {found:?}"), found.p_value());
        }
        family.check();
    }

    #[test]
    fn equal_normals_have_one_horizon() {
        assert!(BetweenHorizons::of(Vec3::Z, Vec3::Z).is_none());
    }
}
