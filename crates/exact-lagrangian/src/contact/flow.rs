//! The flow of a contact Hamiltonian, to round-off.

use super::ContactFlowError;
use super::panel::{Rate, collocate, no_stages};
use contact_geom::numbers::{TangentVector, max_or_nan};
use contact_geom::{ChartVector, ContactHamiltonian, PhasePoint, Scalar};

/// The largest number of panels, including those that are refused.
const MAX_PANELS: u32 = 10_000;
/// The shortest panel, as a part of the whole time.
const SHORTEST: f64 = 1e-9;
/// The largest of the last Legendre coefficients of the rates. The error of the end is about the square of it.
const TAIL: f64 = 1e-9;

/// A motion of a contact Hamiltonian: its end, and the integrals along it. On dual numbers, with the derivatives of all
/// of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ContactMotion<const N: usize, T = f64> {
    /// The end `phi_t(q0, p0, z0)`.
    pub end: PhasePoint<N, T>,
    /// `(q1 - q0, p1 - p0, z1 - z0)`, to relative round-off also where it is small compared with the state.
    pub displacement: ChartVector<N, T>,
    /// `ln sigma = -int H_z dt`.
    pub ln_sigma: T,
    /// The number of panels.
    pub panels: u32,
    /// The number of evaluations of the gradient of H, including refused panels.
    pub evaluations: u64,
}

impl<const N: usize, T: Scalar> ContactMotion<N, T> {
    /// The conformal factor of the flow, `phi_t* eta = sigma eta`.
    pub fn sigma(&self) -> T {
        self.ln_sigma.exp()
    }
}

/// A compensated sum of components, after Kahan.
struct Sum<const N: usize, T> {
    value: ChartVector<N, T>,
    lost: ChartVector<N, T>,
}

impl<const N: usize, T: Scalar> Sum<N, T> {
    fn from(value: ChartVector<N, T>) -> Self {
        Sum { value, lost: ChartVector::null() }
    }

    fn add(&mut self, term: ChartVector<N, T>) {
        let corrected = term.minus(self.lost);
        let next = self.value.plus(corrected);
        self.lost = next.minus(self.value).minus(corrected);
        self.value = next;
    }
}

/// The flow of the contact Hamiltonian vector field `X_H`, `q' = H_p`, `p' = -H_q - p H_z`, `z' = p . H_p - H`, from a
/// start at time `t0` over a duration, with `ln sigma = -int H_z dt`; paper, section 2.1. H may have any rank of
/// `H_pp`. The duration is negative to run backward in time. On dual numbers the result has the solution of the
/// variational equations, also the derivatives in `t0` and in the duration.
///
/// The method is collocation at 14 Gauss points, of order 28, on panels whose length follows from the last Legendre
/// coefficients of the rates; the changes are added by compensated summation. The error is some units of round-off
/// times the condition number of the motion. H must be smooth along the motion: features narrower than the distance of
/// the nodes may be missed.
///
/// ```
/// use contact_geom::{nalgebra::SVector, ContactHamiltonian, PhasePoint, Scalar};
/// struct Decay; // linear in p: q' = z, z' = -z/2
/// impl ContactHamiltonian<1> for Decay {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T { p[0] * z + z * 0.5 }
/// }
/// let motion = exact_lagrangian::contact_flow(&Decay, 0.0, &PhasePoint::new([0.0], [0.0], 1.0), 2.0)?;
/// let (q, z) = (motion.end.q[0], motion.end.z);
/// assert!((z - (-1f64).exp()).abs() < 1e-14 && (q - 2.0 * (1.0 - z)).abs() < 1e-14);
/// # Ok::<(), exact_lagrangian::ContactFlowError<1>>(())
/// ```
///
/// # Errors
/// [`ContactFlowError::NonFinite`], [`ContactFlowError::Undefined`]; [`ContactFlowError::OutsideDomain`] where the
/// motion is not defined or not resolved up to the end, [`ContactFlowError::Unfinished`] where it needs too many
/// panels.
pub fn contact_flow<T: Scalar, const N: usize>(
    hamiltonian: &impl ContactHamiltonian<N>,
    t0: T,
    start: &PhasePoint<N, T>,
    duration: T,
) -> Result<ContactMotion<N, T>, ContactFlowError<N>> {
    let from = ChartVector::from(*start);
    let sizes = Rate { field: from, ln_sigma: T::zero() };
    let input =
        [("time", t0.extent().is_finite()), ("duration", duration.extent().is_finite()), ("start", sizes.is_finite())];
    if let Some((what, _)) = input.into_iter().find(|(_, finite)| !finite) {
        return Err(ContactFlowError::NonFinite { what });
    }
    let mut first = Rate::at(hamiltonian, t0, &from);
    if !first.is_finite() {
        return Err(ContactFlowError::Undefined { t: t0.re() });
    }
    let mut stages = no_stages();
    // The state is summed from its start, so that decaying quantities keep their digits; the displacement from 0.
    let (mut state, mut displacement) = (Sum::from(from), Sum::from(ChartVector::null()));
    let (mut ln_sigma, mut lost) = (T::zero(), T::zero());
    let (mut done, mut length, mut panels, mut evaluations) = (0.0_f64, 1.0_f64, 0, 1);
    let reached = |x: &ChartVector<N, T>, done: f64| {
        let x = PhasePoint { q: x.x.map(T::re), p: x.y.map(T::re), z: x.z.re() };
        (t0.re() + done * duration.re(), x)
    };
    while done < 1.0 {
        if panels >= MAX_PANELS {
            let (t, reached) = reached(&state.value, done);
            return Err(ContactFlowError::Unfinished { t, reached });
        }
        panels += 1;
        let last = length >= 1.0 - done;
        let part = if last { 1.0 - done } else { length };
        let t = t0 + duration * done;
        let (panel, count) = collocate(hamiltonian, t, duration * part, &state.value, &first, &mut stages);
        evaluations += count + 1;
        let accepted = panel.filter(|panel| panel.tail <= TAIL);
        let Some(panel) = accepted else {
            length = part * 0.4;
            if length < SHORTEST {
                let (t, reached) = reached(&state.value, done);
                return Err(ContactFlowError::OutsideDomain { t, reached });
            }
            continue;
        };
        state.add(panel.change.field);
        displacement.add(panel.change.field);
        let corrected = panel.change.ln_sigma - lost;
        let next = ln_sigma + corrected;
        (lost, ln_sigma) = ((next - ln_sigma) - corrected, next);
        done = if last { 1.0 } else { done + part };
        length = part * (0.5 * TAIL / max_or_nan(panel.tail, 1e-300)).powf(1.0 / 13.0).clamp(0.4, 3.0);
        first = Rate::at(hamiltonian, t0 + duration * done, &state.value);
        if !first.is_finite() {
            let (t, reached) = reached(&state.value, done);
            return Err(ContactFlowError::OutsideDomain { t, reached });
        }
    }
    Ok(ContactMotion { end: state.value.into(), displacement: displacement.value, ln_sigma, panels, evaluations })
}
