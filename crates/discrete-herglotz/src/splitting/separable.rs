//! Separable Lagrangians `v.Mv/2 - V(t, q) + f(z)` for splittings.

use crate::integration::OfTyped;
use crate::integration::check_claims::MAX_CLAIM_DEFECT;
use crate::integration::check_kicks;
use crate::system::mass_matrix::{inverted, is_identity, kept_mass_matrix};
use crate::{InputError, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Defect, Derivatives, Dual, Lagrangian, PhasePoint, Scalar, VelocityPoint};

/// The bound on a quantity that vanishes if a hypothesis holds: the round-off for a true one, with a margin of some
/// million for its derivatives.
pub(super) const MAX_HYPOTHESIS_DEFECT: f64 = 1e-9;

/// A separable Lagrangian with its mass matrix, evaluated once.
#[derive(Clone, Debug)]
pub(crate) struct SeparableForm<L, const N: usize> {
    pub(crate) lagrangian: L,
    mass: Box<SMatrix<f64, N, N>>,
    /// The inverse mass matrix; `None` for the identity, whose product would take a third of a step of the oscillator.
    pub(crate) inverse: Option<Box<SMatrix<f64, N, N>>>,
}

impl<L: Lagrangian<N>, const N: usize> SeparableForm<L, N> {
    /// Evaluates M, and verifies the claims of the Lagrangian at a state and at a point near it.
    pub(crate) fn read(lagrangian: L, h: f64, t: f64, state: &PhasePoint<N>) -> Result<Self, InputError> {
        check_kicks(&OfTyped(&lagrangian), "a splitting without drag of the velocity")?;
        Self::read_of(lagrangian, h, t, state, false)
    }

    /// The same for a Lagrangian whose claims may already be `verified`; the probes, which are skipped then, cost as much as
    /// a hundred steps.
    pub(crate) fn read_of(
        lagrangian: L,
        h: f64,
        t: f64,
        state: &PhasePoint<N>,
        verified: bool,
    ) -> Result<Self, InputError> {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        crate::integration::system_problem::check_time(t)?;
        state.check()?;
        let structure = lagrangian.structure();
        if !structure.separable {
            return Err(InputError::Unclaimed { claim: "separable" });
        }
        // Written so that the check is not compiled for a Lagrangian whose claims are proved.
        if const { !L::HINTS.proved } {
            for x in probes(state).into_iter().filter(|_| !verified) {
                // The point near the given state may lie outside of the domain of L.
                let mut defects = structure.defects(&lagrangian, t, &x).into_iter().flatten();
                if let Some(Defect { claim, size }) = defects.find(|d| d.size > MAX_CLAIM_DEFECT) {
                    return Err(InputError::FalseClaim { claim, size });
                }
            }
        }
        let rest = VelocityPoint { q: state.q, v: SVector::zeros(), z: state.z };
        let mass = kept_mass_matrix(&lagrangian, t, &rest);
        let inverse = if is_identity(&mass) {
            None
        } else {
            Some(inverted(&mass).map_err(|e| e.of("the mass matrix L_vv", "use a regular Lagrangian"))?)
        };
        Ok(SeparableForm { lagrangian, mass, inverse })
    }

    /// Verifies at three times that `L_z` does not depend on time.
    pub(crate) fn check_steady_drag(&self, t: f64, state: &PhasePoint<N>) -> Result<(), InputError> {
        let structure = self.lagrangian.structure();
        if structure.autonomous || structure.has_constant_rate() {
            return Ok(());
        }
        // For a proved structure the claims alone decide.
        if const { L::HINTS.proved } {
            return Err(InputError::Hypothesis { hypothesis: "a drag L_z that does not depend on time" });
        }
        for i in 0..3 {
            let still = VelocityPoint {
                q: state.q.map(Dual::constant),
                v: SVector::from_element(Dual::constant(0.0)),
                z: Dual::constant(state.z),
            };
            let time = Dual { re: t + without_symmetry(i), d: SVector::<f64, 1>::new(1.0) };
            let rate = self.lagrangian.gradient(time, &still).z;
            if rate.d[0].is_nan() || rate.d[0].abs() > MAX_HYPOTHESIS_DEFECT * (1.0 + rate.re.abs()) {
                return Err(InputError::Hypothesis { hypothesis: "a drag L_z that does not depend on time" });
            }
        }
        Ok(())
    }

    /// `L(t, q, 0, z) = -V + f(z)`, and `L_q` plus the applied force. Only the derivatives in `q` are carried.
    #[inline(always)]
    pub(crate) fn kick(&self, t: f64, q: &SVector<f64, N>, z: f64) -> (f64, SVector<f64, N>) {
        let rest = VelocityPoint { q: *q, v: SVector::zeros(), z };
        self.lagrangian.with_force(t, &rest)
    }

    /// `L_q` plus the applied force, for steps without the action.
    #[inline(always)]
    pub(crate) fn force(&self, t: f64, q: &SVector<f64, N>, z: f64) -> SVector<f64, N> {
        self.lagrangian.force(t, &VelocityPoint { q: *q, v: SVector::zeros(), z })
    }

    /// The applied force alone, which depends on time and positions.
    pub(crate) fn applied_force<T: Scalar>(&self, t: f64, q: &SVector<T, N>, z: T) -> SVector<T, N> {
        let still = SVector::from_element(T::zero());
        self.lagrangian.applied_force(T::from(t), &VelocityPoint { q: *q, v: still, z })
    }

    /// The value and the force of the kick at an initial state.
    ///
    /// # Errors
    /// [`InputError::FirstStep`] where it is not finite.
    pub(crate) fn first_kick(&self, t: f64, q: &SVector<f64, N>, z: f64) -> Result<(f64, SVector<f64, N>), InputError> {
        let (value, force) = self.kick(t, q, z);
        let finite = value.is_finite() && force.iter().all(|f| f.is_finite());
        if finite { Ok((value, force)) } else { Err(InputError::FirstStep(StepError::NonFinite)) }
    }

    /// Whether steps of this length from a state with this force change a position or a momentum by less than half of
    /// its digits. Such changes vary so little from step to step that their round-off has the same sign and
    /// accumulates.
    pub(crate) fn has_tiny_steps(&self, h: f64, state: &PhasePoint<N>, force: &SVector<f64, N>) -> bool {
        let (v, a) = (self.velocity(&state.p), self.velocity(force));
        let is_tiny = |change: f64, number: f64| change < f64::EPSILON.sqrt() * number.abs();
        // A momentum without force is constant, unless a time-dependent force sets in later.
        let kicks = |i: usize| force[i] != 0.0 || !self.lagrangian.structure().autonomous;
        (0..N).any(|i| {
            let moved = h.abs() * (v[i].abs() + h.abs() * a[i].abs());
            is_tiny(moved, state.q[i]) || kicks(i) && is_tiny(h.abs() * force[i].abs(), state.p[i])
        })
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

    /// The diagonal of M; `None` if another entry is not zero.
    pub(crate) fn diagonal_mass(&self) -> Option<SVector<f64, N>> {
        let diagonal = (0..N).all(|i| (0..N).all(|j| i == j || self.mass[(i, j)] == 0.0));
        diagonal.then(|| self.mass.diagonal())
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

/// The position of the state, and one near it in case that of the state is special; with generic velocities.
fn probes<const N: usize>(state: &PhasePoint<N>) -> [VelocityPoint<N>; 2] {
    let v = SVector::from_fn(|i, _| without_symmetry(i));
    let nearby =
        SVector::from_fn(|i, _| state.q[i] * (1.0 + 0.01 * without_symmetry(i)) + 1e-3 * without_symmetry(N + i));
    [VelocityPoint { q: state.q, v, z: state.z }, VelocityPoint { q: nearby, v, z: state.z + without_symmetry(2 * N) }]
}

/// Generic numbers between 0.3 and 1.3.
pub(super) fn without_symmetry(i: usize) -> f64 {
    0.3 + (((i + 1) * (i + 1)) as f64 * std::f64::consts::SQRT_2).fract()
}

#[cfg(test)]
mod tests {
    use crate::test_lagrangians::{InPlane, Whisper};
    use crate::{Ensemble, Problem, SplittingScheme, Steps, Until};
    use contact_geom::{VelocityPoint, numbers::max_or_nan};

    /// A very small force accumulates correctly: from rest, next to a coordinate with large motion, and for a momentum
    /// with small kicks; in single runs and in lanes.
    #[test]
    fn a_force_of_next_to_nothing_adds_up() {
        let (h, count) = (1e-3, 2000_u32);
        let t = h * f64::from(count);
        for (v, later, spring) in [0.0, 1.0]
            .into_iter()
            .flat_map(|v| [false, true].into_iter().flat_map(move |later| [0.0, 1.0].map(|spring| (v, later, spring))))
        {
            let system = InPlane::from(Whisper { force: 1e-13, later, spring });
            // The contribution of the force to position and momentum; for the force t it is t^3/6 and t^2/2.
            let added = if later { [t * t * t / 6.0, t * t / 2.0] } else { [t * t / 2.0, t] }.map(|x| x * 1e-13);
            let start = VelocityPoint::new([1.0, spring], [v, 0.0], 0.0);
            for scheme in [SplittingScheme::STRANG, SplittingScheme::BLANES_MOAN_6, SplittingScheme::KAHAN_LI_8] {
                let steps = Steps::Count(count as usize);
                let problem = Problem::new(&system, 0.0, start).unwrap();
                let end = problem.by(scheme).steps(steps).run(Until::Time(t)).unwrap();
                let mut ends = vec![(end.q, end.p)];
                let ensemble = Ensemble::new(&system, 0.0, 3, |_| start).by(scheme).steps(steps);
                ensemble
                    .run(Until::Time(t), |member| {
                        let state = &member.ending.as_ref().unwrap().state;
                        ends.push((state.q.clone(), state.p.clone()));
                    })
                    .unwrap();
                assert_eq!(ends.len(), 4);
                for (q, p) in ends {
                    // The tolerance is the round-off of the final value and of t; the sums add none.
                    let off = max_or_nan((q[0] - (1.0 + v * t + added[0])).abs(), (p[0] - (v + added[1])).abs());
                    let name = scheme.name();
                    assert!(off <= 2.0 * f64::EPSILON * (1.0 + v * t), "{name}, v = {v}, {later}, {spring}: {off:e}");
                }
            }
        }
    }
}
