//! Faults that the tests beside must find.

use kilauea_bsdf::{Bsdf, BsdfEval, BsdfSample};
use kilauea_math::Vec3;
use kilauea_testing::{Scatters, Viewed, asymmetry};

use crate::energy::TABLE_ERROR;
use crate::surfaces::{flat, lambert, metal, plastic, views};

/// A BSDF with something wrong in it.
struct Faulty<'a> {
    sound: &'a Bsdf,
    fault: Fault,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// The density stated is this much too large.
    DensityTimes(f32),
    /// Value and weights are this much too large.
    EnergyTimes(f32),
    /// The value lacks the cosine.
    CosineDropped,
    /// Numbers have so many different values.
    CoarseNumbers(f32),
    /// Where both numbers of the direction are above this, they are taken from elsewhere.
    CornerMissed(f32),
    /// More light goes toward +x than comes from there.
    OneWay,
}

impl Faulty<'_> {
    fn numbers(&self, u: [f32; 3]) -> [f32; 3] {
        match self.fault {
            Fault::CoarseNumbers(n) => u.map(|x| (x * n).floor() / n),
            Fault::CornerMissed(rim) if u[1] > rim && u[2] > rim => [u[0], u[1] - rim, u[2] - rim],
            _ => u,
        }
    }
}

impl Scatters for Faulty<'_> {
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let mut sample = self.sound.sample(wo, self.numbers(u))?;
        if let Fault::EnergyTimes(factor) = self.fault {
            sample.diffuse *= factor;
            sample.specular *= factor;
        }
        Some(sample)
    }

    fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
        let mut eval = self.sound.eval(wo, wi);
        let factor = match self.fault {
            Fault::EnergyTimes(factor) => factor,
            Fault::CosineDropped => 1.0 / wi.z.abs().max(1e-3),
            Fault::OneWay => 1.0 + 0.05 * wo.x,
            _ => 1.0,
        };
        eval.diffuse *= factor;
        eval.specular *= factor;
        if let Fault::DensityTimes(factor) = self.fault {
            eval.pdf *= factor;
        }
        eval
    }
}

/// Calls `check` with sound surfaces that have a fault, as seen from the outside.
fn with_fault(fault: Fault, check: impl Fn(&Viewed<'_, Faulty<'_>>)) {
    for sound in [lambert(1.0), flat(&metal(0.35)), flat(&plastic(0.35))] {
        let bsdf = Faulty {
            sound: &sound,
            fault,
        };
        for wo in &views()[1..4] {
            check(&Viewed {
                bsdf: &bsdf,
                wo: *wo,
                n: Vec3::Z,
            });
        }
    }
}

#[test]
fn wrong_densities_are_found() {
    with_fault(Fault::None, |v| {
        assert!(v.compare_density(0).p_value() > 1e-4);
    });
    for fault in [
        Fault::DensityTimes(1.02),
        Fault::DensityTimes(0.98),
        Fault::CoarseNumbers(64.0),
        Fault::CornerMissed(0.85),
    ] {
        with_fault(fault, |v| {
            let found = v.compare_density(0);
            assert!(found.p_value() < 1e-6, "{fault:?}, {}: {found:?}", v.wo);
        });
    }
}

#[test]
fn wrong_weights_are_found() {
    let p_value = |v: &Viewed<'_, Faulty<'_>>| v.draws_p_value(v.smooth_albedo(), 0);
    with_fault(Fault::None, |v| assert!(p_value(v) > 1e-4));
    with_fault(Fault::CosineDropped, |v| {
        assert!(p_value(v) < 1e-6, "{}: {}", v.wo, p_value(v));
    });
}

#[test]
fn half_a_percent_too_much_light_is_found() {
    with_fault(Fault::None, |v| {
        assert!((v.albedo() - 1.0).abs() < TABLE_ERROR);
    });
    with_fault(Fault::EnergyTimes(1.005), |v| {
        assert!(v.albedo() - 1.0 > TABLE_ERROR, "{}", v.albedo());
    });
}

#[test]
fn light_that_prefers_one_way_is_found() {
    let lambert = lambert(0.5);
    let of_fault = |fault| {
        asymmetry(&Faulty {
            sound: &lambert,
            fault,
        })
    };
    assert!(of_fault(Fault::None) < 1e-5);
    assert!(of_fault(Fault::OneWay) > 0.02);
}

#[test]
fn a_wrong_roughness_is_found() {
    /// Draws from one surface, states the density of another.
    struct Mixed(Bsdf, Bsdf);
    impl Scatters for Mixed {
        fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
            self.0.sample(wo, u)
        }
        fn eval(&self, wo: Vec3, wi: Vec3) -> BsdfEval {
            self.1.eval(wo, wi)
        }
    }
    for (roughness, other) in [(0.04, 0.044), (0.4, 0.43), (0.9, 0.96)] {
        let bsdf = Mixed(flat(&metal(roughness)), flat(&metal(other)));
        let viewed = Viewed {
            bsdf: &bsdf,
            wo: views()[2],
            n: Vec3::Z,
        };
        let p = viewed.compare_density(0).p_value();
        assert!(p < 1e-6, "{roughness}, {other}: {p}");
    }
}
