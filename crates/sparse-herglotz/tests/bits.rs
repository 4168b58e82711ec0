//! Results are bitwise equal for any number of threads, and for any number of steps taken at once.

use discrete_herglotz::SplittingScheme;
use sparse_herglotz::systems::{SineGordon, lattice};
use sparse_herglotz::{SparseSplitting, SparseSystem, State};

fn run(system: &SparseSystem, threads: usize, parts: &[usize]) -> Vec<u64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let n = system.unknowns();
    let q: Vec<f64> = (0..n).map(|i| (0.01 * i as f64).sin()).collect();
    let v: Vec<f64> = (0..n).map(|i| (0.03 * i as f64).cos()).collect();
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.5) };
    pool.install(|| {
        let mut motion = SparseSplitting::new(system, &SplittingScheme::BLANES_MOAN_4, 0.1, start).unwrap();
        for steps in parts {
            motion.advance(*steps).unwrap();
            motion.state();
        }
        let end = motion.state();
        end.q.iter().chain(end.v).chain(&end.z).map(|x| x.to_bits()).collect()
    })
}

#[test]
fn bits_do_not_depend_on_threads() {
    // Above the size from which on a pass is distributed over threads, and not a multiple of the block size.
    let system = lattice([523, 307], SineGordon { omega_squared: 1.0 }, 1.0, -0.01).unwrap();
    let one = run(&system, 1, &[5]);
    for threads in [2, 3, 7] {
        assert!(run(&system, threads, &[5]) == one, "{threads} threads");
    }
}

#[test]
fn bits_do_not_depend_on_what_is_looked_at() {
    let system = lattice([40, 25], SineGordon { omega_squared: 1.0 }, 1.0, -0.01).unwrap();
    let once = run(&system, 1, &[12]);
    assert!(run(&system, 1, &[1, 4, 7]) == once);
}
