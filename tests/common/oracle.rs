//! An independent integrator: dop853 of another library, for Herglotz' equations and their variational equation.

use contact_examples::systems::System;
use contact_geom::nalgebra::DMatrix;
use contact_geom::{
    ChartVector, Derivatives, HerglotzField, Lagrangian, PhasePoint, Scalar, Smooth, SmoothFunction, VelocityPoint,
    hamiltonian::DarbouxField,
};
use differential_equations::prelude::{ExplicitRungeKutta, IVP, ODE};

/// The Herglotz field, its variational equation and the exponent `int L_z`, as one first-order system.
struct Variational<'a, L, const N: usize> {
    lagrangian: &'a L,
    /// Whether the derivative of the flow and the exponent are requested.
    derivative: bool,
}

impl<L: Lagrangian<N>, const N: usize> ODE<f64, Vec<f64>> for Variational<'_, L, N> {
    fn diff(&self, t: f64, y: &Vec<f64>, d: &mut Vec<f64>) {
        let m = 2 * N + 1;
        let x = ChartVector::<N>::from_fn(|i| y[i]);
        let field = HerglotzField { lagrangian: self.lagrangian, t };
        if !self.derivative {
            match field.at(&x) {
                Ok(f) => (0..m).for_each(|i| d[i] = f.component(i)),
                Err(_) => d.fill(f64::NAN),
            }
            return;
        }
        let Ok((f, jacobian)) = field.with_jacobian(&x) else {
            d.fill(f64::NAN);
            return;
        };
        (0..m).for_each(|i| d[i] = f.component(i));
        let change = jacobian * DMatrix::from_column_slice(m, m, &y[m..m + m * m]);
        d[m..m + m * m].copy_from_slice(change.as_slice());
        d[m + m * m] = self.lagrangian.gradient(t, &x.into()).z;
    }
}

/// The state of the motion after a time, with the derivative of the flow and the exponent `int L_z` if requested.
fn integrate<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t0: f64,
    start: &VelocityPoint<N>,
    duration: f64,
    derivative: bool,
) -> Vec<f64> {
    let m = 2 * N + 1;
    let mut y = ChartVector::from(*start).to_vector().as_slice().to_vec();
    if derivative {
        y.extend_from_slice(DMatrix::<f64>::identity(m, m).as_slice());
        y.push(0.0);
    }
    let ode = Variational::<_, N> { lagrangian, derivative };
    let method = ExplicitRungeKutta::dop853().rtol(3e-14).atol(1e-15).max_steps(1_000_000);
    let solution = IVP::ode(&ode, t0, t0 + duration, y).method(method).solve();
    let end = solution.ok().and_then(|s| s.y.last().cloned());
    assert!(end.is_some(), "the oracle did not reach the end");
    end.unwrap_or_default()
}

/// The state of the motion after a time.
pub fn motion<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t0: f64,
    start: &VelocityPoint<N>,
    duration: f64,
) -> VelocityPoint<N> {
    let y = integrate(lagrangian, t0, start, duration, false);
    ChartVector::from_fn(|i| y[i]).into()
}

/// The state of the motion after a time, the derivative of the flow, and `exp int L_z`.
pub fn motion_with_derivative<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t0: f64,
    start: &VelocityPoint<N>,
    duration: f64,
) -> (VelocityPoint<N>, DMatrix<f64>, f64) {
    let m = 2 * N + 1;
    let y = integrate(lagrangian, t0, start, duration, true);
    let derivative = DMatrix::from_column_slice(m, m, &y[m..m + m * m]);
    (ChartVector::from_fn(|i| y[i]).into(), derivative, y[m + m * m].exp())
}

/// The Hamiltonian of a system in closed form, as a function.
struct Known<'a, S>(&'a S);

impl<const N: usize, S: System<N>> SmoothFunction<N> for Known<'_, S> {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        self.0.hamiltonian(t, &(*x).into()).unwrap_or(T::from(f64::NAN))
    }
}

/// The contact Hamiltonian equations of a Hamiltonian in closed form.
struct HamiltonianOde<'a, S, const N: usize>(&'a S);

impl<const N: usize, S: System<N>> ODE<f64, Vec<f64>> for HamiltonianOde<'_, S, N> {
    fn diff(&self, t: f64, y: &Vec<f64>, d: &mut Vec<f64>) {
        let x = ChartVector::<N>::from_fn(|i| y[i]);
        match (DarbouxField { hamiltonian: &Known(self.0), t }).at(&x) {
            Ok(f) => (0..2 * N + 1).for_each(|i| d[i] = f.component(i)),
            Err(_) => d.fill(f64::NAN),
        }
    }
}

/// The state of the contact Hamiltonian flow after a time; none where H is not known in closed form.
pub fn hamiltonian_motion<const N: usize>(
    system: &impl System<N>,
    t0: f64,
    start: &PhasePoint<N>,
    duration: f64,
) -> Option<PhasePoint<N>> {
    system.hamiltonian(t0, start)?;
    let y = ChartVector::from(*start).to_vector().as_slice().to_vec();
    let ode = HamiltonianOde::<_, N>(system);
    let method = ExplicitRungeKutta::dop853().rtol(3e-14).atol(1e-15).max_steps(1_000_000);
    let solution = IVP::ode(&ode, t0, t0 + duration, y).method(method).solve();
    let end = solution.ok().and_then(|s| s.y.last().cloned());
    assert!(end.is_some(), "the oracle did not reach the end");
    Some(ChartVector::from_fn(|i| end.as_ref().map_or(f64::NAN, |y| y[i])).into())
}
