//! The derivatives of a formula for any number of coordinates. This code does not depend on the dimension at compile
//! time, so that it is compiled once, with this crate.

use crate::breaks::Kinks;
use crate::cones::has_cones;
use crate::derived_reset::DerivedReset;
use crate::drag::ProvedForce;
use crate::evaluation::At;
use crate::explicit::ExplicitTapes;
use crate::formula::index;
use crate::limits::MOST_NODES;
use crate::node::Inputs;
use crate::parametric_nodes::ParametricNodes;
use crate::structure::{Partials, is_split, kinks, proved};
use crate::tape::Tape;
use crate::{Formula, FormulaError, Graph, Id};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::switching::BreakRate;
use contact_geom::{HamiltonianStructure, Hessian, Scalar, Structure};

/// The maximum number of nodes of a formula with its gradient. Reverse accumulation adds a few nodes for each node of
/// the formula, so that only formulas close to their own bound exceed it.
const MOST_NODES_WITH_GRADIENT: usize = 10 * MOST_NODES;

/// The maximum number of nodes of a formula with its second derivatives, which bounds the memory and the time for them.
const MOST_NODES_WITH_HESSIAN: usize = 20 * MOST_NODES;

/// A formula with its derivatives as tapes, and its proved properties.
#[derive(Clone, Debug)]
pub(crate) struct Derived {
    pub formula: Formula,
    /// L, with the kinetic energies of free particles for coordinates beyond those of the formula.
    pub root: Id,
    /// Proved for all values of the parameters, except `z_free`, which refers to the present value of a constant rate.
    pub structure: Structure,
    pub smooth: bool,
    /// Whether a norm, or another root, may vanish along a motion.
    pub cones: bool,
    pub cyclic: Vec<bool>,
    /// `L_q`, `L_v` and `L_z`.
    pub partials: Vec<Id>,
    pub value: Tape,
    pub force: Tape,
    /// The value, and `L_q`.
    pub with_force: Tape,
    pub gradient: Tape,
    /// `L_z`.
    pub rate: Tape,
    /// `L_q`, `L_v`, `L_z`, and the value.
    pub with_gradient: Tape,
    /// `W` by columns.
    pub mass: Tape,
    /// `L_q`, `L_v`, `L_z`, the value, and all second derivatives in the order qq, qv, vv, qz, vz, zz.
    pub with_second: Tape,
    /// The functions at whose zeros L or a force has kinks and jumps, and those of resets.
    pub switching: Tape,
    pub kinks: Kinks,
    /// The resets, whose functions are the last ones in `switching`.
    pub resets: Vec<DerivedReset>,
    /// The times of kinks and jumps, in ascending order.
    pub breaks: Vec<f64>,
    /// The force on each coordinate of the formula; `None` if there is none.
    pub applied: Option<Tape>,
    /// The value and the force for any values of the parameters.
    pub parametric_value: ParametricNodes,
    pub parametric_force: ParametricNodes,
    /// The derivatives in parameters and time.
    pub explicit: ExplicitTapes,
    /// The holonomic constraints.
    pub constraints: Tape,
    /// The nodes of these forces.
    pub applied_nodes: Vec<Id>,
    pub proved_force: ProvedForce,
    /// The proved structure of the Lagrangian without the forces.
    pub unforced: Structure,
    /// That of a Hamiltonian; no claims for a Lagrangian.
    pub of_hamiltonian: HamiltonianStructure,
}

impl Derived {
    /// Derives a formula over `n` coordinates, at least as many as it has. The coordinates beyond its own are those of
    /// free particles.
    ///
    /// # Errors
    /// [`FormulaError::TooLarge`].
    pub fn new(formula: &Formula, n: usize) -> Result<Self, FormulaError> {
        let (mut graph, mut root) = (formula.graph.clone(), formula.root);
        let half = graph.number(0.5);
        for i in formula.dimension()..n {
            let v = graph.velocity(i as u32);
            let square = graph.mul(v, v);
            let kinetic = graph.mul(square, half);
            root = graph.add(root, kinetic);
        }
        let too_large = FormulaError::TooLarge { limit: MOST_NODES_WITH_GRADIENT };
        let variables = variables(&mut graph, n);
        let applied_nodes = formula.forces.total(&mut graph, formula.dimension(), MOST_NODES_WITH_GRADIENT);
        let applied_nodes = applied_nodes.ok_or(too_large.clone())?;
        let sources: Vec<Id> = std::iter::once(root).chain(formula.forces.roots()).collect();
        let partials = graph.gradient(root, &variables, MOST_NODES_WITH_GRADIENT).ok_or(too_large.clone())?;
        let tape = |graph: &Graph, nodes: &[Id]| Tape::new(graph, nodes, n).ok_or(too_large.clone());
        let (value, force) = (tape(&graph, &[root])?, tape(&graph, partials.get(..n).unwrap_or(&[]))?);
        let of_kick: Vec<Id> = std::iter::once(root).chain(partials.iter().copied().take(n)).collect();
        let with_force = tape(&graph, &of_kick)?;
        let gradient = tape(&graph, &partials)?;
        let rate = tape(&graph, partials.get(2 * n..).unwrap_or(&[]))?;
        let with_value: Vec<Id> = partials.iter().copied().chain([root]).collect();
        let with_gradient = tape(&graph, &with_value)?;

        let second = second_derivatives(&mut graph, &partials, &variables).ok_or(too_large.clone())?;
        let constants = graph.constants(&formula.values);
        let size = 2 * n + 1;
        let entry = |i: usize, j: usize| second.get(i * size + j).copied().unwrap_or(root);
        let pairs = |a: usize, b: usize| (0..n * n).map(move |k| entry(a + k % n, b + k / n));
        let mass: Vec<Id> = pairs(n, n).collect();
        let in_order = pairs(0, 0).chain(pairs(0, n)).chain(pairs(n, n));
        let in_order = in_order.chain((0..size).map(|i| entry(i, 2 * n)));
        let all: Vec<Id> = with_value.into_iter().chain(in_order).collect();
        let of_motion: Vec<Id> = (0..4 * n * n).map(|k| entry(k / (2 * n), k % (2 * n))).collect();
        let (q, v) = partials.split_at(n);
        let (v, z) = v.split_at(n);
        let z = z.first().copied().unwrap_or(root);
        let partials_of_value = Partials { value: root, q, v, z, second: &of_motion, mass: &mass };
        let structure = proved(&mut graph, &partials_of_value, &constants);
        let of_hamiltonian = match formula.is_hamiltonian() {
            true => HamiltonianStructure {
                separable: is_split(&graph, &partials_of_value),
                degree: graph.degree_in_momenta(root),
                homogeneous: graph.is_homogeneous_in_momenta(root),
                ..HamiltonianStructure::default()
            },
            false => HamiltonianStructure::default(),
        };
        let (mass, with_second) = (Tape::new(&graph, &mass, n), Tape::new(&graph, &all, n));
        let (Some(mass), Some(with_second)) = (mass, with_second) else { return Err(too_large.clone()) };
        let needed = graph.needed(root);
        let mut free = |i: usize| needed.get(graph.position(i as u32).index()) != Some(&true);
        let cyclic = (0..n).map(&mut free).collect();
        let smooth = sources.iter().all(|id| kinks(&graph, *id) == Inputs::NONE);
        let cones = has_cones(&graph, &sources);
        let kinks = Kinks::of(&mut graph, &sources)?;
        let triggers = formula.resets.iter().map(|reset| reset.when);
        let functions: Vec<Id> = kinks.functions.iter().copied().chain(triggers).collect();
        let switching = Tape::new(&graph, &functions, n).ok_or(too_large.clone())?;
        let mut derive = |reset| DerivedReset::new(&mut graph, reset, n, MOST_NODES_WITH_HESSIAN);
        let resets = formula.resets.iter().map(&mut derive).collect::<Option<_>>();
        let resets = resets.ok_or(too_large.clone())?;
        let applied = match applied_nodes.as_slice() {
            [] => None,
            forces => Some(Tape::new(&graph, forces, n).ok_or(too_large.clone())?),
        };
        let parametric_value = ParametricNodes::new(&graph, &[root]);
        let parametric_force = ParametricNodes::new(&graph, &applied_nodes);
        let proved_force = ProvedForce::of(&mut graph, &applied_nodes, n, MOST_NODES_WITH_HESSIAN);
        let constraints = Tape::new(&graph, &formula.constraints, n).ok_or(too_large)?;
        let formula = Formula { graph, ..formula.clone() };
        let explicit = ExplicitTapes::new(formula.values.len());
        let mut derived = Derived {
            formula,
            root,
            structure,
            smooth,
            cones,
            cyclic,
            partials,
            value,
            force,
            with_force,
            gradient,
            rate,
            with_gradient,
            mass,
            with_second,
            switching,
            kinks,
            resets,
            breaks: Vec::new(),
            applied,
            parametric_value,
            parametric_force,
            explicit,
            constraints,
            applied_nodes,
            proved_force,
            unforced: structure,
            of_hamiltonian,
        };
        derived.set_constants();
        Ok(derived)
    }

    /// See [`FormulaLagrangian::set`](crate::FormulaLagrangian::set).
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        let i = index(&self.formula.names, parameter, value)?;
        if let Some(old) = self.formula.values.get_mut(i) {
            *old = value;
        }
        self.set_constants();
        Ok(())
    }

    /// Sets the values of all parameters, of which as many are given as there are.
    pub fn set_all(&mut self, values: &[f64]) {
        self.formula.values.copy_from_slice(values);
        self.set_constants();
    }

    /// The times of kinks and jumps with their derivatives in a parameter; a time with several kinks occurs once for each.
    pub fn break_rates(&self, parameter: usize) -> Vec<BreakRate> {
        let Formula { graph, breaks, values, .. } = &self.formula;
        self.kinks.rates(graph, breaks, values, parameter)
    }

    /// The derivative in z, if it is proved to be constant.
    pub fn constant_rate(&self) -> Option<f64> {
        let Derived { formula, structure, partials, .. } = self;
        let rate = partials.last().filter(|_| structure.constant_rate || structure.z_free)?;
        formula.graph.constants(&formula.values).get(rate.index()).copied()
    }

    /// Appends the values of the switching functions at a point.
    pub fn switching_functions(&self, at: At<'_, f64>, values: &mut Vec<f64>) {
        let (tape, first) = (&self.switching, values.len());
        if !tape.results.is_empty() {
            values.resize(first + tape.results.len(), 0.0);
            let results = values.get_mut(first..).unwrap_or(&mut []);
            tape.evaluate::<f64, 0>(at, &mut [results]);
        }
    }

    /// All second derivatives at a point of N coordinates.
    #[inline(always)]
    pub fn hessian<T: Scalar, const N: usize>(&self, at: At<'_, T>) -> Hessian<N, T> {
        let matrix = SMatrix::<T, N, N>::from_element(at.z);
        let vector = SVector::<T, N>::from_element(at.z);
        let mut h = Hessian { qq: matrix, qv: matrix, vv: matrix, qz: vector, vz: vector, zz: at.z };
        let (mut q, mut v, mut z, mut value) = (vector, vector, at.z, at.z);
        let first =
            [q.as_mut_slice(), v.as_mut_slice(), std::slice::from_mut(&mut z), std::slice::from_mut(&mut value)];
        let [l_q, l_v, l_z, l] = first;
        let (qq, qv, vv) = (h.qq.as_mut_slice(), h.qv.as_mut_slice(), h.vv.as_mut_slice());
        let (qz, vz, zz) = (h.qz.as_mut_slice(), h.vz.as_mut_slice(), std::slice::from_mut(&mut h.zz));
        self.with_second.evaluate::<T, N>(at, &mut [l_q, l_v, l_z, l, qq, qv, vv, qz, vz, zz]);
        h
    }

    fn set_constants(&mut self) {
        let constants = self.formula.graph.constants(&self.formula.values);
        let Derived {
            value,
            force,
            with_force,
            gradient,
            rate,
            with_gradient,
            mass,
            with_second,
            switching,
            constraints,
            ..
        } = &mut *self;
        for tape in [value, force, with_force, gradient, rate, with_gradient, mass, with_second, switching, constraints]
        {
            tape.set_constants(&constants);
        }
        if let Some(applied) = &mut self.applied {
            applied.set_constants(&constants);
        }
        self.explicit.set_constants(&self.formula.values);
        self.resets.iter_mut().for_each(|reset| reset.set_constants(&constants));
        self.proved_force.set_constants(&constants);
        self.breaks = self.kinks.times(&self.formula.graph, &constants, &self.formula.breaks);
        let rate = self.partials.last().filter(|_| self.unforced.constant_rate);
        let rate = rate.and_then(|z| constants.get(z.index()));
        let unforced = Structure { z_free: rate == Some(&0.0), ..self.unforced };
        self.structure = self.proved_force.structure(unforced);
        let Structure { autonomous, z_free, z_affine, constant_rate, .. } = self.structure;
        self.of_hamiltonian =
            HamiltonianStructure { autonomous, z_free, z_affine, constant_rate, ..self.of_hamiltonian };
    }
}

/// The nodes of q, v and z.
pub(crate) fn variables(graph: &mut Graph, n: usize) -> Vec<Id> {
    let mut variables: Vec<Id> = (0..n).map(|i| graph.position(i as u32)).collect();
    variables.extend((0..n).map(|i| graph.velocity(i as u32)));
    variables.push(graph.action());
    variables
}

/// The symmetric matrix of second derivatives, by rows, of which one half is derived; `None` if it is too large.
fn second_derivatives(graph: &mut Graph, partials: &[Id], variables: &[Id]) -> Option<Vec<Id>> {
    let size = variables.len();
    let mut second = vec![*partials.first()?; size * size];
    for (i, partial) in partials.iter().enumerate() {
        let row = graph.gradient(*partial, variables.get(i..)?, MOST_NODES_WITH_HESSIAN)?;
        for (j, entry) in row.into_iter().enumerate() {
            *second.get_mut(i * size + i + j)? = entry;
            *second.get_mut((i + j) * size + i)? = entry;
        }
    }
    Some(second)
}
