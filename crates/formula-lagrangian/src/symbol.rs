//! Formulas that are built by a program with the operators of numbers.

use crate::names::Names;
use crate::{Formula, FormulaError, FormulaNames, Function, Graph, Id, Operation};
use contact_geom::table::Table;
use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::rc::Rc;

/// A graph under construction.
#[derive(Debug, Default)]
struct Shared {
    graph: Graph,
    /// Whether an operation combined symbols of different graphs.
    mixed: bool,
}

/// The coordinates, velocities and parameters of a formula that is built by a program.
///
/// ```
/// use formula_lagrangian::Symbols;
/// // A chain of five masses between springs.
/// let symbols = Symbols::new(&["q[5]"], &[("k", 2.0), ("gamma", -0.1)])?;
/// let (k, gamma) = (symbols.parameter("k")?, symbols.parameter("gamma")?);
/// let mut l = gamma * symbols.action();
/// for i in 0..5 {
///     let v = symbols.velocity(i);
///     l = l + 0.5 * (&v * &v);
/// }
/// for i in 1..5 {
///     l = l - &k * (1.0 - (symbols.position(i) - symbols.position(i - 1)).cos());
/// }
/// assert!(symbols.formula(&l)?.lagrangian::<5>()?.proved().separable);
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
#[derive(Debug)]
pub struct Symbols {
    shared: Rc<RefCell<Shared>>,
    names: Names,
    values: Vec<f64>,
}

impl Symbols {
    /// The symbols of a formula over coordinates and parameters, given as for [`Formula::parse`].
    ///
    /// # Errors
    /// [`FormulaError::Name`], [`FormulaError::Dimension`], [`FormulaError::ParameterValue`].
    pub fn new(coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<Self, FormulaError> {
        Self::of_names(&FormulaNames::new(coordinates, parameters), false)
    }

    /// The symbols of a formula over all kinds of names. Tables are not used: see [`Symbol::interpolate`].
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn of_lagrangian(names: &FormulaNames<'_>) -> Result<Self, FormulaError> {
        Self::of_names(names, false)
    }

    /// The symbols of a contact Hamiltonian: the [velocity](Self::velocity) is the momentum.
    ///
    /// ```
    /// use formula_lagrangian::{FormulaNames, Symbols};
    /// let symbols = Symbols::of_hamiltonian(&FormulaNames::new(&["x"], &[]))?;
    /// let (x, p) = (symbols.position(0), symbols.momentum(0));
    /// assert!(symbols.formula(&(&p * &x))?.is_hamiltonian());
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`new`](Self::new), and [`FormulaError::Momenta`].
    pub fn of_hamiltonian(names: &FormulaNames<'_>) -> Result<Self, FormulaError> {
        Self::of_names(names, true)
    }

    fn of_names(given: &FormulaNames<'_>, hamiltonian: bool) -> Result<Self, FormulaError> {
        let values = given.parameters.iter().map(|(_, value)| *value).collect();
        Ok(Symbols { shared: Rc::default(), names: Names::of(given, hamiltonian)?, values })
    }

    fn symbol(&self, node: impl FnOnce(&mut Graph) -> Id) -> Symbol {
        let id = node(&mut self.shared.borrow_mut().graph);
        Symbol { shared: self.shared.clone(), id }
    }

    /// The coordinate with this index. An index out of range is an error of [`formula`](Self::formula).
    pub fn position(&self, index: u32) -> Symbol {
        self.symbol(|graph| graph.position(index))
    }

    /// The velocity of a coordinate.
    pub fn velocity(&self, index: u32) -> Symbol {
        self.symbol(|graph| graph.velocity(index))
    }

    /// The momentum of a coordinate, for [a Hamiltonian](Self::of_hamiltonian).
    pub fn momentum(&self, index: u32) -> Symbol {
        self.velocity(index)
    }

    /// The action z.
    pub fn action(&self) -> Symbol {
        self.symbol(Graph::action)
    }

    /// The time t.
    pub fn time(&self) -> Symbol {
        self.symbol(Graph::time)
    }

    /// A number.
    pub fn number(&self, x: f64) -> Symbol {
        self.symbol(|graph| graph.number(x))
    }

    /// A parameter by its name.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`].
    pub fn parameter(&self, name: &str) -> Result<Symbol, FormulaError> {
        let index = crate::formula::index(&self.names, name, 0.0)?;
        Ok(self.symbol(|graph| graph.parameter(index as u32)))
    }

    /// The formula whose Lagrangian, or Hamiltonian, is the given symbol.
    ///
    /// # Errors
    /// [`FormulaError::Mixed`] if the symbol, or an operand of it, belongs to other [`Symbols`];
    /// [`FormulaError::TooLarge`]; [`FormulaError::Unknown`] if the index of a coordinate is out of range.
    pub fn formula(&self, lagrangian: &Symbol) -> Result<Formula, FormulaError> {
        let shared = self.shared.borrow();
        if shared.mixed || !Rc::ptr_eq(&self.shared, &lagrangian.shared) {
            return Err(FormulaError::Mixed);
        }
        Formula::named(shared.graph.clone(), lagrangian.id, self.names.clone(), self.values.clone())
    }

    /// The same with forces, in the order of the coordinates. Those that are left out are 0.
    ///
    /// # Errors
    /// Those of [`formula`](Self::formula), and [`FormulaError::Unknown`] if there are more forces than coordinates.
    pub fn formula_with_forces(
        &self,
        lagrangian: &Symbol,
        forces: &[Option<&Symbol>],
    ) -> Result<Formula, FormulaError> {
        if forces.iter().flatten().any(|force| !Rc::ptr_eq(&self.shared, &force.shared)) {
            return Err(FormulaError::Mixed);
        }
        let forces: Vec<Option<Id>> = forces.iter().map(|force| force.map(|force| force.id)).collect();
        self.formula(lagrangian)?.with_force_nodes(&forces)
    }
}

/// An expression of [`Symbols`], with the operators and functions of numbers. Cloning is inexpensive.
#[derive(Clone, Debug)]
pub struct Symbol {
    shared: Rc<RefCell<Shared>>,
    id: Id,
}

/// An operand of an operation with a symbol: another symbol, or a number.
pub trait Operand {
    /// The node of the operand in the graph of the symbol `beside`.
    #[doc(hidden)]
    fn node(&self, beside: &Symbol) -> Id;
}

impl Operand for Symbol {
    fn node(&self, beside: &Symbol) -> Id {
        if !Rc::ptr_eq(&self.shared, &beside.shared) {
            // Reported when the formula is made, since operators cannot return errors.
            self.shared.borrow_mut().mixed = true;
            beside.shared.borrow_mut().mixed = true;
            return beside.id;
        }
        self.id
    }
}

impl Operand for &Symbol {
    fn node(&self, beside: &Symbol) -> Id {
        (**self).node(beside)
    }
}

impl Operand for f64 {
    fn node(&self, beside: &Symbol) -> Id {
        beside.shared.borrow_mut().graph.number(*self)
    }
}

impl Symbol {
    fn with(&self, node: impl FnOnce(&mut Graph) -> Id) -> Symbol {
        let id = node(&mut self.shared.borrow_mut().graph);
        Symbol { shared: self.shared.clone(), id }
    }

    fn operate(&self, operation: Operation, other: &impl Operand) -> Symbol {
        let other = other.node(self);
        self.with(|graph| graph.binary(operation, self.id, other))
    }

    fn operate_from(&self, operation: Operation, first: f64) -> Symbol {
        self.with(|graph| {
            let first = graph.number(first);
            graph.binary(operation, first, self.id)
        })
    }

    /// Applies a function.
    pub fn apply(&self, function: Function) -> Symbol {
        self.with(|graph| graph.unary(function, self.id))
    }

    /// An integer power.
    pub fn powi(&self, n: i32) -> Symbol {
        self.with(|graph| graph.powi(self.id, n))
    }

    /// A power; `e^(b ln a)` if the exponent b depends on the state.
    pub fn pow(&self, exponent: impl Operand) -> Symbol {
        self.operate(Operation::Power, &exponent)
    }

    /// The smaller of two values.
    pub fn min(&self, other: impl Operand) -> Symbol {
        self.operate(Operation::Min, &other)
    }

    /// The larger of two values.
    pub fn max(&self, other: impl Operand) -> Symbol {
        self.operate(Operation::Max, &other)
    }

    /// The angle of the point `(x, self)`.
    pub fn atan2(&self, x: impl Operand) -> Symbol {
        self.operate(Operation::Atan2, &x)
    }

    /// `sqrt(self^2 + other^2)` without overflow.
    pub fn hypot(&self, other: impl Operand) -> Symbol {
        self.operate(Operation::Hypot, &other)
    }

    /// Its node in the graph of the formulas that are made of its [`Symbols`] later, such as for
    /// [`Formula::with_reset_nodes`].
    pub fn id(&self) -> Id {
        self.id
    }

    /// The value of a table at it; see [`Graph::interpolate`].
    pub fn interpolate(&self, table: &Table) -> Symbol {
        self.with(|graph| graph.interpolate(table, self.id))
    }

    /// `then` if the symbol is less than `than`, else `otherwise`.
    pub fn if_less(&self, than: impl Operand, then: impl Operand, otherwise: impl Operand) -> Symbol {
        let [than, then, otherwise] = [than.node(self), then.node(self), otherwise.node(self)];
        self.with(|graph| graph.select([self.id, than, then, otherwise]))
    }
}

/// The functions of one number as methods.
macro_rules! functions {
    ($($name:ident $function:ident)*) => {
        impl Symbol {
            $(
                #[doc = concat!("[`Function::", stringify!($function), "`] of it.")]
                pub fn $name(&self) -> Symbol {
                    self.apply(Function::$function)
                }
            )*
        }
    };
}
functions! {
    recip Recip sqrt Sqrt abs Abs signum Sign sin Sin cos Cos tan Tan versine Versine atan Atan sinh Sinh cosh Cosh tanh Tanh
    asinh Asinh acosh Acosh atanh Atanh exp Exp exp_m1 ExpM1 ln Ln ln_1p Ln1p
}

/// The operators between symbols and numbers, by value or by reference.
macro_rules! operators {
    ($($trait:ident $method:ident;)*) => {
        $(
            impl<O: Operand> $trait<O> for Symbol {
                type Output = Symbol;
                fn $method(self, other: O) -> Symbol {
                    self.operate(Operation::$trait, &other)
                }
            }
            impl<O: Operand> $trait<O> for &Symbol {
                type Output = Symbol;
                fn $method(self, other: O) -> Symbol {
                    self.operate(Operation::$trait, &other)
                }
            }
            impl $trait<Symbol> for f64 {
                type Output = Symbol;
                fn $method(self, other: Symbol) -> Symbol {
                    other.operate_from(Operation::$trait, self)
                }
            }
            impl $trait<&Symbol> for f64 {
                type Output = Symbol;
                fn $method(self, other: &Symbol) -> Symbol {
                    other.operate_from(Operation::$trait, self)
                }
            }
        )*
    };
}
operators! { Add add; Sub sub; Mul mul; Div div; }

impl Neg for Symbol {
    type Output = Symbol;
    fn neg(self) -> Symbol {
        self.apply(Function::Neg)
    }
}

impl Neg for &Symbol {
    type Output = Symbol;
    fn neg(self) -> Symbol {
        self.apply(Function::Neg)
    }
}
