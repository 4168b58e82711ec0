//! Formulas with their derivatives, for any number of coordinates.

use crate::derived::Derived;
use crate::drag::ProvedForce;
use crate::evaluation::At;
use crate::{Formula, FormulaError};
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::{Dual, Scalar, ScalarSystem, Slopes, Structure};

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

    /// Whether the forces are functions of time and positions with a [drag](contact_geom::ForceStructure::Drag).
    pub fn force_is_drag(&self) -> bool {
        matches!(self.derived.proved_force, ProvedForce::Drag { .. })
    }

    /// The derivative of the applied force along a direction `(dq, dv, dz)`, which is written, with that of each component.
    pub fn force_along(&self, t: f64, x: (&[f64], &[f64], f64), along: (&[f64], &[f64], f64), to: &mut [f64]) {
        type Along = Dual<f64, SVector<f64, 1>>;
        let moving = |re: f64, d: f64| Along { re, d: SVector::<f64, 1>::from_element(d) };
        let all = |x: &[f64], d: &[f64]| -> Vec<Along> { x.iter().zip(d).map(|(x, d)| moving(*x, *d)).collect() };
        let (q, v) = (all(x.0, along.0), all(x.1, along.1));
        let mut force = vec![Along::from(0.0); to.len()];
        self.applied_force::<Along, 0>(Along::from(t), &q, &v, moving(x.2, along.2), &mut force);
        to.iter_mut().zip(force).for_each(|(to, f)| *to = f.d[0]);
    }

    /// See [`FormulaLagrangian`](crate::FormulaLagrangian): the functions of kinks, then those of resets.
    pub fn switching_functions(&self, t: f64, q: &[f64], v: &[f64], z: f64, values: &mut Vec<f64>) {
        let (tape, first) = (&self.derived.switching, values.len());
        if !tape.results.is_empty() {
            values.resize(first + tape.results.len(), 0.0);
            let results = values.get_mut(first..).unwrap_or(&mut []);
            tape.evaluate::<f64, 0>(At { t, q, v, z }, &mut [results]);
        }
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

    /// The names and the values of the parameters.
    pub fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        self.derived.formula.parameters()
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

    /// The derivative of L with respect to a parameter, or to the time if none is given, which is returned, with those of
    /// its gradient `L_q`, `L_v`, `L_z` and that of the force, which are written.
    pub fn explicit(
        &self,
        parameter: Option<usize>,
        t: f64,
        (q, v, z): (&[f64], &[f64], f64),
        [of_q, of_v, of_z, of_force]: [&mut [f64]; 4],
    ) -> f64 {
        type Along = Dual<f64, SVector<f64, 1>>;
        type AlongTwo = Dual<Along, SVector<Along, 1>>;
        let one = |is: bool| SVector::<f64, 1>::from_element(f64::from(u8::from(is)));
        let explicit = |re: f64, is: bool| {
            let d = SVector::<Along, 1>::from_element(Along::from(f64::from(u8::from(is))));
            AlongTwo { re: Along::from(re), d }
        };
        let theta: Vec<AlongTwo> =
            self.parameters().enumerate().map(|(k, (_, x))| explicit(x, parameter == Some(k))).collect();
        let time = explicit(t, parameter.is_none());
        let mut value = AlongTwo::from(0.0);
        let mut of_l = 0.0;
        let mut along = |kind: usize, i: usize| {
            let at = |x: &[f64], is: bool| -> Vec<AlongTwo> {
                x.iter().enumerate().map(|(j, x)| AlongTwo::constant(Dual { re: *x, d: one(is && i == j) })).collect()
            };
            let (q, v) = (at(q, kind == 0), at(v, kind == 1));
            let z = AlongTwo::constant(Dual { re: z, d: one(kind == 2) });
            let at = At { q: &q, v: &v, z, t: time };
            self.derived.parametric_value.evaluate(&theta, at, std::slice::from_mut(&mut value));
            let Dual { re, d } = value.d[0];
            of_l = re;
            d[0]
        };
        of_q.iter_mut().enumerate().for_each(|(i, to)| *to = along(0, i));
        of_v.iter_mut().enumerate().for_each(|(i, to)| *to = along(1, i));
        of_z.iter_mut().for_each(|to| *to = along(2, 0));
        of_force.fill(0.0);
        let forces = self.derived.parametric_force.len();
        if forces > 0 {
            let simple = |re: f64, is: bool| Along { re, d: one(is) };
            let theta: Vec<Along> =
                self.parameters().enumerate().map(|(k, (_, x))| simple(x, parameter == Some(k))).collect();
            let still = |x: &[f64]| -> Vec<Along> { x.iter().map(|x| Along::from(*x)).collect() };
            let (q, v) = (still(q), still(v));
            let at = At { q: &q, v: &v, z: Along::from(z), t: simple(t, parameter.is_none()) };
            let mut force = vec![Along::from(0.0); forces];
            self.derived.parametric_force.evaluate(&theta, at, &mut force);
            of_force.iter_mut().zip(force).for_each(|(to, f)| *to = f.d[0]);
        }
        of_l
    }

    /// The times of kinks and jumps.
    pub fn breaks(&self) -> &[f64] {
        &self.derived.breaks
    }

    /// Writes the second partial derivatives `L_qq`, `L_qv`, `L_vv`, `L_qz`, `L_vz`, `L_zz`, in this order: matrices of
    /// n × n entries by columns (in `L_qv` the rows belong to q), vectors of n entries, and one number.
    pub fn second_partials(&self, t: f64, q: &[f64], v: &[f64], z: f64, mut to: [&mut [f64]; 6]) {
        self.derived.second.evaluate::<f64, 0>(At { t, q, v, z }, &mut to);
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
