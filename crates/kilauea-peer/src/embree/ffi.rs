//! Records and constants of Embree 4.4 as its headers declare them, for one instance level.

use std::marker::PhantomData;

/// What a handle points to; only Embree knows.
#[repr(C)]
pub(super) struct Opaque<T> {
    _private: [u8; 0],
    _marker: PhantomData<*mut T>,
}

/// Distinguishes handles of devices.
pub(super) enum DeviceTag {}
/// Distinguishes handles of scenes.
pub(super) enum SceneTag {}
/// Distinguishes handles of geometries.
pub(super) enum GeometryTag {}

/// `RTCDevice`.
pub(super) type DeviceHandle = *mut Opaque<DeviceTag>;
/// `RTCScene`.
pub(super) type SceneHandle = *mut Opaque<SceneTag>;
/// `RTCGeometry`.
pub(super) type GeometryHandle = *mut Opaque<GeometryTag>;

/// `RTCRay`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct RtcRay {
    pub(super) org: [f32; 3],
    pub(super) tnear: f32,
    pub(super) dir: [f32; 3],
    pub(super) time: f32,
    /// Becomes the distance of the hit; −∞ where `rtcOccluded1` finds any.
    pub(super) tfar: f32,
    pub(super) mask: u32,
    pub(super) id: u32,
    pub(super) flags: u32,
}

/// `RTCHit`, with the instance arrays that release builds have.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct RtcHit {
    pub(super) ng: [f32; 3],
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) prim_id: u32,
    pub(super) geom_id: u32,
    pub(super) inst_id: u32,
    pub(super) inst_prim_id: u32,
}

/// `RTCRayHit`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct RtcRayHit {
    pub(super) ray: RtcRay,
    pub(super) hit: RtcHit,
}

/// `RTCMemoryMonitorFunction`: user pointer, bytes (negative when freed), whether it has happened.
pub(super) type MemoryMonitor =
    unsafe extern "C" fn(*mut std::ffi::c_void, bytes: isize, post: bool) -> bool;

/// `RTC_INVALID_GEOMETRY_ID`.
pub(super) const INVALID_ID: u32 = u32::MAX;
/// `RTC_GEOMETRY_TYPE_TRIANGLE`.
pub(super) const GEOMETRY_TYPE_TRIANGLE: i32 = 0;
/// `RTC_BUFFER_TYPE_INDEX`.
pub(super) const BUFFER_TYPE_INDEX: i32 = 0;
/// `RTC_BUFFER_TYPE_VERTEX`.
pub(super) const BUFFER_TYPE_VERTEX: i32 = 1;
/// `RTC_FORMAT_UINT3`.
pub(super) const FORMAT_UINT3: i32 = 0x5003;
/// `RTC_FORMAT_FLOAT3`.
pub(super) const FORMAT_FLOAT3: i32 = 0x9003;
/// `RTC_SCENE_FLAG_NONE`.
pub(super) const SCENE_FLAG_NONE: i32 = 0;
/// `RTC_SCENE_FLAG_COMPACT`.
pub(super) const SCENE_FLAG_COMPACT: i32 = 1 << 1;
/// `RTC_SCENE_FLAG_ROBUST`.
pub(super) const SCENE_FLAG_ROBUST: i32 = 1 << 2;
/// `RTC_BUILD_QUALITY_LOW`.
pub(super) const BUILD_QUALITY_LOW: i32 = 0;
/// `RTC_BUILD_QUALITY_MEDIUM`.
pub(super) const BUILD_QUALITY_MEDIUM: i32 = 1;
/// `RTC_BUILD_QUALITY_HIGH`.
pub(super) const BUILD_QUALITY_HIGH: i32 = 2;
/// `RTC_DEVICE_PROPERTY_VERSION_MAJOR`, followed by minor and patch.
pub(super) const DEVICE_PROPERTY_VERSION_MAJOR: i32 = 1;

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{align_of, offset_of, size_of};

    #[test]
    fn records_lie_as_in_the_headers() {
        assert_eq!((size_of::<RtcRay>(), align_of::<RtcRay>()), (48, 16));
        assert_eq!((size_of::<RtcHit>(), align_of::<RtcHit>()), (48, 16));
        assert_eq!((size_of::<RtcRayHit>(), align_of::<RtcRayHit>()), (96, 16));
        let ray = [
            offset_of!(RtcRay, org),
            offset_of!(RtcRay, tnear),
            offset_of!(RtcRay, dir),
            offset_of!(RtcRay, time),
            offset_of!(RtcRay, tfar),
            offset_of!(RtcRay, mask),
            offset_of!(RtcRay, id),
            offset_of!(RtcRay, flags),
        ];
        assert_eq!(ray, [0, 12, 16, 28, 32, 36, 40, 44]);
        let hit = [
            offset_of!(RtcHit, ng),
            offset_of!(RtcHit, u),
            offset_of!(RtcHit, v),
            offset_of!(RtcHit, prim_id),
            offset_of!(RtcHit, geom_id),
            offset_of!(RtcHit, inst_id),
            offset_of!(RtcHit, inst_prim_id),
        ];
        assert_eq!(hit, [0, 12, 16, 20, 24, 28, 32]);
        assert_eq!(offset_of!(RtcRayHit, hit), 48);
    }
}
