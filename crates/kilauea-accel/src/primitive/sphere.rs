use super::ray_frame::{Place, RayFrame};
use kilauea_math::{Bounds3, Vec3};

/// A ball's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sphere {
    pub(crate) center: [f32; 3],
    pub(crate) radius: f32,
}

impl Sphere {
    /// Where the ray enters the ball or, from inside, leaves it.
    #[inline]
    pub(crate) fn intersect(&self, ray: &RayFrame) -> Option<Place> {
        let [x, y, z] = ray.local(self.center);
        let radius = f64::from(self.radius);
        let h = radius * radius - (x * x + y * y);
        if h < 0.0 {
            return None;
        }
        let half_chord = h.sqrt();
        [z - half_chord, z + half_chord]
            .into_iter()
            .find(|&depth| depth > ray.start())
            .map(|depth| Place {
                t: ray.distance(depth),
                u: 0.0,
                v: 0.0,
            })
    }

    /// The smallest box, rounded outwards.
    pub(crate) fn bounds(&self) -> Bounds3 {
        let low = self.center.map(|c| (c - self.radius).next_down());
        let high = self.center.map(|c| (c + self.radius).next_up());
        Bounds3 {
            min: Vec3::from_array(low),
            max: Vec3::from_array(high),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::bezier::tests::Random;
    use kilauea_math::DVec3;

    #[test]
    fn hits_lie_on_the_sphere_and_misses_pass_it_by() {
        let mut random = Random(1);
        let (mut n_hits, mut n_inside) = (0, 0);
        for _ in 0..100_000 {
            let scale = 10_f64.powf(8.0 * random.unit() - 4.0);
            let center = scale * 10.0 * random.point();
            let sphere = Sphere {
                center: center.as_vec3().to_array(),
                radius: (scale * random.unit()) as f32,
            };
            let center = DVec3::from_array(sphere.center.map(f64::from));
            let radius = f64::from(sphere.radius);
            let origin = center + 2.0 * scale * random.point();
            let dir = center + 1.5 * scale * random.point() - origin;
            let t_nearest = (center - origin).dot(dir) / dir.dot(dir);
            let distance = (origin + t_nearest * dir).distance(center);
            let is_inside = origin.distance(center) < radius;
            let place = sphere.intersect(&RayFrame::new(origin, dir, 0.0));
            if let Some(place) = place {
                let p = origin + place.t * dir;
                let off = (p.distance(center) - radius).abs();
                assert!(off < 1e-13 * scale, "{off} at scale {scale}");
                assert_eq!(place.t < t_nearest, !is_inside);
                n_hits += 1;
                n_inside += usize::from(is_inside);
            } else {
                let passes = distance > radius * (1.0 - 1e-13) || (t_nearest < 0.0 && !is_inside);
                assert!(passes, "{distance} of {radius}");
            }
        }
        assert!(n_hits > 10_000 && n_inside > 1000, "{n_hits} {n_inside}");
    }

    #[test]
    fn bounds_hold_the_sphere_tightly() {
        let sphere = Sphere {
            center: [1e4, -1e-4, 0.3],
            radius: 0.1,
        };
        let Bounds3 { min, max } = sphere.bounds();
        for axis in 0..3 {
            let (c, r) = (f64::from(sphere.center[axis]), f64::from(sphere.radius));
            assert!(f64::from(min[axis]) <= c - r && f64::from(max[axis]) >= c + r);
            assert!(max[axis] - min[axis] < 0.21);
        }
    }
}
