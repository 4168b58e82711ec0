//! Calls that may not return or may crash the process, each made in a process of its own.

use crate::formula::{Formula, Kinetic, Rate, Smooth};
use crate::motion::Problem;
use contact_geom::{VelocityPoint, numbers::max_abs_or_nan};
use discrete_herglotz::{
    AnyIntegrator, InputError, Rows, Status, Stepper, Steps, gauss::TransformedStepper, rules::Method,
};
use exact_lagrangian::herglotz_flow;
use std::io::Read;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How a call ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Normally, with this output.
    Answered(String),
    /// By a panic or a signal.
    Crashed,
    /// The call did not end within the time limit.
    TimedOut,
}

impl Ended {
    pub fn text(&self) -> &str {
        match self {
            Ended::Answered(text) => text,
            Ended::Crashed => "crashed",
            Ended::TimedOut => "did not end",
        }
    }
}

/// A call: its name, the first words of the right answers, and the function.
pub type Probe = (&'static str, &'static [&'static str], fn() -> String);

/// The calls.
pub const PROBES: [Probe; 15] = [
    ("steps of 1e-300", &["refused"], || steps(Steps::Size(1e-300), None)),
    ("steps of 1e-17, with rows", &["refused"], || steps(Steps::Size(1e-17), Some(1))),
    ("2^61 steps, with rows", &["refused"], || steps(Steps::Count(1 << 61), Some(1))),
    ("2^64 - 1 steps", &["refused"], || steps(Steps::Count(usize::MAX), None)),
    ("a drag that is NaN, to 1e-9", &["refused"], || to(Formula::oscillator(f64::NAN), 1.0)),
    ("a force that is NaN, to 1e-9", &["refused"], || to(nan_spring(), 1.0)),
    ("a singular W, midpoint rule", &["refused", "halted"], || singular(AnyIntegrator::Discrete(Method::Midpoint))),
    ("a singular W, gauss_8", &["refused", "halted"], || singular(AnyIntegrator::Gauss { stages: 8 })),
    ("t0 infinite, gauss_8", &["refused"], late),
    ("a relativistic particle from q = 20, to 1e-9", &["right", "refused"], relativistic),
    ("a time transformation with a rate near zero", &["refused", "halted"], standing_clock),
    ("the exact flow into rest at a minimum", &["right"], exact_to_rest),
    ("the exact flow of subnormal numbers", &["right"], exact_in_subnormals),
    ("the exact flow into rest, not affine in z", &["right", "refused"], exact_to_fixed_point),
    ("a start at rest in a minimum, to 1e-9", &["right"], at_rest),
];

/// The answer of the call with a name; `None` if there is no such call.
pub fn answer(name: &str) -> Option<String> {
    PROBES.iter().find(|(known, ..)| *known == name).map(|(.., call)| call())
}

/// Makes a call in a process of its own.
pub fn ask(name: &str, time_limit: Duration) -> std::io::Result<Ended> {
    let mut child = Command::new(std::env::current_exe()?)
        .args(["--probe", name])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()?;
    let clock = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            let mut text = String::new();
            if let Some(mut out) = child.stdout.take() {
                out.read_to_string(&mut text)?;
            }
            return Ok(if status.success() { Ended::Answered(text.trim().into()) } else { Ended::Crashed });
        }
        if clock.elapsed() > time_limit {
            child.kill()?;
            child.wait()?;
            return Ok(Ended::TimedOut);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Runs a problem and describes the outcome; with a row every `stride` steps, if requested.
fn run<const N: usize>(
    problem: &Problem<N>,
    steps: Option<Steps>,
    integrator: Option<AnyIntegrator>,
    stride: Option<usize>,
) -> Result<String, InputError> {
    let mut rows = stride.map(Rows::every).transpose()?;
    let motion = problem.motion()?;
    let mut run = motion.accuracy(1e-9);
    if let Some(steps) = steps {
        run = run.by(AnyIntegrator::Gauss { stages: 8 }).steps(steps);
    }
    if let Some(integrator) = integrator {
        run = run.by(integrator);
    }
    if let Some(rows) = &mut rows {
        run = run.observe(rows);
    }
    let outcome = run.run(problem.end())?;
    Ok(match outcome.status {
        Status::Completed => format!("completed q = {:e}", outcome.q[0]),
        status => format!("halted: {status}"),
    })
}

fn described(result: Result<String, InputError>) -> String {
    result.unwrap_or_else(|refused| format!("refused: {refused}"))
}

fn oscillator() -> Problem<1> {
    let start = VelocityPoint::new([1.0], [0.0], 0.0);
    Problem { system: Formula::oscillator(-0.1), t0: 0.0, start, span: 1.0 }
}

fn steps(steps: Steps, stride: Option<usize>) -> String {
    described(run(&oscillator(), Some(steps), Some(AnyIntegrator::Discrete(Method::Midpoint)), stride))
}

fn nan_spring() -> Formula<1> {
    Formula { smooth: Smooth { spring: f64::NAN, ..Smooth::default() }, ..Formula::FREE }
}

fn to(system: Formula<1>, span: f64) -> String {
    described(run(&Problem { system, span, ..oscillator() }, None, None, None))
}

/// `L = v q - q^2/2 - 0.1 z`.
fn singular(integrator: AnyIntegrator) -> String {
    let smooth = Smooth { spring: 1.0, ..Smooth::default() };
    let system = Formula { kinetic: Kinetic::Singular, smooth, rate: Rate::Constant(-0.1), ..Formula::FREE };
    let start = VelocityPoint::new([1.0], [0.5], 0.0);
    described(run(&Problem { system, start, span: 10.0, t0: 0.0 }, Some(Steps::Count(100)), Some(integrator), None))
}

fn late() -> String {
    let problem = Problem { t0: f64::INFINITY, ..oscillator() };
    described(run(&problem, Some(Steps::Count(10)), Some(AnyIntegrator::Gauss { stages: 8 }), None))
}

fn relativistic() -> String {
    let smooth = Smooth { spring: 1.0, ..Smooth::default() };
    let system = Formula { kinetic: Kinetic::Relativistic, smooth, rate: Rate::Constant(-0.1), ..Formula::FREE };
    let start = VelocityPoint::new([20.0], [0.0], 0.0);
    let problem = Problem { system, start, t0: 0.0, span: 40.0 };
    let Ok(truth) = problem.exact_in(64) else { return "no reference".into() };
    match problem.to(1e-9) {
        crate::motion::RunEnd::Refused(cause) => format!("refused: {cause}"),
        crate::motion::RunEnd::Failed(cause) => format!("halted: {cause}"),
        end if end.error(&truth, 0.0) <= 1e-8 => "right".into(),
        end => format!("wrong by {:e}", end.error(&truth, 0.0)),
    }
}

/// Near Kepler's centre the rate dt/dtau of a radial time transformation is 1e-300.
fn standing_clock() -> String {
    let system = Formula::<2>::kepler(0.0);
    let start = VelocityPoint::new([1e-200, 0.0], [0.0, 1e100], 0.0);
    let ended = || -> Result<String, InputError> {
        let motion = discrete_herglotz::Problem::new(&system, 0.0, start)?;
        let mut run = TransformedStepper::new(&motion, 8, 0.1)?;
        Ok(match run.advance_to(1.0) {
            Ok(()) => format!("completed q = {:e}", Stepper::state(&run).q[0]),
            Err(failure) => format!("halted: {}", failure.cause),
        })
    };
    described(ended())
}

/// Compares the end of the exact flow with a point, to a few rounding errors.
fn exact(system: Formula<1>, start: VelocityPoint<1>, span: f64, end: [f64; 2]) -> String {
    match herglotz_flow(&system, 0.0, &start, span) {
        Ok(motion) => {
            let error = max_abs_or_nan([motion.end.q[0] - end[0], motion.end.v[0] - end[1]]);
            if error <= 1e-14 * max_abs_or_nan(end) { "right".into() } else { format!("wrong by {error:e}") }
        }
        Err(cause) => format!("refused: {cause}"),
    }
}

/// A double well with drag, which is at rest in a minimum long before the end.
fn exact_to_rest() -> String {
    let smooth = Smooth { spring: -1.0, quartic: 1.0, ..Smooth::default() };
    let system = Formula { smooth, rate: Rate::Constant(-0.5), ..Formula::FREE };
    exact(system, VelocityPoint::new([1.5], [0.0], 0.0), 400.0, [1.0, 0.0])
}

fn exact_in_subnormals() -> String {
    let start = VelocityPoint::new([1e-310], [0.0], 0.0);
    match herglotz_flow(&Formula::<1>::oscillator(0.0), 0.0, &start, 10.0) {
        // Adjacent doubles of this size are 5e-324 apart.
        Ok(motion) if (motion.end.q[0] - 1e-310 * 10f64.cos()).abs() <= 1e-320 => "right".into(),
        Ok(motion) => format!("wrong: q = {:e}", motion.end.q[0]),
        Err(cause) => format!("refused: {cause}"),
    }
}

/// `v^2/2 - q^2/2 + q - z/2 - z^2/2`: the drag grows with z, and the motion comes to rest at `q = 1`.
fn exact_to_fixed_point() -> String {
    let smooth = Smooth { spring: 1.0, linear: -1.0, ..Smooth::default() };
    let system = Formula { smooth, action: 1.0, rate: Rate::Constant(-0.5), ..Formula::FREE };
    exact(system, VelocityPoint::new([0.5], [0.5], -0.2), 200.0, [1.0, 0.0])
}

fn at_rest() -> String {
    let start = VelocityPoint::new([0.0], [0.0], 0.0);
    let problem = Problem { start, span: 100.0, ..oscillator() };
    match run(&problem, None, None, None) {
        Ok(text) if text == "completed q = 0e0" => "right".into(),
        other => described(other),
    }
}
