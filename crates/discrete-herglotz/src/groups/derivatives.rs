//! Derivatives of motions on Lie groups in the start and in parameters.

use super::{GroupIntegrator, GroupState, GroupStep, ParametricGroupIntegrator};
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::{ChartVector, Dual, Scalar};

/// The end of a motion with its derivatives, by dual numbers through every step: those of the discrete motion, to
/// round-off.
///
/// Tangent vectors have body coordinates `(eta, dPi, dz)`, in this order of rows and columns: the configuration is
/// `g exp(eta)`.
///
/// ```
/// use contact_geom::groups::{Inertia, LieGroup, RigidBody, Rotations, UniformGravity};
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::groups::{GroupDerivatives, GroupGauss, GroupState};
/// let gravity = UniformGravity { weight: [0.0, 0.0, -1.0], centre: [0.1, 0.0, 0.2] };
/// let top = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 2.5])?, gravity, -0.1)?;
/// let start = GroupState { g: Rotations::identity(), momentum: SVector::from([0.5, 1.0, 2.0]), z: 0.0 };
/// let gauss = GroupGauss::new::<Rotations, 3>(&top, 3, 0.05)?;
/// let found = GroupDerivatives::<Rotations, 3>::with_parameters(&gauss, 0.0, &start, 40)?;
/// println!("d Pi_1/d gamma = {}", found.in_parameters[(3, 12)]); // 6 entries of J, 3 + 3 of the gravity, gamma
/// assert!((found.log_factor + 0.2).abs() < 1e-15 && found.contact_defect() < 1e-13);
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Debug)]
pub struct GroupDerivatives<G: LieGroup<N>, const N: usize> {
    /// The state at the start.
    pub start: GroupState<G, N>,
    /// The state at the end.
    pub end: GroupState<G, N>,
    /// The logarithm of the conformal factor, `ln(sigma_1 ... sigma_k)`.
    pub log_factor: f64,
    /// The derivative of the end in the start, a square matrix of size 2N + 1.
    pub in_start: DMatrix<f64>,
    /// The derivative of the end in the parameters, one column for each; no column unless it was requested.
    pub in_parameters: DMatrix<f64>,
}

/// A number with its derivatives along 2N + 1 directions.
pub(super) type Along<const N: usize> = Dual<f64, ChartVector<N>>;

/// The number with derivative 1 in the direction of this index, if there is one.
fn seeded<const N: usize>(value: f64, direction: Option<usize>) -> Along<N> {
    Dual { re: value, d: ChartVector::from_fn(|i| if Some(i) == direction { 1.0 } else { 0.0 }) }
}

/// A state as duals: along its body coordinates, or constant.
pub(super) fn lifted<G: LieGroup<N>, const N: usize>(
    state: &GroupState<G, N>,
    moves: bool,
) -> GroupState<G, N, Along<N>> {
    let of = |value, i| seeded::<N>(value, moves.then_some(i));
    let eta = SVector::from_fn(|i, _| of(0.0, i));
    GroupState {
        g: G::compose(&G::lift(&state.g, Along::<N>::constant), &G::exp(&eta)),
        momentum: SVector::from_fn(|i, _| of(state.momentum[i], N + i)),
        z: of(state.z, 2 * N),
    }
}

/// Where derivatives are wanted: after a number of steps, and a further step of the given length, if it is not 0.
pub type StepsAndRest = (usize, f64);

/// A state that was reached, with the logarithm of the conformal factor.
type EndOfSteps<G, T, const N: usize> = (GroupState<G, N, T>, f64);

/// The states after numbers of steps of the length h from the time t0, in ascending order, with the logarithms of the
/// conformal factor. A step is taken with its length, from a time.
pub(super) fn after_steps<G: LieGroup<N>, T: Scalar, const N: usize>(
    start: GroupState<G, N, T>,
    velocity: SVector<f64, N>,
    (h, t0): (f64, f64),
    ends: &[StepsAndRest],
    step: impl Fn((f64, f64), &GroupState<G, N, T>, &SVector<T, N>) -> Result<GroupStep<N, T>, GroupError>,
) -> Result<Vec<EndOfSteps<G, T, N>>, GroupError> {
    let (mut at, mut taken) = ((start, velocity.map(T::from), 0.0), 0);
    let after = |(state, velocity, log_factor): &(GroupState<G, N, T>, SVector<T, N>, f64), length: f64, k: usize| {
        let step = step((length, t0 + k as f64 * h), state, velocity)?;
        Ok((state.after(&step), step.velocity, log_factor + step.sigma_minus_one.re().ln_1p()))
    };
    let mut found = Vec::with_capacity(ends.len());
    for (steps, rest) in ends {
        while taken < *steps {
            at = after(&at, h, taken)?;
            taken += 1;
        }
        let (state, _, log_factor) = if *rest == 0.0 { at } else { after(&at, *rest, taken)? };
        found.push((state, log_factor));
    }
    Ok(found)
}

/// The derivatives of a state in body coordinates, one row for each coordinate.
fn rows<G: LieGroup<N>, const N: usize>(
    end: &GroupState<G, N, Along<N>>,
) -> Result<(GroupState<G, N>, Vec<ChartVector<N>>), GroupError> {
    let g = G::lift(&end.g, |x: Along<N>| x.re);
    let plain = GroupState { g, momentum: end.momentum.map(|x| x.re), z: end.z.re };
    plain.check()?;
    let turned = G::log(&G::compose(&G::inverse(&G::lift(&g, Along::<N>::constant)), &end.g));
    let rows: Vec<_> = turned.iter().chain(&end.momentum).chain([&end.z]).map(|x| x.d).collect();
    match rows.iter().find(|row| !row.is_finite()) {
        Some(row) => {
            Err(GroupError::NonFinite { what: "a derivative of the end of the motion", value: row.max_abs_or_nan() })
        }
        None => Ok((plain, rows)),
    }
}

impl<G: LieGroup<N>, const N: usize> GroupDerivatives<G, N> {
    /// The derivatives in the start of a motion of a number of steps.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NonUnitQuaternion`] for the start; those of the steps.
    pub fn new(
        integrator: &impl GroupIntegrator<G, N>,
        t0: f64,
        start: &GroupState<G, N>,
        steps: usize,
    ) -> Result<Self, GroupError> {
        only(Self::of_rows(integrator, t0, start, &[(steps, 0.0)])?)
    }

    /// The derivatives in the start after numbers of steps.
    fn of_rows(
        integrator: &impl GroupIntegrator<G, N>,
        t0: f64,
        start: &GroupState<G, N>,
        ends: &[StepsAndRest],
    ) -> Result<Vec<Self>, GroupError> {
        check(t0, start)?;
        let h = integrator.step_size();
        let velocity = integrator.velocity(t0, start)?;
        let found = after_steps(lifted(start, true), velocity, (h, t0), ends, |(h, t), state, velocity| {
            integrator.step_by(h, t, state, velocity)
        })?;
        let of = |(end, log_factor): &EndOfSteps<G, Along<N>, N>| {
            let (end, rows) = rows(end)?;
            let in_start = DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| rows[i].component(j));
            let in_parameters = DMatrix::zeros(2 * N + 1, 0);
            Ok(GroupDerivatives { start: *start, end, log_factor: *log_factor, in_start, in_parameters })
        };
        found.iter().map(of).collect()
    }

    /// The derivatives in the start and in the parameters of the Lagrangian; each 2N + 1 parameters take one more run.
    /// The momentum and the action at the start are fixed, and a velocity there depends on the parameters.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_parameters(
        integrator: &impl ParametricGroupIntegrator<G, N>,
        t0: f64,
        start: &GroupState<G, N>,
        steps: usize,
    ) -> Result<Self, GroupError> {
        only(Self::of_rows_with_parameters(integrator, t0, start, &[(steps, 0.0)])?)
    }

    /// The same at several places of one motion, in ascending order: after numbers of steps, and further steps of other
    /// lengths.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn of_rows_with_parameters(
        integrator: &impl ParametricGroupIntegrator<G, N>,
        t0: f64,
        start: &GroupState<G, N>,
        ends: &[StepsAndRest],
    ) -> Result<Vec<Self>, GroupError> {
        let mut found = Self::of_rows(integrator, t0, start, ends)?;
        let (h, parameters) = (integrator.step_size(), integrator.parameters());
        let velocity = integrator.velocity(t0, start)?;
        for at in &mut found {
            at.in_parameters = DMatrix::zeros(2 * N + 1, parameters.len());
        }
        for first in (0..parameters.len()).step_by(2 * N + 1) {
            let direction = |k: usize| (first..=first + 2 * N).contains(&k).then(|| k - first);
            let theta: Vec<_> = parameters.iter().enumerate().map(|(k, x)| seeded::<N>(*x, direction(k))).collect();
            let states = after_steps(lifted(start, false), velocity, (h, t0), ends, |step, state, velocity| {
                integrator.step_at(&theta, step, state, velocity)
            })?;
            for (at, (end, _)) in found.iter_mut().zip(&states) {
                for (i, row) in rows(end)?.1.iter().enumerate() {
                    for k in first..parameters.len().min(first + 2 * N + 1) {
                        at.in_parameters[(i, k)] = row.component(k - first);
                    }
                }
            }
        }
        Ok(found)
    }

    /// The gradients in the start and in the parameters of a function of the end, whose gradient at the end is given in
    /// body coordinates.
    pub fn gradients(&self, at_end: &ChartVector<N>) -> (ChartVector<N>, DVector<f64>) {
        let row = at_end.to_vector();
        let of_start = self.in_start.tr_mul(&row);
        (ChartVector::from_fn(|i| of_start[i]), self.in_parameters.tr_mul(&row))
    }

    /// The largest component of `Phi* eta - sigma eta` for the contact form `eta = dz - Pi . (g^-1 dg)`, relative to that
    /// of `Phi* eta`, with the conformal factor sigma of the motion. It is round-off unless a force is applied.
    pub fn contact_defect(&self) -> f64 {
        self.contact_defect_beside(&ChartVector::from_fn(|_| 0.0))
    }

    /// The same for `Phi* eta - sigma eta + work`, with the virtual work of a force: round-off for that of a step,
    /// [`GroupGauss::virtual_work`](super::GroupGauss::virtual_work).
    pub fn contact_defect_beside(&self, work: &ChartVector<N>) -> f64 {
        let form = |at: &GroupState<G, N>| ChartVector { x: -at.momentum, y: SVector::zeros(), z: 1.0 };
        let (pullback, _) = self.gradients(&form(&self.end));
        let expected = form(&self.start).scale(self.log_factor.exp()).minus(*work);
        pullback.minus(expected).max_abs_or_nan() / pullback.max_abs_or_nan()
    }
}

/// The only one of a list.
fn only<T>(mut found: Vec<T>) -> Result<T, GroupError> {
    found.pop().ok_or(GroupError::NonFinite { what: "the number of ends", value: f64::NAN })
}

/// Checks the start of a motion.
pub(super) fn check<G: LieGroup<N>, const N: usize>(t0: f64, start: &GroupState<G, N>) -> Result<(), GroupError> {
    if !t0.is_finite() {
        return Err(GroupError::NonFinite { what: "the initial time", value: t0 });
    }
    start.check()
}
