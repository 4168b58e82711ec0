//! Invalid input to derivatives of runs.

use super::runs::seven;
use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{CLAIMING, EXTREME, Report, places, triples};
use crate::lagrangians::One;
use contact_geom::{Parametric, VelocityPoint};
use discrete_herglotz::sensitivity::{SensitivityError, StateDerivative, Variable};
use discrete_herglotz::{AnyIntegrator, InputError, Problem, Until};

pub const TESTS: &[InputTest] = &[InputTest { entries: &["Variable::all"], run: derivatives_in_all_variables }];

impl Parametric<1> for One {}

fn numbers(all: &[StateDerivative]) -> Vec<f64> {
    all.iter().flat_map(|x| [x.q[0], x.v[0], x.p[0], x.z]).collect()
}

fn derivatives_in_all_variables(report: &mut Report) {
    let by = Some(AnyIntegrator::Gauss { stages: 6 });
    for (t, x) in places() {
        let tangent = Problem::new(&CLAIMING, t, VelocityPoint::from(x)).map_err(SensitivityError::from);
        let tangent = tangent.and_then(|problem| {
            let run = seven(&problem, by).tangent(&Variable::all(&problem), Until::Time(t + 0.5))?;
            Ok(numbers(&run.columns))
        });
        report.entry_point(&(t, x), tangent);
    }
    let problem = Problem::new(&CLAIMING, 0.0, VelocityPoint::from(triples()[0])).unwrap();
    for factor in EXTREME {
        let bad = seven(&problem, by).tangent(&Variable::all(&problem), Until::Time(factor));
        let refused = matches!(bad, Err(SensitivityError::Input(InputError::Span { .. })));
        report.check(factor.is_finite() || refused, || format!("a span of {factor}"));
    }
}
