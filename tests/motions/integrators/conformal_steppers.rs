//! The steppers that are no discrete Lagrangians, the splittings and the compositions, are conformally contact too:
//! each of their maps is, and so is a product of such maps. Tested by the derivative of a whole step.

use crate::common::{bounded, on_some, step_from};
use contact_examples::systems::{System, SystemVisitor, visit_catalogue};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{
    ChartVector, Darboux, Derivatives, PhasePoint, legendre,
    numbers::{MaxAbsOrNan, MaxOrNan},
    support::conformality_with_jacobian,
};
use discrete_herglotz::{
    InputError, SplittingScheme, Stepper,
    rules::{Composition, Rule},
    splitting::Splitting,
};

/// The random cases for each system and scheme.
const CASES: u32 = 8;

/// The bound on the conformal defect: the round-off of the differences, `eps / 0.004` times the size of the terms of a
/// step.
const BOUND: f64 = 1e-9;

/// A state and `sigma_d` after one step.
fn step<const N: usize>(stepper: Result<impl Stepper, InputError>) -> Result<(PhasePoint<N>, f64), String> {
    let mut stepper = stepper.map_err(|e| e.to_string())?;
    stepper.advance(1).map_err(|halt| halt.cause.to_string())?;
    Ok((stepper.state().fixed(), stepper.sigma()))
}

/// The derivative of a map by central differences, extrapolated to order 8.
fn jacobian<const N: usize>(
    map: impl Fn(PhasePoint<N>) -> Result<PhasePoint<N>, String>,
    at: &PhasePoint<N>,
) -> Result<DMatrix<f64>, String> {
    const LEVELS: usize = 4;
    let n = ChartVector::<N>::DIMENSION;
    let mut jacobian = DMatrix::zeros(n, n);
    for j in 0..n {
        let moved = |by: f64| {
            let shift = ChartVector::<N>::from_fn(|i| if i == j { by } else { 0.0 });
            map(ChartVector::from(*at).plus(shift).into()).map(ChartVector::from)
        };
        let mut differences = Vec::new();
        for level in 0..LEVELS {
            let d = 0.03 * 0.5f64.powi(level as i32);
            differences.push(moved(d)?.minus(moved(-d)?).scale(0.5 / d).to_vector());
        }
        for order in 1..LEVELS {
            let factor = 1.0 / (4f64.powi(order as i32) - 1.0);
            for level in (order..LEVELS).rev() {
                let better = (&differences[level] - &differences[level - 1]) * factor;
                differences[level] += better;
            }
        }
        jacobian.set_column(j, &differences[LEVELS - 1]);
    }
    Ok(jacobian)
}

/// The conformal defect of a step, the difference of its factor from the `sigma_d` of the stepper, and the factor.
fn defect<const N: usize>(
    map: impl Fn(PhasePoint<N>) -> Result<(PhasePoint<N>, f64), String>,
    from: &PhasePoint<N>,
) -> Result<(f64, f64), String> {
    let (to, sigma) = map(*from)?;
    let jacobian = jacobian(|x| Ok(map(x)?.0), from)?;
    let measured = conformality_with_jacobian(&Darboux, &Darboux, &(*from).into(), &to.into(), &jacobian)
        .map_err(|e| e.to_string())?;
    let size = (1.0 + to.p.max_abs_or_nan()) * jacobian.max_abs_or_nan();
    Ok((
        (measured.defect * measured.pullback.max_abs_or_nan()).max_or_nan((measured.sigma - sigma).abs()) / size,
        sigma,
    ))
}

/// Every scheme, on every separable system with a linear drag, scales the contact form by `sigma_d`, which is `e^(gamma
/// h)` where the rate is constant.
#[test]
fn splittings() {
    struct Visitor {
        met: usize,
        separable: usize,
    }
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let structure = system.structure();
            self.separable += usize::from(structure.separable && structure.is_affine_in_z());
            let (t, x) = (system.initial_time(), system.initial());
            let start = legendre(system, t, &x);
            match Splitting::new(system, &SplittingScheme::STRANG, 0.1, t, start) {
                Ok(_) => self.met += 1,
                Err(InputError::Unclaimed { .. } | InputError::Hypothesis { .. }) => return,
                Err(error) => unreachable!("{}: {error}", system.name()),
            }
            for scheme in SplittingScheme::ALL {
                on_some(CASES, &format!("{} with {}", system.name(), scheme.name()), 2 * N + 3, |u| {
                    let ((t, x), h) = (system.sample(&u[1..]), step_from(u[0]));
                    let map = |from| step(Splitting::new(system, &scheme, h, t, from));
                    let (defect, sigma) = defect(map, &legendre(system, t, &x))?;
                    if structure.has_constant_rate() {
                        let rate = (system.gradient(t, &x).z * h).exp();
                        bounded((sigma / rate - 1.0).abs(), 4.0 * f64::EPSILON)?;
                    }
                    bounded(defect, BOUND)
                });
            }
        }
    }
    let mut visitor = Visitor { met: 0, separable: 0 };
    visit_catalogue(&mut visitor);
    assert_eq!(visitor.met, visitor.separable, "the separable systems with a linear drag");
}

/// Compositions of the symmetric midpoint rule, on every system, scale it by the product of the `sigma_d` of the
/// substeps.
#[test]
fn compositions() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for scheme in SplittingScheme::ALL.into_iter().filter(|scheme| !scheme.is_nystrom()) {
                on_some(CASES, &format!("{} with {}", system.name(), scheme.name()), 2 * N + 3, |u| {
                    let ((t, x), h) = (system.sample(&u[1..]), step_from(u[0]));
                    let rule = |h| Rule::MIDPOINT.of(system, h);
                    let map = |from| step(Composition::new(rule, &scheme, h, t, from));
                    bounded(defect(map, &legendre(system, t, &x))?.0, BOUND)
                });
            }
        }
    }
    visit_catalogue(&mut Visitor);
}
