//! A system that is evaluated at one point at a time, as collocation sees it.

use crate::gauss::routes::hamiltonian::HamiltonianKernel;
use crate::gauss::routes::separable::{Iterated, IterationStart, Separable, SeparableKernel};
use crate::gauss::stages::stage_values::CondensedStages;
use crate::gauss::system::{PointDerivatives, PointGradient, PointRef, SharedKernels, SystemAtPoints};
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{MAX_STAGES, Stages};
use crate::system::{AtState, caught};
use crate::{Components, Point, State, StepError, System, Vector};
use contact_geom::nalgebra::DMatrix;
use std::rc::Rc;

/// Any [`System`]. Collocation evaluates it at all stages of a step at once by its kernels, or else its value and its
/// derivatives at one stage after another.
pub(crate) struct ByPoints<'a> {
    pub system: Rc<dyn System + 'a>,
    pub kernels: Option<SharedKernels>,
}

impl<'a> ByPoints<'a> {
    pub fn new(system: Rc<dyn System + 'a>) -> Self {
        let kernels = system.kernels().and_then(|kernels| kernels.shared());
        ByPoints { system, kernels }
    }
}

fn point(x: PointRef<'_>) -> Point {
    Point { q: x.q.into(), v: x.v.into(), z: x.z }
}

fn state(x: PointRef<'_>) -> State {
    State { q: x.q.into(), p: x.v.into(), z: x.z }
}

/// A position with the velocity and the action 0.
fn at_rest(q: &[f64]) -> Point {
    Point { q: q.into(), v: Vector::zeros(q.len()), z: 0.0 }
}

fn set(to: &mut PointGradient, from: &Components) {
    to.q.copy_from_slice(&from.x);
    to.v.copy_from_slice(&from.y);
    to.z = from.z;
}

impl SystemAtPoints for ByPoints<'_> {
    fn dimension(&self) -> usize {
        self.system.dimension()
    }

    fn is_forced(&self) -> bool {
        self.system.hints().forced
    }

    fn has_cones(&self) -> bool {
        self.system.has_cones()
    }

    fn value(&self, t: f64, x: PointRef<'_>) -> f64 {
        self.system.value(t, &point(x))
    }

    fn stage_value(&self, t: f64, x: PointRef<'_>, gradient: &mut PointGradient, force: &mut [f64]) -> f64 {
        let x = point(x);
        set(gradient, &self.system.gradient(t, &x));
        force.copy_from_slice(&gradient.q);
        if self.is_forced() {
            force.iter_mut().zip(&self.system.applied_force(t, &x)).for_each(|(sum, f)| *sum += f);
        }
        self.system.value(t, &x)
    }

    fn gradient(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) {
        set(out, &self.system.gradient(t, &point(x)));
    }

    fn derivatives(&self, t: f64, x: PointRef<'_>, out: &mut PointDerivatives) {
        let x = point(x);
        out.value = self.system.value(t, &x);
        set(&mut out.gradient, &self.system.gradient(t, &x));
        let second = self.system.hessian(t, &x);
        out.qq.copy_from(&second.qq);
        out.qv.copy_from(&second.qv);
        out.vv.copy_from(&second.vv);
        out.qz.copy_from_slice(&second.qz);
        out.vz.copy_from_slice(&second.vz);
        out.zz = second.zz;
        if let (Some(to), Some(applied)) = (&mut out.force, self.system.force_derivatives(t, &x)) {
            to.value.copy_from_slice(&applied.value);
            to.q.copy_from(&applied.q);
            to.v.copy_from(&applied.v);
            to.z.copy_from_slice(&applied.z);
        }
    }

    fn hamiltonian(&self, _t: f64, _x: PointRef<'_>, _out: &mut PointGradient) -> Option<f64> {
        None
    }

    fn hamiltonian_derivatives(&self, _t: f64, _x: PointRef<'_>, _out: &mut PointDerivatives) -> bool {
        false
    }

    fn applied_force(&self, t: f64, x: PointRef<'_>, out: &mut [f64]) {
        match self.is_forced() {
            true => out.copy_from_slice(&self.system.applied_force(t, &point(x))),
            false => out.fill(0.0),
        }
    }

    fn force(&self, t: f64, q: &[f64], out: &mut [f64]) {
        let x = at_rest(q);
        out.copy_from_slice(&self.system.gradient(t, &x).x);
        if self.is_forced() {
            out.iter_mut().zip(&self.system.applied_force(t, &x)).for_each(|(sum, f)| *sum += f);
        }
    }

    fn curvature(&self, t: f64, q: &[f64], out: &mut DMatrix<f64>) {
        let x = at_rest(q);
        out.copy_from(&self.system.hessian(t, &x).qq);
        if let Some(applied) = self.system.force_derivatives(t, &x) {
            *out += applied.q;
        }
    }

    fn mass_matrix(&self, t: f64, x: PointRef<'_>, out: &mut DMatrix<f64>) {
        out.copy_from(&self.system.mass_matrix(t, &point(x)));
    }

    fn rounding(&self, t: f64, x: PointRef<'_>, out: &mut PointGradient) -> f64 {
        let (of_value, once) = self.system.rounding(t, &point(x));
        set(out, &once);
        of_value
    }

    fn rounding_at_state(&self, t: f64, x: PointRef<'_>, p: &[f64], out: &mut PointGradient) -> f64 {
        let state = State { q: x.q.into(), p: p.into(), z: x.z };
        let (of_value, once) = self.system.rounding_at_state(t, &point(x), &state);
        set(out, &once);
        of_value
    }

    fn velocity(&self, t: f64, at: PointRef<'_>, near: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        out.copy_from_slice(&self.system.legendre_inverse(t, &state(at), near)?.v);
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
        let AtState { x, force, rate, .. } = self.system.at_state(t, &state(at), near)?;
        v.copy_from_slice(&x.v);
        out.q.copy_from_slice(&force);
        out.z = rate;
        Ok(())
    }

    fn dt_dtau(&self, q: &[f64]) -> f64 {
        self.system.dt_dtau(&q.into())
    }
}

/// Systems without kernels have no condensed steps.
impl SeparableKernel for ByPoints<'_> {
    fn iterate(&self, arch: Instructions, run: &mut Separable, start: IterationStart) -> Iterated {
        match &self.kernels {
            Some(kernels) => caught(|| kernels.iterate(arch, &mut *run, start), Iterated::failed),
            None => Iterated::failed(),
        }
    }

    fn stage_values(&self, arch: Instructions, solved: CondensedStages<'_>) -> Stages {
        let undefined = || Stages([f64::NAN; MAX_STAGES]);
        self.kernels.as_ref().map_or(Stages::ZERO, |kernels| caught(|| kernels.stage_values(arch, solved), undefined))
    }
}

impl HamiltonianKernel for ByPoints<'_> {}
