//! Rays per second on one thread: `cargo run --release -p kilauea-accel --example rays [dump DIR]`.
//!
//! With `dump DIR` the meshes and rays are written there as raw `f32` and `u32`, so that another
//! tracer can be timed on the same input.
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

use kilauea_accel::{Accel, BuildOptions, Geometry, Placement, Quality, Ray};
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{DAffine3, DVec3, Frame, Vec2, Vec3, warp};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

struct Mesh {
    name: &'static str,
    positions: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
    camera: Vec3,
    look_at: Vec3,
    light: Vec3,
}

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let option = |name: &str| {
        let found = arguments.iter().position(|argument| argument == name)?;
        Some(arguments.get(found + 1).map_or("", String::as_str))
    };
    println!(
        "mesh             triangles  quality   build ms  MB     primary  diffuse  shadow  Mrays/s"
    );
    for mesh in [bumpy_sphere(187), terrain(180), boxes()] {
        if let Some(only) = option("only")
            && only != mesh.name
        {
            continue;
        }
        let geometry = Geometry {
            meshes: vec![kilauea_accel::Mesh::still(&mesh.positions, &mesh.indices)],
            ..Geometry::default()
        };
        let place =
            |x: f64| Placement::still(0, DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)));
        for (name, quality, places) in [
            ("preview", Quality::Preview, vec![place(0.0)]),
            ("final", Quality::Final, vec![place(0.0)]),
            ("instance", Quality::Final, vec![place(0.0), place(1e3)]),
        ] {
            if option("quality").is_some_and(|only| only != name) {
                continue;
            }
            let options = BuildOptions {
                quality,
                ..BuildOptions::default()
            };
            let start = Instant::now();
            let accel = Accel::build(std::slice::from_ref(&geometry), &places, &options);
            let build_ms = start.elapsed().as_secs_f64() * 1e3;
            let rays = Rays::new(&accel, &mesh);
            if let Some(folder) = option("dump") {
                rays.dump(Path::new(folder), &mesh)?;
            }
            let closest = |ray: &Ray| black_box(accel.intersect(ray)).is_some();
            let any = |ray: &Ray| black_box(accel.occluded(ray));
            println!(
                "{:16} {:9}  {name:8} {build_ms:9.1}  {:5.2}  {:7.2}  {:7.2}  {:6.2}",
                mesh.name,
                mesh.indices.len(),
                accel.n_bytes() as f64 / 1e6,
                mrays_per_s(&rays.primary, closest),
                mrays_per_s(&rays.diffuse, closest),
                mrays_per_s(&rays.shadow, any),
            );
        }
    }
    Ok(())
}

/// Every batch counts with the best of several runs: what else the machine does falls out.
fn mrays_per_s(rays: &[Ray], trace: impl Fn(&Ray) -> bool) -> f64 {
    let mut batches: Vec<(&[Ray], f64)> = rays.chunks(8192).map(|b| (b, f64::INFINITY)).collect();
    for _ in 0..25 {
        for (batch, best) in &mut batches {
            let start = Instant::now();
            black_box(batch.iter().filter(|ray| trace(ray)).count());
            *best = start.elapsed().as_secs_f64().min(*best);
        }
    }
    let seconds: f64 = batches.iter().map(|(_, best)| best).sum();
    rays.len() as f64 / seconds / 1e6
}

struct Rays {
    primary: Vec<Ray>,
    diffuse: Vec<Ray>,
    shadow: Vec<Ray>,
}

impl Rays {
    /// Camera rays in rows, and from where they hit one cosine-distributed ray and one to the light.
    fn new(accel: &Accel, mesh: &Mesh) -> Self {
        const SIZE: u32 = 512;
        let view = Frame::from_z((mesh.look_at - mesh.camera).normalize());
        let mut rays = Self {
            primary: Vec::new(),
            diffuse: Vec::new(),
            shadow: Vec::new(),
        };
        for pixel in 0..SIZE * SIZE {
            let number = |dimension| unit_f32(combine(pixel, dimension));
            let x = ((pixel % SIZE) as f32 + number(0)) / SIZE as f32 - 0.5;
            let y = ((pixel / SIZE) as f32 + number(1)) / SIZE as f32 - 0.5;
            let dir = view.from_local(Vec3::new(x, y, 0.9)).normalize();
            let ray = Ray::new(mesh.camera, dir);
            rays.primary.push(ray);
            let Some(hit) = accel.intersect(&ray) else {
                continue;
            };
            let corners = mesh.indices[hit.primitive as usize]
                .map(|i| Vec3::from_array(mesh.positions[i as usize]));
            let n = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize();
            let n = if n.dot(dir) < 0.0 { n } else { -n };
            let p = ray.at(hit.t) + 1e-4 * n;
            let u = Vec2::new(number(2), number(3));
            let scattered = Frame::from_z(n).from_local(warp::cosine_hemisphere(u));
            rays.diffuse.push(Ray::new(p, scattered));
            rays.shadow.push(Ray {
                t_max: 1.0 - 1e-4,
                ..Ray::new(p, mesh.light - p)
            });
        }
        // Paths arrive in no order.
        for i in 0..rays.diffuse.len() {
            let j = combine(i as u32, 9) as usize % rays.diffuse.len();
            rays.diffuse.swap(i, j);
            rays.shadow.swap(i, j);
        }
        rays
    }

    fn dump(&self, folder: &Path, mesh: &Mesh) -> std::io::Result<()> {
        let file = |name: &str| folder.join(format!("{}.{name}", mesh.name));
        let bytes = |floats: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
            floats.flat_map(f32::to_le_bytes).collect()
        };
        for (name, rays) in [
            ("primary", &self.primary),
            ("diffuse", &self.diffuse),
            ("shadow", &self.shadow),
        ] {
            let mut floats = rays.iter().flat_map(|ray| {
                let ends = [ray.t_min, ray.t_max];
                ray.origin
                    .to_array()
                    .into_iter()
                    .chain(ray.dir.to_array())
                    .chain(ends)
            });
            std::fs::write(file(name), bytes(&mut floats))?;
        }
        let positions = bytes(&mut mesh.positions.iter().copied().flatten());
        std::fs::write(file("positions"), positions)?;
        let indices = mesh.indices.iter().flatten().flat_map(|i| i.to_le_bytes());
        std::fs::write(file("indices"), indices.collect::<Vec<u8>>())
    }
}

fn bumpy_sphere(n: u32) -> Mesh {
    let mut mesh = Mesh {
        name: "bumpy-sphere",
        positions: Vec::new(),
        indices: Vec::new(),
        camera: Vec3::new(0.3, -2.4, 0.9),
        look_at: Vec3::ZERO,
        light: Vec3::new(3.0, -3.0, 4.0),
    };
    let n_around = n;
    for row in 0..=n {
        for column in 0..=n_around {
            let theta = std::f32::consts::PI * row as f32 / n as f32;
            let phi = std::f32::consts::TAU * column as f32 / n_around as f32;
            let bump = 1.0 + 0.15 * theta.sin() * (13.0 * phi).sin() * (15.0 * theta).cos();
            let p = Vec3::new(
                theta.sin() * phi.cos(),
                theta.sin() * phi.sin(),
                theta.cos(),
            );
            mesh.positions.push((p * bump).to_array());
        }
    }
    add_quads(&mut mesh, n_around, n);
    mesh
}

fn terrain(n: u32) -> Mesh {
    let mut mesh = Mesh {
        name: "terrain",
        positions: Vec::new(),
        indices: Vec::new(),
        camera: Vec3::new(-0.6, -0.8, 0.45),
        look_at: Vec3::new(0.2, 0.2, 0.0),
        light: Vec3::new(2.0, 0.5, 0.7),
    };
    for y in 0..=n {
        for x in 0..=n {
            let [x, y] = [x, y].map(|i| 2.0 * i as f32 / n as f32 - 1.0);
            let z = (1..6).fold(0.0, |z, octave| {
                let f = 2.0_f32.powi(octave);
                z + 0.25 / f * (f * 3.0 * x + f).sin() * (f * 2.7 * y + 1.7 * f).cos()
            });
            mesh.positions.push([x, y, z]);
        }
    }
    add_quads(&mut mesh, n, n);
    mesh
}

fn add_quads(mesh: &mut Mesh, width: u32, height: u32) {
    for y in 0..height {
        for x in 0..width {
            let a = y * (width + 1) + x;
            let [b, c, d] = [a + 1, a + width + 1, a + width + 2];
            mesh.indices.extend([[a, c, b], [b, c, d]]);
        }
    }
}

/// An open room with two boxes and a lamp: 32 triangles or so, as in the Cornell box.
fn boxes() -> Mesh {
    let mut mesh = Mesh {
        name: "cornell",
        positions: Vec::new(),
        indices: Vec::new(),
        camera: Vec3::new(0.0, -3.4, 0.0),
        look_at: Vec3::ZERO,
        light: Vec3::new(0.1, 0.05, 0.97),
    };
    add_box(&mut mesh, Vec3::ZERO, Vec3::ONE, 0.0, &[0, 1, 2, 4, 5]);
    add_box(
        &mut mesh,
        Vec3::new(-0.35, 0.3, -0.4),
        Vec3::new(0.3, 0.3, 0.6),
        0.3,
        &[0, 1, 2, 3, 5],
    );
    add_box(
        &mut mesh,
        Vec3::new(0.35, -0.3, -0.7),
        Vec3::splat(0.3),
        -0.3,
        &[0, 1, 2, 3, 5],
    );
    add_box(
        &mut mesh,
        Vec3::new(0.0, 0.0, 0.99),
        Vec3::new(0.25, 0.25, 0.0),
        0.0,
        &[5],
    );
    mesh
}

/// Some faces of a box, turned about z: x low, x high, y high, y low, z low, z high.
fn add_box(mesh: &mut Mesh, center: Vec3, half: Vec3, angle: f32, faces: &[usize]) {
    const FACES: [[u32; 4]; 6] = [
        [0, 2, 6, 4],
        [1, 3, 7, 5],
        [2, 3, 7, 6],
        [0, 1, 5, 4],
        [0, 1, 3, 2],
        [4, 5, 7, 6],
    ];
    let first = mesh.positions.len() as u32;
    for i in 0..8 {
        let sign = Vec3::from_array([0, 1, 2].map(|axis| (i >> axis & 1) as f32 * 2.0 - 1.0));
        let p = sign * half;
        let (sin, cos) = angle.sin_cos();
        let turned = Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z);
        mesh.positions.push((center + turned).to_array());
    }
    for &face in faces {
        let [a, b, c, d] = FACES[face].map(|i| first + i);
        mesh.indices.extend([[a, b, c], [a, c, d]]);
    }
}
