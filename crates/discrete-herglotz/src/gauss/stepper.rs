//! Runs of contact Gauss collocation.

use super::Gauss;
use super::condensed::Condensed;
use super::dense::{DenseStep, Solved, Start};
use super::extension::{Extension, Physical};
use super::general::{General, Mass, Table};
use super::linear::Linear;
use super::look::{Compare, Curve, Look};
use super::separable::Separable;
use super::stage_equations::{Given, Products, StageEquations, Workspace};
use super::sweeps::Progress;
use crate::lanes::forget_branches;
use crate::step_equations::{inverted, is_identity, kept_mass_matrix, mass_matrix};
use crate::{Halt, InputError, StepError, Stepper, Suspicion, verified};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, PhasePoint, Structure, Triple, VelocityPoint, linear};
use pulp::{Arch, Simd, WithSimd};

/// How the steps of contact Gauss collocation are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaussRoute {
    /// The motion is linear: one matrix, made once.
    Linear,
    /// Constant mass and constant rate of the conformal factor: the accelerations of the stages alone are iterated.
    Condensed,
    /// Velocities, actions and factors of the stages are iterated; the matrix W is constant.
    ConstantMass,
    /// The same with W taken at the stages of each step.
    General,
}

/// The largest dimension whose linear motion is advanced by one matrix.
const MOST_LINEAR: usize = 32;

/// The state and the workspace of a route.
#[allow(clippy::large_enum_variant)] // One is made for a run, in a box.
enum Route<'a, L, const N: usize> {
    /// In a box of its own: its matrices are larger than all that others hold.
    Linear(Box<Linear<N>>, Condensed),
    Condensed(Separable<'a, L, N>),
    General(General<'a, L, Physical, N>),
}

/// The misfit between the nodes from which a step does not resolve the motion: momenta are off by as much as they are.
const UNRESOLVED: f64 = 1.0;

/// How the last step was taken, for dense output.
enum Last {
    /// There is none, or the next one failed and left nothing of it.
    None,
    /// By the route; the stages are in its workspace.
    Route,
    /// By Newton's method; the stages are in its workspace.
    Newton,
}

/// Contact Gauss collocation at work: stages in the lanes of the processor's vector registers, each step's start extrapolated
/// from the one before, iteration to round-off, Newton's method where the iteration does not contract, compensated sums.
pub struct GaussStepper<'a, L, const N: usize> {
    lagrangian: &'a L,
    products: &'a Products,
    route: Box<Route<'a, L, N>>,
    mass: Option<Box<SMatrix<f64, N, N>>>,
    arch: Arch,
    t0: f64,
    k: usize,
    /// The state at the start of the last step.
    from: Start<N>,
    last: Last,
    newton: bool,
    /// Made for the first step that needs it.
    workspace: Option<Box<Workspace<N>>>,
    newton_steps: u64,
}

impl<'a, L: Lagrangian<N>, const N: usize> GaussStepper<'a, L, N> {
    pub(super) fn new(
        gauss: &'a Gauss<L>,
        t0: f64,
        state: PhasePoint<N>,
        guess: SVector<f64, N>,
        wants_z: bool,
    ) -> Result<Self, InputError> {
        let (lagrangian, s, h) = (&gauss.lagrangian, gauss.stages(), gauss.forward.h);
        let Beginning { start, structure, w, inverse } = Beginning::of(lagrangian, t0, &state, guess)?;
        let condensed = structure.separable && structure.has_constant_rate();
        let mut mass = None;
        let route = if condensed {
            let table = Condensed::new(s, h, lagrangian.gradient(t0, &start).z)?;
            let unit = is_identity(&w);
            mass = Some(w);
            // Of many coordinates the matrix costs more than the sweeps that it spares, and more room than the stack has.
            let linear = if structure.quadratic && structure.autonomous && const { N <= MOST_LINEAR } {
                Linear::new(lagrangian, &table, &inverse, t0, &start, wants_z)
            } else {
                None
            };
            match linear {
                Some(linear) => Route::Linear(linear, table),
                None => {
                    let left = table.preconditioned(0.0).ok_or(InputError::Step { h })?;
                    let inverse = (!unit).then_some(inverse);
                    Route::Condensed(Separable::new(lagrangian, table, left, inverse, &start, wants_z))
                }
            }
        } else {
            let mass = Mass::new(&structure, inverse);
            let physical = Extension::new(Physical, t0, 0.0);
            Route::General(General::new(lagrangian, physical, Table::new(s, h), mass, &state, &start.v))
        };
        Ok(GaussStepper {
            lagrangian,
            products: &gauss.forward,
            route: Box::new(route),
            mass,
            arch: Arch::new(),
            t0,
            k: 0,
            from: Start { q: [0.0; N], y: [0.0; N], z: 0.0 },
            last: Last::None,
            newton: true,
            workspace: None,
            newton_steps: 0,
        })
    }

    /// Without Newton's method: a step whose iteration does not contract then fails with [`StepError::NotConverged`].
    pub fn without_newton(mut self) -> Self {
        self.newton = false;
        self
    }

    /// How the steps are computed.
    pub fn route(&self) -> GaussRoute {
        match &*self.route {
            Route::Linear(..) => GaussRoute::Linear,
            Route::Condensed(_) => GaussRoute::Condensed,
            Route::General(General { mass: Mass::Constant(_), .. }) => GaussRoute::ConstantMass,
            Route::General(_) => GaussRoute::General,
        }
    }

    /// The steps that were solved by Newton's method, since the iteration did not contract.
    pub fn newton_steps(&self) -> u64 {
        self.newton_steps
    }

    /// The last step as a curve; `None` before the first, and after a step that could not be taken. It costs nothing where it
    /// is not asked for.
    pub fn dense(&self) -> Option<DenseStep<N>> {
        let (s, h) = (self.products.s, self.products.h);
        let t = self.t0 + self.k.checked_sub(1)? as f64 * h;
        let condensed = |table: &Condensed, a, wants_z| {
            let mass = self.mass.as_deref().copied().unwrap_or_else(SMatrix::identity);
            Solved::from_accelerations(self.lagrangian, table, &mass, t, &self.from, a, wants_z)
        };
        let start = self.phase(&self.from);
        let solved = match (&self.last, &*self.route) {
            (Last::None, _) => return None,
            (Last::Newton, route) => {
                let Workspace { x, l, .. } = self.workspace.as_deref()?;
                let mut solved = Solved::from_gradients(&x.v, &x.rho, l);
                if matches!(route, Route::Condensed(run) if !run.wants_z) {
                    solved.l.fill(0.0);
                }
                solved
            }
            (Last::Route, Route::Linear(run, table)) => {
                condensed(table, &run.accelerations(&self.from.q, &self.from.y), run.wants_z())
            }
            (Last::Route, Route::Condensed(run)) => condensed(&run.table, &run.a.map(|a| a.0), run.wants_z),
            (Last::Route, Route::General(run)) => run.solved(),
        };
        Some(DenseStep::new(s, t, h, start, &solved))
    }

    /// A look at the last step between its nodes, at some sets of points: the worst of them. `None` where there is no step, or none
    /// that was iterated.
    pub(crate) fn look(&self, sets: usize) -> Option<Look> {
        let curve = self.arch.dispatch(Stages { run: self })?;
        let at = |set| self.arch.dispatch(Compare { lagrangian: self.lagrangian, curve: &curve, set });
        (0..sets).map(at).reduce(|a, b| if a.misfit >= b.misfit { a } else { b })
    }

    /// The state as the route holds it.
    #[inline(always)]
    fn values(&self) -> Start<N> {
        let (q, y, z) = match &*self.route {
            Route::Linear(run, _) => (&run.q, &run.v, run.z),
            Route::Condensed(run) => (&run.q, &run.v, run.z),
            Route::General(run) => (&run.q, &run.p, run.z),
        };
        Start { q: q.map(|q| q.value), y: y.map(|y| y.value), z: z.value }
    }

    /// With momenta for the velocities of the condensed routes.
    fn phase(&self, x: &Start<N>) -> PhasePoint<N> {
        let y = SVector::from(x.y);
        PhasePoint { q: SVector::from(x.q), p: self.mass.as_ref().map_or(y, |mass| **mass * y), z: x.z }
    }

    /// Takes a step by Newton's method.
    #[cold]
    #[inline(never)]
    fn newton_step(&mut self, t: f64, refused: StepError) -> Result<(), StepError> {
        if !self.newton {
            return Err(refused);
        }
        let (values, from) = (self.values(), self.state());
        let equations = StageEquations { lagrangian: self.lagrangian, products: self.products, t };
        let given = Given::Start(from);
        let v = velocity(self.lagrangian, t, &from, SVector::zeros()).map_err(|_| refused)?;
        let work = self.workspace.get_or_insert_with(|| Box::new(equations.workspace(&given)));
        equations.solve(&given, &v, &from.p, work)?;
        let Workspace { x, l, .. } = &**work;
        let end = equations.end(&given, x, l);
        let mut next = PhasePoint { q: end.q, p: end.p, z: from.z + end.action };
        if !Triple::from(next).is_finite() {
            return Err(StepError::NonFinite);
        }
        if !(end.rho > 0.0 && end.rho.is_finite()) {
            return Err(StepError::SigmaVanished { sigma: 1.0 / end.rho });
        }
        let guess = x.v.last().copied().unwrap_or(v);
        let v = velocity(self.lagrangian, t + self.products.h, &next, guess).map_err(|_| refused)?;
        match &mut *self.route {
            // Its steps are not refused but where they are not finite.
            Route::Linear(..) => return Err(refused),
            Route::Condensed(run) => {
                if !run.wants_z {
                    next.z = from.z;
                }
                run.restart(&next, &v);
            }
            Route::General(run) => run.restart(&next, &v, 1.0 - end.rho),
        }
        self.newton_steps += 1;
        self.from = values;
        self.last = Last::Newton;
        Ok(())
    }
}

/// The stages of the last step, for a look between them.
struct Stages<'b, 'a, L, const N: usize> {
    run: &'b GaussStepper<'a, L, N>,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for Stages<'_, '_, L, N> {
    type Output = Option<Curve<N>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Option<Curve<N>> {
        let GaussStepper { products, route, last, workspace, from, k, t0, .. } = self.run;
        let start = self.run.phase(from);
        let t = t0 + k.checked_sub(1)? as f64 * products.h;
        let mut curve = Curve::new(products.s, t, products.h, &start);
        match (last, &**route) {
            (Last::None, _) | (Last::Route, Route::Linear(..)) => return None,
            (Last::Newton, route) => {
                let Workspace { x, l, .. } = workspace.as_deref()?;
                let wants_z = !matches!(route, Route::Condensed(run) if !run.wants_z);
                curve.of_gradients(&x.v, &x.rho, l, wants_z);
            }
            (Last::Route, Route::Condensed(run)) => {
                curve.of_accelerations::<S>(&run.table, self.run.mass.as_deref(), &from.y, &run.a);
            }
            (Last::Route, Route::General(run)) => {
                let solved = run.solved();
                (curve.v, curve.force) = (solved.v.map(super::stages::Stages), solved.force.map(super::stages::Stages));
                (curve.rate, curve.l) = (super::stages::Stages(solved.rate), Some(super::stages::Stages(solved.l)));
            }
        }
        Some(curve)
    }
}

/// Steps in the lanes of one instruction set; ends at a step that cannot be taken.
struct Advance<'b, 'a, L, const N: usize> {
    run: &'b mut GaussStepper<'a, L, N>,
    steps: usize,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for Advance<'_, '_, L, N> {
    type Output = Result<(), (usize, Progress)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Advance { run, steps } = self;
        forget_branches();
        let (t0, h) = (run.t0, run.products.h);
        if let Route::Linear(linear, _) = &mut *run.route {
            let (taken, from) = linear.advance(steps);
            run.k += taken;
            run.from = from;
            return if taken == steps { Ok(()) } else { Err((taken, Progress::NonFinite)) };
        }
        for taken in 0..steps {
            // Dense output is of the last step.
            if taken + 1 == steps {
                run.from = run.values();
            }
            let t = t0 + run.k as f64 * h;
            let progress = match &mut *run.route {
                Route::Linear(..) => Progress::Done,
                Route::Condensed(condensed) => condensed.step::<S>(t),
                Route::General(general) => general.step::<S>(t),
            };
            if progress != Progress::Done {
                return Err((taken, progress));
            }
            run.k += 1;
        }
        Ok(())
    }
}

impl<L: Lagrangian<N>, const N: usize> Stepper<N> for GaussStepper<'_, L, N> {
    fn advance(&mut self, steps: usize) -> Result<(), Halt> {
        let mut done = 0;
        while done < steps {
            let outcome = self.arch.dispatch(Advance { run: self, steps: steps - done });
            let Err((taken, progress)) = outcome else {
                self.last = Last::Route;
                break;
            };
            // The refused step has overwritten the stages of the one before.
            self.last = Last::None;
            done += taken;
            let refused = match progress {
                Progress::SigmaVanished { sigma } => {
                    return Err(Halt { taken: done, cause: StepError::SigmaVanished { sigma } });
                }
                Progress::Slow { change, sweeps } => StepError::NotConverged { residual: change, iterations: sweeps },
                Progress::Branched => StepError::Branched,
                _ => StepError::NonFinite,
            };
            self.newton_step(self.time(), refused).map_err(|cause| Halt { taken: done, cause })?;
            self.k += 1;
            done += 1;
        }
        Ok(())
    }

    fn state(&self) -> PhasePoint<N> {
        self.phase(&self.values())
    }

    fn time(&self) -> f64 {
        self.t0 + self.k as f64 * self.products.h
    }

    fn sigma(&self) -> f64 {
        match &*self.route {
            _ if self.k == 0 => 1.0,
            Route::Linear(_, table) => 1.0 + table.grow.head,
            Route::Condensed(run) => 1.0 + run.table.grow.head,
            Route::General(run) => 1.0 / (1.0 - run.fallen),
        }
    }

    fn evaluations(&self) -> u64 {
        match &*self.route {
            Route::Linear(..) => 0,
            Route::Condensed(run) => run.evaluations,
            Route::General(run) => run.evaluations,
        }
    }

    /// Looks at the last step alone, between its nodes: a run that wants more asks more often.
    fn suspicion(&self) -> Option<Suspicion> {
        let Look { misfit, .. } = self.look(1)?;
        // Not `misfit > ..`: that would let a NaN pass.
        if misfit <= UNRESOLVED { None } else { Some(Suspicion { step: self.k - 1, misfit: misfit / UNRESOLVED }) }
    }
}

/// What is found of a Lagrangian at the start of a run.
pub(super) struct Beginning<const N: usize> {
    pub start: VelocityPoint<N>,
    pub structure: Structure,
    /// W and its inverse.
    pub w: Box<SMatrix<f64, N, N>>,
    pub inverse: Box<SMatrix<f64, N, N>>,
}

impl<const N: usize> Beginning<N> {
    pub fn of(
        lagrangian: &impl Lagrangian<N>,
        t0: f64,
        state: &PhasePoint<N>,
        guess: SVector<f64, N>,
    ) -> Result<Self, InputError> {
        crate::run::check_time(t0)?;
        state.check()?;
        let v = velocity(lagrangian, t0, state, guess)?;
        let start = VelocityPoint { q: state.q, v, z: state.z };
        let structure = verified(lagrangian, t0, &start)?;
        let w = kept_mass_matrix(lagrangian, t0, &start);
        let inverse = inverted(&w).map_err(|e| InputError::FirstStep(StepError::Singular { pivot: e.pivot }))?;
        Ok(Beginning { start, structure, w, inverse })
    }
}

/// The velocity that belongs to a momentum, `L_v(t, q, v, z) = p`, by Newton's method.
#[inline(never)]
pub(crate) fn velocity<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: SVector<f64, N>,
) -> Result<SVector<f64, N>, InputError> {
    let mut x = VelocityPoint { q: state.q, v: guess, z: state.z };
    let mut before = f64::INFINITY;
    for _ in 0..crate::ITERATION_LIMIT {
        let mut change = lagrangian.gradient(t, &x).y - state.p;
        let mut w = mass_matrix(lagrangian, t, &x);
        linear::solve(&mut w, &mut change)
            .map_err(|e| InputError::FirstStep(StepError::Singular { pivot: e.pivot }))?;
        x.v -= change;
        let (size, scale) = (change.amax(), x.v.amax());
        if !(size + scale).is_finite() {
            return Err(InputError::FirstStep(StepError::NonFinite));
        }
        let round_off = f64::EPSILON * scale;
        if crate::last_correction(size, before, round_off) || (size >= 0.5 * before && size <= 64.0 * round_off) {
            return Ok(x.v);
        }
        before = size;
    }
    Err(InputError::FirstStep(StepError::NotConverged { residual: before, iterations: crate::ITERATION_LIMIT }))
}

#[cfg(test)]
mod tests;
