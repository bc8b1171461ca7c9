//! From a tetrahedral mesh to the compliance of its surface.
//!
//! Mesh of order 1, 2 or 3 ([`mesh`]) → stiffness K ([`assemble_stiffness`]) → held degrees of
//! freedom left out and the others ordered ([`OrderedStiffness`]) → K factored once
//! ([`FactoredStiffness`]) → columns of K⁻¹ for the nodes that can touch ([`Compliance`]). Strain and stress of any displacement are in [`stress`].
//! The crate knows nothing of contact, devices or scenes. SI units.
//!
//! ```
//! use fem::{FactoredStiffness, Material, Mesh, Order, Quadrature, Silent, Supports};
//!
//! // One linear tetrahedron with its base held, pulled at the top.
//! let nodes = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let mesh = Mesh::new(Order::Linear, nodes, vec![1, 2, 3, 4], vec![0, 1, 2, 3], vec![1], vec![]);
//! let mut supports = Supports::new(mesh.n_nodes());
//! for node in 0..3 {
//!     supports.fix_node(node, [true; 3]);
//! }
//! mesh.check(&supports)?;
//! let material = Material::new(1e9, 0.0)?;
//! let stiffness = fem::assemble_stiffness(&mesh, &[material], &[0], Quadrature::Fast)?;
//! let factor = FactoredStiffness::new(&stiffness, &supports, &Silent)?;
//! let mut force = vec![0.0; 12];
//! force[11] = 1.0;
//! // E V / h² = 1e9 / 6 N/m along the axis.
//! assert!((factor.solve(&force)[11] - 6e-9).abs() < 1e-20);
//! # Ok::<(), fem::Error>(())
//! ```

#![cfg_attr(
    test,
    allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")
)]

mod assembly;
mod columns;
mod compliance;
mod constrained;
pub mod element;
pub mod energy;
mod error;
mod factor;
mod geometry;
mod hierarchy;
pub mod load;
mod material;
pub mod mesh;
mod ordered;
mod ordering;
mod progress;
pub mod quadrature;
pub mod recovery;
pub mod skin;
mod stiffness;
pub mod stress;
mod supports;

pub use assembly::{Stiffness, assemble_stiffness};
pub use compliance::{Compliance, ComplianceChecks};
pub use constrained::ConstrainedStiffness;
pub use element::Order;
pub use error::Error;
pub use factor::FactoredStiffness;
pub use hierarchy::{Constraint, Constraints, Edge, Hierarchy, Rule};
pub use material::Material;
pub use mesh::{Face, Group, Mesh};
pub use ordered::OrderedStiffness;
pub use progress::{Progress, Silent};
pub use quadrature::Quadrature;
pub use supports::Supports;
