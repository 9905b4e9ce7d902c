use kilauea_math::Bounds3;
use serde::{Deserialize, Serialize};

use crate::Visibility;
use crate::attribute::{Attribute, n_bytes};
use crate::points::around_balls;

/// Curves with one material, cut into segments that share control points.
///
/// Points are in the space of the chunk's prototype, relative to [`crate::Prototype::center`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvesChunk {
    /// Index of the source prim in [`crate::Scene::prim_paths`]: the primId.
    pub prim_idx: u32,
    /// Index into [`crate::Scene::materials`].
    pub material: u32,
    /// `n_points` control points, at the first motion key.
    pub points: Vec<[f32; 3]>,
    /// The control points at the later motion keys, evenly spaced over the shutter and linear in
    /// between; empty where the curves stand still.
    pub later_points: Vec<Vec<[f32; 3]>>,
    /// `n_points` radii, in between by the same basis as the points.
    pub radii: Vec<f32>,
    /// `n_points` unit normals of an oriented ribbon.
    pub normals: Option<Vec<[f32; 3]>>,
    /// The first control point of each segment.
    pub segments: Vec<u32>,
    /// What a segment is.
    pub basis: CurveBasis,
    /// Cross-section.
    pub profile: CurveProfile,
    /// Only the primvars that the material reads.
    pub attributes: Vec<Attribute>,
    /// Which rays meet the curves.
    pub visibility: Visibility,
}

/// Polynomial basis of a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CurveBasis {
    /// Two control points.
    #[default]
    Linear,
    /// Four control points of a cubic Bézier curve.
    Bezier,
}

impl CurveBasis {
    /// Control points of a segment.
    pub fn n_points(self) -> usize {
        match self {
            Self::Linear => 2,
            Self::Bezier => 4,
        }
    }
}

/// Cross-section of curves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CurveProfile {
    /// A tube.
    #[default]
    Round,
    /// Flat: turned toward the ray, or across [`CurvesChunk::normals`] where there are any.
    Ribbon,
}

impl CurvesChunk {
    /// The box around all segments at all times.
    pub fn bounds(&self) -> Bounds3 {
        let keys = std::iter::once(&self.points).chain(&self.later_points);
        around_balls(keys, &self.radii)
    }

    /// As [`crate::MeshChunk::husk`].
    #[must_use]
    pub fn husk(&self) -> Self {
        Self {
            points: Vec::new(),
            later_points: vec![Vec::new(); self.later_points.len()],
            radii: Vec::new(),
            normals: self.normals.as_ref().map(|_| Vec::new()),
            segments: Vec::new(),
            attributes: self.attributes.iter().map(Attribute::husk).collect(),
            ..*self
        }
    }

    /// Bytes held by the arrays.
    pub fn n_bytes(&self) -> usize {
        let later: usize = self.later_points.iter().map(Vec::len).sum();
        let normals = self.normals.as_ref().map_or(0, Vec::len);
        12 * (self.points.len() + later + normals)
            + 4 * (self.radii.len() + self.segments.len())
            + n_bytes(&self.attributes)
    }
}
