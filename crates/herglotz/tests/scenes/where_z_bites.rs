//! A drag `gamma*z` acts on the canonical momentum: terms of L that change nothing without z then change the motion.

use herglotz::runtime::{Motion, Start, StepControl, System};

/// The end of a motion.
fn end(lagrangian: &str, coordinates: &[&str], parameters: &[(&str, f64)], start: &Start, t: f64) -> Vec<f64> {
    let system = System::parse(lagrangian, coordinates, parameters).unwrap();
    let control = StepControl::Accuracy { error: 1e-10, by: None };
    system.run(&Motion::new(start.clone(), t, control), &mut ()).unwrap().q
}

/// Kapitza's pendulum, whose pivot oscillates as `Y = a cos(w t)`, by two Lagrangians that differ by the derivative of
/// `Y' cos(theta)`. With `gamma*z` they have different motions, since the momenta `theta'` and `theta' + Y' sin(theta)`
/// are dragged; with a force they have the same.
#[test]
fn total_derivatives_change_the_motion_with_z() {
    let with_momentum = "theta'^2/2 - a*w*sin(w*t)*theta'*sin(theta) + g*cos(theta)";
    let with_potential = "theta'^2/2 + (g - a*w^2*cos(w*t))*cos(theta)";
    let start = Start::new(0.0, [2.9], [0.0], 0.0);
    let of = |drag: &str, l: &str| {
        let text = if drag == "z" { format!("{l} - c*z") } else { format!("force[theta] = -c*theta'; {l}") };
        end(&text, &["theta"], &[("a", 0.1), ("w", 30.0), ("g", 1.0), ("c", 0.5)], &start, 3.0)[0]
    };
    let [z, force] = ["z", "force"].map(|drag| [with_momentum, with_potential].map(|l| of(drag, l)));
    println!("by z: {z:?}, by a force: {force:?}");
    assert!((z[0] - z[1]).abs() > 1e-3, "{z:?}");
    assert!((force[0] - force[1]).abs() < 1e-8, "{force:?}");
    // Where the momentum is the velocity, the drag by z is that of the force.
    assert!((z[1] - force[1]).abs() < 1e-8, "{z:?} {force:?}");
}

/// A charge in a magnetic field, by two vector potentials of the same field. The drag `gamma*z` acts on `v + A`, which
/// depends on the choice of the potential; the force `-c v` gives the spiral in closed form with both.
#[test]
fn vector_potentials_are_dragged_with_z() {
    let symmetric = "(x'^2 + y'^2)/2 + b*(x*y' - y*x')/2";
    let one_sided = "(x'^2 + y'^2)/2 + b*x*y'";
    let (b, c, t) = (2.0, 0.4, 5.0_f64);
    let start = Start::new(0.0, [1.0, 0.0], [0.0, 1.0], 0.0);
    let of = |drag: &str, l: &str| {
        let text = match drag {
            "z" => format!("{l} - c*z"),
            _ => format!("force[x] = -c*x'; force[y] = -c*y'; {l}"),
        };
        end(&text, &["x", "y"], &[("b", b), ("c", c)], &start, t)
    };
    // x'' = b y' - c x', y'' = -b x' - c y': with s = c + i b the velocity i e^(-s t), and the position
    // 1 + i (1 - e^(-s t))/s.
    let decay = (-c * t).exp();
    let (re, im) = (1.0 - decay * (b * t).cos(), decay * (b * t).sin());
    let size = c * c + b * b;
    let exact = [1.0 - (im * c - re * b) / size, (re * c + im * b) / size];
    let [z, force] = ["z", "force"].map(|drag| [symmetric, one_sided].map(|l| of(drag, l)));
    println!("by z: {z:?}, by a force: {force:?}, exactly {exact:?}");
    let off = |a: &[f64], b: &[f64]| (a[0] - b[0]).hypot(a[1] - b[1]);
    assert!(off(&z[0], &z[1]) > 0.1 && off(&z[0], &exact) > 0.1 && off(&z[1], &exact) > 0.1, "{z:?} {exact:?}");
    assert!(force.iter().all(|end| off(end, &exact) < 1e-8), "{force:?} {exact:?}");
}
