//! Kinks and jumps of formulas: steps end on them, so that accuracy is maintained across them.

use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, Outcome, Problem, Status, Steps, Until};
use formula_lagrangian::Formula;
use std::f64::consts::PI;

/// The motion of one coordinate x from a position and a velocity, with a required accuracy.
fn by_accuracy(text: &str, [x, v]: [f64; 2], span: f64, wanted: f64) -> Outcome {
    let lagrangian = Formula::parse(text, &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([x], [v], 0.0)).unwrap();
    problem.accuracy(wanted).run(Until::Time(span)).unwrap()
}

/// The same with a given integrator and number of steps.
fn by_steps(text: &str, [x, v]: [f64; 2], span: f64, by: &str, steps: usize) -> Outcome {
    let lagrangian = Formula::parse(text, &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([x], [v], 0.0)).unwrap();
    problem.by(by.parse::<AnyIntegrator>().unwrap()).steps(Steps::Count(steps)).run(Until::Time(span)).unwrap()
}

/// Texts, initial states, time spans, and final states.
fn solved() -> Vec<(&'static str, [f64; 2], f64, [f64; 2])> {
    let forced = "x'^2/2 - x^2/2 + if(t > 0.75, 1, 0)*x";
    vec![
        // Half periods of the frequencies 1 and 3, then of 1 and 2.
        ("x'^2/2 - if(x > 0, x^2/2, 4.5*x^2)", [1.0, 0.0], 4.0 * PI / 3.0, [1.0, 0.0]),
        ("x'^2/2 - if(x > 0, x^2/2, 2*x^2)", [1.0, 0.0], 9.0 * PI, [1.0, 0.0]),
        (forced, [0.0, 0.0], 2.0, [1.0 - 1.25_f64.cos(), 1.25_f64.sin()]),
        // A parabola in each direction; a quarter of a period takes sqrt(2).
        ("x'^2/2 - abs(x)", [1.0, 0.0], 8.0 * 2.0_f64.sqrt(), [1.0, 0.0]),
        // Jumps of the potential at which the motion is reflected, slowed down and accelerated.
        ("x'^2/2 - 5*if(x > 0.7, 1, 0)", [0.0, 1.0], 2.0, [-0.6, -1.0]),
        ("x'^2/2 - 0.3*if(x > 0.7, 1, 0)", [0.0, 1.0], 2.0, [0.7 + 1.3 * 0.4_f64.sqrt(), 0.4_f64.sqrt()]),
        ("x'^2/2 + 0.3*if(x > 0.7, 1, 0)", [0.0, 1.0], 2.0, [0.7 + 1.3 * 1.6_f64.sqrt(), 1.6_f64.sqrt()]),
    ]
}

#[test]
fn accuracy_holds_across_kinks_and_jumps() {
    for (text, start, span, [x, v]) in solved() {
        for wanted in [1e-6, 1e-9, 1e-11] {
            let found = by_accuracy(text, start, span, wanted);
            let off = (found.q[0] - x).hypot(found.p[0] - v) / x.hypot(v);
            assert!(off <= wanted, "{text} to {wanted:e}: {off:e} in {} steps", found.steps);
            assert_eq!((found.status, found.unresolved), (Status::Completed, None), "{text}");
        }
    }
}

/// The same with given steps and several integrators, to within the error of these steps for a smooth motion.
#[test]
fn given_steps_end_on_kinks_and_jumps() {
    for (text, start, span, [x, v]) in solved() {
        // Frequencies are at most 3. The errors of the steps accumulate in time.
        for (by, per_unit, bound) in
            [("gauss_8", 2.0, 1e-11), ("gauss_2", 40.0, 1e-6), ("kahan_li_8", 20.0, 1e-6), ("midpoint", 300.0, 1e-3)]
        {
            let found = by_steps(text, start, span, by, (per_unit * span).ceil() as usize);
            let off = (found.q[0] - x).hypot(found.p[0] - v);
            assert!(off <= bound, "{text} by {by}: {off:e}");
            assert_eq!((found.status, found.unresolved), (Status::Completed, None), "{text} by {by}");
        }
    }
}

/// Random numbers between two bounds, equal on all platforms.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A potential `k x^2/2 - c x + d` in each of three regions, which are separated by two walls; a force that begins at a
/// given time; and drag.
struct Pieces {
    walls: [f64; 2],
    pieces: [[f64; 3]; 3],
    begins: f64,
    force: f64,
    gamma: f64,
}

impl Pieces {
    /// Random pieces with or without jumps of the potential at the walls.
    fn random(random: &mut Random) -> Self {
        let walls = [random.between(-0.8, -0.1), random.between(0.1, 0.8)];
        let mut pieces = [[0.0; 3]; 3].map(|_: [f64; 3]| [random.between(0.2, 9.0), random.between(-1.0, 1.0), 0.0]);
        let jumps = if random.between(0.0, 1.0) < 0.5 { 0.4 } else { 0.0 };
        for i in 0..2 {
            let before = potential(pieces[i], walls[i]) - potential(pieces[i + 1], walls[i]);
            pieces[i + 1][2] = before + jumps * random.between(-1.0, 1.0);
        }
        let [begins, force, gamma] = [random.between(0.5, 4.0), random.between(-1.0, 1.0), random.between(-0.3, 0.05)];
        Pieces { walls, pieces, begins, force, gamma }
    }

    fn text(&self) -> String {
        let of = |[k, c, d]: [f64; 3]| format!("({k:?}*x^2/2 - ({c:?})*x + ({d:?}))");
        let Pieces { walls: [a, b], pieces: [left, middle, right], begins, force, gamma } = self;
        let [left, middle, right] = [left, middle, right].map(|piece| of(*piece));
        format!(
            "x'^2/2 - if(x < {a:?}, {left}, if(x < {b:?}, {middle}, {right})) + if(t > {begins:?}, {force:?}, 0)*x + {gamma:?}*z"
        )
    }

    /// The motion within a region, by the Taylor series of a linear equation, which is exact to round-off for times up
    /// to a tenth.
    fn flow(&self, region: usize, forced: bool, [x, v]: [f64; 2], t: f64) -> [f64; 2] {
        let [k, c, _] = self.pieces[region];
        let c = if forced { c + self.force } else { c };
        let (mut derivatives, mut sums, mut factor) = ([x, v], [x, v], 1.0);
        let mut constant = c;
        for n in 1..24 {
            derivatives = [derivatives[1], -k * derivatives[0] + self.gamma * derivatives[1] + constant];
            constant = 0.0;
            factor *= t / n as f64;
            sums = [sums[0] + factor * derivatives[0], sums[1] + factor * derivatives[1]];
        }
        sums
    }

    /// The motion from an initial state over a time span, from wall to wall. `None` if it comes so close to the top of
    /// a jump of the potential, or to a turning point at a wall, that the final state depends on round-off.
    fn solve(&self, [mut x, mut v]: [f64; 2], span: f64) -> Option<[f64; 2]> {
        let mut t = 0.0;
        let mut region = self.walls.iter().filter(|wall| x >= **wall).count();
        while t < span {
            let forced = t >= self.begins;
            let mut step = (span - t).min(0.01);
            if !forced {
                step = step.min(self.begins - t);
            }
            let bounds = [
                if region > 0 { self.walls[region - 1] } else { f64::NEG_INFINITY },
                if region < 2 { self.walls[region] } else { f64::INFINITY },
            ];
            let at = |s: f64| self.flow(region, forced, [x, v], s);
            let inside = |s: f64| (bounds[0]..=bounds[1]).contains(&at(s)[0]);
            if inside(step) {
                [x, v] = at(step);
                t += step;
                continue;
            }
            let (mut low, mut high) = (0.0, step);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if inside(middle) { low = middle } else { high = middle }
            }
            v = at(low)[1];
            t += low;
            if v.abs() < 0.05 {
                return None;
            }
            let up = v > 0.0;
            let next = if up { region + 1 } else { region - 1 };
            let wall = self.walls[region.min(next)];
            let jump = potential(self.pieces[next], wall) - potential(self.pieces[region], wall);
            let square = v * v - 2.0 * jump;
            if square.abs() < 0.02 {
                return None;
            }
            // The position is exactly on the wall, so that the next piece begins in its own region.
            x = wall;
            if square > 0.0 {
                (v, region) = (square.sqrt().copysign(v), next);
            } else {
                v = -v;
            }
        }
        Some([x, v])
    }
}

fn potential([k, c, d]: [f64; 3], x: f64) -> f64 {
    k * x * x / 2.0 - c * x + d
}

/// A thousand random kinks, jumps and walls. A run with a required accuracy satisfies it, and runs with steps of a
/// sixteenth of a unit of time are accurate to their order.
#[test]
fn random_kinks_and_jumps() {
    let mut random = Random(7);
    let (mut solved, mut refused, mut worst) = (0, 0, 0.0_f64);
    for case in 0..1000 {
        let pieces = Pieces::random(&mut random);
        let start = [random.between(-0.05, 0.05), random.between(0.5, 1.5)];
        let span = random.between(3.0, 8.0);
        let Some([x, v]) = pieces.solve(start, span) else { continue };
        solved += 1;
        let text = pieces.text();
        let lagrangian = Formula::parse(&text, &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
        let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([start[0]], [start[1]], 0.0)).unwrap();
        let size = x.hypot(v);
        match problem.accuracy(1e-9).run(Until::Time(span)) {
            Ok(found) => {
                let off = (found.q[0] - x).hypot(found.p[0] - v) / size;
                worst = worst.max(off);
                assert_eq!(found.status, Status::Completed, "case {case}: {text}");
                assert!(off <= 1e-9, "case {case}: {off:e} from {start:?} to {span}: {text}");
            }
            Err(error) => {
                println!("case {case}: {error}: {text} from {start:?} to {span}");
                refused += 1;
            }
        }
        for (by, bound) in [("gauss_6", 1e-9), ("blanes_moan_6", 1e-5)] {
            let found = by_steps(&text, start, span, by, (16.0 * span).ceil() as usize);
            let off = (found.q[0] - x).hypot(found.p[0] - v) / size;
            assert!(off <= bound, "case {case} by {by}: {off:e} from {start:?} to {span}: {text}");
        }
    }
    println!("{solved} solved, {refused} refused, at worst {worst:e}");
    assert!(solved > 700 && refused <= solved / 100, "{refused} of {solved} refused");
}

/// A jump that is written as a smooth function, so narrow that no evaluation of the gradient detects it. The motion
/// beyond it is correct, or the run is refused.
#[test]
fn a_jump_in_disguise_is_not_crossed() {
    for (height, beyond) in [(0.15, 0.4_f64.sqrt()), (0.0015, 0.994_f64.sqrt())] {
        let text = format!("x'^2/2 - {height}*tanh((x - 0.7)*1e10)");
        let lagrangian = Formula::parse(&text, &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
        let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
        for wanted in [1e-4, 1e-6, 1e-9] {
            if let Ok(found) = problem.accuracy(wanted).run(Until::Time(10.0)) {
                let off = (found.q[0] - 0.7 - 9.3 * beyond).abs();
                assert!(off <= 10.0 * wanted, "{text} to {wanted:e}: {off:e} in {} steps", found.steps);
            }
        }
    }
}
