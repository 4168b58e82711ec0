//! A Lagrangian as a sum of local terms.

use crate::blocks;
use crate::elements::{ElementData, Elements};
use crate::kernels::{Kind, PotentialList};
use crate::{AssemblyError, Potential};

/// The most unknowns that a system can have: places are counted in 32 bits, with a fixed one at each end.
const MOST: usize = u32::MAX as usize - 2;

/// A system of any size, `L = sum_i m_i v_i^2/2 - sum_e V_e(t, q_e; c_e) + gamma z`.
///
/// Its dimension is known at run time. Each potential is a [`Potential`] with its list of elements.
///
/// ```
/// use assembled_herglotz::{AssembledSystem, Difference, FIXED, Potential};
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
/// let chain = AssembledSystem::new(1000)?
///     .with_mass(1.0)
///     .with_drag(-0.01)
///     .with_potential(Difference(Bond { beta: 1.0 }), bonds)?;
/// # Ok::<(), assembled_herglotz::AssemblyError>(())
/// ```
pub struct AssembledSystem {
    unknowns: usize,
    pub(crate) masses: Masses,
    gamma: f64,
    pub(crate) potentials: Vec<Box<dyn PotentialList>>,
}

/// The diagonal of the mass matrix.
#[derive(Clone, Debug)]
pub(crate) enum Masses {
    /// One mass for all.
    Same(f64),
    /// One for each unknown.
    Each(Vec<f64>),
}

impl AssembledSystem {
    /// Without masses, drag and elements.
    ///
    /// # Errors
    /// [`AssemblyError::Unknowns`] for none, or more than 2^32 - 3.
    pub fn new(unknowns: usize) -> Result<Self, AssemblyError> {
        if unknowns == 0 || unknowns > MOST {
            return Err(AssemblyError::Unknowns { found: unknowns, most: MOST });
        }
        Ok(AssembledSystem { unknowns, masses: Masses::Same(0.0), gamma: 0.0, potentials: Vec::new() })
    }

    /// With the same mass for all unknowns.
    pub fn with_mass(self, mass: f64) -> Self {
        AssembledSystem { masses: Masses::Same(mass), ..self }
    }

    /// With a mass for each unknown.
    pub fn with_masses(self, masses: Vec<f64>) -> Self {
        AssembledSystem { masses: Masses::Each(masses), ..self }
    }

    /// With the drag `gamma z`: negative for dissipation.
    pub fn with_drag(self, gamma: f64) -> Self {
        AssembledSystem { gamma, ..self }
    }

    /// With a potential for each of a list of elements.
    ///
    /// Elements that follow each other in memory, each with all unknowns one further than the one before, are found and evaluated
    /// without gathering; such runs need no memory for each element. So give the bonds of a lattice row by row, not site by site.
    ///
    /// # Errors
    /// [`AssemblyError::OutOfRange`], [`AssemblyError::Repeated`] and [`AssemblyError::Parameter`], with the element.
    pub fn with_potential<V, const K: usize, const P: usize>(
        mut self,
        term: V,
        elements: impl IntoIterator<Item = impl Into<ElementData<K, P>>>,
    ) -> Result<Self, AssemblyError>
    where
        V: Potential<K, P>,
    {
        let elements = Elements::new(self.potentials.len(), self.unknowns, elements)?;
        self.potentials.push(Box::new(Kind { term, elements }));
        Ok(self)
    }

    /// The number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// The rate `gamma` of the drag.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// The energy `E_L = sum m_i v_i^2/2 + V - gamma z`, which decays as `e^(gamma t)` where V does not depend on time.
    ///
    /// # Errors
    /// [`AssemblyError::Length`] and [`AssemblyError::NonFinite`] of the state.
    pub fn energy(&self, state: State) -> Result<f64, AssemblyError> {
        state.check(self)?;
        let mut q = vec![0.0; self.unknowns + 2];
        q[1..=self.unknowns].copy_from_slice(state.q);
        let kinetic: f64 = state.v.iter().enumerate().map(|(i, v)| 0.5 * self.mass(i) * v * v).sum();
        Ok(kinetic + self.potential(state.t, &q) - self.gamma * state.z)
    }

    /// The potential energy, of positions between fixed places.
    pub(crate) fn potential(&self, t: f64, q: &[f64]) -> f64 {
        let blocks = blocks::count(self.unknowns);
        let mut sum = 0.0;
        for block in 0..blocks {
            for list in &self.potentials {
                sum += list.energy(block, blocks, t, q);
            }
        }
        sum
    }

    /// The mass of an unknown.
    pub(crate) fn mass(&self, i: usize) -> f64 {
        match &self.masses {
            Masses::Same(m) => *m,
            Masses::Each(masses) => masses.get(i).copied().unwrap_or(0.0),
        }
    }

    /// Checks that each unknown has a mass.
    pub(crate) fn check_masses(&self) -> Result<(), AssemblyError> {
        let check = |unknown: usize, mass: f64| {
            if mass > 0.0 && mass.is_finite() { Ok(()) } else { Err(AssemblyError::Mass { unknown, mass }) }
        };
        match &self.masses {
            Masses::Same(mass) => check(0, *mass),
            Masses::Each(masses) => {
                self.check_vector("the masses", masses)?;
                masses.iter().enumerate().try_for_each(|(i, m)| check(i, *m))
            }
        }
    }

    /// Checks the length of a vector, and that it is finite.
    pub(crate) fn check_vector(&self, what: &'static str, x: &[f64]) -> Result<(), AssemblyError> {
        if x.len() != self.unknowns {
            return Err(AssemblyError::Length { what, found: x.len(), expected: self.unknowns });
        }
        match x.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            Some((index, &value)) => Err(AssemblyError::NonFinite { what, index, value }),
            None => Ok(()),
        }
    }

    /// Checks a number.
    pub(crate) fn check_number(what: &'static str, value: f64) -> Result<(), AssemblyError> {
        if value.is_finite() { Ok(()) } else { Err(AssemblyError::NonFinite { what, index: 0, value }) }
    }
}

/// A state of an assembled system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<'a> {
    /// The time.
    pub t: f64,
    /// The positions.
    pub q: &'a [f64],
    /// The velocities.
    pub v: &'a [f64],
    /// The action; that of the start where it is not followed.
    pub z: f64,
}

impl State<'_> {
    /// Checks a start.
    pub(crate) fn check(&self, system: &AssembledSystem) -> Result<(), AssemblyError> {
        system.check_vector("q", self.q)?;
        system.check_vector("v", self.v)?;
        AssembledSystem::check_number("t", self.t)?;
        AssembledSystem::check_number("z", self.z)
    }
}
