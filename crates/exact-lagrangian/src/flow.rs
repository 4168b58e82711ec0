//! The flow of the Herglotz vector field, to round-off.

use crate::ExactError;
use crate::panel::{Panel, Problem, Rate, Rates, Refused, State, collocate};
use contact_geom::nalgebra::SVector;
use contact_geom::{GeometryError, Lagrangian, Scalar, Triple, VelocityPoint, herglotz_rates};

/// The largest number of panels of a motion.
pub const PANELS: u32 = 100_000;

/// The relative error that a panel's end values may have by their estimate: half a unit of round-off.
pub(crate) const ACCURACY: f64 = 0.5 * f64::EPSILON;

/// Herglotz' equations `q'' = a`, `z' = L`, `b' = L_z`.
pub(crate) struct Herglotz<'a, L>(pub &'a L);

impl<L: Lagrangian<N>, const N: usize> Rates<N> for Herglotz<'_, L> {
    #[inline]
    fn at<T: Scalar>(&self, t: f64, x: &State<N, T>) -> Result<Rate<N, T>, GeometryError> {
        let point = VelocityPoint { q: x.q, v: x.v, z: x.z };
        let (field, b) = herglotz_rates(self.0, T::from(t), &point)?;
        Ok(Rate { a: field.y, z: field.z, b })
    }
}

/// A motion: where it ends, and what has grown along it. Over duals, with the derivatives of all of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<const N: usize, T = f64> {
    /// The end `phi_t(q0, v0, z0)`.
    pub end: VelocityPoint<N, T>,
    /// The displacement `q1 - q0`, to round-off of itself even where it is small beside the positions.
    pub displacement: SVector<T, N>,
    /// The action `z1 - z0 = int L dt`, likewise.
    pub action: T,
    /// `b = int L_z dt`, the logarithm of the conformal factor; paper, section 4.2.
    pub b: T,
    /// The panels that it took.
    pub panels: u32,
    /// The evaluations of the vector field that it took.
    pub evaluations: u32,
}

impl<const N: usize, T: Scalar> Motion<N, T> {
    /// The conformal factor `sigma = e^b` of the flow: `phi_t* eta_L = sigma eta_L`.
    pub fn sigma(&self) -> T {
        self.b.exp()
    }
}

/// The motion `phi_t` of the Herglotz vector field `xi_L` from a start at time `t0` over a duration, negative to go back;
/// paper, section 4.1. To round-off, for any regular L and over any [`Scalar`]: on duals it gives the first (and further)
/// variational equations' solution.
///
/// Collocation at up to 24 Gauss points (order 48) on panels that are as long as the estimated error and the convergence of the
/// iteration allow; the changes of all panels are added with compensation. The error stays within some units of round-off
/// times the condition of the motion.
///
/// # Errors
/// [`ExactError::Input`] for a non-finite argument or a W that is singular at the start; [`ExactError::OutsideDomain`] where the
/// motion is not defined up to the end, with the state reached; [`ExactError::Unfinished`].
pub fn herglotz_flow<T: Scalar, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t0: f64,
    start: &VelocityPoint<N, T>,
    duration: f64,
) -> Result<Motion<N, T>, ExactError<N>> {
    let from = State { q: start.q, v: start.v, z: start.z, b: T::zero() };
    integrate(&Herglotz(lagrangian), t0, &from, duration, ACCURACY)
}

/// A sum whose rounding errors are carried along, after Kahan.
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

/// The sums along a motion. The state is summed up from the start's, so that what decays keeps its digits; the displacement
/// and the action from 0, so that what is small beside the state keeps its own.
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

/// The factor by which a panel of order `2 nodes` should be made longer.
fn stretch<const N: usize, T>(panel: &Panel<N, T>, accuracy: f64) -> f64 {
    0.9 * (accuracy / panel.error.max(1e-300)).powf(0.5 / panel.nodes as f64)
}

/// Refuses what is not finite.
fn finite<T: Scalar>(what: &'static str, entries: &[T]) -> Result<(), GeometryError> {
    match entries.iter().position(|e| !e.extent().is_finite()) {
        Some(index) => Err(GeometryError::NonFinite { what, index, value: entries[index].re() }),
        None => Ok(()),
    }
}

/// Integrates equations of motion over a duration by panels. In the result `b` is that of the last state, grown from
/// `from.b`.
pub(crate) fn integrate<T: Scalar, const N: usize>(
    rates: &impl Rates<N>,
    t0: f64,
    from: &State<N, T>,
    duration: f64,
    accuracy: f64,
) -> Result<Motion<N, T>, ExactError<N>> {
    finite("t0", &[t0])?;
    finite("the duration", &[duration])?;
    finite("q", from.q.as_slice())?;
    finite("v", from.v.as_slice())?;
    finite("z", &[from.z])?;
    let mut sums = Sums::new(from);
    let (mut done, mut panels, mut evaluations) = (0.0, 0, 0);
    let mut guess = rates.at(t0, from)?;
    // The longest panel that seems possible, and the collocation for it.
    let mut longest = duration.abs();
    let mut cause = None;
    let mut at = *from;
    while done != duration {
        let rest = duration - done;
        let ends = rest.abs() <= longest;
        let h = if ends { rest } else { rest / (rest.abs() / longest).ceil() };
        let reached = || Triple {
            x: SVector::<f64, N>::from_fn(|i, _| at.q[i].re()),
            y: SVector::from_fn(|i, _| at.v[i].re()),
            z: at.z.re(),
        };
        // A singularity is closer than round-off.
        if h.abs() <= 4.0 * f64::EPSILON * duration.abs() {
            return Err(ExactError::OutsideDomain { t: t0 + done, reached: reached().into(), cause });
        }
        if panels == PANELS {
            return Err(ExactError::Unfinished { t: t0 + done, reached: reached().into() });
        }
        let problem = Problem { t: t0 + done, h, from: &at, end: None, accuracy };
        match collocate(rates, &problem, guess, &mut { at.v }) {
            Ok(panel) => {
                evaluations += panel.evaluations;
                if panel.error > accuracy {
                    longest = h.abs() * stretch(&panel, accuracy).clamp(0.1, 0.9);
                    continue;
                }
                panels += 1;
                sums.add(&panel);
                at = sums.state();
                done = if ends { duration } else { done + h };
                // Beyond some twenty sweeps two panels of half the length are cheaper.
                let slow = if panel.sweeps > 20 { 0.7 } else { f64::INFINITY };
                longest = h.abs() * stretch(&panel, accuracy).min(slow).clamp(0.5, 3.0);
                guess = panel.last;
            }
            Err(refused) => {
                if let Refused::Undefined(error) = refused {
                    cause = Some(error);
                }
                longest = h.abs() * 0.4;
            }
        }
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
