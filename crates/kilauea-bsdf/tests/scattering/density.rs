use kilauea_bsdf::{Bsdf, Layers};
use kilauea_math::{Frame, Spectrum, Vec3};
use kilauea_testing::{Family, Viewed};

use crate::surfaces::{all, coated, plastic, tinted, views};

#[test]
fn directions_are_drawn_with_the_density_stated() {
    let mut family = Family::new("densities");
    let mut add = |name: &str, bsdf: &Bsdf, n: Vec3| {
        for wo in views() {
            let found = Viewed { bsdf, wo, n }.compare_density(family.len() as u32);
            family.add(format!("{name}, wo {wo}, {found:?}"), found.p_value());
        }
    };
    for surface in all() {
        add(&surface.name(), &surface.bsdf, Vec3::Z);
    }
    // Where shading and geometric normal disagree, some directions are lost.
    for ns in [Vec3::new(0.3, -0.2, 0.9), Vec3::new(-0.8, 0.1, 0.5)] {
        let ns = ns.normalize();
        let frame = Frame::from_z(ns);
        let tilted = |layers: Layers| Bsdf::layered(frame, Vec3::Z, &layers);
        let matte = Bsdf::lambert(frame, Vec3::Z, Spectrum::ONE);
        add("tilted lambert", &matte, ns);
        add("tilted plastic", &tilted(plastic(0.3)), ns);
        add("tilted coat", &tilted(coated(tinted(0.5), 0.1)), ns);
    }
    family.check();
}
