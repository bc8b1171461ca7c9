//! The window: a live session to be seen, and held by mouse and keys.
//!
//! ```text
//!   haptic loop ── newest snapshot ──> app ── displacement of the surface ──> scene3d ──> target ──> window
//!        ^                              │                                                   └──> PNG (picture)
//!        └── simulated device <── guide ┴─ hand (mouse, keys, slider)
//! ```
//! The loop runs on a thread of its own and never waits for the window: snapshots, the plot's points and the hand's target
//! pass through memory of fixed size without locks. Everything here is f64 up to the vertices, which are f32.

pub(crate) mod app;
mod arrows;
mod camera;
pub(crate) mod exhibit;
pub(crate) mod hand;
pub(crate) mod picture;
pub(crate) mod rehearsal;
mod scene3d;
pub(crate) mod session;
mod skin;
mod trail;
