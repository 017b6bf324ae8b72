//! Devices: which there are, how one is opened, what it may be asked for, and what became of it.
//!
//! Nothing here panics or aborts when a device fails: its first fault is kept, and `Gpu::check` tells it.

/// Names of fields, and where they are.
#[cfg(test)]
macro_rules! offsets {
    ($of:ty: $($field:ident),*) => { [$((stringify!($field), std::mem::offset_of!($of, $field))),*] };
}
#[cfg(test)]
pub(crate) use offsets;

pub(crate) mod arrays;
pub(crate) mod bands;
pub(crate) mod buffers;
pub(crate) mod clock;
pub mod construct;
pub(crate) mod function;
pub(crate) mod lines;
pub(crate) mod raster;
pub(crate) mod rays;
pub(crate) mod scene;
pub(crate) mod second;
pub(crate) mod shader;
pub(crate) mod sort;
pub(crate) mod stretch;
pub(crate) mod table;
#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]
pub(crate) mod testing;

use crate::error::{Error, Result};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, Once, PoisonError};

/// What a frame depends on, apart from the view: each part is handed over again only after it was forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// Cells and all that follows from them.
    Mesh,
    /// Where the points are.
    Points,
    /// The field's values.
    Field,
    /// The transfer function.
    Function,
}

/// Where frames are drawn.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The first real GPU; without one, the CPU. The environment variable `HALITE_DEVICE` overrides it.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// An adapter, by its index, its UUID or a part of its name (in any case).
    Named(String),
}

impl DeviceChoice {
    /// "auto", "cpu", or the index, UUID or part of the name of an adapter.
    pub fn parse(text: &str) -> Self {
        match text.trim().to_ascii_lowercase().as_str() {
            "" | "auto" => DeviceChoice::Auto,
            "cpu" => DeviceChoice::Cpu,
            _ => DeviceChoice::Named(text.trim().to_owned()),
        }
    }

    /// This choice, or that of `HALITE_DEVICE` if this is [`DeviceChoice::Auto`].
    pub fn or_environment(self) -> Self {
        match (self, std::env::var("HALITE_DEVICE")) {
            (DeviceChoice::Auto, Ok(text)) => DeviceChoice::parse(&text),
            (choice, _) => choice,
        }
    }
}

/// What is known of an adapter before it is opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// What [`DeviceChoice::Named`] may call it.
    pub index: usize,
    /// The driver's name for it.
    pub name: String,
    /// 32 hexadecimal digits in groups; empty if the driver tells none.
    pub uuid: String,
    /// "discrete GPU", "integrated GPU", "virtual GPU", "CPU" or "other".
    pub kind: &'static str,
    /// Name and version of the driver.
    pub driver: String,
    /// What it lacks to be of use to Halite; none if it lacks nothing.
    pub lacks: Option<String>,
}

impl Description {
    /// Whether it is a driver in software, which draws on the CPU.
    pub fn is_software(&self) -> bool {
        self.kind == SOFTWARE
    }
}

/// The kind of drivers in software.
const SOFTWARE: &str = "CPU";

/// Features without which an adapter is of no use: none beyond compute shaders and [`LIMITS`].
const REQUIRED: wgpu::Features = wgpu::Features::empty();

/// Features that are used where there are any.
const OPTIONAL: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
    .union(wgpu::Features::PIPELINE_STATISTICS_QUERY)
    .union(wgpu::Features::FLOAT32_BLENDABLE)
    .union(wgpu::Features::FLOAT32_FILTERABLE)
    .union(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM);

/// Storage buffers per shader and bytes per storage buffer without which an adapter is of no use.
const LIMITS: (u32, u64) = (16, 128 << 20);

/// The devices of this machine that Vulkan, Metal or Direct3D 12 know.
pub fn devices() -> Vec<Description> {
    adapters().iter().enumerate().map(|(i, a)| describe(i, a)).collect()
}

fn adapters() -> Vec<wgpu::Adapter> {
    let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    pollster::block_on(wgpu::Instance::new(descriptor).enumerate_adapters(backends))
}

fn describe(index: usize, adapter: &wgpu::Adapter) -> Description {
    let info = adapter.get_info();
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => SOFTWARE,
        wgpu::DeviceType::Other => "other",
    };
    let (limits, missing) = (adapter.limits(), REQUIRED - adapter.features());
    let lacks = if !missing.is_empty() {
        Some(format!("it lacks {missing}"))
    } else if limits.max_storage_buffers_per_shader_stage < LIMITS.0 {
        Some(format!("it binds {} buffers, not {}", limits.max_storage_buffers_per_shader_stage, LIMITS.0))
    } else if limits.max_storage_buffer_binding_size < LIMITS.1 {
        Some(format!("it binds buffers of {} bytes, not {}", limits.max_storage_buffer_binding_size, LIMITS.1))
    } else {
        None
    };
    let driver = format!("{} {}", info.driver, info.driver_info).trim().to_owned();
    Description { index, name: info.name, uuid: uuid(adapter), kind, driver, lacks }
}

/// The adapter's UUID, which wgpu itself does not tell; empty where Vulkan is not what drives it.
#[cfg(any(windows, all(unix, not(target_vendor = "apple"))))]
#[allow(unsafe_code, reason = "wgpu's own handles, asked through ash")]
fn uuid(adapter: &wgpu::Adapter) -> String {
    let mut id = ash::vk::PhysicalDeviceIDProperties::default();
    let mut properties = ash::vk::PhysicalDeviceProperties2::default().push_next(&mut id);
    // SAFETY: `hal` keeps instance and physical device alive, and nothing of theirs is changed or destroyed.
    unsafe {
        let Some(hal) = adapter.as_hal::<wgpu::hal::api::Vulkan>() else { return String::new() };
        let instance = hal.shared_instance().raw_instance();
        instance.get_physical_device_properties2(hal.raw_physical_device(), &mut properties);
    }
    let digits: String = id.device_uuid.iter().map(|b| format!("{b:02x}")).collect();
    [&digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..]].join("-")
}

#[cfg(not(any(windows, all(unix, not(target_vendor = "apple")))))]
fn uuid(_: &wgpu::Adapter) -> String {
    String::new()
}

/// An open device, with what was allocated on it and what went wrong.
#[derive(Debug)]
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// The adapter that it is.
    pub(crate) adapter: Description,
    /// Bytes that may be allocated; our own limit, as some drivers promise more than there is.
    pub(crate) budget: u64,
    /// Bytes that one binding of an array may have, at most; tests lower it.
    pub(crate) binding: u64,
    allocated: Arc<AtomicU64>,
    uploaded: AtomicU64,
    fault: Arc<Mutex<Option<DeviceFault>>>,
}

/// What went wrong first.
#[derive(Debug, Clone)]
enum DeviceFault {
    Lost(String),
    OutOfMemory,
    Refused(String),
}

impl Gpu {
    /// Opens what `choice` says; none if that is the CPU, or there is no GPU (which is said) and none was named.
    ///
    /// # Errors
    /// [`Error::Device`] if no adapter bears the name, it is of no use, or it cannot be opened.
    pub(crate) fn open(choice: &DeviceChoice) -> Result<Option<Self>> {
        let name = match choice {
            DeviceChoice::Cpu => return Ok(None),
            DeviceChoice::Auto => None,
            DeviceChoice::Named(name) => Some(name.to_ascii_lowercase()),
        };
        let all: Vec<_> = adapters().into_iter().enumerate().map(|(i, a)| (describe(i, &a), a)).collect();
        let known = all.iter().map(|(d, _)| format!("{} ({})", d.index, d.name)).collect::<Vec<_>>().join(", ");
        let found = all.into_iter().find(|(d, _)| match &name {
            None => !d.is_software() && d.lacks.is_none(),
            Some(n) => match n.parse::<usize>() {
                Ok(index) => d.index == index,
                Err(_) => d.name.to_ascii_lowercase().contains(n) || (!d.uuid.is_empty() && d.uuid == *n),
            },
        });
        match (found, choice) {
            (None, DeviceChoice::Named(name)) => {
                let there = if known.is_empty() { "there is none".into() } else { format!("there is {known}") };
                Err(Error::Device(format!("no device is called \"{name}\": {there}, and \"cpu\"")))
            }
            (None, _) => {
                let found = if known.is_empty() { "none".into() } else { known };
                static SAID: Once = Once::new();
                SAID.call_once(|| tracing::info!("drawing on the CPU: no GPU of use was found (found: {found})"));
                Ok(None)
            }
            (Some((Description { name, lacks: Some(lacks), .. }, _)), _) => {
                Err(Error::Device(format!("{name} cannot be used: {lacks}")))
            }
            (Some((description, adapter)), _) => Self::on(&adapter, description).map(Some),
        }
    }

    fn on(adapter: &wgpu::Adapter, description: Description) -> Result<Self> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("halite"),
            required_features: REQUIRED | (OPTIONAL & adapter.features()),
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Device(format!("{} cannot be opened: {e}", description.name)))?;
        let fault = Arc::new(Mutex::new(None));
        let keep = |fault: &Arc<Mutex<Option<DeviceFault>>>| {
            let fault = Arc::clone(fault);
            move |new: DeviceFault| {
                let mut fault = fault.lock().unwrap_or_else(PoisonError::into_inner);
                // A loss explains everything else.
                if fault.is_none() || matches!(new, DeviceFault::Lost(_)) {
                    *fault = Some(new);
                }
            }
        };
        let (kept, lost) = (keep(&fault), keep(&fault));
        device.on_uncaptured_error(Arc::new(move |error| {
            kept(match error {
                wgpu::Error::OutOfMemory { .. } => DeviceFault::OutOfMemory,
                wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
                    DeviceFault::Refused(description)
                }
            });
        }));
        device
            .set_device_lost_callback(move |reason, message| lost(DeviceFault::Lost(format!("{reason:?}: {message}"))));
        // Half of the main memory for a device that is the CPU; real ones tell when they have no more.
        let budget = if description.is_software() { main_memory() / 2 } else { u64::MAX };
        let limits = device.limits();
        Ok(Gpu {
            binding: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            device,
            queue,
            adapter: description,
            budget,
            allocated: Arc::default(),
            uploaded: AtomicU64::new(0),
            fault,
        })
    }

    /// What went wrong since the device was opened.
    ///
    /// # Errors
    /// [`Error::Lost`] if the device is gone, [`Error::Device`] if it has no more memory or refused a call.
    pub(crate) fn check(&self) -> Result<()> {
        let fault = || self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        if fault().is_some() {
            // A lost device refuses calls before it says that it is lost, which it does when polled.
            let _ = self.device.poll(wgpu::PollType::Poll);
        }
        let mut fault = fault();
        let name = &self.adapter.name;
        match fault.clone() {
            None => Ok(()),
            Some(DeviceFault::Lost(why)) => Err(Error::Lost(format!("{name} was lost ({why})"))),
            Some(DeviceFault::OutOfMemory) => {
                *fault = None;
                let bytes = self.allocated();
                Err(Error::Device(format!(
                    "{name} has not enough memory for the {bytes} bytes that are needed in all; use a smaller picture, another \
                     device, or \"cpu\""
                )))
            }
            Some(DeviceFault::Refused(what)) => {
                *fault = None;
                Err(Error::Device(format!("{name} refused a call: {what}")))
            }
        }
    }

    /// Bytes allocated now.
    pub(crate) fn allocated(&self) -> u64 {
        self.allocated.load(Relaxed)
    }

    /// Bytes handed to the device since it was opened.
    pub(crate) fn uploaded(&self) -> u64 {
        self.uploaded.load(Relaxed)
    }

    /// Waits until all work is done and its callbacks were called.
    ///
    /// # Errors
    /// Those of [`Self::check`].
    pub(crate) fn wait(&self) -> Result<()> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        polled.map(drop).map_err(|e| Error::Lost(format!("{} does not answer: {e}", self.adapter.name)))
    }
}

/// Bytes of main memory, or 8 GiB where the system does not say.
fn main_memory() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("MemTotal:")?.trim().strip_suffix("kB"));
    line.and_then(|kb| kb.trim().parse::<u64>().ok()).map_or(8 << 30, |kb| kb << 10)
}
