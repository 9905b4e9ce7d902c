//! The records that geometry arrives in. Arrays are borrowed, so that they can lie in the buffers
//! of whoever holds them.

use kilauea_math::DAffine3;
use kilauea_scene::{Camera, Light, Material, TextureSource, Visibility};

use crate::tokens::{
    Axis, BoundaryInterpolation, CubicBasis, CurveType, CurveWrap, FaceVaryingRule, ImplicitKind,
    PrimvarInterpolation, Scheme, TriangleRule,
};

/// A primvar, or the normals of a mesh.
#[derive(Clone, Debug)]
pub struct Primvar<'a> {
    /// Without the `primvars:` prefix.
    pub name: &'a str,
    /// Floats per value, 1 to 4.
    pub width: u8,
    /// What the values belong to.
    pub interpolation: PrimvarInterpolation,
    /// `n_values * width` floats.
    pub values: &'a [f32],
    /// Which value belongs to each element; in order when absent.
    pub indices: Option<&'a [i32]>,
}

/// Faces of a mesh with a material of their own (UsdGeomSubset).
#[derive(Clone, Debug)]
pub struct Subset<'a> {
    /// Face indices.
    pub faces: &'a [i32],
    /// Index into [`Payloads::materials`].
    pub material: u32,
}

/// Subdivision attributes of UsdGeomMesh.
#[derive(Clone, Debug)]
pub struct Subdivision<'a> {
    /// The surface's kind.
    pub scheme: Scheme,
    /// What happens at boundaries.
    pub interpolate_boundary: BoundaryInterpolation,
    /// What happens to face-varying data at seams.
    pub face_varying_linear_interpolation: FaceVaryingRule,
    /// Weights at triangles.
    pub triangle_rule: TriangleRule,
    /// Point indices of all creases, one crease after the other.
    pub crease_indices: &'a [i32],
    /// Points in each crease.
    pub crease_lengths: &'a [i32],
    /// One per crease, or one per edge of each crease; 10 and more is infinitely sharp.
    pub crease_sharpnesses: &'a [f32],
    /// Point indices of corners.
    pub corner_indices: &'a [i32],
    /// One per corner.
    pub corner_sharpnesses: &'a [f32],
}

/// A polygon mesh or a subdivision cage, placed in a prototype.
#[derive(Clone, Debug)]
pub struct PolyMesh<'a> {
    /// Source prim.
    pub path: &'a str,
    /// Index into [`Payloads::prototypes`].
    pub prototype: u32,
    /// From the points' space to the prototype's.
    pub prototype_from_mesh: DAffine3,
    /// `n_points` points.
    pub points: &'a [[f32; 3]],
    /// Corners of each face.
    pub face_vertex_counts: &'a [i32],
    /// Point index of each corner, face after face.
    pub face_vertex_indices: &'a [i32],
    /// Faces that are not drawn.
    pub hole_indices: &'a [i32],
    /// Whether faces are wound clockwise as seen from the outside.
    pub left_handed: bool,
    /// Whether the back side may be seen.
    pub double_sided: bool,
    /// Shading normals of a polygon mesh, width 3; faceted when absent.
    pub normals: Option<Primvar<'a>>,
    /// Only those that a bound material reads.
    pub primvars: Vec<Primvar<'a>>,
    /// Present on subdivision cages; `normals` are not read then.
    pub subdivision: Option<Subdivision<'a>>,
    /// Material of faces that are in no subset; index into [`Payloads::materials`].
    pub material: u32,
    /// Faces with other materials.
    pub subsets: Vec<Subset<'a>>,
    /// The mesh at the motion keys after the first, evenly spaced over the shutter; empty where it
    /// stands still.
    pub later_keys: Vec<MeshPose<'a>>,
    /// Which rays meet it.
    pub visibility: Visibility,
}

/// What of a mesh moves.
#[derive(Clone, Debug)]
pub struct MeshPose<'a> {
    /// As many points as the mesh has.
    pub points: &'a [[f32; 3]],
    /// Laid out as the mesh's normals; those of the first key when absent.
    pub normals: Option<Primvar<'a>>,
}

/// A shape given by a formula, centred, placed in a prototype.
#[derive(Clone, Debug)]
pub struct ImplicitShape<'a> {
    /// Source prim.
    pub path: &'a str,
    /// Index into [`Payloads::prototypes`].
    pub prototype: u32,
    /// From the shape's space to the prototype's.
    pub prototype_from_mesh: DAffine3,
    /// The formula.
    pub kind: ImplicitKind,
    /// Spine or normal.
    pub axis: Axis,
    /// Sphere (radius, 0, 0); Cube (size, 0, 0); Cylinder and Capsule (radius at −axis, radius at
    /// +axis, height); Cone (radius, 0, height); Plane (width, length, 0).
    pub dimensions: [f64; 3],
    /// Index into [`Payloads::materials`].
    pub material: u32,
    /// Has no effect: the formula tells outside from inside.
    pub left_handed: bool,
    /// Whether the back side may be seen.
    pub double_sided: bool,
    /// Constant ones only.
    pub primvars: Vec<Primvar<'a>>,
    /// Which rays meet it.
    pub visibility: Visibility,
}

/// Curves by the rules of UsdGeomBasisCurves, placed in a prototype.
#[derive(Clone, Debug)]
pub struct BasisCurves<'a> {
    /// Source prim.
    pub path: &'a str,
    /// Index into [`Payloads::prototypes`].
    pub prototype: u32,
    /// From the points' space to the prototype's.
    pub prototype_from_curves: DAffine3,
    /// The points of all curves, one curve after the other.
    pub points: &'a [[f32; 3]],
    /// The points at the motion keys after the first, evenly spaced over the shutter; empty where
    /// they stand still.
    pub later_points: Vec<&'a [[f32; 3]]>,
    /// Points of each curve.
    pub curve_vertex_counts: &'a [i32],
    /// Straight or cubic.
    pub curve_type: CurveType,
    /// Of cubic curves.
    pub basis: CubicBasis,
    /// What happens at the ends.
    pub wrap: CurveWrap,
    /// Diameters, width 1; one everywhere when absent.
    pub widths: Option<Primvar<'a>>,
    /// Makes oriented ribbons of the curves, width 3; tubes when absent.
    pub normals: Option<Primvar<'a>>,
    /// Only those that the material reads.
    pub primvars: Vec<Primvar<'a>>,
    /// Index into [`Payloads::materials`].
    pub material: u32,
    /// Which rays meet them.
    pub visibility: Visibility,
}

/// Points by the rules of UsdGeomPoints, each a sphere, placed in a prototype.
#[derive(Clone, Debug)]
pub struct Points<'a> {
    /// Source prim.
    pub path: &'a str,
    /// Index into [`Payloads::prototypes`].
    pub prototype: u32,
    /// From the points' space to the prototype's.
    pub prototype_from_points: DAffine3,
    /// Centers.
    pub points: &'a [[f32; 3]],
    /// The centers at the motion keys after the first, evenly spaced over the shutter; empty where
    /// they stand still.
    pub later_points: Vec<&'a [[f32; 3]]>,
    /// Diameters, width 1; one everywhere when absent.
    pub widths: Option<Primvar<'a>>,
    /// Only those that the material reads.
    pub primvars: Vec<Primvar<'a>>,
    /// Index into [`Payloads::materials`].
    pub material: u32,
    /// Which rays meet them.
    pub visibility: Visibility,
}

/// A prototype placed many times inside another.
#[derive(Clone, Debug)]
pub struct InstancesPayload<'a> {
    /// Source prim of the instancer.
    pub path: &'a str,
    /// The prototype that holds them; 0 for the world.
    pub parent: u32,
    /// The prototype that is placed.
    pub prototype: u32,
    /// One per instance, at the first motion key.
    pub parent_from_prototype: Vec<DAffine3>,
    /// The same at the motion keys after the first, evenly spaced over the shutter; empty where
    /// they stand still.
    pub later_parent_from_prototype: Vec<Vec<DAffine3>>,
    /// One value per instance, or constant; they stand in for primvars of that name inside.
    pub primvars: Vec<Primvar<'a>>,
    /// Which rays meet them, as far as their contents let them.
    pub visibility: Visibility,
}

/// A whole frame of geometry, and the records that pass through unchanged.
#[derive(Clone, Debug)]
pub struct Payloads<'a> {
    /// Prim path of each prototype; entry 0 is the world.
    pub prototypes: Vec<String>,
    /// Polygon meshes and subdivision cages.
    pub meshes: Vec<PolyMesh<'a>>,
    /// Shapes given by a formula.
    pub implicits: Vec<ImplicitShape<'a>>,
    /// Curves.
    pub curves: Vec<BasisCurves<'a>>,
    /// Points.
    pub points: Vec<Points<'a>>,
    /// Placements of prototypes.
    pub instances: Vec<InstancesPayload<'a>>,
    /// Passed on.
    pub materials: Vec<Material>,
    /// Passed on.
    pub textures: Vec<TextureSource>,
    /// Passed on.
    pub lights: Vec<Light>,
    /// Passed on; also decides how finely surfaces are tessellated.
    pub camera: Camera,
}
