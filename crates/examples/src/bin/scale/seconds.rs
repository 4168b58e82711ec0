//! Run times of closures.

use std::time::Instant;

/// The shortest run time over some rounds, in seconds.
pub fn best(rounds: usize, mut action: impl FnMut()) -> f64 {
    let [best] = together(rounds, [&mut action]);
    best
}

/// The shortest run times of several actions, in seconds. The actions alternate, so that other load on the machine
/// affects all of them.
pub fn together<const N: usize>(rounds: usize, mut actions: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut best = [f64::INFINITY; N];
    for _ in 0..rounds {
        for (best, action) in best.iter_mut().zip(&mut actions) {
            let clock = Instant::now();
            action();
            *best = best.min(clock.elapsed().as_secs_f64());
        }
    }
    best
}

/// Consumes the result of a timed action, so that the compiler does not remove the action.
pub fn done<R>(result: R) {
    let _ = std::hint::black_box(result);
}
