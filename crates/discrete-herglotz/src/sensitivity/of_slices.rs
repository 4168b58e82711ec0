//! A system over slices, as derivatives of runs see it: evaluated at all stages of a step at once, whatever its number of
//! coordinates.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::MAX_DIMENSION_IN_LANES;
use crate::gauss::system::KernelsOf;
use crate::integration::SolvedStages;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{MAX_STAGES, StageMap, Stages, blocks};
use crate::sensitivity::linear_stages::{Inhomogeneity, StageTangent};
use crate::sensitivity::of_system::{OfQuantities, OfSystem};
use crate::sensitivity::parametric_system::{ExplicitDerivatives, Quantities, Quantity, StageSystem};
use crate::sensitivity::stage_derivatives::StageDerivatives;
use crate::sensitivity::step_maps::StepMaps;
use crate::system::caught;
use crate::{Kernels, Point, StepError, System, Vector};
use contact_geom::nalgebra::{DMatrixViewMut, DVectorViewMut, SVector};
use contact_geom::support::{KernelDual, linear};
use contact_geom::{Arguments, ScalarSystem, SlicesVisitor, Slopes};
use pulp::{Simd, WithSimd};
use std::rc::Rc;
use std::sync::Arc;

/// Makes the stages of a system over slices, which is also given as a system.
pub(crate) struct BySlices<'a>(pub Rc<dyn System + 'a>);

impl<'a> SlicesVisitor for BySlices<'a> {
    type Output = Rc<dyn StageSystem<'a> + 'a>;

    fn visit<F: ScalarSystem + 'static>(self, slices: Arc<F>) -> Self::Output {
        Rc::new(OfSlices { slices, system: self.0 })
    }
}

/// A system over slices without its type.
trait Slices {
    /// Its stages.
    fn stages<'a>(&self, by: BySlices<'a>) -> Rc<dyn StageSystem<'a> + 'a>;
}

impl<F: ScalarSystem + 'static> Slices for Arc<F> {
    fn stages<'a>(&self, by: BySlices<'a>) -> Rc<dyn StageSystem<'a> + 'a> {
        by.visit(self.clone())
    }
}

impl Kernels {
    /// The kernels of a system.
    pub fn of<F: ScalarSystem + 'static>(system: Arc<F>) -> Self {
        let collocation = Rc::new(KernelsOf.visit(system.clone()));
        let derivatives: Box<dyn Slices> = Box::new(system);
        Kernels { collocation, derivatives: Rc::new(derivatives) }
    }

    /// The kernels for motions alone: derivatives of them are computed one stage after another. For small programs.
    pub fn of_motions<F: ScalarSystem + 'static>(system: Arc<F>) -> Self {
        Kernels { collocation: Rc::new(KernelsOf.visit(system)), derivatives: Rc::new(()) }
    }
}

/// The stages of a system: by its kernels, or one after another.
pub(crate) fn stages_of<'a>(system: &Rc<dyn System + 'a>) -> Rc<dyn StageSystem<'a> + 'a> {
    let kernels = system.kernels();
    match kernels.as_ref().and_then(|kernels| kernels.derivatives.downcast_ref::<Box<dyn Slices>>()) {
        Some(slices) => slices.stages(BySlices(system.clone())),
        None => Rc::new(OfSystem(system.clone())),
    }
}

struct OfSlices<'a, F> {
    slices: Arc<F>,
    system: Rc<dyn System + 'a>,
}

impl<'a, F: ScalarSystem + 'static> StageSystem<'a> for OfSlices<'a, F> {
    fn quantities(&self) -> Box<dyn Quantities + 'a> {
        match self.slices.parameters() {
            Some(count) => Box::new(SliceQuantities { slices: self.slices.clone(), count }),
            None => Box::new(OfQuantities::new(self.system.clone())),
        }
    }

    fn evaluate_stages(
        &self,
        arch: Instructions,
        at: &mut StageDerivatives,
        forward: &StepMaps,
        step: &SolvedStages,
        actions: Option<&StageMap>,
    ) -> Result<(), StepError> {
        let kernel = EvaluateStages { slices: &*self.slices, system: &*self.system, at, forward, step, actions };
        caught(|| arch.dispatch(kernel), || Err(StepError::NonFinite))
    }
}

/// The derivatives in parameters and time.
struct SliceQuantities<F> {
    slices: Arc<F>,
    count: usize,
}

fn parameter(of: Quantity) -> Option<usize> {
    match of {
        Quantity::Parameter(k) => Some(k),
        Quantity::Time => None,
    }
}

impl<F: ScalarSystem> Quantities for SliceQuantities<F> {
    fn count(&self) -> usize {
        self.count
    }

    fn at(&mut self, quantity: Quantity, t: f64, x: &Point) -> ExplicitDerivatives {
        let n = x.q.len();
        let found = || {
            let mut to = ExplicitDerivatives::zeros(n);
            let slopes = Slopes { q: &mut to.gradient.x, v: &mut to.gradient.y, z: &mut to.gradient.z };
            let at = Arguments { t, q: &x.q, v: &x.v, z: x.z };
            to.l = self.slices.explicit(parameter(quantity), at, slopes, &mut to.force);
            to
        };
        caught(found, || ExplicitDerivatives::undefined(n))
    }

    fn of_momentum(&mut self, quantity: Quantity, t: f64, (x, _): (&Point, &Vector)) -> Vector {
        self.at(quantity, t, x).gradient.y
    }

    fn add_at_stages(
        &mut self,
        arch: Instructions,
        quantity: Quantity,
        at: &StageDerivatives,
        factors: &Stages,
        to: &mut Inhomogeneity,
    ) {
        let undefined = caught(
            || {
                arch.dispatch(AddAtStages { slices: &*self.slices, quantity, at, factors, to: &mut *to });
                false
            },
            || true,
        );
        if undefined {
            to.z_source = Stages([f64::NAN; MAX_STAGES]);
        }
    }

    fn along(
        &mut self,
        arch: Instructions,
        quantity: Quantity,
        at: &StageDerivatives,
        (w, weights): (&StageTangent, &Stages),
    ) -> f64 {
        caught(|| arch.dispatch(QuantityAlong { slices: &*self.slices, quantity, at, w, weights }), || f64::NAN)
    }
}

/// Binds a name to this number of copies of a zero in registers, without memory on the heap up to a number of them, which are
/// set to zero in any case. A function that returned them would copy them.
macro_rules! registers {
    ($name:ident, $zero:expr, $count:expr, $few:literal) => {
        let (zero, count) = ($zero, $count);
        let (mut few, mut many) = ([zero; $few], Vec::new());
        let $name = if count <= $few {
            &mut few[..count]
        } else {
            many.resize(count, zero);
            &mut many[..]
        };
    };
}

/// Splits slices of the given lengths off the start of another, one after the other.
macro_rules! split {
    ($rest:ident, $($name:ident: $count:expr),*) => {
        $(let ($name, $rest) = $rest.split_at_mut($count);)*
        let _ = $rest;
    };
}

/// The derivatives in a quantity at a block of stages: of L, which is returned, and of `L_q`, `L_v`, `L_z` and f, which are
/// written to slices, as the force after the position and the velocity.
#[inline(always)]
fn in_quantity<S: Simd>(
    slices: &impl ScalarSystem,
    quantity: Quantity,
    at: &StageDerivatives,
    r: usize,
    ([q, v, force], to): ([&mut [Lanes<S>]; 3], Slopes<'_, Lanes<S>>),
) -> Lanes<S> {
    set_point(at, r, [q, v]);
    let arguments = Arguments { t: at.times.block(r), q, v, z: at.z.block(r) };
    slices.explicit(parameter(quantity), arguments, to, force)
}

/// See [`Quantities::add_at_stages`].
struct AddAtStages<'e, F> {
    slices: &'e F,
    quantity: Quantity,
    at: &'e StageDerivatives,
    factors: &'e Stages,
    to: &'e mut Inhomogeneity,
}

impl<F: ScalarSystem> WithSimd for AddAtStages<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let AddAtStages { slices, quantity, at, factors, to } = self;
        let n = at.q.len();
        registers!(all, Lanes::<S>::splat(0.0), 5 * n, 10);
        split!(all, q: n, v: n, force: n, of_q: n, of_v: n);
        for r in 0..blocks::<S>(at.s) {
            let mut of_z = Lanes::<S>::splat(0.0);
            let slopes = Slopes { q: &mut *of_q, v: &mut *of_v, z: &mut of_z };
            let l = in_quantity(slices, quantity, at, r, ([&mut *q, &mut *v, &mut *force], slopes));
            let factor = factors.block::<S>(r);
            for d in 0..n {
                let (v, p) = (&mut to.v_source[d], &mut to.p_source[d]);
                v.set(r, factor.mul_add(of_v[d], v.block(r)));
                p.set(r, factor.mul_add(of_q[d] + force[d], p.block(r)));
            }
            to.z_source.set(r, factor.mul_add(l, to.z_source.block(r)));
            to.r_source.set(r, factor.mul_add(of_z, to.r_source.block(r)));
        }
    }
}

/// See [`Quantities::along`].
struct QuantityAlong<'e, F> {
    slices: &'e F,
    quantity: Quantity,
    at: &'e StageDerivatives,
    w: &'e StageTangent,
    weights: &'e Stages,
}

impl<F: ScalarSystem> WithSimd for QuantityAlong<'_, F> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> f64 {
        let QuantityAlong { slices, quantity, at, w, weights } = self;
        let n = at.q.len();
        registers!(all, Lanes::<S>::splat(0.0), 5 * n, 10);
        split!(all, q: n, v: n, force: n, of_q: n, of_v: n);
        let mut sum = Lanes::<S>::splat(0.0);
        for r in 0..blocks::<S>(at.s) {
            let mut of_z = Lanes::<S>::splat(0.0);
            let slopes = Slopes { q: &mut *of_q, v: &mut *of_v, z: &mut of_z };
            let l = in_quantity(slices, quantity, at, r, ([&mut *q, &mut *v, &mut *force], slopes));
            let mut along = of_z * w.z.block(r);
            for d in 0..n {
                along = (of_q[d] + force[d]).mul_add(w.q[d].block(r), along);
                along = of_v[d].mul_add(w.v[d].block(r), along);
            }
            let along = w.r.block::<S>(r).mul_add(l, at.rho.block::<S>(r) * along);
            sum = weights.block::<S>(r).mul_add(along, sum);
        }
        sum.sum()
    }
}

/// Copies the position and the velocity at a block of stages.
#[inline(always)]
fn set_point<S: Simd>(at: &StageDerivatives, r: usize, [q, v]: [&mut [Lanes<S>]; 2]) {
    for d in 0..q.len() {
        q[d] = at.q[d].block(r);
        v[d] = at.v[d].block(r);
    }
}

/// See [`ParametricSystem::evaluate_stages`].
struct EvaluateStages<'e, F> {
    slices: &'e F,
    system: &'e dyn System,
    at: &'e mut StageDerivatives,
    forward: &'e StepMaps,
    step: &'e SolvedStages,
    actions: Option<&'e StageMap>,
}

impl<F: ScalarSystem> WithSimd for EvaluateStages<'_, F> {
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let EvaluateStages { slices, system, at, forward, step, actions } = self;
        at.set_points::<S>(forward, step);
        let mut regular = at.q.len() <= MAX_DIMENSION_IN_LANES || at.form.inverse_mass.is_some();
        for r in 0..blocks::<S>(step.s) {
            regular = regular && at.take::<S>(slices, r);
        }
        if !regular {
            // W is inverted at one stage after another, which finds where it is singular.
            for i in 0..step.s {
                at.evaluate_stage_of(system, i)?;
            }
        }
        if let (false, Some(actions)) = (step.knows_l, actions) {
            at.set_actions::<S>(forward, step, actions);
        }
        if slices.has_force() {
            for r in 0..blocks::<S>(step.s) {
                at.take_force::<S>(slices, r);
            }
        }
        Ok(())
    }
}

impl StageDerivatives {
    /// Evaluates L with its derivatives at a block of stages; `false` where W is singular.
    #[inline(always)]
    fn take<S: Simd>(&mut self, slices: &impl ScalarSystem, r: usize) -> bool {
        let n = self.q.len();
        let (t, z) = (self.times.block::<S>(r), self.z.block::<S>(r));
        registers!(all, Lanes::<S>::splat(0.0), 7 * n + 4 * n * n, 30);
        split!(all, q: n, v: n, l_q: n, l_v: n, qz: n, vz: n, column: n, qq: n * n, qv: n * n, vv: n * n, copy: n * n);
        set_point(self, r, [&mut *q, &mut *v]);
        let (mut l_z, mut zz) = (Lanes::<S>::splat(0.0), [Lanes::<S>::splat(0.0)]);
        let (at, to) = (Arguments { t, q, v, z }, Slopes { q: &mut *l_q, v: &mut *l_v, z: &mut l_z });
        let second = [&mut *qq, &mut *qv, &mut *vv, &mut *qz, &mut *vz, &mut zz];
        let l = slices.with_second_derivatives::<_, 0>(at, to, second);
        self.l.set(r, l);
        self.l_z.set(r, l_z);
        self.zz.set(r, zz[0]);
        for i in 0..n {
            self.l_q[i].set(r, l_q[i]);
            self.l_v[i].set(r, l_v[i]);
            self.qz[i].set(r, qz[i]);
            self.vz[i].set(r, vz[i]);
            for j in 0..n {
                self.qq[(i, j)].set(r, qq[i + n * j]);
                self.qv[(i, j)].set(r, qv[i + n * j]);
            }
        }
        let rho = self.rho.block::<S>(r);
        if let Some(inverse) = &self.form.inverse_mass {
            let scale = Lanes::<S>::splat(1.0) / rho;
            for i in 0..n {
                for j in 0..n {
                    self.inverse_mass[(i, j)].set(r, scale * inverse[(i, j)]);
                }
            }
            return true;
        }
        for w in vv.iter_mut() {
            *w *= rho;
        }
        for j in 0..n {
            copy.copy_from_slice(vv);
            column.fill(Lanes::splat(0.0));
            column[j] = Lanes::splat(1.0);
            let mut w = DMatrixViewMut::from_slice(copy, n, n);
            if linear::solve_in_kernel(&mut w, &mut DVectorViewMut::from_slice(column, n)).is_err() {
                return false;
            }
            for i in 0..n {
                self.inverse_mass[(i, j)].set(r, column[i]);
            }
        }
        true
    }

    /// Evaluates the applied force with its derivatives at a block of stages.
    #[inline(always)]
    fn take_force<S: Simd>(&mut self, slices: &impl ScalarSystem, r: usize) {
        type Along<S> = KernelDual<Lanes<S>, SVector<Lanes<S>, 1>>;
        let n = self.q.len();
        let at = Along::<S>::constant;
        let t = at(self.times.block::<S>(r));
        registers!(all, at(Lanes::<S>::splat(0.0)), 3 * n + 1, 10);
        // The position, the velocity and the action.
        split!(all, x: 2 * n + 1, force: n);
        for d in 0..n {
            (x[d], x[n + d]) = (at(self.q[d].block(r)), at(self.v[d].block(r)));
        }
        x[2 * n] = at(self.z.block(r));
        let Some(forces) = &mut self.force else { return };
        for j in 0..=2 * n {
            x[j].d[0] = Lanes::splat(1.0);
            slices.applied_force::<_, 0>(t, &x[..n], &x[n..2 * n], x[2 * n], force);
            x[j].d[0] = Lanes::splat(0.0);
            for i in 0..n {
                match j {
                    j if j < n => forces.q[(i, j)].set(r, force[i].d[0]),
                    j if j < 2 * n => forces.v[(i, j - n)].set(r, force[i].d[0]),
                    _ => {
                        forces.z[i].set(r, force[i].d[0]);
                        forces.value[i].set(r, force[i].re);
                    }
                }
            }
        }
    }
}
