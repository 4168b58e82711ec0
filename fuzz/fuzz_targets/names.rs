//! Names of methods and integrators: a name that parses is printed unchanged, and one that does not gives an error that
//! contains it.

#![no_main]

use discrete_herglotz::{AnyIntegrator, rules::Method};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    match text.parse::<Method>() {
        Ok(method) => assert_eq!(method.to_string(), text),
        Err(error) => assert!(error.name == text && error.to_string().contains("midpoint")),
    }
    match text.parse::<AnyIntegrator>() {
        Ok(integrator) => assert!(integrator.to_string() == text && integrator.order() > 0),
        Err(error) => assert!(error.name == text && error.to_string().contains("gauss_16")),
    }
});
