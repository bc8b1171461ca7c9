//! `session.mcap`: every step on one time line, for players of recorded robot data.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};
use serde::{Deserialize, Serialize};

use super::data::{Run, StepRow};

/// The channel that carries the steps.
pub const STEP_TOPIC: &str = "/step";

/// One message on [`STEP_TOPIC`]. SI units, the part's frame.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct StepMessage {
    /// Number of the step.
    pub step: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// `approach`, `hold` or `retract`.
    pub phase: String,
    /// Travel of the held body, m.
    pub travel_m: f64,
    /// Force at the hand along the approach direction, N; `null` where it is not finite.
    pub force_n: Option<f64>,
    /// Force on the handle, N.
    pub force_on_handle_n: [Option<f64>; 3],
    /// Position of the handle, m.
    pub handle_position_m: [Option<f64>; 3],
    /// Position of the tool's origin, m.
    pub tool_position_m: [Option<f64>; 3],
    /// Nodes that carry force.
    pub contacts: u32,
    /// Pivots of all LCPs in the step.
    pub pivots: u32,
    /// Largest violation of the contact conditions, scaled.
    pub certificate: Option<f64>,
}

impl StepMessage {
    /// What a step's row says, without anything that depends on the machine's speed.
    pub fn of(row: &StepRow) -> Self {
        let finite = |value: f64| value.is_finite().then_some(value);
        let vector = |v: glam::DVec3| v.to_array().map(finite);
        Self {
            step: row.step,
            time_s: finite(row.time_s).unwrap_or_default(),
            phase: row.phase.name().to_owned(),
            travel_m: finite(row.travel_m).unwrap_or_default(),
            force_n: finite(row.force_n),
            force_on_handle_n: vector(row.force_on_handle),
            handle_position_m: vector(row.handle_position),
            tool_position_m: vector(row.tool_position),
            contacts: row.contacts,
            pivots: row.pivots,
            certificate: finite(row.certificate),
        }
    }
}

/// The bytes of `session.mcap`. `log_time` is the simulated time in ns.
///
/// # Errors
/// What the writer says.
pub fn session(run: &Run) -> Result<Vec<u8>, McapError> {
    let mut writer = WriteOptions::new()
        .compression(None)
        .profile("")
        .library(concat!("snapin ", env!("CARGO_PKG_VERSION")))
        .create(Cursor::new(Vec::new()))?;
    let schema = writer.add_schema("snapin.Step", "jsonschema", schema().as_bytes())?;
    let about = BTreeMap::from([
        ("title".to_owned(), run.title.clone()),
        ("scene".to_owned(), run.scene_path.clone()),
        ("machine".to_owned(), run.machine.clone()),
    ]);
    let channel_id = writer.add_channel(schema, STEP_TOPIC, "json", &about)?;
    for row in &run.rows {
        let message = serde_json::to_vec(&StepMessage::of(row)).unwrap_or_default();
        // Saturates: a time before the start or beyond 584 years is not told apart.
        let log_time = (row.time_s * 1e9).round() as u64;
        let sequence = u32::try_from(row.step).unwrap_or(u32::MAX);
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time,
            publish_time: log_time,
        };
        writer.write_to_known_channel(&header, &message)?;
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

/// JSON schema of [`StepMessage`].
fn schema() -> String {
    let number = || serde_json::json!({"type": ["number", "null"]});
    let vector =
        || serde_json::json!({"type": "array", "items": number(), "minItems": 3, "maxItems": 3});
    serde_json::json!({
        "title": "snapin.Step",
        "type": "object",
        "properties": {
            "step": {"type": "integer"},
            "time_s": number(),
            "phase": {"type": "string", "enum": ["approach", "hold", "retract"]},
            "travel_m": number(),
            "force_n": number(),
            "force_on_handle_n": vector(),
            "handle_position_m": vector(),
            "tool_position_m": vector(),
            "contacts": {"type": "integer"},
            "pivots": {"type": "integer"},
            "certificate": number(),
        },
    })
    .to_string()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn the_session_reads_back_step_by_step() {
        let run = sample::run();
        let bytes = session(&run).unwrap();
        let messages: Vec<_> = mcap::MessageStream::new(&bytes)
            .unwrap()
            .map(|m| m.unwrap())
            .collect();
        assert_eq!(messages.len(), run.rows.len());
        for (message, row) in messages.iter().zip(&run.rows) {
            assert_eq!(message.channel.topic, STEP_TOPIC);
            assert_eq!(message.channel.message_encoding, "json");
            assert_eq!(message.log_time, row.step * 1_000_000);
            let read: StepMessage = serde_json::from_slice(&message.data).unwrap();
            assert_eq!(read, StepMessage::of(row));
            assert_eq!(read.force_n, Some(row.force_n));
        }
        let channel = &messages[0].channel;
        assert_eq!(channel.metadata["title"], run.title);
        assert_eq!(channel.schema.as_ref().unwrap().encoding, "jsonschema");
    }

    #[test]
    fn the_schema_names_every_field() {
        let schema: serde_json::Value = serde_json::from_str(&schema()).unwrap();
        let message = serde_json::to_value(StepMessage::of(&sample::rows()[0])).unwrap();
        let fields: Vec<_> = message.as_object().unwrap().keys().collect();
        assert_eq!(
            fields,
            schema["properties"]
                .as_object()
                .unwrap()
                .keys()
                .collect::<Vec<_>>()
        );
    }

    #[test]
    fn the_recording_does_not_depend_on_the_clock() {
        let mut run = sample::run();
        let before = session(&run).unwrap();
        for row in &mut run.rows {
            row.total_ns += 77;
        }
        assert_eq!(session(&run).unwrap(), before);
    }
}
