use super::bezier::{self, Components};
use super::segment::{Piece, Segment};

/// The balls of one radius along a line, which hold a piece of a curve and all that tests take for
/// it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Capsule {
    pub(crate) from: [f32; 3],
    pub(crate) to: [f32; 3],
    pub(crate) radius: f32,
}

impl Segment {
    /// A capsule between the ends of the piece.
    ///
    /// At equal parameters the curve and the line between its ends differ by a cubic whose outer
    /// control points vanish, so by no more than 3/4 of the longer inner one. That bound is convex
    /// in time: between two motion keys, ends and radius interpolated linearly hold the piece.
    pub(crate) fn capsule(&self, piece: Piece) -> Capsule {
        // Room for the flat ends of ribbons, which reach a little beyond their radius, for the
        // overlap of neighbouring pieces, and for the rounding of ends, also where interpolated.
        const OF_RADIUS: f64 = 1e-3;
        const OF_LENGTH: f64 = 1e-6;
        const OF_SIZE: f64 = 8.0 * f32::EPSILON as f64;
        let curve: Components<4> = std::array::from_fn(|c| self.points.map(|p| f64::from(p[c])));
        let [x, y, z, r] = bezier::part(&curve, piece.range());
        let inner = |axis: &[f64; 4], i: usize| {
            let along = i as f64 / 3.0;
            axis[i] - (axis[0] + along * (axis[3] - axis[0]))
        };
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let bow = [1, 2].map(|i| length([inner(&x, i), inner(&y, i), inner(&z, i)]));
        let widest = r.into_iter().fold(0.0, f64::max);
        let chord = length([x[3] - x[0], y[3] - y[0], z[3] - z[0]]);
        let around = 0.75 * bow[0].max(bow[1]) + widest * (1.0 + OF_RADIUS);
        let margin = OF_LENGTH * (chord + bow[0] + bow[1]) + OF_SIZE * f64::from(self.size());
        Capsule {
            from: [x[0], y[0], z[0]].map(|p| p as f32),
            to: [x[3], y[3], z[3]].map(|p| p as f32),
            radius: ((around + margin) as f32).next_up(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::CurveShape;
    use crate::primitive::bernstein::value;
    use crate::primitive::bezier::tests::Random;
    use kilauea_math::DVec3;

    fn random_segment(random: &mut Random) -> Segment {
        let bend = random.unit();
        let (first, last) = (random.point(), random.point());
        Segment {
            points: std::array::from_fn(|i| {
                let p = first.lerp(last, i as f64 / 3.0) + bend * random.point();
                let [x, y, z] = (100.0 * p).as_vec3().to_array();
                [x, y, z, random.unit() as f32]
            }),
            shape: CurveShape::RoundBezier,
        }
    }

    fn distance_to_axis(capsule: &Capsule, p: DVec3) -> f64 {
        let [from, to] = [capsule.from, capsule.to].map(|p| DVec3::from_array(p.map(f64::from)));
        let axis = to - from;
        let along = ((p - from).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        p.distance(from + along * axis)
    }

    /// At both keys and between them.
    #[test]
    fn capsules_hold_all_balls_of_their_piece_at_any_time() {
        let mut random = Random(9);
        for _ in 0..100 {
            let [first, last] = [0; 2].map(|_| random_segment(&mut random));
            for piece in first.pieces() {
                let ends = [first, last].map(|segment| segment.capsule(piece));
                for fraction in [0.0, 0.4, 1.0] {
                    let lerp = |a: f32, b: f32| a + fraction * (b - a);
                    let point = |end: fn(&Capsule) -> [f32; 3]| -> [f32; 3] {
                        std::array::from_fn(|axis| lerp(end(&ends[0])[axis], end(&ends[1])[axis]))
                    };
                    let capsule = Capsule {
                        from: point(|capsule| capsule.from),
                        to: point(|capsule| capsule.to),
                        radius: lerp(ends[0].radius, ends[1].radius),
                    };
                    let segment = first.at_time(&last, fraction);
                    let [begin, end] = piece.range();
                    for i in 0..=20 {
                        let u = begin + (end - begin) * f64::from(i) / 20.0;
                        let at = |c: usize| value(segment.points.map(|p| f64::from(p[c])), u);
                        let p = DVec3::new(at(0), at(1), at(2));
                        let reach = distance_to_axis(&capsule, p) + at(3);
                        assert!(
                            reach <= f64::from(capsule.radius),
                            "{capsule:?} {segment:?}"
                        );
                    }
                }
            }
        }
    }
}
