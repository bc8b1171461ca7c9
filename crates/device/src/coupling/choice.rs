//! The stiffness of the coupling, from what the device can render without shaking.

use super::{VirtualCoupling, largest_stiffness_for_damping, largest_stiffness_for_friction};
use crate::error::{DeviceError, check_not_negative, check_positive};
use crate::haptic_device::Limits;

/// What is wished of a coupling, before the device is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CouplingWish {
    /// Translational stiffness, N/m: at most this is chosen. Default 10 000.
    pub translational: f64,
    /// Rotational stiffness, N m/rad: at most this is chosen. Default 20.
    pub rotational: f64,
    /// Damping B of the coupling, N s/m. Default 0: the coupling is a spring alone.
    pub virtual_damping: f64,
    /// Lever r between a turn of the handle and a way of the fingers, m. Default 0.03: half the width of a grip.
    pub lever: f64,
}

impl Default for CouplingWish {
    fn default() -> Self {
        Self {
            translational: 1e4,
            rotational: 20.0,
            virtual_damping: 0.0,
            lever: 0.03,
        }
    }
}

/// A coupling's stiffness as the device allows it, and why.
///
/// ```text
/// k_t = min(wish, K_max, 2(b − |B|)/T, 2c/Δ)        k_r = min(wish, K_r,max or k_t r²)
/// ```
/// K_max, K_r,max: largest stiffness the maker states; b damping and c dry friction of the device, Δ its encoder's
/// step, T the period. A figure that is not known leaves its bound out, and the reason says so.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenCoupling {
    /// Translational stiffness k_t, N/m.
    pub translational: f64,
    /// Rotational stiffness k_r, N m/rad.
    pub rotational: f64,
    /// What decided, what else would have allowed how much, and what was not known; for people.
    pub reason: String,
}

/// A bound on a stiffness, N/m or N m/rad.
struct Bound {
    stiffness: f64,
    words: String,
}

impl ChosenCoupling {
    /// Chooses for a device with these limits at a period (s).
    ///
    /// # Errors
    /// Where the limits, the period or the wish are out of range.
    pub fn for_device(
        limits: &Limits,
        period_s: f64,
        wish: &CouplingWish,
    ) -> Result<Self, DeviceError> {
        limits.check()?;
        check_positive("period_s", period_s)?;
        check_not_negative("virtual_damping", wish.virtual_damping)?;
        check_positive("lever", wish.lever)?;
        // Refuses what no coupling may have.
        VirtualCoupling::new(wish.translational, wish.rotational)?;
        let (translational, reason) = translational(limits, period_s, wish);
        let (rotational, about_rotation) = rotational(limits, translational, wish);
        Ok(Self {
            translational,
            rotational,
            reason: format!("{reason}; {about_rotation}"),
        })
    }

    /// The coupling itself.
    ///
    /// # Errors
    /// Where a stiffness was changed to one that no coupling may have.
    pub fn coupling(&self) -> Result<VirtualCoupling, DeviceError> {
        VirtualCoupling::new(self.translational, self.rotational)
    }
}

fn translational(limits: &Limits, period_s: f64, wish: &CouplingWish) -> (f64, String) {
    let mut unknown = Vec::new();
    let mut bounds = vec![Bound {
        stiffness: wish.translational,
        words: "what is wished".to_owned(),
    }];
    match limits.max_stiffness {
        Some(stiffness) => bounds.push(Bound {
            stiffness,
            words: "the largest stiffness stated for the device".to_owned(),
        }),
        None => unknown.push("the device's largest stiffness"),
    }
    match limits.damping {
        Some(damping) => bounds.push(Bound {
            stiffness: largest_stiffness_for_damping(damping, wish.virtual_damping, period_s),
            words: format!(
                "the device's damping of {} N s/m at a period of {} ms",
                short(damping),
                short(1e3 * period_s)
            ),
        }),
        None => unknown.push("its damping"),
    }
    let step = limits.position_resolution;
    match limits.coulomb_friction {
        Some(friction) if step > 0.0 => bounds.push(Bound {
            stiffness: largest_stiffness_for_friction(friction, step),
            words: format!(
                "its dry friction of {} N over an encoder step of {} mm",
                short(friction),
                short(1e3 * step)
            ),
        }),
        Some(_) => unknown.push("its encoder's step"),
        None => unknown.push("its dry friction"),
    }
    decide(&bounds, &unknown, "N/m")
}

fn rotational(limits: &Limits, translational: f64, wish: &CouplingWish) -> (f64, String) {
    let bound = match limits.max_rotational_stiffness {
        Some(stiffness) => Bound {
            stiffness,
            words: "the largest rotational stiffness stated for the device".to_owned(),
        },
        None => Bound {
            stiffness: translational * wish.lever * wish.lever,
            words: format!(
                "{} N/m at a lever of {} mm",
                short(translational),
                short(1e3 * wish.lever)
            ),
        },
    };
    let wished = Bound {
        stiffness: wish.rotational,
        words: "what is wished".to_owned(),
    };
    let (stiffness, mut reason) = decide(&[wished, bound], &[], "N m/rad");
    if limits.peak_torque == 0.0 {
        reason.push_str("; the device renders no torque");
    }
    (stiffness, reason)
}

/// The smallest bound, and the words for it. There is one bound at least.
fn decide(bounds: &[Bound], unknown: &[&str], unit: &str) -> (f64, String) {
    let smallest = bounds
        .iter()
        .map(|b| b.stiffness)
        .fold(f64::INFINITY, f64::min);
    let (mut decides, mut others) = (None, Vec::new());
    for bound in bounds {
        if decides.is_none() && bound.stiffness == smallest {
            decides = Some(bound.words.as_str());
        } else {
            others.push(format!("{} {}", bound.words, short(bound.stiffness)));
        }
    }
    let mut reason = format!(
        "{} {unit}: {} decides",
        short(smallest),
        decides.unwrap_or("what is wished")
    );
    if !others.is_empty() {
        reason.push_str(&format!(" (allowed by {})", others.join(", by ")));
    }
    if !unknown.is_empty() {
        reason.push_str(&format!(", not known: {}", unknown.join(", ")));
    }
    (smallest, reason)
}

/// A number to four digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (3 - value.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
