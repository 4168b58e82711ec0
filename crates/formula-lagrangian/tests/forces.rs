//! Forces of formulas, in the text of L and by a program.

use contact_geom::nalgebra::SVector;
use contact_geom::{
    Dual, Force, ForceStructure, Forced, Lagrangian, Scalar, Structure, Symmetry, VelocityPoint, herglotz_field,
};
use formula_lagrangian::{Formula, FormulaError, FormulaLagrangian, Function, Graph, Operation, ParseError, Symbols};

const PARAMETERS: [(&str, f64); 2] = [("c", 0.5), ("k", 0.25)];

fn plane(text: &str) -> FormulaLagrangian<2> {
    Formula::parse(text, &["x", "y"], &PARAMETERS).unwrap().lagrangian().unwrap()
}

fn line(text: &str) -> FormulaLagrangian<1> {
    Formula::parse(text, &["x"], &PARAMETERS).unwrap().lagrangian().unwrap()
}

fn point() -> VelocityPoint<2> {
    VelocityPoint::new([0.3, -0.7], [0.6, -0.8], 0.4)
}

/// The same force and Lagrangian by hand.
struct Spring;
impl Lagrangian<2> for Spring {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        v.dot(v) * 0.5 - q.dot(q) * 0.5 - z * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, quadratic: true, ..Structure::default() }
    }
}
struct Drag;
impl Force<2> for Drag {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<2, T>) -> SVector<T, 2> {
        let speed = x.v.dot(&x.v).sqrt();
        let turning = SVector::from([x.q[1], -x.q[0]]);
        SVector::from_fn(|i, _| -(x.v[i] * speed * 0.25) - x.v[i] * 0.5 + turning[i] * t.cos() + x.z * x.v[i])
    }
}

const SPRING: &str = "speed = sqrt(x'^2 + y'^2)
    force[x] = -k*x'*speed - c*x' + y*cos(t) + z*x'
    force[1] = -k*y'*speed - c*y' - x*cos(t) + z*y'
    L = speed^2/2 - (x^2 + y^2)/2 - c*z";

#[test]
fn a_force_is_that_of_a_type() {
    let (l, typed) = (plane(SPRING), Forced { lagrangian: Spring, force: Drag });
    assert!(l.has_force() && FormulaLagrangian::<2>::HINTS.forced);
    let (found, expected) = (l.applied_force(0.6, &point()), typed.applied_force(0.6, &point()));
    assert!((found - expected).amax() <= 1e-15, "{found} {expected}");
    let (found, expected) =
        (herglotz_field(&l, 0.6, &point()).unwrap(), herglotz_field(&typed, 0.6, &point()).unwrap());
    assert!((found.y - expected.y).amax() <= 1e-14 && (found.z - expected.z).abs() <= 1e-15);
    // The derivatives with respect to all variables, on dual numbers.
    type Six = Dual<f64, SVector<f64, 6>>;
    let moving = |i: usize, x: f64| Six { re: x, d: SVector::ith(i, 1.0) };
    let x = point();
    let x = VelocityPoint {
        q: SVector::from_fn(|i, _| moving(i, x.q[i])),
        v: SVector::from_fn(|i, _| moving(2 + i, x.v[i])),
        z: moving(4, x.z),
    };
    let (found, expected) = (l.applied_force(moving(5, 0.6), &x), typed.applied_force(moving(5, 0.6), &x));
    for i in 0..2 {
        assert!((found[i].d - expected[i].d).amax() <= 1e-15, "{:?} {:?}", found[i].d, expected[i].d);
    }
    // A free coordinate in addition has no force.
    let wide = l.formula().lagrangian_within::<3>().unwrap();
    let x = VelocityPoint::new([0.3, -0.7, 1.0], [0.6, -0.8, 1.0], 0.4);
    assert_eq!(wide.applied_force(0.6, &x).as_slice()[..2], *l.applied_force(0.6, &point()).as_slice());
    assert_eq!(wide.applied_force(0.6, &x)[2], 0.0);
}

#[test]
fn no_force() {
    for text in ["x'^2/2", "force[x] = 0; x'^2/2", "rayleigh = x^2; x'^2/2"] {
        let l = line(text);
        assert!(!l.has_force(), "{text}");
        assert_eq!(l.force_structure(), ForceStructure::None);
        assert_eq!(l.applied_force(0.0, &VelocityPoint::new([1.0], [1.0], 0.0))[0], 0.0);
        assert!(l.structure().quadratic && l.structure().autonomous);
    }
    assert!(!line("x'^2/2").formula().has_forces());
}

/// The forces on two coordinates at the point.
fn forces(formula: &Formula) -> [f64; 2] {
    let l: FormulaLagrangian<2> = formula.lagrangian().unwrap();
    let f = l.applied_force(0.6, &point());
    [f[0], f[1]]
}

#[test]
fn notations_of_one_force() {
    let free = Formula::parse("(x'^2 + y'^2)/2", &["x", "y"], &PARAMETERS).unwrap();
    let expected = [-0.5 * 0.6, -0.5 * -0.8 - 1.0];
    let of = |formula: Result<Formula, FormulaError>| assert_eq!(forces(&formula.unwrap()), expected);
    let text = |text: &str| Formula::parse(text, &["x", "y"], &PARAMETERS);
    of(text("force[x] = -c*x'; force[y] = -c*y' - 1; L = (x'^2 + y'^2)/2"));
    of(text("force[q[0]] = -c*x'; force[n - 1] = -c*y' - 1; (x'^2 + y'^2)/2"));
    of(text("force[q[i]] = -c*v[i] - i\n(x'^2 + y'^2)/2"));
    of(text("rayleigh = c/2*(x'^2 + y'^2) + y'\n(x'^2 + y'^2)/2"));
    of(text("g = 1\nrayleigh = c/2*sum(i, 0, n-1, v[i]^2)\nforce[y] = -g\n(x'^2 + y'^2)/2"));
    of(free.with_force("x", "-c*x'").and_then(|f| f.with_force("y", "u = -c*y'; u - 1")));
    of(free.with_forces(&[("0", "-c*x'"), ("q[1]", "F = -c*y' - 1")]));
    of(free.with_force("q[i]", "-c*v[i] - i"));
    of(free.with_rayleigh("c/2*x'^2").and_then(|f| f.with_rayleigh("c/2*y'^2")).and_then(|f| f.with_force("y", "-1")));
    // Arrays.
    for text in [
        "force[u[i]] = -c*u'[i] - i; (u'[0]^2 + u'[1]^2)/2",
        "force[u[0]] = -c*u[0]'; force[u[1]] = -c*v[1] - 1; v[0]^2 + v[1]^2",
    ] {
        of(Formula::parse(text, &["u[2]"], &PARAMETERS));
    }
    // Graphs.
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|i| graph.velocity(i));
    let [xx, yy] = [x, y].map(|v| graph.binary(Operation::Mul, v, v));
    let l = graph.binary(Operation::Add, xx, yy);
    let c = graph.parameter(0);
    let [fx, fy] = [x, y].map(|v| graph.binary(Operation::Mul, v, c)).map(|drag| graph.unary(Function::Neg, drag));
    let one = graph.number(1.0);
    let fy = graph.binary(Operation::Sub, fy, one);
    let foreign = graph.clone().unary(Function::Sin, fy);
    let formula = Formula::from_graph(graph, l, &["x", "y"], &PARAMETERS).unwrap();
    of(formula.clone().with_force_nodes(&[Some(fx), Some(fy)]));
    of(formula.clone().with_force_nodes(&[Some(fx)]).and_then(|f| f.with_force_nodes(&[None, Some(fy)])));
    of(formula.clone().with_force_nodes(&[None, Some(fy)]).and_then(|f| f.with_force("x", "-c*x'")));
    let twice = formula.clone().with_force_nodes(&[Some(fx)]).and_then(|f| f.with_force_nodes(&[Some(fx)]));
    assert_eq!(twice.unwrap_err(), FormulaError::ForceTwice { coordinate: "x".to_owned() });
    assert_eq!(formula.clone().with_force_nodes(&[Some(foreign)]).unwrap_err(), FormulaError::ForeignNode);
    assert_eq!(formula.clone().with_rayleigh_node(foreign).unwrap_err(), FormulaError::ForeignNode);
    assert!(matches!(formula.with_force_nodes(&[None; 3]).unwrap_err(), FormulaError::Unknown { what: "force", .. }));
    // Symbols of a program.
    let symbols = Symbols::new(&["x", "y"], &PARAMETERS).unwrap();
    let (c, x, y) = (symbols.parameter("c").unwrap(), symbols.velocity(0), symbols.velocity(1));
    let l = 0.5 * (&x * &x + &y * &y);
    let (fx, fy) = (-(&c * &x), -(&c * &y) - 1.0);
    of(symbols.formula_with_forces(&l, &[Some(&fx), Some(&fy)]));
    let other = Symbols::new(&["x"], &[]).unwrap().velocity(0);
    assert_eq!(symbols.formula_with_forces(&l, &[Some(&other)]).unwrap_err(), FormulaError::Mixed);
}

fn claims_of<const N: usize>(l: &FormulaLagrangian<N>) -> (ForceStructure<N>, [bool; 4]) {
    let s = l.structure();
    (l.force_structure(), [s.separable, s.autonomous, s.quadratic, s.constant_mass])
}

#[test]
fn proved_structures_of_one_coordinate() {
    let drag = |linear: f64, quadratic: f64| ForceStructure::Drag { linear: SVector::<f64, 1>::new(linear), quadratic };
    for (force, expected) in [
        ("cos(t) - x^3", drag(0.0, 0.0)),
        ("sign(x)*exp(t)", drag(0.0, 0.0)),
        ("-c*x'", drag(0.5, 0.0)),
        ("-(c + k)*(x' - cos(t))", drag(0.75, 0.0)),
        ("c*x'", drag(-0.5, 0.0)),
        ("-k*x'*abs(x')", drag(0.0, 0.25)),
        ("-k*sign(x')*x'^2", drag(0.0, 0.25)),
        ("-abs(x')*x'*k/2", drag(0.0, 0.125)),
        ("-k*x'*sqrt(x'^2)", drag(0.0, 0.25)),
        ("-c*(x' + abs(x')*x'/2) + x", drag(0.5, 0.25)),
        ("-c*sign(x')", ForceStructure::General),
        ("-c*abs(x')", ForceStructure::General),
        ("-c*x'^2", ForceStructure::General),
        ("-c*x'*x", ForceStructure::General),
        ("-c*x'*t", ForceStructure::General),
        ("-c*x' + z", ForceStructure::General),
        ("-c*x' + sign(z)", ForceStructure::General),
        ("if(x' < 1, x, 2*x)", ForceStructure::General),
        ("-k*x'*abs(x')*x", ForceStructure::General),
        ("-k*x'*abs(x)", ForceStructure::General),
    ] {
        let found = claims_of(&line(&format!("force[x] = {force}; x'^2/2 - x^2/2")));
        assert_eq!(found, (expected, [true, false, false, true]), "{force}");
    }
    for (rayleigh, expected) in [
        ("c/2*x'^2", drag(0.5, 0.0)),
        ("k/3*abs(x')^3", drag(0.0, 0.25)),
        ("c*abs(x')", ForceStructure::General),
        ("c/2*x'^2*x^2", ForceStructure::General),
    ] {
        let found = claims_of(&line(&format!("rayleigh = {rayleigh}; x'^2/2 - x^2/2"))).0;
        assert_eq!(found, expected, "{rayleigh}");
    }
    // The structure of L itself: the rate.
    let s = line("force[x] = -x'; x'^2/2 + c*z").structure();
    assert!(s.constant_rate && s.z_affine && !s.z_free);
    assert!(line("force[x] = -x'; x'^2/2").structure().z_free);
    assert_eq!(line("force[x] = -x'; x'^2/2 + c*z").constant_rate(), Some(0.5));
}

#[test]
fn proved_structures_of_two_coordinates() {
    let drag = |x: f64, y: f64, quadratic: f64| ForceStructure::Drag { linear: SVector::from([x, y]), quadratic };
    for (x, y, expected) in [
        ("-c*x'", "0", drag(0.5, 0.0, 0.0)),
        ("-c*x'", "-k*y' + x", drag(0.5, 0.25, 0.0)),
        ("-c*y'", "c*x'", ForceStructure::General),
        ("-k*x'*sqrt(x'^2 + y'^2)", "-k*y'*sqrt(x'^2 + y'^2) - c*y'", drag(0.0, 0.5, 0.25)),
        ("-k*x'*hypot(x', y')", "-k*hypot(x', y')*y'", drag(0.0, 0.0, 0.25)),
        ("-k*x'*hypot(x', y')", "-c*hypot(x', y')*y'", ForceStructure::General),
        ("-k*x'*hypot(x', y')", "-1", ForceStructure::General),
        ("-k*x'*abs(x')", "-k*y'*abs(y')", ForceStructure::General),
        ("-k*y'*hypot(x', y')", "-k*x'*hypot(x', y')", ForceStructure::General),
        ("-k*x'*sqrt(x'^2 + 2*y'^2)", "-k*y'*sqrt(x'^2 + 2*y'^2)", ForceStructure::General),
    ] {
        let found = plane(&format!("force[x] = {x}; force[y] = {y}; (x'^2 + y'^2)/2")).force_structure();
        assert_eq!(found, expected, "{x}, {y}");
    }
    for rayleigh in ["k/3*(x'^2 + y'^2)^1.5", "k/3*hypot(x', y')^3", "k/3*sqrt(x'^2 + y'^2)^3"] {
        let l = plane(&format!("rayleigh = {rayleigh}; (x'^2 + y'^2)/2"));
        let ForceStructure::Drag { linear, quadratic } = l.force_structure() else { panic!("{rayleigh}") };
        assert!((quadratic - 0.25).abs() < 1e-16 && linear.amax() == 0.0, "{rayleigh}: {quadratic}");
        // It is the force.
        let (f, v) = (l.applied_force(0.0, &point()), point().v);
        assert!((f + v * 0.25 * v.norm()).amax() < 1e-15, "{rayleigh}: {f}");
        // With a free coordinate in addition it is not the drag of the whole velocity.
        assert_eq!(l.formula().lagrangian_within::<3>().unwrap().force_structure(), ForceStructure::General);
    }
    let linear = plane("force[x] = -c*x'; (x'^2 + y'^2)/2").formula().lagrangian_within::<3>().unwrap();
    let expected = ForceStructure::Drag { linear: SVector::from([0.5, 0.0, 0.0]), quadratic: 0.0 };
    assert_eq!(linear.force_structure(), expected);
}

#[test]
fn parameters_of_forces_are_set() {
    let mut l = line("force[x] = -c*x' - k*x'*abs(x'); x'^2/2");
    let x = VelocityPoint::new([0.0], [2.0], 0.0);
    assert_eq!(l.applied_force(0.0, &x)[0], -2.0);
    assert_eq!(l.formula().used_parameters().collect::<Vec<_>>(), ["c", "k"]);
    assert_eq!(line("rayleigh = k*x'^2; x'^2/2").formula().used_parameters().collect::<Vec<_>>(), ["k"]);
    l.set("c", 1.0).unwrap();
    assert_eq!(l.applied_force(0.0, &x)[0], -3.0);
    assert_eq!(l.force_structure(), ForceStructure::Drag { linear: SVector::<f64, 1>::new(1.0), quadratic: 0.25 });
    assert!(l.structure().separable);
    l.set("c", 0.0).unwrap();
    l.set("k", 0.0).unwrap();
    assert!(l.structure().separable && l.force_structure().is_of_positions() && l.has_force());
}

#[test]
fn kinks_of_forces_are_switching_functions() {
    let of = |text: &str| {
        let mut values = Vec::new();
        line(text).switching_functions(0.5, &VelocityPoint::new([3.0], [2.0], 4.0), &mut values);
        values
    };
    assert_eq!(of("force[x] = -x'*abs(x'); x'^2/2"), [2.0]);
    assert_eq!(of("force[x] = -c*sign(x'); x'^2/2 - abs(x)"), [2.0, 3.0]);
    assert_eq!(of("rayleigh = c*abs(x'); x'^2/2"), [2.0]);
    assert_eq!(of("force[x] = max(x, z); x'^2/2 - abs(x - z)"), [-1.0]);
    assert_eq!(of("force[x] = -c*x'; x'^2/2"), [0.0; 0]);
    assert!(!line("force[x] = -abs(x'); x'^2/2").is_smooth() && line("force[x] = -x'; x'^2/2").is_smooth());
}

#[test]
fn symmetries_are_those_along_which_forces_do_no_work() {
    let along = |l: &FormulaLagrangian<2>, d: [f64; 2]| {
        l.symmetries().iter().any(|s| matches!(s, Symmetry::Translation(found) if *found == SVector::from(d)))
    };
    let turns = |l: &FormulaLagrangian<2>| l.symmetries().iter().any(|s| matches!(s, Symmetry::Rotation(0, 1)));
    let free = plane("(x'^2 + y'^2)/2");
    assert!(along(&free, [1.0, 0.0]) && along(&free, [0.0, 1.0]) && turns(&free));
    let falling = plane("force[y] = -1; (x'^2 + y'^2)/2");
    assert!(along(&falling, [1.0, 0.0]) && !along(&falling, [0.0, 1.0]) && !turns(&falling));
    let mutual = plane("F = c*(x - y)^3; force[x] = -F; force[y] = F; (x'^2 + y'^2)/2 - (x - y)^2");
    assert!(along(&mutual, [1.0, 1.0]));
    assert!(!along(&plane("force[x] = c*(x - y); (x'^2 + y'^2)/2 - (x - y)^2"), [1.0, 1.0]));
}

fn parse(text: &str) -> ParseError {
    match Formula::parse(text, &["x", "y", "u[3]"], &PARAMETERS).unwrap_err() {
        FormulaError::Parse(error) => error,
        other => panic!("{text}: {other}"),
    }
}

#[test]
fn errors_in_a_text() {
    for (text, at, message) in [
        ("force[angle] = 1; x'^2", 7, "there is no coordinate `angle`; the coordinates are x, y, u[0], u[1], u[2]"),
        ("force[X] = 1; x'^2", 7, "there is no coordinate `X`; did you mean `x`?"),
        ("force[5] = 1; x'^2", 7, "there is no coordinate 5; their indices are 0 to 4"),
        ("force[u[3]] = 1; x'^2", 9, "`u` has no entry 3; its entries are 0 to 2"),
        ("force[u] = 1; x'^2", 8, "`u` has 3 entries; write one of them as `u[0]`"),
        ("force[x[0]] = 1; x'^2", 8, "`x` is a single number and has no entries"),
        ("force[x'] = 1; x'^2", 7, "a force belongs to a coordinate; write `force[x]`, without a prime"),
        ("force[z] = 1; x'^2", 7, "a force belongs to a coordinate; write `force[x]`, without a prime"),
        ("force[c] = 1; x'^2", 7, "expected an integer that does not depend on parameters or on the state"),
        ("force[x] = 1; force[q[0]] = 2; x'^2", 21, "the force on `x` is given twice; write one sum"),
        ("force[u[i]] = 1; force[u[2]] = 2; x'^2", 24, "the force on `u[2]` is given twice; write one sum"),
        ("force[x] = -d*x'; x'^2", 13, "unknown name `d`"),
        ("force[x] = -c*xdot; x'^2", 15, "unknown name `xdot`; did you mean `x'`?"),
        ("force[u[i]] = u[i + 1]; x'^2", 17, "`u` has no entry 3; its entries are 0 to 2"),
        ("force[x] = 1", 13, "expected the Lagrangian after the forces; it is the last line"),
        ("rayleigh = x'^2", 16, "expected a value after the definition of `rayleigh`"),
        ("rayleigh = x'^2; rayleigh = 1; x'^2", 18, "the name `rayleigh` is in use; choose another name for this"),
        ("forces[x] = 1; x'^2", 1, "unknown name `forces`; did you mean `force`?"),
        ("force[] = 1; x'^2", 7, "expected a value, found `]`"),
        ("force[x] 1; x'^2", 10, "expected `=`, found the number 1"),
    ] {
        let error = parse(text);
        let shown = error.to_string();
        assert_eq!((error.line, error.column), (1, at), "{shown}");
        assert!(shown.contains(message), "{text}: {shown}");
    }
    assert_eq!(parse("force[X] = 1; x'^2").nearest.as_deref(), Some("x"));
    // The names remain available.
    assert!(!Formula::parse("force[0]*force'[1]", &["force[2]"], &[]).unwrap().has_forces());
    assert!(Formula::parse("rayleigh*x'^2", &["x"], &[("rayleigh", 1.0)]).is_ok());
    assert!(Formula::parse("rayleigh = x'^2; rayleigh/2", &["x"], &[]).unwrap().has_forces());
}

#[test]
fn errors_by_a_program() {
    let free = Formula::parse("x'^2/2", &["x", "u[2]"], &PARAMETERS).unwrap();
    for (coordinate, message) in [
        ("w", "there is no coordinate `w`"),
        ("ux", "there is no coordinate `ux`; did you mean `x`?"),
        ("3", "there is no coordinate 3; their indices are 0 to 2"),
        ("-1", "there is no coordinate -1"),
        ("x'", "a force belongs to a coordinate, not to a velocity or z"),
        ("z", "a force belongs to a coordinate, not to a velocity or z"),
        ("", "expected the name of a coordinate, found the end"),
        ("x y", "expected the end, found `y`"),
        ("u[2]", "`u` has no entry 2"),
    ] {
        match free.with_force(coordinate, "1").unwrap_err() {
            FormulaError::Target(error) => assert!(error.to_string().contains(message), "{coordinate}: {error}"),
            other => panic!("{coordinate}: {other}"),
        }
    }
    let twice = free.with_forces(&[("x", "1"), ("0", "2")]).unwrap_err();
    assert!(matches!(&twice, FormulaError::Target(e) if e.message.contains("on `x` is given twice")), "{twice}");
    let error = free.with_force("x", "-c*\nxx").unwrap_err();
    assert!(matches!(&error, FormulaError::Parse(e) if (e.line, e.column) == (2, 1)), "{error}");
    assert!(matches!(free.with_rayleigh("c*w"), Err(FormulaError::Parse(_))));
    assert!(matches!(free.with_force("x", "force[x] = 1; 2"), Err(FormulaError::Parse(_))));
    assert!(matches!(free.expression("force[x] = 1; 2"), Err(FormulaError::Parse(_))));
}
