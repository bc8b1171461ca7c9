//! The machine that a figure was measured on, in words.

use sysinfo::System;

/// Processor, cores, memory and system.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Processor's name as the system gives it.
    pub processor: String,
    /// Logical cores this process may use.
    pub cores: usize,
    /// Bytes.
    pub total_memory: u64,
    /// Bytes that a new allocation can expect to get.
    pub available_memory: u64,
    /// Operating system and version.
    pub system: String,
}

impl Machine {
    /// Asks the system.
    pub fn read() -> Self {
        let mut system = System::new();
        system.refresh_memory();
        system.refresh_cpu_all();
        Self {
            processor: system
                .cpus()
                .first()
                .map(|cpu| cpu.brand().trim().to_owned())
                .filter(|name| !name.is_empty())
                .unwrap_or_else(|| "unknown processor".to_owned()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            total_memory: system.total_memory(),
            available_memory: system.available_memory(),
            system: System::long_os_version().unwrap_or_else(|| std::env::consts::OS.to_owned()),
        }
    }

    /// One line.
    pub fn summary(&self) -> String {
        format!(
            "{}, {} cores, {:.1} GiB, {}",
            self.processor,
            self.cores,
            self.total_memory as f64 / (1u64 << 30) as f64,
            self.system
        )
    }
}
