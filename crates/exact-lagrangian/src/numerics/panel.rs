//! One panel of a motion: collocation at Gauss points, solved by fixed-point iteration to round-off.

use crate::numerics::gauss::{Gauss, MAX_NODES, PROBES, Probe, collocations};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::max_or_nan;
use contact_geom::{GeometryError, Scalar};

/// The state of a motion `q'' = a`, with two more quantities that are integrated along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State<const N: usize, T = f64> {
    pub q: SVector<T, N>,
    pub v: SVector<T, N>,
    /// The action.
    pub z: T,
    /// For Herglotz' equations `b = int L_z`.
    pub b: T,
}

/// The rates of `v`, `z` and `b` at a state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rate<const N: usize, T = f64> {
    pub a: SVector<T, N>,
    pub z: T,
    pub b: T,
}

impl<const N: usize, T: Scalar> Rate<N, T> {
    pub fn zero() -> Self {
        Rate { a: SVector::from_element(T::zero()), z: T::zero(), b: T::zero() }
    }

    /// The sum of the rates at the nodes with these weights.
    #[inline(always)]
    fn sum(nodes: &[Self], weights: &[f64; MAX_NODES]) -> Self {
        let mut sum = Self::zero();
        for (rate, w) in nodes.iter().zip(weights) {
            for i in 0..N {
                sum.a[i] += rate.a[i] * *w;
            }
            sum.z += rate.z * *w;
            sum.b += rate.b * *w;
        }
        sum
    }
}

/// Equations of motion over the scalar T: the common interface of Herglotz' equations, Chetaev's equations, and the
/// action along a given curve. It is used as a trait object, so that the integration is compiled once for all of them;
/// the cost of a call is small compared with that of the rates.
pub(crate) trait Rates<const N: usize, T> {
    /// The rates at a time and a state.
    ///
    /// # Errors
    /// A [`GeometryError`] where they are not defined.
    fn at(&self, t: f64, x: &State<N, T>) -> Result<Rate<N, T>, GeometryError>;

    /// Whether the Lagrangian jumps between two states, so that the motion cannot be continued from one to the other.
    fn jumps_between(&self, _ends: [(f64, &State<N, T>); 2]) -> bool {
        false
    }
}

/// A solved panel: the velocity at its start, the changes along it, and their error.
pub(crate) struct Panel<const N: usize, T> {
    pub v0: SVector<T, N>,
    pub displacement: SVector<T, N>,
    pub change: Rate<N, T>,
    /// The rates at the end, with which the next panel starts.
    pub last: Rate<N, T>,
    /// The estimated relative error of the end values.
    pub error: f64,
    /// The largest contraction factor of the changes after the second iteration.
    pub contraction: f64,
    /// The number of nodes.
    pub nodes: usize,
    /// The number of iterations with the last number of nodes.
    pub iterations: u32,
}

/// The position at a panel's end, where it is given instead of the velocity at the start.
pub(crate) struct End<'a, const N: usize, T> {
    pub displacement: &'a SVector<T, N>,
    /// The inverse of `dq1/dv0`, or an approximation of it: `1/h` is that of a free motion, and sufficient for short
    /// times.
    pub inverse: &'a SMatrix<f64, N, N>,
    /// The contraction factor above which the iteration is given up, because a better inverse is needed.
    pub max_contraction: f64,
}

/// The reason why a panel could not be solved; a shorter panel may succeed.
pub(crate) enum Refused {
    /// The iteration does not contract.
    Slow,
    /// A value is not finite.
    NonFinite,
    /// The rates are not defined at a node.
    Undefined(GeometryError),
    /// The nodes miss a feature: at this fraction of the panel the rates differ from their polynomial.
    Hidden(f64),
}

/// The smallest positive number, which is the spacing of the numbers below [`f64::MIN_POSITIVE`].
pub(crate) const SMALLEST: f64 = f64::MIN_POSITIVE * f64::EPSILON;

/// The largest number of iterations of a panel; an iteration that needs more counts as not contracting. Twice as many
/// as those above which shorter panels are less expensive (see [`integrate`](crate::numerics::flow::integrate)).
const MAX_ITERATIONS: u32 = 40;

/// The largest absolute value, of the values alone and of the values with their differentials. On duals both must
/// converge; they are kept apart so that neither masks the other.
#[derive(Clone, Copy, Default)]
pub(crate) struct Size(pub [f64; 2]);

impl Size {
    #[inline(always)]
    fn include<T: Scalar>(&mut self, x: T) {
        // Comparisons instead of `f64::max`: an extent is never NaN, and for a plain number it is the modulus.
        let (extent, plain) = (x.extent(), size_of::<T>() == size_of::<f64>());
        let modulus = if plain { extent } else { x.pivot_size() };
        if modulus > self.0[0] {
            self.0[0] = modulus;
        }
        if extent > self.0[1] {
            self.0[1] = extent;
        }
    }

    #[inline]
    pub fn of<'a, T: Scalar>(entries: impl IntoIterator<Item = &'a T>) -> Self {
        let mut size = Size::default();
        entries.into_iter().for_each(|e| size.include(*e));
        size
    }

    /// The larger of the two quotients; infinite where a size is infinite, and 0 where a size does not exceed its
    /// floor, also for 0/0.
    #[inline]
    fn over(self, scale: Size, floor: Size) -> f64 {
        let quotient = |i: usize| match self.0[i] {
            size if size <= floor.0[i] => 0.0,
            size if size.is_finite() => size / scale.0[i],
            _ => f64::INFINITY,
        };
        max_or_nan(quotient(0), quotient(1))
    }

    /// Both sizes times a factor.
    #[inline]
    pub fn times(self, factor: f64) -> Size {
        Size(self.0.map(|s| s * factor))
    }

    /// The larger of each pair of sizes.
    #[inline]
    pub fn or(self, other: Size) -> Size {
        Size([max_or_nan(self.0[0], other.0[0]), max_or_nan(self.0[1], other.0[1])])
    }
}

/// The sizes of the rates a, z and b below which they are negligible: changes of this size are caused by rounding
/// alone, or change no quantity along a panel by a normal number.
#[derive(Clone, Copy, Default)]
pub(crate) struct Floor([Size; 3]);

impl Floor {
    /// Computed from the rates at a state and at the same state with its last digits changed.
    pub fn between<const N: usize, T: Scalar>(one: &Rate<N, T>, other: &Rate<N, T>) -> Self {
        let of = |d: T| Size::of([&d]);
        let a = (0..N).fold(Size::default(), |size, i| size.or(of(one.a[i] - other.a[i])));
        let finite = |s: Size| Size(s.0.map(|e| if e.is_finite() { e } else { 0.0 }));
        Floor([a, of(one.z - other.z), of(one.b - other.b)].map(finite))
    }

    /// The floor, limited to rates that change velocity, action and b by four roundings of these units along a panel.
    /// Where rounding has a larger effect, the motion is not determined by its rounded state.
    pub fn below(self, units: &[Size; 3], h: f64) -> Self {
        let largest = |i: usize, k: usize| 4.0 * f64::EPSILON * units[i].0[k] / h.abs();
        Floor(std::array::from_fn(|i| Size(std::array::from_fn(|k| self.0[i].0[k].min(largest(i, k))))))
    }

    /// The larger of each pair of sizes.
    pub fn or(self, other: Self) -> Self {
        Floor(std::array::from_fn(|i| self.0[i].or(other.0[i])))
    }

    /// The floor times a factor, and at least the rates that change nothing by more than some of the smallest numbers
    /// along a panel of this length.
    #[inline]
    fn over(&self, h: f64, factor: f64) -> [Size; 3] {
        let least = SMALLEST * factor / f64::min(h.abs(), 1.0);
        self.0.map(|s| s.times(factor).or(Size([least; 2])))
    }
}

/// The changes of the rates in one iteration and the scales to compare them with, for velocity, action and b.
#[derive(Default)]
struct IterationChange {
    changes: [Size; 3],
    scales: [Size; 3],
}

impl IterationChange {
    #[inline]
    fn include<const N: usize, T: Scalar>(&mut self, x: &State<N, T>, new: &Rate<N, T>, old: &Rate<N, T>) {
        for i in 0..N {
            self.changes[0].include(new.a[i] - old.a[i]);
            self.scales[0].include(x.v[i]);
        }
        self.changes[1].include(new.z - old.z);
        self.scales[1].include(new.z);
        self.changes[2].include(new.b - old.b);
        self.scales[2].include(new.b);
    }

    /// The largest relative change: that of the velocity relative to the velocity, those of the rates of z and b
    /// relative to the rates.
    #[inline]
    fn max_abs_or_nan(&self, h: f64, floor: &[Size; 3]) -> f64 {
        let over = |i: usize| self.changes[i].over(self.scales[i], floor[i]);
        max_or_nan(max_or_nan(over(0) * h.abs(), over(1)), over(2))
    }
}

/// The problem of a panel, from a state at a time over a duration. If the end is given, the initial velocity is an
/// unknown, and `from.v` is not used.
pub(crate) struct Problem<'a, const N: usize, T> {
    pub t: f64,
    pub h: f64,
    pub from: &'a State<N, T>,
    pub end: Option<End<'a, N, T>>,
    /// The requested relative error, at least half a unit of round-off.
    pub accuracy: f64,
    /// The sizes below which rates are negligible.
    pub floor: Floor,
    /// The length of the panel relative to the whole motion.
    pub part: f64,
    /// Set after repeated refusals: the largest velocity and action of the motion so far, and the unit of b. Few nodes
    /// are then tried, and a jump of the rates is passed where it changes none of these by more than a rounding.
    pub narrow: Option<[Size; 3]>,
}

/// Solves a panel, first with few nodes. As long as they do not resolve the motion, more nodes are used, starting from
/// the solution with fewer. A solution is then compared with the equations between its nodes.
///
/// `v0` is the initial velocity, or a guess that is improved, also if the panel is refused. A panel that the largest
/// number of nodes does not resolve is returned with its error. The evaluations of the rates are counted in
/// `evaluations`.
pub(crate) fn collocate<const N: usize, T: Scalar>(
    rates: &dyn Rates<N, T>,
    problem: &Problem<N, T>,
    guess: Rate<N, T>,
    v0: &mut SVector<T, N>,
    evaluations: &mut u64,
) -> Result<Panel<N, T>, Refused> {
    let mut nodes = [guess; MAX_NODES];
    let mut contraction = 0.0;
    let sizes = if problem.narrow.is_some() { 2 } else { collocations().len() };
    for (k, g) in collocations()[..sizes].iter().enumerate() {
        let largest = k + 1 == sizes;
        let (mut panel, changes) = iterate(rates, problem, g, &mut nodes[..g.s], v0, largest, evaluations)?;
        contraction = max_or_nan(panel.contraction, contraction);
        panel.contraction = contraction;
        if panel.error <= problem.accuracy {
            let start = problem.end.is_none().then_some(&guess);
            panel.last = between_nodes(rates, problem, g, &nodes[..g.s], &panel, &changes, start, evaluations)?;
            return Ok(panel);
        }
        if largest {
            return Ok(panel);
        }
        let coarse = nodes;
        for (node, row) in nodes.iter_mut().zip(&g.refine) {
            *node = Rate::sum(&coarse[..g.s], row);
        }
    }
    Err(Refused::Slow)
}

/// Compares a solution with its equations at the panel's ends and between its nodes, where narrow features may be
/// missed. Returns the rates at the end.
///
/// The number of probes is such that a long motion, which changes its position or its velocity by as much as they are,
/// is checked at [`PROBES`] points or more in total; a motion without any force is checked at
/// [`PROBES_WITHOUT_FORCE`](crate::numerics::gauss::PROBES_WITHOUT_FORCE) points.
#[expect(clippy::too_many_arguments, reason = "the panel, its rates, and what is counted")]
fn between_nodes<const N: usize, T: Scalar>(
    rates: &dyn Rates<N, T>,
    problem: &Problem<N, T>,
    g: &Gauss,
    nodes: &[Rate<N, T>],
    panel: &Panel<N, T>,
    changes: &IterationChange,
    start: Option<&Rate<N, T>>,
    evaluations: &mut u64,
) -> Result<Rate<N, T>, Refused> {
    let Problem { t, h, from, accuracy, .. } = *problem;
    let sizes =
        |r: &Rate<N, T>| [r.a.iter().map(|a| a.pivot_size()).fold(0.0, max_or_nan), r.z.pivot_size(), r.b.pivot_size()];
    let largest_of = |rates: &[Rate<N, T>]| {
        rates.iter().map(sizes).fold([0.0; 3], |m: [f64; 3], e| std::array::from_fn(|i| max_or_nan(m[i], e[i])))
    };
    let (largest, tails) = (largest_of(nodes), largest_of(&g.tail.map(|row| Rate::sum(nodes, &row))));
    let floor = problem.floor.over(h, 64.0);
    let position = from.q.iter().map(|q| q.pivot_size()).fold(0.0, max_or_nan);
    // The defect of a rate that is accepted: the polynomial's own error, and what changes the state by roundings.
    let state = [changes.scales[0].0[0], from.z.pivot_size(), 1.0];
    let allowed: [f64; 3] = std::array::from_fn(|i| {
        let rounding = max_or_nan(1e4 * accuracy * largest[i], 32.0 * accuracy * state[i] / h.abs());
        max_or_nan(16.0 * tails[i], rounding) + floor[i].0[0]
    });
    let defect = |found: &Rate<N, T>, row: &[f64; MAX_NODES]| {
        let continued = Rate::sum(nodes, row);
        Rate { a: found.a - continued.a, z: found.z - continued.z, b: found.b - continued.b }
    };
    let within = |defect: &Rate<N, T>, bounds: &[f64; 3]| sizes(defect).iter().zip(bounds).all(|(m, bound)| m <= bound);
    if let Some(start) = start
        && !within(&defect(start, &g.start), &allowed)
    {
        return Err(Refused::Hidden(0.0));
    }
    let moved = panel.displacement.iter().map(|d| d.pivot_size()).fold(0.0, max_or_nan);
    let without_force = largest[0] == 0.0;
    // For a motion of many panels the change of the velocity also counts: the motion may have come to rest.
    let faster = if problem.part.abs() < 0.5 { largest[0] * h.abs() / state[0] } else { 0.0 };
    let share = if without_force { 1.0 } else { max_or_nan(moved / max_or_nan(position, moved), faster).min(1.0) };
    let probes = if without_force { g.probes.len() } else { PROBES };
    let requested = (probes as f64 * problem.part.abs() * share * share) as usize;
    let count = requested.max(g.s + 2).min(g.probes.len());
    *evaluations += count as u64;
    let (mut last, mut missed) = (None, [Rate::zero(); 2]);
    for Probe { c, weight, value, once, twice } in &g.probes[..count] {
        let Rate { a, z, b } = Rate::sum(nodes, once);
        let aa = Rate::sum(nodes, twice).a;
        let x = State {
            q: SVector::from_fn(|k, _| from.q[k] + (panel.v0[k] * *c + aa[k] * h) * h),
            v: panel.v0 + a * T::from(h),
            z: from.z + z * h,
            b: from.b + b * h,
        };
        let rate = rates.at(t + c * h, &x).map_err(Refused::Undefined)?;
        let apart = defect(&rate, value);
        if !within(&apart, &allowed) {
            return Err(Refused::Hidden(*c));
        }
        for (missed, weight) in missed.iter_mut().zip([*weight, *weight * *c]) {
            missed.a += apart.a * T::from(weight);
            missed.z += apart.z * weight;
            missed.b += apart.b * weight;
        }
        last = last.or(Some(rate));
    }
    // The mean of the polynomial's own error vanishes, up to an order beyond that of the panel, and so does its first
    // moment. Those of a force that is too small to exceed this error, and too fast for the nodes, both vanish only by
    // an unlikely coincidence.
    let mean = std::array::from_fn(|i| 16.0 * accuracy * max_or_nan(largest[i], state[i] / h.abs()) + floor[i].0[0]);
    if !missed.iter().all(|missed| within(missed, &mean)) {
        return Err(Refused::Hidden(0.0));
    }
    Ok(last.unwrap_or(panel.last))
}

/// Solves the collocation equations by fixed-point iteration, from the rates in `nodes` and the velocity `v0`, which
/// are overwritten with the solution.
///
/// Each iteration evaluates the rates node by node, from the latest values. It ends when the next change, predicted
/// from the last two, is below the accuracy, when changes within round-off no longer decrease, or when it is clear that
/// the nodes do not resolve the motion.
fn iterate<const N: usize, T: Scalar>(
    rates: &dyn Rates<N, T>,
    problem: &Problem<N, T>,
    g: &Gauss,
    nodes: &mut [Rate<N, T>],
    v0: &mut SVector<T, N>,
    last: bool,
    evaluations: &mut u64,
) -> Result<(Panel<N, T>, IterationChange), Refused> {
    let Problem { t, h, from, end, accuracy, narrow, .. } = problem;
    let (t, h) = (*t, *h);
    let (nothing, rounding) = (Floor::default().over(h, 1.0), problem.floor.over(h, 16.0));
    let (mut before, mut contraction) = (f64::INFINITY, 0.0f64);
    for iteration in 1..=MAX_ITERATIONS {
        if let Some(End { displacement, inverse, .. }) = end {
            let twice = Rate::sum(nodes, &g.end).a;
            let missed = SVector::<T, N>::from_fn(|i, _| displacement[i] - (v0[i] + twice[i] * h) * h);
            for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                v0[i] += missed[j] * inverse[(i, j)];
            }
        }
        let mut changes = IterationChange::default();
        *evaluations += g.s as u64;
        for i in 0..g.s {
            let (mut once, mut twice) = (Rate::<N, T>::zero(), SVector::<T, N>::from_element(T::zero()));
            for ((rate, a), aa) in nodes.iter().zip(&g.a[i]).zip(&g.aa[i]) {
                for k in 0..N {
                    once.a[k] += rate.a[k] * *a;
                    twice[k] += rate.a[k] * *aa;
                }
                once.z += rate.z * *a;
                once.b += rate.b * *a;
            }
            let x = State {
                q: SVector::from_fn(|k, _| from.q[k] + (v0[k] * g.c[i] + twice[k] * h) * h),
                v: SVector::from_fn(|k, _| v0[k] + once.a[k] * h),
                z: from.z + once.z * h,
                b: from.b + once.b * h,
            };
            let rate = rates.at(t + g.c[i] * h, &x).map_err(Refused::Undefined)?;
            changes.include(&x, &rate, &nodes[i]);
            nodes[i] = rate;
        }
        if let Some([v, z, b]) = narrow {
            let units = [*v, z.times(1.0 / h.abs()), b.times(1.0 / h.abs())];
            changes.scales = std::array::from_fn(|i| changes.scales[i].or(units[i]));
        }
        let change = changes.max_abs_or_nan(h, &nothing);
        if !change.is_finite() {
            // After a first guess of zero rates a scale may be zero; in later iterations the reason is a value that is
            // not finite.
            if iteration > 1 {
                return Err(Refused::NonFinite);
            }
            continue;
        }
        let error = estimate(problem, nodes, &changes, g);
        let ratio = if before.is_finite() { change / before } else { 1.0 };
        let above_noise = change > 1e3 * f64::EPSILON;
        if iteration > 2 && above_noise {
            contraction = contraction.max(ratio);
        }
        // The first ratio involves the change from a guess, and may be far below those that follow.
        let expected = if iteration < 3 { ratio.max(1e-3) } else { ratio };
        let predicted = change * expected <= 0.5 * accuracy;
        // After few iterations a larger change may still decrease.
        let noise = if iteration < 6 { 16.0 } else { 4096.0 } * f64::EPSILON;
        let stagnant =
            before.is_finite() && ratio >= 1.0 && (change <= noise || changes.max_abs_or_nan(h, &rounding) == 0.0);
        let unresolved = !last && error > *accuracy && change <= 0.1 * error.sqrt();
        if predicted || stagnant || unresolved {
            let (mean, twice) = (Rate::sum(nodes, &g.b), Rate::sum(nodes, &g.end).a);
            let displacement = match end {
                Some(end) => *end.displacement,
                None => SVector::from_fn(|i, _| (v0[i] + twice[i] * h) * h),
            };
            let panel = Panel {
                v0: *v0,
                displacement,
                change: Rate { a: mean.a.map(|a| a * h), z: mean.z * h, b: mean.b * h },
                last: nodes[g.s - 1],
                error,
                contraction,
                nodes: g.s,
                iterations: iteration,
            };
            return Ok((panel, changes));
        }
        let max_contraction = end.as_ref().map_or(1.0, |end| end.max_contraction);
        if (ratio >= 1.0 && iteration > 8) || (ratio > max_contraction && iteration > 3 && above_noise) {
            return Err(Refused::Slow);
        }
        before = change;
    }
    Err(Refused::Slow)
}

/// The estimated relative error of the changes over a panel, from the rates at its nodes.
///
/// The interpolation error of the rates has the size of their last Legendre coefficients. The Gauss weights annihilate
/// it up to a product with the corresponding error of the adjoint motion, so that the error is the square of the
/// relative tail; for `v' = c v` this is exactly the error of the Padé approximation, up to the factor `1 / (2s + 1)`
/// that is applied. This holds where the coefficients decrease geometrically, so that the tail is the square of the
/// relative size of the coefficients halfway to it. For a function with a kink they decrease algebraically; the second
/// factor is then the square of their decrease from halfway to the end.
fn estimate<const N: usize, T: Scalar>(
    problem: &Problem<N, T>,
    nodes: &[Rate<N, T>],
    changes: &IterationChange,
    g: &Gauss,
) -> f64 {
    let h = problem.h;
    let floor = problem.floor.over(h, 32.0);
    let [tails, middle] = [&g.tail, &g.middle].map(|rows| {
        let [one, two] = (*rows).map(|row| Rate::sum(nodes, &row));
        [Size::of(one.a.iter().chain(two.a.iter())), Size::of([&one.z, &two.z]), Size::of([&one.b, &two.b])]
    });
    let accelerations = Size::of(nodes.iter().flat_map(|r| r.a.iter()));
    let scales = [accelerations, changes.scales[1], changes.scales[2]];
    let relative: [f64; 3] = std::array::from_fn(|i| {
        let tail = tails[i].over(scales[i], floor[i]);
        let fall = tails[i].over(middle[i], floor[i]);
        // Below some roundings the coefficients do not decrease.
        if tail <= 64.0 * f64::EPSILON { tail * tail } else { tail * max_or_nan(tail, (fall * fall).min(1.0)) }
    });
    let velocity = match relative[0] {
        0.0 => 0.0,
        tail => tail * accelerations.over(changes.scales[0], Size::default()) * h.abs(),
    };
    max_or_nan(max_or_nan(velocity, relative[1]), relative[2]) / (2 * g.s + 1) as f64
}
