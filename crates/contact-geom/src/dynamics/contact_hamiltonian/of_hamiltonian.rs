//! The Lagrangian of a contact Hamiltonian.

use crate::dynamics::contact_hamiltonian::parametric::lagrangian_at;
use crate::numbers::dot;
use crate::support::linear;
use crate::{
    ChartVector, ContactHamiltonian, HamiltonianDerivatives, Hessian, Hints, Lagrangian, Parametric,
    ParametricHamiltonian, PhasePoint, Scalar, Structure, VelocityPoint, momentum,
};
use nalgebra::{SMatrix, SVector};

/// A contact Hamiltonian in the place of a Lagrangian: problems and runs take it like any other.
///
/// Where `H_pp` is regular, `L = p . v - H` with the momentum p of the velocity, `H_p = v`, and
/// `(L_q, L_v, L_z) = (-H_q, p, -H_z)`. Where it is singular there is no such function: L and its derivatives are NaN.
/// Contact Gauss collocation evaluates H itself, whatever the rank of `H_pp`, from momenta that it knows.
///
/// ```
/// use contact_geom::{nalgebra::SVector, ContactHamiltonian, Lagrangian, OfHamiltonian, Scalar};
/// struct Relativistic;
/// impl ContactHamiltonian<1> for Relativistic {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
///         (p[0] * p[0] + 1.0).sqrt()
///     }
/// }
/// let l: f64 = OfHamiltonian(Relativistic).value(0.0, &[0.0].into(), &[0.6].into(), 0.0);
/// assert!((l + 0.8).abs() < 1e-15); // -sqrt(1 - v^2)
/// ```
#[derive(Clone, Copy, Debug)]
pub struct OfHamiltonian<H>(pub H);

impl<H> OfHamiltonian<H> {
    /// The contact Hamiltonian.
    pub fn hamiltonian(&self) -> &H {
        &self.0
    }
}

/// The state `(q, p, z)` of a point of TQ x R; NaN momenta where there are none.
fn phase_point<H: ContactHamiltonian<N>, T: Scalar, const N: usize>(
    hamiltonian: &H,
    t: T,
    x: &VelocityPoint<N, T>,
) -> PhasePoint<N, T> {
    let p = momentum(hamiltonian, t, x).unwrap_or_else(|_| SVector::from_element(T::from(f64::NAN)));
    PhasePoint { q: x.q, p, z: x.z }
}

impl<const N: usize, H: ContactHamiltonian<N>> Lagrangian<N> for OfHamiltonian<H> {
    const HINTS: Hints = Hints {
        hamiltonian: true,
        proved: H::PROVED,
        interpreted: H::INTERPRETED,
        switching_functions: H::SWITCHING,
        ..Hints::NONE
    };

    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let x = phase_point(&self.0, t, &VelocityPoint { q: *q, v: *v, z });
        dot(x.p, v) - self.0.value(t, &x.q, &x.p, x.z)
    }

    fn structure(&self) -> Structure {
        self.0.structure().of_lagrangian()
    }

    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        self.closed_with_gradient(t, x).map(|(_, gradient)| gradient)
    }

    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        let state = phase_point(&self.0, t, x);
        let (h, d) = self.0.with_gradient(t, &state);
        Some((dot(state.p, x.v) - h, ChartVector { x: -d.x, y: state.p, z: -d.z }))
    }

    /// With `K = H_pp^-1`: `L_vv = K`, `L_vq = -K H_pq`, `L_vz = -K H_pz`, `L_qq = H_qp K H_pq - H_qq` and so on.
    fn closed_hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        let h = self.0.hessian(t, &phase_point(&self.0, t, x));
        let none = T::from(f64::NAN);
        let column = |b: SVector<T, N>| {
            let mut b = b;
            if linear::solve(&mut h.vv.clone_owned(), &mut b).is_ok() { b } else { SVector::from_element(none) }
        };
        let (mut vv, mut vq) = (SMatrix::<T, N, N>::from_element(none), SMatrix::<T, N, N>::from_element(none));
        for j in 0..N {
            let unit = SVector::from_fn(|i, _| if i == j { T::one() } else { T::zero() });
            vv.set_column(j, &column(unit));
            vq.set_column(j, &-column(SVector::from_fn(|i, _| h.qv[(j, i)])));
        }
        let vz = -column(h.vz);
        // `H_qp` times the derivatives of the momentum.
        let sum = |i: usize, of: &dyn Fn(usize) -> T| (0..N).fold(T::zero(), |sum, k| sum - h.qv[(i, k)] * of(k));
        Some(Hessian {
            qq: SMatrix::from_fn(|i, j| sum(i, &|k| vq[(k, j)]) - h.qq[(i, j)]),
            qv: vq.transpose(),
            vv,
            qz: SVector::from_fn(|i, _| sum(i, &|k| vz[k]) - h.qz[i]),
            vz,
            zz: (0..N).fold(-h.zz, |sum, k| sum - h.vz[k] * vz[k]),
        })
    }

    #[inline(always)]
    fn hamiltonian_with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        Some(self.0.with_gradient(t, x))
    }

    fn hamiltonian_hessian(&self, t: f64, x: &PhasePoint<N>) -> Option<Hessian<N>> {
        Some(self.0.hessian(t, x))
    }

    fn hamiltonian_defect(&self, t: f64, x: &PhasePoint<N>) -> Option<crate::Defect> {
        if const { H::PROVED } { None } else { self.0.structure().defect(&self.0, t, x) }
    }

    /// Those of the Hamiltonian, with p in the place of v.
    fn switching_functions(&self, t: f64, x: &VelocityPoint<N>, values: &mut Vec<f64>) {
        self.0.switching_functions(t, &PhasePoint { q: x.q, p: x.v, z: x.z }, values);
    }

    fn breaks(&self) -> &[f64] {
        self.0.breaks()
    }
}

/// The parameters are those of the Hamiltonian. Where `H_pp` is singular the Lagrangian is NaN; derivatives of runs are then
/// those of the Hamiltonian.
impl<const N: usize, H: ParametricHamiltonian<N>> Parametric<N> for OfHamiltonian<H> {
    fn parameter_names(&self) -> Vec<String> {
        self.0.parameter_names()
    }

    fn parameters(&self) -> Vec<f64> {
        self.0.parameters()
    }

    fn parameter_count(&self) -> usize {
        self.0.parameters().len()
    }

    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        self.0.with_parameters(theta).map(OfHamiltonian)
    }

    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        if theta.is_empty() {
            return self.value(t, q, v, z);
        }
        lagrangian_at(&self.0, theta, t, &VelocityPoint { q: *q, v: *v, z })
    }

    fn hamiltonian_at<T: Scalar>(&self, theta: &[T], t: T, x: &PhasePoint<N, T>) -> Option<T> {
        Some(self.0.value_at(theta, t, &x.q, &x.p, x.z))
    }
}
