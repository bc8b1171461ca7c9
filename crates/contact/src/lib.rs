//! Contact of a deformable part with a rigid tool: from places near the tool to normal forces.
//!
//! The way of the data: a [`Place`] is a point of the part that the tool is near, a node or one that [`minima`] finds on
//! an edge or in a face of its [`surface::Surface`]; [`Place::contact`] sees the [`tool::Tool`] from it; the caller's
//! compliance blocks become the Delassus operator in [`delassus`]; [`lcp`] finds the normal forces and certifies them,
//! [`friction`] the tangential ones where a scene calls for them; [`wrench_on_tool`] sums them up. What of a tool's
//! corners and edges comes between the nodes is found by [`tool::Features`] against the faces, and is a place like any
//! other. Everything is in the part's frame and in SI units. This crate knows no finite elements.
//!
//! ```
//! use contact::delassus::{ComplianceBlocks, delassus_into};
//! use contact::glam::{DMat3, DVec3};
//! use contact::glamx::DPose3;
//! use contact::lcp::{Problem, Scratch, Settings, Start, Status, solve};
//! use contact::tool::{Sphere, Tool};
//! use contact::{Contact, Place, wrench_on_tool};
//!
//! /// Two nodes on springs of 1000 N/m.
//! struct Springs;
//! const SPRING: DMat3 = DMat3::from_diagonal(DVec3::splat(1e-3));
//! impl ComplianceBlocks for Springs {
//!     fn block(&self, row: usize, col: usize) -> DMat3 {
//!         if row == col { SPRING } else { DMat3::ZERO }
//!     }
//! }
//!
//! # fn main() -> Result<(), contact::Error> {
//! // A ball of 10 mm, 2 mm deep into the node at the origin. The other node is far away.
//! let nodes = [DVec3::ZERO, DVec3::X];
//! let tool = Tool::Sphere(Sphere::new(0.010)?);
//! let pose_part_tool = DPose3::from_translation(DVec3::new(0.0, 0.0, 0.008));
//!
//! let places: Vec<Place> = nodes.iter().zip(0..).map(|(x, k)| Place::node(k, *x)).collect();
//! let seen = places.iter().zip(0..).map(|(place, k)| place.contact(k, &tool, &pose_part_tool, place.rest));
//! let contacts: Vec<Contact> = seen.filter(|contact| contact.gap < 0.001).collect();
//!
//! let m = contacts.len();
//! assert_eq!(m, 1);
//! let gaps: Vec<f64> = contacts.iter().map(|contact| contact.gap).collect();
//! let mut delassus = vec![0.0; m * m];
//! delassus_into(&Springs, &contacts, None, &mut delassus)?;
//!
//! let problem = Problem::symmetric(&delassus, &gaps)?;
//! let (mut forces, mut gaps_after) = (vec![0.0; m], vec![0.0; m]);
//! let mut scratch = Scratch::new(m);
//! let solution = solve(&problem, &Settings::default(), &mut scratch, Start::Cold, &mut forces, &mut gaps_after)?;
//! assert_eq!(solution.status, Status::Solved);
//! assert!(solution.certificate.natural_residual < 1e-14);
//!
//! let on_part: Vec<DVec3> = contacts.iter().zip(&forces).map(|(contact, f)| *f * contact.normal).collect();
//! let (force_on_tool, _torque) = wrench_on_tool(&contacts, &on_part, DVec3::ZERO);
//! assert!((force_on_tool - DVec3::new(0.0, 0.0, 2.0)).length() < 1e-12);
//! # Ok(())
//! # }
//! ```
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a test may stop"))]

pub mod contacts;
pub mod delassus;
mod error;
pub mod face;
pub mod friction;
pub mod lcp;
pub mod minima;
pub mod patch;
pub mod surface;
pub mod tool;

pub use contacts::{Contact, Place, Witness, wrench_on_tool};
pub use error::{Coordinates, Error};
// The versions of these that the interface speaks.
pub use {glam, glamx};
