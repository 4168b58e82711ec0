//! Mechanical systems with a number of coordinates that is known at compile time.

use super::ForceDerivatives;
use super::applied_force::{AppliedForce, ForceAt};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::switching::Control;
use contact_geom::{
    ChartVector, Defect, Defects, Derivatives, ForceStructure, GeometryError, Hessian, Hints, Lagrangian, PhasePoint,
    Structure, VelocityPoint,
    support::{gradient_rounding, herglotz_rates, rounding_at_state},
};

/// A mechanical system whose number of coordinates is known at compile time: its Lagrangian `L(t, q, v, z)`, the derivatives
/// of L at points in `f64`, and its switching functions. Every [`Lagrangian`] is one; a [`System`](crate::System) is the
/// same without the number in its type.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::TypedSystem;
/// let pendulum = Pendulum { gamma: -0.1 };
/// let system: &dyn TypedSystem<1> = &pendulum;
/// let x = VelocityPoint::new([1.0], [2.0], 0.0);
/// assert_eq!(system.gradient(0.0, &x).y[0], 2.0); // L_v
/// ```
pub trait TypedSystem<const N: usize> {
    /// What is known of the Lagrangian at compile time.
    fn hints(&self) -> Hints;

    /// The declared structure of the Lagrangian.
    fn structure(&self) -> Structure;

    /// What may be relied on about the applied force.
    fn force_structure(&self) -> ForceStructure<N>;

    /// Whether there is an applied force.
    fn has_force(&self) -> bool;

    /// The value `L(t, q, v, z)`.
    fn value(&self, t: f64, x: &VelocityPoint<N>) -> f64;

    /// The partial derivatives `(L_q, L_v, L_z)`.
    fn gradient(&self, t: f64, x: &VelocityPoint<N>) -> ChartVector<N>;

    /// The value with `(L_q + f, L_v, L_z)`, where f is the applied force.
    fn with_gradient_and_force(&self, t: f64, x: &VelocityPoint<N>) -> (f64, ChartVector<N>);

    /// The applied force `f(t, q, v, z)`.
    fn applied_force(&self, t: f64, x: &VelocityPoint<N>) -> SVector<f64, N>;

    /// The applied force with its derivatives; `None` if there is none.
    fn force_derivatives(&self, t: f64, x: &VelocityPoint<N>) -> Option<ForceDerivatives>;

    /// The second partial derivatives in `(q, v, z)`.
    fn hessian(&self, t: f64, x: &VelocityPoint<N>) -> Hessian<N>;

    /// `W = L_vv` alone.
    fn mass_matrix(&self, t: f64, x: &VelocityPoint<N>) -> SMatrix<f64, N, N>;

    /// The Herglotz vector field `(v, a, L)` with the rate `L_z` of the conformal factor.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where W is singular; [`GeometryError::Undefined`] for a Lagrangian that is given by a
    /// contact Hamiltonian, whose rates are those of `(q, p, z)`.
    fn rates(&self, t: f64, x: &VelocityPoint<N>) -> Result<(ChartVector<N>, f64), GeometryError>;

    /// First-order bounds of the rounding errors of the value and of the gradient; NaN for a Lagrangian that is given by a
    /// contact Hamiltonian, for which they are known [at a state](Self::rounding_at_state) alone.
    fn rounding(&self, t: f64, x: &VelocityPoint<N>) -> (f64, ChartVector<N>);

    /// The same at a state with its velocity, for a Lagrangian that is given by a contact Hamiltonian from the
    /// derivatives of the Hamiltonian.
    fn rounding_at_state(&self, t: f64, x: &VelocityPoint<N>, state: &PhasePoint<N>) -> (f64, ChartVector<N>);

    /// The defects at a point of the claims of the [structure](Self::structure); `None` where they cannot be judged, and
    /// where they are proved.
    fn claim_defects(&self, t: f64, x: &VelocityPoint<N>) -> Option<Defects>;

    /// The contact Hamiltonian with its derivatives `(H_q, H_p, H_z)` at a state, where the Lagrangian is given by one.
    fn hamiltonian_with_gradient(&self, t: f64, x: &PhasePoint<N>) -> Option<(f64, ChartVector<N>)>;

    /// The second derivatives of that contact Hamiltonian, with p in the place of v.
    fn hamiltonian_hessian(&self, t: f64, x: &PhasePoint<N>) -> Option<Hessian<N>>;

    /// The first claim on that contact Hamiltonian that is false at a state.
    fn hamiltonian_defect(&self, t: f64, x: &PhasePoint<N>) -> Option<Defect>;

    /// Appends the values of the switching functions at a point.
    fn switching_functions(&self, t: f64, x: &VelocityPoint<N>, values: &mut Vec<f64>);

    /// What happens at a zero of a switching function.
    fn at_switch(&self, index: usize, t: f64, x: &VelocityPoint<N>, rising: bool) -> Control<N>;

    /// What happens where replacements at the zero of a switching function accumulate.
    fn at_accumulation(&self, index: usize, t: f64, x: &VelocityPoint<N>) -> Control<N>;

    /// The times at which L or the applied force has a kink or a jump in time.
    fn breaks(&self) -> &[f64];

    /// Whether L or the applied force contains a norm, or another root, that may vanish along the motion.
    fn has_cones(&self) -> bool;

    /// The rate `dt/dtau` of the time transformation.
    fn dt_dtau(&self, q: &SVector<f64, N>) -> f64;
}

impl<L: Lagrangian<N>, const N: usize> TypedSystem<N> for L {
    fn hints(&self) -> Hints {
        L::HINTS
    }
    fn structure(&self) -> Structure {
        Lagrangian::structure(self)
    }
    fn force_structure(&self) -> ForceStructure<N> {
        Lagrangian::force_structure(self)
    }
    fn has_force(&self) -> bool {
        Lagrangian::has_force(self)
    }
    fn value(&self, t: f64, x: &VelocityPoint<N>) -> f64 {
        Lagrangian::value(self, t, &x.q, &x.v, x.z)
    }
    fn gradient(&self, t: f64, x: &VelocityPoint<N>) -> ChartVector<N> {
        Derivatives::gradient(self, t, x)
    }
    fn with_gradient_and_force(&self, t: f64, x: &VelocityPoint<N>) -> (f64, ChartVector<N>) {
        Derivatives::with_gradient_and_force(self, t, x)
    }
    fn applied_force(&self, t: f64, x: &VelocityPoint<N>) -> SVector<f64, N> {
        Lagrangian::applied_force(self, t, x)
    }
    fn force_derivatives(&self, t: f64, x: &VelocityPoint<N>) -> Option<ForceDerivatives> {
        if const { L::HINTS.over_slices } {
            return Lagrangian::over_slices(self, ForceAt { t, x: &x.into() }).flatten();
        }
        let applied = AppliedForce::of(self, t, x)?;
        let matrix = |m: &SMatrix<f64, N, N>| DMatrix::from_column_slice(N, N, m.as_slice());
        let (q, v) = (matrix(&applied.q), matrix(&applied.v));
        Some(ForceDerivatives { value: applied.value.into(), q, v, z: applied.z.into() })
    }
    fn hessian(&self, t: f64, x: &VelocityPoint<N>) -> Hessian<N> {
        Derivatives::hessian(self, t, x)
    }
    fn mass_matrix(&self, t: f64, x: &VelocityPoint<N>) -> SMatrix<f64, N, N> {
        Derivatives::mass_matrix(self, t, x)
    }
    fn rates(&self, t: f64, x: &VelocityPoint<N>) -> Result<(ChartVector<N>, f64), GeometryError> {
        // The derivatives of an inverse Legendre transformation are not compiled where nothing needs them.
        if const { L::HINTS.hamiltonian } {
            return Err(GeometryError::Undefined { what: "the acceleration as a function of position and velocity" });
        }
        herglotz_rates(self, t, x)
    }
    fn rounding(&self, t: f64, x: &VelocityPoint<N>) -> (f64, ChartVector<N>) {
        if const { L::HINTS.hamiltonian } {
            let none = SVector::from_element(f64::NAN);
            return (f64::NAN, ChartVector { x: none, y: none, z: f64::NAN });
        }
        gradient_rounding(self, t, x)
    }
    fn rounding_at_state(&self, t: f64, x: &VelocityPoint<N>, state: &PhasePoint<N>) -> (f64, ChartVector<N>) {
        rounding_at_state(self, t, x, state)
    }
    fn claim_defects(&self, t: f64, x: &VelocityPoint<N>) -> Option<Defects> {
        if const { L::HINTS.proved || L::HINTS.hamiltonian } {
            return None;
        }
        Lagrangian::structure(self).defects(self, t, x)
    }
    fn hamiltonian_with_gradient(&self, t: f64, x: &PhasePoint<N>) -> Option<(f64, ChartVector<N>)> {
        Lagrangian::hamiltonian_with_gradient(self, t, x)
    }
    fn hamiltonian_hessian(&self, t: f64, x: &PhasePoint<N>) -> Option<Hessian<N>> {
        Lagrangian::hamiltonian_hessian(self, t, x)
    }
    fn hamiltonian_defect(&self, t: f64, x: &PhasePoint<N>) -> Option<Defect> {
        Lagrangian::hamiltonian_defect(self, t, x)
    }
    fn switching_functions(&self, t: f64, x: &VelocityPoint<N>, values: &mut Vec<f64>) {
        Lagrangian::switching_functions(self, t, x, values);
    }
    fn at_switch(&self, index: usize, t: f64, x: &VelocityPoint<N>, rising: bool) -> Control<N> {
        Lagrangian::at_switch(self, index, t, x, rising)
    }
    fn at_accumulation(&self, index: usize, t: f64, x: &VelocityPoint<N>) -> Control<N> {
        Lagrangian::at_accumulation(self, index, t, x)
    }
    fn breaks(&self) -> &[f64] {
        Lagrangian::breaks(self)
    }
    fn has_cones(&self) -> bool {
        Lagrangian::has_cones(self)
    }
    fn dt_dtau(&self, q: &SVector<f64, N>) -> f64 {
        Lagrangian::dt_dtau(self, q)
    }
}
