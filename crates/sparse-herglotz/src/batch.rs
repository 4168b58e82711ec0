//! Forces of the elements outside runs, for a batch of SIMD registers at a time.

use crate::Potential;
use crate::blocks::{BLOCK_SIZE, ByBlock, block_count};
use crate::elements::{Elements, MAX_ELEMENT_UNKNOWNS};
use crate::kick::KickFactor;
use crate::lanes::{LANES, Lanes};
use crate::potential::vector;

/// Number of groups of [`LANES`] elements in a batch: few enough that their forces stay in the L1 cache, and enough
/// that several forces on one unknown are summed before they are added to its velocity.
const GROUPS_PER_BATCH: usize = 4;

/// Elements with unknowns in one block. All elements are evaluated first; then the forces on each unknown are summed
/// and applied at once. If the elements updated the velocities one after the other, each update would have to wait for
/// the preceding one.
#[derive(Clone, Debug)]
pub(crate) struct Batch<const K: usize, const P: usize> {
    groups: Vec<ElementGroup<K, P>>,
    targets: Vec<TargetUnknowns>,
    /// The rows of `targets`, one target after the other: each row holds one index per lane into the forces of the
    /// groups.
    rows: Vec<[u16; LANES]>,
}

/// Up to [`LANES`] elements, one per lane; unused lanes repeat the first element.
#[derive(Clone, Debug)]
struct ElementGroup<const K: usize, const P: usize> {
    /// The padded indices of their unknowns.
    indices: [[u32; LANES]; K],
    parameters: [[f64; LANES]; P],
}

/// Unknowns of the block on which the elements act, one per lane.
#[derive(Clone, Copy, Debug)]
struct TargetUnknowns {
    /// Indices relative to the first unknown of the block; unused lanes hold an index beyond the last.
    unknowns: [u32; LANES],
    /// The number of rows of these unknowns.
    rows: usize,
}

impl<const K: usize, const P: usize> Batch<K, P> {
    /// The batch of the elements with these indices, for the unknowns of a block.
    fn new(elements: &Elements<K, P>, element_indices: &[u32], block: usize, unknowns: usize) -> Self {
        const {
            assert!(
                (GROUPS_PER_BATCH + 1) * LANES * MAX_ELEMENT_UNKNOWNS <= 1 << 16,
                "an entry has 16 bits, an element up to 32 unknowns"
            )
        };
        let index = |e: u32, k: usize| elements.outside_runs.get(e as usize).map_or(0, |indices| indices[k]);
        let parameter =
            |e: u32, p: usize| elements.parameters_outside_runs[p].get(e as usize).copied().unwrap_or(f64::NAN);
        let groups = element_indices.chunks(LANES).map(|group| {
            let element = |lane: usize| group.get(lane).or(group.first()).copied().unwrap_or(0);
            ElementGroup {
                indices: std::array::from_fn(|k| std::array::from_fn(|lane| index(element(lane), k))),
                parameters: std::array::from_fn(|p| std::array::from_fn(|lane| parameter(element(lane), p))),
            }
        });
        // Fixed components and unknowns of other blocks are skipped.
        let inside = block * BLOCK_SIZE + 1..((block + 1) * BLOCK_SIZE).min(unknowns) + 1;
        let mut all = Vec::new();
        for (i, e) in element_indices.iter().enumerate() {
            for k in 0..K {
                let padded = index(*e, k) as usize;
                if inside.contains(&padded) {
                    let entry = (i / LANES * K + k) * LANES + i % LANES;
                    all.push(((padded - inside.start) as u32, entry as u16));
                }
            }
        }
        all.sort_by_key(|(unknown, _)| *unknown);
        let (mut targets, mut rows) = (Vec::new(), Vec::new());
        let by_unknown: Vec<&[(u32, u16)]> = all.chunk_by(|a, b| a.0 == b.0).collect();
        for lanes in by_unknown.chunks(LANES) {
            let longest = lanes.iter().map(|entries| entries.len()).max().unwrap_or(0);
            let unknown = |lane: usize| lanes.get(lane).and_then(|entries| entries.first()).map_or(u32::MAX, |e| e.0);
            targets.push(TargetUnknowns { unknowns: std::array::from_fn(unknown), rows: longest });
            // Unused entries of a row refer to the zeros after the groups.
            let unused = (GROUPS_PER_BATCH * K * LANES) as u16;
            let entry = |lane: usize, i: usize| lanes.get(lane).and_then(|entries| entries.get(i));
            rows.extend((0..longest).map(|i| std::array::from_fn(|lane| entry(lane, i).map_or(unused, |e| e.1))));
        }
        Batch { groups: groups.collect(), targets, rows }
    }

    /// Adds the forces, times the factor, to the velocities of the block.
    #[inline(always)]
    pub fn kick<V: Potential<K, P>>(&self, term: &V, t: Lanes, q: &[f64], factor: KickFactor, v: &mut [f64]) {
        let Some(last) = q.len().checked_sub(1) else { return };
        let mut slopes = [[[0.0; LANES]; K]; GROUPS_PER_BATCH + 1];
        for (slopes, group) in slopes.iter_mut().zip(&self.groups) {
            // Loops, since `map` on arrays would compile to function calls.
            let (mut x, mut c) = ([Lanes::splat(0.0); K], [Lanes::splat(0.0); P]);
            for (x, indices) in x.iter_mut().zip(&group.indices) {
                *x = gathered(q, last, indices);
            }
            for (c, parameters) in c.iter_mut().zip(&group.parameters) {
                *c = Lanes::new(*parameters);
            }
            let gradient = term.gradient(t, &vector(x), &c);
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
                let unknown = *unknown as usize;
                if let Some(v) = v.get_mut(unknown) {
                    *v -= slope
                        * match factor {
                            KickFactor::Uniform(w) => w,
                            KickFactor::InverseMasses(w, m) => w * m.get(unknown).copied().unwrap_or(0.0),
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
    let at = |index: u32| q[(index as usize).min(last)];
    Lanes::new([at(*a), at(*b), at(*c), at(*d), at(*e), at(*f), at(*g), at(*h)])
}

/// The batches of all blocks.
pub(crate) fn batches<const K: usize, const P: usize>(
    elements: &Elements<K, P>,
    unknowns: usize,
) -> ByBlock<Batch<K, P>> {
    let blocks = block_count(unknowns);
    let mut of_block = Vec::new();
    for (e, indices) in elements.outside_runs.iter().enumerate() {
        let free = indices.iter().filter(|i| (1..=unknowns).contains(&(**i as usize)));
        let mut of: Vec<u32> = free.map(|i| (*i - 1) / BLOCK_SIZE as u32).collect();
        of.sort_unstable();
        of.dedup();
        of_block.extend(of.into_iter().map(|block| (block, e as u32)));
    }
    let of_block = ByBlock::new(blocks, of_block);
    let mut all = Vec::new();
    for block in 0..blocks {
        let chunks = of_block.in_block(block).chunks(GROUPS_PER_BATCH * LANES);
        all.extend(chunks.map(|chunk| (block as u32, Batch::new(elements, chunk, block, unknowns))));
    }
    ByBlock::new(blocks, all)
}
