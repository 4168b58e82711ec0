//! Attacks on ensembles.

use super::runs::BY;
use crate::Attack;
use crate::numbers::{Claiming, HOSTILE, Report, places, triples};
use contact_geom::VelocityPoint;
use discrete_herglotz::{Ensemble, EnsembleError, Member, Problem, Rows, Status, Steps, Tally, Until};

pub const ATTACKS: &[Attack] = &[Attack {
    on: &[
        "Ensemble::new",
        "Ensemble::of",
        "Ensemble::by",
        "Ensemble::steps",
        "Ensemble::threads",
        "Ensemble::without_action",
        "Ensemble::checkpoint",
        "Ensemble::progress",
        "Ensemble::run",
        "Ensemble::rows_every",
        "Ensemble::accuracy",
        "Ensemble::unwatched",
        "Ensemble::observe",
        "ObservedEnsemble::run",
        "Problem::ensemble",
        "Integrator::in_lanes",
    ],
    run: ensembles,
}];

/// The members at their ends.
fn ends(ensemble: &Ensemble<'_, Claiming, 1>, until: Until) -> Result<(Tally, Vec<Member<1>>), EnsembleError> {
    let mut all = Vec::new();
    let tally = ensemble.run(until, |member| all.push(member.clone()))?;
    Ok((tally, all))
}

/// Whether members have ended, with finite states, or say why not.
fn good(ended: &Result<(Tally, Vec<Member<1>>), EnsembleError>, count: usize) -> bool {
    let Ok((tally, all)) = ended else { return true };
    let finite = all.iter().all(|m| m.ending.is_ok_and(|e| e.state.check().is_ok()) || m.ending.is_err());
    finite && all.len() == count && (tally.members, tally.completed + tally.failed) == (count, count)
}

fn ensembles(report: &mut Report) {
    let tame = VelocityPoint::from(triples()[0]);
    for by in BY.into_iter().flatten() {
        for (t, x) in places() {
            // One that no one means among good ones.
            let start = |i: usize| if i == 1 { VelocityPoint::from(x) } else { tame };
            let of = Ensemble::new(&Claiming, t, 3, start).by(by).steps(Steps::Count(5)).threads(1);
            let ended = ends(&of, Until::Time(t + 0.5));
            report.check(good(&ended, 3), || format!("{by}, {x:?} at {t}: {ended:?}"));
            let others = ended.as_ref().map_or(true, |(_, all)| {
                [0, 2].iter().all(|i| all[*i].ending.is_ok_and(|e| e.status == Status::Completed))
            });
            report.check(others, || format!("{by}, beside {x:?} at {t}: {ended:?}"));
            report.check(ended.is_ok() || !(t + 0.5).is_finite() || t + 0.5 == t, || format!("{by} at {t}: {ended:?}"));
        }
        for number in HOSTILE {
            let of = |steps| Ensemble::of(0.4, 2, |_| (&Claiming, tame)).by(by).steps(steps).without_action();
            if !(number > 0.0 && number < 1e-3) {
                let ended = ends(&of(Steps::Size(number)), Until::Time(0.9));
                report.check(good(&ended, 2), || format!("{by}, steps of {number}: {ended:?}"));
                report.check(number > 0.0 || ended.is_err(), || format!("{by}, steps of {number}: {ended:?}"));
            }
            let ended = ends(&of(Steps::Count(3)), Until::Time(number));
            report.check(good(&ended, 2), || format!("{by} until {number}: {ended:?}"));
            report.check(number.is_finite() || ended.is_err(), || format!("{by} until {number}: {ended:?}"));
        }
    }
    let of = |count| Ensemble::new(&Claiming, 0.4, count, |_| tame).steps(Steps::Count(3));
    let until = Until::After(0.5);
    report.check(matches!(ends(&of(0), until), Err(EnsembleError::Empty)), || "no member".into());
    let by = BY.into_iter().flatten().next();
    let of = |count| by.map_or(of(count), |by| of(count).by(by));
    report.check(matches!(ends(&of(1).threads(0), until), Err(EnsembleError::Threads)), || "no thread".into());
    report.check(ends(&of(1).rows_every(0), until).is_err(), || "rows every 0 steps".into());
    report.check(ends(&of(1).rows_every(usize::MAX).unwatched(), until).is_ok(), || "rows of the ends alone".into());
    for wanted in HOSTILE {
        // An error that cannot be had is refused; one above that of any steps may be had.
        let ended = ends(&of(2).accuracy(wanted), until);
        report.check(good(&ended, 2), || format!("accuracy {wanted}: {ended:?}"));
        report.check(wanted > 0.0 || ended.is_err(), || format!("accuracy {wanted}: {ended:?}"));
    }
    let observed = of(2).observe(Rows::every, |rows: Rows<'_, 1>| rows.rows.len());
    let mut seen = Vec::new();
    let tally = observed.run(until, |member, rows| seen.push((member.ending.is_ok(), rows.is_some())));
    report.check(tally.is_ok() && seen == [(false, false), (true, true)], || format!("observers: {seen:?}"));
    if let (Ok(problem), Some(by)) = (Problem::new(&Claiming, 0.4, tame), by) {
        let ended = ends(&problem.ensemble(1, |_| tame).by(by).steps(Steps::Count(3)), until);
        report.check(ended.is_ok(), || format!("of a problem: {ended:?}"));
    }
    report.check(ends(&of(1).threads(usize::MAX), until).is_ok(), || "more threads than members".into());
    let folder = std::env::temp_dir();
    report.check(ends(&of(1).checkpoint(folder), until).is_err(), || "a folder for a checkpoint".into());
    report.check(ends(&of(1).progress(|part| assert!(part == 1.0)), until).is_ok(), || "progress".into());
}
