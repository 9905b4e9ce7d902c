//! Random curves and slow, plain answers for the tests.

use super::bernstein::value;
use super::bezier::Components;
use super::bezier::tests::Random;
use super::ray_frame::RayFrame;
use kilauea_math::DVec3;

/// A random curve in engine space with an offset and scale of its own, and rays near it.
pub(crate) struct Case {
    pub(crate) points: [[f32; 4]; 4],
    pub(crate) scale: f64,
    /// Straight there and back.
    pub(crate) is_fold: bool,
    pub(crate) origin: DVec3,
    pub(crate) dir: DVec3,
}

impl Case {
    /// Curves of every kind: strong and weak bends, cusps, thin and thick, pointed and degenerate.
    pub(crate) fn new(random: &mut Random) -> Self {
        let scale = 10_f64.powf((8.0 * random.unit()).floor() - 4.0);
        let offset = scale * [0.0, 1.0, 100.0][(3.0 * random.unit()) as usize] * random.point();
        let thickness = [0.5, 0.1, 0.01, 0.002][(4.0 * random.unit()) as usize];
        let bend = [1.0, 0.3, 0.02, 0.0][(4.0 * random.unit()) as usize];
        let (first, last) = (random.point(), random.point());
        let kind = random.unit();
        let mut points: [DVec3; 4] = std::array::from_fn(|i| {
            first + (last - first) * i as f64 / 3.0 + bend * random.point()
        });
        if kind < 0.05 {
            points = [first; 4];
        } else if kind < 0.1 {
            points[1] = points[0];
        } else if kind < 0.15 {
            points[3] = points[0];
        }
        let mut radii: [f64; 4] = std::array::from_fn(|_| thickness * random.unit());
        if random.unit() < 0.3 {
            radii[3] = 0.0;
        }
        if random.unit() < 0.3 {
            radii = [thickness; 4];
        }
        let points = std::array::from_fn(|i| {
            let p = (offset + scale * points[i]).as_vec3();
            [p.x, p.y, p.z, (scale * radii[i]) as f32]
        });
        let rounded = points.map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
        let u = random.unit();
        let target = DVec3::from_array([0, 1, 2].map(|axis| value(rounded.map(|p| p[axis]), u)))
            + 1.5 * scale * thickness * random.point();
        let distance = [0.5 * thickness, 0.3, 3.0, 300.0][(4.0 * random.unit()) as usize];
        let mut origin = target + distance * scale * random.point();
        if random.unit() < 0.1 {
            // Along the curve.
            origin = target + 3.0 * (rounded[3] - rounded[0]);
        }
        let dir = (target - origin) * (0.1 + random.unit());
        Self {
            points,
            scale,
            is_fold: bend == 0.0 && rounded[3] == rounded[0],
            origin,
            dir: if dir == DVec3::ZERO { DVec3::X } else { dir },
        }
    }

    pub(crate) fn frame(&self) -> RayFrame {
        RayFrame::new(self.origin, self.dir, 0.0)
    }

    /// The curve in the frame of the ray.
    pub(crate) fn curve(&self, frame: &RayFrame) -> Components<4> {
        let local = self.points.map(|[x, y, z, r]| {
            let [x, y, z] = frame.local([x, y, z]);
            [x, y, z, f64::from(r)]
        });
        std::array::from_fn(|c| local.map(|p| p[c]))
    }
}

/// The first depth after `start` at which the union of densely sampled balls begins or, with
/// `start` inside, ends.
pub(crate) fn first_boundary(ball: impl Fn(f64) -> [f64; 4], start: f64) -> Option<f64> {
    const N: usize = 2000;
    let mut chords: Vec<[f64; 2]> = (0..=N)
        .filter_map(|i| {
            let [x, y, z, r] = ball(i as f64 / N as f64);
            let h = r * r - (x * x + y * y);
            (h >= 0.0).then(|| [z - h.sqrt(), z + h.sqrt()])
        })
        .collect();
    chords.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut end = start;
    for [first, last] in chords {
        if first > end {
            return Some(if end > start { end } else { first });
        }
        end = end.max(last);
    }
    (end > start).then_some(end)
}
