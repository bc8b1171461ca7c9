//! Deformed shapes for ParaView and its relatives: VTK's XML unstructured grid.
//!
//! The points are the nodes at rest; the viewer's "warp by vector" with `displacement_m` shows the
//! deformed shape at any exaggeration.

use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataSet, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};

use super::data::{CellKind, Frame, PartDrawing};

/// VTK's node k of a quadratic tetrahedron is Gmsh's node `GMSH_OF_VTK_TET10[k]`: the middles of
/// the edges 1-3 and 2-3 change places.
const GMSH_OF_VTK_TET10: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];

/// The same for the cubic tetrahedron. VTK walks its edges 01 12 20 03 13 23 and its faces 013 123
/// 023 012; Gmsh walks 01 12 20 30 32 31 and 021 013 032 312.
const GMSH_OF_VTK_TET20: [usize; 20] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 10, 15, 14, 13, 12, 17, 19, 18, 16,
];

/// The bytes of a `.vtu` file: the part with `displacement_m`, `von_mises_Pa` (if the frame has
/// it) and `contact_force_N` (on the part) at its nodes.
///
/// # Errors
/// What the writer says.
pub fn frame(part: &PartDrawing, frame: &Frame) -> Result<Vec<u8>, String> {
    let n_nodes = part.nodes.len();
    let per_cell = part.cell_kind.nodes_per_cell();
    let (cell_type, order): (_, &[usize]) = match part.cell_kind {
        CellKind::Tet4 => (CellType::Tetra, &[0, 1, 2, 3]),
        CellKind::Tet10 => (CellType::QuadraticTetra, &GMSH_OF_VTK_TET10),
        CellKind::Tet20 => (CellType::LagrangeTetrahedron, &GMSH_OF_VTK_TET20),
    };
    let cells = part.cells.chunks_exact(per_cell);
    let n_cells = cells.len();
    let connectivity: Vec<u64> = cells
        .flat_map(|cell| order.iter().map(|&k| u64::from(cell[k])))
        .collect();

    let mut contact_force = vec![0.0f64; 3 * n_nodes];
    for contact in &frame.contacts {
        let at = 3 * contact.node as usize;
        for (sum, f) in contact_force[at..at + 3]
            .iter_mut()
            .zip(contact.force.to_array())
        {
            *sum += f;
        }
    }
    let flat = |v: &[glam::DVec3]| v.iter().flat_map(|p| p.to_array()).collect::<Vec<f64>>();
    let mut point = vec![
        Attribute::vectors("displacement_m").with_data(flat(&frame.displacement)),
        Attribute::vectors("contact_force_N").with_data(contact_force),
    ];
    if !frame.von_mises.is_empty() {
        point.push(Attribute::scalars("von_mises_Pa", 1).with_data(frame.von_mises.clone()));
    }
    let grid = UnstructuredGridPiece {
        points: flat(&part.nodes).into(),
        cells: Cells {
            cell_verts: VertexNumbers::XML {
                connectivity,
                offsets: (1..=n_cells).map(|i| (i * per_cell) as u64).collect(),
            },
            types: vec![cell_type; n_cells],
        },
        data: Attributes {
            point,
            cell: Vec::new(),
        },
    };
    let file = Vtk {
        // Of the format, for Lagrange cells; older readers know 0.1 but not the cells.
        version: Version { major: 1, minor: 0 },
        title: frame.label.clone(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::inline(grid),
        file_path: None,
    };
    let mut bytes = Vec::new();
    file.write_xml(&mut bytes).map_err(|e| e.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use glam::DVec3;
    use vtkio::model::{IOBuffer, Piece};

    use super::super::sample;
    use super::*;

    fn read_back(bytes: &[u8]) -> UnstructuredGridPiece {
        let DataSet::UnstructuredGrid { pieces, .. } = Vtk::parse_xml(bytes).unwrap().data else {
            panic!("another data set")
        };
        let Some(Piece::Inline(piece)) = pieces.into_iter().next() else {
            panic!("no piece")
        };
        *piece
    }

    fn values(buffer: &IOBuffer) -> Vec<f64> {
        buffer.clone().cast_into().unwrap()
    }

    fn array(piece: &UnstructuredGridPiece, name: &str) -> Vec<f64> {
        let found = piece.data.point.iter().find_map(|a| match a {
            Attribute::DataArray(data) if data.name == name => Some(values(&data.data)),
            _ => None,
        });
        found.unwrap()
    }

    #[test]
    fn a_frame_reads_back_as_it_was() {
        let part = sample::part(8, 1, 2);
        let mut shown = sample::frame(&part, "peak", 1.0);
        let (node, force) = (3, DVec3::new(1.0, 2.0, 3.0));
        let point = part.nodes[3];
        shown.contacts = vec![
            super::super::ContactForce {
                node,
                point,
                force,
                sticks: false
            };
            2
        ];
        let piece = read_back(&frame(&part, &shown).unwrap());
        let nodes = values(&piece.points);
        assert_eq!(nodes.len(), 3 * part.nodes.len());
        assert_eq!(nodes[3..6], part.nodes[1].to_array());
        assert_eq!(piece.cells.types.len(), part.cells.len() / 4);
        assert!(piece.cells.types.iter().all(|&t| t == CellType::Tetra));
        let (connectivity, offsets) = piece.cells.cell_verts.clone().into_xml();
        assert!(
            connectivity
                .iter()
                .map(|&i| i as u32)
                .eq(part.cells.iter().copied())
        );
        assert_eq!(*offsets.last().unwrap(), part.cells.len() as u64);
        assert_eq!(
            array(&piece, "displacement_m")[15..18],
            shown.displacement[5].to_array()
        );
        assert_eq!(array(&piece, "von_mises_Pa"), shown.von_mises);
        let forces = array(&piece, "contact_force_N");
        assert_eq!(forces[9..12], [2.0, 4.0, 6.0]);
        assert_eq!(forces.iter().sum::<f64>(), 12.0);
    }

    #[test]
    fn a_frame_without_stress_has_no_such_array() {
        let part = sample::part(4, 1, 1);
        let mut shown = sample::frame(&part, "peak", 1.0);
        shown.von_mises.clear();
        let piece = read_back(&frame(&part, &shown).unwrap());
        assert_eq!(piece.data.point.len(), 2);
    }

    /// Nodes by their corners' weights: edges in Gmsh's and VTK's walk, then faces.
    fn tetrahedron(edges: [[usize; 2]; 6], faces: &[[usize; 3]], shares: &[f64]) -> Vec<DVec3> {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mut nodes = corners.to_vec();
        for [a, b] in edges {
            nodes.extend(shares.iter().map(|&s| corners[a].lerp(corners[b], s)));
        }
        for face in faces {
            nodes.push(face.iter().map(|&c| corners[c]).sum::<DVec3>() / 3.0);
        }
        nodes
    }

    #[test]
    fn curved_elements_get_the_viewers_node_order() {
        let gmsh_edges = [[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]];
        let vtk_edges = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
        let gmsh_faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [3, 1, 2]];
        let vtk_faces = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]];
        let thirds = [1.0 / 3.0, 2.0 / 3.0];
        for (kind, cell_type, gmsh, vtk) in [
            (
                CellKind::Tet10,
                CellType::QuadraticTetra,
                tetrahedron(gmsh_edges, &[], &[0.5]),
                tetrahedron(vtk_edges, &[], &[0.5]),
            ),
            (
                CellKind::Tet20,
                CellType::LagrangeTetrahedron,
                tetrahedron(gmsh_edges, &gmsh_faces, &thirds),
                tetrahedron(vtk_edges, &vtk_faces, &thirds),
            ),
        ] {
            let n = gmsh.len();
            let part = PartDrawing {
                nodes: gmsh,
                cells: (0..n as u32).collect(),
                cell_kind: kind,
                ..PartDrawing::default()
            };
            let shown = Frame {
                displacement: vec![DVec3::ZERO; n],
                ..Frame::default()
            };
            let piece = read_back(&frame(&part, &shown).unwrap());
            assert_eq!(piece.cells.types, [cell_type]);
            let (connectivity, _) = piece.cells.cell_verts.into_xml();
            for (k, expected) in vtk.iter().enumerate() {
                let node = part.nodes[connectivity[k] as usize];
                assert!(
                    node.distance(*expected) < 1e-12,
                    "{kind:?} node {k}: {node}"
                );
            }
        }
    }
}
