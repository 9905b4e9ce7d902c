use libloading::Library;
use std::ffi::{c_char, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;

use super::ffi::{DeviceHandle, GeometryHandle, MemoryMonitor, RtcRay, RtcRayHit, SceneHandle};
use crate::PeerError;

macro_rules! functions {
    ($($name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The C functions in use, under their own names.
        #[expect(non_snake_case, reason = "names of the C interface")]
        pub(super) struct Functions {
            $(pub(super) $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// # Safety
            /// The library must be Embree 4 and must stay loaded while the functions are in use.
            unsafe fn find(library: &Library) -> Result<Self, libloading::Error> {
                Ok(Self {
                    // SAFETY: the caller promises Embree 4, whose headers declare these types.
                    $($name: unsafe { *library.get(concat!(stringify!($name), "\0"))? },)*
                })
            }
        }
    };
}

functions! {
    rtcNewDevice(*const c_char) -> DeviceHandle;
    rtcReleaseDevice(DeviceHandle);
    rtcGetDeviceError(DeviceHandle) -> i32;
    rtcGetDeviceProperty(DeviceHandle, i32) -> isize;
    rtcSetDeviceMemoryMonitorFunction(DeviceHandle, MemoryMonitor, *mut c_void);
    rtcNewScene(DeviceHandle) -> SceneHandle;
    rtcReleaseScene(SceneHandle);
    rtcSetSceneFlags(SceneHandle, i32);
    rtcSetSceneBuildQuality(SceneHandle, i32);
    rtcCommitScene(SceneHandle);
    rtcNewGeometry(DeviceHandle, i32) -> GeometryHandle;
    rtcReleaseGeometry(GeometryHandle);
    rtcSetGeometryBuildQuality(GeometryHandle, i32);
    rtcSetSharedGeometryBuffer(GeometryHandle, i32, u32, i32, *const c_void, usize, usize, usize);
    rtcCommitGeometry(GeometryHandle);
    rtcAttachGeometry(SceneHandle, GeometryHandle) -> u32;
    rtcIntersect1(SceneHandle, *mut RtcRayHit, *mut c_void);
    rtcOccluded1(SceneHandle, *mut RtcRay, *mut c_void);
}

/// The library, loaded until the process ends.
pub struct Embree {
    pub(super) functions: Functions,
    /// Never unloaded: the threads of its task scheduler may outlive every device.
    _library: ManuallyDrop<Library>,
}

impl Embree {
    /// Loads `libembree4`. The file is trusted: its code runs in this process.
    pub fn load(path: &Path) -> Result<Self, PeerError> {
        let failed = |source| PeerError::Library {
            path: path.into(),
            source,
        };
        // SAFETY: Embree's initialisers ask nothing of their caller, and the library is not
        // unloaded.
        let library = ManuallyDrop::new(unsafe { Library::new(path) }.map_err(failed)?);
        // SAFETY: whoever names the file says that it is Embree 4; it stays loaded.
        let functions = unsafe { Functions::find(&library) }.map_err(failed)?;
        Ok(Self {
            functions,
            _library: library,
        })
    }
}
