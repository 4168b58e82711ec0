//! What a call costs: the run time from the Lagrangian to the outcome, where an error is requested, beside that of the
//! least expensive given steps that reach it.
//!
//! A call checks its input, selects its steps, makes its tables and integrates; the other tables of the program time the
//! integration alone. The ratio of the two columns of times is the price of the search for the steps.

use crate::candidate::{Candidate, Control, Run, RunError};
use crate::measure::{Effort, sweep, timed};
use crate::problems::{KEPLER, OSCILLATOR, PENDULUM, Problem, QUADRATIC, System};
use crate::row::{Action, Origin, fastest};
use contact_examples::{Directory, Failure, number, print};
use contact_geom::Lagrangian;
use discrete_herglotz::{AnyIntegrator, Until};
use formula_lagrangian::Formula;
use std::time::Instant;

/// The errors that are requested.
const ERRORS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];

/// The numbers of stages of the given steps.
const STAGES: [usize; 6] = [4, 6, 8, 10, 12, 16];

/// The columns of the table.
const COLUMNS: [&str; 10] =
    ["problem", "z", "requested", "error", "steps", "evaluations", "seconds", "given_method", "given_seconds", "ratio"];

/// Calls for a problem: with given steps of an integrator, or for a requested error.
struct Calls<L, const N: usize> {
    lagrangian: L,
    by: Option<AnyIntegrator>,
    name: String,
    problem: Problem,
    z: Action,
}

impl<L: Lagrangian<N>, const N: usize> Candidate for Calls<L, N> {
    fn name(&self) -> &str {
        &self.name
    }

    fn order(&self) -> u32 {
        self.by.map_or(0, |by| by.order())
    }

    fn control(&self) -> Control {
        if self.by.is_some() { Control::Step } else { Control::Tolerance }
    }

    fn run(&self, control: f64) -> Result<Run, RunError> {
        let clock = Instant::now();
        let motion = discrete_herglotz::Problem::new(&self.lagrangian, 0.0, self.problem.point())?;
        let run = match self.by {
            Some(by) => motion.by(by).steps(discrete_herglotz::Steps::Size(control)),
            None => motion.accuracy(control),
        };
        let run = if self.z == Action::On { run } else { run.without_action() };
        let outcome = run.run(Until::Time(self.problem.duration))?;
        let seconds = clock.elapsed().as_secs_f64();
        let n = outcome.q.len();
        let v = outcome.v.map_or_else(|| vec![f64::NAN; n], |v| v.iter().copied().collect());
        let state = outcome.q.iter().copied().chain(v).chain(outcome.z).collect();
        Ok(Run { state, steps: outcome.steps as u64, evaluations: outcome.evaluations, seconds })
    }
}

/// The call for a requested error, and those with given steps.
fn calls_of(problem: &Problem, z: Action) -> Result<Vec<Box<dyn Candidate>>, Failure> {
    if let Some(text) = problem.text {
        let formula = Formula::parse(text.formula, text.coordinates, text.parameters)?;
        return match text.coordinates.len() {
            1 => Ok(of(&formula.lagrangian::<1>()?, problem, z)),
            _ => Ok(of(&formula.lagrangian::<2>()?, problem, z)),
        };
    }
    Ok(match problem.system {
        System::Oscillator => of(&OSCILLATOR, problem, z),
        System::Pendulum => of(&PENDULUM, problem, z),
        System::Kepler => of::<_, 2>(&KEPLER, problem, z),
        System::Quadratic => of(&QUADRATIC, problem, z),
        System::Projectile | System::DoublePendulum => Vec::new(),
    })
}

fn of<L: Lagrangian<N> + Clone + 'static, const N: usize>(
    lagrangian: &L,
    problem: &Problem,
    z: Action,
) -> Vec<Box<dyn Candidate>> {
    let call = |by: Option<AnyIntegrator>| -> Box<dyn Candidate> {
        let name = by.map_or_else(|| "accuracy".to_owned(), |by| by.to_string());
        Box::new(Calls { lagrangian: lagrangian.clone(), by, name, problem: *problem, z })
    };
    let given = STAGES.into_iter().map(|stages| Some(AnyIntegrator::Gauss { stages }));
    [None].into_iter().chain(given).map(call).collect()
}

/// Measures the calls for a problem, and prints their table; returns its rows.
///
/// # Errors
/// Where the Lagrangian as text is invalid.
fn measured(problem: &Problem, z: Action) -> Result<Vec<[String; 10]>, Failure> {
    let calls = calls_of(problem, z)?;
    let Some((by_accuracy, given)) = calls.split_first() else { return Ok(Vec::new()) };
    let effort = Effort { quick: false };
    let rows: Vec<_> = given.iter().flat_map(|call| sweep(&**call, Origin::Library, problem, z, effort).rows).collect();
    let mut table = Vec::new();
    let mut text = format!("\n{}, {}, z {}: time of a call\n\n", problem.name, problem.title, z.name());
    text += "  requested     error     steps        time   given steps              time    ratio\n";
    for requested in ERRORS {
        let best = fastest(rows.iter(), requested);
        let name = best.map_or(String::new(), |row| format!("{} {}", row.method, row.steps));
        let least = best.map_or(f64::NAN, |row| row.seconds);
        let run = match timed(&**by_accuracy, requested) {
            Ok(run) => run,
            Err(error) => {
                text += &format!("  {requested:<9.0e} {error}\n");
                continue;
            }
        };
        let (error, ratio) = (problem.error(&run.state), run.seconds / least);
        let [own, other] = [run.seconds, least].map(|seconds| seconds * 1e6);
        text += &format!(
            "  {requested:<9.0e} {error:>9.1e} {:>9} {own:>8.1} us   {name:<16} {other:>9.1} us {ratio:>8.2}\n",
            run.steps
        );
        let [requested, error, seconds, least, ratio] = [requested, error, run.seconds, least, ratio].map(number);
        let [steps, evaluations] = [run.steps, run.evaluations].map(|count| count.to_string());
        let (problem, z) = (problem.name.to_owned(), z.name().to_owned());
        table.push([problem, z, requested, error, steps, evaluations, seconds, name, least, ratio]);
    }
    print(&text)?;
    Ok(table)
}

/// Measures the calls for problems, prints a table of each, and writes `calls.csv`.
///
/// # Errors
/// Where a Lagrangian as text is invalid, or the table cannot be written.
pub fn run(problems: impl Iterator<Item = (&'static Problem, Action)>, out: &Directory) -> Result<(), Failure> {
    let mut rows = Vec::new();
    for (problem, z) in problems {
        rows.extend(measured(problem, z)?);
    }
    out.table("calls.csv", &COLUMNS, rows)?;
    print(&format!(
        "\nA ratio is the time of a call for a requested error over that of the least expensive steps that reach it.\n\
         The table is in {}.\n",
        out.path().display()
    ))
}
