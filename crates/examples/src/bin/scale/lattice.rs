//! Sine-Gordon lattices in the plane: time and memory of steps of the implicit midpoint rule and of explicit steps.

use crate::memory::peak;
use crate::seconds::{best, done};
use contact_examples::Failure;
use contact_examples::Report;
use discrete_herglotz::SplittingScheme;
use sparse_herglotz::systems::{SineGordon, lattice};
use sparse_herglotz::{SparseMidpoint, SparseSplitting, State};

/// The memory that the factors may take, in bytes: half of that of a small machine.
const MEMORY: usize = 8 << 30;

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let sides: &[usize] = if report.quick { &[30, 100, 200] } else { &[100, 200, 500, 1000] };
    for &side in sides {
        let n = side * side;
        // A kink in each row, at rest.
        let q: Vec<f64> = (0..n).map(|i| 4.0 * (0.5 * ((i % side) as f64 - 0.5 * side as f64)).exp().atan()).collect();
        let v = vec![0.0; n];
        // The action is not computed: the potential energies for it would be part of the measured time.
        let from = State { t: 0.0, q: &q, v: &v, z: None };
        let site = SineGordon { omega_squared: 1.0 };
        let (seconds, bytes) = peak(|| {
            let system = lattice([side, side], site, 4.0, -0.01)?;
            let mut motion = SparseMidpoint::new(&system, 0.2, from, Some(MEMORY))?;
            let first = best(1, || done(motion.advance(1)));
            Ok::<_, Failure>((first, best(3, || done(motion.advance(2))) / 2.0))
        });
        let (first, later) = seconds?;
        report.row("the first step by the midpoint rule", n, first, Some(bytes))?;
        report.row("a step by the midpoint rule", n, later, Some(bytes))?;
        let (seconds, bytes) = peak(|| {
            let system = lattice([side, side], site, 4.0, -0.01)?;
            let mut motion = SparseSplitting::new(&system, &SplittingScheme::STRANG, 0.2, from)?;
            Ok::<_, Failure>(best(3, || done(motion.advance(5))) / 5.0)
        });
        report.row("a step by strang", n, seconds?, Some(bytes))?;
    }
    Ok(())
}
