//! The splitting of a separable contact Hamiltonian, whose pieces are found from its declared structure.

use super::pieces::{Kinetic, PolynomialInAction, Potential, Prolonged};
use super::{HamiltonianSplitting, Polynomial};
use crate::integration::StepFormula;
use crate::{InputError, Integrator, MethodInfo, Problem, SplittingScheme, StepError, Stepper, StepperOptions};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianDerivatives, OfHamiltonian, PhasePoint, Scalar};
use std::borrow::Cow;

/// The pieces of a separable contact Hamiltonian, in the order of a [`HamiltonianSplitting`].
pub type SeparablePieces<H, const N: usize> =
    (Kinetic<PartOfMomenta<H, N>>, Prolonged<PolynomialInAction<PartOfAction>>, Potential<PartOfPositions<H, N>>);

/// `T(p) = H(t0, q0, p, 0) - H(t0, q0, p0, 0)` for a separable H.
#[derive(Clone, Copy, Debug)]
pub struct PartOfMomenta<H, const N: usize> {
    hamiltonian: H,
    t: f64,
    q: SVector<f64, N>,
    /// `H(t0, q0, p0, 0)`.
    value: f64,
}

impl<H: ContactHamiltonian<N>, const N: usize> PartOfMomenta<H, N> {
    fn at<T: Scalar>(&self, p: &SVector<T, N>) -> (T, PhasePoint<N, T>) {
        (T::from(self.t), PhasePoint { q: self.q.map(T::from), p: *p, z: T::zero() })
    }
}

impl<H: ContactHamiltonian<N>, const N: usize> ContactHamiltonian<N> for PartOfMomenta<H, N> {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, N>, p: &SVector<T, N>, _z: T) -> T {
        let (t, x) = self.at(p);
        self.hamiltonian.value(t, &x.q, &x.p, x.z) - self.value
    }

    fn closed_with_gradient<T: Scalar>(&self, _t: T, x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        let (t, x) = self.at(&x.p);
        let (h, d) = self.hamiltonian.with_gradient(t, &x);
        Some((h - self.value, ChartVector { x: SVector::from_element(T::zero()), y: d.y, z: T::zero() }))
    }
}

/// `V(t, q) = H(t, q, p0, 0)` for a separable H.
#[derive(Clone, Copy, Debug)]
pub struct PartOfPositions<H, const N: usize> {
    hamiltonian: H,
    p: SVector<f64, N>,
}

impl<H: ContactHamiltonian<N>, const N: usize> PartOfPositions<H, N> {
    fn at<T: Scalar>(&self, q: &SVector<T, N>) -> PhasePoint<N, T> {
        PhasePoint { q: *q, p: self.p.map(T::from), z: T::zero() }
    }
}

impl<H: ContactHamiltonian<N>, const N: usize> ContactHamiltonian<N> for PartOfPositions<H, N> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, _p: &SVector<T, N>, _z: T) -> T {
        let x = self.at(q);
        self.hamiltonian.value(t, &x.q, &x.p, x.z)
    }

    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        let (h, d) = self.hamiltonian.with_gradient(t, &self.at(&x.q));
        Some((h, ChartVector { x: d.x, y: SVector::from_element(T::zero()), z: T::zero() }))
    }
}

/// `f(z) = a z + b z^2` for a separable H.
#[derive(Clone, Copy, Debug)]
pub struct PartOfAction {
    linear: f64,
    quadratic: f64,
}

impl<const N: usize> Polynomial<N> for PartOfAction {
    fn coefficients<T: Scalar>(&self, _t: T, _q: &SVector<T, N>) -> [T; 3] {
        [T::zero(), T::from(self.linear), T::from(self.quadratic)]
    }
}

/// The pieces of `H = T(p) + V(t, q) + a z + b z^2`, which must declare that it is
/// [`separable`](contact_geom::HamiltonianStructure::separable): its parts are values of H at the time, position and
/// momentum of a state, where the other variables vary.
///
/// ```
/// use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{PieceSum, separable_pieces};
/// struct Pendulum;
/// impl ContactHamiltonian<1> for Pendulum {
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
///         p[0] * p[0] * 0.5 - q[0].cos() + z * 0.1
///     }
///     fn structure(&self) -> HamiltonianStructure {
///         HamiltonianStructure { separable: true, ..HamiltonianStructure::default() }
///     }
/// }
/// let sum = PieceSum(separable_pieces(&Pendulum, 0.0, &PhasePoint::new([1.0], [0.5], 0.2))?);
/// let (q, p) = ([0.3].into(), [0.7].into());
/// assert!((sum.value(0.0, &q, &p, 0.4) - Pendulum.value(0.0, &q, &p, 0.4)).abs() < 1e-15);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
///
/// # Errors
/// [`InputError::Hypothesis`] where H does not declare to be separable; [`InputError::Undefined`] where it is not finite
/// at the state.
pub fn separable_pieces<'a, H: ContactHamiltonian<N>, const N: usize>(
    hamiltonian: &'a H,
    t: f64,
    x: &PhasePoint<N>,
) -> Result<SeparablePieces<&'a H, N>, InputError> {
    check_separable(hamiltonian)?;
    let at = PhasePoint { z: 0.0, ..*x };
    let ((value, d), second) = (hamiltonian.with_gradient(t, &at), hamiltonian.hessian(t, &at).zz);
    if !(value.is_finite() && d.is_finite() && second.is_finite()) {
        return Err(InputError::Undefined);
    }
    Ok((
        Kinetic(PartOfMomenta { hamiltonian, t, q: x.q, value }),
        Prolonged(PolynomialInAction(PartOfAction { linear: d.z, quadratic: 0.5 * second })),
        Potential(PartOfPositions { hamiltonian, p: x.p }),
    ))
}

fn check_separable<const N: usize>(hamiltonian: &impl ContactHamiltonian<N>) -> Result<(), InputError> {
    if hamiltonian.structure().separable {
        return Ok(());
    }
    Err(InputError::Hypothesis {
        hypothesis: "H = T(p) + V(t, q) + a z + b z^2, declared as separable (for another H use Gauss collocation, or \
                     name the pieces of a HamiltonianSplitting)",
    })
}

/// The splitting of a separable contact Hamiltonian into [`separable_pieces`], of every order of the compositions.
///
/// ```
/// use discrete_herglotz::{SplittingScheme, hamiltonian::SeparableSplitting};
/// let method = SeparableSplitting { scheme: SplittingScheme::KAHAN_LI_8 };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeparableSplitting {
    /// The composition.
    pub scheme: SplittingScheme,
}

impl SeparableSplitting {
    /// The splitting with the pieces of a Hamiltonian at the start of a problem.
    fn of<'a, H: ContactHamiltonian<N>, const N: usize>(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
    ) -> Result<HamiltonianSplitting<SeparablePieces<&'a H, N>>, InputError> {
        let pieces = separable_pieces(&problem.lagrangian.0, problem.t0, &problem.state)?;
        Ok(HamiltonianSplitting { pieces, scheme: self.scheme })
    }
}

impl<'a, H: ContactHamiltonian<N>, const N: usize> Integrator<'a, OfHamiltonian<H>, N> for SeparableSplitting {
    fn info(&self) -> MethodInfo {
        let name = Cow::Borrowed(self.scheme.name());
        MethodInfo { name, ..super::splitting::info(&self.scheme) }
    }

    fn check(&self, hamiltonian: &OfHamiltonian<H>) -> Result<(), InputError> {
        super::splitting::substeps(&self.scheme)?;
        check_separable(&hamiltonian.0)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        self.of(problem)?.stepper(problem, h, options)
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Jacobian)
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        self.of(problem).map_or(Ok(None), |splitting| splitting.step_jacobian(problem, h, step))
    }
}
