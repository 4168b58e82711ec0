//! Figures of rows: columns against time, and phase portraits.

use contact_examples::figure::{Axis, Coordinate, Curve, Line, Panel, draw, draw_grid, fold, folded};
use herglotz::runtime::{Column, Comparison, Work, velocity_name};
use herglotz::{EndsScene, LatticeScene, Scene};
use std::collections::BTreeSet;

/// The maximal number of points of a curve; more points are not visible.
const MAX_POINTS: usize = 2000;

/// From this number on, the points of a section are drawn as dots, so that they do not cover each other.
const MIN_SECTION_POINTS: usize = 500;

/// The number of panels in a row: three fit the width of a page.
const PANELS_IN_A_ROW: usize = 3;

/// The families of integrators, with the number of integrators of each that are drawn in a comparison.
const FAMILIES: [(&str, usize); 5] =
    [("gauss_", 3), ("transformed_gauss_", 2), ("midpoint_by_", 2), ("rules", 2), ("splittings", 3)];

/// The discrete Lagrangians given by a quadrature rule.
const RULES: [&str; 4] = ["rectangle", "left_midpoint", "midpoint", "trapezoidal"];

/// A run was delayed by other load on the machine if it takes this many times as long as a run with more steps, or as a
/// run with fewer, but at least half as many, steps. Run time is proportional to the number of steps, up to small
/// variations, so that both factors are far outside the usual.
const OUTLIER: (f64, f64) = (2.0, 8.0);

/// The maximal length of an axis label, in characters: as many as fit along an axis.
const MAX_LABEL_LENGTH: usize = 30;

/// A quantity on an axis: its name, and whether it is an angle.
#[derive(Clone, Copy)]
struct Quantity<'q> {
    name: &'q str,
    coordinate: Coordinate,
}

impl<'q> Quantity<'q> {
    /// A column of a scene.
    fn of(scene: &Scene, name: &'q str) -> Self {
        let coordinate = if scene.is_angle(name) { Coordinate::Angle } else { Coordinate::Number };
        Quantity { name, coordinate }
    }

    /// A quantity that is not an angle.
    fn plain(name: &'q str) -> Self {
        Quantity { name, coordinate: Coordinate::Number }
    }
}

/// The figures of rows with their file names: each column against time, each velocity against its coordinate, and the
/// path in the first two coordinates.
pub(crate) fn of_rows(scene: &Scene, rows: &[Vec<f64>]) -> Vec<(String, String)> {
    let columns = scene.columns.iter().map(|(name, column)| (Quantity::of(scene, name), column)).collect();
    of_columns(columns, scene.system.dimension(), rows)
}

/// The same for the points of a path between ends.
pub(crate) fn of_path(scene: &EndsScene, rows: &[Vec<f64>]) -> Vec<(String, String)> {
    let columns = scene.columns.iter().map(|(name, column)| (Quantity::plain(name), column)).collect();
    of_columns(columns, scene.system.dimension(), rows)
}

fn of_columns(columns: Vec<(Quantity<'_>, &Column)>, dimension: usize, rows: &[Vec<f64>]) -> Vec<(String, String)> {
    let position = |is_requested: &dyn Fn(&Column) -> bool| columns.iter().position(|(_, column)| is_requested(column));
    let of_pair = |i: usize, j: usize| panel([columns.get(i)?.0, columns.get(j)?.0], Line::Solid, points(rows, i, j));
    let mut figures = Vec::new();
    if let Some(t) = position(&|column| matches!(column, Column::Time)) {
        let panels: Vec<Panel> = (0..columns.len()).filter(|i| *i != t).filter_map(|i| of_pair(t, i)).collect();
        figures.extend((!panels.is_empty()).then(|| ("columns.svg".to_owned(), grid(&panels))));
    }
    let portraits = (0..dimension).filter_map(|k| {
        let q = position(&|column| matches!(column, Column::Position(i) if *i == k))?;
        let v = position(&|column| matches!(column, Column::Velocity(i) if *i == k));
        // The portrait of a Hamiltonian is that of positions and momenta.
        let v = v.or_else(|| position(&|column| matches!(column, Column::Momentum(i) if *i == k)))?;
        of_pair(q, v)
    });
    let panels: Vec<Panel> = portraits.collect();
    figures.extend((!panels.is_empty()).then(|| ("phase.svg".to_owned(), grid(&panels))));
    let positions: Vec<usize> =
        (0..dimension).filter_map(|k| position(&|column| matches!(column, Column::Position(i) if *i == k))).collect();
    if let [x, y, ..] = positions.as_slice() {
        figures.extend(of_pair(*x, *y).map(|panel| ("path.svg".to_owned(), draw(&panel))));
    }
    figures
}

/// The points of a column j against a column i, as many as a figure resolves.
fn points(rows: &[Vec<f64>], i: usize, j: usize) -> Vec<(f64, f64)> {
    let stride = rows.len().div_ceil(MAX_POINTS).max(1);
    let points = rows.iter().step_by(stride).chain(rows.last());
    points.filter_map(|row| Some((*row.get(i)?, *row.get(j)?))).filter(|(x, y)| (x + y).is_finite()).collect()
}

/// The figure of a section: velocities against coordinates where the first event changes sign.
pub(crate) fn of_section(scene: &Scene, crossings: &[(usize, Vec<f64>)]) -> Option<String> {
    let names = scene.system.formula().coordinates();
    let panels = names.iter().enumerate().filter_map(|(i, name)| {
        let velocity = velocity_name(name);
        let quantities = [Quantity::of(scene, name), Quantity::of(scene, &velocity)];
        // A row has the time, the coordinates and their velocities, in this order.
        let of = |(_, row): &(usize, Vec<f64>)| Some((*row.get(1 + i)?, *row.get(1 + names.len() + i)?));
        let points: Vec<_> = crossings.iter().filter(|(event, _)| *event == 0).filter_map(of).collect();
        let panel = panel(quantities, single(points.len()), points)?;
        let all = || panel.curves.iter().flat_map(|curve| &curve.points);
        let size = |of: fn(&(f64, f64)) -> f64| all().map(|p| of(p).abs()).fold(0.0, f64::max);
        // A section in which the coordinate or the velocity vanishes is not drawn.
        (size(|p| p.0) > 1e-9 && size(|p| p.1) > 1e-9).then_some(panel)
    });
    let panels: Vec<Panel> = panels.collect();
    (!panels.is_empty()).then(|| grid(&panels))
}

/// The figure of one column, which may be an angle, against the swept value, over the members of a sweep.
pub(crate) fn of_sweep(quantity: &str, column: (&str, bool), points: Vec<(f64, f64)>) -> Option<String> {
    let (name, is_angle) = column;
    let coordinate = if is_angle { Coordinate::Angle } else { Coordinate::Number };
    let quantities = [Quantity::plain(quantity), Quantity { name, coordinate }];
    panel(quantities, single(points.len()), points).map(|panel| draw(&panel))
}

/// The style in which a number of single points is drawn.
fn single(count: usize) -> Line {
    if count < MIN_SECTION_POINTS { Line::Discs } else { Line::Dots }
}

/// Panels in a grid; a single panel has no letter.
pub(crate) fn grid(panels: &[Panel]) -> String {
    match panels {
        [one] => draw(one),
        several => draw_grid(several, if several.len() == 4 { 2 } else { several.len().min(PANELS_IN_A_ROW) }),
    }
}

/// The label of an axis.
pub(crate) fn label(name: &str) -> String {
    match name.char_indices().nth(MAX_LABEL_LENGTH) {
        Some((end, _)) => format!("{}...", &name[..end]),
        None => name.to_owned(),
    }
}

/// One curve with axes that fit it; angles are reduced to -pi to pi.
fn panel([x, y]: [Quantity<'_>; 2], line: Line, points: Vec<(f64, f64)>) -> Option<Panel> {
    let (x_label, y_label, kinds) = (label(x.name), label(y.name), (x.coordinate, y.coordinate));
    let axis_of = |kind: Coordinate, of: fn(&(f64, f64)) -> f64| {
        let fitted = axis(points.iter().map(of))?;
        Some(match kind {
            Coordinate::Angle => Axis::Angle,
            Coordinate::Number => fitted,
        })
    };
    let (x, y) = (axis_of(kinds.0, |p| p.0)?, axis_of(kinds.1, |p| p.1)?);
    let curves = match line {
        _ if kinds == (Coordinate::Number, Coordinate::Number) => vec![Curve::unnamed(line, points)],
        // Single points are not joined by lines.
        Line::Discs | Line::Dots => {
            let reduced = |kind: Coordinate, x: f64| if kind == Coordinate::Angle { fold(x) } else { x };
            vec![Curve::unnamed(line, points.iter().map(|p| (reduced(kinds.0, p.0), reduced(kinds.1, p.1))))]
        }
        _ => folded(&points, kinds).into_iter().map(|piece| Curve::unnamed(line, piece)).collect(),
    };
    Some(Panel::new((&x_label, x), (&y_label, y), (0.0, 1.0), curves))
}

/// A linear axis that contains the numbers and extends from tick to tick; `None` without numbers.
pub(crate) fn axis(numbers: impl Iterator<Item = f64>) -> Option<Axis> {
    let (low, high) = numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return None;
    }
    // Variation of the size of round-off is shown as a constant.
    let least = f64::EPSILON * 1e4 * low.abs().max(high.abs());
    let span = if high - low > least { high - low } else { low.abs().max(1e-12) };
    let rough = span / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = power * [1.0, 2.0, 5.0].into_iter().find(|digit| digit * power >= rough).unwrap_or(10.0);
    let middle = 0.5 * (low + high);
    let (low, high) = (low.min(middle - 0.5 * span), high.max(middle + 0.5 * span));
    let rounding = 1e-9;
    Some(Axis::Linear((low / step + rounding).floor() * step, (high / step - rounding).ceil() * step, step))
}

/// The index of the family of an integrator.
fn family(name: &str) -> usize {
    let by_rule = RULES.contains(&name);
    let of = |(family, _): &(&str, usize)| name.starts_with(family) || by_rule && *family == "rules";
    FAMILIES.iter().position(of).unwrap_or(FAMILIES.len() - 1)
}

/// For each family, the names of the integrators that are its fastest for most errors from 1 to 1e-15.
fn best_of_families(rows: &[&Work]) -> Vec<String> {
    let mut chosen = Vec::new();
    for (index, (_, most)) in FAMILIES.iter().enumerate() {
        let of_family = || rows.iter().filter(|row| family(&row.integrator) == index);
        let mut counts: Vec<(&str, usize)> = Vec::new();
        for error in (0..=15).map(|digits| 10f64.powi(-digits)) {
            let reached = of_family().filter(|row| row.error <= error);
            let Some(fastest) = reached.min_by(|a, b| a.seconds.total_cmp(&b.seconds)) else { continue };
            match counts.iter_mut().find(|(known, _)| *known == fastest.integrator) {
                Some((_, count)) => *count += 1,
                None => counts.push((&fastest.integrator, 1)),
            }
        }
        counts.sort_by_key(|(name, count)| (std::cmp::Reverse(*count), *name));
        chosen.extend(counts.into_iter().take(*most).map(|(name, _)| name.to_owned()));
    }
    // Sorted by number, so that gauss_4 precedes gauss_12.
    chosen.sort_by_key(|name| {
        let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let (stem, number) = name.split_at(name.len() - digits);
        (stem.to_owned(), number.parse::<u32>().unwrap_or(0))
    });
    chosen
}

/// The runs that can be drawn, without delayed ones: these say nothing about their integrator and would determine the
/// range of the axis.
fn to_draw(comparison: &Comparison) -> Vec<&Work> {
    let shown = |row: &&Work| row.error > 0.0 && row.error.is_finite() && row.seconds > 0.0;
    let rows: Vec<&Work> = comparison.rows.iter().chain(&comparison.peers).filter(shown).collect();
    let held_up = |row: &Work| {
        rows.iter().filter(|other| other.integrator == row.integrator).any(|other| {
            other.steps > row.steps && row.seconds > OUTLIER.0 * other.seconds
                || other.steps < row.steps && 2 * other.steps >= row.steps && row.seconds > OUTLIER.1 * other.seconds
        })
    };
    rows.iter().copied().filter(|row| !held_up(row)).collect()
}

/// Run time against error, both on logarithmic axes, of the best integrators of each family and of the peers.
pub(crate) fn of_comparison(comparison: &Comparison) -> Option<String> {
    let rows = to_draw(comparison);
    let is_peer = |name: &str| comparison.peers.iter().any(|row| row.integrator == name);
    let (peers, own): (Vec<&Work>, Vec<&Work>) = rows.iter().copied().partition(|row| is_peer(&row.integrator));
    let mut names = best_of_families(&own);
    let own_names = names.len();
    for peer in peers {
        if !names.contains(&peer.integrator) {
            names.push(peer.integrator.clone());
        }
    }
    let shown = || rows.iter().copied().filter(|row| names.contains(&row.integrator));
    let range = |of: &dyn Fn(&Work) -> f64| {
        let powers = shown().map(of).map(f64::log10);
        let (low, high) = powers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        (low <= high).then(|| (low.floor() as i32, (high.ceil() as i32).max(low.floor() as i32 + 1)))
    };
    let (fast, slow) = range(&|row| row.seconds)?;
    let (best, worst) = range(&|row| row.error)?;
    let curve = |(number, name): (usize, &String)| {
        let points = shown().filter(|row| row.integrator == *name).map(|row| (row.seconds, row.error));
        let line = number.checked_sub(own_names).map_or(Line::Coloured(number), Line::Grey);
        Curve::new(name, line, points)
    };
    Some(draw(&Panel::new(
        ("run time (s)", Axis::Logarithmic(fast, slow, 1)),
        ("relative error of (q, p)", Axis::Logarithmic(best, worst, ((worst - best) / 8).max(1) as u32)),
        (1.0, 1.0),
        names.iter().enumerate().map(curve).collect(),
    )))
}

/// The maximal number of curves of a space-time figure; more are too close to be distinguished.
const MAX_PROFILES: usize = 40;

/// The maximal number of points of each of these curves.
const MAX_PROFILE_SITES: usize = 150;

/// The figures of a lattice with their file names: the first component at all sites, as curves at successive times
/// above each other, and the same component at three sites against time. For lattices with several directions, the
/// sites are those along the last direction, in the middle of the others.
pub(crate) fn of_lattice(scene: &LatticeScene, rows: &[Vec<f64>]) -> Vec<(String, String)> {
    let (d, length) = (scene.coordinates.len(), scene.sizes.last().copied().unwrap_or(0));
    let strides = (0..scene.sizes.len()).map(|a| scene.sizes.iter().skip(a + 1).product::<usize>());
    let first: usize = scene
        .sizes
        .iter()
        .zip(strides)
        .take(scene.sizes.len().saturating_sub(1))
        .map(|(size, stride)| size / 2 * stride)
        .sum();
    if scene.has_columns() {
        return of_chosen(&scene.columns(), rows);
    }
    let name = scene.coordinates.first().map_or("x", String::as_str);
    let value = |row: &[f64], i: usize| Some((*row.first()?, *row.get(1 + d * (first + i))?));
    let mut figures = Vec::new();
    let stride = rows.len().div_ceil(MAX_PROFILES).max(1);
    let chosen: Vec<&Vec<f64>> = rows.iter().step_by(stride).collect();
    let sizes = chosen.iter().flat_map(|row| (0..length).filter_map(|i| value(row, i))).map(|(_, x)| x.abs());
    let largest = sizes.fold(0.0, f64::max);
    let times: Vec<f64> = chosen.iter().filter_map(|row| row.first().copied()).collect();
    if let ([start, .., end], true) = (times.as_slice(), largest > 0.0 && largest.is_finite()) {
        // The largest value is drawn 2.5 times as high as the distance of two curves.
        let height = 2.5 * (end - start) / (times.len() - 1) as f64 / largest;
        let every = length.div_ceil(MAX_PROFILE_SITES).max(1);
        let curves: Vec<Curve> = chosen
            .iter()
            .map(|row| {
                let points =
                    (0..length).step_by(every).filter_map(|i| value(row, i).map(|(t, x)| (i as f64, t + height * x)));
                Curve::unnamed(Line::Solid, points)
            })
            .collect();
        let along = axis([0.0, length.saturating_sub(1) as f64].into_iter());
        let across = axis(curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.1)));
        if let (Some(x), Some(y)) = (along, across) {
            let panel = Panel::new(("site", x), (&format!("t, with {name} above it"), y), (0.0, 1.0), curves);
            figures.push(("space-time.svg".to_owned(), draw(&panel)));
        }
    }
    let stride = rows.len().div_ceil(MAX_POINTS).max(1);
    let panels: Vec<Panel> = [0, length / 4, length / 2]
        .into_iter()
        .collect::<BTreeSet<usize>>()
        .into_iter()
        .filter_map(|i| {
            let points = rows.iter().step_by(stride).chain(rows.last()).filter_map(|row| value(row, i)).collect();
            panel([Quantity::plain("t"), Quantity::plain(&format!("{name}[{i}]"))], Line::Solid, points)
        })
        .collect();
    figures.extend((!panels.is_empty()).then(|| ("sites.svg".to_owned(), grid(&panels))));
    figures
}

/// The columns that the scene of a lattice chooses, against time if it is among them.
fn of_chosen(names: &[String], rows: &[Vec<f64>]) -> Vec<(String, String)> {
    let Some(t) = names.iter().position(|name| name == "t") else { return Vec::new() };
    let panels: Vec<Panel> = (0..names.len())
        .filter(|i| *i != t)
        .filter_map(|i| panel([Quantity::plain("t"), Quantity::plain(names.get(i)?)], Line::Solid, points(rows, t, i)))
        .collect();
    if panels.is_empty() { Vec::new() } else { vec![("columns.svg".to_owned(), grid(&panels))] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work(integrator: &str, steps: usize, error: f64, seconds: f64) -> Work {
        Work { integrator: integrator.into(), order: 2, step_size: 0.1, steps, evaluations: 1, error, seconds }
    }

    /// The best integrators of each family are chosen by name, even if those of other families are faster; a delayed
    /// run is left out.
    #[test]
    fn families_and_outliers() {
        let mut rows = Vec::new();
        for stages in 1..=16 {
            for k in 1..=4 {
                let error = f64::powi(0.1, k * stages);
                rows.push(work(&format!("gauss_{stages}"), 8 << k, error, 1e-5 * f64::from(k + stages)));
            }
        }
        for (name, slow) in [("strang", 3.0), ("blanes_moan_6", 1.0), ("rectangle", 80.0), ("midpoint", 10.0)] {
            rows.extend((1..=4).map(|k| work(name, 8 << k, f64::powi(0.1, k), 1e-3 * slow * f64::from(k))));
        }
        rows.push(work("midpoint_by_yoshida_4", 16, 1e-3, 1e-2));
        rows.push(work("strang", 256, 1e-5, 40.0));
        let left_out = Vec::new();
        // Peers are drawn after all others, whatever their names.
        let peers = (1..=3).map(|k| work("dop853", 8 << k, f64::powi(0.01, k), 1e-4 * f64::from(k))).collect();
        let comparison =
            Comparison { rows, peers, reference: String::new(), reference_error: 1e-15, left_out, ended: false };
        let rows = to_draw(&comparison);
        assert_eq!(rows.len() + 1, comparison.rows.len() + 3);
        assert!(rows.iter().all(|row| row.seconds < 1.0));
        let mut names = best_of_families(&rows[..rows.len() - 3]);
        assert_eq!(names.iter().filter(|name| name.starts_with("gauss_")).count(), 3, "{names:?}");
        for name in ["blanes_moan_6", "midpoint", "midpoint_by_yoshida_4"] {
            assert!(names.iter().any(|known| known == name), "{names:?}");
        }
        names.push("dop853".to_owned());
        let figure = of_comparison(&comparison).unwrap_or_default();
        let places: Vec<Option<usize>> = names.iter().map(|name| figure.find(&format!(">{name}<"))).collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{names:?} {places:?}");
    }
}
