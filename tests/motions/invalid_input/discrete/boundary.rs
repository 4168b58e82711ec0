//! Invalid input to paths between given ends.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EVERYTHING, EXTREME, Report};
use crate::lagrangians::{One, one};
use contact_examples::systems::Pendulum;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::{
    InputError,
    boundary::{BoundaryPath, CriticalPath, End, branch, continuation},
    rules::{Quadrature, Rule},
    theory::DiscretePath,
};

pub const TESTS: &[InputTest] = &[InputTest {
    entries: &[
        "BoundaryPath::new",
        "BoundaryPath::periodic",
        "BoundaryPath::starting_at",
        "BoundaryPath::from_path",
        "BoundaryPath::avoiding",
        "BoundaryPath::steps",
        "BoundaryPath::search",
        "BoundaryPath::index",
        "CriticalPath::is_found",
        "CriticalPath::action",
        "CriticalPath::path",
        "boundary::continuation",
        "boundary::branch",
    ],
    run: paths,
}];

/// Input that is not finite is refused; otherwise a search ends, and a path is found only if it is finite and has a
/// small residual.
fn paths(report: &mut Report) {
    fn judge(
        report: &mut Report,
        what: &str,
        problem: Result<BoundaryPath<&Quadrature<One>, 1>, InputError>,
        good: bool,
    ) {
        report.check(problem.is_ok() == good, || format!("{what}: {:?}", problem.as_ref().err()));
        let Ok(problem) = problem else { return };
        let found = problem.search();
        let sound = |path: &CriticalPath<1>| {
            path.points.len() == problem.steps() + 1
                && (!path.is_found()
                    || path.path().is_ok() && path.action().is_finite() && path.relative_residual < 1e-9)
        };
        report.check(sound(&found), || format!("{what}: {found:?}"));
        let index = problem.index(&found);
        report.check(index.is_ok() || !found.is_found(), || format!("{what}: the index {index:?}"));
        let other = problem.clone().avoiding(&[&found], 1.0).map(|problem| problem.search());
        report.check(other.as_ref().is_ok_and(sound), || format!("{what}: beside it {other:?}"));
    }
    let ld = Rule::MIDPOINT.of(EVERYTHING, 0.1).unwrap();
    let at = |q: f64| End::Position(SVector::from([q]));
    for value in EXTREME {
        let good = value.is_finite();
        for ends in [
            [at(value), at(0.4)],
            [at(0.3), at(value)],
            [End::Momentum([value].into()), at(0.4)],
            [End::Free, at(value)],
        ] {
            judge(report, &format!("{ends:?}"), BoundaryPath::new(&ld, 4, ends), good);
        }
        judge(report, &format!("a shift {value}"), BoundaryPath::periodic(&ld, 4, [value].into()), good);
        for (t0, z0) in [(value, 0.0), (0.0, value)] {
            let problem = BoundaryPath::new(&ld, 4, [at(0.3), at(0.4)]).unwrap().starting_at(t0, z0);
            judge(report, &format!("t0 = {t0}, z0 = {z0}"), problem, good);
        }
        if let Ok(path) = DiscretePath::new([0.3, value, 0.4].map(|q| SVector::from([q])).into()) {
            let problem = BoundaryPath::new(&ld, 2, [at(0.3), at(0.4)]).unwrap().from_path(path);
            judge(report, &format!("from a path through {value}"), problem, true);
        }
        let known = BoundaryPath::new(&ld, 4, [at(0.3), at(0.4)]).unwrap().search();
        let avoiding = BoundaryPath::new(&ld, 4, [at(0.3), at(0.4)]).unwrap().avoiding(&[&known], value);
        report.check(avoiding.is_ok() == (good && value > 0.0), || format!("deflation by {value}"));
        let pendulum = Rule::MIDPOINT.of(one(Pendulum::default()), 0.1).unwrap();
        let ends = BoundaryPath::new(&pendulum, 4, [at(0.0), at(value)]);
        let paths = ends.and_then(|problem| continuation([problem.clone(), problem]));
        report.check(paths.is_ok() == good, || format!("continuation to {value}: {paths:?}"));
    }
    for steps in [0, 1] {
        let refused = BoundaryPath::new(&ld, steps, [at(0.3), at(0.4)]).is_err();
        report.check(refused && BoundaryPath::periodic(&ld, steps, [0.0].into()).is_err(), || format!("{steps} steps"));
    }
    // Values at the end of a path of the pendulum.
    let pendulum = Rule::MIDPOINT.of(one(Pendulum::default()), 0.1).unwrap();
    let problem = |q: f64| BoundaryPath::new(&pendulum, 4, [at(0.0), at(q)]);
    for value in EXTREME {
        for range in [[value, 0.4], [0.1, value]] {
            let found = branch(problem, range, 0.1, 8);
            let good = |paths: &Vec<(f64, CriticalPath<1>)>| {
                paths.iter().all(|(q, path)| q.is_finite() && path.points.iter().all(|q| q[0].is_finite()))
            };
            report.check(found.as_ref().map_or(true, good), || format!("a branch over {range:?}: {found:?}"));
            report.check(found.is_err() || value.is_finite(), || format!("a branch over {range:?}"));
        }
        if !(value > 0.0 && value < 1e-3) {
            let found = branch(problem, [0.1, 0.4], value, 8);
            report.check(found.is_err() || value > 0.0 && value.is_finite(), || {
                format!("a branch by {value}: {found:?}")
            });
        }
    }
    report.check(branch(problem, [0.1, 0.4], 0.1, 1).is_err(), || "a branch of one path".into());
}
