//! The contact form of a Lagrangian on TQ x R.

use crate::forms::fibre_form::{FibreForm, contact_form_by_fibre};
use crate::{ChartVector, ContactForm, Derivatives, GeometryError, Lagrangian, Scalar, Smooth};
use nalgebra::{DMatrix, SVector};

/// `eta_L = dz - theta_L` with `theta_L = L_v dq`, at a fixed time; contact exactly where L is regular. Its Reeb field
/// is `R_L = d/dz - W^-1 L_vz d/dv`; paper, section 2.2.
#[derive(Clone, Copy, Debug)]
pub struct LagrangianForm<'a, L> {
    /// The Lagrangian.
    pub lagrangian: &'a L,
    /// The time at which it is evaluated.
    pub t: f64,
}

impl<const N: usize, L: Lagrangian<N>> Smooth<N> for LagrangianForm<'_, L> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        let momentum = self.lagrangian.gradient(T::from(self.t), &(*x).into()).y;
        Ok(ChartVector { x: -momentum, y: SVector::from_fn(|_, _| T::zero()), z: T::one() })
    }
}

impl<L> LagrangianForm<'_, L> {
    fn fibre_form<const N: usize>(&self, x: &ChartVector<N>) -> Result<FibreForm<N>, GeometryError>
    where
        L: Lagrangian<N>,
    {
        let x = (*x).into();
        let h = self.lagrangian.hessian(self.t, &x);
        let p = self.lagrangian.gradient(self.t, &x).y;
        Ok(FibreForm { p, p_x: h.qv.transpose(), p_y: h.vv, p_z: h.vz, what: "W = L_vv" })
    }
}

impl<const N: usize, L: Lagrangian<N>> ContactForm<N> for LagrangianForm<'_, L> {
    contact_form_by_fibre!();
}
