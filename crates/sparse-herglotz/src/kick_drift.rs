//! A kick and the drift that follows it, in one pass over memory, block by block.

use crate::blocks::{BLOCK_SIZE, MIN_PARALLEL_UNKNOWNS, block_count};
use crate::drag::apply_drift;
use crate::energies::sum_of_squares;
use crate::friction::FrictionDrift;
use crate::kick::{FollowingDrift, KickFactor};
use crate::stages::Stage;
use crate::system::{Masses, SparseSystem};
use discrete_herglotz::support::{Drift, exact_sum};

/// The maximum number of blocks in a parallel task: enough that the task takes long compared with its start, and few
/// enough that [`MIN_PARALLEL_UNKNOWNS`] are eight tasks.
const MAX_BLOCKS_PER_TASK: usize = 16;

/// The size of the buffer of kicks for systems with few unknowns. It occupies eight cache lines, so that clearing it
/// costs little.
const SMALL_BUFFER: usize = 64;

/// The inverse of the diagonal mass matrix.
pub(crate) enum InverseMasses {
    Same(f64),
    Each(Vec<f64>),
}

/// A kick and a drift, from the positions `q` to new positions.
pub(crate) struct KickDrift<'p> {
    pub system: &'p SparseSystem,
    pub inverse_masses: &'p InverseMasses,
    /// The positions, padded.
    pub q: &'p [f64],
    pub t: f64,
    pub stage: Stage,
    /// The drifts of the unknowns, if the system has friction.
    pub friction: Option<&'p FrictionDrift>,
}

/// What a kick and drift update: the velocities, the positions after the drift, and, if requested and otherwise empty,
/// the energies of each block, and the compensation term of each position and velocity.
pub(crate) struct KickDriftOutput<'p> {
    pub v: &'p mut [f64],
    pub next: &'p mut [f64],
    pub energies: &'p mut [[f64; 2]],
    pub q_rest: &'p mut [f64],
    pub v_rest: &'p mut [f64],
}

impl<'p> KickDriftOutput<'p> {
    /// Splits the output after the given number of blocks.
    fn split_at(self, blocks: usize) -> (Self, Self) {
        fn at<T>(x: &mut [T], middle: usize) -> (&mut [T], &mut [T]) {
            x.split_at_mut(middle.min(x.len()))
        }
        let KickDriftOutput { v, next, energies, q_rest, v_rest } = self;
        let middle = blocks * BLOCK_SIZE;
        let ((v, v_after), (next, next_after), (energies, energies_after)) =
            (at(v, middle), at(next, middle), at(energies, blocks));
        let ((q_rest, q_rest_after), (v_rest, v_rest_after)) = (at(q_rest, middle), at(v_rest, middle));
        let after = KickDriftOutput {
            v: v_after,
            next: next_after,
            energies: energies_after,
            q_rest: q_rest_after,
            v_rest: v_rest_after,
        };
        (KickDriftOutput { v, next, energies, q_rest, v_rest }, after)
    }
}

impl KickDrift<'_> {
    /// Applies the kick and the drift to all blocks.
    pub fn run(&self, all: KickDriftOutput) {
        if all.v.len() < MIN_PARALLEL_UNKNOWNS || rayon::current_num_threads() == 1 {
            self.run_blocks(0, all);
        } else {
            self.run_in_parallel(0, all);
        }
    }

    /// Processes the blocks from the index `first` on, distributed over the available threads.
    fn run_in_parallel(&self, first: usize, all: KickDriftOutput) {
        let count = block_count(all.v.len());
        if count <= MAX_BLOCKS_PER_TASK {
            return self.run_blocks(first, all);
        }
        let half = (count / 2).next_multiple_of(MAX_BLOCKS_PER_TASK);
        let (one, other) = all.split_at(half);
        rayon::join(|| self.run_in_parallel(first, one), || self.run_in_parallel(first + half, other));
    }

    /// Processes the blocks from the index `first` on, one after the other.
    fn run_blocks(&self, first: usize, mut all: KickDriftOutput) {
        let mut block = first;
        while !all.v.is_empty() {
            let (one, others) = all.split_at(1);
            match one.v_rest.len() {
                0 => self.run_block(block, one),
                1..=SMALL_BUFFER => self.run_block_compensated::<SMALL_BUFFER>(block, one),
                _ => self.run_block_compensated::<BLOCK_SIZE>(block, one),
            }
            (all, block) = (others, block + 1);
        }
    }

    /// The factor of the forces on the unknowns of a block.
    fn kick_factor(&self, block: usize, count: usize) -> KickFactor<'_> {
        let (kick, from) = (self.stage.kick, block * BLOCK_SIZE);
        match self.inverse_masses {
            InverseMasses::Same(inverse) => KickFactor::Uniform(kick * inverse),
            InverseMasses::Each(inverse) => {
                KickFactor::InverseMasses(kick, inverse.get(from..from + count).unwrap_or(&[]))
            }
        }
    }

    /// The kick and the drift of one block.
    fn run_block(&self, block: usize, KickDriftOutput { v, next, energies, .. }: KickDriftOutput) {
        let Stage { kick, drift, .. } = self.stage;
        if kick != 0.0 {
            let (lists, factor) = (&self.system.potentials, self.kick_factor(block, v.len()));
            for (i, list) in lists.iter().enumerate() {
                // Energies are evaluated between the kick and the drift, so that these cannot be fused.
                let is_last = i + 1 == lists.len() && energies.is_empty() && self.friction.is_none();
                let following = is_last.then_some(FollowingDrift { drift, next: &mut *next });
                if list.kick(block, self.t, self.q, factor, v, following) {
                    return;
                }
            }
        }
        self.evaluate_energies(block, v, energies);
        let q = self.q.get(block * BLOCK_SIZE + 1..).unwrap_or(&[]);
        let Some(friction) = self.friction else { return apply_drift(&drift, q, v, next) };
        let [length, damping, _] = friction.block(block * BLOCK_SIZE, v.len());
        for ((((next, q), v), length), damping) in next.iter_mut().zip(q).zip(v).zip(length).zip(damping) {
            *next = q + length * *v;
            *v += damping * *v;
        }
    }

    /// The same with compensated summation, for a block of at most B unknowns.
    fn run_block_compensated<const B: usize>(
        &self,
        block: usize,
        KickDriftOutput { v, next, energies, q_rest, v_rest }: KickDriftOutput,
    ) {
        let Stage { kick, drift: Drift { length, damping, .. }, .. } = self.stage;
        let mut kicks = [0.0; B];
        let kicks = kicks.get_mut(..v.len()).unwrap_or_default();
        if kick != 0.0 {
            let factor = self.kick_factor(block, v.len());
            for list in &self.system.potentials {
                list.kick(block, self.t, self.q, factor, kicks, None);
            }
            for ((v, v_rest), kick) in v.iter_mut().zip(&mut *v_rest).zip(&*kicks) {
                (*v, *v_rest) = exact_sum(*v, kick + *v_rest);
            }
        }
        self.evaluate_energies(block, v, energies);
        let q = self.q.get(block * BLOCK_SIZE + 1..).unwrap_or(&[]);
        if let Some(friction) = self.friction {
            let [lengths, dampings, _] = friction.block(block * BLOCK_SIZE, v.len());
            let rest = next.iter_mut().zip(q).zip(q_rest).zip(v).zip(v_rest);
            for (((((next, q), q_rest), v), v_rest), (length, damping)) in rest.zip(lengths.iter().zip(dampings)) {
                (*next, *q_rest) = exact_sum(*q, length * *v + (length * *v_rest + *q_rest));
                (*v, *v_rest) = exact_sum(*v, damping * *v + (damping * *v_rest + *v_rest));
            }
            return;
        }
        for ((((next, q), q_rest), v), v_rest) in next.iter_mut().zip(q).zip(q_rest).zip(v).zip(v_rest) {
            (*next, *q_rest) = exact_sum(*q, length * *v + (length * *v_rest + *q_rest));
            (*v, *v_rest) = exact_sum(*v, damping * *v + (damping * *v_rest + *v_rest));
        }
    }

    /// Evaluates the energies of a block between the kick and the drift, if they are requested.
    fn evaluate_energies(&self, block: usize, v: &[f64], energies: &mut [[f64; 2]]) {
        let Some(energies) = energies.first_mut() else { return };
        let blocks = block_count(self.system.unknowns());
        let lists = self.system.potentials.iter();
        let potential = lists.map(|list| list.energy(block, blocks, self.t, self.q)).sum();
        // The potential changes the action only in a kick.
        energies[0] = if self.stage.kick == 0.0 { 0.0 } else { potential };
        let from = block * BLOCK_SIZE;
        if let Some(friction) = self.friction {
            let [_, _, lift] = friction.block(from, v.len());
            let of = |(i, (lift, v)): (usize, (&f64, &f64))| lift * self.system.mass(from + i) * v * v;
            energies[1] = lift.iter().zip(v).enumerate().map(of).sum();
            return;
        }
        energies[1] = match &self.system.masses {
            Masses::Same(m) => m * sum_of_squares(v),
            Masses::Each(masses) => masses[from..from + v.len()].iter().zip(v).map(|(m, v)| m * v * v).sum(),
        };
    }
}
