//! Times of actions.

use std::time::Instant;

/// The shortest time of some rounds, in seconds.
pub fn best(rounds: usize, mut action: impl FnMut()) -> f64 {
    let [best] = together(rounds, [&mut action]);
    best
}

/// The shortest times of actions that take turns: what disturbs one disturbs the others.
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

/// The end of what is timed: the compiler must not leave it out.
pub fn done<R>(result: R) {
    let _ = std::hint::black_box(result);
}
