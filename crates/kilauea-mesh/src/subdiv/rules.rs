use super::split::child_sharpness;
use super::topology::Topology;

/// How a vertex moves (DeRose et al. 1998, "Subdivision Surfaces in Character Animation").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rule {
    /// By all its neighbours.
    Smooth,
    /// By its neighbours along two sharp edges.
    Crease,
    /// Not at all.
    Corner,
}

/// The neighbourhood of a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct VertexRules {
    pub(crate) n_edges: u32,
    n_faces: u32,
    n_sharp: u32,
    /// Of the sharp edges, those still sharp one level down.
    n_child_sharp: u32,
    n_fading: u32,
    sharpness_fading: f32,
}

/// Neighbourhoods of all vertices.
pub(crate) fn vertex_rules(topology: &Topology) -> Vec<VertexRules> {
    let mut rules = vec![VertexRules::default(); topology.n_vertices];
    for &v in &topology.vertex {
        rules[v as usize].n_faces += 1;
    }
    for edge in 0..topology.n_edges() {
        let sharpness = topology.edge_sharpness[edge];
        for v in topology.ends(edge) {
            let rule = &mut rules[v as usize];
            rule.n_edges += 1;
            if sharpness > 0.0 {
                rule.n_sharp += 1;
                if child_sharpness(sharpness) > 0.0 {
                    rule.n_child_sharp += 1;
                } else {
                    rule.n_fading += 1;
                    rule.sharpness_fading += sharpness;
                }
            }
        }
    }
    for (rule, &sharpness) in rules.iter_mut().zip(&topology.vertex_sharpness) {
        if sharpness > 0.0 && child_sharpness(sharpness) == 0.0 {
            rule.n_fading += 1;
            rule.sharpness_fading += sharpness;
        }
    }
    rules
}

impl VertexRules {
    /// The rule at this level.
    pub(crate) fn rule(&self, sharpness: f32) -> Rule {
        self.rule_for(sharpness, self.n_sharp)
    }

    /// Whether a crease ends at this vertex, in the middle of smooth faces.
    pub(crate) fn is_dart(&self, sharpness: f32) -> bool {
        self.n_sharp == 1 && self.rule(sharpness) == Rule::Smooth
    }

    fn rule_for(&self, sharpness: f32, n_sharp: u32) -> Rule {
        // Where faces do not close around a vertex, there is no smooth rule.
        let is_disk = self.n_faces == self.n_edges && self.n_edges >= 2;
        match n_sharp {
            _ if sharpness > 0.0 => Rule::Corner,
            0 | 1 if is_disk => Rule::Smooth,
            2 => Rule::Crease,
            _ => Rule::Corner,
        }
    }

    /// Weights of the smooth, crease and corner rules. A vertex whose rule changes within a level
    /// takes both, by the mean of the sharpnesses that fade out.
    pub(crate) fn weights(&self, sharpness: f32) -> [f32; 3] {
        let mut weights = [0.0; 3];
        let now = self.rule_for(sharpness, self.n_sharp);
        let then = self.rule_for(child_sharpness(sharpness), self.n_child_sharp);
        if now == then || self.n_fading == 0 {
            weights[now as usize] = 1.0;
        } else {
            let w = (self.sharpness_fading / self.n_fading as f32).min(1.0);
            weights[now as usize] += w;
            weights[then as usize] += 1.0 - w;
        }
        weights
    }

    /// Whether an edge of this sharpness is one of the two of the crease.
    #[inline]
    pub(crate) fn is_crease_edge(&self, sharpness: f32) -> bool {
        if self.n_sharp == 2 {
            sharpness > 0.0
        } else {
            self.n_child_sharp == 2 && child_sharpness(sharpness) > 0.0
        }
    }
}
