//! Properties of tangents that need no reference.

use crate::gradients::runs::weyl;
use contact_examples::systems::{System, SystemVisitor, visit_catalogue};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{PhasePoint, legendre};
use discrete_herglotz::sensitivity::Variable;
use discrete_herglotz::{GaussCollocation, Problem, Start, Steps, Until};

/// The determinant of the tangent in (q, p, z) is `sigma^(n+1)` for the conformal factor sigma of the run, and vectors
/// with `dz = p.dq` at the start have `dz = p.dq` at the end. Both hold to round-off of the terms, amplified by the
/// condition of the tangent.
#[test]
fn the_tangent_is_conformally_contact() {
    struct Visit(u32);
    impl SystemVisitor for Visit {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for _ in 0..4 {
                self.0 += 1;
                let (t0, start) = system.sample(&weyl(self.0, 2 * N + 2));
                let t0 = t0 + system.initial_time();
                let PhasePoint { q, p, z } = legendre(system, t0, &start);
                let start = Start::Momentum(PhasePoint { q, p, z }, start.v);
                let problem = Problem::new(system, t0, start).unwrap();
                let stages = 1 + (self.0 as usize * 3) % 16;
                let run = problem.by(GaussCollocation { stages }).steps(Steps::Count(4)).with_conformal_factor();
                let variables: Vec<Variable> = Variable::all(&problem).into_iter().take(2 * N + 1).collect();
                let tangent = run.tangent(&variables, Until::After(0.5)).unwrap();
                let name = format!("{}, {stages} stages", system.name());
                let entry = |i: usize, j: usize| {
                    let column = &tangent.columns[j];
                    if i < N {
                        column.q[i]
                    } else if i < 2 * N {
                        column.p[i - N]
                    } else {
                        column.z
                    }
                };
                let matrix = DMatrix::from_fn(2 * N + 1, 2 * N + 1, entry);
                let size = matrix.iter().fold(1.0, |m, x: &f64| contact_geom::numbers::max_or_nan(m, x.abs()));
                let expected = (tangent.outcome.log_factor.unwrap() * (N as f64 + 1.0)).exp();
                let found = matrix.determinant();
                assert!((found / expected - 1.0).abs() <= 1e-12 * size.powi(2), "{name}: {found} and {expected}");
                for (j, column) in tangent.columns.iter().enumerate() {
                    // A vector of the kernel: dz = p.dq at the start.
                    let dz = if j < N { p[j] } else { 0.0 };
                    if j == 2 * N {
                        continue;
                    }
                    let action = &tangent.columns[2 * N];
                    let (dq, dz) = (&column.q + &action.q * dz, column.z + action.z * dz);
                    let defect = dz - tangent.outcome.p.dot(&dq);
                    assert!(defect.abs() <= 1e-12 * size * (1.0 + p.norm()), "{name}: defect {defect:e} of column {j}");
                }
            }
        }
    }
    visit_catalogue(&mut Visit(40));
}
