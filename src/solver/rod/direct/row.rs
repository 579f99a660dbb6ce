//! Scratch of the solve for each edge.

/// Results of the elimination for back substitution: index i belongs to edge i and the node at its
/// end.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct DirectRow<C> {
    pub(super) near: [[C; 3]; 3],
    pub(super) far: [[C; 3]; 3],
    pub(super) solution: [C; 3],
    pub(super) lower: [C; 3],
    pub(super) twist: C,
    pub(super) twist_next: C,
}
