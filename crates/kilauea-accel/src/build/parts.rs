//! Geometries taken apart: what is of one kind, moves by equally many keys and is seen by the same
//! rays goes into the same trees.

use super::soup::{MAX_COORDINATE, has_area, in_range};
use crate::geometry::{CurveBasis, CurveProfile, Curves};
use crate::primitive::{CurveShape, Segment, Sphere};
use crate::visibility::Visibility;
use crate::whole::Numbered;
use std::collections::BTreeMap;

/// Primitives by motion key, with their ids in the geometry.
#[derive(Clone, Debug)]
pub(crate) struct Part<T> {
    pub(crate) ids: Vec<u32>,
    pub(crate) keys: Vec<Vec<T>>,
}

/// Parts by number of keys and visibility.
pub(crate) type Parts<P> = BTreeMap<(usize, Visibility), P>;

impl<T> Part<T> {
    fn new(n_keys: usize) -> Self {
        Self {
            ids: Vec::new(),
            keys: (0..n_keys).map(|_| Vec::new()).collect(),
        }
    }

    /// Adds a primitive, given at each key.
    fn push(&mut self, id: u32, by_key: Vec<T>) {
        self.ids.push(id);
        for (key, primitive) in self.keys.iter_mut().zip(by_key) {
            key.push(primitive);
        }
    }
}

/// Segments of curves by motion key.
#[derive(Clone, Debug)]
pub(crate) struct CurvePart {
    part: Part<Segment>,
    /// By segment: index into `normals`, `u32::MAX` for none.
    pub(crate) normals_of: Vec<u32>,
    pub(crate) normals: Vec<[[f32; 3]; 4]>,
}

impl std::ops::Deref for CurvePart {
    type Target = Part<Segment>;

    fn deref(&self) -> &Part<Segment> {
        &self.part
    }
}

/// All parts of a geometry but its still triangles.
#[derive(Debug, Default)]
pub(crate) struct Sorted {
    pub(crate) moving_triangles: Parts<Part<[[f32; 3]; 3]>>,
    pub(crate) spheres: Parts<Part<Sphere>>,
    pub(crate) curves: Parts<CurvePart>,
    /// Primitives left out.
    pub(crate) n_rejected: usize,
}

impl Sorted {
    pub(crate) fn new(geometry: Numbered<'_, '_>) -> Self {
        let mut sorted = Self::default();
        for (mesh, first_id) in geometry.meshes() {
            if mesh.positions.len() > 1 && mesh.visibility != Visibility::NONE {
                let n_keys = mesh.positions.len();
                let part = sorted
                    .moving_triangles
                    .entry((n_keys, mesh.visibility))
                    .or_insert_with(|| Part::new(n_keys));
                for (id, corners) in (first_id..).zip(mesh.triangles) {
                    let by_key = mesh.positions.iter().map(|positions| {
                        let [a, b, c] = corners.map(|i| positions.get(i as usize).copied());
                        Some([a?, b?, c?]).filter(|v| v.iter().all(in_range))
                    });
                    match by_key.collect::<Option<Vec<_>>>() {
                        Some(keys) if keys.iter().any(has_area) => part.push(id, keys),
                        _ => sorted.n_rejected += 1,
                    }
                }
            }
        }
        for (group, first_id) in geometry.spheres() {
            let n_keys = group.centers.len();
            if group.visibility != Visibility::NONE {
                let part = sorted
                    .spheres
                    .entry((n_keys, group.visibility))
                    .or_insert_with(|| Part::new(n_keys));
                for (i, &radius) in group.radii.iter().enumerate() {
                    let by_key = group.centers.iter().map(|centers| {
                        let center = *centers.get(i).filter(|c| in_range(c))?;
                        Some(Sphere { center, radius })
                    });
                    match by_key.collect::<Option<Vec<_>>>() {
                        Some(keys) if is_radius(radius) && radius > 0.0 && n_keys > 0 => {
                            part.push(first_id + i as u32, keys);
                        }
                        _ => sorted.n_rejected += 1,
                    }
                }
            }
        }
        for (group, first_id) in geometry.curves() {
            if group.visibility != Visibility::NONE {
                sorted.add_curves(group, first_id);
            }
        }
        sorted
    }

    fn add_curves(&mut self, group: &Curves<'_>, first_id: u32) {
        let n_keys = group.points.len();
        let curves = self
            .curves
            .entry((n_keys, group.visibility))
            .or_insert_with(|| CurvePart {
                part: Part::new(n_keys),
                normals_of: Vec::new(),
                normals: Vec::new(),
            });
        let is_oriented = group.normals.is_some() && group.profile == CurveProfile::Ribbon;
        let shape = match (group.profile, group.basis) {
            _ if is_oriented => CurveShape::Oriented,
            (CurveProfile::Round, CurveBasis::Linear) => CurveShape::RoundLinear,
            (CurveProfile::Round, CurveBasis::Bezier) => CurveShape::RoundBezier,
            (CurveProfile::Ribbon, CurveBasis::Linear) => CurveShape::FacingLinear,
            (CurveProfile::Ribbon, CurveBasis::Bezier) => CurveShape::FacingBezier,
        };
        for (id, &first) in (first_id..).zip(group.segments) {
            let by_key = group.points.iter().map(|points| {
                let points = control_values(points, first, group.basis)?;
                let radii = control_values(group.radii, first, group.basis)?;
                let is_valid = points.iter().all(in_range)
                    && radii.iter().all(|&r| is_radius(r))
                    && radii != [0.0; 4];
                let points = std::array::from_fn(|i| {
                    let [x, y, z] = points[i];
                    [x, y, z, radii[i]]
                });
                is_valid.then_some(Segment { points, shape })
            });
            let keys = by_key.collect::<Option<Vec<_>>>();
            let normals = match group.normals.filter(|_| is_oriented) {
                None => Some(None),
                Some(normals) => control_values(normals, first, group.basis)
                    .filter(|normals| normals.iter().all(in_range))
                    .map(Some),
            };
            let (Some(keys), Some(normals)) = (keys, normals) else {
                self.n_rejected += 1;
                continue;
            };
            if n_keys == 0 {
                self.n_rejected += 1;
                continue;
            }
            curves.part.push(id, keys);
            curves.normals_of.push(match normals {
                None => u32::MAX,
                Some(normals) => {
                    curves.normals.push(normals);
                    curves.normals.len() as u32 - 1
                }
            });
        }
    }
}

/// What can stand at control points.
trait Value: Copy {
    fn lerp(self, other: Self, t: f64) -> Self;
}

impl Value for f32 {
    fn lerp(self, other: Self, t: f64) -> Self {
        let (a, b) = (f64::from(self), f64::from(other));
        (a + t * (b - a)) as f32
    }
}

impl Value for [f32; 3] {
    fn lerp(self, other: Self, t: f64) -> Self {
        [0, 1, 2].map(|axis| self[axis].lerp(other[axis], t))
    }
}

/// The values at the four control points of a segment; a straight one gets those between its ends.
fn control_values<T: Value>(values: &[T], first: u32, basis: CurveBasis) -> Option<[T; 4]> {
    let get = |i: usize| values.get(first as usize + i).copied();
    Some(match basis {
        CurveBasis::Bezier => [get(0)?, get(1)?, get(2)?, get(3)?],
        CurveBasis::Linear => {
            let (a, b) = (get(0)?, get(1)?);
            [a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b]
        }
    })
}

fn is_radius(r: f32) -> bool {
    (0.0..=MAX_COORDINATE).contains(&r)
}
