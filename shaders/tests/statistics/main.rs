//! Every shader with parameters from all over their declared ranges: what it scatters must be
//! drawn as it states, carry the light that its value says, and be no more than comes in.

#![forbid(unsafe_code)]

mod looks;

use kilauea_bsdf::Bsdf;
use kilauea_math::Vec3;
use kilauea_testing::{Family, Viewed, asymmetry, project};
use looks::{Color, Look, looks};
use shaders::Shader;

/// What the tables of directional albedos cost.
const TABLE_ERROR: f64 = 2.5e-3;

/// Grazing and steep, from the outside and the inside.
fn views() -> [Vec3; 4] {
    let at = |cos: f32, azimuth: f32| {
        let sin = (1.0 - cos * cos).sqrt();
        Vec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos)
    };
    [at(0.05, 0.3), at(0.7, 4.0), -at(0.2, 1.0), -at(0.9, 3.0)]
}

/// Calls `check` with all looks of all shaders, as they are seen from everywhere.
fn for_each_view(color: Color, mut check: impl FnMut(String, &Look, &Viewed<'_, Bsdf>)) {
    for look in looks(color) {
        for wo in views() {
            let bsdf = look.bsdf(wo);
            let viewed = Viewed {
                bsdf: &bsdf,
                wo,
                n: look.ns,
            };
            check(format!("{look:?}, wo {wo}"), &look, &viewed);
        }
    }
}

#[test]
fn directions_are_drawn_with_the_density_stated() {
    let mut family = Family::new("densities of shaders");
    for_each_view(Color::Any, |name, _, viewed| {
        let found = viewed.compare_density(family.len() as u32);
        family.add(format!("{name}, {found:?}"), found.p_value());
    });
    family.check();
}

#[test]
fn light_is_carried_and_never_gained() {
    let mut family = Family::new("weights of shaders");
    for_each_view(Color::Any, |name, look, viewed| {
        let smooth = viewed.smooth_albedo();
        let albedo = smooth + viewed.delta_albedo();
        assert!(albedo < 1.0 + TABLE_ERROR, "{name}: {albedo}");
        // Where normals disagree some light is lost, and the albedo stated does not say so.
        if look.is_flat() {
            let stated = project(viewed.bsdf.albedo(viewed.wo));
            let error = (stated - albedo).abs();
            assert!(error < TABLE_ERROR, "{name}: {albedo}, stated {stated}");
        }
        let p = viewed.draws_p_value(smooth, family.len() as u32);
        family.add(name, p);
    });
    family.check();
}

#[test]
fn white_looks_scatter_all_light() {
    let mut n_white = [0; Shader::NAMES.len()];
    for_each_view(Color::White, |name, look, viewed| {
        if look.is_flat() && !look.absorbs() {
            let albedo = viewed.albedo();
            assert!((albedo - 1.0).abs() < TABLE_ERROR, "{name}: {albedo}");
            n_white[look.shader_idx] += 1;
        }
    });
    assert!(n_white.iter().all(|&n| n > 6), "{n_white:?}");
}

#[test]
fn half_a_percent_too_much_light_is_found() {
    let white = looks(Color::White);
    let is_matte = |look: &&Look| look.shader == "Matte" && look.is_flat();
    let matte = white.iter().find(is_matte).expect("some are");
    let bsdf = matte.bsdf(Vec3::Z);
    let viewed = Viewed {
        bsdf: &bsdf,
        wo: Vec3::Z,
        n: Vec3::Z,
    };
    assert!(1.005 * viewed.albedo() > 1.0 + TABLE_ERROR);
    let smooth = 1.005 * viewed.smooth_albedo();
    assert!(viewed.draws_p_value(smooth, 0) < 1e-6);
}

/// Largest share of a shader's light that would go elsewhere if it went the other way.
///
/// Metals give back what facets lose, and coats and glass take their share, by one direction alone.
const ASYMMETRY_BOUNDS: [(&str, f64); 4] = [
    ("Glass", 0.0),
    ("Matte", 1e-5),
    ("Mirror", 0.28),
    ("UsdPreviewSurface", 0.85),
];

#[test]
fn shaders_are_as_reciprocal_as_they_claim() {
    for look in looks(Color::Any).iter().filter(|look| look.is_flat()) {
        let bound = ASYMMETRY_BOUNDS
            .iter()
            .find(|(name, _)| *name == look.shader);
        let (_, bound) = *bound.expect("each shader has its bound");
        let found = asymmetry(&look.bsdf(Vec3::Z));
        assert!(found <= bound, "{look:?}: {found}");
    }
}
