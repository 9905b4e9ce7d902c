use kilauea_math::DVec3;

use super::Tessellation;
use super::profile::ProfilePoint;

/// Segments around the spine of something `radius_px` pixels large.
pub(crate) fn segments_around(radius_px: f64, pixels_per_edge: f64) -> u32 {
    /// A sphere of so many segments lacks 0.16 % of its area.
    const FEWEST: f64 = 72.0;
    const MOST: f64 = 256.0;
    let n = std::f64::consts::TAU * radius_px / pixels_per_edge;
    // NaN takes the fewest.
    let n = if n > FEWEST { n.min(MOST) } else { FEWEST };
    (n / 8.0).ceil() as u32 * 8
}

/// Turns profiles around the spine; `place` maps (across, across, along) to the shape's space.
///
/// Triangles are counter-clockwise from the outside when the profile runs up the spine. Where the
/// profile touches the spine, quads shrink to triangles: of one vertex if the normal there is the
/// spine (a pole), of one vertex per segment otherwise (an apex).
pub(crate) fn revolve(
    runs: &[Vec<ProfilePoint>],
    n_around: u32,
    place: impl Fn(f64, f64, f64) -> DVec3,
) -> Tessellation {
    let mut points = Vec::new();
    let mut normals = Vec::new();
    let mut corner_points = Vec::new();
    let mut push = |p: ProfilePoint, turn: f64| {
        let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
        let point = place(p.radius * cos, p.radius * sin, p.height);
        points.push(point.as_vec3().to_array());
        let normal = place(p.normal[0] * cos, p.normal[0] * sin, p.normal[1]);
        normals.extend(normal.as_vec3().to_array());
        points.len() as u32 - 1
    };
    for run in runs {
        let rings: Vec<Ring> = run
            .iter()
            .map(|&p| {
                let is_on_spine = p.radius == 0.0;
                let is_pole = is_on_spine && p.normal[0] == 0.0;
                // The normal of an apex belongs to the middle of its triangle.
                let phase = if is_on_spine { 0.5 } else { 0.0 };
                let n = if is_pole { 1 } else { n_around };
                let vertices = (0..n)
                    .map(|i| push(p, (f64::from(i) + phase) / f64::from(n_around)))
                    .collect();
                Ring {
                    vertices,
                    is_on_spine,
                }
            })
            .collect();
        for pair in rings.windows(2) {
            let [low, high] = pair else { continue };
            for i in 0..n_around as usize {
                let [a, b] = low.segment(i);
                let [d, c] = high.segment(i);
                if !low.is_on_spine {
                    corner_points.extend([a, b, c]);
                }
                if !high.is_on_spine {
                    corner_points.extend([a, c, d]);
                }
            }
        }
    }
    Tessellation {
        points,
        face_size: 3,
        corner_points,
        normals: Some(normals),
    }
}

/// The vertices of one profile point.
struct Ring {
    vertices: Vec<u32>,
    is_on_spine: bool,
}

impl Ring {
    /// The two ends of a segment; the same vertex on the spine.
    fn segment(&self, i: usize) -> [u32; 2] {
        let n = self.vertices.len();
        let first = self.vertices[i % n];
        let second = if self.is_on_spine {
            first
        } else {
            self.vertices[(i + 1) % n]
        };
        [first, second]
    }
}
