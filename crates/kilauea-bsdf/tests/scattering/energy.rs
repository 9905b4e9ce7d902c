use std::sync::LazyLock;

use kilauea_math::Vec3;
use kilauea_testing::{Family, Viewed, project};

use crate::surfaces::{Surface, all, views};

/// What the tables of directional albedos cost.
pub(crate) const TABLE_ERROR: f64 = 2.5e-3;

/// A surface seen from somewhere, with what it scatters of a white environment.
struct Scattered {
    surface: Surface,
    wo: Vec3,
    /// By quadrature.
    smooth: f64,
    delta: f64,
}

impl Scattered {
    fn albedo(&self) -> f64 {
        self.smooth + self.delta
    }

    fn case(&self) -> String {
        format!("{}, wo {}", self.surface.name(), self.wo)
    }
}

fn seen(surface: &Surface, wo: Vec3) -> Viewed<'_, kilauea_bsdf::Bsdf> {
    Viewed {
        bsdf: &surface.bsdf,
        wo,
        n: Vec3::Z,
    }
}

/// All surfaces from everywhere.
static ALL: LazyLock<Vec<Scattered>> = LazyLock::new(|| {
    let from_everywhere = |surface: Surface| {
        views().map(|wo| Scattered {
            surface: surface.clone(),
            wo,
            smooth: seen(&surface, wo).smooth_albedo(),
            delta: seen(&surface, wo).delta_albedo(),
        })
    };
    all().into_iter().flat_map(from_everywhere).collect()
});

#[test]
fn draws_carry_the_light_that_the_value_says() {
    let mut family = Family::new("weights");
    for (stream, scattered) in (0..).zip(&*ALL) {
        let viewed = seen(&scattered.surface, scattered.wo);
        let p = viewed.draws_p_value(scattered.smooth, stream);
        family.add(scattered.case(), p);
    }
    family.check();
}

#[test]
fn the_albedo_stated_is_the_integral() {
    for scattered in &*ALL {
        let stated = project(scattered.surface.bsdf.albedo(scattered.wo));
        let found = scattered.albedo();
        let error = (found - stated).abs();
        let case = scattered.case();
        assert!(error < TABLE_ERROR, "{case}: {found}, stated {stated}");
    }
}

#[test]
fn white_surfaces_scatter_all_light() {
    for scattered in ALL.iter().filter(|s| s.surface.is_white) {
        let albedo = scattered.albedo();
        let case = scattered.case();
        assert!((albedo - 1.0).abs() < TABLE_ERROR, "{case}: {albedo}");
    }
}
