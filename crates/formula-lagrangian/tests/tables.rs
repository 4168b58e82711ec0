//! Tables in formulas, and the times of kinks and jumps.

use contact_geom::nalgebra::SVector;
use contact_geom::{
    Derivatives, ForceStructure, Lagrangian, Scalar, VelocityPoint, WithoutClosedDerivatives,
    table::{Interpolation, Table},
};
use discrete_herglotz::{AnyIntegrator, Problem, Steps, Until};
use formula_lagrangian::{Formula, FormulaError, FormulaLagrangian, Graph, Operation, Symbols};

const TIMES: [f64; 5] = [0.0, 0.5, 1.5, 2.0, 4.0];
const VALUES: [f64; 5] = [1.0, -2.0, 0.5, 3.0, 0.0];
const KINDS: [Interpolation; 3] = [Interpolation::Held, Interpolation::Linear, Interpolation::Cubic];
const PARAMETERS: [(&str, f64); 2] = [("a", 2.0), ("t1", 0.75)];

fn drive(interpolation: Interpolation) -> Table {
    Table::new(&TIMES, &VALUES, interpolation).unwrap()
}

fn formula(text: &str, interpolation: Interpolation) -> Formula {
    Formula::parse_with_tables(text, &["x"], &PARAMETERS, &[("drive", drive(interpolation))]).unwrap()
}

fn lagrangian(text: &str, interpolation: Interpolation) -> FormulaLagrangian<1> {
    formula(text, interpolation).lagrangian().unwrap()
}

/// The same Lagrangian as a type.
struct Driven(Table);
impl Lagrangian<1> for Driven {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * self.0.value(t * 2.0 - 0.75) * 0.5 + self.0.value(q[0]) * self.0.value(v[0]) - q[0] * q[0]
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * (1.0 + b.abs())
}

#[test]
fn values_and_derivatives_are_those_of_a_type() {
    for interpolation in KINDS {
        let l = lagrangian("x'^2*drive(a*t - t1)/2 + drive(x)*drive(x') - x^2", interpolation);
        let typed = Driven(drive(interpolation));
        for k in 0..200 {
            let of = |i: usize| ((k * 7 + i) as f64 * 0.618_033_988_749_894_9).fract() * 5.0 - 0.5;
            let (t, x) = (of(0), VelocityPoint::new([of(1)], [of(2)], 0.0));
            assert!(close(l.value(t, &x.q, &x.v, x.z), typed.value(t, &x.q, &x.v, x.z)));
            let (found, expected) = (l.gradient(t, &x), typed.gradient(t, &x));
            assert!(close(found.x[0], expected.x[0]) && close(found.y[0], expected.y[0]), "{interpolation:?}");
            // Second derivatives, and the derivatives of the formula by dual numbers.
            let expected = typed.hessian(t, &x);
            for found in [l.hessian(t, &x), WithoutClosedDerivatives(&l).hessian(t, &x)] {
                let pairs = [(found.qq, expected.qq), (found.qv, expected.qv), (found.vv, expected.vv)];
                assert!(pairs.iter().all(|(a, b)| close(a[0], b[0])), "{interpolation:?}: {pairs:?}");
            }
        }
    }
}

#[test]
fn structures_of_tables() {
    let s = lagrangian("x'^2/2 - x^2/2 + x*drive(t)", Interpolation::Cubic).structure();
    assert!(s.separable && s.quadratic && s.constant_mass && s.z_free && !s.autonomous);
    let s = lagrangian("x'^2/2 - drive(x)", Interpolation::Cubic).structure();
    assert!(s.separable && s.autonomous && !s.quadratic);
    let s = lagrangian("x'^2/2 - x^2/2 + drive(t)*z", Interpolation::Linear).structure();
    assert!(s.z_affine && s.separable && s.quadratic && !s.constant_rate);
    assert!(!lagrangian("x'^2/2 - drive(x')", Interpolation::Linear).structure().constant_mass);
    let driven = lagrangian("force[x] = drive(t) - a*x'; x'^2/2 - x^2/2", Interpolation::Held);
    let drag = ForceStructure::Drag { linear: SVector::<f64, 1>::new(2.0), quadratic: 0.0 };
    assert_eq!(driven.force_structure(), drag);
    assert!(!driven.is_smooth());
    assert_eq!(driven.applied_force(0.6, &VelocityPoint::new([0.0], [1.0], 0.0))[0], -4.0);
    assert_eq!(driven.breaks(), &TIMES[1..]);
    // A table at a parameter is a constant.
    let mut l = lagrangian("x'^2/2 - drive(t1)*x", Interpolation::Linear);
    let force = |l: &FormulaLagrangian<1>| l.gradient(0.0, &VelocityPoint::new([0.0], [1.0], 0.0)).x[0];
    assert_eq!((force(&l), l.breaks()), (-(-2.0 + 0.25 * 2.5), [].as_slice()));
    l.set("t1", 1.5).unwrap();
    assert_eq!(force(&l), -0.5);
    assert!(l.structure().quadratic && l.structure().autonomous);
}

fn switches(l: &FormulaLagrangian<1>, t: f64) -> Vec<f64> {
    let mut values = Vec::new();
    l.switching_functions(t, &VelocityPoint::new([3.0], [2.0], 4.0), &mut values);
    values
}

#[test]
fn samples_are_breaks_or_switching_functions() {
    let of = |text: &str, interpolation| {
        let l = lagrangian(text, interpolation);
        (l.breaks().to_vec(), switches(&l, 1.0))
    };
    for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
        assert_eq!(of("x'^2/2 + x*drive(t)", interpolation), (TIMES.to_vec(), vec![]));
    }
    assert_eq!(of("x'^2/2 + x*drive(t)", Interpolation::Held), (TIMES[1..].to_vec(), vec![]));
    let scaled = [0.375, 0.625, 1.125, 1.375, 2.375];
    assert_eq!(of("x'^2/2 + x*drive(a*t - t1)", Interpolation::Linear), (scaled.to_vec(), vec![]));
    assert_eq!(
        of("x'^2/2 + x*drive((2 - 4*t)/4) + x*drive(t/2)", Interpolation::Linear).0,
        [-3.5, -1.5, -1.0, 0.0, 0.5, 1.0, 3.0, 4.0, 8.0]
    );
    // At an argument of the state each sample is a switching function.
    let (breaks, found) = of("x'^2/2 + drive(t - x) + drive(t - x)*z", Interpolation::Linear);
    assert_eq!((breaks, found), (vec![], TIMES.map(|knot| -2.0 - knot).to_vec()));
    let of_square = of("x'^2/2 + x*drive(t^2)", Interpolation::Held);
    assert_eq!(of_square, (vec![], TIMES[1..].iter().map(|knot| 1.0 - knot).collect()));
    let many: Vec<f64> = (0..201).map(f64::from).collect();
    let long = Table::new(&many, &many, Interpolation::Linear).unwrap();
    let with = |text| Formula::parse_with_tables(text, &["x"], &[], &[("long", long.clone())]).unwrap();
    let error = with("x'^2/2 + long(x)").lagrangian::<1>().unwrap_err();
    assert_eq!(error, FormulaError::TableOfState { found: 201, limit: 200 });
    assert_eq!(with("x'^2/2 + x*long(t)").lagrangian::<1>().unwrap().breaks().len(), 201);
}

#[test]
fn exact_times_are_breaks() {
    let of = |text: &str| {
        let l: FormulaLagrangian<1> = Formula::parse(text, &["x"], &PARAMETERS).unwrap().lagrangian().unwrap();
        (l.breaks().to_vec(), switches(&l, 1.0))
    };
    for (text, breaks, functions) in [
        ("x'^2/2 + if(t > 5, x, 0)", vec![5.0], vec![]),
        ("x'^2/2 + if(t < 0.1, x, 0)", vec![0.1], vec![]),
        ("x'^2/2 + if(5 > a*t, x, 0)", vec![2.5], vec![]),
        ("x'^2/2 + if(t1 + a > t, x, 0) + if(t > 0, x, 0)", vec![0.0, 2.75], vec![]),
        ("x'^2/2 + x*abs((3 - t)/a) + x*max(2*t - 3, t - 1)", vec![2.0, 3.0], vec![]),
        ("force[x] = sign(t - 7); x'^2/2", vec![7.0], vec![]),
        ("rayleigh = if(t > 2, x'^2, 0); x'^2/2", vec![2.0], vec![]),
        ("x'^2/2 + if(sin(3*t) > 0.5, x, 0)", vec![], vec![0.5 - 3.0_f64.sin()]),
        ("x'^2/2 + if(t > x, x, 0) + if(t > 1, x, 0) + abs(x)", vec![1.0], vec![2.0, 3.0]),
        ("x'^2/2 + x*abs(t^2 - 1)", vec![], vec![0.0]),
        // Never, and at infinity.
        ("x'^2/2 + if((a - 2)*t > 1, x, 0)", vec![], vec![]),
        ("x'^2/2 + if(1e-300*t > 1e300, x, 0)", vec![], vec![]),
        ("x'^2/2 + if(a > 1, x, 0)", vec![], vec![]),
    ] {
        assert_eq!(of(text), (breaks, functions), "{text}");
    }
}

#[test]
fn breaks_follow_parameters_and_are_given() {
    let formula = Formula::parse("x'^2/2 + if(a*t > t1, x, 0)", &["x"], &PARAMETERS).unwrap();
    let mut l =
        formula.with_breaks(&[3.0, 1.0]).and_then(|f| f.with_breaks(&[1.0, -2.0])).unwrap().lagrangian::<1>().unwrap();
    assert_eq!(l.breaks(), [-2.0, 0.375, 1.0, 3.0]);
    l.set("a", 0.75).unwrap();
    assert_eq!(l.breaks(), [-2.0, 1.0, 3.0]);
    l.set("a", 0.0).unwrap();
    assert_eq!(l.breaks(), [-2.0, 1.0, 3.0]);
    l.set("t1", -0.5).unwrap();
    l.set("a", 0.125).unwrap();
    assert_eq!(l.breaks(), [-4.0, -2.0, 1.0, 3.0]);
    for time in [f64::NAN, f64::INFINITY] {
        let error = formula.with_breaks(&[1.0, time]).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("a break of the motion is at the time {time}; it must be a finite number")
        );
    }
}

/// Runs in the lanes of integrators: the table is a polynomial that the formula can also have.
#[test]
fn runs_with_tables() {
    let times: Vec<f64> = (0..12).map(|k| 1.25 * f64::from(k) - 1.0).collect();
    let values: Vec<f64> = times.iter().map(|t| 0.01 * t * t * t - 0.1 * t).collect();
    let cubic = Table::new(&times, &values, Interpolation::Cubic).unwrap();
    let ends = Table::new(&[-1.0, 12.0], &[-0.5, 6.0], Interpolation::Linear).unwrap();
    let tables = [("cubic", cubic), ("ramp", ends)];
    let of = |text: &str| {
        let formula = Formula::parse_with_tables(text, &["x"], &[], &tables).unwrap();
        let l: FormulaLagrangian<1> = formula.lagrangian().unwrap();
        let problem = Problem::new(&l, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
        let by = ["gauss_8", "kahan_li_8", "midpoint", "gauss_3"].map(|by| {
            let run = problem.by(by.parse::<AnyIntegrator>().unwrap()).steps(Steps::Count(200));
            run.run(Until::Time(10.0)).unwrap()
        });
        by.map(|found| (found.q[0], found.p[0]))
    };
    let pairs = [
        ("x'^2/2 - x^2/2 + x*cubic(t) - 0.1*z", "x'^2/2 - x^2/2 + x*(0.01*t^3 - 0.1*t) - 0.1*z"),
        ("x'^2/2 - (1 + ramp(t))*cos(x)", "x'^2/2 - (1 + t/2)*cos(x)"),
    ];
    for (with, without) in pairs {
        for ((q, p), (x, y)) in of(with).into_iter().zip(of(without)) {
            assert!((q - x).hypot(p - y) < 1e-11, "{with}: {q} {p}, not {x} {y}");
        }
    }
}

#[test]
fn names_of_tables() {
    let table = drive(Interpolation::Linear);
    let parse =
        |text: &str, name: &str| Formula::parse_with_tables(text, &["x"], &PARAMETERS, &[(name, table.clone())]);
    for (text, message) in [
        ("x'^2 + x*driv(t)", "line 1, column 10: unknown function `driv`; did you mean `drive`?"),
        ("x'^2 + x*drive", "column 10: `drive` is a table, a function: write `drive(t)`"),
        ("x'^2 + x*drive(t, x)", "column 10: `drive` takes one argument, not 2"),
        ("drive = 3; x'^2", "the name `drive` is in use"),
        ("sum(drive, 0, 3, x'^2)", "the name `drive` is in use"),
        ("x'^2 + interp(t)", "unknown function `interp`; give the samples as a table and write its name"),
    ] {
        let error = parse(text, "drive").unwrap_err().to_string();
        assert!(error.contains(message), "{text}: {error}");
    }
    for (name, message) in [("x", "is given twice"), ("a", "is given twice"), ("sin", "is reserved"), ("1a", "must be")]
    {
        let error = parse("x'^2", name).unwrap_err().to_string();
        assert!(error.contains(message), "{name}: {error}");
    }
    let twice = [("drive", table.clone()), ("drive", table.clone())];
    assert!(matches!(Formula::parse_with_tables("x'^2", &["x"], &[], &twice), Err(FormulaError::Name { .. })));
    // In other expressions, in forces, and in formulas that are built by a program.
    let formula = parse("x'^2/2", "drive").unwrap();
    assert_eq!(formula.expression("2*drive(t)").unwrap().at(0.25, &[0.0], &[0.0], 0.0), -1.0);
    assert_eq!(formula.tables().collect::<Vec<_>>(), [("drive", &table)]);
    let second = Table::new(&[0.0, 1.0], &[0.0, 8.0], Interpolation::Linear).unwrap();
    let both = formula.with_table("other", &second).unwrap().with_force("x", "drive(t) + other(t)").unwrap();
    let point = VelocityPoint::new([0.0], [0.0], 0.0);
    assert_eq!(both.lagrangian::<1>().unwrap().applied_force(0.25, &point)[0], 1.5);
    assert!(formula.with_table("drive", &second).is_err());
    let energy = parse("x'^2/2 - x*drive(t)", "drive").unwrap().with_table("other", &second).unwrap();
    assert_eq!(energy.expression("energy + other(t)").unwrap().at(0.25, &[2.0], &[1.0], 0.0), 0.5 - 1.0 + 2.0);

    let mut graph = Graph::new();
    let (v, t) = (graph.velocity(0), graph.time());
    let (kinetic, value) = (graph.binary(Operation::Mul, v, v), graph.interpolate(&second, t));
    assert_eq!((graph.interpolate(&second, t), graph.tables().len()), (value, 1));
    let formula = Formula::from_graph(graph, kinetic, &["x"], &[]).unwrap().with_force_nodes(&[Some(value)]).unwrap();
    let formula = formula.with_table("drive", &table).unwrap();
    assert_eq!(formula.lagrangian::<1>().unwrap().applied_force(0.25, &point)[0], 2.0);
    assert_eq!(formula.expression("drive(t)").unwrap().at(0.25, &[0.0], &[0.0], 0.0), -0.5);
    let symbols = Symbols::new(&["x"], &[]).unwrap();
    let l = symbols.velocity(0) * symbols.velocity(0) + symbols.position(0) * symbols.time().interpolate(&second);
    assert_eq!(symbols.formula(&l).unwrap().lagrangian::<1>().unwrap().force(0.25, &point)[0], 2.0);
}
