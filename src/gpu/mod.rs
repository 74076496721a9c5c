//! The graphics device: adapter, shaders, struct layouts, readback. Knows no scene and no pass.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};

pub mod layout;
pub mod readback;
pub mod shader;

/// A graphics device, and the first error that it reported.
///
/// Errors of the device cause no panic; [`take_error`](Self::take_error) returns them.
#[derive(Debug)]
pub struct Gpu {
    /// Creates surfaces.
    pub instance: wgpu::Instance,
    pub adapter: wgpu::Adapter,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    faults: Faults,
}

/// Measures GPU times; nothing else depends on it.
const CLOCK: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY;

/// Location of the error on a machine without an adapter.
const GRAPHICS: &str = "graphics";

/// Whether an error says that there is no graphics adapter.
pub fn is_no_adapter(error: &Error) -> bool {
    error.location == GRAPHICS
}

impl Gpu {
    /// A device without a window: on Vulkan if possible, otherwise on any backend of this build.
    ///
    /// # Errors
    /// No adapter, or one that provides no device.
    pub fn headless() -> Result<Self> {
        Self::headless_within(|limits| limits)
    }

    /// [`headless`](Self::headless) with reduced limits, to test smaller devices.
    ///
    /// # Errors
    /// No adapter, or one that provides no device with these limits.
    pub fn headless_within(limits: impl FnOnce(wgpu::Limits) -> wgpu::Limits) -> Result<Self> {
        let vulkan = instance_of(wgpu::Backends::VULKAN);
        if let Ok(adapter) = request_adapter(&vulkan, None) {
            let limits = limits(adapter.limits());
            return Self::from_adapter(vulkan, adapter, limits);
        }
        let any = instance_of(wgpu::Backends::all());
        let adapter = request_adapter(&any, None)?;
        let limits = limits(adapter.limits());
        Self::from_adapter(any, adapter, limits)
    }

    /// A device that draws nothing and keeps what buffers hold, of the size that every browser offers: to gather what a
    /// renderer would send to one. Needs no adapter.
    ///
    /// # Errors
    /// None that is known of.
    pub fn idle() -> Result<Self> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::NOOP;
        descriptor.backend_options.noop.enable = true;
        let instance = wgpu::Instance::new(descriptor);
        let adapter = request_adapter(&instance, None)?;
        Self::from_adapter(instance, adapter, wgpu::Limits::default())
    }

    /// A device with all limits of its adapter, which can present to `surface`. The surface was created by `instance`.
    ///
    /// # Errors
    /// No adapter that can present to it, or one that provides no device.
    pub fn for_surface(instance: wgpu::Instance, surface: &wgpu::Surface<'_>) -> Result<Self> {
        let adapter = request_adapter(&instance, Some(surface))?;
        let limits = adapter.limits();
        Self::from_adapter(instance, adapter, limits)
    }

    /// Requires no optional feature except timestamps, so that what runs here runs everywhere.
    fn from_adapter(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        required_limits: wgpu::Limits,
    ) -> Result<Self> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("nephroid"),
            required_features: adapter.features() & CLOCK,
            required_limits,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
            Error::failure(
                format!("graphics adapter {}", adapter.get_info().name),
                format!("gave no device ({error})"),
                "update its driver, or use --backend cpu",
            )
        })?;
        let faults = Faults::listen_to(&device);
        Ok(Self {
            instance,
            adapter,
            device,
            queue,
            faults,
        })
    }

    /// Name of the adapter and its backend, for messages.
    pub fn adapter_name(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({})", info.name, info.backend)
    }

    /// Whether the device is emulated on the CPU.
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Whether GPU times can be measured.
    pub fn tells_times(&self) -> bool {
        self.device.features().contains(CLOCK)
    }

    pub fn limits(&self) -> wgpu::Limits {
        self.device.limits()
    }

    /// The first error since the last call, if there was one.
    pub fn take_error(&self) -> Option<Error> {
        self.faults.take()
    }

    /// Whether the device is lost: this [`Gpu`] and everything created on it must be replaced.
    pub fn is_lost(&self) -> bool {
        self.faults.is_lost()
    }

    /// Waits until all submitted work is done.
    ///
    /// # Errors
    /// A lost device, or an error that it reported since the last check.
    pub fn wait(&self) -> Result<()> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        if let Some(fault) = self.take_error() {
            return Err(fault);
        }
        polled
            .map(|_| ())
            .map_err(|error| device_error(&error.to_string()))
    }

    /// Checks that a texture of this device can hold a picture or a map; `location` names it in the error.
    ///
    /// # Errors
    /// A side of 0 or above the device's limit.
    pub fn check_texture_size(&self, location: &str, width: u32, height: u32) -> Result<()> {
        let limit = self.limits().max_texture_dimension_2d;
        if (1..=limit).contains(&width) && (1..=limit).contains(&height) {
            return Ok(());
        }
        Err(Error::failure(
            location,
            format!(
                "{width}×{height} does not fit a texture of {}",
                self.adapter_name()
            ),
            format!("choose 1 to {limit} in each direction"),
        ))
    }
}

/// A texture of `[width, height, layers]`, with one mip level and one sample per texel.
pub fn texture_of(
    label: &str,
    [width, height, depth_or_array_layers]: [u32; 3],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureDescriptor<'_> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}

/// A target that a pass clears and keeps.
pub fn cleared(view: &wgpu::TextureView, clear: wgpu::Color) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(clear),
            store: wgpu::StoreOp::Store,
        },
    }
}

fn instance_of(backends: wgpu::Backends) -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    wgpu::Instance::new(descriptor)
}

#[cfg(feature = "gles")]
const BACKENDS: &str = "Vulkan, Metal, Direct3D or OpenGL";
#[cfg(not(feature = "gles"))]
const BACKENDS: &str = "Vulkan, Metal or Direct3D";

fn request_adapter(
    instance: &wgpu::Instance,
    compatible_surface: Option<&wgpu::Surface<'_>>,
) -> Result<wgpu::Adapter> {
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        compatible_surface,
        ..Default::default()
    };
    pollster::block_on(instance.request_adapter(&options)).map_err(|_| {
        Error::failure(
            GRAPHICS,
            format!("no graphics adapter was found by {BACKENDS}"),
            "install a driver (Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1), build with --features gles \
             where there is OpenGL alone, or use --backend cpu",
        )
    })
}

impl Gpu {
    /// A buffer with the given contents, zero-padded to a multiple of four bytes, at least four. On a lost device
    /// nothing is written: the buffer is useless, and [`Gpu::take_error`] tells why.
    pub fn filled_buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let whole = contents.len().max(1) as u64;
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: whole.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage,
            mapped_at_creation: true,
        });
        if let Ok(mut range) = buffer.get_mapped_range_mut(..) {
            range.slice(..contents.len()).copy_from_slice(contents);
        }
        buffer.unmap();
        buffer
    }
}

#[derive(Debug, Default)]
struct State {
    first_error: Option<Error>,
    lost: bool,
}

/// First error and loss of a device, shared between its callbacks and its owner.
#[derive(Clone, Debug, Default)]
struct Faults(Arc<Mutex<State>>);

impl Faults {
    fn listen_to(device: &wgpu::Device) -> Self {
        let faults = Self::default();
        let on_error = faults.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            log::error!("graphics device: {error}");
            on_error.record(device_error(&error.to_string()), false);
        }));
        let on_lost = faults.clone();
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the last handle of a device is not an error.
            if reason != wgpu::DeviceLostReason::Destroyed {
                log::error!("graphics device lost: {message}");
            }
            on_lost.record(device_error(&format!("the device was lost ({message})")), true);
        });
        faults
    }

    fn take(&self) -> Option<Error> {
        self.with(|state| state.first_error.take())
    }

    fn is_lost(&self) -> bool {
        self.with(|state| state.lost)
    }

    fn record(&self, error: Error, lost: bool) {
        self.with(|state| {
            state.lost |= lost;
            // Later errors are mostly consequences of the first one.
            state.first_error.get_or_insert(error);
        });
    }

    fn with<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Joins the lines of a driver's message into one; its last line names the cause.
fn device_error(message: &str) -> Error {
    let lines: Vec<&str> = message
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    Error::failure(
        "graphics device",
        lines.join(" "),
        "close other programs that use it or update its driver, or use --backend cpu",
    )
}
