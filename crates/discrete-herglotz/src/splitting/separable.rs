//! Lagrangians `v.Mv/2 - V(t, q) + f(z)`, as splittings read them.

use crate::rules::step_equations::{inverted, is_identity, kept_mass_matrix};
use crate::run::verified::PROBE;
use crate::{InputError, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Defect, Derivatives, Dual, Lagrangian, PhasePoint, Scalar, VelocityPoint};

/// What is left of a false claim's derivative by the rounding of a true one, with some margin.
pub(super) const FALSE_CLAIM: f64 = 1e-9;

/// A separable Lagrangian with its mass matrix, read once.
#[derive(Clone, Debug)]
pub(crate) struct SeparableForm<L, const N: usize> {
    pub(crate) lagrangian: L,
    mass: Box<SMatrix<f64, N, N>>,
    /// `None` for the identity: a product with it would cost a third of a step of the oscillator.
    pub(crate) inverse: Option<Box<SMatrix<f64, N, N>>>,
}

impl<L: Lagrangian<N>, const N: usize> SeparableForm<L, N> {
    /// Reads M, and verifies what the Lagrangian claims, at a state and beside it.
    pub(crate) fn read(lagrangian: L, h: f64, t: f64, state: &PhasePoint<N>) -> Result<Self, InputError> {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        crate::run::check_time(t)?;
        state.check()?;
        let structure = lagrangian.structure();
        if !structure.separable {
            return Err(InputError::Unclaimed { claim: "separable" });
        }
        for x in probes(state) {
            if const { L::PROVED } {
                break;
            }
            // A state beside the given one may be outside of the domain.
            let mut defects = structure.defects(&lagrangian, t, &x).into_iter().flatten();
            if let Some(Defect { claim, size }) = defects.find(|d| d.size > PROBE) {
                return Err(InputError::FalseClaim { claim, size });
            }
        }
        let rest = VelocityPoint { q: state.q, v: SVector::zeros(), z: state.z };
        let mass = kept_mass_matrix(&lagrangian, t, &rest);
        let inverse = if is_identity(&mass) {
            None
        } else {
            Some(inverted(&mass).map_err(|e| e.of("the mass matrix L_vv", "take a regular Lagrangian"))?)
        };
        Ok(SeparableForm { lagrangian, mass, inverse })
    }

    /// Verifies, at some times, that `L_z` does not depend on time.
    pub(crate) fn check_steady_drag(&self, t: f64, state: &PhasePoint<N>) -> Result<(), InputError> {
        let structure = self.lagrangian.structure();
        if structure.autonomous || structure.has_constant_rate() {
            return Ok(());
        }
        // It is known of one that is proved.
        if const { L::PROVED } {
            return Err(InputError::Hypothesis { hypothesis: "a drag L_z that does not depend on time" });
        }
        for i in 0..3 {
            let still = VelocityPoint {
                q: state.q.map(Dual::constant),
                v: SVector::from_element(Dual::constant(0.0)),
                z: Dual::constant(state.z),
            };
            let clock = Dual { re: t + without_symmetry(i), d: SVector::<f64, 1>::new(1.0) };
            let rate = self.lagrangian.gradient(clock, &still).z;
            if rate.d[0].is_nan() || rate.d[0].abs() > FALSE_CLAIM * (1.0 + rate.re.abs()) {
                return Err(InputError::Hypothesis { hypothesis: "a drag L_z that does not depend on time" });
            }
        }
        Ok(())
    }

    /// `L(t, q, 0, z)`, which is `-V` up to `f(z)`, and `L_q`. Duals carry the directions of `q` alone, so that the
    /// compiler drops what velocity and action would add.
    #[inline(always)]
    pub(crate) fn kick(&self, t: f64, q: &SVector<f64, N>, z: f64) -> (f64, SVector<f64, N>) {
        let rest = VelocityPoint { q: *q, v: SVector::zeros(), z };
        self.lagrangian.with_force(t, &rest)
    }

    /// `L_q` alone, for what does not ask for the action.
    #[inline(always)]
    pub(crate) fn force(&self, t: f64, q: &SVector<f64, N>, z: f64) -> SVector<f64, N> {
        self.lagrangian.force(t, &VelocityPoint { q: *q, v: SVector::zeros(), z })
    }

    /// The kick at a start.
    ///
    /// # Errors
    /// [`InputError::FirstStep`] where it is not finite.
    pub(crate) fn first_kick(&self, t: f64, q: &SVector<f64, N>, z: f64) -> Result<(f64, SVector<f64, N>), InputError> {
        let (value, force) = self.kick(t, q, z);
        let finite = value.is_finite() && force.iter().all(|f| f.is_finite());
        if finite { Ok((value, force)) } else { Err(InputError::FirstStep(StepError::NonFinite)) }
    }

    /// `v.Mv`.
    pub(crate) fn twice_kinetic<T: Scalar>(&self, v: &SVector<T, N>) -> T {
        let mut sum = T::zero();
        for i in 0..N {
            for j in 0..N {
                sum += v[i] * v[j] * self.mass[(i, j)];
            }
        }
        sum
    }

    /// `M v`.
    pub(crate) fn momentum(&self, v: &SVector<f64, N>) -> SVector<f64, N> {
        match &self.inverse {
            None => *v,
            Some(_) => *self.mass * v,
        }
    }

    /// `M^-1 p`.
    #[inline(always)]
    pub(crate) fn velocity(&self, p: &SVector<f64, N>) -> SVector<f64, N> {
        match &self.inverse {
            None => *p,
            Some(inverse) => **inverse * p,
        }
    }
}

/// The state's position, and one beside it where the state's own may be special; with generic velocities.
fn probes<const N: usize>(state: &PhasePoint<N>) -> [VelocityPoint<N>; 2] {
    let v = SVector::from_fn(|i, _| without_symmetry(i));
    let beside =
        SVector::from_fn(|i, _| state.q[i] * (1.0 + 0.01 * without_symmetry(i)) + 1e-3 * without_symmetry(N + i));
    [VelocityPoint { q: state.q, v, z: state.z }, VelocityPoint { q: beside, v, z: state.z + without_symmetry(2 * N) }]
}

/// Numbers between 0.3 and 1.3 without special relation.
pub(super) fn without_symmetry(i: usize) -> f64 {
    0.3 + (((i + 1) * (i + 1)) as f64 * std::f64::consts::SQRT_2).fract()
}
