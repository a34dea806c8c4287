//! Graphics processors of NVIDIA, through their driver, which is loaded at run time.
//!
//! The driver compiles the kernels from PTX (`rust-core/gpu/ptx`). Tests have no device; `rust-core/gpu/measure run` checks this file on one.

#![allow(unsafe_code)]

use std::collections::HashMap;
use std::ffi::{CStr, CString, c_void};
use std::path::{Path, PathBuf};

use cudarc::driver::result::{ctx, device, event, free_sync, init, launch_kernel, malloc_sync, mem_get_info, module};
use cudarc::driver::result::{memcpy_dtoh_sync, memcpy_htod_sync, primary_ctx, stream};
use cudarc::driver::{DriverError, sys};

use super::{Address, Device, DeviceError, Kernel};
use crate::arguments::Launch;

const NO_FLAGS: sys::CUevent_wait_flags = sys::CUevent_wait_flags::CU_EVENT_WAIT_DEFAULT;

/// Name of the environment variable with the file of the kernels.
const KERNELS: &str = "CONCORDEM_KERNELS";

/// A graphics processor.
pub struct Cuda {
    device: sys::CUdevice,
    context: sys::CUcontext,
    module: sys::CUmodule,
    functions: HashMap<String, sys::CUfunction>,
    name: String,
    /// Where the sums run, beside the next step.
    beside: sys::CUstream,
    /// The step is complete but for its sums; the sums of the last even and odd step are complete.
    moved: sys::CUevent,
    summed: [sys::CUevent; 2],
}

// Safety: handles of the driver, which any thread may use after it has made the context current. A shared reference only reads.
unsafe impl Send for Cuda {}
unsafe impl Sync for Cuda {}

impl Cuda {
    /// The first graphics processor, with the kernels of the file that `CONCORDEM_KERNELS` names, or of `concordem.ptx` beside the
    /// program, or of the build.
    ///
    /// # Errors
    /// There is no driver, no graphics processor, or no file of kernels.
    pub fn open() -> Result<Self, DeviceError> {
        // Safety: loads a library and forgets it. Without this test the first call would panic.
        if !unsafe { sys::is_culib_present() } {
            let text = "the driver of NVIDIA's graphics processors (libcuda.so) cannot be loaded; install it, or run without --device gpu";
            return Err(DeviceError(text.to_owned()));
        }
        let kernels = std::fs::read(kernels()?).map_err(|error| DeviceError(format!("the kernels: {error}")))?;
        let image = CString::new(kernels).map_err(|_| DeviceError("the file of the kernels is damaged".to_owned()))?;
        init().map_err(|error| fault("there is no graphics processor", error))?;
        let none = |error| fault("there is no graphics processor", error);
        let device = device::get(0).map_err(none)?;
        // Safety: the device exists; the context is current before its use, and is released in `drop`.
        unsafe {
            let context = primary_ctx::retain(device).map_err(none)?;
            ctx::set_current(context).map_err(none)?;
            let module = module::load_data(image.as_ptr().cast()).map_err(|error| fault("the kernels", error))?;
            let name = device::get_name(device).map_err(none)?;
            let flags = sys::CUevent_flags::CU_EVENT_DISABLE_TIMING;
            let event = || event::create(flags).map_err(|error| fault("an event", error));
            let beside = stream::create(stream::StreamKind::NonBlocking).map_err(|error| fault("a stream", error))?;
            let (moved, summed) = (event()?, [event()?, event()?]);
            Ok(Self { device, context, module, functions: HashMap::new(), name, beside, moved, summed })
        }
    }

    /// Make the context current in this thread.
    fn enter(&self) -> Result<(), DeviceError> {
        // Safety: the context lives as long as this value.
        unsafe { ctx::set_current(self.context) }.map_err(|error| fault("the context", error))
    }

    /// Wait for the sums.
    fn wait(&self) -> Result<(), DeviceError> {
        self.enter()?;
        // Safety: the stream lives as long as this value.
        unsafe { stream::synchronize(self.beside) }.map_err(|error| fault("the steps on the device", error))
    }

    fn function(&mut self, kernel: Kernel) -> Result<sys::CUfunction, DeviceError> {
        let entry = kernel.entry();
        if let Some(function) = self.functions.get(&entry) {
            return Ok(*function);
        }
        let name = CString::new(&entry[..]).map_err(|_| DeviceError(format!("the kernel {entry}")))?;
        // Safety: the module is loaded.
        let function = unsafe { module::get_function(self.module, name) };
        let function = function.map_err(|error| fault(&format!("the kernel {entry}"), error))?;
        self.functions.insert(entry, function);
        Ok(function)
    }
}

impl Device for Cuda {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn peak_bandwidth(&self) -> Option<f64> {
        use sys::CUdevice_attribute as Attribute;
        // Safety: the device exists.
        let of = |attribute| unsafe { device::get_attribute(self.device, attribute) }.ok();
        let kilohertz = of(Attribute::CU_DEVICE_ATTRIBUTE_MEMORY_CLOCK_RATE)?;
        let bits = of(Attribute::CU_DEVICE_ATTRIBUTE_GLOBAL_MEMORY_BUS_WIDTH)?;
        // Two transfers in each cycle.
        Some(2.0 * 1e3 * f64::from(kilohertz) * f64::from(bits) / 8.0)
    }

    fn allocate(&mut self, bytes: usize) -> Result<Address, DeviceError> {
        self.enter()?;
        // Safety: the context is current. Arrays are aligned to 256 bytes.
        unsafe { malloc_sync(bytes.max(16)) }.map_err(|error| {
            let (free, total) = mem_get_info().unwrap_or_default();
            let text = format!(
                "no {bytes} bytes are free on {} ({free} of {total} are); take fewer particles, or run without --device gpu",
                self.name
            );
            fault(&text, error)
        })
    }

    fn free(&mut self, array: Address) {
        // Safety: the array is one of `allocate`, and no longer used. A failure would be one of an earlier call, which is reported there.
        let _ = self.wait().map(|()| unsafe { free_sync(array) });
    }

    fn upload(&mut self, array: Address, bytes: &[std::mem::MaybeUninit<u8>]) -> Result<(), DeviceError> {
        if bytes.is_empty() {
            return Ok(());
        }
        self.wait()?;
        // Safety: the array is as long.
        unsafe { memcpy_htod_sync(array, bytes) }.map_err(|error| fault("a copy to the device", error))
    }

    fn download(&mut self, array: Address, bytes: &mut [u8]) -> Result<(), DeviceError> {
        if bytes.is_empty() {
            return Ok(());
        }
        self.wait()?;
        // Safety: the array is as long. The copy waits for the launches before it, because all but the sums use the same stream.
        unsafe { memcpy_dtoh_sync(bytes, array) }.map_err(|error| fault("a copy from the device", error))
    }

    fn launch(
        &mut self,
        kernel: Kernel,
        threads: usize,
        arguments: Address,
        launch: Launch,
    ) -> Result<(), DeviceError> {
        if threads == 0 {
            return Ok(());
        }
        self.enter()?;
        let function = self.function(kernel)?;
        let block = kernel.block();
        let blocks = threads.div_ceil(block);
        let blocks = u32::try_from(blocks).map_err(|_| DeviceError(format!("{threads} threads are too many")))?;
        let Launch { mut step, mut from, mut sample, mut serial } = launch;
        let mut arguments = arguments;
        let numbers = [&raw mut step, &raw mut from, &raw mut sample, &raw mut serial];
        let [step, from, sample, serial] = numbers.map(<*mut u32>::cast);
        let mut parameters: [*mut c_void; 5] = [(&raw mut arguments).cast(), step, from, sample, serial];
        let sums = kernel == Kernel::Sums;
        let (main, summed) = (std::ptr::null_mut(), self.summed[launch.parity()]);
        let stream = if sums { self.beside } else { main };
        // Safety: the kernel has these parameters, and its arguments lie on the device. The sums wait for their step, and the step after
        // the next one for the sums.
        let launched = unsafe {
            if sums {
                event::record(self.moved, main).and_then(|()| stream::wait_event(stream, self.moved, NO_FLAGS))
            } else {
                stream::wait_event(stream, summed, NO_FLAGS)
            }
            .and_then(|()| launch_kernel(function, (blocks, 1, 1), (block as u32, 1, 1), 0, stream, &mut parameters))
            .and_then(|()| if sums { event::record(summed, stream) } else { Ok(()) })
        };
        launched.map_err(|error| fault(&format!("the kernel {}", kernel.entry()), error))
    }
}

impl Drop for Cuda {
    fn drop(&mut self) {
        // Safety: nothing uses them any more. Failures have no consequence at the end.
        unsafe {
            let _ = ctx::set_current(self.context);
            let _ = stream::synchronize(self.beside).and_then(|()| stream::destroy(self.beside));
            for event in [self.moved, self.summed[0], self.summed[1]] {
                let _ = event::destroy(event);
            }
            let _ = module::unload(self.module);
            let _ = primary_ctx::release(self.device);
        }
    }
}

/// The file of the kernels.
fn kernels() -> Result<PathBuf, DeviceError> {
    if let Some(path) = std::env::var_os(KERNELS) {
        return Ok(PathBuf::from(path));
    }
    let program = std::env::current_exe().unwrap_or_default();
    let folder = program.parent().unwrap_or(Path::new("."));
    let places = [folder.join("concordem.ptx"), folder.join("../ptx/concordem.ptx")];
    places.into_iter().find(|path| path.exists()).ok_or_else(|| {
        DeviceError(format!(
            "there are no kernels: compile them with `make ptx`, and put target/ptx/concordem.ptx beside the program, or name the \
             file in the environment variable {KERNELS}"
        ))
    })
}

/// An error of the driver in words.
fn fault(what: &str, error: DriverError) -> DeviceError {
    let text = error.error_string().map(CStr::to_string_lossy);
    let text = text.map_or_else(|_| format!("{:?}", error.0), std::borrow::Cow::into_owned);
    DeviceError(format!("{what}: {text}"))
}
