use kilauea_math::DAffine3;
use kilauea_mesh::{MeshPose, PolyMesh, Primvar, PrimvarInterpolation};
use kilauea_scene::Visibility;

/// A polygon mesh that owns its arrays.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Prim path.
    pub path: String,
    /// Index of the prototype that holds it; 0 is the world.
    pub prototype: u32,
    /// Placement in the prototype.
    pub prototype_from_mesh: DAffine3,
    /// `n_points` points.
    pub points: Vec<[f32; 3]>,
    /// Corners of each face.
    pub counts: Vec<i32>,
    /// Point index of each corner.
    pub indices: Vec<i32>,
    /// Index into [`crate::Stage::materials`].
    pub material: u32,
    /// Primvars.
    pub primvars: Vec<MeshPrimvar>,
    /// Points at the later motion keys.
    pub later_points: Vec<Vec<[f32; 3]>>,
    /// Which rays meet it.
    pub visibility: Visibility,
}

/// A primvar of three floats.
#[derive(Clone, Debug)]
pub struct MeshPrimvar {
    /// Without the `primvars:` prefix.
    pub name: String,
    /// What the values belong to.
    pub interpolation: PrimvarInterpolation,
    /// Three floats per value.
    pub values: Vec<f32>,
}

impl Mesh {
    /// A mesh in the world, with the first material.
    pub fn new(points: Vec<[f32; 3]>, counts: Vec<i32>, indices: Vec<i32>) -> Self {
        Self {
            path: "/Mesh".into(),
            prototype: 0,
            prototype_from_mesh: DAffine3::IDENTITY,
            points,
            counts,
            indices,
            material: 0,
            primvars: Vec::new(),
            later_points: Vec::new(),
            visibility: Visibility::ALL,
        }
    }

    /// One face, seen from where its corners run counter-clockwise.
    pub fn polygon(points: &[[f32; 3]]) -> Self {
        let n = points.len() as i32;
        Self::new(points.to_vec(), vec![n], (0..n).collect())
    }

    /// A square in the plane y = 0, facing up.
    pub fn floor(half_width: f32) -> Self {
        let w = half_width;
        Self::polygon(&[[-w, 0.0, w], [w, 0.0, w], [w, 0.0, -w], [-w, 0.0, -w]])
    }

    /// The cube from −1 to 1, wound outward: faces at −x, +x, −y, +y, −z, +z.
    pub fn cube() -> Self {
        let points = (0..8).map(|i| [i & 1, (i >> 1) & 1, i >> 2].map(|b| 2.0 * b as f32 - 1.0));
        let indices = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        Self::new(points.collect(), vec![4; 6], indices.concat())
    }

    /// One face of [`Self::cube`], as a mesh of its own.
    pub fn cube_face(face: usize) -> Self {
        let mut cube = Self::cube();
        cube.counts.truncate(1);
        cube.indices = cube.indices[4 * face..4 * face + 4].to_vec();
        cube
    }

    /// The same mesh with its inside for its outside.
    #[must_use]
    pub fn inside_out(mut self) -> Self {
        let mut rest = self.indices.as_mut_slice();
        for &count in &self.counts {
            let (face, others) = rest.split_at_mut(count as usize);
            face.reverse();
            rest = others;
        }
        self
    }

    /// The same mesh with another material.
    #[must_use]
    pub fn with_material(self, material: u32) -> Self {
        Self { material, ..self }
    }

    /// The same mesh, placed.
    #[must_use]
    pub fn placed(self, prototype_from_mesh: DAffine3) -> Self {
        Self {
            prototype_from_mesh,
            ..self
        }
    }

    /// The same mesh in a prototype.
    #[must_use]
    pub fn in_prototype(self, prototype: u32) -> Self {
        Self { prototype, ..self }
    }

    /// The same mesh, met by these rays only.
    #[must_use]
    pub fn met_by(self, visibility: Visibility) -> Self {
        Self { visibility, ..self }
    }

    /// The same mesh, shifted by a vector at each later motion key.
    #[must_use]
    pub fn moving(self, shifts: &[[f32; 3]]) -> Self {
        let moved = |shift: &[f32; 3]| {
            let points = self.points.iter();
            points
                .map(|p| std::array::from_fn(|i| p[i] + shift[i]))
                .collect()
        };
        Self {
            later_points: shifts.iter().map(moved).collect(),
            ..self
        }
    }

    pub(crate) fn payload(&self) -> PolyMesh<'_> {
        let primvars = self.primvars.iter().map(|p| Primvar {
            name: &p.name,
            width: 3,
            interpolation: p.interpolation,
            values: &p.values,
            indices: None,
        });
        PolyMesh {
            path: &self.path,
            prototype: self.prototype,
            prototype_from_mesh: self.prototype_from_mesh,
            points: &self.points,
            face_vertex_counts: &self.counts,
            face_vertex_indices: &self.indices,
            hole_indices: &[],
            left_handed: false,
            double_sided: true,
            normals: None,
            primvars: primvars.collect(),
            subdivision: None,
            material: self.material,
            subsets: Vec::new(),
            later_keys: self
                .later_points
                .iter()
                .map(|points| MeshPose {
                    points,
                    normals: None,
                })
                .collect(),
            visibility: self.visibility,
        }
    }
}
