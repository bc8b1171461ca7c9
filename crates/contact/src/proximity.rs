//! Which nodes may be near the tool: a bounding-volume tree over their rest positions.
//!
//! The tree never changes: the part's displacement is covered by the margin of the query instead. The cost of a query
//! grows with the nodes it finds, not with the mesh.

use glam::DVec3;
use glamx::DPose3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, TraversalAction};

use crate::error::Error;
use crate::tool::Tool;

/// Tree over the rest positions of the candidate nodes.
#[derive(Clone)]
pub struct NodeTree {
    tree: Bvh,
    positions: Vec<DVec3>,
}

impl std::fmt::Debug for NodeTree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NodeTree")
            .field("n_nodes", &self.positions.len())
            .finish_non_exhaustive()
    }
}

impl NodeTree {
    /// `rest_positions`: of the candidate nodes, part's frame, m. A node is named by its place in this list.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn new(rest_positions: &[DVec3]) -> Result<Self, Error> {
        if let Some(index) = rest_positions.iter().position(|p| !p.is_finite()) {
            return Err(Error::NotFinite {
                what: "rest position of candidate node",
                index,
            });
        }
        let leaves: Vec<Aabb> = rest_positions.iter().map(|&p| Aabb::new(p, p)).collect();
        Ok(Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves),
            positions: rest_positions.to_vec(),
        })
    }

    /// Number of candidate nodes.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Rest positions as given, m.
    pub fn rest_positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Nodes whose rest position has a signed distance to the tool below `inflate`, ascending; replaces `near`.
    ///
    /// `inflate` (m) = margin + bound on the displacement of any node: then no node that is nearer than the margin in its
    /// displaced position is missed, because a signed distance changes by no more than the point moves. A
    /// [`Tool::Field`] keeps that within its error bound: add it to the margin.
    /// Does not allocate if `near` has a capacity of [`NodeTree::len`].
    pub fn near_into(
        &self,
        tool: &Tool,
        pose_part_tool: &DPose3,
        inflate: f64,
        near: &mut Vec<u32>,
    ) {
        let (min, max) = tool
            .aabb(pose_part_tool)
            .unwrap_or((DVec3::NEG_INFINITY, DVec3::INFINITY));
        let (min, max) = (min - DVec3::splat(inflate), max + DVec3::splat(inflate));
        let distance = |p| tool.signed_distance(pose_part_tool, p).signed_distance;
        // A mesh answers slowly, and so does a field far from its surface: the box alone prunes well. The others cost
        // less than a visit.
        let is_cheap = !matches!(tool, Tool::Mesh(_) | Tool::Field(_));
        self.collect(near, |node_min, node_max, is_leaf| {
            let overlaps = node_min.cmple(max).all() && node_max.cmpge(min).all();
            if !overlaps || is_leaf || !is_cheap {
                return overlaps;
            }
            let radius = 0.5 * (node_max - node_min).length();
            distance(0.5 * (node_min + node_max)) - radius < inflate
        });
        near.retain(|&node| distance(self.positions[node as usize]) < inflate);
    }

    /// Nodes whose rest position lies in the box from `min` to `max` (m), bounds included, ascending; replaces
    /// `inside`. Does not allocate if `inside` has a capacity of [`NodeTree::len`].
    pub fn inside_box_into(&self, min: DVec3, max: DVec3, inside: &mut Vec<u32>) {
        self.collect(inside, |node_min, node_max, _| {
            node_min.cmple(max).all() && node_max.cmpge(min).all()
        });
    }

    /// All leaves reached while `is_wanted(min, max, is_leaf)`.
    fn collect(&self, found: &mut Vec<u32>, is_wanted: impl Fn(DVec3, DVec3, bool) -> bool) {
        found.clear();
        self.tree.traverse(|node| {
            if !is_wanted(node.mins(), node.maxs(), node.is_leaf()) {
                return TraversalAction::Prune;
            }
            found.extend(node.leaf_data());
            TraversalAction::Continue
        });
        found.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, LazyLock};

    use glam::DQuat;
    use proptest::prelude::*;

    use super::*;
    use crate::tool::{BoxShape, Capsule, Cylinder, DistanceField, HalfSpace, Mesh, Sphere};

    /// Made once: the build takes longer than the queries.
    static FIELD: LazyLock<Arc<DistanceField>> = LazyLock::new(|| {
        let brick = Tool::Box(BoxShape::new(DVec3::new(0.3, 0.5, 0.2)).unwrap());
        DistanceField::new(brick, 2e-3, 0.1, 1 << 30)
            .unwrap()
            .into()
    });

    fn tools() -> Vec<Tool> {
        let brick = Tool::Box(BoxShape::new(DVec3::new(0.3, 0.5, 0.2)).unwrap());
        let (vertices, triangles) = brick.tessellate(1.0);
        vec![
            Tool::Sphere(Sphere::new(0.4).unwrap()),
            Tool::Cylinder(Cylinder::new(0.3, Some(0.5)).unwrap()),
            Tool::Cylinder(Cylinder::new(0.3, None).unwrap()),
            Tool::Capsule(Capsule::new(0.2, 0.4).unwrap()),
            Tool::HalfSpace(HalfSpace),
            Tool::Mesh(Mesh::new(&vertices, &triangles).unwrap().into()),
            Tool::Field(Arc::clone(&FIELD)),
            brick,
        ]
    }

    /// A bent strip of nodes, with some nodes at the same place.
    fn nodes() -> Vec<DVec3> {
        (0..600)
            .map(|k| {
                let t = (k / 2) as f64 * 0.07;
                DVec3::new(t.cos(), t.sin() * 0.8, (k % 20) as f64 * 0.1 - 1.0)
            })
            .collect()
    }

    proptest! {
        /// Against asking every node, for random poses of every tool.
        #[test]
        fn near_nodes_are_those_of_brute_force(
            place in prop::array::uniform3(-1.5..1.5_f64),
            turn in prop::array::uniform3(-3.0..3.0_f64),
            inflate in -0.05..0.4_f64,
        ) {
            let tree = NodeTree::new(&nodes()).unwrap();
            let mut near = Vec::with_capacity(tree.len());
            let pose = DPose3::from_parts(
                DVec3::from_array(place),
                DQuat::from_scaled_axis(DVec3::from_array(turn)),
            );
            for tool in tools() {
                tree.near_into(&tool, &pose, inflate, &mut near);
                let expected: Vec<u32> = (0..tree.len() as u32)
                    .filter(|&k| {
                        let p = tree.rest_positions()[k as usize];
                        tool.signed_distance(&pose, p).signed_distance < inflate
                    })
                    .collect();
                prop_assert_eq!(&near, &expected, "{:?}", tool);
            }
        }

        #[test]
        fn box_query_is_that_of_brute_force(
            a in prop::array::uniform3(-1.5..1.5_f64),
            b in prop::array::uniform3(-1.5..1.5_f64),
        ) {
            let tree = NodeTree::new(&nodes()).unwrap();
            let (a, b) = (DVec3::from_array(a), DVec3::from_array(b));
            let (min, max) = (a.min(b), a.max(b));
            let mut inside = Vec::new();
            tree.inside_box_into(min, max, &mut inside);
            let is_inside = |p: DVec3| p.cmpge(min).all() && p.cmple(max).all();
            let expected: Vec<u32> = (0..tree.len() as u32)
                .filter(|&k| is_inside(tree.rest_positions()[k as usize]))
                .collect();
            prop_assert_eq!(inside, expected);
        }
    }

    #[test]
    fn few_nodes_and_bad_nodes() {
        let tool = Tool::Sphere(Sphere::new(1.0).unwrap());
        let mut near = vec![7];
        for n in 0..4 {
            let tree = NodeTree::new(&vec![DVec3::ZERO; n]).unwrap();
            tree.near_into(&tool, &DPose3::IDENTITY, 0.0, &mut near);
            assert_eq!(near, (0..n as u32).collect::<Vec<_>>());
        }
        let bad = NodeTree::new(&[DVec3::ZERO, DVec3::NAN]).unwrap_err();
        assert!(matches!(bad, Error::NotFinite { index: 1, .. }));
    }
}
