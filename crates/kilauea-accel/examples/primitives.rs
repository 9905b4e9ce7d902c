//! Rays per second, on one thread, through spheres, hair and motion, and what code for absent
//! features costs triangles: `cargo run --release -p kilauea-accel --example primitives`.
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

use kilauea_accel::{
    Accel, BuildOptions, CurveBasis, CurveProfile, Curves, Geometry, Mesh, Placement, Ray, Spheres,
    Visibility,
};
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{DAffine3, Vec3};
use std::hint::black_box;
use std::time::Instant;

const N_STRANDS: u32 = 10_000;
const N_RAYS: u32 = 1 << 16;

fn main() {
    let hair = Hair::new();
    let normals: Vec<[f32; 3]> = hair
        .points
        .iter()
        .map(|&p| Vec3::from_array(p).normalize().to_array())
        .collect();
    println!("primitives        number      MB  nearest  any   Mrays/s");
    for (name, profile, normals) in [
        ("round", CurveProfile::Round, None),
        ("facing ribbons", CurveProfile::Ribbon, None),
        ("oriented ribbons", CurveProfile::Ribbon, Some(&normals[..])),
    ] {
        let curves = hair.curves(profile, normals);
        let n = curves.segments.len();
        let geometry = Geometry {
            curves: vec![curves],
            ..Geometry::default()
        };
        report(name, n, &geometry, true);
    }
    let later: Vec<[f32; 3]> = hair.points.iter().map(moved).collect();
    let mut moving = hair.curves(CurveProfile::Round, None);
    moving.points.push(&later);
    let geometry = Geometry {
        curves: vec![moving],
        ..Geometry::default()
    };
    report("round, moving", hair.segments.len(), &geometry, true);

    let radii = vec![0.006; hair.points.len()];
    let spheres = Spheres {
        centers: vec![&hair.points],
        radii: &radii,
        visibility: Visibility::ALL,
    };
    let geometry = Geometry {
        spheres: vec![spheres],
        ..Geometry::default()
    };
    report("spheres", radii.len(), &geometry, true);

    let (positions, triangles) = ball(187);
    let still = Mesh::still(&positions, &triangles);
    let later: Vec<[f32; 3]> = positions.iter().map(moved).collect();
    let moving = Mesh {
        positions: vec![&positions, &later],
        ..still.clone()
    };
    for (name, mesh, specialize) in [
        ("triangles", &still, true),
        ("by general code", &still, false),
        ("moving", &moving, true),
    ] {
        let geometry = Geometry {
            meshes: vec![mesh.clone()],
            ..Geometry::default()
        };
        report(name, triangles.len(), &geometry, specialize);
    }
}

fn report(name: &str, n: usize, geometry: &Geometry<'_>, specialize: bool) {
    let placement = Placement::still(0, DAffine3::IDENTITY);
    let options = BuildOptions {
        specialize,
        ..BuildOptions::default()
    };
    let accel = Accel::build(std::slice::from_ref(geometry), &[placement], &options);
    let rays: Vec<Ray> = (0..N_RAYS).map(ray).collect();
    println!(
        "{name:16} {n:8}  {:6.1}  {:7.2}  {:4.2}",
        accel.n_bytes() as f64 / 1e6,
        mrays_per_s(&rays, |ray| accel.intersect(ray).is_some()),
        mrays_per_s(&rays, |ray| accel.occluded(ray)),
    );
}

/// Every batch counts with the best of several runs: what else the machine does falls out.
fn mrays_per_s(rays: &[Ray], trace: impl Fn(&Ray) -> bool) -> f64 {
    let mut seconds = 0.0;
    for batch in rays.chunks(128) {
        let mut best = f64::INFINITY;
        for _ in 0..7 {
            let start = Instant::now();
            black_box(batch.iter().filter(|ray| trace(ray)).count());
            best = start.elapsed().as_secs_f64().min(best);
        }
        seconds += best;
    }
    rays.len() as f64 / seconds / 1e6
}

fn number(i: u32, dimension: u32) -> f32 {
    unit_f32(combine(i, dimension))
}

/// A number in [-1, 1) thrice.
fn point(i: u32, dimension: u32) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|axis| 2.0 * number(i, dimension + axis) - 1.0))
}

/// A ray from around the unit ball towards it.
fn ray(i: u32) -> Ray {
    let origin = 3.0 * point(i, 0).normalize();
    Ray {
        time: number(i, 9),
        ..Ray::new(origin, (1.2 * point(i, 3) - origin).normalize())
    }
}

fn moved(p: &[f32; 3]) -> [f32; 3] {
    let [x, y, z] = *p;
    [x + 0.05 * y, y - 0.05 * x, z + 0.02]
}

/// Strands of four segments that grow from the unit ball.
struct Hair {
    points: Vec<[f32; 3]>,
    radii: Vec<f32>,
    segments: Vec<u32>,
}

impl Hair {
    fn new() -> Self {
        let mut hair = Self {
            points: Vec::new(),
            radii: Vec::new(),
            segments: Vec::new(),
        };
        for strand in 0..N_STRANDS {
            let root = point(strand, 20).normalize();
            let curl = 0.3 * point(strand, 24);
            let first = hair.points.len() as u32;
            for i in 0..13_u32 {
                let along = i as f32 / 12.0;
                let p = root * (1.0 + 0.3 * along) + along * along * curl;
                hair.points.push(p.to_array());
                hair.radii.push(0.0015 * (1.0 - along));
            }
            hair.segments.extend([0, 3, 6, 9].map(|i| first + i));
        }
        hair
    }

    fn curves<'a>(&'a self, profile: CurveProfile, normals: Option<&'a [[f32; 3]]>) -> Curves<'a> {
        Curves {
            points: vec![&self.points],
            radii: &self.radii,
            normals,
            segments: &self.segments,
            basis: CurveBasis::Bezier,
            profile,
            visibility: Visibility::ALL,
        }
    }
}

/// The unit ball in `2 n²` triangles.
fn ball(n: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for row in 0..=n {
        for column in 0..=n {
            let theta = std::f32::consts::PI * row as f32 / n as f32;
            let phi = std::f32::consts::TAU * column as f32 / n as f32;
            let (sin, cos) = theta.sin_cos();
            positions.push([sin * phi.cos(), sin * phi.sin(), cos]);
            if row < n && column < n {
                let a = row * (n + 1) + column;
                let [b, c, d] = [a + 1, a + n + 1, a + n + 2];
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
    }
    (positions, triangles)
}
