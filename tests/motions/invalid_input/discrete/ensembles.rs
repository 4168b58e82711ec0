//! Invalid input to ensembles.

use super::runs::BY;
use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{CLAIMING, EXTREME, Report, places, triples};
use crate::lagrangians::One;
use contact_geom::VelocityPoint;
use discrete_herglotz::{
    Ensemble, Problem, Rows, Status, Steps, Until,
    ensemble::{EnsembleError, Lagrangians, Member, Tally},
};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
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
            "Ensemble::without_resolution_check",
            "Ensemble::observe",
            "ObservedEnsemble::run",
            "Problem::ensemble",
            "Integrator::batch_kernel",
        ],
        run: ensembles,
    },
    InputTest {
        entries: &[
            "Ensemble::in_shards",
            "Ensemble::merge",
            "ShardedEnsemble::compute",
            "ShardedEnsemble::count",
            "ShardedEnsemble::fingerprint",
            "Merge::add",
            "Merge::missing",
            "Merge::bound",
            "Merge::tally",
        ],
        run: shards,
    },
];

/// The members at their ends.
fn ends(ensemble: &Ensemble<'_, Lagrangians<'_, One, 1>>, until: Until) -> Result<(Tally, Vec<Member>), EnsembleError> {
    let mut all = Vec::new();
    let tally = ensemble.run(until, |member| all.push(member.clone()))?;
    Ok((tally, all))
}

/// Whether members end with finite states or an error.
fn good(ended: &Result<(Tally, Vec<Member>), EnsembleError>, count: usize) -> bool {
    let Ok((tally, all)) = ended else { return true };
    let finite = all.iter().all(|m| m.ending.as_ref().is_ok_and(|e| e.state.is_finite()) || m.ending.is_err());
    finite && all.len() == count && (tally.members, tally.completed + tally.failed) == (count, count)
}

fn ensembles(report: &mut Report) {
    let tame = VelocityPoint::from(triples()[0]);
    for by in BY.into_iter().flatten() {
        for (t, x) in places() {
            // A member with an invalid start among others.
            let start = |i: usize| if i == 1 { VelocityPoint::from(x) } else { tame };
            let of = Ensemble::new(&CLAIMING, t, 3, start).by(by).steps(Steps::Count(5)).threads(1);
            let ended = ends(&of, Until::Time(t + 0.5));
            report.check(good(&ended, 3), || format!("{by}, {x:?} at {t}: {ended:?}"));
            let others = ended.as_ref().map_or(true, |(_, all)| {
                [0, 2].iter().all(|i| all[*i].ending.as_ref().is_ok_and(|e| e.status == Status::Completed))
            });
            report.check(others, || format!("{by}, beside {x:?} at {t}: {ended:?}"));
            report.check(ended.is_ok() || !(t + 0.5).is_finite() || t + 0.5 == t, || format!("{by} at {t}: {ended:?}"));
        }
        for number in EXTREME {
            let of = |steps| Ensemble::of(0.4, 2, |_| (&CLAIMING, tame)).by(by).steps(steps).without_action();
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
    let of = |count| Ensemble::new(&CLAIMING, 0.4, count, |_| tame).steps(Steps::Count(3));
    let until = Until::After(0.5);
    report.check(matches!(ends(&of(0), until), Err(EnsembleError::Empty)), || "no member".into());
    let by = BY.into_iter().flatten().next();
    let of = |count| by.map_or(of(count), |by| of(count).by(by));
    report.check(matches!(ends(&of(1).threads(0), until), Err(EnsembleError::Threads)), || "no thread".into());
    report.check(ends(&of(1).rows_every(0), until).is_err(), || "rows every 0 steps".into());
    report.check(ends(&of(1).rows_every(usize::MAX).without_resolution_check(), until).is_ok(), || {
        "rows of the ends alone".into()
    });
    for wanted in EXTREME {
        // An error that cannot be reached is refused; a requested error above that of any steps may be reached.
        let ended = ends(&of(2).accuracy(wanted), until);
        report.check(good(&ended, 2), || format!("accuracy {wanted}: {ended:?}"));
        report.check(wanted > 0.0 || ended.is_err(), || format!("accuracy {wanted}: {ended:?}"));
    }
    let observed = of(2).observe(Rows::every, |rows: Rows<'_>| rows.rows.len());
    let mut seen = Vec::new();
    let tally = observed.run(until, |member, rows| seen.push((member.ending.is_ok(), rows.is_some())));
    report.check(tally.is_ok() && seen == [(false, false), (true, true)], || format!("observers: {seen:?}"));
    if let (Ok(problem), Some(by)) = (Problem::new(&CLAIMING, 0.4, tame), by) {
        let ended = ends(&problem.ensemble(1, |_| tame).by(by).steps(Steps::Count(3)), until);
        report.check(ended.is_ok(), || format!("of a problem: {ended:?}"));
    }
    report.check(ends(&of(1).threads(usize::MAX), until).is_ok(), || "more threads than members".into());
    let folder = std::env::temp_dir();
    report.check(ends(&of(1).checkpoint(folder), until).is_err(), || "a folder for a checkpoint".into());
    report.check(ends(&of(1).progress(|part| assert!(part == 1.0)), until).is_ok(), || "progress".into());
}

/// Shards that the ensemble does not have, and data that belong to no shard.
fn shards(report: &mut Report) {
    let tame = VelocityPoint::from(triples()[0]);
    let by = BY.into_iter().flatten().next().unwrap();
    let of = |t, count| Ensemble::new(&CLAIMING, t, count, |_| tame).by(by).steps(Steps::Count(3));
    for number in EXTREME {
        let ensemble = of(number, 400);
        let sharded = ensemble.in_shards(Until::After(0.5));
        report.check(sharded.is_err() || number.is_finite(), || format!("shards from the time {number}"));
    }
    report.check(of(0.4, 0).in_shards(Until::After(0.5)).is_err(), || "shards of no member".into());
    let (ensemble, other) = (of(0.4, 400), of(0.5, 400));
    let (Ok(sharded), Ok(foreign)) = (ensemble.in_shards(Until::After(0.5)), other.in_shards(Until::After(0.5))) else {
        return report.check(false, || "shards of a good ensemble".into());
    };
    report.check(sharded.fingerprint() != foreign.fingerprint(), || "one fingerprint of two ensembles".into());
    let mut indices = Vec::new();
    let mut fold = |member: &Member| indices.push(member.index);
    let Ok(mut merge) = ensemble.merge(&sharded, &mut fold) else {
        return report.check(false, || "a merge of a good ensemble".into());
    };
    let good: Vec<Vec<u64>> = (0..sharded.count()).map(|shard| sharded.compute(shard)).collect();
    let mut bad = vec![Vec::new(), vec![0], vec![u64::MAX; 4], vec![0; 1000]];
    bad.extend([sharded.count(), usize::MAX].map(|shard| sharded.compute(shard)));
    for words in &good {
        bad.push(words[..words.len() - 1].to_vec());
        bad.push(words.iter().copied().chain([0]).collect());
        for place in 0..3 {
            for value in [u64::MAX, 1 << 40, words[place] + 1] {
                let mut changed = words.clone();
                changed[place] = value;
                // The number of members in lanes may be any number.
                if place != 1 {
                    bad.push(changed);
                }
            }
        }
    }
    // The data of one shard with the number of the other are refused because of their length.
    for words in &bad {
        let refused = matches!(merge.add(words), Err(EnsembleError::ForeignShard));
        report.check(refused, || format!("{:?}.. of {} words", words.iter().take(3).collect::<Vec<_>>(), words.len()));
    }
    report.check(merge.missing().len() == sharded.count() && merge.tally().members == 0, || "taken in".into());
    report
        .check(merge.bound(0) > 0 && merge.bound(usize::MAX) == usize::MAX, || "the bound of no worker, of all".into());
    for words in good.iter().rev().chain(&good) {
        report.check(merge.add(words).is_ok(), || "a good shard".into());
    }
    report.check(merge.missing().is_empty() && merge.tally().members == 400, || format!("{:?}", merge.tally()));
    report.check(indices.iter().copied().eq(0..400), || "members in another order".into());
}
