//! Symmetries of a formula.

use crate::forces::Work;
use crate::{Formula, FormulaDerivatives};

/// A symmetry that is recognised in a formula; its momentum decays with the conformal factor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FormulaSymmetry {
    /// L is invariant under translation of these coordinates by a common length.
    Translation(Vec<usize>),
    /// L is invariant under rotation of these pairs of coordinates by a common angle.
    Rotation(Vec<(usize, usize)>),
}

impl FormulaSymmetry {
    /// The momentum at a state: the sum of `p_i`, or of `q_i p_j - q_j p_i`. It is NaN where a component is missing.
    pub fn momentum(&self, q: &[f64], p: &[f64]) -> f64 {
        let at = |x: &[f64], i: usize| x.get(i).copied().unwrap_or(f64::NAN);
        match self {
            FormulaSymmetry::Translation(moved) => moved.iter().map(|i| at(p, *i)).sum(),
            FormulaSymmetry::Rotation(pairs) => {
                pairs.iter().map(|(i, j)| at(q, *i) * at(p, *j) - at(q, *j) * at(p, *i)).sum()
            }
        }
    }
}

impl FormulaDerivatives {
    /// The detected symmetries, whose momenta are multiplied by the conformal factor: translations along a coordinate
    /// on which L does not depend; rotations of two coordinates that occur in L only in squares of lengths, scalar
    /// products and areas, such as `x^2 + y^2`; and common translations and rotations of bodies, whose coordinates are
    /// those with differences in L, such as `x1 - x2` and `y1 - y2`, in their order. With forces, they are those along
    /// which the forces do no work, as far as their expressions show: the forces on the coordinates that are moved are
    /// 0, or cancel as `F` and `-F`; with constraints, they are those under which each constraint is invariant, as far as
    /// its expression shows. With resets, which change momenta, there are none.
    pub fn symmetries(&self) -> Vec<FormulaSymmetry> {
        if self.resets() > 0 {
            return Vec::new();
        }
        let Formula { graph, root, constraints, .. } = &self.derived.formula;
        let n = self.derived.formula.dimension();
        let moves = |set: &[usize]| constraints.iter().all(|c| graph.moves_into_itself(*c, set));
        let turned = |planes: &[(usize, usize)]| constraints.iter().all(|c| graph.turns_into_itself(*c, planes));
        let mut work = Work::new(graph, &self.derived.applied_nodes);
        let bodies = graph.sets_of_differences(*root, n);
        let mut seen = Vec::new();
        let cyclic = (0..n).filter(|i| self.derived.cyclic.get(*i) == Some(&true)).map(|i| vec![i]);
        seen.extend(cyclic.filter(|set| moves(set) && work.vanishes_along(set)).map(FormulaSymmetry::Translation));
        let moving = bodies.iter().filter(|set| graph.moves_into_itself(*root, set));
        seen.extend(
            moving.filter(|set| moves(set) && work.vanishes_along(set)).cloned().map(FormulaSymmetry::Translation),
        );
        let turns = |(i, j): &(usize, usize)| graph.turns_into_itself(*root, &[(*i, *j)]) && turned(&[(*i, *j)]);
        let pairs = (0..n).flat_map(|j| (0..j).map(move |i| (i, j))).filter(turns);
        seen.extend(
            pairs.filter(|pair| work.vanishes_around(&[*pair])).map(|pair| FormulaSymmetry::Rotation(vec![pair])),
        );
        for (k, second) in bodies.iter().enumerate() {
            for first in bodies.iter().take(k).filter(|first| first.len() == second.len()) {
                let planes: Vec<_> = first.iter().copied().zip(second.iter().copied()).collect();
                if graph.turns_into_itself(*root, &planes) && turned(&planes) && work.vanishes_around(&planes) {
                    seen.push(FormulaSymmetry::Rotation(planes));
                }
            }
        }
        seen
    }
}
