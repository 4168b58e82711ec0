//! Formulas with their derivatives, for any number of coordinates.

use crate::derived::Derived;
use crate::evaluation::At;
use crate::{Formula, FormulaError};
use contact_geom::Structure;
use contact_geom::nalgebra::DMatrix;

/// A Lagrangian formula with its derivatives in closed form and its proved structure, evaluated at points that are given
/// by slices. [`FormulaLagrangian`](crate::FormulaLagrangian) is the same with a number of coordinates that is known at
/// compile time.
///
/// ```
/// use formula_lagrangian::Formula;
/// let chain = Formula::parse("sum(i, 0, n-1, v[i]^2 - q[i]^2)/2 - z/10", &["x[20]"], &[])?;
/// let (chain, mut gradient) = (chain.derivatives()?, vec![0.0; 41]);
/// let value = chain.with_gradient(0.0, &[1.0; 20], &[3.0; 20], 0.5, &mut gradient);
/// assert_eq!((value, gradient[0], gradient[20], gradient[40]), (79.95, -1.0, 3.0, -0.1));
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FormulaDerivatives {
    derived: Derived,
}

impl Formula {
    /// The formula with its derivatives, for any number of coordinates.
    ///
    /// # Errors
    /// [`FormulaError::TooLarge`], [`FormulaError::IsHamiltonian`].
    pub fn derivatives(&self) -> Result<FormulaDerivatives, FormulaError> {
        self.check_is_lagrangian("Lagrangian of its own", "use `Formula::hamiltonian`")?;
        Ok(FormulaDerivatives { derived: Derived::new(self, self.dimension())? })
    }
}

impl FormulaDerivatives {
    /// The formula, with the present values of its parameters.
    pub fn formula(&self) -> &Formula {
        &self.derived.formula
    }

    /// Sets the value of a parameter, without parsing or differentiating again.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`], [`FormulaError::ParameterValue`].
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        self.derived.set(parameter, value)
    }

    /// The proved structure.
    pub fn proved(&self) -> &Structure {
        &self.derived.structure
    }

    /// Whether L has neither kinks nor jumps.
    pub fn is_smooth(&self) -> bool {
        self.derived.smooth
    }

    /// `L_z` if it is proved to be constant.
    pub fn constant_rate(&self) -> Option<f64> {
        self.derived.constant_rate()
    }

    /// The value of L.
    pub fn value(&self, t: f64, q: &[f64], v: &[f64], z: f64) -> f64 {
        let mut value = 0.0;
        self.derived.value.evaluate::<f64, 0>(At { t, q, v, z }, &mut [std::slice::from_mut(&mut value)]);
        value
    }

    /// The value of L, and its gradient `(L_q, L_v, L_z)`, which has 2n + 1 entries.
    pub fn with_gradient(&self, t: f64, q: &[f64], v: &[f64], z: f64, gradient: &mut [f64]) -> f64 {
        let mut value = 0.0;
        let results = &mut [gradient, std::slice::from_mut(&mut value)];
        self.derived.with_gradient.evaluate::<f64, 0>(At { t, q, v, z }, results);
        value
    }

    /// Writes the second partial derivatives `L_qq`, `L_qv`, `L_vv`, `L_qz`, `L_vz`, `L_zz`, in this order: matrices of
    /// n × n entries by columns (in `L_qv` the rows belong to q), vectors of n entries, and one number.
    pub fn second_partials(&self, t: f64, q: &[f64], v: &[f64], z: f64, mut to: [&mut [f64]; 6]) {
        self.derived.second.evaluate::<f64, 0>(At { t, q, v, z }, &mut to);
    }

    /// `W = L_vv`.
    pub fn mass_matrix(&self, t: f64, q: &[f64], v: &[f64], z: f64) -> DMatrix<f64> {
        let n = self.derived.formula.dimension();
        let mut w = DMatrix::zeros(n, n);
        self.derived.mass.evaluate::<f64, 0>(At { t, q, v, z }, &mut [w.as_mut_slice()]);
        w
    }
}
