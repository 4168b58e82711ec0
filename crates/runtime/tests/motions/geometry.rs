//! The geometry at a point, and symmetries, for any number of coordinates.

use super::by_steps;
use contact_geom::{ChartVector, ContactForm, LagrangianForm, VelocityPoint, herglotz_field};
use herglotz_runtime::{Formula, FormulaSymmetry, Motion, Start, System};

/// Against the forms and fields of contact-geom, which are computed with dual numbers: a mass matrix that depends on all of
/// `(t, q, v, z)`, and a force.
#[test]
fn it_is_that_of_the_lagrangian() {
    let text = "force[x] = -x'*y/3; exp(t/9)*(2 + sin(x) + z^2/5)*x'^2/2 + (1 + y^2)*y'^2/2 + cosh(y')*x'*y'/4 \
                - cos(x - y) + x'*z/7 - z/5";
    let formula = Formula::parse(text, &["x", "y"], &[]).unwrap();
    let lagrangian = formula.lagrangian::<2>().unwrap();
    let system = System::new(&formula).unwrap();
    let (t, x) = (0.7, VelocityPoint::new([0.3, -0.8], [0.6, 0.9], 0.4));
    let found = system.geometry(&Start::new(t, [0.3, -0.8], [0.6, 0.9], 0.4)).unwrap();
    let (form, point) = (LagrangianForm { lagrangian: &lagrangian, t }, ChartVector::from(x));
    // Some dozen roundings of terms of about one, and the condition of W.
    let bound = 64.0 * f64::EPSILON * found.condition;
    let numbers = |of: ChartVector<2>| [of.x.as_slice(), of.y.as_slice(), &[of.z]].concat();
    for (what, found, expected) in [
        ("eta", &found.eta, numbers(form.eta(&point).unwrap())),
        ("Reeb field", &found.reeb, numbers(form.reeb(&point).unwrap())),
        ("Herglotz field", &found.herglotz_field, numbers(herglotz_field(&lagrangian, t, &x).unwrap())),
        ("volume", &vec![found.volume], vec![form.volume(&point).unwrap()]),
    ] {
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() <= bound, "{what}: {found:?}, {expected:?}");
        }
        assert_eq!(found.len(), expected.len(), "{what}");
    }
}

/// Ten bodies in the plane, more coordinates than any kernel: their common translations and rotation are found, their momenta
/// decay with the conformal factor, and the field is that of the geometry.
#[test]
fn many_coordinates() {
    let names: Vec<String> = (1..=10).flat_map(|k| [format!("x{k}"), format!("y{k}")]).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let kinetic: Vec<String> = (1..=10).map(|k| format!("{k}*(x{k}'^2 + y{k}'^2)/2")).collect();
    let springs: Vec<String> = (1..10).map(|k| format!("((x{k} - x{0})^2 + (y{k} - y{0})^2)^2", k + 1)).collect();
    let text = format!("{} - ({}) - z/10", kinetic.join(" + "), springs.join(" + "));
    let system = System::parse(&text, &names, &[]).unwrap();
    let all = |first: usize| (first..20).step_by(2).collect::<Vec<_>>();
    let planes = (0..10).map(|k| (2 * k, 2 * k + 1)).collect();
    assert_eq!(
        system.symmetries(),
        [FormulaSymmetry::Translation(all(0)), FormulaSymmetry::Translation(all(1)), FormulaSymmetry::Rotation(planes)]
    );
    let (q, v): (Vec<f64>, Vec<f64>) =
        (0..20).map(|i| ((0.7 * f64::from(i)).sin(), 0.3 * (0.4 * f64::from(i)).cos())).unzip();
    let start = Start::new(0.0, q.clone(), v.clone(), 0.2);
    let geometry = system.geometry(&start).unwrap();
    assert_eq!((geometry.rate, geometry.mass[6][6], geometry.mass[6][7]), (-0.1, 4.0, 0.0));
    let mut field = vec![0.0; 41];
    system.rates(0.0, &[&q[..], &v[..], &[0.2]].concat(), &mut field);
    assert_eq!(field, geometry.herglotz_field);
    let check = system.check(&Motion::new(start, 3.0, by_steps(120)), 3).unwrap();
    let last = check.samples.last().unwrap();
    assert_eq!(last.momenta.len(), 3);
    for momentum in &last.momenta {
        // The momenta of the bodies have a sum of some tens.
        let off = (momentum.momentum - momentum.predicted).abs();
        assert!(off <= 120.0 * 50.0 * f64::EPSILON, "{momentum:?}: {off:e}");
    }
}
