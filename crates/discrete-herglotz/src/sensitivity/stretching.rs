//! The stretching of a frame of tangents along a run.

use crate::StepError;
use crate::sensitivity::columns::Column;

/// The logarithms of the factors by which a frame has been stretched, direction by direction.
pub(super) struct Stretching {
    pub logarithms: Vec<f64>,
    /// The time in the middle of the run.
    half: f64,
    /// A time with the logarithms there: the first one in the second half of the run.
    middle: Option<(f64, Vec<f64>)>,
    /// The last one within a step before it.
    before: Option<(f64, Vec<f64>)>,
}

impl Stretching {
    /// That of a frame of so many columns, for a run between two times.
    pub fn new(columns: usize, (t0, t_end): (f64, f64)) -> Self {
        Stretching { logarithms: vec![0.0; columns], half: 0.5 * (t0 + t_end), middle: None, before: None }
    }

    /// Makes columns orthonormal, in their order, and adds the logarithms of their lengths; a second pass makes them
    /// orthogonal to round-off. `times`, the derivatives of a time along the columns, go with them.
    ///
    /// # Errors
    /// [`StepError::NonFinite`] for columns that are dependent or not finite.
    pub fn orthonormalise(&mut self, columns: &mut [Column], times: &mut [f64]) -> Result<(), StepError> {
        for (i, logarithm) in self.logarithms.iter_mut().enumerate() {
            let (before, rest) = columns.split_at_mut(i);
            let (times_before, times_rest) = times.split_at_mut(i);
            let (Some(column), Some(time)) = (rest.first_mut(), times_rest.first_mut()) else { return Ok(()) };
            for _ in 0..2 {
                for (other, of_other) in before.iter().zip(&*times_before) {
                    let factor = -column.dot(other);
                    column.add_multiple(factor, other);
                    *time += factor * of_other;
                }
            }
            let length = column.dot(column).sqrt();
            if !(length > 0.0 && length.is_finite()) {
                return Err(StepError::NonFinite);
            }
            *logarithm += length.ln();
            column.scale(1.0 / length);
            *time /= length;
        }
        Ok(())
    }

    /// Notes a time within a step, in a run in this direction.
    pub fn note_within(&mut self, t: f64, is_backward: bool) {
        let is_later = if is_backward { t <= self.half } else { t >= self.half };
        match (is_later, &self.middle) {
            (true, None) => self.middle = Some((t, self.logarithms.clone())),
            (false, None) => self.before = Some((t, self.logarithms.clone())),
            _ => {}
        }
    }

    /// Notes the end of a step in the second half of the run.
    pub fn note_end(&mut self, t: f64) {
        if self.middle.is_none() {
            self.middle = Some((t, self.logarithms.clone()));
        }
    }

    /// The time and the logarithms from which the second half of a run to a time is counted: at the nearest time to its
    /// middle that was noted, or at its start.
    pub fn middle(&self, t0: f64, t: f64) -> (f64, Vec<f64>) {
        let noted = [&self.middle, &self.before].into_iter().flatten().find(|(middle, _)| *middle != t);
        noted.cloned().unwrap_or_else(|| (t0, vec![0.0; self.logarithms.len()]))
    }
}
