//! Which graphics adapters are there, and which of them is asked first.

use std::fmt;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

use crate::error::Error;

/// A driver that is asked what it has does not answer at all after this time.
const SEARCH: Duration = Duration::from_secs(20);

/// Share of an adapter's memory, %, from which buffers are refused: an upload beyond it would push out what else runs
/// there. Where the driver does not tell its memory, it refuses when it has none left.
const MOST_MEMORY: u8 = 95;

/// Where Linux shows graphics adapters: all but NVIDIA's; NVIDIA's; those of Windows below it; of phones and boards.
const DEVICES: [&str; 5] = [
    "/dev/dri/renderD",
    "/dev/nvidia",
    "/dev/dxg",
    "/dev/kgsl-3d",
    "/dev/mali",
];

/// Whether the system has a device of a graphics adapter, or does not show whether it has.
fn has_device() -> bool {
    let is_named = |name: &str| std::env::var_os(name).is_some();
    if !cfg!(target_os = "linux") || is_named("WGPU_BACKEND") || is_named("WGPU_ADAPTER_NAME") {
        return true;
    }
    DEVICES.iter().any(|device| {
        let (folder, begin) = device.rsplit_once('/').unwrap_or(("/", device));
        std::fs::read_dir(folder).is_ok_and(|entries| {
            entries
                .filter_map(Result::ok)
                .any(|entry| entry.file_name().to_string_lossy().starts_with(begin))
        })
    })
}

/// A graphics adapter of this machine.
#[derive(Clone, Debug)]
pub struct Adapter {
    pub(crate) adapter: wgpu::Adapter,
    info: wgpu::AdapterInfo,
}

impl Adapter {
    /// Name and way to it, for people: `NVIDIA H100 (Vulkan)`.
    pub fn name(&self) -> String {
        format!("{} ({})", self.info.name, backend_name(self.info.backend))
    }

    /// What a measurement on this adapter is remembered by: name, way to it and driver with its version.
    pub fn key(&self) -> String {
        format!(
            "{}, {} {}",
            self.name(),
            self.info.driver,
            self.info.driver_info
        )
    }

    /// Whether it is the processor that plays a graphics adapter.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether its shaders can unpack 16-bit numbers.
    pub(crate) fn unpacks_16_bits(&self) -> bool {
        let flags = self.adapter.get_downlevel_capabilities().flags;
        flags.contains(wgpu::DownlevelFlags::SHADER_F16_IN_F32)
    }

    /// Bytes that one binding of a shader can reach. A larger compliance is split.
    pub fn binding_limit(&self) -> u64 {
        let limits = self.adapter.limits();
        limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size)
    }

    /// Bytes of one buffer at most.
    pub fn buffer_limit(&self) -> u64 {
        self.adapter.limits().max_buffer_size
    }
}

/// What a search has found.
#[derive(Clone, Debug)]
pub struct Adapters {
    /// Best first: real ones before software, discrete before integrated, Vulkan, Metal and Direct3D before OpenGL.
    pub list: Vec<Adapter>,
    looked_for: String,
}

impl Adapters {
    /// Asks the drivers of this machine. The environment variables `WGPU_BACKEND` (`vulkan`, `gl`, ...) and
    /// `WGPU_ADAPTER_NAME` (part of a name) narrow the search.
    pub fn find() -> Self {
        Self::find_within(MOST_MEMORY)
    }

    /// As [`Adapters::find`] for who wants none in software: drivers are not asked where the system has no device of a
    /// graphics adapter, as on most servers. That takes a tenth of a second, and some drivers complain on the error
    /// stream that nobody is logged in.
    pub fn find_hardware() -> Self {
        if has_device() {
            return Self::find();
        }
        Self {
            list: Vec::new(),
            looked_for: format!("looked for {}", DEVICES.join(", ")),
        }
    }

    /// The same, with buffers refused from a share of the memory on, %.
    pub(crate) fn find_within(most_memory: u8) -> Self {
        // A driver can hang; the search then ends without it.
        let (send, receive) = sync_channel(1);
        let search = move || {
            let _ = send.send(search(most_memory));
        };
        let spawned = std::thread::Builder::new()
            .name("snapin-adapters".to_owned())
            .spawn(search);
        let nothing = |why: String| Self {
            list: Vec::new(),
            looked_for: why,
        };
        match spawned.map(|_| receive.recv_timeout(SEARCH)) {
            Ok(Ok(found)) => found,
            Ok(Err(RecvTimeoutError::Timeout)) => {
                nothing(format!("the drivers did not answer within {SEARCH:?}"))
            }
            Ok(Err(RecvTimeoutError::Disconnected)) => {
                nothing("a driver failed while it was asked".to_owned())
            }
            Err(error) => nothing(format!("no thread to ask the drivers in: {error}")),
        }
    }

    /// The one to use; software adapters only if they are `allowed`.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] where there is none.
    pub fn best(&self, software_allowed: bool) -> Result<&Adapter, Error> {
        self.list
            .iter()
            .find(|adapter| software_allowed || !adapter.is_software())
            .ok_or_else(|| Error::NoAdapter {
                looked_for: self.to_string(),
            })
    }
}

impl fmt::Display for Adapters {
    /// What was looked for and what was found.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.looked_for)?;
        for (k, adapter) in self.list.iter().enumerate() {
            let before = if k == 0 { ", found " } else { ", " };
            let kind = if adapter.is_software() {
                ", software"
            } else {
                ""
            };
            write!(f, "{before}{}{kind}", adapter.name())?;
        }
        if self.list.is_empty() {
            f.write_str(", found none")?;
        }
        Ok(())
    }
}

fn search(most_memory: u8) -> Adapters {
    let mut asked = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    asked.memory_budget_thresholds.for_resource_creation = Some(most_memory);
    let backends = asked.backends;
    let instance = wgpu::Instance::new(asked);
    let wanted = std::env::var("WGPU_ADAPTER_NAME").ok();
    let mut list: Vec<Adapter> = pollster::block_on(instance.enumerate_adapters(backends))
        .into_iter()
        .map(|adapter| Adapter {
            info: adapter.get_info(),
            adapter,
        })
        .filter(|adapter| match &wanted {
            Some(part) => adapter
                .info
                .name
                .to_lowercase()
                .contains(&part.to_lowercase()),
            None => true,
        })
        .filter(|adapter| {
            let flags = adapter.adapter.get_downlevel_capabilities().flags;
            flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        })
        .collect();
    list.sort_by_key(|adapter| {
        (
            rank(adapter.info.device_type),
            adapter.info.backend == wgpu::Backend::Gl,
        )
    });
    let names: Vec<&str> = [
        wgpu::Backend::Vulkan,
        wgpu::Backend::Metal,
        wgpu::Backend::Dx12,
        wgpu::Backend::Gl,
    ]
    .into_iter()
    .filter(|backend| {
        backends.contains((*backend).into())
            && wgpu::Instance::enabled_backend_features().contains((*backend).into())
    })
    .map(backend_name)
    .collect();
    let of_name = wanted.map_or_else(String::new, |part| {
        format!(" named {part:?} (WGPU_ADAPTER_NAME)")
    });
    let names = if names.is_empty() {
        // What WGPU_BACKEND names is not there on this system.
        "nothing (WGPU_BACKEND)".to_owned()
    } else {
        names.join(", ")
    };
    Adapters {
        list,
        looked_for: format!("looked for adapters of {names}{of_name}"),
    }
}

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn backend_name(backend: wgpu::Backend) -> &'static str {
    match backend {
        wgpu::Backend::Vulkan => "Vulkan",
        wgpu::Backend::Metal => "Metal",
        wgpu::Backend::Dx12 => "Direct3D 12",
        wgpu::Backend::Gl => "OpenGL",
        wgpu::Backend::BrowserWebGpu => "WebGPU",
        wgpu::Backend::Noop => "none",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_looked_for_is_named() {
        let nothing = Adapters {
            list: Vec::new(),
            looked_for: format!("looked for {}", DEVICES.join(", ")),
        };
        let error = nothing.best(true).unwrap_err().to_string();
        assert!(
            error.contains("looked for /dev/dri/renderD, /dev/nvidia"),
            "{error}"
        );
        assert!(error.contains("found none"), "{error}");
        // Where it finds any hardware, the other search does too; one in software alone is no hardware.
        let found = Adapters::find_hardware();
        if found.best(false).is_ok() {
            assert!(Adapters::find().best(false).is_ok());
        } else {
            eprintln!("no adapter in hardware: {found}");
            assert!(found.to_string().contains("looked for"));
        }
    }
}
