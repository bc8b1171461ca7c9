//! Payloads to messages and back. All numbers stand in network order, without gaps.

use super::{
    BUTTONS_MAX, CHANNELS_MAX, ForceField, Kind, Message, Motion, Placement, Plane, SensorPose,
    TEXT_LEN, Text, Workspace,
};
use crate::driver::vrpn::wire::Fields;

/// The message, or nothing where the payload is too short or too long.
pub(super) fn decode(kind: Kind, payload: &[u8]) -> Option<Message> {
    let mut fields = Fields::new(payload);
    let message = read(kind, &mut fields)?;
    fields.is_empty().then_some(message)
}

fn read(kind: Kind, from: &mut Fields<'_>) -> Option<Message> {
    Some(match kind {
        Kind::Ping => Message::Ping,
        Kind::Pong => Message::Pong,
        Kind::Text => Message::Text(text(from)?),
        Kind::PosQuat => Message::PosQuat(sensor_pose(from)?),
        Kind::Velocity => Message::Velocity(motion(from)?),
        Kind::Acceleration => Message::Acceleration(motion(from)?),
        Kind::ToRoom => Message::ToRoom(placement(from)?),
        Kind::UnitToSensor => Message::UnitToSensor(sensor_pose(from)?),
        Kind::Workspace => Message::Workspace(Workspace {
            min: from.f64s()?,
            max: from.f64s()?,
        }),
        Kind::RequestToRoom => Message::RequestToRoom,
        Kind::RequestUnitToSensor => Message::RequestUnitToSensor,
        Kind::RequestWorkspace => Message::RequestWorkspace,
        Kind::SetUpdateRate => Message::SetUpdateRate(from.f64()?),
        Kind::ResetOrigin => Message::ResetOrigin,
        Kind::ButtonChange => Message::ButtonChange {
            button: from.i32()?,
            state: from.i32()?,
        },
        Kind::ButtonStates => Message::ButtonStates(button_states(from)?),
        Kind::Analog => Message::Analog(channels(from)?),
        Kind::Dial => Message::Dial {
            delta: from.f64()?,
            dial: from.i32()?,
        },
        Kind::Force => Message::Force(from.f64s()?),
        Kind::SurfaceContact => Message::SurfaceContact(placement(from)?),
        Kind::ForceError => Message::ForceError(from.i32()?),
        Kind::ForceField => Message::ForceField(force_field(from)?),
        Kind::Plane => Message::Plane(plane(from)?),
        Kind::PlaneEffects => Message::PlaneEffects(from.f32s()?),
        Kind::CustomEffect => custom_effect(from)?,
    })
}

fn text(from: &mut Fields<'_>) -> Option<Text> {
    let (severity, level) = (from.u32()?, from.u32()?);
    let bytes = from.rest();
    if bytes.len() > TEXT_LEN {
        return None;
    }
    // What follows the NUL is whatever was in the sender's memory.
    let words = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    let text = String::from_utf8_lossy(words).replace(char::is_control, " ");
    Some(Text {
        severity,
        level,
        text,
    })
}

fn placement(from: &mut Fields<'_>) -> Option<Placement> {
    Some(Placement {
        position: from.f64s()?,
        rotation: from.f64s()?,
    })
}

/// Number of a sensor, and what brings the next number to a multiple of 8.
fn sensor(from: &mut Fields<'_>) -> Option<i32> {
    let sensor = from.i32()?;
    from.i32()?;
    Some(sensor)
}

fn sensor_pose(from: &mut Fields<'_>) -> Option<SensorPose> {
    Some(SensorPose {
        sensor: sensor(from)?,
        at: placement(from)?,
    })
}

fn motion(from: &mut Fields<'_>) -> Option<Motion> {
    Some(Motion {
        sensor: sensor(from)?,
        linear: from.f64s()?,
        rotation: from.f64s()?,
        interval_s: from.f64()?,
    })
}

fn button_states(from: &mut Fields<'_>) -> Option<Vec<i32>> {
    let count = from.i32()?;
    if !(0..=BUTTONS_MAX).contains(&count) {
        return None;
    }
    (0..count).map(|_| from.i32()).collect()
}

fn channels(from: &mut Fields<'_>) -> Option<Vec<f64>> {
    let count = from.f64()?;
    if !(0.0..=CHANNELS_MAX).contains(&count) || count.fract() != 0.0 {
        return None;
    }
    (0..count as usize).map(|_| from.f64()).collect()
}

fn force_field(from: &mut Fields<'_>) -> Option<ForceField> {
    Some(ForceField {
        origin: from.f32s()?,
        force: from.f32s()?,
        jacobian: [from.f32s()?, from.f32s()?, from.f32s()?],
        radius: from.f32()?,
    })
}

fn plane(from: &mut Fields<'_>) -> Option<Plane> {
    Some(Plane {
        coefficients: from.f32s()?,
        stiffness: from.f32()?,
        damping: from.f32()?,
        dynamic_friction: from.f32()?,
        static_friction: from.f32()?,
        index: from.i32()?,
        recovery_cycles: from.i32()?,
    })
}

fn custom_effect(from: &mut Fields<'_>) -> Option<Message> {
    let id = from.u32()?;
    // Ends at the payload's end, whatever the count says.
    let count = from.u32()?;
    let parameters = (0..count).map(|_| from.f32()).collect::<Option<_>>()?;
    Some(Message::CustomEffect { id, parameters })
}

/// Writes the payload of a message.
pub(super) fn encode(message: &Message, out: &mut Vec<u8>) {
    match message {
        Message::Ping
        | Message::Pong
        | Message::RequestToRoom
        | Message::RequestUnitToSensor
        | Message::RequestWorkspace
        | Message::ResetOrigin => {}
        Message::Text(text) => put_text(out, text),
        Message::PosQuat(pose) | Message::UnitToSensor(pose) => {
            put_sensor(out, pose.sensor);
            put_placement(out, &pose.at);
        }
        Message::Velocity(motion) | Message::Acceleration(motion) => {
            put_sensor(out, motion.sensor);
            put_f64s(out, &motion.linear);
            put_f64s(out, &motion.rotation);
            put_f64s(out, &[motion.interval_s]);
        }
        Message::ToRoom(at) | Message::SurfaceContact(at) => put_placement(out, at),
        Message::Workspace(workspace) => {
            put_f64s(out, &workspace.min);
            put_f64s(out, &workspace.max);
        }
        Message::SetUpdateRate(rate) => put_f64s(out, &[*rate]),
        Message::ButtonChange { button, state } => put_i32s(out, &[*button, *state]),
        Message::ButtonStates(states) => {
            put_i32s(out, &[states.len() as i32]);
            put_i32s(out, states);
        }
        Message::Analog(channels) => {
            put_f64s(out, &[channels.len() as f64]);
            put_f64s(out, channels);
        }
        Message::Dial { delta, dial } => {
            put_f64s(out, &[*delta]);
            put_i32s(out, &[*dial]);
        }
        Message::Force(force) => put_f64s(out, force),
        Message::ForceError(code) => put_i32s(out, &[*code]),
        Message::ForceField(field) => put_field(out, field),
        Message::Plane(plane) => put_plane(out, plane),
        Message::PlaneEffects(effects) => put_f32s(out, effects),
        Message::CustomEffect { id, parameters } => {
            out.extend_from_slice(&id.to_be_bytes());
            out.extend_from_slice(&(parameters.len() as u32).to_be_bytes());
            put_f32s(out, parameters);
        }
    }
}

fn put_i32s(out: &mut Vec<u8>, numbers: &[i32]) {
    for number in numbers {
        out.extend_from_slice(&number.to_be_bytes());
    }
}

fn put_f32s(out: &mut Vec<u8>, numbers: &[f32]) {
    for number in numbers {
        out.extend_from_slice(&number.to_be_bytes());
    }
}

fn put_f64s(out: &mut Vec<u8>, numbers: &[f64]) {
    for number in numbers {
        out.extend_from_slice(&number.to_be_bytes());
    }
}

fn put_sensor(out: &mut Vec<u8>, sensor: i32) {
    put_i32s(out, &[sensor, 0]);
}

fn put_placement(out: &mut Vec<u8>, at: &Placement) {
    put_f64s(out, &at.position);
    put_f64s(out, &at.rotation);
}

fn put_text(out: &mut Vec<u8>, text: &Text) {
    out.extend_from_slice(&text.severity.to_be_bytes());
    out.extend_from_slice(&text.level.to_be_bytes());
    let mut room = [0; TEXT_LEN];
    // The last byte stays NUL.
    let words = &text.text.as_bytes()[..text.text.len().min(TEXT_LEN - 1)];
    room[..words.len()].copy_from_slice(words);
    out.extend_from_slice(&room);
}

fn put_field(out: &mut Vec<u8>, field: &ForceField) {
    put_f32s(out, &field.origin);
    put_f32s(out, &field.force);
    for row in &field.jacobian {
        put_f32s(out, row);
    }
    put_f32s(out, &[field.radius]);
}

fn put_plane(out: &mut Vec<u8>, plane: &Plane) {
    put_f32s(out, &plane.coefficients);
    put_f32s(
        out,
        &[
            plane.stiffness,
            plane.damping,
            plane.dynamic_friction,
            plane.static_friction,
        ],
    );
    put_i32s(out, &[plane.index, plane.recovery_cycles]);
}

#[cfg(test)]
mod tests;
