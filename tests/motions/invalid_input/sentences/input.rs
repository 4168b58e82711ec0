//! Errors of the input, and the reasons for which an accuracy is not reached.

use super::{name_of_variant, variants};
use super::{pendulum_at, strong};
use crate::common::gauss::GaussSteppers;
use crate::lagrangians::{One, one};
use contact_examples::systems::constrained::RigidPendulum;
use contact_examples::systems::{CoupledInZ, Kepler, Pendulum};
use contact_geom::constraints::Constraint;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::dot;
use contact_geom::{
    ContactHamiltonian, DiscretePoint, Forced, Hints, Lagrangian, OfHamiltonian, PhasePoint, Scalar, Structure,
    VelocityDrag, VelocityPoint,
};
use discrete_herglotz::boundary::{BoundaryPath, End};
use discrete_herglotz::constraints::{Constrained, ConstrainedMethod};
use discrete_herglotz::gauss::Gauss;
use discrete_herglotz::hamiltonian::{HamiltonianSplitting, Kinetic, PieceStepper, Quadratic};
use discrete_herglotz::rules::{Composition, Flow, Method, Rule};
use discrete_herglotz::splitting::Strang;
use discrete_herglotz::theory::DiscretePath;
use discrete_herglotz::{
    AnyIntegrator, Checkpoint, DiscreteLagrangian, InputError, Integrator, Interrupt, MethodInfo, Problem, ResumeState,
    Rows, SelectionFailure, SplittingScheme, State, StepError, StepFailure, Stepper, StepperOptions, Steps, Until,
};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Switching functions that are not declared.
#[derive(Clone, Copy, Debug)]
pub struct Unstated;

impl Lagrangian<1> for Unstated {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0].abs()
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
}

/// A ridge on a circle.
#[derive(Clone, Copy, Debug)]
pub struct Ridge;

impl Lagrangian<2> for Ridge {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        dot(v, v) * 0.5 - q[0].abs()
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<2>, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
}

impl Constraint<2, 1> for Ridge {
    fn value<T: Scalar>(&self, q: &SVector<T, 2>) -> SVector<T, 1> {
        [dot(q, q) - 1.0].into()
    }
}

/// Declares to be quadratic, and is not.
#[derive(Clone, Copy, Debug)]
pub struct FalselyQuadratic;

impl Lagrangian<1> for FalselyQuadratic {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].powi(3) - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { quadratic: true, ..Structure::default() }
    }
}

/// A free particle whose transformed time stands still.
struct Stopped;

impl Lagrangian<1> for Stopped {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, ..Structure::default() }
    }
    fn dt_dtau<T: Scalar>(&self, _q: &SVector<T, 1>) -> T {
        T::zero()
    }
}

/// `H = 2 p`, whose motion has one velocity only.
struct Shift;

impl ContactHamiltonian<1> for Shift {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
        p[0] * 2.0
    }
}

struct Nothing;

impl Lagrangian<0> for Nothing {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 0>, _v: &SVector<T, 0>, z: T) -> T {
        z
    }
}

/// The length of the step to a power: singular on the diagonal.
struct Length;

impl DiscreteLagrangian<1> for Length {
    fn step_size(&self) -> f64 {
        0.1
    }
    fn value<T: Scalar>(&self, _t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
        let d = x.q1[0] - x.q0[0];
        Ok(d * d.sqrt() - x.z0 * 0.01)
    }
}

/// The contact Hamiltonian of an oscillator with drag.
fn spring() -> Quadratic<1> {
    let one = SMatrix::identity();
    Quadratic::new(one, one * 0.0, one, -0.1)
}

/// An integrator with the required functions alone.
struct Minimal;

struct Bare<'a>(Box<dyn Stepper + 'a>);

impl<'a> Integrator<'a, One, 1> for Minimal {
    fn info(&self) -> MethodInfo {
        MethodInfo::of_discrete::<1>("forgetful", 2)
    }
    fn check(&self, _: &One) -> Result<(), InputError> {
        Ok(())
    }
    fn stepper(
        &self,
        problem: &Problem<'a, One, 1>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        Ok(Box::new(Bare(Method::Midpoint.stepper(problem, h, options)?)))
    }
}

impl Stepper for Bare<'_> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        self.0.advance(steps)
    }
    fn state(&self) -> State {
        self.0.state()
    }
    fn time(&self) -> f64 {
        self.0.time()
    }
    fn sigma(&self) -> f64 {
        self.0.sigma()
    }
    fn evaluations(&self) -> u64 {
        self.0.evaluations()
    }
}

#[test]
fn input_errors() {
    let (pendulum, start) = (one(Pendulum::default()), VelocityPoint::new([0.3], [0.5], 0.1));
    let problem = Problem::new(&pendulum, 0.5, start).unwrap();
    let in_steps = |steps| problem.steps(steps).plan(Until::Time(5.5)).err().unwrap();
    let kepler = Kepler::<2>::default();
    every!(InputError, "discrete-herglotz/src/error/mod.rs" {
        InputError::Step { .. } => in_steps(Steps::Size(-0.25)), ["-0.25", "finite nonzero number", "positive if the end of the run gives"];
        InputError::Span { .. } => problem.steps(Steps::Count(1)).plan(Until::Time(f64::INFINITY)).err().unwrap(), ["is inf;", "finite and nonzero", "negative for a run backward"];
        InputError::Accuracy { .. } => {
            let run = problem.by(AnyIntegrator::Gauss { stages: 8 }).accuracy(1e-17);
            run.plan(Until::Time(5.5)).err().unwrap()
        }, ["1e-17", "request a larger error"];
        InputError::Tolerance { .. } => problem.accuracy(-0.5).plan(Until::Time(5.5)).err().unwrap(), ["-0.5", "positive and finite"];
        InputError::Scale { .. } => problem.accuracy(0.5).scales([-2.5]).plan(Until::Time(5.5)).err().unwrap(), ["coordinate 0", "-2.5", "positive and finite"];
        InputError::TooMany { .. } => in_steps(Steps::Size(1e-300)), ["the number of steps", "e300", "longer steps"];
        InputError::NoSteps => problem.by(AnyIntegrator::Gauss { stages: 8 }).plan(Until::Time(5.5)).err().unwrap(), ["`steps`", "`accuracy`"];
        InputError::NoIntegrator => problem.accuracy(0.5).steps(Steps::Count(1)).plan(Until::Time(5.5)).err().unwrap(), ["`by`", "`accuracy`"];
        InputError::Interrupted => {
            let asked = || true;
            let interrupted = problem.with_interrupt(Interrupt::when(&asked));
            interrupted.accuracy(1e-6).plan(Until::Time(5.5)).err().unwrap()
        }, ["the trial runs were interrupted", "run again", "give a step"];
        InputError::AnotherRun => {
            let path = std::env::temp_dir().join(format!("another_run_{}", std::process::id()));
            let mut saved = Checkpoint::every(1, &path).unwrap();
            problem.steps(Steps::Count(1)).observe(&mut saved).run(Until::Time(5.5)).unwrap();
            let interrupted = ResumeState::read(&path).unwrap();
            std::fs::remove_file(path).unwrap();
            problem.steps(Steps::Count(2)).resume(interrupted).run(Until::Time(5.5)).unwrap_err()
        }, ["differs from the interrupted one", "same problem"];
        InputError::Unsaved => {
            let mut saved = Checkpoint::every(1, std::env::temp_dir().join("never_written")).unwrap();
            problem.by(Minimal).steps(Steps::Count(1)).observe(&mut saved).run(Until::Time(5.5)).unwrap_err()
        }, ["cannot be saved", "remove the checkpoint", "`restore`"];
        InputError::Times { .. } => {
            let mut rows = Rows::at([0.5, 7.25]).unwrap();
            problem.steps(Steps::Count(1)).observe(&mut rows).run(Until::Time(5.5)).unwrap_err()
        }, ["t = 7.25", "row 1", "outside of the span of the run", "in the direction of the run"];
        InputError::Undefined => Problem::new(&One::from(Odd::Kicked), 0.0, VelocityPoint::new([f64::MAX], [0.0], 0.0)).err().unwrap(), ["not finite at the start", "inside its domain"];
        InputError::NoMomentum => {
            let start = VelocityPoint::new([0.0], [1.0], 0.0);
            Problem::new(&OfHamiltonian(Shift), 0.0, start).err().unwrap()
        }, ["has no momentum", "H_pp is singular", "start from a momentum"];
        InputError::Stages { .. } => Gauss::new(pendulum, 17, 0.1).err().unwrap(), ["17", "from 1 to 16"];
        InputError::TimeTransformation { .. } => {
            let (gauss, start) = (Gauss::new(Stopped, 3, 0.1).unwrap(), PhasePoint::new([0.0], [1.0], 0.0));
            gauss.transformed_stepper(0.0, start, start.p).err().unwrap()
        }, ["is 0", "positive and finite"];
        InputError::Dimension => Rule::MIDPOINT.of(Nothing, 0.1).err().unwrap(), ["dimension 0", "at least one"];
        InputError::Count { .. } => Rows::every(0).err().unwrap(), ["the number of steps between two rows", "is 0", "at least 1"];
        InputError::PathLength { .. } => {
            let ends = [End::Position([0.0].into()), End::Free];
            let path = DiscretePath::new(vec![[0.0].into(); 3]).unwrap();
            BoundaryPath::new(Rule::MIDPOINT.of(pendulum, 0.1).unwrap(), 5, ends).unwrap().from_path(path).err().unwrap()
        }, ["2 steps", "problem has 5", "5 + 1 points"];
        InputError::Geometry(_) => {
            Flow::new(&Rule::MIDPOINT.of(pendulum, 0.1).unwrap(), 0.0, pendulum_at(f64::NAN)).err().unwrap()
        }, ["p[0] = NaN", "finite"];
        InputError::Constraint(_) => {
            let hanging = RigidPendulum::<2> { gravity: 1.0, gamma: -0.1 };
            let problem = Problem::new(&hanging, 0.0, VelocityPoint::new([1.1, 0.0], [0.0, 0.0], 0.0)).unwrap();
            let lobatto = Constrained::new(&hanging, ConstrainedMethod::Lobatto { stages: 3 });
            problem.by(lobatto).steps(Steps::Count(3)).run(Until::Time(1.0)).err().unwrap()
        }, ["off the constraints", "constraint 0", "OffConstraint::Project"];
        InputError::KinksUnderConstraints => {
            let problem = Problem::new(&Ridge, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0)).unwrap();
            let lobatto = Constrained::new(&Ridge, ConstrainedMethod::Lobatto { stages: 3 });
            problem.by(lobatto).steps(Steps::Count(3)).run(Until::Time(1.0)).err().unwrap()
        }, ["kinks or jumps", "under constraints", "smooth it"];
        InputError::Sigma { .. } => Flow::new(&strong(), 0.0, pendulum_at(0.5)).err().unwrap(), ["sigma_d = -1", "smaller step"];
        InputError::EqualPoints => {
            Flow::from_points(&Length, 0.0, DiscretePoint::new([0.3], [0.3], 0.0)).err().unwrap()
        }, ["q0 = q1", "two different points"];
        InputError::Unclaimed { .. } => {
            Strang::new(one(CoupledInZ::default()), 0.1, 0.0, &pendulum_at(0.5)).err().unwrap()
        }, ["separable", "claim it", "another method"];
        InputError::FalseClaim { .. } => Problem::new(&One::from(FalselyQuadratic), 0.0, start).err().unwrap(), ["quadratic", "does not hold", "size"];
        InputError::SwitchingUnstated => {
            let unstated = One::from(Unstated);
            let problem = Problem::new(&unstated, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
            problem.steps(Steps::Size(0.1)).plan(Until::Steps(3)).err().unwrap()
        }, ["switching_functions", "Hints { switching_functions: true"];
        InputError::Hypothesis { .. } => {
            let rule = |h| Rule::MIDPOINT.of(pendulum, h);
            Composition::new(rule, &SplittingScheme::BLANES_MOAN_6, 0.1, 0.0, pendulum_at(0.5)).err().unwrap()
        }, ["requires a composition", "another method"];
        InputError::PieceSum { .. } => {
            let hamiltonian = OfHamiltonian(spring());
            let problem = Problem::new(&hamiltonian, 0.0, pendulum_at(0.5)).unwrap();
            let splitting = HamiltonianSplitting { pieces: (spring(), spring()), scheme: SplittingScheme::STRANG };
            splitting.stepper(&problem, 0.1, StepperOptions::default()).err().unwrap()
        }, ["do not sum", "differ by", "add the missing piece"];
        InputError::PieceFlow { .. } => {
            let pieces = (spring(), Kinetic(spring()));
            PieceStepper::new(pieces, &SplittingScheme::STRANG, 0.1, 0.0, pendulum_at(0.5)).err().unwrap()
        }, ["piece 1", "differ by", "correct the flow"];
        InputError::NoTimeTransformation => {
            AnyIntegrator::TransformedGauss { stages: 4 }.check(&one(Pendulum { gamma: -0.1 })).err().unwrap()
        }, ["declares a time transformation", "another integrator"];
        InputError::Forced { .. } => {
            let drag = VelocityDrag { linear: SVector::from([0.1]), quadratic: 0.0 };
            Gauss::new::<1>(Forced { lagrangian: pendulum, force: drag }, 2, 0.1).err().unwrap()
        }, ["a discrete Lagrangian does not take", "`GaussCollocation`"];
        InputError::FirstStep(_) => {
            let centre = PhasePoint::new([0.0, 0.0], [0.0, 1.0], 0.0);
            Flow::new(&Rule::RECTANGLE.of(kepler, 0.1).unwrap(), 0.0, centre).err().unwrap()
        }, ["the first step fails", "not finite"];
    });
}

/// Systems for which an accuracy is not reached.
#[derive(Clone, Copy, Debug)]
pub enum Odd {
    /// A force that jumps at q = 0.
    Jumping,
    /// A drive faster than all steps that are tried.
    Kicked,
    /// `z' = z^2`.
    Explosive,
    /// Duffing's oscillator, driven into chaos.
    Chaotic,
    /// A pendulum.
    Pendulum,
    /// A potential with a step at q = 3.
    Stepped,
    /// A force that begins at t = 1.
    DelayedForce,
}

impl Lagrangian<1> for Odd {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let (kinetic, square) = (v[0] * v[0] * 0.5, q[0] * q[0]);
        match self {
            Odd::Jumping => kinetic - q[0].abs(),
            Odd::Kicked => kinetic - square * square + (t * 1e12).sin() * q[0] * 1e12,
            Odd::Explosive => kinetic + z * z,
            Odd::Pendulum => kinetic + q[0].cos(),
            Odd::Stepped => kinetic + q[0] - ((q[0] - 3.0) * 1e10).tanh() * 0.0015,
            Odd::DelayedForce => kinetic + T::from(1.0).if_less(t, q[0] * (t - 1.0) * 100.0, T::from(0.0)),
            Odd::Chaotic => kinetic + square * 0.5 - square * square * 0.25 + (t * 1.4).cos() * q[0] * 0.35 - z * 0.1,
        }
    }
    fn structure(&self) -> Structure {
        let Odd::DelayedForce = self else { return Structure::default() };
        Structure {
            z_free: true,
            z_affine: true,
            constant_rate: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

/// The reasons for which an accuracy is not reached, and their messages.
#[test]
fn selection_failures() {
    let failure_from = |q: f64, system: Odd, by: &str, span: f64, wanted: f64| {
        let system = One::from(system);
        let problem = Problem::new(&system, 0.0, VelocityPoint::new([q], [0.0], 1.0)).unwrap();
        let run = problem.by(by.parse::<AnyIntegrator>().unwrap()).accuracy(wanted);
        match run.plan(Until::Time(span)).err() {
            Some(InputError::Accuracy { cause, .. }) => cause,
            other => panic!("{other:?}"),
        }
    };
    let failure = |system, by: &str, span, wanted| failure_from(1.0, system, by, span, wanted);
    // Upright, of which pi has the error 1e-16: it grows to about one, the round-off of the runs to 1e-3.
    let upright = || failure_from(PI, Odd::Pendulum, "gauss_8", 40.0, 0.02);
    every!(SelectionFailure, "discrete-herglotz/src/error/selection.rs" {
        SelectionFailure::RoundOff => failure(Odd::Chaotic, "gauss_8", 2.0, 1e-18), ["round-off", "request a larger error"];
        SelectionFailure::Chaos { .. } => failure(Odd::Chaotic, "gauss_8", 600.0, 1e-6), ["chaotic", "after t = ", "request a larger error"];
        SelectionFailure::IllConditioned { .. } => upright(), ["last digit of the start becomes", "after t = ", "end the run there"];
        SelectionFailure::Order { .. } => failure(Odd::Jumping, "gauss_8", 20.0, 1e-13), ["order", "not smooth", "request a larger error"];
        SelectionFailure::DefectBetweenNodes { .. } => failure(Odd::Stepped, "gauss_8", 3.0, 1e-6), ["between the nodes", "only with order", "smooth the Lagrangian"];
        SelectionFailure::FeatureAtNodes { .. } => failure(Odd::DelayedForce, "gauss_8", 2.0, 1e-9), ["one more step", "with the ends of the steps", "end the span before it"];
        SelectionFailure::StepFailed { .. } => failure(Odd::Explosive, "gauss_8", 2.0, 1e-6), ["beyond t = 0.99", "end the span"];
        SelectionFailure::Unresolved { .. } => failure(Odd::Kicked, "gauss_8", 1.0, 1e-6), ["near t = ", "shorter span"];
        SelectionFailure::Budget => failure(Odd::Chaotic, "rectangle", 10.0, 1e-12), ["too many", "higher order", "give a step"];
    });
}
