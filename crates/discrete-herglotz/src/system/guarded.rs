//! The border to the systems of a user.

use super::{Components, Point, SecondDerivatives, State, System, Vector};
use crate::StepError;
use contact_geom::nalgebra::DMatrix;
use contact_geom::{Hints, Structure};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A system of a user, by its value and its derivatives: where they have the wrong length, or the code panics, they are
/// NaN, so that a run ends with a status.
pub(crate) struct Guarded<'a> {
    system: &'a (dyn System + 'a),
    n: usize,
}

impl<'a> Guarded<'a> {
    pub fn new(system: &'a (dyn System + 'a)) -> Self {
        Guarded { system, n: catch_unwind(AssertUnwindSafe(|| system.dimension())).unwrap_or(0) }
    }

    /// The result of the system's code, or `none` where it panics or the result is not of the system's size.
    fn checked<R>(&self, of: impl FnOnce() -> R, fits: impl FnOnce(&R) -> bool, none: impl FnOnce() -> R) -> R {
        catch_unwind(AssertUnwindSafe(of)).ok().filter(fits).unwrap_or_else(none)
    }
}

impl System for Guarded<'_> {
    fn dimension(&self) -> usize {
        self.n
    }
    fn hints(&self) -> Hints {
        let proved = self.checked(|| self.system.hints().proved, |_| true, || false);
        Hints { proved, ..Hints::NONE }
    }
    /// A proved structure, as far as collocation point by point uses it. Otherwise the claim that W is constant, which is
    /// verified.
    fn structure(&self) -> Structure {
        let claimed = self.checked(|| self.system.structure(), |_| true, Structure::default);
        match self.hints().proved {
            true => Structure { separable: false, quadratic: false, ..claimed },
            false => Structure { constant_mass: claimed.constant_mass, ..Structure::default() },
        }
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
