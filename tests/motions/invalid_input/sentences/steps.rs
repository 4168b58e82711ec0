//! Errors of steps, and the status of a run.

use super::input::Odd;
use super::{name_of_variant, variants};
use super::{pendulum_at, strong};
use crate::common::gauss::GaussSteppers;
use crate::common::lagrangians::Massless;
use crate::common::observers::StopsAt;
use crate::lagrangians::{One, SwitchingOne, one};
use crate::resets::Floor;
use contact_examples::systems::{FreeParticle, HarmonicOscillator, Kepler, Pendulum, UniformField};
use contact_geom::nalgebra::SVector;
use contact_geom::switching::{Control, Impact, Impacts};
use contact_geom::{DiscretePoint, Hints, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};
use discrete_herglotz::gauss::Gauss;
use discrete_herglotz::rules::{Method, Rule};
use discrete_herglotz::solve::Solver;
use discrete_herglotz::{
    AnyIntegrator, DiscreteLagrangian, DividedGauss, Event, Events, InputError, Problem, Status, StepError, Stepper,
    Steps, Until,
};
use exact_lagrangian::ExactLagrangian;
use std::collections::BTreeSet;

/// A Lagrangian that jumps where its velocity passes 1/2, one with a reset there, and one whose switching function changes its sign at every
/// evaluation.
pub enum Switching {
    Fast,
    /// A reset beyond its surface.
    Reset,
    Restless(std::cell::Cell<bool>),
}

impl Lagrangian<1> for Switching {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };

    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 + q[0] - v[0].if_less(T::from(0.5), T::zero(), T::from(5.0))
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(match self {
            Switching::Fast | Switching::Reset => x.v[0] - 0.5,
            Switching::Restless(positive) => {
                positive.set(!positive.get());
                if positive.get() { 1.0 } else { -1.0 }
            }
        });
    }
    fn at_switch(&self, _index: usize, _t: f64, x: &VelocityPoint<1>, _rising: bool) -> Control<1> {
        match self {
            Switching::Reset => Control::Replace(VelocityPoint { v: [0.7].into(), ..*x }),
            _ => Control::Continue,
        }
    }
}

/// A ball that falls from the height 1/2 on a floor.
struct Impacting(Impact);

impl Impacting {
    fn fails(self) -> StepError {
        let ball = SwitchingOne::from(Impacts::new(UniformField { field: [-1.0], gamma: 0.0 }, Floor, self.0));
        let problem = Problem::new(&ball, 0.0, VelocityPoint::new([0.5], [0.0], 0.0)).unwrap();
        match problem.steps(Steps::Size(0.3)).run(Until::Time(3.0)).unwrap().status {
            Status::Failed { cause, .. } => cause,
            other => panic!("{other:?}"),
        }
    }
}

impl Switching {
    fn fails(self) -> StepError {
        let system = SwitchingOne::from(self);
        let problem = Problem::new(&system, 0.0, VelocityPoint::new([0.0], [0.0], 0.0)).unwrap();
        match problem.steps(Steps::Size(0.3)).run(Until::Steps(3)).unwrap().status {
            Status::Failed { cause, .. } => cause,
            other => panic!("{other:?}"),
        }
    }
}

/// A spring whose stiffness depends on the sign of q - 0.3, by a comparison of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Branching;

impl Lagrangian<1> for Branching {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let k = if q[0].re() > 0.3 { 2.0 } else { 1.0 };
        v[0] * v[0] * 0.5 - q[0] * q[0] * (0.5 * k)
    }
}

/// Declares to be quadratic, which holds to the last digit where the motion starts.
#[derive(Clone, Copy, Debug)]
pub struct QuadraticAtFirst;

impl Lagrangian<1> for QuadraticAtFirst {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - (q[0] - 2.0).max(T::from(0.0)).powi(3) - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { quadratic: true, autonomous: true, ..Structure::default() }
    }
}

#[test]
fn step_errors() {
    let forward = |ld: &dyn Fn(&mut Solver<1>) -> Option<StepError>| ld(&mut Solver::default()).unwrap();
    let guess = SVector::from([0.5]);
    every!(StepError, "discrete-herglotz/src/error/mod.rs" {
        StepError::NotConverged { .. } => {
            let gauss = Gauss::new(one(Pendulum { gamma: 0.0 }), 2, 50.0).unwrap();
            let mut stepper = gauss.stepper(0.0, pendulum_at(0.5), guess).unwrap().without_newton();
            stepper.advance(1).unwrap_err().cause
        }, ["residual of", "iterations", "smaller step"];
        StepError::Singular { .. } => {
            let ld = Rule::MIDPOINT.of(Massless, 0.1).unwrap();
            forward(&|solver| ld.forward(0.0, &pendulum_at(0.5), &guess, solver).err())
        }, ["pivot", "not regular", "smaller step"];
        StepError::SigmaVanished { .. } => {
            forward(&|solver| strong().forward(0.0, &pendulum_at(0.5), &guess, solver).err())
        }, ["sigma_d = -1", "smaller step"];
        StepError::OutsideDomain { .. } => {
            let ld = ExactLagrangian::<_, 1>::new(One::from(Odd::Explosive), 2.0).unwrap();
            let from = PhasePoint::new([0.0], [0.0], 1.0);
            forward(&|solver| ld.forward(0.0, &from, &guess, solver).err())
        }, ["only until t = ", "smaller step"];
        StepError::ConjugatePoint { .. } => {
            let ld = ExactLagrangian::<_, 1>::new(one(HarmonicOscillator { gamma: 0.0 }), std::f64::consts::PI).unwrap();
            ld.jet(0.0, &DiscretePoint::new([0.3], [0.5], 0.0)).unwrap_err()
        }, ["conjugate", "singular value", "another size"];
        StepError::StageFactor { .. } => {
            let gauss = Gauss::new(one(FreeParticle { gamma: -40.0 }), 3, 1.0).unwrap();
            match gauss.stepper(0.0, pendulum_at(0.5), guess).err() {
                Some(InputError::FirstStep(cause)) => cause,
                other => panic!("{other:?}"),
            }
        }, ["stage", "smaller step"];
        StepError::Branched => {
            let gauss = Gauss::new(One::from(Branching), 4, 0.5).unwrap();
            let start = PhasePoint::new([0.0], [1.0], 0.0);
            gauss.stepper(0.0, start, [1.0].into()).unwrap().without_newton().advance(3).unwrap_err().cause
        }, ["differs between SIMD lanes", "if_less"];
        StepError::Event { .. } => {
            let pendulum = one(Pendulum::default());
            let problem = Problem::new(&pendulum, 0.0, pendulum_at(0.5)).unwrap();
            let mut undefined = Events::new([Event::new(|t, _| (0.15 - t).sqrt())]);
            let outcome = problem.steps(Steps::Size(0.1)).observe(&mut undefined).run(Until::Steps(3));
            match outcome.unwrap().status {
                Status::Failed { cause, .. } => cause,
                other => panic!("{other:?}"),
            }
        }, ["the function of an event", "not finite at t = 0.15", "defined along the motion"];
        StepError::EventUnresolved { .. } => {
            let free = one(FreeParticle { gamma: 0.0 });
            let problem = Problem::new(&free, 0.0, pendulum_at(0.5)).unwrap();
            let mut fast = Events::new([Event::new(|t, _| (1e6 * t).sin() + 0.5)]);
            match problem.steps(Steps::Size(10.0)).observe(&mut fast).run(Until::Steps(1)).unwrap().status {
                Status::Failed { cause, .. } => cause,
                other => panic!("{other:?}"),
            }
        }, ["the function of an event varies so fast after t = ", "shorter steps", "smoother function"];
        StepError::Undivided { .. } => {
            let divided = DividedGauss { stages: 2, max_defect: f64::MIN_POSITIVE };
            let pendulum = one(Pendulum { gamma: -0.1 });
            let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.5], 0.0)).unwrap();
            match problem.by(divided).steps(Steps::Count(1)).run(Until::Time(1.0)).unwrap().status {
                Status::Failed { cause, .. } => cause,
                other => panic!("{other:?}"),
            }
        }, ["cannot be divided into parts", "near t = ", "allow a larger defect"];
        StepError::Switching { .. } => {
            Switching::Restless(std::cell::Cell::new(false)).fails()
        }, ["too often", "smooth the kink"];
        StepError::ResetUndefined { .. } => {
            Impacting(Impact::Restitution(f64::NAN)).fails()
        }, ["the reset at t = ", "not finite", "change what the reset assigns"];
        StepError::ResetBeyond { .. } => {
            Switching::Reset.fails()
        }, ["the reset at t = ", "the other side of its own surface", "assign a state"];
        StepError::Accumulation { .. } => {
            Impacting(Impact::Restitution(0.3)).fails()
        }, ["accumulate at t = ", "the motion continues"];
        StepError::Contact { .. } => {
            Impacting(Impact::Restitution(0.0)).fails()
        }, ["rests at t = ", "pressed onto it", "end the run before"];
        StepError::JumpAlong { .. } => Switching::Fast.fails(), ["depends on the velocity", "smooth the jump"];
        StepError::NonFinite => {
            let ld = Rule::RECTANGLE.of(Kepler::<2>::default(), 0.1).unwrap();
            let centre = PhasePoint::new([0.0, 0.0], [0.0, 1.0], 0.0);
            ld.forward(0.0, &centre, &[0.0, 1.0].into(), &mut Solver::default()).unwrap_err()
        }, ["not finite", "leaves the domain"];
    });
}

#[test]
fn statuses() {
    let (pendulum, explosive) = (one(Pendulum::default()), One::from(Odd::Explosive));
    let problem = Problem::new(&pendulum, 0.0, pendulum_at(0.5)).unwrap();
    let run = || problem.by(AnyIntegrator::Discrete(Method::Midpoint)).steps(Steps::Size(0.1));
    let blows_up = Problem::new(&explosive, 0.0, PhasePoint::new([0.0], [0.1], 1.0)).unwrap();
    every!(Status, "discrete-herglotz/src/status.rs" {
        Status::Completed => run().run(Until::Steps(3)).unwrap().status, ["completed"];
        Status::Stopped { .. } => {
            let mut fourth = StopsAt(4, "a weary observer");
            run().observe(&mut fourth).run(Until::Steps(10)).unwrap().status
        }, ["stopped by a weary observer", "at t = 0.4", "in step 4"];
        Status::FalseClaim { .. } => {
            // A cubic force that vanishes for q < 2, which the motion reaches after the steps that are tried before a
            // run.
            let system = One::from(QuadraticAtFirst);
            let problem = Problem::new(&system, 0.0, VelocityPoint::new([0.5], [1.0], 0.0)).unwrap();
            problem.steps(Steps::Count(1000)).run(Until::Time(10.0)).unwrap().status
        }, ["unreliable: after step ", "`quadratic`", "correct its `structure`"];
        Status::Failed { .. } => {
            let run = blows_up.by(AnyIntegrator::Discrete(Method::LeftMidpoint)).steps(Steps::Size(0.01));
            run.run(Until::Steps(4000)).unwrap().status
        }, ["failed in step", "at t = ", "without bound"];
    });
    // The ways in which a run with events ends; events that were found before are kept.
    let run = |event: Event<'_>, steps| {
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
