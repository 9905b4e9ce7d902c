//! Weights of caustic photons against other ways to make the same path.
//!
//! A caustic photon has gone from a light y₀ over near-specular surfaces y₁ … yₖ₋₁ to a rough one,
//! x = yₖ, and an eye path has x as a rough vertex. Three strategies make that path:
//!
//! - *merging*: the photon lies within the radius around x. Its density is the eye's for x times
//!   η p_L, where η = N π r² for N emitted paths, and p_L is the density of the light path in area;
//! - *hitting*: from x the eye path goes on by sampling BSDFs until it meets the light;
//! - *connecting*: the same up to y₁, where the light is sampled (next-event estimation).
//!
//! The balance heuristic (Veach 1997, §9.2) needs ratios of these densities. In them the squared
//! distances cancel, since the two directions of an edge share them, and what remains is a product
//! over edges (j, j+1) of
//!
//! ```text
//! p(yⱼ₊₁ → yⱼ) cos θⱼ / (p(yⱼ → yⱼ₊₁) cos θⱼ₊₁)
//! ```
//!
//! with densities over solid angle and the cosines of the edge at its ends, divided by the density
//! of y₀. For a light at infinity y₀ is a direction, and the density of y₁ is that of the disc
//! through which its light enters, so that cos θ₀ is 1. One number, updated at each vertex,
//! therefore suffices on either side: it is what dVCM and dVM of Georgiev (2012, "Implementing Vertex
//! Connection and Merging") become when only these three strategies compete. [`LightSubpath`]
//! multiplies from the light to x, [`EyeSubpath`] from x to the light.
//!
//! The weights of a path sum to one if both sides use one function for each density, with Russian
//! roulette within both or in neither. A perfectly specular vertex has the same discrete probability
//! in both directions; both densities are then passed as that, and nothing connects there.

mod edges;
mod eye_subpath;
mod light_subpath;
#[cfg(test)]
mod tests;
mod weights;

pub use eye_subpath::EyeSubpath;
pub use light_subpath::LightSubpath;
pub use weights::Merging;
