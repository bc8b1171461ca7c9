//! What a scene asks of accuracy, and what it costs time.

use schemars::JsonSchema;
use serde::Deserialize;

use super::raw;

/// What accuracy is asked for. The order of the elements is [`super::Part::order`].
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// The goal, if one was named; its settings are in the other fields.
    pub preset: Option<Preset>,
    /// µs, > 0: the settings are to be chosen by measurement, so that 99.9 % of the steps keep it.
    pub budget_us: Option<f64>,
    /// Which interface nodes are free.
    pub adaptive: Adaptive,
    /// How often contact planes are put on anew within a step.
    pub contact_iterations: ContactIterations,
    /// Candidates nearer than this get a contact plane, m, > 0; `None`: chosen by the program.
    pub near_distance: Option<f64>,
    /// Rows of one contact problem; more near nodes than that share rows.
    pub max_contacts: usize,
    /// Whether the haptic loop solves whole steps.
    pub rates: Rates,
    /// Whether the tool's corners and edges touch the part between its nodes.
    pub tool_features: ToolFeatures,
    /// Relative error of the resultant by sharing rows above which a step is counted and reported, > 0.
    pub merge_tolerance: f64,
    /// Number type of the displacement multiply.
    pub scalar: MultiplyScalar,
    /// Number type in which the step reads the compliance between nodes that can touch.
    pub contact_scalar: Scalar,
    /// Which columns of the compliance are there from the start.
    pub columns: Columns,
    /// Where the displacement multiply runs.
    pub multiply: Multiply,
}

/// Which columns of the compliance are there from the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Columns {
    /// all if they fit into memory, else `"near"`.
    #[default]
    Auto,
    /// all, or the part is refused.
    All,
    /// some; the others are fetched in the background when the tool comes near.
    Near,
}

impl Accuracy {
    /// Settings of a preset, or what a scene without one has.
    pub fn of(preset: Option<Preset>) -> Self {
        let plain = Self {
            preset,
            budget_us: None,
            adaptive: Adaptive::Off,
            contact_iterations: ContactIterations::Converged,
            near_distance: None,
            max_contacts: raw::default::MAX_CONTACTS as usize,
            rates: Rates::Auto,
            tool_features: ToolFeatures::Auto,
            merge_tolerance: raw::default::MERGE_TOLERANCE,
            scalar: MultiplyScalar::Auto,
            contact_scalar: Scalar::F64,
            columns: Columns::Auto,
            multiply: Multiply::Auto,
        };
        match preset {
            Some(Preset::Fast) => Self {
                adaptive: Adaptive::On(FreeNodes::Radius(0.0)),
                contact_iterations: ContactIterations::Times(2),
                ..plain
            },
            Some(Preset::Balanced) => Self {
                adaptive: Adaptive::On(FreeNodes::Indicator(SEEN_BEND)),
                ..plain
            },
            Some(Preset::Exact) | None => plain,
        }
    }
}

impl Accuracy {
    /// The settings in a few words, for tables and reports.
    pub fn words(&self) -> String {
        let planes = match self.contact_iterations {
            ContactIterations::Converged => "planes converged".to_owned(),
            ContactIterations::Times(1) => "planes once".to_owned(),
            ContactIterations::Times(n) => format!("planes {n} times"),
        };
        let contact = match self.contact_scalar {
            Scalar::F64 => "f64",
            Scalar::F32 => "f32",
        };
        // Where it is not written, what it has become stands beside where the multiply runs.
        let shape = match self.scalar {
            MultiplyScalar::Auto => "",
            MultiplyScalar::F64 => ", shape in f64",
            MultiplyScalar::F32 => ", shape in f32",
            MultiplyScalar::F16 => ", shape in f16",
        };
        let preset = self.preset.map(|p| format!("{}: ", p.name()));
        let rates = match self.rates {
            Rates::Auto | Rates::One => String::new(),
            Rates::Every(n) => format!(", results {n} periods later"),
        };
        format!(
            "{}{planes}, interface nodes {}, contact in {contact}{shape}{rates}",
            preset.unwrap_or_default(),
            self.adaptive.words(),
        )
    }
}

impl Adaptive {
    /// In a few words, lengths in mm.
    pub fn words(&self) -> String {
        let Self::On(free) = self else {
            return "all free".to_owned();
        };
        match free {
            FreeNodes::Radius(0.0) => "none free".to_owned(),
            FreeNodes::Radius(radius) => format!("free within {:.3} mm", 1e3 * radius),
            FreeNodes::Indicator(share) => format!("free where bent by {} %", 100.0 * share),
            FreeNodes::BudgetUs(budget) => format!("free as {budget} µs allow"),
        }
    }
}

/// Whether the haptic loop solves whole steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rates {
    /// Yes; in real time only if they fit the period, by measurement.
    #[default]
    Auto,
    /// Yes.
    One,
    /// No: the engine runs beside it, and its results are there so many servo periods later, in
    /// [1, 50]; in real time as soon as they are solved.
    Every(u32),
}

/// Whether the tool's corners and sharp edges touch the part's faces between its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToolFeatures {
    /// If the tool has some and the contact groups have faces.
    #[default]
    Auto,
    /// Or else an error, which names this line of the scene.
    On {
        /// Line of the key.
        line: usize,
    },
    /// Contact at the part's nodes only.
    Off,
}

/// Bend of an edge, as a share of the largest displacement, that a picture of a thousand pixels
/// begins to show.
const SEEN_BEND: f64 = 1e-3;

/// A goal that stands for all settings of accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Two passes over the contact planes, shape drawn between the elements' vertices.
    Fast,
    /// Converged planes; interface nodes free where the part is seen to bend.
    Balanced,
    /// Order 3, all nodes free, tightest tolerance.
    Exact,
}

impl Preset {
    /// As in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Exact => "exact",
        }
    }
}

/// The p-method (Duriez et al. 2004, section 3.2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Adaptive {
    /// Every interface node is free.
    #[default]
    Off,
    /// Some are; the others are interpolated for drawing. Forces are those of the full order.
    On(FreeNodes),
}

/// Which interface nodes are free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FreeNodes {
    /// Within this distance of a contact, m, >= 0.
    Radius(f64),
    /// Where the edge bends by more than this share of the largest displacement, > 0.
    Indicator(f64),
    /// As many as a step of this many µs allows, nearest to the contact first, > 0.
    BudgetUs(f64),
}

/// How often contact planes are put on anew within a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactIterations {
    /// Until the displacement no longer changes.
    Converged,
    /// This often, 1 to 50.
    Times(u32),
}

/// Number type in which the step reads the compliance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scalar {
    /// 64-bit.
    #[default]
    F64,
    /// 32-bit.
    F32,
}

/// Number type in which the displacement multiply keeps the compliance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MultiplyScalar {
    /// 64-bit on the processor, 32-bit on a GPU.
    #[default]
    Auto,
    /// 64-bit: the processor only.
    F64,
    /// 32-bit.
    F32,
    /// 16-bit on a GPU, 32-bit on the processor.
    F16,
}

/// Where the displacement multiply runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Multiply {
    /// On the faster of processor and GPU.
    #[default]
    Auto,
    /// On the processor.
    Cpu,
    /// On a GPU, or not at all. Not with 64-bit numbers or fetched columns.
    Gpu,
}
