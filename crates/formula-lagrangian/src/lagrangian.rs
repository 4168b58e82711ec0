//! Formulas as Lagrangians.

use crate::derived::Derived;
use crate::drag::ProvedForce;
use crate::evaluation::{At, whole, whole_vector};
use crate::{Formula, FormulaDerivatives, FormulaError, FormulaSymmetry};
use contact_geom::nalgebra::{ArrayStorage, SMatrix, SVector};
use contact_geom::switching::Control;
use contact_geom::{
    ChartVector, ForceStructure, Hessian, Hints, Lagrangian, Scalar, SlicesVisitor, Structure, Symmetry, VelocityPoint,
    vector,
};
use std::sync::Arc;

/// A [`Formula`] over `N` coordinates as a [`Lagrangian`], with gradient and second derivatives in closed form and with
/// a proved structure. All formulas of one dimension have the same type, so that integrators are compiled for it once.
///
/// ```
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
/// use formula_lagrangian::Formula;
///
/// let formula = Formula::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)])?;
/// let mut pendulum = formula.lagrangian::<1>()?;
/// for gamma in [-0.1, -0.2] {
///     pendulum.set("gamma", gamma)?;
///     let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
///     let outcome = problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.5)).run(Until::Time(5.0))?;
///     println!("gamma = {gamma}: theta = {}", outcome.q[0]);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct FormulaLagrangian<const N: usize> {
    /// Its derivatives over N coordinates.
    pub(crate) derivatives: Arc<FormulaDerivatives>,
}

impl Formula {
    /// The Lagrangian for integrators, with its derivatives and its proved structure. Its type is compiled once for
    /// each dimension, for all formulas.
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] unless the formula has `N` coordinates, [`FormulaError::TooLarge`],
    /// [`FormulaError::IsHamiltonian`].
    pub fn lagrangian<const N: usize>(&self) -> Result<FormulaLagrangian<N>, FormulaError> {
        FormulaLagrangian::new(self)
    }

    /// The same with at least as many coordinates. Each coordinate beyond those of the formula is that of an uncoupled
    /// free particle of mass 1, which stays at rest if it starts at rest. For programs that are not compiled for each
    /// dimension.
    ///
    /// ```
    /// use formula_lagrangian::Formula;
    /// let three = Formula::parse("sum(i, 0, n-1, v[i]^2 - q[i]^2)/2", &["x[3]"], &[])?;
    /// assert!(three.lagrangian::<4>().is_err() && three.lagrangian_within::<4>().is_ok());
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] if the formula has more than `N` coordinates, [`FormulaError::TooLarge`].
    pub fn lagrangian_within<const N: usize>(&self) -> Result<FormulaLagrangian<N>, FormulaError> {
        FormulaLagrangian::within(self)
    }
}

impl<const N: usize> FormulaLagrangian<N> {
    /// The Lagrangian of a formula.
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] unless the formula has `N` coordinates, [`FormulaError::TooLarge`].
    pub fn new(formula: &Formula) -> Result<Self, FormulaError> {
        if formula.dimension() != N {
            return Err(FormulaError::OtherDimension { found: formula.dimension(), asked: N });
        }
        Self::within(formula)
    }

    /// See [`Formula::lagrangian_within`].
    pub(crate) fn within(formula: &Formula) -> Result<Self, FormulaError> {
        formula.check_is_lagrangian("Lagrangian of its own", "use `Formula::hamiltonian`")?;
        if formula.dimension() > N {
            return Err(FormulaError::OtherDimension { found: formula.dimension(), asked: N });
        }
        Ok(FormulaLagrangian { derivatives: Arc::new(FormulaDerivatives::within(formula, N)?) })
    }

    #[inline(always)]
    pub(crate) fn derived(&self) -> &Derived {
        &self.derivatives.derived
    }

    pub(crate) fn derived_mut(&mut self) -> &mut Derived {
        &mut Arc::make_mut(&mut self.derivatives).derived
    }

    /// The formula, with the present values of its parameters.
    pub fn formula(&self) -> &Formula {
        &self.derived().formula
    }

    /// Sets the value of a parameter, without parsing or differentiating again.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`], [`FormulaError::ParameterValue`].
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        self.derived_mut().set(parameter, value)
    }

    /// The proved structure of L with its forces; the same as [`structure`](Lagrangian::structure).
    pub fn proved(&self) -> &Structure {
        &self.derived().structure
    }

    /// Whether L and the forces have neither kinks nor jumps: they contain none of `abs`, `sign`, `min`, `max`, `if`,
    /// `atan2`, `hypot`, and no tables. Integrators reach their order where the motion does not meet a kink or a jump.
    pub fn is_smooth(&self) -> bool {
        self.derived().smooth
    }

    /// The number of resets and impacts.
    pub fn resets(&self) -> usize {
        self.derived().resets.len()
    }

    /// The number of the reset to which a [switching function](Lagrangian::switching_functions) belongs; `None` for the
    /// functions of kinks and jumps, which come first.
    pub fn reset_of(&self, index: usize) -> Option<usize> {
        self.derivatives.reset_of(index)
    }

    /// `L_z` if it is proved to be constant, so that the conformal factor over a time T is `e^(L_z T)`.
    pub fn constant_rate(&self) -> Option<f64> {
        self.derived().constant_rate()
    }

    /// The derivatives that it evaluates, over N coordinates.
    pub fn derivatives(&self) -> &Arc<FormulaDerivatives> {
        &self.derivatives
    }

    /// The [detected symmetries](FormulaDerivatives::symmetries).
    pub fn symmetries(&self) -> Vec<Symmetry<N>> {
        let along = |set: &[usize]| SVector::from_fn(|j, _| if set.contains(&j) { 1.0 } else { 0.0 });
        let of = |found: &FormulaSymmetry| match found {
            FormulaSymmetry::Translation(set) => Some(Symmetry::Translation(along(set))),
            FormulaSymmetry::Rotation(planes) => match planes[..] {
                [(i, j)] => Some(Symmetry::Rotation(i, j)),
                _ => Symmetry::rotations(planes).ok(),
            },
        };
        self.derivatives.symmetries().iter().filter_map(of).collect()
    }
}

/// Zeros, into which results are written.
#[inline(always)]
pub(crate) fn blank<T: Scalar, const N: usize>() -> ChartVector<N, T> {
    let zero = vector!(|_| T::zero());
    ChartVector { x: zero, y: zero, z: T::zero() }
}

/// See [`whole`].
#[inline(always)]
pub(crate) fn whole_triple<T: Scalar, const N: usize>(g: &ChartVector<N, T>) -> ChartVector<N, T> {
    ChartVector { x: whole_vector(&g.x), y: whole_vector(&g.y), z: whole(g.z) }
}

impl<const N: usize> Lagrangian<N> for FormulaLagrangian<N> {
    const HINTS: Hints = Hints {
        switching_functions: true,
        proved: true,
        interpreted: true,
        forced: true,
        over_slices: true,
        resets: true,
        ..Hints::NONE
    };

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let mut value = T::zero();
        self.derived().value.evaluate::<T, N>(At::new(t, q, v, z), &mut [std::slice::from_mut(&mut value)]);
        whole(value)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        let mut g = blank::<T, N>();
        let results = &mut [g.x.as_mut_slice(), g.y.as_mut_slice(), std::slice::from_mut(&mut g.z)];
        self.derived().gradient.evaluate::<T, N>(At::new(t, &x.q, &x.v, x.z), results);
        Some(whole_triple(&g))
    }

    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        let (mut g, mut value) = (blank::<T, N>(), T::zero());
        let (z, value_slice) = (std::slice::from_mut(&mut g.z), std::slice::from_mut(&mut value));
        let results = &mut [g.x.as_mut_slice(), g.y.as_mut_slice(), z, value_slice];
        self.derived().with_gradient.evaluate::<T, N>(At::new(t, &x.q, &x.v, x.z), results);
        Some((whole(value), whole_triple(&g)))
    }

    #[inline(always)]
    fn closed_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SVector<T, N>> {
        let mut force: SVector<T, N> = vector!(|_| T::zero());
        self.derived().force.evaluate::<T, N>(At::new(t, &x.q, &x.v, x.z), &mut [force.as_mut_slice()]);
        Some(whole_vector(&force))
    }

    #[inline(always)]
    fn closed_with_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, SVector<T, N>)> {
        let (mut value, mut force): (T, SVector<T, N>) = (T::zero(), vector!(|_| T::zero()));
        let results = &mut [std::slice::from_mut(&mut value), force.as_mut_slice()];
        self.derived().with_force.evaluate::<T, N>(At::new(t, &x.q, &x.v, x.z), results);
        Some((whole(value), whole_vector(&force)))
    }

    #[inline(always)]
    fn closed_rate<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<T> {
        let mut rate = T::zero();
        self.derived().rate.evaluate::<T, N>(At::new(t, &x.q, &x.v, x.z), &mut [std::slice::from_mut(&mut rate)]);
        Some(whole(rate))
    }

    #[inline(always)]
    fn closed_mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SMatrix<T, N, N>> {
        let mut w: SMatrix<T, N, N> = SMatrix::from_array_storage(ArrayStorage([[T::zero(); N]; N]));
        self.derived().mass.evaluate::<T, N>(At::new(t, &x.q, &x.v, x.z), &mut [w.as_mut_slice()]);
        Some(w)
    }

    #[inline(always)]
    fn closed_hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        Some(self.derived().hessian(At::new(t, &x.q, &x.v, x.z)))
    }

    fn over_slices<V: SlicesVisitor>(&self, visitor: V) -> Option<V::Output> {
        Some(visitor.visit(self.derivatives.clone()))
    }

    fn structure(&self) -> Structure {
        self.derived().structure
    }

    #[inline(always)]
    fn applied_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let mut force: SVector<T, N> = vector!(|_| T::zero());
        match &self.derived().applied {
            None => force,
            Some(tape) => {
                // Not inlined: it would be beside each evaluation of L, also where there is no force.
                tape.evaluate::<T, 0>(At::new(t, &x.q, &x.v, x.z), &mut [force.as_mut_slice()]);
                whole_vector(&force)
            }
        }
    }

    /// Proved from the expressions of the forces. Quadratic drag is recognised if it is written as `-k*x'*abs(x')` for
    /// one coordinate, or as `-k*x'*sqrt(x'^2 + y'^2)` or with `hypot(x', y')` for each of several, with the same k; or
    /// if it follows from a Rayleigh function such as `k/3*(x'^2 + y'^2)^1.5`.
    fn force_structure(&self) -> ForceStructure<N> {
        match &self.derived().proved_force {
            ProvedForce::None => ForceStructure::None,
            ProvedForce::General => ForceStructure::General,
            ProvedForce::Drag { linear, quadratic } => ForceStructure::Drag {
                linear: SVector::from_fn(|i, _| linear.get(i).map_or(0.0, |c| c.value)),
                quadratic: quadratic.value,
            },
        }
    }

    #[inline(always)]
    fn has_force(&self) -> bool {
        self.derived().applied.is_some()
    }

    /// The arguments of `abs` and `sign`, and the differences whose sign decides `min`, `max` and `if`, in L and in the
    /// forces; those that are affine functions of time are [breaks](Lagrangian::breaks) instead. Then those of the
    /// resets.
    fn switching_functions(&self, t: f64, x: &VelocityPoint<N>, values: &mut Vec<f64>) {
        self.derivatives.switching_functions(t, x.q.as_slice(), x.v.as_slice(), x.z, values);
    }

    /// The state after the reset or the impact to which the function belongs, if it has this direction. A new value may
    /// be NaN.
    fn at_switch(&self, index: usize, t: f64, x: &VelocityPoint<N>, rising: bool) -> Control<N> {
        let mut to = *x;
        let state = (to.q.as_mut_slice(), to.v.as_mut_slice(), &mut to.z);
        match self.derivatives.reset(index, rising, t, state) {
            None => Control::Continue,
            Some(None) => Control::Replace(to),
            Some(Some(factor)) => Control::Conformal { to, factor },
        }
    }

    /// The state at which the motion continues where resets accumulate, if the reset states one.
    fn at_accumulation(&self, index: usize, t: f64, x: &VelocityPoint<N>) -> Control<N> {
        let mut to = *x;
        match self.derivatives.rest(index, t, (to.q.as_mut_slice(), to.v.as_mut_slice(), &mut to.z)) {
            true => Control::Replace(to),
            false => Control::Continue,
        }
    }

    /// The zeros of switching functions that are affine functions of time with coefficients from the parameters, as of
    /// `t - 5` in `if(t > 5, 1, 0)`; the samples of tables at such arguments; and the times of
    /// [`Formula::with_breaks`].
    fn breaks(&self) -> &[f64] {
        &self.derived().breaks
    }

    /// Whether L or a force contains `sqrt`, `hypot`, `atan2` or a fractional power whose argument may vanish along a
    /// motion. Of a sum of squares with a positive number it cannot, nor where L becomes infinite.
    fn has_cones(&self) -> bool {
        self.derived().cones
    }
}
