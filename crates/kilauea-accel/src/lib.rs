//! Ray acceleration: trees over triangles, spheres, curves and instances, still or moving, and the
//! kernels that walk them.
//!
//! Binary trees, which `obvhs` improves, become nodes of eight boxes and leaves of up to eight
//! triangles. This crate traces them with its own kernels, AVX2 where the processor has it. Both
//! give the same hits, bit for bit: which hit wins depends on distance, instance and primitive
//! alone. So do any two trees over the same primitives, but for lines that pass a silhouette so
//! close that rounding decides.
//!
//! ```
//! use kilauea_accel::{Accel, BuildOptions, Geometry, Mesh, Placement, Ray};
//! use kilauea_math::{DAffine3, Vec3};
//!
//! let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let mesh = Mesh::still(&positions, &[[0, 1, 2]]);
//! let geometry = Geometry { meshes: vec![mesh], ..Geometry::default() };
//! let placement = Placement::still(0, DAffine3::IDENTITY);
//! let accel = Accel::build(&[geometry], &[placement], &BuildOptions::default());
//!
//! let hit = accel.intersect(&Ray::new(Vec3::new(0.25, 0.5, 1.0), Vec3::NEG_Z)).expect("a hit");
//! assert_eq!((hit.t, hit.u, hit.v), (1.0, 0.25, 0.5));
//! ```

mod accel;
mod block;
mod box_tree;
mod build;
mod forest;
mod geometry;
mod motion;
mod node;
mod primitive;
mod ray;
mod spawn;
mod traverse;
mod validate;
mod visibility;
mod whole;

pub use accel::Accel;
pub use box_tree::BoxTree;
pub use geometry::{
    BuildOptions, CurveBasis, CurveProfile, Curves, Geometry, Mesh, Placement, Spheres,
};
pub use ray::{Hit, PrimitiveId, Ray};
pub use spawn::{PlacementError, SurfacePoint, offset_origin};
pub use visibility::Visibility;
pub use whole::Whole;
