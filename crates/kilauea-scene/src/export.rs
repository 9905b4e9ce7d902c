//! A scene as files that other renderers can read: `scene.json` and raw little-endian arrays.

use kilauea_math::DAffine3;
use serde_json::{Value, json};
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::{Instances, MeshChunk, RenderSettings, Scene};

impl Scene {
    /// Writes the scene into an existing folder. `scene.json` holds the records of this crate as
    /// serde writes them, and names the files of the arrays: `f32` and `u32` as in [`MeshChunk`],
    /// matrices as 16 `f64` each, column after column.
    pub fn export(&self, folder: &Path, settings: &RenderSettings) -> io::Result<()> {
        let mut arrays = ArrayWriter { folder, n_files: 0 };
        let mut prototypes = Vec::new();
        for prototype in &self.prototypes {
            let chunks = prototype
                .chunks
                .iter()
                .map(|chunk| arrays.chunk(chunk))
                .collect::<io::Result<Vec<_>>>()?;
            let instances = prototype
                .instances
                .iter()
                .map(|instances| arrays.instances(instances))
                .collect::<io::Result<Vec<_>>>()?;
            prototypes.push(json!({
                "path": prototype.path,
                "center": prototype.center,
                "chunks": chunks,
                "instances": instances,
            }));
        }
        let scene = json!({
            "origin_world": self.origin_world,
            "prim_paths": self.prim_paths,
            "prototypes": prototypes,
            "materials": self.materials,
            "textures": self.textures,
            "lights": self.lights,
            "camera": self.camera,
            "settings": settings,
        });
        fs::write(
            folder.join("scene.json"),
            serde_json::to_vec_pretty(&scene)?,
        )
    }
}

struct ArrayWriter<'a> {
    folder: &'a Path,
    n_files: usize,
}

impl ArrayWriter<'_> {
    fn chunk(&mut self, chunk: &MeshChunk) -> io::Result<Value> {
        let normals = match &chunk.normals {
            Some(normals) => Value::from(self.floats(normals.as_flattened())?),
            None => Value::Null,
        };
        let attributes = chunk
            .attributes
            .iter()
            .map(|a| {
                Ok(json!({
                    "name": a.name,
                    "width": a.width,
                    "interpolation": a.interpolation,
                    "data": self.floats(&a.data)?,
                }))
            })
            .collect::<io::Result<Vec<_>>>()?;
        let triangles = chunk.triangles.as_flattened();
        Ok(json!({
            "prim_idx": chunk.prim_idx,
            "material": chunk.material,
            "double_sided": chunk.double_sided,
            "n_vertices": chunk.positions.len(),
            "n_triangles": chunk.triangles.len(),
            "positions": self.floats(chunk.positions.as_flattened())?,
            "triangles": self.write(triangles.iter().map(|v| v.to_le_bytes()))?,
            "normals": normals,
            "attributes": attributes,
        }))
    }

    fn instances(&mut self, instances: &Instances) -> io::Result<Value> {
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
        let numbers = instances.parent_from_prototype.iter().flat_map(columns);
        let matrices = self.write(numbers.flatten().map(f64::to_le_bytes))?;
        let attributes = instances
            .attributes
            .iter()
            .map(|a| {
                let data = self.floats(&a.data)?;
                Ok(json!({ "name": a.name, "width": a.width, "data": data }))
            })
            .collect::<io::Result<Vec<_>>>()?;
        Ok(json!({
            "prototype": instances.prototype,
            "matrices": matrices,
            "attributes": attributes,
        }))
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
