//! One panel of a motion: collocation at Gauss points, solved by iteration to round-off.

use crate::gauss::{Gauss, MOST, collocations};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{GeometryError, Scalar};

/// The state of a motion `q'' = a`, with two more quantities that grow along it.
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

    /// The sum of the nodes' rates with these weights.
    #[inline(always)]
    fn sum(nodes: &[Self], weights: &[f64; MOST]) -> Self {
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

/// The equations of a motion: what Herglotz' equations, Chetaev's, and the action along a given curve have in common.
pub(crate) trait Rates<const N: usize> {
    /// The rates at a time and a state.
    ///
    /// # Errors
    /// A [`GeometryError`] where they are not defined.
    fn at<T: Scalar>(&self, t: f64, x: &State<N, T>) -> Result<Rate<N, T>, GeometryError>;
}

/// A panel that has been solved: the velocity at its start, what changes along it, and how exactly.
pub(crate) struct Panel<const N: usize, T> {
    pub v0: SVector<T, N>,
    pub displacement: SVector<T, N>,
    pub change: Rate<N, T>,
    /// The rates at the last node, a guess for the next panel.
    pub last: Rate<N, T>,
    /// The estimated relative error of the end values.
    pub error: f64,
    /// The largest factor by which a sweep after the second reduced the changes.
    pub contraction: f64,
    /// The number of nodes.
    pub nodes: usize,
    /// The sweeps that were made with the last number of nodes.
    pub sweeps: u32,
    /// The evaluations of the rates.
    pub evaluations: u32,
}

/// The position at a panel's end, where it is given instead of the velocity at the start.
pub(crate) struct End<'a, const N: usize, T> {
    pub displacement: &'a SVector<T, N>,
    /// The inverse of `dq1/dv0`, or what is known of it: `1/h` is that of a free motion, and good enough in a short time.
    pub inverse: &'a SMatrix<f64, N, N>,
    /// The factor of contraction above which the iteration is given up, for want of a better inverse.
    pub patience: f64,
}

/// Why a panel could not be solved; a shorter one may be.
pub(crate) enum Refused {
    /// The iteration does not contract.
    Slow,
    /// A value is not finite.
    NonFinite,
    /// The rates are not defined at a node.
    Undefined(GeometryError),
}

/// The sweeps after which an iteration counts as not contracting.
const SWEEPS: u32 = 40;

/// The largest size, of the values alone and of the values with their differentials: over duals both must converge, and
/// neither may hide behind the other.
#[derive(Clone, Copy, Default)]
struct Size([f64; 2]);

impl Size {
    #[inline(always)]
    fn see<T: Scalar>(&mut self, x: T) {
        // Comparisons rather than `f64::max`: an extent is no NaN, and of a plain number it is the modulus.
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
    fn of<'a, T: Scalar>(entries: impl IntoIterator<Item = &'a T>) -> Self {
        let mut size = Size::default();
        entries.into_iter().for_each(|e| size.see(*e));
        size
    }

    /// The larger of the two quotients; 0 for 0/0, infinite where a size is.
    #[inline]
    fn over(self, scale: Size) -> f64 {
        let quotient = |i: usize| match self.0[i] {
            0.0 => 0.0,
            size if size.is_finite() => size / scale.0[i],
            _ => f64::INFINITY,
        };
        quotient(0).max(quotient(1))
    }
}

/// Changes of a sweep and the scales to compare them with, for velocity, action and b.
#[derive(Default)]
struct Sweep {
    changes: [Size; 3],
    scales: [Size; 3],
}

impl Sweep {
    #[inline]
    fn see<const N: usize, T: Scalar>(&mut self, x: &State<N, T>, new: &Rate<N, T>, old: &Rate<N, T>) {
        for i in 0..N {
            self.changes[0].see(new.a[i] - old.a[i]);
            self.scales[0].see(x.v[i]);
        }
        self.changes[1].see(new.z - old.z);
        self.scales[1].see(new.z);
        self.changes[2].see(new.b - old.b);
        self.scales[2].see(new.b);
    }

    /// The largest relative change: of the velocity in units of the velocity, of the rates of z and b in units of them.
    fn largest(&self, h: f64) -> f64 {
        let velocity = self.changes[0].over(self.scales[0]) * h.abs();
        velocity.max(self.changes[1].over(self.scales[1])).max(self.changes[2].over(self.scales[2]))
    }
}

/// A panel from a state at a time over a duration; where the end is given, the initial velocity is an unknown, and `from.v` not read.
pub(crate) struct Problem<'a, const N: usize, T> {
    pub t: f64,
    pub h: f64,
    pub from: &'a State<N, T>,
    pub end: Option<End<'a, N, T>>,
    /// The relative error that is wanted; half a unit of round-off at least.
    pub accuracy: f64,
}

/// Solves a panel, first with few nodes; with more, from where these have led, as long as they do not resolve the motion.
///
/// `v0` is the initial velocity, or a guess of it that is improved upon, also if the panel is refused. A panel that the most nodes
/// do not resolve is returned with its error.
pub(crate) fn collocate<const N: usize, T: Scalar>(
    rates: &impl Rates<N>,
    problem: &Problem<N, T>,
    guess: Rate<N, T>,
    v0: &mut SVector<T, N>,
) -> Result<Panel<N, T>, Refused> {
    let mut nodes = [guess; MOST];
    let (mut evaluations, mut contraction) = (0, 0.0);
    for g in collocations() {
        let largest = g.s == MOST;
        let panel = sweeps(rates, problem, g, &mut nodes[..g.s], v0, largest)?;
        evaluations += panel.evaluations;
        contraction = panel.contraction.max(contraction);
        if panel.error <= problem.accuracy || largest {
            return Ok(Panel { evaluations, contraction, ..panel });
        }
        let coarse = nodes;
        for (node, row) in nodes.iter_mut().zip(&g.refine) {
            *node = Rate::sum(&coarse[..g.s], row);
        }
    }
    Err(Refused::Slow)
}

/// Solves the collocation equations by iteration, from the rates in `nodes` and the velocity `v0`, and leaves the solution
/// there.
///
/// A sweep evaluates the rates node by node, each from the latest. The iteration ends when the next change, predicted from
/// the last two, is below the accuracy, when changes within round-off no longer fall, or when it is clear that the nodes do
/// not resolve the motion.
fn sweeps<const N: usize, T: Scalar>(
    rates: &impl Rates<N>,
    problem: &Problem<N, T>,
    g: &Gauss,
    nodes: &mut [Rate<N, T>],
    v0: &mut SVector<T, N>,
    last: bool,
) -> Result<Panel<N, T>, Refused> {
    let Problem { t, h, from, end, accuracy } = problem;
    let (t, h) = (*t, *h);
    let (mut before, mut contraction) = (f64::INFINITY, 0.0f64);
    for sweep in 1..=SWEEPS {
        if let Some(End { displacement, inverse, .. }) = end {
            let twice = Rate::sum(nodes, &g.end).a;
            let missed = SVector::<T, N>::from_fn(|i, _| displacement[i] - (v0[i] + twice[i] * h) * h);
            for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                v0[i] += missed[j] * inverse[(i, j)];
            }
        }
        let mut seen = Sweep::default();
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
            seen.see(&x, &rate, &nodes[i]);
            nodes[i] = rate;
        }
        let change = seen.largest(h);
        if !change.is_finite() {
            // After a first guess of zero rates a scale may be zero; one sweep later a value is not a number.
            if sweep > 1 {
                return Err(Refused::NonFinite);
            }
            continue;
        }
        let error = estimate(nodes, &seen, h, g);
        let ratio = if before.is_finite() { change / before } else { 1.0 };
        let above_noise = change > 1e3 * f64::EPSILON;
        if sweep > 2 && above_noise {
            contraction = contraction.max(ratio);
        }
        // The first ratio compares with the change from a guess, and may be far below those that follow.
        let expected = if sweep < 3 { ratio.max(1e-3) } else { ratio };
        let predicted = change * expected <= 0.5 * accuracy;
        // After few sweeps a larger change may still be one that is on its way.
        let noise = if sweep < 6 { 16.0 } else { 4096.0 } * f64::EPSILON;
        let stagnant = before.is_finite() && ratio >= 1.0 && change <= noise;
        let unresolved = !last && error > *accuracy && change <= 0.1 * error.sqrt();
        if predicted || stagnant || unresolved {
            let (mean, twice) = (Rate::sum(nodes, &g.b), Rate::sum(nodes, &g.end).a);
            let displacement = match end {
                Some(end) => *end.displacement,
                None => SVector::from_fn(|i, _| (v0[i] + twice[i] * h) * h),
            };
            return Ok(Panel {
                v0: *v0,
                displacement,
                change: Rate { a: mean.a.map(|a| a * h), z: mean.z * h, b: mean.b * h },
                last: nodes[g.s - 1],
                error,
                contraction,
                nodes: g.s,
                sweeps: sweep,
                evaluations: sweep * g.s as u32,
            });
        }
        let patience = end.as_ref().map_or(1.0, |end| end.patience);
        if (ratio >= 1.0 && sweep > 8) || (ratio > patience && sweep > 3 && above_noise) {
            return Err(Refused::Slow);
        }
        before = change;
    }
    Err(Refused::Slow)
}

/// The estimated relative error of the changes over a panel, from the rates at its nodes.
///
/// The interpolation of the rates misses a part of the size of their last Legendre coefficients; Gauss' weights annihilate
/// it up to a product with the like part of the adjoint motion. So the error is the square of the relative tail; for
/// `v' = c v` this is exactly the error of the Padé approximation, up to the factor `1 / (2s + 1)` that is applied.
fn estimate<const N: usize, T: Scalar>(nodes: &[Rate<N, T>], seen: &Sweep, h: f64, g: &Gauss) -> f64 {
    let tails = g.tail.map(|row| Rate::sum(nodes, &row));
    let accelerations = Size::of(nodes.iter().flat_map(|r| r.a.iter()));
    let relative = [
        Size::of(tails.iter().flat_map(|r| r.a.iter())).over(accelerations),
        Size::of(tails.iter().map(|r| &r.z)).over(seen.scales[1]),
        Size::of(tails.iter().map(|r| &r.b)).over(seen.scales[2]),
    ];
    let velocity = relative[0] * relative[0] * accelerations.over(seen.scales[0]) * h.abs();
    velocity.max(relative[1] * relative[1]).max(relative[2] * relative[2]) / (2 * g.s + 1) as f64
}
