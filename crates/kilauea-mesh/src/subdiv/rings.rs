//! Limits where no closed form holds: where a crease ends, and beside a crease with an unusual
//! number of faces. The faces around the vertex are refined until they are small instead.

use crate::tokens::Scheme;

use super::neighbours::loop_beta;
use super::rules::VertexRules;
use super::topology::Topology;

/// Refinements of a ring. Each halves it, roughly.
const N_STEPS: usize = 32;

/// Puts the limit values of darts into `limits`.
pub(crate) fn limit_darts<const W: usize>(
    topology: &Topology,
    rules: &[VertexRules],
    scheme: Scheme,
    values: &[[f32; W]],
    limits: &mut [[f32; W]],
) {
    let is_dart = |v: usize| rules[v].is_dart(topology.vertex_sharpness[v]);
    if !(0..topology.n_vertices).any(is_dart) {
        return;
    }
    topology.for_each_fan(|fan, is_closed| {
        let v = topology.vertex[fan[0] as usize] as usize;
        if is_closed && is_dart(v) {
            let settled = SmallRing::around_dart(topology, scheme, values, fan).settle();
            limits[v] = settled.center.map(|x| x as f32);
        }
    });
}

/// The neighbours of a vertex relative to it, counter-clockwise: all of them from the end of a
/// crease on, or those on one side of a crease from its one edge to its other.
pub(crate) struct SmallRing<const W: usize> {
    scheme: Scheme,
    center: [f64; W],
    /// Other ends of the edges; one more than there are faces beside a crease.
    pub(crate) edges: Vec<[f64; W]>,
    /// Vertices across the faces, each after the edge of its number.
    faces: Vec<[f64; W]>,
}

impl<const W: usize> SmallRing<W> {
    /// `fan` is closed and has one sharp edge.
    pub(crate) fn around_dart(
        topology: &Topology,
        scheme: Scheme,
        values: &[[f32; W]],
        fan: &[u32],
    ) -> Self {
        let sharpness = |&c: &u32| topology.edge_sharpness[topology.edge[c as usize] as usize];
        let first = fan.iter().position(|c| sharpness(c) > 0.0).unwrap_or(0);
        let mut turned = fan.to_vec();
        turned.rotate_left(first);
        let mut ring = Self::beside_crease(topology, scheme, values, &turned);
        ring.edges.pop();
        ring
    }

    /// `sector` lies between two sharp edges.
    pub(crate) fn beside_crease(
        topology: &Topology,
        scheme: Scheme,
        values: &[[f32; W]],
        sector: &[u32],
    ) -> Self {
        let center = values[topology.vertex[sector[0] as usize] as usize].map(f64::from);
        let offset = |corner: u32| {
            let value = values[topology.vertex[corner as usize] as usize];
            std::array::from_fn(|i| f64::from(value[i]) - center[i])
        };
        let next = sector.iter().map(|&c| topology.next(c));
        let last = topology.prev(sector[sector.len() - 1]);
        Self {
            scheme,
            center,
            edges: next.clone().chain([last]).map(offset).collect(),
            faces: next.map(|c| offset(topology.next(c))).collect(),
        }
    }

    /// The ring at the limit, blown up to about its first size.
    pub(crate) fn settle(mut self) -> Self {
        let mut scale = 1.0;
        for _ in 0..N_STEPS {
            let moved = match self.scheme {
                Scheme::Loop => self.step_loop(),
                Scheme::CatmullClark | Scheme::Bilinear => self.step_catmull_clark(),
            };
            for (center, moved) in self.center.iter_mut().zip(moved) {
                *center += scale * moved;
            }
            scale *= 0.5;
            for value in self.edges.iter_mut().chain(&mut self.faces) {
                *value = std::array::from_fn(|i| 2.0 * (value[i] - moved[i]));
            }
        }
        self
    }

    /// Whether the ring is one side of a crease.
    fn is_open(&self) -> bool {
        self.edges.len() > self.faces.len()
    }

    /// Whether an edge is part of the crease.
    fn is_sharp(&self, edge: usize) -> bool {
        edge == 0 || edge == self.faces.len()
    }

    /// One refinement; where the vertex goes.
    fn step_catmull_clark(&mut self) -> [f64; W] {
        let n = self.edges.len();
        let old = self.edges.clone();
        for (k, face) in self.faces.iter_mut().enumerate() {
            *face = std::array::from_fn(|i| 0.25 * (old[k][i] + face[i] + old[(k + 1) % n][i]));
        }
        let moved = |k: usize| {
            std::array::from_fn(|i| {
                if self.is_sharp(k) {
                    0.5 * old[k][i]
                } else {
                    0.25 * (old[k][i] + self.faces[k - 1][i] + self.faces[k][i])
                }
            })
        };
        self.edges = (0..n).map(moved).collect();
        let sum = |ring: &[[f64; W]], i: usize| ring.iter().map(|v| v[i]).sum::<f64>();
        std::array::from_fn(|i| {
            if self.is_open() {
                0.125 * (old[0][i] + old[n - 1][i])
            } else {
                (sum(&old, i) + sum(&self.faces, i)) / (n * n) as f64
            }
        })
    }

    /// One refinement; where the vertex goes.
    fn step_loop(&mut self) -> [f64; W] {
        let n = self.edges.len();
        let old = self.edges.clone();
        let moved = |k: usize| {
            std::array::from_fn(|i| {
                if self.is_sharp(k) {
                    0.5 * old[k][i]
                } else {
                    0.375 * old[k][i] + 0.125 * (old[k - 1][i] + old[(k + 1) % n][i])
                }
            })
        };
        self.edges = (0..n).map(moved).collect();
        std::array::from_fn(|i| {
            if self.is_open() {
                0.125 * (old[0][i] + old[n - 1][i])
            } else {
                f64::from(loop_beta(n as u32)) * old.iter().map(|v| v[i]).sum::<f64>()
            }
        })
    }
}
