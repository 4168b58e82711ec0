//! Operators and functions of the values of a traced function.

use crate::condition::Condition;
use crate::symbol::{Operand, Shared, Symbol, no_number, tracer};
use crate::table::{Table, name_of};
use crate::text;
use formula_lagrangian::{Function, Graph, Id, Operation};
use pyo3::exceptions::{PyAttributeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::pyclass::CompareOp;
use pyo3::types::{PyDict, PyTuple};

impl Symbol {
    fn unary(&self, function: Function) -> PyResult<Symbol> {
        self.with(|graph| graph.unary(function, self.id))
    }

    fn binary<'py>(&self, op: Operation, other: &Bound<'py, PyAny>, reversed: bool) -> PyResult<Bound<'py, PyAny>> {
        let py = other.py();
        match self.operand(other)? {
            Operand::Other => Ok(py.NotImplemented().into_bound(py)),
            Operand::Node(other) => {
                let (a, b) = if reversed { (other, self.id) } else { (self.id, other) };
                Ok(Bound::new(py, self.with(|graph| graph.binary(op, a, b))?)?.into_any())
            }
        }
    }

    /// A function of the value, multiplied by a number.
    fn scaled(&self, function: Function, by: f64) -> PyResult<Symbol> {
        self.with(|graph| {
            let (value, by) = (graph.unary(function, self.id), graph.number(by));
            graph.binary(Operation::Mul, value, by)
        })
    }

    /// A function of one number by its NumPy name; `None` where it is not known.
    fn named(&self, name: &str) -> Option<PyResult<Symbol>> {
        use std::f64::consts::{LOG2_E, LOG10_E};
        let function = match name {
            "negative" => Function::Neg,
            "reciprocal" => Function::Recip,
            "sqrt" => Function::Sqrt,
            "absolute" | "fabs" => Function::Abs,
            "sign" => Function::Sign,
            "sin" => Function::Sin,
            "cos" => Function::Cos,
            "tan" => Function::Tan,
            "versine" => Function::Versine,
            "arctan" => Function::Atan,
            "sinh" => Function::Sinh,
            "cosh" => Function::Cosh,
            "tanh" => Function::Tanh,
            "arcsinh" => Function::Asinh,
            "arccosh" => Function::Acosh,
            "arctanh" => Function::Atanh,
            "exp" => Function::Exp,
            "expm1" => Function::ExpM1,
            "log" => Function::Ln,
            "log1p" => Function::Ln1p,
            "log2" => return Some(self.scaled(Function::Ln, LOG2_E)),
            "log10" => return Some(self.scaled(Function::Ln, LOG10_E)),
            "positive" | "conjugate" => return Some(Ok(self.clone())),
            "square" => return Some(self.with(|graph| graph.powi(self.id, 2))),
            "arcsin" => return Some(self.inverse(true)),
            "arccos" => return Some(self.inverse(false)),
            _ => return None,
        };
        Some(self.unary(function))
    }

    /// The inverse of the sine or the cosine: the angle of the point `(sqrt((1 - x)(1 + x)), x)`, or of the point with
    /// these coordinates exchanged.
    fn inverse(&self, sine: bool) -> PyResult<Symbol> {
        self.with(|graph| {
            let (x, one) = (self.id, graph.number(1.0));
            let (below, above) = (graph.binary(Operation::Sub, one, x), graph.binary(Operation::Add, x, one));
            let square = graph.binary(Operation::Mul, below, above);
            let root = graph.unary(Function::Sqrt, square);
            let (y, x) = if sine { (x, root) } else { (root, x) };
            graph.binary(Operation::Atan2, y, x)
        })
    }
}

#[pymethods]
impl Symbol {
    fn __add__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Add, other, false)
    }
    fn __radd__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Add, other, true)
    }
    fn __sub__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Sub, other, false)
    }
    fn __rsub__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Sub, other, true)
    }
    fn __mul__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Mul, other, false)
    }
    fn __rmul__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Mul, other, true)
    }
    fn __truediv__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Div, other, false)
    }
    fn __rtruediv__<'py>(&self, other: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Div, other, true)
    }
    fn __pow__<'py>(
        &self,
        other: &Bound<'py, PyAny>,
        _modulo: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Power, other, false)
    }
    fn __rpow__<'py>(
        &self,
        other: &Bound<'py, PyAny>,
        _modulo: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.binary(Operation::Power, other, true)
    }
    fn __neg__(&self) -> PyResult<Symbol> {
        self.unary(Function::Neg)
    }
    fn __pos__(&self) -> Symbol {
        self.clone()
    }
    fn __abs__(&self) -> PyResult<Symbol> {
        self.unary(Function::Abs)
    }
    fn __bool__(&self) -> PyResult<bool> {
        Err(no_number())
    }
    fn __float__(&self) -> PyResult<f64> {
        Err(no_number())
    }
    fn __int__(&self) -> PyResult<i64> {
        Err(no_number())
    }
    fn __index__(&self) -> PyResult<i64> {
        Err(no_number())
    }
    fn __hash__(&self) -> isize {
        self.shared.address() as isize
    }

    fn __richcmp__<'py>(&self, other: &Bound<'py, PyAny>, compare: CompareOp) -> PyResult<Bound<'py, PyAny>> {
        let py = other.py();
        let Operand::Node(other) = self.operand(other)? else { return Ok(py.NotImplemented().into_bound(py)) };
        let condition = Condition::comparing(self, other, compare);
        Ok(Bound::new(py, condition)?.into_any())
    }

    /// Applies a NumPy ufunc.
    #[pyo3(signature = (ufunc, method, *inputs, **kwargs))]
    fn __array_ufunc__<'py>(
        &self,
        ufunc: &Bound<'py, PyAny>,
        method: &Bound<'py, PyAny>,
        inputs: &Bound<'py, PyTuple>,
        kwargs: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = ufunc.py();
        if inputs.len() == 1 && kwargs.is_none() {
            let name = ufunc.getattr(pyo3::intern!(py, "__name__"))?;
            if let Some(value) = self.named(name.extract()?) {
                return Ok(Bound::new(py, value?)?.into_any());
            }
        }
        tracer(py, "apply")?.call1((ufunc, method, inputs, kwargs))
    }

    /// Applies a NumPy function that is not a ufunc.
    fn __array_function__<'py>(
        &self,
        function: &Bound<'py, PyAny>,
        types: &Bound<'py, PyAny>,
        arguments: &Bound<'py, PyAny>,
        kwargs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let _ = types;
        tracer(function.py(), "call")?.call1((function, arguments, kwargs))
    }

    /// The value as an expression in the names of coordinates, velocities and parameters.
    #[pyo3(signature = (coordinates, velocities, parameters, action = "z".to_owned()))]
    fn text(
        &self,
        coordinates: Vec<String>,
        velocities: Vec<String>,
        parameters: Vec<String>,
        action: String,
    ) -> PyResult<String> {
        let graph = self.shared.graph();
        let tables = graph.tables().iter().map(name_of).collect();
        let names = text::Names { coordinates, velocities, parameters, tables, action };
        Ok(text::text(&graph, self.id, &names))
    }

    /// The tables in the traced function, which its text refers to by their names.
    fn tables(&self) -> Vec<Table> {
        self.shared.graph().tables().iter().cloned().map(Table::from).collect()
    }

    /// For object arrays other than those of the tracer, NumPy calls a function as a method of the elements.
    fn __getattr__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let is_two = matches!(name, "arctan2" | "hypot");
        if !is_two && (name.starts_with('_') || slf.get().named(name).is_none()) {
            return Err(PyAttributeError::new_err(format!("a traced value has no attribute {name:?}")));
        }
        let apply = slf.getattr(if is_two { "apply_two" } else { "apply" })?;
        slf.py().import("functools")?.call_method1("partial", (apply, name))
    }

    fn __repr__(&self) -> &'static str {
        "<traced value>"
    }

    /// A function of one number by its NumPy name.
    #[pyo3(name = "apply")]
    fn apply_named(&self, name: &str) -> PyResult<Symbol> {
        self.named(name).unwrap_or_else(|| {
            Err(PyTypeError::new_err(format!("np.{name} is not supported for traced values: write it out")))
        })
    }

    /// A function of two numbers by its NumPy name.
    #[pyo3(signature = (name, other, reversed = false))]
    fn apply_two<'py>(&self, name: &str, other: &Bound<'py, PyAny>, reversed: bool) -> PyResult<Bound<'py, PyAny>> {
        let operation = match name {
            "minimum" => Operation::Min,
            "maximum" => Operation::Max,
            "arctan2" => Operation::Atan2,
            "hypot" => Operation::Hypot,
            _ => {
                return Err(PyTypeError::new_err(format!(
                    "np.{name} is not supported for traced values: write it out"
                )));
            }
        };
        self.binary(operation, other, reversed)
    }
}

/// The symbols of a trace: t, the coordinates, the velocities, z and the parameters.
#[pyfunction]
pub fn symbols(n: u32, parameters: u32) -> (Symbol, Vec<Symbol>, Vec<Symbol>, Symbol, Vec<Symbol>) {
    let shared = Shared::default();
    let symbol = |node: &mut dyn FnMut(&mut Graph) -> Id| {
        let id = node(&mut shared.graph());
        Symbol { shared: shared.clone(), id }
    };
    let many = |count: u32, node: fn(&mut Graph, u32) -> Id| {
        (0..count).map(|i| symbol(&mut |graph| node(graph, i))).collect::<Vec<_>>()
    };
    (
        symbol(&mut |graph| graph.time()),
        many(n, |graph, i| graph.position(i)),
        many(n, |graph, i| graph.velocity(i)),
        symbol(&mut |graph| graph.action()),
        many(parameters, |graph, i| graph.parameter(i)),
    )
}
