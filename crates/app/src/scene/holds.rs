//! `[holds]`: which of the two bodies is held and moved, and where.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SceneError;
use super::check::{Check, Range};
use super::keys::Point;

/// What is held and moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Handle {
    /// the tool moves, the part is fixed in the world.
    #[default]
    Tool,
    /// the part moves, the tool is fixed in the world.
    Part,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct HoldsKeys {
    /// The body that is moved.
    pub(super) handle: Handle,
    /// Where it is held, in its own frame (that of the mesh, or of the tool): the hand's springs and those of the
    /// coupling turn it about this point. The origin of its file does not matter.
    #[schemars(extend("x-default" = "centre of its bounding box"))]
    grip: Option<Point>,
}

impl HoldsKeys {
    pub(super) fn grip(&self, check: &Check<'_>) -> Result<Option<DVec3>, SceneError> {
        let grip = self.grip.map(|grip| check.vector("grip", grip, Range::Any));
        Ok(grip.transpose()?.map(DVec3::from_array))
    }
}
