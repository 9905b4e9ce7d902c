use crate::tokens::{Scheme, TriangleRule};

use super::limit::limit;
use super::normals::limit_normals;
use super::rules::{VertexRules, vertex_rules};
use super::smooth::{refine, refine_linear};
use super::split::{ChildVertices, split};
use super::topology::Topology;

/// Data at the vertices of a topology.
#[derive(Clone, Debug)]
pub(crate) struct Values {
    /// Floats per value, 1 to 4.
    pub(crate) width: usize,
    /// Whether values stay linear between the vertices of the cage.
    pub(crate) is_linear: bool,
    pub(crate) data: Vec<f32>,
}

/// What refinement to do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refinement {
    pub(crate) scheme: Scheme,
    pub(crate) triangle_rule: TriangleRule,
    pub(crate) level: u32,
}

/// A cage after refinement.
pub(crate) struct Refined {
    /// At the level asked for; one level on from level 0.
    pub(crate) topology: Topology,
    /// On the limit surface; of the cage's own vertices at level 0.
    pub(crate) values: Vec<Values>,
    /// Distinct limit normals of the first values, and which one each corner of the topology has.
    pub(crate) normals: Option<(Vec<[f32; 3]>, Vec<u32>)>,
}

impl Refinement {
    /// Refines and moves to the limit. Level 0 goes to level 1 and back to the cage's vertices:
    /// limit masks need quads.
    pub(crate) fn run(
        self,
        cage: Topology,
        mut values: Vec<Values>,
        with_normals: bool,
    ) -> Refined {
        let first_kept = if self.level == 0 {
            ChildVertices::new(&cage, self.scheme).vertices
        } else {
            0
        };
        let mut topology = cage;
        for _ in 0..self.level.max(1) {
            let rules = vertex_rules(&topology);
            for channel in &mut values {
                self.refine(&topology, &rules, channel);
            }
            topology = split(&topology, self.scheme);
        }
        let rules = vertex_rules(&topology);
        let normals = (with_normals && self.scheme != Scheme::Bilinear).then(|| {
            let (points, _) = values[0].data.as_chunks::<3>();
            limit_normals(&topology, &rules, self.scheme, points)
        });
        for channel in &mut values {
            if !channel.is_linear {
                self.move_to_limit(&topology, &rules, channel);
            }
            channel.data.drain(..first_kept * channel.width);
        }
        Refined {
            topology,
            values,
            normals,
        }
    }

    /// The corner of the next level at a corner of the cage.
    pub(crate) fn first_child(self, corner: usize) -> usize {
        match self.scheme {
            Scheme::Loop => 3 * (4 * (corner / 3) + corner % 3),
            Scheme::CatmullClark | Scheme::Bilinear => 4 * corner,
        }
    }

    fn refine(self, topology: &Topology, rules: &[VertexRules], values: &mut Values) {
        match values.width {
            1 => self.refine_width::<1>(topology, rules, values),
            2 => self.refine_width::<2>(topology, rules, values),
            3 => self.refine_width::<3>(topology, rules, values),
            _ => self.refine_width::<4>(topology, rules, values),
        }
    }

    fn refine_width<const W: usize>(
        self,
        topology: &Topology,
        rules: &[VertexRules],
        values: &mut Values,
    ) {
        let (old, _) = values.data.as_chunks::<W>();
        let new = if values.is_linear {
            refine_linear(topology, self.scheme, old)
        } else {
            refine(topology, rules, self.scheme, self.triangle_rule, old)
        };
        values.data = new.into_flattened();
    }

    fn move_to_limit(self, topology: &Topology, rules: &[VertexRules], values: &mut Values) {
        match values.width {
            1 => self.limit_width::<1>(topology, rules, values),
            2 => self.limit_width::<2>(topology, rules, values),
            3 => self.limit_width::<3>(topology, rules, values),
            _ => self.limit_width::<4>(topology, rules, values),
        }
    }

    fn limit_width<const W: usize>(
        self,
        topology: &Topology,
        rules: &[VertexRules],
        values: &mut Values,
    ) {
        let (old, _) = values.data.as_chunks::<W>();
        values.data = limit(topology, rules, self.scheme, old).into_flattened();
    }
}
