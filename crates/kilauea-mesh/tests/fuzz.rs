//! Garbage in, no panic.

mod stage;

use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{DAffine3, DVec3};
use kilauea_mesh::*;
use kilauea_scene::Visibility;
use stage::*;

/// A stream of random numbers.
struct Random {
    key: u32,
    n: u32,
}

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.n += 1;
        combine(self.key, self.n) % n.max(1)
    }

    fn one_in(&mut self, n: u32) -> bool {
        self.below(n) == 0
    }

    fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len() as u32) as usize]
    }

    /// Mostly an index, sometimes not.
    fn index(&mut self, n: u32) -> i32 {
        if self.one_in(400) {
            self.pick(&[-1, i32::MIN, i32::MAX, n as i32])
        } else {
            self.below(n) as i32
        }
    }

    fn float(&mut self) -> f32 {
        if self.one_in(200) {
            self.pick(&[f32::NAN, f32::INFINITY, f32::MAX, 1e-40, -1e30, 0.0])
        } else {
            self.n += 1;
            // Few distinct values: coinciding points and values.
            (unit_f32(combine(self.key, self.n)) * 5.0).round()
        }
    }

    fn floats(&mut self, n: usize) -> Vec<f32> {
        (0..n).map(|_| self.float()).collect()
    }

    fn indices(&mut self, n: usize, limit: u32) -> Vec<i32> {
        (0..n).map(|_| self.index(limit)).collect()
    }

    /// Mostly the length that fits.
    fn length(&mut self, n: usize) -> usize {
        if self.one_in(10) {
            self.below(20) as usize
        } else {
            n
        }
    }
}

/// Interpolation, width, values, indices.
type PrimvarArrays = (&'static str, u8, Vec<f32>, Option<Vec<i32>>);

/// The arrays that a random mesh borrows.
struct Arrays {
    points: Vec<[f32; 3]>,
    counts: Vec<i32>,
    curve_counts: Vec<i32>,
    indices: Vec<i32>,
    holes: Vec<i32>,
    subset: Vec<i32>,
    primvars: Vec<PrimvarArrays>,
    crease_indices: Vec<i32>,
    crease_lengths: Vec<i32>,
    crease_sharpnesses: Vec<f32>,
    corner_indices: Vec<i32>,
    corner_sharpnesses: Vec<f32>,
}

impl Arrays {
    fn new(random: &mut Random) -> Self {
        let n_points = random.below(12);
        let n_faces = random.below(10) as usize;
        let counts: Vec<i32> = (0..n_faces)
            .map(|_| match random.below(60) {
                0 => random.pick(&[-1, i32::MAX, i32::MIN]),
                1..4 => random.below(3) as i32,
                4..30 => 3,
                30..56 => 4,
                _ => 5 + random.below(3) as i32,
            })
            .collect();
        let n_corners: i64 = counts.iter().map(|&c| i64::from(c)).sum();
        let n_corners = random.length(n_corners.clamp(0, 100) as usize);
        let sizes = [
            ("constant", 1),
            ("uniform", n_faces),
            ("varying", n_points as usize),
            ("vertex", n_points as usize),
            ("faceVarying", n_corners),
        ];
        let primvars = (0..random.below(4))
            .map(|_| {
                let (interpolation, n) = random.pick(&sizes);
                let width = random.below(6) as u8;
                let n_values = random.length(n);
                let indices = random.one_in(2).then(|| {
                    let n = random.length(n);
                    random.indices(n, n_values as u32)
                });
                let values = random.floats(n_values * usize::from(width));
                (interpolation, width, values, indices)
            })
            .collect();
        let crease_lengths: Vec<i32> = (0..random.below(4))
            .map(|_| 2 + random.below(2) as i32)
            .collect();
        let n_crease = random.length(crease_lengths.iter().sum::<i32>() as usize);
        let n_corner = random.below(3) as usize;
        // Two curves that share the points.
        let first = random.below(n_points + 1) as i32;
        let second = random.length((n_points as i32 - first) as usize) as i32;
        Self {
            curve_counts: vec![first, second],
            points: (0..n_points)
                .map(|_| [random.float(), random.float(), random.float()])
                .collect(),
            indices: random.indices(n_corners, n_points),
            counts,
            holes: {
                let n = random.below(3) as usize;
                random.indices(n, n_faces as u32)
            },
            subset: {
                let n = random.below(5) as usize;
                random.indices(n, n_faces as u32)
            },
            primvars,
            crease_indices: random.indices(n_crease, n_points),
            crease_sharpnesses: {
                let n = random.length(crease_lengths.len());
                random.floats(n).iter().map(|s| 3.0 * s).collect()
            },
            crease_lengths,
            corner_indices: random.indices(n_corner, n_points),
            corner_sharpnesses: {
                let n = random.length(n_corner);
                random.floats(n)
            },
        }
    }

    fn primvar(&self, i: usize) -> Option<Primvar<'_>> {
        let (interpolation, width, values, indices) = self.primvars.get(i)?;
        Some(Primvar {
            name: ["a", "b", "c", "d"][i],
            indices: indices.as_deref(),
            ..primvar(interpolation, *width, values)
        })
    }

    fn mesh(&self, random: &mut Random) -> PolyMesh<'_> {
        use FaceVaryingRule as F;
        let mut made = mesh(&self.points, &self.counts, &self.indices);
        made.prototype = random.below(3);
        made.prototype_from_mesh = transform(random);
        made.hole_indices = &self.holes;
        made.left_handed = random.one_in(2);
        made.normals = self.primvar(0).filter(|p| p.width == 3);
        made.primvars = (0..4).filter_map(|i| self.primvar(i)).collect();
        made.subsets = vec![Subset {
            faces: &self.subset,
            material: random.below(4),
        }];
        let scheme = random.pick(&[Scheme::CatmullClark, Scheme::Loop, Scheme::Bilinear]);
        made.subdivision = (!random.one_in(3)).then(|| Subdivision {
            scheme,
            interpolate_boundary: random.pick(&[
                BoundaryInterpolation::None,
                BoundaryInterpolation::EdgeOnly,
                BoundaryInterpolation::EdgeAndCorner,
            ]),
            face_varying_linear_interpolation: random.pick(&[
                F::None,
                F::CornersOnly,
                F::CornersPlus1,
                F::CornersPlus2,
                F::Boundaries,
                F::All,
            ]),
            triangle_rule: random.pick(&[TriangleRule::CatmullClark, TriangleRule::Smooth]),
            crease_indices: &self.crease_indices,
            crease_lengths: &self.crease_lengths,
            crease_sharpnesses: &self.crease_sharpnesses,
            corner_indices: &self.corner_indices,
            corner_sharpnesses: &self.corner_sharpnesses,
        });
        if random.one_in(3) {
            let normals = self.primvar(1).filter(|p| p.width == 3);
            let points = &self.points[..random.length(self.points.len()).min(self.points.len())];
            made.later_keys = vec![MeshPose { points, normals }];
        }
        made
    }

    fn curves<'a>(&'a self, later: &'a Self, random: &mut Random) -> BasisCurves<'a> {
        BasisCurves {
            path: "/curves",
            prototype: random.below(3),
            prototype_from_curves: transform(random),
            points: &self.points,
            later_points: later.later_points(self, random),
            curve_vertex_counts: &self.curve_counts,
            curve_type: random.pick(&[CurveType::Linear, CurveType::Cubic, CurveType::Cubic]),
            basis: random.pick(&[
                CubicBasis::Bezier,
                CubicBasis::Bspline,
                CubicBasis::CatmullRom,
            ]),
            wrap: random.pick(&[
                CurveWrap::Nonperiodic,
                CurveWrap::Periodic,
                CurveWrap::Pinned,
            ]),
            widths: self.primvar(0),
            normals: self.primvar(1),
            primvars: (0..4).filter_map(|i| self.primvar(i)).collect(),
            material: random.below(4),
            visibility: Visibility::ALL,
        }
    }

    fn spheres<'a>(&'a self, later: &'a Self, random: &mut Random) -> Points<'a> {
        Points {
            path: "/points",
            prototype: random.below(3),
            prototype_from_points: transform(random),
            points: &self.points,
            later_points: later.later_points(self, random),
            widths: self.primvar(0),
            primvars: (0..4).filter_map(|i| self.primvar(i)).collect(),
            material: random.below(4),
            visibility: Visibility::ALL,
        }
    }

    /// Sometimes a key that fits, or does not.
    fn later_points<'a>(&'a self, first: &'a Self, random: &mut Random) -> Vec<&'a [[f32; 3]]> {
        match random.below(6) {
            0 => vec![&self.points],
            1 => vec![&first.points, &first.points],
            _ => Vec::new(),
        }
    }
}

fn transform(random: &mut Random) -> DAffine3 {
    let scale = random.pick(&[1.0, -1.0, 1e-8, 1e8, 0.0, f64::NAN, 1.0, 2.0]);
    DAffine3::from_translation(DVec3::splat(f64::from(random.float())))
        * DAffine3::from_scale(DVec3::new(scale, 1.0, 2.0))
}

#[test]
fn garbage_never_panics_and_never_reaches_the_scene() {
    let mut n_triangles = 0;
    let (mut n_subdivided, mut n_segments, mut n_points) = (0, 0, 0);
    for key in 0..2500 {
        let random = &mut Random { key, n: 0 };
        let arrays = [Arrays::new(random), Arrays::new(random)];
        let mut payloads = empty();
        payloads.prototypes = vec![String::new(), "/a".into(), "/b".into()];
        payloads.meshes = arrays.iter().map(|a| a.mesh(random)).collect();
        for _ in 0..random.below(3) {
            payloads.instances.push(InstancesPayload {
                path: "/instancer",
                parent: random.below(2),
                prototype: 1 + random.below(2),
                parent_from_prototype: (0..random.below(4)).map(|_| transform(random)).collect(),
                later_parent_from_prototype: (0..random.below(2))
                    .map(|_| (0..random.below(4)).map(|_| transform(random)).collect())
                    .collect(),
                visibility: Visibility(random.below(8) as u8),
                primvars: arrays[0].primvar(0).into_iter().collect(),
            });
        }
        payloads.implicits.push(ImplicitShape {
            path: "/shape",
            prototype: random.below(3),
            prototype_from_mesh: transform(random),
            kind: random.pick(&[
                ImplicitKind::Sphere,
                ImplicitKind::Cube,
                ImplicitKind::Cylinder,
                ImplicitKind::Cone,
                ImplicitKind::Capsule,
                ImplicitKind::Plane,
            ]),
            axis: random.pick(&[Axis::X, Axis::Y, Axis::Z]),
            dimensions: std::array::from_fn(|_| f64::from(random.float()) - 0.5),
            material: 0,
            left_handed: false,
            double_sided: false,
            primvars: arrays[1].primvar(0).into_iter().collect(),
            visibility: Visibility::ALL,
        });
        payloads.curves = vec![arrays[0].curves(&arrays[1], random)];
        payloads.points = vec![arrays[1].spheres(&arrays[0], random)];
        let options = AssembleOptions {
            max_chunk_triangles: random.below(200) as usize,
            pixels_per_edge: random.float(),
            resolution: [random.below(2000), random.below(2000)],
            max_subdivision_level: random.below(3),
        };
        n_subdivided += payloads
            .meshes
            .iter()
            .filter(|m| m.subdivision.is_some())
            .count();
        // Instances of a prototype in itself are errors.
        let Ok(assembled) = assemble(payloads, &options) else {
            continue;
        };
        n_triangles += assembled.n_triangles;
        for prototype in &assembled.scene.prototypes {
            for curves in &prototype.curves {
                n_segments += curves.segments.len();
                let keys = std::iter::once(&curves.points).chain(&curves.later_points);
                assert!(keys.flatten().flatten().all(|x| x.is_finite()), "{key}");
                assert!(
                    curves.radii.iter().all(|r| *r >= 0.0 && r.is_finite()),
                    "{key}"
                );
                for n in curves.normals.iter().flatten() {
                    let length = kilauea_math::Vec3::from_array(*n).length();
                    assert!((length - 1.0).abs() < 1e-4, "{key}: {n:?}");
                }
            }
            for points in &prototype.points {
                n_points += points.centers.len();
                let keys = std::iter::once(&points.centers).chain(&points.later_centers);
                assert!(keys.flatten().flatten().all(|x| x.is_finite()), "{key}");
                assert!(
                    points.radii.iter().all(|r| *r > 0.0 && r.is_finite()),
                    "{key}"
                );
            }
        }
        for chunk in assembled.scene.prototypes.iter().flat_map(|p| &p.chunks) {
            let keys = chunk.later_keys.iter().flat_map(|k| &k.positions);
            assert!(keys.flatten().all(|x| x.is_finite()), "{key}");
            assert!(
                chunk.positions.iter().flatten().all(|x| x.is_finite()),
                "{key}"
            );
            let normals = chunk.normals.iter().flatten();
            for n in normals {
                let length = kilauea_math::Vec3::from_array(*n).length();
                assert!((length - 1.0).abs() < 1e-4, "{key}: {n:?}");
            }
            assert!(
                chunk
                    .attributes
                    .iter()
                    .flat_map(|a| &a.data)
                    .all(|x| x.is_finite())
            );
        }
    }
    // The garbage is not so bad that nothing is tested.
    assert!(
        n_triangles > 100_000 && n_subdivided > 1000 && n_segments > 1000 && n_points > 1000,
        "{n_triangles} {n_subdivided} {n_segments} {n_points}"
    );
}
