//! The Jacobian of the stage equations of contact Gauss collocation, as a sparse matrix with a border.

use super::border::Border;
use super::gauss_table::GaussTable;
use super::pattern::{FullPattern, LowerPattern};
use crate::SparseError;
use crate::derivatives::{EvaluationPoint, FirstDerivatives, SecondDerivatives};
use crate::system::SparseSystem;

/// The second derivatives of a system at one stage at a time, and their assembly into the Jacobian.
pub(crate) struct StageJacobian {
    pub pattern: FullPattern,
    /// The indices of the second derivatives of the potentials in `lower`, and of those of the general terms in
    /// `second`.
    potentials: Vec<Vec<u32>>,
    general_terms: Vec<Vec<u32>>,
    lower: Vec<f64>,
    second: SecondDerivatives,
}

impl StageJacobian {
    /// Determines the pattern.
    ///
    /// # Errors
    /// [`SparseError::Unknowns`] if there are more entries than 32-bit indices allow.
    pub fn new(system: &SparseSystem) -> Result<Self, SparseError> {
        let n = system.unknowns();
        let triangle = LowerPattern::new(n, |f| {
            system.potentials.iter().for_each(|list| list.visit(f));
            system.general_terms.iter().for_each(|list| list.visit(f));
        })?;
        let pattern = FullPattern::new(&triangle)?;
        let potentials = system.potentials.iter().map(|list| list.entry_indices(&triangle)).collect();
        let general_terms: Vec<Vec<u32>> =
            system.general_terms.iter().map(|list| list.entry_indices(&pattern)).collect();
        let second = if general_terms.is_empty() {
            SecondDerivatives::default()
        } else {
            SecondDerivatives::zeros(n, pattern.rows.len())
        };
        Ok(StageJacobian { potentials, general_terms, lower: vec![0.0; triangle.rows.len()], second, pattern })
    }

    /// Evaluates the second derivatives at a point.
    fn evaluate(&mut self, system: &SparseSystem, at: EvaluationPoint) {
        self.lower.fill(0.0);
        for (list, indices) in system.potentials.iter().zip(&self.potentials) {
            list.add_hessian(at.t, at.q, -1.0, indices, &mut self.lower);
        }
        self.second.clear();
        for (list, indices) in system.general_terms.iter().zip(&self.general_terms) {
            list.add_second(at, indices, &mut self.second);
        }
    }

    /// Computes the entries of `L_vv` at a point.
    pub fn mass_matrix(&mut self, system: &SparseSystem, at: EvaluationPoint, entries: &mut [f64]) {
        self.evaluate(system, at);
        for (column, range) in self.pattern.columns() {
            for e in range {
                let diagonal = self.pattern.rows[e] as usize == column;
                let mass = if diagonal { system.mass(column) } else { 0.0 };
                entries[e] = mass + self.second.vv.get(e).copied().unwrap_or(0.0);
            }
        }
    }

    /// Adds the contribution of the stage j, with its first derivatives, to the Jacobian, and to its border if there is
    /// one:
    ///
    /// `dR_i/dV_k = delta_ik rho_i L_vv + h a_ik (rho_i L_vq - rho_k L_qv) - h^2 sum_j a_ij a_jk rho_j L_qq`.
    #[expect(clippy::too_many_arguments, reason = "the quantities of the formula, and the sums to which it is added")]
    pub fn add_stage(
        &mut self,
        system: &SparseSystem,
        table: &GaussTable,
        at: EvaluationPoint,
        j: usize,
        rho: f64,
        first: &FirstDerivatives,
        entries: &mut [f64],
        border: Option<&mut Border>,
    ) {
        self.evaluate(system, at);
        let StageJacobian { pattern, lower, second, general_terms, .. } = self;
        let (s, a) = (table.s, &table.a);
        let general = !general_terms.is_empty();
        for (column, range) in pattern.columns() {
            let (begin, width) = (range.start * s * s, range.len() * s);
            for (offset, e) in range.enumerate() {
                let mass = if pattern.rows[e] as usize == column { system.mass(column) } else { 0.0 };
                let mut qq = lower[pattern.lower[e] as usize];
                let (mut vv, mut qv, mut vq) = (mass, 0.0, 0.0);
                if general {
                    qq += second.qq[e];
                    vv += second.vv[e];
                    (qv, vq) = (second.qv[e], second.vq[e]);
                }
                for k in 0..s {
                    for i in 0..s {
                        let mut entry = -a[i][j] * a[j][k] * qq;
                        if i == j {
                            entry += a[j][k] * vq;
                        }
                        if k == j {
                            entry -= a[i][j] * qv;
                        }
                        if i == j && k == j {
                            entry += vv;
                        }
                        entries[begin + k * width + offset * s + i] += rho * entry;
                    }
                }
            }
        }
        if let Some(border) = border {
            border.add_stage(table, j, rho, first, second);
        }
    }
}
