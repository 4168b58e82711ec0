//! Ensembles by accuracy whose members take other steps than equal ones: each of these is its single run.

use super::{GAUSS, accurate, members};
use contact_geom::VelocityPoint;
use discrete_herglotz::ensemble::{EnsembleError, Member};
use discrete_herglotz::{GaussCollocation, Until};
use formula_lagrangian::{Formula, FormulaNames};
use herglotz_runtime::{
    Ensemble, Event, InitialVelocity, MemberEnd, Motion, Start, Status, StepControl, System, Tally,
};
use std::ops::ControlFlow;
use std::path::Path;

/// The requested error.
const ERROR: f64 = 1e-8;

/// An oscillator with a narrow well beside its centre.
const WELL: &str = "x'^2/2 - x^2/2 + 0.002/((x - 2)^2 + 1e-4)";

/// Numbers that fill the unit interval evenly.
fn unit(i: usize) -> f64 {
    ((i as f64 + 0.5) * 0.618_033_988_749_894_9).fract()
}

fn of<'a>(count: usize, start: &'a (dyn Fn(usize) -> Start + Sync), end: f64, threads: usize) -> Ensemble<'a> {
    let step_control = accurate(ERROR);
    let (varied, rows, threads) = (None, None, Some(threads));
    Ensemble { count, start, t0: 0.0, varied, end, step_control, rows, columns: &[], events: &[], threads }
}

/// The members and their numbers.
fn run(system: &System, ensemble: &Ensemble<'_>) -> (Vec<MemberEnd>, Tally) {
    let mut all = Vec::new();
    let mut keep = |member| {
        all.push(member);
        ControlFlow::Continue(())
    };
    let tally = system.ensemble(ensemble, &mut keep).unwrap();
    (all, tally)
}

/// Asserts that all members complete, and that those that were not computed in lanes are single runs, bit by bit; returns
/// how many these are. The others differ from single runs by the two errors, relative to the size of (q, p).
fn check(name: &str, system: &System, ensemble: Ensemble<'_>) -> usize {
    let (all, tally) = run(system, &ensemble);
    let failed = all.iter().find(|member| !matches!(&member.ending, Ok(end) if end.status == Status::Completed));
    assert!(failed.is_none(), "{name}: {failed:?}");
    assert_eq!(tally.own_plans, ensemble.count - tally.batch_kernel, "{name}");
    let mut own = 0;
    for member in &all {
        let motion = Motion::new((ensemble.start)(member.index), ensemble.end, ensemble.step_control);
        let (many, alone) = (member.ending.as_ref().unwrap(), system.run(&motion, &mut ()).unwrap());
        let same = (many.steps, &many.q, &many.p, Some(many.z)) == (alone.steps, &alone.q, &alone.p, alone.z);
        own += usize::from(same);
        let of = |q: &[f64], p: &[f64]| q.iter().chain(p).map(|x| x * x).sum::<f64>().sqrt();
        let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let apart = of(&less(&many.q, &alone.q), &less(&many.p, &alone.p));
        assert!(same || apart <= 2.0 * ERROR * of(&alone.q, &alone.p), "{name}, {}: {apart:e}", member.index);
    }
    assert!(own >= tally.own_plans, "{name}: {own} of {tally:?}");
    // The number of threads changes no bit.
    let many = run(system, &Ensemble { threads: Some(3), ..ensemble });
    assert_eq!(format!("{:?}", (all, tally)), format!("{many:?}"), "{name}");
    tally.own_plans
}

/// The thermostat of Nose, whose clock s comes near 0.
fn nose() -> System {
    let text = "s^2*x'^2/2 + m*s'^2/2 - x^2/2 - T*log(s)";
    System::parse(text, &["x", "s"], &[("m", 0.1), ("T", 1.0)]).unwrap()
}

/// Contact density dynamics of Bravetti and Tapias: H grows exponentially with the energy.
fn thermostat() -> System {
    let text = "exp(beta*(p_x^2/2 + 2*x^2)/2)*2*sqrt(c)*cosh(z/(2*c))";
    let names = FormulaNames::new(&["x"], &[("beta", 0.1), ("c", 2.0)]);
    System::new(&Formula::parse_hamiltonian(text, &names).unwrap()).unwrap()
}

#[test]
fn thermostats_with_fast_phases_vary_their_steps() {
    let start = |i: usize| Start::new(0.0, [2.0 * unit(i), 0.5 + unit(i + 9)], [0.3, 0.0], 0.0);
    assert_eq!(check("Nose", &nose(), of(10, &start, 20.0, 1)), 10);
    let start = |i: usize| Start {
        velocity: InitialVelocity::Momentum(vec![2.0 * unit(i + 9)]),
        ..Start::new(0.0, [0.2 + 2.0 * unit(i)], [0.0], 4.0 * unit(i + 77) - 2.0)
    };
    assert_eq!(check("contact density dynamics", &thermostat(), of(10, &start, 30.0, 1)), 10);
}

/// Orbits with passages of the centre down to 1e-4: where these are short, the orbits leave the lanes.
#[test]
fn close_passages_leave_the_lanes() {
    let kepler = System::parse("(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)", &["x", "y"], &[]).unwrap();
    let orbits = |count: usize, [from, to]: [f64; 2]| {
        let start = move |i: usize| {
            let e = from + (to - from) * unit(i);
            Start::new(0.0, [1.0 + e, 0.0], [0.0, ((1.0 - e) / (1.0 + e)).sqrt()], 0.0)
        };
        check("Kepler", &kepler, of(count, &start, 20.0, 1))
    };
    assert_eq!(orbits(60, [0.2, 0.4]), 0);
    assert_eq!(orbits(6, [0.99, 0.9999]), 6);
    // One in ten is close to a parabola.
    let start = |i: usize| {
        let e: f64 = if i % 10 == 9 { 0.999 } else { 0.3 };
        Start::new(0.0, [1.0 + e, 0.0], [0.0, ((1.0 - e) / (1.0 + e)).sqrt()], 0.0)
    };
    let own = check("Kepler", &kepler, of(41, &start, 20.0, 1));
    assert_eq!(own, 4);
}

/// A relaxation oscillation, and a motion through a narrow well beside others that do not reach it.
#[test]
fn short_phases_of_some_members() {
    let formula = Formula::parse("x'^2/2 - x^2/2", &["x"], &[("mu", 100.0)]).unwrap();
    let relaxation = System::new(&formula.with_force("x", "mu*(1 - x^2)*x'").unwrap()).unwrap();
    let start = |i: usize| Start::new(0.0, [2.0 + unit(i)], [0.0], 0.0);
    assert_eq!(check("relaxation", &relaxation, of(4, &start, 200.0, 1)), 4);
    let well = System::parse(WELL, &["x"], &[]).unwrap();
    let start = |i: usize| Start::new(0.0, [if i % 16 == 7 { 3.0 } else { 0.8 * unit(i) }], [0.0], 0.0);
    assert_eq!(check("well", &well, of(64, &start, 20.0, 1)), 4);
}

/// Shards in any order, and a run that continues from half a checkpoint, have the same bits.
#[test]
fn own_steps_are_the_same_from_shards_and_checkpoints() {
    let path = std::env::temp_dir().join(format!("own-steps-of-ensembles-{}", std::process::id()));
    let lagrangian = Formula::parse(WELL, &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
    let start = |i: usize| VelocityPoint::new([if i % 100 == 7 { 3.0 } else { 0.8 * unit(i) }], [0.0], 0.0);
    let (count, until) = (800, Until::Time(20.0));
    let of = || discrete_herglotz::Ensemble::new(&lagrangian, 0.0, count, start);
    let run = |path: Option<&Path>| {
        let (many, mut all) = (of().accuracy(ERROR).threads(2), Vec::new());
        let many = if let Some(path) = path { many.checkpoint(path) } else { many };
        let tally = many.run(until, |member: &Member| all.push(member.clone())).unwrap();
        assert_eq!((tally.completed, tally.own_plans, tally.batch_kernel), (count, 8, count - 8));
        all
    };
    let plain = run(None);
    assert!(run(Some(&path)) == plain && run(Some(&path)) == plain);
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    assert!(run(Some(&path)) == plain && std::fs::read(&path).unwrap() == whole);
    // The same steps in the lanes, by an integrator that is named, are another ensemble.
    let named = of().by(GaussCollocation { stages: 8 }).accuracy(ERROR).checkpoint(&path);
    assert!(matches!(named.run(until, |_| {}), Err(EnsembleError::AnotherEnsemble { .. })));
    std::fs::remove_file(path).unwrap();
    let (many, mut all) = (of().accuracy(ERROR), Vec::new());
    let sharded = many.in_shards(until).unwrap();
    let mut fold = |member: &Member| all.push(member.clone());
    let mut merge = many.merge(&sharded, &mut fold).unwrap();
    for shard in merge.missing().into_iter().rev() {
        merge.add(&sharded.compute(shard)).unwrap();
    }
    assert_eq!(merge.tally().own_plans, 8);
    assert!(all == plain);
}

/// The accuracy of a motion is that up to its terminal event, in an ensemble as in a single run: beyond it these fall into
/// a centre of force.
#[test]
fn an_event_ends_members_before_their_singularity() {
    let system = System::parse("x'^2/2 + 1/x", &["x"], &[]).unwrap();
    let start = |i: usize| Start::new(0.0, [1.0 + unit(i)], [0.0], 0.0);
    let near = Event { terminal: true, ..Event::new(system.formula().expression("x - 0.1").unwrap()) };
    let events = [near];
    for member in members(&system, &Ensemble { events: &events, ..of(8, &start, 10.0, 2) }) {
        let motion = Motion { events: events.to_vec(), ..Motion::new(start(member.index), 10.0, accurate(ERROR)) };
        let (many, alone) = (member.ending.unwrap(), system.run(&motion, &mut ()).unwrap());
        assert!(matches!(many.status, Status::Stopped { .. }), "{many:?}");
        assert_eq!((many.t, many.q, many.p), (alone.t, alone.q, alone.p));
    }
}

/// A named integrator is that of each member, with equal steps.
#[test]
fn a_named_integrator_is_kept() {
    let start = |i: usize| Start::new(0.0, [2.0 * unit(i), 0.5 + unit(i + 9)], [0.3, 0.0], 0.0);
    let step_control = StepControl::Accuracy { error: ERROR, by: Some(GAUSS) };
    let ensemble = Ensemble { step_control, ..of(4, &start, 2.0, 1) };
    assert_eq!(check("Nose by gauss_8", &nose(), ensemble), 4);
}
