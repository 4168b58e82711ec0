//! The external integrator of comparisons: Hairer's explicit Runge-Kutta method DOP853 of order 8 with step size
//! control.

use differential_equations::methods::ExplicitRungeKutta;
use differential_equations::prelude::{IVP, ODE};
use differential_equations::traits::State;
use herglotz::runtime::{FirstOrder, Peer, PeerEnd};

/// The maximal number of steps of a run; runs that need more are left out of the comparison.
const MAX_STEPS: usize = 100_000;

/// `dop853` of the crate differential-equations.
pub(crate) struct Dop853;

/// The vector field of a motion, in the interface of that crate.
struct Rates<'m>(&'m FirstOrder);

impl<const D: usize> ODE<f64, [f64; D]> for Rates<'_> {
    fn diff(&self, t: f64, y: &[f64; D], rate: &mut [f64; D]) {
        self.0.rates(t, y, rate);
    }
}

impl ODE<f64, Vec<f64>> for Rates<'_> {
    fn diff(&self, t: f64, y: &Vec<f64>, rate: &mut Vec<f64>) {
        self.0.rates(t, y, rate);
    }
}

impl Peer for Dop853 {
    fn name(&self) -> &str {
        "dop853"
    }

    fn order(&self) -> u32 {
        8
    }

    fn run(&self, motion: &FirstOrder, tolerance: f64) -> Option<PeerEnd> {
        // For few variables (up to three coordinates) arrays avoid an allocation in each stage.
        match motion.start.len() {
            2 => in_array::<2>(motion, tolerance),
            3 => in_array::<3>(motion, tolerance),
            4 => in_array::<4>(motion, tolerance),
            5 => in_array::<5>(motion, tolerance),
            6 => in_array::<6>(motion, tolerance),
            7 => in_array::<7>(motion, tolerance),
            _ => run(motion, motion.start.clone(), tolerance, Vec::clone),
        }
    }
}

fn in_array<const D: usize>(motion: &FirstOrder, tolerance: f64) -> Option<PeerEnd> {
    run(motion, <[f64; D]>::try_from(motion.start.as_slice()).ok()?, tolerance, |y| y.to_vec())
}

fn run<Y: State<f64>>(
    motion: &FirstOrder,
    start: Y,
    tolerance: f64,
    numbers: impl Fn(&Y) -> Vec<f64>,
) -> Option<PeerEnd>
where
    for<'m> Rates<'m>: ODE<f64, Y>,
{
    let rates = Rates(motion);
    let method = ExplicitRungeKutta::dop853().rtol(tolerance).atol(tolerance * motion.size).max_steps(MAX_STEPS);
    let solved = IVP::ode(&rates, motion.t0, motion.end, start).t_eval([motion.end]).method(method).solve().ok()?;
    Some(PeerEnd {
        state: numbers(solved.y.last()?),
        steps: solved.steps.accepted,
        evaluations: solved.evals.function as u64,
    })
}
