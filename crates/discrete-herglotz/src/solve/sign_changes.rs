//! All sign changes of a function on an interval.
//!
//! The interval is divided until the Chebyshev interpolant of the function on each part proves that the function has no
//! zero there, is monotone, or has a single extremum. Points between which there is at most one sign change follow.

use crate::solve::chebyshev::{Chebyshev, MAX_DEGREE, Samples, node};
use crate::solve::roots::bracketed_root_within;
use std::convert::Infallible;

/// The error of an interpolant, relative to the size of the function on the whole interval, up to which it is taken for
/// the function. What is smaller is beyond the accuracy of the interpolated motion in most steps.
const MAX_ERROR: f64 = 1e-8;

/// The number of bisections of the interval: parts of 1e-6 of it. Smooth functions need a few; functions with a kink or
/// a jump are bisected to this width, where two sign changes at the same kink can no longer be told apart.
const MAX_BISECTIONS: i32 = 20;

/// The largest number of parts that are examined. A kink or a jump takes about 40, an oscillation about ten a period; a
/// function that needs more is evaluated so often that shorter steps cost less.
const MAX_PARTS: usize = 1024;

/// The size of a function in one of the shortest parts, relative to its size on the whole interval, below which it is
/// on its surface there. A smooth function is of this size in a part with a zero, and so is the noise of functions in
/// single precision.
const NEGLIGIBLE: f64 = 1e-5;

/// The relative variation of a function in a part without a zero, up to which its smallest value at a node is taken for
/// its minimum.
const SMALL_VARIATION: f64 = 0.1;

/// The number of changes of direction in one of the shortest parts, up to which a function is taken to have a single
/// kink, with one change, or a single jump between two slopes, with two. The values of an oscillation change more
/// often.
const MAX_DIRECTION_CHANGES: usize = 2;

/// The tolerance of the place of an extremum, as a fraction of its part: the value there has the square of it as error.
const EXTREMUM_TOLERANCE: f64 = 1e-8;

/// What is large and what is small for a function.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// Its size on the interval.
    pub size: f64,
    /// The value below which an extremum of one sign may in truth have the other one, and is among the points.
    pub near: f64,
    /// The effect of round-off on its values: the sign of a smaller value is meaningless.
    pub noise: f64,
}

/// A point between sign changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Separator {
    /// The fraction of the interval.
    pub fraction: f64,
    /// The value of the function.
    pub value: f64,
    /// Whether it is an extremum close to zero, between points of the same sign.
    pub is_touch: bool,
    kept: bool,
}

impl Separator {
    fn new(fraction: f64, value: f64) -> Self {
        Separator { fraction, value, is_touch: false, kept: false }
    }
}

/// How far a search came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Separation {
    /// All sign changes of the interval are separated.
    Complete,
    /// Those before this fraction are separated. After it, the function varies too fast.
    Unresolved(f64),
    /// Those before the last point are separated. There the function is not finite.
    Undefined,
}

/// The verdict on a part of the interval.
enum Verdict {
    /// It has at most one sign change.
    Separated,
    /// It has at most one sign change before this fraction of the part, and at most one after it.
    SeparatedAt(f64),
    /// Neither is proven.
    Open,
}

/// The points that separate the sign changes of a function g on `[0, 1]`: there is at most one sign change between 0
/// and the first point, between two neighbours, and between the last point and 1. Extrema close to zero are points too.
/// There are no points if g has no more than one sign change, and no such extremum.
///
/// `first` has values of g at the nodes of the interval.
pub(crate) fn separate(
    first: &Samples,
    scale: Scale,
    mut g: impl FnMut(f64) -> f64,
    points: &mut Vec<Separator>,
) -> Separation {
    points.clear();
    points.push(Separator::new(0.0, first.ends()[0]));
    let separation = parts(first, scale, &mut g, points);
    select(points, scale, separation == Separation::Complete);
    separation
}

/// Whether a function has no zero, and its absolute value exceeds a margin: the proof for the usual case, by the values
/// at the nodes alone.
pub(crate) fn has_no_zero(samples: &Samples, margin: f64) -> bool {
    samples.interpolant().exceeds(margin)
}

/// Whether an interpolant is taken for its function.
pub(crate) fn resolves(interpolant: &Chebyshev, scale: Scale) -> bool {
    interpolant.error <= MAX_ERROR * scale.size + MAX_DEGREE as f64 * scale.noise
}

/// Examines the parts of the interval in order, and appends the ends of those with at most one sign change, and their
/// extrema.
fn parts(first: &Samples, scale: Scale, g: &mut impl FnMut(f64) -> f64, points: &mut Vec<Separator>) -> Separation {
    // The parts that are left, the first of them last: at most one from each bisection.
    let (mut left, mut count) = ([[0.0, 1.0]; MAX_BISECTIONS as usize + 1], 1);
    let mut known = Some(*first);
    for _ in 0..MAX_PARTS {
        if count == 0 {
            return Separation::Complete;
        }
        count -= 1;
        let [a, b] = left[count];
        let samples = known.take().unwrap_or_else(|| Samples::on([a, b], MAX_DEGREE, &mut *g));
        let place = |fraction: f64| a + fraction * (b - a);
        let undefined = samples.values().iter().position(|value| !value.is_finite());
        let verdict = if undefined.is_some() { Verdict::Open } else { verdict(&samples, scale) };
        let is_shortest = b - a <= f64::powi(2.0, -MAX_BISECTIONS);
        let extremum = match verdict {
            Verdict::Separated => None,
            Verdict::SeparatedAt(extremum) => Some(place(extremum)),
            Verdict::Open if samples.degree() < MAX_DEGREE => {
                count += 1;
                continue;
            }
            Verdict::Open if !is_shortest => {
                let middle = 0.5 * (a + b);
                (left[count], left[count + 1]) = ([middle, b], [a, middle]);
                count += 2;
                continue;
            }
            Verdict::Open => {
                if let Some(j) = undefined {
                    for j in [j.saturating_sub(1), j] {
                        points.push(Separator::new(place(node(MAX_DEGREE, j)), samples.values()[j]));
                    }
                    return Separation::Undefined;
                }
                if !is_simple(&samples) && samples.size() > NEGLIGIBLE * scale.size + scale.noise {
                    return Separation::Unresolved(a);
                }
                Some(place(node(MAX_DEGREE, samples.smallest())))
            }
        };
        if let Some(extremum) = extremum.filter(|x| (a < *x) && (*x < b)) {
            points.push(Separator::new(extremum, g(extremum)));
        }
        points.push(Separator::new(b, samples.ends()[1]));
    }
    match count {
        0 => Separation::Complete,
        _ => Separation::Unresolved(left[count - 1][0]),
    }
}

/// What the interpolant proves on a part.
fn verdict(samples: &Samples, scale: Scale) -> Verdict {
    let g = samples.interpolant();
    if g.exceeds(scale.near) {
        return Verdict::Separated;
    }
    if g.is_nearly_constant(SMALL_VARIATION) {
        return Verdict::SeparatedAt(node(samples.degree(), samples.smallest()));
    }
    if !resolves(&g, scale) {
        return Verdict::Open;
    }
    let slope = g.derivative();
    if slope.exceeds(0.0) {
        return Verdict::Separated;
    }
    if slope.derivative().exceeds(0.0) {
        return extremum(&slope);
    }
    // Zero up to round-off, as a quantity that is conserved.
    if samples.size() <= scale.noise { Verdict::Separated } else { Verdict::Open }
}

/// The verdict on a part where the slope is monotone.
fn extremum(slope: &Chebyshev) -> Verdict {
    let ends = [slope.at(0.0), slope.at(1.0)];
    if ends[0] * ends[1] >= 0.0 {
        return Verdict::Separated;
    }
    match bracketed_root_within(EXTREMUM_TOLERANCE, [0.0, 1.0], ends, |x| Ok::<_, Infallible>(slope.at(x))) {
        Ok(extremum) => Verdict::SeparatedAt(extremum),
    }
}

/// Whether the values in one of the shortest parts are those of a function with a single kink or a jump: they change
/// their sign at most once, and their direction at most twice.
fn is_simple(samples: &Samples) -> bool {
    let values = samples.values();
    let directions = values.windows(2).map(|pair| pair[1] - pair[0]);
    count_changes(values.iter().copied()) <= 1 && count_changes(directions) <= MAX_DIRECTION_CHANGES
}

/// The number of sign changes of a sequence, without its zeros.
fn count_changes(of: impl Iterator<Item = f64>) -> usize {
    let (mut last, mut count) = (0.0, 0);
    for x in of.filter(|x| *x != 0.0) {
        count += usize::from((x < 0.0 && last > 0.0) || (x > 0.0 && last < 0.0));
        last = x;
    }
    count
}

/// Keeps the points that are needed: the one with the largest value among neighbours of the same sign, except where an
/// end of the interval is among these, and the extrema close to zero.
fn select(points: &mut Vec<Separator>, scale: Scale, to_end: bool) {
    let has_sign = |value: f64| value.abs() > scale.noise;
    let last = points.len() - 1;
    let (mut largest, mut with_start): (Option<usize>, bool) = (None, points[0].value.abs() > scale.noise);
    for i in 0..=last {
        let value = points[i].value;
        if !has_sign(value) {
            continue;
        }
        match largest {
            Some(j) if same_sign(points[j].value, value) => {
                if value.abs() > points[j].value.abs() {
                    largest = Some(i);
                }
            }
            Some(j) => {
                points[j].kept = !with_start;
                (largest, with_start) = (Some(i), false);
            }
            None => largest = Some(i),
        }
    }
    if let Some(j) = largest {
        points[j].kept = !(with_start || to_end && has_sign(points[last].value));
    }
    for i in 1..last {
        let [before, value, after] = [i - 1, i, i + 1].map(|i| points[i].value);
        // Written so that a NaN is no extremum.
        let is_touch =
            same_sign(before, after) && value.abs() < scale.near && value / before <= 1.0 && value / after < 1.0;
        points[i].is_touch = is_touch;
        points[i].kept |= is_touch;
    }
    if let Some(end) = points.last_mut() {
        end.kept |= !end.value.is_finite();
    }
    points.retain(|point| point.kept && point.fraction > 0.0 && point.fraction < 1.0);
}

/// Whether two numbers have opposite signs; a product of them might underflow.
pub(crate) fn opposite_signs(a: f64, b: f64) -> bool {
    (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0)
}

/// Whether two numbers have the same sign, and neither is zero.
fn same_sign(a: f64, b: f64) -> bool {
    (a < 0.0 && b < 0.0) || (a > 0.0 && b > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sign changes of a function, each by bisection between the points that separate them; the number of
    /// evaluations.
    fn roots(degree: usize, g: &dyn Fn(f64) -> f64) -> (Separation, Vec<f64>, usize) {
        let (first, mut count, mut points) = (Samples::on([0.0, 1.0], degree, g), 0, Vec::new());
        let scale = Scale { size: first.size(), near: 0.0, noise: 0.0 };
        let counted = |x: f64| {
            count += 1;
            g(x)
        };
        let separation = separate(&first, scale, counted, &mut points);
        let places: Vec<f64> =
            [0.0].into_iter().chain(points.iter().map(|point| point.fraction)).chain([1.0]).collect();
        let between = |pair: &[f64]| {
            let ([a, b], values) = ([pair[0], pair[1]], [g(pair[0]), g(pair[1])]);
            let changes = opposite_signs(values[0], values[1]);
            changes.then(|| bracketed_root_within(1e-12, [a, b], values, |x| Ok::<_, Infallible>(g(x))).unwrap_or(2.0))
        };
        (separation, places.windows(2).filter_map(between).collect(), count)
    }

    fn assert_roots(degree: usize, g: &dyn Fn(f64) -> f64, expected: &[f64]) {
        let (separation, found, count) = roots(degree, g);
        assert_eq!((separation, found.len()), (Separation::Complete, expected.len()), "{degree}: {found:?}, {count}");
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() <= 1e-9, "{degree}: {found:?}, not {expected:?}");
        }
    }

    #[test]
    fn all_sign_changes_are_separated() {
        for degree in 3..=MAX_DEGREE {
            assert_roots(degree, &|x| x + 1.0, &[]);
            assert_roots(degree, &|x| (x - 0.2) * (x - 0.21) * (x - 0.9), &[0.2, 0.21, 0.9]);
            assert_roots(degree, &|x| (x - 0.43).powi(2) - 1e-8, &[0.4299, 0.4301]);
            assert_roots(degree, &|x| (x - 0.5).powi(4) - 1e-16, &[0.4999, 0.5001]);
            assert_roots(degree, &|x| (x - 0.43).powi(2) + 1e-8, &[]);
            assert_roots(degree, &|x| (x - 0.43).powi(3), &[0.43]);
            assert_roots(degree, &|x| (x - 0.3).abs() - 1e-4, &[0.2999, 0.3001]);
            assert_roots(degree, &|x| if x < 0.37 { 1.0 } else { -3.0 }, &[0.37]);
            let waves: Vec<f64> = (0..20).map(|k| (f64::from(k) + 0.5) / 20.0).collect();
            assert_roots(degree, &|x| (20.0 * std::f64::consts::PI * x).cos(), &waves);
            assert!(matches!(roots(degree, &|x| (1e7 * x).sin() + 0.1).0, Separation::Unresolved(_)));
            // Faster and faster towards a point; five values are by chance those of a function without a zero.
            let place = roots(degree, &|x| (10.0 * (x - 0.3).abs().ln()).sin() + 0.5).0;
            let is_near = |x: f64| (x - 0.3).abs() <= 16.0 * f64::powi(2.0, -MAX_BISECTIONS);
            assert!(degree == 4 || matches!(place, Separation::Unresolved(x) if is_near(x)), "{degree}: {place:?}");
            assert_eq!(roots(degree, &|x| if x < 0.7 { 0.3 - x } else { f64::NAN }).0, Separation::Undefined);
        }
    }

    /// A smooth function is examined at the nodes of the first interval, or once more.
    #[test]
    fn simple_sign_changes_take_few_evaluations() {
        let count = |degree, g: &dyn Fn(f64) -> f64| roots(degree, g).2;
        assert_eq!([count(10, &|x| x - 0.3), count(10, &|x| x.exp() - 1.2), count(10, &|x| x * x + 1.0)], [0; 3]);
        // A parabola takes its extremum.
        assert_eq!(count(10, &|x| (x - 0.3) * (x - 0.4)), 1);
        let waves = count(10, &|x| (9.0 * x).cos() + 0.5);
        assert!(waves <= 15 * (MAX_DEGREE + 2), "{waves}");
        // The search of a function that is not resolved is bounded.
        assert!(count(10, &|x| (1e7 * x).sin()) <= MAX_PARTS * (MAX_DEGREE + 2));
    }
}
