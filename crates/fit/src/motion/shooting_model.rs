//! The model of multiple shooting: the motion in pieces, whose starts are unknowns.

use crate::motion::motion_model::MotionModel;
use crate::motion::tangent_rows::state_variables;
use crate::{Model, ModelFailure};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{Parametric, VelocityPoint};
use discrete_herglotz::sensitivity::{TangentRow, Variable};

/// A motion in pieces that start at nodes. The unknowns are those of the motion, then the state `(q, v, z)` at each node;
/// the values are those of the motion, then the matching defects: the end of each piece less the node there.
pub(crate) struct ShootingModel<'a, 'b, L, const N: usize> {
    pub motion: &'a MotionModel<'b, L, N>,
    pub nodes: Vec<f64>,
}

/// The numbers of a state.
pub(crate) const fn state_size<const N: usize>() -> usize {
    2 * N + 1
}

/// The numbers of a state, in the order q, v, z.
pub(crate) fn numbers<const N: usize>(x: &VelocityPoint<N>) -> impl Iterator<Item = f64> {
    x.q.iter().chain(x.v.iter()).chain([&x.z]).copied()
}

/// The state with these numbers.
pub(crate) fn state_of<const N: usize>(numbers: &[f64]) -> VelocityPoint<N> {
    let number = |i: usize| numbers.get(i).copied().unwrap_or(f64::NAN);
    let q = SVector::from_fn(|i, _| number(i));
    VelocityPoint { q, v: SVector::from_fn(|i, _| number(N + i)), z: number(2 * N) }
}

impl<L: Parametric<N>, const N: usize> ShootingModel<'_, '_, L, N> {
    /// The number of unknowns of the motion.
    pub fn unknown_count(&self) -> usize {
        self.motion.unknowns.len()
    }

    /// The place of a node among the unknowns.
    fn place(&self, node: usize) -> usize {
        self.unknown_count() + node * state_size::<N>()
    }

    /// The nodes of the motion from a start; `None` where it cannot be computed.
    pub fn nodes_of_motion(&self, theta: &[f64]) -> Result<Vec<VelocityPoint<N>>, ModelFailure> {
        let start = (self.motion.t0, self.motion.state_at(theta));
        let rows = self.motion.rows(theta, start, &self.nodes, &[])?;
        Ok(rows.iter().map(|row| VelocityPoint { q: row.state.q, v: row.state.v, z: row.state.z }).collect())
    }
}

impl<L: Parametric<N>, const N: usize> Model for ShootingModel<'_, '_, L, N> {
    fn parameter_names(&self) -> Vec<String> {
        let of = |t: &f64| {
            let vectors = ["q", "v"].into_iter().flat_map(|letter| (0..N).map(move |i| format!("{letter}[{i}]")));
            vectors.chain(["z".to_owned()]).map(|name| format!("{name} at t = {t}")).collect::<Vec<_>>()
        };
        self.motion.names.iter().cloned().chain(self.nodes.iter().flat_map(of)).collect()
    }

    fn value_count(&self) -> usize {
        self.motion.values.len() + self.nodes.len() * state_size::<N>()
    }

    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        let (motion, count, size) = (self.motion, self.unknown_count(), state_size::<N>());
        if let Some(jacobian) = &mut jacobian {
            jacobian.fill(0.0);
        }
        let (own, states) = theta.split_at(count);
        let parameters =
            motion.unknowns.iter().enumerate().filter(|(_, v)| matches!(v, Variable::Parameter(_))).collect::<Vec<_>>();
        let mut derivatives = Vec::new();
        for piece in 0..=self.nodes.len() {
            // The variables of the piece, and their places among the unknowns.
            let (t, start, variables, places): (f64, _, Vec<Variable>, Vec<usize>) = match piece.checked_sub(1) {
                None => (motion.t0, motion.state_at(own), motion.unknowns.clone(), (0..count).collect()),
                Some(node) => {
                    let variables = state_variables::<N>().chain(parameters.iter().map(|(_, v)| (*v).clone()));
                    let places = (0..size).map(|i| self.place(node) + i).chain(parameters.iter().map(|(i, _)| *i));
                    let start = state_of(&states[node * size..][..size]);
                    (self.nodes[node], start, variables.collect(), places.collect())
                }
            };
            let end = self.nodes.get(piece).copied();
            let first = motion.times.partition_point(|time| *time < t);
            let first = if piece == 0 { 0 } else { first };
            let last = end.map_or(motion.times.len(), |end| motion.times.partition_point(|time| *time < end));
            let mut times = motion.times[first..last].to_vec();
            times.extend(end);
            let variables: &[Variable] = if jacobian.is_some() { &variables } else { &[] };
            let rows = motion.rows(own, (t, start), &times, variables)?;
            let observed = motion.values.iter().enumerate().filter(|(_, value)| (first..last).contains(&value.time));
            for (i, value) in observed {
                let TangentRow { state, columns } = &rows[value.time - first];
                values[i] = motion.observed[value.quantity].at(state, columns, &mut derivatives);
                if let Some(jacobian) = &mut jacobian {
                    for (place, derivative) in places.iter().zip(&derivatives) {
                        jacobian[(i, *place)] = *derivative;
                    }
                }
            }
            let (Some(_), Some(TangentRow { state, columns })) = (end, rows.last()) else { continue };
            let (row, node) = (motion.values.len() + piece * size, &states[piece * size..][..size]);
            let reached = VelocityPoint { q: state.q, v: state.v, z: state.z };
            for (i, (reached, node)) in numbers(&reached).zip(node).enumerate() {
                values[row + i] = reached - node;
            }
            if let Some(jacobian) = &mut jacobian {
                for i in 0..size {
                    jacobian[(row + i, self.place(piece) + i)] = -1.0;
                }
                for (place, column) in places.iter().zip(columns) {
                    let column = VelocityPoint { q: column.q, v: column.v, z: column.z };
                    for (i, derivative) in numbers(&column).enumerate() {
                        jacobian[(row + i, *place)] = derivative;
                    }
                }
            }
        }
        Ok(())
    }
}
