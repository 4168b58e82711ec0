//! Splittings of rigid bodies.

use super::{GroupIntegrator, GroupState, GroupStep};
use crate::SplittingScheme;
use contact_geom::Scalar;
use contact_geom::groups::{GroupError, GroupPotential, Inertia, LieGroup, RigidBody, Rotation, Rotations};
use contact_geom::nalgebra::SVector;

/// Explicit splittings of a rigid body about a fixed point with linear drag, `l = omega . J omega/2 - V(R) + gamma z`,
/// composed to the order of a [`SplittingScheme`], up to 10.
///
/// The kinetic energy is a sum of two parts with closed flows: that of the symmetric body that is nearest,
/// `(|Pi|^2/I_a + (1/I_b - 1/I_a) (Pi . u_b)^2)/2`, a turn about Pi and one about the axis u_b; and the rest,
/// `(1/I_c - 1/I_a) (Pi . u_c)^2/2`, a turn about u_c, which vanishes for a symmetric body. The drag is part of a turn
/// by a change of time, `tau = (e^(gamma t) - 1)/gamma`. A kick by V changes Pi by the torque. Every part is the flow
/// of a contact Hamiltonian, so that a step is conformally contact with `sigma_d = e^(gamma h)`. Fast rotation costs no
/// accuracy: the step is limited by the torque, and by the difference `1/I_c - 1/I_a`.
///
/// ```
/// use contact_geom::groups::{Inertia, LieGroup, NoPotential, RigidBody, Rotations};
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::{SplittingScheme, groups::{GroupMotion, GroupState, RigidBodySplitting}};
/// let body = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 3.0])?, NoPotential, -0.1)?;
/// let method = RigidBodySplitting::new(body, SplittingScheme::SOFRONIOU_SPALETTA_10, 0.5)?;
/// let start = GroupState { g: Rotations::identity(), momentum: SVector::from([1.0, 1.0, 1.0]), z: 0.0 };
/// let mut motion = GroupMotion::<Rotations, 3>::new(0.0, start)?;
/// motion.advance(&method, 20)?;
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Debug)]
pub struct RigidBodySplitting<V> {
    body: RigidBody<V, 3>,
    h: f64,
    /// `1/I_a`.
    shared: f64,
    /// The axis u_b with `1/I_b - 1/I_a`.
    first: Turn,
    /// The axis u_c with `1/I_c - 1/I_a`; `None` for a symmetric body.
    second: Option<Turn>,
    /// In units of h; the kicks are one more.
    drifts: Vec<f64>,
    kicks: Vec<f64>,
}

/// A part `factor (Pi . axis)^2/2` of the kinetic energy.
#[derive(Clone, Copy, Debug)]
struct Turn {
    axis: SVector<f64, 3>,
    factor: f64,
}

/// The state within a step, at the time s after its start. The momentum and the action are divided by `e^(gamma s)`,
/// and the momentum is at g0 in the body, where turns leave it unchanged.
struct Inner<T> {
    f: Rotation<T>,
    at_start: SVector<T, 3>,
    kicks: SVector<T, 3>,
    z: T,
    s: f64,
}

impl<V> RigidBodySplitting<V> {
    /// The splitting of a body by a scheme with the step h. A Runge-Kutta-Nyström scheme needs a body with two equal
    /// moments of inertia.
    ///
    /// # Errors
    /// [`GroupError::Step`], [`GroupError::NeedsComposition`], and those of [`Inertia::new`].
    pub fn new(body: RigidBody<V, 3>, scheme: SplittingScheme, h: f64) -> Result<Self, GroupError> {
        if !(h.is_finite() && h != 0.0) {
            return Err(GroupError::Step { h });
        }
        let inertia = Inertia::new(*body.mass())?;
        let inverse = inertia.moments().map(|i| 1.0 / i);
        // The pair (a, c) with the smallest difference; b is the third axis.
        let pairs = [[1, 0, 2], [0, 1, 2], [0, 2, 1]];
        let difference = |[a, _, c]: [usize; 3]| inverse[c] - inverse[a];
        let nearest = |best: [usize; 3], next: [usize; 3]| {
            if difference(next).abs() < difference(best).abs() { next } else { best }
        };
        let [a, b, c] = pairs.into_iter().fold(pairs[0], nearest);
        let axis = |k: usize| inertia.axes().column(k).into_owned();
        let rest = difference([a, b, c]);
        // Moments that differ by round-off are equal.
        let symmetric = rest.abs() <= 8.0 * f64::EPSILON * inverse[a];
        if !symmetric && scheme.is_nystrom() {
            return Err(GroupError::NeedsComposition { scheme: scheme.name() });
        }
        let (drifts, kicks) = scheme.coefficients();
        Ok(RigidBodySplitting {
            body,
            h,
            shared: inverse[a],
            first: Turn { axis: axis(b), factor: inverse[b] - inverse[a] },
            second: (!symmetric).then(|| Turn { axis: axis(c), factor: rest }),
            drifts,
            kicks,
        })
    }

    /// The body.
    pub fn body(&self) -> &RigidBody<V, 3> {
        &self.body
    }

    /// The body momentum divided by `e^(gamma s)`.
    fn momentum<T: Scalar>(&self, inner: &Inner<T>) -> SVector<T, 3> {
        inner.f.apply_inverse(&(inner.at_start + inner.kicks))
    }

    /// The time `int e^(gamma s) ds` of a free body over the duration d from the time s.
    fn free_time(&self, s: f64, d: f64) -> f64 {
        let gamma = self.body.gamma();
        let free = if gamma == 0.0 { d } else { (gamma * d).exp_m1() / gamma };
        free * (gamma * s).exp()
    }

    /// The flow of the symmetric part for a time of the free body.
    fn symmetric_turn<T: Scalar>(&self, inner: &mut Inner<T>, time: f64) {
        let momentum = self.momentum(inner);
        let axis = self.first.axis.map(T::from);
        let along = momentum.dot(&axis);
        let about_momentum = Rotations::exp(&(momentum * T::from(self.shared * time)));
        let about_axis = Rotations::exp(&(axis * (along * (self.first.factor * time))));
        inner.f = Rotations::compose(&inner.f, &Rotations::compose(&about_momentum, &about_axis));
        inner.z += (momentum.dot(&momentum) * self.shared + along * along * self.first.factor) * (0.5 * time);
    }

    /// The flow of the rest of the kinetic energy.
    fn axis_turn<T: Scalar>(&self, inner: &mut Inner<T>, turn: &Turn, time: f64) {
        let axis = turn.axis.map(T::from);
        let along = self.momentum(inner).dot(&axis);
        inner.f = Rotations::compose(&inner.f, &Rotations::exp(&(axis * (along * (turn.factor * time)))));
        inner.z += along * along * (0.5 * turn.factor * time);
    }

    /// The kinetic part with drag for a duration: one flow for a symmetric body, a Strang splitting for others.
    fn drift<T: Scalar>(&self, inner: &mut Inner<T>, d: f64) {
        let (s, end) = (inner.s, inner.s + d);
        match &self.second {
            None => self.symmetric_turn(inner, self.free_time(s, d)),
            Some(turn) => {
                let factor = |s: f64| (self.body.gamma() * s).exp();
                self.symmetric_turn(inner, 0.5 * d * factor(s));
                self.axis_turn(inner, turn, self.free_time(s, d));
                self.symmetric_turn(inner, 0.5 * d * factor(end));
            }
        }
        inner.s = end;
    }
}

impl<V: GroupPotential<Rotations, 3>> GroupIntegrator<Rotations, 3> for RigidBodySplitting<V> {
    fn step_size(&self) -> f64 {
        self.h
    }

    fn step_by<T: Scalar>(
        &self,
        h: f64,
        _t: f64,
        from: &GroupState<Rotations, 3, T>,
        _velocity: &SVector<T, 3>,
    ) -> Result<GroupStep<3, T>, GroupError> {
        let gamma = self.body.gamma();
        let zero = SVector::<T, 3>::zeros();
        let mut inner = Inner { f: Rotations::identity(), at_start: from.momentum, kicks: zero, z: T::zero(), s: 0.0 };
        for (i, kick) in self.kicks.iter().enumerate() {
            if *kick != 0.0 {
                let weight = kick * h * (-gamma * inner.s).exp();
                let (potential, gradient) = self.body.potential().with_gradient(&Rotations::compose(&from.g, &inner.f));
                inner.kicks -= inner.f.apply(&gradient) * T::from(weight);
                inner.z -= potential * weight;
            }
            if let Some(drift) = self.drifts.get(i) {
                self.drift(&mut inner, drift * h);
            }
        }
        let sigma = (gamma * h).exp();
        let sigma_minus_one = (gamma * h).exp_m1();
        let velocity = self.body.velocity(&(self.momentum(&inner) * T::from(sigma)));
        Ok(GroupStep {
            increment: Rotations::log(&inner.f),
            impulse: inner.kicks * T::from(sigma),
            sigma_minus_one: T::from(sigma_minus_one),
            action: inner.z * sigma + from.z * sigma_minus_one,
            velocity,
        })
    }

    fn velocity(&self, _t: f64, from: &GroupState<Rotations, 3>) -> Result<SVector<f64, 3>, GroupError> {
        Ok(self.body.velocity(&from.momentum))
    }
}
