//! Conversion of numbers between Python and Rust; errors name the argument.

use herglotz_runtime::{FormulaError, RuntimeError};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyInt, PyList, PyTuple};
use std::fmt::Display;

/// The `ValueError` with the text of an error.
pub fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The number of an argument.
pub fn number(name: &str, from: &Bound<'_, PyAny>) -> PyResult<f64> {
    let wrong = || value_error(format!("`{name}` is {}; it must be a finite number", shown(from)));
    if from.is_instance_of::<PyBool>() {
        return Err(wrong());
    }
    let x: f64 = from.extract().map_err(|_| wrong())?;
    if x.is_finite() { Ok(x) } else { Err(wrong()) }
}

/// The integer of an argument, at least `least`. A float is refused; where it is a whole number, the error says how to
/// write it.
pub fn whole(name: &str, from: &Bound<'_, PyAny>, least: usize) -> PyResult<usize> {
    let wrong = |instead: String| {
        value_error(format!("`{name}` is {}; it must be an integer of at least {least}{instead}", shown(from)))
    };
    let is_boolean = from.is_instance_of::<PyBool>() || from.get_type().name().is_ok_and(|name| name == "bool");
    if is_boolean {
        return Err(wrong(String::new()));
    }
    if let Ok(found) = from.extract::<usize>() {
        return if found >= least { Ok(found) } else { Err(wrong(String::new())) };
    }
    // Integers that are too large or negative, and everything that is not an integer.
    match from.extract::<f64>() {
        Ok(x) if x.fract() == 0.0 && x >= least as f64 && x <= 1e15 => Err(wrong(format!(": write {x}"))),
        _ => Err(wrong(String::new())),
    }
}

/// The string of an argument.
pub fn word(name: &str, from: &Bound<'_, PyAny>, example: &str) -> PyResult<String> {
    from.extract()
        .map_err(|_| value_error(format!("`{name}` is {}; it must be a string such as {example}", shown(from))))
}

/// The representation of an object for an error message, truncated where it is long.
pub fn shown(from: &Bound<'_, PyAny>) -> String {
    /// The number of characters from which the text is truncated.
    const MAX_LENGTH: usize = 60;
    let text = from.repr().map_or_else(|_| "an object".to_owned(), |text| text.to_string());
    if text.chars().count() <= MAX_LENGTH { text } else { text.chars().take(MAX_LENGTH).chain("...".chars()).collect() }
}

/// The finite numbers of a one-dimensional argument; a single number gives a vector of length 1.
pub fn numbers(name: &str, from: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    // Floats, lists and tuples are read directly; NumPy converts everything else.
    if from.is_instance_of::<PyFloat>() {
        return Ok(vec![number(name, from)?]);
    }
    let plain = |items: &mut dyn Iterator<Item = Bound<'_, PyAny>>| -> Option<Vec<f64>> {
        items
            .map(|x| {
                if x.is_exact_instance_of::<PyFloat>() || x.is_exact_instance_of::<PyInt>() {
                    x.extract().ok()
                } else {
                    None
                }
            })
            .collect()
    };
    let written = if let Ok(list) = from.cast::<PyList>() {
        plain(&mut list.iter())
    } else if let Ok(tuple) = from.cast::<PyTuple>() {
        plain(&mut tuple.iter())
    } else {
        None
    };
    let found = match written {
        Some(found) => found,
        None => {
            let (shape, found) = array(name, from)?;
            if shape.len() > 1 {
                return Err(value_error(format!("`{name}` has the shape {shape:?}; it must have one dimension")));
            }
            found
        }
    };
    finite(name, &found)?;
    Ok(found)
}

/// Checks that all numbers are finite.
fn finite(name: &str, numbers: &[f64]) -> PyResult<()> {
    match numbers.iter().enumerate().find(|(_, x)| !x.is_finite()) {
        Some((i, x)) => Err(value_error(format!("`{name}[{i}]` is {x}; it must be a finite number"))),
        None => Ok(()),
    }
}

/// The numbers of an array of any shape, in C order.
fn array(name: &str, from: &Bound<'_, PyAny>) -> PyResult<(Vec<usize>, Vec<f64>)> {
    if let Ok(array) = from.extract::<PyReadonlyArrayDyn<'_, f64>>() {
        let shape = array.shape().to_vec();
        return Ok((shape, array.as_array().iter().copied().collect()));
    }
    let numpy = from.py().import("numpy")?;
    let wrong = |what: String| value_error(format!("`{name}` {what}; it must be an array of real numbers"));
    let ragged = |_| wrong(format!("is {}", shown(from)));
    let any = numpy.call_method1("asarray", (from,)).map_err(ragged)?;
    let dtype = any.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u") {
        return Err(wrong(format!("has the dtype {dtype} ({})", shown(from))));
    }
    let any = any.call_method1("astype", ("float64",))?;
    let array: PyReadonlyArrayDyn<'_, f64> = any.extract().map_err(|_| PyTypeError::new_err(name.to_owned()))?;
    Ok((array.shape().to_vec(), array.as_array().iter().copied().collect()))
}

/// The finite numbers of a two-dimensional argument with this number of columns, and the number of its rows.
pub fn table(name: &str, from: &Bound<'_, PyAny>, columns: usize) -> PyResult<(usize, Vec<f64>)> {
    let (shape, found) = array(name, from)?;
    match shape.as_slice() {
        [rows, width] if *width == columns => {
            finite(name, &found)?;
            Ok((*rows, found))
        }
        _ => Err(value_error(format!(
            "`{name}` has the shape {shape:?}; it must have the shape [M, {columns}], with a row for each member"
        ))),
    }
}

/// A vector as a NumPy array, without a copy.
pub fn vector(py: Python<'_>, numbers: Vec<f64>) -> Py<PyArray1<f64>> {
    PyArray1::from_vec(py, numbers).unbind()
}

/// Consecutive rows as a NumPy matrix, without a copy.
pub fn matrix(py: Python<'_>, numbers: Vec<f64>, columns: usize) -> PyResult<Py<PyArray2<f64>>> {
    let rows = numbers.len() / columns.max(1);
    Ok(PyArray1::from_vec(py, numbers).reshape([rows, columns])?.unbind())
}

/// The error of a column or an event, with its text.
pub fn named<T>(what: &str, text: &str, read: Result<T, RuntimeError>) -> PyResult<T> {
    read.map_err(|error| value_error(format!("{what} {text:?}: {}", of_runtime(error))))
}

/// The error of a formula; for an unknown name it says how a parameter gets a value.
pub fn of_formula(mut error: FormulaError) -> FormulaError {
    if let FormulaError::Parse(parse) = &mut error {
        let name = parse.message.strip_prefix("unknown name `").and_then(|rest| rest.strip_suffix('`'));
        if let (Some(name), None) = (name, &parse.nearest) {
            parse.message += &format!("; a parameter needs a value, as in parameters={{{name:?}: 1.0}}");
        }
    }
    error
}

/// The same for an error that may be that of a formula.
pub fn of_runtime(error: RuntimeError) -> RuntimeError {
    match error {
        RuntimeError::Formula(error) => RuntimeError::Formula(of_formula(error)),
        RuntimeError::Part { part, error } => RuntimeError::Part { part, error: Box::new(of_formula(*error)) },
        error => error,
    }
}
