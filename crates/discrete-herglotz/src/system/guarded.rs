//! The border to the systems of a user.

use super::{
    AtSwitch, Components, ExplicitDerivatives, ForceDerivatives, ForceKind, Kernels, Point, Quantity,
    SecondDerivatives, State, System, Vector,
};
use crate::StepError;
use contact_geom::nalgebra::DMatrix;
use contact_geom::switching::BreakRate;
use contact_geom::{Hints, Structure};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;

/// The result of a user's code, or `none` where it panics.
pub(crate) fn caught<R>(of: impl FnOnce() -> R, none: impl FnOnce() -> R) -> R {
    catch_unwind(AssertUnwindSafe(of)).unwrap_or_else(|_| none())
}

/// A system of a user, by its value and its derivatives: where they have the wrong length, or the code panics, they are
/// NaN, so that a run ends with a status.
pub(crate) struct Guarded<'a> {
    system: &'a (dyn System + 'a),
    n: usize,
}

impl<'a> Guarded<'a> {
    pub fn new(system: &'a (dyn System + 'a)) -> Self {
        Guarded { system, n: caught(|| system.dimension(), || 0) }
    }

    /// The result of the system's code, or `none` where it panics or the result is not of the system's size.
    fn checked<R>(&self, of: impl FnOnce() -> R, fits: impl FnOnce(&R) -> bool, none: impl FnOnce() -> R) -> R {
        caught(|| Some(of()), || None).filter(fits).unwrap_or_else(none)
    }
}

impl Guarded<'_> {
    /// What happens at a switch: a state of another length, or a panic, is a state that is not finite.
    fn replacement(&self, of: impl FnOnce() -> AtSwitch) -> AtSwitch {
        let n = self.n;
        let fits = |at: &AtSwitch| match at {
            AtSwitch::Replace { to, .. } => to.q.len() == n && to.v.len() == n,
            AtSwitch::Continue => true,
        };
        let none = || Vector::repeat(n, f64::NAN);
        self.checked(of, fits, || AtSwitch::Replace { to: Point { q: none(), v: none(), z: f64::NAN }, factor: None })
    }
}

impl System for Guarded<'_> {
    fn dimension(&self) -> usize {
        self.n
    }
    fn hints(&self) -> Hints {
        let of = self.checked(|| self.system.hints(), |_| true, || Hints::NONE);
        let forced = self.has_force();
        Hints { proved: of.proved, switching_functions: of.switching_functions, forced, ..Hints::NONE }
    }
    /// A proved structure, as far as its routes use it. Otherwise the claim that W is constant, which is verified.
    fn structure(&self) -> Structure {
        let claimed = self.checked(|| self.system.structure(), |_| true, Structure::default);
        match self.hints().proved {
            true if self.kernels().is_some() => claimed,
            true => Structure { separable: false, quadratic: false, ..claimed },
            false => Structure { constant_mass: claimed.constant_mass, ..Structure::default() },
        }
    }
    fn force_kind(&self) -> ForceKind {
        let fits = |of: &ForceKind| match of {
            ForceKind::Drag { linear, .. } => linear.len() == self.n,
            _ => true,
        };
        self.checked(|| self.system.force_kind(), fits, || ForceKind::General)
    }
    fn has_force(&self) -> bool {
        self.checked(|| self.system.has_force(), |_| true, || false)
    }
    fn applied_force(&self, t: f64, x: &Point) -> Vector {
        let n = self.n;
        self.checked(|| self.system.applied_force(t, x), |f| f.len() == n, || Vector::repeat(n, f64::NAN))
    }
    fn force_derivatives(&self, t: f64, x: &Point) -> Option<ForceDerivatives> {
        let n = self.n;
        let fits = |of: &Option<ForceDerivatives>| {
            of.as_ref().is_some_and(|of| {
                [&of.q, &of.v].iter().all(|m| m.shape() == (n, n)) && of.value.len() == n && of.z.len() == n
            })
        };
        let none = || {
            let (matrix, line) = (|| DMatrix::repeat(n, n, f64::NAN), || Vector::repeat(n, f64::NAN));
            Some(ForceDerivatives { value: line(), q: matrix(), v: matrix(), z: line() })
        };
        if !self.has_force() {
            return None;
        }
        self.checked(|| self.system.force_derivatives(t, x), fits, none)
    }
    fn parameter_names(&self) -> Vec<String> {
        self.checked(|| self.system.parameter_names(), |_| true, Vec::new)
    }
    fn parameters(&self) -> Vec<f64> {
        let n = self.parameter_names().len();
        self.checked(|| self.system.parameters(), |theta| theta.len() == n, || vec![f64::NAN; n])
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Rc<dyn System>> {
        self.checked(|| self.system.with_parameters(theta), |_| true, || None)
    }
    fn in_quantity(&self, of: Quantity, t: f64, x: &Point) -> ExplicitDerivatives {
        let n = self.n;
        let fits = |found: &ExplicitDerivatives| {
            found.gradient.x.len() == n && found.gradient.y.len() == n && found.force.len() == n
        };
        self.checked(|| self.system.in_quantity(of, t, x), fits, || ExplicitDerivatives::undefined(n))
    }
    fn kernels(&self) -> Option<Kernels> {
        self.checked(|| self.system.kernels(), |_| true, || None)
    }
    fn switching_functions(&self, t: f64, x: &Point, values: &mut Vec<f64>) {
        let first = values.len();
        let fill = |values: &mut Vec<f64>| {
            self.system.switching_functions(t, x, values);
            true
        };
        let filled = caught(|| fill(&mut *values), || false);
        if !filled || values.len() < first {
            values.resize(values.len().max(first), f64::NAN);
            values[first..].fill(f64::NAN);
        }
    }
    fn at_switch(&self, index: usize, t: f64, x: &Point, rising: bool) -> AtSwitch {
        self.replacement(|| self.system.at_switch(index, t, x, rising))
    }
    fn at_accumulation(&self, index: usize, t: f64, x: &Point) -> AtSwitch {
        self.replacement(|| self.system.at_accumulation(index, t, x))
    }
    fn breaks(&self) -> &[f64] {
        self.checked(|| self.system.breaks(), |_| true, || &[])
    }
    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        self.checked(|| self.system.break_rates(parameter), |_| true, || None)
    }

    fn has_cones(&self) -> bool {
        self.checked(|| self.system.has_cones(), |_| true, || false)
    }
    fn value(&self, t: f64, x: &Point) -> f64 {
        self.checked(|| self.system.value(t, x), |_| true, || f64::NAN)
    }
    fn gradient(&self, t: f64, x: &Point) -> Components {
        let n = self.n;
        let none = || Vector::repeat(n, f64::NAN);
        let fits = |g: &Components| g.x.len() == n && g.y.len() == n;
        self.checked(|| self.system.gradient(t, x), fits, || Components { x: none(), y: none(), z: f64::NAN })
    }
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives {
        let n = self.n;
        let fits = |h: &SecondDerivatives| {
            [&h.qq, &h.qv, &h.vv].iter().all(|m| m.shape() == (n, n)) && h.qz.len() == n && h.vz.len() == n
        };
        let none = || {
            let (matrix, line) = (|| DMatrix::repeat(n, n, f64::NAN), || Vector::repeat(n, f64::NAN));
            SecondDerivatives { qq: matrix(), qv: matrix(), vv: matrix(), qz: line(), vz: line(), zz: f64::NAN }
        };
        self.checked(|| self.system.hessian(t, x), fits, none)
    }
    fn mass_matrix(&self, t: f64, x: &Point) -> DMatrix<f64> {
        let n = self.n;
        let fits = |w: &DMatrix<f64>| w.shape() == (n, n);
        self.checked(|| self.system.mass_matrix(t, x), fits, || DMatrix::repeat(n, n, f64::NAN))
    }
    fn legendre_inverse(&self, t: f64, state: &State, guess: &[f64]) -> Result<Point, StepError> {
        super::defaults::legendre_inverse(self, t, state, guess)
    }
}
