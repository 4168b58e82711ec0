//! Ensembles: their members are single runs, whatever the threads, the width of the lanes and the neighbours.

use contact_geom::VelocityPoint;
use contact_geom::systems::{Kepler, Pendulum};
use discrete_herglotz::{Ending, Ensemble, GaussCollocation, Problem, SplittingScheme, Status, Steps, Until};

#[test]
fn first() {
    let kepler = Kepler::<2>::default();
    let start = |i: usize| VelocityPoint::new([1.0 + 0.001 * i as f64, 0.0], [0.0, 1.0], 0.0);
    for scheme in SplittingScheme::ALL {
        let ensemble = Ensemble::new(&kepler, 0.0, 300, start).by(scheme).steps(Steps::Count(100)).threads(2);
        let mut count = 0;
        let tally = ensemble
            .run(Until::Time(5.0), |member| {
                assert_eq!(member.index, count);
                count += 1;
                let Ending { status, state, .. } = member.ending.unwrap();
                assert_eq!(status, Status::Completed);
                if member.index % 50 == 0 {
                    let problem = Problem::new(&kepler, 0.0, start(member.index)).unwrap();
                    let own = problem.by(scheme).steps(Steps::Count(100)).run(Until::Time(5.0)).unwrap();
                    assert_eq!(own.state(), state, "{}: {}", scheme.name(), member.index);
                }
            })
            .unwrap();
        assert_eq!(tally.in_lanes, 300);
        assert_eq!(tally.members, 300);
    }
    let pendulum = Pendulum { gamma: -0.01 };
    let start = |i: usize| VelocityPoint::new([-2.0 + 4.0 * i as f64 / 299.0], [0.5], 0.1);
    for stages in 1..=16 {
        let gauss = GaussCollocation { stages };
        let ensemble = Ensemble::new(&pendulum, 0.0, 300, start).by(gauss).steps(Steps::Count(20)).threads(1);
        let mut worst = 0.0f64;
        let tally = ensemble.run(Until::Time(10.0), |member| {
            let state = member.ending.unwrap().state;
            if member.index % 50 == 0 {
                    let problem = Problem::new(&pendulum, 0.0, start(member.index)).unwrap();
                    let own = problem.by(gauss).steps(Steps::Count(20)).run(Until::Time(10.0)).unwrap().state();
                    worst = worst.max((own.q - state.q).norm()).max((own.p - state.p).norm()).max((own.z - state.z).abs());
            }
        }).unwrap();
        println!("{stages} {tally:?} {worst:e}");
    }
}
