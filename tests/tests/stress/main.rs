//! The whole renderer under inputs that break renderers.
//!
//! What holds for all of them: no NaN gets into a picture, nothing panics, and what is left out is
//! said. Beyond that each test holds its picture to what it must be. `cargo test -p kilauea-tests
//! --test stress -- --nocapture` prints the figures.
#![allow(clippy::print_stdout, reason = "the figures, with --nocapture")]

mod cameras;
mod coplanar;
mod dielectrics;
mod faults;
mod frames;
mod instances;
mod leaks;
mod lights;
mod magnitudes;
mod sky;
mod triangles;
mod white;

/// Prints a figure of a test.
fn report(test: &str, what: impl std::fmt::Display, value: impl std::fmt::Display) {
    println!("{test:<20} {what:<44} {value}");
}
