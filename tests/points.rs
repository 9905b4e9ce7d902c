use kilauea_math::DAffine3;
use kilauea_mesh::{Points as PointsPayload, Primvar, PrimvarInterpolation};
use kilauea_scene::Visibility;

/// Points of one material that own their arrays.
#[derive(Clone, Debug)]
pub struct Points {
    /// Index of the prototype that holds them; 0 is the world.
    pub prototype: u32,
    /// Placement in the prototype.
    pub prototype_from_points: DAffine3,
    /// Centers.
    pub points: Vec<[f32; 3]>,
    /// Centers at the later motion keys.
    pub later_points: Vec<Vec<[f32; 3]>>,
    /// One diameter per point.
    pub widths: Vec<f32>,
    /// Index into [`crate::Stage::materials`].
    pub material: u32,
}

impl Points {
    /// Points of one width, with the first material.
    pub fn new(points: &[[f32; 3]], width: f32) -> Self {
        Self {
            prototype: 0,
            prototype_from_points: DAffine3::IDENTITY,
            points: points.to_vec(),
            later_points: Vec::new(),
            widths: vec![width; points.len()],
            material: 0,
        }
    }

    pub(crate) fn payload(&self) -> PointsPayload<'_> {
        PointsPayload {
            path: "/Points",
            prototype: self.prototype,
            prototype_from_points: self.prototype_from_points,
            points: &self.points,
            later_points: self.later_points.iter().map(Vec::as_slice).collect(),
            widths: Some(Primvar {
                name: "widths",
                width: 1,
                interpolation: PrimvarInterpolation::Vertex,
                values: &self.widths,
                indices: None,
            }),
            primvars: Vec::new(),
            material: self.material,
            visibility: Visibility::ALL,
        }
    }
}
