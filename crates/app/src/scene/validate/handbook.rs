//! `[handbook]`: keys that belong to the kind, ranges, SI.

use super::super::error::line_of;
use super::super::handbook::{Annular, Cantilever, Handbook, Ring};
use super::super::raw::{At, HandbookRaw, KindRaw, ShapeRaw, ToolRaw};
use super::super::units::Quantity;
use super::super::{Material, SceneError};
use super::{Check, Range};

/// The section with the words for its kind.
struct Section<'a> {
    check: &'a Check<'a>,
    at: &'a At<HandbookRaw>,
    tool: &'a ToolRaw,
    kind: &'static str,
}

impl Check<'_> {
    /// The tool's radius is the default of radii that it stands for; the material says whether an
    /// annular joint's formula has an answer.
    pub(super) fn handbook(
        &self,
        at: &At<HandbookRaw>,
        tool: &ToolRaw,
        material: &Material,
    ) -> Result<Handbook, SceneError> {
        let (kind, keys): (_, &[&str]) = match at.value.kind {
            KindRaw::Cantilever => (
                "cantilever",
                &[
                    "length",
                    "width",
                    "undercut",
                    "lead_angle_deg",
                    "friction",
                    "arms",
                    "ramp",
                    "edge_radius",
                ],
            ),
            KindRaw::Annular => (
                "annular",
                &[
                    "undercut",
                    "lead_angle_deg",
                    "edge_radius",
                    "return_angle_deg",
                    "diameter",
                    "bead_height",
                    "from_end",
                ],
            ),
            KindRaw::Ring => (
                "ring",
                &[
                    "width",
                    "radius",
                    "rod_radius",
                    "opening_deg",
                    "root_angle_deg",
                ],
            ),
        };
        let section = Section {
            check: self,
            at,
            tool,
            kind,
        };
        section.refuse_foreign(keys)?;
        match at.value.kind {
            KindRaw::Cantilever => section.cantilever().map(Handbook::Cantilever),
            KindRaw::Annular => section.annular(material).map(Handbook::Annular),
            KindRaw::Ring => section.ring().map(Handbook::Ring),
        }
    }
}

impl Section<'_> {
    /// Keys of other kinds. `thickness` and `share` belong to all.
    fn refuse_foreign(&self, keys: &[&str]) -> Result<(), SceneError> {
        let raw = &self.at.value;
        fn place<T>(at: &Option<At<T>>) -> Option<usize> {
            at.as_ref().map(|at| at.offset)
        }
        let written = [
            ("length", place(&raw.length)),
            ("width", place(&raw.width)),
            ("undercut", place(&raw.undercut)),
            ("lead_angle_deg", place(&raw.lead_angle_deg)),
            ("friction", place(&raw.friction)),
            ("arms", place(&raw.arms)),
            ("ramp", place(&raw.ramp)),
            ("edge_radius", place(&raw.edge_radius)),
            ("return_angle_deg", place(&raw.return_angle_deg)),
            ("diameter", place(&raw.diameter)),
            ("bead_height", place(&raw.bead_height)),
            ("from_end", place(&raw.from_end)),
            ("radius", place(&raw.radius)),
            ("rod_radius", place(&raw.rod_radius)),
            ("opening_deg", place(&raw.opening_deg)),
            ("root_angle_deg", place(&raw.root_angle_deg)),
        ];
        for (key, offset) in written {
            if let Some(offset) = offset.filter(|_| !keys.contains(&key)) {
                let what = format!("{key} does not belong to kind \"{}\"", self.kind);
                let mend = format!(
                    "remove it; its own keys: thickness, share, {}",
                    keys.join(", ")
                );
                return Err(self.check.error(offset, what, mend));
            }
        }
        Ok(())
    }

    fn required<'b>(&self, key: &str, at: &'b Option<At<f64>>) -> Result<&'b At<f64>, SceneError> {
        at.as_ref().ok_or_else(|| SceneError::Missing {
            path: self.check.path.to_path_buf(),
            line: line_of(self.check.source, self.at.offset),
            what: format!("kind \"{}\" needs {key} in [handbook]", self.kind),
            mend: format!("add `{key} = ...`"),
        })
    }

    fn length(&self, key: &str, at: &Option<At<f64>>) -> Result<f64, SceneError> {
        let at = self.required(key, at)?;
        self.check
            .number(key, at, Quantity::Length, Range::Positive)
    }

    fn thickness(&self) -> Result<f64, SceneError> {
        self.check.number(
            "thickness",
            &self.at.value.thickness,
            Quantity::Length,
            Range::Positive,
        )
    }

    /// Above 0 and below 90.
    fn slope(&self, key: &str, at: &At<f64>) -> Result<f64, SceneError> {
        let angle = self
            .check
            .number(key, at, Quantity::Angle, Range::Positive)?;
        if angle >= 90.0 {
            let what = format!("{key} {angle} must be below 90");
            return Err(self.check.error(at.offset, what, "ramps have 20 to 45"));
        }
        Ok(angle)
    }

    /// The radius of a cylinder as tool, in SI. Whether it makes sense is the tool's check.
    fn cylinder_radius(&self) -> Option<&At<f64>> {
        let radius = self.tool.radius.as_ref();
        radius.filter(|at| self.tool.shape == ShapeRaw::Cylinder && at.value > 0.0)
    }

    fn edge_radius(&self) -> Result<f64, SceneError> {
        let written = self.at.value.edge_radius.as_ref();
        self.check.number_or(
            "edge_radius",
            written.or_else(|| self.cylinder_radius()),
            0.0,
            Quantity::Length,
            Range::NotNegative,
        )
    }

    fn share(&self) -> Result<f64, SceneError> {
        let Some(at) = &self.at.value.share else {
            return Ok(1.0);
        };
        let share = self
            .check
            .number("share", at, Quantity::Number, Range::Positive)?;
        if share > 1.0 {
            let what = format!("share {share} is more than the whole joint");
            let mend = "write 1 for a whole joint, 0.5 for half of it, 0.25 for a quarter";
            return Err(self.check.error(at.offset, what, mend));
        }
        Ok(share)
    }

    fn cantilever(&self) -> Result<Cantilever, SceneError> {
        let raw = &self.at.value;
        let angle = self.required("lead_angle_deg", &raw.lead_angle_deg)?;
        let arm = Cantilever {
            length: self.length("length", &raw.length)?,
            thickness: self.thickness()?,
            width: self.length("width", &raw.width)?,
            undercut: self.length("undercut", &raw.undercut)?,
            lead_angle_deg: self.slope("lead_angle_deg", angle)?,
            friction: self.check.number_or(
                "friction",
                raw.friction.as_ref(),
                0.0,
                Quantity::Number,
                Range::NotNegative,
            )?,
            arms: match &raw.arms {
                // At most 100.
                Some(at) => self.check.integer("arms", at, 1, 100)? as u32,
                None => 1,
            },
            ramp: raw.ramp.as_ref().map(|at| at.value).unwrap_or_default(),
            edge_radius: self.edge_radius()?,
            share: self.share()?,
        };
        if let Some(friction) = raw.friction.as_ref().filter(|_| arm.is_locked()) {
            let what = format!(
                "friction {} locks a ramp of {} degrees",
                arm.friction, arm.lead_angle_deg
            );
            return Err(self.check.error(
                friction.offset,
                what,
                "friction times tan(lead angle) must be below 1",
            ));
        }
        Ok(arm)
    }

    fn annular(&self, material: &Material) -> Result<Annular, SceneError> {
        let raw = &self.at.value;
        let or_zero = |key: &str, at: &Option<At<f64>>| {
            let quantity = Quantity::Length;
            self.check
                .number_or(key, at.as_ref(), 0.0, quantity, Range::NotNegative)
        };
        let lead = self.required("lead_angle_deg", &raw.lead_angle_deg)?;
        let back = raw.return_angle_deg.as_ref();
        let cap = Annular {
            diameter: self.length("diameter", &raw.diameter)?,
            thickness: self.thickness()?,
            undercut: self.length("undercut", &raw.undercut)?,
            bead_height: or_zero("bead_height", &raw.bead_height)?,
            from_end: or_zero("from_end", &raw.from_end)?,
            lead_angle_deg: self.slope("lead_angle_deg", lead)?,
            return_angle_deg: back
                .map(|at| self.slope("return_angle_deg", at))
                .transpose()?,
            edge_radius: self.edge_radius()?,
            share: self.share()?,
        };
        if let Some(at) = &raw.bead_height
            && cap.bead_height >= 0.5 * cap.diameter
        {
            let what = format!("bead_height {} fills the wall's inside", at.value);
            let mend = "it counts from the wall's inside to the bead's crest";
            return Err(self.check.error(at.offset, what, mend));
        }
        if cap.is_locked(material.poisson_ratio) {
            let what = format!("a ramp of {} degrees closes this bead", cap.lead_angle_deg);
            let mend = "the formula has no answer for so high a bead on so steep a ramp: lower one of them";
            return Err(self.check.error(lead.offset, what, mend));
        }
        Ok(cap)
    }

    fn ring(&self) -> Result<Ring, SceneError> {
        let raw = &self.at.value;
        let (length, angle) = (Quantity::Length, Quantity::Angle);
        let opening = self.required("opening_deg", &raw.opening_deg)?;
        let rod = match raw.rod_radius.as_ref().or_else(|| self.cylinder_radius()) {
            Some(at) => at,
            None => self.required("rod_radius", &raw.rod_radius)?,
        };
        let root = raw.root_angle_deg.as_ref();
        let ring = Ring {
            radius: self.length("radius", &raw.radius)?,
            thickness: self.thickness()?,
            width: self.length("width", &raw.width)?,
            opening_deg: self
                .check
                .number("opening_deg", opening, angle, Range::Positive)?,
            root_angle_deg: self.check.number_or(
                "root_angle_deg",
                root,
                0.0,
                angle,
                Range::NotNegative,
            )?,
            rod_radius: self
                .check
                .number("rod_radius", rod, length, Range::Positive)?,
            share: self.share()?,
        };
        if ring.opening_deg > 180.0 {
            let what = format!(
                "opening_deg {} is more than half of the ring",
                ring.opening_deg
            );
            let mend = "write 180 or less: a ring that is more open holds nothing";
            return Err(self.check.error(opening.offset, what, mend));
        }
        let lip = 180.0 - 0.5 * ring.opening_deg;
        if let Some(at) = root.filter(|_| ring.root_angle_deg >= lip) {
            let what = format!(
                "root_angle_deg {} leaves no arm before the lip at {lip}",
                ring.root_angle_deg
            );
            let mend = "both count from the foot's middle";
            return Err(self.check.error(at.offset, what, mend));
        }
        if ring.rod_radius <= ring.half_opening() {
            let what = format!("rod_radius {} passes the opening untouched", rod.value);
            let mend = "radius sin(opening_deg / 2) must be below it";
            return Err(self.check.error(rod.offset, what, mend));
        }
        Ok(ring)
    }
}
