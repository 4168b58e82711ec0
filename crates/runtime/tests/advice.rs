//! The advice of refusals: an integrator that a refusal names is taken, and one that says to choose another has one to
//! choose.

#![allow(clippy::unwrap_used, clippy::panic)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    AnyIntegrator, Body, BodyMotion, BodyTorque, Formula, FormulaNames, InitialVelocity, Lattice, Motion, RuntimeError,
    SiteMotion, Start, StepControl, Steps, System,
};

/// The integrators that a message names.
fn named_in(message: &str) -> Vec<AnyIntegrator> {
    message.split('"').skip(1).step_by(2).filter_map(|name| name.parse().ok()).collect()
}

/// Tries every integrator by `run`, and those that its refusal names or, if it only says to choose another, all of them.
fn try_the_advice(what: &str, run: &dyn Fn(AnyIntegrator) -> Result<(), RuntimeError>) {
    let all = AnyIntegrator::all();
    let taken = all.iter().filter(|by| run(**by).is_ok()).count();
    for by in all {
        let Err(refusal) = run(by) else { continue };
        let message = refusal.to_string();
        for other in named_in(&message).into_iter().filter(|other| *other != by) {
            let followed = run(other);
            assert!(followed.is_ok(), "{what} by {by}: {message}\n{other}: {}", followed.unwrap_err());
        }
        let other = message.contains("another integrator") || message.contains("another method");
        assert!(!other || taken > 0, "{what} by {by}, as by every other: {message}");
    }
}

/// Ways to advance by an integrator: steps, and an accuracy.
fn ways(by: AnyIntegrator) -> [StepControl; 2] {
    [StepControl::Steps { by, steps: Steps::Count(10) }, StepControl::Accuracy { error: 1e-3, by: Some(by) }]
}

fn parsed(text: &str) -> Formula {
    Formula::parse(text, &["x", "y"], &[]).unwrap()
}

/// The coordinates x0 to x16, with this term in each of them.
fn many(term: &str) -> Formula {
    let names: Vec<String> = (0..17).map(|i| format!("x{i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let text: Vec<String> = names.iter().map(|name| term.replace('u', name)).collect();
    Formula::parse(&text.join(" + "), &names, &[]).unwrap()
}

#[test]
fn integrators_that_are_advised_are_taken() {
    let newton = parsed("(x'^2 + y'^2)/2 - y - z/10");
    let kinked = parsed("(x'^2 + y'^2)/2 - abs(y - 0.3) - z/10");
    let general = parsed("(x'^2 + y'^2)*(1 + z^2)/2 - y - x'*y*t/10");
    let circle = |of: &Formula| of.with_constraints(&["x^2 + y^2 = 1"]).unwrap();
    let force = |of: &Formula| of.with_force("x", "-x'^3 - y/10").unwrap();
    let drag = |of: &Formula| of.with_rayleigh("(x'^2 + y'^2)/10").unwrap();
    let impact = newton.with_impact("y + 0.1", herglotz_runtime::Impact::Elastic, None).unwrap();
    let names = FormulaNames::new(&["x", "y"], &[]);
    let hamiltonian = |text: &str| Formula::parse_hamiltonian(text, &names).unwrap();
    let systems = [
        ("free", newton.clone()),
        ("kinked", kinked.clone()),
        ("general", general.clone()),
        ("forced", force(&newton)),
        ("forced, general", force(&general)),
        ("dragged", drag(&newton)),
        ("dragged, kinked", drag(&kinked)),
        ("impacts", impact.clone()),
        ("forced impacts", force(&impact)),
        ("constrained", circle(&newton)),
        ("constrained, forced", circle(&force(&newton))),
        ("constrained, dragged", circle(&drag(&newton))),
        ("constrained, general", circle(&general)),
        ("constrained, kinked", circle(&kinked)),
        ("Hamiltonian", hamiltonian("(p_x^2 + p_y^2)/2 + y + z/10")),
        ("Hamiltonian, general", hamiltonian("(p_x^2 + p_y^2)*(1 + x^2)/2 + y + z^2/10")),
        ("Hamiltonian, kinked", hamiltonian("(p_x^2 + p_y^2)/2 + abs(y - 0.3) + z/10")),
    ];
    for (what, formula) in &systems {
        let Ok(system) = System::new(formula) else { continue };
        let at_rest = Start::new(0.0, [1.0, 0.0], [0.0, 0.0], 0.0);
        let start = match formula.is_hamiltonian() {
            true => Start { velocity: InitialVelocity::Momentum(vec![0.0; 2]), ..at_rest },
            false => at_rest,
        };
        try_the_advice(what, &|by| {
            ways(by)
                .into_iter()
                .try_for_each(|way| system.run(&Motion::new(start.clone(), 0.5, way), &mut ()).map(drop))
        });
        let motion = |by| Motion { resumable: true, ..Motion::new(start.clone(), 0.5, ways(by)[0]) };
        try_the_advice(&format!("{what}, resumable"), &|by| system.run(&motion(by), &mut ()).map(drop));
        try_the_advice(&format!("{what}, derivatives"), &|by| {
            system.sensitivity(&Motion { resumable: false, ..motion(by) }, &["x", "t_end"], &[], &mut ()).map(drop)
        });
    }
}

#[test]
fn integrators_that_are_advised_for_many_coordinates_are_taken() {
    for (what, formula) in [
        ("many", many("u'^2/2 - u^2/2")),
        ("many, forced", many("u'^2/2 - u^2/2").with_force("x3", "-x3'").unwrap()),
        ("many, kinked", many("u'^2/2 - abs(u - 0.3)")),
    ] {
        let system = System::new(&formula).unwrap();
        let start = Start::new(0.0, [1.0; 17], [0.0; 17], 0.0);
        try_the_advice(what, &|by| {
            ways(by)
                .into_iter()
                .try_for_each(|way| system.run(&Motion::new(start.clone(), 0.5, way), &mut ()).map(drop))
        });
        let motion = |by| Motion::new(start.clone(), 0.5, ways(by)[0]);
        try_the_advice(&format!("{what}, derivatives"), &|by| {
            system.sensitivity(&motion(by), &["x3", "t_end"], &[], &mut ()).map(drop)
        });
    }
    let chain = Lattice {
        site: "x'^2/2 - x^2/2 - z/10".into(),
        bond: Some("-(xr - xl)^2/2".into()),
        sizes: vec![20],
        ..Lattice::default()
    };
    let system = chain.system().unwrap();
    let at = Start::new(0.0, [0.1; 20], [0.0; 20], 0.0);
    let start = Start { velocity: InitialVelocity::Velocity(vec![0.0; 20]), ..at };
    try_the_advice("lattice", &|by| {
        system.run(&SiteMotion::new(start.clone(), 0.5, by, Steps::Count(10)), &mut ()).map(drop)
    });
}

#[test]
fn integrators_that_are_advised_for_bodies_are_taken() {
    let free = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() };
    let torque = Some(BodyTorque::parse(["-omega1", "t", "0"]).unwrap());
    for (what, body) in [("body", free.clone()), ("body with a torque", Body { torque, ..free })] {
        try_the_advice(what, &|by| {
            let motion = |way| BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.3], 0.5, way);
            ways(by).into_iter().try_for_each(|way| body.run(&motion(way), &mut ()).map(drop))
        });
        try_the_advice(&format!("{what}, derivatives"), &|by| {
            let motion = BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.3], 0.5, ways(by)[0]);
            body.derivatives(&motion).map(drop)
        });
    }
}
