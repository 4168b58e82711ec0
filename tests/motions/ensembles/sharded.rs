//! Tests of ensembles in shards: merged in any order they are bitwise equal to one run, and a checkpoint with missing
//! shards can be resumed.

use crate::lagrangians::One;
use contact_examples::systems::{OneCoordinate, Pendulum};
use contact_geom::VelocityPoint;
use discrete_herglotz::{
    CheckpointError, Ensemble, SplittingScheme, Steps, Until,
    ensemble::{EnsembleError, Lagrangians, Tally},
};

const PENDULUM: One = One::Catalogue(OneCoordinate::Pendulum(Pendulum { gamma: -0.1 }));
const UNTIL: Until = Until::Time(2.0);

/// The number of members: six shards, the last one not full. A member of the third shard has an invalid initial state.
const COUNT: usize = 2000;

fn ensemble(steps: usize) -> Ensemble<'static, Lagrangians<'static, One, 1>> {
    let start = |i: usize| {
        let angle = if i == 900 { f64::NAN } else { 0.001 * i as f64 };
        VelocityPoint::new([angle], [0.5], 0.1)
    };
    Ensemble::new(&PENDULUM, 0.0, COUNT, start).by(SplittingScheme::STRANG).steps(Steps::Count(steps)).threads(2)
}

/// All members as text, and the tally.
fn plain(of: &Ensemble<'_, Lagrangians<'_, One, 1>>) -> (Vec<String>, Tally) {
    let mut all = Vec::new();
    let tally = of.run(UNTIL, |member| all.push(format!("{member:?}"))).unwrap();
    (all, tally)
}

/// The same from shards that are added in the given order.
fn merged(of: &Ensemble<'_, Lagrangians<'_, One, 1>>, order: &[usize]) -> (Vec<String>, Tally) {
    let (sharded, mut all) = (of.in_shards(UNTIL).unwrap(), Vec::new());
    let mut fold = |member: &_| all.push(format!("{member:?}"));
    let mut merge = of.merge(&sharded, &mut fold).unwrap();
    for shard in order {
        merge.add(&sharded.compute(*shard)).unwrap();
        assert!(!merge.missing().contains(shard));
    }
    let tally = merge.tally();
    (all, tally)
}

#[test]
fn shards_in_any_order_are_one_run() {
    let of = ensemble(20);
    let expected = plain(&of);
    assert_eq!((expected.1.members, expected.1.failed, expected.1.first_failed), (COUNT, 1, Some(900)));
    // The last order has repeated shards.
    for order in [[0, 1, 2, 3, 4, 5].as_slice(), &[5, 4, 3, 2, 1, 0], &[2, 2, 0, 5, 0, 1, 4, 3, 3, 1]] {
        assert_eq!(merged(&of, order), expected, "{order:?}");
    }
    // Shards are not handed on before the first one is complete.
    let (all, tally) = merged(&of, &[1, 2, 3, 4, 5]);
    assert!(all.is_empty() && tally.members == 0);
}

#[test]
fn a_checkpoint_with_gaps_is_gone_on_from() {
    let folder = std::env::temp_dir().join(format!("sharded-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("shards");
    let of = ensemble(20).checkpoint(&path);
    let expected = plain(&ensemble(20));
    let begin_anew = |shards: &[usize]| {
        let _ = std::fs::remove_file(&path);
        merged(&of, shards)
    };
    for there in [[4, 1].as_slice(), &[5, 0, 3], &[3, 2, 1, 5, 4]] {
        // Resumed by one process, and by several.
        begin_anew(there);
        assert_eq!(plain(&of), expected, "{there:?}");
        assert_eq!(plain(&of), expected, "{there:?}, from a whole file");
        begin_anew(there);
        let missing: Vec<usize> = (0..6).rev().filter(|shard| !there.contains(shard)).collect();
        assert_eq!(merged(&of, &missing), expected, "{there:?}");
        // A truncated shard is computed again.
        begin_anew(there);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        assert_eq!(plain(&of), expected, "{there:?}, cut off");
    }
    // A shard that is added twice is stored once.
    begin_anew(&[4, 1]);
    let once = std::fs::read(&path).unwrap();
    begin_anew(&[4, 4, 1, 4]);
    assert!(std::fs::read(&path).unwrap() == once);
    // A flipped bit in the number of a shard is detected.
    begin_anew(&[4]);
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[40] ^= 64;
    std::fs::write(&path, &bytes).unwrap();
    let damaged = of.run(UNTIL, |_| {});
    assert!(matches!(damaged, Err(EnsembleError::Checkpoint { cause: CheckpointError::Damaged, .. })), "{damaged:?}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_no_shard_is_refused() {
    let of = ensemble(20);
    let sharded = of.in_shards(UNTIL).unwrap();
    let mut fold = |_: &_| {};
    let mut merge = of.merge(&sharded, &mut fold).unwrap();
    let good = sharded.compute(5);
    let mut no_such_shard = good.clone();
    no_such_shard[0] = 6;
    // A full shard with the number of the last one, which is not full.
    let mut too_long = sharded.compute(1);
    too_long[0] = 5;
    let mut longer = good.clone();
    longer.push(0);
    let mut no_bool = good.clone();
    no_bool[3] = 2;
    let of_none = sharded.compute(6);
    for words in [&[][..], &good[..9], &no_such_shard, &too_long, &longer, &no_bool, &of_none, &[u64::MAX; 3]] {
        let refused = merge.add(words);
        assert!(matches!(refused, Err(EnsembleError::ForeignShard)), "{refused:?}");
    }
    merge.add(&good).unwrap();
    assert_eq!(merge.missing(), [0, 1, 2, 3, 4]);
}

/// Results that wait to be merged occupy memory, unless there is a checkpoint.
#[test]
fn the_window_is_bounded_without_a_checkpoint() {
    let of = ensemble(2);
    let sharded = of.in_shards(UNTIL).unwrap();
    let mut fold = |_: &_| {};
    let mut merge = of.merge(&sharded, &mut fold).unwrap();
    assert_eq!((merge.bound(2), merge.bound(10_000)), (16, 80_000));
    merge.add(&sharded.compute(0)).unwrap();
    assert_eq!((merge.missing(), merge.bound(2)), (vec![1, 2, 3, 4, 5], 17));
    let path = std::env::temp_dir().join(format!("sharded-window-{}", std::process::id()));
    let kept = ensemble(2).checkpoint(&path);
    assert_eq!(kept.merge(&sharded, &mut fold).unwrap().bound(2), usize::MAX);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn fingerprints_tell_ensembles_apart() {
    let fingerprint =
        |of: Ensemble<'static, Lagrangians<'static, One, 1>>, until| of.in_shards(until).unwrap().fingerprint();
    let first = fingerprint(ensemble(20), UNTIL);
    assert_eq!(fingerprint(ensemble(20).threads(1), UNTIL), first);
    let others = [
        fingerprint(ensemble(21), UNTIL),
        fingerprint(ensemble(20), Until::Time(3.0)),
        fingerprint(ensemble(20).without_action(), UNTIL),
        fingerprint(ensemble(20).by(SplittingScheme::YOSHIDA_4), UNTIL),
    ];
    assert!(others.iter().all(|other| *other != first), "{others:?}");
}
