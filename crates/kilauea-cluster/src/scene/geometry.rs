//! The geometry of a scene, written and read field by field in the same order.

use kilauea_math::{DAffine3, DVec3};
use kilauea_scene::{
    Attribute, CurveBasis, CurveProfile, CurvesChunk, InstanceAttribute, Instances, Interpolation,
    MeshChunk, MeshKey, PointsChunk, Prototype, Visibility,
};

use super::SceneBytesError;
use super::read::SceneReader;
use super::write::SceneWriter;

type Read<T> = Result<T, SceneBytesError>;

impl SceneWriter {
    pub(super) fn prototype(&mut self, prototype: &Prototype) {
        self.text(&prototype.path);
        self.array(&prototype.center.to_array());
        self.list(&prototype.chunks, |writer, of| writer.chunk(of, Self::mesh));
        self.list(&prototype.curves, |writer, of| {
            writer.chunk(of, Self::curves);
        });
        self.list(&prototype.points, |writer, of| {
            writer.chunk(of, Self::points);
        });
        self.list(&prototype.instances, Self::instances);
    }

    fn mesh(&mut self, chunk: &MeshChunk) {
        self.u32(chunk.prim_idx);
        self.u32(chunk.material);
        self.u8(chunk.visibility.0);
        self.u8(chunk.double_sided.into());
        self.array(&chunk.positions);
        self.array(&chunk.triangles);
        self.optional_array(chunk.normals.as_deref());
        self.list(&chunk.later_keys, |writer, key| {
            writer.array(&key.positions);
            writer.optional_array(key.normals.as_deref());
        });
        self.list(&chunk.attributes, Self::attribute);
    }

    fn curves(&mut self, chunk: &CurvesChunk) {
        self.u32(chunk.prim_idx);
        self.u32(chunk.material);
        self.u8(chunk.visibility.0);
        self.u8(match chunk.basis {
            CurveBasis::Linear => 0,
            CurveBasis::Bezier => 1,
        });
        self.u8(match chunk.profile {
            CurveProfile::Round => 0,
            CurveProfile::Ribbon => 1,
        });
        self.array(&chunk.points);
        self.list(&chunk.later_points, |writer, key| writer.array(key));
        self.array(&chunk.radii);
        self.optional_array(chunk.normals.as_deref());
        self.array(&chunk.segments);
        self.list(&chunk.attributes, Self::attribute);
    }

    fn points(&mut self, chunk: &PointsChunk) {
        self.u32(chunk.prim_idx);
        self.u32(chunk.material);
        self.u8(chunk.visibility.0);
        self.array(&chunk.centers);
        self.list(&chunk.later_centers, |writer, key| writer.array(key));
        self.array(&chunk.radii);
        self.list(&chunk.attributes, Self::attribute);
    }

    fn instances(&mut self, instances: &Instances) {
        self.u32(instances.prim_idx);
        self.u32(instances.prototype);
        self.u8(instances.visibility.0);
        self.transforms(&instances.parent_from_prototype);
        self.list(&instances.later_parent_from_prototype, |writer, key| {
            writer.transforms(key);
        });
        self.list(&instances.attributes, |writer, attribute| {
            writer.text(&attribute.name);
            writer.u8(attribute.width);
            writer.array(&attribute.data);
        });
    }

    fn attribute(&mut self, attribute: &Attribute) {
        self.text(&attribute.name);
        self.u8(attribute.width);
        self.u8(match attribute.interpolation {
            Interpolation::Constant => 0,
            Interpolation::Uniform => 1,
            Interpolation::Vertex => 2,
        });
        self.array(&attribute.data);
    }

    /// Twelve numbers each, column after column.
    fn transforms(&mut self, transforms: &[DAffine3]) {
        let columns: Vec<[f64; 12]> = transforms.iter().map(DAffine3::to_cols_array).collect();
        self.array(&columns);
    }
}

impl SceneReader<'_> {
    pub(super) fn prototype(&mut self) -> Read<Prototype> {
        Ok(Prototype {
            path: self.text()?,
            center: self.point()?,
            chunks: self.list(Self::mesh)?,
            curves: self.list(Self::curves)?,
            points: self.list(Self::points)?,
            instances: self.list(Self::instances)?,
        })
    }

    pub(super) fn mesh(&mut self) -> Read<MeshChunk> {
        Ok(MeshChunk {
            prim_idx: self.u32()?,
            material: self.u32()?,
            visibility: Visibility(self.u8()?),
            double_sided: self.flag("whether a mesh has two sides")?,
            positions: self.array()?,
            triangles: self.array()?,
            normals: self.optional_array()?,
            later_keys: self.list(|reader| {
                Ok(MeshKey {
                    positions: reader.array()?,
                    normals: reader.optional_array()?,
                })
            })?,
            attributes: self.list(Self::attribute)?,
        })
    }

    pub(super) fn curves(&mut self) -> Read<CurvesChunk> {
        Ok(CurvesChunk {
            prim_idx: self.u32()?,
            material: self.u32()?,
            visibility: Visibility(self.u8()?),
            basis: self.choice(
                "the basis of curves",
                &[CurveBasis::Linear, CurveBasis::Bezier],
            )?,
            profile: self.choice(
                "the profile of curves",
                &[CurveProfile::Round, CurveProfile::Ribbon],
            )?,
            points: self.array()?,
            later_points: self.list(Self::array)?,
            radii: self.array()?,
            normals: self.optional_array()?,
            segments: self.array()?,
            attributes: self.list(Self::attribute)?,
        })
    }

    pub(super) fn points(&mut self) -> Read<PointsChunk> {
        Ok(PointsChunk {
            prim_idx: self.u32()?,
            material: self.u32()?,
            visibility: Visibility(self.u8()?),
            centers: self.array()?,
            later_centers: self.list(Self::array)?,
            radii: self.array()?,
            attributes: self.list(Self::attribute)?,
        })
    }

    fn instances(&mut self) -> Read<Instances> {
        Ok(Instances {
            prim_idx: self.u32()?,
            prototype: self.u32()?,
            visibility: Visibility(self.u8()?),
            parent_from_prototype: self.transforms()?,
            later_parent_from_prototype: self.list(Self::transforms)?,
            attributes: self.list(|reader| {
                Ok(InstanceAttribute {
                    name: reader.text()?,
                    width: reader.u8()?,
                    data: reader.array()?,
                })
            })?,
        })
    }

    fn attribute(&mut self) -> Read<Attribute> {
        Ok(Attribute {
            name: self.text()?,
            width: self.u8()?,
            interpolation: self.choice(
                "the interpolation of a primvar",
                &[
                    Interpolation::Constant,
                    Interpolation::Uniform,
                    Interpolation::Vertex,
                ],
            )?,
            data: self.array()?,
        })
    }

    fn point(&mut self) -> Read<DVec3> {
        let xyz: Vec<f64> = self.array()?;
        let [x, y, z] = xyz[..] else {
            return Err(SceneBytesError::Value {
                what: "the number of coordinates",
                value: xyz.len() as u8,
            });
        };
        Ok(DVec3::new(x, y, z))
    }

    fn transforms(&mut self) -> Read<Vec<DAffine3>> {
        let columns: Vec<[f64; 12]> = self.array()?;
        Ok(columns.iter().map(DAffine3::from_cols_array).collect())
    }

    /// One of some values, by its number.
    fn choice<T: Copy>(&mut self, what: &'static str, values: &[T]) -> Read<T> {
        let value = self.u8()?;
        let chosen = values.get(usize::from(value));
        chosen
            .copied()
            .ok_or(SceneBytesError::Value { what, value })
    }
}
