//! `[output]`: which results are written.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::SceneError;
use super::check::Check;
use super::keys::{Direction, Whole};

const FRAMES: u32 = 6;

/// Which results are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// Number of moments of which pictures and shapes are kept.
    pub frames: u32,
    /// Unit vector from the part to the eye; `None` to choose it by the contact.
    pub camera: Option<DVec3>,
    /// PNG of each frame.
    pub pictures: bool,
    /// VTU (ParaView) of each frame.
    pub vtu: bool,
    /// Session as MCAP.
    pub mcap: bool,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct OutputKeys {
    /// Moments of which pictures and shapes are kept, 0 to 1000.
    #[schemars(extend("default" = FRAMES))]
    frames: Option<Whole<0, 1000>>,
    /// From where the pictures are taken: direction from the part to the eye, in the part's frame; any length but 0. Without it
    /// the view that shows most of the contact is chosen, and where no view shows it part and tool are drawn cut open.
    #[schemars(extend("x-default" = "where contact is seen best"))]
    camera: Option<Direction>,
    /// Write a PNG of each frame.
    #[schemars(extend("default" = true))]
    pictures: Option<bool>,
    /// Write the deformed shape of each frame as VTU, for ParaView.
    #[schemars(extend("default" = true))]
    vtu: Option<bool>,
    /// Write the session as MCAP, for replay and for Foxglove.
    #[schemars(extend("default" = true))]
    mcap: Option<bool>,
}

impl OutputKeys {
    pub(super) fn checked(&self, check: &Check<'_>) -> Result<Output, SceneError> {
        let frames = self.frames.map(|frames| check.whole("frames", frames));
        let camera = self.camera.map(|camera| check.direction("camera", camera));
        Ok(Output {
            frames: frames.transpose()?.unwrap_or(FRAMES),
            camera: camera.transpose()?,
            pictures: self.pictures.unwrap_or(true),
            vtu: self.vtu.unwrap_or(true),
            mcap: self.mcap.unwrap_or(true),
        })
    }
}
