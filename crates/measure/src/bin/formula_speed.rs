//! Run time of Lagrangians given as formulas, relative to Rust types of the same Lagrangians.
//!
//! ```text
//! cargo run --release --features timings --bin formula_speed -- [--out DIR] [--rounds 15]
//! ```
//!
//! The formula and the type of each system run alternately, `--rounds` times, and the medians of the run times are
//! compared. Writes `formula_speed.csv` into `--out`: system, integrator, both times in seconds, their ratio, and the
//! difference of the final `q[0]`. Prints the same numbers, and the median time from the text of a formula to the end
//! of the first step.

use clap::Parser;
use contact_geom::systems::{DoublePendulum, HarmonicOscillator, Kepler, Pendulum, QuadraticInZ};
use contact_geom::{Lagrangian, VelocityPoint};
use discrete_herglotz::{GaussCollocation, Problem, SplittingScheme, Steps, Until};
use formula_lagrangian::{Formula, FormulaLagrangian};
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

/// Measures the run time of Lagrangians given as formulas, relative to Rust types.
#[derive(Parser)]
struct Arguments {
    /// The directory of the table; created where it does not exist.
    #[arg(long, default_value = "out")]
    out: PathBuf,
    /// The number of runs of each pair.
    #[arg(long, default_value_t = 15)]
    rounds: usize,
}

/// A Lagrangian as a formula and as a type, with initial values.
struct Case<'a, L, const N: usize> {
    name: &'a str,
    formula: Formula,
    typed: L,
    start: VelocityPoint<N>,
    /// The step, and the duration of a run.
    h: f64,
    time: f64,
}

/// The table and the number of runs of each pair.
struct Table {
    rounds: usize,
    csv: csv::Writer<std::fs::File>,
}

/// Integrates by Gauss collocation with the given number of stages, or by `blanes_moan_6` without one. Returns the run
/// time in seconds, without planning, and the final `q[0]`.
fn run<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    case: (VelocityPoint<N>, f64, f64),
    stages: Option<usize>,
) -> Result<(f64, f64), Box<dyn Error>> {
    let (start, h, time) = case;
    let problem = Problem::new(lagrangian, 0.0, start)?;
    let run = match stages {
        Some(stages) => problem.by(GaussCollocation { stages }),
        None => problem.by(SplittingScheme::BLANES_MOAN_6),
    };
    let plan = run.steps(Steps::Size(h)).plan(Until::Time(time))?;
    let begin = Instant::now();
    let outcome = plan.run()?;
    Ok((begin.elapsed().as_secs_f64(), outcome.q[0]))
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

impl Table {
    fn compare<L: Lagrangian<N>, const N: usize>(
        &mut self,
        case: &Case<'_, L, N>,
        integrators: &[(&str, Option<usize>)],
    ) -> Result<(), Box<dyn Error>> {
        let formula: FormulaLagrangian<N> = case.formula.lagrangian()?;
        for (name, stages) in integrators {
            let at = (case.start, case.h, case.time);
            let (mut ours, mut theirs, mut off) = (Vec::new(), Vec::new(), 0.0);
            for _ in 0..self.rounds {
                let (formula_time, q) = run(&formula, at, *stages)?;
                let (typed_time, of_typed) = run(&case.typed, at, *stages)?;
                off = q - of_typed;
                ours.push(formula_time);
                theirs.push(typed_time);
            }
            let (ours, theirs) = (median(&mut ours), median(&mut theirs));
            let ratio = ours / theirs;
            println!(
                "{:20} {name:16} {ratio:6.3}  ({:.1} us, {:.1} us; q differs by {off:.1e})",
                case.name,
                ours * 1e6,
                theirs * 1e6
            );
            let numbers = [ours, theirs, ratio, off].map(|x| x.to_string());
            self.csv.write_record([case.name, *name].map(str::to_owned).into_iter().chain(numbers))?;
        }
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let Arguments { out, rounds } = Arguments::parse();
    std::fs::create_dir_all(&out)?;
    let mut csv = csv::Writer::from_path(out.join("formula_speed.csv"))?;
    csv.write_record(["system", "integrator", "formula_seconds", "type_seconds", "ratio", "difference_of_q"])?;
    let mut table = Table { rounds, csv };
    let all = [("gauss_8", Some(8)), ("gauss_16", Some(16)), ("blanes_moan_6", None)];
    let [first, second, _] = all;
    let gauss = [first, second];

    let pendulum = "theta'^2/2 - 1 + cos(theta) + gamma*z";
    table.compare(
        &Case {
            name: "pendulum",
            formula: Formula::parse(pendulum, &["theta"], &[("gamma", -0.01)])?,
            typed: Pendulum { gamma: -0.01 },
            start: VelocityPoint::new([1.0], [0.0], 0.0),
            h: 0.5,
            time: 1000.0,
        },
        &all,
    )?;
    let oscillator = HarmonicOscillator::default();
    table.compare(
        &Case {
            name: "oscillator",
            formula: Formula::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", oscillator.gamma)])?,
            typed: oscillator,
            start: VelocityPoint::new([1.0], [0.0], 0.0),
            h: 0.5,
            time: 1000.0,
        },
        &all,
    )?;
    table.compare(
        &Case {
            name: "kepler",
            formula: Formula::parse(
                "(x'^2 + y'^2)/2 + mu/sqrt(x^2 + y^2) + gamma*z",
                &["x", "y"],
                &[("mu", 1.0), ("gamma", -1e-3)],
            )?,
            typed: Kepler::<2> { mu: 1.0, gamma: -1e-3 },
            start: VelocityPoint::new([0.5, 0.0], [0.0, 3f64.sqrt()], 0.0),
            h: 0.2,
            time: 200.0,
        },
        &all,
    )?;
    let quadratic = QuadraticInZ::default();
    table.compare(
        &Case {
            name: "quadratic_in_z",
            formula: Formula::parse("v[0]^2/2 - x^2/2 - c*z^2/2", &["x"], &[("c", quadratic.c)])?,
            typed: quadratic,
            start: VelocityPoint::new([1.0], [0.0], 0.0),
            h: 0.5,
            time: 200.0,
        },
        &gauss,
    )?;
    let text = "x'^2 + y'^2/2 + cos(x - y)*x'*y' - 2*(1 - cos(x)) - (1 - cos(y)) + gamma*z";
    table.compare(
        &Case {
            name: "double_pendulum",
            formula: Formula::parse(text, &["x", "y"], &[("gamma", -0.1)])?,
            typed: DoublePendulum::default(),
            start: VelocityPoint::new([1.5, 2.0], [0.0, 0.0], 0.0),
            h: 0.2,
            time: 50.0,
        },
        &gauss,
    )?;
    table.csv.flush()?;

    let mut times = Vec::new();
    for _ in 0..rounds.max(1) {
        let begin = Instant::now();
        let formula = Formula::parse(pendulum, &["theta"], &[("gamma", -0.01)])?.lagrangian::<1>()?;
        let problem = Problem::new(&formula, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
        problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.5)).run(Until::Steps(1))?;
        times.push(begin.elapsed().as_secs_f64());
    }
    println!("time from the text of the pendulum to the end of its first step: {:.3} ms", median(&mut times) * 1e3);
    Ok(())
}
