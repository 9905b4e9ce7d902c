//! Statistical tests for code that draws random numbers.
//!
//! Every test ends in a p-value: how often sound code would look as bad as what was seen. A
//! [`Family`] holds all p-values of one question together, so that the number of cases does not
//! decide how often one of them fails by chance. Numbers come from hashes: what holds once holds
//! always.
//!
//! ```
//! use kilauea_math::{Vec2, Vec3, warp};
//! use kilauea_testing::{Directions, Draw, Family, compare, uniforms};
//!
//! let mut family = Family::new("warps");
//! let density = |w: Vec3| f64::from(warp::cosine_hemisphere_pdf(w.z));
//! let draw = |i| {
//!     let [x, y] = uniforms(0, i);
//!     Draw::At(warp::cosine_hemisphere(Vec2::new(x, y)))
//! };
//! let found = compare(&Directions::around(Vec3::Z, 1.5), 10_000, draw, density);
//! family.add("cosine", found.p_value());
//! family.check();
//! ```

#![forbid(unsafe_code)]

mod chi2;
mod density;
mod directions;
mod domain;
mod family;
mod functions;
mod moments;
mod numbers;
mod quadrature;
mod scattering;
mod tile_file;

pub use chi2::Chi2;
pub use density::{Comparison, Draw, compare};
pub use directions::Directions;
pub use domain::{Domain, Rectangle};
pub use family::Family;
pub use functions::{chi2_survival, normal_two_sided, student_two_sided};
pub use moments::{Moments, welch_p};
pub use numbers::uniforms;
pub use quadrature::{integrate, integrate_over};
pub use scattering::{Scatters, Viewed, asymmetry, project};
pub use tile_file::TileFile;
