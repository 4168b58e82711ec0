//! The Hamiltonian of a regular Lagrangian, given directly, moves as the Lagrangian does.

use super::systems::{One, Two};
use crate::common::relative_distance;
use contact_geom::systems::{
    ChargedParticle, CoupledPlane, DoublePendulum, Duffing, FreeParticle, HarmonicOscillator, LaneEmden, OneCoordinate,
    Pendulum, PerturbedKepler, QuadraticInZ, Relativistic, SphericalPendulum, System, TwoCoordinates, UniformField,
};
use contact_geom::{ContactHamiltonian, Derivatives, Lagrangian, OfHamiltonian, legendre};
use discrete_herglotz::gauss::GaussStepper;
use discrete_herglotz::{Problem, Stepper, StepperOptions};

/// Both routes of a system with 8 stages to time 2: the states agree to the round-off of the two runs, whose steps are
/// the same equations.
fn compare<S: System<N>, H: ContactHamiltonian<N>, const N: usize>(system: &S, hamiltonian: H) {
    let (t, x) = (system.initial_time(), system.initial());
    let of = OfHamiltonian(hamiltonian);
    let by_lagrangian = Problem::new(system, t, x).unwrap();
    let by_hamiltonian = Problem::of_hamiltonian(&of, t, legendre(system, t, &x)).unwrap();
    // The steppers alone: whole runs of so many types would take long to compile.
    let options = StepperOptions { action: true, check_resolution: false };
    let mut a = GaussStepper::new(&by_lagrangian, 8, 1.0 / 128.0, options).unwrap();
    let mut b = GaussStepper::new(&by_hamiltonian, 8, 1.0 / 128.0, options).unwrap();
    a.advance(256).unwrap();
    b.advance(256).unwrap();
    let (a, b) = (a.state(), b.state());
    let off = relative_distance(a, b);
    assert!(off <= 1e-12, "{}: {off:e}", system.name());
    // The Lagrangian of the Hamiltonian, and its derivatives.
    let (l, g) = (system.value(t, &x.q, &x.v, x.z), system.gradient(t, &x));
    let (m, k) = (of.value(t, &x.q, &x.v, x.z), of.gradient(t, &x));
    assert!((l - m).abs() <= 1e-13 * (1.0 + l.abs()), "{}: L {l} {m}", system.name());
    assert!(g.minus(k).amax() <= 1e-12 * (1.0 + g.amax()), "{}: {g:?} {k:?}", system.name());
    let (w, u) = (system.hessian(t, &x), of.hessian(t, &x));
    let apart = [w.qq - u.qq, w.qv - u.qv, w.vv - u.vv].iter().map(|m| m.norm()).sum::<f64>();
    let apart = apart + (w.qz - u.qz).norm() + (w.vz - u.vz).norm() + (w.zz - u.zz).abs();
    assert!(apart <= 1e-10 * (1.0 + w.qq.norm() + w.qv.norm() + w.vv.norm()), "{}: {apart:e}", system.name());
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
        compare(&system, One::Of(system));
        compared += 1;
    }
    for system in two.into_iter().filter(has_hamiltonian) {
        compare(&system, Two::Of(system));
        compared += 1;
    }
    assert!(compared >= 12, "{compared} systems have a closed Hamiltonian");
}

/// Whether the Hamiltonian of a system is known in closed form.
fn has_hamiltonian<S: System<N>, const N: usize>(system: &S) -> bool {
    let (t, x) = (system.initial_time(), system.initial());
    system.hamiltonian(t, &legendre(system, t, &x)).is_some()
}
