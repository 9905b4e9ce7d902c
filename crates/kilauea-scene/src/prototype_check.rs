//! Whether the arrays of a scene's geometry fit together.

use crate::{CurvesChunk, MeshChunk, PointsChunk, Scene, SceneError};

/// Checks every prototype: indices are inside their arrays, arrays have matching lengths.
pub(crate) fn check_prototypes(scene: &Scene) -> Result<(), SceneError> {
    let named = |prim_idx: u32| Check {
        path: scene
            .prim_paths
            .get(prim_idx as usize)
            .map_or("<unknown prim>", String::as_str),
        n_materials: scene.materials.len(),
    };
    for prototype in &scene.prototypes {
        for chunk in &prototype.chunks {
            named(chunk.prim_idx).mesh(chunk)?;
        }
        for chunk in &prototype.curves {
            named(chunk.prim_idx).curves(chunk)?;
        }
        for chunk in &prototype.points {
            named(chunk.prim_idx).points(chunk)?;
        }
        for instances in &prototype.instances {
            let check = Check {
                path: &prototype.path,
                n_materials: scene.materials.len(),
            };
            let n_prototypes = scene.prototypes.len();
            check.index("instances", 0, instances.prototype, n_prototypes)?;
            let n = instances.parent_from_prototype.len();
            for key in &instances.later_parent_from_prototype {
                check.count("instances at a later motion key", key.len(), n)?;
            }
        }
    }
    Ok(())
}

/// Checks one prim's arrays; errors name the prim.
struct Check<'a> {
    path: &'a str,
    n_materials: usize,
}

impl Check<'_> {
    fn mesh(&self, chunk: &MeshChunk) -> Result<(), SceneError> {
        self.index("material", 0, chunk.material, self.n_materials)?;
        let n = chunk.positions.len();
        let mut vertices = chunk.triangles.iter().flatten();
        if let Some(at) = vertices.position(|&v| v as usize >= n) {
            self.index("triangles", at, chunk.triangles[at / 3][at % 3], n)?;
        }
        if let Some(normals) = &chunk.normals {
            self.count("normals", normals.len(), n)?;
        }
        for key in &chunk.later_keys {
            self.count("positions at a later motion key", key.positions.len(), n)?;
            let found = key.normals.as_ref().map_or(0, Vec::len);
            let expected = if chunk.normals.is_some() { n } else { 0 };
            self.count("normals at a later motion key", found, expected)?;
        }
        Ok(())
    }

    fn curves(&self, chunk: &CurvesChunk) -> Result<(), SceneError> {
        self.index("material", 0, chunk.material, self.n_materials)?;
        let n = chunk.points.len();
        self.count("radii", chunk.radii.len(), n)?;
        if let Some(normals) = &chunk.normals {
            self.count("normals", normals.len(), n)?;
        }
        for key in &chunk.later_points {
            self.count("points at a later motion key", key.len(), n)?;
        }
        // The last control point of every segment must exist.
        let n_first = (n + 1).saturating_sub(chunk.basis.n_points());
        let mut segments = chunk.segments.iter();
        match segments.position(|&first| first as usize >= n_first) {
            Some(at) => self.index("segments", at, chunk.segments[at], n_first),
            None => Ok(()),
        }
    }

    fn points(&self, chunk: &PointsChunk) -> Result<(), SceneError> {
        self.index("material", 0, chunk.material, self.n_materials)?;
        let n = chunk.centers.len();
        self.count("radii", chunk.radii.len(), n)?;
        for key in &chunk.later_centers {
            self.count("centers at a later motion key", key.len(), n)?;
        }
        Ok(())
    }

    fn index(&self, name: &str, at: usize, value: u32, limit: usize) -> Result<(), SceneError> {
        if (value as usize) < limit {
            return Ok(());
        }
        Err(SceneError::Index {
            path: self.path.into(),
            attribute: name.into(),
            at,
            value: value.into(),
            limit,
        })
    }

    fn count(&self, name: &str, found: usize, expected: usize) -> Result<(), SceneError> {
        if found == expected {
            return Ok(());
        }
        Err(SceneError::Count {
            path: self.path.into(),
            attribute: name.into(),
            found,
            expected,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CurveBasis;

    const CHECK: Check<'static> = Check {
        path: "/prim",
        n_materials: 1,
    };

    fn curve() -> CurvesChunk {
        CurvesChunk {
            points: vec![[0.0; 3]; 7],
            radii: vec![1.0; 7],
            segments: vec![0, 3],
            basis: CurveBasis::Bezier,
            ..CurvesChunk::default()
        }
    }

    #[test]
    fn segments_stay_inside_their_control_points() {
        assert!(CHECK.curves(&curve()).is_ok());
        let mut too_far = curve();
        too_far.segments[1] = 4;
        let error = CHECK.curves(&too_far).unwrap_err().to_string();
        assert_eq!(error, "/prim: segments[1] is 4, outside 0..4");
        let mut too_few = curve();
        too_few.points.truncate(3);
        too_few.radii.truncate(3);
        assert!(CHECK.curves(&too_few).is_err());
    }

    #[test]
    fn motion_keys_are_as_long_as_the_first() {
        let mut moving = curve();
        moving.later_points = vec![vec![[1.0; 3]; 7], vec![[2.0; 3]; 6]];
        let error = CHECK.curves(&moving).unwrap_err().to_string();
        assert!(error.contains("later motion key"), "{error}");

        let mut mesh = MeshChunk {
            positions: vec![[0.0; 3]; 3],
            triangles: vec![[0, 1, 2]],
            later_keys: vec![crate::MeshKey {
                positions: vec![[1.0; 3]; 3],
                normals: None,
            }],
            ..MeshChunk::default()
        };
        assert!(CHECK.mesh(&mesh).is_ok());
        mesh.normals = Some(vec![[0.0, 0.0, 1.0]; 3]);
        assert!(CHECK.mesh(&mesh).is_err());
    }
}
