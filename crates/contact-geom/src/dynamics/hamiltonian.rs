//! Contact Hamiltonian vector fields, the Jacobi bracket and dissipated quantities.

use crate::forms::smooth::{apply, apply_transposed};
use crate::{
    ChartVector, ContactForm, GeometryError, Scalar, Smooth, SmoothFunction,
    numbers::{MaxAbsOrNan, TangentVector},
};

/// The contact Hamiltonian vector field `X_f` of a function f for any contact form, `flat(X_f) = df - (f + R(f)) eta`;
/// paper, section 2.1.
///
/// # Errors
/// Those of the form.
pub fn hamiltonian_vector_field<const N: usize>(
    form: &impl ContactForm<N>,
    f: &impl SmoothFunction<N>,
    t: f64,
    x: &ChartVector<N>,
) -> Result<ChartVector<N>, GeometryError> {
    let df = f.differential(t, x);
    let rate = df.dot(&form.reeb(x)?);
    form.sharp(x, &df.minus(form.eta(x)?.scale(f.value(t, x) + rate)))
}

/// `X_H` in Darboux coordinates, `q' = H_p`, `p' = -H_q - p H_z`, `z' = p H_p - H`, as a vector field that can be
/// differentiated.
#[derive(Clone, Copy, Debug)]
pub struct DarbouxField<'a, H> {
    /// The Hamiltonian.
    pub hamiltonian: &'a H,
    /// The time at which it is evaluated.
    pub t: f64,
}

impl<const N: usize, H: SmoothFunction<N>> Smooth<N> for DarbouxField<'_, H> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        let t = T::from(self.t);
        let (h, dh) = (self.hamiltonian.value(t, x), self.hamiltonian.differential(t, x));
        Ok(ChartVector { x: dh.y, y: -dh.x - x.y * dh.z, z: x.y.dot(&dh.y) - h })
    }
}

/// The derivative `X(f)` of a function along a vector.
pub fn derivative_along<const N: usize>(
    f: &impl SmoothFunction<N>,
    t: f64,
    x: &ChartVector<N>,
    vector: &ChartVector<N>,
) -> f64 {
    f.differential(t, x).dot(vector)
}

/// The Jacobi bracket `{f, g} = X_f(g) + g R(f)` at one point. It is skew, and `X_{f,g} = [X_f, X_g]`.
///
/// # Errors
/// Those of the form.
pub fn jacobi_bracket<const N: usize>(
    form: &impl ContactForm<N>,
    f: &impl SmoothFunction<N>,
    g: &impl SmoothFunction<N>,
    t: f64,
    x: &ChartVector<N>,
) -> Result<f64, GeometryError> {
    let x_f = hamiltonian_vector_field(form, f, t, x)?;
    let rate = derivative_along(f, t, x, &form.reeb(x)?);
    Ok(derivative_along(g, t, x, &x_f) + g.value(t, x) * rate)
}

/// The Jacobi bracket of two functions in Darboux coordinates, as a function that can be differentiated.
#[derive(Clone, Copy, Debug)]
pub struct DarbouxBracket<'a, F, G> {
    /// The first function.
    pub f: &'a F,
    /// The second function.
    pub g: &'a G,
}

impl<const N: usize, F: SmoothFunction<N>, G: SmoothFunction<N>> SmoothFunction<N> for DarbouxBracket<'_, F, G> {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        let (f, df, dg) = (self.f.value(t, x), self.f.differential(t, x), self.g.differential(t, x));
        let x_f = ChartVector { x: df.y, y: -df.x - x.y * df.z, z: x.y.dot(&df.y) - f };
        dg.dot(&x_f) + self.g.value(t, x) * df.z
    }
}

/// The defect `|L_{X_H} f + R(H) f|` of dissipation, relative to the sizes of its terms. It vanishes everywhere if and
/// only if `f` is dissipated at the rate of H, `f o phi_t = sigma_t f`; paper, section 2.2.2.
///
/// # Errors
/// Those of the form.
pub fn dissipation_defect<const N: usize>(
    form: &impl ContactForm<N>,
    hamiltonian: &impl SmoothFunction<N>,
    f: &impl SmoothFunction<N>,
    t: f64,
    x: &ChartVector<N>,
) -> Result<f64, GeometryError> {
    let field = hamiltonian_vector_field(form, hamiltonian, t, x)?;
    let rate = derivative_along(hamiltonian, t, x, &form.reeb(x)?);
    let df = f.differential(t, x);
    let (change, loss) = (df.dot(&field), rate * f.value(t, x));
    let size = df.each(f64::abs).dot(&field.each(f64::abs)) + loss.abs();
    Ok(if size == 0.0 { 0.0 } else { (change + loss).abs() / size })
}

/// The Lie bracket `[X, Y] = DY X - DX Y` of two vector fields at a point.
///
/// # Errors
/// Those of the fields.
pub fn lie_bracket<const N: usize>(
    x_field: &impl Smooth<N>,
    y_field: &impl Smooth<N>,
    at: &ChartVector<N>,
) -> Result<ChartVector<N>, GeometryError> {
    let ((x, dx), (y, dy)) = (x_field.with_jacobian(at)?, y_field.with_jacobian(at)?);
    Ok(apply(&dy, &x).minus(apply(&dx, &y)))
}

/// The Lie derivative `L_X eta = i_X d eta + d(eta(X))` of a one-form along a vector field, by Cartan's formula.
///
/// # Errors
/// Those of the form and of the field.
pub fn lie_derivative<const N: usize>(
    form: &impl Smooth<N>,
    field: &impl Smooth<N>,
    at: &ChartVector<N>,
) -> Result<ChartVector<N>, GeometryError> {
    let ((eta, d_form), (x, d_field)) = (form.with_jacobian(at)?, field.with_jacobian(at)?);
    let contraction = apply_transposed(&(d_form.transpose() - &d_form), &x);
    let exact = apply_transposed(&d_form, &x).plus(apply_transposed(&d_field, &eta));
    Ok(contraction.plus(exact))
}

/// Whether a vector field is an infinitesimal conformal contactomorphism at a point: `L_X eta = a eta`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InfinitesimalConformality {
    /// The rate `a`; 0 for an infinitesimal contactomorphism. For `X = X_f` it is `-R(f)`.
    pub rate: f64,
    /// The largest component of `L_X eta - a eta`, relative to one plus that of `L_X eta`.
    pub defect: f64,
}

/// Measures how far a vector field is from being an infinitesimal conformal contactomorphism.
///
/// # Errors
/// Those of the form and of the field.
pub fn infinitesimal_conformality<const N: usize, F: Smooth<N> + ContactForm<N>>(
    form: &F,
    field: &impl Smooth<N>,
    at: &ChartVector<N>,
) -> Result<InfinitesimalConformality, GeometryError> {
    let change = lie_derivative(form, field, at)?;
    let rate = change.dot(&form.reeb(at)?);
    let defect = change.minus(form.eta(at)?.scale(rate)).max_abs_or_nan() / (1.0 + change.max_abs_or_nan());
    Ok(InfinitesimalConformality { rate, defect })
}

/// The conformal factor along a flow, `sigma_t(x) = exp(int_0^t a(F_s(x)) ds)` with `a = -R(H)`, in the corrected form
/// of the paper's section 2.1.
///
/// The integral is evaluated by the given quadrature, a list of times in `[0, t]` with weights; `path` is the integral
/// curve of `X_H` through x.
///
/// # Errors
/// Those of the form.
pub fn conformal_factor_along<const N: usize>(
    form: &impl ContactForm<N>,
    hamiltonian: &impl SmoothFunction<N>,
    path: impl Fn(f64) -> ChartVector<N>,
    quadrature: &[(f64, f64)],
) -> Result<f64, GeometryError> {
    let mut exponent = 0.0;
    for &(s, weight) in quadrature {
        let x = path(s);
        exponent -= weight * derivative_along(hamiltonian, s, &x, &form.reeb(&x)?);
    }
    Ok(exponent.exp())
}

/// The quotient of two functions: conserved along the flow where both are dissipated and the second does not vanish.
#[derive(Clone, Copy, Debug)]
pub struct Quotient<'a, F, G> {
    /// The numerator.
    pub f: &'a F,
    /// The denominator.
    pub g: &'a G,
}

impl<const N: usize, F: SmoothFunction<N>, G: SmoothFunction<N>> SmoothFunction<N> for Quotient<'_, F, G> {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        self.f.value(t, x) / self.g.value(t, x)
    }
}
