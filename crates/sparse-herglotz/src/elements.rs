//! Lists of elements, divided into runs of consecutive elements and other elements.

use crate::SparseError;
use crate::blocks::{BLOCK_SIZE, ByBlock, block_count};

/// Stands for an unknown of an element that is held at 0, for example at a wall.
pub const FIXED: usize = usize::MAX;

/// The unknowns and the parameters of one element. Converts from `[usize; K]`, and from `([usize; K], [f64; P])`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementData<const K: usize, const P: usize> {
    /// The unknowns, or [`FIXED`].
    pub unknowns: [usize; K],
    /// The parameters.
    pub parameters: [f64; P],
}

impl<const K: usize> From<[usize; K]> for ElementData<K, 0> {
    fn from(unknowns: [usize; K]) -> Self {
        ElementData { unknowns, parameters: [] }
    }
}

impl<const K: usize, const P: usize> From<([usize; K], [f64; P])> for ElementData<K, P> {
    fn from((unknowns, parameters): ([usize; K], [f64; P])) -> Self {
        ElementData { unknowns, parameters }
    }
}

/// The maximum number of unknowns of an element: the number of bits of [`RunSegment::slots`].
pub(crate) const MAX_ELEMENT_UNKNOWNS: usize = u32::BITS as usize;

/// The minimum number of elements of a run; fewer do not fill the eight lanes in which elements are evaluated.
const MIN_RUN_LENGTH: usize = 8;

/// Consecutive elements whose unknowns all increase by one, such as the bonds of a chain or of a row of a lattice.
/// Their unknowns are loaded from consecutive memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run<const K: usize> {
    /// The padded indices of the unknowns of the first element.
    pub start: [usize; K],
    /// The number of elements.
    pub len: usize,
    /// The index of the parameters of the first element.
    pub first: usize,
}

/// Consecutive unknowns of a block on which the same slots of a run act. Slot k is the k-th unknown of an element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunSegment {
    /// The index of the run.
    pub run: u32,
    /// The first unknown, relative to the first unknown of the block.
    pub from: u32,
    /// The end of the unknowns, exclusive.
    pub to: u32,
    /// The bit k is set if elements of the run have these unknowns in slot k.
    pub slots: u32,
}

/// Consecutive elements of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElementRange {
    /// The index of the run.
    pub run: u32,
    pub from: usize,
    pub to: usize,
}

/// The elements of one list. Unknowns have padded indices, which start from 1, so that [`FIXED`] has an index too: 0,
/// or the one after the last unknown.
///
/// The list is given element by element. It is divided into runs, which store no indices for each element, and the
/// remaining elements.
#[derive(Clone, Debug)]
pub(crate) struct Elements<const K: usize, const P: usize> {
    pub runs: Vec<Run<K>>,
    pub run_parameters: [Vec<f64>; P],
    /// The unknowns of each block on which runs act.
    pub segments: ByBlock<RunSegment>,
    /// The elements of runs by the block of their first unknown.
    pub ranges: ByBlock<ElementRange>,
    /// The padded indices of the unknowns of the elements outside runs.
    pub outside_runs: Vec<[u32; K]>,
    pub parameters_outside_runs: [Vec<f64>; P],
}

impl<const K: usize, const P: usize> Elements<K, P> {
    /// Checks the elements and finds the runs.
    pub fn new(
        list: usize,
        unknowns: usize,
        elements: impl IntoIterator<Item = impl Into<ElementData<K, P>>>,
    ) -> Result<Self, SparseError> {
        const { assert!(K >= 1 && K <= MAX_ELEMENT_UNKNOWNS, "a local term has from 1 to 32 unknowns") };
        let mut found = Elements {
            runs: Vec::new(),
            run_parameters: std::array::from_fn(|_| Vec::new()),
            segments: ByBlock::new(0, Vec::new()),
            ranges: ByBlock::new(0, Vec::new()),
            outside_runs: Vec::new(),
            parameters_outside_runs: std::array::from_fn(|_| Vec::new()),
        };
        let mut open: Option<Run<K>> = None;
        for (element, data) in elements.into_iter().enumerate() {
            let ElementData { unknowns: of_element, parameters } = data.into();
            check_element(list, element, unknowns, &of_element, &parameters)?;
            match &mut open {
                Some(run) if (0..K).all(|k| has_index(of_element[k], run.start[k] + run.len, unknowns)) => run.len += 1,
                _ => {
                    found.close_run(open.take());
                    let start = of_element.map(|u| if u == FIXED { 0 } else { u + 1 });
                    open = Some(Run { start, len: 1, first: found.run_parameters.first().map_or(0, Vec::len) });
                }
            }
            for (all, c) in found.run_parameters.iter_mut().zip(parameters) {
                all.push(c);
            }
        }
        found.close_run(open);
        found.divide_among_blocks(unknowns);
        Ok(found)
    }

    /// Stores a run, or its elements one by one if they are few.
    fn close_run(&mut self, run: Option<Run<K>>) {
        let Some(run) = run else { return };
        if run.len >= MIN_RUN_LENGTH {
            self.runs.push(run);
            return;
        }
        self.outside_runs.extend((0..run.len).map(|e| run.start.map(|s| (s + e) as u32)));
        for (outside, all) in self.parameters_outside_runs.iter_mut().zip(&mut self.run_parameters) {
            outside.append(&mut all.split_off(run.first));
        }
    }

    /// Divides the work among the blocks of unknowns.
    fn divide_among_blocks(&mut self, unknowns: usize) {
        let mut segments = Vec::new();
        let mut ranges = Vec::new();
        for (index, run) in self.runs.iter().enumerate() {
            let index = index as u32;
            push_segments(run, index, unknowns, &mut segments);
            // The fixed component before the first unknown belongs to the first block.
            let block_of = |e: usize| (run.start[0] + e).saturating_sub(1).min(unknowns - 1) / BLOCK_SIZE;
            let mut from = 0;
            while from < run.len {
                let block = block_of(from);
                let to = ((block + 1) * BLOCK_SIZE + 1 - run.start[0]).clamp(from + 1, run.len);
                let to = if block_of(run.len - 1) == block { run.len } else { to };
                ranges.push((block as u32, ElementRange { run: index, from, to }));
                from = to;
            }
        }
        let blocks = block_count(unknowns);
        self.segments = ByBlock::new(blocks, segments);
        self.ranges = ByBlock::new(blocks, ranges);
    }

    /// Calls a function with the padded indices of the unknowns of each element, first those of runs.
    pub fn visit(&self, mut f: impl FnMut([usize; K])) {
        for run in &self.runs {
            (0..run.len).for_each(|e| f(run.start.map(|s| s + e)));
        }
        self.outside_runs.iter().for_each(|indices| f(indices.map(|i| i as usize)));
    }
}

/// Whether an unknown has the given padded index; [`FIXED`] has the index after the last unknown here.
fn has_index(unknown: usize, index: usize, unknowns: usize) -> bool {
    if unknown == FIXED { index == unknowns + 1 } else { index == unknown + 1 }
}

/// Checks that the unknowns of an element exist and differ, and that its parameters are finite.
pub(crate) fn check_element(
    list: usize,
    element: usize,
    unknowns: usize,
    of_element: &[usize],
    parameters: &[f64],
) -> Result<(), SparseError> {
    for (k, &unknown) in of_element.iter().enumerate() {
        if unknown == FIXED {
            continue;
        }
        if unknown >= unknowns {
            return Err(SparseError::OutOfRange { list, element, unknown, last: unknowns - 1 });
        }
        if of_element[..k].contains(&unknown) {
            return Err(SparseError::Repeated { list, element, unknown });
        }
    }
    match parameters.iter().find(|c| !c.is_finite()) {
        Some(&value) => Err(SparseError::Parameter { list, element, value }),
        None => Ok(()),
    }
}

/// Divides the unknowns on which a run acts where a slot begins or ends, and at the ends of blocks.
fn push_segments<const K: usize>(run: &Run<K>, index: u32, unknowns: usize, segments: &mut Vec<(u32, RunSegment)>) {
    // The unknowns of a slot, without fixed components.
    let slot = |k: usize| (run.start[k].max(1) - 1)..(run.start[k] + run.len - 1).min(unknowns);
    let mut bounds: Vec<usize> = (0..K).flat_map(|k| [slot(k).start, slot(k).end]).collect();
    bounds.sort_unstable();
    bounds.dedup();
    for ends in bounds.windows(2) {
        let &[mut from, end] = ends else { continue };
        let slots = (0..K).filter(|k| slot(*k).contains(&from)).fold(0, |bits, k| bits | 1 << k);
        if slots == 0 {
            continue;
        }
        while from < end {
            let block = from / BLOCK_SIZE;
            let to = end.min((block + 1) * BLOCK_SIZE);
            let (from_in, to_in) = ((from - block * BLOCK_SIZE) as u32, (to - block * BLOCK_SIZE) as u32);
            segments.push((block as u32, RunSegment { run: index, from: from_in, to: to_in, slots }));
            from = to;
        }
    }
}
