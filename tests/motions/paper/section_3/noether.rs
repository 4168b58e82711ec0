//! Statements 25 and 26 (section 3.2): the momentum along a run, and a group that is no symmetry.

use crate::lagrangians::{kepler, two};
use contact_examples::systems::{Kepler, SphericalPendulum, System};
use contact_geom::{DiscretePoint, Lagrangian, numbers::max_or_nan};
use discrete_herglotz::{
    MomentumDecay, Problem, SplittingScheme, Status, Steps, Until,
    rules::{Method, Rule},
    theory::discrete_symmetry_defect,
};

/// Along a run of a thousand steps the momentum is its initial value times the product of the sigma_d, up to round-off
/// that grows at most like the number of steps.
#[test]
fn along_a_run() {
    fn run<const N: usize>(system: &impl System<N>, lagrangian: &impl Lagrangian<N>, h: f64) {
        let problem = Problem::new(lagrangian, 0.0, system.initial()).unwrap();
        for method in Method::applicable(&system.structure()) {
            for group in system.symmetries() {
                let mut decay = MomentumDecay::new(group);
                let run = match method {
                    Method::Strang => problem.by(SplittingScheme::STRANG),
                    rule => problem.by(rule),
                };
                let outcome = run.steps(Steps::Size(h)).observe(&mut decay).run(Until::Steps(1000)).unwrap();
                assert_eq!(
                    (outcome.status, outcome.steps),
                    (Status::Completed, 1000),
                    "{} with {method}",
                    system.name()
                );
                assert_eq!(decay.rows.len(), 1001);
                let scale = decay.rows.iter().map(|row| row.momentum.abs()).fold(1e-3, max_or_nan);
                for (k, row) in decay.rows.iter().enumerate() {
                    let defect = (row.momentum - row.predicted).abs() / scale;
                    let allowed = 64.0 * f64::EPSILON * (k + 1) as f64;
                    assert!(defect <= allowed, "{} with {method}: {defect:e} at {k}", system.name());
                }
            }
        }
    }
    run(&Kepler::default(), &kepler(Kepler::default()), 0.02);
    run(&SphericalPendulum::default(), &two(SphericalPendulum::default()), 0.02);
}

/// A group that is no symmetry of L is no symmetry of L_d.
#[test]
fn without_symmetry() {
    let ld = Rule::LEFT_MIDPOINT.of(Kepler::<2>::default(), 0.1).unwrap();
    let shift = contact_geom::Symmetry::Translation(contact_geom::nalgebra::SVector::from([1.0, 0.0]));
    let x = DiscretePoint::new([1.0, 0.0], [1.0, 0.1], 0.0);
    assert!(discrete_symmetry_defect(&ld, &shift, 0.0, &x).is_ok_and(|d| d > 0.01));
}
