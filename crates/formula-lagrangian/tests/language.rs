//! The values of valid texts, and the errors of invalid ones.

use formula_lagrangian::{Formula, FormulaError, ParseError};

/// The value of a text over x, y with parameter a = 3, at x = 2, y = -1, x' = 0.5, y' = 4, z = 7, t = 0.25.
fn value(text: &str) -> f64 {
    let formula = Formula::parse("x'^2 + y'^2", &["x", "y"], &[("a", 3.0)]).unwrap();
    let expression = formula.expression(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    expression.at(0.25, &[2.0, -1.0], &[0.5, 4.0], 7.0)
}

fn error(text: &str) -> ParseError {
    match Formula::parse(text, &["x", "y"], &[("a", 3.0), ("gamma", -0.1)]) {
        Err(FormulaError::Parse(error)) => error,
        other => panic!("{text}: {other:?}"),
    }
}

#[test]
fn values_are_those_of_the_same_operations() {
    let (x, y, a): (f64, f64, f64) = (2.0, -1.0, 3.0);
    let table: &[(&str, f64)] = &[
        ("-x^2", -4.0),
        ("2^3^2", 512.0),
        ("2**3", 8.0),
        ("2^-1", 0.5),
        ("-2^-x^2", -0.0625),
        ("1 - 2 - 3", -4.0),
        ("12/3/2", 2.0),
        ("2*x' + y'", 5.0),
        ("z - t", 6.75),
        ("- - x", 2.0),
        ("+x", 2.0),
        ("a*x + y", 5.0),
        ("0.1 + 0.2", 0.1 + 0.2),
        ("1e-3*x", 2e-3),
        (".5*x", 1.0),
        ("5.*x", 10.0),
        // Numbers are read exactly.
        ("0.1000000000000000055511151231257827021181583404541015625", 0.1),
        ("2.2250738585072011e-308", 2.225_073_858_507_201e-308),
        ("x*3.141592653589793238462643383279502884", x * std::f64::consts::PI),
        ("sqrt(x)", x.sqrt()),
        ("abs(y) + sign(y) + sign(x - 2)", 0.0),
        ("sin(x) + cos(y)", x.sin() + y.cos()),
        ("tan(x)", x.tan()),
        ("atan(x)", x.atan()),
        ("sinh(x)", x.sinh()),
        ("asinh(x) + asinh(-1e300*x)", x.asinh() - (1e300 * x).asinh()),
        ("acosh(1 + x^2)", (1.0 + x * x).acosh()),
        ("atanh(x/10) - atanh(-x/20)", (x / 10.0).atanh() + (x / 20.0).atanh()),
        ("cosh(y)", y.cosh()),
        ("tanh(y)", y.tanh()),
        ("exp(x)", x.exp()),
        ("expm1(y)", y.exp_m1()),
        ("ln(x)", x.ln()),
        ("log(x)", x.ln()),
        ("log1p(x)", x.ln_1p()),
        ("versine(x)", 2.0 * (0.5 * x).sin().powi(2)),
        ("min(x, y, a)", -1.0),
        ("max(x, y, a)", 3.0),
        ("x^a", 8.0),
        ("y^a", -1.0),
        ("x^0.3", x.powf(0.3)),
        ("pow(x, 3)", 8.0),
        ("a^x", (x * a.ln()).exp()),
        ("if(x < y, 1, 2)", 2.0),
        ("if(x > y, 1, 2)", 1.0),
        ("sum(i, 0, 3, i^2)", 14.0),
        ("sum(i, 0, n-1, q[i])", 1.0),
        ("sum(i, 1, n-1, (q[i] - q[i-1])^2)", 9.0),
        ("sum(i, 1, 0, q[i+5])*x", 0.0),
        ("sum(i, 0, 1, sum(j, 0, i, v[j]))", 5.0),
        ("r2 = x^2 + y^2; r2/x", 2.5),
        ("u = x + 1\nw = u*u # the square\n\nw -\n  1", 8.0),
        ("L = x", 2.0),
        ("(x\n+\ny)", 1.0),
        ("pi*x", std::f64::consts::TAU),
    ];
    for (text, expected) in table {
        assert_eq!(value(text), *expected, "{text}");
    }
    // Functions that are composed of others have some more roundings.
    let composed = [
        ("atan2(y, x)", y.atan2(x)),
        ("atan2(x, y)", x.atan2(y)),
        ("atan2(-x, y)", (-x).atan2(y)),
        ("atan2(y, -x)", y.atan2(-x)),
        ("hypot(x, y)", x.hypot(y)),
        ("hypot(1e200*x, 1e200)", 1e200 * 5f64.sqrt()),
        ("asin(x/4)", 0.5f64.asin()),
        ("acos(y/3)", (-1.0 / 3.0f64).acos()),
        ("acos(x/4)", 0.5f64.acos()),
        ("x^2.5", x.powf(2.5)),
        ("x^-1.5", x.powf(-1.5)),
    ];
    for (text, expected) in composed {
        let found = value(text);
        assert!((found - expected).abs() <= 4.0 * f64::EPSILON * expected.abs(), "{text}: {found:e}, not {expected:e}");
    }
    assert_eq!(value("hypot(x - 2, y + 1)"), 0.0);
}

#[test]
fn arrays_of_coordinates() {
    let chain = "sum(i, 0, n-1, u'[i]^2)/2 - sum(i, 1, n-1, (u[i] - u[i-1])^2)/2 + z";
    let formula = Formula::parse(chain, &["u[3]"], &[]).unwrap();
    assert_eq!(formula.coordinates(), ["u[0]", "u[1]", "u[2]"]);
    let l = formula.expression(chain).unwrap();
    assert_eq!(l.at(0.0, &[1.0, 2.0, 4.0], &[1.0, 2.0, 3.0], 0.5), 7.0 - 2.5 + 0.5);
    let primes = formula.expression("u[1]' + u'[2] + v[0]").unwrap();
    assert_eq!(primes.at(0.0, &[0.0; 3], &[1.0, 2.0, 4.0], 0.0), 7.0);
}

#[test]
fn errors_show_the_place_and_the_remedy() {
    let table = [
        ("x'^2 + gama*z", 1, 8, "unknown name `gama`"),
        ("x'^2 +\n  sine(x)", 2, 3, "unknown function `sine`"),
        ("2 x", 1, 3, "a product is written with `*`"),
        ("2(x)", 1, 2, "a product is written with `*`"),
        ("x(y)", 1, 2, "expected an operator, found `(`"),
        ("0,5*x", 1, 2, "numbers have a point, not a comma"),
        ("x +", 1, 4, "expected a value, found the end"),
        ("(x + y", 1, 7, "expected `)`, found the end"),
        ("x)", 1, 2, "expected an operator, found `)`"),
        ("", 1, 1, "expected a value, found the end"),
        ("x''", 1, 1, "a second derivative"),
        ("x[0]", 1, 2, "`x` is a single number"),
        ("q[2]", 1, 3, "`q` has no entry 2; its entries are 0 to 1"),
        ("q[-1]", 1, 3, "`q` has no entry -1"),
        ("q[0.5]", 1, 3, "expected an integer, found 0.5"),
        ("q[a]", 1, 3, "does not depend on parameters"),
        ("v", 1, 1, "unknown name `v`"),
        ("sin", 1, 1, "`sin` is a function"),
        ("sin(x, y)", 1, 1, "`sin` takes one argument, not 2"),
        ("atan2(x)", 1, 1, "`atan2` takes two arguments, not 1"),
        ("1/0 + x", 1, 2, "the value is inf"),
        ("ln(0)", 1, 1, "the value is -inf"),
        ("1e999", 1, 1, "too large"),
        ("1.2.3", 1, 4, "expected an operator, found the number 0.3"),
        ("x $ y", 1, 3, "'$' has no meaning"),
        ("r = x", 1, 6, "expected a value after the definition of `r`"),
        ("x = 3; y", 1, 1, "the name `x` is in use"),
        ("r = 1; r = 2; r", 1, 8, "the name `r` is in use"),
        ("x\ny", 2, 1, "a formula has a single value"),
        ("sum(x, 0, 1, x)", 1, 5, "the name `x` is in use"),
        ("sum(2, 0, 1, x)", 1, 5, "the name of an index"),
        ("sum(i, 0, 1e8, i)", 1, 16, "more than 20000 operations"),
        ("if(x, y, 1)", 1, 5, "expected `<` or `>`"),
    ];
    for (text, line, column, message) in table {
        let found = error(text);
        assert!(found.to_string().contains(message), "{text}: {found}");
        assert_eq!((found.line, found.column), (line, column), "{text}: {found}");
    }
    assert_eq!(error("x'^2 + gama*z").nearest.as_deref(), Some("gamma"));
    assert_eq!(error("sine(x)").nearest.as_deref(), Some("sin"));
    assert_eq!(error("X'^2").nearest.as_deref(), Some("x"));
    assert_eq!(error("unheard_of").nearest, None);
    let shown = "line 1, column 8: unknown name `gama`; did you mean `gamma`?\n  x'^2 + gama*z\n         ^^^^";
    assert_eq!(error("x'^2 + gama*z").to_string(), shown);
    assert_eq!(
        error("x'^2 + gama*z").moved_to(7, 13).to_string(),
        shown.replace("line 1, column 8", "line 7, column 20")
    );
}

/// Corrections for the notation of other languages.
#[test]
fn errors_say_what_to_write_instead() {
    let table = [
        ("v^2/2", "the velocities are `x'` and so on, or `v[0]` to `v[n-1]`"),
        ("x'^2 - q^2", "the coordinates are `x` and so on, or `q[0]` to `q[n-1]`"),
        ("xdot^2/2", "did you mean `x'`?"),
        ("y_dot^2/2", "did you mean `y'`?"),
        ("vx^2/2", "did you mean `x'`?"),
        ("v_y^2/2", "did you mean `y'`?"),
        ("dx^2/2", "did you mean `x'`?"),
        ("x'^2/2 + z'", "the rate of `z` is the Lagrangian itself"),
        ("x'^2/2 + t'", "the rate of `t` is 1"),
        ("x'^2/2 + a'", "`a` is a parameter, which is constant"),
        ("r = x^2; x'^2/2 + r'", "`r` is a definition"),
        ("x'^2/2 + x*x''", "write L in terms of `x` and `x'`"),
        ("x'^2/2 + diff(x, t)", "write `x'` for the velocity of `x`"),
        ("x(t)^2", "a coordinate as its name"),
        ("v@v/2", "written `sum(i, 0, n-1, q[i]*v[i])`"),
        ("np.sin(x)", "write `sin(x)` for `np.sin(x)`"),
        ("x + math.pi", "`pi` for `math.pi`"),
        ("e^x", "write `exp(x)`"),
        ("heaviside(t - 1)*x", "write `if(t > 1, 1, 0)`"),
        ("where(x > 0, x, y)", "write `if(a < b, then, otherwise)`"),
        ("x if x > 0 else y", "write `if(a < b, then, otherwise)`"),
        ("if(x <= 0, x, y)", "with `<` or `>`"),
        ("if(x == 0, x, y)", "with `<` or `>`"),
        ("if(x > 0 and y > 0, x, y)", "write `if(a < b, then, otherwise)`"),
        ("x > 0", "a condition is `if(a < b, then, otherwise)`"),
        ("x*if", "write `if(a < b, then, otherwise)`"),
        ("interp(x, 1, 2)", "write its pieces with `if(a < b, then, otherwise)`"),
        ("polyval(x, 1)", "`c0 + x*(c1 + x*c2)`"),
        ("log10(x)", "write `ln(x)/ln(10)`"),
        ("norm(x)", "`hypot(x, y)`"),
        ("sum(x^2)", "a sum has the form `sum(i, 0, n-1, q[i]^2)`"),
        ("x\u{b2}", "write `^2`"),
        ("arcsin(x)", "did you mean `asin`?"),
    ];
    for (text, instead) in table {
        let found = error(text).to_string();
        assert!(found.contains(instead), "{text}: {found}");
    }
    // Arrays are suggested by their own names, and no name is suggested as its own correction.
    let of_array = |text: &str| match Formula::parse(text, &["q[2]"], &[]) {
        Err(FormulaError::Parse(error)) => error.to_string(),
        other => panic!("{text}: {other:?}"),
    };
    assert!(of_array("v^2/2").contains("the velocities are `q'[0]` and so on"), "{}", of_array("v^2/2"));
    assert!(of_array("qdot[0]^2").contains("did you mean `q'[0]`?"), "{}", of_array("qdot[0]^2"));
    for name in ["v", "q", "n", "pi", "t", "x", "a"] {
        let found = error(&format!("x'^2 + {name}(1)")).to_string();
        assert!(!found.contains(&format!("did you mean `{name}`?")), "{found}");
    }
}

#[test]
fn names_and_values_that_are_none() {
    let parse = |coordinates: &[&str], parameters: &[(&str, f64)]| {
        Formula::parse("1", coordinates, parameters).map(|f| f.dimension())
    };
    assert_eq!(parse(&["x"; 1], &[]), Ok(1));
    assert_eq!(parse(&["q[8]"], &[]), Ok(8));
    for bad in ["", "2x", "x'", "a b", "sin", "t", "z", "q[0]", "q[x]", "q[", "x]"] {
        assert!(matches!(parse(&[bad], &[]), Err(FormulaError::Name { .. })), "{bad}");
    }
    assert!(matches!(parse(&["x", "x"], &[]), Err(FormulaError::Name { .. })));
    assert!(matches!(parse(&["x"], &[("x", 1.0)]), Err(FormulaError::Name { .. })));
    assert!(matches!(parse(&["x"], &[("a", f64::NAN)]), Err(FormulaError::ParameterValue { .. })));
    assert_eq!(parse(&[], &[]), Err(FormulaError::Dimension { found: 0 }));
    assert_eq!(parse(&["q[257]"], &[]), Err(FormulaError::Dimension { found: 257 }));
    assert!(matches!(parse(&["q[99999999999999999999]"], &[]), Err(FormulaError::Name { .. })));
    let formula = Formula::parse("x'^2", &["x"], &[("a", 1.0)]).unwrap();
    assert_eq!(formula.lagrangian::<2>().unwrap_err(), FormulaError::OtherDimension { found: 1, asked: 2 });
    let mut lagrangian = formula.lagrangian::<1>().unwrap();
    assert!(matches!(lagrangian.set("b", 1.0), Err(FormulaError::UnknownParameter { .. })));
    assert!(matches!(lagrangian.set("a", f64::INFINITY), Err(FormulaError::ParameterValue { .. })));
}

/// Long, deeply nested and wide texts are errors, without delay and on a stack of ordinary size.
#[test]
fn texts_without_measure() {
    let deep = [
        format!("{}x{}", "(".repeat(5000), ")".repeat(5000)),
        format!("{}x", "-".repeat(5000)),
        format!("{}x", "x^".repeat(5000)),
        format!("{}x{}", "sin(".repeat(5000), ")".repeat(5000)),
    ];
    for text in deep {
        assert!(error(&text).message.contains("nested more than"), "{}", error(&text));
    }
    assert!(error(&"x+".repeat(40_000)).message.contains("bytes"));
    // A long sum has one level of nesting.
    let long = format!("x'^2 + y'^2 {}", "+ x*y'".repeat(5000));
    Formula::parse(&long, &["x", "y"], &[]).unwrap().lagrangian::<2>().unwrap();
    let nested = "sum(i, 1, 1000, sum(j, 1, 1000, sum(k, 1, 1000, x*i*j*k)))";
    assert!(error(nested).message.contains("more than 20000 operations"));
    // Very many words, and only a few nodes.
    assert!(error("sum(i, 1, 100000000, sum(j, 1, 100000000, 0))").message.contains("more than 20000 operations"));
    // Exponentially many paths in a small graph.
    let doubled: String = (0..300).map(|i| format!("a{} = sin(a{i}) * (a{i} + 1)\n", i + 1)).collect();
    Formula::parse(&format!("a0 = x\n{doubled}x'^2 + y'^2 + a300"), &["x", "y"], &[])
        .unwrap()
        .lagrangian::<2>()
        .unwrap();
}

/// An output column may have a name that is not in use; the function of an event must not be an equation.
#[test]
fn values_with_names() {
    let formula = Formula::parse("x'^2/2 - k*x^2/2", &["x"], &[("k", 2.0)]).unwrap();
    let energy = formula.named_expression("kinetic = x'^2/2; E = kinetic + k*x^2/2").unwrap();
    assert_eq!(energy.at(0.0, &[1.0], &[2.0], 0.0), 3.0);
    for taken in ["x = 1", "k = x", "t = x", "sin = x", "a = x; a = 2*a"] {
        let error = formula.named_expression(taken).unwrap_err().to_string();
        assert!(error.contains("is in use"), "{taken}: {error}");
    }
    assert!(formula.expression("x = 1").is_err() && formula.expression("y = x").is_err());
}

/// Expressions that belong to a Lagrangian have names for its energy, momenta and conformal factor. Coordinates,
/// parameters and definitions may take these names.
#[test]
fn quantities_of_the_motion() {
    let text = "m*x'^2/2 + a*x'*w'[1] + cosh(w'[0]) + w'[1]^4/4 - x^2*z + gamma*z + t";
    let l = Formula::parse(text, &["x", "w[2]"], &[("m", 2.0), ("a", 0.5), ("gamma", -0.25)]).unwrap();
    let (t, q, v, z) = (0.5, [0.3, 0.2, -0.1], [1.5, -0.5, 2.0], 0.75);
    let at = |text: &str, log_factor: f64| l.expression(text).unwrap().at_factor(t, (&q, &v, z), log_factor);
    let momenta = [2.0 * v[0] + 0.5 * v[2], f64::sinh(v[1]), 0.5 * v[0] + v[2].powi(3)];
    let value = v[0] * v[0] + 0.5 * v[0] * v[2] + v[1].cosh() + v[2].powi(4) / 4.0 - q[0] * q[0] * z - 0.25 * z + t;
    let energy = v.iter().zip(momenta).map(|(v, p)| v * p).sum::<f64>() - value;
    // Round-off of a dozen operations on numbers up to 10.
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-14 * 10.0, "{a} and {b}");
    near(at("energy", 0.0), energy);
    for (name, p) in ["p_x", "p_w[0]", "p_w[1]"].iter().zip(momenta) {
        near(at(name, 0.0), p);
    }
    near(at("sum(i, 0, 1, p_w[i]^2) + energy/sigma - log_factor", -0.5), {
        momenta[1].powi(2) + momenta[2].powi(2) + energy * f64::exp(0.5) + 0.5
    });
    assert!(
        l.expression("sigma").unwrap().has_conformal_factor()
            && !l.expression("energy").unwrap().has_conformal_factor()
    );
    assert!(l.expression("p_x").unwrap().has_velocity() && l.expression("energy").unwrap().has_action());
    // The same holds for other values of the parameters.
    let mut light = l.expression("p_x - energy").unwrap();
    let before = light.at(t, &q, &v, z);
    light.set("m", 4.0).unwrap();
    near(light.at(t, &q, &v, z) - before, 2.0 * v[0] - v[0] * v[0]);

    // A name that is in use keeps its meaning. In the Lagrangian itself these names are not available.
    let taken = Formula::parse("x'^2/2 + sigma*p_x", &["x"], &[("sigma", 3.0), ("p_x", 5.0)]).unwrap();
    assert_eq!(taken.expression("sigma + p_x").unwrap().at(0.0, &[0.0], &[0.0], 0.0), 8.0);
    assert_eq!(taken.expression("energy = 7; energy + 1").unwrap().at(0.0, &[0.0], &[0.0], 0.0), 8.0);
    for text in ["x'^2/2 + energy", "x'^2/2 + p_x", "x'^2/2 + sigma*z", "log_factor"] {
        assert!(Formula::parse(text, &["x"], &[]).unwrap_err().to_string().contains("unknown name"), "{text}");
    }
    let wrong = |text: &str| l.expression(text).unwrap_err().to_string();
    assert!(
        wrong("enrgy").contains("`energy`") && wrong("p_w").contains("`p_w[0]`") || wrong("p_w").contains("entries"),
        "{}",
        wrong("p_w")
    );
    assert!(wrong("p_w[2]").contains("entry 2") && wrong("p_y").contains("unknown name"), "{}", wrong("p_w[2]"));
}
