//! Attacks on scenes.

use crate::Attack;
use crate::numbers::{Claiming, HOSTILE, Report, places, triples};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, VelocityPoint};
use discrete_herglotz::{InputError, Integrator, Method, Scene, SplittingScheme, Steps, Wanted};

pub const ATTACKS: &[Attack] = &[
    Attack { on: &["Integrator::check"], run: integrators },
    Attack {
        on: &[
            "Scene::new",
            "Scene::from_time",
            "Scene::by",
            "Scene::steps",
            "Scene::wanting",
            "Scene::wanted",
            "Scene::plan",
            "Plan::step_size",
            "Plan::count",
            "Plan::error",
            "Plan::integrator",
            "Plan::items",
            "Plan::stepper",
            "Plan::run",
        ],
        run: scenes,
    },
];

/// A free particle that claims nothing.
struct Silent;

impl Lagrangian<1> for Silent {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5
    }
}

fn integrators(report: &mut Report) {
    for stages in [0, 17, usize::MAX] {
        for integrator in [Integrator::Gauss { stages }, Integrator::Clocked { stages }] {
            let refused = integrator.check(&Claiming);
            report.check(refused == Err(InputError::Stages { found: stages }), || format!("{integrator}: {refused:?}"));
        }
    }
    report.check(Integrator::Splitting(SplittingScheme::STRANG).check(&Silent).is_err(), || "unclaimed".into());
    let pair = Integrator::Composition(Method::Rectangle, SplittingScheme::YOSHIDA_4).check(&Silent);
    report.check(matches!(pair, Err(InputError::Hypothesis { .. })), || format!("{pair:?}"));
}

fn scenes(report: &mut Report) {
    let start = VelocityPoint::from(triples()[0]);
    let scene = |span: f64| Scene::new(&Claiming, start, span).steps(Steps::Count(7));
    let run = |scene: &Scene<'_, Claiming, 1>| {
        scene.plan().and_then(|plan| plan.run()).map(|o| ((o.q, o.p), (o.z, o.t), o.conformal_factor))
    };
    for (t, x) in places() {
        let scene = Scene::new(&Claiming, x.into(), 0.5).from_time(t).steps(Steps::Count(7));
        for integrator in [
            Integrator::Gauss { stages: 6 },
            Integrator::Discrete(Method::Trapezoidal),
            Integrator::Splitting(SplittingScheme::BLANES_MOAN_6),
            Integrator::Composition(Method::Midpoint, SplittingScheme::YOSHIDA_4),
        ] {
            let made = Scene::new(&Claiming, x.into(), 0.5).from_time(t).steps(Steps::Count(7)).by(integrator);
            report.door(&(t, x), run(&made));
        }
        report.door(&(t, x), run(&scene));
    }
    for span in HOSTILE {
        let refused = !(span > 0.0 && span.is_finite());
        report.check(!refused || matches!(run(&scene(span)), Err(InputError::Span { .. })), || {
            format!("a span of {span}")
        });
        report.door(&span, run(&scene(span)));
    }
    for h in HOSTILE.into_iter().filter(|h| !(*h > 0.0 && *h < 1e-3)) {
        let made = scene(0.5).steps(Steps::Size(h));
        let refused = !(h > 0.0 && h.is_finite());
        report.check(!refused || matches!(run(&made), Err(InputError::Step { .. })), || format!("steps of {h}"));
        report.door(&h, run(&made));
    }
    for error in HOSTILE {
        let made = scene(0.5).steps(Steps::Accuracy(error));
        let refused = !(error > 0.0 && error.is_finite());
        report.check(!refused || matches!(run(&made), Err(InputError::Tolerance { .. })), || {
            format!("to an error of {error}")
        });
        if let Ok(plan) = made.plan() {
            let kept = plan.error().is_some_and(|found| found <= error) && plan.integrator().order() > 0;
            report.check(kept, || format!("{:?} where {error} is asked for", plan.error()));
        }
        report.door(&error, run(&made));
    }
    report.check(run(&scene(0.5).steps(Steps::Count(0))).is_err(), || "no step".into());
    for rows in [0, 1, usize::MAX] {
        let wanted = Wanted { rows: Some(rows), conformal_factor: true, ..Wanted::default() };
        let made = scene(0.5).wanting(wanted.clone());
        report.check(made.wanted() == &wanted, || "what is wanted".into());
        let outcome = made.plan().and_then(|plan| plan.run());
        let expected = [None, Some(8), Some(2)][[0, 1, usize::MAX].iter().position(|r| *r == rows).unwrap()];
        report.check(outcome.ok().map(|o| o.rows.len()) == expected, || format!("a row every {rows} steps"));
    }
    let plan = scene(0.5).plan().unwrap();
    report.check(plan.count() == 7 && (plan.step_size() - 0.5 / 7.0).abs() < 1e-16, || "seven steps".into());
    report.check(!plan.items().is_empty() && plan.stepper().is_ok(), || "a plan says what it does".into());
}
