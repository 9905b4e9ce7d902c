use std::ptr;

use super::device::Device;
use super::ffi::{
    BUFFER_TYPE_INDEX, BUFFER_TYPE_VERTEX, BUILD_QUALITY_HIGH, BUILD_QUALITY_LOW,
    BUILD_QUALITY_MEDIUM, FORMAT_FLOAT3, FORMAT_UINT3, GEOMETRY_TYPE_TRIANGLE, INVALID_ID, RtcHit,
    RtcRay, RtcRayHit, SCENE_FLAG_COMPACT, SCENE_FLAG_NONE, SCENE_FLAG_ROBUST, SceneHandle,
};
use crate::{PeerError, Segment, Tracer, TriangleMesh};

/// How a scene is built and traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Short name.
    pub name: &'static str,
    quality: i32,
    flags: i32,
}

impl Mode {
    /// Morton codes: the fastest build.
    pub const LOW: Self = Self::new("low", BUILD_QUALITY_LOW, SCENE_FLAG_NONE);
    /// Binned surface area heuristic: the default.
    pub const MEDIUM: Self = Self::new("medium", BUILD_QUALITY_MEDIUM, SCENE_FLAG_NONE);
    /// Spatial splits: the fastest rays.
    pub const HIGH: Self = Self::new("high", BUILD_QUALITY_HIGH, SCENE_FLAG_NONE);
    /// As medium, with watertight edges and no box missed for rounding: what ours always does.
    pub const ROBUST: Self = Self::new("robust", BUILD_QUALITY_MEDIUM, SCENE_FLAG_ROBUST);
    /// As medium, with leaves that point into the mesh instead of copying it.
    pub const COMPACT: Self = Self::new("compact", BUILD_QUALITY_MEDIUM, SCENE_FLAG_COMPACT);

    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::LOW,
        Self::MEDIUM,
        Self::HIGH,
        Self::ROBUST,
        Self::COMPACT,
    ];

    const fn new(name: &'static str, quality: i32, flags: i32) -> Self {
        Self {
            name,
            quality,
            flags,
        }
    }
}

/// Embree's tree over a mesh, whose arrays it shares.
pub struct EmbreeScene<'a> {
    device: &'a Device<'a>,
    handle: SceneHandle,
    n_bytes: usize,
    _mesh: &'a TriangleMesh,
}

impl<'a> EmbreeScene<'a> {
    /// Builds the tree on the threads of the device.
    pub fn build(
        device: &'a Device<'a>,
        mesh: &'a TriangleMesh,
        mode: Mode,
    ) -> Result<Self, PeerError> {
        let f = device.functions;
        let n_bytes_before = device.n_bytes();
        // SAFETY: the device is valid.
        let handle = unsafe { (f.rtcNewScene)(device.handle) };
        device.check("rtcNewScene")?;
        let mut scene = Self {
            device,
            handle,
            n_bytes: 0,
            _mesh: mesh,
        };
        // SAFETY: device and scene are valid; the buffers have the counts, strides and formats
        // given, all indices are in range, the vertices are padded (`TriangleMesh`), and the mesh
        // is borrowed for as long as the scene lives. The scene keeps the geometry once attached.
        unsafe {
            (f.rtcSetSceneFlags)(handle, mode.flags);
            (f.rtcSetSceneBuildQuality)(handle, mode.quality);
            let geometry = (f.rtcNewGeometry)(device.handle, GEOMETRY_TYPE_TRIANGLE);
            device.check("rtcNewGeometry")?;
            (f.rtcSetGeometryBuildQuality)(geometry, mode.quality);
            let positions = mesh.positions();
            (f.rtcSetSharedGeometryBuffer)(
                geometry,
                BUFFER_TYPE_VERTEX,
                0,
                FORMAT_FLOAT3,
                positions.as_ptr().cast(),
                0,
                size_of::<[f32; 3]>(),
                positions.len(),
            );
            let triangles = mesh.triangles();
            (f.rtcSetSharedGeometryBuffer)(
                geometry,
                BUFFER_TYPE_INDEX,
                0,
                FORMAT_UINT3,
                triangles.as_ptr().cast(),
                0,
                size_of::<[u32; 3]>(),
                triangles.len(),
            );
            (f.rtcCommitGeometry)(geometry);
            (f.rtcAttachGeometry)(handle, geometry);
            (f.rtcReleaseGeometry)(geometry);
            (f.rtcCommitScene)(handle);
        }
        device.check("rtcCommitScene")?;
        scene.n_bytes = (device.n_bytes() - n_bytes_before).max(0) as usize;
        Ok(scene)
    }

    /// Memory that Embree took for the scene; the mesh is not in it.
    pub fn n_bytes(&self) -> usize {
        self.n_bytes
    }
}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene is valid and nobody else holds it.
        unsafe { (self.device.functions.rtcReleaseScene)(self.handle) };
    }
}

impl Tracer for EmbreeScene<'_> {
    #[inline(always)]
    fn nearest(&self, ray: &Segment) -> Option<f32> {
        let mut query = RtcRayHit {
            ray: rtc_ray(ray),
            hit: RtcHit {
                ng: [0.0; 3],
                u: 0.0,
                v: 0.0,
                prim_id: INVALID_ID,
                geom_id: INVALID_ID,
                inst_id: INVALID_ID,
                inst_prim_id: INVALID_ID,
            },
        };
        // SAFETY: the scene is committed, the record aligned; null means the default arguments.
        unsafe {
            (self.device.functions.rtcIntersect1)(self.handle, &raw mut query, ptr::null_mut());
        }
        (query.hit.geom_id != INVALID_ID).then_some(query.ray.tfar)
    }

    #[inline(always)]
    fn occluded(&self, ray: &Segment) -> bool {
        let mut query = rtc_ray(ray);
        // SAFETY: as above.
        unsafe {
            (self.device.functions.rtcOccluded1)(self.handle, &raw mut query, ptr::null_mut());
        }
        query.tfar == f32::NEG_INFINITY
    }
}

#[inline(always)]
fn rtc_ray(ray: &Segment) -> RtcRay {
    RtcRay {
        org: ray.origin,
        tnear: ray.t_min,
        dir: ray.dir,
        time: 0.0,
        tfar: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}
