use kilauea_math::DAffine3;
use kilauea_mesh::{BasisCurves, CubicBasis, CurveType, CurveWrap, Primvar, PrimvarInterpolation};
use kilauea_scene::Visibility;

/// Curves of one material that own their arrays.
#[derive(Clone, Debug)]
pub struct Curves {
    /// Placement in the world.
    pub world_from_curves: DAffine3,
    /// The points of all curves.
    pub points: Vec<[f32; 3]>,
    /// Points at the later motion keys.
    pub later_points: Vec<Vec<[f32; 3]>>,
    /// Points of each curve.
    pub counts: Vec<i32>,
    /// Straight, or cubic B-splines pinned to their ends.
    pub curve_type: CurveType,
    /// One diameter for all.
    pub width: [f32; 1],
    /// One normal for all, which makes ribbons of them.
    pub normal: Option<[f32; 3]>,
    /// Index into [`crate::Stage::materials`].
    pub material: u32,
}

impl Curves {
    /// One curve through points, round, with the first material.
    pub fn new(curve_type: CurveType, points: &[[f32; 3]], width: f32) -> Self {
        Self {
            world_from_curves: DAffine3::IDENTITY,
            points: points.to_vec(),
            later_points: Vec::new(),
            counts: vec![points.len() as i32],
            curve_type,
            width: [width],
            normal: None,
            material: 0,
        }
    }

    pub(crate) fn payload(&self) -> BasisCurves<'_> {
        let constant = |name, values| Primvar {
            name,
            width: if name == "normals" { 3 } else { 1 },
            interpolation: PrimvarInterpolation::Constant,
            values,
            indices: None,
        };
        BasisCurves {
            path: "/Curves",
            prototype: 0,
            prototype_from_curves: self.world_from_curves,
            points: &self.points,
            later_points: self.later_points.iter().map(Vec::as_slice).collect(),
            curve_vertex_counts: &self.counts,
            curve_type: self.curve_type,
            basis: CubicBasis::Bspline,
            wrap: CurveWrap::Pinned,
            widths: Some(constant("widths", &self.width)),
            normals: self.normal.as_ref().map(|n| constant("normals", n)),
            primvars: Vec::new(),
            material: self.material,
            visibility: Visibility::ALL,
        }
    }
}
