//! Each kind of light alone.

use kilauea_math::{DMat4, DVec3, Spectrum, Vec3};
use kilauea_scene::{Light, LightShape, Shaping};
use kilauea_testing::{Directions, Family, TileFile};
use std::f64::consts::FRAC_PI_2;

use super::lit::{
    Lit, combined_irradiance_p_value, compare_density, irradiance_p_value, prepare, share_not_found,
};
use crate::PreparedScene;
use crate::light::{ByImportance, Receiver};

/// A light of radiance one.
pub(crate) fn light(shape: LightShape, world_from_light: DMat4) -> Light {
    Light {
        path: "/Light".into(),
        shape,
        world_from_light,
        radiance: Spectrum::ONE,
        texture: None,
        diffuse: 1.0,
        specular: 0.5,
        shaping: None,
        visible_to_camera: true,
    }
}

/// A place in which no axis is special.
pub(crate) fn turned() -> DMat4 {
    DMat4::from_translation(DVec3::new(0.3, -1.2, 0.7))
        * DMat4::from_rotation_y(0.7)
        * DMat4::from_rotation_x(-0.4)
}

/// There, stretched along the light's axes.
pub(crate) fn scaled(x: f64, y: f64, z: f64) -> DMat4 {
    turned() * DMat4::from_scale(DVec3::new(x, y, z))
}

/// Takes the right angles away from a light; areas in its xy plane grow by a factor of 1.08.
pub(crate) fn shear() -> DMat4 {
    DMat4::from_cols_array_2d(&[
        [1.0, 0.4, 0.0, 0.0],
        [0.3, 1.2, 0.0, 0.0],
        [0.1, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ])
}

pub(crate) const RECT: LightShape = LightShape::Rect {
    width: 1.2,
    height: 0.7,
};
pub(crate) const DISK: LightShape = LightShape::Disk { radius: 0.5 };
pub(crate) const SPHERE: LightShape = LightShape::Sphere { radius: 0.5 };
pub(crate) const CYLINDER: LightShape = LightShape::Cylinder {
    radius: 0.15,
    length: 1.4,
};

/// A soft cone that is brightest along its axis.
pub(crate) fn shaping() -> Shaping {
    Shaping {
        cone_angle_degrees: 40.0,
        cone_softness: 0.3,
        focus: 2.0,
        focus_tint: Spectrum::BLACK,
    }
}

/// A scene of one light at the place of [`turned`].
struct Case {
    name: String,
    prepared: PreparedScene,
    size: Size,
}

/// How much of a point's surroundings a light takes.
#[derive(Clone, Copy)]
enum Size {
    /// From its place it reaches as far as this.
    Radius(f32),
    /// It is infinitely far toward the place's +z, and reaches as far as this angle in degrees.
    HalfAngle(f64),
}

impl Case {
    /// Calls `check` with the light as points before it see it, near and far, and with directions
    /// that are dense where it is.
    fn for_each_receiver(&self, mut check: impl FnMut(String, &Lit<'_>, &Directions)) {
        let place = turned();
        let center = place.transform_point3(DVec3::ZERO).as_vec3();
        // Charts are about a direction off the light's center, so that no rim runs along cells.
        // Toward where the light shines, in units of its radius: close, aside, far.
        for (from_light, normal) in [
            (DVec3::new(0.1, 0.05, -0.6), Vec3::new(0.1, 0.2, 1.0)),
            (DVec3::new(0.9, -0.7, -0.4), Vec3::new(-0.8, 0.3, 0.4)),
            (DVec3::new(6.0, 3.0, -20.0), Vec3::new(0.0, 0.0, 1.0)),
        ] {
            let offset = place.transform_vector3(from_light).as_vec3();
            let (p, directions) = match self.size {
                Size::Radius(radius) => {
                    let half_angle = f64::from(1.0 / offset.length()).atan();
                    let aside = 0.3 * offset.any_orthogonal_vector().normalize();
                    let directions = Directions::around(aside - offset, half_angle);
                    (center + radius * offset, directions)
                }
                Size::HalfAngle(degrees) => {
                    let half_angle = degrees.to_radians().min(FRAC_PI_2);
                    let axis = DVec3::new(0.3 * half_angle, 0.0, 1.0);
                    let axis = place.transform_vector3(axis).as_vec3();
                    (offset, Directions::around(axis, half_angle))
                }
            };
            let n = place.transform_vector3(normal.as_dvec3()).as_vec3();
            let seen = Lit {
                prepared: &self.prepared,
                receiver: Receiver {
                    p,
                    n: n.normalize(),
                },
                chooser: ByImportance,
            };
            check(format!("{}, from {p}", self.name), &seen, &directions);
        }
    }
}

/// A picture with a texel that is a thousand times brighter than the others.
pub(crate) fn sunny() -> TileFile {
    TileFile::new([16, 8], |x, y| {
        let is_sun = (x, y) == (11, 6);
        let sky = 0.2 + 0.1 * (x % 3) as f32 + 0.05 * y as f32;
        if is_sun { [300.0; 3] } else { [sky; 3] }
    })
}

fn cases() -> Vec<Case> {
    let shear = shear();
    let (rect, disk, sphere, cylinder) = (RECT, DISK, SPHERE, CYLINDER);
    let distant = |angle_degrees| LightShape::Distant { angle_degrees };
    let shaping = shaping();
    let mut cases: Vec<Case> = [
        ("rect", Size::Radius(0.7), light(rect, turned())),
        (
            "sheared rect",
            Size::Radius(0.8),
            light(rect, turned() * shear),
        ),
        ("disk", Size::Radius(0.5), light(disk, turned())),
        (
            "ellipse",
            Size::Radius(0.6),
            light(disk, scaled(1.2, 0.5, 2.0)),
        ),
        ("sphere", Size::Radius(0.55), light(sphere, turned())),
        (
            "ellipsoid",
            Size::Radius(0.6),
            light(sphere, scaled(1.2, 0.4, 0.8)),
        ),
        ("cylinder", Size::Radius(0.75), light(cylinder, turned())),
        (
            "flat cylinder",
            Size::Radius(0.75),
            light(cylinder, scaled(1.0, 3.0, 0.5)),
        ),
        ("sun", Size::HalfAngle(0.3), light(distant(0.53), turned())),
        (
            "wide distant",
            Size::HalfAngle(25.0),
            light(distant(50.0), turned()),
        ),
        (
            "half sphere distant",
            Size::HalfAngle(90.0),
            light(distant(180.0), turned()),
        ),
        (
            "more than half distant",
            Size::HalfAngle(90.0),
            light(distant(250.0), turned()),
        ),
        (
            "dome",
            Size::HalfAngle(90.0),
            light(LightShape::Dome, turned()),
        ),
        (
            "shaped sphere",
            Size::Radius(0.55),
            Light {
                shaping: Some(shaping),
                ..light(sphere, turned())
            },
        ),
    ]
    .into_iter()
    .map(|(name, size, light)| Case {
        name: name.into(),
        prepared: prepare(vec![light], &[], Vec::new()),
        size,
    })
    .collect();

    let sunny = sunny();
    for (name, shape, size) in [
        ("dome with a sun", LightShape::Dome, Size::HalfAngle(90.0)),
        ("pictured rect", rect, Size::Radius(0.7)),
    ] {
        let light = Light {
            texture: Some(0),
            ..light(shape, turned())
        };
        cases.push(Case {
            name: name.into(),
            prepared: prepare(vec![light], &[], vec![sunny.source()]),
            size,
        });
    }
    let corner = |x, y, z| turned().transform_point3(DVec3::new(x, y, z)).as_vec3();
    let triangle = [
        corner(-0.6, -0.3, 0.1),
        corner(0.5, -0.4, -0.1),
        corner(0.1, 0.6, 0.0),
    ];
    cases.push(Case {
        name: "triangle".into(),
        prepared: prepare(Vec::new(), &[triangle], Vec::new()),
        size: Size::Radius(0.7),
    });
    cases
}

#[test]
fn directions_are_drawn_with_the_density_that_rays_find() {
    let mut family = Family::new("densities of lights");
    for case in cases() {
        case.for_each_receiver(|name, seen, directions| {
            let found = compare_density(seen, directions, family.len() as u32);
            family.add(format!("{name}: {found:?}"), found.p_value());
        });
    }
    family.check();
}

#[test]
fn draws_carry_the_light_that_rays_find() {
    let mut family = Family::new("irradiance");
    for case in cases() {
        case.for_each_receiver(|name, seen, directions| {
            let p = irradiance_p_value(seen, directions, family.len() as u32);
            family.add(name, p);
        });
    }
    family.check();
}

#[test]
fn draws_and_rays_of_surfaces_together_carry_all_light() {
    let mut family = Family::new("irradiance by two strategies");
    for case in cases() {
        case.for_each_receiver(|name, seen, directions| {
            let p = combined_irradiance_p_value(seen, directions, 2 * family.len() as u32);
            family.add(name, p);
        });
    }
    family.check();
}

#[test]
fn rays_find_the_light_and_density_of_each_draw() {
    for case in cases() {
        case.for_each_receiver(|name, seen, _| {
            let share = share_not_found(seen, 0);
            // On the rim rounding decides.
            assert!(share < 2e-3, "{name}: {share}");
        });
    }
}
