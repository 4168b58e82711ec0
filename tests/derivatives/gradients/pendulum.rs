//! A damped pendulum over ten periods, against derivatives that were computed with 30 digits.

use contact_examples::systems::{OneCoordinate, Pendulum};
use contact_geom::VelocityPoint;
use discrete_herglotz::sensitivity::{EndCovector, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};

/// `(q, v, z)` at t = 100 from (1, 1, 0), and its derivatives in q0, v0 and gamma.
const END: [f64; 3] = [-0.591939247134, -0.633067337150, -1.747387946531];
const DERIVATIVES: [[f64; 3]; 3] = [
    [5.65210486970, -5.53295490161, -3.94604242032],
    [7.38154595869, -7.16085111397, -4.67301564412],
    [225.145071391822, -255.642934500038, -265.676953215921],
];

/// Each number is given to twelve digits.
#[test]
fn the_pendulum_of_the_issue() {
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.01 });
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0)).unwrap();
    let variables = [Variable::Position(0), Variable::Velocity(0), Variable::Parameter("gamma".into())];
    for (stages, h) in [(8, 0.25), (16, 1.0)] {
        let run = || problem.by(GaussCollocation { stages }).steps(Steps::Size(h));
        let tangent = run().tangent(&variables, Until::Time(100.0)).unwrap();
        let outcome = tangent.outcome;
        let end = [outcome.q[0], outcome.v.unwrap()[0], outcome.z.unwrap()];
        for (found, expected) in end.into_iter().zip(END) {
            assert!((found - expected).abs() <= 1e-11 * expected.abs(), "{found} and {expected}");
        }
        let recorded = run().record(Until::Time(100.0)).unwrap();
        let mut units = [0, 1, 2].map(|_| EndCovector::zero(1));
        (units[0].q[0], units[1].v[0], units[2].z) = (1.0, 1.0, 1.0);
        let gradients = recorded.pullbacks(&units).unwrap();
        for (k, (column, expected)) in tangent.columns.iter().zip(DERIVATIVES).enumerate() {
            let forward = [column.q[0], column.v[0], column.z];
            let backward: Vec<f64> = gradients.iter().map(|g| [g.q[0], g.rate[0], g.parameters[0]][k]).collect();
            for ((forward, backward), expected) in forward.iter().zip(backward).zip(expected) {
                for found in [*forward, backward] {
                    assert!((found - expected).abs() <= 1e-11 * expected.abs(), "{stages} stages: {found}, {expected}");
                }
            }
        }
    }
}
