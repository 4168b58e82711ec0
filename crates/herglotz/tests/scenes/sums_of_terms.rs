//! Lattices and bodies as systems of scenes.

use herglotz::Scene;
use herglotz::runtime::Outcome;

const LATTICE: &str = r#"
[system]
parameters = { k = 2.0, gamma = -0.1, level = 0.05 }
[system.lattice]
sites = 4
boundary = "fixed"
site = "x'^2/2 + cos(x) + gamma*z"
bond = "-k*(xr - xl)^2/2"
[start]
x = [0.1, 0.3, 0.0, 0.2]
"x'" = 0.0
[force]
"x[i]" = "-x'[i]^3"
[run]
time = 10.0
accuracy = 1e-9
[want]
rows = { every = 0.5, columns = ["t", "x[0]", "x'[3]", "energy"] }
events = [{ when = "x[0] - level" }]
[sweep]
k = [1.0, 2.0]
"#;

const WRITTEN: &str = r#"
[system]
coordinates = ["x[4]"]
lagrangian = "sum(i, 0, 3, x'[i]^2/2 + cos(x[i])) + gamma*z - k*(x[0]^2 + x[3]^2 + sum(i, 1, 3, (x[i] - x[i-1])^2))/2"
parameters = { k = 2.0, gamma = -0.1, level = 0.05 }
"#;

fn end(text: &str) -> Outcome {
    let scene = Scene::read(text).unwrap();
    scene.system.run(&scene.bare_motion(), &mut ()).unwrap()
}

#[test]
fn a_lattice_is_a_system_with_all_that_systems_have() {
    let (_, rest) = LATTICE.split_once("[start]").unwrap();
    let (a, b) = (end(LATTICE), end(&format!("{WRITTEN}[start]{rest}")));
    for (a, b) in a.q.iter().zip(&b.q) {
        // To the accuracy, since the steps may differ.
        assert!((a - b).abs() < 1e-8, "{a} {b}");
    }
    let scene = Scene::read(LATTICE).unwrap();
    assert_eq!((scene.events.len(), scene.swept.len()), (1, 1));
}

#[test]
fn bodies_are_a_system_whose_masses_are_parameters() {
    let text = r#"
[system]
parameters = { G = 1.0, gamma = -0.01 }
[system.bodies]
masses = [1.0, 0.5]
dimensions = 2
[start]
x_0 = 0.0
y_0 = 0.0
x_1 = 1.0
y_1 = 0.0
"x_0'" = 0.0
"y_0'" = 0.0
"x_1'" = 0.0
"y_1'" = 1.0
[run]
time = 3.0
accuracy = 1e-9
[sweep]
m_1 = [0.25, 0.5]
"#;
    let lighter = Scene::read_with(&text.replace("G = 1.0,", "G = 1.0, m_1 = 0.5,"), &["m_1=0.25".to_owned()]).unwrap();
    let found = lighter.system.run(&lighter.bare_motion(), &mut ()).unwrap();
    let expected = end(&text.replace("masses = [1.0, 0.5]", "masses = [1.0, 0.25]"));
    assert_eq!((found.q, found.z), (expected.q, expected.z));
}

#[test]
fn what_is_wrong_is_said_at_its_place() {
    let changed = |from: &str, to: &str| {
        assert!(LATTICE.contains(from), "{from}");
        Scene::read(&LATTICE.replace(from, to)).map(|_| ()).unwrap_err().to_string()
    };
    for (from, to, expected) in [
        ("cos(x)", "cos(y)", "unknown name `y`"),
        ("cos(x)", "q[0]", "`site` uses `q`"),
        ("gamma*z\"", "x*z\"", "`site` depends on z in another form"),
        ("sites = 4", "sites = 0", "`sites` has 0 along a direction"),
        ("[system]", "[system]\nlagrangian = \"x'^2\"", "give this or a `lattice` or `bodies`, not both"),
        ("[system]", "[system]\naction = \"s\"", "the action of a lattice and of bodies is `z`"),
        (
            "[system]",
            "[system]\nbodies = { masses = [1.0, 1.0], dimensions = 2 }",
            "give a `lattice` or `bodies`, not both",
        ),
        ("level = 0.05", "level = 0.05, typo = 1.0", "typo"),
        ("sites = 4", "sites = 300", "256"),
    ] {
        let found = changed(from, to);
        assert!(found.contains(expected), "{found:?} for {expected:?}");
    }
}

/// A start by a formula in the index of an array is that of its values, for arrays of a formula and the sites of a lattice.
#[test]
fn starts_by_formulas() {
    let values: Vec<f64> = (0..4).map(|i| 0.1 * f64::from(i).sin() + 2.0 / 4.0).collect();
    let starts = ["x = \"0.1*sin(i) + k/n\"".to_owned(), format!("x = {values:?}")];
    let of = |text: &str| starts.each_ref().map(|start| end(&text.replace("x = [0.1, 0.3, 0.0, 0.2]", start)).q);
    let (_, rest) = LATTICE.split_once("[start]").unwrap();
    for text in [LATTICE.to_owned(), format!("{WRITTEN}[start]{rest}")] {
        let [by_formula, by_values] = of(&text);
        assert_eq!(by_formula, by_values);
    }
    // Velocities of a lattice default to 0, and single sites have names.
    let without = LATTICE.replace("\"x'\" = 0.0\n", "");
    assert!(without.len() < LATTICE.len() && end(&without).q == end(LATTICE).q);
    let one_by_one =
        LATTICE.replace("x = [0.1, 0.3, 0.0, 0.2]", "\"x[0]\" = 0.1\n\"x[1]\" = 0.3\n\"x[2]\" = 0.0\n\"x[3]\" = 0.2");
    assert_eq!(end(&one_by_one).q, end(LATTICE).q);
    let error =
        |start: &str| Scene::read(&LATTICE.replace("[0.1, 0.3, 0.0, 0.2]", start)).map(|_| ()).unwrap_err().to_string();
    assert!(error("\"sin(l)\"").contains("unknown name `l`"), "{}", error("\"sin(l)\""));
    assert!(error("\"1/i\"").contains("`x` is inf at the entry 0"), "{}", error("\"1/i\""));
    assert!(error("\"z\"").contains("can depend only on the index"), "{}", error("\"z\""));
}
