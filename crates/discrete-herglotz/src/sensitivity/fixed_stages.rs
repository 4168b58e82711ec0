//! The solved stages of a step of a system whose number of coordinates is known at compile time.

use crate::StepError;
use crate::integration::SolvedStages;
use crate::numbers::registers::Stages;
use crate::sensitivity::stage_derivatives::StageVector;
use contact_geom::PhasePoint;

/// [`SolvedStages`] with a number of coordinates that is known at compile time.
pub(crate) struct FixedStages<'s, const N: usize> {
    pub s: usize,
    pub t: f64,
    pub h: f64,
    pub start: PhasePoint<N>,
    pub v: &'s StageVector<N>,
    pub force: &'s StageVector<N>,
    pub rate: &'s Stages,
    pub l: &'s Stages,
    pub knows_l: bool,
}

impl<'s, const N: usize> FixedStages<'s, N> {
    /// # Errors
    /// [`StepError::NonFinite`] for stages with another number of coordinates.
    pub fn of(step: &'s SolvedStages) -> Result<Self, StepError> {
        let SolvedStages { s, t, h, start, v, force, rate, l, knows_l } = step;
        let other = |_| StepError::NonFinite;
        let (v, force) = (v.as_slice().try_into().map_err(other)?, force.as_slice().try_into().map_err(other)?);
        Ok(FixedStages { s: *s, t: *t, h: *h, start: start.fixed(), v, force, rate, l, knows_l: *knows_l })
    }
}
