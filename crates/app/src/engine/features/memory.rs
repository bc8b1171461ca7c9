//! What is remembered of each feature of the tool from pass to pass and from step to step.

use contact::surface::NO_FACE;

use super::Found;

/// The face that a feature stays with in this pass, of several that it is behind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) face: u32,
    pub(super) gap: f64,
    /// Followed from the face that it was at before.
    pub(super) is_by_walk: bool,
}

/// Faces that a feature is remembered at in a stride: as many as meet in most corners between faces.
const MOST_FACES: usize = 6;

#[derive(Clone, Copy, Debug)]
struct OfFeature {
    face: u32,
    /// All that it had a row at in this stride, the first of them set.
    faces: [u32; MOST_FACES],
    n_faces: usize,
    /// Stride in which it last had a row.
    stride: u64,
    /// Pass in which it last had a row.
    pass: u64,
    side: Side,
    /// Pass that the side belongs to.
    side_pass: u64,
    /// Smallest gap of its rows in the pass that it last had one in, m.
    pressed: f64,
}

/// Faces and forces of all features.
#[derive(Debug)]
pub(super) struct Memory {
    of: Vec<OfFeature>,
    /// Features that had a row in this stride.
    seen: Vec<u32>,
    stride: u64,
    pass: u64,
}

impl Memory {
    pub(super) fn new(n_features: usize) -> Self {
        let nothing = OfFeature {
            face: NO_FACE,
            faces: [NO_FACE; MOST_FACES],
            n_faces: 0,
            stride: 0,
            pass: 0,
            side: Side {
                face: NO_FACE,
                gap: 0.0,
                is_by_walk: false,
            },
            side_pass: 0,
            pressed: f64::INFINITY,
        };
        Self {
            of: vec![nothing; n_features],
            seen: Vec::with_capacity(n_features),
            // A stride after the last one: nothing is remembered.
            stride: 2,
            pass: 0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.seen.clear();
        // What was at a face is not any more.
        self.stride += 2;
    }

    /// Only these have had a row.
    pub(super) fn begin_stride<'f>(&mut self, carried: impl Iterator<Item = &'f Found>) {
        self.stride += 1;
        self.seen.clear();
        for found in carried {
            self.see(found.feature);
            self.add_face(found.feature, found.face);
        }
    }

    pub(super) fn begin_pass(&mut self) {
        self.pass += 1;
    }

    fn see(&mut self, feature: u32) {
        let of = &mut self.of[feature as usize];
        if of.stride != self.stride {
            of.stride = self.stride;
            of.n_faces = 0;
            self.seen.push(feature);
        }
    }

    fn add_face(&mut self, feature: u32, face: u32) {
        let of = &mut self.of[feature as usize];
        let is_new = !of.faces[..of.n_faces].contains(&face);
        if is_new && of.n_faces < MOST_FACES {
            of.faces[of.n_faces] = face;
            of.n_faces += 1;
        }
    }

    /// The faces that a feature which was seen had a row at in this stride.
    pub(super) fn faces(&self, feature: u32) -> ([u32; MOST_FACES], usize) {
        let of = &self.of[feature as usize];
        (of.faces, of.n_faces)
    }

    /// Features that had a row in this stride.
    pub(super) fn seen(&self) -> &[u32] {
        &self.seen
    }

    /// The face that a feature was at in this stride or the one before.
    pub(super) fn face_before(&self, feature: u32) -> u32 {
        let of = &self.of[feature as usize];
        if of.stride + 1 >= self.stride {
            of.face
        } else {
            NO_FACE
        }
    }

    pub(super) fn side_of(&self, feature: u32) -> Option<Side> {
        let of = &self.of[feature as usize];
        (of.side_pass == self.pass).then_some(of.side)
    }

    /// A feature that stays with a face has a row there, whatever its gap.
    pub(super) fn set_side(&mut self, feature: u32, face: u32, gap: f64, is_by_walk: bool) {
        let of = &mut self.of[feature as usize];
        of.side = Side {
            face,
            gap,
            is_by_walk,
        };
        of.side_pass = self.pass;
        if is_by_walk {
            self.see(feature);
        }
    }

    /// Notes which features have a row.
    pub(super) fn note(&mut self, rows: &[Found]) {
        for row in rows {
            let of = &mut self.of[row.feature as usize];
            (of.pass, of.pressed) = (self.pass, f64::INFINITY);
        }
    }

    pub(super) fn has_row(&self, feature: u32) -> bool {
        self.of[feature as usize].pass == self.pass
    }

    /// Keeps the faces of the pass's rows; of several the one that is pressed most.
    pub(super) fn remember(&mut self, rows: &[Found]) {
        self.note(rows);
        for row in rows {
            self.see(row.feature);
            self.add_face(row.feature, row.face);
            let of = &mut self.of[row.feature as usize];
            if row.gap < of.pressed {
                (of.face, of.pressed) = (row.face, row.gap);
            }
        }
    }
}
