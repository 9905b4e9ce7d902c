//! Random scenes of all kinds of primitives, and a plain tracer of them in `f64`.
#![allow(dead_code, reason = "each user of this module needs a part of it")]

use super::shapes::Random;
use kilauea_accel::{
    CurveBasis, CurveProfile, Curves, Geometry, Hit, Mesh, Placement, Ray, Spheres, Visibility,
};
use kilauea_math::{DAffine3, DVec3, Vec3};

/// A kind of primitives, in the order of their ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    Triangles,
    Spheres,
    RoundLinear,
    RoundBezier,
    FacingLinear,
    FacingBezier,
    Oriented,
}

impl Group {
    pub(crate) const ALL: [Self; 7] = [
        Self::Triangles,
        Self::Spheres,
        Self::RoundLinear,
        Self::RoundBezier,
        Self::FacingLinear,
        Self::FacingBezier,
        Self::Oriented,
    ];

    /// Points to a primitive.
    fn n_points(self) -> usize {
        match self {
            Self::Spheres => 1,
            Self::RoundLinear | Self::FacingLinear => 2,
            Self::Triangles => 3,
            _ => 4,
        }
    }
}

const N_PRIMITIVES: usize = 20;

/// Primitives of one group: points of each follow each other.
struct Members {
    group: Group,
    /// By motion key.
    points: Vec<Vec<[f32; 3]>>,
    radii: Vec<f32>,
    normals: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    segments: Vec<u32>,
    visibility: Visibility,
}

pub(crate) struct MixedScene {
    members: Vec<Members>,
    pub(crate) placements: Vec<Placement>,
}

impl MixedScene {
    /// Twenty primitives of each group in the cube [-1, 1]³, placed once.
    pub(crate) fn new(groups: &[Group], n_keys: usize, seed: u32) -> Self {
        let mut random = Random(seed << 16);
        let members = groups
            .iter()
            .map(|&group| Members::new(group, n_keys, &mut random))
            .collect();
        Self {
            members,
            placements: vec![Placement::still(0, DAffine3::IDENTITY)],
        }
    }

    /// Adds a stretched and a mirrored placement; `motion` makes both move by it.
    pub(crate) fn place_several(&mut self, motion: Option<DAffine3>) {
        let stretched = DAffine3::from_translation(DVec3::new(0.3, -1.5, 0.2))
            * DAffine3::from_scale(DVec3::new(0.5, 0.8, 0.6));
        let mirrored = DAffine3::from_translation(DVec3::new(-0.5, 1.5, 0.0))
            * DAffine3::from_scale(DVec3::new(-0.7, 0.7, 0.7));
        for world_from_geometry in [stretched, mirrored] {
            self.placements.push(Placement {
                motion: motion.map(|by| [world_from_geometry, by * world_from_geometry].into()),
                ..Placement::still(0, world_from_geometry)
            });
        }
    }

    /// Hides each group from some rays, and adds a placement that lights alone see.
    pub(crate) fn mask(&mut self) {
        for (i, members) in self.members.iter_mut().enumerate() {
            members.visibility = [
                Visibility::CAMERA,
                Visibility::SHADOW | Visibility::INDIRECT,
                Visibility::ALL,
            ][i % 3];
        }
        self.placements.push(Placement {
            visibility: Visibility::SHADOW,
            ..Placement::still(0, DAffine3::from_rotation_x(1.0))
        });
    }

    pub(crate) fn geometries(&self) -> Vec<Geometry<'_>> {
        let mut geometry = Geometry::default();
        for members in &self.members {
            members.add_to(&mut geometry);
        }
        vec![geometry]
    }

    pub(crate) fn has(&self, group: Group) -> bool {
        self.members.iter().any(|members| members.group == group)
    }

    fn locate(&self, primitive: u32) -> (&Members, usize) {
        let members = &self.members[primitive as usize / N_PRIMITIVES];
        (members, primitive as usize % N_PRIMITIVES)
    }

    pub(crate) fn group_of(&self, hit: &Hit) -> Group {
        self.locate(hit.primitive).0.group
    }

    pub(crate) fn is_visible(&self, ray: &Ray, hit: &Hit) -> bool {
        let mask = self.locate(hit.primitive).0.visibility;
        (mask & self.placements[hit.instance as usize].visibility).meets(ray.visibility)
    }

    /// How far the reported place on the primitive is from the ray's, in the primitive's space.
    pub(crate) fn distance_to(&self, ray: &Ray, hit: &Hit) -> f64 {
        let (members, i) = self.locate(hit.primitive);
        let local = LocalRay::new(ray, &self.placements[hit.instance as usize]);
        let p = local.origin + f64::from(hit.t) * local.dir;
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let shape = members.at(i, ray.time);
        match members.group {
            Group::Triangles => {
                let [a, b, c, _] = shape.points;
                p.distance(a + u * (b - a) + v * (c - a))
            }
            Group::Spheres | Group::RoundLinear | Group::RoundBezier => {
                let (center, radius) = shape.ball(u);
                (p.distance(center) - radius).abs()
            }
            Group::FacingLinear | Group::FacingBezier => {
                // The offset goes across ray and curve; at round ends it goes anywhere across.
                let (center, radius) = shape.ball(u);
                let off_plane = (p - center).dot(local.dir.normalize()).abs();
                let offset = (2.0 * v - 1.0).abs() * radius;
                off_plane.max((p.distance(center) - offset).abs())
            }
            Group::Oriented => {
                let (center, radius) = shape.ball(u);
                p.distance(center + (2.0 * v - 1.0) * radius * shape.across(u))
            }
        }
    }

    /// Distance of the nearest hit that is inside its primitive by `slack` at least.
    pub(crate) fn nearest(&self, ray: &Ray, slack: f64) -> Option<f64> {
        let mut nearest: Option<f64> = None;
        for placement in &self.placements {
            let local = LocalRay::new(ray, placement);
            for members in &self.members {
                if !(members.visibility & placement.visibility).meets(ray.visibility) {
                    continue;
                }
                for i in 0..N_PRIMITIVES {
                    if let Some(t) = members.at(i, ray.time).hit(members.group, &local, slack) {
                        nearest = Some(nearest.map_or(t, |nearest| nearest.min(t)));
                    }
                }
            }
        }
        nearest
    }
}

impl Members {
    fn new(group: Group, n_keys: usize, random: &mut Random) -> Self {
        let n_points = group.n_points() * N_PRIMITIVES;
        let mut points: Vec<Vec<[f32; 3]>> = vec![Vec::new(); n_keys];
        for _ in 0..N_PRIMITIVES {
            let center = random.point();
            let along = 0.4 * random.point();
            for i in 0..group.n_points() {
                let p = center + i as f32 * along + 0.3 * random.point();
                for key in &mut points {
                    key.push((p + 0.2 * random.point()).to_array());
                }
            }
        }
        let first_points = (0..N_PRIMITIVES).map(|i| (group.n_points() * i) as u32);
        Self {
            group,
            points,
            radii: (0..n_points).map(|_| 0.03 + 0.12 * random.unit()).collect(),
            normals: (0..n_points).map(|_| random.point().to_array()).collect(),
            triangles: first_points.clone().map(|i| [i, i + 1, i + 2]).collect(),
            segments: first_points.collect(),
            visibility: Visibility::ALL,
        }
    }

    fn add_to<'a>(&'a self, geometry: &mut Geometry<'a>) {
        let by_key = self.points.iter().map(Vec::as_slice).collect();
        let visibility = self.visibility;
        if self.group == Group::Triangles {
            geometry.meshes.push(Mesh {
                positions: by_key,
                triangles: &self.triangles,
                visibility,
            });
            return;
        }
        if self.group == Group::Spheres {
            geometry.spheres.push(Spheres {
                centers: by_key,
                radii: &self.radii,
                visibility,
            });
            return;
        }
        let is_linear = matches!(self.group, Group::RoundLinear | Group::FacingLinear);
        let is_round = matches!(self.group, Group::RoundLinear | Group::RoundBezier);
        geometry.curves.push(Curves {
            points: by_key,
            radii: &self.radii,
            normals: (self.group == Group::Oriented).then_some(&self.normals[..]),
            segments: &self.segments,
            basis: if is_linear {
                CurveBasis::Linear
            } else {
                CurveBasis::Bezier
            },
            profile: if is_round {
                CurveProfile::Round
            } else {
                CurveProfile::Ribbon
            },
            visibility,
        });
    }

    /// A primitive at a time.
    fn at(&self, i: usize, time: f32) -> Shape {
        let n_intervals = self.points.len().max(2) - 1;
        let scaled = f64::from(time) * n_intervals as f64;
        let key = (scaled as usize).min(n_intervals - 1);
        let point = |j: usize| {
            let at_key = |key: usize| {
                Vec3::from_array(self.points[key.min(self.points.len() - 1)][j]).as_dvec3()
            };
            at_key(key).lerp(at_key(key + 1), scaled - key as f64)
        };
        let n = self.group.n_points();
        let index = |corner: usize| n * i + corner.min(n - 1);
        let mut shape = Shape {
            points: [0, 1, 2, 3].map(|corner| point(index(corner))),
            radii: [0, 1, 2, 3].map(|corner| f64::from(self.radii[index(corner)])),
            normals: [0, 1, 2, 3]
                .map(|corner| Vec3::from_array(self.normals[index(corner)]).as_dvec3()),
        };
        if n == 2 {
            // A straight line as a cubic.
            let (a, b) = (shape.points[0], shape.points[3]);
            let (ra, rb) = (shape.radii[0], shape.radii[3]);
            for (i, third) in [(1, 1.0 / 3.0), (2, 2.0 / 3.0)] {
                shape.points[i] = a.lerp(b, third);
                shape.radii[i] = ra + third * (rb - ra);
            }
        }
        shape
    }
}

/// The ray in the space of a placement.
struct LocalRay {
    origin: DVec3,
    dir: DVec3,
}

impl LocalRay {
    fn new(ray: &Ray, placement: &Placement) -> Self {
        let world_from_geometry = match placement.motion.as_deref() {
            None => placement.world_from_geometry,
            Some(keys) => {
                let time = f64::from(ray.time);
                DAffine3 {
                    matrix3: keys[0].matrix3 * (1.0 - time) + keys[1].matrix3 * time,
                    translation: keys[0].translation.lerp(keys[1].translation, time),
                }
            }
        };
        let inverse = world_from_geometry.inverse();
        Self {
            origin: inverse.transform_point3(ray.origin.as_dvec3()),
            dir: inverse.transform_vector3(ray.dir.as_dvec3()),
        }
    }
}

/// One primitive: the points of a triangle or curve, or one point four times.
struct Shape {
    points: [DVec3; 4],
    radii: [f64; 4],
    normals: [DVec3; 4],
}

/// Steps along a curve.
const N_STEPS: usize = 100;

impl Shape {
    fn weights(u: f64) -> [f64; 4] {
        let v = 1.0 - u;
        [v * v * v, 3.0 * u * v * v, 3.0 * u * u * v, u * u * u]
    }

    fn ball(&self, u: f64) -> (DVec3, f64) {
        let weights = Self::weights(u);
        let sum = |values: [DVec3; 4]| -> DVec3 {
            weights
                .iter()
                .zip(values)
                .map(|(&w, value)| w * value)
                .sum()
        };
        let radius = weights.iter().zip(self.radii).map(|(w, r)| w * r).sum();
        (sum(self.points), radius)
    }

    /// The unit direction across an oriented ribbon.
    fn across(&self, u: f64) -> DVec3 {
        let normal: DVec3 = Self::weights(u)
            .iter()
            .zip(self.normals)
            .map(|(&w, n)| w * n)
            .sum();
        normal.cross(self.tangent(u)).normalize()
    }

    fn tangent(&self, u: f64) -> DVec3 {
        let [a, b, c, d] = self.points;
        (b - a) * (1.0 - u).powi(2) + (c - b) * (2.0 * u * (1.0 - u)) + (d - c) * (u * u)
    }

    /// Distance of a hit that is inside by `slack`, the nearest among samples of curves.
    fn hit(&self, group: Group, ray: &LocalRay, slack: f64) -> Option<f64> {
        let center = self.points[0];
        let reach = |i: usize| self.points[i].distance(center) + self.radii[i];
        let size = (0..4).map(reach).fold(0.0, f64::max);
        let distance = (center - ray.origin).cross(ray.dir).length() / ray.dir.length();
        if distance > size {
            return None;
        }
        match group {
            Group::Triangles => self.triangle_hit(ray, slack),
            Group::Spheres | Group::RoundLinear | Group::RoundBezier => self.ball_hit(ray, slack),
            _ => self.ribbon_hit(group, ray, slack),
        }
    }

    fn triangle_hit(&self, ray: &LocalRay, slack: f64) -> Option<f64> {
        let [a, b, c, _] = self.points;
        let n = (b - a).cross(c - a);
        let t = (a - ray.origin).dot(n) / ray.dir.dot(n);
        let p = ray.origin + t * ray.dir;
        let inside = [(a, b), (b, c), (c, a)]
            .into_iter()
            .all(|(from, to)| (to - from).cross(p - from).dot(n) > slack * n.dot(n).sqrt());
        (inside && t > slack).then_some(t)
    }

    /// Where the first of many balls along the curve begins, unless the ray starts in one or next to
    /// it.
    fn ball_hit(&self, ray: &LocalRay, slack: f64) -> Option<f64> {
        let dd = ray.dir.dot(ray.dir);
        let chords = (0..=N_STEPS).filter_map(|i| {
            let (center, radius) = self.ball(i as f64 / N_STEPS as f64);
            let oc = center - ray.origin;
            let middle = oc.dot(ray.dir) / dd;
            let h = radius * radius - (oc - middle * ray.dir).length_squared();
            let half = h.max(0.0).sqrt() / dd.sqrt();
            (h > slack * radius).then_some([middle - half, middle + half])
        });
        let ahead: Vec<[f64; 2]> = chords.filter(|&[_, last]| last > -0.01).collect();
        let first = ahead.iter().map(|c| c[0]).fold(f64::INFINITY, f64::min);
        (first > 0.01 && first < f64::INFINITY).then_some(first)
    }

    /// Where the line first passes from one side of the ribbon to the other, between its edges.
    fn ribbon_hit(&self, group: Group, ray: &LocalRay, slack: f64) -> Option<f64> {
        if group == Group::FacingLinear {
            return self.linear_facing_hit(ray, slack);
        }
        let across = |u: f64| {
            if group == Group::Oriented {
                self.across(u)
            } else {
                ray.dir.cross(self.tangent(u)).normalize()
            }
        };
        let side = |u: f64| (self.ball(u).0 - ray.origin).cross(across(u)).dot(ray.dir);
        let mut first: Option<f64> = None;
        for i in 0..N_STEPS {
            let (mut low, mut high) = (i as f64 / N_STEPS as f64, (i + 1) as f64 / N_STEPS as f64);
            let is_positive = side(low) > 0.0;
            if is_positive == (side(high) > 0.0) {
                continue;
            }
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if (side(middle) > 0.0) == is_positive {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let (center, radius) = self.ball(low);
            let (b, dd) = (across(low), ray.dir.dot(ray.dir));
            // center + s b meets the line: leave out what is along it.
            let flat = |p: DVec3| p - ray.dir * (p.dot(ray.dir) / dd);
            let offset = flat(ray.origin - center).dot(flat(b)) / flat(b).length_squared();
            let t = (center + offset * b - ray.origin).dot(ray.dir) / dd;
            if offset.abs() < radius - slack && t > slack {
                first = Some(first.map_or(t, |first| first.min(t)));
            }
        }
        first
    }

    /// Where the line passes nearest to a straight segment.
    fn linear_facing_hit(&self, ray: &LocalRay, slack: f64) -> Option<f64> {
        let dd = ray.dir.dot(ray.dir);
        let flat = |p: DVec3| p - ray.dir * (p.dot(ray.dir) / dd);
        let from = flat(self.points[0] - ray.origin);
        let step = flat(self.points[3] - self.points[0]);
        let u = (-from.dot(step) / step.length_squared()).clamp(0.0, 1.0);
        let (center, radius) = self.ball(u);
        let t = (center - ray.origin).dot(ray.dir) / dd;
        ((from + u * step).length() < radius - slack && t > slack).then_some(t)
    }
}
