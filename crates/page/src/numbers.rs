//! Numbers in JSON.

use serde_json::Value;

/// A number, or its name where it is not finite.
pub fn number(x: f64) -> Value {
    match serde_json::Number::from_f64(x) {
        Some(number) => Value::Number(number),
        None => Value::String(x.to_string()),
    }
}

/// Named numbers.
pub fn named<S: Into<String>>(all: impl IntoIterator<Item = (S, f64)>) -> Value {
    Value::Object(all.into_iter().map(|(name, x)| (name.into(), number(x))).collect())
}
