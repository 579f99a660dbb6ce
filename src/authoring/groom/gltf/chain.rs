//! Joins loose segments to strands.

/// Chains of nodes, root first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chains {
    nodes: Vec<u32>,
    ends: Vec<usize>,
    /// Closed lines that were opened.
    pub loops: usize,
    /// Nodes where lines branched.
    pub branches: usize,
    /// Segments that join a node with itself.
    pub repeated: usize,
}

impl Chains {
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.ends.len()).map(|i| {
            let start = i.checked_sub(1).map_or(0, |before| self.ends[before]);
            &self.nodes[start..self.ends[i]]
        })
    }

    fn end(&mut self) {
        self.ends.push(self.nodes.len());
    }

    /// One line through all nodes.
    pub fn of_strip(order: Vec<u32>, closed: bool) -> Self {
        Self {
            ends: vec![order.len()],
            nodes: order,
            loops: usize::from(closed),
            ..Self::default()
        }
    }

    /// `count` nodes in pairs without shared indices: a pair that begins where the one before ends
    /// continues its chain.
    pub fn of_pairs<E>(count: u32, place: impl Fn(u32) -> Result<[f32; 3], E>) -> Result<Self, E> {
        let mut chains = Self::default();
        let mut last = None;
        for i in (0..count / 2).map(|i| 2 * i) {
            let (from, to) = (place(i)?, place(i + 1)?);
            if last != Some(from) {
                if last.is_some() {
                    chains.end();
                }
                chains.nodes.push(i);
            }
            chains.nodes.push(i + 1);
            last = Some(to);
        }
        if last.is_some() {
            chains.end();
        }
        Ok(chains)
    }

    /// Edges between nodes, two indices each, in any order. A chain begins at the end that has the
    /// lower index; at nodes with three or more edges, chains end and others begin.
    pub fn of_edges(indices: &[u32]) -> Self {
        let mut chains = Self::default();
        let Some(mut edges) = Edges::new(indices, &mut chains.repeated) else {
            return chains;
        };
        let count = edges.count();
        chains.branches = (0..count).filter(|v| edges.degree(*v) > 2).count();
        // From ends first, then from branches, and finally loops.
        let begins: [fn(usize) -> bool; 3] = [|d| d == 1, |d| d > 2, |d| d == 2];
        let mut open = Vec::new();
        for begins in begins {
            for start in 0..count {
                if begins(edges.degree(start)) {
                    open.push(start);
                }
                while let Some(v) = open.pop() {
                    while let Some(after) = edges.take(v) {
                        open.extend(chains.walk(&mut edges, v, after));
                    }
                }
            }
        }
        chains
    }

    /// Adds one chain from `v` through `after`. Returns the branch that it ends at.
    fn walk(&mut self, edges: &mut Edges, v: usize, after: usize) -> Option<usize> {
        self.nodes.push(edges.index(v));
        let mut at = after;
        while at != v {
            self.nodes.push(edges.index(at));
            match edges.degree(at) {
                2 => match edges.take(at) {
                    Some(after) => at = after,
                    None => break,
                },
                1 => break,
                _ => {
                    self.end();
                    return Some(at);
                }
            }
        }
        self.loops += usize::from(at == v);
        self.end();
        None
    }
}

/// Which edges each node has.
struct Edges {
    /// The lowest index, that of node 0 here.
    low: u32,
    /// Where the neighbours of each node begin.
    first: Vec<usize>,
    /// Each with its edge.
    neighbours: Vec<(usize, usize)>,
    used: Vec<bool>,
    /// Up to where the neighbours of each node have been used.
    next: Vec<usize>,
}

impl Edges {
    fn new(indices: &[u32], repeated: &mut usize) -> Option<Self> {
        let (pairs, _) = indices.as_chunks::<2>();
        let (low, high) = (*indices.iter().min()?, *indices.iter().max()?);
        let node = |index: u32| (index - low) as usize;
        let edges = || pairs.iter().filter(|[a, b]| a != b).map(|p| p.map(node));
        let mut first = vec![0; node(high) + 2];
        edges().flatten().for_each(|v| first[v + 1] += 1);
        let mut sum = 0;
        for f in &mut first {
            sum += *f;
            *f = sum;
        }
        let mut next = first.clone();
        let mut neighbours = vec![(0, 0); sum];
        for (e, [a, b]) in edges().enumerate() {
            for (v, other) in [(a, b), (b, a)] {
                neighbours[next[v]] = (other, e);
                next[v] += 1;
            }
        }
        *repeated = pairs.len() - sum / 2;
        next.clone_from(&first);
        Some(Self { low, first, neighbours, used: vec![false; sum / 2], next })
    }

    fn count(&self) -> usize {
        self.first.len() - 1
    }

    fn index(&self, v: usize) -> u32 {
        self.low + v as u32
    }

    fn degree(&self, v: usize) -> usize {
        self.first[v + 1] - self.first[v]
    }

    /// A neighbour by an unused edge, which is marked as used.
    fn take(&mut self, v: usize) -> Option<usize> {
        while self.next[v] < self.first[v + 1] {
            let (other, edge) = self.neighbours[self.next[v]];
            self.next[v] += 1;
            if !core::mem::replace(&mut self.used[edge], true) {
                return Some(other);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chains(indices: &[u32]) -> Vec<Vec<u32>> {
        Chains::of_edges(indices).iter().map(<[u32]>::to_vec).collect()
    }

    #[test]
    fn edges_in_any_order_become_strands_from_their_lower_end() {
        assert_eq!(chains(&[2, 3, 1, 0, 1, 2, 5, 4]), [vec![0, 1, 2, 3], vec![4, 5]]);
    }

    #[test]
    fn loops_open_and_branches_split() {
        let closed = Chains::of_edges(&[0, 1, 1, 2, 2, 0]);
        assert_eq!((closed.loops, closed.iter().next()), (1, Some(&[0, 1, 2][..])));
        let fork = Chains::of_edges(&[0, 1, 1, 2, 2, 3, 2, 4]);
        let lines: Vec<_> = fork.iter().collect();
        assert_eq!(lines, [&[0, 1, 2][..], &[2, 3], &[2, 4]]);
        assert_eq!((fork.branches, fork.loops), (1, 0));
    }

    #[test]
    fn odd_edges_do_no_harm() {
        assert_eq!(Chains::of_edges(&[3, 3]).repeated, 1);
        assert_eq!(Chains::of_edges(&[]).iter().count(), 0);
        assert_eq!(chains(&[0, 1, 0, 1]), [[0, 1]]);
        assert_eq!(chains(&[7]), [[0u32; 0]; 0]);
    }

    #[test]
    fn loose_pairs_follow_each_other_by_place() {
        let at = |x: f32| [x, 0.0, 0.0];
        let places = [at(0.0), at(1.0), at(1.0), at(2.0), at(5.0), at(6.0)];
        let chains = Chains::of_pairs::<()>(6, |i| Ok(places[i as usize])).unwrap();
        let lines: Vec<_> = chains.iter().collect();
        assert_eq!(lines, [&[0, 1, 3][..], &[4, 5]]);
    }
}
