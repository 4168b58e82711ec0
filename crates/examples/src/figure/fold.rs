//! Angles on an axis of one turn: curves that leave it on one side continue on the other.

use std::f64::consts::{PI, TAU};

/// The maximum number of turns between two points that are joined by a line. A curve with more turns is not resolved by
/// its points, and its lines would fill the figure.
const MAX_TURNS: f64 = 3.0;

/// What a coordinate of a curve is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinate {
    /// A number, which is drawn as it is.
    Number,
    /// An angle, which is reduced to (-pi, pi].
    Angle,
}

/// The turn that contains an angle: 0 for the interval (-pi, pi].
fn turn(angle: f64) -> f64 {
    ((angle - PI) / TAU).ceil()
}

/// The angle reduced to (-pi, pi].
///
/// ```
/// use contact_examples::figure::fold;
/// assert_eq!(fold(1.0), 1.0);
/// assert!((fold(7.0) - (7.0 - std::f64::consts::TAU)).abs() < 1e-15);
/// ```
pub fn fold(angle: f64) -> f64 {
    let folded = angle - TAU * turn(angle);
    // The reduced angle exceeds the edges by rounding only.
    folded.clamp(-PI, PI)
}

/// The pieces of a curve after reduction of its angular coordinates. The curve is cut where one of them changes its
/// turn, and each piece reaches the edge there, so that no line crosses the figure.
pub fn folded(points: &[(f64, f64)], kinds: (Coordinate, Coordinate)) -> Vec<Vec<(f64, f64)>> {
    let turn_of = |x: f64, kind: Coordinate| match kind {
        Coordinate::Angle => turn(x),
        Coordinate::Number => 0.0,
    };
    let turns_of = |(x, y): (f64, f64)| (turn_of(x, kinds.0), turn_of(y, kinds.1));
    let place = |(x, y): (f64, f64), turns: (f64, f64)| {
        let reduced = |x: f64, turn: f64, kind: Coordinate| match kind {
            Coordinate::Angle => (x - TAU * turn).clamp(-PI, PI),
            Coordinate::Number => x,
        };
        (reduced(x, turns.0, kinds.0), reduced(y, turns.1, kinds.1))
    };
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut last: Option<(f64, f64)> = None;
    let mut turns = (f64::NAN, f64::NAN);
    for &point in points {
        let begins = last.map(turns_of);
        let ends = turns_of(point);
        match (last, begins) {
            (Some(from), Some(begins))
                if (ends.0 - begins.0).abs() <= MAX_TURNS && (ends.1 - begins.1).abs() <= MAX_TURNS =>
            {
                let at = |part: f64| (from.0 + part * (point.0 - from.0), from.1 + part * (point.1 - from.1));
                let mut cuts = cuts((from.0, point.0), (begins.0, ends.0));
                cuts.extend(self::cuts((from.1, point.1), (begins.1, ends.1)));
                cuts.sort_by(f64::total_cmp);
                cuts.push(1.0);
                let mut before = 0.0;
                for part in cuts {
                    // A point at an edge belongs to two turns, so the turn is taken between the edges.
                    let between = turns_of(at(0.5 * (before + part)));
                    if between != turns {
                        pieces.push(vec![place(at(before), between)]);
                        turns = between;
                    }
                    let end = if part == 1.0 { point } else { at(part) };
                    pieces.last_mut().into_iter().for_each(|piece| piece.push(place(end, between)));
                    before = part;
                }
            }
            _ => {
                pieces.push(vec![place(point, ends)]);
                turns = ends;
            }
        }
        last = Some(point);
    }
    pieces
}

/// The fractions of the way from one angle to another at which it passes from one turn to the next.
fn cuts((from, to): (f64, f64), (first, last): (f64, f64)) -> Vec<f64> {
    let (low, high) = (first.min(last), first.max(last));
    let count = (high - low) as usize;
    let part = |k: usize| ((2.0 * (low + k as f64) + 1.0) * PI - from) / (to - from);
    (0..count).map(part).filter(|part| *part > 0.0 && *part < 1.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every angle is reduced, angles of the turn 0 are unchanged, and both edges are mapped to the upper one.
    #[test]
    fn angles_are_folded() {
        for k in -1000..=1000 {
            let angle = 0.1 * f64::from(k);
            let found = fold(angle);
            assert!(found > -PI && found <= PI, "{angle}: {found}");
            // The bound is the rounding of angles up to one hundred.
            assert!((found.sin() - angle.sin()).abs() + (found.cos() - angle.cos()).abs() < 1e-13, "{angle}: {found}");
            assert!(angle.abs() > PI || found == angle);
        }
        assert_eq!((fold(PI), fold(-PI), fold(0.0), fold(-1e-300)), (PI, PI, 0.0, -1e-300));
        assert!(fold(f64::NAN).is_nan());
    }

    /// The lines of the pieces have the slope of the curve, and the pieces meet the edges.
    #[test]
    fn curves_are_cut_at_the_edges() {
        let curve =
            |rate: f64| -> Vec<(f64, f64)> { (0..=200).map(|k| 0.1 * f64::from(k)).map(|t| (t, rate * t)).collect() };
        for rate in [0.9, -0.9, 7.0, -7.0, 40.0, PI / 2.0, -10.0 * PI] {
            let points = curve(rate);
            let pieces = folded(&points, (Coordinate::Number, Coordinate::Angle));
            let turns = (rate.abs() * 20.0 / TAU + 0.5).floor() as usize;
            // There is one more piece where the curve ends, or a piece begins, at an edge.
            assert!((turns..=turns + 2).contains(&pieces.len()), "{rate}: {} for {turns}", pieces.len());
            for piece in &pieces {
                assert!(piece.iter().all(|(_, y)| y.abs() <= PI));
                for w in piece.windows(2) {
                    let (width, height) = (w[1].0 - w[0].0, w[1].1 - w[0].1);
                    // The slope is that of the curve.
                    assert!((height - rate * width).abs() < 1e-11 && width < 0.1 + 1e-12, "{rate}: {w:?}");
                }
            }
            for w in pieces.windows(2) {
                let (end, begin) = (w[0][w[0].len() - 1], w[1][0]);
                assert!((end.0 - begin.0).abs() < 1e-12, "{rate}: {end:?} {begin:?}");
                let edge = PI.copysign(rate);
                assert!((end.1 - edge).abs() < 1e-12 && (begin.1 + edge).abs() < 1e-12, "{rate}: {end:?} {begin:?}");
            }
        }
        // If both coordinates are angles, the lines have the slope of the curve everywhere.
        let torus: Vec<(f64, f64)> = curve(1.0).iter().map(|(t, _)| (3.0 * t, -1.7 * t)).collect();
        let pieces = folded(&torus, (Coordinate::Angle, Coordinate::Angle));
        assert!(pieces.len() > 10);
        for w in pieces.iter().flat_map(|piece| piece.windows(2)) {
            assert!((1.7 * (w[1].0 - w[0].0) + 3.0 * (w[1].1 - w[0].1)).abs() < 1e-12, "{w:?}");
        }
        // A curve without angles is not cut, and points that do not resolve the curve are not joined.
        assert_eq!(folded(&torus, (Coordinate::Number, Coordinate::Number)), std::slice::from_ref(&torus));
        assert_eq!(folded(&[(0.0, 0.0), (1.0, 1e300)], (Coordinate::Number, Coordinate::Angle)).len(), 2);
        assert!(folded(&[], (Coordinate::Angle, Coordinate::Angle)).is_empty());
    }
}
