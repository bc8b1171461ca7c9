//! In which order nodes are eliminated, so that the factor has few entries.
//!
//! Two kinds of part want two kinds of order. In thin ones minimum degree is best; in solid ones
//! nested dissection leaves a third less. Both are computed on the graph of the nodes, which is
//! nine times smaller than that of the unknowns and gives the same order; the caller counts the
//! entries and takes the better.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::amd;

use crate::Error;

/// Vertices below which a piece is not cut any more but ordered by minimum degree. From 50 to 400
/// the entries differ by 3 %.
const LEAF: usize = 100;

/// How much a cut into unequal halves is worth avoiding, tried one after the other: small
/// separators suit long parts, equal halves suit blocks.
pub(crate) const BALANCES: [f64; 2] = [0.1, 0.5];

/// An undirected graph without loops: neighbours of vertex `v` at `starts[v]..starts[v + 1]`.
#[derive(Clone, Debug)]
pub(crate) struct Graph {
    starts: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// From the neighbours of one vertex after the other.
    pub(crate) fn new(lists: impl IntoIterator<Item = Vec<u32>>) -> Self {
        let mut graph = Self {
            starts: vec![0],
            neighbours: Vec::new(),
        };
        for list in lists {
            graph.neighbours.extend(list);
            graph.starts.push(graph.neighbours.len());
        }
        graph
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn neighbours(&self, vertex: u32) -> &[u32] {
        &self.neighbours[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }

    /// Approximate minimum degree (Amestoy, Davis and Duff 1996).
    ///
    /// # Errors
    /// [`Error::TooLarge`].
    pub(crate) fn minimum_degree(&self) -> Result<Vec<u32>, Error> {
        let all: Vec<u32> = (0..self.len() as u32).collect();
        let mut local = all.clone();
        self.minimum_degree_of(&all, &mut local)
    }

    /// Nested dissection (George 1973) by levels of distance from a vertex at the rim: a level
    /// cuts the graph in two and is eliminated after both.
    ///
    /// # Errors
    /// [`Error::TooLarge`].
    pub(crate) fn dissection(&self, balance: f64) -> Result<Vec<u32>, Error> {
        let all: Vec<u32> = (0..self.len() as u32).collect();
        let mut cutting = Dissection {
            graph: self,
            balance,
            piece: vec![0; self.len()],
            n_pieces: 1,
            level: vec![UNSEEN; self.len()],
            local: vec![0; self.len()],
        };
        // Parts still to be ordered, the last of the order first; a separator is only written.
        let mut reversed = Vec::with_capacity(self.len());
        let mut waiting = vec![all];
        while let Some(vertices) = waiting.pop() {
            if vertices.len() > LEAF
                && let Some(cut) = cutting.cut(&vertices)
            {
                reversed.extend(cut.separator.into_iter().rev());
                waiting.extend(cut.halves);
            } else {
                let order = self.minimum_degree_of(&vertices, &mut cutting.local)?;
                reversed.extend(order.into_iter().rev());
            }
        }
        reversed.reverse();
        Ok(reversed)
    }

    /// Order of some vertices by minimum degree in their subgraph. `local` is memory for each
    /// vertex of the graph.
    fn minimum_degree_of(&self, vertices: &[u32], local: &mut [u32]) -> Result<Vec<u32>, Error> {
        let n = vertices.len();
        for (i, &v) in vertices.iter().enumerate() {
            local[v as usize] = i as u32;
        }
        let is_here = |v: u32| vertices.get(local[v as usize] as usize) == Some(&v);
        let mut starts = vec![0u32];
        let mut rows = Vec::new();
        for (j, &v) in vertices.iter().enumerate() {
            let before = rows.len();
            let others = self.neighbours(v).iter().filter(|&&u| is_here(u));
            rows.extend(
                others
                    .map(|&u| local[u as usize])
                    .filter(|&i| (i as usize) < j),
            );
            rows[before..].sort_unstable();
            starts.push(rows.len() as u32);
        }
        let upper = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
        let (mut order, mut place) = (vec![0u32; n], vec![0u32; n]);
        let scratch = amd::order_scratch::<u32>(n, upper.compute_nnz());
        let too_large = || Error::TooLarge(format!("no memory to order {n} nodes"));
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| too_large())?;
        let stack = MemStack::new(&mut memory);
        amd::order(
            &mut order,
            &mut place,
            upper.as_ref(),
            amd::Control::default(),
            stack,
        )
        .map_err(|_| too_large())?;
        Ok(order.into_iter().map(|i| vertices[i as usize]).collect())
    }
}

/// Level of a vertex that the search has not met.
const UNSEEN: u32 = u32::MAX;

struct Dissection<'a> {
    graph: &'a Graph,
    balance: f64,
    /// Which piece each vertex is in.
    piece: Vec<u32>,
    n_pieces: u32,
    /// Distance from the root of the last search of its piece.
    level: Vec<u32>,
    local: Vec<u32>,
}

/// No edge leads from one half to the other.
struct Cut {
    halves: [Vec<u32>; 2],
    separator: Vec<u32>,
}

impl Dissection<'_> {
    /// Cuts a piece in two; `None` if it is too dense to have a level between two others.
    fn cut(&mut self, vertices: &[u32]) -> Option<Cut> {
        let mut found = self.search(vertices, vertices[0]);
        if found.len() < vertices.len() {
            let is_found = |v: &u32| self.level[*v as usize] != UNSEEN;
            let rest = vertices.iter().copied().filter(|v| !is_found(v)).collect();
            return Some(self.take([found, rest], vec![]));
        }
        // From the end of a search to the end of the next: soon from rim to rim.
        for _ in 0..3 {
            found = self.search(vertices, *found.last()?);
        }
        let last = self.level[*found.last()? as usize];
        let at = self.best_level(&found, last)?;
        let (mut near, mut far, mut separator) = (vec![], vec![], vec![]);
        for v in found {
            match self.level[v as usize].cmp(&at) {
                std::cmp::Ordering::Greater => far.push(v),
                std::cmp::Ordering::Equal if self.has_next_level(v) => separator.push(v),
                _ => near.push(v),
            }
        }
        Some(self.take([near, far], separator))
    }

    /// Smallest level, with a price on unequal halves.
    fn best_level(&self, found: &[u32], last: u32) -> Option<u32> {
        // Vertices of each level, and those of them with a neighbour in the next.
        let (mut size, mut rim) = (vec![0usize; last as usize + 1], vec![0; last as usize + 1]);
        for &v in found {
            let level = self.level[v as usize] as usize;
            size[level] += 1;
            rim[level] += usize::from(self.has_next_level(v));
        }
        let n = found.len() as f64;
        let mut before = size[0];
        let mut best = None;
        for level in 1..last {
            let (size, rim) = (size[level as usize], rim[level as usize]);
            let near = (before + size - rim) as f64 / n;
            let far = (found.len() - before - size) as f64 / n;
            before += size;
            let unequal = (near - far) * (near - far) / (near * far);
            let cost = rim as f64 * (1.0 + self.balance * unequal);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, level));
            }
        }
        best.map(|(_, level)| level)
    }

    fn has_next_level(&self, v: u32) -> bool {
        let mut neighbours = self.graph.neighbours(v).iter();
        let (piece, next) = (self.piece[v as usize], self.level[v as usize] + 1);
        neighbours.any(|&u| self.piece[u as usize] == piece && self.level[u as usize] == next)
    }

    /// Vertices of a piece in the order of their distance from the root.
    fn search(&mut self, vertices: &[u32], root: u32) -> Vec<u32> {
        for &v in vertices {
            self.level[v as usize] = UNSEEN;
        }
        let piece = self.piece[root as usize];
        self.level[root as usize] = 0;
        let mut found = vec![root];
        let mut next = 0;
        while let Some(&v) = found.get(next) {
            next += 1;
            for &u in self.graph.neighbours(v) {
                if self.piece[u as usize] == piece && self.level[u as usize] == UNSEEN {
                    self.level[u as usize] = self.level[v as usize] + 1;
                    found.push(u);
                }
            }
        }
        found
    }

    fn take(&mut self, halves: [Vec<u32>; 2], separator: Vec<u32>) -> Cut {
        for piece in halves.iter().chain([&separator]) {
            for &v in piece {
                self.piece[v as usize] = self.n_pieces;
            }
            self.n_pieces += 1;
        }
        Cut { halves, separator }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of `n` x `m` x `k` vertices, neighbours along edges and diagonals.
    fn grid(n: usize, m: usize, k: usize) -> Graph {
        let vertices = (0..n * m * k).map(|v| [v % n, v / n % m, v / (n * m)]);
        Graph::new(vertices.map(|[x, y, z]| {
            let mut list = Vec::new();
            for a in x.saturating_sub(1)..(x + 2).min(n) {
                for b in y.saturating_sub(1)..(y + 2).min(m) {
                    for c in z.saturating_sub(1)..(z + 2).min(k) {
                        if [a, b, c] != [x, y, z] {
                            list.push((a + n * (b + m * c)) as u32);
                        }
                    }
                }
            }
            list
        }))
    }

    /// Entries of L (diagonal included) by eliminating one vertex after the other on paper.
    fn entries(graph: &Graph, order: &[u32]) -> usize {
        let mut place = vec![0; order.len()];
        for (i, &v) in order.iter().enumerate() {
            place[v as usize] = i;
        }
        let mut below: Vec<std::collections::BTreeSet<usize>> = order
            .iter()
            .enumerate()
            .map(|(i, &v)| {
                let places = graph.neighbours(v).iter().map(|&u| place[u as usize]);
                places.filter(|&p| p > i).collect()
            })
            .collect();
        for i in 0..order.len() {
            if let Some(&parent) = below[i].first() {
                let rest: Vec<usize> = below[i].iter().copied().skip(1).collect();
                below[parent].extend(rest);
            }
        }
        order.len() + below.iter().map(|b| b.len()).sum::<usize>()
    }

    fn assert_permutation(order: &[u32], n: usize) {
        let mut sorted = order.to_vec();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..n as u32).collect::<Vec<_>>());
    }

    #[test]
    fn each_order_has_every_vertex_once() {
        let two_pieces = Graph::new((0..400u32).map(|v| {
            let ends = [v.checked_sub(1), Some(v + 1)];
            let is_there = |u: &u32| *u < 400 && u / 200 == v / 200;
            ends.into_iter().flatten().filter(is_there).collect()
        }));
        let complete = Graph::new((0..150).map(|v| (0..150).filter(|&u| u != v).collect()));
        for graph in [
            Graph::new([]),
            Graph::new([vec![]]),
            grid(12, 9, 7),
            two_pieces,
            complete,
        ] {
            assert_permutation(&graph.minimum_degree().unwrap(), graph.len());
            for balance in BALANCES {
                assert_permutation(&graph.dissection(balance).unwrap(), graph.len());
            }
        }
    }

    /// A bar is cut across, so that its factor grows with its length only; a plate is cut into
    /// plates.
    #[test]
    fn dissection_leaves_fewer_entries_than_the_natural_order() {
        let plate = grid(60, 60, 1);
        let natural: Vec<u32> = (0..plate.len() as u32).collect();
        let cut = entries(&plate, &plate.dissection(0.5).unwrap());
        let uncut = entries(&plate, &natural);
        assert!(3 * cut < 2 * uncut, "{cut} {uncut}");
        let bar = |length| {
            entries(
                &grid(length, 4, 4),
                &grid(length, 4, 4).dissection(0.1).unwrap(),
            )
        };
        let (short, long) = (bar(60), bar(240));
        assert!(long < 5 * short, "{short} {long}");
    }
}
