//! Corners of surfaces: events whose functions are `min`, `max` or `abs`, against the law of reflection in closed form.

use super::Seen;
use contact_geom::switching::Impact;
use discrete_herglotz::{AnyIntegrator, Status, StepError, Steps};
use formula_lagrangian::{Direction, Formula, Reset};
use herglotz_runtime::{Event, Motion, Outcome, Start, StepControl, System};

/// The side of the box.
const SIDE: f64 = 4.5;

/// The accuracy of a position after some twenty impacts: each is located to some hundred roundings of positions of this
/// size, and so is the end of a flight between two walls.
const ROUND_OFF: f64 = 20.0 * 100.0 * f64::EPSILON * SIDE;

fn by(name: &str, h: f64) -> StepControl {
    StepControl::Steps { by: name.parse::<AnyIntegrator>().unwrap(), steps: Steps::Size(h) }
}

/// Integrators that are exact for free flights, with steps that contain some impacts or many, and an accuracy.
fn controls() -> Vec<StepControl> {
    let accurate = StepControl::Accuracy { error: 1e-9, by: None };
    vec![by("gauss_2", 0.1), by("gauss_8", 3.0), by("strang", 0.5), by("blanes_moan_4", 0.07), accurate]
}

fn free(law: &str, coordinates: &[&str], impact: Impact) -> Formula {
    let squares: Vec<String> = coordinates.iter().map(|x| format!("{x}'^2")).collect();
    let l = format!("({})/2", squares.join(" + "));
    Formula::parse(&l, coordinates, &[]).unwrap().with_impact(law, impact, None).unwrap()
}

/// The end of a motion and the number of its impacts, or what is said about it.
fn run<const N: usize>(
    formula: &Formula,
    (t, q, v): (f64, [f64; N], [f64; N]),
    end: f64,
    by: StepControl,
) -> Result<(Outcome, usize), String> {
    let event = Event { reset: Some(0), ..Event::new(formula.expression("t").unwrap()) };
    let motion = Motion { events: vec![event], ..Motion::new(Start::new(t, q, v, 0.0), end, by) };
    let mut seen = Seen::default();
    let outcome = System::new(formula).unwrap().run(&motion, &mut seen).map_err(|error| error.to_string())?;
    Ok((outcome, seen.crossings.len()))
}

/// How a run that is completed differs from an expected position, velocity and number of impacts; `None` if it does not.
fn differs<const N: usize>(
    found: Result<(Outcome, usize), String>,
    (q, v, impacts): ([f64; N], [f64; N], usize),
    tolerance: f64,
) -> Option<String> {
    let (outcome, count) = match found {
        Ok(found) => found,
        Err(error) => return Some(error),
    };
    let near = |found: &[f64], expected: &[f64]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
    let velocity = outcome.v.unwrap_or_default();
    let is_right = outcome.status == Status::Completed
        && velocity.len() == N
        && near(&outcome.q, &q)
        && near(&velocity, &v)
        && count == impacts;
    (!is_right).then(|| format!("{}: {:?} {velocity:?} {count}, not {q:?} {v:?} {impacts}", outcome.status, outcome.q))
}

/// A coordinate between two walls, each of which multiplies its velocity by `-e`: the position, the velocity, and the
/// number of impacts after a time.
fn between_walls(mut q: f64, mut v: f64, mut time: f64, e: f64) -> (f64, f64, usize) {
    let mut impacts = 0;
    loop {
        let wall = if v > 0.0 { SIDE } else { 0.0 };
        let flight = (wall - q) / v;
        if v == 0.0 || flight >= time {
            return (q + v * time, v, impacts);
        }
        (q, v, time, impacts) = (wall, -e * v, time - flight, impacts + 1);
    }
}

fn in_box<const N: usize>(q: [f64; N], v: [f64; N], time: f64, e: f64) -> ([f64; N], [f64; N], usize) {
    let each: Vec<_> = (0..N).map(|i| between_walls(q[i], v[i], time, e)).collect();
    let of = |f: &dyn Fn(&(f64, f64, usize)) -> f64| std::array::from_fn(|i| f(&each[i]));
    (of(&|x| x.0), of(&|x| x.1), each.iter().map(|x| x.2).sum())
}

const BOX: &str = "min(4.5 - x, 4.5 - y, x, y)";

/// The failures of a table of runs.
#[derive(Default)]
struct Failures(Vec<String>);

impl Failures {
    fn add(&mut self, what: &str, by: StepControl, difference: Option<String>) {
        let by = match by {
            StepControl::Steps { by, steps } => format!("{by} {steps:?}"),
            StepControl::Accuracy { error, .. } => format!("to {error}"),
        };
        self.0.extend(difference.map(|difference| format!("{what} by {by}: {difference}")));
    }
    fn assert_none(&self) {
        assert!(self.0.is_empty(), "{}:\n{}", self.0.len(), self.0.join("\n"));
    }
}

/// Into corners of a box and past them, at any distance: there are two impacts at one instant, or two within a time that
/// vanishes with the distance.
#[test]
fn a_ball_in_a_box_leaves_its_corners() {
    // A flight along a wall at a distance of a few roundings is not seen, in which the other coordinate changes by this times
    // the ratio of the velocities: the last number.
    let starts = [
        ([0.5, 0.5], [1.0, 1.0], 1.0),
        ([0.5, 2.5], [1.0, 0.5], 2.0),
        ([3.5, 1.5], [-0.7, -0.3], 3.0),
        ([1.1, 2.3], [0.85, 0.55], 2.0),
        ([0.5, 4.4], [4.0, 0.1], 40.0),
    ];
    let mut failures = Failures::default();
    for (law, e) in [(Impact::Elastic, 1.0), (Impact::Restitution(0.8), 0.8)] {
        let formula = free(BOX, &["x", "y"], law);
        for (q, v, ratio) in starts {
            for distance in [0.0, 1e-16, 1e-15, -1e-14, 1e-13, -1e-12, 1e-11, 1e-10, -1e-9, 1e-7, -1e-6, 1e-3] {
                let q = [q[0], q[1] + distance];
                let expected = in_box(q, v, 11.7, e);
                for by in controls() {
                    let difference = differs(run(&formula, (0.0, q, v), 11.7, by), expected, ratio * ROUND_OFF);
                    failures.add(&format!("{law:?} {q:?} {v:?} {distance:e}"), by, difference);
                }
            }
        }
    }
    failures.assert_none();
}

/// Three walls at once, and two of three.
#[test]
fn a_ball_in_a_cube_leaves_its_corners() {
    let formula = free("min(4.5 - x, 4.5 - y, 4.5 - u, x, y, u)", &["x", "y", "u"], Impact::Elastic);
    let mut failures = Failures::default();
    for [y, u] in [[0.0, 0.0], [1e-12, -1e-9], [0.0, 1e-3], [-1e-9, 1e-9], [1e-15, -1e-15]] {
        let (q, v) = ([0.5, 0.5 + y, 0.5 + u], [1.0; 3]);
        for by in controls() {
            let difference = differs(run(&formula, (0.0, q, v), 11.7, by), in_box(q, v, 11.7, 1.0), ROUND_OFF);
            failures.add(&format!("{q:?}"), by, difference);
        }
    }
    failures.assert_none();
}

/// With the drag of a contact system velocities decay as `exp(-t/10)`, on the path of the free motion for the time
/// `10 (1 - exp(-t/10))`. The solution of `z' = L` is known where impacts conserve energy.
#[test]
fn corners_with_drag() {
    let damped = Formula::parse("(x'^2 + y'^2)/2 - 0.1*z", &["x", "y"], &[]).unwrap();
    let accurate = StepControl::Accuracy { error: 1e-10, by: None };
    let (end, mut failures) = (20.0, Failures::default());
    let (decay, time) = (f64::exp(-0.1 * end), 10.0 * (1.0 - f64::exp(-0.1 * end)));
    for (law, e) in [(Impact::Elastic, 1.0), (Impact::Restitution(0.8), 0.8)] {
        let formula = damped.with_impact(BOX, law, None).unwrap();
        for (q, v) in [([0.5, 0.5], [1.0, 1.0]), ([0.5, 2.5], [1.0, 0.5]), ([0.5, 0.5 - 1e-9], [1.0, 1.0])] {
            let (at, going, impacts) = in_box(q, v, time, e);
            let expected = (at, going.map(|v| v * decay), impacts);
            for by in [by("gauss_8", 0.1), by("gauss_8", 1.0), by("gauss_12", 3.0), accurate] {
                // The accuracy that is requested; the steps of order 16 and 24 are exact to less.
                let found = run(&formula, (0.0, q, v), end, by);
                let z = found.as_ref().map_or(f64::NAN, |(outcome, _)| outcome.z.unwrap());
                failures.add(&format!("{law:?} {q:?}"), by, differs(found, expected, 1e-10));
                let energy = 0.5 * (v[0] * v[0] + v[1] * v[1]);
                let off = (z - decay * energy * time).abs();
                let is_known = law == Impact::Elastic;
                failures.add("z", by, (is_known && (off.is_nan() || off > 1e-10)).then(|| format!("{q:?}: {z}")));
            }
        }
    }
    failures.assert_none();
}

/// A ball falls into the vertex of a valley.
#[test]
fn a_ball_falls_into_a_vertex() {
    let falling = Formula::parse("(x'^2 + y'^2)/2 - y", &["x", "y"], &[]).unwrap();
    let mut failures = Failures::default();
    for (text, impacts) in [("y - abs(x)", 1), ("min(y - x, y + x)", 2)] {
        let formula = falling.with_impact(text, Impact::Elastic, None).unwrap();
        for by in controls() {
            let expected = ([0.0, 2.0], [0.0, 0.0], impacts);
            failures.add(text, by, differs(run(&formula, (0.0, [0.0, 2.0], [0.0, 0.0]), 4.0, by), expected, ROUND_OFF));
        }
    }
    failures.assert_none();
}

/// The event of all walls is that of each of them at once. (The conformal law takes its energy from the normal velocity, so
/// that its result depends on the order of the walls.)
#[test]
fn one_event_of_all_walls_is_one_event_of_each() {
    let l = Formula::parse("(x'^2 + y'^2)/2 - 0.1*z", &["x", "y"], &[]).unwrap();
    for law in [Impact::Elastic, Impact::Restitution(0.8), Impact::Restitution(0.0)] {
        let one = l.with_impact(BOX, law, None).unwrap();
        let each = ["4.5 - x", "4.5 - y", "x", "y"]
            .into_iter()
            .fold(l.clone(), |formula, wall| formula.with_impact(wall, law, None).unwrap());
        for by in [by("gauss_8", 0.1), by("gauss_8", 3.0)] {
            let start = (0.0, [0.5, 2.5], [1.0, 0.5]);
            let [one, each] = [&one, &each].map(|formula| run(formula, start, 9.0, by).unwrap().0);
            assert_eq!([one.status, each.status], [Status::Completed; 2], "{law:?} by {by:?}");
            let numbers = |of: &Outcome| [&of.q[..], of.v.as_ref().unwrap(), &[of.z.unwrap()]].concat();
            for (a, b) in numbers(&one).iter().zip(numbers(&each)) {
                assert!((a - b).abs() <= ROUND_OFF, "{law:?} by {by:?}: {one:?}, not {each:?}");
            }
        }
    }
}

/// The velocity after reflections on walls with these normals.
fn reflected(v: [f64; 2], normals: &[[f64; 2]]) -> [f64; 2] {
    normals.iter().fold(v, |v, n| {
        let mu = 2.0 * (v[0] * n[0] + v[1] * n[1]) / (n[0] * n[0] + n[1] * n[1]);
        [v[0] - mu * n[0], v[1] - mu * n[1]]
    })
}

/// Into the vertex of a wedge of the angle `pi/n`: n reflections, in either order.
#[test]
fn a_ball_leaves_the_vertex_of_a_wedge() {
    let mut failures = Failures::default();
    for (n, inside) in [(2, [0.1, 0.5, 0.785, 1.5]), (3, [0.1, 0.5, 0.523, 1.0]), (18, [0.02, 0.08, 0.1, 0.16])] {
        let angle = std::f64::consts::PI / n as f64;
        let normals = [[0.0, 1.0], [angle.sin(), -angle.cos()]];
        let formula = free(&format!("min(y, {:?}*x - {:?}*y)", angle.sin(), angle.cos()), &["x", "y"], Impact::Elastic);
        for a in inside {
            let q = [f64::cos(a), f64::sin(a)];
            let v = q.map(|x| -x);
            let [after, other] =
                [0, 1].map(|first| reflected(v, &(0..n).map(|k| normals[(first + k) % 2]).collect::<Vec<_>>()));
            assert!((0..2).all(|i| (after[i] - other[i]).abs() <= 1e-14), "{after:?} {other:?}");
            for by in controls() {
                // The tip of a narrow wedge is as far as its width is round-off.
                let tolerance = ROUND_OFF / angle.sin();
                let difference = differs(run(&formula, (0.0, q, v), 2.0, by), (after, after, n), tolerance);
                failures.add(&format!("pi/{n} at {a}"), by, difference);
            }
        }
    }
    // The same by `abs`, whose derivative at its vertex is that of neither side. The last motion is along its axis, and
    // there the law with the mean normal has the same result.
    let formula = free("y - abs(x)", &["x", "y"], Impact::Elastic);
    for (x, impacts) in [(0.3, 2), (-0.7, 2), (1e-3, 2), (-1e-4, 2), (0.0, 1)] {
        for by in controls() {
            let found = run(&formula, (0.0, [x, 1.0], [-x, -1.0]), 2.0, by);
            failures.add(&format!("abs from {x}"), by, differs(found, ([x, 1.0], [x, 1.0], impacts), ROUND_OFF));
        }
    }
    failures.assert_none();
}

/// A ball that meets the edge of an obstacle, `x > 0 and y > 0`, or a wall just beside it, whatever the slopes of the two
/// walls along its motion. On the edge itself it is reflected by one of the walls.
#[test]
fn a_ball_meets_the_edge_of_an_obstacle() {
    let formula = free("max(-x, -y)", &["x", "y"], Impact::Elastic);
    let mut failures = Failures::default();
    for v in [[1.0, 1.0], [1.0, 5.0], [30.0, 1.0]] {
        for distance in [0.0, 1e-13, 1e-11, -1e-11, 1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-3] {
            let q = [-v[0], -v[1] + distance];
            let by_x = ([-v[0], v[1] + distance], [-v[0], v[1]], 1);
            let by_y = ([v[0], -v[1] - distance], [v[0], -v[1]], 1);
            for by in controls() {
                // The positions are up to seven times those of the box.
                let near = |expected| differs(run(&formula, (0.0, q, v), 2.0, by), expected, 7.0 * ROUND_OFF);
                let difference = match distance {
                    _ if f64::abs(distance) < 1e-12 => near(by_x).and_then(|_| near(by_y)),
                    _ if distance > 0.0 => near(by_x),
                    _ => near(by_y),
                };
                failures.add(&format!("{v:?} {distance:e}"), by, difference);
            }
        }
    }
    failures.assert_none();
}

/// A motion that starts at a corner, or is continued there.
#[test]
fn a_motion_starts_at_a_corner() {
    let formula = free(BOX, &["x", "y"], Impact::Elastic);
    let mut failures = Failures::default();
    for (q, v) in [
        ([4.5, 4.5], [1.0, 1.0]),
        ([4.5, 4.5], [1.0, 0.3]),
        ([4.5, 4.5], [-1.0, 1.0]),
        ([4.5, 4.5], [-1.0, -1.0]),
        ([4.5, 4.5 - 1e-12], [1.0, 1.0]),
        ([4.5, 4.5 - 1e-9], [1.0, 0.3]),
        ([0.0, 4.5], [-1.0, 2.0]),
    ] {
        for by in controls() {
            let difference = differs(run(&formula, (0.0, q, v), 6.2, by), in_box(q, v, 6.2, 1.0), 4.0 * ROUND_OFF);
            failures.add(&format!("{q:?} {v:?}"), by, difference);
        }
    }
    for by in controls() {
        let (first, before) = run(&formula, (0.0, [0.5, 0.5], [1.0, 1.0]), 4.0, by).unwrap();
        let (q, v): ([f64; 2], [f64; 2]) = (first.q.try_into().unwrap(), first.v.unwrap().try_into().unwrap());
        let rest = run(&formula, (4.0, q, v), 11.7, by).map(|(outcome, after)| (outcome, before + after));
        failures.add("continued", by, differs(rest, in_box([0.5, 0.5], [1.0, 1.0], 11.7, 1.0), ROUND_OFF));
    }
    failures.assert_none();
}

/// Resets at a corner that do not turn a motion back end the run, and those that are kicks let it pass.
#[test]
fn a_motion_that_is_pressed_into_a_corner_ends_there() {
    let corner = "min(4.5 - x, 4.5 - y)";
    let free = Formula::parse("(x'^2 + y'^2)/2", &["x", "y"], &[]).unwrap();
    let pushed = Formula::parse("(x'^2 + y'^2)/2 + x + y", &["x", "y"], &[]).unwrap();
    let by_reset = |then| Reset { when: corner, direction: Direction::Falling, then, rest: None };
    for (what, formula, time) in [
        ("one wall only", free.with_reset(by_reset(&[("x'", "-x'")])).unwrap(), 4.0),
        // Accelerated, it arrives at the root of t + t^2/2 = 4.
        ("no restitution", pushed.with_impact(corner, Impact::Restitution(0.0), None).unwrap(), 2.0),
    ] {
        for by in controls() {
            match run(&formula, (0.0, [0.5, 0.5], [1.0, 1.0]), 11.7, by) {
                Ok((outcome, _)) => {
                    let Status::Failed { cause: StepError::Contact { t }, .. } = outcome.status else {
                        panic!("{what} by {by:?}: {}, {:?}", outcome.status, outcome.q)
                    };
                    assert!((t - time).abs() <= ROUND_OFF, "{what} by {by:?}: {t}");
                }
                Err(refused) => assert!(refused.contains("is pressed onto it"), "{what}: {refused}"),
            }
        }
    }
    let kick = free.with_reset(by_reset(&[("x'", "x' + 1")])).unwrap();
    for (distance, v) in [(0.0, [1.0, 1.0]), (0.0, [1.0, 0.5]), (1e-9, [1.0, 1.0])] {
        for by in controls() {
            let q = [4.5 - 4.0 * v[0], 4.5 - 4.0 * v[1] - distance];
            let expected = ([4.5 + 4.0 * (v[0] + 1.0), q[1] + 8.0 * v[1]], [v[0] + 1.0, v[1]], 1);
            assert_eq!(differs(run(&kick, (0.0, q, v), 8.0, by), expected, ROUND_OFF), None, "{v:?} by {by:?}");
        }
    }
}

/// A passage at a corner has no derivative in general, and beside it that of two impacts.
#[test]
fn a_corner_has_no_derivatives() {
    let of = |text: &str, q: [f64; 2], v: [f64; 2]| {
        let motion = Motion::new(Start::new(0.0, q, v, 0.0), 6.0, by("gauss_2", 0.5));
        let system = System::new(&free(text, &["x", "y"], Impact::Elastic)).unwrap();
        let found =
            system.sensitivity(&motion, &["x", "y", "x'"], &[6.0], &mut ()).map_err(|error| error.to_string())?;
        Ok(found.rows[0].iter().map(|of| of.q.clone()).collect::<Vec<_>>())
    };
    for (text, q, v) in [
        (BOX, [0.5, 0.5], [1.0, 1.0]),
        (BOX, [0.5, 2.5], [1.0, 0.5]),
        ("y - abs(x)", [0.0, 4.0], [0.0, -1.0]),
        ("y - abs(x)", [0.4, 4.0], [-0.1, -1.0]),
        ("max(-x, -y)", [-4.0, -4.0], [1.0, 1.0]),
    ] {
        let said: Result<_, String> = of(text, q, v);
        assert!(said.as_ref().is_err_and(|said| said.contains("corner of the surface")), "{text}: {said:?}");
    }
    for distance in [0.1, 1e-3, 1e-6] {
        let found = of(BOX, [0.5, 0.5 - distance], [1.0, 1.0]).unwrap();
        for (row, expected) in found.iter().zip([[-1.0, 0.0], [0.0, -1.0], [-6.0, 0.0]]) {
            let off = row.iter().zip(expected).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            // By differences of positions, with a round-off of 1e-15, over a thousandth of the distance.
            assert!(off <= 1e-12 / distance, "{distance}: {found:?}");
        }
    }
}
