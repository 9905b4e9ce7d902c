//! Rays that look for trouble.

use super::oracle::border_width;
use super::stage::{Inside, Stage};
use kilauea_accel::Ray;
use kilauea_math::hash::mix64;
use kilauea_math::{DAffine3, DVec3, Vec3};

/// A ray and what is known beforehand of its hit.
pub(crate) struct Aimed {
    pub(crate) ray: Ray,
    pub(crate) must: Must,
}

/// See [`Aimed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Must {
    /// Hit no later than this: it begins in, or leads into, a closed mesh.
    Hit(f64),
    /// Hit nothing: its range is empty.
    Miss,
    /// What the oracle says.
    Either,
}

/// Numbers in a fixed order.
pub(crate) struct Random(u64);

/// Makes the rays for a stage.
pub(crate) struct RaySource<'a> {
    stage: &'a Stage,
    random: Random,
    n_made: u64,
    /// Engine space: middle and half width of all corners.
    center: DVec3,
    half_width: f64,
    inverses: Vec<DAffine3>,
}

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(mix64(seed.wrapping_add(0x9e37_79b9_7f4a_7c15)))
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix64(self.0)
    }

    /// In [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    pub(crate) fn index(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }

    /// In the cube [-1, 1)³.
    pub(crate) fn point(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// A power of ten.
    pub(crate) fn decade(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(low + self.unit() * (high - low))
    }
}

impl<'a> RaySource<'a> {
    pub(crate) fn new(stage: &'a Stage, seed: u64) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for placement in 0..stage.placements.len() {
            for triangle in 0..stage.mesh(placement).indices.len() as u32 {
                for p in stage.corners(placement, triangle) {
                    (low, high) = (low.min(p), high.max(p));
                }
            }
        }
        let inverse = |i: usize| stage.placements[i].world_from_geometry.inverse();
        Self {
            stage,
            random: Random::new(seed),
            n_made: 0,
            center: 0.5 * (low + high),
            half_width: 0.5 * (high - low).max_element(),
            inverses: (0..stage.placements.len()).map(inverse).collect(),
        }
    }

    pub(crate) fn random(&mut self) -> &mut Random {
        &mut self.random
    }

    pub(crate) fn next(&mut self) -> Aimed {
        self.n_made += 1;
        match self.n_made % 12 {
            0 => self.toward(Self::corner),
            1 => self.toward(Self::edge_point),
            2 => self.toward(Self::face_point),
            3 => self.along_an_axis([0.0, -0.0]),
            4 => self.along_an_axis([1e-42, -1e-40]),
            5 => self.of_extreme_length(),
            6 | 7 => self.through_the_inside(),
            8 => self.along_an_edge(),
            9 => self.within_nothing(),
            10 => self.through_a_corner_along_an_axis(),
            _ => self.free(),
        }
    }

    /// From inside a closed mesh, or from anywhere.
    fn toward(&mut self, target: fn(&mut Self, usize) -> DVec3) -> Aimed {
        let (origin, inside) = self.start();
        let placement = inside.map_or_else(|| self.placement(), |inside| inside.placement);
        let target = target(self, placement);
        Self::aim(origin, (target - origin.as_dvec3()).as_vec3(), inside)
    }

    /// One component alone differs from those tiny ones.
    fn along_an_axis(&mut self, tiny: [f32; 2]) -> Aimed {
        let (origin, inside) = self.start();
        let mut dir = [0; 3].map(|_| tiny[self.random.index(2)]);
        dir[self.random.index(3)] = [1.0, -1.0, 0.3, -7.0][self.random.index(4)];
        Self::aim(origin, Vec3::from_array(dir), inside)
    }

    fn of_extreme_length(&mut self) -> Aimed {
        let (origin, inside) = self.start();
        // Distances must fit into `f32`.
        let length = self.half_width * self.random.decade(-36.0, 30.0);
        let dir = (self.random.point() * length).as_vec3();
        Self::aim(origin, dir, inside)
    }

    /// Through a point inside a closed mesh; at a corner where there is none.
    fn through_the_inside(&mut self) -> Aimed {
        let away = 4.0 * self.half_width * self.random.decade(0.0, 3.0);
        let origin = (self.center + away * self.random.point().normalize()).as_vec3();
        let Some((target, inside)) = self.point_inside() else {
            let placement = self.placement();
            let target = self.corner(placement);
            return Self::aim(origin, (target - origin.as_dvec3()).as_vec3(), None);
        };
        let ray = Ray::new(origin, (target - origin.as_dvec3()).as_vec3());
        // The direction's rounding, or what the kernels may err, can lead it past the mesh.
        let arrives = origin.as_dvec3() + ray.dir.as_dvec3();
        let error = border_width(arrives.distance(origin.as_dvec3()));
        let must = if self.is_inside(arrives, &inside, error) {
            Must::Hit(1.0)
        } else {
            Must::Either
        };
        Aimed { ray, must }
    }

    /// In line with an edge.
    fn along_an_edge(&mut self) -> Aimed {
        let placement = self.placement();
        let [a, b, _] = self.triangle(placement);
        let origin = a - self.random.unit() * (b - a);
        Self::aim(origin.as_vec3(), (b - a).as_vec3(), None)
    }

    fn within_nothing(&mut self) -> Aimed {
        let (origin, _) = self.start();
        let t = self.random.unit() as f32;
        let dir = self.random.point().as_vec3();
        Aimed {
            ray: Ray {
                t_min: t,
                t_max: t,
                ..Ray::new(origin, dir)
            },
            must: Must::Miss,
        }
    }

    /// Shares two coordinates with a corner.
    fn through_a_corner_along_an_axis(&mut self) -> Aimed {
        let placement = self.placement();
        let mut origin = self.corner(placement).as_vec3();
        let axis = self.random.index(3);
        let mut dir = Vec3::ZERO;
        dir[axis] = if self.random.unit() < 0.5 { 1.0 } else { -1.0 };
        origin[axis] -= dir[axis] * (2.0 * self.half_width) as f32;
        Self::aim(origin, dir, None)
    }

    /// Anywhere, over part of its line.
    fn free(&mut self) -> Aimed {
        let (origin, _) = self.start();
        let dir = self.random.point().as_vec3();
        let t = [(); 2].map(|()| (2.0 * self.half_width * self.random.unit()) as f32);
        let ray = Ray {
            t_min: t[0].min(t[1]),
            t_max: t[0].max(t[1]),
            ..Ray::new(origin, dir)
        };
        Aimed {
            ray,
            must: Must::Either,
        }
    }

    fn aim(origin: Vec3, dir: Vec3, inside: Option<Inside>) -> Aimed {
        let holds = inside.is_some() && dir != Vec3::ZERO;
        Aimed {
            ray: Ray::new(origin, dir),
            must: if holds {
                Must::Hit(f64::INFINITY)
            } else {
                Must::Either
            },
        }
    }

    /// Where a ray starts, and what holds it in.
    fn start(&mut self) -> (Vec3, Option<Inside>) {
        if let Some((p, inside)) = self.point_inside() {
            let origin = p.as_vec3();
            let holds = self.is_inside(origin.as_dvec3(), &inside, 0.0);
            return (origin, holds.then_some(inside));
        }
        let origin = self.center + 1.5 * self.half_width * self.random.point();
        (origin.as_vec3(), None)
    }

    /// A point of engine space well inside a closed mesh.
    fn point_inside(&mut self) -> Option<(DVec3, Inside)> {
        if self.stage.insides.is_empty() {
            return None;
        }
        let inside = self.stage.insides[self.random.index(self.stage.insides.len())];
        let offset = self.random.point() * (0.5 * inside.radius / 3_f64.sqrt());
        let placement = &self.stage.placements[inside.placement];
        let p = placement
            .world_from_geometry
            .transform_point3(inside.center + offset);
        Some((p, inside))
    }

    /// Whether a point is inside, even if it is moved in engine space by `error`.
    fn is_inside(&self, p_world: DVec3, inside: &Inside, error: f64) -> bool {
        let geometry_from_world = &self.inverses[inside.placement];
        let p = geometry_from_world.transform_point3(p_world);
        let is_own_space = !self.stage.may_be_baked(inside.placement);
        let error = if is_own_space { 0.0 } else { error };
        let stretch = geometry_from_world.matrix3.to_cols_array().map(f64::abs);
        let stretch = 3.0 * stretch.into_iter().fold(0.0, f64::max);
        p.distance(inside.center) + stretch * error < 0.9 * inside.radius
    }

    fn placement(&mut self) -> usize {
        self.random.index(self.stage.placements.len())
    }

    fn triangle(&mut self, placement: usize) -> [DVec3; 3] {
        let n_triangles = self.stage.mesh(placement).indices.len();
        let mut corners = self
            .stage
            .corners(placement, self.random.index(n_triangles) as u32);
        corners.rotate_left(self.random.index(3));
        corners
    }

    fn corner(&mut self, placement: usize) -> DVec3 {
        self.triangle(placement)[0]
    }

    fn edge_point(&mut self, placement: usize) -> DVec3 {
        let [a, b, _] = self.triangle(placement);
        let s = [0.5, self.random.unit()][self.random.index(2)];
        a + s * (b - a)
    }

    fn face_point(&mut self, placement: usize) -> DVec3 {
        let [a, b, c] = self.triangle(placement);
        let s = self.random.unit().sqrt();
        let v = self.random.unit();
        a + s * (1.0 - v) * (b - a) + s * v * (c - a)
    }
}
