//! The model of multiple shooting: the motion in pieces, whose starts are unknowns.

use crate::motion::piecewise::{Observation, Piece, PiecewiseModel};
use crate::{Model, ModelFailure};
use nalgebra::DMatrix;

/// A motion in pieces that start at nodes. The unknowns are those of the motion, then the state at each node; the values
/// are those of the motion, then the matching defects: the end of each piece less the node there.
pub(crate) struct ShootingModel<'a, M> {
    pub motion: &'a M,
    pub nodes: Vec<f64>,
    pub observations: Vec<Observation>,
    /// The number of unknowns of the motion.
    pub unknowns: usize,
    /// The number of numbers of a state.
    pub size: usize,
    /// The values of each piece, by their indices.
    values: Vec<Vec<usize>>,
}

impl<'a, M: PiecewiseModel> ShootingModel<'a, M> {
    pub fn new(motion: &'a M, nodes: Vec<f64>) -> Self {
        let observations = motion.observations();
        // A value at a node belongs to the piece that starts there.
        let mut values = vec![Vec::new(); nodes.len() + 1];
        for (i, observation) in observations.iter().enumerate() {
            values[nodes.partition_point(|node| *node <= observation.t)].push(i);
        }
        let (unknowns, size) = (motion.parameter_names().len(), motion.state_names().len());
        ShootingModel { motion, nodes, observations, unknowns, size, values }
    }

    /// The place of the first number of a node among the unknowns.
    fn place(&self, node: usize) -> usize {
        self.unknowns + node * self.size
    }

    /// The states at the nodes of the motion from a start, up to the first that cannot be computed.
    pub fn nodes_of_motion(&self, theta: &[f64]) -> Vec<Vec<f64>> {
        let mut states: Vec<Vec<f64>> = Vec::with_capacity(self.nodes.len());
        for (k, to) in self.nodes.iter().enumerate() {
            let from = k.checked_sub(1).map(|before| (self.nodes[before], states[before].as_slice()));
            let piece = Piece { from, to: Some(*to), values: &[], is_differentiated: false };
            match self.motion.piece(theta, &piece) {
                Ok(found) if found.values.iter().all(|x| x.is_finite()) => states.push(found.values),
                _ => break,
            }
        }
        states
    }
}

impl<M: PiecewiseModel> Model for ShootingModel<'_, M> {
    fn parameter_names(&self) -> Vec<String> {
        let numbers = self.motion.state_names();
        let of = |t: &f64| numbers.iter().map(|name| format!("{name} at t = {t}")).collect::<Vec<_>>();
        self.motion.parameter_names().into_iter().chain(self.nodes.iter().flat_map(of)).collect()
    }

    fn value_count(&self) -> usize {
        self.observations.len() + self.nodes.len() * self.size
    }

    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        if let Some(jacobian) = &mut jacobian {
            jacobian.fill(0.0);
        }
        let (own, states) = theta.split_at(self.unknowns);
        let state = |node: usize| &states[node * self.size..][..self.size];
        for (k, indices) in self.values.iter().enumerate() {
            let before = k.checked_sub(1);
            let piece = Piece {
                from: before.map(|node| (self.nodes[node], state(node))),
                to: self.nodes.get(k).copied(),
                values: indices,
                is_differentiated: jacobian.is_some(),
            };
            let found = self.motion.piece(own, &piece)?;
            let defects = piece.to.map(|_| self.observations.len() + k * self.size);
            // The row of each number of the piece.
            let rows = indices.iter().copied().chain(defects.into_iter().flat_map(|row| row..row + self.size));
            let rows: Vec<usize> = rows.collect();
            for (row, value) in rows.iter().zip(&found.values) {
                values[*row] = *value;
            }
            if let Some(row) = defects {
                for (value, node) in values[row..].iter_mut().zip(state(k)) {
                    *value -= node;
                }
            }
            let Some(jacobian) = &mut jacobian else { continue };
            for (i, row) in rows.iter().enumerate() {
                for j in 0..found.derivatives.ncols() {
                    let place = match j.checked_sub(self.unknowns) {
                        Some(number) => self.place(k.saturating_sub(1)) + number,
                        None => j,
                    };
                    jacobian[(*row, place)] = found.derivatives[(i, j)];
                }
            }
            if let Some(row) = defects {
                for i in 0..self.size {
                    jacobian[(row + i, self.place(k) + i)] = -1.0;
                }
            }
        }
        Ok(())
    }
}
