//! Contact Gauss collocation.

pub(crate) mod checks;
mod choice;
mod collocation_stepper;
mod curve;
mod dense;
mod initial_mass;
pub(crate) mod integrator;
pub(crate) mod limits;
pub(crate) mod resolution;
pub(crate) mod routes;
pub(crate) mod stages;
mod stepper;
mod steps;
pub(crate) mod system;
pub(crate) mod tables;
mod virtual_work;
mod work_summary;

pub(crate) use collocation_stepper::CollocationStepper;
pub(crate) use dense::{StepStart, curve_through};
pub(crate) use integrator::info;
pub(crate) use resolution::defect_sample::{DefectSample, SAMPLE_SETS};
pub use routes::transformed::TransformedStepper;
pub use stepper::GaussStepper;
pub use virtual_work::VirtualWork;
pub use work_summary::GaussRoute;

use crate::integration::check_unforced;
use crate::{DiscreteLagrangian, DiscreteStep, InputError, StepError, solve::Solver};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{
    ChartVector, Derivatives, DiscreteJet, DiscretePoint, Dual, Lagrangian, PhasePoint, Scalar, SecondDiscreteJet,
    support::seed,
};
use stages::equations::{Given as GivenValues, Products, StageEquations as Plain, Workspace};
use stages::lifted_equations::{Given, StageEquations, StepEnd};
use system::{PointRef, Typed};
pub(crate) use tables::coefficients::MAX_STAGES;

/// Contact Gauss collocation with `s` stages, of order `2s`, for every regular Lagrangian. Its discrete Lagrangian is
/// `L_d(q0, q1, z0) = z1 - z0`, defined by the stage equations
///
/// `Q = q0 + hA V`, `Z = z0 + hA L`, `rho = 1 - hA (rho L_z)`, `rho L_v = p0 + hA (rho L_q)`,
///
/// with the end of the step `q1 = q0 + hb.V`, `p1 = (p0 + hb.(rho L_q)) / rho1`, `rho1 = 1 - hb.(rho L_z)`,
/// `sigma_d = 1 / rho1`.
///
/// `(rho L_v)' = rho L_q` with `rho' = -rho L_z` is Herglotz' equation. The method is Gauss collocation applied to the
/// symplectified motion and reduced to the contact phase space; its flow is therefore conformally contact up to
/// round-off. It is symmetric. As a [`DiscreteLagrangian`] it solves the stage equations by Newton's method, starting
/// from a constant velocity. Runs by [`GaussCollocation`](crate::GaussCollocation) take the same steps in a fraction of
/// the time.
///
/// ```
/// use contact_examples::systems::DoublePendulum;
/// use contact_geom::DiscretePoint;
/// use discrete_herglotz::{DiscreteLagrangian, gauss::Gauss};
/// let ld = Gauss::new(DoublePendulum::default(), 8, 0.1)?;
/// let x = DiscretePoint::new([1.0, 0.5], [0.95, 0.5], 0.0);
/// println!("L_d = {}, sigma_d = {}", ld.value(0.0, &x)?, ld.jet(0.0, &x)?.sigma());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Gauss<L> {
    lagrangian: L,
    forward: Products,
    backward: Products,
}

impl<L> Gauss<L> {
    /// The largest number of stages.
    pub const STAGES: usize = MAX_STAGES;

    /// The method with `stages` from 1 to 16 and the time step `h`.
    ///
    /// # Errors
    /// [`InputError::Stages`], [`InputError::Step`], [`InputError::Dimension`].
    pub fn new<const N: usize>(lagrangian: L, stages: usize, h: f64) -> Result<Self, InputError>
    where
        L: Lagrangian<N>,
    {
        checks::check_step(stages, h)?;
        if N == 0 {
            return Err(InputError::Dimension);
        }
        check_unforced(&lagrangian, "a discrete Lagrangian")?;
        Ok(Gauss { lagrangian, forward: Products::new(stages, h), backward: Products::new(stages, -h) })
    }

    /// The Lagrangian.
    pub fn lagrangian(&self) -> &L {
        &self.lagrangian
    }

    /// The number of stages.
    pub fn stages(&self) -> usize {
        self.forward.s
    }

    /// The stage equations of a step forward or backward in time.
    fn equations<const N: usize>(&self, t: f64, forward: bool) -> StageEquations<'_, L, N> {
        let products = if forward { &self.forward } else { &self.backward };
        StageEquations { lagrangian: &self.lagrangian, products, t }
    }

    /// A step from a state, forward or backward in time.
    fn transition<const N: usize>(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        forward: bool,
    ) -> Result<DiscreteStep<N>, StepError>
    where
        L: Lagrangian<N>,
    {
        let equations = self.equations(t, forward);
        let (system, start) = (Typed(&self.lagrangian), PointRef::of_state(from));
        let mut work = Workspace::new(&system, self.stages(), false);
        let plain = Plain { system: &system, products: equations.products, t };
        let iterations = plain.solve(&GivenValues::Start(start), guess.as_slice(), start.v, &mut work)?;
        let (x, l) = work.solution::<N>();
        let end = equations.end(&Given::Start(*from), &x, &l);
        let velocity = (0..self.stages()).fold(SVector::zeros(), |sum, j| sum + x.v[j] * self.forward.weight(j));
        DiscreteStep {
            end: PhasePoint { q: end.q, p: end.p, z: from.z + end.action },
            velocity,
            sigma: if forward { 1.0 / end.rho } else { end.rho },
            iterations,
        }
        .checked()
    }

    /// Solves the stage equations between two given points, over `f64`.
    fn between<const N: usize>(&self, t: f64, x: &DiscretePoint<N>) -> Result<Workspace, StepError>
    where
        L: Lagrangian<N>,
    {
        let system = Typed(&self.lagrangian);
        let u = (x.q1 - x.q0) / self.forward.h;
        let middle = contact_geom::VelocityPoint { q: (x.q0 + x.q1) * 0.5, v: u, z: x.z0 };
        let p = self.lagrangian.gradient(t + 0.5 * self.forward.h, &middle).y;
        let mut work = Workspace::new(&system, self.stages(), true);
        let equations = Plain { system: &system, products: &self.forward, t };
        equations.solve(&ends_of(x), u.as_slice(), p.as_slice(), &mut work)?;
        Ok(work)
    }

    /// The end of the step between two points over a scalar with derivatives, from the solved stages over `f64`.
    fn lifted_end<const N: usize, T: Scalar>(
        &self,
        t: f64,
        x: &DiscretePoint<N, T>,
        plain: &DiscretePoint<N>,
        work: &mut Workspace,
    ) -> Result<StepEnd<N, T>, StepError>
    where
        L: Lagrangian<N>,
    {
        let equations = Plain { system: &Typed(&self.lagrangian), products: &self.forward, t };
        let inverse = equations.inverse_jacobian(&ends_of(plain), work).ok_or(StepError::Singular { pivot: 0.0 })?;
        let given = Given::Ends { q0: x.q0, q1: x.q1, z0: x.z0 };
        self.equations(t, true).lifted_end(&given, &work.solution().0, &inverse)
    }
}

/// The ends of a step as given values.
fn ends_of<const N: usize>(x: &DiscretePoint<N>) -> GivenValues<'_> {
    GivenValues::Ends { q0: x.q0.as_slice(), q1: x.q1.as_slice(), z0: x.z0 }
}

impl<const N: usize, L: Lagrangian<N>> DiscreteLagrangian<N> for Gauss<L> {
    fn step_size(&self) -> f64 {
        self.forward.h
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        let point = DiscretePoint { q0: x.q0.map(|e| e.re()), q1: x.q1.map(|e| e.re()), z0: x.z0.re() };
        let mut work = self.between(t, &point)?;
        Ok(self.lifted_end(t, x, &point, &mut work)?.action)
    }

    /// From the momenta of the solved step: `D1 = -sigma_d p0`, `D2 = p1`.
    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        let (given, (stages, l)) = (Given::Ends { q0: x.q0, q1: x.q1, z0: x.z0 }, self.between(t, x)?.solution());
        let end = self.equations(t, true).end(&given, &stages, &l);
        let sigma = 1.0 / end.rho;
        Ok(DiscreteJet::new(end.action, end.p0 * -sigma, end.p, (1.0 - end.rho) * sigma).with_sigma(sigma))
    }

    /// From the derivatives of the step, by one linear system; the nested dual numbers of [`value`](Self::value) are
    /// not needed.
    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        let mut work = self.between(t, x)?;
        let seeded: DiscretePoint<N, Dual<f64, ChartVector<N>>> = seed(&ChartVector::from(*x)).into();
        let end = self.lifted_end(t, &seeded, x, &mut work)?;
        let sigma = end.rho.recip();
        let (d1, d2) = (end.p0.map(|p| -(p * sigma)), end.p);
        let dz = ((-end.rho + 1.0) * sigma).re;
        let first = DiscreteJet::new(end.action.re, d1.map(|d| d.re), d2.map(|d| d.re), dz).with_sigma(sigma.re);
        Ok(SecondDiscreteJet {
            first,
            d11: SMatrix::from_fn(|i, j| d1[i].d.x[j]),
            d12: SMatrix::from_fn(|i, j| d1[i].d.y[j]),
            d22: SMatrix::from_fn(|i, j| d2[i].d.y[j]),
            d1z: SVector::from_fn(|i, _| d1[i].d.z),
            d2z: SVector::from_fn(|i, _| d2[i].d.z),
            dzz: sigma.d.z,
        })
    }

    fn forward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        _solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        self.transition(t, from, guess, true)
    }

    /// A step with `-h` from the end, since the method is symmetric.
    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        _solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        self.transition(t + self.forward.h, from, guess, false)
    }
}
