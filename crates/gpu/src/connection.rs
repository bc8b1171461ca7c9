//! An open device: what is made on it, and what goes wrong on it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::adapters::Adapter;
use crate::error::Error;

/// The shaders by name: what is compiled, and what a test validates without any adapter.
pub(crate) const SHADERS: [(&str, &str); 4] = [
    (
        "multiply, 32-bit compliance",
        concat!(
            include_str!("shaders/f32.wgsl"),
            include_str!("shaders/multiply.wgsl")
        ),
    ),
    (
        "multiply, 16-bit compliance",
        concat!(
            include_str!("shaders/f16.wgsl"),
            include_str!("shaders/multiply.wgsl")
        ),
    ),
    ("reduce", include_str!("shaders/reduce.wgsl")),
    ("copy", include_str!("shaders/copy.wgsl")),
];
pub(crate) const REDUCE: usize = 2;
pub(crate) const COPY: usize = 3;

/// An open device: its queue, its name, and the first fault that was reported on it.
#[derive(Clone, Debug)]
pub struct Connection {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) name: String,
    is_software: bool,
    fault: Arc<Mutex<Option<Error>>>,
}

impl Connection {
    /// Opens a device of an adapter, with the adapter's own limits for storage.
    ///
    /// # Errors
    /// [`Error::Refused`] where the driver does not give one.
    pub fn open(adapter: &Adapter) -> Result<Self, Error> {
        let limits = adapter.adapter.limits();
        let asked = wgpu::DeviceDescriptor {
            label: Some("snapin"),
            required_limits: wgpu::Limits {
                max_storage_buffer_binding_size: limits.max_storage_buffer_binding_size,
                max_buffer_size: limits.max_buffer_size,
                ..wgpu::Limits::downlevel_defaults()
            },
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..wgpu::DeviceDescriptor::default()
        };
        let name = adapter.name();
        let (device, queue) =
            pollster::block_on(adapter.adapter.request_device(&asked)).map_err(|e| {
                Error::Refused {
                    adapter: name.clone(),
                    reason: e.to_string(),
                }
            })?;
        let connection = Self::shared(device, queue, name, adapter.is_software());
        let fault = Arc::clone(&connection.fault);
        let adapter = connection.name.clone();
        // Without this an error ends the program.
        connection
            .device
            .on_uncaptured_error(Arc::new(move |error| {
                note(&fault, named(&adapter, &error, 0));
            }));
        let fault = Arc::clone(&connection.fault);
        let adapter = connection.name.clone();
        connection
            .device
            .set_device_lost_callback(move |_, reason| {
                note(
                    &fault,
                    Error::DeviceLost {
                        adapter: adapter.clone(),
                        reason,
                    },
                );
            });
        Ok(connection)
    }

    /// A device that somebody else opened: the viewer's, which then draws what is computed without a copy. Faults
    /// outside the multiply are for its owner to catch.
    pub fn shared(
        device: wgpu::Device,
        queue: wgpu::Queue,
        name: String,
        is_software: bool,
    ) -> Self {
        Self {
            device,
            queue,
            name,
            is_software,
            fault: Arc::default(),
        }
    }

    pub(crate) fn is_software(&self) -> bool {
        self.is_software
    }

    /// Runs `make` and gives the error that the device reported meanwhile.
    pub(crate) fn scoped<T>(&self, bytes: u64, make: impl FnOnce() -> T) -> Result<T, Error> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let made = make();
        let refused = pollster::block_on(validation.pop());
        let refused = pollster::block_on(memory.pop()).or(refused);
        match refused {
            Some(error) => Err(named(&self.name, &error, bytes)),
            None => self.check().map(|()| made),
        }
    }

    /// The first fault reported on the device.
    pub(crate) fn check(&self) -> Result<(), Error> {
        match &*self.fault.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error.clone()),
            None => Ok(()),
        }
    }

    /// Waits until a submission is done.
    pub(crate) fn wait(
        &self,
        submission: wgpu::SubmissionIndex,
        most: Duration,
    ) -> Result<(), Error> {
        let polled = self.device.poll(wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: Some(most),
        });
        self.check()?;
        match polled {
            Ok(_) => Ok(()),
            Err(wgpu::PollError::Timeout) => Err(Error::TimedOut {
                adapter: self.name.clone(),
                milliseconds: most.as_millis() as u64,
            }),
            Err(error) => Err(self.refused(error.to_string())),
        }
    }

    pub(crate) fn refused(&self, reason: String) -> Error {
        Error::Refused {
            adapter: self.name.clone(),
            reason,
        }
    }

    pub(crate) fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    pub(crate) fn pipeline(
        &self,
        shader: usize,
        entry: &str,
        layout: &wgpu::BindGroupLayout,
    ) -> wgpu::ComputePipeline {
        let (name, text) = SHADERS[shader];
        let module = self
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
        let layout = self
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(name),
                bind_group_layouts: &[Some(layout)],
                immediate_size: 0,
            });
        self.device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
    }

    pub(crate) fn bind_group_layout(
        &self,
        bindings: &[wgpu::BufferBindingType],
    ) -> wgpu::BindGroupLayout {
        let entries: Vec<_> = (0..)
            .zip(bindings)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: *ty,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        self.device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: None,
                entries: &entries,
            })
    }

    pub(crate) fn bind(
        &self,
        layout: &wgpu::BindGroupLayout,
        buffers: &[&wgpu::Buffer],
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
    }
}

fn note(fault: &Mutex<Option<Error>>, error: Error) {
    let mut fault = fault.lock().unwrap_or_else(PoisonError::into_inner);
    // The first one is the cause; a lost device is then said by every call.
    fault.get_or_insert(error);
}

fn named(adapter: &str, error: &wgpu::Error, bytes: u64) -> Error {
    // One line of what are several.
    let text = error.to_string();
    let words: Vec<&str> = text.split_whitespace().collect();
    let (adapter, reason) = (adapter.to_owned(), words.join(" "));
    match error {
        wgpu::Error::OutOfMemory { .. } => Error::OutOfMemory {
            adapter,
            bytes,
            reason,
        },
        _ => Error::Refused { adapter, reason },
    }
}

pub(crate) const STORAGE: wgpu::BufferBindingType =
    wgpu::BufferBindingType::Storage { read_only: false };
pub(crate) const READ_ONLY: wgpu::BufferBindingType =
    wgpu::BufferBindingType::Storage { read_only: true };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_the_driver_are_told_apart_in_one_line() {
        let memory = wgpu::Error::OutOfMemory {
            source: "heap".into(),
        };
        let memory = named("adapter", &memory, 7);
        assert!(matches!(memory, Error::OutOfMemory { bytes: 7, .. }));
        assert!(
            memory
                .to_string()
                .contains("no memory for a compliance of 7 bytes")
        );
        let validation = wgpu::Error::Validation {
            source: "cause".into(),
            description: "a\n  b".to_owned(),
        };
        let refused = named("adapter", &validation, 7).to_string();
        assert!(
            refused.starts_with("adapter refused the work: "),
            "{refused}"
        );
        assert!(refused.ends_with("a b"), "{refused}");
    }
}
