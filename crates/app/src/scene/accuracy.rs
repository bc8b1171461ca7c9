//! `[accuracy]`: what a scene asks of accuracy, and what it costs time.

mod adaptive;
mod iterations;
mod preset;
mod rates;

use schemars::JsonSchema;
use serde::Deserialize;

use super::SceneError;
use super::check::Check;
use super::check::Range::Positive;
use super::keys::{At, In, Length, Plain, Whole};
use adaptive::AdaptiveKey;
pub use adaptive::{Adaptive, FreeNodes};
pub use iterations::ContactIterations;
use iterations::IterationsKey;
pub use preset::Preset;
pub(super) use preset::WordOrKeys;
pub use rates::Rates;
use rates::RatesKey;

const MAX_CONTACTS: u32 = 500;
const MERGE_TOLERANCE: f64 = 0.05;

/// Bend of an edge, as a share of the largest displacement, that a picture of a thousand pixels
/// begins to show.
const SEEN_BEND: f64 = 1e-3;

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
    /// Where contact acts on the part.
    pub contact_at: ContactAt,
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

/// Where contact acts on the part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ContactAt {
    /// at the part's nodes: the force steps from one row of them to the next.
    #[default]
    Nodes,
    /// where the tool is nearest to the edges and faces of the part: these places move with it.
    Places,
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

/// Number type in which the step reads the compliance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scalar {
    /// 64 bits.
    #[default]
    F64,
    /// 32 bits: half the memory to read, about seven digits.
    F32,
}

/// Number type in which the displacement multiply keeps the compliance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MultiplyScalar {
    /// 64 bits on the processor, 32 on a GPU.
    #[default]
    Auto,
    /// 64 bits, on the processor.
    F64,
    /// 32 bits, about seven digits.
    F32,
    /// 16 bits on a GPU, about three digits; the processor keeps 32.
    F16,
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

/// Where the displacement multiply runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Multiply {
    /// on the faster of processor and GPU.
    #[default]
    Auto,
    /// on the processor.
    Cpu,
    /// on the best GPU, one in software too, or else an error.
    Gpu,
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
            max_contacts: MAX_CONTACTS as usize,
            rates: Rates::Auto,
            contact_at: ContactAt::Nodes,
            tool_features: ToolFeatures::Auto,
            merge_tolerance: MERGE_TOLERANCE,
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

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct AccuracyKeys {
    /// Settings for a goal; keys that are written beside it take precedence.
    #[schemars(extend("x-default" = "none"))]
    preset: Option<Preset>,
    /// Time that 99.9 % of the steps may take, in microseconds whatever the units: the most
    /// accurate settings that keep it on this machine are measured, chosen and named. Stands alone.
    #[schemars(extend("x-type" = "number", "x-default" = "none"))]
    budget_us: Option<At<f64>>,
    /// Order of the elements, 1, 2 or 3; raised or lowered from the mesh's own.
    #[schemars(extend("x-default" = "the mesh's own"))]
    order: Option<Whole<1, 3>>,
    /// The p-method: which interface nodes (those on edges and faces) are drawn where they are; the others follow
    /// their principal nodes (the elements' vertices). Forces are those of the full order whatever is chosen.
    /// `"off"`: all. A number: those within this radius of the contact. A table: `radius`, or `indicator` (where the
    /// edge bends by more than this share of the largest displacement), or `budget_us` (as many as this time
    /// allows, nearest first). Example: `{ radius = 3.0 }`.
    #[schemars(extend("default" = "off"))]
    adaptive: Option<At<AdaptiveKey>>,
    /// How often contact planes are put on anew at the new positions within one step: until the
    /// displacement no longer changes, or 1 to 50 times.
    #[schemars(extend("default" = "converged"))]
    contact_iterations: Option<At<IterationsKey>>,
    /// Nodes nearer to the tool than this get a contact plane, above 0.
    #[schemars(extend("x-default" = "chosen from the tool's motion"))]
    near_distance: Option<Length>,
    /// Rows of the contact problem of one step, 1 to 5000; its time grows with their cube. Where
    /// more nodes are near, neighbours share a row, up to eight times as many; beyond that the
    /// deepest are kept and the rest is counted and reported.
    #[schemars(extend("default" = MAX_CONTACTS))]
    max_contacts: Option<Whole<1, 5000>>,
    /// Whether the haptic loop solves the whole step (`"one"`), or the engine runs beside it and hands
    /// each step's contact problem over, which the loop solves again in every period: `{ every = 5 }`,
    /// the results being there that many periods later, 1 to 50 and 50 ms at most (where the run waits
    /// for the real clock: as soon as they are solved). `"auto"`: one; where the run waits for the
    /// clock, two if 99 % of the steps of a rehearsal do not fit 0.7 of the period.
    #[schemars(extend("default" = "auto"))]
    rates: Option<RatesKey>,
    /// Where contact acts on the part. Places take the steps out of the force of a tool with curved sides, and are dearer to
    /// find; they need contact groups of faces.
    #[schemars(extend("default" = "nodes"))]
    contact_at: Option<ContactAt>,
    /// Corners and sharp edges of the tool (a box, a cylinder of finite length, a mesh that bends by more than 20 degrees)
    /// against the part's faces between its nodes: each point of them at a face is one more contact plane, of
    /// `max_contacts` too. Without it contact acts at nodes only, and what comes between them is not seen. Edges
    /// are sampled at half the part's smallest face. A step then takes some 0.1 ms on the shipped hook (docs/performance.md).
    #[schemars(extend("default" = "auto"))]
    tool_features: Option<At<ToolFeaturesWord>>,
    /// Where nodes share rows, relative error of the resultant force above which steps are counted
    /// and reported, above 0 to 1. It is estimated in each step by the gaps that are left.
    #[schemars(extend("default" = MERGE_TOLERANCE))]
    merge_tolerance: Option<Plain>,
    /// Number type in which the displacement multiply keeps the compliance: it changes the drawn shape only, forces are
    /// always computed in f64.
    #[schemars(extend("default" = "auto"))]
    scalar: Option<At<MultiplyScalar>>,
    /// Number type in which the compliance between nodes that can touch is kept for the step; sums and solutions are
    /// in f64. `"f32"` halves the memory and changes forces in the seventh digit.
    #[schemars(extend("default" = "f64"))]
    contact_scalar: Option<Scalar>,
    /// Which columns of the compliance, one for each node that can touch, are computed beforehand; a node without
    /// its column cannot be touched yet. `"near"` is for parts whose compliance does not fit into memory: the part is
    /// factored at each start, and a node whose column came late is eased in. Not with `adaptive`.
    #[schemars(extend("default" = "auto"))]
    columns: Option<At<Columns>>,
    /// Where the displacement multiply runs; forces do not depend on it. `"auto"` measures processor and GPU once for each
    /// part, remembers the winner beside the prepared part, and says what it chose; a GPU that fails in a run is given up
    /// for the processor. `"gpu"` is not for `scalar = "f64"` or `columns = "near"`.
    #[schemars(extend("default" = "auto"))]
    multiply: Option<Multiply>,
}

/// [`ToolFeatures`] as written: without the line, which only the check knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum ToolFeaturesWord {
    /// if the tool has some and the contact groups have faces.
    Auto,
    /// or else an error.
    On,
    /// contact at the part's nodes only.
    Off,
}

impl AccuracyKeys {
    /// Order of the elements: of `accuracy.order`, `part.order` or the preset.
    pub(super) fn order(
        &self,
        of_part: Option<Whole<1, 3>>,
        check: &Check<'_>,
    ) -> Result<Option<u8>, SceneError> {
        let read = |order| check.whole("order", order).map(|order| order as u8);
        let own = self.order.map(read).transpose()?;
        let of_part = of_part.map(read).transpose()?;
        match (own, of_part, self.order) {
            (Some(a), Some(p), Some(at)) if a != p => {
                let what = format!("accuracy.order {a} and part.order {p} differ");
                Err(check.error(at.offset, what, "leave one of the two out"))
            }
            (None, None, _) => Ok((self.preset == Some(Preset::Exact)).then_some(3)),
            _ => Ok(own.or(of_part)),
        }
    }

    /// `period`: of the servo, s.
    pub(super) fn checked(&self, period: f64, check: &Check<'_>) -> Result<Accuracy, SceneError> {
        self.refuse_mixed_budget(check)?;
        let base = Accuracy::of(self.preset);
        let budget_us = self.budget_us.map(|At { value, offset }| Plain {
            value: In(value),
            offset,
        });
        let near_distance = check.optional("near_distance", self.near_distance, Positive)?;
        let max_contacts = match self.max_contacts {
            Some(most) => check.whole("max_contacts", most)? as usize,
            None => base.max_contacts,
        };
        let adaptive = match self.adaptive {
            Some(adaptive) => adaptive.checked(check)?,
            None => base.adaptive,
        };
        Ok(Accuracy {
            preset: self.preset,
            budget_us: check.optional("budget_us", budget_us, Positive)?,
            rates: match self.rates {
                Some(rates) => rates.checked(period, check)?,
                None => base.rates,
            },
            adaptive,
            contact_iterations: match self.contact_iterations {
                Some(iterations) => iterations.checked(check)?,
                None => base.contact_iterations,
            },
            near_distance,
            max_contacts,
            merge_tolerance: self.merge_tolerance(check)?,
            contact_at: self.contact_at.unwrap_or_default(),
            tool_features: self.tool_features(check),
            scalar: self.scalar.map_or(base.scalar, |at| at.value),
            contact_scalar: self.contact_scalar.unwrap_or(base.contact_scalar),
            columns: self.columns(adaptive, check)?,
            multiply: self.multiply(check)?,
        })
    }

    /// A budget chooses settings itself, so others beside it would be ignored.
    fn refuse_mixed_budget(&self, check: &Check<'_>) -> Result<(), SceneError> {
        let Some(budget) = self.budget_us else {
            return Ok(());
        };
        let beside = [
            ("preset", self.preset.is_some()),
            ("order", self.order.is_some()),
            ("adaptive", self.adaptive.is_some()),
            ("contact_iterations", self.contact_iterations.is_some()),
            ("scalar", self.scalar.is_some()),
        ];
        match beside.into_iter().find(|(_, is_there)| *is_there) {
            Some((key, _)) => Err(check.error(
                budget.offset,
                format!("budget_us chooses {key} itself, but {key} is written too"),
                format!("leave out budget_us or {key}"),
            )),
            None => Ok(()),
        }
    }

    fn merge_tolerance(&self, check: &Check<'_>) -> Result<f64, SceneError> {
        let Some(written) = self.merge_tolerance else {
            return Ok(MERGE_TOLERANCE);
        };
        let value = check.number("merge_tolerance", written, Positive)?;
        if value > 1.0 {
            let what = format!("merge_tolerance {value} is more than all of the force");
            let mend = "write a share from above 0 to 1";
            return Err(check.error(written.offset, what, mend));
        }
        Ok(value)
    }

    fn tool_features(&self, check: &Check<'_>) -> ToolFeatures {
        match self.tool_features {
            None => ToolFeatures::default(),
            Some(At { value, offset }) => match value {
                ToolFeaturesWord::Auto => ToolFeatures::Auto,
                ToolFeaturesWord::On => ToolFeatures::On {
                    line: check.line(offset),
                },
                ToolFeaturesWord::Off => ToolFeatures::Off,
            },
        }
    }

    /// `adaptive`: the key's or the preset's.
    fn columns(&self, adaptive: Adaptive, check: &Check<'_>) -> Result<Columns, SceneError> {
        let Some(At { value, offset }) = self.columns else {
            return Ok(Columns::default());
        };
        if value == Columns::Near && adaptive != Adaptive::Off {
            let what = "columns \"near\" and adaptive do not go together";
            let mend = "leave columns out, or write adaptive = \"off\"";
            return Err(check.error(offset, what, mend));
        }
        Ok(value)
    }

    fn multiply(&self, check: &Check<'_>) -> Result<Multiply, SceneError> {
        let multiply = self.multiply.unwrap_or_default();
        if multiply != Multiply::Gpu {
            return Ok(multiply);
        }
        if let Some(scalar) = self.scalar.filter(|at| at.value == MultiplyScalar::F64) {
            let what =
                "scalar \"f64\" does not go with multiply \"gpu\", which keeps 32 or 16 bits";
            let mend =
                "write scalar = \"f32\" or \"f16\" or leave it out, or write multiply = \"cpu\"";
            return Err(check.error(scalar.offset, what, mend));
        }
        if let Some(columns) = self.columns.filter(|at| at.value == Columns::Near) {
            let what = "columns \"near\" does not go with multiply \"gpu\", which needs the whole compliance";
            return Err(check.error(columns.offset, what, "leave one of the two out"));
        }
        Ok(multiply)
    }
}
