//! Each tetrahedron into eight: how many nodes, where, and cut along which diagonal.

use std::collections::{BTreeMap, BTreeSet};

use fem::Order;

use crate::common::{ORDERS, bend, cube, hold, place, read};

/// The number of nodes of the refined cube is that of the cube with twice as many cells, and each
/// edge is where it should be: Euler's formula leaves no room for a node too many.
#[test]
fn refining_makes_each_shared_node_once() {
    for order in ORDERS {
        let finer = cube(order, 1, bend).refined().unwrap();
        let p = order as usize;
        assert_eq!(finer.n_nodes(), (2 * p + 1).pow(3));
        let twice = finer.refined().unwrap();
        assert_eq!(twice.n_nodes(), (4 * p + 1).pow(3));
        assert_eq!(
            twice.check(&hold(&twice, &twice.surface_nodes())),
            Ok(vec![])
        );
        // Closed: the boundary is the refined group, each face once.
        let key = |nodes: &[u32]| nodes[..3].iter().copied().collect::<BTreeSet<u32>>();
        let boundary: BTreeSet<_> = twice
            .boundary_faces()
            .iter()
            .map(|f| key(&f.nodes))
            .collect();
        let group = twice.group("surface").unwrap();
        assert_eq!(group.faces.len(), 12 * 16);
        assert_eq!(
            group
                .faces
                .iter()
                .map(|f| key(&f.nodes))
                .collect::<BTreeSet<_>>(),
            boundary
        );
    }
}

/// Points of a parent are points of one of its children, at any place of curved elements.
#[test]
fn children_cover_their_parent_and_nothing_else() {
    for mesh in [read("ring-tet10.msh"), read("ring-tet20.msh")] {
        let finer = mesh.refined().unwrap();
        for e in [0, mesh.n_elements() / 2, mesh.n_elements() - 1] {
            for l in [[0.25; 4], [0.6, 0.2, 0.1, 0.1], [0.3, 0.35, 0.15, 0.2]] {
                let (found, _) = fem::stress::locate(&finer, place(&mesh, e, l)).unwrap();
                assert_eq!(found / 8, e);
            }
        }
    }
}

/// The four inner children share the shortest diagonal, and a mesh that is moved (other round-off,
/// many ties) is cut alike.
#[test]
fn the_octahedron_is_cut_along_its_shortest_diagonal() {
    let map = |x: [f64; 3]| [x[0] + 0.4 * x[1], x[1] + 0.3 * x[2], 2.0 * x[2]];
    let mesh = cube(Order::Linear, 2, map);
    let finer = mesh.refined().unwrap();
    let square = |a: [f64; 3], b: [f64; 3]| -> f64 { (0..3).map(|c| (a[c] - b[c]).powi(2)).sum() };
    let mut chosen = BTreeMap::new();
    for e in 0..mesh.n_elements() {
        let middle = |a: usize, b: usize| {
            let mut l = [0.0; 4];
            (l[a], l[b]) = (0.5, 0.5);
            place(&mesh, e, l)
        };
        let squares = [
            square(middle(0, 1), middle(2, 3)),
            square(middle(0, 2), middle(1, 3)),
            square(middle(0, 3), middle(1, 2)),
        ];
        let shortest = squares.into_iter().fold(f64::INFINITY, f64::min);
        let at = squares.iter().position(|s| *s == shortest).unwrap();
        *chosen.entry(at).or_insert(0) += 1;
        let inner: Vec<&[u32]> = (8 * e + 4..8 * e + 8)
            .map(|c| finer.element_nodes(c))
            .collect();
        let shared: Vec<u32> = (inner[0].iter().copied())
            .filter(|n| inner.iter().all(|child| child.contains(n)))
            .collect();
        assert_eq!(shared.len(), 2);
        let [a, b] = [0, 1].map(|k| finer.nodes[shared[k] as usize]);
        assert!((square(a, b) / shortest - 1.0).abs() < 1e-8);
    }
    assert!(
        chosen.len() > 1,
        "one diagonal is always the shortest: {chosen:?}"
    );
    // In a regular cell two of the three are always as long, but for round-off of the turn.
    let regular = cube(Order::Linear, 1, |x| x).refined().unwrap();
    let moved = cube(Order::Linear, 1, |[x, y, z]| {
        let (s, c) = 0.3f64.sin_cos();
        let (y, z) = (c * y - s * z, s * y + c * z);
        [c * x - s * y, s * x + c * y, z + 0.1]
    });
    let moved = moved.refined().unwrap();
    assert_eq!(regular.elements, moved.elements);
    assert_eq!(
        regular.refined().unwrap().elements,
        moved.refined().unwrap().elements
    );
}
