//! Rows as a CSV file, written during the run.

use crate::InputError;
use crate::run::{Observer, OutputRequest, Rows, RunInfo, StepView, Stop};
use std::io::Write;
use std::ops::ControlFlow;

/// Writes rows as CSV during the run, without keeping them: a header, then the numbers of each row with all digits.
///
/// ```
/// use contact_examples::systems::{OneCoordinate, Pendulum};
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{CsvRows, GaussCollocation, Problem, Rows, Steps, Until};
/// let pendulum = OneCoordinate::from(Pendulum { gamma: -0.1 });
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let mut csv = CsvRows::new(Rows::every(10)?.with_energy(), std::io::stdout());
/// problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.1)).observe(&mut csv).run(Until::Time(10.0))?;
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct CsvRows<'f, W: Write> {
    rows: Rows<'f>,
    writer: csv::Writer<W>,
    /// The error with which writing a row failed; it ends the run.
    pub error: Option<csv::Error>,
}

impl<'f, W: Write> CsvRows<'f, W> {
    /// Writes these rows to a file or another writer.
    pub fn new(rows: Rows<'f>, to: W) -> Self {
        CsvRows { rows, writer: csv::Writer::from_writer(to), error: None }
    }

    fn write(&mut self, k: usize, last: bool) -> csv::Result<()> {
        if k == 0 {
            self.writer.write_record(self.rows.header())?;
        }
        for row in self.rows.rows.drain(..) {
            self.writer.write_record(row.numbers().map(|x| format!("{x:e}")))?;
        }
        if last { Ok(self.writer.flush()?) } else { Ok(()) }
    }

    fn written(&mut self, flow: ControlFlow<Stop>, at: &StepView<'_>) -> ControlFlow<Stop> {
        if let Err(error) = self.write(at.k, at.last || flow.is_break()) {
            self.error = Some(error);
            return ControlFlow::Break(Stop::here("a failure to write a row"));
        }
        flow
    }
}

impl<W: Write> Observer for CsvRows<'_, W> {
    fn needs(&self) -> OutputRequest {
        self.rows.needs()
    }

    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.rows.prepare(info)
    }

    fn next(&self, taken: usize) -> usize {
        self.rows.next(taken)
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        let flow = self.rows.start(at);
        self.written(flow, at)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        let flow = self.rows.step(at);
        self.written(flow, at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_lagrangians::OnLine;
    use crate::{GaussCollocation, Problem, Status, Steps, Until};
    use contact_examples::systems::Pendulum;
    use contact_geom::VelocityPoint;

    fn run(observer: &mut impl Observer) -> Status {
        let pendulum = OnLine::from(Pendulum { gamma: -0.1 });
        let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.3], 0.0)).unwrap();
        let run = problem.by(GaussCollocation { stages: 3 }).steps(Steps::Size(0.1)).observe(observer);
        run.run(Until::Time(2.0)).unwrap().status
    }

    fn rows<'f>() -> Rows<'f> {
        Rows::every(3).unwrap().with_energy().column("q^2", |_, x| x.q[0] * x.q[0])
    }

    /// The numbers in the file are bitwise those of the rows.
    #[test]
    fn the_file_has_the_rows() {
        let (mut kept, mut text) = (rows(), Vec::new());
        assert_eq!(run(&mut kept), Status::Completed);
        let mut csv = CsvRows::new(rows(), &mut text);
        assert_eq!((run(&mut csv), csv.error.is_none()), (Status::Completed, true));
        drop(csv);
        let mut reader = csv::Reader::from_reader(text.as_slice());
        assert_eq!(reader.headers().unwrap(), vec!["t", "q0", "p0", "z", "energy", "q^2"]);
        let read: Vec<Vec<f64>> = reader.deserialize().map(Result::unwrap).collect();
        assert_eq!(read, kept.rows.iter().map(|row| row.numbers().collect::<Vec<_>>()).collect::<Vec<_>>());
    }

    /// A full disk ends the run, with the cause.
    #[test]
    fn a_row_that_cannot_be_written_ends_the_run() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let mut csv = CsvRows::new(rows(), Full);
        let status = run(&mut csv);
        assert!(matches!(status, Status::Stopped { by: "a failure to write a row", .. }), "{status:?}");
        assert!(csv.error.is_some());
    }
}
