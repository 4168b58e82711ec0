//! An area in phase space, carried along by the damped pendulum: a contact splitting contracts it by exactly the factor of the motion, the
//! classical Runge-Kutta method does not.
//!
//! With one coordinate `d eta = dq ^ dp`. The step of a splitting has the constant `sigma_d = e^(gamma h)`, and `Phi^* eta = sigma_d eta`
//! says that the map `(q, p) -> (q, p)` contracts every area by `e^(gamma h)` in each step, however long the step is.

use contact_examples::systems::Pendulum;
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, number};
use contact_geom::nalgebra::Vector2;
use contact_geom::numbers::max_or_nan;
use contact_geom::{GeometryError, PhasePoint, VelocityPoint, herglotz_field};
use discrete_herglotz::splitting::Splitting;
use discrete_herglotz::{SplittingScheme, Stepper};
use std::f64::consts::{PI, TAU};

/// `L = v^2/2 - (1 - cos q) + gamma z`: `q'' = -sin q + gamma q'`, with `p = v`.
const PENDULUM: Pendulum = Pendulum { gamma: -0.1 };

/// The splitting, its step and the number of its steps. A small oscillation takes 6.3 time units.
const SCHEME: SplittingScheme = SplittingScheme::BLANES_MOAN_6;
const STEP: f64 = 1.0;
const STEPS: usize = 20;

/// The number of Runge-Kutta steps that evaluate as many forces as one step of the splitting: 12 beside 11.
const SUBSTEPS: usize = 3;

/// The disc of initial states: its centre (q, p), its radius, and the number of points on its edge. Half as many give the same areas to
/// round-off.
const CENTRE: (f64, f64) = (0.0, 1.45);
const RADIUS: f64 = 0.5;
const POINTS: usize = 512;

/// The numbers of steps after which the area is drawn, each with its colour; all of them are solid lines.
const DRAWN: [(usize, Line); 5] = [
    (0, Line::Coloured(0)),
    (2, Line::Coloured(4)),
    (4, Line::Coloured(8)),
    (6, Line::Coloured(15)),
    (20, Line::Coloured(19)),
];

/// The largest relative defect of an area that counts as round-off: a hundred times what the splitting has.
const BOUND: f64 = 1e-12;

/// The points of a closed curve, at equal distances of its parameter.
type Edge = Vec<Vector2<f64>>;

/// The edge of the area at the start and after each step, and the area inside.
struct Carried {
    edges: Vec<Edge>,
    areas: Vec<f64>,
}

impl Carried {
    /// From the motions of the points on the edge: each has its state at the start and after each step.
    fn new(motions: &[Vec<Vector2<f64>>]) -> Self {
        let edges: Vec<Edge> = (0..=STEPS).map(|k| motions.iter().map(|motion| motion[k]).collect()).collect();
        let areas = edges.iter().map(|edge| enclosed(edge)).collect();
        Carried { edges, areas }
    }

    /// The times after the start, and `|A(t) / (A(0) e^(gamma t)) - 1|` there.
    fn defects(&self) -> Vec<(f64, f64)> {
        let defect = |k: usize| (self.areas[k] / (self.areas[0] * contraction(k)) - 1.0).abs();
        (1..=STEPS).map(|k| (time(k), defect(k))).collect()
    }

    /// The largest defect; a NaN where one is.
    fn worst(&self) -> f64 {
        self.defects().into_iter().map(|(_, defect)| defect).fold(0.0, max_or_nan)
    }
}

fn time(k: usize) -> f64 {
    STEP * k as f64
}

/// What the motion contracts areas by in k steps.
fn contraction(k: usize) -> f64 {
    (PENDULUM.gamma * time(k)).exp()
}

/// The edge of the disc.
fn circle() -> Edge {
    let at = |angle: f64| Vector2::new(CENTRE.0 + RADIUS * angle.cos(), CENTRE.1 + RADIUS * angle.sin());
    (0..POINTS).map(|k| at(TAU * k as f64 / POINTS as f64)).collect()
}

/// The area inside a smooth closed curve, `int q dp`, by its Fourier series: exact but for the modes beyond half the number of points.
fn enclosed(edge: &[Vector2<f64>]) -> f64 {
    let count = edge.len();
    let angles: Vec<(f64, f64)> = (0..count).map(|j| (TAU * j as f64 / count as f64).sin_cos()).collect();
    let mode = |k: usize| {
        let (mut sines, mut cosines) = (Vector2::zeros(), Vector2::zeros());
        for (j, x) in edge.iter().enumerate() {
            let (sin, cos) = angles[j * k % count];
            sines += x * sin;
            cosines += x * cos;
        }
        k as f64 * (cosines[0] * sines[1] - sines[0] * cosines[1])
    };
    let normalisation = 2.0 / count as f64;
    (1..count / 2).map(mode).sum::<f64>() * PI * normalisation * normalisation
}

/// The motions of the points by the splitting.
fn by_splitting() -> Result<Carried, Failure> {
    let motion = |start: &Vector2<f64>| {
        let start = PhasePoint::new([start[0]], [start[1]], 0.0);
        let mut splitting = Splitting::new(&PENDULUM, &SCHEME, STEP, 0.0, start)?.without_action();
        let mut motion = vec![Vector2::new(start.q[0], start.p[0])];
        for _ in 0..STEPS {
            splitting.advance(1).map_err(|failure| failure.cause)?;
            let x = splitting.state();
            motion.push(Vector2::new(x.q[0], x.p[0]));
        }
        Ok(motion)
    };
    Ok(Carried::new(&circle().iter().map(motion).collect::<Result<Vec<_>, Failure>>()?))
}

/// The motions of the points by the classical Runge-Kutta method of order four, with so many of its steps in each [`STEP`].
fn by_runge_kutta(substeps: usize) -> Result<Carried, Failure> {
    let h = STEP / substeps as f64;
    let motion = |start: &Vector2<f64>| {
        let mut motion = vec![*start];
        for k in 0..STEPS {
            let end = (0..substeps).try_fold(motion[k], |x, _| runge_kutta(&x, h))?;
            motion.push(end);
        }
        Ok(motion)
    };
    Ok(Carried::new(&circle().iter().map(motion).collect::<Result<Vec<_>, GeometryError>>()?))
}

/// One step of the classical Runge-Kutta method for `q' = v`, `v' = a`.
fn runge_kutta(x: &Vector2<f64>, h: f64) -> Result<Vector2<f64>, GeometryError> {
    let field = |x: &Vector2<f64>| {
        let at = VelocityPoint::new([x[0]], [x[1]], 0.0);
        herglotz_field(&PENDULUM, 0.0, &at).map(|xi| Vector2::new(xi.x[0], xi.y[0]))
    };
    let k1 = field(x)?;
    let k2 = field(&(x + k1 * (0.5 * h)))?;
    let k3 = field(&(x + k2 * (0.5 * h)))?;
    let k4 = field(&(x + k3 * h))?;
    Ok(x + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0))
}

/// The area by three methods.
pub struct Area {
    splitting: Carried,
    classical: Carried,
    finer: Carried,
}

impl Area {
    /// Carries the area along.
    pub fn new() -> Result<Self, Failure> {
        Ok(Area { splitting: by_splitting()?, classical: by_runge_kutta(1)?, finer: by_runge_kutta(SUBSTEPS)? })
    }

    /// Writes the areas at all times, and draws them at some.
    pub fn write(&self, out: &Directory) -> Result<(), Failure> {
        let columns =
            ["t", "area_exact", "area_blanes_moan_6", "area_runge_kutta_4", "area_runge_kutta_4_shorter_steps"];
        let entries = (0..=STEPS).map(|k| {
            let exact = self.splitting.areas[0] * contraction(k);
            [time(k), exact, self.splitting.areas[k], self.classical.areas[k], self.finer.areas[k]].map(number)
        });
        out.table("area.csv", &columns, entries)?;
        out.text("area.svg", &filled(&draw_row(&[self.phase_space(), self.contraction()])))
    }

    fn phase_space(&self) -> Panel {
        let closed = |edge: &Edge| edge.iter().step_by(4).chain(&edge[..1]).map(|x| (x[0], x[1])).collect::<Vec<_>>();
        let drawn = DRAWN.iter().map(|(k, line)| {
            let name = format!("t = {}", time(*k));
            Curve::new(&name, *line, closed(&self.splitting.edges[*k]))
        });
        let compared = DRAWN[1..].iter().map(|(k, _)| Curve::unnamed(Line::Dotted, closed(&self.classical.edges[*k])));
        Panel::new(
            ("angle q (radians)", Axis::Linear(-3.0, 3.0, 1.0)),
            ("momentum p (dimensionless)", Axis::Linear(-2.0, 2.0, 1.0)),
            (0.78, 0.97),
            drawn.chain(compared).collect(),
        )
    }

    fn contraction(&self) -> Panel {
        Panel::new(
            ("time t (dimensionless)", Axis::Linear(0.0, 21.0, 5.0)),
            ("relative defect of the area", Axis::Logarithmic(-18, 0, 3)),
            (0.3, 0.6),
            vec![
                Curve::new("Runge-Kutta 4, h = 1", Line::Dotted, self.classical.defects()),
                Curve::new("Runge-Kutta 4, h = 1/3", Line::DashDot, self.finer.defects()),
                Curve::new("blanes_moan_6, h = 1", Line::Discs, self.splitting.defects()),
            ],
        )
    }

    /// The largest defect of the splitting.
    pub fn defect(&self) -> f64 {
        self.splitting.worst()
    }

    /// What was computed, and how exact it is.
    pub fn report(&self) -> String {
        let mut text = format!(
            "An area in phase space (area.svg, area.csv)\n\n  \
             A disc of initial states (q, p) of the damped pendulum q'' = -sin q + gamma q', gamma = {}, follows the \
             motion over\n  \
             {} time units. The motion contracts its area A by exactly e^(gamma t). The largest |A(t)/(A(0) e^(gamma \
             t)) - 1|:\n\n",
            PENDULUM.gamma,
            time(STEPS)
        );
        let finer = format!("classical Runge-Kutta, order 4, h = {STEP}/{SUBSTEPS}");
        for (method, forces, carried) in [
            (format!("{}, order {}, h = {STEP}", SCHEME.name(), SCHEME.order()), SCHEME.stages(), &self.splitting),
            (format!("classical Runge-Kutta, order 4, h = {STEP}"), 4, &self.classical),
            (finer, 4 * SUBSTEPS, &self.finer),
        ] {
            text += &format!("    {method:<42} {forces:>2} forces per time unit   {:.1e}\n", carried.worst());
        }
        text + "\n  The defect of the splitting is round-off: its step contracts the area by e^(gamma h) for every \
                h.\n\n"
    }

    /// Fails where the splitting has more than round-off.
    pub fn verdict(&self) -> Result<(), Failure> {
        let defect = self.defect();
        let wrong = format!("  area by {}, relative defect: {defect:.1e} > {BOUND:e}", SCHEME.name());
        let wrong = if defect <= BOUND { Vec::new() } else { vec![wrong] };
        Failure::unless_empty(&wrong, 1, "figures are above their bounds")
    }
}

/// The same figure with the inside of its solid curves filled by their colour.
fn filled(svg: &str) -> String {
    const SOLID: &str = r#"" stroke-width="2" fill="none" />"#;
    let mut parts: Vec<String> = svg.split(SOLID).map(String::from).collect();
    let last = parts.pop().unwrap_or_default();
    for part in &mut parts {
        let colour = part.rsplit('"').next().unwrap_or_default().to_owned();
        *part += &format!(r#"" stroke-width="2" fill="{colour}" fill-opacity="0.2" />"#);
    }
    parts.concat() + &last
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The limacon `r = a + b cos s` has the area `pi (a^2 + b^2/2)`; its series ends after two modes.
    #[test]
    fn the_area_of_a_limacon() {
        let (a, b) = (1.0, 0.6);
        let edge: Edge = (0..32)
            .map(|k| TAU * f64::from(k) / 32.0)
            .map(|s| Vector2::new(s.cos(), s.sin()) * (a + b * s.cos()) + Vector2::new(3.0, -7.0))
            .collect();
        let area = PI * (a * a + 0.5 * b * b);
        assert!((enclosed(&edge) / area - 1.0).abs() < 1e-14);
    }

    /// The points resolve the areas, and a map that is not conformal is seen.
    #[test]
    fn the_bound_tells_the_methods_apart() {
        let area = Area::new().unwrap();
        for (edge, whole) in area.splitting.edges.iter().zip(&area.splitting.areas) {
            let half: Edge = edge.iter().step_by(2).copied().collect();
            assert!((enclosed(&half) / whole - 1.0).abs() < 0.1 * BOUND);
        }
        assert!(area.splitting.worst() < 0.1 * BOUND);
        assert!(area.classical.worst() > 1e-2 && area.finer.worst() > 1e-5);
    }
}
