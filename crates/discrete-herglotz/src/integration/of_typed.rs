//! A system whose number of coordinates is known at compile time, seen without it.

use crate::integration::{at_state, force_defect};
use crate::theory::legendre_inverse;
use crate::{
    AtState, AtSwitch, Components, ForceDerivatives, ForceKind, Point, SecondDerivatives, State, StepError, System,
    TypedSystem, Vector,
};
use contact_geom::nalgebra::DMatrix;
use contact_geom::switching::Control;
use contact_geom::{Defect, Defects, ForceStructure, GeometryError, Hints, Structure};

/// A system whose number of coordinates is known at compile time, seen without it. It is compiled for each number of
/// coordinates, not for each Lagrangian.
#[derive(Clone, Copy)]
pub(crate) struct OfTyped<'a, const N: usize>(pub &'a (dyn TypedSystem<N> + 'a));

fn at_switch<const N: usize>(control: Control<N>) -> AtSwitch {
    match control {
        Control::Replace(to) => AtSwitch::Replace { to: to.into(), factor: None },
        Control::Conformal { to, factor } => AtSwitch::Replace { to: to.into(), factor: Some(factor) },
        _ => AtSwitch::Continue,
    }
}

impl<const N: usize> System for OfTyped<'_, N> {
    fn dimension(&self) -> usize {
        N
    }
    fn hints(&self) -> Hints {
        self.0.hints()
    }
    fn structure(&self) -> Structure {
        self.0.structure()
    }
    fn force_kind(&self) -> ForceKind {
        match self.0.force_structure() {
            ForceStructure::None => ForceKind::None,
            drag if drag.is_of_positions() => ForceKind::OfPositions,
            ForceStructure::Drag { linear, quadratic } => ForceKind::Drag { linear: linear.into(), quadratic },
            _ => ForceKind::General,
        }
    }
    fn has_force(&self) -> bool {
        self.0.has_force()
    }
    fn value(&self, t: f64, x: &Point) -> f64 {
        self.0.value(t, &x.fixed())
    }
    fn gradient(&self, t: f64, x: &Point) -> Components {
        self.0.gradient(t, &x.fixed()).into()
    }
    fn applied_force(&self, t: f64, x: &Point) -> Vector {
        self.0.applied_force(t, &x.fixed()).into()
    }
    fn force_derivatives(&self, t: f64, x: &Point) -> Option<ForceDerivatives> {
        self.0.force_derivatives(t, &x.fixed())
    }
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives {
        (&self.0.hessian(t, &x.fixed())).into()
    }
    fn mass_matrix(&self, t: f64, x: &Point) -> DMatrix<f64> {
        DMatrix::from_column_slice(N, N, self.0.mass_matrix(t, &x.fixed()).as_slice())
    }
    fn rates(&self, t: f64, x: &Point) -> Result<(Components, f64), GeometryError> {
        self.0.rates(t, &x.fixed()).map(|(field, rate)| (field.into(), rate))
    }
    fn legendre_inverse(&self, t: f64, state: &State, guess: &[f64]) -> Result<Point, StepError> {
        legendre_inverse(self.0, t, &state.fixed(), &Vector::from(guess).fixed()).map(Point::from)
    }
    fn at_state(&self, t: f64, state: &State, guess: &[f64]) -> Result<AtState, StepError> {
        let at = at_state(self.0, t, &state.fixed(), &Vector::from(guess).fixed())?;
        Ok(AtState { x: at.x.into(), l: at.l, force: at.force.into(), rate: at.rate })
    }
    fn rounding(&self, t: f64, x: &Point) -> (f64, Components) {
        let (value, gradient) = self.0.rounding(t, &x.fixed());
        (value, gradient.into())
    }
    fn rounding_at_state(&self, t: f64, x: &Point, state: &State) -> (f64, Components) {
        let (value, gradient) = self.0.rounding_at_state(t, &x.fixed(), &state.fixed());
        (value, gradient.into())
    }
    fn claim_defects(&self, t: f64, x: &Point) -> Option<Defects> {
        self.0.claim_defects(t, &x.fixed())
    }
    fn force_defect(&self, t: f64, x: &Point) -> Option<Defect> {
        force_defect(self.0, t, &x.fixed())
    }
    fn hamiltonian_with_gradient(&self, t: f64, x: &State) -> Option<(f64, Components)> {
        self.0.hamiltonian_with_gradient(t, &x.fixed()).map(|(value, gradient)| (value, gradient.into()))
    }
    fn hamiltonian_hessian(&self, t: f64, x: &State) -> Option<SecondDerivatives> {
        self.0.hamiltonian_hessian(t, &x.fixed()).as_ref().map(SecondDerivatives::from)
    }
    fn hamiltonian_defect(&self, t: f64, x: &State) -> Option<Defect> {
        self.0.hamiltonian_defect(t, &x.fixed())
    }
    fn switching_functions(&self, t: f64, x: &Point, values: &mut Vec<f64>) {
        self.0.switching_functions(t, &x.fixed(), values);
    }
    fn at_switch(&self, index: usize, t: f64, x: &Point, rising: bool) -> AtSwitch {
        at_switch(self.0.at_switch(index, t, &x.fixed(), rising))
    }
    fn at_accumulation(&self, index: usize, t: f64, x: &Point) -> AtSwitch {
        at_switch(self.0.at_accumulation(index, t, &x.fixed()))
    }
    fn breaks(&self) -> &[f64] {
        self.0.breaks()
    }
    fn has_cones(&self) -> bool {
        self.0.has_cones()
    }
    fn dt_dtau(&self, q: &Vector) -> f64 {
        self.0.dt_dtau(&q.fixed())
    }
}
