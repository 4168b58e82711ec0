//! Forces and energies of a list of elements, eight at a time.

use crate::Potential;
use crate::blocks::BLOCK;
use crate::drag::Drift;
use crate::elements::{Elements, Piece, Run};
use crate::implicit::Pattern;
use crate::lanes::{LANES, Lanes};
use crate::term::column;
use contact_geom::nalgebra::SVector;

/// The weight with which a force is added to a velocity.
#[derive(Clone, Copy)]
pub(crate) enum Weight<'a> {
    /// The same factor for all unknowns.
    Same(f64),
    /// A factor, and the inverse masses of the block.
    Masses(f64, &'a [f64]),
}

/// The drift after a kick, and the slice for the new positions of the block.
pub(crate) struct Then<'a> {
    pub drift: Drift,
    pub next: &'a mut [f64],
}

/// A list of potentials with any number of unknowns per element.
pub(crate) trait PotentialList: Send + Sync {
    /// Adds the weighted forces `-V_q` on the unknowns of a block. `q` is padded with one fixed component at each end.
    ///
    /// Returns whether the drift was applied as well. This is done while the velocities are in registers, if all
    /// unknowns have the same mass and one piece of a run covers the whole block with all its slots.
    fn kick(&self, block: usize, t: f64, q: &[f64], weight: Weight, v: &mut [f64], then: Option<Then>) -> bool;

    /// The energy of the elements assigned to a block: those of runs by their first unknown, the others in equal
    /// shares.
    fn energy(&self, block: usize, blocks: usize, t: f64, q: &[f64]) -> f64;

    /// Calls a function with the padded indices of the unknowns of each element.
    fn visit(&self, f: &mut dyn FnMut(&[usize]));

    /// The indices of the second derivatives of each element among the entries of a matrix: for each pair of unknowns
    /// of which the second does not follow the first.
    fn entries(&self, pattern: &Pattern) -> Vec<u32>;

    /// Adds the second derivatives, times a factor, to the entries of the matrix.
    fn hessian(&self, t: f64, q: &[f64], factor: f64, places: &[u32], entries: &mut [f64]);

    /// Adds the product of the second derivatives with a vector x. The vectors q, x and the product are padded with one
    /// fixed component at each end.
    fn hessian_times(&self, t: f64, q: &[f64], x: &[f64], product: &mut [f64]);
}

/// A potential and its elements.
pub(crate) struct Kind<V, const K: usize, const P: usize> {
    pub term: V,
    pub elements: Elements<K, P>,
}

impl<V: Potential<K, P>, const K: usize, const P: usize> PotentialList for Kind<V, K, P> {
    fn kick(&self, block: usize, t: f64, q: &[f64], weight: Weight, v: &mut [f64], then: Option<Then>) -> bool {
        let all = if K == 32 { u32::MAX } else { (1 << K) - 1 };
        let (pieces, batches) = (self.elements.pieces.of(block), self.elements.batches.of(block));
        let of = |piece: &Piece| self.elements.runs.get(piece.run as usize);
        if let ([piece], [], Weight::Same(w), Some(then)) = (pieces, batches, weight, then)
            && piece.slots == all
            && (piece.from, piece.to as usize) == (0, v.len())
            && let Some(run) = of(piece)
        {
            self.kick_piece::<true, false, true>(block, t, q, run, piece, w, &[], v, then);
            return true;
        }
        for piece in pieces {
            let Some(run) = of(piece) else { continue };
            let none = Then { drift: Drift::NONE, next: &mut [] };
            match (weight, piece.slots == all) {
                (Weight::Same(w), true) => {
                    self.kick_piece::<true, false, false>(block, t, q, run, piece, w, &[], v, none);
                }
                (Weight::Same(w), false) => {
                    self.kick_piece::<false, false, false>(block, t, q, run, piece, w, &[], v, none);
                }
                (Weight::Masses(w, m), true) => {
                    self.kick_piece::<true, true, false>(block, t, q, run, piece, w, m, v, none);
                }
                (Weight::Masses(w, m), false) => {
                    self.kick_piece::<false, true, false>(block, t, q, run, piece, w, m, v, none);
                }
            }
        }
        let t = Lanes::splat(t);
        for batch in batches {
            batch.kick(&self.term, t, q, weight, v);
        }
        false
    }

    fn energy(&self, block: usize, blocks: usize, t: f64, q: &[f64]) -> f64 {
        let t = Lanes::splat(t);
        let mut sum = Lanes::splat(0.0);
        let mut rest = 0.0;
        for span in self.elements.spans.of(block) {
            let Some(run) = self.elements.runs.get(span.run as usize) else { continue };
            let mut e = span.from;
            while e + LANES <= span.to {
                sum += self.term.energy(t, &unknowns(q, run, e), &self.elements.parameters(run, e));
                e += LANES;
            }
            if e < span.to {
                let count = span.to - e;
                let part = self.term.energy(
                    t,
                    &unknowns_part(q, run, e, count),
                    &self.elements.parameters_part(run, e, count),
                );
                rest += part.to_array()[..count].iter().sum::<f64>();
            }
        }
        let loose = self.elements.loose.len();
        let (mut e, end) = (loose * block / blocks, loose * (block + 1) / blocks);
        while e < end {
            let count = LANES.min(end - e);
            let (x, c) = self.elements.gathered(q, count, |lane| e + lane);
            rest += self.term.energy(t, &x, &c).to_array()[..count].iter().sum::<f64>();
            e += count;
        }
        rest + sum.to_array().iter().sum::<f64>()
    }

    fn visit(&self, f: &mut dyn FnMut(&[usize])) {
        self.elements.visit(|places| f(&places));
    }

    fn entries(&self, pattern: &Pattern) -> Vec<u32> {
        let mut entries = Vec::new();
        self.visit(&mut |places| {
            for (i, a) in places.iter().enumerate() {
                entries.extend(places[..=i].iter().map(|b| pattern.entry(*a, *b)));
            }
        });
        entries
    }

    fn hessian(&self, t: f64, q: &[f64], factor: f64, places: &[u32], entries: &mut [f64]) {
        self.add_second(t, q, factor, places, entries);
    }

    fn hessian_times(&self, t: f64, q: &[f64], x: &[f64], product: &mut [f64]) {
        self.add_product(t, q, x, product);
    }
}

/// The unknowns of eight elements of a run.
#[inline(always)]
pub(crate) fn unknowns<const K: usize>(q: &[f64], run: &Run<K>, e: usize) -> SVector<Lanes, K> {
    column(std::array::from_fn(|i| Lanes::load(q, run.start[i] + e)))
}

/// The unknowns of fewer than eight elements of a run.
#[inline(always)]
pub(crate) fn unknowns_part<const K: usize>(q: &[f64], run: &Run<K>, e: usize, count: usize) -> SVector<Lanes, K> {
    column(std::array::from_fn(|i| Lanes::load_part(q, run.start[i] + e, count)))
}

impl<V: Potential<K, P>, const K: usize, const P: usize> Kind<V, K, P> {
    /// Applies the kick to the unknowns of a piece. Each unknown is visited once and receives the forces of all
    /// elements of the run. An element is evaluated once for each of its unknowns, which costs less than storing its
    /// forces and loading them again. With `DRIFT` the drift follows.
    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "of slices by themselves the compiler knows that they do not overlap"
    )]
    fn kick_piece<'a, const FULL: bool, const MASSES: bool, const DRIFT: bool>(
        &'a self,
        block: usize,
        t: f64,
        q: &'a [f64],
        run: &Run<K>,
        piece: &Piece,
        weight: f64,
        inverse_masses: &'a [f64],
        v: &mut [f64],
        then: Then,
    ) {
        let (from, to) = (piece.from as usize, piece.to as usize);
        let Some(v) = v.get_mut(from..to) else { return };
        let inverse_masses = if MASSES { inverse_masses.get(from..to).unwrap_or(&[]) } else { &[] };
        let t = Lanes::splat(t);
        // The padded index of the first unknown of the piece.
        let place = block * BLOCK + from + 1;
        let acts = |k: usize| FULL || piece.slots >> k & 1 == 1;
        let (chunks, rest) = v.as_chunks_mut::<LANES>();
        let count = chunks.len();
        // For each slot, the unknowns and parameters of its elements, as slices of as many registers as there are of
        // velocities: then loads need no bounds checks.
        let of = |x: &'a [f64], from: usize| {
            x.get(from..).and_then(|x| x.as_chunks::<LANES>().0.get(..count)).unwrap_or(&[])
        };
        let first = |k: usize| if acts(k) { place - run.start[k] } else { 0 };
        let x: [[&[[f64; LANES]]; K]; K] =
            std::array::from_fn(|k| std::array::from_fn(|i| of(q, run.start[i] + first(k))));
        let c: [[&[[f64; LANES]]; P]; K] = std::array::from_fn(|k| {
            std::array::from_fn(|p| of(&self.elements.run_parameters[p], run.first + first(k)))
        });
        let masses = if MASSES { of(inverse_masses, 0) } else { &[] };
        let Drift { length, damping, .. } = then.drift;
        let (moved, moved_rest) = then.next.as_chunks_mut::<LANES>();
        let here = if DRIFT { of(q, place) } else { &[] };
        if DRIFT && (here.len() != count || moved.len() != count || moved_rest.len() != rest.len()) {
            return;
        }
        let inside = |slices: &[&[[f64; LANES]]]| slices.iter().all(|s| s.len() == count);
        if !(0..K).all(|k| !acts(k) || inside(&x[k]) && inside(&c[k])) || MASSES && masses.len() != count {
            return;
        }
        for (number, chunk) in chunks.iter_mut().enumerate() {
            let mut force = Lanes::splat(0.0);
            for k in 0..K {
                if acts(k) {
                    let x = std::array::from_fn(|i| Lanes::new(x[k][i][number]));
                    let c = std::array::from_fn(|p| Lanes::new(c[k][p][number]));
                    force -= self.term.gradient(t, &column(x), &c)[k];
                }
            }
            let factor = if MASSES { Lanes::new(masses[number]) * weight } else { Lanes::splat(weight) };
            let mut velocity = force.mul_add(factor, Lanes::new(*chunk));
            if DRIFT {
                moved[number] = velocity.mul_add(Lanes::splat(length), Lanes::new(here[number])).to_array();
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
                let e = place + done - run.start[k];
                let (x, c) = (unknowns_part(q, run, e, count), self.elements.parameters_part(run, e, count));
                force -= self.term.gradient(t, &x, &c)[k];
            }
        }
        let factor = if MASSES { Lanes::load_part(inverse_masses, done, count) * weight } else { Lanes::splat(weight) };
        for (v, kick) in rest.iter_mut().zip((force * factor).to_array()) {
            *v += kick;
        }
        if DRIFT {
            then.drift.go(q.get(place + done..).unwrap_or(&[]), rest, moved_rest);
        }
    }
}

impl<const K: usize, const P: usize> Elements<K, P> {
    /// Calls a function with the padded indices of each element, first those of runs.
    pub(crate) fn visit(&self, mut f: impl FnMut([usize; K])) {
        for run in &self.runs {
            (0..run.len).for_each(|e| f(run.start.map(|s| s + e)));
        }
        self.loose.iter().for_each(|places| f(places.map(|p| p as usize)));
    }

    /// The parameters of eight elements of a run.
    #[inline(always)]
    pub(crate) fn parameters(&self, run: &Run<K>, e: usize) -> [Lanes; P] {
        std::array::from_fn(|p| Lanes::load(&self.run_parameters[p], run.first + e))
    }

    /// The parameters of fewer than eight elements of a run.
    #[inline(always)]
    pub(crate) fn parameters_part(&self, run: &Run<K>, e: usize, count: usize) -> [Lanes; P] {
        std::array::from_fn(|p| Lanes::load_part(&self.run_parameters[p], run.first + e, count))
    }

    /// The unknowns and parameters of elements outside runs; unused lanes repeat the first element.
    #[inline(always)]
    pub(crate) fn gathered(
        &self,
        q: &[f64],
        count: usize,
        element: impl Fn(usize) -> usize,
    ) -> (SVector<Lanes, K>, [Lanes; P]) {
        // Loops, since `map` on arrays would compile to function calls.
        let (mut x, mut c) = ([[f64::NAN; LANES]; K], [[f64::NAN; LANES]; P]);
        for lane in 0..LANES {
            let e = element(if lane < count { lane } else { 0 });
            let Some(places) = self.loose.get(e) else { continue };
            for k in 0..K {
                if let Some(value) = q.get(places[k] as usize) {
                    x[k][lane] = *value;
                }
            }
            for (c, parameter) in c.iter_mut().zip(&self.loose_parameters) {
                if let Some(value) = parameter.get(e) {
                    c[lane] = *value;
                }
            }
        }
        let (x, c) = (std::array::from_fn(|k| Lanes::new(x[k])), std::array::from_fn(|p| Lanes::new(c[p])));
        (column(x), c)
    }
}
