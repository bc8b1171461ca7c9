//! Where the displacement multiply runs, and why there.
//!
//! `"cpu"`: on the processor, without asking any driver. `"gpu"`: on the best adapter, one in software too, or an
//! error. `"auto"`: on the faster of processor and best real adapter, measured once for each part and remembered
//! (`choice/memory.rs`); what is wrong with an adapter is told, and the processor multiplies.

mod memory;
#[cfg(test)]
mod tests;

use std::path::Path;

use gpu::{
    Adapter, Adapters, Compared, ComplianceMultiply, Gpu, GpuSettings, Guarded, Layout, Storage,
};

use crate::Error;
use crate::machine::Machine;
use crate::scene::{Accuracy, Multiply, MultiplyScalar};
use memory::Memory;

/// A back-end with what is told of it.
pub(crate) enum Multiplier {
    /// On the processor.
    Processor(Box<dyn ComplianceMultiply>),
    /// On an adapter, the processor behind it.
    Guarded(Box<Guarded>),
}

impl Multiplier {
    /// The multiply.
    pub(crate) fn get(&mut self) -> &mut dyn ComplianceMultiply {
        match self {
            Self::Processor(processor) => processor.as_mut(),
            Self::Guarded(guarded) => guarded.as_mut(),
        }
    }

    /// Whether whoever multiplies may wait for a driver.
    pub(crate) fn is_on_gpu(&self) -> bool {
        matches!(self, Self::Guarded(_))
    }

    /// How often the adapter was too late.
    pub(crate) fn n_late(&self) -> u32 {
        match self {
            Self::Processor(_) => 0,
            Self::Guarded(guarded) => guarded.n_late(),
        }
    }
}

/// Where the multiply runs, and why there.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Name of the place with the numbers kept there: `the processor, 64 bits`.
    pub runs_on: String,
    /// Whether that is a graphics adapter.
    pub is_on_gpu: bool,
    /// Why there.
    pub why: Why,
}

/// Why the multiply runs where it does.
#[derive(Clone, Debug, PartialEq)]
pub enum Why {
    /// The scene says so.
    Asked,
    /// The scene asks for 64-bit numbers, which a GPU does not keep.
    Numbers,
    /// The surface is drawn from fetched columns.
    Fetched,
    /// There is no adapter, or none but in software.
    NoAdapter {
        /// What was looked for and what was found.
        looked_for: String,
        /// Whether there are some in software.
        is_software_there: bool,
    },
    /// It is the faster of the two.
    Faster(Race),
    /// The adapter could not be used.
    Failed {
        /// What it said.
        reason: String,
    },
}

impl Why {
    /// Name in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Asked => "asked",
            Self::Numbers => "numbers",
            Self::Fetched => "fetched",
            Self::NoAdapter { .. } => "no_adapter",
            Self::Faster(_) => "faster",
            Self::Failed { .. } => "failed",
        }
    }
}

/// Times of the two back-ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Race {
    /// The adapter's name.
    pub adapter: String,
    /// Contacts of the product.
    pub n_contacts: usize,
    /// Median time on the processor, s.
    pub processor_s: f64,
    /// Median time on the adapter, s.
    pub gpu_s: f64,
    /// Whether it was measured in an earlier run.
    pub is_remembered: bool,
}

impl Choice {
    fn processor(scalar: gpu::Scalar, why: Why) -> Self {
        let bits = match scalar {
            gpu::Scalar::F64 => 64,
            gpu::Scalar::F32 => 32,
        };
        Self {
            runs_on: format!("the processor, {bits} bits"),
            is_on_gpu: false,
            why,
        }
    }

    fn adapter(adapter: &Adapter, storage: Storage, why: Why) -> Self {
        Self {
            runs_on: format!("{}, {} bits", name_of(adapter), 8 * storage.bytes()),
            is_on_gpu: true,
            why,
        }
    }

    /// Where and why, in a short line.
    pub fn words(&self) -> String {
        let why = match &self.why {
            Why::Asked => ", as asked for".to_owned(),
            Why::Numbers => ": a GPU keeps no 64-bit numbers (scalar)".to_owned(),
            Why::Fetched => ": columns are fetched".to_owned(),
            Why::NoAdapter {
                is_software_there: false,
                ..
            } => ": there is no graphics adapter".to_owned(),
            Why::NoAdapter { .. } => ": there is no graphics adapter but in software".to_owned(),
            Why::Faster(race) => self.race_words(race),
            Why::Failed { reason } => format!(", because {reason}"),
        };
        format!("{}{why}", self.runs_on)
    }

    /// The same with what was looked for, where nothing was found.
    pub fn words_in_full(&self) -> String {
        match &self.why {
            Why::NoAdapter { looked_for, .. } => format!("{}; {looked_for}", self.words()),
            _ => self.words(),
        }
    }

    /// What the reader must not miss: an adapter that is there and could not be used.
    pub fn warning(&self) -> Option<String> {
        match &self.why {
            Why::Failed { reason } => Some(format!("{reason}; the processor multiplies instead")),
            _ => None,
        }
    }

    fn race_words(&self, race: &Race) -> String {
        let (won, lost, other) = if self.is_on_gpu {
            (race.gpu_s, race.processor_s, "the processor")
        } else {
            (race.processor_s, race.gpu_s, race.adapter.as_str())
        };
        let ratio = lost / won;
        let digits = if ratio < 9.95 { 1 } else { 0 };
        let when = if race.is_remembered {
            ", measured earlier"
        } else {
            ""
        };
        format!(
            ", {ratio:.digits$} times faster than {other} (for {} contacts: {} ms against {} ms{when})",
            race.n_contacts,
            crate::report::plot::short(1e3 * won),
            crate::report::plot::short(1e3 * lost),
        )
    }
}

/// Numbers that the processor keeps.
pub(crate) fn processor_scalar(scalar: MultiplyScalar) -> gpu::Scalar {
    match scalar {
        MultiplyScalar::Auto | MultiplyScalar::F64 => gpu::Scalar::F64,
        MultiplyScalar::F32 | MultiplyScalar::F16 => gpu::Scalar::F32,
    }
}

/// Numbers that a GPU keeps.
fn storage(scalar: MultiplyScalar) -> Storage {
    match scalar {
        MultiplyScalar::Auto | MultiplyScalar::F64 | MultiplyScalar::F32 => Storage::F32,
        MultiplyScalar::F16 => Storage::F16,
    }
}

/// Behind the name of an adapter that the processor plays.
pub(crate) const SOFTWARE: &str = ", software";

/// An adapter's name, which says if it is the processor that plays it.
pub(crate) fn name_of(adapter: &Adapter) -> String {
    let software = if adapter.is_software() { SOFTWARE } else { "" };
    format!("{}{software}", adapter.name())
}

/// The multiply of a compliance, blocks as in [`Layout`], where `accuracy` wants it. `folder`: of what was measured
/// before; `None`: it is measured anew.
///
/// # Errors
/// A compliance that the multiply refuses; `"gpu"` where no adapter can do it.
pub(crate) fn choose(
    layout: Layout,
    blocks: &[&[f64]],
    accuracy: &Accuracy,
    folder: Option<&Path>,
) -> Result<(Multiplier, Choice), Error> {
    let asking = Asking::new(layout, blocks, accuracy.scalar);
    match accuracy.multiply {
        Multiply::Cpu => asking.on_processor(Why::Asked),
        Multiply::Auto if accuracy.scalar == MultiplyScalar::F64 => {
            asking.on_processor(Why::Numbers)
        }
        Multiply::Auto => asking.on_faster(&Adapters::find_hardware(), false, folder),
        Multiply::Gpu => asking.on_gpu(&Adapters::find()),
    }
}

/// The choice where the surface is drawn without a multiply of its own.
pub(crate) fn fetched(scalar: gpu::Scalar) -> Choice {
    Choice::processor(scalar, Why::Fetched)
}

/// An adapter that nobody waits for, if there is one: as a driver that is too late each time.
#[cfg(test)]
pub(crate) fn impatient(layout: Layout, blocks: &[&[f64]]) -> Option<Multiplier> {
    let mut asking = Asking::new(layout, blocks, MultiplyScalar::Auto);
    asking.settings.patience = Some(std::time::Duration::ZERO);
    let chosen = asking.on_gpu(&Adapters::find());
    chosen.ok().map(|(multiplier, _)| multiplier)
}

/// A compliance and the numbers in which it is to be kept.
struct Asking<'a> {
    layout: Layout,
    blocks: &'a [&'a [f64]],
    scalar: gpu::Scalar,
    settings: GpuSettings,
}

impl<'a> Asking<'a> {
    fn new(layout: Layout, blocks: &'a [&'a [f64]], scalar: MultiplyScalar) -> Self {
        Self {
            layout,
            blocks,
            scalar: processor_scalar(scalar),
            settings: GpuSettings {
                storage: storage(scalar),
                ..GpuSettings::default()
            },
        }
    }

    fn processor(&self) -> Result<Box<dyn ComplianceMultiply>, Error> {
        Ok(gpu::on_cpu(self.layout, self.blocks, self.scalar)?)
    }

    fn open(&self, adapter: &Adapter) -> Result<Gpu, gpu::Error> {
        Gpu::new(adapter, self.layout, self.blocks, self.settings)
    }

    fn on_processor(&self, why: Why) -> Result<(Multiplier, Choice), Error> {
        let choice = Choice::processor(self.scalar, why);
        Ok((Multiplier::Processor(self.processor()?), choice))
    }

    fn on_gpu(&self, adapters: &Adapters) -> Result<(Multiplier, Choice), Error> {
        let asked = |source| Error::GpuAsked { source };
        let adapter = adapters.best(true).map_err(asked)?;
        let gpu = self.open(adapter).map_err(asked)?;
        let guarded = Box::new(Guarded::new(gpu, self.processor()?));
        let choice = Choice::adapter(adapter, self.settings.storage, Why::Asked);
        Ok((Multiplier::Guarded(guarded), choice))
    }

    /// `software_allowed`: whether an adapter that the processor plays may compete.
    fn on_faster(
        &self,
        adapters: &Adapters,
        software_allowed: bool,
        folder: Option<&Path>,
    ) -> Result<(Multiplier, Choice), Error> {
        let Ok(adapter) = adapters.best(software_allowed) else {
            return self.on_processor(Why::NoAdapter {
                looked_for: adapters.to_string(),
                is_software_there: !adapters.list.is_empty(),
            });
        };
        let mut processor = self.processor()?;
        let raced = self.race(adapter, processor.as_mut(), folder);
        let (opened, why) = match raced {
            Ok((opened, race)) => (opened, Why::Faster(race)),
            Err(error) => (
                None,
                Why::Failed {
                    reason: error.to_string(),
                },
            ),
        };
        Ok(match opened {
            Some(gpu) => {
                let guarded = Box::new(Guarded::new(gpu, processor));
                let choice = Choice::adapter(adapter, self.settings.storage, why);
                (Multiplier::Guarded(guarded), choice)
            }
            None => {
                let choice = Choice::processor(self.scalar, why);
                (Multiplier::Processor(processor), choice)
            }
        })
    }

    /// Who is faster, by what is remembered or by measurement; the adapter's back-end if it is the one.
    fn race(
        &self,
        adapter: &Adapter,
        processor: &mut dyn ComplianceMultiply,
        folder: Option<&Path>,
    ) -> Result<(Option<Gpu>, Race), gpu::Error> {
        let memory = folder.map(|folder| {
            let machine = Machine::read();
            let processor = format!("{}, {} cores", machine.processor, machine.cores);
            let numbers = (self.scalar, self.settings.storage);
            Memory::new(folder, adapter.key(), processor, self.layout, numbers)
        });
        let race = |compared: &Compared, is_remembered| Race {
            adapter: name_of(adapter),
            n_contacts: compared.n_contacts,
            processor_s: compared.processor_s,
            gpu_s: compared.gpu_s,
            is_remembered,
        };
        if let Some(compared) = memory.as_ref().and_then(Memory::recall) {
            let gpu = match compared.gpu_wins() {
                true => Some(self.open(adapter)?),
                false => None,
            };
            return Ok((gpu, race(&compared, true)));
        }
        let mut gpu = self.open(adapter)?;
        let compared = gpu::compare(processor, &mut gpu)?;
        if let Some(memory) = memory {
            memory.keep(&compared);
        }
        let won = compared.gpu_wins().then_some(gpu);
        Ok((won, race(&compared, false)))
    }
}
