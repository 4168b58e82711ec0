//! The memory of a gradient.

use crate::counting_allocator::{allocations, peak};
use crate::lagrangians::One;
use contact_examples::systems::{Pendulum, System};
use contact_geom::Scalar;
use discrete_herglotz::{
    GaussCollocation, Problem, Steps, Until,
    sensitivity::{EndState, Loss},
};

/// The memory of a gradient is bounded: the stages of steps are kept if they are few, else states at intervals, which are
/// doubled when there are too many. The steps themselves allocate nothing, so that the number of allocations grows with the
/// kept states alone.
#[test]
fn memory_is_bounded() {
    struct End;
    impl Loss<1> for End {
        fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
            end.q[0] * end.v[0]
        }
    }
    let pendulum = One::from(Pendulum::default());
    let problem = Problem::new(&pendulum, 0.0, Pendulum::default().initial()).unwrap();
    let gradient = |steps: usize| {
        let run = problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(1e-3));
        let found = run.gradient(&End, Until::Time(1e-3 * steps as f64)).unwrap();
        assert!(found.loss.is_some() && found.outcome.steps == steps);
    };
    let count = |steps: usize| allocations(|| gradient(steps));
    // A state is kept after each 64 steps, in at most 8 allocations; one in each step would be 64.
    let (few, more) = (count(64 * 16), count(64 * 32));
    assert!(more <= few + 8 * 16, "{few} and {more} allocations");
    // With 4 stages, 21 numbers of each step are kept of up to 199,728 steps.
    assert!(peak(|| gradient(199_000)) < 34 << 20);
    let (few, many) = (peak(|| gradient(200_000)), peak(|| gradient(800_000)));
    assert!(many <= few + few / 4 && many < 4 << 20, "{few} and {many} bytes");
}
