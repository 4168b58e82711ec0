//! Starts of constrained motions: checks and projections.

use super::{ConstraintError, Corrections, Progress};
use crate::InputError;
use contact_geom::constraints::{Constraint, ConstraintDerivatives, Redundancy};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::support::{independent_rows, linear::solve, restricted};
use contact_geom::{Derivatives, GeometryError, Lagrangian, PhasePoint, VelocityPoint};

/// What happens to a start that does not satisfy the constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OffConstraint {
    /// An error with the distance.
    #[default]
    Refuse,
    /// The position is moved to the constraint along the directions `W^-1 G^T`, and the velocity is projected
    /// orthogonally in the metric W.
    Project,
}

/// The start of a constrained motion, a position, a velocity and an action, with the treatment of starts that are off
/// the constraints and of redundant constraints.
///
/// ```
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::constraints::{ConstrainedStart, OffConstraint};
/// let start = ConstrainedStart::new(VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0));
/// assert_eq!(start.off_constraint, OffConstraint::Refuse);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstrainedStart<const N: usize> {
    /// The time.
    pub t: f64,
    /// The position, the velocity and the action.
    pub at: VelocityPoint<N>,
    /// What happens where it does not satisfy the constraints.
    pub off_constraint: OffConstraint,
    /// What happens where the constraints are redundant.
    pub redundancy: Redundancy,
}

impl<const N: usize> ConstrainedStart<N> {
    /// A start at the time 0, which is refused where it does not satisfy the constraints or where these are redundant.
    pub fn new(at: VelocityPoint<N>) -> Self {
        ConstrainedStart { t: 0.0, at, off_constraint: OffConstraint::Refuse, redundancy: Redundancy::Refuse }
    }

    /// The point that satisfies the constraints, from which a [`Problem`](crate::Problem) with a
    /// [`Constrained`](super::Constrained) integrator starts: the checked and, on request, projected start.
    ///
    /// # Errors
    /// [`InputError::Constraint`] where it is off the constraints or they are dependent; other [`InputError`]s for a
    /// start that is not finite, and where L is singular.
    pub fn resolved<const M: usize>(
        &self,
        lagrangian: &impl Lagrangian<N>,
        constraint: &impl Constraint<N, M>,
    ) -> Result<VelocityPoint<N>, InputError> {
        self.resolved_for(lagrangian, constraint, f64::INFINITY)
    }

    /// The same for a step h: velocities that move positions by less than round-off in a step are round-off, which is
    /// larger than that of the velocity where this is small, as at a turning point.
    pub(super) fn resolved_for<const M: usize>(
        &self,
        lagrangian: &impl Lagrangian<N>,
        constraint: &impl Constraint<N, M>,
        h: f64,
    ) -> Result<VelocityPoint<N>, InputError> {
        let mut x = self.at;
        crate::integration::system_problem::check_time(self.t)?;
        PhasePoint { q: x.q, p: x.v, z: x.z }.check()?;
        let (c, g) = constraint.with_jacobian(&x.q);
        if !(c.iter().chain(g.iter()).all(|e| e.is_finite())) {
            return Err(GeometryError::Undefined { what: "a constraint or its derivative" }.into());
        }
        let kept = self.independent(constraint.count(), &g)?;
        let inverse = inverse_mass(lagrangian, self.t, &x)?;
        // The first correction is the distance.
        let step = correction(&g, &inverse, &kept, &c)?;
        let (mut index, mut value) = (0, 0.0);
        for a in 0..M {
            if c[a].abs() > f64::abs(value) {
                (index, value) = (a, c[a]);
            }
        }
        match self.off_constraint {
            OffConstraint::Refuse if exceeds(&step, round_off(&x.q)) => {
                return Err(ConstraintError::OffConstraint { distance: step.norm(), index, value }.into());
            }
            OffConstraint::Refuse => {}
            OffConstraint::Project => x.q = projected(constraint, &inverse, &kept, x.q)?,
        }
        if kept.iter().take(constraint.count()).any(|kept| !kept) {
            check_redundant(constraint, &inverse, &kept, &x.q)?;
        }
        let (c, g) = constraint.with_jacobian(&x.q);
        let largest =
            c.iter().enumerate().fold((0, 0.0), |m, (a, c)| if c.abs() > f64::abs(m.1) { (a, *c) } else { m });
        // Dependent constraints that contradict the others are not reached by the projection.
        if exceeds(&c, 1e-9 * (g.max_abs_or_nan() * (1.0 + x.q.max_abs_or_nan()))) {
            return Err(
                ConstraintError::OffConstraint { distance: f64::INFINITY, index: largest.0, value: largest.1 }.into()
            );
        }
        let inverse = inverse_mass(lagrangian, self.t, &x)?;
        let rounding = round_off(&x.v) + round_off(&x.q) / h.abs();
        x.v = tangent_velocity(&g, &inverse, &kept, (x.v, rounding), self.off_constraint)?;
        Ok(x)
    }

    /// The independent constraints.
    fn independent<const M: usize>(&self, count: usize, g: &SMatrix<f64, M, N>) -> Result<[bool; M], InputError> {
        let kept = independent_rows(g);
        let rank = kept.iter().filter(|kept| **kept).count();
        if rank < count && (self.redundancy == Redundancy::Refuse || rank == 0) {
            let index = kept.iter().position(|kept| !kept).unwrap_or(0);
            return Err(ConstraintError::RankDeficient { rank, expected: count, index }.into());
        }
        Ok(kept)
    }
}

/// The velocity, projected to `g v = 0` on request, and refused otherwise where it is not there up to its round-off.
pub(super) fn tangent_velocity<const N: usize, const M: usize>(
    g: &SMatrix<f64, M, N>,
    inverse: &SMatrix<f64, N, N>,
    kept: &[bool; M],
    (v, rounding): (SVector<f64, N>, f64),
    off: OffConstraint,
) -> Result<SVector<f64, N>, InputError> {
    let step = correction(g, inverse, kept, &(g * v))?;
    match off {
        OffConstraint::Refuse if exceeds(&step, rounding) => {
            Err(ConstraintError::OffVelocity { distance: step.norm() }.into())
        }
        OffConstraint::Refuse => Ok(v),
        OffConstraint::Project => {
            let v = v - step;
            Ok(v - correction(g, inverse, kept, &(g * v))?)
        }
    }
}

/// Whether an entry is larger than a bound, or one of them is not a number.
fn exceeds<const K: usize>(x: &SVector<f64, K>, bound: f64) -> bool {
    let size = x.max_abs_or_nan();
    size.is_nan() || bound.is_nan() || size > bound
}

/// The size of corrections that count as round-off of a start.
pub(super) fn round_off<const N: usize>(x: &SVector<f64, N>) -> f64 {
    64.0 * f64::EPSILON * x.max_abs_or_nan()
}

/// The inverse of `W = L_vv` at a point.
pub(super) fn inverse_mass<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<SMatrix<f64, N, N>, GeometryError> {
    let mass = lagrangian.mass_matrix(t, x);
    let mut inverse = SMatrix::<f64, N, N>::identity();
    for mut column in inverse.column_iter_mut() {
        solve(&mut mass.clone_owned(), &mut column).map_err(|e| e.of("W = L_vv", "choose a regular Lagrangian"))?;
    }
    Ok(inverse)
}

/// `W^-1 G^T (G W^-1 G^T)^-1 c`, with the independent constraints alone.
fn correction<const N: usize, const M: usize>(
    g: &SMatrix<f64, M, N>,
    inverse: &SMatrix<f64, N, N>,
    kept: &[bool; M],
    c: &SVector<f64, M>,
) -> Result<SVector<f64, N>, GeometryError> {
    let mut y = SVector::<f64, M>::from_fn(|a, _| if kept[a] { c[a] } else { 0.0 });
    solve(&mut restricted(g * inverse * g.transpose(), kept), &mut y)
        .map_err(|e| e.of("c_q W^-1 c_q^T", "choose a position at which the constraints are independent"))?;
    Ok(inverse * (g.transpose() * y))
}

/// The position on the independent constraints, by Newton's method.
fn projected<const N: usize, const M: usize>(
    constraint: &impl Constraint<N, M>,
    inverse: &SMatrix<f64, N, N>,
    kept: &[bool; M],
    mut q: SVector<f64, N>,
) -> Result<SVector<f64, N>, InputError> {
    let mut corrections = Corrections::new();
    loop {
        let (c, g) = constraint.with_jacobian(&q);
        let step = correction(&g, inverse, kept, &c)?;
        q -= step;
        match corrections.after(step.max_abs_or_nan(), q.max_abs_or_nan()) {
            Ok(Progress::Ended) => return Ok(q),
            Ok(_) => {}
            Err(_) => return Err(ConstraintError::NotProjected { distance: step.norm() }.into()),
        }
    }
}

/// Checks that dependent constraints follow from the independent ones at a point of the manifold near the start.
fn check_redundant<const N: usize, const M: usize>(
    constraint: &impl Constraint<N, M>,
    inverse: &SMatrix<f64, N, N>,
    kept: &[bool; M],
    q: &SVector<f64, N>,
) -> Result<(), InputError> {
    // A tangent direction without special symmetry, short enough for a projection.
    let generic = SVector::<f64, N>::from_fn(|i, _| 1.0 + ((i + 1) as f64 * std::f64::consts::SQRT_2).fract());
    let g = constraint.with_jacobian(q).1;
    let tangent = generic - correction(&g, inverse, kept, &(g * generic))?;
    let size = 1e-2 * (1.0 + q.max_abs_or_nan()) / (1.0 + tangent.max_abs_or_nan());
    let near = projected(constraint, inverse, kept, q + tangent * size)?;
    let (c, g) = constraint.with_jacobian(&near);
    let rank = kept.iter().filter(|kept| **kept).count();
    // A constraint that is only tangent there has a value of the order of the square of the distance.
    let scale = g.max_abs_or_nan() * (1.0 + near.max_abs_or_nan());
    let violated = (0..M).find(|a| c[*a].abs() > 1e-10 * scale);
    let violated = violated.or_else(|| {
        let there = independent_rows(&g);
        (there.iter().filter(|kept| **kept).count() != rank).then_some(0)
    });
    match violated {
        Some(index) => Err(ConstraintError::SingularPosition { rank, index, value: c[index] }.into()),
        None => Ok(()),
    }
}
