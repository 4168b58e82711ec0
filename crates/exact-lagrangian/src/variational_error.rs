//! Variational error analysis: the error of a discrete Lagrangian against the exact one, and the order of its flow.

use crate::{ExactError, herglotz_flow};
use contact_geom::{
    ChartVector, Derivatives, DiscretePoint, Lagrangian, PhasePoint, VelocityPoint, numbers::max_or_nan,
};
use discrete_herglotz::{
    DiscreteLagrangian, InputError,
    solve::Solver,
    theory::{legendre_minus, legendre_plus},
};

/// An order, as far as the errors at all time steps determine it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// The least-squares slope of the error against the time step, both on a logarithmic scale.
    Measured(f64),
    /// The error is round-off at every step.
    Exact,
    /// Fewer than three steps have an error above the round-off plateau, so that no order can be measured.
    Unclear,
}

impl Order {
    /// Whether it is measured and within a band around an expected order.
    pub fn is(self, expected: f64, band: f64) -> bool {
        matches!(self, Order::Measured(found) if (found - expected).abs() < band)
    }
}

impl std::fmt::Display for Order {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Order::Measured(order) => write!(f, "{order:.3}"),
            Order::Exact => write!(f, "exact"),
            Order::Unclear => write!(f, "unclear"),
        }
    }
}

/// An order measured as the slope of an error against the time step, both on a logarithmic scale.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MeasuredOrder {
    /// The order.
    pub order: Order,
    /// All time steps with their errors, from the largest.
    pub errors: Vec<(f64, f64)>,
    /// The steps that were fitted: the smallest whose errors are above the round-off plateau.
    pub fitted: Vec<(f64, f64)>,
}

/// The orders of a discrete Lagrangian against the exact one at a point.
///
/// For a method whose flow has order r, `value` and `flow` are `r + 1`, and `legendre_minus` and `legendre_plus` at
/// least r. By the theorem in the literature all of them are `r + 1` (Marsden and West, Acta Numerica 10 (2001),
/// theorem 2.3.1); but `L_d - L_h^e = h^(r+1) C(q0, u, z0)` is smooth in the mean velocity `u = (q1 - q0)/h`, so that
/// its derivatives in `q0` and `q1` have a factor `1/h`, and the momenta agree to order r only. The flow has the full
/// order: the inverse of `F-` changes `q1` by h times that error, and in `F+ o (F-)^-1` the errors of the two momenta
/// cancel to leading order. This is proved in Patrick and Cuell, "Error analysis of variational integrators of
/// unconstrained Lagrangian systems", Numer. Math. 113 (2009).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ErrorOrders {
    /// The order of `|L_d - L_h^e|`.
    pub value: MeasuredOrder,
    /// The order of `|F-L_d - F-L_h^e|`.
    pub legendre_minus: MeasuredOrder,
    /// The order of `|F+L_d - F+L_h^e|`.
    pub legendre_plus: MeasuredOrder,
    /// The order of the error of one step of the flow on T\*Q x R from the same state.
    pub flow: MeasuredOrder,
}

/// The number of time steps, from the largest by factors of the square root of two: down to 3e-7 times the largest.
const STEPS: usize = 44;

/// The number of steps that are fitted, if so many are above the plateau: a factor of ten in h.
const FITTED_STEPS: usize = 8;

/// The factor by which an error must exceed its round-off to be used. The slope of a fit over a factor of ten in h then
/// has an error of less than 0.01.
const MIN_ERROR_OVER_ROUND_OFF: f64 = 200.0;

/// Measures the orders of a discrete Lagrangian, given as a function of the time step, along the motion from a start at
/// time t. `largest` is the largest step tried; the others are smaller by factors of the square root of two. For a
/// method of documented order r, `value` and `flow` should show `r + 1` on a problem that is nonlinear in q and z.
///
/// ```
/// use contact_examples::systems::QuadraticInZ;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::rules::Rule;
/// use exact_lagrangian::error_orders;
///
/// let system = QuadraticInZ { c: 1.0 };
/// let x = VelocityPoint::new([0.8], [-0.6], 0.4);
/// let orders = error_orders(&system, |h| Rule::MIDPOINT.of(&system, h), 0.0, &x, 0.5)?;
/// assert!(orders.value.order.is(3.0, 0.15) && orders.flow.order.is(3.0, 0.15));
/// # Ok::<(), exact_lagrangian::ExactError<1>>(())
/// ```
///
/// # Errors
/// [`ExactError::Input`] for bad arguments or a method that refuses a step, and those of the motion; steps at which the
/// method itself fails are omitted.
pub fn error_orders<D: DiscreteLagrangian<N>, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    method: impl Fn(f64) -> Result<D, InputError>,
    t: f64,
    x: &VelocityPoint<N>,
    largest: f64,
) -> Result<ErrorOrders, ExactError<N>> {
    if !(largest > 0.0 && largest.is_finite()) {
        return Err(InputError::Step { h: largest }.into());
    }
    let p0 = lagrangian.gradient(t, x).y;
    let start = PhasePoint { q: x.q, p: p0, z: x.z };
    let mut rows: [Vec<Row>; 4] = Default::default();
    let mut solver = Solver::default();
    for k in 0..STEPS {
        let h = largest * 0.5f64.powf(0.5 * k as f64);
        let ld = method(h)?;
        let motion = match herglotz_flow(lagrangian, t, x, h) {
            Ok(motion) => motion,
            Err(error @ ExactError::Input(_)) => return Err(error),
            // A step too large for the motion; smaller ones follow.
            Err(_) => continue,
        };
        let end = PhasePoint { q: motion.end.q, p: lagrangian.gradient(t + h, &motion.end).y, z: motion.end.z };
        let point = DiscretePoint { q0: x.q, q1: end.q, z0: x.z };
        // The round-off of the positions, which enters p through W/h, and of the terms of z.
        let position = f64::EPSILON * x.q.amax().max(end.q.amax());
        let momentum = f64::EPSILON * p0.amax().max(end.p.amax()) + position * slope(lagrangian, t, x) / h;
        let action = p0.amax().max(end.p.amax()) * position + f64::EPSILON * motion.action.abs();
        let state = position + f64::EPSILON * end.p.amax().max(end.z.abs()).max(x.z.abs());
        let away = |found: PhasePoint<N>, truth: PhasePoint<N>| ChartVector::from(found).minus(truth.into()).amax();
        let mut put = |i: usize, error: Option<f64>, floor: f64| {
            if let Some(error) = error.filter(|e: &f64| e.is_finite()) {
                rows[i].push(Row { h, error, floor });
            }
        };
        put(0, ld.value(t, &point).ok().map(|l: f64| (l - motion.action).abs()), action);
        put(1, legendre_minus(&ld, t, &point).ok().map(|found| away(found, start)), momentum);
        put(2, legendre_plus(&ld, t, &point).ok().map(|found| away(found, end)), momentum);
        let step = ld.forward(t, &start, &(motion.displacement / h), &mut solver);
        put(3, step.ok().map(|step| away(step.end, end)), state);
    }
    let [value, legendre_minus, legendre_plus, flow] = rows.map(fit);
    Ok(ErrorOrders { value, legendre_minus, legendre_plus, flow })
}

/// The size of W, the derivative of the momentum with respect to the velocity.
fn slope<const N: usize>(lagrangian: &impl Lagrangian<N>, t: f64, x: &VelocityPoint<N>) -> f64 {
    lagrangian.hessian(t, x).vv.amax()
}

/// An error at a time step, with a lower bound of its round-off.
struct Row {
    h: f64,
    error: f64,
    floor: f64,
}

/// The number of smallest steps that show the round-off plateau if their errors do not decrease: as many as are fitted.
const PLATEAU_STEPS: usize = 8;

/// The largest slope of a plateau: half of the lowest possible order.
const MAX_PLATEAU_SLOPE: f64 = 0.5;

/// Raises the round-off of the errors, if it is too low, to the plateau of the smallest steps. The plateau is constant
/// or grows by at most `1/h`, as it does where momenta are differences of positions divided by h.
fn raise_floors(rows: &mut [Row]) {
    let smallest = &rows[rows.len().saturating_sub(PLATEAU_STEPS)..];
    let positive: Vec<(f64, f64)> = smallest.iter().filter(|r| r.error > 0.0).map(|r| (r.h, r.error)).collect();
    if positive.len() < PLATEAU_STEPS || !smallest.iter().any(|r| r.error > MIN_ERROR_OVER_ROUND_OFF * r.floor) {
        return;
    }
    let slope = least_squares_slope(&positive);
    if slope < MAX_PLATEAU_SLOPE {
        let slope = slope.clamp(-1.0, 0.0);
        let level = positive.iter().map(|(h, e)| e.ln() - slope * h.ln()).sum::<f64>() / positive.len() as f64;
        rows.iter_mut().for_each(|r| r.floor = max_or_nan(r.floor, (level + slope * r.h.ln()).exp()));
    }
}

fn fit(mut rows: Vec<Row>) -> MeasuredOrder {
    raise_floors(&mut rows);
    let errors = rows.iter().map(|r| (r.h, r.error)).collect();
    let clear: Vec<(f64, f64)> =
        rows.iter().take_while(|r| r.error > MIN_ERROR_OVER_ROUND_OFF * r.floor).map(|r| (r.h, r.error)).collect();
    let fitted = clear[clear.len().saturating_sub(FITTED_STEPS)..].to_vec();
    let order = match fitted.len() {
        0 if rows.is_empty() => Order::Unclear,
        0 => Order::Exact,
        1 | 2 => Order::Unclear,
        _ => Order::Measured(least_squares_slope(&fitted)),
    };
    MeasuredOrder { order, errors, fitted }
}

/// The least-squares slope of the logarithm of the second entries against that of the first.
fn least_squares_slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), (h, e)| (x + h.ln() / n, y + e.ln() / n));
    let covariance: f64 = points.iter().map(|(h, e)| (h.ln() - x) * (e.ln() - y)).sum();
    covariance / points.iter().map(|(h, _)| (h.ln() - x).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_examples::systems::CoupledInZ;
    use contact_geom::Scalar;
    use discrete_herglotz::StepError;
    use discrete_herglotz::rules::{Quadrature, Rule};

    /// The midpoint rule, given by its value alone: its momenta and steps are differences that lose digits like `1/h`.
    struct WithoutClosedDerivatives<'a>(Quadrature<&'a CoupledInZ>);
    impl DiscreteLagrangian<1> for WithoutClosedDerivatives<'_> {
        fn step_size(&self) -> f64 {
            DiscreteLagrangian::<1>::step_size(&self.0)
        }
        fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
            self.0.value(t, x)
        }
    }

    /// The plateau of a discrete Lagrangian that is given by its value alone is not fitted, whatever the largest step;
    /// where no step is above it, no order is reported.
    #[test]
    fn a_plateau_is_no_order() {
        let system = CoupledInZ::default();
        let x = VelocityPoint::new([0.8], [-0.6], 0.4);
        let of = |largest| {
            error_orders(&system, |h| Rule::MIDPOINT.of(&system, h).map(WithoutClosedDerivatives), 0.0, &x, largest)
                .unwrap()
        };
        let orders = of(0.25);
        for (what, found, expected) in [
            ("value", &orders.value, 3.0),
            ("F-", &orders.legendre_minus, 2.0),
            ("F+", &orders.legendre_plus, 2.0),
            ("flow", &orders.flow, 3.0),
        ] {
            assert!(found.order.is(expected, 0.15), "{what}: {:?} from {:?}", found.order, found.fitted);
        }
        for largest in [1e-3, 1e-6, 1e-9] {
            let orders = of(largest);
            for (found, expected) in [(&orders.value, 3.0), (&orders.legendre_minus, 2.0), (&orders.flow, 3.0)] {
                let told = matches!(found.order, Order::Exact | Order::Unclear) || found.order.is(expected, 0.3);
                assert!(told, "{largest}: {:?} from {:?}", found.order, found.fitted);
            }
        }
    }

    /// Two steps above the plateau give no slope. With no step above it the method is exact; without any steps nothing
    /// is known.
    #[test]
    fn what_can_be_told_of_an_order() {
        let of = |errors: &[f64]| {
            let row = |(k, e): (usize, &f64)| Row { h: 0.5f64.powi(k as i32), error: *e, floor: 1e-16 };
            fit(errors.iter().enumerate().map(row).collect()).order
        };
        assert_eq!(of(&[]), Order::Unclear);
        assert_eq!(of(&[1e-16; 12]), Order::Exact);
        let two: Vec<f64> = (0..12).map(|k| if k < 2 { 0.1f64.powi(k) } else { 1e-10 * 2f64.powi(k) }).collect();
        assert_eq!(of(&two), Order::Unclear);
        let cubic: Vec<f64> = (0..40).map(|k| 0.125f64.powi(k) + 1e-12 * 2f64.powi(k)).collect();
        assert!(of(&cubic).is(3.0, 0.01), "{:?}", of(&cubic));
    }
}
