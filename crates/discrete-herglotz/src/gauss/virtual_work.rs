//! The contact defect of a step of contact Gauss collocation with a force.

use crate::gauss::checks::check_step;
use crate::gauss::stages::equations::{Given as GivenValues, Products, StageEquations as Plain, Workspace};
use crate::gauss::stages::lifted_equations::{Given, StageEquations};
use crate::gauss::system::{PointRef, Typed};
use crate::{InputError, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, Dual, Lagrangian, OneParameterGroup, PhasePoint, VelocityPoint,
    numbers::{MaxAbsOrNan, MaxOrNan},
    support::seed,
};

/// A step of contact Gauss collocation from `(q0, p0, z0)` to `(q1, p1, z1)`, with its contact defect and the virtual
/// work of the applied force f.
///
/// Both are covectors at the start: `rho1 (dz1 - p1.dq1) - (dz0 - p0.dq0)`, and `-h sum_j b_j rho_j f_j.dQ_j` with the
/// stage positions `Q_j` and integrating factors `rho_j`. They are equal. So the step is conformally contact exactly
/// where the force does no virtual work, and always without a force.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::{Force, Forced, PhasePoint, Scalar, VelocityPoint, nalgebra::SVector};
/// use discrete_herglotz::gauss::VirtualWork;
/// struct Friction;
/// impl Force<1> for Friction {
///     fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<1, T>) -> SVector<T, 1> {
///         -x.v
///     }
/// }
/// let pendulum = Forced { lagrangian: Pendulum::default(), force: Friction };
/// let step = VirtualWork::of_step(&pendulum, 3, 0.1, 0.0, &PhasePoint::new([1.0], [0.5], 0.0), &[0.5].into())?;
/// assert!(step.residual() < 1e-14 && step.work.y[0].abs() > 1e-3);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualWork<const N: usize> {
    /// The state at the end of the step.
    pub end: PhasePoint<N>,
    /// `sigma_d = 1 / rho1`.
    pub sigma: f64,
    /// The contact defect `rho1 (dz1 - p1.dq1) - (dz0 - p0.dq0)`: its components on `dq0`, `dp0` and `dz0`.
    pub defect: ChartVector<N>,
    /// The virtual work `-h sum_j b_j rho_j f_j.dQ_j`, in the same components.
    pub work: ChartVector<N>,
    /// The size of the terms of the defect.
    size: f64,
    /// The stage positions with `h b_j rho_j f_j`.
    impulses: Vec<[SVector<f64, N>; 2]>,
}

impl<const N: usize> VirtualWork<N> {
    /// Takes a step of length `h` with this number of stages, from a state at a time and a guess of its velocity.
    ///
    /// # Errors
    /// [`InputError::Stages`], [`InputError::Step`], [`InputError::Dimension`]; [`InputError::FirstStep`] where the
    /// stage equations cannot be solved.
    pub fn of_step(
        lagrangian: &impl Lagrangian<N>,
        stages: usize,
        h: f64,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
    ) -> Result<Self, InputError> {
        check_step(stages, h)?;
        if N == 0 {
            return Err(InputError::Dimension);
        }
        crate::integration::system_problem::check_time(t)?;
        from.check()?;
        Self::solved(lagrangian, &Products::new(stages, h), t, from, guess).map_err(InputError::FirstStep)
    }

    fn solved(
        lagrangian: &impl Lagrangian<N>,
        products: &Products,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
    ) -> Result<Self, StepError> {
        let equations = StageEquations { lagrangian, products, t };
        let (system, start) = (Typed(lagrangian), PointRef::of_state(from));
        let plain = Plain { system: &system, products, t };
        let mut work = Workspace::new(&system, products.s, false);
        let start = GivenValues::Start(start);
        plain.solve(&start, guess.as_slice(), from.p.as_slice(), &mut work)?;
        let inverse = plain.inverse_jacobian(&start, &mut work).ok_or(StepError::Singular { pivot: 0.0 })?;
        let state: PhasePoint<N, Dual<f64, ChartVector<N>>> = seed(&ChartVector::from(*from)).into();
        let given = Given::Start(state);
        let (x, l) = equations.lifted(&given, &work.solution().0, &inverse)?;
        let end = equations.end(&given, &x, &l);

        let (rho, mut defect) = (end.rho.re, ChartVector { x: from.p, y: SVector::zeros(), z: -1.0 });
        let last = end.action.d.plus(ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 1.0 });
        defect = defect.plus(last.scale(rho));
        let mut size = defect.max_abs_or_nan().max_or_nan(1.0);
        for d in 0..N {
            let part = end.q[d].d.scale(rho * end.p[d].re);
            size = size.max_or_nan(part.max_abs_or_nan());
            defect = defect.plus(part.scale(-1.0));
        }
        let mut virtual_work = ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 };
        let mut impulses = Vec::with_capacity(products.s);
        for j in 0..products.s {
            let q = equations.position(&given, &x, j);
            let at = VelocityPoint { q: q.map(|q| q.re), v: x.v[j].map(|v| v.re), z: x.z[j].re };
            let force = lagrangian.applied_force(t + products.time(j), &at);
            let impulse = force * (products.h * products.weight(j) * x.rho[j].re);
            for d in 0..N {
                let part = q[d].d.scale(impulse[d]);
                size = size.max_or_nan(part.max_abs_or_nan());
                virtual_work = virtual_work.plus(part.scale(-1.0));
            }
            impulses.push([at.q, impulse]);
        }
        let state = PhasePoint { q: end.q.map(|q| q.re), p: end.p.map(|p| p.re), z: from.z + end.action.re };
        Ok(VirtualWork { end: state, sigma: 1.0 / rho, defect, work: virtual_work, size, impulses })
    }

    /// The difference of the contact defect and the virtual work, relative to the size of their terms.
    pub fn residual(&self) -> f64 {
        self.defect.minus(self.work).max_abs_or_nan() / self.size
    }

    /// The momentum that the force gives to a group: `h sum_j b_j rho_j f_j.xi(Q_j)`. Where L is invariant under a
    /// group that is affine in the coordinates, the momentum of the step obeys `J1 = sigma_d (J0 + impulse)`.
    pub fn impulse(&self, group: &impl OneParameterGroup<N>) -> f64 {
        self.impulses.iter().map(|[q, impulse]| impulse.dot(&group.generator(q))).sum()
    }
}
