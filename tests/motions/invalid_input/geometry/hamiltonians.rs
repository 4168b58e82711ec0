//! Invalid input to contact Hamiltonians: their derivatives propagate a NaN, and a velocity without a momentum is refused.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report, places};
use contact_geom::nalgebra::SVector;
use contact_geom::support::{rounding_at_state, seed};
use contact_geom::{
    ChartVector, ContactHamiltonian, Derivatives, HamiltonianDerivatives, HamiltonianStructure, NoMomentum,
    OfHamiltonian, PhasePoint, Scalar, VelocityPoint, legendrian_defect, momentum,
};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "HamiltonianDerivatives::contact_field",
            "HamiltonianDerivatives::hessian",
            "HamiltonianDerivatives::with_gradient",
            "HamiltonianStructure::defect",
            "rounding_at_state",
        ],
        run: derivatives,
    },
    InputTest { entries: &["momentum"], run: momenta },
    InputTest { entries: &["LegendrianDefect::largest", "legendrian_defect"], run: graphs },
];

/// Nonlinear in all variables, with a regular `H_pp`.
struct Nonlinear;

impl ContactHamiltonian<1> for Nonlinear {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        let (q, p) = (q[0], p[0]);
        p * p * (z * z * 0.1 + 1.0) * 0.5 + p.powi(4) * 0.05 + q.sin() * (z + t) + z * 0.1
    }
}

fn derivatives(report: &mut Report) {
    for (t, x) in places() {
        let input = (t, x);
        let state = PhasePoint::from(x);
        let (h, d) = Nonlinear.with_gradient(t, &state);
        report.formula(&input, Ok::<_, NoMomentum>((h, d)));
        report.formula(&input, Ok::<_, NoMomentum>((h, Nonlinear.contact_field(t, &state))));
        let second = Nonlinear.hessian(t, &state);
        report.formula(&input, Ok::<_, NoMomentum>((second.qz[0], (second.vv[(0, 0)] + second.qq[(0, 0)], h))));
        // A claim cannot be judged where H is not finite; the false one is found where it is.
        let claim = HamiltonianStructure { z_free: true, ..HamiltonianStructure::default() };
        let judged = claim.defect(&Nonlinear, t, &state);
        let finite = h.is_finite() && d.is_finite();
        report.check(finite || judged.is_none(), || format!("{input:?}: {judged:?}"));
        let velocity = VelocityPoint { q: state.q, v: d.y, z: state.z };
        let (of_value, of_gradient) = rounding_at_state(&OfHamiltonian(Nonlinear), t, &velocity, &state);
        report.formula(&input, Ok::<_, NoMomentum>((of_value, of_gradient)));
    }
}

/// The form depends on momenta and on the factor; positions and actions enter by their derivatives alone.
fn graphs(report: &mut Report) {
    for p in EXTREME {
        let x = ChartVector { x: [0.3].into(), y: [p].into(), z: 0.2 };
        let x0: PhasePoint<1, _> = seed(&x).into();
        let x1 = PhasePoint { q: x0.q, p: x0.p + x0.p, z: x0.z + x0.z };
        let of = |r: f64| legendrian_defect(&x0, &x1, r.into()).largest();
        report.formula(&p, Ok::<_, NoMomentum>(of(2f64.ln())));
        report.check(of(f64::NAN).is_nan(), || format!("{p} with a factor that is not a number: {}", of(f64::NAN)));
    }
}

fn momenta(report: &mut Report) {
    for (t, x) in places() {
        let input = (t, x);
        let found = momentum(&Nonlinear, t, &VelocityPoint::from(x));
        report.entry_point(&input, found.map(|p| p[0]));
        // Through the Lagrangian of the Hamiltonian.
        let g = OfHamiltonian(Nonlinear).gradient(t, &VelocityPoint::from(x));
        report.formula(&input, Ok::<_, NoMomentum>(g));
    }
    /// Linear in p.
    struct Linear;
    impl ContactHamiltonian<1> for Linear {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
            p[0] * q[0]
        }
    }
    let found = momentum(&Linear, 0.0, &VelocityPoint::new([0.3], [0.7], 0.2));
    report.check(matches!(found, Err(NoMomentum::Singular { .. })), || format!("{found:?}"));
}
