use super::SizeOnScreen;
use super::cage::Cage;
use crate::tokens::Scheme;

/// No mesh is refined beyond this.
const MAX_TRIANGLES: usize = 4_000_000;

/// Cages of fewer faces are always refined twice: their shape is far from the limit's.
const FEW_FACES: usize = 500;

/// How often to refine: until edges are short enough on screen and creases have faded out.
pub(crate) fn choose_level(
    cage: &Cage,
    scheme: Scheme,
    points: &[[f32; 3]],
    size: SizeOnScreen,
) -> u32 {
    let topology = &cage.topology;
    let edge_px = mean_edge(cage, points) * size.pixels_per_unit;
    // NaN, of no edges infinitely near, is level 0.
    let by_size = (edge_px / size.pixels_per_edge).log2().ceil().max(0.0);
    let by_faces = if topology.n_faces() < FEW_FACES { 2 } else { 0 };
    let by_creases = if cage.has_creases {
        cage.semi_sharpness.ceil().max(1.0) as u32
    } else {
        0
    };
    let wanted = (by_size as u32).max(by_faces).max(by_creases);
    let n_triangles = |level: u32| match (scheme, level) {
        (_, 0) => topology.n_corners(),
        (Scheme::Loop, _) => topology.n_faces() << (2 * level),
        _ => (2 * topology.n_corners()) << (2 * (level - 1)),
    };
    let mut level = wanted.min(size.max_level).min(10);
    while level > 0 && n_triangles(level) > MAX_TRIANGLES {
        level -= 1;
    }
    level
}

fn mean_edge(cage: &Cage, points: &[[f32; 3]]) -> f64 {
    let n = cage.topology.n_edges();
    let sum: f64 = (0..n)
        .map(|edge| {
            let [a, b] = cage
                .topology
                .ends(edge)
                .map(|v| kilauea_math::Vec3::from_array(points[v as usize]).as_dvec3());
            a.distance(b)
        })
        .sum();
    sum / n as f64
}
