//! Hidden features: narrow forces, walls, kinks, jumps and drags at random positions and times. They test runs to a
//! requested accuracy, the exact flow, and claims of structure that hold only at the start.

use crate::damping::{COLUMNS, Tally, bad, row};
use crate::formula::{Feature, Force, Formula, Rate, Smooth};
use crate::motion::{FAMILIES, Problem, RunEnd, Verdict, distance, dop853_in};
use crate::parallel::parallel;
use crate::random::Random;
use contact_examples::Report;
use contact_examples::{Failure, number};
use contact_geom::{PhasePoint, Structure, VelocityPoint};
use std::collections::BTreeMap;

/// The kinds of hidden features.
const KINDS: [&str; 9] =
    ["hill", "pulse of force", "pulse of drag", "region of drag", "wall", "kink", "jump", "fast drive", "fast drag"];

/// The requested accuracy, and the error that the exact flow may have.
const ACCURACY: f64 = 1e-6;
const MAX_EXACT_ERROR: f64 = 1e-9;

/// The fraction of the span above which, by the documentation, no feature is missed: a motion is sampled at about a
/// thousand points.
const DETECTED_WIDTH: f64 = 1e-3;

/// A problem with its exact final state.
struct Hidden {
    kind: usize,
    width: f64,
    problem: Problem<1>,
    truth: Option<PhasePoint<1>>,
}

/// A free particle of velocity 1 from 0.
fn free(feature: Feature) -> Problem<1> {
    let start = VelocityPoint::new([0.0], [1.0], 0.0);
    Problem { system: Formula { feature, ..Formula::FREE }, t0: 0.0, start, span: 10.0 }
}

/// An oscillator from `(1, 0.3)`.
fn swinging(rate: Rate, force: Force) -> Problem<1> {
    let start = VelocityPoint::new([1.0], [0.3], 0.2);
    Problem { system: Formula { rate, force, ..Formula::oscillator(0.0) }, t0: 0.0, start, span: 10.0 }
}

impl Hidden {
    fn random(i: usize, finest: f64) -> Hidden {
        let mut random = Random::new(6, i);
        let kind = i % KINDS.len();
        let (at, width) = (random.between(1.0, 8.0), random.spread(finest, 0.3));
        let sign = if random.happens(0.5) { 1.0 } else { -1.0 };
        let strength = random.between(0.3, 2.0);
        // The number of parts of the span such that no feature is narrower than a part.
        let parts = |width: f64| Some((40.0 / width).ceil() as usize);
        let (problem, parts) = match kind {
            0 => (free(Feature::Hill { at, width, height: strength }), parts(width)),
            1 => {
                let force = Force::Pulse { size: sign * strength / width, at, width };
                (swinging(Rate::Constant(-0.05), force), parts(width))
            }
            2 => (swinging(Rate::Pulse { size: -strength / width, at, width }, Force::None), parts(width)),
            3 => {
                let at = random.between(-0.9, 0.9);
                (swinging(Rate::Region { size: -strength, at, width }, Force::None), parts(width))
            }
            4 => (free(Feature::Wall { width: at }), Some(2000)),
            5 => (free(Feature::Kink { at, slope: strength }), None),
            // Narrower than any step, so that the closed form is that of a jump.
            6 => (free(Feature::Step { at, width: 1e-10, height: 0.5 * sign * strength }), None),
            // Steps whose number is a power of two contain whole numbers of periods.
            7 => {
                let frequency = std::f64::consts::TAU * f64::from(1 << random.below(6));
                let force = Force::Swinging { size: 4.0 * strength, frequency };
                (Problem { span: 16.0, ..swinging(Rate::Constant(-0.1), force) }, Some(4096))
            }
            _ => {
                let frequency = std::f64::consts::TAU * f64::from(1 << random.below(6));
                (
                    Problem { span: 16.0, ..swinging(Rate::Swinging { size: -strength, frequency }, Force::None) },
                    Some(4096),
                )
            }
        };
        let truth = match (parts, problem.system.feature) {
            // By dop853 where the exact flow fails.
            (Some(parts), _) => {
                problem.exact_in(parts).ok().or_else(|| dop853_in::<1, 3>(&problem, parts, 1e-13, 1e-13))
            }
            (None, Feature::Kink { at, slope }) => Some(over_kink(at, slope, problem.span)),
            (None, Feature::Step { at, height, .. }) => Some(over_jump(at, height, problem.span)),
            _ => None,
        };
        Hidden { kind, width, problem, truth }
    }

    /// Whether the feature is narrower than the documentation promises to detect; only the first four kinds have this
    /// width.
    fn is_narrow(&self) -> bool {
        self.kind < 4 && self.width < DETECTED_WIDTH * self.problem.span
    }
}

/// The motion from 0 with velocity 1 in the potential `slope |q - at|`, `at > 0`: a sequence of parabolas.
fn over_kink(at: f64, slope: f64, span: f64) -> PhasePoint<1> {
    let (mut t, mut x, mut v) = (0.0, -at, 1.0f64);
    loop {
        // On this side of the kink the force points towards it. The particle leaves the side when its parabola returns
        // to the kink, at the later root.
        let side = if x == 0.0 { v.signum() } else { x.signum() };
        let force = -side * slope;
        let (speed, height) = (side * v, side * x);
        let back = (speed + (speed * speed + 2.0 * slope * height).sqrt()) / slope;
        if t + back >= span {
            let s = span - t;
            return PhasePoint::new([at + x + v * s + 0.5 * force * s * s], [v + force * s], 0.0);
        }
        (t, x, v) = (t + back, 0.0, v + force * back);
    }
}

/// The motion from 0 with velocity 1 over a jump of the potential: with another velocity beyond the jump, or reflected.
fn over_jump(at: f64, height: f64, span: f64) -> PhasePoint<1> {
    let (t, energy) = (at, 0.5 - height);
    let v = if energy > 0.0 { (2.0 * energy).sqrt() } else { -1.0 };
    if span <= t { PhasePoint::new([span], [1.0], 0.0) } else { PhasePoint::new([at + v * (span - t)], [v], 0.0) }
}

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let (count, finest) = if report.quick { (54, 1e-2) } else { (1800, 1e-3) };
    let found = parallel(&report.bar, count, |i| {
        let hidden = Hidden::random(i, finest);
        let truth = hidden.truth?;
        let to = hidden.problem.to(ACCURACY);
        let exact = hidden.problem.exact();
        let exact = exact.map_or(RunEnd::Panicked, RunEnd::Completed);
        let exact_worth = match &exact {
            RunEnd::Panicked => Verdict::Refused,
            end => end.verdict(&truth, 0.0, MAX_EXACT_ERROR),
        };
        let of_run = (to.verdict(&truth, 0.0, 10.0 * ACCURACY), to.error(&truth, 0.0));
        Some((hidden, of_run, (exact_worth, exact.error(&truth, 0.0))))
    });
    let mut rows = Vec::new();
    let mut tallies: BTreeMap<(&str, bool, usize), Tally> = BTreeMap::new();
    for (hidden, of_run, of_flow) in found.iter().flatten() {
        let Hidden { kind, width, .. } = hidden;
        for (by, (verdict, error)) in [("to 1e-6", of_run), ("exact flow", of_flow)] {
            *tallies.entry((by, hidden.is_narrow(), *kind)).or_default().entry(*verdict).or_default() += 1;
            rows.push(vec![KINDS[*kind].into(), by.into(), number(*width), verdict.name().into(), number(*error)]);
        }
    }
    let unknown = found.iter().filter(|f| f.is_none()).count();
    report.at_most("random features without a known reference", unknown as f64, 0.0)?;
    for (by, narrow, what) in [
        ("to 1e-6", false, "features"),
        ("exact flow", false, "features"),
        ("to 1e-6", true, "features narrower than a thousandth of the span"),
        ("exact flow", true, "features narrower than a thousandth of the span"),
    ] {
        let of = || tallies.iter().filter(|((who, thin, _), _)| (*who, *thin) == (by, narrow)).map(|(_, tally)| tally);
        let all: usize = of().flat_map(|tally| tally.values()).sum();
        // A quick run has no features that narrow.
        if all > 0 {
            report.at_most(&format!("{what}, {by}: of {all} silently wrong"), bad(of()), 0.0)?;
        }
    }
    let named = |by: &str, narrow: bool, kind: usize| {
        format!("{}{}, {by}", KINDS[kind], if narrow { " (narrower than a thousandth)" } else { "" })
    };
    let mut lines: Vec<Vec<String>> =
        tallies.iter().map(|((by, narrow, kind), tally)| row(named(by, *narrow, *kind), tally)).collect();
    lines.extend(claims(report, &mut rows)?);
    let columns: Vec<&str> = ["feature"].into_iter().chain(COLUMNS).collect();
    report.markdown(&columns, lines);
    report.table("", &["what", "by", "width", "worth", "error"], rows)
}

/// Claims of structure that are true at the start and false later, and true claims near the border of a domain.
fn claims(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<Vec<Vec<String>>, Failure> {
    let all = |system: Formula<1>, change: fn(&mut Structure)| {
        let mut claims = contact_geom::Lagrangian::<1>::structure(&system);
        change(&mut claims);
        Formula { claims: Some(claims), ..system }
    };
    let steady: fn(&mut Structure) = |c| (c.autonomous, c.constant_rate) = (true, true);
    let affine: fn(&mut Structure) = |c| (c.z_affine, c.constant_rate, c.separable) = (true, true, true);
    let quadratic: fn(&mut Structure) = |c| c.quadratic = true;
    let timed = |rate, force| swinging(rate, force).system;
    let bump = |feature| Formula { feature, smooth: Smooth { spring: 1.0, ..Smooth::default() }, ..Formula::FREE };
    let (none, still) = (Force::None, Rate::Constant(-0.1));
    let lies = [
        (
            "rate -0.3 cos t claimed constant",
            all(timed(Rate::Swinging { size: -0.3, frequency: 1.0 }, none), |c| c.constant_rate = true),
        ),
        (
            "force 0.5 cos 0.7 t claimed autonomous",
            all(timed(still, Force::Swinging { size: 0.5, frequency: 0.7 }), steady),
        ),
        ("late force claimed autonomous", all(timed(still, Force::Pulse { size: 2.0, at: 5.0, width: 0.5 }), steady)),
        ("late drag claimed constant", all(timed(Rate::Pulse { size: -2.0, at: 5.0, width: 0.5 }, none), steady)),
        ("region of drag claimed affine", all(timed(Rate::Region { size: -1.0, at: -0.5, width: 0.02 }, none), affine)),
        ("wall claimed quadratic", all(bump(Feature::Wall { width: 1.5 }), quadratic)),
        ("hill claimed quadratic", all(bump(Feature::Hill { at: -0.8, width: 0.05, height: 2.0 }), quadratic)),
    ];
    let mut lines = Vec::new();
    let mut tallies = Vec::new();
    for (name, system) in lies {
        // Fast enough to reach the wall.
        let start = VelocityPoint::new([0.4], [1.6], 0.3);
        let problem = Problem { system, t0: 0.0, start, span: 10.0 };
        let honest = Problem { system: Formula { claims: None, ..system }, ..problem };
        let Ok(truth) = honest.exact_in(2000) else { continue };
        let mut tally = Tally::new();
        for integrator in FAMILIES.into_iter().filter(|i| i.check(&system).is_ok()) {
            // An integrator that does not use the claim is as accurate as without it.
            let end = problem.by(integrator, 400);
            let bound = match honest.by(integrator, 400) {
                RunEnd::Completed(x) => (2.0 * distance(&x, &truth, 0.0)).max(1e-3),
                _ => 1e-3,
            };
            let verdict = end.verdict(&truth, 0.0, bound);
            *tally.entry(verdict).or_default() += 1;
            rows.push(vec![
                name.into(),
                integrator.to_string(),
                "-".into(),
                verdict.name().into(),
                number(end.error(&truth, 0.0)),
            ]);
        }
        lines.push(row(name.into(), &tally));
        tallies.push(tally);
    }
    report.at_most("claims that are false later: runs silently wrong", bad(&tallies), 0.0)?;
    // True claims near the border of the domain of L.
    let mut refused = 0;
    for q in [0.0, 0.9, 0.99, 0.999, -0.999] {
        let system = Formula { feature: Feature::Domain, rate: Rate::Constant(-0.1), ..Formula::<1>::FREE };
        let problem = Problem { system, t0: 0.0, start: VelocityPoint::new([q], [0.0], 0.0), span: 1.0 };
        for integrator in FAMILIES {
            let is_refused = matches!(problem.by(integrator, 1000), RunEnd::Refused(_));
            refused += u32::from(is_refused);
            let verdict = if is_refused { "refused" } else { "right" };
            rows.push(vec![
                "true claims".into(),
                integrator.to_string(),
                q.to_string(),
                verdict.into(),
                number(f64::NAN),
            ]);
        }
    }
    report.at_most("true claims next to the boundary of a domain: refused", f64::from(refused), 0.0)?;
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms_keep_the_energy() {
        for span in [0.5, 3.0, 7.0, 20.0] {
            let x = over_kink(2.0, 1.5, span);
            assert!((0.5 * x.p[0] * x.p[0] + 1.5 * (x.q[0] - 2.0).abs() - 3.5).abs() < 1e-12, "{span}: {x:?}");
            let x = over_jump(2.0, 0.3, span);
            let height = if x.q[0] > 2.0 { 0.3 } else { 0.0 };
            assert!((0.5 * x.p[0] * x.p[0] + height - 0.5).abs() < 1e-12, "{span}: {x:?}");
        }
        // Reflected.
        assert_eq!(over_jump(2.0, 0.6, 3.0), PhasePoint::new([1.0], [-1.0], 0.0));
    }
}
