use super::bezier::{self, Components};
use super::ray_frame::{Place, RayFrame};
use super::{linear, ribbon, round};
use kilauea_math::Bounds3;

/// What is swept along a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CurveShape {
    /// Balls along a straight line.
    RoundLinear,
    /// Balls along a cubic Bézier curve.
    RoundBezier,
    /// A flat strip along a straight line, facing the ray.
    FacingLinear,
    /// A flat strip along a cubic Bézier curve, facing the ray.
    FacingBezier,
    /// A flat strip across the curve and its normals.
    Oriented,
}

/// One segment of a curve, by control points.
///
/// A straight one has its ends first and last, and points in even steps between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    /// x, y, z and radius.
    pub(crate) points: [[f32; 4]; 4],
    pub(crate) shape: CurveShape,
}

/// A range of a segment's parameter, in eighths, so that boxes around it are tight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    pub(crate) from: u8,
    pub(crate) to: u8,
}

impl Piece {
    pub(crate) const WHOLE: Self = Self { from: 0, to: 8 };

    pub(super) fn range(self) -> [f64; 2] {
        [self.from, self.to].map(|eighths| f64::from(eighths) / 8.0)
    }
}

impl Segment {
    /// Where the ray first meets the piece, or leaves a round segment that it starts in.
    /// `normals` are those of the control points of an oriented one. `limit` is a distance beyond
    /// which hits do not matter.
    ///
    /// Straight segments are met as a whole, which is faster; so two pieces of one give the same
    /// place.
    pub(crate) fn intersect(
        &self,
        normals: Option<&[[f32; 3]; 4]>,
        piece: Piece,
        ray: &RayFrame,
        limit: f32,
    ) -> Option<Place> {
        // A hit a little beyond may round to the limit.
        let limit = ray.depth(limit.next_up());
        let local = self.points.map(|[x, y, z, r]| {
            let [x, y, z] = ray.local([x, y, z]);
            [x, y, z, f64::from(r)]
        });
        let curve: Components<4> = std::array::from_fn(|c| local.map(|p| p[c]));
        let ends = curve.map(|[first, .., last]| [first, last]);
        let range = piece.range();
        match self.shape {
            CurveShape::RoundLinear => linear::intersect_round(&ends, ray),
            CurveShape::FacingLinear => linear::intersect_facing(&ends, ray),
            CurveShape::RoundBezier => round::intersect(&curve, range, ray, limit),
            CurveShape::FacingBezier => ribbon::intersect_facing(&curve, range, ray, limit),
            CurveShape::Oriented => {
                let normals = normals?.map(|n| ray.local_dir(n));
                let [x, y, z, r] = curve;
                let [nx, ny, nz] = [0, 1, 2].map(|axis| normals.map(|n| n[axis]));
                ribbon::intersect_oriented(&[x, y, z, r, nx, ny, nz], range, ray, limit)
            }
        }
    }

    /// The largest coordinate, with the radius.
    pub(crate) fn size(&self) -> f32 {
        let extent = |[x, y, z, r]: [f32; 4]| x.abs().max(y.abs()).max(z.abs()) + r;
        self.points.map(extent).into_iter().fold(0.0, f32::max)
    }

    /// A box around the piece.
    pub(crate) fn bounds(&self, piece: Piece) -> Bounds3 {
        let curve: Components<4> = std::array::from_fn(|c| self.points.map(|p| f64::from(p[c])));
        bezier::bounds(&bezier::part(&curve, piece.range()))
    }

    /// The pieces to build over: as many as boxes get smaller by.
    pub(crate) fn pieces(&self) -> Vec<Piece> {
        // What the boxes' total area must fall to when their number doubles.
        const WORTH_CUTTING: f32 = 0.65;
        let cut = |n: u8| -> Vec<Piece> {
            let length = Piece::WHOLE.to / n;
            let piece = |i| Piece {
                from: i * length,
                to: (i + 1) * length,
            };
            (0..n).map(piece).collect()
        };
        let area =
            |pieces: &[Piece]| -> f32 { pieces.iter().map(|&p| self.bounds(p).half_area()).sum() };
        let mut pieces = cut(1);
        for n in [2, 4, 8] {
            let finer = cut(n);
            if area(&finer) > WORTH_CUTTING * area(&pieces) {
                break;
            }
            pieces = finer;
        }
        pieces
    }

    /// The segment between this one and `later`, at `fraction` of the way.
    pub(crate) fn at_time(&self, later: &Self, fraction: f32) -> Self {
        let lerp = |a: f32, b: f32| a + fraction * (b - a);
        Self {
            points: std::array::from_fn(|i| {
                std::array::from_fn(|c| lerp(self.points[i][c], later.points[i][c]))
            }),
            shape: self.shape,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(radius: f32) -> Segment {
        Segment {
            points: [0.0, 1.0, 2.0, 3.0].map(|c| [c, c, c, radius]),
            shape: CurveShape::RoundBezier,
        }
    }

    #[test]
    fn long_thin_segments_are_cut_and_stubs_are_not() {
        assert_eq!(diagonal(0.01).pieces().len(), 8);
        assert_eq!(diagonal(10.0).pieces().len(), 1);
        let pieces = diagonal(0.01).pieces();
        assert_eq!((pieces[0].from, pieces[7].to), (0, 8));
        assert!(pieces.windows(2).all(|pair| pair[0].to == pair[1].from));
    }

    /// Boxes interpolated between two keys hold the segment interpolated between them.
    #[test]
    fn bounds_of_moving_segments_are_linear_in_time() {
        let mut later = diagonal(0.3);
        for (i, point) in later.points.iter_mut().enumerate() {
            point[0] = 5.0 - (i * i) as f32;
            point[1] *= -0.5;
        }
        let segment = diagonal(0.3);
        for piece in segment.pieces() {
            let (first, last) = (segment.bounds(piece), later.bounds(piece));
            for fraction in [0.0, 0.25, 0.6, 1.0] {
                let between = segment.at_time(&later, fraction).bounds(piece);
                let slack = 1e-5;
                assert!(
                    between
                        .min
                        .cmpge(first.min.lerp(last.min, fraction) - slack)
                        .all()
                );
                assert!(
                    between
                        .max
                        .cmple(first.max.lerp(last.max, fraction) + slack)
                        .all()
                );
            }
        }
    }
}
