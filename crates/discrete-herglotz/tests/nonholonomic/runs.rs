//! Nonholonomic motions as runs: an accuracy, rows, events, checkpoints, momenta, the force of the constraints, and
//! what is refused.

use super::sleigh;
use contact_examples::systems::constrained::{ChaplyginSleigh, KnifeEdge, RollingDisc};
use contact_geom::constraints::Distribution;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::{Force, Forced, Scalar, Symmetry, VelocityPoint};
use discrete_herglotz::constraints::{ConstrainedStart, ConstraintError, LagrangeDAlembert, Nonholonomic};
use discrete_herglotz::rules::{Method, Rule};
use discrete_herglotz::{
    Checkpoint, Event, Events, InputError, Integrator, MomentumDecay, Observer, Problem, ResumeState, Rows,
    SplittingScheme, Status, StepView, Steps, Stop, Until, Vector,
};
use std::ops::ControlFlow;

contact_geom::lagrangian_enum! {
    /// Bodies on a plane with a blade, which are compiled together.
    #[derive(Clone, Copy, Debug)]
    enum Blade<3> {
        Sleigh(ChaplyginSleigh),
        Edge(KnifeEdge),
    }
}

impl Distribution<3, 1> for Blade {
    fn omega<T: Scalar>(&self, q: &SVector<T, 3>) -> SMatrix<T, 1, 3> {
        match self {
            Blade::Sleigh(sleigh) => sleigh.omega(q),
            Blade::Edge(edge) => edge.omega(q),
        }
    }
}

/// A composition of order 4, and one of order 8 for twelve digits.
const SCHEMES: [SplittingScheme; 2] = [SplittingScheme::SUZUKI_4, SplittingScheme::KAHAN_LI_8];

const SLOPE: f64 = 1.3;
const TURN: f64 = 1.7;
/// The invariant of the sleigh and its phase, as in `sleigh`.
const INVARIANT: f64 = 1.5;
const PHASE: f64 = -1.0;

fn damped_sleigh(gamma: f64) -> Blade {
    ChaplyginSleigh { mass: 1.0, arm: 1.0, inertia: 1.0, gamma }.into()
}

fn edge() -> Blade {
    KnifeEdge { slope: SLOPE, gamma: 0.0 }.into()
}

/// The start of the sleigh, and of the edge.
fn start(blade: &Blade) -> VelocityPoint<3> {
    match blade {
        Blade::Sleigh(_) => {
            let [u, w, _] = sleigh(0.0, 0.0, INVARIANT, PHASE);
            VelocityPoint::new([0.0; 3], [u, 0.0, w], 0.1)
        }
        Blade::Edge(_) => VelocityPoint::new([0.0; 3], [0.0, 0.0, TURN], 0.0),
    }
}

/// The position of the edge, and its velocity.
fn edge_at(t: f64) -> [[f64; 3]; 2] {
    let (turned, w) = (TURN * t, TURN);
    let (s, c) = turned.sin_cos();
    let x = SLOPE * s * s / (2.0 * w * w);
    let y = SLOPE * (turned - s * c) / (2.0 * w * w);
    [[x, y, turned], [SLOPE * s * c / w, SLOPE * s * s / w, w]]
}

/// Runs meet their accuracy: at their end, at rows, and at events, where the edge crosses a line across the slope and
/// where the sleigh has a given heading, by the closed forms.
#[test]
fn an_accuracy_is_met() {
    let until = Until::Time(4.0);
    for (scheme, accuracy) in SCHEMES.into_iter().zip([1e-7, 1e-11]) {
        let blade = edge();
        let problem = Problem::new(&blade, 0.0, start(&blade)).unwrap();
        let mut crossed = Events::new([Event::new(|_, x| x.q[1] - 0.9)]);
        let mut rows = Rows::at([1.1, 2.9]).unwrap();
        let run = problem.by(LagrangeDAlembert::<_, 1>::new(&blade, scheme)).accuracy(accuracy);
        let found = run.observe(&mut crossed).observe(&mut rows).run(until).unwrap();
        assert_eq!((found.status, found.unresolved), (Status::Completed, None));
        // The accuracy is relative to the size of the motion, at most that of its heading, 7.
        let bound = 7.0 * accuracy;
        let off = |t: f64, q: &Vector| (q.fixed::<3>() - SVector::from(edge_at(t)[0])).max_abs_or_nan();
        assert!(off(4.0, &found.q) <= bound, "{}: {:e}", scheme.name(), off(4.0, &found.q));
        assert_eq!((crossed.crossings.len(), rows.rows.len()), (1, 2));
        for row in &rows.rows {
            assert!(off(row.t, &row.q) <= bound, "{}: {:e}", scheme.name(), off(row.t, &row.q));
        }
        let [[_, y, _], [_, rate, _]] = edge_at(crossed.crossings[0].t);
        // The time of an event is off by the error of the state, divided by the rate, which is above 0.5 there.
        assert!(rate > 0.5 && (y - 0.9).abs() <= bound, "{}: {:e}", scheme.name(), y - 0.9);

        for gamma in [0.0, -0.1] {
            let blade = damped_sleigh(gamma);
            let problem = Problem::new(&blade, 0.0, start(&blade)).unwrap();
            let mut crossed = Events::new([Event::new(|_, x| x.q[2] - 2.0)]);
            let mut rows = Rows::at([1.1, 2.9]).unwrap();
            let run = problem.by(LagrangeDAlembert::<_, 1>::new(&blade, scheme)).accuracy(accuracy);
            let found = run.observe(&mut crossed).observe(&mut rows).run(until).unwrap();
            assert_eq!((found.status, found.unresolved), (Status::Completed, None));
            // Positions up to 4.
            let bound = 4.0 * accuracy;
            let ends = rows.rows.iter().map(|row| (row.t, row.q.clone())).chain([(found.t, found.q)]);
            for (t, q) in ends {
                let off = q[2] - sleigh(gamma, t, INVARIANT, PHASE)[2];
                assert!(off.abs() <= bound, "{} at {t}: {off:e}", scheme.name());
            }
            assert_eq!(crossed.crossings.len(), 1);
            let off = sleigh(gamma, crossed.crossings[0].t, INVARIANT, PHASE)[2] - 2.0;
            assert!(off.abs() <= bound, "{}: {off:e}", scheme.name());
        }
    }
}

/// Ends a run after this step.
struct StopsAt(usize);

impl Observer for StopsAt {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.k == self.0 { ControlFlow::Break(Stop::here("a test")) } else { ControlFlow::Continue(()) }
    }
}

/// A stopped run continues to the same bits.
#[test]
fn runs_are_resumed() {
    let path = std::env::temp_dir().join(format!("nonholonomic_{}", std::process::id()));
    for (blade, scheme) in [(damped_sleigh(-0.1), SCHEMES[0]), (edge(), SplittingScheme::STRANG)] {
        let problem = Problem::new(&blade, 0.0, start(&blade)).unwrap();
        let by = LagrangeDAlembert::<_, 1>::new(&blade, scheme);
        let run = || problem.by(by).steps(Steps::Count(400)).with_conformal_factor();
        let whole = run().run(Until::Time(4.0)).unwrap();
        assert_eq!((whole.status, whole.unresolved), (Status::Completed, None));
        let mut saved = Checkpoint::every(133, &path).unwrap();
        let mut interrupt = StopsAt(133);
        let stopped = run().observe(&mut saved).observe(&mut interrupt).run(Until::Time(4.0)).unwrap();
        assert_eq!((stopped.steps, saved.error.is_none()), (133, true));
        let state = ResumeState::read(&path).unwrap();
        assert_eq!(run().resume(state.clone()).run(Until::Time(4.0)).unwrap(), whole, "{}", scheme.name());
        // The constraints are part of the run.
        let other = Problem::new(&blade, 0.0, start(&blade)).unwrap();
        let free = other.by(Method::Midpoint).steps(Steps::Count(400)).with_conformal_factor();
        assert_eq!(free.resume(state).run(Until::Time(4.0)).err(), Some(InputError::AnotherRun));
    }
    std::fs::remove_file(path).unwrap();
}

/// Along a run of the rolling disc the momentum of its heading, a horizontal symmetry, is multiplied by the conformal
/// factor; that of a translation, which is a symmetry of L and of omega but not horizontal, is not: the force of the
/// constraints changes it, by the closed form.
#[test]
fn momenta_of_horizontal_symmetries_alone_are_dissipated() {
    let gamma = -0.2;
    let disc = RollingDisc { radius: 0.5, mass: 2.0, spin_inertia: 0.3, turn_inertia: 0.2, gamma };
    let (spin, turn) = (2.0, 1.5);
    let start = VelocityPoint::new([0.0; 4], [0.5 * spin, 0.0, spin, turn], 0.0);
    let problem = Problem::new(&disc, 0.0, start).unwrap();
    let by = LagrangeDAlembert::<_, 2>::new(&disc, SplittingScheme::SUZUKI_4);
    let along = |i: usize| SVector::<f64, 4>::from_fn(|j, _| f64::from(u8::from(i == j)));
    let mut heading = MomentumDecay::new(Symmetry::Translation(along(3)));
    let mut across = MomentumDecay::new(Symmetry::Translation(along(0)));
    let run = problem.by(by).steps(Steps::Count(100)).observe(&mut heading).observe(&mut across);
    let plan = run.plan(Until::Time(2.0)).unwrap();
    let info = plan.integrator();
    assert!(!info.contact && info.constrained && info.symmetric, "{info:?}");
    assert!(plan.entries().iter().any(|entry| entry.what == "contact form" && !entry.computed), "{plan}");
    let outcome = run.run(Until::Time(2.0)).unwrap();
    assert_eq!(outcome.unresolved, None);
    for row in &heading.rows {
        // As in `rolling_disc_follows_its_circle`: five substeps in each of a hundred steps.
        assert!(row.defect() < 1e-11, "{row:?}");
    }
    let tau = (2.0 * gamma).exp_m1() / gamma;
    let last = across.rows[100];
    // p = m v e^(gamma t) cos(heading); the prediction of Noether's theorem is without the cosine. The error of order 4
    // is below 1e-7.
    let expected = 2.0 * 0.5 * spin * (2.0 * gamma).exp();
    assert!((last.predicted - expected).abs() < 1e-6, "{last:?}");
    assert!((last.momentum - expected * (turn * tau).cos()).abs() < 1e-6, "{last:?}");
    assert!(last.defect() > 0.5, "{last:?}");
}

/// The force of the constraints at a state is that of the closed forms.
#[test]
fn force_of_the_constraints() {
    let across = |q: &SVector<f64, 3>, force: SVector<f64, 3>| {
        let (s, c) = q[2].sin_cos();
        assert!((force[0] * c + force[1] * s).abs() + force[2].abs() < 8.0 * f64::EPSILON, "{force}");
        force[1] * c - force[0] * s
    };
    for t in [0.0, 0.3, 1.9] {
        let blade = edge();
        let by = LagrangeDAlembert::<_, 1>::new(&blade, SplittingScheme::STRANG);
        let [q, v] = edge_at(t);
        let x = VelocityPoint::new(q, v, 0.7);
        // y'' = cos(theta) mu = slope sin(2 theta).
        let mu = across(&x.q, by.constraint_force(&blade, t, &x).unwrap());
        assert!((mu - 2.0 * SLOPE * q[2].sin()).abs() < 16.0 * f64::EPSILON, "{mu}");

        // The acceleration across the blade of the centre of mass, at the distance 1, is w' + u w = u w/2; drag, which
        // adds to w' and to the force, cancels.
        let blade = damped_sleigh(-0.1);
        let by = LagrangeDAlembert::<_, 1>::new(&blade, SplittingScheme::STRANG);
        let [u, w, heading] = sleigh(-0.1, t, INVARIANT, PHASE);
        let (s, c) = heading.sin_cos();
        let x = VelocityPoint::new([0.4, -0.2, heading], [u * c, u * s, w], 0.7);
        let mu = across(&x.q, by.constraint_force(&blade, t, &x).unwrap());
        assert!((mu - 0.5 * u * w).abs() < 16.0 * f64::EPSILON, "{mu}");
    }
}

/// A wind that does not depend on the motion.
#[derive(Clone, Copy, Debug)]
struct Wind;

impl Force<3> for Wind {
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<3, T>) -> SVector<T, 3> {
        x.v.map(|v| v * 0.0 + 1.0)
    }
}

/// What runs refuse before their first step.
#[test]
fn what_does_not_apply_is_refused() {
    let blade = edge();
    let refused = |start: VelocityPoint<3>, scheme: SplittingScheme| {
        let problem = Problem::new(&blade, 0.0, start).unwrap();
        problem.by(LagrangeDAlembert::new(&blade, scheme)).steps(Steps::Count(10)).run(Until::Time(0.5)).err()
    };
    let off = refused(VelocityPoint::new([0.0; 3], [0.0, 0.1, 1.0], 0.0), SCHEMES[0]);
    let Some(InputError::Constraint(ConstraintError::OffVelocity { distance })) = off else { panic!("{off:?}") };
    assert!((distance - 0.1).abs() < 1e-15, "{distance}");
    let nystrom = SplittingScheme::ALL.into_iter().find(SplittingScheme::is_nystrom).unwrap();
    assert!(matches!(refused(start(&blade), nystrom), Some(InputError::Hypothesis { .. })));
    // Compositions of a rule that is not symmetric have order one.
    let by =
        LagrangeDAlembert::<_, 1, _> { distribution: &blade, scheme: SplittingScheme::STRANG, rule: Rule::RECTANGLE };
    let rectangle = Integrator::<Blade, 3>::check(&by, &blade).err();
    assert!(matches!(rectangle, Some(InputError::Hypothesis { .. })), "{rectangle:?}");
    // A force would be left out.
    let windy = Forced::new(blade, Wind);
    let by = LagrangeDAlembert::<_, 1>::new(&blade, SplittingScheme::STRANG);
    let forced = Integrator::check(&by, &windy).err();
    assert!(matches!(forced, Some(InputError::Forced { .. })), "{forced:?}");
    let at = ConstrainedStart::new(start(&blade));
    let rule = |h| Rule::MIDPOINT.of(windy, h);
    let forced = Nonholonomic::<_, _, _, 3, 1>::new(windy, blade, rule, &SplittingScheme::STRANG, 0.1, &at).err();
    assert!(matches!(forced, Some(InputError::Forced { .. })), "{forced:?}");
    // Round-off is not met.
    let problem = Problem::new(&blade, 0.0, start(&blade)).unwrap();
    let by = LagrangeDAlembert::<_, 1>::new(&blade, SCHEMES[1]);
    let missed = problem.by(by).accuracy(1e-17).run(Until::Time(0.5)).err();
    assert!(matches!(missed, Some(InputError::Accuracy { .. })), "{missed:?}");
}
