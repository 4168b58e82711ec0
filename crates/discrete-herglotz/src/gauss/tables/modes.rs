//! The modes of Gauss collocation: the eigenvalues and eigenvectors of its Butcher matrix.

use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES, POLYNOMIALS};
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages};
use contact_geom::nalgebra::{Complex, DMatrix};
use contact_geom::support::legendre_polynomials;
use num_traits::{One, Zero};
use pulp::Simd;
use qd::Quad;
use std::sync::OnceLock;

/// The diagonalisation of the Butcher matrix A. Its eigenvalues are pairs of complex conjugate numbers, and one real
/// number if s is odd.
///
/// A linear system such as `(1 - h A (x) J) x = r` therefore decouples into one small complex system for each mode:
/// Butcher, "On the implementation of implicit Runge-Kutta methods", BIT 16 (1976).
pub(crate) struct Modes {
    s: usize,
    /// The maps from stages to the coefficients of the eigenvectors, and back.
    into: StageMap,
    back: StageMap,
    modes: Vec<Mode>,
}

/// One real eigenvalue, or a pair of complex conjugate ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mode {
    /// The eigenvalue, with a positive imaginary part in a pair.
    pub value: Complex<f64>,
    /// The index of the real part of its coefficient; in a pair the imaginary part follows.
    place: usize,
    pair: bool,
}

impl Modes {
    /// The modes for a number of stages from 1 to 16, computed once.
    pub fn of(s: usize) -> &'static Modes {
        static MODES: [OnceLock<Box<Modes>>; MAX_STAGES] = [const { OnceLock::new() }; MAX_STAGES];
        MODES[s.clamp(1, MAX_STAGES) - 1].get_or_init(|| Box::new(Self::new(s.clamp(1, MAX_STAGES))))
    }

    fn new(s: usize) -> Self {
        let g = Coefficients::of(s);
        let at = g.c.map(|c| legendre_polynomials::<_, POLYNOMIALS>(s, c + c - Quad::one()));
        let (mut modes, mut into, mut back) =
            (Vec::with_capacity(s), [[0.0; MAX_STAGES]; MAX_STAGES], [[0.0; MAX_STAGES]; MAX_STAGES]);
        let mut place = 0;
        for guess in eigenvalues(s).into_iter().filter(|value| value.im >= -1e-9 * value.re) {
            let (value, x) = eigenvector(s, guess);
            let pair = place + 1 < s && guess.im > 1e-9 * guess.re;
            if place >= s {
                break;
            }
            // In an orthonormal basis the left eigenvector has the same components with alternating signs.
            let sign = |k: usize| Quad::from(if k.is_multiple_of(2) { 1.0 } else { -1.0 });
            let sum = |f: &dyn Fn(usize) -> Complex<Quad>| (0..s).fold(Complex::<Quad>::zero(), |sum, k| sum + f(k));
            let norm = sum(&|k| x[k] * x[k] * (sign(k) / Quad::from((2 * k + 1) as f64)));
            for j in 0..s {
                let left: Complex<Quad> = sum(&|k| x[k] * (sign(k) * g.b[j] * at[j][k])) / norm;
                let right = sum(&|k| x[k] * at[j][k]);
                (into[place][j], back[j][place]) = (left.re.0, right.re.0);
                if pair {
                    into[place + 1][j] = left.im.0;
                    (back[j][place], back[j][place + 1]) = (2.0 * right.re.0, -2.0 * right.im.0);
                }
            }
            modes.push(Mode { value: Complex::new(value.re.0, if pair { value.im.0 } else { 0.0 }), place, pair });
            place += 1 + usize::from(pair);
        }
        Modes { s, into: StageMap::new(&into, s), back: StageMap::new(&back, s), modes }
    }

    pub fn iter(&self) -> impl Iterator<Item = &Mode> {
        self.modes.iter()
    }

    /// Transforms stage values to the coefficients of the modes.
    #[inline(always)]
    pub fn enter<S: Simd>(&self, x: &mut Stages) {
        let stages = *x;
        self.into.apply(&stages, self.s, x, Lanes::<S>::splat(0.0));
    }

    /// Transforms coefficients of the modes to stage values.
    #[inline(always)]
    pub fn leave<S: Simd>(&self, x: &mut Stages) {
        let modes = *x;
        self.back.apply(&modes, self.s, x, Lanes::<S>::splat(0.0));
    }
}

impl Mode {
    /// The coefficient of the mode.
    #[inline(always)]
    pub fn of(&self, x: &Stages) -> Complex<f64> {
        Complex::new(x.0[self.place], if self.pair { x.0[self.place + 1] } else { 0.0 })
    }

    #[inline(always)]
    pub fn set(&self, x: &mut Stages, to: Complex<f64>) {
        x.0[self.place] = to.re;
        if self.pair {
            x.0[self.place + 1] = to.im;
        }
    }
}

/// `1 / (2 (2k + 1))`: for k > 0 the integral of `P_k` on `[0, 1]` is this number times `P_(k+1) - P_(k-1)`.
fn share(k: usize) -> Quad {
    Quad::one() / Quad::from((4 * k + 2) as f64)
}

/// Approximate eigenvalues of A, which is tridiagonal in the basis of Legendre polynomials.
fn eigenvalues(s: usize) -> Vec<Complex<f64>> {
    let a = DMatrix::from_fn(s, s, |i, j| match (i, j) {
        (0, 0) => 0.5,
        _ if i == j + 1 => share(j).0,
        _ if j == i + 1 => -share(j).0,
        _ => 0.0,
    });
    a.complex_eigenvalues().iter().copied().collect()
}

/// An eigenvalue of A near a guess, and its eigenvector in the basis of Legendre polynomials; in twice the working
/// precision, since for many stages the eigenvectors are nearly linearly dependent.
fn eigenvector(s: usize, guess: Complex<f64>) -> (Complex<Quad>, [Complex<Quad>; MAX_STAGES + 1]) {
    let half = Complex::new(Quad::from(0.5), Quad::zero());
    let mut value = Complex::new(Quad::from(guess.re), Quad::from(guess.im));
    let mut x = [Complex::zero(); MAX_STAGES + 1];
    // Newton's method for the last row; it converges quadratically from six digits.
    for _ in 0..6 {
        let mut slope = [Complex::<Quad>::zero(); MAX_STAGES + 1];
        x[0] = Complex::one();
        for k in 0..s {
            let (below, slope_below) = if k == 0 {
                (half * x[0], Complex::zero())
            } else {
                (x[k - 1] * share(k - 1), slope[k - 1] * share(k - 1))
            };
            let next = share(k + 1);
            x[k + 1] = (below - value * x[k]) / next;
            slope[k + 1] = (slope_below - x[k] - value * slope[k]) / next;
        }
        value -= x[s] / slope[s];
    }
    (value, x)
}

#[cfg(test)]
#[allow(clippy::needless_range_loop)] // Several arrays share an index.
mod tests {
    use super::*;
    use std::array::from_fn;

    /// Multiplying each mode by its eigenvalue is multiplication by A, to a thousand units of round-off times the
    /// product of the largest entries of the two maps. That product is up to 1e8, so that simplified Newton iteration
    /// gains seven digits in each iteration.
    #[test]
    fn modes_are_those_of_the_collocation() {
        for s in 1..=MAX_STAGES {
            let (a, modes) = (&Coefficients::of(s).a, Modes::of(s));
            let largest =
                |map: &StageMap| map.0[..s].iter().flat_map(|c| &c.0[..s]).fold(0.0, |m: f64, e| m.max(e.abs()));
            let bound = 1e3 * f64::EPSILON * (1.0 + largest(&modes.into) * largest(&modes.back));
            for k in 0..s {
                let mut x = Stages(from_fn(|i| if i == k { 1.0 } else { 0.0 }));
                modes.enter::<pulp::Scalar>(&mut x);
                for mode in modes.iter() {
                    let c = mode.of(&x);
                    mode.set(&mut x, c * mode.value);
                }
                modes.leave::<pulp::Scalar>(&mut x);
                for i in 0..s {
                    let off = (x.0[i] - a[i][k].0).abs();
                    assert!(off <= bound && bound < 1e-4, "s = {s}: {i}, {k}: {off:e}, bound {bound:e}");
                }
            }
        }
    }
}
