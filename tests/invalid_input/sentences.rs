//! Every variant of every error, triggered through the public interface: its message has the value and the remedy.

use crate::common::lagrangians::{Bratu, Explosive, Massless};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::systems::{CoupledInZ, FreeParticle, HarmonicOscillator, Kepler, Pendulum};
use contact_geom::{
    DiscretePoint, GeometryError, Hints, Lagrangian, PhasePoint, Scalar, Statement, Structure, Symmetry,
    TimeTransformation, VelocityPoint, herglotz_field, support::linear,
};
use discrete_herglotz::{
    AnyIntegrator, Checkpoint, DiscreteLagrangian, DividedGauss, Event, Events, InputError, Integrator, Interrupt,
    MethodInfo, Problem, ResumeState, Rows, SelectionFailure, SplittingScheme, Status, StepError, StepFailure,
    StepView, Stepper, StepperOptions, Steps, Stop, UnknownIntegrator, UnresolvedStep, Until,
    boundary::{BoundaryPath, End},
    gauss::Gauss,
    rules::{Composition, Flow, LeftMidpoint, Method, Midpoint, Rectangle, UnknownMethod},
    solve::Solver,
    splitting::Strang,
    theory::DiscretePath,
};
use exact_lagrangian::{ContactExponential, ExactError, ExactLagrangian, herglotz_flow};
use std::ops::ControlFlow;

/// The variants of an error, each with an expression that triggers it and words of its message. A missing variant does
/// not compile.
macro_rules! every {
    ($Error:ty { $($variant:pat => $trigger:expr, $words:expr;)* }) => {
        // Without a wildcard the match is complete.
        let _: fn(&$Error) = |error| match error { $($variant => (),)* };
        $(
            let error: $Error = $trigger;
            assert!(matches!(error, $variant), "not {}: {error:?}", stringify!($variant));
            let sentence = error.to_string();
            for word in $words {
                assert!(sentence.contains(word), "no {word:?} in {sentence:?}");
            }
        )*
    };
}

fn pendulum_at(p: f64) -> PhasePoint<1> {
    PhasePoint::new([0.3], [p], 0.1)
}

/// A drag that makes the conformal factor of a step of 0.1 negative.
fn strong() -> LeftMidpoint<FreeParticle> {
    LeftMidpoint::new(FreeParticle { gamma: -20.0 }, 0.1).unwrap()
}

/// A Lagrangian that jumps where its velocity passes 1/2, and one whose switching function changes its sign at every
/// evaluation.
enum Switching {
    Fast,
    Restless(std::cell::Cell<bool>),
}

impl Lagrangian<1> for Switching {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };

    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 + q[0] - v[0].if_less(T::from(0.5), T::zero(), T::from(5.0))
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(match self {
            Switching::Fast => x.v[0] - 0.5,
            Switching::Restless(positive) => {
                positive.set(!positive.get());
                if positive.get() { 1.0 } else { -1.0 }
            }
        });
    }
}

impl Switching {
    fn fails(self) -> StepError {
        let problem = Problem::new(&self, 0.0, VelocityPoint::new([0.0], [0.0], 0.0)).unwrap();
        match problem.steps(Steps::Size(0.3)).run(Until::Steps(3)).unwrap().status {
            Status::Failed { cause, .. } => cause,
            other => panic!("{other:?}"),
        }
    }
}

/// Switching functions that are not declared.
struct Unstated;

impl Lagrangian<1> for Unstated {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0].abs()
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
}

/// A spring whose stiffness depends on the sign of q - 0.3, by a comparison of numbers.
struct Branching;

impl Lagrangian<1> for Branching {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let k = if q[0].re() > 0.3 { 2.0 } else { 1.0 };
        v[0] * v[0] * 0.5 - q[0] * q[0] * (0.5 * k)
    }
}

/// Declares to be quadratic, and is not.
struct FalselyQuadratic;

impl Lagrangian<1> for FalselyQuadratic {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].powi(3) - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { quadratic: true, ..Structure::default() }
    }
}

/// Declares to be quadratic, which holds to the last digit where the motion starts.
struct QuadraticAtFirst;

impl Lagrangian<1> for QuadraticAtFirst {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - (q[0] - 2.0).max(T::from(0.0)).powi(3) - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { quadratic: true, autonomous: true, ..Structure::default() }
    }
}

struct Stopped;

impl TimeTransformation<2> for Stopped {
    fn rate<T: Scalar>(&self, q: &SVector<T, 2>) -> T {
        q[0] * 0.0
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

/// An integrator with the required functions alone.
struct Minimal;

struct Bare<'a>(Box<dyn Stepper<1> + 'a>);

impl<'a> Integrator<'a, Pendulum, 1> for Minimal {
    fn info(&self) -> MethodInfo {
        MethodInfo::of_discrete::<1>("forgetful", 2)
    }
    fn check(&self, _: &Pendulum) -> Result<(), InputError> {
        Ok(())
    }
    fn stepper(
        &self,
        problem: &Problem<'a, Pendulum, 1>,
        h: f64,
        wants: StepperOptions,
    ) -> Result<Box<dyn Stepper<1> + 'a>, InputError> {
        Ok(Box::new(Bare(Method::Midpoint.stepper(problem, h, wants)?)))
    }
}

impl Stepper<1> for Bare<'_> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        self.0.advance(steps)
    }
    fn state(&self) -> PhasePoint<1> {
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
    let (pendulum, start) = (Pendulum::default(), VelocityPoint::new([0.3], [0.5], 0.1));
    let problem = Problem::new(&pendulum, 0.5, start).unwrap();
    let in_steps = |steps| problem.steps(steps).plan(Until::Time(5.5)).err().unwrap();
    let kepler = Kepler::<2>::default();
    let circle = PhasePoint::new([1.0, 0.0], [0.0, 1.0], 0.0);
    every!(InputError {
        InputError::Step { .. } => in_steps(Steps::Size(-0.25)), ["-0.25", "finite number and not 0", "positive where the end of the run tells"];
        InputError::Span { .. } => problem.steps(Steps::Count(1)).plan(Until::Time(f64::INFINITY)).err().unwrap(), ["is inf;", "finite and not 0", "negative to go back"];
        InputError::Accuracy { .. } => {
            let run = problem.by(AnyIntegrator::Gauss { stages: 8 }).accuracy(1e-17);
            run.plan(Until::Time(5.5)).err().unwrap()
        }, ["1e-17", "ask for less"];
        InputError::Tolerance { .. } => problem.accuracy(-0.5).plan(Until::Time(5.5)).err().unwrap(), ["-0.5", "positive and finite"];
        InputError::Scale { .. } => problem.accuracy(0.5).scales([-2.5]).plan(Until::Time(5.5)).err().unwrap(), ["coordinate 0", "-2.5", "positive and finite"];
        InputError::TooMany { .. } => in_steps(Steps::Size(1e-300)), ["the number of steps", "e300", "longer steps"];
        InputError::NoSteps => problem.by(AnyIntegrator::Gauss { stages: 8 }).plan(Until::Time(5.5)).err().unwrap(), ["`steps`", "`accuracy`"];
        InputError::NoIntegrator => problem.accuracy(0.5).steps(Steps::Count(1)).plan(Until::Time(5.5)).err().unwrap(), ["`by`", "`accuracy`"];
        InputError::Interrupted => {
            let asked = || true;
            let interrupted = problem.with_interrupt(Interrupt::when(&asked));
            interrupted.accuracy(1e-6).plan(Until::Time(5.5)).err().unwrap()
        }, ["the trial runs were interrupted", "run it again", "give a step"];
        InputError::AnotherRun => {
            let path = std::env::temp_dir().join(format!("another_run_{}", std::process::id()));
            let mut saved = Checkpoint::every(1, &path).unwrap();
            problem.steps(Steps::Count(1)).observe(&mut saved).run(Until::Time(5.5)).unwrap();
            let interrupted = ResumeState::read(&path).unwrap();
            std::fs::remove_file(path).unwrap();
            problem.steps(Steps::Count(2)).resume(interrupted).run(Until::Time(5.5)).unwrap_err()
        }, ["not the one that was interrupted", "same problem"];
        InputError::Unsaved => {
            let mut saved = Checkpoint::every(1, std::env::temp_dir().join("never_written")).unwrap();
            problem.by(Minimal).steps(Steps::Count(1)).observe(&mut saved).run(Until::Time(5.5)).unwrap_err()
        }, ["cannot be saved", "leave the checkpoint out", "`restore`"];
        InputError::Times { .. } => {
            let mut rows = Rows::at([0.5, 7.25]).unwrap();
            problem.steps(Steps::Count(1)).observe(&mut rows).run(Until::Time(5.5)).unwrap_err()
        }, ["t = 7.25", "row 1", "outside of the run's span", "in the order of the run"];
        InputError::Undefined => Problem::new(&Odd::Kicked, 0.0, VelocityPoint::new([f64::MAX], [0.0], 0.0)).err().unwrap(), ["not finite at the start", "inside its domain"];
        InputError::Stages { .. } => Gauss::new(pendulum, 17, 0.1).err().unwrap(), ["17", "from 1 to 16"];
        InputError::TimeTransformation { .. } => {
            let gauss = Gauss::new(kepler, 3, 0.1).unwrap();
            gauss.transformed_stepper(Stopped, 0.0, circle, circle.p).err().unwrap()
        }, ["is 0", "positive and finite"];
        InputError::Dimension => Midpoint::new(Nothing, 0.1).err().unwrap(), ["dimension 0", "at least one"];
        InputError::Count { .. } => Rows::<1>::every(0).err().unwrap(), ["the steps between two rows", "= 0", "at least 1"];
        InputError::PathLength { .. } => {
            let ends = [End::Position([0.0].into()), End::Free];
            let path = DiscretePath::new(vec![[0.0].into(); 3]).unwrap();
            BoundaryPath::new(Midpoint::new(pendulum, 0.1).unwrap(), 5, ends).unwrap().from_path(path).err().unwrap()
        }, ["2 steps", "problem has 5", "5 + 1 points"];
        InputError::Geometry(_) => {
            Flow::new(&Midpoint::new(pendulum, 0.1).unwrap(), 0.0, pendulum_at(f64::NAN)).err().unwrap()
        }, ["p[0] = NaN", "finite"];
        InputError::Sigma { .. } => Flow::new(&strong(), 0.0, pendulum_at(0.5)).err().unwrap(), ["sigma_d = -1", "smaller step"];
        InputError::EqualPoints => {
            Flow::from_points(&Length, 0.0, DiscretePoint::new([0.3], [0.3], 0.0)).err().unwrap()
        }, ["q0 = q1", "two different points"];
        InputError::Unclaimed { .. } => {
            Strang::new(CoupledInZ::default(), 0.1, 0.0, &pendulum_at(0.5)).err().unwrap()
        }, ["separable", "claim it", "another method"];
        InputError::FalseClaim { .. } => Problem::new(&FalselyQuadratic, 0.0, start).err().unwrap(), ["quadratic", "is not", "size"];
        InputError::SwitchingUnstated => {
            let problem = Problem::new(&Unstated, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
            problem.steps(Steps::Size(0.1)).plan(Until::Steps(3)).err().unwrap()
        }, ["switching_functions", "Hints { switching_functions: true"];
        InputError::Hypothesis { .. } => {
            let rule = |h| Midpoint::new(pendulum, h);
            Composition::new(rule, &SplittingScheme::BLANES_MOAN_6, 0.1, 0.0, pendulum_at(0.5)).err().unwrap()
        }, ["needs a composition", "another method"];
        InputError::NoTimeTransformation => {
            AnyIntegrator::TransformedGauss { stages: 4 }.check(&Pendulum { gamma: -0.1 }).err().unwrap()
        }, ["states a time transformation", "another method"];
        InputError::FirstStep(_) => {
            let centre = PhasePoint::new([0.0, 0.0], [0.0, 1.0], 0.0);
            Flow::new(&Rectangle::new(kepler, 0.1).unwrap(), 0.0, centre).err().unwrap()
        }, ["no first step", "not finite"];
    });
}

/// Systems for which an accuracy is not reached; one type, since each type is compiled with every integrator.
enum Odd {
    /// A force that jumps at q = 0.
    Jumping,
    /// A drive faster than all steps that are tried.
    Kicked,
    /// `z' = z^2`.
    Explosive,
    /// Duffing's oscillator, driven into chaos.
    Chaotic,
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
    let start = VelocityPoint::new([1.0], [0.0], 1.0);
    let failure = |system: &Odd, by: &str, span: f64, wanted: f64| {
        let problem = Problem::new(system, 0.0, start).unwrap();
        let run = problem.by(by.parse::<AnyIntegrator>().unwrap()).accuracy(wanted);
        match run.plan(Until::Time(span)).err() {
            Some(InputError::Accuracy { cause, .. }) => cause,
            other => panic!("{other:?}"),
        }
    };
    every!(SelectionFailure {
        SelectionFailure::RoundOff => failure(&Odd::Chaotic, "gauss_8", 2.0, 1e-18), ["round-off", "ask for less"];
        SelectionFailure::Chaos { .. } => failure(&Odd::Chaotic, "gauss_8", 600.0, 1e-6), ["chaotic", "after t = ", "ask for less"];
        SelectionFailure::Order { .. } => failure(&Odd::Jumping, "gauss_8", 20.0, 1e-13), ["order", "not smooth", "ask for less"];
        SelectionFailure::Misfit { .. } => failure(&Odd::Stepped, "gauss_8", 3.0, 1e-6), ["between the nodes", "only with order", "smooth the Lagrangian"];
        SelectionFailure::Hidden { .. } => failure(&Odd::DelayedForce, "gauss_8", 2.0, 1e-9), ["one step more", "at the ends of their steps", "end the span beside it"];
        SelectionFailure::Halted { .. } => failure(&Odd::Explosive, "gauss_8", 2.0, 1e-6), ["beyond t = 0.99", "end the span"];
        SelectionFailure::Unresolved { .. } => failure(&Odd::Kicked, "gauss_8", 1.0, 1e-6), ["near t = ", "shorter span"];
        SelectionFailure::Budget => failure(&Odd::Chaotic, "rectangle", 10.0, 1e-12), ["too many", "higher order", "give a step"];
    });
}

#[test]
fn step_errors() {
    let forward = |ld: &dyn Fn(&mut Solver<1>) -> Option<StepError>| ld(&mut Solver::default()).unwrap();
    let guess = SVector::from([0.5]);
    every!(StepError {
        StepError::NotConverged { .. } => {
            let gauss = Gauss::new(Pendulum { gamma: 0.0 }, 2, 50.0).unwrap();
            let mut stepper = gauss.stepper(0.0, pendulum_at(0.5), guess).unwrap().without_newton();
            stepper.advance(1).unwrap_err().cause
        }, ["residual of", "iterations", "smaller step"];
        StepError::Singular { .. } => {
            let ld = Midpoint::new(Massless, 0.1).unwrap();
            forward(&|solver| ld.forward(0.0, &pendulum_at(0.5), &guess, solver).err())
        }, ["pivot", "not regular", "smaller step"];
        StepError::SigmaVanished { .. } => {
            forward(&|solver| strong().forward(0.0, &pendulum_at(0.5), &guess, solver).err())
        }, ["sigma_d = -1", "smaller step"];
        StepError::OutsideDomain { .. } => {
            let ld = ExactLagrangian::<_, 1>::new(Explosive, 2.0).unwrap();
            let from = PhasePoint::new([0.0], [0.0], 1.0);
            forward(&|solver| ld.forward(0.0, &from, &guess, solver).err())
        }, ["only until t = ", "smaller step"];
        StepError::ConjugatePoint { .. } => {
            let ld = ExactLagrangian::<_, 1>::new(HarmonicOscillator { gamma: 0.0 }, std::f64::consts::PI).unwrap();
            ld.jet(0.0, &DiscretePoint::new([0.3], [0.5], 0.0)).unwrap_err()
        }, ["conjugate", "singular value", "another step"];
        StepError::StageFactor { .. } => {
            let gauss = Gauss::new(FreeParticle { gamma: -40.0 }, 3, 1.0).unwrap();
            match gauss.stepper(0.0, pendulum_at(0.5), guess).err() {
                Some(InputError::FirstStep(cause)) => cause,
                other => panic!("{other:?}"),
            }
        }, ["stage", "smaller step"];
        StepError::Branched => {
            let gauss = Gauss::new(Branching, 4, 0.5).unwrap();
            let start = PhasePoint::new([0.0], [1.0], 0.0);
            gauss.stepper(0.0, start, [1.0].into()).unwrap().without_newton().advance(3).unwrap_err().cause
        }, ["lanes that differ", "if_less"];
        StepError::Event { .. } => {
            let pendulum = Pendulum::default();
            let problem = Problem::new(&pendulum, 0.0, pendulum_at(0.5)).unwrap();
            let mut undefined = Events::new([Event::new(|t, _| (0.15 - t).sqrt())]);
            let outcome = problem.steps(Steps::Size(0.1)).observe(&mut undefined).run(Until::Steps(3));
            match outcome.unwrap().status {
                Status::Failed { cause, .. } => cause,
                other => panic!("{other:?}"),
            }
        }, ["the function of an event", "not finite at t = 0.15", "defined along the motion"];
        StepError::Undivided { .. } => {
            let divided = DividedGauss { stages: 2, most_misfit: f64::MIN_POSITIVE };
            let pendulum = Pendulum { gamma: -0.1 };
            let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.5], 0.0)).unwrap();
            match problem.by(divided).steps(Steps::Count(1)).run(Until::Time(1.0)).unwrap().status {
                Status::Failed { cause, .. } => cause,
                other => panic!("{other:?}"),
            }
        }, ["cannot be divided into parts", "near t = ", "allow a larger one"];
        StepError::Switching { .. } => {
            Switching::Restless(std::cell::Cell::new(false)).fails()
        }, ["without end", "smooth the kink"];
        StepError::JumpAlong { .. } => Switching::Fast.fails(), ["depends on the velocity", "smooth the jump"];
        StepError::NonFinite => {
            let ld = Rectangle::new(Kepler::<2>::default(), 0.1).unwrap();
            let centre = PhasePoint::new([0.0, 0.0], [0.0, 1.0], 0.0);
            ld.forward(0.0, &centre, &[0.0, 1.0].into(), &mut Solver::default()).unwrap_err()
        }, ["not finite", "leaves the domain"];
    });
}

#[test]
fn statuses() {
    let (pendulum, explosive) = (Pendulum::default(), Explosive);
    let problem = Problem::new(&pendulum, 0.0, pendulum_at(0.5)).unwrap();
    let run = || problem.by(AnyIntegrator::Discrete(Method::Midpoint)).steps(Steps::Size(0.1));
    let blows_up = Problem::new(&explosive, 0.0, PhasePoint::new([0.0], [0.1], 1.0)).unwrap();
    every!(Status {
        Status::Completed => run().run(Until::Steps(3)).unwrap().status, ["completed"];
        Status::Stopped { .. } => {
            let mut fourth = |at: &StepView<'_, 1>| match at.k {
                4 => ControlFlow::Break(Stop::here("a weary observer")),
                _ => ControlFlow::Continue(()),
            };
            run().observe(&mut fourth).run(Until::Steps(10)).unwrap().status
        }, ["stopped by a weary observer", "at t = 0.4", "in step 4"];
        Status::FalseClaim { .. } => {
            // A cubic force that vanishes for q < 2, which the motion reaches after the steps that are tried before a
            // run.
            let problem = Problem::new(&QuadraticAtFirst, 0.0, VelocityPoint::new([0.5], [1.0], 0.0)).unwrap();
            problem.steps(Steps::Count(1000)).run(Until::Time(10.0)).unwrap().status
        }, ["unreliable: after step ", "not quadratic", "correct its structure"];
        Status::Failed { .. } => {
            let run = blows_up.by(AnyIntegrator::Discrete(Method::LeftMidpoint)).steps(Steps::Size(0.01));
            run.run(Until::Steps(4000)).unwrap().status
        }, ["failed in step", "at t = ", "without bound"];
    });
    // The ways in which a run with events ends; events that were found before are kept.
    let run = |event: Event<'_, 1>, steps| {
        let mut events = Events::new([event]);
        let run = blows_up.by(AnyIntegrator::Gauss { stages: 2 }).steps(Steps::Size(0.1)).observe(&mut events);
        (run.run(Until::Steps(steps)).unwrap().status, events.crossings.len())
    };
    assert_eq!(run(Event::new(|_, _| 1.0), 2), (Status::Completed, 0));
    let (stopped, found) = run(Event::new(|t, _| t - 0.15).terminal(), 2);
    let there = matches!(stopped, Status::Stopped { step: 2, t, by: "an event" } if (t - 0.15).abs() <= 1e-15);
    assert!(there && found == 1, "{stopped:?}, {found}");
    let (undefined, _) = run(Event::new(|t, _| (0.15 - t).sqrt()), 3);
    assert!(matches!(undefined, Status::Failed { cause: StepError::Event { .. }, .. }), "{undefined:?}");
    let (failed, found) = run(Event::new(|_, x| x.z - 3.0), 4000);
    let by_itself = matches!(failed, Status::Failed { cause, .. } if !matches!(cause, StepError::Event { .. }));
    assert!(by_itself && found > 0, "{failed:?}, {found}");
}

#[test]
fn geometry_errors() {
    every!(GeometryError {
        GeometryError::WrongSize { .. } => PhasePoint::<2>::from_slices(&[1.0], &[1.0, 2.0], 0.0).unwrap_err(), ["q has 1", "pass 2"];
        GeometryError::NonFinite { .. } => {
            VelocityPoint::<2>::from_slices(&[1.0, 2.0], &[1.0, f64::INFINITY], 0.0).unwrap_err()
        }, ["v[1] = inf", "finite number"];
        GeometryError::Singular { .. } => {
            herglotz_field(&Massless, 0.0, &VelocityPoint::new([0.1], [0.2], 0.0)).unwrap_err()
        }, ["singular", "pivot 0e0"];
        GeometryError::Undefined { .. } => {
            let ld = Rectangle::new(Explosive, 0.1).unwrap();
            let outside = DiscretePoint::new([0.0], [f64::NAN], 0.0);
            discrete_herglotz::theory::statements::residual(Statement::ActionDifferential, &ld, &[], 0.0, &outside).unwrap_err()
        }, ["not defined", "inside its domain"];
    });
    // The message names the remedy.
    let sentence = Symmetry::<2>::rotation(0, 2).unwrap_err().to_string();
    assert!(sentence.contains("plane of rotation") && sentence.contains("dimension 2"), "{sentence}");
    let mut singular = (DMatrix::<f64>::zeros(2, 2), contact_geom::nalgebra::DVector::zeros(2));
    let error = linear::solve(&mut singular.0, &mut singular.1).unwrap_err();
    assert!(error.to_string().contains("singular matrix (pivot 0e0)"), "{error}");
    let named = error.of("the mass matrix", "take another").to_string();
    assert!(named.contains("the mass matrix") && named.contains("take another"), "{named}");
}

#[test]
fn exact_errors() {
    let oscillator = HarmonicOscillator { gamma: 0.0 };
    every!(ExactError<1> {
        ExactError::Input(_) => ContactExponential::new(oscillator, -0.5).map_err(ExactError::from).unwrap_err(), ["-0.5", "finite number", "positive"];
        ExactError::OutsideDomain { .. } => {
            herglotz_flow(&Explosive, 0.0, &VelocityPoint::new([0.0], [0.0], 1.0), 2.0).unwrap_err()
        }, ["only until t = ", "smaller h", "another start"];
        ExactError::Unfinished { .. } => {
            herglotz_flow(&oscillator, 0.0, &VelocityPoint::new([1.0], [0.0], 0.0), 1e9).unwrap_err()
        }, ["t = ", "go on from there"];
        ExactError::NotConverged { .. } => {
            let exp = ContactExponential::new(Bratu { lambda: 6.0, drag: 0.01 }, 0.8).unwrap();
            exp.retract(0.0, &DiscretePoint::new([0.0], [0.1], 0.0)).unwrap_err()
        }, ["no motion", "misses", "pass a guess"];
        ExactError::ConjugatePoint { .. } => {
            let exp = ContactExponential::new(oscillator, std::f64::consts::PI).unwrap();
            exp.retract(0.0, &DiscretePoint::new([0.3], [0.5], 0.0)).unwrap_err()
        }, ["conjugate", "singular value", "another h"];
    });
}

#[test]
fn names_that_are_none() {
    let UnknownMethod { name } = "mid-point".parse::<Method>().unwrap_err();
    let sentence = UnknownMethod { name }.to_string();
    assert!(sentence.contains("\"mid-point\"") && sentence.contains("left_midpoint, midpoint"), "{sentence}");
    let UnknownIntegrator { name } = "gauss_17".parse::<AnyIntegrator>().unwrap_err();
    let sentence = UnknownIntegrator { name }.to_string();
    assert!(sentence.contains("\"gauss_17\"") && sentence.contains("gauss_16"), "{sentence}");
    let sentence = UnresolvedStep { step: 7, defect: 12.5 }.to_string();
    assert!(
        sentence.contains("step 7") && sentence.contains("1.2e1") && sentence.contains("smaller step"),
        "{sentence}"
    );
}
