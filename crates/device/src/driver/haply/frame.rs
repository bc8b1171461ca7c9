//! The frames of the simulation channel: what the service says, every member optional, and what is said to it.
//!
//! Nothing a frame holds is trusted: numbers that are not finite, not of unit length or beyond what a device on a
//! table can reach count as absent.

use glam::{DQuat, DVec3};
use serde_json::{Value, json};

/// Devices and grips of one frame that are looked at; the rest is not read.
const ENTRIES_MAX: usize = 32;

/// Longest name or identifier that is taken over, bytes.
const NAME_MAX: usize = 64;

/// Largest coordinate of a cursor, m: a device on a table stays within one.
const REACH_MAX: f64 = 2.0;

/// Largest velocity component, m/s, and force component, N, that is believed.
const RATE_MAX: f64 = 1e3;

/// How far the square of a quaternion's length may be from 1: the grips round to 16 bits.
const UNIT_TOLERANCE: f64 = 1e-2;

/// The name this program registers its session by.
const PROFILE: &str = "snapin";

/// How a force is written: the name of its member.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Services from 3.5 on.
    Vector,
    /// Older services; the later ones take it until 4.0.
    Values,
}

impl Form {
    pub(super) fn member(self) -> &'static str {
        match self {
            Self::Vector => "vector",
            Self::Values => "values",
        }
    }

    pub(super) fn other(self) -> Self {
        match self {
            Self::Vector => Self::Values,
            Self::Values => Self::Vector,
        }
    }
}

/// Why a text is no frame of the service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Unreadable(pub(super) &'static str);

/// One message of the service.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Frame {
    pub(super) devices: Vec<Inverse>,
    pub(super) grips: Vec<Grip>,
}

/// What a frame says of one Inverse.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Inverse {
    pub(super) id: String,
    pub(super) config: Option<Config>,
    pub(super) status: Status,
    /// Position of the cursor, m.
    pub(super) position: Option<DVec3>,
    /// Its velocity, m/s.
    pub(super) velocity: Option<DVec3>,
    /// Orientation of the device's body.
    pub(super) body: Option<DQuat>,
    /// Force that the service says it renders, N.
    pub(super) felt: Option<DVec3>,
    /// Is the control mode `force`? `None` where it is not stated.
    pub(super) is_force_mode: Option<bool>,
    /// Does a workspace transform move, turn or scale positions?
    pub(super) is_moved: bool,
}

/// The settings of a device; the first frame of a session has them.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Config {
    /// `inverse3`, `inverse3x`, `minverse`; empty where it is not stated.
    pub(super) kind: String,
    /// Version of the device, such as `7.4`.
    pub(super) version: Option<String>,
    /// Gain that the force keeps while the service sees an oscillation.
    pub(super) gate: Option<f64>,
    /// Damping that the service adds, N s/m.
    pub(super) damping: Option<Damping>,
    /// How the axes are named; `XYZ` is right, forward, up.
    pub(super) basis: Option<String>,
    /// Where the origin is.
    pub(super) preset: Option<String>,
    /// Has it a member that came with 3.5?
    pub(super) is_from_3_5: bool,
    /// Does the mount move, turn or scale positions?
    pub(super) is_moved: bool,
}

/// Damping of the service, N s/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Damping {
    pub(super) scalar: f64,
    pub(super) vector: DVec3,
}

impl Damping {
    pub(super) fn is_zero(self) -> bool {
        self.scalar == 0.0 && self.vector == DVec3::ZERO
    }
}

/// What a device says of its readiness; `None` where it says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Status {
    pub(super) calibrated: Option<bool>,
    pub(super) ready: Option<bool>,
    pub(super) power: Option<bool>,
    pub(super) in_use: Option<bool>,
}

impl Status {
    /// What is newly said, over what was said before.
    pub(super) fn renewed(self, newer: Self) -> Self {
        Self {
            calibrated: newer.calibrated.or(self.calibrated),
            ready: newer.ready.or(self.ready),
            power: newer.power.or(self.power),
            in_use: newer.in_use.or(self.in_use),
        }
    }
}

/// What a frame says of one grip.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Grip {
    pub(super) id: String,
    pub(super) orientation: Option<DQuat>,
    /// a, b, c in bits 0, 1, 2; a single button is a.
    pub(super) buttons: u32,
    /// 0 to 1.
    pub(super) battery: Option<f64>,
    /// Is it connected and awake, as far as it says?
    pub(super) is_awake: bool,
}

impl Frame {
    /// Reads a message of the service.
    pub(super) fn decode(text: &str) -> Result<Self, Unreadable> {
        let value: Value = serde_json::from_str(text).map_err(|_| Unreadable("is no JSON"))?;
        let Some(members) = value.as_object() else {
            return Err(Unreadable("is no JSON object"));
        };
        if !members.contains_key("inverse3") && !members.contains_key("session_id") {
            return Err(Unreadable("has neither session_id nor inverse3"));
        }
        let mut frame = Self {
            devices: entries(&value, "inverse3").filter_map(inverse).collect(),
            grips: Vec::new(),
        };
        // A wired or wireless grip may be listed a second time as a custom one: the first place counts.
        for place in ["verse_grip", "wireless_verse_grip", "custom_verse_grip"] {
            for grip in entries(&value, place).filter_map(grip) {
                if frame.grips.iter().all(|known| known.id != grip.id) {
                    frame.grips.push(grip);
                }
            }
        }
        Ok(frame)
    }

    /// The device of this identifier.
    pub(super) fn device(&self, id: &str) -> Option<&Inverse> {
        self.devices.iter().find(|device| device.id == id)
    }

    /// The grip of this identifier.
    pub(super) fn grip(&self, id: &str) -> Option<&Grip> {
        self.grips.iter().find(|grip| grip.id == id)
    }
}

/// The first frame of a session: its name, once, and its axes: x right, y forward, z up.
pub(super) fn session_frame() -> String {
    let configure = json!({"profile": {"name": PROFILE}, "basis": {"permutation": "XYZ"}});
    json!({"session": {"configure": configure}}).to_string()
}

/// The settings that a force needs to arrive as it is sent; asks for the settings that are then in force.
pub(super) fn configure_frame(id: &str, form: Form) -> String {
    let filters = json!({"force_gate": {"gain": 1.0}, "damping": {"scalar": 0.0, "vector": vector_json(DVec3::ZERO)}});
    json!({
        "session": {"force_render_full_state": {}},
        "inverse3": [{
            "device_id": id,
            "configure": filters,
            "commands": {"set_cursor_force": {form.member(): vector_json(DVec3::ZERO)}},
        }],
    })
    .to_string()
}

/// A force on the cursor, N.
pub(super) fn force_frame(id: &str, force: DVec3, form: Form) -> String {
    json!({
        "inverse3": [{
            "device_id": id,
            "commands": {"set_cursor_force": {form.member(): vector_json(force)}},
        }],
    })
    .to_string()
}

fn vector_json(v: DVec3) -> Value {
    json!({"x": v.x, "y": v.y, "z": v.z})
}

fn entries<'a>(value: &'a Value, name: &str) -> impl Iterator<Item = &'a Value> {
    value
        .get(name)
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
        .take(ENTRIES_MAX)
}

fn inverse(entry: &Value) -> Option<Inverse> {
    let state = &entry["state"];
    let status = &entry["status"];
    let flag = |name: &str| status.get(name).and_then(Value::as_bool);
    Some(Inverse {
        id: short(entry.get("device_id")?)?,
        config: entry
            .get("config")
            .filter(|config| config.is_object())
            .map(config),
        status: Status {
            calibrated: flag("calibrated"),
            ready: flag("ready"),
            power: flag("power_supply"),
            in_use: flag("in_use"),
        },
        position: vector(&state["cursor_position"], REACH_MAX),
        velocity: vector(&state["cursor_velocity"], RATE_MAX),
        body: quaternion(&state["body_orientation"]),
        felt: vector(&state["current_cursor_force"], RATE_MAX),
        is_force_mode: state
            .get("control_mode")
            .and_then(Value::as_str)
            .map(|mode| mode == "force"),
        is_moved: moves(&state["transform"]),
    })
}

fn config(config: &Value) -> Config {
    let info = &config["device_info"];
    let version = match (&info["major_version"], &info["minor_version"]) {
        (Value::Number(major), Value::Number(minor)) => short_text(&format!("{major}.{minor}")),
        _ => None,
    };
    let filters = &config["filters"];
    let new_members = ["filters", "preset", "basis", "mount"];
    Config {
        kind: short(&config["type"]).unwrap_or_default(),
        version,
        gate: number(&filters["force_gate"]["gain"], RATE_MAX),
        damping: damping(&filters["damping"]),
        basis: short(&config["basis"]["permutation"]),
        preset: short(&config["preset"]),
        is_from_3_5: new_members.iter().any(|name| config.get(name).is_some()),
        is_moved: moves(&config["mount"]),
    }
}

fn damping(value: &Value) -> Option<Damping> {
    let scalar = number(&value["scalar"], RATE_MAX);
    let vector = vector(&value["vector"], RATE_MAX);
    (scalar.is_some() || vector.is_some()).then(|| Damping {
        scalar: scalar.unwrap_or(0.0),
        vector: vector.unwrap_or(DVec3::ZERO),
    })
}

fn grip(entry: &Value) -> Option<Grip> {
    let state = &entry["state"];
    let status = &entry["status"];
    let is_pressed = |name: &str| state["buttons"][name] == Value::Bool(true);
    let mut buttons = u32::from(state["button"] == Value::Bool(true));
    for (bit, names) in [["a", "button_0"], ["b", "button_1"], ["c", "button_2"]]
        .iter()
        .enumerate()
    {
        buttons |= u32::from(names.iter().any(|name| is_pressed(name))) << bit;
    }
    Some(Grip {
        id: short(entry.get("device_id")?)?,
        orientation: quaternion(&state["orientation"]),
        buttons,
        battery: number(&state["battery_level"], 1.0),
        is_awake: ["connected", "awake"]
            .iter()
            .all(|name| status.get(name) != Some(&Value::Bool(false))),
    })
}

/// A finite number of at most this size.
fn number(value: &Value, largest: f64) -> Option<f64> {
    value.as_f64().filter(|n| n.abs() <= largest)
}

/// Three such numbers; one that is missing makes the whole absent.
fn vector(value: &Value, largest: f64) -> Option<DVec3> {
    let [x, y, z] = ["x", "y", "z"].map(|axis| number(&value[axis], largest));
    Some(DVec3::new(x?, y?, z?))
}

fn quaternion(value: &Value) -> Option<DQuat> {
    let [x, y, z, w] = ["x", "y", "z", "w"].map(|axis| number(&value[axis], 2.0));
    let q = DQuat::from_xyzw(x?, y?, z?, w?);
    ((q.length_squared() - 1.0).abs() <= UNIT_TOLERANCE).then(|| q.normalize())
}

/// Is this transform anything but the identity? Members at their identity are left out by the service.
fn moves(transform: &Value) -> bool {
    const SMALL: f64 = 1e-9;
    let differs = |name: &str, identity: DVec3| match transform.get(name) {
        None => false,
        Some(value) => vector(value, RATE_MAX).is_none_or(|v| (v - identity).length() > SMALL),
    };
    let turns = match transform.get("rotation") {
        None => false,
        Some(value) => quaternion(value).is_none_or(|q| DVec3::new(q.x, q.y, q.z).length() > SMALL),
    };
    differs("position", DVec3::ZERO) || differs("scale", DVec3::ONE) || turns
}

/// A text that may stand in a name: short, of visible ASCII letters.
fn short(value: &Value) -> Option<String> {
    value.as_str().and_then(short_text)
}

fn short_text(text: &str) -> Option<String> {
    let is_fit = !text.is_empty() && text.len() <= NAME_MAX;
    (is_fit && text.bytes().all(|b| b.is_ascii_graphic())).then(|| text.to_owned())
}

#[cfg(test)]
mod tests;
