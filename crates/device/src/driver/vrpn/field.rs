//! A command as the force field that VRPN's servers evaluate in their own loop, and back.

use glam::{DMat3, DVec3};

use super::message::ForceField;
use crate::haptic_device::Command;

/// Radius of a field whose origin is that of the device, m.
///
/// Larger than any workspace, so it bounds nothing: it cannot. The Falcon's server takes the radius of each new
/// field in with a delay and begins at 0 with each of them, so that of a field that is renewed at once only a
/// tenth (or less, as the server is set) is in force. VRPN's own constraints use the same number.
const RADIUS_WIDE: f32 = 100.0;

/// Radius of a field about the handle, m: 20 ms at 1 m/s, the fastest a hand moves against a force.
const RADIUS_NEAR: f32 = 0.02;

/// How a field is written down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Form {
    /// About the origin of the device: F₀ − J x₀ there. Understood by every server: that of the Falcon takes an
    /// origin with the wrong sign, which with any other origin turns a spring of 1 kN/m, 50 mm away, into 100 N.
    #[default]
    Wide,
    /// About the handle, and only near it: a hand that moves 20 mm away from a field that nobody renews is free.
    Near,
}

impl ForceField {
    /// No force anywhere.
    pub const OFF: Self = Self {
        origin: [0.0; 3],
        force: [0.0; 3],
        jacobian: [[0.0; 3]; 3],
        radius: 0.0,
    };

    /// The force at a position (m), N.
    #[must_use]
    pub fn force_at(&self, position: DVec3) -> DVec3 {
        let offset = position - vector(self.origin);
        // A distance that is not a number is no distance within the radius.
        if offset.length() <= f64::from(self.radius) {
            let [x, y, z] = self.jacobian.map(vector);
            vector(self.force) + DMat3::from_cols(x, y, z).transpose() * offset
        } else {
            DVec3::ZERO
        }
    }

    /// Are all numbers finite?
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let numbers = [self.origin, self.force];
        let numbers = numbers.iter().chain(&self.jacobian).flatten();
        numbers.chain([&self.radius]).all(|x| x.is_finite())
    }

    /// The field of a command that was computed at a position (m) of the handle; off where it is no force, or where
    /// its numbers are beyond those of the message.
    pub(super) fn of_command(command: &Command, position: DVec3, form: Form) -> Self {
        let (force, stiffness) = (command.wrench.force, command.stiffness);
        if force == DVec3::ZERO && stiffness == DMat3::ZERO {
            return Self::OFF;
        }
        let rows = stiffness.transpose();
        let jacobian = [rows.x_axis, rows.y_axis, rows.z_axis].map(single);
        let field = match form {
            Form::Wide => Self {
                origin: [0.0; 3],
                force: single(force - stiffness * position),
                jacobian,
                radius: RADIUS_WIDE,
            },
            Form::Near => Self {
                origin: single(position),
                force: single(force),
                jacobian,
                radius: RADIUS_NEAR,
            },
        };
        if field.is_finite() { field } else { Self::OFF }
    }
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wrench::Wrench;

    fn command(force: DVec3, stiffness: DMat3) -> Command {
        Command {
            wrench: Wrench::new(force, DVec3::ZERO),
            stiffness,
        }
    }

    #[test]
    fn both_forms_are_the_same_field_near_the_handle() {
        let force = DVec3::new(1.0, -2.0, 0.5);
        // Not symmetric: rows and columns must not be swapped.
        let stiffness = DMat3::from_cols(
            DVec3::new(-1000.0, 30.0, 0.0),
            DVec3::new(0.0, -500.0, 20.0),
            DVec3::new(10.0, 0.0, -2000.0),
        );
        let position = DVec3::new(0.05, -0.02, 0.1);
        let command = command(force, stiffness);
        for form in [Form::Wide, Form::Near] {
            let field = ForceField::of_command(&command, position, form);
            for offset in [DVec3::ZERO, DVec3::new(1e-3, -2e-3, 5e-4)] {
                let expected = force + stiffness * offset;
                let found = field.force_at(position + offset);
                // 200 N at the origin in numbers of 24 bits.
                assert!((found - expected).length() < 1e-4, "{form:?}: {found}");
            }
        }
        let near = ForceField::of_command(&command, position, Form::Near);
        assert_eq!(near.force_at(position + DVec3::X * 0.021), DVec3::ZERO);
    }

    #[test]
    fn no_force_and_forces_beyond_numbers_are_off() {
        let off = ForceField::OFF;
        for bad in [0.0, 1e300, f64::NAN, f64::INFINITY] {
            let command = command(DVec3::X * bad, DMat3::ZERO);
            assert_eq!(
                ForceField::of_command(&command, DVec3::ZERO, Form::Wide),
                off
            );
        }
        let bent = command(DVec3::X, DMat3::from_diagonal(DVec3::splat(f64::NAN)));
        assert_eq!(ForceField::of_command(&bent, DVec3::ZERO, Form::Wide), off);
        let lost = DVec3::new(f64::NAN, 0.0, 0.0);
        let push = command(DVec3::X, DMat3::IDENTITY);
        assert_eq!(ForceField::of_command(&push, lost, Form::Wide), off);
        assert_eq!(off.force_at(DVec3::ZERO), DVec3::ZERO);
        let wide = ForceField::of_command(&push, DVec3::ZERO, Form::Wide);
        assert_eq!(wide.force_at(lost), DVec3::ZERO);
    }
}
