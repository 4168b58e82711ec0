//! Holonomic constraints in scenes.

use crate::{SceneError, read};
use herglotz::Scene;
use herglotz::runtime::Status;

const PENDULUM: &str = include_str!("../../../../scenes/rigid_pendulum.toml");
const LINKAGE: &str = include_str!("../../../../scenes/linkage.toml");

/// A scene with some of its text replaced.
fn with(scene: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(scene.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    })
}

fn column(scene: &Scene, rows: &[Vec<f64>], name: &str) -> Vec<f64> {
    let place = scene.columns.iter().position(|(known, _)| known == name).unwrap();
    rows.iter().map(|row| row[place]).collect()
}

/// Without drag the pendulum returns after a period, on its circle in all rows; its multiplier is that of the tension.
#[test]
fn the_rigid_pendulum_returns() {
    let text = with(
        PENDULUM,
        &[
            ("gamma = -0.05", "gamma = 0.0"),
            ("time = 20.0", "time = 2.367841947576237"),
            ("step = 0.02", "steps = 200"),
        ],
    );
    let scene = Scene::read(&text).unwrap();
    let (outcome, rows) = scene.system.record(&scene.motion()).unwrap();
    assert_eq!(outcome.status, Status::Completed);
    assert!((outcome.q[0] - 1.0).abs() < 1e-9 && outcome.q[1].abs() < 1e-9, "{:?}", outcome.q);
    let [x, y] = ["x", "y"].map(|name| column(&scene, &rows, name));
    assert!(x.len() > 40 && x.iter().zip(&y).all(|(x, y)| (x * x + y * y - 1.0).abs() < 1e-14));
    let (lambda, energy) = (column(&scene, &rows, "lambda"), column(&scene, &rows, "energy"));
    let tension = scene.columns.iter().position(|(name, _)| name.contains("tension")).unwrap();
    assert!(lambda.iter().zip(&rows).all(|(lambda, row)| (lambda + row[tension] / 2.0).abs() < 1e-9));
    assert!(energy.iter().all(|e| e.abs() < 1e-9));
}

/// The linkage starts on its constraints after a projection and stays there; its energy decreases.
#[test]
fn the_linkage_stays_together() {
    let text = with(
        LINKAGE,
        &[
            ("time = 20.0", "time = 1.0"),
            ("\"x3\", \"y3\", \"energy\"", "\"x1^2 + y1^2\", \"(x3 - x2)^2 + (y3 - y2)^2\", \"energy\""),
        ],
    );
    let scene = Scene::read(&text).unwrap();
    let (outcome, rows) = scene.system.record(&scene.motion()).unwrap();
    assert_eq!(outcome.status, Status::Completed);
    assert!(rows.len() > 40 && rows.iter().all(|row| (row[1] - 1.0).abs() < 1e-13 && (row[2] - 4.0).abs() < 1e-13));
    let refused = Scene::read(&with(LINKAGE, &[("project = true", "")])).unwrap();
    let error = refused.system.run(&refused.motion(), &mut ()).unwrap_err();
    let error = refused.explain(&error).to_string();
    assert!(error.contains("off the constraints by the distance") && error.contains("[start]"), "{error}");
}

/// What is no constraint is refused at its position in the file.
#[test]
fn constraints_that_are_refused() {
    let good = "\"x^2 + y^2 = l^2\"";
    for (bad, part) in [
        ("\"x^2 + y'^2 = l^2\"", "not on velocities"),
        ("\"x^2 + w^2 = l^2\"", "unknown name `w`"),
        ("\"x + t\"", "does not depend on time"),
        ("\"x = 1\", \"y = 1\"", "fewer constraints"),
        ("\"l = 1\"", "does not depend on a coordinate"),
    ] {
        let error: SceneError = read(&with(PENDULUM, &[(good, bad)])).err().unwrap();
        assert!(error.to_string().contains(part) && error.error.text.starts_with("constraints"), "{bad}: {error}");
    }
    let error = read(&with(PENDULUM, &[("\"kahan_li_8\"", "\"midpoint\"")])).err().unwrap();
    assert!(error.to_string().contains("RATTLE") && error.error.text.starts_with("integrator"), "{error}");
}
