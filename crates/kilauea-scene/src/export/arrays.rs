use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use kilauea_math::DAffine3;
use serde_json::{Value, json};

use crate::{Attribute, CurvesChunk, Instances, MeshChunk, PointsChunk};

/// Writes arrays to numbered files and returns records that name them.
pub(super) struct ArrayWriter<'a> {
    folder: &'a Path,
    n_files: usize,
}

impl<'a> ArrayWriter<'a> {
    pub(super) fn new(folder: &'a Path) -> Self {
        Self { folder, n_files: 0 }
    }

    /// Records of many things, in order.
    pub(super) fn list<T>(
        &mut self,
        items: &[T],
        mut record: impl FnMut(&mut Self, &T) -> io::Result<Value>,
    ) -> io::Result<Value> {
        items.iter().map(|item| record(self, item)).collect()
    }

    pub(super) fn mesh(&mut self, chunk: &MeshChunk) -> io::Result<Value> {
        let triangles = chunk.triangles.as_flattened();
        Ok(json!({
            "prim_idx": chunk.prim_idx,
            "material": chunk.material,
            "double_sided": chunk.double_sided,
            "visibility": chunk.visibility,
            "n_vertices": chunk.positions.len(),
            "n_triangles": chunk.triangles.len(),
            "positions": self.triples(&chunk.positions)?,
            "triangles": self.write(triangles.iter().map(|v| v.to_le_bytes()))?,
            "normals": self.optional_triples(chunk.normals.as_deref())?,
            "later_keys": self.list(&chunk.later_keys, |arrays, key| {
                Ok(json!({
                    "positions": arrays.triples(&key.positions)?,
                    "normals": arrays.optional_triples(key.normals.as_deref())?,
                }))
            })?,
            "attributes": self.list(&chunk.attributes, Self::attribute)?,
        }))
    }

    pub(super) fn curves(&mut self, chunk: &CurvesChunk) -> io::Result<Value> {
        Ok(json!({
            "prim_idx": chunk.prim_idx,
            "material": chunk.material,
            "visibility": chunk.visibility,
            "basis": chunk.basis,
            "profile": chunk.profile,
            "n_points": chunk.points.len(),
            "n_segments": chunk.segments.len(),
            "points": self.triples(&chunk.points)?,
            "later_points": self.keys(&chunk.later_points)?,
            "radii": self.floats(&chunk.radii)?,
            "normals": self.optional_triples(chunk.normals.as_deref())?,
            "segments": self.write(chunk.segments.iter().map(|v| v.to_le_bytes()))?,
            "attributes": self.list(&chunk.attributes, Self::attribute)?,
        }))
    }

    pub(super) fn points(&mut self, chunk: &PointsChunk) -> io::Result<Value> {
        Ok(json!({
            "prim_idx": chunk.prim_idx,
            "material": chunk.material,
            "visibility": chunk.visibility,
            "n_points": chunk.centers.len(),
            "centers": self.triples(&chunk.centers)?,
            "later_centers": self.keys(&chunk.later_centers)?,
            "radii": self.floats(&chunk.radii)?,
            "attributes": self.list(&chunk.attributes, Self::attribute)?,
        }))
    }

    pub(super) fn instances(&mut self, instances: &Instances) -> io::Result<Value> {
        Ok(json!({
            "prototype": instances.prototype,
            "visibility": instances.visibility,
            "matrices": self.matrices(&instances.parent_from_prototype)?,
            "later_matrices": self.list(&instances.later_parent_from_prototype, |arrays, key| {
                Ok(arrays.matrices(key)?.into())
            })?,
            "attributes": self.list(&instances.attributes, |arrays, a| {
                let data = arrays.floats(&a.data)?;
                Ok(json!({ "name": a.name, "width": a.width, "data": data }))
            })?,
        }))
    }

    fn attribute(&mut self, attribute: &Attribute) -> io::Result<Value> {
        Ok(json!({
            "name": attribute.name,
            "width": attribute.width,
            "interpolation": attribute.interpolation,
            "data": self.floats(&attribute.data)?,
        }))
    }

    /// Files of one array per motion key.
    fn keys(&mut self, keys: &[Vec<[f32; 3]>]) -> io::Result<Value> {
        self.list(keys, |arrays, key| Ok(arrays.triples(key)?.into()))
    }

    fn matrices(&mut self, matrices: &[DAffine3]) -> io::Result<String> {
        let columns = |m: &DAffine3| {
            let [a, b, c] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
            let t = m.translation;
            [
                [a.x, a.y, a.z, 0.0],
                [b.x, b.y, b.z, 0.0],
                [c.x, c.y, c.z, 0.0],
                [t.x, t.y, t.z, 1.0],
            ]
        };
        let numbers = matrices.iter().flat_map(columns);
        self.write(numbers.flatten().map(f64::to_le_bytes))
    }

    fn optional_triples(&mut self, values: Option<&[[f32; 3]]>) -> io::Result<Option<String>> {
        values.map(|values| self.triples(values)).transpose()
    }

    fn triples(&mut self, values: &[[f32; 3]]) -> io::Result<String> {
        self.floats(values.as_flattened())
    }

    fn floats(&mut self, values: &[f32]) -> io::Result<String> {
        self.write(values.iter().map(|v| v.to_le_bytes()))
    }

    /// Writes one array to a file of its own and returns the file's name.
    fn write<const N: usize>(
        &mut self,
        values: impl Iterator<Item = [u8; N]>,
    ) -> io::Result<String> {
        let name = format!("{:06}.bin", self.n_files);
        self.n_files += 1;
        let mut file = BufWriter::new(fs::File::create(self.folder.join(&name))?);
        for value in values {
            file.write_all(&value)?;
        }
        file.flush()?;
        Ok(name)
    }
}
