//! Ensembles: 1e5 pendula to given errors, neighbours of one pendulum over a long time, time and memory against the
//! number of members, and the speed-up by two threads.

use crate::peer::python;
use contact_examples::Report;
use contact_examples::systems::Pendulum;
use contact_examples::{Failure, print};
use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, Ensemble, InputError, SplittingScheme, Steps, Until, ensemble::EnsembleError};
use std::time::Instant;

/// For the pendula of problem P5: the error to reach; the best time of the batch mode of heyoka 7 from its table, in
/// seconds, used where heyoka is not installed; and the target for the ratio to the time of heyoka.
const PENDULA: [(f64, f64, f64); 3] = [(1e-4, 0.124, 0.1), (1e-8, 0.127, 0.15), (1e-12, 0.145, 0.3)];

/// For the neighbours of the pendulum of problem P2: their number, the final time, the relative error to reach, the
/// best time of heyoka per member from that table, in seconds, and the target ratio.
const NEIGHBOURS: (usize, f64, f64, f64, f64) = (10_000, 1000.0, 1e-9, 355e-6, 0.5);

const PENDULUM: Pendulum = Pendulum { gamma: -0.01 };

/// Final positions and momenta, and the run time in seconds.
type Timed = (Vec<[f64; 2]>, f64);

fn failure(error: EnsembleError) -> Failure {
    let cause = match error {
        EnsembleError::Member { cause, .. } => cause,
        _ => InputError::Count { what: "members", least: 1, found: 0 },
    };
    cause.into()
}

/// Runs an ensemble of pendula and measures the run time.
fn timed(
    count: usize,
    start: impl Fn(usize) -> VelocityPoint<1> + Sync,
    integrator: AnyIntegrator,
    (steps, end): (usize, f64),
    threads: usize,
) -> Result<Timed, Failure> {
    let ensemble = Ensemble::new(&PENDULUM, 0.0, count, start)
        .by(integrator)
        .steps(Steps::Count(steps))
        .threads(threads)
        .without_action();
    let mut ends = Vec::with_capacity(count);
    let clock = Instant::now();
    let tally = ensemble
        .run(Until::Time(end), |member| {
            ends.push(member.ending.as_ref().map_or([f64::NAN; 2], |e| [e.state.q[0], e.state.p[0]]));
        })
        .map_err(failure)?;
    let seconds = clock.elapsed().as_secs_f64();
    if tally.members != count {
        return Err(InputError::Hypothesis { hypothesis: "all members" }.into());
    }
    Ok((ends, seconds))
}

/// The run with the shortest time among `repeats` runs.
fn shortest(repeats: usize, run: impl Fn() -> Result<Timed, Failure>) -> Result<Timed, Failure> {
    let mut best = run()?;
    for _ in 1..repeats {
        let next = run()?;
        if next.1 < best.1 {
            best = next;
        }
    }
    Ok(best)
}

/// The largest distance between corresponding members of two ensembles, absolute or relative to the second.
fn distance(a: &[[f64; 2]], b: &[[f64; 2]], relative: bool) -> f64 {
    let of = |(a, b): (&[f64; 2], &[f64; 2])| {
        (a[0] - b[0]).hypot(a[1] - b[1]) / if relative { b[0].hypot(b[1]) } else { 1.0 }
    };
    contact_geom::numbers::max_abs_or_nan(a.iter().zip(b).map(of))
}

/// The initial values of problem P5: `q0` in [-2, 2] by `v0` in [-1, 1], 400 by 250.
fn grid(i: usize) -> VelocityPoint<1> {
    let part = |i: usize, n: usize| i as f64 / (n - 1) as f64;
    VelocityPoint::new([4.0 * part(i / 250, 400) - 2.0], [2.0 * part(i % 250, 250) - 1.0], 0.0)
}

/// The initial values of the neighbours of the pendulum of problem P2.
fn neighbour(i: usize) -> VelocityPoint<1> {
    VelocityPoint::new([1.0 + 1e-6 * i as f64], [1.0], 0.0)
}

fn candidates() -> Vec<AnyIntegrator> {
    let gauss = [6, 8, 10, 12].map(|stages| AnyIntegrator::Gauss { stages });
    SplittingScheme::ALL.into_iter().map(AnyIntegrator::Splitting).chain(gauss).collect()
}

/// The smallest number of steps, to within a sixteenth, with which an integrator reaches an error; `None` beyond
/// `most`.
fn steps_for(
    error: &dyn Fn(usize) -> Result<f64, Failure>,
    accuracy: f64,
    most: usize,
) -> Result<Option<usize>, Failure> {
    let mut steps = 1;
    while steps <= most {
        if error(steps)? <= accuracy {
            return Ok(Some(steps));
        }
        steps = (steps + 1).max(steps * 17 / 16);
    }
    Ok(None)
}

/// A run of heyoka: the problem, the time per member in seconds, and the largest error.
struct Peer {
    what: String,
    seconds: f64,
    error: f64,
}

/// The runs of heyoka at several tolerances; empty where it is not installed.
fn heyoka(report: &mut Report) -> Result<Vec<Peer>, Failure> {
    let (count, end, ..) = NEIGHBOURS;
    let input = format!("{:e}\n{count}\n{end}\n", PENDULUM.gamma);
    let Some(output) = python(include_str!("ensembles_heyoka.py"), &input)? else {
        print("            heyoka is not installed (python3 with the package heyoka); its tabulated times are used\n")?;
        return Ok(Vec::new());
    };
    let mut peers = Vec::new();
    for line in output.lines() {
        let [what, way, tolerance, seconds, error] = line.split(' ').collect::<Vec<_>>()[..] else { continue };
        let number = |x: &str| x.parse().unwrap_or(f64::NAN);
        let peer = Peer { what: what.into(), seconds: number(seconds), error: number(error) };
        let name = format!("{what} by heyoka, {way}, tolerance {tolerance}, error {:.1e}", peer.error);
        report.row(&name, 1, peer.seconds, None)?;
        peers.push(peer);
    }
    Ok(peers)
}

/// The shortest measured time of heyoka per member for an error, or the tabulated one, and a name that says which of
/// the two.
fn peer_time(peers: &[Peer], what: &str, accuracy: f64, by_table: f64) -> (f64, &'static str) {
    let found = peers.iter().filter(|peer| peer.what == what && peer.error <= accuracy).map(|peer| peer.seconds);
    let shortest = found.fold(f64::INFINITY, f64::min);
    if shortest < f64::INFINITY { (shortest, "the time of heyoka") } else { (by_table, "the tabulated time of heyoka") }
}

fn pendula(report: &mut Report, peers: &[Peer]) -> Result<(), Failure> {
    let (count, end) = (100_000, 10.0);
    let thin = 40;
    // The number of steps is found on a part of the grid and verified on the whole grid.
    let part = |i: usize| grid(i * thin);
    let reference = AnyIntegrator::Gauss { stages: 16 };
    let (exact_part, _) = timed(count / thin, part, reference, (20, end), 1)?;
    let (exact, _) = timed(count, grid, reference, (20, end), 2)?;
    for (accuracy, by_table, share) in PENDULA {
        let mut best: Option<(f64, AnyIntegrator, usize)> = None;
        for integrator in candidates() {
            let error = |steps: usize| -> Result<f64, Failure> {
                let (ends, _) = timed(count / thin, part, integrator, (steps, end), 1)?;
                Ok(distance(&ends, &exact_part, false))
            };
            let most = if accuracy < 1e-6 && integrator.order() < 6 { 0 } else { 400 };
            let Some(mut steps) = steps_for(&error, accuracy, most)? else { continue };
            loop {
                let (ends, seconds) = shortest(3, || timed(count, grid, integrator, (steps, end), 1))?;
                let error = distance(&ends, &exact, false);
                if error <= accuracy {
                    report.row(
                        &format!("pendula, {integrator}, {steps} steps, error {error:.1e}"),
                        count,
                        seconds,
                        None,
                    )?;
                    if best.is_none_or(|(fastest, ..)| seconds < fastest) {
                        best = Some((seconds, integrator, steps));
                    }
                    break;
                }
                steps += 1;
            }
        }
        let Some((_, integrator, steps)) = best else { continue };
        let (_, seconds) = shortest(9, || timed(count, grid, integrator, (steps, end), 1))?;
        let (peer_seconds, whose) = peer_time(peers, "pendula", accuracy, by_table / count as f64);
        let what = format!("pendula to {accuracy:e} by {integrator} in {steps} steps, of {whose}");
        report.at_most(&what, seconds / count as f64 / peer_seconds, share)?;
    }
    Ok(())
}

fn neighbours(report: &mut Report, peers: &[Peer]) -> Result<(), Failure> {
    let (count, end, accuracy, by_table, share) = NEIGHBOURS;
    // Enough members to fill the SIMD lanes.
    let few = 128;
    let part = |i: usize| neighbour(i * (count / few));
    let (exact, _) = timed(few, part, AnyIntegrator::Gauss { stages: 16 }, (1600, end), 1)?;
    let mut best: Option<(f64, AnyIntegrator, usize)> = None;
    for integrator in [
        AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6),
        AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6_LONG),
        AnyIntegrator::Splitting(SplittingScheme::BLANES_CASAS_8),
        AnyIntegrator::Splitting(SplittingScheme::SOFRONIOU_SPALETTA_10),
        AnyIntegrator::Gauss { stages: 8 },
        AnyIntegrator::Gauss { stages: 12 },
    ] {
        let mut steps = 500;
        while steps < 20_000 {
            let (ends, seconds) = timed(few, part, integrator, (steps, end), 1)?;
            let error = distance(&ends, &exact, true);
            if error <= accuracy {
                report.row(
                    &format!("neighbours, {integrator}, {steps} steps, error {error:.1e}"),
                    few,
                    seconds,
                    None,
                )?;
                if best.is_none_or(|(fastest, ..)| seconds < fastest) {
                    best = Some((seconds, integrator, steps));
                }
                break;
            }
            steps = steps * 33 / 32;
        }
    }
    let Some((_, integrator, steps)) = best else { return Ok(()) };
    let (_, seconds) = timed(count, neighbour, integrator, (steps, end), 1)?;
    let (peer_seconds, whose) = peer_time(peers, "neighbours", accuracy, by_table);
    let what = format!("neighbours to {accuracy:e} by {integrator} in {steps} steps, each of {whose}");
    report.at_most(&what, seconds / count as f64 / peer_seconds, share)?;
    Ok(())
}

/// The peak memory of this process since the last call, in bytes, where the system reports it.
fn peak() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kilobytes: usize = line.split_whitespace().nth(1)?.parse().ok()?;
    // Resets the peak.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    Some(kilobytes * 1024)
}

fn sizes(report: &mut Report) -> Result<(), Failure> {
    let largest = if report.quick { 100_000 } else { 1_000_000 };
    let start = |i: usize| VelocityPoint::new([2.0 * (i as f64 * 0.618_033_988_749_894_9).fract() - 1.0], [0.5], 0.0);
    let run = |count: usize, integrator: AnyIntegrator, threads: usize| -> Result<f64, Failure> {
        let ensemble = Ensemble::new(&PENDULUM, 0.0, count, start)
            .by(integrator)
            .steps(Steps::Count(40))
            .threads(threads)
            .without_action();
        let (clock, mut sum) = (Instant::now(), 0.0);
        ensemble
            .run(Until::Time(10.0), |member| sum += member.ending.as_ref().map_or(0.0, |e| e.state.q[0]))
            .map_err(failure)?;
        Ok(clock.elapsed().as_secs_f64())
    };
    for integrator in [AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6), AnyIntegrator::Gauss { stages: 4 }] {
        let mut peaks = Vec::new();
        let mut count = 100;
        while count <= largest {
            peak();
            let seconds = run(count, integrator, 1)?;
            let bytes = peak();
            report.row(&format!("{integrator}, 40 steps"), count, seconds, bytes)?;
            peaks.extend(bytes);
            count *= 10;
        }
        if let [first, .., last] = peaks[..] {
            report.at_most(
                &format!("{integrator}: growth of the memory with the count"),
                last as f64 / first as f64,
                1.1,
            )?;
        }
        // The runs alternate, so that other load on the machine affects both.
        let count = largest / 5;
        let mut seconds = [f64::INFINITY; 2];
        for _ in 0..20 {
            for threads in [1, 2] {
                seconds[threads - 1] = seconds[threads - 1].min(run(count, integrator, threads)?);
            }
        }
        for (threads, seconds) in [1, 2].into_iter().zip(seconds) {
            report.row(&format!("{integrator}, 40 steps, threads: {threads}"), count, seconds, None)?;
        }
        report.at_most(
            &format!("{integrator}: two threads, of the time of one"),
            seconds[1] / seconds[0],
            1.0 / 1.8,
        )?;
    }
    Ok(())
}

/// Runs the case.
///
/// # Errors
/// [`Failure`] where a run cannot be started.
pub fn run(report: &mut Report) -> Result<(), Failure> {
    sizes(report)?;
    let peers = heyoka(report)?;
    neighbours(report, &peers)?;
    pendula(report, &peers)
}
