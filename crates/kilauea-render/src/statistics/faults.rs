//! Faults that the tests of lights must find.

use kilauea_math::{DMat4, Vec3};
use kilauea_scene::LightShape;
use kilauea_testing::Directions;

use super::lights::light;
use super::lit::{
    Lit, Sees, combined_irradiance_p_value, compare_density, irradiance_p_value, prepare,
    share_not_found,
};
use crate::light::{ByImportance, ChosenLight, Emitted, Receiver};

/// Lights with something wrong in them.
struct Faulty<'a> {
    sound: &'a Lit<'a>,
    fault: Fault,
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    None,
    /// The density that rays find is this much too large.
    DensityTimes(f32),
    /// The light that is drawn is this much too bright.
    DrawsTimes(f32),
    /// Where both numbers are above this, they are taken from elsewhere.
    CornerMissed(f32),
    /// Numbers have so many different values.
    CoarseNumbers(f32),
    /// The density drawn with lacks the choice of one light of two.
    ChoiceForgotten,
}

impl Sees for Faulty<'_> {
    fn sample(&self, [choice, x, y]: [f32; 3]) -> Option<ChosenLight> {
        let (x, y) = match self.fault {
            Fault::CornerMissed(rim) if x > rim && y > rim => (x - rim, y - rim),
            Fault::CoarseNumbers(n) => ((x * n).floor() / n, (y * n).floor() / n),
            _ => (x, y),
        };
        let mut light = self.sound.sample([choice, x, y])?;
        match self.fault {
            Fault::DrawsTimes(factor) => light.sample.radiance *= factor,
            Fault::ChoiceForgotten => light.sample.pdf *= 2.0,
            _ => (),
        }
        Some(light)
    }

    fn for_each_arriving(&self, dir: Vec3, mut visit: impl FnMut(&Emitted)) {
        let factor = match self.fault {
            Fault::DensityTimes(factor) => factor,
            _ => 1.0,
        };
        self.sound.for_each_arriving(dir, |e| {
            visit(&Emitted {
                pdf: factor * e.pdf,
                ..*e
            });
        });
    }

    fn n(&self) -> Vec3 {
        self.sound.n()
    }
}

/// Calls `check` with two rect lights above a point.
fn with_fault(fault: Fault, check: impl Fn(&Faulty<'_>, &Directions)) {
    let shape = LightShape::Rect {
        width: 1.0,
        height: 1.0,
    };
    let at = |x| {
        light(
            shape,
            DMat4::from_translation(kilauea_math::DVec3::new(x, 0.0, 1.0)),
        )
    };
    let prepared = prepare(vec![at(-0.6), at(0.6)], &[], Vec::new());
    let (p, n) = (Vec3::ZERO, Vec3::Z);
    let sound = Lit {
        prepared: &prepared,
        receiver: Receiver { p, n },
        chooser: ByImportance,
    };
    let faulty = Faulty {
        sound: &sound,
        fault,
    };
    check(&faulty, &Directions::around(n, 0.8));
}

#[test]
fn wrong_densities_are_found() {
    with_fault(Fault::None, |seen, directions| {
        let found = compare_density(seen, directions, 0);
        assert!(found.p_value() > 1e-3, "{found:?}");
    });
    for fault in [
        Fault::DensityTimes(1.02),
        Fault::DensityTimes(0.98),
        Fault::CornerMissed(0.85),
        Fault::CoarseNumbers(40.0),
    ] {
        with_fault(fault, |seen, directions| {
            let found = compare_density(seen, directions, 0);
            assert!(found.p_value() < 1e-6, "{fault:?}: {found:?}");
        });
    }
}

#[test]
fn wrong_light_is_found() {
    with_fault(Fault::None, |seen, directions| {
        assert!(irradiance_p_value(seen, directions, 0) > 1e-3);
        assert!(share_not_found(seen, 0) < 1e-3);
    });
    for fault in [
        Fault::DrawsTimes(1.02),
        Fault::DrawsTimes(0.98),
        Fault::ChoiceForgotten,
    ] {
        with_fault(fault, |seen, directions| {
            let p = irradiance_p_value(seen, directions, 0);
            assert!(p < 1e-6, "{fault:?}: {p}");
            assert!(share_not_found(seen, 0) > 0.99, "{fault:?}");
        });
    }
}

#[test]
fn light_that_two_strategies_lose_is_found() {
    with_fault(Fault::None, |seen, directions| {
        assert!(combined_irradiance_p_value(seen, directions, 0) > 1e-3);
    });
    for fault in [
        Fault::DrawsTimes(1.02),
        Fault::DensityTimes(1.3),
        Fault::ChoiceForgotten,
    ] {
        with_fault(fault, |seen, directions| {
            let p = combined_irradiance_p_value(seen, directions, 0);
            assert!(p < 1e-6, "{fault:?}: {p}");
        });
    }
}
