//! Contact of a deformable part with a rigid tool: from near nodes to normal forces.
//!
//! The way of the data: a [`proximity::NodeTree`] finds the candidate nodes near a [`tool::Tool`]; each gets
//! a [`plane::Plane`]; the caller's compliance blocks become the Delassus operator in [`delassus`]; [`lcp`] finds
//! the normal forces and certifies them, [`friction`] the tangential ones where a scene calls for them; [`plane::wrench_on_tool`] sums them up. What of a tool's corners and edges comes between the nodes is found by
//! [`tool::Features`] against the faces of a [`surface::Surface`] and adds rows of its own, [`face_row`]. Everything is in the part's frame
//! and in SI units. This crate knows no finite elements.
//!
//! ```
//! use contact::delassus::{ComplianceBlocks, delassus_into};
//! use contact::glam::{DMat3, DVec3};
//! use contact::glamx::DPose3;
//! use contact::lcp::{Problem, Scratch, Settings, Start, Status, solve};
//! use contact::plane::{planes_into, wrench_on_tool};
//! use contact::proximity::NodeTree;
//! use contact::tool::{Sphere, Tool};
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
//! let nodes = NodeTree::new(&[DVec3::ZERO, DVec3::X])?;
//! let tool = Tool::Sphere(Sphere::new(0.010)?);
//! let pose_part_tool = DPose3::from_translation(DVec3::new(0.0, 0.0, 0.008));
//!
//! let mut near = Vec::with_capacity(nodes.len());
//! nodes.near_into(&tool, &pose_part_tool, 0.001, &mut near);
//! let mut planes = Vec::with_capacity(nodes.len());
//! let rest = |node: u32| nodes.rest_positions()[node as usize];
//! planes_into(&tool, &pose_part_tool, &near, rest, 0.001, &mut planes);
//!
//! let m = planes.len();
//! let gaps: Vec<f64> = planes.iter().map(|plane| plane.gap).collect();
//! let mut delassus = vec![0.0; m * m];
//! delassus_into(&Springs, &planes, None, &mut delassus)?;
//!
//! let problem = Problem::symmetric(&delassus, &gaps)?;
//! let (mut forces, mut gaps_after) = (vec![0.0; m], vec![0.0; m]);
//! let mut scratch = Scratch::new(m);
//! let solution = solve(&problem, &Settings::default(), &mut scratch, Start::Cold, &mut forces, &mut gaps_after)?;
//! assert_eq!(solution.status, Status::Solved);
//! assert!(solution.certificate.natural_residual < 1e-14);
//!
//! let (force_on_tool, _torque) = wrench_on_tool(&planes, &forces, DVec3::ZERO);
//! assert!((force_on_tool - DVec3::new(0.0, 0.0, 2.0)).length() < 1e-12);
//! # Ok(())
//! # }
//! ```
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a test may stop"))]

pub mod delassus;
mod error;
pub mod face;
pub mod face_row;
pub mod friction;
pub mod lcp;
pub mod patch;
pub mod plane;
pub mod proximity;
pub mod surface;
pub mod tool;

pub use error::{Coordinates, Error};
// The versions of these that the interface speaks.
pub use {glam, glamx};
