use kilauea_math::DAffine3;

/// Positions and vertex indices of a mesh.
pub type MeshSlices<'a> = (&'a [[f32; 3]], &'a [[u32; 3]]);

/// The triangle meshes of one prototype.
#[derive(Clone, Debug, Default)]
pub struct Geometry<'a> {
    /// The chunks of the prototype. Triangle ids count through them in order.
    pub meshes: Vec<MeshSlices<'a>>,
}

/// A geometry put into the engine's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Index into the geometries.
    pub geometry: u32,
    /// Takes positions of the geometry to engine space; may mirror.
    pub world_from_geometry: DAffine3,
}

/// How much time a build may take for faster rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// A fast build for interactive changes.
    Preview,
    /// The tree with the lowest expected ray cost.
    #[default]
    Final,
}

/// Choices of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// Build time against ray cost.
    pub quality: Quality,
    /// Whether vector instructions may be used where the processor has them. The hits are the
    /// same either way.
    pub simd: bool,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            quality: Quality::Final,
            simd: true,
        }
    }
}
