//! Surfaces of every kind and roughness, and where they are seen from.

use kilauea_bsdf::{Bsdf, Layers, f0_from_ior};
use kilauea_math::{Frame, Spectrum, Vec3};

const ROUGHNESSES: [f32; 6] = [0.0, 0.04, 0.12, 0.35, 0.7, 1.0];

/// Grazing to perpendicular, from the outside and the inside, in no plane of symmetry.
pub(crate) fn views() -> [Vec3; 6] {
    let at = |cos: f32, azimuth: f32| {
        let sin = (1.0 - cos * cos).sqrt();
        Vec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos)
    };
    [
        at(0.015, 0.3),
        at(0.2, 2.0),
        at(0.6, 4.0),
        at(0.995, 5.5),
        -at(0.1, 1.0),
        -at(0.8, 3.0),
    ]
}

/// Flat, facing up.
pub(crate) fn flat(layers: &Layers) -> Bsdf {
    Bsdf::layered(Frame::from_z(Vec3::Z), Vec3::Z, layers)
}

pub(crate) fn lambert(albedo: f32) -> Bsdf {
    Bsdf::lambert(Frame::from_z(Vec3::Z), Vec3::Z, Spectrum::splat(albedo))
}

pub(crate) fn plastic(roughness: f32) -> Layers {
    Layers {
        diffuse: Spectrum::ONE,
        f0: Spectrum::splat(f0_from_ior(1.5)),
        f90: Spectrum::ONE,
        roughness,
        ..Layers::default()
    }
}

pub(crate) fn metal(roughness: f32) -> Layers {
    Layers {
        f0: Spectrum::ONE,
        f90: Spectrum::ONE,
        roughness,
        ..Layers::default()
    }
}

/// Half of the light that is let in goes into glass.
pub(crate) fn glassy(roughness: f32) -> Layers {
    Layers {
        diffuse: Spectrum::splat(0.5),
        transmission: 0.5,
        ..plastic(roughness)
    }
}

pub(crate) fn glass(roughness: f32) -> Layers {
    Layers {
        roughness,
        transmission: 1.0,
        ..Layers::default()
    }
}

pub(crate) fn tinted(roughness: f32) -> Layers {
    Layers {
        diffuse: Spectrum::new(0.1, 0.4, 0.3),
        f0: Spectrum::new(0.6, 0.3, 0.05),
        f90: Spectrum::new(1.0, 0.8, 0.5),
        transmission: 0.3,
        transmission_tint: Spectrum::new(0.9, 0.5, 0.0),
        ..plastic(roughness)
    }
}

pub(crate) fn coated(layers: Layers, coat_roughness: f32) -> Layers {
    Layers {
        coat: 0.8,
        coat_roughness,
        ..layers
    }
}

/// Every kind that absorbs nothing, at one roughness.
pub(crate) fn white(roughness: f32) -> [(&'static str, Layers); 6] {
    [
        ("plastic", plastic(roughness)),
        ("metal", metal(roughness)),
        ("half glass", glassy(roughness)),
        ("glass", glass(roughness)),
        ("coated plastic", coated(plastic(roughness), 0.15)),
        ("coated metal", coated(metal(roughness), 0.0)),
    ]
}

/// A surface, flat and facing up.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    pub(crate) kind: &'static str,
    /// Of the interface; 1 for ideal diffusers.
    pub(crate) roughness: f32,
    pub(crate) bsdf: Bsdf,
    pub(crate) is_white: bool,
}

/// Every kind at every roughness.
pub(crate) fn all() -> Vec<Surface> {
    let surface = |kind, roughness, bsdf, is_white| Surface {
        kind,
        roughness,
        bsdf,
        is_white,
    };
    let mut all = vec![
        surface("white lambert", 1.0, lambert(1.0), true),
        surface("gray lambert", 1.0, lambert(0.5), false),
    ];
    for roughness in ROUGHNESSES {
        for (kind, layers) in white(roughness) {
            all.push(surface(kind, roughness, flat(&layers), true));
        }
        let tinted = tinted(roughness);
        let coated = coated(tinted, 0.4);
        for (kind, layers) in [("tinted", tinted), ("coated and tinted", coated)] {
            all.push(surface(kind, roughness, flat(&layers), false));
        }
    }
    all
}

impl Surface {
    pub(crate) fn name(&self) -> String {
        format!("{} of roughness {}", self.kind, self.roughness)
    }
}
