//! BSDFs as Monte Carlo needs them: what is drawn has the density stated for it, carries the light
//! that the value says, and adds up to no more than what comes in.

#![forbid(unsafe_code)]

mod density;
mod energy;
mod faults;
mod laws;
mod mirrors;
mod reciprocity;
mod surfaces;
