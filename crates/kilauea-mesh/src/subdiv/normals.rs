use std::f64::consts::TAU;

use kilauea_math::{DVec3, Vec3};

use crate::tokens::Scheme;

use super::rings::SmallRing;
use super::rules::{Rule, VertexRules};
use super::topology::Topology;

/// Normals of the limit surface by corner: distinct normals, and which one each corner has.
///
/// The faces around a vertex share a normal as far as no sharp edge lies between them. Zero where
/// the surface has no tangent plane and faces have no area.
pub(crate) fn limit_normals(
    topology: &Topology,
    rules: &[VertexRules],
    scheme: Scheme,
    points: &[[f32; 3]],
) -> (Vec<[f32; 3]>, Vec<u32>) {
    let mut normals = Vec::with_capacity(topology.n_vertices);
    let mut of_corner = vec![0; topology.n_corners()];
    let mut masks = TangentMasks {
        scheme,
        by_valence: Vec::new(),
    };
    let mut ring = Ring {
        topology,
        points,
        corners: Vec::new(),
    };
    topology.for_each_fan(|fan, is_closed| {
        let vertex = topology.vertex[fan[0] as usize] as usize;
        let rule = rules[vertex].rule(topology.vertex_sharpness[vertex]);
        let mut push = |normal: Vec3, corners: &[u32]| {
            for &corner in corners {
                of_corner[corner as usize] = normals.len() as u32;
            }
            normals.push(normal.to_array());
        };
        if is_closed && rule == Rule::Smooth {
            ring.corners.clear();
            ring.corners.extend_from_slice(fan);
            let normal = if rules[vertex].is_dart(topology.vertex_sharpness[vertex]) {
                small_normal(SmallRing::around_dart(topology, scheme, points, fan))
            } else {
                ring.smooth_normal(masks.get(fan.len()))
            };
            push(normal, fan);
            return;
        }
        let is_sharp = |&c: &u32| topology.edge_sharpness[topology.edge[c as usize] as usize] > 0.0;
        let n_sharp = fan.iter().filter(|c| is_sharp(c)).count();
        if is_closed && n_sharp < 2 {
            // The tip of a cone: no edge tells where one side ends.
            for corner in fan {
                ring.corners.clear();
                ring.corners.push(*corner);
                push(ring.mean_normal(), &ring.corners);
            }
            return;
        }
        // Each sharp edge starts a sector; a closed fan starts at the first of them.
        let first = fan.iter().position(is_sharp).unwrap_or(0);
        let turned: Vec<u32> = fan[first..].iter().chain(&fan[..first]).copied().collect();
        for sector in turned.chunk_by(|_, c| !is_sharp(c)) {
            ring.corners.clear();
            ring.corners.extend_from_slice(sector);
            let normal = match rule {
                Rule::Crease => ring.crease_normal(scheme),
                Rule::Smooth | Rule::Corner => ring.mean_normal(),
            };
            push(normal, sector);
        }
    });
    (normals, of_corner)
}

/// The normal of the little that is left of the faces in a ring.
fn small_normal(ring: SmallRing<3>) -> Vec3 {
    let edges: Vec<DVec3> = ring.settle().edges.into_iter().map(DVec3::from).collect();
    let pairs = edges.windows(2);
    let sum = pairs.fold(DVec3::ZERO, |sum, pair| sum + pair[0].cross(pair[1]));
    sum.normalize_or_zero().as_vec3()
}

/// Successive corners around a vertex.
struct Ring<'t> {
    topology: &'t Topology,
    points: &'t [[f32; 3]],
    corners: Vec<u32>,
}

impl Ring<'_> {
    fn point(&self, corner: u32) -> Vec3 {
        Vec3::from_array(self.points[self.topology.vertex[corner as usize] as usize])
    }

    fn center(&self) -> Vec3 {
        self.point(self.corners[0])
    }

    /// The other end of the edge before face `i`; one more than there are faces.
    fn edge(&self, i: usize) -> Vec3 {
        if i < self.corners.len() {
            self.point(self.topology.next(self.corners[i]))
        } else {
            self.point(self.topology.prev(self.corners[i - 1]))
        }
    }

    /// The vertex across face `i`.
    fn across(&self, i: usize) -> Vec3 {
        let next = self.topology.next(self.corners[i]);
        self.point(self.topology.next(next))
    }

    fn smooth_normal(&self, masks: &[TangentWeights]) -> Vec3 {
        let mut tangents = [Vec3::ZERO; 2];
        for (i, mask) in masks.iter().enumerate() {
            let (edge, across) = (self.edge(i), self.across(i));
            for (tangent, (e, f)) in tangents.iter_mut().zip(mask.edge.iter().zip(&mask.face)) {
                *tangent += *e * edge + *f * across;
            }
        }
        self.or_mean(tangents[0].cross(tangents[1]))
    }

    /// One side of a crease or boundary.
    fn crease_normal(&self, scheme: Scheme) -> Vec3 {
        let ends = self.edge(0) + self.edge(self.corners.len());
        let along = self.edge(0) - self.edge(self.corners.len());
        // Derivatives across regular boundaries, of B-splines and box splines.
        let inward = match (scheme, self.corners.len()) {
            // The limit plane is that of the boundary curve, which is nearly straight.
            (_, 1) => return self.mean_normal(),
            (Scheme::CatmullClark | Scheme::Bilinear, 2) => {
                let across = self.across(0) + self.across(1);
                4.0 * (self.edge(1) - self.center()) - ends + across
            }
            (Scheme::Loop, 3) => 2.0 * (self.edge(1) + self.edge(2) - self.center()) - ends,
            _ => {
                let (topology, points) = (self.topology, self.points);
                let ring = SmallRing::beside_crease(topology, scheme, points, &self.corners);
                return self.or_mean(small_normal(ring));
            }
        };
        self.or_mean(along.cross(inward))
    }

    /// The mean of the faces' normals at their corners.
    fn mean_normal(&self) -> Vec3 {
        let center = self.center();
        let sum = (0..self.corners.len()).fold(Vec3::ZERO, |sum, i| {
            let end = self.point(self.topology.prev(self.corners[i]));
            let normal = (self.edge(i) - center).cross(end - center);
            sum + normal.normalize_or_zero()
        });
        sum.normalize_or_zero()
    }

    fn or_mean(&self, normal: Vec3) -> Vec3 {
        normal.try_normalize().unwrap_or_else(|| self.mean_normal())
    }
}

/// Weights of an edge's end and of the vertex across the face after it, in two tangents.
#[derive(Clone, Copy, Debug)]
struct TangentWeights {
    edge: [f32; 2],
    face: [f32; 2],
}

/// Tangent masks of smooth vertices, made once per valence.
struct TangentMasks {
    scheme: Scheme,
    by_valence: Vec<Vec<TangentWeights>>,
}

impl TangentMasks {
    fn get(&mut self, n: usize) -> &[TangentWeights] {
        if self.by_valence.len() <= n {
            self.by_valence.resize(n + 1, Vec::new());
        }
        if self.by_valence[n].is_empty() {
            self.by_valence[n] = tangent_weights(self.scheme, n);
        }
        &self.by_valence[n]
    }
}

/// Left eigenvectors of the subdominant eigenvalue (Loop 1987; Halstead et al. 1993).
fn tangent_weights(scheme: Scheme, n: usize) -> Vec<TangentWeights> {
    let theta = TAU / n as f64;
    let edge_weight = match scheme {
        Scheme::Loop => 1.0,
        Scheme::CatmullClark | Scheme::Bilinear => {
            let half = (0.5 * theta).cos();
            1.0 + theta.cos() + half * (2.0 * (9.0 + theta.cos())).sqrt()
        }
    };
    let face_weight = if scheme == Scheme::Loop { 0.0 } else { 1.0 };
    let at = |i: usize| (i as f64 * theta).sin_cos();
    (0..n)
        .map(|i| {
            let ((sin, cos), (next_sin, next_cos)) = (at(i), at(i + 1));
            TangentWeights {
                edge: [cos, sin].map(|x| (edge_weight * x) as f32),
                face: [cos + next_cos, sin + next_sin].map(|x| (face_weight * x) as f32),
            }
        })
        .collect()
}
