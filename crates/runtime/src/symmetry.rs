//! Symmetries of a formula.

/// A symmetry that is recognised in a formula; its momentum decays with the conformal factor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FormulaSymmetry {
    /// L is invariant under translation of these coordinates by a common length.
    Translation(Vec<usize>),
    /// L is invariant under rotation of these pairs of coordinates by a common angle.
    Rotation(Vec<(usize, usize)>),
}
