//! Growth of round-off in long runs of Gauss collocation: Brouwer's law for every route.

use crate::common::gauss::GaussSteppers;
use crate::common::lagrangians::WithGradientAndStructure;
use crate::lagrangians::One;
use contact_examples::systems::{Kepler, OneCoordinate, Pendulum};
use contact_geom::{Lagrangian, PhasePoint, Structure, VelocityPoint, legendre};
use discrete_herglotz::{Stepper, gauss::Gauss};

/// The number of starts, which differ in their last digits, and of steps from each.
const STARTS: usize = 16;
const STEPS: usize = 8192;

/// The bound on a bias, in units of its standard error: of a normal distribution, one value in 3e6 is beyond 5; of
/// Student's t with 15 degrees of freedom, one in 6000. With eight cases there is one false alarm in 800 changes of the
/// rounding.
const SIGMAS: f64 = 5.0;

/// The error of the energy after [`STEPS`] steps has no bias over the starts, and the size of a random walk: less than
/// `eps` times the square root of the number of steps. The energy is in units of its initial value, of size 1.
fn check<const N: usize>(
    name: &str,
    start: VelocityPoint<N>,
    mut stepper: impl FnMut(VelocityPoint<N>) -> Box<dyn FnMut(usize) -> PhasePoint<N>>,
    energy: impl Fn(&PhasePoint<N>) -> f64,
) {
    let errors: Vec<f64> = (0..STARTS)
        .map(|k| {
            let mut x = start;
            x.q[0] *= 1.0 + k as f64 * 2f64.powi(-46);
            let mut run = stepper(x);
            let before = energy(&run(0));
            (energy(&run(STEPS)) - before) / before
        })
        .collect();
    let n = STARTS as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let deviation = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let walk = f64::EPSILON * (STEPS as f64).sqrt();
    println!("{name}: {mean:.1e} +- {:.1e}, deviation {:.2} walks", deviation / n.sqrt(), deviation / walk);
    assert!(mean.abs() <= SIGMAS * deviation / n.sqrt(), "{name}: bias {mean:e}, deviation {deviation:e}");
    assert!(deviation <= walk, "{name}: deviation {deviation:e}");
}

fn runner<const N: usize>(mut stepper: impl Stepper + 'static) -> Box<dyn FnMut(usize) -> PhasePoint<N>> {
    Box::new(move |n| {
        stepper.advance(n).unwrap();
        stepper.state().fixed()
    })
}

/// Steps so short that the error of the method is below round-off. With coefficients rounded to doubles, or an
/// iteration that ends at the first change below round-off, the energy would drift by 1e-18 to 5e-17 a step.
#[test]
fn the_energy_does_not_drift() {
    let constant = Structure { autonomous: true, z_affine: true, constant_mass: true, ..Structure::default() };
    for gamma in [0.0, -1e-12] {
        let pendulum = OneCoordinate::from(Pendulum { gamma });
        let energy = move |x: &PhasePoint<1>| 0.5 * x.p[0] * x.p[0] + 2.0 * (0.5 * x.q[0]).sin().powi(2);
        for (structure, s, h) in [(pendulum.structure(), 12, 1.2), (constant, 12, 1.2)] {
            let lagrangian = One::from(WithGradientAndStructure(pendulum, structure));
            let gauss: &'static _ = Box::leak(Box::new(Gauss::new(lagrangian, s, h).unwrap()));
            let start = VelocityPoint::new([1.0], [1.0], 0.0);
            let make = |x: VelocityPoint<1>| gauss.stepper(0.0, legendre(&pendulum, 0.0, &x), x.v).unwrap();
            let scale = (-gamma * h * STEPS as f64).exp();
            let first = std::cell::Cell::new(true);
            let decayed = |x: &PhasePoint<1>| {
                let factor = if first.replace(!first.get()) { 1.0 } else { scale };
                (energy(x) - gamma * x.z) * factor
            };
            check(&format!("pendulum, {gamma:e}, {:?}", make(start).route()), start, |x| runner(make(x)), decayed);
        }
        let kepler = Kepler::<2> { mu: 1.0, gamma };
        // e = 0.3.
        let start = VelocityPoint::new([0.7, 0.0], [0.0, (1.3f64 / 0.7).sqrt()], 0.0);
        if gamma == 0.0 {
            let energy = |x: &PhasePoint<2>| 0.5 * x.p.dot(&x.p) - 1.0 / x.q.dot(&x.q).sqrt();
            let gauss: &'static _ = Box::leak(Box::new(Gauss::new(kepler, 16, 0.3).unwrap()));
            let make = |x: VelocityPoint<2>| gauss.stepper(0.0, legendre(&kepler, 0.0, &x), x.v).unwrap();
            check("kepler", start, |x| runner(make(x)), energy);
            let transformed =
                |x: VelocityPoint<2>| gauss.transformed_stepper(0.0, legendre(&kepler, 0.0, &x), x.v).unwrap();
            check("kepler with a time transformation", start, |x| runner(transformed(x)), energy);
        }
    }
}
