//! Splittings of contact Hamiltonians into pieces with closed contact flows.

use super::increment::jacobian;
use super::map_stepper::{ContactMaps, MapStepper, StateSums};
use super::pieces::PieceList;
use crate::integration::StepFormula;
use crate::{
    InputError, Integrator, MethodInfo, PlanEntry, Problem, SplittingScheme, StepError, Stepper, StepperOptions,
};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, ContactHamiltonian, OfHamiltonian, PhasePoint, Scalar};
use contact_geom::{numbers::MaxAbsOrNan, numbers::max_or_nan};
use std::borrow::Cow;

/// The splitting of a contact Hamiltonian `H = H_1 + ... + H_k` into [pieces](super::ContactPiece) with closed contact
/// flows, by a composition of the symmetric map of order 2
///
/// `S_h = phi1_(h/2) ... phi(k-1)_(h/2) phik_h phi(k-1)_(h/2) ... phi1_(h/2)`.
///
/// Every step is conformally contact, with `sigma_d` the product of the factors of the flows. Pieces may depend on
/// time: the pieces before the last have the time of the start of a substep on the way in and that of its end on the
/// way out, and the last one has the time between, which is the splitting of the autonomous system with `t' = 1` as a
/// further piece.
///
/// The first and the last piece have one flow in a substep, the others two; those with the most expensive flows should
/// be the first and the last. Where the pieces do not sum to H, or a flow is not that of its piece, a typed error says
/// so.
///
/// ```
/// use contact_geom::{ContactHamiltonian, PhasePoint, Scalar, nalgebra::{SMatrix, SVector}};
/// use discrete_herglotz::hamiltonian::{AffineFlow, PieceStepper, Prolonged, Quadratic};
/// use discrete_herglotz::{SplittingScheme, Stepper};
/// let one = SMatrix::<f64, 1, 1>::identity();
/// let pieces = (Quadratic::new(one, one * 0.0, one, -0.1), Prolonged(AffineFlow { qz: [0.2].into(), ..AffineFlow::ZERO }));
/// let start = PhasePoint::new([1.0], [0.0], 0.0);
/// let mut stepper = PieceStepper::new(pieces, &SplittingScheme::KAHAN_LI_8, 0.1, 0.0, start)?;
/// stepper.advance(100)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct HamiltonianSplitting<P> {
    /// The pieces.
    pub pieces: P,
    /// The composition.
    pub scheme: SplittingScheme,
}

/// For a contact Hamiltonian that is the sum of the pieces.
impl<'a, H, P, const N: usize> Integrator<'a, OfHamiltonian<H>, N> for HamiltonianSplitting<P>
where
    H: ContactHamiltonian<N>,
    P: PieceList<N> + Clone + 'a,
{
    fn info(&self) -> MethodInfo {
        info(&self.scheme)
    }

    fn check(&self, _hamiltonian: &OfHamiltonian<H>) -> Result<(), InputError> {
        substeps(&self.scheme).map(|_| ())
    }

    fn stepper(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        _options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        check_sum(&problem.lagrangian.0, &self.pieces, problem.t0, &problem.state)?;
        Ok(Box::new(PieceStepper::new(self.pieces.clone(), &self.scheme, h, problem.t0, problem.state)?))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Jacobian)
    }

    fn step_jacobian(
        &self,
        _problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        (t, from, _to): (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        let Ok(flows) = flows(&self.pieces, &self.scheme, h) else { return Ok(None) };
        let step = |x: &_| Ok::<_, StepError>(step(&self.pieces, &flows, (t, h), x).0);
        jacobian(from, step).map(Some)
    }
}

/// The properties of a splitting into pieces with closed flows.
pub(super) fn info(scheme: &SplittingScheme) -> MethodInfo {
    MethodInfo {
        name: Cow::Owned(format!("hamiltonian_splitting_{}", scheme.name())),
        order: scheme.order(),
        symmetric: true,
        explicit: true,
        exact_rate: false,
        in_transformed_time: false,
        collocation: None,
        substeps: scheme.stages() > 1,
        constrained: false,
        contact: true,
        divides: false,
        cost_per_evaluation: 2,
        source: Cow::Borrowed(scheme.source()),
    }
}

/// The substeps of a composition.
pub(super) fn substeps(scheme: &SplittingScheme) -> Result<Vec<f64>, InputError> {
    scheme.substeps().ok_or(InputError::Hypothesis {
        hypothesis: "a composition of symmetric maps (a Runge-Kutta-Nyström scheme has its order for kicks and drifts only)",
    })
}

/// A flow of a step: the map, and its time as a fraction of the step.
#[derive(Clone, Debug)]
pub(super) struct PieceFlow<M> {
    map: M,
    time: f64,
}

/// The flows of a step in their order; two flows of the first piece between substeps are combined.
pub(super) fn flows<P: PieceList<N>, const N: usize>(
    pieces: &P,
    scheme: &SplittingScheme,
    h: f64,
) -> Result<Vec<PieceFlow<P::Map>>, InputError> {
    let substeps = substeps(scheme)?;
    let Some(last) = pieces.count().checked_sub(1) else {
        return Err(InputError::Count { what: "the number of pieces", least: 1, found: 0 });
    };
    let mut list = Vec::new();
    let mut flow = |index: usize, fraction: f64, time: f64| {
        list.extend(pieces.over(index, fraction * h).map(|map| PieceFlow { map, time }));
    };
    let (mut start, mut before) = (0.0, 0.0);
    for g in substeps {
        if last > 0 {
            flow(0, 0.5 * (before + g), start);
        }
        (1..last).for_each(|index| flow(index, 0.5 * g, start));
        flow(last, g, start + 0.5 * g);
        (1..last).rev().for_each(|index| flow(index, 0.5 * g, start + g));
        (start, before) = (start + g, g);
    }
    if last > 0 {
        flow(0, 0.5 * before, start);
    }
    Ok(list)
}

/// A step from the time t, over any scalar: the state and the conformal factor.
pub(super) fn step<P: PieceList<N>, T: Scalar, const N: usize>(
    pieces: &P,
    flows: &[PieceFlow<P::Map>],
    (t, h): (f64, f64),
    x: &PhasePoint<N, T>,
) -> (PhasePoint<N, T>, T) {
    flows.iter().fold((*x, T::one()), |(x, sigma), PieceFlow { map, time }| {
        let change = pieces.change(map, t + time * h, &x);
        (change.after(&x), sigma + sigma * change.sigma_minus_one)
    })
}

/// The bound on the relative difference of H and the sum of the pieces, and on that of two flows over half the time
/// and one flow over the whole: round-off, with room for constants that are rounded.
const LARGEST_DEFECT: f64 = 1e-10;

/// A point near a state, without a symmetry of H.
fn nearby<const N: usize>(x: &PhasePoint<N>, distance: f64) -> PhasePoint<N> {
    let moved = |e: f64, i: usize| e + distance * (1.0 + e.abs()) * (0.4 + (0.618 * (i + 1) as f64).fract());
    PhasePoint {
        q: SVector::from_fn(|i, _| moved(x.q[i], i)),
        p: SVector::from_fn(|i, _| moved(x.p[i], N + i)),
        z: moved(x.z, 2 * N),
    }
}

/// Returns an error unless the pieces sum to H at a state and near it.
fn check_sum<const N: usize>(
    hamiltonian: &impl ContactHamiltonian<N>,
    pieces: &impl PieceList<N>,
    t: f64,
    x: &PhasePoint<N>,
) -> Result<(), InputError> {
    for (distance, t) in [(0.0, t), (0.05, t + 0.1), (-0.05, t)] {
        let x = nearby(x, distance);
        let value = hamiltonian.value(t, &x.q, &x.p, x.z);
        let (sum, size) = pieces.sum(t, &x.q, &x.p, x.z);
        if !value.is_finite() {
            // A point near the start may be outside of the domain of H.
            if distance == 0.0 {
                return Err(InputError::Undefined);
            }
            continue;
        }
        let (difference, size) = ((value - sum).abs(), size + value.abs());
        let relative = if difference == 0.0 { 0.0 } else { difference / size };
        if relative.is_nan() || relative > LARGEST_DEFECT {
            return Err(InputError::PieceSum { size: relative });
        }
    }
    Ok(())
}

/// Returns an error unless the flow of each piece is that of its contact Hamiltonian at a state: the increments over
/// short times agree with the vector field, and two flows over half a time with one over the whole.
fn check_flows<P: PieceList<N>, const N: usize>(pieces: &P, t: f64, x: &PhasePoint<N>) -> Result<(), InputError> {
    for index in 0..pieces.count() {
        let Some(field) = pieces.field(index, t, x) else { continue };
        let flow = |tau: f64, x: &PhasePoint<N>| {
            pieces.over(index, tau).map_or_else(super::ContactIncrement::undefined, |map| pieces.change(&map, t, x))
        };
        let chart = |x: &PhasePoint<N>| ChartVector::from(*x);
        let size = 1.0 + chart(x).max_abs_or_nan();
        let rate = 1.0 / (1.0 + field.max_abs_or_nan() / size);
        if !field.is_finite() {
            return Err(InputError::Undefined);
        }
        // The error of the quotient is of the second order in tau.
        let tau = 1e-4 * rate;
        let quotient = {
            let (a, b) = (flow(tau, x), flow(-tau, x));
            let of = |a: f64, b: f64| (a - b) / (2.0 * tau);
            ChartVector::<N> { x: (a.q - b.q) / (2.0 * tau), y: (a.p - b.p) / (2.0 * tau), z: of(a.z, b.z) }
        };
        let slope = quotient.minus(field).max_abs_or_nan() * rate / size;
        let tau = 1e-2 * rate;
        let half = flow(0.5 * tau, x).after(x);
        let (twice, once) = (flow(0.5 * tau, &half).after(&half), flow(tau, x).after(x));
        let group = chart(&twice).minus(chart(&once)).max_abs_or_nan() / size;
        if slope <= 1e-6 && group <= LARGEST_DEFECT {
            continue;
        }
        return Err(InputError::PieceFlow { index, size: max_or_nan(slope, group) });
    }
    Ok(())
}

/// The flows of the pieces in a step.
#[derive(Clone, Debug)]
pub struct PieceMaps<P: PieceList<N>, const N: usize> {
    pieces: P,
    flows: Vec<PieceFlow<P::Map>>,
}

/// The stepper of [`HamiltonianSplitting`]. Its evaluations are flows of pieces.
pub type PieceStepper<P, const N: usize> = MapStepper<PieceMaps<P, N>, N>;

impl<P: PieceList<N>, const N: usize> PieceStepper<P, N> {
    /// The stepper for the sum of the pieces, with steps of length h from the state at the time t0.
    ///
    /// # Errors
    /// [`InputError::Step`] unless h is finite and not 0; [`InputError::Geometry`] where the state is not finite;
    /// [`InputError::Hypothesis`] for a Runge-Kutta-Nyström scheme; [`InputError::Count`] without pieces;
    /// [`InputError::Undefined`] where a piece has no finite vector field; [`InputError::PieceFlow`] where a flow is
    /// not that of its piece.
    pub fn new(pieces: P, scheme: &SplittingScheme, h: f64, t0: f64, state: PhasePoint<N>) -> Result<Self, InputError> {
        let flows = flows(&pieces, scheme, h)?;
        let stepper = MapStepper::of(PieceMaps { pieces, flows }, h, t0, &state)?;
        check_flows(&stepper.maps.pieces, t0, &state)?;
        Ok(stepper)
    }
}

impl<P: PieceList<N>, const N: usize> ContactMaps<N> for PieceMaps<P, N> {
    fn add_step(&self, t: f64, h: f64, sums: &mut StateSums<N>, evaluations: &mut u64) -> Result<(), StepError> {
        for PieceFlow { map, time } in &self.flows {
            sums.add(&self.pieces.change(map, t + time * h, &sums.state()));
        }
        *evaluations += self.flows.len() as u64;
        Ok(())
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        vec![
            PlanEntry::skipped("Newton's method", "the flow of each piece is known in closed form"),
            PlanEntry::computed("action z", "the flows of pieces are contact maps of (q, p, z)"),
        ]
    }
}
