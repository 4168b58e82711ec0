//! The last step of a run, with dense output.

use crate::integration::motion::Motion;
use crate::integration::{Piece, PieceStart};
use crate::run::ResolvedStep;
use crate::solve::chebyshev::node;
use crate::switching::stepper::parts::time_spacing;
use crate::{DenseStep, State, StepError, Stepper, Vector};
use std::cell::OnceCell;

/// The degree of interpolation of a function along a step, if the method has no dense output: larger by one than that
/// of the cubic curve through both ends.
const SAMPLING_DEGREE: usize = 4;

/// The distance, as a fraction of a step, over which the curvature of the interpolant is computed.
const CURVATURE_DISTANCE: f64 = 1e-3;

/// The largest relative difference between the slope of the interpolant and that of the motion with which the curvature
/// is used: its error then changes a state at [`TaylorPolynomial::MAX_DISTANCE`] by less than round-off.
const MAX_SLOPE_DIFFERENCE: f64 = 1e-4;

/// The relative round-off of a time: a time that differs by less from the end of a step is that end.
const TIME_ROUND_OFF: f64 = 2.0 * f64::EPSILON;

/// The distance from the ends of a piece within which a time may be that of what happens there, in units of the spacing of times.
const NEAR_ENDS: f64 = 16.0;

/// The motion in each piece of a step, if its polynomial resolves it; computed on demand.
type ResolvedPieces = Box<[OnceCell<Option<Box<ResolvedStep>>>]>;

/// The second-order Taylor polynomial of a motion about one of its states, in fractions of a step.
pub(crate) struct TaylorPolynomial {
    state: State,
    slope: State,
    curvature: State,
}

impl TaylorPolynomial {
    /// The fraction of a step up to which the third-order term is below round-off, if the step resolves the motion.
    pub(crate) const MAX_DISTANCE: f64 = 1e-6;

    /// The state at a distance `ahead`, in fractions of the step.
    pub(crate) fn at(&self, ahead: f64) -> State {
        let TaylorPolynomial { state, slope, curvature } = self;
        let half = 0.5 * ahead;
        let of = |x: &Vector, slope: &Vector, curvature: &Vector| {
            Vector::from_fn(x.len(), |i| x[i] + (slope[i] + curvature[i] * half) * ahead)
        };
        State {
            q: of(&state.q, &slope.q, &curvature.q),
            p: of(&state.p, &slope.p, &curvature.p),
            z: state.z + (slope.z + curvature.z * half) * ahead,
        }
    }
}

/// A step, with dense output between its ends.
pub struct LastStep<'r> {
    /// The point from which steps to points within it are taken, if it is not the start.
    origin: Option<Box<(f64, State)>>,
    from: (f64, State),
    to: (f64, State),
    /// What happens at the end, if the state is replaced or its momentum jumps, and the state after it.
    next: Option<Box<(PieceStart, (f64, State))>>,
    motion: &'r dyn Motion,
    stepper: &'r dyn Stepper,
    /// The curve of the step, if the method has one; computed on demand.
    curve: Option<Option<Box<DenseStep>>>,
    /// The motion between the ends, if polynomials resolve it; computed on demand.
    resolved: OnceCell<Option<Box<ResolvedStep>>>,
    /// The same for each of its pieces; `None` if it is a piece itself.
    resolved_pieces: Option<OnceCell<ResolvedPieces>>,
    /// The time derivatives of the state at both ends, computed on demand.
    rates: [Option<State>; 2],
}

impl<'r> LastStep<'r> {
    /// The step between two times with their states.
    pub(crate) fn new([from, to]: [(f64, State); 2], motion: &'r dyn Motion, stepper: &'r dyn Stepper) -> Self {
        LastStep {
            origin: None,
            from,
            to,
            next: None,
            motion,
            stepper,
            curve: None,
            resolved: OnceCell::new(),
            resolved_pieces: Some(OnceCell::new()),
            rates: [None, None],
        }
    }

    /// The pieces of this step, in their order, each with what happens at its start; none if it was not divided.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = (PieceStart, Self)> + '_ {
        let pieces = self.stepper.pieces();
        let of = |(k, piece): (usize, &Piece)| {
            // Steps into a piece are taken from the last point at which the motion can be started anew: at the zero of
            // a switching function the side of the motion would have to be found again.
            let origin = pieces.iter().take(k).rfind(|before| before.start == PieceStart::Regular);
            let origin = origin.map_or(&self.from, |before| &before.from);
            let is_regular = piece.start == PieceStart::Regular;
            let next = pieces.get(k + 1).filter(|next| next.start > PieceStart::Zero);
            let step = LastStep {
                origin: (!is_regular).then(|| Box::new(origin.clone())),
                from: piece.from.clone(),
                to: piece.to.clone(),
                next: next.map(|next| Box::new((next.start, next.from.clone()))),
                motion: self.motion,
                stepper: self.stepper,
                curve: Some(piece.dense.clone().map(Box::new)),
                resolved: OnceCell::new(),
                resolved_pieces: None,
                rates: [None, None],
            };
            (piece.start, step)
        };
        pieces.iter().enumerate().map(of)
    }

    /// The times of the step's start and end.
    pub fn span(&self) -> (f64, f64) {
        (self.from.0, self.to.0)
    }

    /// The times and states of both ends.
    pub fn ends(&self) -> (&(f64, State), &(f64, State)) {
        (&self.from, &self.to)
    }

    /// What happens at the end, if the state is replaced or its momentum jumps, and the state from which the motion
    /// continues.
    pub(crate) fn next(&self) -> Option<&(PieceStart, (f64, State))> {
        self.next.as_deref()
    }

    /// The time at a fraction of the step.
    pub(crate) fn time(&self, fraction: f64) -> f64 {
        if fraction == 1.0 { self.to.0 } else { self.from.0 + fraction * (self.to.0 - self.from.0) }
    }

    /// The state at a time between the ends, as accurate as those at the ends. For collocation it is on polynomials that
    /// resolve the motion between the ends; for other methods, and where [exact](crate::run::OutputRequest::exact) states are requested, it
    /// is computed by a step of the same integrator that ends at this time, so that the map to it is conformally contact like a
    /// full step.
    ///
    /// # Errors
    /// Those of a step.
    pub fn at(&self, t: f64) -> Result<State, StepError> {
        if t == self.to.0 { Ok(self.to.1.clone()) } else { self.step_to(t).map(|(state, _)| state) }
    }

    /// The same state, with the conformal factor from the start of the step.
    pub(crate) fn step_to(&self, t: f64) -> Result<(State, f64), StepError> {
        if t == self.from.0 {
            return Ok((self.from.1.clone(), 1.0));
        }
        if self.is_undivided() && (t - self.to.0).abs() <= TIME_ROUND_OFF * self.to.0.abs() {
            return Ok((self.to.1.clone(), self.stepper.sigma()));
        }
        let is_inside = (t - self.from.0) * (t - self.to.0) <= 0.0;
        if is_inside && let Some(resolved) = self.resolved().or_else(|| self.resolved_piece(t)) {
            let (state, sigma) = resolved.at(t);
            return if state.is_finite() && sigma > 0.0 { Ok((state, sigma)) } else { Err(StepError::NonFinite) };
        }
        let origin = self.origin.as_deref().unwrap_or(&self.from);
        let is_whole = origin.0 == self.from.0;
        let curve = self.curve.as_ref().and_then(Option::as_deref).filter(|_| is_whole);
        self.motion.state_within_step(origin, t, self.stepper.last_velocity().as_ref(), curve)
    }

    /// Whether it is the whole of a step that was not divided.
    fn is_undivided(&self) -> bool {
        self.stepper.pieces().is_empty()
    }

    /// Whether polynomials resolve the motion between the ends, so that a state there costs little.
    pub(crate) fn is_resolved(&self) -> bool {
        self.resolved().is_some()
    }

    /// The motion between the ends, if polynomials resolve it.
    fn resolved(&self) -> Option<&ResolvedStep> {
        let LastStep { from, to, motion, stepper, curve, .. } = self;
        let resolved = self.resolved.get_or_init(|| {
            let curve = curve.as_ref().and_then(Option::as_deref);
            let found = || motion.resolve((from, to), (*stepper, curve), stepper.last_velocity().as_ref());
            if self.is_undivided() { found().map(Box::new) } else { None }
        });
        resolved.as_deref()
    }

    /// The motion in the piece of the step in which a time is, if its polynomial resolves it; `None` at the ends of pieces, where the
    /// motion may be before or after what happens there.
    fn resolved_piece(&self, t: f64) -> Option<&ResolvedStep> {
        let pieces = self.stepper.pieces();
        let near = NEAR_ENDS * time_spacing(t, self.to.0 - self.from.0);
        let is_within = |piece: &Piece| {
            let [from, to] = [&piece.from, &piece.to].map(|end| t - end.0);
            from * to < 0.0 && from.abs().min(to.abs()) > near
        };
        let k = pieces.iter().position(is_within)?;
        let new = || pieces.iter().map(|_| OnceCell::new()).collect();
        let resolved = self.resolved_pieces.as_ref()?.get_or_init(new).get(k)?;
        let found = || {
            let near = self.stepper.last_velocity();
            self.motion.resolve_piece(pieces.get(k)?, near.as_ref()).map(Box::new)
        };
        resolved.get_or_init(found).as_deref()
    }

    /// Sets the time derivatives at its start, as computed for the preceding step.
    pub(crate) fn set_rates_at_start(&mut self, rates: Option<State>) {
        self.rates = [rates, None];
    }

    /// Takes the time derivatives at the end, if they have been computed.
    pub(crate) fn take_rates_at_end(&mut self) -> Option<State> {
        self.rates[1].take()
    }

    /// Interpolated states at the Chebyshev-Lobatto nodes between the ends of the step, at which a search along it
    /// first evaluates a function; no step is taken.
    pub(crate) fn interpolated_states(&mut self, to: &mut Vec<State>) -> Result<(), StepError> {
        to.clear();
        if let Some(curve) = self.curve() {
            curve.states_at_nodes(to);
            return Ok(());
        }
        for j in 1..SAMPLING_DEGREE {
            to.push(self.interpolate(node(SAMPLING_DEGREE, j))?);
        }
        Ok(())
    }

    /// The Taylor polynomial about a state of the motion at a fraction of the step: the slope from the equations of
    /// motion, the curvature from the interpolant. `None` if the slope of the interpolant differs, so that its
    /// curvature is unreliable, or if the time derivatives cannot be computed.
    pub(crate) fn taylor_polynomial(
        &mut self,
        fraction: f64,
        state: &State,
    ) -> Result<Option<TaylorPolynomial>, StepError> {
        let (t0, t1) = self.span();
        let near = self.stepper.last_velocity();
        let Ok(rates) = self.motion.rates(self.time(fraction), state, near.as_ref()) else { return Ok(None) };
        let distance = CURVATURE_DISTANCE.min(fraction).min(1.0 - fraction);
        let (below, here, above) = (
            self.interpolate(fraction - distance)?,
            self.interpolate(fraction)?,
            self.interpolate(fraction + distance)?,
        );
        let part = |of: fn(&State) -> &Vector| {
            let slope = of(&rates) * (t1 - t0);
            let [below, here, above] = [&below, &here, &above].map(of);
            let agrees = ((above - below) / (2.0 * distance) - &slope).amax() <= MAX_SLOPE_DIFFERENCE * slope.amax();
            (agrees, slope, (above - here * 2.0 + below) / (distance * distance))
        };
        let ((q_agrees, q_slope, q_curvature), (p_agrees, p_slope, p_curvature)) = (part(|x| &x.q), part(|x| &x.p));
        let z_curvature = (above.z - 2.0 * here.z + below.z) / (distance * distance);
        Ok((q_agrees && p_agrees).then_some(TaylorPolynomial {
            state: state.clone(),
            slope: State { q: q_slope, p: p_slope, z: rates.z * (t1 - t0) },
            curvature: State { q: q_curvature, p: p_curvature, z: z_curvature },
        }))
    }

    fn curve(&mut self) -> Option<&DenseStep> {
        let LastStep { from, to, motion, stepper, .. } = self;
        self.curve.get_or_insert_with(|| motion.curve((from, to), *stepper).map(Box::new)).as_deref()
    }

    /// The interpolated state at a fraction of the step, without taking a step: by the collocation polynomial if there
    /// is one, otherwise by the cubic Hermite polynomial through both ends.
    pub(crate) fn interpolate(&mut self, fraction: f64) -> Result<State, StepError> {
        if let Some(curve) = self.curve() {
            return Ok(curve.at_fraction(fraction));
        }
        let LastStep { from, to, motion, stepper, rates: [at_start, at_end], .. } = self;
        let ra = rates_at(from, at_start, (*motion, *stepper))?;
        let rb = rates_at(to, at_end, (*motion, *stepper))?;
        let ((t0, a), (t1, b)) = (&*from, &*to);
        let (u, rest, h) = (fraction, 1.0 - fraction, t1 - t0);
        let weights =
            [rest * rest * (1.0 + 2.0 * u), u * u * (1.0 + 2.0 * rest), h * u * rest * rest, -h * u * u * rest];
        let of = |a: &Vector, b: &Vector, ra: &Vector, rb: &Vector| {
            Vector::from_fn(a.len(), |i| {
                a[i] * weights[0] + b[i] * weights[1] + ra[i] * weights[2] + rb[i] * weights[3]
            })
        };
        Ok(State {
            q: of(&a.q, &b.q, &ra.q, &rb.q),
            p: of(&a.p, &b.p, &ra.p, &rb.p),
            z: a.z * weights[0] + b.z * weights[1] + ra.z * weights[2] + rb.z * weights[3],
        })
    }
}

/// The time derivatives at an end of a step, computed if they are not known.
fn rates_at<'k>(
    (t, state): &(f64, State),
    known: &'k mut Option<State>,
    (motion, stepper): (&dyn Motion, &dyn Stepper),
) -> Result<&'k State, StepError> {
    match known {
        Some(rates) => Ok(rates),
        None => Ok(known.insert(motion.rates(*t, state, stepper.last_velocity().as_ref())?)),
    }
}
