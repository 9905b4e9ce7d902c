//! Primitives beyond triangles, each intersected in `f64`.
//!
//! In the frame of a ray (its line along z through x = y = 0) a ball of radius r at (x, y, z)
//! covers the depths from z - √h to z + √h where h = r² - x² - y² is not negative. A round curve
//! is the union of the balls along it, so everything here is about two polynomials of the curve's
//! parameter u: depth z(u) and h(u).
//!
//! Distances are exact to a few units of 1e-15 of the distance from the ray's origin to the
//! primitive, plus, for cubic curves, 1e-9 of the radius; rounding the result to `f32` outweighs
//! both.

mod bernstein;
mod bezier;
mod linear;
#[cfg(test)]
mod oracle;
mod ray_frame;
mod ribbon;
mod round;
mod segment;
mod sphere;

pub(crate) use ray_frame::RayFrame;
pub(crate) use segment::{CurveShape, Piece, Segment};
pub(crate) use sphere::Sphere;
