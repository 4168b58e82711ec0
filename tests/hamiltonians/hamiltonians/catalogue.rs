//! The Hamiltonian of a regular Lagrangian, given directly, moves as the Lagrangian does.

use super::systems::{Line, One, Two};
use crate::common::relative_distance;
use contact_examples::systems::{
    ChargedParticle, CoupledPlane, DoublePendulum, Duffing, FreeParticle, HarmonicOscillator, LaneEmden, OneCoordinate,
    Pendulum, PerturbedKepler, QuadraticInZ, Relativistic, SphericalPendulum, System, TwoCoordinates, UniformField,
};
use contact_geom::{ContactHamiltonian, Derivatives, Lagrangian, OfHamiltonian, legendre};
use discrete_herglotz::gauss::GaussStepper;
use discrete_herglotz::{Problem, Stepper, StepperOptions};

/// Both routes of a system with 8 stages to time 2: the states agree to the round-off of the two runs, whose steps are
/// the same equations.
fn compare<L: Lagrangian<N> + From<S>, S: System<N>, const N: usize>(
    system: S,
    hamiltonian: impl ContactHamiltonian<N>,
) {
    let (name, t, x) = (system.name(), system.initial_time(), system.initial());
    let (lagrangian, of) = (L::from(system), OfHamiltonian(hamiltonian));
    let by_lagrangian = Problem::new(&lagrangian, t, x).unwrap();
    let by_hamiltonian = Problem::of_hamiltonian(&of, t, legendre(&lagrangian, t, &x)).unwrap();
    // The steppers alone: whole runs of so many types would take long to compile.
    let options = StepperOptions { action: true, check_resolution: false, ..StepperOptions::default() };
    let mut a = GaussStepper::new(&by_lagrangian, 8, 1.0 / 128.0, options).unwrap();
    let mut b = GaussStepper::new(&by_hamiltonian, 8, 1.0 / 128.0, options).unwrap();
    a.advance(256).unwrap();
    b.advance(256).unwrap();
    let (a, b) = (a.state(), b.state());
    let off = relative_distance(a, b);
    assert!(off <= 1e-12, "{name}: {off:e}");
    // The Lagrangian of the Hamiltonian, and its derivatives.
    let (l, g) = (lagrangian.value(t, &x.q, &x.v, x.z), lagrangian.gradient(t, &x));
    let (m, k) = (of.value(t, &x.q, &x.v, x.z), of.gradient(t, &x));
    assert!((l - m).abs() <= 1e-13 * (1.0 + l.abs()), "{name}: L {l} {m}");
    assert!(g.minus(k).amax() <= 1e-12 * (1.0 + g.amax()), "{name}: {g:?} {k:?}");
    let (w, u) = (lagrangian.hessian(t, &x), of.hessian(t, &x));
    let apart = [w.qq - u.qq, w.qv - u.qv, w.vv - u.vv].iter().map(|m| m.norm()).sum::<f64>();
    let apart = apart + (w.qz - u.qz).norm() + (w.vz - u.vz).norm() + (w.zz - u.zz).abs();
    assert!(apart <= 1e-10 * (1.0 + w.qq.norm() + w.qv.norm() + w.vv.norm()), "{name}: {apart:e}");
}

#[test]
fn a_hamiltonian_moves_as_its_lagrangian() {
    let one: [OneCoordinate; 8] = [
        FreeParticle::default().into(),
        HarmonicOscillator::default().into(),
        Pendulum::default().into(),
        Duffing::default().into(),
        Duffing::forced().into(),
        LaneEmden::default().into(),
        QuadraticInZ::default().into(),
        Relativistic::default().into(),
    ];
    let two: [TwoCoordinates; 6] = [
        UniformField::default().into(),
        SphericalPendulum::default().into(),
        DoublePendulum::default().into(),
        PerturbedKepler::default().into(),
        CoupledPlane::default().into(),
        ChargedParticle::default().into(),
    ];
    let mut compared = 0;
    for system in one.into_iter().filter(has_hamiltonian) {
        compare::<Line, _, 1>(system, One::Of(system));
        compared += 1;
    }
    for system in two.into_iter().filter(has_hamiltonian) {
        compare::<TwoCoordinates, _, 2>(system, Two::Of(system));
        compared += 1;
    }
    assert!(compared >= 12, "{compared} systems have a closed Hamiltonian");
}

/// Whether the Hamiltonian of a system is known in closed form.
fn has_hamiltonian<S: System<N>, const N: usize>(system: &S) -> bool {
    let (t, x) = (system.initial_time(), system.initial());
    system.hamiltonian(t, &legendre(system, t, &x)).is_some()
}
