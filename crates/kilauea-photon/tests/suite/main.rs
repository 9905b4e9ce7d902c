//! What holds of photon maps as others use them.

mod density;
mod hostile;
mod invariance;
mod oracle;
mod partial;
mod photons;
mod progressive;
mod radiance;
