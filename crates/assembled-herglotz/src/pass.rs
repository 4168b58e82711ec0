//! One pass over memory: a kick and the drift that follows it, block by block.

use crate::blocks::{self, BLOCK};
use crate::drag::Drift;
use crate::kernels::{Then, Weight};
use crate::splitting::Stage;
use crate::system::{AssembledSystem, Masses};

/// The number of unknowns from which on a pass is distributed over threads.
pub(crate) const SHARED: usize = 1 << 17;

/// The number of blocks in a parallel task.
const TOGETHER: usize = 16;

/// The size of the buffer of kicks for systems with few unknowns. It occupies few cache lines, so that clearing it
/// costs nothing.
const FEW: usize = 64;

pub(crate) enum InverseMasses {
    Same(f64),
    Each(Vec<f64>),
}

/// A kick and a drift, from the positions `q` to new positions.
pub(crate) struct Pass<'p> {
    pub system: &'p AssembledSystem,
    pub inverse: &'p InverseMasses,
    /// The positions, padded.
    pub q: &'p [f64],
    pub t: f64,
    pub stage: Stage,
}

/// The output of a pass: the velocities, the positions after it, and, if requested and otherwise empty, the energies of
/// each block, and the rounding errors of each position and velocity.
pub(crate) struct Passed<'p> {
    pub v: &'p mut [f64],
    pub next: &'p mut [f64],
    pub energies: &'p mut [[f64; 2]],
    pub q_rest: &'p mut [f64],
    pub v_rest: &'p mut [f64],
}

impl<'p> Passed<'p> {
    /// Splits the output after the given number of blocks.
    fn split_at(self, blocks: usize) -> (Self, Self) {
        fn at<T>(x: &mut [T], middle: usize) -> (&mut [T], &mut [T]) {
            x.split_at_mut(middle.min(x.len()))
        }
        let Passed { v, next, energies, q_rest, v_rest } = self;
        let middle = blocks * BLOCK;
        let ((v, v_after), (next, next_after), (energies, energies_after)) =
            (at(v, middle), at(next, middle), at(energies, blocks));
        let ((q_rest, q_rest_after), (v_rest, v_rest_after)) = (at(q_rest, middle), at(v_rest, middle));
        let after = Passed {
            v: v_after,
            next: next_after,
            energies: energies_after,
            q_rest: q_rest_after,
            v_rest: v_rest_after,
        };
        (Passed { v, next, energies, q_rest, v_rest }, after)
    }
}

impl Pass<'_> {
    pub fn run(&self, all: Passed) {
        if all.v.len() < SHARED || rayon::current_num_threads() == 1 {
            self.blocks(0, all);
        } else {
            self.share(0, all);
        }
    }

    /// Processes the blocks from the number `first` on, distributed over the available threads.
    fn share(&self, first: usize, all: Passed) {
        let count = blocks::count(all.v.len());
        if count <= TOGETHER {
            return self.blocks(first, all);
        }
        let half = (count / 2).next_multiple_of(TOGETHER);
        let (one, other) = all.split_at(half);
        rayon::join(|| self.share(first, one), || self.share(first + half, other));
    }

    /// Processes the blocks from the number `first` on, one after the other.
    fn blocks(&self, first: usize, mut all: Passed) {
        let mut block = first;
        while !all.v.is_empty() {
            let (one, others) = all.split_at(1);
            match one.v_rest.len() {
                0 => self.block(block, one),
                1..=FEW => self.compensated::<FEW>(block, one),
                _ => self.compensated::<BLOCK>(block, one),
            }
            (all, block) = (others, block + 1);
        }
    }

    fn weight(&self, block: usize, count: usize) -> Weight<'_> {
        let (kick, from) = (self.stage.kick, block * BLOCK);
        match self.inverse {
            InverseMasses::Same(inverse) => Weight::Same(kick * inverse),
            InverseMasses::Each(inverse) => Weight::Masses(kick, inverse.get(from..from + count).unwrap_or(&[])),
        }
    }

    fn block(&self, block: usize, Passed { v, next, energies, .. }: Passed) {
        let Stage { kick, drift, .. } = self.stage;
        if kick != 0.0 {
            let (lists, weight) = (&self.system.potentials, self.weight(block, v.len()));
            for (i, list) in lists.iter().enumerate() {
                // Energies are evaluated between the kick and the drift, so that these cannot be fused.
                let last = i + 1 == lists.len() && energies.is_empty();
                if list.kick(block, self.t, self.q, weight, v, last.then_some(Then { drift, next: &mut *next })) {
                    return;
                }
            }
        }
        self.weigh(block, v, energies);
        drift.go(self.q.get(block * BLOCK + 1..).unwrap_or(&[]), v, next);
    }

    /// The same with compensated summation, for a block of at most B unknowns.
    fn compensated<const B: usize>(&self, block: usize, Passed { v, next, energies, q_rest, v_rest }: Passed) {
        let Stage { kick, drift: Drift { length, damping, .. }, .. } = self.stage;
        let mut kicks = [0.0; B];
        let kicks = kicks.get_mut(..v.len()).unwrap_or_default();
        if kick != 0.0 {
            let weight = self.weight(block, v.len());
            for list in &self.system.potentials {
                list.kick(block, self.t, self.q, weight, kicks, None);
            }
            for ((v, v_rest), kick) in v.iter_mut().zip(&mut *v_rest).zip(&*kicks) {
                (*v, *v_rest) = exact_sum(*v, kick + *v_rest);
            }
        }
        self.weigh(block, v, energies);
        let q = self.q.get(block * BLOCK + 1..).unwrap_or(&[]);
        for ((((next, q), q_rest), v), v_rest) in next.iter_mut().zip(q).zip(q_rest).zip(v).zip(v_rest) {
            (*next, *q_rest) = exact_sum(*q, length * *v + (length * *v_rest + *q_rest));
            (*v, *v_rest) = exact_sum(*v, damping * *v + (damping * *v_rest + *v_rest));
        }
    }

    /// Evaluates the energies of a block between the kick and the drift, if they are requested.
    fn weigh(&self, block: usize, v: &[f64], energies: &mut [[f64; 2]]) {
        let Some(energies) = energies.first_mut() else { return };
        let blocks = blocks::count(self.system.unknowns());
        let lists = self.system.potentials.iter();
        let potential = lists.map(|list| list.energy(block, blocks, self.t, self.q)).sum();
        // The potential changes the action only in a kick.
        energies[0] = if self.stage.kick == 0.0 { 0.0 } else { potential };
        let from = block * BLOCK;
        energies[1] = match &self.system.masses {
            Masses::Same(m) => m * sum_of_squares(v),
            Masses::Each(masses) => masses[from..from + v.len()].iter().zip(v).map(|(m, v)| m * v * v).sum(),
        };
    }
}

/// The sum of two numbers and its rounding error, by Knuth's algorithm, in which either number may be the larger.
#[inline(always)]
fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// The sum of squares, in eight partial sums so that the compiler may use vector registers.
pub(crate) fn sum_of_squares(v: &[f64]) -> f64 {
    let (chunks, rest) = v.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for (sum, v) in sums.iter_mut().zip(chunk) {
            *sum += v * v;
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|v| v * v).sum::<f64>()
}
