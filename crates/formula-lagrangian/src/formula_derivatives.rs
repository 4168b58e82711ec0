//! Formulas with their derivatives, for any number of coordinates.

use crate::derived::Derived;
use crate::drag::ProvedForce;
use crate::evaluation::At;
use crate::{Formula, FormulaError};
use contact_geom::nalgebra::{DMatrix, DVector};
use contact_geom::switching::BreakRate;
use contact_geom::{Arguments, Scalar, ScalarSystem, Slopes, Structure};

/// A Lagrangian formula with its derivatives in closed form and its proved structure, evaluated at points that are given
/// by slices, as a [`ScalarSystem`].
/// [`FormulaLagrangian`](crate::FormulaLagrangian) is the same with a number of coordinates that is known at
/// compile time.
///
/// ```
/// use contact_geom::{ScalarSystem, Slopes};
/// use formula_lagrangian::Formula;
/// let chain = Formula::parse("sum(i, 0, n-1, v[i]^2 - q[i]^2)/2 - z/10", &["x[20]"], &[])?;
/// let (chain, mut q, mut v, mut z) = (chain.derivatives()?, [0.0; 20], [0.0; 20], 0.0);
/// let to = Slopes { q: &mut q, v: &mut v, z: &mut z };
/// let value = chain.with_gradient::<f64, 0>(0.0, &[1.0; 20], &[3.0; 20], 0.5, to);
/// assert_eq!((value, q[0], v[0], z), (79.95, -1.0, 3.0, -0.1));
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FormulaDerivatives {
    pub(crate) derived: Derived,
    n: usize,
}

impl Formula {
    /// The formula with its derivatives, for any number of coordinates.
    ///
    /// # Errors
    /// [`FormulaError::TooLarge`], [`FormulaError::IsHamiltonian`].
    pub fn derivatives(&self) -> Result<FormulaDerivatives, FormulaError> {
        self.check_is_lagrangian("Lagrangian of its own", "use `Formula::hamiltonian`")?;
        FormulaDerivatives::within(self, self.dimension())
    }
}

impl FormulaDerivatives {
    /// Over n coordinates, at least as many as the formula has: those beyond its own are those of free particles.
    pub(crate) fn within(formula: &Formula, n: usize) -> Result<Self, FormulaError> {
        Ok(FormulaDerivatives { derived: Derived::new(formula, n)?, n })
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

    /// The proved structure.
    pub fn proved(&self) -> &Structure {
        &self.derived.structure
    }

    /// Whether L has neither kinks nor jumps.
    pub fn is_smooth(&self) -> bool {
        self.derived.smooth
    }

    /// `L_z` if it is proved to be constant.
    pub fn constant_rate(&self) -> Option<f64> {
        self.derived.constant_rate()
    }

    /// The number of resets and impacts.
    pub fn resets(&self) -> usize {
        self.derived.resets.len()
    }

    /// See [`FormulaLagrangian::reset_of`](crate::FormulaLagrangian::reset_of).
    pub fn reset_of(&self, index: usize) -> Option<usize> {
        index.checked_sub(self.derived.kinks.functions.len()).filter(|reset| *reset < self.resets())
    }

    /// Whether the forces are functions of time and positions.
    pub fn force_is_of_positions(&self) -> bool {
        match &self.derived.proved_force {
            ProvedForce::None => true,
            ProvedForce::General => false,
            ProvedForce::Drag { linear, quadratic } => {
                quadratic.value == 0.0 && linear.iter().all(|coefficient| coefficient.value == 0.0)
            }
        }
    }

    /// The coefficients, linear and quadratic, of the [drag](contact_geom::ForceStructure::Drag) of the velocity, if the
    /// forces are functions of time and positions with such a drag.
    pub fn force_drag(&self) -> Option<(Vec<f64>, f64)> {
        let ProvedForce::Drag { linear, quadratic } = &self.derived.proved_force else { return None };
        Some((linear.iter().map(|c| c.value).collect(), quadratic.value))
    }

    /// See [`FormulaLagrangian`](crate::FormulaLagrangian): the functions of kinks, then those of resets.
    pub fn switching_functions(&self, t: f64, q: &[f64], v: &[f64], z: f64, values: &mut Vec<f64>) {
        self.derived.switching_functions(At { t, q, v, z }, values);
    }

    /// Replaces a state `(q, v, z)` by that after the reset or the impact to which a switching function belongs; `None` if
    /// there is none in this direction. A new value may be NaN. Returns the factor by which an impact multiplies the contact
    /// form, if it is contact.
    pub fn reset(
        &self,
        index: usize,
        rising: bool,
        t: f64,
        (q, v, z): (&mut [f64], &mut [f64], &mut f64),
    ) -> Option<Option<f64>> {
        let (n, position) = (q.len(), q.to_vec());
        let at = |v: &[f64], z: f64| {
            let (mut l_q, mut l_v, mut l_z) = (vec![0.0; n], DVector::zeros(n), 0.0);
            let to = Slopes { q: &mut l_q, v: l_v.as_mut_slice(), z: &mut l_z };
            let l = self.with_gradient::<f64, 0>(t, &position, v, z, to);
            let mut w = DMatrix::zeros(n, n);
            self.mass_matrix::<f64, 0>(t, &position, v, z, w.as_mut_slice());
            (l, l_v, w)
        };
        self.derived.resets.get(self.reset_of(index)?)?.replace(at, t, rising, (q, v, z))
    }

    /// The same where resets accumulate.
    pub fn rest(&self, index: usize, t: f64, x: (&mut [f64], &mut [f64], &mut f64)) -> bool {
        let reset = self.reset_of(index).and_then(|i| self.derived.resets.get(i));
        reset.is_some_and(|reset| reset.replace_by_rest(t, x))
    }

    /// The same formula with these values of all parameters; `None` where their number is wrong or one is not finite.
    pub fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        if theta.len() != self.derived.formula.values.len() || !theta.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut other = self.clone();
        other.derived.set_all(theta);
        Some(other)
    }

    /// Whether L or a force contains a norm, or another root, that may vanish along a motion.
    pub fn has_cones(&self) -> bool {
        self.derived.cones
    }

    /// The times of kinks and jumps.
    pub fn breaks(&self) -> &[f64] {
        &self.derived.breaks
    }

    /// The same times with their derivatives in the parameter with this index; a time with several kinks or jumps occurs
    /// once for each of them.
    ///
    /// ```
    /// use formula_lagrangian::Formula;
    /// let pulse = Formula::parse("x'^2/2 + if(2*t < T - 1, x, 0)", &["x"], &[("T", 4.0)])?.derivatives()?;
    /// let found = pulse.break_rates(0);
    /// assert_eq!((found[0].time, found[0].rate), (1.5, 0.5));
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    pub fn break_rates(&self, parameter: usize) -> Vec<BreakRate> {
        self.derived.break_rates(parameter)
    }
}

impl ScalarSystem for FormulaDerivatives {
    #[inline(always)]
    fn dimension(&self) -> usize {
        self.n
    }

    #[inline(always)]
    fn value<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T) -> T {
        let mut value = T::zero();
        self.derived.value.evaluate::<T, N>(At { t, q, v, z }, &mut [std::slice::from_mut(&mut value)]);
        value
    }

    #[inline(always)]
    fn with_gradient<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T, to: Slopes<'_, T>) -> T {
        let mut value = T::zero();
        let results = &mut [to.q, to.v, std::slice::from_mut(to.z), std::slice::from_mut(&mut value)];
        self.derived.with_gradient.evaluate::<T, N>(At { t, q, v, z }, results);
        value
    }

    #[inline(always)]
    fn force<T: Scalar, const N: usize>(&self, t: T, q: &[T], to: &mut [T]) {
        self.derived.force.evaluate::<T, N>(At { t, q, v: &[], z: T::zero() }, &mut [to]);
    }

    #[inline(always)]
    fn mass_matrix<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T, to: &mut [T]) {
        self.derived.mass.evaluate::<T, N>(At { t, q, v, z }, &mut [to]);
    }

    #[inline(always)]
    fn with_second_derivatives<T: Scalar, const N: usize>(
        &self,
        Arguments { t, q, v, z }: Arguments<'_, T>,
        to: Slopes<'_, T>,
        [qq, qv, vv, qz, vz, zz]: [&mut [T]; 6],
    ) -> T {
        let mut value = T::zero();
        let (l_z, l) = (std::slice::from_mut(to.z), std::slice::from_mut(&mut value));
        let results = &mut [to.q, to.v, l_z, l, qq, qv, vv, qz, vz, zz];
        self.derived.with_second.evaluate::<T, N>(At { t, q, v, z }, results);
        value
    }

    fn parameters(&self) -> Option<usize> {
        Some(self.derived.formula.values.len())
    }

    /// Where the base of a power is not positive, its derivative with respect to a parameter in the exponent is taken to
    /// be 0; so are those of jumps.
    #[inline(always)]
    fn explicit<T: Scalar>(&self, of: Option<usize>, at: Arguments<'_, T>, to: Slopes<'_, T>, force: &mut [T]) -> T {
        let Arguments { t, q, v, z } = at;
        let mut value = T::from(f64::NAN);
        let to = &mut [to.q, to.v, std::slice::from_mut(to.z), std::slice::from_mut(&mut value), force];
        if let Some(tape) = self.derived.explicit(of) {
            tape.evaluate::<T, 0>(At { t, q, v, z }, to);
        } else {
            to.iter_mut().for_each(|to| to.fill(T::from(f64::NAN)));
        }
        value
    }

    #[inline(always)]
    fn has_force(&self) -> bool {
        self.derived.applied.is_some()
    }

    #[inline(always)]
    fn applied_force<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T, to: &mut [T]) {
        if let Some(tape) = &self.derived.applied {
            tape.evaluate::<T, N>(At { t, q, v, z }, &mut [to]);
        }
    }
}
