//! What VRPN's messages say: one variant for each type that is known here.
//!
//! Numbers are passed on as they came, also where they are not finite: judging them is not the wire's part.

use super::wire::ProtocolError;

mod payload;

/// Length of the text of a text message, bytes, the NUL included.
const TEXT_LEN: usize = 1024;

/// Most buttons of one sender.
const BUTTONS_MAX: i32 = 256;

/// Most channels of an analog message.
const CHANNELS_MAX: f64 = 128.0;

macro_rules! kinds {
    ($($kind:ident = $name:literal, $doc:literal;)*) => {
        /// The types of messages that are known here.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum Kind {
            $(#[doc = $doc] $kind,)*
        }

        impl Kind {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$kind,)*];

            /// Name by which both sides know the type; numbers differ from link to link.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }
        }
    };
}

kinds! {
    Ping = "vrpn_Base ping_message", "Are you there?";
    Pong = "vrpn_Base pong_message", "Answer to a ping.";
    Text = "vrpn_Base text_message", "Words for the user.";
    PosQuat = "vrpn_Tracker Pos_Quat", "Pose of a sensor.";
    Velocity = "vrpn_Tracker Velocity", "Velocity of a sensor.";
    Acceleration = "vrpn_Tracker Acceleration", "Acceleration of a sensor.";
    ToRoom = "vrpn_Tracker To_Room", "Pose of the tracker in the room.";
    UnitToSensor = "vrpn_Tracker Unit_To_Sensor", "Pose of a sensor on what it is mounted to.";
    Workspace = "vrpn_Tracker Workspace", "Box that the sensor moves in.";
    RequestToRoom = "vrpn_Tracker Request_Tracker_To_Room", "Asks for `ToRoom`.";
    RequestUnitToSensor = "vrpn_Tracker Request_Unit_To_Sensor", "Asks for `UnitToSensor`.";
    RequestWorkspace = "vrpn_Tracker Request_Tracker_Workspace", "Asks for `Workspace`.";
    SetUpdateRate = "vrpn_Tracker set_update_rate", "Asks for another rate of poses.";
    ResetOrigin = "vrpn_Tracker Reset_Origin", "Asks to take the pose of now for the origin.";
    ButtonChange = "vrpn_Button Change", "One button went down or up.";
    ButtonStates = "vrpn_Button States", "All buttons.";
    Analog = "vrpn_Analog Channel", "All channels of an analog device.";
    Dial = "vrpn_Dial update", "A dial was turned.";
    Force = "vrpn_ForceDevice Force", "The force that is rendered.";
    SurfaceContact = "vrpn_ForceDevice SCP", "Where a proxy touches a surface.";
    ForceError = "vrpn_ForceDevice Force_Error", "The force was cut or is not as asked for.";
    ForceField = "vrpn_ForceDevice Force_Field", "The force to render, near a point.";
    Plane = "vrpn_ForceDevice Plane", "A plane to render.";
    PlaneEffects = "vrpn_ForceDevice Plane2", "Adhesion, texture and buzzing of a plane.";
    CustomEffect = "vrpn_ForceDevice Custom Effect", "An effect that the server alone knows.";
}

impl Kind {
    /// The type of this name, if it is known here.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }
}

/// A message.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Message {
    /// [`Kind::Ping`]
    Ping,
    /// [`Kind::Pong`]
    Pong,
    /// [`Kind::Text`]
    Text(Text),
    /// [`Kind::PosQuat`]
    PosQuat(SensorPose),
    /// [`Kind::Velocity`]
    Velocity(Motion),
    /// [`Kind::Acceleration`]
    Acceleration(Motion),
    /// [`Kind::ToRoom`]
    ToRoom(Placement),
    /// [`Kind::UnitToSensor`]
    UnitToSensor(SensorPose),
    /// [`Kind::Workspace`]
    Workspace(Workspace),
    /// [`Kind::RequestToRoom`]
    RequestToRoom,
    /// [`Kind::RequestUnitToSensor`]
    RequestUnitToSensor,
    /// [`Kind::RequestWorkspace`]
    RequestWorkspace,
    /// [`Kind::SetUpdateRate`], Hz
    SetUpdateRate(f64),
    /// [`Kind::ResetOrigin`]
    ResetOrigin,
    /// [`Kind::ButtonChange`]
    ButtonChange {
        /// Number of the button, from 0.
        button: i32,
        /// 1 pressed, 0 released.
        state: i32,
    },
    /// [`Kind::ButtonStates`]: 1 pressed, 0 released, button 0 first
    ButtonStates(Vec<i32>),
    /// [`Kind::Analog`]: the channels
    Analog(Vec<f64>),
    /// [`Kind::Dial`]
    Dial {
        /// Turns since the last message.
        delta: f64,
        /// Number of the dial, from 0.
        dial: i32,
    },
    /// [`Kind::Force`], N
    Force([f64; 3]),
    /// [`Kind::SurfaceContact`]
    SurfaceContact(Placement),
    /// [`Kind::ForceError`]: 0 a value out of range, 1 duty cycle, 2 force, motor or amplifier, 3 other, 4 all well
    ForceError(i32),
    /// [`Kind::ForceField`]
    ForceField(ForceField),
    /// [`Kind::Plane`]
    Plane(Plane),
    /// [`Kind::PlaneEffects`]: adhesion along the normal and across it, amplitude and wavelength of the texture,
    /// amplitude and frequency of the buzzing
    PlaneEffects([f32; 6]),
    /// [`Kind::CustomEffect`]
    CustomEffect {
        /// Number of the effect, the server's own.
        id: u32,
        /// Its parameters.
        parameters: Vec<f32>,
    },
}

/// Words of a server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// 0 in passing, 1 a warning, 2 an error.
    pub severity: u32,
    /// How unimportant it is, 0 least so.
    pub level: u32,
    /// The words, up to the first NUL, without control characters.
    pub text: String,
}

/// A pose with the number of its sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorPose {
    /// Number of the sensor, from 0.
    pub sensor: i32,
    /// The pose.
    pub at: Placement,
}

/// A position and an orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Position, m.
    pub position: [f64; 3],
    /// Orientation, quaternion x, y, z, w.
    pub rotation: [f64; 4],
}

/// A velocity or an acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Number of the sensor, from 0.
    pub sensor: i32,
    /// Of the position, m/s or m/s².
    pub linear: [f64; 3],
    /// Turn (or its change) within the interval, quaternion x, y, z, w.
    pub rotation: [f64; 4],
    /// The interval, s.
    pub interval_s: f64,
}

/// A box along the axes of the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Workspace {
    /// Least x, y, z, m.
    pub min: [f64; 3],
    /// Largest x, y, z, m.
    pub max: [f64; 3],
}

/// A force that depends linearly on the position, within a ball.
///
/// ```text
/// F(x) = F₀ + J (x − x₀)  for |x − x₀| <= radius, else 0
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceField {
    /// x₀, m.
    pub origin: [f32; 3],
    /// F₀, N.
    pub force: [f32; 3],
    /// J, N/m, row i is dF_i/dx.
    pub jacobian: [[f32; 3]; 3],
    /// m.
    pub radius: f32,
}

/// A plane with a surface, rendered in front of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// a, b, c, d of a x + b y + c z + d = 0; all 0 switches it off.
    pub coefficients: [f32; 4],
    /// Stiffness, in the server's units.
    pub stiffness: f32,
    /// Damping, in the server's units.
    pub damping: f32,
    /// Dynamic friction, dimensionless.
    pub dynamic_friction: f32,
    /// Static friction, dimensionless.
    pub static_friction: f32,
    /// Number of the plane, below 4.
    pub index: i32,
    /// Cycles in which the force comes up.
    pub recovery_cycles: i32,
}

impl Message {
    /// Its type.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Self::Ping => Kind::Ping,
            Self::Pong => Kind::Pong,
            Self::Text(_) => Kind::Text,
            Self::PosQuat(_) => Kind::PosQuat,
            Self::Velocity(_) => Kind::Velocity,
            Self::Acceleration(_) => Kind::Acceleration,
            Self::ToRoom(_) => Kind::ToRoom,
            Self::UnitToSensor(_) => Kind::UnitToSensor,
            Self::Workspace(_) => Kind::Workspace,
            Self::RequestToRoom => Kind::RequestToRoom,
            Self::RequestUnitToSensor => Kind::RequestUnitToSensor,
            Self::RequestWorkspace => Kind::RequestWorkspace,
            Self::SetUpdateRate(_) => Kind::SetUpdateRate,
            Self::ResetOrigin => Kind::ResetOrigin,
            Self::ButtonChange { .. } => Kind::ButtonChange,
            Self::ButtonStates(_) => Kind::ButtonStates,
            Self::Analog(_) => Kind::Analog,
            Self::Dial { .. } => Kind::Dial,
            Self::Force(_) => Kind::Force,
            Self::SurfaceContact(_) => Kind::SurfaceContact,
            Self::ForceError(_) => Kind::ForceError,
            Self::ForceField(_) => Kind::ForceField,
            Self::Plane(_) => Kind::Plane,
            Self::PlaneEffects(_) => Kind::PlaneEffects,
            Self::CustomEffect { .. } => Kind::CustomEffect,
        }
    }

    /// The message of a type out of its payload.
    ///
    /// # Errors
    /// Where the payload has not the size that it must have.
    pub fn decode(kind: Kind, payload: &[u8]) -> Result<Self, ProtocolError> {
        payload::decode(kind, payload).ok_or(ProtocolError::WrongSize {
            kind: kind.name(),
            size: payload.len(),
        })
    }

    /// Writes the payload behind what is there.
    pub fn encode_into(&self, out: &mut Vec<u8>) {
        payload::encode(self, out);
    }
}
