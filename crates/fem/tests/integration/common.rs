//! Meshes made by formula, and the shortest way to a solution.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use fem::element::MAX_NODES;
use fem::{Group, Material, Mesh, Order, Quadrature, Stiffness, Supports};

/// Of mesh files.
pub(crate) const ORDERS: [Order; 3] = [Order::Linear, Order::Quadratic, Order::Cubic];

/// Those of the inside of a part too.
pub(crate) const ALL_ORDERS: [Order; 5] = [
    Order::Linear,
    Order::Quadratic,
    Order::Cubic,
    Order::Quartic,
    Order::Quintic,
];

pub(crate) fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

pub(crate) fn read(name: &str) -> Mesh {
    fem::mesh::gmsh::read(&data(name)).unwrap()
}

/// The unit cube in `n`³ cells of six tetrahedra, inner vertices displaced by up to a tenth of a
/// cell, straight edges; then every node is moved by `map`, which bends the edges if it is not
/// affine. Groups `fixed` (x = 0), `load` (x = 1) and `surface`.
pub(crate) fn cube(order: Order, n: usize, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    let vertex = |at: [usize; 3]| -> [f64; 3] {
        let is_inner = at.iter().all(|i| *i > 0 && *i < n);
        std::array::from_fn(|c| {
            let spread = (at[0] * 7 + at[1] * 13 + at[2] * 29 + c * 5) % 11;
            let shift = if is_inner {
                spread as f64 / 50.0 - 0.1
            } else {
                0.0
            };
            (at[c] as f64 + shift) / n as f64
        })
    };
    let mut mesh = cells(order, [n; 3], [1.0; 3], vertex);
    mesh.groups = vec![
        group(&mesh, "fixed", &|x| x[0].abs() < 1e-9),
        group(&mesh, "load", &|x| (x[0] - 1.0).abs() < 1e-9),
        group(&mesh, "surface", &|_| true),
    ];
    for x in &mut mesh.nodes {
        *x = map(*x);
    }
    mesh
}

/// A straight block from the origin, `n` cells of six tetrahedra along each axis. Groups `fixed` (x = 0)
/// and `load` (largest x).
pub(crate) fn block(order: Order, n: [usize; 3], size: [f64; 3]) -> Mesh {
    let vertex = |at: [usize; 3]| std::array::from_fn(|c| size[c] * at[c] as f64 / n[c] as f64);
    let mut mesh = cells(order, n, size, vertex);
    mesh.groups = vec![
        group(&mesh, "fixed", &|x| x[0].abs() < 1e-9 * size[0]),
        group(&mesh, "load", &|x| (x[0] - size[0]).abs() < 1e-9 * size[0]),
    ];
    mesh
}

/// Cells of six tetrahedra with straight edges; `size` says which coordinates are equal.
fn cells(
    order: Order,
    n: [usize; 3],
    size: [f64; 3],
    vertex: impl Fn([usize; 3]) -> [f64; 3],
) -> Mesh {
    const PATHS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [2, 1, 0],
        [1, 0, 2],
    ];
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    let mut known: HashMap<[i64; 3], u32> = HashMap::new();
    for cell in 0..n[0] * n[1] * n[2] {
        let corner = [cell % n[0], cell / n[0] % n[1], cell / n[0] / n[1]];
        for (k, path) in PATHS.iter().enumerate() {
            let mut at = corner;
            let mut vertices = [vertex(at); 4];
            for (step, &axis) in path.iter().enumerate() {
                at[axis] += 1;
                vertices[step + 1] = vertex(at);
            }
            // Odd permutations of the axes turn the element inside out.
            if k >= 3 {
                vertices.swap(1, 2);
            }
            for l in order.node_coordinates() {
                let x: [f64; 3] =
                    std::array::from_fn(|c| (0..4).map(|v| l[v] * vertices[v][c]).sum());
                let key = std::array::from_fn(|c| (1e7 * x[c] / size[c]).round() as i64);
                elements.push(*known.entry(key).or_insert_with(|| {
                    nodes.push(x);
                    nodes.len() as u32 - 1
                }));
            }
        }
    }
    let n_elements = elements.len() / order.nodes_per_element();
    let tags = (1..=nodes.len() as u64).collect();
    let of_elements = (1..=n_elements as u64).collect();
    Mesh::new(order, nodes, tags, elements, of_elements, vec![])
}

/// The faces of the boundary all of whose nodes are there.
fn group(mesh: &Mesh, name: &str, is_there: &dyn Fn([f64; 3]) -> bool) -> Group {
    let mut faces = mesh.boundary_faces();
    faces.retain(|f| f.nodes.iter().all(|&i| is_there(mesh.nodes[i as usize])));
    let mut nodes: Vec<u32> = faces.iter().flat_map(|f| f.nodes.clone()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    Group {
        name: name.to_owned(),
        dimension: 2,
        nodes,
        lines: Vec::new(),
        faces,
        elements: vec![],
    }
}

/// Bends a cube so that most edges are curved and all elements stay valid.
pub(crate) fn bend([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        x + 0.10 * y * z,
        y - 0.12 * x * z + 0.05 * x * x,
        z + 0.08 * x * y,
    ]
}

pub(crate) fn steel() -> Material {
    Material::new(2.1e11, 0.29).unwrap()
}

pub(crate) fn assemble(mesh: &Mesh, material: Material, quadrature: Quadrature) -> Stiffness {
    fem::assemble_stiffness(mesh, &[material], &vec![0; mesh.n_elements()], quadrature).unwrap()
}

/// Holds all components of the nodes.
pub(crate) fn hold(mesh: &Mesh, nodes: &[u32]) -> Supports {
    let mut supports = Supports::new(mesh.n_nodes());
    for &node in nodes {
        supports.fix_node(node, [true; 3]);
    }
    supports
}

/// A field at all nodes.
pub(crate) fn interpolate(mesh: &Mesh, field: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    mesh.nodes.iter().flat_map(|x| field(*x)).collect()
}

pub(crate) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a: f64, v| a.max(v.abs()))
}

pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

/// Where a local point of an element is.
pub(crate) fn place(mesh: &Mesh, element: usize, l: [f64; 4]) -> [f64; 3] {
    let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
    mesh.order.shape(l, &mut n, &mut d);
    std::array::from_fn(|c| {
        mesh.element_nodes(element)
            .iter()
            .zip(&n)
            .map(|(&node, n)| n * mesh.nodes[node as usize][c])
            .sum()
    })
}

/// Area of the faces of a group, m². Tangents by central differences of the tetrahedron's shape
/// functions on its face 0: another way than the crate's, good to 1e-10.
pub(crate) fn area(mesh: &Mesh, name: &str) -> f64 {
    let shape = |order: Order, l: [f64; 3]| -> Vec<[f64; 2]> {
        let h = 1e-5;
        let local = order.face_nodes(0);
        let at = |l: [f64; 3]| {
            let mut full = [0.0; 4];
            for (v, x) in fem::element::FACE_VERTICES[0].into_iter().zip(l) {
                full[v] = x;
            }
            let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
            order.shape(full, &mut n, &mut d);
            local.iter().map(|&i| n[i]).collect::<Vec<f64>>()
        };
        let along = |k: usize| {
            let (mut up, mut down) = (l, l);
            (up[k], up[0], down[k], down[0]) = (l[k] + h, l[0] - h, l[k] - h, l[0] + h);
            let (up, down) = (at(up), at(down));
            up.into_iter()
                .zip(down)
                .map(|(a, b)| (a - b) / (2.0 * h))
                .collect::<Vec<f64>>()
        };
        along(1)
            .into_iter()
            .zip(along(2))
            .map(|(a, b)| [a, b])
            .collect()
    };
    let rule = fem::quadrature::triangle(24);
    let shapes: Vec<(f64, Vec<[f64; 2]>)> = rule
        .iter()
        .map(|p| (p.weight, shape(mesh.order, p.coordinates)))
        .collect();
    let mut sum = 0.0;
    for face in &mesh.group(name).unwrap().faces {
        for (weight, d) in &shapes {
            let tangent = |k: usize| -> [f64; 3] {
                std::array::from_fn(|c| {
                    face.nodes
                        .iter()
                        .zip(d)
                        .map(|(&n, d)| d[k] * mesh.nodes[n as usize][c])
                        .sum()
                })
            };
            let (a, b) = (tangent(0), tangent(1));
            let normal: [f64; 3] = std::array::from_fn(|i| {
                a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]
            });
            sum += 0.5 * weight * normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        }
    }
    sum
}

/// Coordinates to 1e-9, as a set.
pub(crate) fn coordinates(mesh: &Mesh, nodes: impl IntoIterator<Item = u32>) -> BTreeSet<[i64; 3]> {
    nodes
        .into_iter()
        .map(|n| mesh.nodes[n as usize].map(|c| (c * 1e9).round() as i64))
        .collect()
}

pub(crate) fn all_coordinates(mesh: &Mesh) -> BTreeSet<[i64; 3]> {
    coordinates(mesh, 0..mesh.n_nodes() as u32)
}

/// Each node is on one place only, and every node belongs to an element.
pub(crate) fn assert_no_node_twice(mesh: &Mesh) {
    assert_eq!(all_coordinates(mesh).len(), mesh.n_nodes());
    let used: BTreeSet<u32> = mesh.elements.iter().copied().collect();
    assert_eq!(used.len(), mesh.n_nodes());
    let tags: BTreeSet<u64> = mesh.node_tags.iter().copied().collect();
    assert_eq!(tags.len(), mesh.n_nodes());
}

/// Turns an element inside out: its vertices 1 and 2 swapped, with all their mid nodes.
pub(crate) fn mirror(mesh: &mut Mesh, element: usize) {
    let places = mesh.order.node_coordinates();
    let nodes = mesh.element_nodes(element).to_vec();
    let first = element * nodes.len();
    for (i, l) in places.iter().enumerate() {
        let other = [l[0], l[2], l[1], l[3]];
        let at = places.iter().position(|m| *m == other).unwrap();
        mesh.elements[first + i] = nodes[at];
    }
}
