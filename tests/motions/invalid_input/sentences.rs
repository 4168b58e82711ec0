//! Every variant of every error, triggered through the public interface: its message has the value and the remedy.

/// The variants of an error, each with an expression that triggers it and words of its message. All variants in the
/// source of the error must be there.
macro_rules! every {
    ($Error:ty, $source:literal { $($variant:pat => $trigger:expr, $words:expr;)* }) => {
        let found: BTreeSet<String> = [$(name_of_variant(stringify!($variant))),*].into();
        assert_eq!(found, variants(stringify!($Error), $source));
        $(
            let error: $Error = $trigger;
            assert!(matches!(error, $variant), "not {}: {error:?}", stringify!($variant));
            let sentence = error.to_string();
            for word in $words {
                assert!(sentence.contains(word), "no {word:?} in {sentence:?}");
            }
        )*
    };
}

/// The name of the variant in a pattern such as `StepError::Singular { .. }`.
fn name_of_variant(pattern: &str) -> String {
    let name = pattern.rsplit("::").next().unwrap();
    name.chars().take_while(|c| c.is_alphanumeric()).collect()
}

/// The variants of an enum, read from its source, which is formatted by rustfmt.
fn variants(of: &str, source: &str) -> BTreeSet<String> {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("crates").join(source)).unwrap();
    let name = of.split('<').next().unwrap();
    let body = text.split(&format!("\npub enum {name}")).nth(1).unwrap().split("\n}").next().unwrap();
    let variant =
        |line: &str| line.strip_prefix("    ")?.starts_with(char::is_uppercase).then(|| name_of_variant(line.trim()));
    body.lines().filter_map(variant).collect()
}

pub mod input;
pub mod steps;

use crate::common::lagrangians::{Bratu, Massless};
use crate::lagrangians::{One, one};
use contact_examples::systems::{FreeParticle, HarmonicOscillator};
use contact_geom::nalgebra::DMatrix;
use contact_geom::support::linear;
use contact_geom::{DiscretePoint, GeometryError, PhasePoint, Statement, Symmetry, VelocityPoint, herglotz_field};
use discrete_herglotz::rules::{Method, Quadrature, Rule, UnknownMethod};
use discrete_herglotz::{AnyIntegrator, UnknownIntegrator, UnresolvedStep};
use exact_lagrangian::{ContactExponential, ExactError, herglotz_flow};
use input::Odd;
use std::collections::BTreeSet;
use std::path::Path;

fn pendulum_at(p: f64) -> PhasePoint<1> {
    PhasePoint::new([0.3], [p], 0.1)
}

/// A drag that makes the conformal factor of a step of 0.1 negative.
fn strong() -> Quadrature<One> {
    Rule::LEFT_MIDPOINT.of(one(FreeParticle { gamma: -20.0 }), 0.1).unwrap()
}

#[test]
fn geometry_errors() {
    every!(GeometryError, "contact-geom/src/error.rs" {
        GeometryError::WrongSize { .. } => PhasePoint::<2>::from_slices(&[1.0], &[1.0, 2.0], 0.0).unwrap_err(), ["q has 1", "pass 2"];
        GeometryError::NonFinite { .. } => {
            VelocityPoint::<2>::from_slices(&[1.0, 2.0], &[1.0, f64::INFINITY], 0.0).unwrap_err()
        }, ["v[1] = inf", "finite number"];
        GeometryError::Singular { .. } => {
            herglotz_field(&Massless, 0.0, &VelocityPoint::new([0.1], [0.2], 0.0)).unwrap_err()
        }, ["singular", "pivot 0e0"];
        GeometryError::Undefined { .. } => {
            let ld = Rule::RECTANGLE.of(One::from(Odd::Explosive), 0.1).unwrap();
            let outside = DiscretePoint::new([0.0], [f64::NAN], 0.0);
            discrete_herglotz::statements::residual(Statement::ActionDifferential, &ld, &[], 0.0, &outside).unwrap_err()
        }, ["not defined", "inside its domain"];
    });
    // The message names the remedy.
    let sentence = Symmetry::<2>::rotation(0, 2).unwrap_err().to_string();
    assert!(sentence.contains("plane of rotation") && sentence.contains("dimension 2"), "{sentence}");
    let mut singular = (DMatrix::<f64>::zeros(2, 2), contact_geom::nalgebra::DVector::zeros(2));
    let error = linear::solve(&mut singular.0, &mut singular.1).unwrap_err();
    assert!(error.to_string().contains("singular matrix (pivot 0e0)"), "{error}");
    let named = error.of("the mass matrix", "take another").to_string();
    assert!(named.contains("the mass matrix") && named.contains("take another"), "{named}");
}

#[test]
fn exact_errors() {
    let oscillator = one(HarmonicOscillator { gamma: 0.0 });
    every!(ExactError<1>, "exact-lagrangian/src/error.rs" {
        ExactError::Input(_) => ContactExponential::new(oscillator, -0.5).map_err(ExactError::from).unwrap_err(), ["-0.5", "finite nonzero number", "positive"];
        ExactError::OutsideDomain { .. } => {
            herglotz_flow(&One::from(Odd::Explosive), 0.0, &VelocityPoint::new([0.0], [0.0], 1.0), 2.0).unwrap_err()
        }, ["only until t = ", "smaller h", "another start"];
        ExactError::Unfinished { .. } => {
            herglotz_flow(&oscillator, 0.0, &VelocityPoint::new([1.0], [0.0], 0.0), 1e9).unwrap_err()
        }, ["t = ", "continue from there"];
        ExactError::NotConverged { .. } => {
            let exp = ContactExponential::new(Bratu { lambda: 6.0, drag: 0.01 }, 0.8).unwrap();
            exp.retract(0.0, &DiscretePoint::new([0.0], [0.1], 0.0)).unwrap_err()
        }, ["no motion", "misses", "pass a guess"];
        ExactError::ConjugatePoint { .. } => {
            let exp = ContactExponential::new(oscillator, std::f64::consts::PI).unwrap();
            exp.retract(0.0, &DiscretePoint::new([0.3], [0.5], 0.0)).unwrap_err()
        }, ["conjugate", "singular value", "another h"];
    });
}

#[test]
fn names_that_are_none() {
    let UnknownMethod { name } = "mid-point".parse::<Method>().unwrap_err();
    let sentence = UnknownMethod { name }.to_string();
    assert!(sentence.contains("\"mid-point\"") && sentence.contains("left_midpoint, midpoint"), "{sentence}");
    let UnknownIntegrator { name } = "gauss_17".parse::<AnyIntegrator>().unwrap_err();
    let sentence = UnknownIntegrator { name }.to_string();
    assert!(sentence.contains("\"gauss_17\"") && sentence.contains("gauss_16"), "{sentence}");
    let sentence = UnresolvedStep { step: 7, defect: 12.5 }.to_string();
    assert!(
        sentence.contains("step 7") && sentence.contains("1.2e1") && sentence.contains("smaller step"),
        "{sentence}"
    );
}
