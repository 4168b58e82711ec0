//! The motion of a problem by other means: extrapolation of the modified midpoint rule (Gragg, Bulirsch and Stoer), over
//! pieces that end where the field or the state changes.

use super::feature::Surface;
use super::problem::Problem;

/// The motion of a problem.
#[derive(Clone, Debug, Default)]
pub struct Reference {
    /// The time and the state at the end.
    pub t: f64,
    pub end: [f64; 3],
    /// The states at the requested times.
    pub rows: Vec<[f64; 3]>,
    /// The times of impacts, and the states after them.
    pub impacts: Vec<(f64, [f64; 3])>,
    /// The times at which x crosses the requested value.
    pub crossings: Vec<f64>,
    /// The largest |x| at the ends of steps.
    pub farthest: f64,
}

/// The longest step. The extrapolated rule of order 16 then has an error below round-off.
const STEP: f64 = 0.05;

/// A part of the motion in which the field is smooth.
struct Piece<'p> {
    problem: &'p Problem,
    /// The surfaces of each feature.
    surfaces: Vec<Vec<Surface>>,
    /// Which side of its surfaces each feature is on.
    sides: Vec<Vec<f64>>,
    /// How many of its times have passed.
    passed: Vec<usize>,
}

impl Piece<'_> {
    fn rates(&self, t: f64, [x, v, z]: [f64; 3]) -> [f64; 3] {
        let Problem { m, k, gamma, pendulum, features, .. } = self.problem;
        let (mut potential, mut force) =
            if *pendulum { (k * (1.0 - x.cos()), -k * x.sin()) } else { (k * x * x / 2.0, -k * x) };
        for (i, feature) in features.iter().enumerate() {
            let part = feature.field(t, x, v, &self.sides[i], self.passed[i]);
            potential += part.0;
            force += part.1;
        }
        [v, force / m + gamma * v, m * v * v / 2.0 - potential + gamma * z]
    }

    /// A step by eight midpoint rules of 2, 4, ..., 16 substeps, extrapolated.
    fn step(&self, t: f64, y: [f64; 3], h: f64) -> [f64; 3] {
        let add = |a: [f64; 3], b: [f64; 3], s: f64| std::array::from_fn(|i| a[i] + s * b[i]);
        let mut above: Vec<[f64; 3]> = Vec::new();
        for row in 1..=8 {
            let n = 2 * row;
            let s = h / n as f64;
            let (mut before, mut now) = (y, add(y, self.rates(t, y), s));
            for i in 1..n {
                let next = add(before, self.rates(t + s * i as f64, now), 2.0 * s);
                (before, now) = (now, next);
            }
            let mut line = vec![add(add(before, now, 1.0), self.rates(t + h, now), s).map(|x| x / 2.0)];
            for (k, above) in above.iter().enumerate() {
                let ratio = (row as f64 / (row - k - 1) as f64).powi(2) - 1.0;
                let last = line[k];
                line.push(std::array::from_fn(|i| last[i] + (last[i] - above[i]) / ratio));
            }
            above = line;
        }
        above[7]
    }

    /// The parts of a step at which it is seen whether the motion has left the sides of the piece: the middle, the end, and
    /// where it is nearest to a surface from which it turns away.
    fn searched(&self, t: f64, y: [f64; 3], h: f64) -> Vec<f64> {
        let mut parts = vec![0.5, 1.0];
        for (.., surface) in self.surfaces() {
            let rate = |part: f64| surface.rate(t + part * h, self.step(t, y, part * h));
            let (mut before, mut after) = (0.0, 1.0);
            if surface.rate(t, y) * rate(after) >= 0.0 {
                continue;
            }
            for _ in 0..30 {
                let middle = (before + after) / 2.0;
                if rate(middle) * rate(after) > 0.0 { after = middle } else { before = middle }
            }
            parts.push(after);
        }
        parts.sort_by(f64::total_cmp);
        parts
    }

    /// Whether the motion has left the sides of the piece.
    fn is_left(&self, t: f64, y: [f64; 3]) -> bool {
        self.surfaces().any(|(i, j, surface)| surface.function(t, y) * self.sides[i][j] < 0.0)
    }

    /// All surfaces, with the number of the feature and theirs in it; the last feature is the watched position.
    fn surfaces(&self) -> impl Iterator<Item = (usize, usize, Surface)> {
        let of_features = self.surfaces.iter().enumerate();
        of_features.flat_map(|(i, surfaces)| surfaces.iter().enumerate().map(move |(j, surface)| (i, j, *surface)))
    }
}

impl Surface {
    fn is_of_velocity(self) -> bool {
        matches!(self, Surface::Rest | Surface::End(None))
    }

    /// The rate of the function of a surface of positions; 0 for others.
    fn rate(self, t: f64, [_, v, _]: [f64; 3]) -> f64 {
        match self {
            Surface::Position(_) | Surface::Step { .. } | Surface::End(Some(_)) => v,
            Surface::Wall { b, w, .. } => v - b * w * (w * t).cos(),
            Surface::Rest | Surface::End(None) => 0.0,
        }
    }

    /// Its function, which changes its sign where the motion crosses it.
    fn function(self, t: f64, [x, v, _]: [f64; 3]) -> f64 {
        match self {
            Surface::Position(a) | Surface::Step { a, .. } | Surface::End(Some(a)) => x - a,
            Surface::Wall { a, b, w, .. } => x - (a + b * (w * t).sin()),
            Surface::Rest | Surface::End(None) => v,
        }
    }
}

/// The motion from a time and a state, with rows at these times, until the end of the problem; a watched position is
/// one whose crossings are recorded. `None` where a thousand surfaces are met, or where it is not defined whether the
/// motion comes to rest.
pub fn motion(
    problem: &Problem,
    (mut t, mut y): (f64, [f64; 3]),
    times: &[f64],
    watched: Option<f64>,
) -> Option<Reference> {
    let mut found = Reference::default();
    let mut surfaces: Vec<_> = problem.features.iter().map(super::feature::Feature::surfaces).collect();
    surfaces.push(watched.map(Surface::Position).into_iter().collect());
    let mut piece = Piece { problem, sides: Vec::new(), passed: Vec::new(), surfaces };
    let side = |surface: &Surface| surface.function(t, y).signum();
    piece.sides = piece.surfaces.iter().map(|of| of.iter().map(side).collect()).collect();
    let changes: Vec<Vec<f64>> = problem.features.iter().map(super::feature::Feature::times).collect();
    let passed = |t: f64| changes.iter().map(|times| times.iter().filter(|at| **at <= t).count()).collect::<Vec<_>>();
    let mut cuts: Vec<f64> = changes.iter().flatten().chain(times).copied().chain([problem.end]).collect();
    cuts.retain(|at| *at > t && *at <= problem.end);
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let mut met = 0;
    for cut in cuts {
        piece.passed = passed(t);
        while t < cut {
            let h = STEP.min(cut - t);
            found.farthest = found.farthest.max(y[0].abs());
            let to = |part: f64| piece.step(t, y, part * h);
            let parts = piece.searched(t, y, h);
            let Some(i) = parts.iter().position(|part| piece.is_left(t + *part * h, to(*part))) else {
                y = to(1.0);
                t = if h == cut - t { cut } else { t + h };
                continue;
            };
            let (mut inside, mut outside) = (if i == 0 { 0.0 } else { parts[i - 1] }, parts[i]);
            for _ in 0..60 {
                let middle = (inside + outside) / 2.0;
                if piece.is_left(t + middle * h, to(middle)) { outside = middle } else { inside = middle }
            }
            y = to(outside);
            t += outside * h;
            met += 1;
            if met > 1000 {
                return None;
            }
            let crossed: Vec<_> =
                piece.surfaces().filter(|(i, j, surface)| surface.function(t, y) * piece.sides[*i][*j] < 0.0).collect();
            let mut reversed = false;
            for (i, j, surface) in crossed {
                match surface {
                    Surface::Step { h, .. } => {
                        let rise = -h * piece.sides[i][j];
                        let square = y[1] * y[1] - 2.0 * rise / problem.m;
                        if square > 0.0 {
                            y[1] = square.sqrt().copysign(y[1]);
                            piece.sides[i][j] = -piece.sides[i][j];
                        } else {
                            // Whether it is at rest in between is a matter of the limit.
                            if piece.surfaces().any(|of| of.2 == Surface::End(None)) {
                                return None;
                            }
                            y[1] = -y[1];
                            reversed = true;
                        }
                    }
                    Surface::Wall { a, b, w, e } => {
                        let speed = b * w * (w * t).cos();
                        (y[0], y[1]) = (a + b * (w * t).sin(), speed - e * (y[1] - speed));
                        found.impacts.push((t, y));
                        reversed = true;
                    }
                    Surface::End(_) => return Some(Reference { t, end: y, ..found }),
                    Surface::Position(_) | Surface::Rest => {
                        piece.sides[i][j] = -piece.sides[i][j];
                        if i == problem.features.len() {
                            found.crossings.push(t);
                        }
                    }
                }
            }
            // The velocity passes 0 in an instant, which is no crossing.
            let of_velocity: Vec<_> = piece.surfaces().filter(|of| reversed && of.2.is_of_velocity()).collect();
            for (i, j, _) in of_velocity {
                piece.sides[i][j] = y[1].signum();
            }
        }
        if times.contains(&cut) {
            found.rows.push(y);
        }
    }
    Some(Reference { t, end: y, ..found })
}
