//! Names of methods and integrators: what parses is printed back as it came, what does not is an error that says it.

#![no_main]

use discrete_herglotz::{AnyIntegrator, Method};
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
