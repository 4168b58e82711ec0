//! Forces and impacts, which the paper does not treat: energy, contact defects and momenta. Statements 42 to 47.

use crate::common::{TOLERANCE, on_some, step_from};
use crate::forces::{Applied, forced_two};
use crate::lagrangians::{self, KindVisitor, visit_kinds};
use crate::paper::table::{Row, at_points_of_every_system};
use contact_examples::systems::{Kepler, System};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{Force, Forced, Lagrangian, Scalar, Statement, VelocityPoint, legendre, statements::AnyForce};
use discrete_herglotz::gauss::VirtualWork;
use discrete_herglotz::statements::forced_residual;

/// The statement about motions at a point of a system.
pub const AT_POINTS: &[Row] = &[Row::new(Statement::ForcedEnergy, TOLERANCE)];

/// The statements about impacts. The velocity after an impact is known up to the condition of W.
pub const AT_IMPACTS: &[Row] =
    &[Row::new(Statement::ElasticImpact, TOLERANCE), Row::new(Statement::ConformalImpact, TOLERANCE)];

/// The statements about steps with a force. The contact defect of a Gauss step is a sum of some ten terms, each with a
/// few units of round-off; the other bounds are those without forces.
pub const WITH_FORCES: &[Row] = &[
    Row::new(Statement::DiscreteForces, 1e-12),
    Row::new(Statement::VirtualWork, 1e-14),
    Row::with_symmetry(Statement::ForcedMomentum, TOLERANCE),
];

#[test]
fn statements_at_points_of_every_system() {
    at_points_of_every_system(AT_POINTS);
    at_points_of_every_system(AT_IMPACTS);
}

/// Evaluates the statements at random points of one system of each kind of structure.
#[test]
fn statements_with_forces() {
    struct Visitor<'a>(&'a Row, usize);
    impl KindVisitor for Visitor<'_> {
        fn visit<const N: usize, S: System<N>, L: Lagrangian<N> + Copy>(&mut self, system: &S, lagrangian: L) {
            let row = self.0;
            let name = format!("statement {} on {}", row.statement, system.name());
            let symmetries = system.symmetries();
            let forced = Forced { lagrangian, force: Applied::from(AnyForce(0.37)) };
            on_some(48, &name, 2 * N + 3, |u| {
                let (t, x) = system.sample(&u[1..]);
                let residual = forced_residual(row.statement, &forced, &symmetries, step_from(u[0]), t, &x);
                let found = residual.map_err(|e| e.to_string())?;
                assert_eq!(found.is_some(), row.applies_to(system), "{name}");
                self.1 += usize::from(found.is_some());
                found.map_or(Ok(()), |residual| crate::common::bounded(residual, row.bound))
            });
        }
    }
    for row in WITH_FORCES {
        let mut visitor = Visitor(row, 0);
        visit_kinds(&mut visitor);
        assert!(visitor.1 >= 48, "statement {}: {} samples", row.statement, visitor.1);
    }
}

/// A force towards the origin that depends on everything: it has no moment.
#[derive(Clone, Copy, Debug)]
pub struct Central;

impl<const N: usize> Force<N> for Central {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let size = (dot(x.v, x.v) * 0.3 + t.sin() + x.z * 0.2) * 0.4;
        x.q.map(|q| -(q * size))
    }
}

/// Statement 45 where f.xi = 0: the angular momentum decays by exactly sigma_d, while the step has a contact defect.
#[test]
fn a_force_without_moment_leaves_the_decay() {
    let kepler = Kepler::<2>::default();
    let forced = forced_two(lagrangians::kepler(kepler), Central);
    on_some(48, "angular momentum", 7, |u| {
        let (t, x) = kepler.sample(&u[1..]);
        let from = legendre(&forced, t, &x);
        let step = VirtualWork::of_step(&forced, 3, step_from(u[0]), t, &from, &x.v).map_err(|e| e.to_string())?;
        let of = |q: &SVector<f64, 2>, p: &SVector<f64, 2>| q[0] * p[1] - q[1] * p[0];
        let (before, after) = (of(&from.q, &from.p), of(&step.end.q, &step.end.p));
        let off = (after - step.sigma * before).abs() / (from.q.norm() * from.p.norm());
        assert!(step.work.x.norm() > 1e-6, "no virtual work: {:?}", step.work);
        crate::common::bounded(off, 1e-14)
    });
}
