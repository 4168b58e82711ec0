//! The solution of the stage equations by LU factorisation.

use super::iteration::Kinds;
use super::{Inhomogeneity, LinearStages, StageTangent};
use crate::StepError;
use crate::sensitivity::step_maps::StepMaps;
use crate::solve::DenseLu;
use pulp::Simd;

/// The workspace of the factorisation, for the unknowns of some kinds.
pub(super) struct Fallback {
    kinds: Kinds,
    s: usize,
    lu: DenseLu,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
    /// A unit vector and its image.
    unit: StageTangent,
}

impl LinearStages {
    /// Solves the stage equations by LU factorisation of their matrix, whose columns are the images of unit vectors.
    #[cold]
    #[inline(never)]
    pub(super) fn solve_directly<S: Simd>(
        &mut self,
        kinds: Kinds,
        maps: &StepMaps,
        given: &Inhomogeneity,
        x: &mut StageTangent,
    ) -> Result<(), StepError> {
        let (s, coordinates) = (maps.s, self.l_v.len());
        let n = s * (if kinds.motion { coordinates } else { 0 } + usize::from(kinds.z) + usize::from(kinds.r));
        let mut fallback = match self.fallback.take() {
            Some(fallback) if fallback.kinds == kinds && fallback.s == s => fallback,
            _ => Box::new(Fallback {
                kinds,
                s,
                lu: DenseLu::new(n),
                matrix: vec![0.0; n * n],
                rhs: vec![0.0; n],
                unit: StageTangent::zeros(coordinates),
            }),
        };
        let Fallback { lu, matrix, rhs, unit, .. } = &mut *fallback;
        for j in 0..n {
            set_unknowns(kinds, s, unit, |k| f64::from(u8::from(k == j)));
            self.update::<S>(kinds, maps, None, unit);
            let column = &mut matrix[j * n..][..n];
            unknowns(kinds, s, unit, |k, value| column[k] = f64::from(u8::from(k == j)) - value);
        }
        lu.factorise(|i, j| matrix[j * n + i])?;
        // Two refinements: the second shows that the first has reached round-off.
        for _ in 0..3 {
            unknowns(kinds, s, x, |k, value| rhs[k] = -value);
            self.update::<S>(kinds, maps, Some(given), x);
            unknowns(kinds, s, x, |k, value| rhs[k] += value);
            let mut before = std::mem::take(rhs);
            // x is now F(x0) = x0 + rhs; the solution is x0 + (1 - T)^-1 rhs.
            let shifted: Vec<f64> = before.clone();
            lu.solve(&mut before)?;
            add_to_unknowns(kinds, s, x, |k| before[k] - shifted[k]);
            *rhs = before;
        }
        self.update::<S>(kinds, maps, Some(given), x);
        self.fallback = Some(fallback);
        Ok(())
    }
}

/// Applies a function to the unknowns of an iteration, in the order: v, z', r'.
fn for_each_unknown(kinds: Kinds, s: usize, x: &mut StageTangent, mut f: impl FnMut(usize, &mut f64)) {
    let mut k = 0;
    let motion = if kinds.motion { &mut x.v[..] } else { &mut [] };
    let others = [(kinds.z, &mut x.z_rate), (kinds.r, &mut x.r_rate)];
    for rates in motion.iter_mut().chain(others.into_iter().filter(|(is, _)| *is).map(|(_, rates)| rates)) {
        for rate in rates.0.iter_mut().take(s) {
            f(k, rate);
            k += 1;
        }
    }
}

fn set_unknowns(kinds: Kinds, s: usize, x: &mut StageTangent, to: impl Fn(usize) -> f64) {
    for_each_unknown(kinds, s, x, |k, rate| *rate = to(k));
}

fn add_to_unknowns(kinds: Kinds, s: usize, x: &mut StageTangent, by: impl Fn(usize) -> f64) {
    for_each_unknown(kinds, s, x, |k, rate| *rate += by(k));
}

fn unknowns(kinds: Kinds, s: usize, x: &StageTangent, mut f: impl FnMut(usize, f64)) {
    let motion = if kinds.motion { &x.v[..] } else { &[] };
    let others = [(kinds.z, &x.z_rate), (kinds.r, &x.r_rate)];
    let rates = motion.iter().chain(others.into_iter().filter(|(is, _)| *is).map(|(_, rates)| rates));
    for (k, rate) in rates.flat_map(|rates| rates.0.iter().take(s)).enumerate() {
        f(k, *rate);
    }
}
