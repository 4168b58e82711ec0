//! A system whose Lagrangian is a sum of local terms.

use crate::blocks::{BLOCK_SIZE, MIN_PARALLEL_UNKNOWNS, block_count};
use crate::constraints::{ConstraintElements, ConstraintList};
use crate::derivatives::{EvaluationPoint, FirstDerivatives};
use crate::drag::Drag;
use crate::elements::{ElementData, Elements};
use crate::energies::{Energies, EnergyKind, sum_of_squares};
use crate::kick::KickFactor;
use crate::local_term_list::{LocalTermElements, LocalTermList};
use crate::potential_list::{PotentialElements, PotentialList};
use crate::{LocalConstraint, LocalLagrangian, Potential, SparseError};
use rayon::prelude::{IntoParallelIterator, ParallelIterator};

/// The maximum number of unknowns: padded indices have 32 bits, and there is one fixed component at each end.
const MAX_UNKNOWNS: usize = u32::MAX as usize - 2;

/// A system of any size,
/// `L = sum_i m_i v_i^2/2 - sum_e V_e(t, q_e; c_e) + gamma(t) z + sum_e l_e(t, q_e, v_e, z; c_e)`.
///
/// Its dimension is known at run time. Each potential is a [`Potential`] with its list of elements, each general term a
/// [`LocalLagrangian`] with its own list. A system without general terms can be integrated by all integrators, one with
/// general terms by [`SparseGauss`](crate::SparseGauss). The motion may be restricted by constraints `c_e(q_e) = 0` of
/// elements, each a [`LocalConstraint`] with its list; such systems are integrated by
/// [`SparseRattle`](crate::SparseRattle).
///
/// ```
/// use sparse_herglotz::{SparseSystem, Difference, FIXED, Potential};
/// use contact_geom::{Scalar, nalgebra::SVector};
/// struct Bond { beta: f64 }
/// impl Potential<1> for Bond {
///     #[inline(always)]
///     fn energy<T: Scalar>(&self, _t: T, r: &SVector<T, 1>, _c: &[T; 0]) -> T {
///         let square = r[0] * r[0];
///         square * (square * (self.beta * 0.25) + 0.5)
///     }
/// }
/// // A chain of 1000 between two walls.
/// let bonds = (0..=1000).map(|i| [if i == 0 { FIXED } else { i - 1 }, if i == 1000 { FIXED } else { i }]);
/// let chain = SparseSystem::new(1000)?
///     .with_mass(1.0)
///     .with_drag(-0.01)
///     .with_potential(Difference(Bond { beta: 1.0 }), bonds)?;
/// # Ok::<(), sparse_herglotz::SparseError>(())
/// ```
pub struct SparseSystem {
    unknowns: usize,
    pub(crate) masses: Masses,
    pub(crate) drag: Drag,
    /// The coefficients of the friction of the unknowns.
    pub(crate) friction: Option<Vec<f64>>,
    pub(crate) potentials: Vec<Box<dyn PotentialList>>,
    pub(crate) general_terms: Vec<Box<dyn LocalTermList>>,
    pub(crate) constraints: Vec<Box<dyn ConstraintList>>,
}

/// Where the masses of a system come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MassSource {
    /// From the diagonal mass matrix alone.
    Diagonal,
    /// General terms may contribute to the mass of an unknown, which may be 0 in the diagonal matrix.
    WithGeneralTerms,
}

/// Whether the value of L is needed besides its first derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LagrangianValue {
    /// It is needed.
    Needed,
    /// It is not needed; it is computed only if that costs nothing.
    NotNeeded,
}

/// The diagonal of the mass matrix.
#[derive(Clone, Debug)]
pub(crate) enum Masses {
    /// The same mass for all unknowns.
    Same(f64),
    /// One mass for each unknown.
    Each(Vec<f64>),
}

impl SparseSystem {
    /// A system without masses, drag and elements.
    ///
    /// # Errors
    /// [`SparseError::Unknowns`] if `unknowns` is 0 or exceeds 2^32 - 3.
    pub fn new(unknowns: usize) -> Result<Self, SparseError> {
        if unknowns == 0 || unknowns > MAX_UNKNOWNS {
            return Err(SparseError::Unknowns { found: unknowns, most: MAX_UNKNOWNS });
        }
        Ok(SparseSystem {
            unknowns,
            masses: Masses::Same(0.0),
            drag: Drag::Constant(0.0),
            friction: None,
            potentials: Vec::new(),
            general_terms: Vec::new(),
            constraints: Vec::new(),
        })
    }

    /// Sets the same mass for all unknowns.
    pub fn with_mass(self, mass: f64) -> Self {
        SparseSystem { masses: Masses::Same(mass), ..self }
    }

    /// Sets a mass for each unknown.
    pub fn with_masses(self, masses: Vec<f64>) -> Self {
        SparseSystem { masses: Masses::Each(masses), ..self }
    }

    /// Sets the drag `gamma z`, with gamma negative for dissipation.
    pub fn with_drag(self, gamma: f64) -> Self {
        SparseSystem { drag: Drag::Constant(gamma), ..self }
    }

    /// Sets a drag `gamma(t) z` with a time-dependent rate, instead of [`with_drag`](Self::with_drag). The rate must be
    /// a smooth function, since splittings integrate it along a drift by a Gauss formula of order 12; it need not be
    /// periodic.
    ///
    /// ```
    /// use sparse_herglotz::systems::OuterSolarSystem;
    /// let year = 365.25;
    /// let solar = OuterSolarSystem::system(5, 0.0)?
    ///     .with_timed_drag(move |t| -1e-8 * (1.0 + 0.5 * (std::f64::consts::TAU * t / year).cos()));
    /// assert!((solar.rate(0.0) + 1.5e-8).abs() < 1e-20);
    /// # Ok::<(), sparse_herglotz::SparseError>(())
    /// ```
    pub fn with_timed_drag(self, rate: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        SparseSystem { drag: Drag::Timed(Box::new(rate)), ..self }
    }

    /// Sets the friction of each unknown, an applied force `-c_i v_i`: `m_i v_i' = -V_q + gamma m_i v_i - c_i v_i`. Unlike
    /// a drag `gamma z` it differs from unknown to unknown and does not enter `z' = L`; the motion is not contact, and its
    /// defect is the virtual work of the friction. Only [`SparseSplitting`](crate::SparseSplitting) takes it, by an exact
    /// flow, and does not monitor the energy of such motions.
    pub fn with_friction(self, coefficients: Vec<f64>) -> Self {
        SparseSystem { friction: Some(coefficients), ..self }
    }

    /// Adds a potential for each element of a list.
    ///
    /// Consecutive elements, each with all unknowns one higher than those of the element before, are detected and
    /// evaluated without gathering; such runs store no indices for each element. Therefore list the bonds of a lattice
    /// row by row, not site by site.
    ///
    /// # Errors
    /// [`SparseError::OutOfRange`], [`SparseError::Repeated`] and [`SparseError::Parameter`], with the index of
    /// the element.
    pub fn with_potential<V, const K: usize, const P: usize>(
        mut self,
        term: V,
        elements: impl IntoIterator<Item = impl Into<ElementData<K, P>>>,
    ) -> Result<Self, SparseError>
    where
        V: Potential<K, P>,
    {
        let elements = Elements::new(self.lists(), self.unknowns, elements)?;
        self.potentials.push(Box::new(PotentialElements::new(term, elements, self.unknowns)));
        Ok(self)
    }

    /// Adds a general term for each element of a list.
    ///
    /// # Errors
    /// Those of [`with_potential`](Self::with_potential).
    pub fn with_term<V, const K: usize, const P: usize>(
        mut self,
        term: V,
        elements: impl IntoIterator<Item = impl Into<ElementData<K, P>>>,
    ) -> Result<Self, SparseError>
    where
        V: LocalLagrangian<K, P>,
    {
        let elements = Elements::new(self.lists(), self.unknowns, elements)?;
        self.general_terms.push(Box::new(LocalTermElements::new(term, elements)));
        Ok(self)
    }

    /// Adds a constraint `c(q; c_e) = 0` for each element of a list. Only [`SparseRattle`](crate::SparseRattle) takes
    /// systems with constraints.
    ///
    /// ```
    /// use sparse_herglotz::{Distance, FIXED, SparseSystem};
    /// // A planar double pendulum: two rods of length 1, the first of them from the origin.
    /// let rods = [([FIXED, FIXED, 0, 1], [1.0]), ([0, 1, 2, 3], [1.0])];
    /// let pendulum = SparseSystem::new(4)?.with_mass(1.0).with_constraint(Distance, rods)?;
    /// # Ok::<(), sparse_herglotz::SparseError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`with_potential`](Self::with_potential).
    pub fn with_constraint<C, const K: usize, const P: usize>(
        mut self,
        constraint: C,
        elements: impl IntoIterator<Item = impl Into<ElementData<K, P>>>,
    ) -> Result<Self, SparseError>
    where
        C: LocalConstraint<K, P>,
    {
        let list = ConstraintElements::new(constraint, self.lists(), self.unknowns, elements)?;
        self.constraints.push(Box::new(list));
        Ok(self)
    }

    /// The number of lists of elements so far.
    fn lists(&self) -> usize {
        self.potentials.len() + self.general_terms.len() + self.constraints.len()
    }

    /// The number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// The rate `gamma(t)` of the drag.
    pub fn rate(&self, t: f64) -> f64 {
        self.drag.rate(t)
    }

    /// The energy `E_L = v.L_v - L`. Without general terms it is `sum m_i v_i^2/2 + V - gamma z`, which for a constant
    /// gamma varies as `e^(gamma t)` if V does not depend on time.
    ///
    /// # Errors
    /// [`SparseError::Length`] and [`SparseError::NonFinite`] of the state; [`SparseError::NoAction`] if L
    /// depends on the action and the state does not have it.
    pub fn energy(&self, state: State) -> Result<f64, SparseError> {
        state.check(self)?;
        let z = self.action(state)?;
        let padded = |x: &[f64]| [&[0.0], x, &[0.0]].concat();
        let (q, v) = (padded(state.q), padded(state.v));
        let mut first = FirstDerivatives::zeros(self.unknowns);
        let at = EvaluationPoint { t: state.t, q: &q, v: &v, z };
        self.first_derivatives(at, LagrangianValue::Needed, &mut first);
        let twice_kinetic: f64 = first.v.iter().zip(state.v).map(|(p, v)| p * v).sum();
        Ok(twice_kinetic - first.l)
    }

    /// Evaluates L and its first derivatives; without general terms the value of L only if it is requested.
    pub(crate) fn first_derivatives(&self, at: EvaluationPoint, value: LagrangianValue, sums: &mut FirstDerivatives) {
        let FirstDerivatives { l, q, v, z } = sums;
        (*l, *z) = (0.0, self.rate(at.t));
        for (block, force) in q.chunks_mut(BLOCK_SIZE).enumerate() {
            force.fill(0.0);
            for list in &self.potentials {
                list.kick(block, at.t, at.q, KickFactor::Uniform(1.0), force, None);
            }
        }
        let velocities = at.v.iter().skip(1);
        for (i, (p, v)) in v.iter_mut().zip(velocities).enumerate() {
            *p = self.mass(i) * v;
        }
        if value == LagrangianValue::Needed || !self.general_terms.is_empty() {
            let velocities = at.v.iter().skip(1);
            let twice_kinetic: f64 = v.iter().zip(velocities).map(|(p, v)| p * v).sum();
            *l = 0.5 * twice_kinetic - self.potential(at.t, at.q) + *z * at.z;
        }
        for list in &self.general_terms {
            list.add_first(at, sums);
        }
    }

    /// The potential energy at padded positions.
    pub(crate) fn potential(&self, t: f64, q: &[f64]) -> f64 {
        (0..block_count(self.unknowns)).map(|block| self.block_potential(block, t, q)).sum()
    }

    /// The potential energy of the elements that are assigned to a block.
    fn block_potential(&self, block: usize, t: f64, q: &[f64]) -> f64 {
        let blocks = block_count(self.unknowns);
        self.potentials.iter().map(|list| list.energy(block, blocks, t, q)).sum()
    }

    /// The energies of a system without general terms at padded positions. For large systems the sum is distributed
    /// over threads as steps are, so that its last bits depend on their number.
    pub(crate) fn energies(&self, (t, q, v, z): (f64, &[f64], &[f64], f64), kind: EnergyKind) -> Energies {
        let kinetic = 0.5
            * match &self.masses {
                Masses::Same(m) => m * sum_of_squares(v),
                Masses::Each(masses) => masses.iter().zip(v).map(|(m, v)| m * v * v).sum(),
            };
        let potential = if self.unknowns < MIN_PARALLEL_UNKNOWNS || rayon::current_num_threads() == 1 {
            self.potential(t, q)
        } else {
            (0..block_count(self.unknowns)).into_par_iter().map(|block| self.block_potential(block, t, q)).sum()
        };
        let of_drag = match kind {
            EnergyKind::Lagrangian => -self.rate(t) * z,
            EnergyKind::Mechanical => 0.0,
        };
        let (total, terms) = (kinetic + potential + of_drag, potential.abs() + of_drag.abs());
        Energies { total, kinetic, terms }
    }

    /// The mass of an unknown.
    pub(crate) fn mass(&self, i: usize) -> f64 {
        match &self.masses {
            Masses::Same(m) => *m,
            Masses::Each(masses) => masses.get(i).copied().unwrap_or(0.0),
        }
    }

    /// The action of a state; 0 if the state has none and L does not depend on it.
    pub(crate) fn action(&self, state: State) -> Result<f64, SparseError> {
        let independent = self.general_terms.is_empty() && self.rate(state.t) == 0.0;
        state.z.or(independent.then_some(0.0)).ok_or(SparseError::NoAction)
    }

    /// Checks that there are no general terms.
    pub(crate) fn check_separable(&self) -> Result<(), SparseError> {
        if self.general_terms.is_empty() { Ok(()) } else { Err(SparseError::NotSeparable) }
    }

    /// Checks that there is no friction, for a method that takes none.
    pub(crate) fn check_frictionless(&self, method: &'static str) -> Result<(), SparseError> {
        if self.friction.is_none() { Ok(()) } else { Err(SparseError::Friction { method }) }
    }

    /// Checks that there are no constraints, for a method that takes none.
    pub(crate) fn check_unconstrained(&self, method: &'static str) -> Result<(), SparseError> {
        if self.constraints.is_empty() { Ok(()) } else { Err(SparseError::Constrained { method }) }
    }

    /// Checks that each unknown has a mass; 0 is accepted if general terms may contribute the mass.
    pub(crate) fn check_masses(&self, source: MassSource) -> Result<(), SparseError> {
        let accepted = |mass: f64| mass > 0.0 || source == MassSource::WithGeneralTerms && mass == 0.0;
        let check = |unknown: usize, mass: f64| {
            if accepted(mass) && mass.is_finite() { Ok(()) } else { Err(SparseError::Mass { unknown, mass }) }
        };
        match &self.masses {
            Masses::Same(mass) => check(0, *mass),
            Masses::Each(masses) => {
                self.check_vector("the masses", masses)?;
                masses.iter().enumerate().try_for_each(|(i, m)| check(i, *m))
            }
        }
    }

    /// Checks the length of a vector, and that its components are finite.
    pub(crate) fn check_vector(&self, what: &'static str, x: &[f64]) -> Result<(), SparseError> {
        if x.len() != self.unknowns {
            return Err(SparseError::Length { what, found: x.len(), expected: self.unknowns });
        }
        match x.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            Some((index, &value)) => Err(SparseError::NonFinite { what, index, value }),
            None => Ok(()),
        }
    }

    /// Checks that a number is finite.
    pub(crate) fn check_number(what: &'static str, value: f64) -> Result<(), SparseError> {
        if value.is_finite() { Ok(()) } else { Err(SparseError::NonFinite { what, index: 0, value }) }
    }
}

/// A state of a sparse system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<'a> {
    /// The time.
    pub t: f64,
    /// The positions.
    pub q: &'a [f64],
    /// The velocities.
    pub v: &'a [f64],
    /// The action. If the start has none, the action of the motion is not computed, which saves the energies at each
    /// stage; the states of such a motion have no action either.
    pub z: Option<f64>,
}

impl State<'_> {
    /// Checks an initial state.
    pub(crate) fn check(&self, system: &SparseSystem) -> Result<(), SparseError> {
        system.check_vector("q", self.q)?;
        system.check_vector("v", self.v)?;
        SparseSystem::check_number("t", self.t)?;
        self.z.map_or(Ok(()), |z| SparseSystem::check_number("z", z))
    }
}
