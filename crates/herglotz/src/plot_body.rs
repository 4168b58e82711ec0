//! Figures of rigid bodies: the polhode, and the path of a point of the body.

use crate::plot::{axis, grid};
use contact_examples::figure::{Axis, Curve, Line, Panel};
use herglotz::runtime::Body;
use std::f64::consts::TAU;

/// The maximal number of points of a curve; more points are not visible.
const MAX_POINTS: usize = 4000;

/// The number of points of an outline.
const OUTLINE: usize = 360;

/// The figures of the rows of a rigid body with their file names: `polhode.svg`, the direction of the body momentum on
/// the unit sphere, seen along the axis of which it is nearest at the start, with its size against time; and `path.svg`,
/// the path of the centre of mass (or of the third axis) from above, and its height against time.
pub(crate) fn of_body(body: &Body, rows: &[Vec<f64>]) -> Vec<(&'static str, String)> {
    let stride = rows.len().div_ceil(MAX_POINTS).max(1);
    let of = |name: &str| -> Option<Vec<f64>> {
        let k = Body::COLUMNS.iter().position(|known| *known == name)?;
        rows.iter().step_by(stride).map(|row| row.get(k).copied()).collect()
    };
    let polhode = || {
        let t = of("t")?;
        let momentum = [of("Pi1")?, of("Pi2")?, of("Pi3")?];
        let [a, b, c] = &momentum;
        let vectors: Vec<[f64; 3]> = a.iter().zip(b).zip(c).map(|((x, y), z)| [*x, *y, *z]).collect();
        let size = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A body at rest has no direction.
        let unit: Vec<[f64; 3]> = vectors.iter().filter(|v| size(v) > 0.0).map(|v| v.map(|x| x / size(v))).collect();
        // Seen from outside along the axis in whose hemisphere most of the curve is.
        let mean = unit.iter().fold([0.0; 3], |m, v| [m[0] + v[0], m[1] + v[1], m[2] + v[2]]);
        let view = (0..3).max_by(|i, j| mean_of(&mean, *i).total_cmp(&mean_of(&mean, *j)))?;
        // Right-handed about the axis of view.
        let (i, j) = ((view + 1) % 3, (view + 2) % 3);
        let place = |v: &[f64; 3]| Some((*v.get(i)?, *v.get(j)?));
        let side = mean.get(view)?.signum();
        let outline = (0..=OUTLINE).map(|k| TAU * k as f64 / OUTLINE as f64).map(|a| (a.cos(), a.sin()));
        let mut curves = vec![Curve::unnamed(Line::Dotted, outline)];
        for (pieces, line) in [
            (pieces(&unit, |v| at(v, view) * side >= 0.0), Line::Solid),
            (pieces(&unit, |v| at(v, view) * side < 0.0), Line::Dashed),
        ] {
            curves.extend(pieces.into_iter().map(|piece| Curve::unnamed(line, piece.iter().filter_map(place))));
        }
        let name = |k: usize| format!("Pi{}/|Pi|", k + 1);
        let sphere = Panel {
            equal_scales: true,
            marks: unit.first().and_then(place).into_iter().collect(),
            ..Panel::new(
                (&name(i), Axis::Linear(-1.2, 1.2, 0.4)),
                (&name(j), Axis::Linear(-1.2, 1.2, 0.4)),
                (0.0, 1.0),
                curves,
            )
        };
        let sizes: Vec<(f64, f64)> = t.iter().copied().zip(vectors.iter().map(size)).collect();
        let against = against_time("|Pi|", sizes, true)?;
        Some(("polhode.svg", grid(&[sphere, against])))
    };
    let path = || {
        let (t, x, y, z) = (of("t")?, of("tip_x")?, of("tip_y")?, of("tip_z")?);
        let plane: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
        let length = body.tip().iter().map(|x| x * x).sum::<f64>().sqrt();
        let outline: Vec<(f64, f64)> = (0..=OUTLINE)
            .map(|k| TAU * k as f64 / OUTLINE as f64)
            .map(|a| (length * a.cos(), length * a.sin()))
            .collect();
        let fitted = axis(outline.iter().map(|p| p.0))?;
        let above = Panel {
            equal_scales: true,
            marks: plane.first().copied().into_iter().collect(),
            ..Panel::new(
                ("tip_x", fitted),
                ("tip_y", fitted),
                (0.0, 1.0),
                vec![Curve::unnamed(Line::Dotted, outline), Curve::unnamed(Line::Solid, plane.iter().copied())],
            )
        };
        let height = against_time("tip_z", t.into_iter().zip(z).collect(), false)?;
        Some(("path.svg", grid(&[above, height])))
    };
    polhode().into_iter().chain(path()).collect()
}

fn at(v: &[f64; 3], k: usize) -> f64 {
    v.get(k).copied().unwrap_or(f64::NAN)
}

fn mean_of(mean: &[f64; 3], k: usize) -> f64 {
    at(mean, k).abs()
}

/// The pieces of a curve on one side.
fn pieces(points: &[[f64; 3]], shown: impl Fn(&[f64; 3]) -> bool) -> Vec<Vec<[f64; 3]>> {
    let runs = points.split(|v| !shown(v)).filter(|piece| !piece.is_empty());
    runs.map(<[_]>::to_vec).collect()
}

/// A quantity against time; from zero on, if it is a size.
fn against_time(name: &str, points: Vec<(f64, f64)>, from_zero: bool) -> Option<Panel> {
    let x = axis(points.iter().map(|p| p.0))?;
    let y = axis(points.iter().map(|p| p.1).chain(from_zero.then_some(0.0)))?;
    let curves = vec![Curve::unnamed(Line::Solid, points)];
    Some(Panel::new(("t", x), (name, y), (0.0, 1.0), curves))
}
