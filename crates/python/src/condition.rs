//! Comparisons of traced values.

use crate::symbol::{Operand, Symbol, no_number, tracer};
use formula_lagrangian::Id;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::pyclass::CompareOp;

/// A condition, reduced to `<`, `not` and `and`.
#[derive(Clone)]
enum Kind {
    Less(Id, Id),
    Not(Box<Kind>),
    And(Box<Kind>, Box<Kind>),
}

/// A comparison of traced values, for `where`.
#[pyclass(frozen, module = "herglotz")]
#[derive(Clone)]
pub struct Condition {
    of: Symbol,
    kind: Kind,
}

fn not(kind: Kind) -> Kind {
    match kind {
        Kind::Not(kind) => *kind,
        kind => Kind::Not(Box::new(kind)),
    }
}

fn and(a: Kind, b: Kind) -> Kind {
    Kind::And(Box::new(a), Box::new(b))
}

impl Condition {
    /// The comparison of a value with another node of its graph.
    pub fn comparing(a: &Symbol, b: Id, compare: CompareOp) -> Condition {
        let (less, more) = (Kind::Less(a.id, b), Kind::Less(b, a.id));
        let equal = || and(not(Kind::Less(a.id, b)), not(Kind::Less(b, a.id)));
        let kind = match compare {
            CompareOp::Lt => less,
            CompareOp::Gt => more,
            CompareOp::Le => not(more),
            CompareOp::Ge => not(less),
            CompareOp::Eq => equal(),
            CompareOp::Ne => not(equal()),
        };
        Condition { of: a.clone(), kind }
    }

    fn with(&self, kind: Kind) -> Condition {
        Condition { of: self.of.clone(), kind }
    }
}

/// `then` where a condition holds, else `otherwise`.
fn choose(of: &Symbol, kind: &Kind, then: Id, otherwise: Id) -> PyResult<Id> {
    Ok(match kind {
        Kind::Less(a, b) => of.with(|graph| graph.select([*a, *b, then, otherwise]))?.id,
        Kind::Not(kind) => choose(of, kind, otherwise, then)?,
        Kind::And(a, b) => {
            let inner = choose(of, b, then, otherwise)?;
            choose(of, a, inner, otherwise)?
        }
    })
}

#[pymethods]
impl Condition {
    fn __bool__(&self) -> PyResult<bool> {
        Err(no_number())
    }
    fn __invert__(&self) -> Condition {
        self.with(not(self.kind.clone()))
    }
    fn __and__(&self, other: &Condition) -> Condition {
        self.with(and(self.kind.clone(), other.kind.clone()))
    }
    fn __or__(&self, other: &Condition) -> Condition {
        self.with(not(and(not(self.kind.clone()), not(other.kind.clone()))))
    }

    /// `then` where the condition holds, else `otherwise`.
    fn choose(&self, then: &Bound<'_, PyAny>, otherwise: &Bound<'_, PyAny>) -> PyResult<Symbol> {
        let node = |x: &Bound<'_, PyAny>| match self.of.operand(x)? {
            Operand::Node(id) => Ok(id),
            Operand::Other => Err(PyTypeError::new_err(format!(
                "np.where of a traced value does not accept {x:?}: give numbers or traced values"
            ))),
        };
        let id = choose(&self.of, &self.kind, node(then)?, node(otherwise)?)?;
        Ok(Symbol { shared: self.of.shared.clone(), id })
    }

    #[pyo3(signature = (ufunc, method, *inputs, **kwargs))]
    fn __array_ufunc__<'py>(
        slf: &Bound<'py, Self>,
        ufunc: &Bound<'py, PyAny>,
        method: &Bound<'py, PyAny>,
        inputs: &Bound<'py, pyo3::types::PyTuple>,
        kwargs: Option<&Bound<'py, pyo3::types::PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        tracer(slf.py(), "apply")?.call1((ufunc, method, inputs, kwargs))
    }

    fn __array_function__<'py>(
        slf: &Bound<'py, Self>,
        function: &Bound<'py, PyAny>,
        types: &Bound<'py, PyAny>,
        arguments: &Bound<'py, PyAny>,
        kwargs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let _ = types;
        tracer(slf.py(), "call")?.call1((function, arguments, kwargs))
    }

    fn __repr__(&self) -> &'static str {
        "<condition on a traced value>"
    }
}
