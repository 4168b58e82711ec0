//! Lattices and bodies as formulas, against their sparse systems.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    Bodies, Boundary, Lattice, Motion, Outcome, RuntimeError, SiteMotion, SiteSystem, Start, StepControl, Steps,
    SumOfTerms, System,
};

/// The distance of the ends of the same steps by a sparse system and by its formula.
fn apart(sparse: &SiteSystem, terms: &SumOfTerms, by: &str) -> f64 {
    let (n, by) = (sparse.dimension(), by.parse().unwrap());
    let q: Vec<f64> = (0..n).map(|i| 2.0 * (i / 2) as f64 * f64::from(n < 8) + (1.3 * i as f64).sin()).collect();
    let v: Vec<f64> = (0..n).map(|i| 0.3 * (0.9 * i as f64).cos()).collect();
    let start = Start::new(0.5, q, v, 0.2);
    let found = sparse.run(&SiteMotion::new(start.clone(), 1.5, by, Steps::Count(10)), &mut ()).unwrap();
    let system = System::new(&terms.formula().unwrap()).unwrap();
    let motion = Motion::new(start, 1.5, StepControl::Steps { by, steps: Steps::Count(10) });
    let of_formula = system.run(&motion, &mut ()).unwrap();
    let all = |of: &Outcome| [&of.q[..], &of.p, &[of.z.unwrap()]].concat();
    all(&found).iter().zip(all(&of_formula)).fold(0.0, |m: f64, (a, b)| {
        let apart = (a - b).abs();
        if apart <= m { m } else { apart }
    })
}

#[test]
fn lattices_are_their_formulas() {
    let line = Lattice {
        site: "u = 1 - cos(x)\nlong = 0.1*t +\n 0.2\nL = m*x'^2/2 - u*(1 + u/7) + long*x + gamma*(1 + sin(t))*z".into(),
        bond: Some("d = xr - xl; -k*d^2/2 - d^4/4".into()),
        parameters: [("m", 1.5), ("gamma", -0.1), ("k", 2.0)].map(|(name, x)| (name.to_owned(), x)).into(),
        ..Lattice::default()
    };
    let plane = Lattice {
        coordinates: vec!["x".into(), "y".into()],
        site: "x'^2/2 + y'^2 - (x^2 + y^2)^2/4 + 0.3*sin(t)*x + sum(i_, 1, 2, y^i_/9) - 0.2*z".into(),
        bond: Some("-((xr - xl)^2 + (yr - yl)^2)/2 - xl*yr/5".into()),
        ..Lattice::default()
    };
    for boundary in [Boundary::Periodic, Boundary::Fixed, Boundary::Free] {
        for (lattice, sizes) in [
            (&line, vec![2]),
            (&line, vec![5]),
            (&line, vec![3, 4]),
            (&line, vec![2, 3, 2]),
            (&line, vec![20]),
            (&plane, vec![3]),
            (&plane, vec![2, 3]),
            (
                &Lattice { bond: None, parameters: vec![("m".into(), 1.5), ("gamma".into(), -0.1)], ..line.clone() },
                vec![3],
            ),
        ] {
            let lattice = Lattice { sizes, boundary, ..lattice.clone() };
            let off = apart(&lattice.system().unwrap(), &lattice.sum_of_terms().unwrap(), "gauss_2");
            // Ten steps on numbers of order one: round-off, with that of Newton's method.
            assert!(off < 1e-12, "{lattice:?}: {off:e}");
        }
    }
}

#[test]
fn bodies_are_their_formulas() {
    for (dimensions, masses) in [(2, vec![1.0, 0.5]), (2, vec![1.0, 0.5, 0.25]), (3, vec![1.0, 0.5])] {
        let bodies = Bodies { masses, dimensions, g: 1.3, gamma: -0.05 };
        for by in ["strang", "blanes_moan_6"] {
            let off = apart(&bodies.system().unwrap(), &bodies.sum_of_terms().unwrap(), by);
            assert!(off < 1e-12, "{bodies:?} by {by}: {off:e}");
        }
    }
}

#[test]
fn general_sites_have_formulas_alone() {
    // Masses that depend on the position, and bonds with velocities.
    let lattice = Lattice {
        site: "(1 + x^2)*x'^2/2 + gamma*z".into(),
        bond: Some("xl'*xr'/5 - (xr - xl)^2/2".into()),
        sizes: vec![3],
        boundary: Boundary::Free,
        parameters: vec![("gamma".into(), -0.1)],
        ..Lattice::default()
    };
    assert!(matches!(lattice.system(), Err(RuntimeError::Argument { .. })));
    let expected =
        "sum(i, 0, 2, (1 + x[i]^2)*x'[i]^2/2) + sum(i, 0, 1, x'[i]*x'[i+1]/5 - (x[i+1] - x[i])^2/2) + gamma*z";
    let written = System::parse(expected, &["x[3]"], &[("gamma", -0.1)]).unwrap();
    let start = Start::new(0.0, [0.3, -0.2, 0.5], [0.1, 0.2, -0.1], 0.0);
    let motion = Motion::new(start, 2.0, StepControl::Accuracy { error: 1e-9, by: None });
    let made = System::new(&lattice.sum_of_terms().unwrap().formula().unwrap()).unwrap();
    let (a, b) = (made.run(&motion, &mut ()).unwrap(), written.run(&motion, &mut ()).unwrap());
    for (a, b) in a.q.iter().zip(&b.q) {
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }
}

#[test]
fn what_is_no_lattice_is_refused() {
    let of = |site: &str, bond: &str| Lattice {
        site: site.into(),
        bond: Some(bond.into()),
        sizes: vec![4],
        parameters: vec![("n".into(), 1.0)],
        ..Lattice::default()
    };
    let good = "n*x'^2/2";
    for (lattice, expected) in [
        (of("force[x] = -x'\nn*x'^2/2", "xl*xr"), "`site` has a force"),
        (of("rayleigh = x'^2\nn*x'^2/2", "xl*xr"), "`site` has a force"),
        (of("n*x'^2/2 + z^2", "xl*xr"), "`site` depends on z in another form"),
        (of("n*x'^2/2 + x*z", "xl*xr"), "`site` depends on z in another form"),
        (of("n*v[0]^2/2", "xl*xr"), "`site` uses `v`"),
        (of("n*x'^2/2 - q[0]^2", "xl*xr"), "`site` uses `q`"),
        (of(good, "-q[1]*xl"), "`bond` uses `q`"),
        (of(good, "xl*xr + z"), "`bond` depends on z"),
        (of("n*x'^2/2 - cos(y)", "xl*xr"), "`site`: line 1, column 16: unknown name `y`"),
        (Lattice { sizes: vec![], ..of(good, "xl*xr") }, "`sites` has no direction"),
        (Lattice { coordinates: vec![], ..of("1", "1") }, "`site`: "),
    ] {
        let found = lattice.sum_of_terms().unwrap_err().to_string();
        assert!(found.starts_with(expected), "{found:?} for {expected:?}");
        if expected.ends_with("a force") {
            // The sparse system has no forces either.
            assert_eq!(lattice.system().err().unwrap().to_string(), found);
        }
    }
    let many = Lattice { sizes: vec![300], ..of(good, "xl*xr") }.sum_of_terms().unwrap();
    assert!(many.formula().unwrap_err().to_string().contains("256"), "{:?}", many.formula().unwrap_err());
    assert!(Bodies { masses: vec![1.0], dimensions: 2, g: 1.0, gamma: 0.0 }.sum_of_terms().is_err());
}
