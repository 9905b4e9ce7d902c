use std::ffi::{CString, c_void};
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};

use super::ffi::{DEVICE_PROPERTY_VERSION_MAJOR, DeviceHandle};
use super::library::{Embree, Functions};
use crate::PeerError;

/// The C interface that `ffi` declares.
const MAJOR_VERSION: isize = 4;

/// A device with a number of threads, which builds use; rays are traced by who asks.
pub struct Device<'a> {
    pub(super) functions: &'a Functions,
    pub(super) handle: DeviceHandle,
    /// Bytes that Embree holds; it keeps the counter's address.
    n_bytes: Arc<AtomicIsize>,
}

impl<'a> Device<'a> {
    /// Starts a device. Embree shares its threads between devices, so only one should live while
    /// a build is timed.
    pub fn new(embree: &'a Embree, n_threads: usize) -> Result<Self, PeerError> {
        let functions = &embree.functions;
        let config =
            CString::new(format!("threads={n_threads},verbose=0")).expect("digits and letters");
        // SAFETY: the text ends in zero and outlives the call, which copies it.
        let handle = unsafe { (functions.rtcNewDevice)(config.as_ptr()) };
        let device = Self {
            functions,
            handle,
            n_bytes: Arc::new(AtomicIsize::new(0)),
        };
        device.check("rtcNewDevice")?;
        if device.version()[0] != MAJOR_VERSION {
            return Err(PeerError::Version {
                found: device.name(),
                needed: MAJOR_VERSION,
            });
        }
        let counter = Arc::as_ptr(&device.n_bytes);
        // SAFETY: the device is valid, and the counter lives as long as it does.
        unsafe {
            (functions.rtcSetDeviceMemoryMonitorFunction)(
                handle,
                count_bytes,
                counter.cast_mut().cast(),
            );
        }
        device.check("rtcSetDeviceMemoryMonitorFunction")?;
        Ok(device)
    }

    /// The library with its version.
    pub fn name(&self) -> String {
        let [major, minor, patch] = self.version();
        format!("Embree {major}.{minor}.{patch}")
    }

    fn version(&self) -> [isize; 3] {
        [0, 1, 2].map(|part| {
            let property = DEVICE_PROPERTY_VERSION_MAJOR + part;
            // SAFETY: the device is valid.
            unsafe { (self.functions.rtcGetDeviceProperty)(self.handle, property) }
        })
    }

    /// Bytes that Embree holds now.
    pub(super) fn n_bytes(&self) -> isize {
        self.n_bytes.load(Ordering::Relaxed)
    }

    /// Turns the error that Embree has recorded for this thread into ours.
    pub(super) fn check(&self, call: &'static str) -> Result<(), PeerError> {
        // SAFETY: the device is valid, or null, which asks why there is none.
        match unsafe { (self.functions.rtcGetDeviceError)(self.handle) } {
            0 => Ok(()),
            code => Err(PeerError::Embree { call, code }),
        }
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // SAFETY: the device is valid, and scenes borrow it, so none is left.
            unsafe { (self.functions.rtcReleaseDevice)(self.handle) };
        }
    }
}

/// Embree's memory monitor.
///
/// # Safety
/// `counter` points to an [`AtomicIsize`].
unsafe extern "C" fn count_bytes(counter: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: `Device::new` registered it with the address of its counter.
    let counter = unsafe { &*counter.cast::<AtomicIsize>() };
    counter.fetch_add(bytes, Ordering::Relaxed);
    true
}
