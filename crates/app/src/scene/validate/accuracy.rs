//! `[accuracy]`: presets resolved, ranges checked, SI.

use super::super::error::line_of;
use super::super::raw::{
    AccuracyKeys, AdaptiveKeys, AdaptiveRaw, At, IterationsRaw, MultiplyRaw, MultiplyScalarRaw,
    PresetRaw, RatesRaw, ScalarRaw, ToolFeaturesRaw, default,
};
use super::super::units::Quantity;
use super::super::{
    Accuracy, Adaptive, Columns, ContactIterations, FreeNodes, Multiply, MultiplyScalar, Preset,
    Rates, Scalar, SceneError, ToolFeatures,
};
use super::{Check, Range};

impl Check<'_> {
    /// `period`: of the servo, s.
    pub(super) fn accuracy(&self, raw: &AccuracyKeys, period: f64) -> Result<Accuracy, SceneError> {
        self.refuse_mixed_budget(raw)?;
        let preset = raw.preset.map(|preset| match preset {
            PresetRaw::Fast => Preset::Fast,
            PresetRaw::Balanced => Preset::Balanced,
            PresetRaw::Exact => Preset::Exact,
        });
        let base = Accuracy::of(preset);
        let near = raw.near_distance.as_ref();
        let near_distance = near
            .map(|at| self.number("near_distance", at, Quantity::Length, Range::Positive))
            .transpose()?;
        let most = raw.max_contacts.as_ref();
        let max_contacts = most.map_or(Ok(default::MAX_CONTACTS), |at| {
            self.integer("max_contacts", at, 1, 5000)
        })?;
        let adaptive = match &raw.adaptive {
            Some(at) => self.adaptive(at)?,
            None => base.adaptive,
        };
        Ok(Accuracy {
            preset,
            budget_us: match &raw.budget_us {
                Some(at) => Some(self.micros("budget_us", at)?),
                None => None,
            },
            rates: match &raw.rates {
                Some(at) => self.rates(at, period)?,
                None => base.rates,
            },
            adaptive,
            contact_iterations: match &raw.contact_iterations {
                Some(at) => self.iterations(at)?,
                None => base.contact_iterations,
            },
            near_distance,
            max_contacts: max_contacts as usize,
            merge_tolerance: match &raw.merge_tolerance {
                Some(at) => self.merge_tolerance(at)?,
                None => base.merge_tolerance,
            },
            tool_features: self.tool_features(raw)?,
            scalar: match raw.scalar.as_ref().map(|at| at.value) {
                Some(MultiplyScalarRaw::Auto) => MultiplyScalar::Auto,
                Some(MultiplyScalarRaw::F64) => MultiplyScalar::F64,
                Some(MultiplyScalarRaw::F32) => MultiplyScalar::F32,
                Some(MultiplyScalarRaw::F16) => MultiplyScalar::F16,
                None => base.scalar,
            },
            contact_scalar: match raw.contact_scalar.as_ref().map(|at| at.value) {
                Some(ScalarRaw::F32) => Scalar::F32,
                Some(ScalarRaw::F64) => Scalar::F64,
                None => base.contact_scalar,
            },
            columns: self.columns(raw, base.adaptive)?,
            multiply: self.multiply(raw)?,
        })
    }

    fn multiply(&self, raw: &AccuracyKeys) -> Result<Multiply, SceneError> {
        let at = match &raw.multiply {
            None => return Ok(Multiply::Auto),
            Some(at) => at,
        };
        match at.value {
            MultiplyRaw::Auto => return Ok(Multiply::Auto),
            MultiplyRaw::Cpu => return Ok(Multiply::Cpu),
            MultiplyRaw::Gpu => {}
        }
        let f64_at = raw
            .scalar
            .as_ref()
            .filter(|s| s.value == MultiplyScalarRaw::F64);
        let near_at = raw.columns.as_ref().filter(|c| c.value == Columns::Near);
        if let Some(scalar) = f64_at {
            let what =
                "scalar \"f64\" does not go with multiply \"gpu\", which keeps 32 or 16 bits";
            let mend =
                "write scalar = \"f32\" or \"f16\" or leave it out, or write multiply = \"cpu\"";
            return Err(self.error(scalar.offset, what.to_owned(), mend));
        }
        if let Some(columns) = near_at {
            let what = "columns \"near\" does not go with multiply \"gpu\", which needs the whole compliance";
            let mend = "leave one of the two out";
            return Err(self.error(columns.offset, what.to_owned(), mend));
        }
        Ok(Multiply::Gpu)
    }

    fn columns(&self, raw: &AccuracyKeys, preset: Adaptive) -> Result<Columns, SceneError> {
        let Some(at) = &raw.columns else {
            return Ok(Columns::default());
        };
        let adapts = match &raw.adaptive {
            Some(adaptive) => !matches!(adaptive.value, AdaptiveRaw::Off),
            None => preset != Adaptive::Off,
        };
        if at.value == Columns::Near && adapts {
            let what = "columns \"near\" and adaptive do not go together".to_owned();
            let mend = "leave columns out, or write adaptive = \"off\"";
            return Err(self.error(at.offset, what, mend));
        }
        Ok(at.value)
    }

    /// Order of the elements: of `accuracy.order`, `part.order` or the preset.
    pub(super) fn order(
        &self,
        of_accuracy: Option<&At<i64>>,
        of_part: Option<&At<i64>>,
        preset: Option<PresetRaw>,
    ) -> Result<Option<u8>, SceneError> {
        let read = |at: &At<i64>| self.integer("order", at, 1, 3).map(|order| order as u8);
        let (of_accuracy, place) = (of_accuracy.map(read).transpose()?, of_accuracy);
        let of_part = of_part.map(read).transpose()?;
        match (of_accuracy, of_part, place) {
            (Some(a), Some(p), Some(at)) if a != p => {
                let what = format!("accuracy.order {a} and part.order {p} differ");
                Err(self.error(at.offset, what, "leave one of the two out"))
            }
            (Some(order), ..) | (None, Some(order), _) => Ok(Some(order)),
            (None, None, _) => Ok((preset == Some(PresetRaw::Exact)).then_some(3)),
        }
    }

    /// A budget chooses settings itself, so others beside it would be ignored.
    fn refuse_mixed_budget(&self, raw: &AccuracyKeys) -> Result<(), SceneError> {
        let Some(budget) = &raw.budget_us else {
            return Ok(());
        };
        let beside = [
            ("preset", raw.preset.is_some()),
            ("order", raw.order.is_some()),
            ("adaptive", raw.adaptive.is_some()),
            ("contact_iterations", raw.contact_iterations.is_some()),
            ("scalar", raw.scalar.is_some()),
        ];
        match beside.into_iter().find(|(_, is_there)| *is_there) {
            Some((key, _)) => Err(self.error(
                budget.offset,
                format!("budget_us chooses {key} itself, but {key} is written too"),
                format!("leave out budget_us or {key}"),
            )),
            None => Ok(()),
        }
    }

    fn rates(&self, at: &At<RatesRaw>, period: f64) -> Result<Rates, SceneError> {
        /// s, after which a result is too old: twice as old, before the next, it would begin to fade.
        const MOST_DELAY: f64 = 0.05;
        let every = match &at.value {
            RatesRaw::Auto => return Ok(Rates::Auto),
            RatesRaw::One => return Ok(Rates::One),
            RatesRaw::Every(every) => every,
        };
        let periods = self.integer("rates.every", every, 1, 50)? as u32;
        let most = (MOST_DELAY / period * (1.0 + 1e-9)).floor().max(1.0);
        if f64::from(periods) > most {
            let what = format!(
                "rates.every {periods} periods of {period} s are {} s, more than {MOST_DELAY} s",
                f64::from(periods) * period
            );
            return Err(self.error(every.offset, what, format!("write {most} or less")));
        }
        Ok(Rates::Every(periods))
    }

    fn micros(&self, key: &str, at: &At<f64>) -> Result<f64, SceneError> {
        self.number(key, at, Quantity::Number, Range::Positive)
    }

    fn iterations(&self, at: &At<IterationsRaw>) -> Result<ContactIterations, SceneError> {
        match at.value {
            IterationsRaw::Converged => Ok(ContactIterations::Converged),
            IterationsRaw::Times(value) => {
                let offset = at.offset;
                let times =
                    self.integer("contact_iterations", &At { value, offset }, 1, 50)? as u32;
                Ok(ContactIterations::Times(times))
            }
        }
    }

    fn merge_tolerance(&self, at: &At<f64>) -> Result<f64, SceneError> {
        let value = self.number("merge_tolerance", at, Quantity::Number, Range::Positive)?;
        if value > 1.0 {
            let what = format!("merge_tolerance {value} is more than all of the force");
            return Err(self.error(at.offset, what, "write a share from above 0 to 1"));
        }
        Ok(value)
    }

    fn adaptive(&self, at: &At<AdaptiveRaw>) -> Result<Adaptive, SceneError> {
        match &at.value {
            AdaptiveRaw::Off => Ok(Adaptive::Off),
            AdaptiveRaw::Radius(value) => {
                let (value, offset) = (*value, at.offset);
                let radius = At { value, offset };
                Ok(Adaptive::On(FreeNodes::Radius(self.radius(&radius)?)))
            }
            AdaptiveRaw::Keys(keys) => self.adaptive_keys(keys, at.offset),
        }
    }

    fn adaptive_keys(&self, keys: &AdaptiveKeys, offset: usize) -> Result<Adaptive, SceneError> {
        let free = match (&keys.radius, &keys.indicator, &keys.budget_us) {
            (Some(at), None, None) => FreeNodes::Radius(self.radius(at)?),
            (None, Some(at), None) => FreeNodes::Indicator(self.number(
                "adaptive.indicator",
                at,
                Quantity::Number,
                Range::Positive,
            )?),
            (None, None, Some(at)) => FreeNodes::BudgetUs(self.micros("adaptive.budget_us", at)?),
            (None, None, None) => {
                let what = "adaptive says nothing of which nodes are free".to_owned();
                return Err(self.error(offset, what, "write radius, indicator or budget_us"));
            }
            _ => {
                let what = "adaptive says more than once which nodes are free".to_owned();
                let mend = "keep one of radius, indicator and budget_us";
                return Err(self.error(offset, what, mend));
            }
        };
        Ok(Adaptive::On(free))
    }

    fn tool_features(&self, raw: &AccuracyKeys) -> Result<ToolFeatures, SceneError> {
        let Some(at) = &raw.tool_features else {
            return Ok(ToolFeatures::Auto);
        };
        match at.value {
            ToolFeaturesRaw::Auto => Ok(ToolFeatures::Auto),
            ToolFeaturesRaw::Off => Ok(ToolFeatures::Off),
            ToolFeaturesRaw::On => Ok(ToolFeatures::On {
                line: line_of(self.source, at.offset),
            }),
        }
    }

    fn radius(&self, at: &At<f64>) -> Result<f64, SceneError> {
        self.number("adaptive radius", at, Quantity::Length, Range::NotNegative)
    }
}
