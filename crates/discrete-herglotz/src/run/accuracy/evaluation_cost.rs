//! The cost of the parts of a trial run.

/// The cost of parts of a run, in evaluations of L at one stage.
pub(crate) struct EvaluationCost {
    /// A step that needs Newton's method: a few solutions of the dense equations of all stages, with second derivatives
    /// at each.
    pub newton: u64,
    /// A defect sample at as many points as there are stages, including the maps to the points.
    pub sample: u64,
}

impl EvaluationCost {
    /// The cost for this number of stages, in n coordinates.
    pub fn of(stages: usize, n: usize) -> Self {
        let (unknowns, stages) = ((stages * (n + 2)) as u64, stages as u64);
        // An evaluation takes as long as about 32 products; second derivatives are not computed in SIMD lanes.
        EvaluationCost { newton: 4 * (unknowns.pow(3) / 96 + 8 * stages * (2 * n as u64 + 1)), sample: 2 * stages }
    }
}
