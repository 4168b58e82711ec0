//! The flow of the Herglotz vector field, to round-off.

#[cfg(test)]
mod tests;

use crate::ExactError;
use crate::numerics::panel::{Floor, Panel, Problem, Rate, Rates, Refused, SMALLEST, Size, State, collocate};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, GeometryError, Lagrangian, Scalar, VelocityPoint, numbers::max_or_nan, support::herglotz_rates,
};
use discrete_herglotz::checks::jumps_between;

/// The largest number of evaluations of the vector field for a motion, or for the search for one between two points:
/// about one second of work. An evaluation on duals of n entries counts n times.
pub const EVALUATIONS: u64 = 4_000_000;

/// The tolerance for the estimated relative error of a panel's end values: half a unit of round-off.
pub(crate) const ACCURACY: f64 = 0.5 * f64::EPSILON;

/// Herglotz' equations `q'' = a`, `z' = L`, `b' = L_z`.
pub(crate) struct Herglotz<'a, L>(pub &'a L);

impl<L: Lagrangian<N>, T: Scalar, const N: usize> Rates<N, T> for Herglotz<'_, L> {
    #[inline]
    fn at(&self, t: f64, x: &State<N, T>) -> Result<Rate<N, T>, GeometryError> {
        let point = VelocityPoint { q: x.q, v: x.v, z: x.z };
        let (field, b) = herglotz_rates(self.0, T::from(t), &point)?;
        Ok(Rate { a: field.y, z: field.z, b })
    }

    fn jumps_between(&self, ends: [(f64, &State<N, T>); 2]) -> bool {
        if !const { L::HINTS.switching_functions } {
            return false;
        }
        jumps_between(
            self.0,
            ends.map(|(t, x)| (t, VelocityPoint { q: x.q.map(T::re), v: x.v.map(T::re), z: x.z.re() })),
        )
    }
}

/// The same equations without the check for jumps of L, for runs whose steps end on these jumps: passing one by a
/// rounding must not be refused.
pub(crate) struct BetweenJumps<'a, L>(pub Herglotz<'a, L>);

impl<L: Lagrangian<N>, T: Scalar, const N: usize> Rates<N, T> for BetweenJumps<'_, L> {
    #[inline]
    fn at(&self, t: f64, x: &State<N, T>) -> Result<Rate<N, T>, GeometryError> {
        self.0.at(t, x)
    }
}

/// [`herglotz_flow`] without the check for jumps of L.
pub(crate) fn flow_between_jumps<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t0: f64,
    start: &VelocityPoint<N>,
    duration: f64,
) -> Result<Motion<N>, ExactError<N>> {
    let from = State { q: start.q, v: start.v, z: start.z, b: 0.0 };
    integrate(&BetweenJumps(Herglotz(lagrangian)), t0, &from, duration, ACCURACY, &mut Work::default())
}

/// A motion: its end, and the integrals along it. On dual numbers, with the derivatives of all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Motion<const N: usize, T = f64> {
    /// The end `phi_t(q0, v0, z0)`.
    pub end: VelocityPoint<N, T>,
    /// The displacement `q1 - q0`, to relative round-off even where it is small compared with the positions.
    pub displacement: SVector<T, N>,
    /// The action `z1 - z0 = int L dt`, with the same accuracy.
    pub action: T,
    /// `b = int L_z dt`, the logarithm of the conformal factor; paper, section 4.2.
    pub b: T,
    /// The number of panels.
    pub panels: u32,
    /// The number of evaluations of the vector field, including refused panels and the checks between the nodes.
    pub evaluations: u64,
}

impl<const N: usize, T: Scalar> Motion<N, T> {
    /// The conformal factor `sigma = e^b` of the flow: `phi_t* eta_L = sigma eta_L`.
    pub fn sigma(&self) -> T {
        self.b.exp()
    }
}

/// The flow `phi_t` of the Herglotz vector field `xi_L` from a start at time `t0` over a duration, which is negative to
/// run backward in time; paper, section 4.1. It is computed to round-off, for any regular L and over any [`Scalar`]: on
/// duals it gives the solution of the first (and higher) variational equations.
///
/// The method is collocation at 4 to 24 Gauss points (order 8 to 48) on panels that are as long as the estimated error
/// and the convergence of the iteration allow; the changes over all panels are added by compensated summation. The
/// error is some units of round-off times the condition number of the motion.
///
/// Narrow features may be missed by the nodes. Each panel is therefore compared with the equations at both ends and at
/// 5 to 25 or more other points, a total of 160 or more for a motion that changes its position or its velocity by as
/// much as they are. A force of Gaussian shape `exp(-(s/w)^2)` in position or time, which is noticeable over `8 w`, is
/// as a rule detected if w is at least 1e-3 of the span. Narrower features may be missed; use shorter durations where
/// such features are known. A force that is small compared with another and too fast for the nodes is detected by its
/// mean effect. A jump of a force or of the drag is detected at the ends of the panels, and passed in a panel so short
/// that only the last digit is affected. Across a jump of L itself, which its
/// [switching functions](Lagrangian::switching_functions) indicate, the vector field has no flow: the motion is refused
/// there, while a [`Run`](discrete_herglotz::Run) continues by the corner conditions.
///
/// The last digit of a subnormal number is the smallest positive number.
///
/// # Errors
/// [`ExactError::Input`] for a non-finite argument or a W that is singular at the start; [`ExactError::OutsideDomain`]
/// where the motion is not defined up to the end, with the state reached; [`ExactError::Unfinished`] after
/// [`EVALUATIONS`].
pub fn herglotz_flow<T: Scalar, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t0: f64,
    start: &VelocityPoint<N, T>,
    duration: f64,
) -> Result<Motion<N, T>, ExactError<N>> {
    let from = State { q: start.q, v: start.v, z: start.z, b: T::zero() };
    integrate(&Herglotz(lagrangian), t0, &from, duration, ACCURACY, &mut Work::default())
}

/// A compensated sum, after Kahan. It differs from the compensated sum of `discrete-herglotz` in scalar and algorithm:
/// it adds terms over any scalar, so that derivatives are compensated too, where that one adds pairs of `f64` by
/// Knuth's TwoSum; their results differ in the last digit.
#[derive(Clone, Copy)]
struct Sum<T> {
    value: T,
    lost: T,
}

impl<T: Scalar> Sum<T> {
    fn from(value: T) -> Self {
        Sum { value, lost: T::zero() }
    }

    #[inline]
    fn add(&mut self, term: T) {
        let corrected = term - self.lost;
        let next = self.value + corrected;
        self.lost = (next - self.value) - corrected;
        self.value = next;
    }
}

/// The sums along a motion. The state is summed from its initial value, so that decaying quantities keep their digits;
/// the displacement and the action from 0, so that they keep their digits where they are small compared with the state.
struct Sums<const N: usize, T> {
    q: [Sum<T>; N],
    v: [Sum<T>; N],
    z: Sum<T>,
    b: Sum<T>,
    displacement: [Sum<T>; N],
    action: Sum<T>,
}

impl<const N: usize, T: Scalar> Sums<N, T> {
    fn new(from: &State<N, T>) -> Self {
        Sums {
            q: std::array::from_fn(|i| Sum::from(from.q[i])),
            v: std::array::from_fn(|i| Sum::from(from.v[i])),
            z: Sum::from(from.z),
            b: Sum::from(from.b),
            displacement: [Sum::from(T::zero()); N],
            action: Sum::from(T::zero()),
        }
    }

    fn add(&mut self, panel: &Panel<N, T>) {
        for i in 0..N {
            self.q[i].add(panel.displacement[i]);
            self.v[i].add(panel.change.a[i]);
            self.displacement[i].add(panel.displacement[i]);
        }
        self.z.add(panel.change.z);
        self.b.add(panel.change.b);
        self.action.add(panel.change.z);
    }

    fn state(&self) -> State<N, T> {
        State {
            q: SVector::from_fn(|i, _| self.q[i].value),
            v: SVector::from_fn(|i, _| self.v[i].value),
            z: self.z.value,
            b: self.b.value,
        }
    }
}

/// The number of evaluations that remain of [`EVALUATIONS`].
pub(crate) struct Work(u64);

impl Default for Work {
    fn default() -> Self {
        Work(EVALUATIONS)
    }
}

impl Work {
    /// Whether none remain.
    pub fn is_done(&self) -> bool {
        self.0 == 0
    }

    fn take<T>(&mut self, evaluations: u64) {
        self.0 = self.0.saturating_sub(evaluations * (size_of::<T>() / size_of::<f64>()) as u64);
    }
}

/// The factor by which the panel after one of order `2 nodes` should be longer.
fn stretch<const N: usize, T>(panel: &Panel<N, T>, accuracy: f64) -> f64 {
    0.9 * (accuracy / max_or_nan(panel.error, 1e-300)).powf(0.5 / panel.nodes as f64)
}

/// The state with the last digit of each coordinate changed, alternately up and down.
fn with_last_digits_changed<const N: usize, T: Scalar>(x: &State<N, T>) -> State<N, T> {
    let [up, down] = [1.0 + f64::EPSILON, 1.0 - f64::EPSILON];
    // The last digit of a subnormal number is the smallest positive number.
    let changed = |x: T, factor: f64| x * factor + if x.pivot_size() < f64::MIN_POSITIVE { SMALLEST } else { 0.0 };
    let of = |x: &SVector<T, N>, even, odd| SVector::from_fn(|i, _| changed(x[i], if i % 2 == 0 { even } else { odd }));
    State { q: of(&x.q, up, down), v: of(&x.v, down, up), z: changed(x.z, up), b: x.b }
}

/// The number of refusals after which the distance to the end of the refused panel is halved with each panel. Before,
/// the length follows from the estimated error, which has no meaning at a jump or a singularity.
const HALVE_DISTANCE: u32 = 8;

/// The number of refusals after which the panels are [narrow](Problem::narrow): the distance has then been
/// halved six times.
const NARROW_PANELS: u32 = 14;

/// The number of refusals after which the motion is given up. It exceeds the number of halvings from any length to a
/// rounding of it.
const MAX_REFUSALS: u32 = 250;

/// Returns an error if an entry is not finite.
fn finite<T: Scalar>(what: &'static str, entries: &[T]) -> Result<(), GeometryError> {
    match entries.iter().position(|e| !e.extent().is_finite()) {
        Some(index) => Err(GeometryError::NonFinite { what, index, value: entries[index].re() }),
        None => Ok(()),
    }
}

/// Integrates equations of motion over a duration by panels. In the result `b` is that of the final state; its initial
/// value is `from.b`.
pub(crate) fn integrate<T: Scalar, const N: usize>(
    rates: &dyn Rates<N, T>,
    t0: f64,
    from: &State<N, T>,
    duration: f64,
    accuracy: f64,
    work: &mut Work,
) -> Result<Motion<N, T>, ExactError<N>> {
    finite("t0", &[t0])?;
    finite("the duration", &[duration])?;
    finite("t0 + the duration", &[t0 + duration])?;
    finite("q", from.q.as_slice())?;
    finite("v", from.v.as_slice())?;
    finite("z", &[from.z])?;
    let mut sums = Sums::new(from);
    let (mut done, mut panels, mut evaluations) = (Sum::from(0.0), 0, 1);
    let mut start = rates.at(t0, from)?;
    // The length of the longest panel that seems possible.
    let mut longest = duration.abs();
    // The number of refusals since a panel has passed the nearest refused end, and the distance to that end.
    let (mut refusals, mut wall) = (0, f64::INFINITY);
    // The length of the first refused panel; and the distance to a point at which a panel has missed something, which
    // the following panels may not pass.
    let (mut usual, mut suspect) = (longest, f64::INFINITY);
    // The longest panel so far.
    let mut scale: f64 = 0.0;
    // The effect of rounding on the rates, and the largest velocity and action so far.
    let (mut floor, mut units) = (Floor::default(), [Size::default(); 3]);
    // The effect on the rates of rounding the time: far from t = 0 it limits the accuracy of a force that depends on
    // time.
    let mut of_time = Floor::default();
    let mut cause = None;
    let mut at = *from;
    let mut ended = duration == 0.0;
    while !ended {
        let t = t0 + done.value;
        let rest = (duration - done.value) + done.lost;
        longest = longest.min(suspect);
        let ends = rest.abs() <= longest;
        let h = if ends {
            rest
        } else if refusals == 0 && longest < suspect {
            rest / (rest.abs() / longest).ceil()
        } else {
            longest.copysign(rest)
        };
        let reached = || ChartVector {
            x: SVector::<f64, N>::from_fn(|i, _| at.q[i].re()),
            y: SVector::from_fn(|i, _| at.v[i].re()),
            z: at.z.re(),
        };
        // A singularity is closer than round-off.
        let closed = refusals < HALVE_DISTANCE && h.abs() <= 4.0 * f64::EPSILON * duration.abs() && !ends;
        if closed || refusals > MAX_REFUSALS || h == 0.0 {
            return Err(ExactError::OutsideDomain { t, reached: reached().into(), cause });
        }
        if work.is_done() {
            return Err(ExactError::Unfinished { t, reached: reached().into() });
        }
        units = [units[0].or(Size::of(&at.v)), units[1].or(Size::of([&at.z])), Size([1.0, f64::INFINITY])];
        let narrow = (refusals >= NARROW_PANELS).then_some(units);
        // At rest, velocities are determined up to the rounding of the positions over the time of a panel.
        let time = if panels == 0 { duration.abs() } else { scale };
        let at_rest = [units[0].or(Size::of(&at.q).times(1.0 / time)), units[1], units[2]];
        let part = h / duration;
        let problem =
            Problem { t, h, from: &at, end: None, accuracy, floor: floor.below(&at_rest, h).or(of_time), part, narrow };
        let mut counted = 0;
        let outcome = collocate(rates, &problem, start, &mut { at.v }, &mut counted);
        match outcome {
            Ok(panel) if panel.error <= accuracy => {
                panels += 1;
                scale = max_or_nan(scale, h.abs());
                let before = at;
                sums.add(&panel);
                at = sums.state();
                if rates.jumps_between([(t, &before), (t + h, &at)]) {
                    let cause = Some(GeometryError::Undefined { what: "the flow across a jump of the Lagrangian" });
                    let [q, v] = [&before.q, &before.v].map(|x| x.map(T::re));
                    return Err(ExactError::OutsideDomain {
                        t,
                        reached: VelocityPoint { q, v, z: before.z.re() },
                        cause,
                    });
                }
                done.add(h);
                ended = ends;
                start = panel.last;
                // Beyond some twenty iterations two panels of half the length are less expensive.
                let slow = if panel.iterations > 20 { 0.7 } else { f64::INFINITY };
                longest = h.abs() * stretch(&panel, accuracy).min(slow).clamp(0.5, 3.0);
                suspect = if h.abs() >= 0.999 * suspect { f64::INFINITY } else { suspect - h.abs() };
                wall -= h.abs();
                if wall <= 0.0 {
                    if refusals >= NARROW_PANELS {
                        longest = usual;
                    }
                    (refusals, wall) = (0, f64::INFINITY);
                } else if refusals >= HALVE_DISTANCE {
                    refusals += 1;
                    longest = longest.min(2.0 * wall);
                }
            }
            refused => {
                if refusals == 0 {
                    usual = h.abs();
                }
                if refusals == 0 || refusals >= HALVE_DISTANCE {
                    // The effect of rounding on the rates here, which no panel can resolve.
                    counted += 3;
                    let later = t + 2.0 * f64::EPSILON * t.abs();
                    of_time = match (rates.at(t, &at), rates.at(later, &at)) {
                        (Ok(now), Ok(later)) => Floor::between(&now, &later),
                        _ => of_time,
                    };
                    floor = rates.at(t, &with_last_digits_changed(&at)).map_or(floor, |r| Floor::between(&r, &start));
                }
                refusals += 1;
                longest = match refused {
                    Ok(panel) => h.abs() * stretch(&panel, accuracy).clamp(0.1, 0.9),
                    Err(Refused::Hidden(c)) if c > 0.0 && c < 1.0 => {
                        suspect = h.abs() * c;
                        suspect
                    }
                    Err(Refused::Undefined(error)) => {
                        cause = Some(error);
                        h.abs() * 0.4
                    }
                    Err(_) => h.abs() * 0.4,
                };
                wall = wall.min(h.abs());
                if refusals >= HALVE_DISTANCE {
                    longest = longest.min(0.5 * wall);
                }
            }
        }
        evaluations += counted;
        work.take::<T>(counted);
    }
    Ok(Motion {
        end: VelocityPoint { q: at.q, v: at.v, z: at.z },
        displacement: SVector::from_fn(|i, _| sums.displacement[i].value),
        action: sums.action.value,
        b: at.b,
        panels,
        evaluations,
    })
}
