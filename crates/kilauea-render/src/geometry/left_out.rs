//! What no ray can hit, counted by prim.

use std::collections::{BTreeMap, BTreeSet};

use kilauea_accel as accel;
use kilauea_scene::Scene;

use super::placed::Placed;

/// How many prims a line names.
const MAX_PRIMS: usize = 10;

/// What the tree leaves out.
pub(super) struct LeftOut {
    /// Primitives and placements.
    n_all: usize,
    /// Degenerate triangles by prim.
    triangles: BTreeMap<u32, usize>,
}

impl LeftOut {
    /// Looks for degenerate triangles only where the tree says that it left something out.
    pub(super) fn of(
        tree: &accel::Accel,
        geometries: &[accel::Geometry<'_>],
        placements: &[Placed],
        scene: &Scene,
    ) -> Self {
        let n_all = tree.n_rejected();
        let mut triangles = BTreeMap::new();
        if n_all > 0 {
            let placed: BTreeSet<u32> = placements.iter().map(|p| p.prototype).collect();
            for prototype in placed.into_iter().map(|p| p as usize) {
                let meshes = geometries[prototype].meshes.iter();
                for (chunk, mesh) in scene.prototypes[prototype].chunks.iter().zip(meshes) {
                    *triangles.entry(chunk.prim_idx).or_insert(0) += mesh.n_degenerate();
                }
            }
            triangles.retain(|_, n| *n > 0);
        }
        Self { n_all, triangles }
    }

    /// Names the first prims; none where nothing is left out.
    pub(super) fn line(&self, scene: &Scene) -> Option<String> {
        if self.n_all == 0 {
            return None;
        }
        let named = self.triangles.iter().take(MAX_PRIMS);
        let mut named: Vec<String> = named
            .map(|(&prim, n)| format!("{} {n}", scene.prim_path(prim)))
            .collect();
        let n_more = self.triangles.len() - named.len();
        if n_more > 0 {
            named.push(format!("and {n_more} more prims"));
        }
        let triangles = match &named[..] {
            [] => String::new(),
            _ => format!(
                "; triangles without area or out of range: {}",
                named.join(", ")
            ),
        };
        let n = self.n_all;
        Some(format!(
            "{n} degenerate surfaces or placements were left out{triangles}"
        ))
    }
}
