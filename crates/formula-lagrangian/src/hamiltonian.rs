//! Formulas as contact Hamiltonians.

use crate::derived::Derived;
use crate::evaluation::{At, whole};
use crate::lagrangian::{blank, whole_triple};
use crate::{Formula, FormulaError};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianStructure, Hessian, PhasePoint, Scalar};

/// A [`Formula`] over `N` coordinates as a [`ContactHamiltonian`], with derivatives in closed form and with a proved
/// structure. All formulas of one dimension have the same type. It is evaluated like a
/// [`FormulaLagrangian`](crate::FormulaLagrangian), with p in the place of v.
///
/// The zeros of its switching functions are those of the arguments of `abs` and `sign`, and so on, as for a Lagrangian.
///
/// ```
/// use contact_geom::{ContactHamiltonian, HamiltonianDerivatives, PhasePoint};
/// use formula_lagrangian::{Formula, FormulaNames};
/// // Van der Pol's oscillator: H is linear in p, and has no Lagrangian.
/// let names = FormulaNames::new(&["x"], &[("mu", 0.5)]);
/// let h = Formula::parse_hamiltonian("p_x*z - x + mu*(x^2 - 1)*z", &names)?.hamiltonian::<1>()?;
/// assert_eq!(h.structure().degree, Some(1));
/// let (value, d) = h.with_gradient(0.0, &PhasePoint::new([2.0], [0.0], 0.5));
/// assert_eq!((value, d.x[0], d.y[0], d.z), (-1.25, 0.0, 0.5, 1.5)); // H, H_q, H_p, H_z
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FormulaHamiltonian<const N: usize> {
    pub(crate) derived: Derived,
}

impl Formula {
    /// The contact Hamiltonian for integrators, with its derivatives and its proved structure.
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] unless the formula has `N` coordinates, [`FormulaError::TooLarge`],
    /// [`FormulaError::IsLagrangian`].
    pub fn hamiltonian<const N: usize>(&self) -> Result<FormulaHamiltonian<N>, FormulaError> {
        FormulaHamiltonian::new(self)
    }

    /// The same with at least as many coordinates. `p^2/2` is added for each one beyond those of the formula, which
    /// stays at rest if it starts at rest.
    ///
    /// # Errors
    /// Those of [`hamiltonian`](Self::hamiltonian); the formula may have less than `N` coordinates.
    pub fn hamiltonian_within<const N: usize>(&self) -> Result<FormulaHamiltonian<N>, FormulaError> {
        FormulaHamiltonian::within(self)
    }
}

impl<const N: usize> FormulaHamiltonian<N> {
    /// The Hamiltonian of a formula.
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] unless the formula has `N` coordinates, [`FormulaError::TooLarge`],
    /// [`FormulaError::IsLagrangian`].
    pub fn new(formula: &Formula) -> Result<Self, FormulaError> {
        if formula.dimension() != N {
            return Err(FormulaError::OtherDimension { found: formula.dimension(), asked: N });
        }
        Self::within(formula)
    }

    /// See [`Formula::hamiltonian_within`].
    pub(crate) fn within(formula: &Formula) -> Result<Self, FormulaError> {
        if !formula.is_hamiltonian() {
            return Err(FormulaError::IsLagrangian);
        }
        if formula.dimension() > N {
            return Err(FormulaError::OtherDimension { found: formula.dimension(), asked: N });
        }
        Ok(FormulaHamiltonian { derived: Derived::new(formula, N)? })
    }

    /// The formula, with the present values of its parameters.
    pub fn formula(&self) -> &Formula {
        &self.derived.formula
    }

    /// Sets the value of a parameter, without parsing or differentiating again.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`], [`FormulaError::ParameterValue`].
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        self.derived.set(parameter, value)
    }

    /// Whether H has neither kinks nor jumps; see [`is_smooth`](crate::FormulaLagrangian::is_smooth).
    pub fn is_smooth(&self) -> bool {
        self.derived.smooth
    }

    /// `L_z = -H_z` if it is proved to be constant, so that the conformal factor over a time T is `e^(L_z T)`.
    pub fn constant_rate(&self) -> Option<f64> {
        self.derived.constant_rate().map(|rate| if rate == 0.0 { 0.0 } else { -rate })
    }

    /// The indices of the coordinates on which H does not depend: their momenta are multiplied by the conformal factor.
    pub fn cyclic(&self) -> Vec<usize> {
        let n = self.derived.formula.dimension();
        (0..n).filter(|i| self.derived.cyclic.get(*i) == Some(&true)).collect()
    }
}

impl<const N: usize> ContactHamiltonian<N> for FormulaHamiltonian<N> {
    const PROVED: bool = true;
    const INTERPRETED: bool = true;
    const SWITCHING: bool = true;

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let mut value = T::zero();
        self.derived.value.evaluate::<T, N>(At::new(t, q, p, z), &mut [std::slice::from_mut(&mut value)]);
        whole(value)
    }

    /// Proved from the expression, for all values of the parameters except `z_free`.
    fn structure(&self) -> HamiltonianStructure {
        self.derived.of_hamiltonian
    }

    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        let (mut g, mut value) = (blank::<T, N>(), T::zero());
        let (z, value_slice) = (std::slice::from_mut(&mut g.z), std::slice::from_mut(&mut value));
        let results = &mut [g.x.as_mut_slice(), g.y.as_mut_slice(), z, value_slice];
        self.derived.with_gradient.evaluate::<T, N>(At::new(t, &x.q, &x.p, x.z), results);
        Some((whole(value), whole_triple(&g)))
    }

    #[inline(always)]
    fn closed_hessian<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<Hessian<N, T>> {
        Some(self.derived.hessian(At::new(t, &x.q, &x.p, x.z)))
    }

    /// As those of a [`FormulaLagrangian`](crate::FormulaLagrangian).
    fn switching_functions(&self, t: f64, x: &PhasePoint<N>, values: &mut Vec<f64>) {
        self.derived.switching_functions(At { t, q: x.q.as_slice(), v: x.p.as_slice(), z: x.z }, values);
    }

    /// As those of a [`FormulaLagrangian`](crate::FormulaLagrangian).
    fn breaks(&self) -> &[f64] {
        &self.derived.breaks
    }
}
