//! Coefficients of the general step of contact Gauss collocation.

use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::numbers::registers::{StageMap, Stages};
use qd::Quad;
use std::array::from_fn;
use std::cmp::Ordering;
use std::sync::OnceLock;

/// The coefficients of a step, `h a_ij = m_ij h b_j`.
///
/// The round-off of coefficients is the same in every step, and that of `h a_ij` and `h b_j` would make the energy
/// drift. However, the method is symplectic for any weights if `m_ij + m_ji = 1`, which numbers of 53 binary digits can
/// satisfy exactly: the stages use `M (h b f)`, and the end of the step the sum of the same `h b f`. See Antonana,
/// Makazaga and Murua, "Reducing and monitoring round-off error propagation for symplectic implicit Runge-Kutta
/// schemes", Numer. Algorithms 76 (2017).
pub(crate) struct StageTable {
    pub s: usize,
    pub h: f64,
    /// `M`.
    pub m: &'static StageMap,
    /// `h b`, padded with 0.
    pub weights: Stages,
    /// The times of the stages relative to the start of the step.
    pub times: Stages,
    /// The extrapolation from the stages of one step to those of the next, and the same for values multiplied by the
    /// weights.
    pub extrapolation: &'static StageMap,
    pub extrapolation_weighted: &'static StageMap,
}

/// The coefficients that do not depend on the step size.
struct Maps {
    m: StageMap,
    extrapolation: StageMap,
    extrapolation_weighted: StageMap,
}

impl Maps {
    /// The coefficients for a number of stages from 1 to 16, computed once.
    fn of(s: usize) -> &'static Maps {
        static TABLES: [OnceLock<Box<Maps>>; MAX_STAGES] = [const { OnceLock::new() }; MAX_STAGES];
        TABLES[s.clamp(1, MAX_STAGES) - 1].get_or_init(|| Box::new(Self::new(s.clamp(1, MAX_STAGES))))
    }

    fn new(s: usize) -> Self {
        let g = Coefficients::of(s);
        // Above the diagonal from the transposed entry, which is about 1, so that the difference is exact.
        let ratio = |i: usize, j: usize| (g.a[i][j] / g.b[j]).0;
        let entry = |i: usize, j: usize| match i.cmp(&j) {
            _ if i.max(j) >= s => 0.0,
            Ordering::Less => 1.0 - ratio(j, i),
            Ordering::Equal => 0.5,
            Ordering::Greater => ratio(i, j),
        };
        let weighted = |i: usize, j: usize| {
            if i.max(j) < s { g.b[i].0 * g.extrapolation[i][j] / g.b[j].0 } else { 0.0 }
        };
        Maps {
            m: StageMap::new(&from_fn(|i| from_fn(|j| entry(i, j))), s),
            extrapolation: StageMap::new(&g.extrapolation, s),
            extrapolation_weighted: StageMap::new(&from_fn(|i| from_fn(|j| weighted(i, j))), s),
        }
    }
}

impl StageTable {
    pub fn new(s: usize, h: f64) -> Self {
        let (g, step) = (Coefficients::of(s), Quad::from(h));
        let mut weights = from_fn(|j| if j < s { (step * g.b[j]).0 } else { 0.0 });
        if s > 2 {
            // The outer weights are adjusted so that the sum is h to the last digit of the smallest weight.
            let inner = weights[1..s - 1].iter().fold(Quad::from(0.0), |sum, w| sum + Quad::from(*w));
            weights[0] = (Quad::from(0.5) * (step - inner)).0;
            weights[s - 1] = weights[0];
        }
        // The last stage is repeated in the padding.
        let mut times = [(step * g.c[s - 1]).0; MAX_STAGES];
        times.iter_mut().zip(&g.c).take(s).for_each(|(time, c)| *time = (step * *c).0);
        let Maps { m, extrapolation, extrapolation_weighted } = Maps::of(s);
        StageTable { s, h, m, weights: Stages(weights), times: Stages(times), extrapolation, extrapolation_weighted }
    }
}
