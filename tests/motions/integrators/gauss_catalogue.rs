//! Contact Gauss collocation on the systems of the catalogue: its fast steps are those of Newton's method, its flow is
//! conformally contact, and its curves meet the states.

use crate::common::gauss::GaussSteppers;
use crate::common::{TOLERANCE, around, bounded, on_some, relative_distance, step_from};
use crate::lagrangians::{KindVisitor, visit_kinds};
use contact_examples::systems::{System, SystemVisitor, visit_catalogue};
use contact_geom::{
    ChartVector, Derivatives, Lagrangian, PhasePoint, Statement, VelocityPoint, legendre,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use discrete_herglotz::{DiscreteLagrangian, StepDetails, Stepper, gauss::Gauss, statements, theory::derived_jet};

/// The stepper agrees with Newton's steps at random points of each system, and so does its `sigma_d`: to 1e-12, which
/// is round-off times its growth in five steps of these motions.
#[test]
fn the_stepper_takes_the_steps_of_newton() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for s in [1, 2, 3, 5, 8, 16] {
                let cases = if s * N > 24 { 4 } else { 12 };
                on_some(cases, &format!("{} with {s} stages", system.name()), 2 * N + 3, |u| {
                    let (t, x) = system.sample(&u[1..]);
                    compare(system, s, step_from(u[0]), t, &x)
                });
            }
        }
    }
    fn compare<const N: usize>(
        system: &impl Lagrangian<N>,
        s: usize,
        h: f64,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Result<(), String> {
        let gauss = Gauss::new(system, s, h).map_err(|e| e.to_string())?;
        let mut state = legendre(system, t, x);
        let mut guess = x.v;
        let mut stepper = gauss.stepper(t, state, x.v).map_err(|e| e.to_string())?;
        for k in 0..5 {
            let at = t + f64::from(k) * h;
            let step = gauss.forward(at, &state, &guess, &mut Default::default()).map_err(|e| e.to_string())?;
            (state, guess) = (step.end, step.velocity);
            stepper.advance(1).map_err(|halt| format!("{halt:?}"))?;
            let (off, of_sigma) =
                (relative_distance(stepper.state(), state), (stepper.sigma() / step.sigma - 1.0).abs());
            if !(off <= 1e-12 && of_sigma <= 1e-13) {
                return Err(format!("step {k}, h = {h}: off by {off:e}, sigma by {of_sigma:e}"));
            }
        }
        Ok(())
    }
    visit_catalogue(&mut Visitor);
}

/// Statement 24, `Phi* eta = sigma_d eta`, on each system: the differential of the action, through the stages, is `p1
/// dq1 - sigma_d p0 dq0 + (sigma_d - 1) dz0`, with the `p0`, `p1` and `sigma_d` of the step; to 1e-12.
#[test]
fn the_flow_is_conformal() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for s in [1, 2, 3, 5, 8, 16] {
                on_some(
                    if s * N > 24 { 2 } else { 8 },
                    &format!("{} with {s} stages", system.name()),
                    2 * N + 3,
                    |u| {
                        let (t, x) = system.sample(&u[1..]);
                        let h = step_from(u[0]);
                        let gauss = Gauss::new(system, s, h).map_err(|e| e.to_string())?;
                        let point = around(&x, h);
                        let said = gauss.jet(t, &point).map_err(|e| e.to_string())?;
                        let derived = derived_jet(&gauss, t, &point).map_err(|e| e.to_string())?;
                        let off = (said.d1 - derived.d1)
                            .max_abs_or_nan()
                            .max_or_nan((said.d2 - derived.d2).max_abs_or_nan())
                            .max_or_nan((said.dz - derived.dz).abs());
                        bounded(
                            off / (1.0 + derived.d1.max_abs_or_nan().max_or_nan(derived.d2.max_abs_or_nan())),
                            1e-12,
                        )
                    },
                );
            }
        }
    }
    visit_catalogue(&mut Visitor);
}

/// Statement 21, for which the first and second derivatives are compared with those of the value, statement 23 on Q x Q
/// x R and statement 24, with two and three stages, on one system of each kind.
#[test]
fn the_forms_are_conformal() {
    struct Visitor;
    impl KindVisitor for Visitor {
        fn visit<const N: usize, S: System<N>, L: Lagrangian<N> + Copy>(&mut self, system: &S, lagrangian: L) {
            for s in [2, 3] {
                on_some(8, &format!("{} with {s} stages", system.name()), 2 * N + 3, |u| {
                    let (t, x) = system.sample(&u[1..]);
                    let h = step_from(u[0]);
                    let gauss = Gauss::new(lagrangian, s, h).map_err(|e| e.to_string())?;
                    let point = around(&x, h);
                    for (statement, bound) in [
                        (Statement::DiscreteContactForms, TOLERANCE),
                        (Statement::DiscreteFlowIsConformal, 1e-12),
                        (Statement::HamiltonianFlowIsConformal, 1e-12),
                    ] {
                        match statements::residual(statement, &gauss, &[], t, &point) {
                            Ok(Some(r)) if r <= bound => {}
                            other => return Err(format!("statement {statement}, h = {h}: {other:?}")),
                        }
                    }
                    Ok(())
                });
            }
        }
    }
    visit_kinds(&mut Visitor);
}

/// The curve of each step meets the states at its ends, on each system: to 100 eps, the rounding of sums of sixteen
/// terms. Its velocity belongs to its momentum at the stages; in the middle, which is a stage for odd s, to round-off.
#[test]
fn curves_meet_the_states() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for s in [1, 2, 3, 8, 13, 16] {
                let (t0, x) = (system.initial_time(), system.initial());
                let start = legendre(system, t0, &x);
                let gauss = Gauss::new(system, s, 0.02);
                let stepper = gauss.as_ref().map(|g| g.stepper(t0, start, x.v));
                let Ok(Ok(mut stepper)) = stepper else { panic!("{}: no stepper", system.name()) };
                assert!(stepper.dense().is_none());
                for _ in 0..4 {
                    let (from, t) = (stepper.state().fixed::<N>(), stepper.time());
                    assert_eq!(stepper.advance(1), Ok(()), "{}", system.name());
                    let Some(curve) = stepper.dense() else { panic!("{}: no curve", system.name()) };
                    assert_eq!(curve.span(), (t, t + 0.02));
                    let off = |t: f64, x: PhasePoint<N>| {
                        let size =
                            ChartVector::from(x).max_abs_or_nan().max_or_nan(ChartVector::from(from).max_abs_or_nan());
                        ChartVector::from(curve.at(t).fixed::<N>()).minus(x.into()).max_abs_or_nan()
                            / (size * f64::EPSILON)
                    };
                    let (there, here) = (off(t, from), off(stepper.time(), stepper.state().fixed()));
                    assert!(there <= 100.0 && here <= 100.0, "{} s = {s}: {there}, {here} eps", system.name());
                    if s % 2 == 1 {
                        let middle = t + 0.01;
                        let at = curve.at(middle).fixed::<N>();
                        let v = VelocityPoint { q: at.q, v: curve.velocity(middle).fixed(), z: at.z };
                        let off =
                            (system.gradient(middle, &v).y - at.p).max_abs_or_nan() / (1.0 + at.p.max_abs_or_nan());
                        assert!(off <= 1e-12, "{} s = {s}: momentum off by {off:e}", system.name());
                    }
                }
            }
        }
    }
    visit_catalogue(&mut Visitor);
}
