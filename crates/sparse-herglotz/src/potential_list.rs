//! Forces and energies of a list of elements, eight at a time.

use crate::Potential;
use crate::batch::{Batch, batches};
use crate::blocks::{BLOCK_SIZE, ByBlock};
use crate::drag::{NO_DRIFT, apply_drift};
use crate::elements::{Elements, MAX_ELEMENT_UNKNOWNS, Run, RunSegment};
use crate::gather;
use crate::hessian::{add_hessian, add_hessian_product};
use crate::implicit::LowerPattern;
use crate::kick::{FollowingDrift, KickFactor};
use crate::lanes::{LANES, Lanes};
use crate::potential::vector;
use discrete_herglotz::support::Drift;

/// A list of potentials with any number of unknowns per element.
pub(crate) trait PotentialList: Send + Sync {
    /// Adds the forces `-V_q`, times the factor, to the velocities of a block. `q` is padded with one fixed component
    /// at each end.
    ///
    /// Returns whether the following drift was applied as well. This is done while the velocities are in registers, if
    /// all unknowns have the same mass and one segment of a run covers the whole block with all its slots.
    fn kick(
        &self,
        block: usize,
        t: f64,
        q: &[f64],
        factor: KickFactor,
        v: &mut [f64],
        following: Option<FollowingDrift>,
    ) -> bool;

    /// The energy of the elements assigned to a block: those of runs by their first unknown, the others in equal
    /// shares.
    fn energy(&self, block: usize, blocks: usize, t: f64, q: &[f64]) -> f64;

    /// Calls a function with the padded indices of the unknowns of each element.
    fn visit(&self, f: &mut dyn FnMut(&[usize]));

    /// The indices of the second derivatives of each element among the entries of a matrix: those of the lower triangle
    /// of the element, row by row.
    fn entry_indices(&self, pattern: &LowerPattern) -> Vec<u32>;

    /// Adds the second derivatives, times a factor, to the entries of the matrix.
    fn add_hessian(&self, t: f64, q: &[f64], factor: f64, entry_indices: &[u32], entries: &mut [f64]);

    /// Adds the product of the second derivatives with a vector x. The vectors q, x and the product are padded with one
    /// fixed component at each end.
    fn add_hessian_product(&self, t: f64, q: &[f64], x: &[f64], product: &mut [f64]);
}

/// A potential and its elements.
pub(crate) struct PotentialElements<V, const K: usize, const P: usize> {
    term: V,
    elements: Elements<K, P>,
    /// The elements outside runs that have unknowns in each block.
    batches: ByBlock<Batch<K, P>>,
}

impl<V, const K: usize, const P: usize> PotentialElements<V, K, P> {
    /// A potential and its elements, in a system with the given number of unknowns.
    pub fn new(term: V, elements: Elements<K, P>, unknowns: usize) -> Self {
        let batches = batches(&elements, unknowns);
        PotentialElements { term, elements, batches }
    }
}

impl<V: Potential<K, P>, const K: usize, const P: usize> PotentialList for PotentialElements<V, K, P> {
    fn kick(
        &self,
        block: usize,
        t: f64,
        q: &[f64],
        factor: KickFactor,
        v: &mut [f64],
        following: Option<FollowingDrift>,
    ) -> bool {
        let all = if K == MAX_ELEMENT_UNKNOWNS { u32::MAX } else { (1 << K) - 1 };
        let (segments, batches) = (self.elements.segments.in_block(block), self.batches.in_block(block));
        let run_of = |segment: &RunSegment| self.elements.runs.get(segment.run as usize);
        if let ([segment], [], KickFactor::Uniform(w), Some(following)) = (segments, batches, factor, following)
            && segment.slots == all
            && (segment.from, segment.to as usize) == (0, v.len())
            && let Some(run) = run_of(segment)
        {
            self.kick_segment::<true, false, true>(block, t, q, run, segment, w, &[], v, following);
            return true;
        }
        for segment in segments {
            let Some(run) = run_of(segment) else { continue };
            let none = FollowingDrift { drift: NO_DRIFT, next: &mut [] };
            match (factor, segment.slots == all) {
                (KickFactor::Uniform(w), true) => {
                    self.kick_segment::<true, false, false>(block, t, q, run, segment, w, &[], v, none);
                }
                (KickFactor::Uniform(w), false) => {
                    self.kick_segment::<false, false, false>(block, t, q, run, segment, w, &[], v, none);
                }
                (KickFactor::InverseMasses(w, m), true) => {
                    self.kick_segment::<true, true, false>(block, t, q, run, segment, w, m, v, none);
                }
                (KickFactor::InverseMasses(w, m), false) => {
                    self.kick_segment::<false, true, false>(block, t, q, run, segment, w, m, v, none);
                }
            }
        }
        let t = Lanes::splat(t);
        for batch in batches {
            batch.kick(&self.term, t, q, factor, v);
        }
        false
    }

    fn energy(&self, block: usize, blocks: usize, t: f64, q: &[f64]) -> f64 {
        let t = Lanes::splat(t);
        let mut sum = Lanes::splat(0.0);
        let mut rest = 0.0;
        for range in self.elements.ranges.in_block(block) {
            let Some(run) = self.elements.runs.get(range.run as usize) else { continue };
            let mut e = range.from;
            while e + LANES <= range.to {
                sum += self.term.energy(t, &gather::unknowns(q, run, e), &gather::parameters(&self.elements, run, e));
                e += LANES;
            }
            if e < range.to {
                let count = range.to - e;
                let part = self.term.energy(
                    t,
                    &gather::unknowns_part(q, run, e, count),
                    &gather::parameters_part(&self.elements, run, e, count),
                );
                rest += part.to_array()[..count].iter().sum::<f64>();
            }
        }
        let outside = self.elements.outside_runs.len();
        let (mut e, end) = (outside * block / blocks, outside * (block + 1) / blocks);
        while e < end {
            let count = LANES.min(end - e);
            let (x, c) = gather::outside_runs(&self.elements, q, count, |lane| e + lane);
            rest += self.term.energy(t, &x, &c).to_array()[..count].iter().sum::<f64>();
            e += count;
        }
        rest + sum.to_array().iter().sum::<f64>()
    }

    fn visit(&self, f: &mut dyn FnMut(&[usize])) {
        self.elements.visit(|indices| f(&indices));
    }

    fn entry_indices(&self, pattern: &LowerPattern) -> Vec<u32> {
        let mut entries = Vec::new();
        self.visit(&mut |indices| {
            for (i, a) in indices.iter().enumerate() {
                entries.extend(indices[..=i].iter().map(|b| pattern.entry(*a, *b)));
            }
        });
        entries
    }

    fn add_hessian(&self, t: f64, q: &[f64], factor: f64, entry_indices: &[u32], entries: &mut [f64]) {
        add_hessian(&self.term, &self.elements, (t, q), factor, entry_indices, entries);
    }

    fn add_hessian_product(&self, t: f64, q: &[f64], x: &[f64], product: &mut [f64]) {
        add_hessian_product(&self.term, &self.elements, (t, q), x, product);
    }
}

impl<V: Potential<K, P>, const K: usize, const P: usize> PotentialElements<V, K, P> {
    /// Applies the kick to the unknowns of a segment. Each unknown is visited once and receives the forces of all
    /// elements of the run. An element is evaluated once for each of its unknowns, which costs less than storing its
    /// forces and loading them again. With `FULL` all slots act, with `MASSES` the masses differ, and with `DRIFT` the
    /// drift follows.
    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "of slices by themselves the compiler knows that they do not overlap"
    )]
    fn kick_segment<'a, const FULL: bool, const MASSES: bool, const DRIFT: bool>(
        &'a self,
        block: usize,
        t: f64,
        q: &'a [f64],
        run: &Run<K>,
        segment: &RunSegment,
        factor: f64,
        inverse_masses: &'a [f64],
        v: &mut [f64],
        following: FollowingDrift,
    ) {
        let (from, to) = (segment.from as usize, segment.to as usize);
        let Some(v) = v.get_mut(from..to) else { return };
        let inverse_masses = if MASSES { inverse_masses.get(from..to).unwrap_or(&[]) } else { &[] };
        let t = Lanes::splat(t);
        // The padded index of the first unknown of the segment.
        let index = block * BLOCK_SIZE + from + 1;
        let acts = |k: usize| FULL || segment.slots >> k & 1 == 1;
        let (chunks, rest) = v.as_chunks_mut::<LANES>();
        let count = chunks.len();
        // For each slot, the unknowns and parameters of its elements, as slices of as many registers as there are of
        // velocities: then loads need no bounds checks.
        let registers = |x: &'a [f64], from: usize| {
            x.get(from..).and_then(|x| x.as_chunks::<LANES>().0.get(..count)).unwrap_or(&[])
        };
        let first = |k: usize| if acts(k) { index - run.start[k] } else { 0 };
        let x: [[&[[f64; LANES]]; K]; K] =
            std::array::from_fn(|k| std::array::from_fn(|i| registers(q, run.start[i] + first(k))));
        let c: [[&[[f64; LANES]]; P]; K] = std::array::from_fn(|k| {
            std::array::from_fn(|p| registers(&self.elements.run_parameters[p], run.first + first(k)))
        });
        let masses = if MASSES { registers(inverse_masses, 0) } else { &[] };
        let Drift { length, damping, .. } = following.drift;
        let (new_positions, new_positions_rest) = following.next.as_chunks_mut::<LANES>();
        let positions = if DRIFT { registers(q, index) } else { &[] };
        if DRIFT && (positions.len() != count || new_positions.len() != count || new_positions_rest.len() != rest.len())
        {
            return;
        }
        let complete = |slices: &[&[[f64; LANES]]]| slices.iter().all(|s| s.len() == count);
        if !(0..K).all(|k| !acts(k) || complete(&x[k]) && complete(&c[k])) || MASSES && masses.len() != count {
            return;
        }
        for (register, chunk) in chunks.iter_mut().enumerate() {
            let mut force = Lanes::splat(0.0);
            for k in 0..K {
                if acts(k) {
                    let x = std::array::from_fn(|i| Lanes::new(x[k][i][register]));
                    let c = std::array::from_fn(|p| Lanes::new(c[k][p][register]));
                    force -= self.term.gradient(t, &vector(x), &c)[k];
                }
            }
            let factors = if MASSES { Lanes::new(masses[register]) * factor } else { Lanes::splat(factor) };
            let mut velocity = force.mul_add(factors, Lanes::new(*chunk));
            if DRIFT {
                new_positions[register] =
                    velocity.mul_add(Lanes::splat(length), Lanes::new(positions[register])).to_array();
                velocity = velocity.mul_add(Lanes::splat(damping), velocity);
            }
            *chunk = velocity.to_array();
        }
        if rest.is_empty() {
            return;
        }
        let (done, count) = (chunks.len() * LANES, rest.len());
        let mut force = Lanes::splat(0.0);
        for k in 0..K {
            if acts(k) {
                let e = index + done - run.start[k];
                let (x, c) =
                    (gather::unknowns_part(q, run, e, count), gather::parameters_part(&self.elements, run, e, count));
                force -= self.term.gradient(t, &x, &c)[k];
            }
        }
        let factors =
            if MASSES { Lanes::load_part(inverse_masses, done, count) * factor } else { Lanes::splat(factor) };
        for (v, kick) in rest.iter_mut().zip((force * factors).to_array()) {
            *v += kick;
        }
        if DRIFT {
            apply_drift(&following.drift, q.get(index + done..).unwrap_or(&[]), rest, new_positions_rest);
        }
    }
}
