//! The kinds of rays that a renderer traces.

use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{Frame, Vec2, Vec3, warp};

use crate::{Ours, Query, RaySet, Segment, TriangleMesh, View, Workload};

/// How far rays start off the surface, and length of ambient occlusion rays; both as a fraction of
/// the diagonal of the mesh's box.
const OFFSET: f32 = 1e-5;
const OCCLUSION_LENGTH: f32 = 0.05;

impl Workload {
    /// Makes rays of five kinds against a mesh, about `n_rays` of each:
    ///
    /// - `primary`: from the camera, row after row, jittered within their pixels;
    /// - `diffuse`: from what those hit, cosine-distributed, in random order;
    /// - `shadow`: from there toward the light, in the same random order;
    /// - `occlusion`: short cosine-distributed ones, in the order of the picture;
    /// - `random`: from anywhere in the mesh's box in any direction.
    ///
    /// There are as many of the middle three as primary rays that hit something; kinds without
    /// any ray are left out.
    pub fn trace_view(name: &str, mesh: TriangleMesh, view: &View, n_rays: usize) -> Self {
        let ours = Ours::build(&mesh);
        let diagonal = mesh.bounds().diagonal().length();
        let mut primary = Vec::new();
        let mut diffuse = Vec::new();
        let mut shadow = Vec::new();
        let mut occlusion = Vec::new();
        let [width, height] = view.resolution(n_rays);
        for pixel in 0..width * height {
            let number = |dimension| unit_f32(combine(pixel, dimension));
            let x = ((pixel % width) as f32 + number(0)) / width as f32;
            let y = ((pixel / width) as f32 + number(1)) / height as f32;
            let ray = view.ray(x, y);
            primary.push(ray);
            let Some((t, triangle)) = ours.hit(&ray) else {
                continue;
            };
            let n = facing_normal(&mesh, triangle, Vec3::from_array(ray.dir));
            let p = ray.at(t) + OFFSET * diagonal * n;
            let scattered = |u| Frame::from_z(n).from_local(warp::cosine_hemisphere(u));
            let bounce = scattered(Vec2::new(number(2), number(3)));
            let short = scattered(Vec2::new(number(4), number(5)));
            diffuse.push(Segment::new(p, bounce));
            shadow.push(Segment::until(p, view.light - p, 1.0 - 1e-4));
            occlusion.push(Segment::until(p, short, OCCLUSION_LENGTH * diagonal));
        }
        shuffle(&mut diffuse);
        shuffle(&mut shadow);
        let sets = [
            ("primary", Query::NearestCoherent, primary),
            ("diffuse", Query::Nearest, diffuse),
            ("shadow", Query::Any, shadow),
            ("occlusion", Query::Any, occlusion),
            ("random", Query::Nearest, random(&mesh, n_rays as u32)),
        ];
        let sets = sets.into_iter().map(|(kind, query, rays)| RaySet {
            kind: kind.into(),
            query,
            rays,
        });
        Self {
            name: name.into(),
            rays: sets.filter(|set| !set.rays.is_empty()).collect(),
            mesh,
        }
    }
}

/// The unit normal of a triangle on the side that a direction comes from.
fn facing_normal(mesh: &TriangleMesh, triangle: u32, dir: Vec3) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle);
    let n = (b - a).cross(c - a).normalize_or(-dir);
    if n.dot(dir) < 0.0 { n } else { -n }
}

fn random(mesh: &TriangleMesh, n_rays: u32) -> Vec<Segment> {
    let bounds = mesh.bounds();
    let ray = |i| {
        let number = |dimension| unit_f32(combine(i, dimension));
        let unit_point = Vec3::new(number(10), number(11), number(12));
        let dir = warp::uniform_sphere(Vec2::new(number(13), number(14)));
        Segment::new(bounds.min + unit_point * bounds.diagonal(), dir)
    };
    (0..n_rays).map(ray).collect()
}

/// Puts rays in an order that depends on their number alone (Fisher and Yates): paths arrive in
/// none.
fn shuffle(rays: &mut [Segment]) {
    for last in (1..rays.len()).rev() {
        let number = combine(last as u32, 20) as usize;
        rays.swap(last, number % (last + 1));
    }
}
