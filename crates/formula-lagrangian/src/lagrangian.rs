//! Formulas as Lagrangians.

use crate::evaluation::At;
use crate::formula::index;
use crate::parser::MOST_NODES;
use crate::structure::{Partials, kinks, proved};
use crate::tape::Tape;
use crate::{Formula, FormulaError, Graph, Id};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Hessian, Lagrangian, Scalar, Structure, Symmetry, Triple, VelocityPoint};

/// The most nodes that a formula has with its gradient, and with its second derivatives.
const WITH_GRADIENT: usize = 10 * MOST_NODES;
const WITH_HESSIAN: usize = 20 * MOST_NODES;

/// A [`Formula`] over `N` coordinates as a [`Lagrangian`], with its gradient and its second derivatives in closed form and with its
/// structure proved. All formulas of one dimension are one type: integrators are compiled for it once.
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
    formula: Formula,
    /// Proved for all values of the parameters, but for `z_free`, which is so for a rate of zero.
    structure: Structure,
    smooth: bool,
    cyclic: [bool; N],
    /// `L_q`, `L_v` and `L_z`.
    pub(crate) partials: Vec<Id>,
    value: Tape,
    force: Tape,
    /// The value, and `L_q`.
    with_force: Tape,
    gradient: Tape,
    /// `L_q`, `L_v`, `L_z`, and the value.
    with_gradient: Tape,
    /// `W` by columns.
    mass: Tape,
    /// All second derivatives in the order qq, qv, vv, qz, vz, zz.
    second: Tape,
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
        if formula.dimension() > N {
            return Err(FormulaError::OtherDimension { found: formula.dimension(), asked: N });
        }
        let (mut graph, mut root) = (formula.graph.clone(), formula.root);
        let half = graph.number(0.5);
        for i in formula.dimension()..N {
            let v = graph.velocity(i as u32);
            let square = graph.mul(v, v);
            let kinetic = graph.mul(square, half);
            root = graph.add(root, kinetic);
        }
        let too_large = FormulaError::TooLarge { limit: WITH_GRADIENT };
        let variables = variables::<N>(&mut graph);
        let partials = graph.gradient(root, &variables, WITH_GRADIENT).ok_or(too_large.clone())?;
        let tape = |graph: &Graph, nodes: &[Id]| Tape::new(graph, nodes, N).ok_or(too_large.clone());
        let (value, force) = (tape(&graph, &[root])?, tape(&graph, partials.get(..N).unwrap_or(&[]))?);
        let of_kick: Vec<Id> = std::iter::once(root).chain(partials.iter().copied().take(N)).collect();
        let with_force = tape(&graph, &of_kick)?;
        let gradient = tape(&graph, &partials)?;
        let all: Vec<Id> = partials.iter().copied().chain([root]).collect();
        let with_gradient = tape(&graph, &all)?;

        let second = second_derivatives(&mut graph, &partials, &variables).ok_or(too_large.clone())?;
        let constants = graph.constants(&formula.values);
        let size = 2 * N + 1;
        let entry = |i: usize, j: usize| second.get(i * size + j).copied().unwrap_or(root);
        let pairs = |a: usize, b: usize| (0..N * N).map(move |k| entry(a + k % N, b + k / N));
        let mass: Vec<Id> = pairs(N, N).collect();
        let in_order = pairs(0, 0).chain(pairs(0, N)).chain(pairs(N, N));
        let all: Vec<Id> = in_order.chain((0..size).map(|i| entry(i, 2 * N))).collect();
        let of_motion: Vec<Id> = (0..4 * N * N).map(|k| entry(k / (2 * N), k % (2 * N))).collect();
        let (q, v) = partials.split_at(N);
        let (v, z) = v.split_at(N);
        let z = z.first().copied().unwrap_or(root);
        let structure = {
            let partials = Partials { value: root, q, v, z, second: &of_motion, mass: &mass };
            proved(&mut graph, &partials, &constants)
        };
        let (mass, second) = (Tape::new(&graph, &mass, N), Tape::new(&graph, &all, N));
        let (Some(mass), Some(second)) = (mass, second) else { return Err(too_large) };
        let needed = graph.needed(root);
        let cyclic = std::array::from_fn(|i| {
            let position = graph.position(i as u32);
            !needed.get(position.index()).copied().unwrap_or(false)
        });
        let smooth = kinks(&graph, root) == crate::node::Inputs::NONE;
        let formula = Formula { graph, ..formula.clone() };
        let mut lagrangian = FormulaLagrangian {
            formula,
            structure,
            smooth,
            cyclic,
            partials,
            value,
            force,
            with_force,
            gradient,
            with_gradient,
            mass,
            second,
        };
        lagrangian.set_constants();
        Ok(lagrangian)
    }

    /// The formula, with the present values of its parameters.
    pub fn formula(&self) -> &Formula {
        &self.formula
    }

    /// Gives a parameter another value. Nothing is read or derived anew.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`], [`FormulaError::ParameterValue`].
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        let i = index(&self.formula.names, parameter, value)?;
        if let Some(old) = self.formula.values.get_mut(i) {
            *old = value;
        }
        self.set_constants();
        Ok(())
    }

    fn set_constants(&mut self) {
        let constants = self.formula.graph.constants(&self.formula.values);
        let FormulaLagrangian { value, force, with_force, gradient, with_gradient, mass, second, .. } = &mut *self;
        for tape in [value, force, with_force, gradient, with_gradient, mass, second] {
            tape.set_constants(&constants);
        }
        let rate = self.partials.last().filter(|_| self.structure.constant_rate);
        let rate = rate.and_then(|z| constants.get(z.index()));
        self.structure.z_free = rate == Some(&0.0);
    }

    /// What is proved of the structure of L; the same as [`structure`](Lagrangian::structure).
    pub fn proved(&self) -> &Structure {
        &self.structure
    }

    /// Whether L has neither kinks nor jumps: no function of `abs`, `sign`, `min`, `max`, `if`, `atan2`, `hypot`. Integrators reach their
    /// order where a motion does not meet one.
    pub fn is_smooth(&self) -> bool {
        self.smooth
    }

    /// The symmetries that are seen, whose momenta decay as the conformal factor: moving along a coordinate on which L does not depend,
    /// and turning two coordinates where L has them in squares of lengths, products and areas alone, as `x^2 + y^2`.
    pub fn symmetries(&self) -> Vec<Symmetry<N>> {
        let along = |i: usize| Symmetry::Translation(SVector::from_fn(|j, _| if i == j { 1.0 } else { 0.0 }));
        let n = self.formula.dimension();
        let moving = (0..n).filter(|i| self.cyclic.get(*i) == Some(&true)).map(along);
        let Formula { graph, root, .. } = &self.formula;
        let turns = |(i, j): &(usize, usize)| graph.turns_into_itself(*root, *i as u32, *j as u32);
        let pairs = (0..n).flat_map(|j| (0..j).map(move |i| (i, j)));
        moving.chain(pairs.filter(turns).map(|(i, j)| Symmetry::Rotation(i, j))).collect()
    }
}

/// The nodes of q, v and z.
fn variables<const N: usize>(graph: &mut Graph) -> Vec<Id> {
    let mut variables: Vec<Id> = (0..N).map(|i| graph.position(i as u32)).collect();
    variables.extend((0..N).map(|i| graph.velocity(i as u32)));
    variables.push(graph.action());
    variables
}

/// The matrix of second derivatives, by rows; the half of it is derived. `None` where it is too large.
fn second_derivatives(graph: &mut Graph, partials: &[Id], variables: &[Id]) -> Option<Vec<Id>> {
    let size = variables.len();
    let mut second = vec![*partials.first()?; size * size];
    for (i, partial) in partials.iter().enumerate() {
        let row = graph.gradient(*partial, variables.get(i..)?, WITH_HESSIAN)?;
        for (j, entry) in row.into_iter().enumerate() {
            *second.get_mut(i * size + i + j)? = entry;
            *second.get_mut((i + j) * size + i)? = entry;
        }
    }
    Some(second)
}

impl<const N: usize> Lagrangian<N> for FormulaLagrangian<N> {
    const PROVED: bool = true;
    const INTERPRETED: bool = true;

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let mut value = T::zero();
        self.value.evaluate(At::new(t, q, v, z), &mut [std::slice::from_mut(&mut value)]);
        value
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<Triple<N, T>> {
        let mut g = Triple::from(*x);
        let results = &mut [g.x.as_mut_slice(), g.y.as_mut_slice(), std::slice::from_mut(&mut g.z)];
        self.gradient.evaluate(At::new(t, &x.q, &x.v, x.z), results);
        Some(g)
    }

    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, Triple<N, T>)> {
        let (mut g, mut value) = (Triple::from(*x), x.z);
        let (z, value_slice) = (std::slice::from_mut(&mut g.z), std::slice::from_mut(&mut value));
        let results = &mut [g.x.as_mut_slice(), g.y.as_mut_slice(), z, value_slice];
        self.with_gradient.evaluate(At::new(t, &x.q, &x.v, x.z), results);
        Some((value, g))
    }

    #[inline(always)]
    fn closed_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SVector<T, N>> {
        let mut force = x.q;
        self.force.evaluate(At::new(t, &x.q, &x.v, x.z), &mut [force.as_mut_slice()]);
        Some(force)
    }

    #[inline(always)]
    fn closed_with_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, SVector<T, N>)> {
        let (mut value, mut force) = (x.z, x.q);
        let results = &mut [std::slice::from_mut(&mut value), force.as_mut_slice()];
        self.with_force.evaluate(At::new(t, &x.q, &x.v, x.z), results);
        Some((value, force))
    }

    #[inline(always)]
    fn closed_mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SMatrix<T, N, N>> {
        let mut w: SMatrix<T, N, N> = SMatrix::from_element(x.z);
        self.mass.evaluate(At::new(t, &x.q, &x.v, x.z), &mut [w.as_mut_slice()]);
        Some(w)
    }

    #[inline(always)]
    fn closed_hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        let matrix = SMatrix::from_element(x.z);
        let mut h = Hessian { qq: matrix, qv: matrix, vv: matrix, qz: x.q, vz: x.v, zz: x.z };
        let [qq, qv, vv] = [&mut h.qq, &mut h.qv, &mut h.vv].map(|m| m.as_mut_slice());
        let results = &mut [qq, qv, vv, h.qz.as_mut_slice(), h.vz.as_mut_slice(), std::slice::from_mut(&mut h.zz)];
        self.second.evaluate(At::new(t, &x.q, &x.v, x.z), results);
        Some(h)
    }

    fn structure(&self) -> Structure {
        self.structure
    }
}
