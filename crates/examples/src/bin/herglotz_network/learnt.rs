//! What a fitted network is: its motion beside that of the pendulum from a start that it was not fitted to, whether that
//! motion is contact, and the law of its drag.

use crate::training::{STAGES, STEP, TRUTH, network_states, smallest_mass, times, true_states};
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, number};
use contact_geom::nalgebra::SMatrix;
use contact_geom::numbers::max_or_nan;
use contact_geom::{Derivatives, PhasePoint, VelocityPoint, legendre};
use discrete_herglotz::sensitivity::{EndState, StateDerivative, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Start, Status, Steps, Until};
use formula_lagrangian::FormulaLagrangian;

/// The motion that is not among those of the fit: its start, and the number of its times.
const START: ([f64; 2], [f64; 2]) = ([0.9, -0.6], [0.0, 0.5]);
const TIMES: usize = 100;

/// The motion of a network, beside that of the pendulum.
pub struct Learnt {
    truth: Vec<EndState<2>>,
    found: Vec<EndState<2>>,
    /// `L_z` at the states of the network.
    rates: Vec<f64>,
    /// The smallest eigenvalue of the mass matrix along the motion.
    pub smallest_mass: f64,
    pub contact: Contact,
}

/// How far the map from the start to the end of a motion is from being contact.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// The logarithm of the conformal factor sigma.
    pub log_factor: f64,
    /// `|det d(q1, p1, z1)/d(q0, p0, z0) / sigma^3 - 1|`.
    pub determinant: f64,
    /// The largest component of `Phi^* eta - sigma eta`, for `eta = dz - p dq`.
    pub pullback: f64,
    /// The largest entry of the tangent, by which round-off is amplified.
    pub size: f64,
}

impl Learnt {
    /// Computes the motion of a network.
    pub fn new(network: &FormulaLagrangian<2>) -> Result<Self, Failure> {
        let (start, times) = (VelocityPoint::new(START.0, START.1, 0.0), times(TIMES));
        let (truth, found) = (true_states(start, &times)?, network_states(network, start, &times)?);
        let point = |x: &EndState<2>| VelocityPoint { q: x.q, v: x.v, z: x.z };
        let rates = found.iter().map(|x| network.gradient(x.t, &point(x)).z).collect();
        let masses: Option<Vec<f64>> = found.iter().map(|x| smallest_mass(network, x)).collect();
        let smallest_mass = masses.map_or(f64::NAN, |masses| masses.into_iter().fold(f64::INFINITY, f64::min));
        let contact = Contact::new(network, start, times.last().copied().unwrap_or(0.0))?;
        Ok(Learnt { truth, found, rates, smallest_mass, contact })
    }

    /// The largest difference of an angle up to a time.
    pub fn error_until(&self, t: f64) -> f64 {
        let pairs = self.truth.iter().zip(&self.found).filter(|(truth, _)| truth.t <= t);
        pairs
            .map(|(truth, found)| (truth.q - found.q).abs().iter().copied().fold(0.0, max_or_nan))
            .fold(0.0, max_or_nan)
    }

    /// The end of the motion.
    pub fn end(&self) -> f64 {
        self.truth.last().map_or(0.0, |state| state.t)
    }

    /// The mean of `L_z` along the motion.
    pub fn rate(&self) -> f64 {
        self.rates.iter().sum::<f64>() / self.rates.len() as f64
    }

    /// The largest difference of `L_z` along the motion from that of the pendulum.
    pub fn rate_error(&self) -> f64 {
        self.rates.iter().map(|rate| (rate - TRUTH.gamma).abs()).fold(0.0, max_or_nan)
    }

    /// Writes the motion as a table, and as a figure beside that of the untrained network and the drag law.
    pub fn write(&self, out: &Directory, untrained: &Learnt) -> Result<(), Failure> {
        let columns = ["t", "q1_true", "q2_true", "q1", "q2", "rate_true", "rate"];
        let rows = self.truth.iter().zip(&self.found).zip(&self.rates);
        let entries = rows.map(|((truth, found), rate)| {
            [truth.t, truth.q[0], truth.q[1], found.q[0], found.q[1], TRUTH.gamma, *rate].map(number)
        });
        out.table("herglotz_network.csv", &columns, entries)?;
        let angle = |states: &[EndState<2>]| states.iter().map(|x| (x.t, x.q[1])).collect::<Vec<_>>();
        let motion = Panel {
            x_label: "time t (dimensionless)".into(),
            y_label: "lower angle q2 (radians)".into(),
            x: Axis::Linear(0.0, 20.0, 5.0),
            y: Axis::Linear(-1.5, 2.0, 0.5),
            legend: (0.45, 0.98),
            curves: vec![
                Curve::new("network", Line::Solid, angle(&self.found)),
                Curve::new("pendulum", Line::Dashed, angle(&self.truth)),
                Curve::new("untrained network", Line::Dotted, angle(&untrained.found)),
            ],
            marks: Vec::new(),
        };
        let rates = |of: &Learnt| of.found.iter().zip(&of.rates).map(|(x, rate)| (x.t, *rate)).collect::<Vec<_>>();
        let drag = Panel {
            x_label: "time t (dimensionless)".into(),
            y_label: "rate L_z along the motion".into(),
            x: Axis::Linear(0.0, 20.0, 5.0),
            y: Axis::Linear(-0.2, 0.1, 0.05),
            legend: (0.45, 0.98),
            curves: vec![
                Curve::new("network", Line::Solid, rates(self)),
                Curve::new("pendulum", Line::Dashed, self.truth.iter().map(|x| (x.t, TRUTH.gamma))),
                Curve::new("untrained network", Line::Dotted, rates(untrained)),
            ],
            marks: Vec::new(),
        };
        out.text("herglotz_network.svg", &draw_row(&[motion, drag]))
    }
}

impl Contact {
    /// Of the motion of a network from a state at time 0.
    fn new(network: &FormulaLagrangian<2>, start: VelocityPoint<2>, end: f64) -> Result<Self, Failure> {
        let PhasePoint { q, p, z } = legendre(network, 0.0, &start);
        let problem = Problem::new(network, 0.0, Start::Momentum(PhasePoint { q, p, z }, start.v))?;
        let run = problem.by(GaussCollocation { stages: STAGES }).steps(Steps::Size(STEP)).with_conformal_factor();
        let variables = [0, 1].map(Variable::Position).into_iter().chain([0, 1].map(Variable::Momentum));
        let variables: Vec<Variable> = variables.chain([Variable::Action]).collect();
        let tangent = run.tangent(&variables, Until::Time(end))?;
        let outcome = &tangent.outcome;
        if outcome.status != Status::Completed {
            return Err(Failure::Run { what: "the network", status: outcome.status });
        }
        let entry = |i: usize, column: &StateDerivative<2>| match i {
            0 | 1 => column.q[i],
            2 | 3 => column.p[i - 2],
            _ => column.z,
        };
        let matrix = SMatrix::<f64, 5, 5>::from_fn(|i, j| entry(i, &tangent.columns[j]));
        let log_factor = outcome.log_factor.unwrap_or(f64::NAN);
        let factor = log_factor.exp();
        // eta = dz - p dq at the start: -p in q, 0 in p, 1 in z.
        let eta = [-p[0], -p[1], 0.0, 0.0, 1.0];
        let defects = tangent.columns.iter().zip(eta);
        let defects = defects.map(|(column, eta)| (column.z - outcome.p.dot(&column.q) - factor * eta).abs());
        Ok(Contact {
            log_factor,
            determinant: (matrix.determinant() / factor.powi(3) - 1.0).abs(),
            pullback: defects.fold(0.0, max_or_nan),
            size: matrix.iter().map(|x| x.abs()).fold(0.0, max_or_nan),
        })
    }
}
