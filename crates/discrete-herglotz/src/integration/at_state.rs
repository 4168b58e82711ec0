//! L and its derivatives at a state (q, p, z).

use crate::{StepError, TypedSystem, theory::legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{PhasePoint, VelocityPoint};

/// The velocity, and L with its derivatives, at a state.
pub(crate) struct AtState<const N: usize> {
    pub x: VelocityPoint<N>,
    pub l: f64,
    /// `L_q + f`, with the applied force f.
    pub force: SVector<f64, N>,
    /// `L_z`.
    pub rate: f64,
}

/// L and its derivatives at a state. For a Lagrangian that is given by a contact Hamiltonian they are those of the
/// Hamiltonian, `v = H_p`, `L = p . v - H`, `L_q = -H_q`, `L_z = -H_z`, whatever the rank of `H_pp`; for all others v is
/// found from the momentum, starting from a guess.
///
/// # Errors
/// Those of [`legendre_inverse`].
pub(crate) fn at_state<const N: usize>(
    system: &dyn TypedSystem<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: &SVector<f64, N>,
) -> Result<AtState<N>, StepError> {
    let hints = system.hints();
    if hints.hamiltonian
        && let Some((h, d)) = system.hamiltonian_with_gradient(t, state)
    {
        let x = VelocityPoint { q: state.q, v: d.y, z: state.z };
        let mut force = -d.x;
        if hints.forced {
            force += system.applied_force(t, &x);
        }
        return Ok(AtState { x, l: dot(state.p, d.y) - h, force, rate: -d.z });
    }
    let x = legendre_inverse(system, t, state, guess)?;
    let (l, g) = system.with_gradient_and_force(t, &x);
    Ok(AtState { x, l, force: g.x, rate: g.z })
}
