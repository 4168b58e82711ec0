//! Members that fail, a start that panics, and invalid input.

use super::systems::{Bowl, pendulum};
use super::{By, gauss, pendulum_start, splitting};
use crate::lagrangians::One;
use contact_geom::VelocityPoint;
use discrete_herglotz::ensemble::{EnsembleError, Member};
use discrete_herglotz::rules::Rule;
use discrete_herglotz::{Ensemble, InputError, Integrator, SplittingScheme, Status, Steps, Until};

#[test]
fn a_member_that_fails_has_its_error_and_the_others_continue() {
    // From q = 0.5 with v = 5 the motion crosses the edge; at 2 L is not defined.
    let start = |i: usize| match i {
        3 => VelocityPoint::new([0.5], [5.0], 0.0),
        20 => VelocityPoint::new([2.0], [0.0], 0.0),
        21 => VelocityPoint::new([0.1], [f64::INFINITY], 0.0),
        _ => VelocityPoint::new([0.001 * i as f64], [0.1], 0.0),
    };
    let good = |i: usize| VelocityPoint::new([0.001 * i as f64], [0.1], 0.0);
    let bowl = One::from(Bowl);
    for by in [splitting(SplittingScheme::KAHAN_LI_6), gauss(4), By::Rule(Rule::MIDPOINT)] {
        let all = |start: &(dyn Fn(usize) -> VelocityPoint<1> + Sync)| {
            let ensemble = Ensemble::new(&bowl, 0.0, 40, start).by(by).steps(Steps::Count(20)).threads(1);
            let mut all = Vec::new();
            (ensemble.run(Until::Time(2.0), |member| all.push(member.clone())).unwrap(), all)
        };
        let ((tally, mixed), (_, plain)) = (all(&start), all(&good));
        assert_eq!((tally.completed, tally.failed, tally.first_failed), (37, 3, Some(3)), "{by:?}");
        let Ok(failed) = &mixed[3].ending else { unreachable!("{by:?}: {:?}", mixed[3]) };
        assert!(matches!(failed.status, Status::Failed { .. }), "{by:?}: {failed:?}");
        assert!(failed.t < 2.0 && failed.state.q[0].is_finite(), "{by:?}: {failed:?}");
        assert_eq!(mixed[20].ending, Err(InputError::Undefined), "{by:?}");
        assert!(matches!(mixed[21].ending, Err(InputError::Geometry(_))), "{by:?}: {:?}", mixed[21].ending);
        for i in (0..40).filter(|i| ![3, 20, 21].contains(i)) {
            assert_eq!(mixed[i], plain[i], "{by:?}");
        }
    }
}

#[test]
fn bad_input_is_refused_before_work_begins() {
    let pendulum = pendulum(-0.1);
    let by = SplittingScheme::STRANG;
    let of = |count: usize| Ensemble::new(&pendulum, 0.0, count, pendulum_start).by(by).steps(Steps::Count(4));
    let fold = |_: &Member| unreachable!("nothing is computed");
    let until = Until::Time(1.0);
    assert!(matches!(of(0).run(until, fold), Err(EnsembleError::Empty)));
    assert!(matches!(of(1).threads(0).run(until, fold), Err(EnsembleError::Threads)));
    let refused = |result: Result<_, EnsembleError>| match result {
        Err(EnsembleError::Member { index: 0, cause }) => cause,
        other => unreachable!("{other:?}"),
    };
    let endless = refused(of(9).run(Until::Time(f64::INFINITY), fold));
    assert_eq!(endless, InputError::Span { span: f64::INFINITY });
    assert!(matches!(refused(of(9).steps(Steps::Size(-1.0)).run(until, fold)), InputError::Step { .. }));
    let none = Ensemble::new(&pendulum, 0.0, 9, pendulum_start);
    assert_eq!(refused(none.run(until, fold)), InputError::NoIntegrator);
    let none = Ensemble::new(&pendulum, 0.0, 9, pendulum_start).by(by);
    assert_eq!(refused(none.run(until, fold)), InputError::NoSteps);
    // An invalid start in an ensemble in which all starts are invalid.
    let nowhere = Ensemble::new(&pendulum, 0.0, 9, |_| VelocityPoint::new([f64::NAN], [0.0], 0.0)).by(by);
    assert!(matches!(refused(nowhere.steps(Steps::Count(4)).run(until, fold)), InputError::Geometry(_)));
    assert!(Integrator::<One, 1>::batch_kernel(&by).is_some());
}

#[test]
fn a_panic_of_the_start_is_one_of_the_run() {
    let pendulum = pendulum(-0.1);
    let start = |i: usize| if i == 777 { unreachable!("a start that panics") } else { pendulum_start(i) };
    let ensemble =
        Ensemble::new(&pendulum, 0.0, 100_000, start).by(SplittingScheme::STRANG).steps(Steps::Count(2)).threads(3);
    // The panic does not cause a deadlock.
    let run = std::panic::AssertUnwindSafe(|| ensemble.run(Until::Time(1.0), |_| {}));
    assert!(std::panic::catch_unwind(run).is_err());
}
