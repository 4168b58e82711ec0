//! A fan of motions from one point, and the conjugate points at which neighbouring motions meet again.

use contact_examples::systems::Pendulum;
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, number};
use contact_geom::VelocityPoint;
use exact_lagrangian::{ContactExponential, herglotz_flow};
use std::f64::consts::PI;

/// The pendulum of the fan.
const PENDULUM: Pendulum = Pendulum { gamma: -0.1 };

/// The duration of the motions, and the number of samples of each.
const RUN: (f64, usize) = (8.0, 320);

/// The initial velocities of the fan, in hundredths: their spacing and their number on each side. The fastest motion
/// still oscillates; from a velocity of about 2.2 on, the pendulum rotates.
const FAN: (i32, i32) = (30, 7);

/// The same for the envelope of all motions, on which the conjugate points lie.
const ENVELOPE: (i32, i32) = (4, 53);

/// The motions whose derivative is drawn: their indices in the fan, counted from the middle, and their line styles.
const DRAWN: [(usize, Line); 3] = [(0, Line::Solid), (4, Line::DashDot), (6, Line::Dotted)];

/// The initial velocities of a fan.
fn velocities((spacing, side): (i32, i32)) -> impl Iterator<Item = f64> {
    (-side..=side).map(move |k| f64::from(spacing * k) / 100.0)
}

/// The position of a motion at one time, and its derivative with respect to the initial velocity.
struct Sample {
    t: f64,
    q: f64,
    /// `dq/dv0`, whose zeros are the conjugate points.
    slope: f64,
}

/// A motion of the fan.
struct Motion {
    /// Its initial velocity.
    v0: f64,
    samples: Vec<Sample>,
    /// Its conjugate points, in order of time.
    conjugate: Vec<Meeting>,
}

/// A conjugate point, with the position there.
struct Meeting {
    /// The time since the start.
    after: f64,
    q: f64,
    /// The size of the derivative `dq/dv0` there, relative to that of the variation in position and velocity.
    smallest: f64,
}

/// The start of a motion.
fn start(v0: f64) -> VelocityPoint<1> {
    VelocityPoint::new([0.0], [v0], 0.0)
}

/// The conjugate points of the motion with an initial velocity.
fn meetings(v0: f64) -> Result<Vec<Meeting>, Failure> {
    let mut found = Vec::new();
    for point in ContactExponential::new(PENDULUM, RUN.0)?.conjugate_points(0.0, &start(v0))? {
        let q = herglotz_flow(&PENDULUM, 0.0, &start(v0), point.after)?.end.q[0];
        found.push(Meeting { after: point.after, q, smallest: point.smallest });
    }
    Ok(found)
}

/// A motion with its conjugate points.
fn motion(v0: f64) -> Result<Motion, Failure> {
    let (end, count) = RUN;
    let mut samples = vec![Sample { t: 0.0, q: 0.0, slope: 0.0 }];
    for k in 1..=count {
        let t = end * k as f64 / count as f64;
        let to = ContactExponential::new(PENDULUM, t)?.differential(0.0, &start(v0))?;
        samples.push(Sample { t, q: to.image.q1[0], slope: to.v[(0, 0)] });
    }
    Ok(Motion { v0, samples, conjugate: meetings(v0)? })
}

/// The envelope of the motions: its two arms after the first conjugate points, then those after the second.
fn envelope() -> Result<[Vec<(f64, f64)>; 2], Failure> {
    let mut arms = [Vec::new(), Vec::new()];
    for v0 in velocities(ENVELOPE) {
        for (arm, point) in arms.iter_mut().zip(meetings(v0)?) {
            arm.push((point.after, point.q));
        }
    }
    Ok(arms)
}

/// Writes tables and figure; returns a summary as text.
pub fn write(out: &Directory) -> Result<String, Failure> {
    let fan: Vec<Motion> = velocities(FAN).map(motion).collect::<Result<_, _>>()?;
    let points = fan.iter().flat_map(|m| m.conjugate.iter().map(|c| [m.v0, c.after, c.smallest].map(number)));
    out.table("conjugate_points.csv", &["v0", "after", "smallest"], points)?;
    let samples = fan.iter().flat_map(|m| m.samples.iter().map(|s| [m.v0, s.t, s.q, s.slope].map(number)));
    out.table("conjugate_fan.csv", &["v0", "t", "q", "slope"], samples)?;
    out.text("conjugate_points.svg", &draw_row(&[motions(&fan, envelope()?), slopes(&fan)]))?;

    // Small motions are those of the damped oscillator, whose conjugate points are half periods apart.
    let half_period = PI / (1.0 - 0.25 * PENDULUM.gamma * PENDULUM.gamma).sqrt();
    let first = |m: &Motion| m.conjugate.first().map_or(f64::NAN, |c| c.after);
    let rest = fan.get(fan.len() / 2).map_or(f64::NAN, first);
    let (fastest, last) = fan.last().map_or((f64::NAN, f64::NAN), |m| (m.v0, first(m)));
    Ok(format!(
        "first conjugate point: t = {rest:.6} for v0 = 0 ({:.1e} from pi/omega), t = {last:.6} for v0 = {fastest}\n",
        (rest - half_period).abs()
    ))
}

/// The positions of all motions over time, with the envelope.
fn motions(fan: &[Motion], envelope: [Vec<(f64, f64)>; 2]) -> Panel {
    let mut curves: Vec<Curve> =
        fan.iter().map(|m| Curve::unnamed(Line::Solid, m.samples.iter().map(|s| (s.t, s.q)))).collect();
    if let Some(first) = curves.first_mut() {
        first.name = Some("motions".into());
    }
    let [first, second] = envelope;
    curves.push(Curve::new("envelope", Line::Dashed, first));
    curves.push(Curve::unnamed(Line::Dashed, second));
    let points = fan.iter().flat_map(|m| m.conjugate.iter().map(|c| (c.after, c.q)));
    curves.push(Curve::new("conjugate points", Line::Discs, points));
    Panel::new(
        ("time t (dimensionless)", Axis::Linear(0.0, 8.0, 1.0)),
        ("position q (dimensionless)", Axis::Linear(-3.0, 4.0, 1.0)),
        (0.55, 0.98),
        curves,
    )
}

/// The derivative of the position with respect to the initial velocity, for three of the motions.
fn slopes(fan: &[Motion]) -> Panel {
    let mut curves = vec![Curve::unnamed(Line::Dotted, [(0.0, 0.0), (RUN.0, 0.0)])];
    let mut zeros = Vec::new();
    for (k, line) in DRAWN {
        if let Some(m) = fan.get(fan.len() / 2 + k) {
            curves.push(Curve::new(&format!("v0 = {}", m.v0), line, m.samples.iter().map(|s| (s.t, s.slope))));
            zeros.extend(m.conjugate.iter().map(|c| (c.after, 0.0)));
        }
    }
    curves.push(Curve::new("conjugate points", Line::Discs, zeros));
    Panel::new(
        ("time t (dimensionless)", Axis::Linear(0.0, 8.0, 1.0)),
        ("derivative \u{2202}q/\u{2202}v0 (dimensionless)", Axis::Linear(-4.0, 4.0, 1.0)),
        (0.05, 0.4),
        curves,
    )
}
