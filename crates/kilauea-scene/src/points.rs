use kilauea_math::{Bounds3, Vec3};
use serde::{Deserialize, Serialize};

use crate::Visibility;
use crate::attribute::{Attribute, n_bytes};

/// Points with one material, each a sphere.
///
/// Centers are in the space of the chunk's prototype, relative to [`crate::Prototype::center`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointsChunk {
    /// Index of the source prim in [`crate::Scene::prim_paths`]: the primId.
    pub prim_idx: u32,
    /// Index into [`crate::Scene::materials`].
    pub material: u32,
    /// `n_points` centers, at the first motion key.
    pub centers: Vec<[f32; 3]>,
    /// The centers at the later motion keys, evenly spaced over the shutter and linear in between;
    /// empty where the points stand still.
    pub later_centers: Vec<Vec<[f32; 3]>>,
    /// `n_points` radii.
    pub radii: Vec<f32>,
    /// Only the primvars that the material reads.
    pub attributes: Vec<Attribute>,
    /// Which rays meet the points.
    pub visibility: Visibility,
}

impl PointsChunk {
    /// The box around all spheres at all times.
    pub fn bounds(&self) -> Bounds3 {
        let keys = std::iter::once(&self.centers).chain(&self.later_centers);
        around_balls(keys, &self.radii)
    }

    /// As [`crate::MeshChunk::husk`].
    #[must_use]
    pub fn husk(&self) -> Self {
        Self {
            centers: Vec::new(),
            later_centers: vec![Vec::new(); self.later_centers.len()],
            radii: Vec::new(),
            attributes: self.attributes.iter().map(Attribute::husk).collect(),
            ..*self
        }
    }

    /// Bytes held by the arrays.
    pub fn n_bytes(&self) -> usize {
        let later: usize = self.later_centers.iter().map(Vec::len).sum();
        12 * (self.centers.len() + later) + 4 * self.radii.len() + n_bytes(&self.attributes)
    }
}

/// The box around balls with those radii, at each of the keys.
pub(crate) fn around_balls<'a>(
    keys: impl Iterator<Item = &'a Vec<[f32; 3]>>,
    radii: &[f32],
) -> Bounds3 {
    let balls = keys.flat_map(|centers| centers.iter().zip(radii));
    balls.fold(Bounds3::EMPTY, |mut bounds, (&center, &radius)| {
        let center = Vec3::from_array(center);
        bounds.include(center - radius);
        bounds.include(center + radius);
        bounds
    })
}
