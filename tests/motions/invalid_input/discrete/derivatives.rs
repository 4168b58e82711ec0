//! Invalid input to derivatives of runs.

use super::runs::seven;
use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{BASE, CLAIMING, EXTREME, Report, places, triples};
use crate::lagrangians::One;
use contact_geom::{Parametric, Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::{EndState, Loss, SensitivityError, StateDerivative, Variable};
use discrete_herglotz::{AnyIntegrator, InputError, Problem, Until};

pub const TESTS: &[InputTest] = &[InputTest {
    entries: &[
        "Run::second_tangent",
        "Run::second_tangent_along",
        "Run::hessian",
        "Run::hessian_along",
        "Variable::all",
    ],
    run: second_derivatives,
}];

impl Parametric<1> for One {}

/// A multiple of the square of the end's position.
struct Multiple(f64);

impl Loss<1> for Multiple {
    fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
        end.q[0] * end.q[0] * self.0
    }
}

fn numbers(all: &[StateDerivative<1>]) -> Vec<f64> {
    all.iter().flat_map(|x| [x.q[0], x.v[0], x.p[0], x.z]).collect()
}

fn second_derivatives(report: &mut Report) {
    let by = Some(AnyIntegrator::Gauss { stages: 6 });
    for (t, x) in places() {
        let second = Problem::new(&CLAIMING, t, VelocityPoint::from(x)).map_err(SensitivityError::from);
        let second = second.and_then(|problem| {
            let variables = Variable::all(&problem);
            let run = seven(&problem, by).second_tangent(&variables, Until::Time(t + 0.5))?;
            Ok(run.end.map(|end| (numbers(&end.columns), numbers(&end.second.concat()))))
        });
        report.entry_point(&(t, x), second);
    }
    let problem = Problem::new(&CLAIMING, 0.0, VelocityPoint::from(triples()[0])).unwrap();
    let (variables, until) = ([Variable::Position(0), Variable::Action], Until::Time(BASE[0]));
    for factor in EXTREME {
        let direction = [vec![factor, 1.0]];
        let run = || seven(&problem, by);
        let second = run().second_tangent_along(&variables, &direction, until);
        report.entry_point(&factor, second.map(|run| run.end.map(|end| numbers(&end.second[0]))));
        let product = run().hessian_along(&Multiple(1.0), &variables, &direction, until);
        report.entry_point(&factor, product.map(|run| run.loss.map(|loss| loss.hessian)));
        let hessian = run().hessian(&Multiple(factor), &variables, until);
        report.entry_point(&factor, hessian.map(|run| run.loss.map(|loss| (loss.value, loss.hessian))));
        let bad = seven(&problem, by).second_tangent(&variables, Until::Time(factor));
        let refused = matches!(bad, Err(SensitivityError::Input(InputError::Span { .. })));
        report.check(factor.is_finite() || refused, || format!("a span of {factor}"));
    }
}
