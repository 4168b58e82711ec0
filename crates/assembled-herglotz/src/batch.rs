//! Forces of the elements outside runs, a batch of SIMD registers at a time.

use crate::Potential;
use crate::blocks::{self, BLOCK, ByBlock};
use crate::elements::Elements;
use crate::kernels::Weight;
use crate::lanes::{LANES, Lanes};
use crate::term::column;

/// Number of SIMD registers of elements in a batch: few enough that their forces stay in the L1 cache, and enough that
/// several forces on one unknown are summed before they are added to its velocity.
const GROUPS: usize = 4;

/// Elements with unknowns in one block. All elements are evaluated first; then the forces on each unknown are summed
/// and applied at once. If the elements updated the velocities one after the other, each update would have to wait for
/// the preceding one.
#[derive(Clone, Debug)]
pub(crate) struct Batch<const K: usize, const P: usize> {
    groups: Vec<Group<K, P>>,
    targets: Vec<Targets>,
    /// The rows of `targets`, one target after the other: each row holds one index per lane into the forces of the
    /// groups.
    rows: Vec<[u16; LANES]>,
}

/// The elements of one SIMD register; unused lanes repeat the first element.
#[derive(Clone, Debug)]
struct Group<const K: usize, const P: usize> {
    /// The padded indices of their unknowns.
    places: [[u32; LANES]; K],
    parameters: [[f64; LANES]; P],
}

/// A SIMD register of unknowns of the block.
#[derive(Clone, Copy, Debug)]
struct Targets {
    /// Indices relative to the first unknown of the block; unused lanes hold an index beyond the last.
    unknowns: [u32; LANES],
    /// The number of rows of these unknowns.
    rows: usize,
}

impl<const K: usize, const P: usize> Batch<K, P> {
    /// The batch of the elements with these numbers, for the unknowns of a block.
    fn new(elements: &Elements<K, P>, numbers: &[u32], block: usize, unknowns: usize) -> Self {
        const { assert!((GROUPS + 1) * LANES * 32 <= 1 << 16, "an entry has 16 bits, an element up to 32 unknowns") };
        let place = |e: u32, k: usize| elements.loose.get(e as usize).map_or(0, |places| places[k]);
        let parameter = |e: u32, p: usize| elements.loose_parameters[p].get(e as usize).copied().unwrap_or(f64::NAN);
        let groups = numbers.chunks(LANES).map(|group| {
            let of = |lane: usize| group.get(lane).or(group.first()).copied().unwrap_or(0);
            let places = std::array::from_fn(|k| std::array::from_fn(|lane| place(of(lane), k)));
            Group { places, parameters: std::array::from_fn(|p| std::array::from_fn(|lane| parameter(of(lane), p))) }
        });
        // Fixed components and unknowns of other blocks are skipped.
        let inside = block * BLOCK + 1..((block + 1) * BLOCK).min(unknowns) + 1;
        let mut all = Vec::new();
        for (i, e) in numbers.iter().enumerate() {
            for k in 0..K {
                let place = place(*e, k) as usize;
                if inside.contains(&place) {
                    let entry = (i / LANES * K + k) * LANES + i % LANES;
                    all.push(((place - inside.start) as u32, entry as u16));
                }
            }
        }
        all.sort_by_key(|(unknown, _)| *unknown);
        let (mut targets, mut rows) = (Vec::new(), Vec::new());
        let each: Vec<&[(u32, u16)]> = all.chunk_by(|a, b| a.0 == b.0).collect();
        for lanes in each.chunks(LANES) {
            let longest = lanes.iter().map(|entries| entries.len()).max().unwrap_or(0);
            let unknown = |lane: usize| lanes.get(lane).and_then(|entries| entries.first()).map_or(u32::MAX, |e| e.0);
            targets.push(Targets { unknowns: std::array::from_fn(unknown), rows: longest });
            // Unused entries of a row refer to the zeros after the groups.
            let entry = |lane: usize, i: usize| lanes.get(lane).and_then(|entries| entries.get(i));
            rows.extend(
                (0..longest)
                    .map(|i| std::array::from_fn(|lane| entry(lane, i).map_or((GROUPS * K * LANES) as u16, |e| e.1))),
            );
        }
        Batch { groups: groups.collect(), targets, rows }
    }

    /// Adds the weighted forces to the velocities of the block.
    #[inline(always)]
    pub fn kick<V: Potential<K, P>>(&self, term: &V, t: Lanes, q: &[f64], weight: Weight, v: &mut [f64]) {
        let Some(last) = q.len().checked_sub(1) else { return };
        let mut slopes = [[[0.0; LANES]; K]; GROUPS + 1];
        for (slopes, group) in slopes.iter_mut().zip(&self.groups) {
            // Loops, since `map` on arrays would compile to function calls.
            let (mut x, mut c) = ([Lanes::splat(0.0); K], [Lanes::splat(0.0); P]);
            for (x, places) in x.iter_mut().zip(&group.places) {
                *x = gathered(q, last, places);
            }
            for (c, parameters) in c.iter_mut().zip(&group.parameters) {
                *c = Lanes::new(*parameters);
            }
            let gradient = term.gradient(t, &column(x), &c);
            for k in 0..K {
                slopes[k] = gradient[k].to_array();
            }
        }
        let slopes = slopes.as_flattened().as_flattened();
        let mut rows = self.rows.iter();
        for targets in &self.targets {
            let mut sums = [0.0; LANES];
            for row in rows.by_ref().take(targets.rows) {
                for (sum, entry) in sums.iter_mut().zip(row) {
                    *sum += slopes.get(usize::from(*entry)).copied().unwrap_or(0.0);
                }
            }
            for (unknown, slope) in targets.unknowns.iter().zip(sums) {
                let at = *unknown as usize;
                if let Some(v) = v.get_mut(at) {
                    *v -= slope
                        * match weight {
                            Weight::Same(w) => w,
                            Weight::Masses(w, m) => w * m.get(at).copied().unwrap_or(0.0),
                        };
                }
            }
        }
    }
}

/// The values at eight indices. The indices are in range by construction; clamping them instead of branching lets the
/// compiler load the values directly into registers.
#[inline(always)]
fn gathered(q: &[f64], last: usize, [a, b, c, d, e, f, g, h]: &[u32; LANES]) -> Lanes {
    let at = |place: u32| q[(place as usize).min(last)];
    Lanes::new([at(*a), at(*b), at(*c), at(*d), at(*e), at(*f), at(*g), at(*h)])
}

/// The batches of all blocks.
pub(crate) fn batches<const K: usize, const P: usize>(
    elements: &Elements<K, P>,
    unknowns: usize,
) -> ByBlock<Batch<K, P>> {
    let blocks = blocks::count(unknowns);
    let mut of_block = Vec::new();
    for (e, places) in elements.loose.iter().enumerate() {
        let real = places.iter().filter(|p| (1..=unknowns).contains(&(**p as usize)));
        let mut of: Vec<u32> = real.map(|p| (*p - 1) / BLOCK as u32).collect();
        of.sort_unstable();
        of.dedup();
        of_block.extend(of.into_iter().map(|block| (block, e as u32)));
    }
    let of_block = ByBlock::new(blocks, of_block);
    let mut all = Vec::new();
    for block in 0..blocks {
        let chunks = of_block.of(block).chunks(GROUPS * LANES);
        all.extend(chunks.map(|numbers| (block as u32, Batch::new(elements, numbers, block, unknowns))));
    }
    ByBlock::new(blocks, all)
}
