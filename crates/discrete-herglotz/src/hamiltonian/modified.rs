//! Modified Hamiltonians: the contact Hamiltonian of which a step is the exact flow, up to a power of the step size.

use crate::{InputError, Integrator, Problem, StepError, StepperOptions};
use contact_geom::numbers::dot;
use contact_geom::{ChartVector, Lagrangian, PhasePoint, numbers::max_abs_or_nan};

/// The largest order of an interpolated modified Hamiltonian: beyond it the differences of states are round-off.
pub const MAX_MODIFIED_ORDER: usize = 8;

/// The value of the modified Hamiltonian `H~_k` at the middle one, of index k/2, of k + 1 states that consecutive steps of
/// length h connect.
///
/// A conformally contact map `Phi_h` near the identity is formally the flow over h of a contact Hamiltonian vector field
/// `X~`. The derivative at the middle node of the polynomial through the states is `X~_k = X~ + O(h^k)`, and
/// `H~_k = -eta(X~_k) = p . q~ - z~` for its components `q~`, `z~`. So one step has
/// `H~_k o Phi = sigma_d H~_k + O(h^(k+1))`.
///
/// See Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), chapter IX, for the series. `None` for fewer than
/// two states, and for more than [`MAX_MODIFIED_ORDER`] + 1.
///
/// ```
/// use contact_geom::PhasePoint;
/// use discrete_herglotz::hamiltonian::modified_hamiltonian;
/// // Steps of length 0.1 along q' = 1, z' = p - H with H = p.
/// let states = [0.0, 0.1, 0.2].map(|q| PhasePoint::new([q], [2.0], 0.0));
/// assert!((modified_hamiltonian(&states, 0.1).unwrap() - 2.0).abs() < 1e-14);
/// ```
pub fn modified_hamiltonian<const N: usize>(states: &[PhasePoint<N>], h: f64) -> Option<f64> {
    let k = states.len().checked_sub(1).filter(|k| (1..=MAX_MODIFIED_ORDER).contains(k))?;
    let middle = k / 2;
    let here = states.get(middle)?;
    let apart = |i: usize, j: usize| i as f64 - j as f64;
    // The derivatives of the Lagrange polynomials at the middle node; their sum is 0.
    let weight = |j: usize| {
        let over = (0..=k).filter(|m| *m != middle && *m != j).map(|m| apart(middle, m)).product::<f64>();
        over / (0..=k).filter(|m| *m != j).map(|m| apart(j, m)).product::<f64>()
    };
    let mut field = ChartVector::from_fn(|_| 0.0);
    for (j, state) in states.iter().enumerate().filter(|(j, _)| *j != middle) {
        field = field.plus(ChartVector::from(*state).minus((*here).into()).scale(weight(j) / h));
    }
    Some(dot(here.p, field.x) - field.z)
}

/// How far steps are from the flow of their modified Hamiltonian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModifiedDefect {
    /// The order k of the modified Hamiltonian.
    pub k: usize,
    /// The step size.
    pub h: f64,
    /// The largest `|H~_k(x1) - sigma_d H~_k(x0)|` of the steps, relative to the largest `|H~_k|`.
    pub defect: f64,
}

/// The largest number of steps of a size over the span.
const MAX_STEPS: usize = 1_000_000;

/// The defects `H~_k o Phi - sigma_d H~_k` of the steps of a method over a span, for several step sizes, and for the orders
/// k from 1 to `most`: a table for a plot of the defect against the order and the step size. They decrease as `h^(k+1)`;
/// for fixed h the smallest one over k decreases as `exp(-c/h)` for an analytic H.
///
/// # Errors
/// [`InputError::Unclaimed`] for a Lagrangian that does not claim to be autonomous, since the modified Hamiltonian then
/// depends on time; [`InputError::Count`] for an order of 0 or beyond [`MAX_MODIFIED_ORDER`]; [`InputError::TooMany`] for
/// more than a million steps; those of the stepper, and [`InputError::FirstStep`] where a step fails.
pub fn modified_defects<'a, L: Lagrangian<N>, const N: usize>(
    problem: &Problem<'a, L, N>,
    integrator: &impl Integrator<'a, L, N>,
    span: f64,
    steps: &[f64],
    most: usize,
) -> Result<Vec<ModifiedDefect>, InputError> {
    if !problem.structure.autonomous {
        return Err(InputError::Unclaimed { claim: "autonomous" });
    }
    if !(1..=MAX_MODIFIED_ORDER).contains(&most) {
        let what = "the order of the modified Hamiltonian, at most 8,";
        return Err(InputError::Count { what, least: 1, found: most });
    }
    integrator.check(problem.lagrangian)?;
    let mut found = Vec::with_capacity(most * steps.len());
    for &h in steps {
        let mut stepper =
            integrator.stepper(problem, h, StepperOptions { action: true, ..StepperOptions::default() })?;
        let count = (span / h).abs().round();
        if count.is_nan() || count > MAX_STEPS as f64 {
            let (what, remedy) = ("the number of steps of the span", "take a shorter span or longer steps");
            return Err(InputError::TooMany { what, found: count, most: MAX_STEPS as f64, remedy });
        }
        let count = (count as usize).max(1);
        let (mut states, mut sigmas) = (vec![stepper.state().fixed::<N>()], Vec::with_capacity(count + most));
        for _ in 0..count + most {
            stepper.advance(1).map_err(|failure| InputError::FirstStep(failure.cause))?;
            states.push(stepper.state().fixed());
            sigmas.push(stepper.sigma());
        }
        for k in 1..=most {
            let values = states.windows(k + 1).filter_map(|states| modified_hamiltonian(states, h));
            let values: Vec<f64> = values.take(count + 1).collect();
            let pairs = values.iter().zip(values.iter().skip(1)).zip(sigmas.iter().skip(k / 2));
            let apart = max_abs_or_nan(pairs.map(|((before, after), sigma)| after - sigma * before));
            let defect = apart / max_abs_or_nan(values.iter().copied());
            if !defect.is_finite() {
                return Err(InputError::FirstStep(StepError::NonFinite));
            }
            found.push(ModifiedDefect { k, h, defect });
        }
    }
    Ok(found)
}
