//! `session.mcap`: every step on one time line, for players of recorded robot data.

mod whole;

use std::collections::BTreeMap;
use std::io::{Cursor, Seek, Write};

use mcap::read::Options;
use mcap::records::MessageHeader;
use mcap::{McapError, MessageStream, WriteOptions, Writer};
use serde::{Deserialize, Serialize};

use super::data::{Run, StepRow};
pub use whole::WholeFile;

/// The channel that carries the steps.
pub const STEP_TOPIC: &str = "/step";

/// One message on [`STEP_TOPIC`]. SI units; numbers that are not finite are `null`.
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
    /// Force at the hand along the approach direction, N.
    pub force_n: Option<f64>,
    /// Force on the handle, world, N.
    pub force_on_handle_n: [Option<f64>; 3],
    /// Torque on the handle about its point, world, N m.
    pub torque_on_handle_nm: [Option<f64>; 3],
    /// Force that went to the device, in the device's axes, N; `null` where there was none.
    #[serde(default)]
    pub sent_force_n: Option<[f64; 3]>,
    /// Whether force was on: not before it is armed. `null` in scripted sessions.
    #[serde(default)]
    pub armed: Option<bool>,
    /// Position of the handle, world, m.
    pub handle_position_m: [Option<f64>; 3],
    /// Orientation of the handle, world: x, y, z, w.
    pub handle_rotation: [Option<f64>; 4],
    /// Position of the tool's origin, part's frame, m.
    pub tool_position_m: [Option<f64>; 3],
    /// Orientation of the tool, part's frame: x, y, z, w.
    pub tool_rotation: [Option<f64>; 4],
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
        Self {
            step: row.step,
            time_s: finite(row.time_s).unwrap_or_default(),
            phase: row.phase.name().to_owned(),
            travel_m: finite(row.travel_m).unwrap_or_default(),
            force_n: finite(row.force_n),
            force_on_handle_n: numbers(row.force_on_handle.to_array()),
            torque_on_handle_nm: numbers(row.torque_on_handle.to_array()),
            sent_force_n: None,
            armed: None,
            handle_position_m: numbers(row.handle_pose.translation.to_array()),
            handle_rotation: numbers(row.handle_pose.rotation.to_array()),
            tool_position_m: numbers(row.tool_pose.translation.to_array()),
            tool_rotation: numbers(row.tool_pose.rotation.to_array()),
            contacts: row.contacts,
            pivots: row.pivots,
            certificate: finite(row.certificate),
        }
    }
}

/// A number, where it is one.
pub(crate) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The same for each.
pub(crate) fn numbers<const N: usize>(values: [f64; N]) -> [Option<f64>; N] {
    values.map(finite)
}

/// Writes steps one by one, so that a file that is cut anywhere still holds what came before the last
/// [`Self::flush`].
pub struct StepWriter<W: Write + Seek> {
    writer: Writer<W>,
    channel_id: u16,
}

impl<W: Write + Seek> StepWriter<W> {
    /// Begins a file. `about`: what the recording is of.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(file: W, about: &BTreeMap<String, String>) -> Result<Self, McapError> {
        let mut writer = WriteOptions::new()
            .compression(None)
            .profile("")
            .library(concat!("snapin ", env!("CARGO_PKG_VERSION")))
            .create(file)?;
        let schema = writer.add_schema("snapin.Step", "jsonschema", schema().as_bytes())?;
        let channel_id = writer.add_channel(schema, STEP_TOPIC, "json", about)?;
        Ok(Self { writer, channel_id })
    }

    /// Adds a step. `log_time` is the simulated time in ns.
    ///
    /// # Errors
    /// What the writer says.
    pub fn push(&mut self, step: &StepMessage) -> Result<(), McapError> {
        let message = serde_json::to_vec(step).unwrap_or_default();
        // Saturates: a time before the start or beyond 584 years is not told apart.
        let log_time = (step.time_s * 1e9).round() as u64;
        let header = MessageHeader {
            channel_id: self.channel_id,
            sequence: u32::try_from(step.step).unwrap_or(u32::MAX),
            log_time,
            publish_time: log_time,
        };
        self.writer.write_to_known_channel(&header, &message)
    }

    /// Hands everything so far to the file.
    ///
    /// # Errors
    /// What the writer says.
    pub fn flush(&mut self) -> Result<(), McapError> {
        self.writer.flush()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(mut self) -> Result<W, McapError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}

/// The bytes of `session.mcap`.
///
/// # Errors
/// What the writer says.
pub fn session(run: &Run) -> Result<Vec<u8>, McapError> {
    let about = BTreeMap::from([
        ("title".to_owned(), run.title.clone()),
        ("scene".to_owned(), run.scene_path.clone()),
        ("machine".to_owned(), run.machine.clone()),
    ]);
    let mut steps = StepWriter::new(Cursor::new(Vec::new()), &about)?;
    for row in &run.rows {
        steps.push(&StepMessage::of(row))?;
    }
    Ok(steps.finish()?.into_inner())
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    /// In order of time.
    pub messages: Vec<StepMessage>,
    /// Whether the file was ended; otherwise it was cut, and these are the steps before.
    pub is_whole: bool,
    /// What the recording is of.
    pub about: BTreeMap<String, String>,
}

/// Reads a recording, also one that was cut.
///
/// # Errors
/// Bytes that do not begin as a recording; a step that cannot be understood.
pub fn read(bytes: &[u8]) -> Result<Steps, McapError> {
    // A recording that was not ended has an end without a summary, or none.
    let is_whole = mcap::read::footer(bytes).is_ok_and(|end| end.summary_start != 0);
    let mut found = Steps {
        messages: Vec::new(),
        is_whole,
        about: BTreeMap::new(),
    };
    let stream = MessageStream::new_with_options(bytes, Options::IgnoreEndMagic.into())?;
    for message in stream {
        let message = match message {
            Ok(message) => message,
            // Behind it is what the last flush did not reach.
            Err(_) if !is_whole => break,
            Err(error) => return Err(error),
        };
        if message.channel.topic != STEP_TOPIC {
            continue;
        }
        if found.about.is_empty() {
            found.about.clone_from(&message.channel.metadata);
        }
        let step = serde_json::from_slice(&message.data)
            .map_err(|e| McapError::Io(std::io::Error::other(e)))?;
        found.messages.push(step);
    }
    Ok(found)
}

/// JSON schema of [`StepMessage`].
fn schema() -> String {
    let number = || serde_json::json!({"type": ["number", "null"]});
    let list = |n: u32| serde_json::json!({"type": "array", "items": number(), "minItems": n, "maxItems": n});
    let (vector, rotation) = (|| list(3), || list(4));
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
            "torque_on_handle_nm": vector(),
            "sent_force_n": {"type": ["array", "null"], "items": {"type": "number"}},
            "armed": {"type": ["boolean", "null"]},
            "handle_position_m": vector(),
            "handle_rotation": rotation(),
            "tool_position_m": vector(),
            "tool_rotation": rotation(),
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
    fn a_file_that_is_cut_anywhere_holds_the_steps_before() {
        let run = sample::run();
        let mut steps = StepWriter::new(Cursor::new(Vec::new()), &BTreeMap::new()).unwrap();
        for (k, row) in run.rows.iter().enumerate() {
            steps.push(&StepMessage::of(row)).unwrap();
            if k % 10 == 9 {
                steps.flush().unwrap();
            }
        }
        let whole = steps.finish().unwrap().into_inner();
        let all = read(&whole).unwrap();
        assert!(all.is_whole);
        assert_eq!(all.messages.len(), run.rows.len());
        let mut last = 0;
        for cut in (64..whole.len() - 1).step_by(997) {
            // Within the first records there is nothing to find yet.
            let Ok(found) = read(&whole[..cut]) else {
                assert_eq!(last, 0, "a longer cut holds no less");
                continue;
            };
            assert!(!found.is_whole);
            assert_eq!(found.messages[..], all.messages[..found.messages.len()]);
            assert!(found.messages.len() >= last);
            last = found.messages.len();
        }
        assert_eq!(last, run.rows.len());
    }

    /// Players that ask for an end find one after each flush, and what was flushed before it.
    #[test]
    fn a_file_is_a_recording_after_each_flush_and_ended_at_the_end() {
        let run = sample::run();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps.mcap");
        let file = WholeFile::new(std::fs::File::create(&path).unwrap());
        let mut steps = StepWriter::new(file, &BTreeMap::new()).unwrap();
        for (k, row) in run.rows.iter().enumerate() {
            steps.push(&StepMessage::of(row)).unwrap();
            if k % 10 == 9 {
                steps.flush().unwrap();
                let bytes = std::fs::read(&path).unwrap();
                assert!(mcap::read::footer(&bytes).is_ok());
                let strict = MessageStream::new(&bytes).unwrap();
                assert_eq!(strict.map(Result::unwrap).count(), k + 1);
                assert!(!read(&bytes).unwrap().is_whole);
            }
        }
        steps.finish().unwrap().finish().unwrap();
        let all = read(&std::fs::read(&path).unwrap()).unwrap();
        assert!(all.is_whole);
        assert_eq!(all.messages.len(), run.rows.len());
        // What the program writes at once and what it writes step by step is the same.
        let at_once = read(&session(&run).unwrap()).unwrap();
        assert_eq!(at_once.messages, all.messages);
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
