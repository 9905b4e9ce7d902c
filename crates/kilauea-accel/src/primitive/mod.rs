//! Primitives beyond triangles, each intersected in `f64`.
//!
//! In the frame of a ray (its line along z through x = y = 0) a ball of radius r at (x, y, z)
//! covers the depths from z - √h to z + √h where h = r² - x² - y² is not negative. A round curve
//! is the union of the balls along it, so everything here is about two polynomials of the curve's
//! parameter u: depth z(u) and h(u).
//!
//! Before distances are rounded to `f32`, hits are off their surface by less than 1e-13 of the scene's
//! scale around spheres and 1e-9 of a curve's size, as the tests hold them to; the flat ends of
//! ribbons reach 1e-4 of the radius too far, so that joints have no gaps.

mod bernstein;
mod bezier;
mod capsule;
mod linear;
#[cfg(test)]
mod oracle;
mod ray_frame;
mod ribbon;
mod round;
mod segment;
mod sphere;

pub(crate) use capsule::Capsule;
pub(crate) use ray_frame::RayFrame;
pub(crate) use segment::{CurveShape, Piece, Segment};
pub(crate) use sphere::Sphere;
