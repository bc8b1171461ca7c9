//! What would make the stiffness singular or wrong, found before it is assembled.

use rayon::prelude::*;

use super::Mesh;
use crate::Error;
use crate::supports::{self, Supports};

/// Elements that are inverted or flat somewhere, or not proved to be neither.
pub(super) struct InvalidElements {
    /// The first with the lowest bound of det J, and that bound, m³.
    pub(super) worst: Option<(usize, f64)>,
    count: usize,
}

impl InvalidElements {
    /// "; N more are too", or nothing.
    pub(super) fn others_in_words(&self) -> String {
        match self.count {
            0 | 1 => String::new(),
            count => format!("; {} more are too", count - 1),
        }
    }
}

impl Mesh {
    /// Finds inverted elements, loose pieces and free rigid motions; returns warnings about what
    /// can be lived with.
    ///
    /// # Errors
    /// [`Error::Inverted`], [`Error::LoosePiece`], [`Error::FreeRigidMotion`]: named by tags of
    /// the mesh file.
    pub fn check(&self, supports: &Supports) -> Result<Vec<String>, Error> {
        self.check_elements()?;
        self.check_supports(supports)?;
        Ok(self.warnings())
    }

    /// Refuses elements that are not valid.
    pub(super) fn check_elements(&self) -> Result<(), Error> {
        let invalid = self.invalid_elements();
        match invalid.worst {
            None => Ok(()),
            Some((e, jacobian)) => Err(Error::Inverted {
                tag: self.element_tags[e],
                jacobian,
                more: invalid.others_in_words(),
            }),
        }
    }

    /// Elements whose det J is not proved positive.
    pub(super) fn invalid_elements(&self) -> InvalidElements {
        let bounds: Vec<f64> = (0..self.n_elements())
            .into_par_iter()
            .map(|e| self.smallest_jacobian(e))
            .collect();
        let mut invalid = InvalidElements {
            worst: None,
            count: 0,
        };
        for (e, bound) in bounds.into_iter().enumerate() {
            if bound > 0.0 && bound.is_finite() {
                continue;
            }
            invalid.count += 1;
            if invalid.worst.is_none_or(|(_, worst)| bound < worst) {
                invalid.worst = Some((e, bound));
            }
        }
        invalid
    }

    fn check_supports(&self, supports: &Supports) -> Result<(), Error> {
        let pieces = self.pieces();
        let n_pieces = pieces.iter().max().map_or(0, |p| p + 1);
        let mut nodes_of_piece = vec![Vec::new(); n_pieces as usize];
        for (e, &piece) in pieces.iter().enumerate() {
            nodes_of_piece[piece as usize].extend_from_slice(self.element_nodes(e));
        }
        for (piece, nodes) in nodes_of_piece.iter_mut().enumerate() {
            nodes.sort_unstable();
            nodes.dedup();
            let free = supports::free_rigid_motions(&self.nodes, nodes, supports);
            if free.is_empty() {
                continue;
            }
            let motions = free.join(", ");
            if n_pieces == 1 {
                return Err(Error::FreeRigidMotion { motions });
            }
            let elements: Vec<usize> = (0..pieces.len())
                .filter(|&e| pieces[e] as usize == piece)
                .collect();
            return Err(Error::LoosePiece {
                tag: self.element_tags[elements[0]],
                elements: elements.len(),
                motions,
            });
        }
        Ok(())
    }

    fn warnings(&self) -> Vec<String> {
        let mut used = vec![false; self.n_nodes()];
        for &node in &self.elements {
            used[node as usize] = true;
        }
        let unused: Vec<u64> = self
            .node_tags
            .iter()
            .zip(&used)
            .filter(|(_, used)| !**used)
            .map(|(tag, _)| *tag)
            .collect();
        let mut warnings = Vec::new();
        if let [first, ..] = unused[..] {
            warnings.push(format!(
                "{} nodes are in no element (the first is node {first}); they are held and take no part",
                unused.len()
            ));
        }
        if let Some((element, count)) = self.overlap() {
            warnings.push(format!(
                "{count} faces belong to more than two elements (the first is of element {}); \
                 elements overlap or are there twice, and their stiffness counts twice",
                self.element_tags[element as usize]
            ));
        }
        warnings
    }
}
