//! A formula and its derivatives are evaluated without allocation.

#[allow(dead_code)] // Other binaries use the rest of it.
#[path = "../../../tests/common/counting_allocator.rs"]
mod counting_allocator;

use contact_geom::table::{Interpolation, Table};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint};
use counting_allocator::allocations;
use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
use formula_lagrangian::{Formula, FormulaLagrangian};

#[test]
fn nothing_is_allocated() {
    // The counter works.
    assert_eq!(allocations(|| drop(Box::new(1.0))), 1);
    // Eight coordinates, each coupled to its neighbours, with a kinetic energy that depends on position: two hundred
    // second derivatives.
    let text =
        "sum(i, 0, n-1, v[i]^2*(2 + sin(q[i])))/2 - sum(i, 1, n-1, cos(q[i] - q[i-1])*v[i]*v[i-1]) - exp(-a*t)*z";
    let l: FormulaLagrangian<8> = Formula::parse(text, &["q[8]"], &[("a", 0.1)]).unwrap().lagrangian().unwrap();
    let x = VelocityPoint::new([0.3; 8], [0.7; 8], 0.1);
    let mut sum = 0.0;
    let count = allocations(|| {
        sum += l.value(0.5, &x.q, &x.v, x.z) + l.with_gradient(0.5, &x).1.z + l.gradient(0.5, &x).x[0];
        sum += l.force(0.5, &x)[7] + l.mass_matrix(0.5, &x)[(6, 7)] + l.hessian(0.5, &x).vv[(1, 1)];
    });
    assert!(sum.is_finite());
    assert_eq!(count, 0);
    // Forces, tables, and switching functions into a vector with room for them.
    let table = Table::new(&[0.0, 1.0, 2.0], &[1.0, 3.0, 0.0], Interpolation::Cubic).unwrap();
    let text = "force[q[i]] = -a*v[i]*abs(v[i]) + drive(t); sum(i, 0, n-1, v[i]^2 - abs(q[i]))";
    let forced = Formula::parse_with_tables(text, &["q[8]"], &[("a", 0.1)], &[("drive", table)]).unwrap();
    let forced: FormulaLagrangian<8> = forced.lagrangian().unwrap();
    let mut values = Vec::with_capacity(16);
    let count = allocations(|| {
        sum += forced.applied_force(0.5, &x)[7] + l.applied_force(0.5, &x)[7];
        forced.switching_functions(0.5, &x, &mut values);
        sum += forced.breaks().len() as f64 + f64::from(forced.has_force());
    });
    assert!(sum.is_finite() && values.len() == 16);
    assert_eq!(count, 0);
    // The steps of integrators do not allocate either: they do not use nested dual numbers, whose registers are on the
    // heap.
    let pendulum = Formula::parse("x'^2*(2 + sin(x))/2 + cos(x) - exp(-a*t)*z", &["x"], &[("a", 0.1)]).unwrap();
    let pendulum: FormulaLagrangian<1> = pendulum.lagrangian().unwrap();
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([0.3], [0.7], 0.1)).unwrap();
    for stages in [1, 2, 8, 16] {
        let plan = problem.by(GaussCollocation { stages }).steps(Steps::Size(1e-3)).plan(Until::Time(1.0)).unwrap();
        let mut stepper = plan.stepper().unwrap();
        stepper.advance(1).unwrap();
        assert_eq!(allocations(|| stepper.advance(10).unwrap()), 0, "{stages} stages");
    }
    // Steps that are searched for a kink and do not contain one do not allocate either.
    let kinked = Formula::parse("x'^2/2 - x^2/2 - max(x - 100, 0)", &["x"], &[]).unwrap().lagrangian::<1>().unwrap();
    let problem = Problem::new(&kinked, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let plan = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(1e-1)).plan(Until::Time(10.0)).unwrap();
    let mut stepper = plan.stepper().unwrap();
    stepper.advance(1).unwrap();
    assert_eq!(allocations(|| stepper.advance(10).unwrap()), 0, "beside a kink");
}
