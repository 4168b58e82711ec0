//! What each skip saves: the same motion with something computed and with it left out, in one run, and how far the results are
//! apart.
//!
//! Prints a table, and `skips.csv` into the directory that the environment variable `OUT` names, if it names one.

use contact_geom::nalgebra::SVector;
use contact_geom::systems::{DoublePendulum, HarmonicOscillator, Kepler, Pendulum, QuadraticInZ, System};
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use discrete_herglotz::{InputError, Integrator, Outcome, Scene, SplittingScheme, Status, Steps, Wanted};
use std::hint::black_box;
use std::io::Write;
use std::time::Instant;

/// A Lagrangian that claims less than it is, so that a method does the work which the claim would save.
struct Claiming<L>(L, Structure);

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for Claiming<L> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    fn structure(&self) -> Structure {
        self.1
    }
}

/// One line of the table.
struct Line {
    what: &'static str,
    on: &'static str,
    full: f64,
    skipped: f64,
    apart: f64,
}

/// Runs of which a median is taken.
const RUNS: usize = 41;

/// The median time of a scene's run, in microseconds, with its outcome.
fn timed<L: Lagrangian<N>, const N: usize>(scene: &Scene<'_, L, N>) -> Result<(f64, Outcome<N>), InputError> {
    let plan = scene.plan()?;
    let outcome = plan.run()?;
    let mut times = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        let mut stepper = plan.stepper()?;
        let clock = Instant::now();
        let recorded = scene_runs_by_itself(scene);
        if recorded {
            black_box(plan.run()?);
        } else {
            let halted = stepper.advance(plan.count());
            assert!(halted.is_ok(), "{halted:?}");
        }
        times.push(clock.elapsed().as_secs_f64() * 1e6);
    }
    times.sort_by(f64::total_cmp);
    assert_eq!(outcome.status, Status::Completed);
    Ok((times[RUNS / 2], outcome))
}

/// Whether what is timed is the run of the plan, with its rows and factors, and not the steps alone.
fn scene_runs_by_itself<L: Lagrangian<N>, const N: usize>(scene: &Scene<'_, L, N>) -> bool {
    scene.wanted().rows.is_some() || scene.wanted().conformal_factor
}

/// A line from a scene that does all and one that skips.
fn line<A: Lagrangian<N>, B: Lagrangian<N>, const N: usize>(
    (what, on): (&'static str, &'static str),
    full: &Scene<'_, A, N>,
    skipping: &Scene<'_, B, N>,
) -> Result<Line, InputError> {
    let ((full, a), (skipped, b)) = (timed(full)?, timed(skipping)?);
    let size = a.q.amax().max(a.p.amax());
    Ok(Line { what, on, full, skipped, apart: (a.q - b.q).amax().max((a.p - b.p).amax()) / size })
}

fn lines() -> Result<Vec<Line>, InputError> {
    let none = Wanted { action: false, ..Wanted::default() };
    let start = VelocityPoint::new([1.0], [1.0], 0.0);
    let sixteen = Integrator::Gauss { stages: 16 };
    let eight = Integrator::Gauss { stages: 8 };
    let nystrom = Integrator::Splitting(SplittingScheme::BLANES_MOAN_6);

    let pendulum = Pendulum { gamma: -0.01 };
    let swing = |by: Integrator, h: f64, wanted: &Wanted<1>| {
        Scene::new(&pendulum, start, 1000.0).by(by).steps(Steps::Size(h)).wanting(wanted.clone())
    };
    let with_z = Wanted::default();
    let rows = Wanted { rows: Some(1), ..none.clone() };
    let affine = Structure { separable: false, ..pendulum.structure() };
    let constant_mass = Claiming(pendulum, affine);
    let plain = Claiming(pendulum, Structure { constant_mass: false, ..affine });

    let oscillator = HarmonicOscillator { gamma: -0.05 };
    let unquadratic = Claiming(oscillator, Structure { quadratic: false, ..oscillator.structure() });
    let kepler = Kepler::<2> { mu: 1.0, gamma: -1e-4 };
    let orbit = |wanted: Wanted<2>| {
        Scene::new(&kepler, kepler.initial(), 200.0).by(sixteen).steps(Steps::Size(0.5)).wanting(wanted)
    };
    let square = QuadraticInZ { c: 0.1 };
    let decay = |conformal_factor: bool| {
        Scene::new(&square, VelocityPoint::new([1.0], [0.0], 1.0), 100.0)
            .by(eight)
            .steps(Steps::Size(2.0))
            .wanting(Wanted { conformal_factor, ..Wanted::default() })
    };
    let double = DoublePendulum::default();
    let by = |integrator: Integrator, h: f64| {
        Scene::new(&double, double.initial(), 20.0).by(integrator).steps(Steps::Size(h))
    };
    let general = |l| Scene::new(l, start, 1000.0).by(eight).steps(Steps::Size(1.0)).wanting(none.clone());

    Ok(vec![
        line(("z", "pendulum, gauss_16"), &swing(sixteen, 2.5, &with_z), &swing(sixteen, 2.5, &none))?,
        line(("z", "pendulum, blanes_moan_6"), &swing(nystrom, 0.2, &with_z), &swing(nystrom, 0.2, &none))?,
        line(
            ("z", "Kepler, gauss_16"),
            &orbit(Wanted::default()),
            &orbit(Wanted { action: false, ..Wanted::default() }),
        )?,
        line(
            ("iteration (one matrix)", "oscillator, gauss_16"),
            &Scene::new(&unquadratic, start, 1000.0).by(sixteen).steps(Steps::Size(2.5)).wanting(none.clone()),
            &Scene::new(&oscillator, start, 1000.0).by(sixteen).steps(Steps::Size(2.5)).wanting(none.clone()),
        )?,
        line(("stages of z and rho", "pendulum, gauss_8"), &general(&constant_mass), &swing(eight, 1.0, &none))?,
        line(
            ("mass matrix at the stages", "pendulum, gauss_8"),
            &general(&plain),
            &Scene::new(&constant_mass, start, 1000.0).by(eight).steps(Steps::Size(1.0)).wanting(none.clone()),
        )?,
        line(
            ("Newton's method", "double pendulum, midpoint by composition or gauss_3"),
            &by(Integrator::Composition(discrete_herglotz::Method::Midpoint, SplittingScheme::YOSHIDA_6), 0.05),
            &by(Integrator::Gauss { stages: 3 }, 0.05),
        )?,
        line(("rows", "pendulum, blanes_moan_6"), &swing(nystrom, 0.2, &rows), &swing(nystrom, 0.2, &none))?,
        line(("conformal factor", "quadratic in z, gauss_8"), &decay(true), &decay(false))?,
    ])
}

fn main() {
    // `cargo test --benches` passes `--test`: nothing is measured then.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let lines = match lines() {
        Ok(lines) => lines,
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(1);
        }
    };
    println!("{:28} {:52} {:>10} {:>10} {:>6} {:>9}", "what is skipped", "on", "with, us", "without", "ratio", "apart");
    for Line { what, on, full, skipped, apart } in &lines {
        println!("{what:28} {on:52} {full:10.1} {skipped:10.1} {:6.2} {apart:9.1e}", full / skipped);
    }
    let Ok(out) = std::env::var("OUT") else { return };
    let written = std::fs::File::create(std::path::Path::new(&out).join("skips.csv")).and_then(|mut file| {
        writeln!(file, "skipped,on,seconds_with,seconds_without,apart")?;
        lines.iter().try_for_each(|l| {
            writeln!(file, "{},\"{}\",{:e},{:e},{:e}", l.what, l.on, l.full * 1e-6, l.skipped * 1e-6, l.apart)
        })
    });
    if let Err(error) = written {
        eprintln!("{error}");
        std::process::exit(1);
    }
}
