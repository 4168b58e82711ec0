//! A mechanical system as collocation sees it: its number of coordinates is known at run time, and vectors are slices.

mod by_points;
mod kernels;
mod over_slices;

pub(crate) use by_points::ByPoints;
pub(crate) use kernels::{Coordinates, InRegisters, KernelsOf, SharedKernels, add_force, few_coordinates, zeros};
pub(crate) use over_slices::OverSlices;

use crate::StepError;
use crate::gauss::curve::SampleKernel;
use crate::gauss::routes::general::GeneralKernel;
use crate::gauss::routes::hamiltonian::HamiltonianKernel;
use crate::gauss::routes::separable::SeparableKernel;
use crate::gauss::stages::curvature::curvature;
use crate::integration::{AtState, at_state};
use crate::system::applied_force::AppliedForce;
use crate::system::mass_matrix::{BLOCK, mass_matrix};
use crate::theory::legendre_inverse;
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ChartVector, Derivatives, Dual, Hessian, Lagrangian, PhasePoint, VelocityPoint,
    support::{gradient_rounding, rounding_at_state, seed},
};

/// A point `(q, v, z)` of TQ x R, or a state `(q, p, z)` of T\*Q x R with p in the place of v.
#[derive(Clone, Copy)]
pub(crate) struct PointRef<'r> {
    pub q: &'r [f64],
    pub v: &'r [f64],
    pub z: f64,
}

impl<'r> PointRef<'r> {
    /// A state with its momentum.
    pub fn of_state<const N: usize>(state: &'r PhasePoint<N>) -> Self {
        PointRef { q: state.q.as_slice(), v: state.p.as_slice(), z: state.z }
    }
}

/// A gradient `(L_q, L_v, L_z)`, or `(H_q, H_p, H_z)` with `H_p` in the place of `L_v`.
#[derive(Clone, Debug)]
pub(crate) struct PointGradient {
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub z: f64,
}

impl PointGradient {
    pub fn zeros(n: usize) -> Self {
        PointGradient { q: vec![0.0; n], v: vec![0.0; n], z: 0.0 }
    }

    fn set<const N: usize>(&mut self, g: &ChartVector<N>) {
        self.q.copy_from_slice(g.x.as_slice());
        self.v.copy_from_slice(g.y.as_slice());
        self.z = g.z;
    }
}

/// The applied force at a point with its derivatives in q, v and z; all 0 where there is none.
#[derive(Clone, Debug)]
pub(crate) struct ForceDerivatives {
    pub value: Vec<f64>,
    pub q: DMatrix<f64>,
    pub v: DMatrix<f64>,
    pub z: Vec<f64>,
}

/// L, or H, at a point with its first and second derivatives, and the applied force. Made once for a run, so that steps do
/// not allocate.
#[derive(Clone, Debug)]
pub(crate) struct PointDerivatives {
    pub value: f64,
    pub gradient: PointGradient,
    pub qq: DMatrix<f64>,
    pub qv: DMatrix<f64>,
    pub vv: DMatrix<f64>,
    pub qz: Vec<f64>,
    pub vz: Vec<f64>,
    pub zz: f64,
    /// `None` where the system has none.
    pub force: Option<ForceDerivatives>,
}

impl PointDerivatives {
    /// The workspace for a system.
    pub fn of(system: &(impl SystemAtPoints + ?Sized)) -> Self {
        let n = system.dimension();
        let (square, line) = (|| DMatrix::zeros(n, n), || vec![0.0; n]);
        let force = || ForceDerivatives { value: line(), q: square(), v: square(), z: line() };
        PointDerivatives {
            value: 0.0,
            gradient: PointGradient::zeros(n),
            qq: square(),
            qv: square(),
            vv: square(),
            qz: line(),
            vz: line(),
            zz: 0.0,
            force: system.is_forced().then(force),
        }
    }

    fn set_hessian<const N: usize>(&mut self, hessian: &Hessian<N>) {
        let Hessian { qq, qv, vv, qz, vz, zz } = hessian;
        self.qq.copy_from_slice(qq.as_slice());
        self.qv.copy_from_slice(qv.as_slice());
        self.vv.copy_from_slice(vv.as_slice());
        self.qz.copy_from_slice(qz.as_slice());
        self.vz.copy_from_slice(vz.as_slice());
        self.zz = *zz;
    }

    fn set_force<const N: usize>(&mut self, applied: Option<AppliedForce<N>>) {
        let (Some(to), Some(applied)) = (&mut self.force, applied) else { return };
        to.value.copy_from_slice(applied.value.as_slice());
        to.q.copy_from_slice(applied.q.as_slice());
        to.v.copy_from_slice(applied.v.as_slice());
        to.z.copy_from_slice(applied.z.as_slice());
    }
}

/// What is evaluated at single points.
pub(crate) trait SystemAtPoints {
    /// The number n of coordinates.
    fn dimension(&self) -> usize;

    /// Whether there may be an applied force.
    fn is_forced(&self) -> bool;

    /// Whether there are norms that may vanish; see [`System::has_cones`](crate::System::has_cones).
    fn has_cones(&self) -> bool;

    /// The value of L.
    fn value(&self, t: f64, x: PointRef<'_>) -> f64;

    /// L, which is returned, its gradient, and `L_q + f`, as Newton's method for the stages evaluates them.
    fn stage_value(&self, t: f64, x: PointRef<'_>, gradient: &mut PointGradient, force: &mut [f64]) -> f64;

    /// The gradient of L.
    fn gradient(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient);

    /// L, its gradient and Hessian, and the applied force with its derivatives.
    fn derivatives(&self, t: f64, x: PointRef<'_>, out: &mut PointDerivatives);

    /// The contact Hamiltonian with its gradient, if the Lagrangian is given by one; the applied force is not included.
    fn hamiltonian(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) -> Option<f64>;

    /// The contact Hamiltonian with its derivatives, and the applied force with its derivatives in q, v, z; `false` where
    /// the Lagrangian is not given by one.
    fn hamiltonian_derivatives(&self, t: f64, x: PointRef<'_>, out: &mut PointDerivatives) -> bool;

    /// The applied force, 0 where there is none.
    fn applied_force(&self, t: f64, x: PointRef<'_>, out: &mut [f64]);

    /// `L_q + f` of a separable Lagrangian at a position.
    fn force(&self, t: f64, q: &[f64], out: &mut [f64]);

    /// The derivative of [`force`](Self::force) in the position.
    fn curvature(&self, t: f64, q: &[f64], out: &mut DMatrix<f64>);

    /// `W = L_vv`.
    fn mass_matrix(&self, t: f64, x: PointRef<'_>, out: &mut DMatrix<f64>);

    /// First-order bounds of the rounding errors of L, which is returned, and of its gradient.
    fn rounding(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) -> f64;

    /// The same at a state with the momentum p, for a Lagrangian that is given by a contact Hamiltonian from the
    /// derivatives of the Hamiltonian.
    fn rounding_at_state(&self, t: f64, x: PointRef<'_>, p: &[f64], out: &mut PointGradient) -> f64;

    /// The velocity at a state, near a guess.
    ///
    /// # Errors
    /// Those of the inverse Legendre transform.
    fn velocity(&self, t: f64, state: PointRef<'_>, near: &[f64], out: &mut [f64]) -> Result<(), StepError>;

    /// The velocity at a state, near a guess, with `L_q + f` and `L_z` there in `out.q` and `out.z`; of a contact
    /// Hamiltonian whatever the rank of `H_pp`.
    ///
    /// # Errors
    /// Those of the inverse Legendre transform.
    fn at_state(
        &self,
        t: f64,
        state: PointRef<'_>,
        near: &[f64],
        v: &mut [f64],
        out: &mut PointGradient,
    ) -> Result<(), StepError>;

    /// The rate dt/dtau of the time transformation.
    fn dt_dtau(&self, q: &[f64]) -> f64;
}

/// A system whose motions collocation follows.
pub(crate) trait CollocationSystem:
    SystemAtPoints + GeneralKernel + SeparableKernel + HamiltonianKernel + SampleKernel
{
}

impl<T: SystemAtPoints + GeneralKernel + SeparableKernel + HamiltonianKernel + SampleKernel> CollocationSystem for T {}

/// A Lagrangian whose number of coordinates is known at compile time.
pub(crate) struct Typed<'a, L, const N: usize>(pub &'a L);

impl<L, const N: usize> Clone for Typed<'_, L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L, const N: usize> Copy for Typed<'_, L, N> {}

/// A vector from its components.
pub(crate) fn vector_of<const N: usize>(x: &[f64]) -> SVector<f64, N> {
    SVector::from_fn(|d, _| x[d])
}

fn point<const N: usize>(x: PointRef<'_>) -> VelocityPoint<N> {
    VelocityPoint { q: vector_of(x.q), v: vector_of(x.v), z: x.z }
}

fn state<const N: usize>(x: PointRef<'_>) -> PhasePoint<N> {
    PhasePoint { q: vector_of(x.q), p: vector_of(x.v), z: x.z }
}

impl<L: Lagrangian<N>, const N: usize> SystemAtPoints for Typed<'_, L, N> {
    fn dimension(&self) -> usize {
        N
    }

    fn is_forced(&self) -> bool {
        L::HINTS.forced
    }

    fn has_cones(&self) -> bool {
        self.0.has_cones()
    }

    fn value(&self, t: f64, x: PointRef<'_>) -> f64 {
        Lagrangian::value(self.0, t, &vector_of(x.q), &vector_of(x.v), x.z)
    }

    fn stage_value(&self, t: f64, x: PointRef<'_>, gradient: &mut PointGradient, force: &mut [f64]) -> f64 {
        let x = point(x);
        // Dual numbers with many directions would not fit on the stack.
        let (value, d) = if const { N > BLOCK } {
            self.0.with_gradient(t, &x)
        } else {
            let l: Dual<f64, ChartVector<N>> = self.0.along(t, &seed(&ChartVector::from(x)).into());
            (l.re, l.d)
        };
        gradient.set(&d);
        force.copy_from_slice(d.x.as_slice());
        if const { L::HINTS.forced } {
            let applied = self.0.applied_force(t, &x);
            for d in 0..N {
                force[d] += applied[d];
            }
        }
        value
    }

    fn gradient(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) {
        out.set(&Derivatives::gradient(self.0, t, &point(x)));
    }

    fn derivatives(&self, t: f64, x: PointRef<'_>, out: &mut PointDerivatives) {
        let x = point(x);
        out.value = Lagrangian::value(self.0, t, &x.q, &x.v, x.z);
        // `with_gradient`, which is made for kernels, may round in another way.
        out.gradient.set(&self.0.gradient(t, &x));
        out.set_hessian(&self.0.hessian(t, &x));
        out.set_force(AppliedForce::of(self.0, t, &x));
    }

    fn hamiltonian(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) -> Option<f64> {
        let (value, gradient) = self.0.hamiltonian_with_gradient(t, &state(x))?;
        out.set(&gradient);
        Some(value)
    }

    fn hamiltonian_derivatives(&self, t: f64, x: PointRef<'_>, out: &mut PointDerivatives) -> bool {
        let x = state(x);
        let with_gradient = self.0.hamiltonian_with_gradient(t, &x);
        let (Some((value, gradient)), Some(hessian)) = (with_gradient, self.0.hamiltonian_hessian(t, &x)) else {
            return false;
        };
        out.value = value;
        out.gradient.set(&gradient);
        out.set_hessian(&hessian);
        out.set_force(AppliedForce::of(self.0, t, &VelocityPoint { q: x.q, v: gradient.y, z: x.z }));
        true
    }

    fn applied_force(&self, t: f64, x: PointRef<'_>, out: &mut [f64]) {
        if const { L::HINTS.forced } {
            out.copy_from_slice(self.0.applied_force(t, &point(x)).as_slice());
        } else {
            out.fill(0.0);
        }
    }

    fn force(&self, t: f64, q: &[f64], out: &mut [f64]) {
        let x = VelocityPoint { q: vector_of(q), v: SVector::zeros(), z: 0.0 };
        out.copy_from_slice(self.0.force(t, &x).as_slice());
    }

    fn curvature(&self, t: f64, q: &[f64], out: &mut DMatrix<f64>) {
        out.copy_from_slice(curvature(self.0, t, &vector_of(q)).as_slice());
    }

    fn mass_matrix(&self, t: f64, x: PointRef<'_>, out: &mut DMatrix<f64>) {
        out.copy_from_slice(mass_matrix(self.0, t, &point(x)).as_slice());
    }

    fn rounding(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) -> f64 {
        let (of_value, once) = gradient_rounding(self.0, t, &point(x));
        out.set(&once);
        of_value
    }

    fn rounding_at_state(&self, t: f64, x: PointRef<'_>, p: &[f64], out: &mut PointGradient) -> f64 {
        let state = PhasePoint { q: vector_of(x.q), p: vector_of(p), z: x.z };
        let (of_value, once) = rounding_at_state(self.0, t, &point(x), &state);
        out.set(&once);
        of_value
    }

    fn velocity(&self, t: f64, at: PointRef<'_>, near: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        let x = legendre_inverse(self.0, t, &state::<N>(at), &vector_of(near))?;
        out.copy_from_slice(x.v.as_slice());
        Ok(())
    }

    fn at_state(
        &self,
        t: f64,
        at: PointRef<'_>,
        near: &[f64],
        v: &mut [f64],
        out: &mut PointGradient,
    ) -> Result<(), StepError> {
        let AtState { x, force, rate, .. } = at_state(self.0, t, &state::<N>(at), &vector_of(near))?;
        v.copy_from_slice(x.v.as_slice());
        out.q.copy_from_slice(force.as_slice());
        out.z = rate;
        Ok(())
    }

    fn dt_dtau(&self, q: &[f64]) -> f64 {
        self.0.dt_dtau(&vector_of(q))
    }
}
