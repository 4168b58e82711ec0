//! Three discrete flows with the same long step, compared with the motion.

use contact_examples::systems::{CoupledInZ, System};
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, number};
use contact_geom::{PhasePoint, legendre};
use discrete_herglotz::{
    DiscreteLagrangian,
    rules::{Flow, Rule},
};
use exact_lagrangian::{ExactLagrangian, herglotz_flow};

/// A pendulum whose inertia depends on position, velocity and action: nonlinear in z.
const SYSTEM: CoupledInZ = CoupledInZ { a: 0.5, b: 0.1, gamma: -0.1 };

/// The step, long enough for visible differences between the rules; the number of steps; and the points of the exact
/// curve per step.
const RUN: (f64, usize, usize) = (1.0, 15, 40);

/// Times and states.
type States = Vec<(f64, PhasePoint<1>)>;

/// A run of the discrete Hamiltonian flow.
fn run(ld: &impl DiscreteLagrangian<1>) -> Result<States, Failure> {
    let mut flow = Flow::new(ld, 0.0, legendre(&SYSTEM, 0.0, &SYSTEM.initial()))?;
    let mut states = vec![(0.0, *flow.state())];
    for _ in 0..RUN.1 {
        let step = flow.step()?;
        states.push((step.t, step.to));
    }
    Ok(states)
}

/// The motion. Each state is computed from the initial state in one call, independently of the steps of the exact
/// discrete flow.
fn curve() -> Result<States, Failure> {
    let (h, steps, fine) = RUN;
    let state = |k: usize| -> Result<(f64, PhasePoint<1>), Failure> {
        let t = h * k as f64 / fine as f64;
        let end = herglotz_flow(&SYSTEM, 0.0, &SYSTEM.initial(), t)?.end;
        Ok((t, legendre(&SYSTEM, t, &end)))
    };
    (0..=steps * fine).map(state).collect()
}

/// The largest distance of a run's positions from the curve at the same times.
fn distance(run: &States, curve: &States) -> f64 {
    let at_steps = curve.iter().step_by(RUN.2);
    run.iter().zip(at_steps).map(|(a, b)| (a.1.q[0] - b.1.q[0]).abs()).fold(0.0, f64::max)
}

/// Writes table and figure; returns a summary as text.
pub fn write(out: &Directory) -> Result<String, Failure> {
    let (h, steps, _) = RUN;
    let exact = run(&ExactLagrangian::<_, 1>::new(SYSTEM, h)?)?;
    let left = run(&Rule::LEFT_MIDPOINT.of::<1, _>(SYSTEM, h)?)?;
    let middle = run(&Rule::MIDPOINT.of::<1, _>(SYSTEM, h)?)?;
    let curve = curve()?;
    let columns = [
        "t",
        "q_exact",
        "p_exact",
        "z_exact",
        "q_left_midpoint",
        "p_left_midpoint",
        "z_left_midpoint",
        "q_midpoint",
        "p_midpoint",
        "z_midpoint",
    ];
    let rows = exact.iter().zip(&left).zip(&middle).map(|((e, l), m)| {
        let states = [e.1, l.1, m.1].into_iter().flat_map(|x| [x.q[0], x.p[0], x.z]);
        std::iter::once(e.0).chain(states).map(number)
    });
    out.table("exact_and_discrete_flows.csv", &columns, rows)?;

    let runs = Runs { curve: &curve, exact: &exact, left: &left, middle: &middle };
    let position = runs.panel("position q (dimensionless)", Axis::Linear(-2.0, 3.0, 1.0), (0.45, 0.98), |x| x.q[0]);
    let action = runs.panel("action z (dimensionless)", Axis::Linear(-2.0, 2.0, 1.0), (0.45, 0.98), |x| x.z);
    out.text("exact_and_discrete_flows.svg", &draw_row(&[position, action]))?;
    Ok(format!(
        "{steps} steps of h = {h}: largest distance of q from the motion\n  \
         exact {:.1e}, left midpoint {:.1e}, midpoint {:.1e}\n",
        distance(&exact, &curve),
        distance(&left, &curve),
        distance(&middle, &curve)
    ))
}

/// The curves of both panels.
struct Runs<'a> {
    /// The motion.
    curve: &'a States,
    /// The flow of the exact discrete Lagrangian.
    exact: &'a States,
    /// That of the paper's rule.
    left: &'a States,
    /// That of the rule made symmetric in z.
    middle: &'a States,
}

impl Runs<'_> {
    /// A panel with one coordinate of all runs over time.
    fn panel(&self, label: &str, y: Axis, legend: (f64, f64), entry: fn(&PhasePoint<1>) -> f64) -> Panel {
        let points = |states: &States| -> Vec<(f64, f64)> { states.iter().map(|(t, x)| (*t, entry(x))).collect() };
        Panel::new(
            ("time t (dimensionless)", Axis::Linear(0.0, 16.0, 4.0)),
            (label, y),
            legend,
            vec![
                Curve::new("motion", Line::Dashed, points(self.curve)),
                Curve::new("exact discrete flow", Line::Discs, points(self.exact)),
                Curve::new("left midpoint", Line::Crosses, points(self.left)),
                Curve::new("midpoint", Line::Pluses, points(self.middle)),
            ],
        )
    }
}
