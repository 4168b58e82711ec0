//! A system that is evaluated at one point at a time, as collocation sees it.

use crate::gauss::routes::hamiltonian::HamiltonianKernel;
use crate::gauss::routes::separable::SeparableKernel;
use crate::gauss::system::{PointDerivatives, PointGradient, PointRef, SystemAtPoints};
use crate::numbers::registers::Stages;
use crate::system::AtState;
use crate::{Components, Point, State, StepError, System, Vector};
use contact_geom::nalgebra::DMatrix;
use std::rc::Rc;

/// Any [`System`] without an applied force, in its general form: collocation evaluates its value and its derivatives at one
/// stage after another.
pub(crate) struct ByPoints<'a>(pub Rc<dyn System + 'a>);

fn point(x: PointRef<'_>) -> Point {
    Point { q: x.q.into(), v: x.v.into(), z: x.z }
}

fn state(x: PointRef<'_>) -> State {
    State { q: x.q.into(), p: x.v.into(), z: x.z }
}

fn set(to: &mut PointGradient, from: &Components) {
    to.q.copy_from_slice(&from.x);
    to.v.copy_from_slice(&from.y);
    to.z = from.z;
}

impl SystemAtPoints for ByPoints<'_> {
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    fn is_forced(&self) -> bool {
        false
    }

    fn value(&self, t: f64, x: PointRef<'_>) -> f64 {
        self.0.value(t, &point(x))
    }

    fn value_at_stage(&self, t: f64, i: usize, q: &[Stages], v: &[Stages]) -> f64 {
        let at = |of: &[Stages]| of.iter().map(|x| x.0[i]).collect();
        self.0.value(t, &Point { q: at(q), v: at(v), z: 0.0 })
    }

    fn stage_value(&self, t: f64, x: PointRef<'_>, gradient: &mut PointGradient, force: &mut [f64]) -> f64 {
        let x = point(x);
        set(gradient, &self.0.gradient(t, &x));
        force.copy_from_slice(&gradient.q);
        self.0.value(t, &x)
    }

    fn gradient(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) {
        set(out, &self.0.gradient(t, &point(x)));
    }

    fn derivatives(&self, t: f64, x: PointRef<'_>, out: &mut PointDerivatives) {
        let x = point(x);
        out.value = self.0.value(t, &x);
        set(&mut out.gradient, &self.0.gradient(t, &x));
        let second = self.0.hessian(t, &x);
        out.qq.copy_from(&second.qq);
        out.qv.copy_from(&second.qv);
        out.vv.copy_from(&second.vv);
        out.qz.copy_from_slice(&second.qz);
        out.vz.copy_from_slice(&second.vz);
        out.zz = second.zz;
    }

    fn hamiltonian(&self, _t: f64, _x: PointRef<'_>, _out: &mut PointGradient) -> Option<f64> {
        None
    }

    fn hamiltonian_derivatives(&self, _t: f64, _x: PointRef<'_>, _out: &mut PointDerivatives) -> bool {
        false
    }

    fn applied_force(&self, _t: f64, _x: PointRef<'_>, out: &mut [f64]) {
        out.fill(0.0);
    }

    fn force(&self, t: f64, q: &[f64], out: &mut [f64]) {
        let x = Point { q: q.into(), v: Vector::zeros(q.len()), z: 0.0 };
        out.copy_from_slice(&self.0.gradient(t, &x).x);
    }

    fn curvature(&self, t: f64, q: &[f64], out: &mut DMatrix<f64>) {
        let x = Point { q: q.into(), v: Vector::zeros(q.len()), z: 0.0 };
        out.copy_from(&self.0.hessian(t, &x).qq);
    }

    fn mass_matrix(&self, t: f64, x: PointRef<'_>, out: &mut DMatrix<f64>) {
        out.copy_from(&self.0.mass_matrix(t, &point(x)));
    }

    fn rounding(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) -> f64 {
        let (of_value, once) = self.0.rounding(t, &point(x));
        set(out, &once);
        of_value
    }

    fn rounding_at_state(&self, t: f64, x: PointRef<'_>, p: &[f64], out: &mut PointGradient) -> f64 {
        let state = State { q: x.q.into(), p: p.into(), z: x.z };
        let (of_value, once) = self.0.rounding_at_state(t, &point(x), &state);
        set(out, &once);
        of_value
    }

    fn velocity(&self, t: f64, at: PointRef<'_>, near: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        out.copy_from_slice(&self.0.legendre_inverse(t, &state(at), near)?.v);
        Ok(())
    }

    fn at_state(
        &self,
        t: f64,
        at: PointRef<'_>,
        near: &[f64],
        v: &mut [f64],
        out: &mut PointGradient,
    ) -> Result<(), StepError> {
        let AtState { x, force, rate, .. } = self.0.at_state(t, &state(at), near)?;
        v.copy_from_slice(&x.v);
        out.q.copy_from_slice(&force);
        out.z = rate;
        Ok(())
    }

    fn dt_dtau(&self, q: &[f64]) -> f64 {
        self.0.dt_dtau(&q.into())
    }
}

impl SeparableKernel for ByPoints<'_> {}
impl HamiltonianKernel for ByPoints<'_> {}
