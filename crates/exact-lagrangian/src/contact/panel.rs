//! One panel of the flow of a contact Hamiltonian: Gauss collocation with 14 nodes, of order 28.

use crate::numerics::gauss::{Gauss, collocations};
use contact_geom::numbers::{TangentVector, max_or_nan};
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianDerivatives, PhasePoint, Scalar};

/// The table of coefficients that is used, with 14 nodes.
const TABLE: usize = 2;
/// The number of its nodes.
const NODES: usize = 14;
/// The largest number of iterations for the stages.
const MAX_ITERATIONS: usize = 40;
/// A change of the stages below this, relative to the state, is round-off once it does not decrease further.
const PLATEAU: f64 = 1e-12;
/// Changes of the stages below this, relative to the state, are round-off.
const ROUND_OFF: f64 = f64::EPSILON;

/// The rates `(X_H, -H_z)` of the state and of `ln sigma`.
#[derive(Clone, Copy)]
pub(super) struct Rate<const N: usize, T> {
    pub field: ChartVector<N, T>,
    pub ln_sigma: T,
}

impl<const N: usize, T: Scalar> Rate<N, T> {
    /// The rates at a state.
    pub fn at(hamiltonian: &impl ContactHamiltonian<N>, t: T, x: &ChartVector<N, T>) -> Self {
        let (h, d) = hamiltonian.with_gradient(t, &PhasePoint { q: x.x, p: x.y, z: x.z });
        let field = ChartVector { x: d.y, y: -d.x - x.y * d.z, z: x.y.dot(&d.y) - h };
        Rate { field, ln_sigma: -d.z }
    }

    fn zero() -> Self {
        Rate { field: TangentVector::null(), ln_sigma: T::zero() }
    }

    fn add(&mut self, a: f64, other: &Self) {
        self.field = self.field.join(other.field, |x, y| x + y * a);
        self.ln_sigma += other.ln_sigma * a;
    }

    /// The product with a number.
    fn times(self, a: T) -> Self {
        Rate { field: self.field.scaled(a), ln_sigma: self.ln_sigma * a }
    }

    /// The largest components of the blocks q, p, z and ln sigma, over all differentials.
    pub fn sizes(&self) -> [f64; 4] {
        let [mut x, mut y] = [0.0; 2];
        for i in 0..N {
            x = max_or_nan(x, self.field.x[i].extent());
            y = max_or_nan(y, self.field.y[i].extent());
        }
        [x, y, self.field.z.extent(), self.ln_sigma.extent()]
    }

    pub fn is_finite(&self) -> bool {
        self.sizes().iter().all(|e| e.is_finite())
    }
}

/// A panel that was computed.
pub(super) struct Panel<const N: usize, T> {
    /// The change of the state and of `ln sigma`.
    pub change: Rate<N, T>,
    /// The last Legendre coefficients of the rates, relative to the state.
    pub tail: f64,
}

/// The collocation coefficients.
fn table() -> &'static Gauss {
    let tables = collocations();
    &tables[TABLE]
}

/// The largest of the blocks of `a` relative to those of `scale`; 0 where both vanish.
fn relative(a: [f64; 4], scale: [f64; 4]) -> f64 {
    a.into_iter().zip(scale).fold(0.0, |largest, (a, s)| max_or_nan(largest, if a == 0.0 { 0.0 } else { a / s }))
}

/// The panel from a state at the time t over a step, with the number of evaluations. `None` where the iteration does
/// not converge, or where H is not finite at a stage.
pub(super) fn collocate<T: Scalar, const N: usize>(
    hamiltonian: &impl ContactHamiltonian<N>,
    t: T,
    step: T,
    start: &ChartVector<N, T>,
    first: &Rate<N, T>,
    stages: &mut [Rate<N, T>; NODES],
) -> (Option<Panel<N, T>>, u64) {
    let g = table();
    stages.fill(*first);
    let mut scale = Rate { field: *start, ln_sigma: T::one() }.sizes();
    let grown = first.times(step).sizes();
    for (s, g) in scale.iter_mut().zip(grown) {
        *s = max_or_nan(*s, g);
    }
    let (mut before, mut evaluations) = (f64::INFINITY, 0);
    for iteration in 0..MAX_ITERATIONS {
        let mut change = [0.0; 4];
        for i in 0..NODES {
            let mut sum = Rate::zero();
            for (a, stage) in g.a[i].iter().zip(&*stages) {
                sum.add(*a, stage);
            }
            let x = start.plus(sum.field.scaled(step));
            let rate = Rate::at(hamiltonian, t + step * g.c[i], &x);
            evaluations += 1;
            let mut moved = rate;
            moved.add(-1.0, &stages[i]);
            for (largest, size) in change.iter_mut().zip(moved.times(step).sizes()) {
                *largest = max_or_nan(*largest, size);
            }
            stages[i] = rate;
        }
        let size = relative(change, scale);
        if !size.is_finite() {
            return (None, evaluations);
        }
        if size <= ROUND_OFF || (size <= PLATEAU && size >= 0.5 * before) {
            return (Some(finish(g, step, stages, scale)), evaluations);
        }
        // An iteration that contracts slowly is replaced by shorter panels.
        if iteration > 4 && size > 0.7 * before {
            break;
        }
        before = size;
    }
    (None, evaluations)
}

/// The panel with these stages.
fn finish<T: Scalar, const N: usize>(
    g: &Gauss,
    step: T,
    stages: &[Rate<N, T>; NODES],
    mut scale: [f64; 4],
) -> Panel<N, T> {
    let combine = |weights: &[f64]| {
        let mut sum = Rate::zero();
        for (b, stage) in weights.iter().zip(stages) {
            sum.add(*b, stage);
        }
        sum.times(step)
    };
    for stage in stages {
        for (s, g) in scale.iter_mut().zip(stage.times(step).sizes()) {
            *s = max_or_nan(*s, g);
        }
    }
    let tail = g.tail.iter().fold(0.0, |tail, row| max_or_nan(tail, relative(combine(row).sizes(), scale)));
    Panel { change: combine(&g.b), tail }
}

/// The stages before the first iteration.
pub(super) fn no_stages<T: Scalar, const N: usize>() -> [Rate<N, T>; NODES] {
    [Rate::zero(); NODES]
}
