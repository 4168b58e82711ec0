//! Impacts against closed forms.

use crate::lagrangians::{SwitchingOne, SwitchingTwo};
use crate::resets::Floor;
use contact_examples::systems::{Pendulum, UniformField};
use contact_geom::numbers::dot;
use contact_geom::switching::{Control, Impact, Impacts, Surface};
use contact_geom::{Hints, Lagrangian, Scalar, Structure, VelocityPoint, nalgebra::SVector};
use discrete_herglotz::{AnyIntegrator, GaussCollocation, Outcome, Problem, Resets, Status, StepError, Steps, Until};

fn ball(gamma: f64, g: f64, law: Impact) -> SwitchingOne {
    Impacts::new(UniformField { field: [-g], gamma }, Floor, law).into()
}

/// The run of a ball from the height 1 at rest, with its impacts.
fn dropped(ball: &SwitchingOne, steps: Steps, t_end: f64) -> (Outcome, Vec<f64>) {
    let problem = Problem::new(ball, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let mut resets = Resets::new();
    let run = problem.by(GaussCollocation { stages: 8 }).steps(steps);
    let outcome = run.observe(&mut resets).run(Until::Time(t_end)).unwrap();
    (outcome, resets.resets.iter().map(|reset| reset.t).collect())
}

/// The ball with drag has two impacts until t = 5. The reference was computed from the closed form of the flights with 30
/// digits; a step may contain both impacts.
#[test]
fn an_elastic_ball_with_drag_meets_its_closed_form() {
    let ball = ball(-0.1, 1.0, Impact::Elastic);
    for h in [0.05, 0.5, 1.7, 5.0] {
        let (outcome, impacts) = dropped(&ball, Steps::Size(h), 5.0);
        assert_eq!((outcome.status, outcome.unresolved, impacts.len()), (Status::Completed, None, 2));
        // Some roundings of each of two flights.
        assert!((outcome.q[0] - 0.687_239_291_673_724_4).abs() <= 4e-15, "h = {h}: {:e}", outcome.q[0]);
        assert!((outcome.v.unwrap()[0] - 0.202_101_943_351_217_57).abs() <= 4e-15, "h = {h}");
    }
    let problem = Problem::new(&ball, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let outcome = problem.accuracy(1e-10).run(Until::Time(5.0)).unwrap();
    assert!((outcome.q[0] - 0.687_239_291_673_724_4).abs() <= 1e-10);
}

/// Every integrator takes impacts with its own order: the error of 40 steps is at most that of 20 divided by the power of
/// two of the order, up to a factor of two, or it is round-off.
#[test]
fn every_integrator_takes_impacts() {
    let ball = SwitchingOne::from(Impacts::new(Pendulum { gamma: -0.1 }, Floor, Impact::Elastic));
    let end = |integrator: AnyIntegrator, count: usize| {
        let problem = Problem::new(&ball, 0.0, VelocityPoint::new([1.0], [0.5], 0.0)).unwrap();
        problem.by(integrator).steps(Steps::Count(count)).run(Until::Time(8.0)).unwrap().q[0]
    };
    let exact = end(AnyIntegrator::Gauss { stages: 8 }, 64);
    for (name, order) in [("midpoint", 2), ("trapezoidal", 2), ("strang", 2), ("gauss_2", 4), ("blanes_moan_4", 4)] {
        let integrator: AnyIntegrator = name.parse().unwrap();
        let [coarse, fine] = [64, 128].map(|count| (end(integrator, count) - exact).abs());
        assert!(fine <= coarse / f64::powi(2.0, order) * 2.0 + 1e-13, "{name}: {coarse:e} {fine:e}");
        assert!(coarse < 0.05, "{name}: {coarse:e}");
    }
}

/// A ball with restitution 1/2 has impacts at `sqrt(2) (1 + 2 sum 2^-k)`, whose limit is `3 sqrt(2)`.
#[test]
fn accumulating_impacts_name_their_limit() {
    let limit = 3.0 * f64::sqrt(2.0);
    for h in [0.1, 1.0, 6.0] {
        let (outcome, impacts) = dropped(&ball(0.0, 1.0, Impact::Restitution(0.5)), Steps::Size(h), 6.0);
        let Status::Failed { cause: StepError::Accumulation { t }, .. } = outcome.status else {
            panic!("h = {h}: {}", outcome.status)
        };
        assert!((t - limit).abs() <= 1e-12, "h = {h}: {:e}", t - limit);
        assert!(outcome.q[0] >= 0.0 && outcome.t < limit);
        for (k, impact) in impacts.iter().enumerate() {
            let sum: f64 = (1..=k).map(|k| f64::powi(0.5, k as i32)).sum();
            assert!((impact - f64::sqrt(2.0) * (1.0 + 2.0 * sum)).abs() <= 4e-15, "impact {k}");
        }
    }
    // The coefficient with most impacts that is followed here: some thousand.
    let (outcome, _) = dropped(&ball(0.0, 1.0, Impact::Restitution(0.98)), Steps::Size(0.5), 150.0);
    let limit = f64::sqrt(2.0) * (1.0 + 2.0 * 0.98 / 0.02);
    assert!(
        matches!(outcome.status, Status::Failed { cause: StepError::Accumulation { t }, .. } if (t - limit).abs() < 1e-9),
        "{}",
        outcome.status
    );
}

/// A ball that is stopped dead on the floor rests at once, and the run ends there.
#[test]
fn a_ball_without_restitution_stops_where_it_falls() {
    let (outcome, _) = dropped(&ball(0.0, 1.0, Impact::Restitution(0.0)), Steps::Size(0.1), 6.0);
    let Status::Failed { cause: StepError::Contact { t }, .. } = outcome.status else { panic!("{}", outcome.status) };
    assert!((t - f64::sqrt(2.0)).abs() <= 4e-15);
}

/// A ball that rests after its last impact: the second coordinate is a mode, 1 in contact, in which the floor carries
/// the weight.
pub struct Resting;

impl Lagrangian<2> for Resting {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };

    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        dot(v, v) * 0.5 - q[1].if_less(T::from(0.5), q[0], T::zero())
    }
    fn structure(&self) -> Structure {
        Structure::default()
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<2>, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
    fn at_switch(&self, _index: usize, _t: f64, x: &VelocityPoint<2>, rising: bool) -> Control<2> {
        if rising {
            Control::Continue
        } else {
            Control::Replace(VelocityPoint { v: [-0.5 * x.v[0], 0.0].into(), ..*x })
        }
    }
    fn at_accumulation(&self, _index: usize, _t: f64, x: &VelocityPoint<2>) -> Control<2> {
        Control::Replace(VelocityPoint::new([0.0, 1.0], [0.0, 0.0], x.z))
    }
}

#[test]
fn a_resting_contact_continues_where_it_is_asked_for() {
    let system = SwitchingTwo::from(Resting);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0)).unwrap();
    let outcome = problem.by(GaussCollocation { stages: 3 }).steps(Steps::Size(0.1)).run(Until::Time(6.0)).unwrap();
    assert_eq!((outcome.status, outcome.q[0], outcome.q[1]), (Status::Completed, 0.0, 1.0));
}

/// A wall that moves with the velocity u: an elastic impact reverses the velocity relative to the wall, `v+ = 2u - v-`.
#[derive(Clone, Copy)]
pub struct Piston {
    u: f64,
}

impl Surface<1> for Piston {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>) -> T {
        q[0] - t * self.u
    }
}

#[test]
fn a_moving_wall_changes_the_energy() {
    for (law, after) in [(Impact::Elastic, 2.0 * 0.25 + 1.0), (Impact::Restitution(0.5), 0.25 + 0.5 * 1.25)] {
        let particle = Impacts::new(UniformField { field: [0.0], gamma: 0.0 }, Piston { u: 0.25 }, law);
        let particle = SwitchingOne::from(particle);
        let problem = Problem::new(&particle, 0.0, VelocityPoint::new([2.5], [-1.0], 0.0)).unwrap();
        let outcome =
            problem.by(AnyIntegrator::Gauss { stages: 2 }).steps(Steps::Count(3)).run(Until::Time(4.0)).unwrap();
        assert!((outcome.v.unwrap()[0] - after).abs() <= 4e-15, "{law:?}");
        assert!((outcome.q[0] - (0.5 + 2.0 * after)).abs() <= 1e-14, "{law:?}");
    }
}

/// A uniform field whose potential is 3 at the floor.
pub struct High;

impl Lagrangian<1> for High {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0] - 3.0
    }
}

/// The law that takes more energy than there is has no state after it.
#[test]
fn a_law_without_a_state_after_it_is_refused() {
    // The law takes nine tenths of the potential at the floor.
    let ball = SwitchingOne::from(Impacts::new(High, Floor, Impact::Conformal(0.1)));
    let problem = Problem::new(&ball, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let outcome = problem.by(GaussCollocation { stages: 2 }).steps(Steps::Size(0.1)).run(Until::Time(2.0)).unwrap();
    assert!(
        matches!(outcome.status, Status::Failed { cause: StepError::ResetUndefined { .. }, .. }),
        "{}",
        outcome.status
    );
}
