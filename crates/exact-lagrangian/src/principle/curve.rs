//! Herglotz' principle: the action of a curve, and its derivative with respect to the curve.

use crate::numerics::flow::{ACCURACY, Work, integrate};
use crate::numerics::panel::{Rate, Rates, State};
use crate::{ExactError, herglotz_flow};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, GeometryError, Lagrangian, VelocityPoint};
use std::cell::RefCell;

/// A curve in Q, or a variation of one: position and velocity at each time, counted from the curve's start.
///
/// Any function of time that returns both is a curve; it must be smooth between its [`breaks`](Self::breaks).
pub trait Curve<const N: usize> {
    /// Position and velocity at the time s after the start.
    ///
    /// # Errors
    /// A [`GeometryError`] where the curve is not defined.
    fn at(&self, s: f64) -> Result<(SVector<f64, N>, SVector<f64, N>), GeometryError>;

    /// The times, in ascending order, at which the curve is not smooth, such as the nodes of a spline.
    fn breaks(&self) -> &[f64] {
        &[]
    }
}

impl<const N: usize, F: Fn(f64) -> (SVector<f64, N>, SVector<f64, N>)> Curve<N> for F {
    fn at(&self, s: f64) -> Result<(SVector<f64, N>, SVector<f64, N>), GeometryError> {
        Ok(self(s))
    }
}

/// The motion of a Lagrangian from a start, as a curve.
#[derive(Clone, Copy, Debug)]
pub struct MotionCurve<'a, L, const N: usize> {
    /// The Lagrangian.
    pub lagrangian: &'a L,
    /// The time of the start.
    pub t0: f64,
    /// The start.
    pub start: VelocityPoint<N>,
}

impl<L: Lagrangian<N>, const N: usize> Curve<N> for MotionCurve<'_, L, N> {
    fn at(&self, s: f64) -> Result<(SVector<f64, N>, SVector<f64, N>), GeometryError> {
        let end = herglotz_flow(self.lagrangian, self.t0, &self.start, s)?.end;
        Ok((end.q, end.v))
    }
}

/// A curve with a multiple of a variation added.
#[derive(Clone, Copy, Debug)]
pub struct VariedCurve<'a, C, V> {
    /// The curve.
    pub curve: &'a C,
    /// The variation; its breaks must be among the curve's.
    pub variation: &'a V,
    /// The factor of the variation.
    pub by: f64,
}

impl<const N: usize, C: Curve<N>, V: Curve<N>> Curve<N> for VariedCurve<'_, C, V> {
    fn at(&self, s: f64) -> Result<(SVector<f64, N>, SVector<f64, N>), GeometryError> {
        let ((q, v), (dq, dv)) = (self.curve.at(s)?, self.variation.at(s)?);
        Ok((q + dq * self.by, v + dv * self.by))
    }

    fn breaks(&self) -> &[f64] {
        self.curve.breaks()
    }
}

/// The action along a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CurveAction {
    /// The end value `Z = z(t1)` of the action.
    pub z: f64,
    /// `b = int L_z` along the curve: `dZ/dz0 = e^b`.
    pub b: f64,
}

/// The action `Z(q, z0)` of a curve that starts at time `t0`, over a duration: the solution at its end of
/// `z' = L(t0 + s, q(s), q'(s), z)`, `z(0) = z0`; paper, section 2.2.1.
///
/// # Errors
/// [`ExactError::Input`] for non-finite arguments; those of the curve; [`ExactError::OutsideDomain`] where the action
/// is not defined up to the end, with the state reached.
pub fn action<C: Curve<N>, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    curve: &C,
    (t0, duration): (f64, f64),
    z0: f64,
) -> Result<CurveAction, ExactError<N>> {
    let along = AlongCurve { lagrangian, curve, t0, variation: None::<&C>, read: RefCell::default() };
    let (z, b) = along.solve(duration, (z0, 0.0))?;
    Ok(CurveAction { z, b })
}

/// The derivative of the action of a curve along a variation of the curve and of `z0`: the solution at the end of
/// `dz' = L_q dq + L_v dv + L_z dz`, `dz(t0) = dz0`. By Herglotz' principle it is zero for all variations that vanish
/// at both ends, with `dz0 = 0`, if and only if the curve solves Herglotz' equations; paper, section 2.2.1.
///
/// # Errors
/// Those of [`action`].
pub fn action_derivative<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    curve: &impl Curve<N>,
    variation: &impl Curve<N>,
    (t0, duration): (f64, f64),
    (z0, dz0): (f64, f64),
) -> Result<f64, ExactError<N>> {
    let along = AlongCurve { lagrangian, curve, t0, variation: Some(variation), read: RefCell::default() };
    Ok(along.solve(duration, (z0, dz0))?.1)
}

/// The action along a curve, as equations of motion with position zero: `z' = L`, and `b' = L_z` or, with a variation,
/// `b = dz`.
struct AlongCurve<'a, L, C, V, const N: usize> {
    lagrangian: &'a L,
    curve: &'a C,
    /// The time at which the curve starts.
    t0: f64,
    variation: Option<&'a V>,
    /// The points of the curve and of its variation that were evaluated last, with their times: the iterations of a
    /// panel return to the same times, and a point of a curve may require the computation of a whole motion.
    read: RefCell<Vec<(f64, [CurvePoint<N>; 2])>>,
}

/// Position and velocity on a curve.
type CurvePoint<const N: usize> = (SVector<f64, N>, SVector<f64, N>);

/// The number of times that are kept, sufficient for a panel and the one before.
const STORED_TIMES: usize = 64;

impl<L: Lagrangian<N>, C: Curve<N>, V: Curve<N>, const N: usize> Rates<N, f64> for AlongCurve<'_, L, C, V, N> {
    fn at(&self, s: f64, x: &State<N>) -> Result<Rate<N>, GeometryError> {
        let ([(q, v), (dq, dv)], t) = (self.read(s)?, self.t0 + s);
        let point = VelocityPoint { q, v, z: x.z };
        let g = self.lagrangian.gradient(t, &point);
        let b = match self.variation {
            None => g.z,
            Some(_) => g.x.dot(&dq) + g.y.dot(&dv) + g.z * x.b,
        };
        let z = self.lagrangian.value(t, &point.q, &point.v, x.z);
        Ok(Rate { a: SVector::zeros(), z, b })
    }
}

impl<L: Lagrangian<N>, C: Curve<N>, V: Curve<N>, const N: usize> AlongCurve<'_, L, C, V, N> {
    /// The curve and its variation at a time; 0 if there is no variation.
    fn read(&self, s: f64) -> Result<[CurvePoint<N>; 2], GeometryError> {
        let mut read = self.read.borrow_mut();
        if let Some((_, points)) = read.iter().rev().find(|(at, _)| at.to_bits() == s.to_bits()) {
            return Ok(*points);
        }
        let rest = (SVector::zeros(), SVector::zeros());
        let points = [self.curve.at(s)?, self.variation.map_or(Ok(rest), |variation| variation.at(s))?];
        if read.len() == STORED_TIMES {
            read.drain(..STORED_TIMES / 2);
        }
        read.push((s, points));
        Ok(points)
    }

    /// The end values of z and b, solved from break to break.
    fn solve(&self, duration: f64, (z0, b0): (f64, f64)) -> Result<(f64, f64), ExactError<N>> {
        let inside = |s: &&f64| (**s > duration.min(0.0)) && (**s < duration.max(0.0));
        let mut stops: Vec<f64> = self.curve.breaks().iter().filter(inside).copied().collect();
        if duration < 0.0 {
            stops.reverse();
        }
        let (mut s, mut z, mut b) = (0.0, z0, b0);
        let mut work = Work::default();
        for stop in stops.into_iter().chain([duration]) {
            let from = State { q: SVector::zeros(), v: SVector::zeros(), z, b };
            let motion = integrate(self, s, &from, stop - s, ACCURACY, &mut work).map_err(|e| self.located(e))?;
            (s, z, b) = (stop, motion.end.z, motion.b);
        }
        Ok((z, b))
    }

    /// The error with the state of the curve.
    fn located(&self, error: ExactError<N>) -> ExactError<N> {
        let on_curve = |s: f64, z: f64| {
            let (q, v) = self.curve.at(s).unwrap_or((SVector::zeros(), SVector::zeros()));
            VelocityPoint { q, v, z }
        };
        match error {
            ExactError::OutsideDomain { t: s, reached, cause } => {
                ExactError::OutsideDomain { t: self.t0 + s, reached: on_curve(s, reached.z), cause }
            }
            ExactError::Unfinished { t: s, reached } => {
                ExactError::Unfinished { t: self.t0 + s, reached: on_curve(s, reached.z) }
            }
            other => other,
        }
    }
}
