//! Joins loose segments to strands.

use bevy::platform::collections::HashMap;

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

    /// Joins chains that meet at a place, because segments have nodes of their own: one that begins where the
    /// one before ends continues it, and so does any other that alone begins where only one ends. Chains that
    /// begin at the same place are strands with the same root.
    pub fn joined(self, place: impl Fn(u32) -> [f32; 3]) -> Self {
        let key = |i: u32| {
            place(i).map(|x| if x.is_nan() { x.to_bits() ^ i } else { (x + 0.0).to_bits() })
        };
        let chains: Vec<&[u32]> = self.iter().filter(|chain| !chain.is_empty()).collect();
        let heads: Vec<[u32; 3]> = chains.iter().map(|c| key(c[0])).collect();
        let tails: Vec<[u32; 3]> = chains.iter().map(|c| key(c[c.len() - 1])).collect();
        let sole = |places: &[[u32; 3]]| {
            let mut sole = HashMap::<[u32; 3], Option<usize>>::default();
            for (k, place) in places.iter().enumerate() {
                sole.entry(*place).and_modify(|k| *k = None).or_insert(Some(k));
            }
            sole
        };
        let (heads_at, tails_at) = (sole(&heads), sole(&tails));
        let follows = |k: usize| k + 1 < chains.len() && tails[k] == heads[k + 1];
        let next = |k: usize| {
            let sole = |at: &HashMap<_, Option<usize>>| at.get(&tails[k]).copied().flatten();
            let other = sole(&heads_at).filter(|j| *j != k && sole(&tails_at) == Some(k));
            if follows(k) { Some(k + 1) } else { other }
        };
        let mut is_next = vec![false; chains.len()];
        (0..chains.len()).filter_map(next).for_each(|j| is_next[j] = true);
        let mut made = Self {
            loops: self.loops,
            branches: self.branches,
            repeated: self.repeated,
            ..Self::default()
        };
        let mut done = vec![false; chains.len()];
        // From chains that continue none, and then round closed lines.
        for closed in [false, true] {
            for start in 0..chains.len() {
                if done[start] || (is_next[start] && !closed) {
                    continue;
                }
                done[start] = true;
                made.nodes.extend(chains[start]);
                let mut at = start;
                while let Some(j) = next(at).filter(|j| !done[*j]) {
                    done[j] = true;
                    made.nodes.extend(&chains[j][1..]);
                    at = j;
                }
                made.loops += usize::from(closed);
                made.end();
            }
        }
        made
    }

    /// Edges between nodes, two indices each, in any order. A chain begins at the end that has the
    /// lower index, a lone edge at its first; at nodes with three or more edges, chains end and others begin.
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
        let is_lone = edges.degree(v) == 1 && edges.degree(after) == 1;
        if is_lone && edges.is_from(after) {
            self.nodes.extend([edges.index(after), edges.index(v)]);
            self.end();
            return None;
        }
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
    /// Whether an edge is from each node.
    from: Vec<bool>,
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
        let mut from = vec![false; first.len()];
        for (e, [a, b]) in edges().enumerate() {
            from[a] = true;
            for (v, other) in [(a, b), (b, a)] {
                neighbours[next[v]] = (other, e);
                next[v] += 1;
            }
        }
        *repeated = pairs.len() - sum / 2;
        next.clone_from(&first);
        Some(Self { low, first, neighbours, from, used: vec![false; sum / 2], next })
    }

    fn count(&self) -> usize {
        self.first.len() - 1
    }

    fn index(&self, v: usize) -> u32 {
        self.low + v as u32
    }

    /// Whether an edge is from it.
    fn is_from(&self, v: usize) -> bool {
        self.from[v]
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
        assert_eq!(chains(&[2, 3, 1, 0, 1, 2, 5, 4]), [vec![0, 1, 2, 3], vec![5, 4]]);
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
        let joined = |places: &[f32], indices: &[u32]| {
            let chains = Chains::of_edges(indices).joined(|i| [places[i as usize], 0.0, 0.0]);
            (chains.iter().map(<[u32]>::to_vec).collect::<Vec<_>>(), chains.loops)
        };
        let places = [0.0, 1.0, 1.0, 2.0, 5.0, 6.0];
        let lines = vec![vec![0, 1, 3], vec![4, 5]];
        assert_eq!(joined(&places, &[0, 1, 2, 3, 4, 5]), (lines.clone(), 0));
        // In another order, and against the order of their nodes.
        assert_eq!(joined(&places, &[2, 3, 4, 5, 0, 1]), (lines, 0));
        assert_eq!(joined(&places, &[3, 2, 1, 0]), (vec![vec![3, 2, 0]], 0));
        // Some nodes are shared, one is double.
        assert_eq!(
            joined(&[0.0, 1.0, 2.0, 2.0, 3.0], &[0, 1, 1, 2, 3, 4]),
            (vec![vec![0, 1, 2, 4]], 0)
        );
        // Two strands with the same root, in a row, and two that end together.
        let fan = vec![vec![0, 1], vec![2, 3]];
        assert_eq!(joined(&[0.0, 1.0, 0.0, 2.0], &[0, 1, 2, 3]), (fan.clone(), 0));
        assert_eq!(joined(&[1.0, 0.0, 2.0, 0.0], &[0, 1, 2, 3]), (fan, 0));
        // Closed.
        let ring = [0.0, 1.0, 1.0, 2.0, 2.0, 0.0];
        assert_eq!(joined(&ring, &[0, 1, 2, 3, 4, 5]), (vec![vec![0, 1, 3, 5]], 1));
        let broken = joined(&[0.0, f32::NAN, f32::NAN, 1.0], &[0, 1, 2, 3]);
        assert_eq!(broken.0.len(), 2);
    }
}
