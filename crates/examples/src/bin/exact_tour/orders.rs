//! Variational error analysis of every method on every system, with a figure for one system.

use contact_examples::systems::{CoupledInZ, System, SystemVisitor, visit_catalogue};
use contact_examples::{Axis, Checks, Curve, Directory, Failure, Line, Panel, Subject, draw_row, fractions};
use contact_geom::{Statement, VelocityPoint, legendre};
use discrete_herglotz::rules::Method;
use exact_lagrangian::{ErrorOrders, ExactError, MeasuredOrder, Order, error_orders};

/// The accepted deviation from the documented order.
const BAND: f64 = 0.15;

/// The largest step size.
const LARGEST: f64 = 0.25;

/// One measured order.
struct Row {
    system: &'static str,
    method: &'static str,
    quantity: &'static str,
    documented: u32,
    measured: MeasuredOrder,
}

/// The four quantities, each with its order for a method of order r.
fn quantities(orders: ErrorOrders, r: u32) -> [(&'static str, u32, MeasuredOrder); 4] {
    [
        ("value", r + 1, orders.value),
        ("legendre_minus", r, orders.legendre_minus),
        ("legendre_plus", r, orders.legendre_plus),
        ("flow", r + 1, orders.flow),
    ]
}

struct Walk<'a> {
    checks: &'a mut Checks,
    rows: Vec<Row>,
}

/// The deviation of a measured order from the documented one. A method may be exact, as the Strang splitting is for a
/// free particle.
fn off(measured: &MeasuredOrder, documented: u32) -> f64 {
    match measured.order {
        Order::Measured(order) => (order - f64::from(documented)).abs(),
        Order::Exact => 0.0,
        Order::Unclear => f64::INFINITY,
    }
}

/// The orders at a generic point; if one of them deviates from the documented order there, as where a leading error
/// coefficient almost vanishes, the orders at a second point.
fn measure<const N: usize, S: System<N>>(
    system: &S,
    method: Method,
) -> Result<[(&'static str, u32, MeasuredOrder); 4], ExactError<N>> {
    let at = |point: usize| {
        let (t, x) = system.sample(&fractions(point, 2 * N + 2));
        let start = legendre(system, t, &x);
        error_orders(system, |h| method.discretise(system, h, t, &start), t, &x, LARGEST)
            .map(|orders| quantities(orders, method.order()))
    };
    let first = at(3)?;
    if first.iter().all(|(_, documented, measured)| off(measured, *documented) <= BAND) { Ok(first) } else { at(4) }
}

impl SystemVisitor for Walk<'_> {
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
        for method in Method::applicable(&system.structure()) {
            let (system_name, method_name) = (system.name(), method.name());
            let subject = Subject::discrete(Statement::ErrorOrders, system_name, method_name, 0.0);
            match measure(system, method) {
                Err(error) => self.checks.record_within(BAND, &subject, Err::<Option<f64>, _>(error)),
                Ok(orders) => {
                    for (quantity, documented, measured) in orders {
                        let off = off(&measured, documented);
                        self.checks.record_within(BAND, &subject, Ok::<_, ExactError<N>>(Some(off)));
                        self.rows.push(Row {
                            system: system_name,
                            method: method_name,
                            quantity,
                            documented,
                            measured,
                        });
                    }
                }
            }
        }
    }
}

/// Measures all orders, records them in `checks`, and writes table and figure; returns a summary as text.
pub fn write(out: &Directory, checks: &mut Checks) -> Result<String, Failure> {
    let mut walk = Walk { checks, rows: Vec::new() };
    visit_catalogue(&mut walk);
    let rows = walk.rows;
    let columns = ["system", "method", "quantity", "documented", "measured", "smallest_h", "steps_fitted"];
    out.table(
        "orders.csv",
        &columns,
        rows.iter().map(|row| {
            let smallest = row.measured.fitted.last().map_or(f64::NAN, |(h, _)| *h);
            let (measured, count) = (row.measured.order.to_string(), row.measured.fitted.len());
            let names = [row.system, row.method, row.quantity].map(String::from);
            let numbers = [row.documented.to_string(), measured, format!("{smallest:.3e}"), count.to_string()];
            names.into_iter().chain(numbers)
        }),
    )?;
    figure(out)?;

    let mut text = format!(
        "\nOrders of the difference from the exact discrete Lagrangian: lowest and highest slope over the \
         catalogue\n\n  \
         {:<16}{:>16}{:>16}{:>16}{:>16}\n",
        "method", "|L_d - L_h^e|", "F-", "F+", "flow, one step"
    );
    let mut methods: Vec<&str> = rows.iter().map(|r| r.method).collect();
    methods.sort_unstable();
    methods.dedup();
    for method in methods {
        text += &format!("  {method:<16}");
        for quantity in ["value", "legendre_minus", "legendre_plus", "flow"] {
            let slope = |row: &Row| match row.measured.order {
                Order::Measured(order) => Some(order),
                Order::Exact | Order::Unclear => None,
            };
            let of = || rows.iter().filter(|r| r.method == method && r.quantity == quantity).filter_map(slope);
            let (low, high) = (of().fold(f64::INFINITY, f64::min), of().fold(0.0, f64::max));
            text += &format!("{:>16}", format!("{low:.2} .. {high:.2}"));
        }
        text += "\n";
    }
    text += "\n  \
             For a method of order r the value and the flow have order r + 1, as the theory states, and the Legendre \
             transforms\n  \
             order r: they are derivatives of L_d - L_h^e = h^(r+1) C(q0, u, z0) in q0 and q1, where u = (q1 - q0)/h \
             contributes\n  \
             a factor 1/h. In the flow F+ o (F-)^-1 the two errors cancel to leading order (Patrick and Cuell, \
             2009).\n";
    Ok(text)
}

/// The errors of the quadrature rules against the step, for a system nonlinear in z.
fn figure(out: &Directory) -> Result<(), Failure> {
    let system = CoupledInZ { gamma: -1.0, ..CoupledInZ::default() };
    let x = VelocityPoint::new([0.8], [-0.6], 0.4);
    let start = legendre(&system, 0.0, &x);
    let mut curves = Vec::new();
    let lines = [Line::Dotted, Line::Dashed, Line::Solid, Line::DashDot];
    for (method, line) in Method::RULES.iter().zip(lines) {
        let orders = error_orders(&system, |h| method.discretise(&system, h, 0.0, &start), 0.0, &x, LARGEST)?;
        curves.push((line, method.name(), orders));
    }
    let panel = |y_label: &str, of: fn(&ErrorOrders) -> &MeasuredOrder, named: bool| {
        Panel::new(
            ("time step h (dimensionless)", Axis::Logarithmic(-6, 0, 1)),
            (y_label, Axis::Logarithmic(-20, 0, 4)),
            (0.03, 0.98),
            curves
                .iter()
                .map(|(line, name, orders)| {
                    let points = of(orders).errors.iter().copied().filter(|(_, e)| *e > 0.0);
                    if named {
                        Curve::new(&name.replace('_', " "), *line, points)
                    } else {
                        Curve::unnamed(*line, points)
                    }
                })
                .collect(),
        )
    };
    let panels = [
        panel("error of Ld (dimensionless)", |o| &o.value, true),
        panel("error of F\u{207b}Ld (dimensionless)", |o| &o.legendre_minus, false),
        panel("error of one step (dimensionless)", |o| &o.flow, false),
    ];
    out.text("orders.svg", &draw_row(&panels))
}
