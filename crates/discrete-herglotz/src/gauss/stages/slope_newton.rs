//! Simplified Newton iteration for the stage equations of a condensed step: the derivative of the force is taken at one
//! point for all stages, so that the Jacobian decouples into one small complex matrix for each eigenvalue of the Butcher
//! matrix.
//!
//! It converges for stiff forces, where fixed-point iteration does not, at about twice the cost of an iteration.

use crate::gauss::stages::product::matrix_product;
use crate::gauss::system::CollocationSystem;
use crate::gauss::tables::condensed::Condensed;
use crate::gauss::tables::modes::Modes;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::numbers::state_words::saved;
use crate::solve::inverse::invert_complex;
use contact_geom::nalgebra::linalg::try_invert_to;
use contact_geom::nalgebra::{Complex, DMatrix, DMatrixView, DVectorView, DVectorViewMut, SMatrix};
use contact_geom::numbers::max_abs_or_nan;
use pulp::{Simd, WithSimd};

/// Simplified Newton iteration for the accelerations of [`Condensed`] stages, `a = f(q0 + u v0 + B a)`. With `J = f'`
/// at one point, the change `r` of the accelerations in a fixed-point iteration becomes `(1 - B (x) J)^-1 r`. Here B is
/// replaced by `(hA)^2 / (1 - gamma hA)`, which agrees with it up to the error of the collocation.
pub(crate) struct SlopeNewton {
    modes: &'static Modes,
    s: usize,
    /// The step size h and the rate gamma.
    h: f64,
    gamma: f64,
    /// `(1 - b J)^-1`, by columns, for each eigenvalue b of B, together with b.
    inverses: Vec<(Vec<Complex<f64>>, Complex<f64>)>,
    /// The accelerations from which the next iteration starts.
    pub a: Vec<Stages>,
    /// The corrections of the positions.
    moved: Vec<Stages>,
    /// The right-hand side and the solution of the equations of one mode.
    sides: [Vec<Complex<f64>>; 2],
    /// J, and `L_qq`.
    slopes: [DMatrix<f64>; 2],
}

impl SlopeNewton {
    /// The workspace for steps of n coordinates.
    pub fn new(table: &Condensed, n: usize) -> Self {
        let (modes, zero) = (Modes::of(table.s), Complex::new(0.0, 0.0));
        SlopeNewton {
            modes,
            s: table.s,
            h: table.h,
            gamma: table.gamma,
            inverses: vec![(vec![zero; n * n], zero); modes.iter().count()],
            a: vec![Stages::ZERO; n],
            moved: vec![Stages::ZERO; n],
            sides: [vec![zero; n], vec![zero; n]],
            slopes: [DMatrix::zeros(n, n), DMatrix::zeros(n, n)],
        }
    }

    /// Inverts the matrices of the modes for J at a time and a position; `false` if one of them is singular or not
    /// finite. The inverse mass is `None` where M is the identity.
    pub fn linearise(
        &mut self,
        system: &dyn CollocationSystem,
        t: f64,
        q: &[f64],
        inverse_mass: Option<&DMatrix<f64>>,
    ) -> bool {
        let [slope, curvature] = &mut self.slopes;
        match inverse_mass {
            None => system.curvature(t, q, slope),
            Some(inverse) => {
                system.curvature(t, q, curvature);
                matrix_product(inverse, curvature, slope);
            }
        }
        self.factorise()
    }

    /// Inverts the matrices of the modes; `false` if one of them is singular.
    fn factorise(&mut self) -> bool {
        let [slope, _] = &self.slopes;
        let n = slope.nrows();
        self.modes.iter().zip(&mut self.inverses).all(|(mode, (inverse, b))| {
            let mu = mode.value * self.h;
            *b = mu * mu / (-mu * self.gamma + 1.0);
            for (index, (entry, slope)) in inverse.iter_mut().zip(slope.iter()).enumerate() {
                *entry = Complex::from(if index % (n + 1) == 0 { 1.0 } else { 0.0 }) - *b * *slope;
            }
            invert(inverse, n)
        })
    }

    /// Starts an iteration from accelerations.
    #[cold]
    #[inline(never)]
    pub fn begin(&mut self, a: &[Stages]) {
        self.a.copy_from_slice(a);
    }

    /// Corrects the accelerations `found` that a fixed-point iteration at the positions x gives for `self.a`. Returns the
    /// largest change of the accelerations, and whether the positions have changed by no more than their round-off.
    #[cold]
    #[inline(never)]
    pub fn correct(&mut self, arch: Instructions, found: &mut [Stages], x: &[Stages]) -> (f64, bool) {
        let s = self.s;
        let (change, moved) = arch.dispatch(CorrectSlope { newton: self, found });
        let width = max_abs_or_nan(x.iter().flat_map(|x| &x.0[..s]).copied());
        (change, moved <= 4.0 * f64::EPSILON * width)
    }

    /// The corrections of the accelerations and of the positions, in the coordinates of the modes. Not inlined, since
    /// complex numbers gain nothing from vector instructions.
    #[inline(never)]
    fn solve_modes(&mut self, found: &mut [Stages]) {
        let (n, [side, change]) = (found.len(), &mut self.sides);
        let (zero, one) = (Complex::new(0.0, 0.0), Complex::new(1.0, 0.0));
        for (mode, (inverse, b)) in self.modes.iter().zip(&self.inverses) {
            for (side, found) in side.iter_mut().zip(found.iter()) {
                *side = mode.of(found);
            }
            let (inverse, side) = (DMatrixView::from_slice(inverse, n, n), DVectorView::from_slice(side, n));
            DVectorViewMut::from_slice(change, n).gemv(one, &inverse, &side, zero);
            for ((found, moved), change) in found.iter_mut().zip(&mut self.moved).zip(change.iter()) {
                mode.set(found, *change);
                mode.set(moved, *change * *b);
            }
        }
    }
}

/// The kernel of [`SlopeNewton::correct`]: the largest change of the accelerations, and that of the positions.
struct CorrectSlope<'a> {
    newton: &'a mut SlopeNewton,
    found: &'a mut [Stages],
}

impl WithSimd for CorrectSlope<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> (f64, f64) {
        let CorrectSlope { newton, found } = self;
        let (modes, m) = (newton.modes, blocks::<S>(newton.s));
        for (found, a) in found.iter_mut().zip(&newton.a) {
            for r in 0..m {
                found.set(r, found.block::<S>(r) - a.block(r));
            }
            modes.enter::<S>(found);
        }
        newton.moved.fill(Stages::ZERO);
        newton.solve_modes(found);
        let mut far = Lanes::<S>::splat(0.0);
        for moved in &mut newton.moved {
            modes.leave::<S>(moved);
            for r in 0..m {
                far = far.max(moved.block::<S>(r).abs());
            }
        }
        let mut largest = Lanes::<S>::splat(0.0);
        for (found, a) in found.iter_mut().zip(&mut newton.a) {
            modes.leave::<S>(found);
            for r in 0..m {
                let change = found.block::<S>(r);
                largest = largest.max(change.abs());
                found.set(r, a.block::<S>(r) + change);
            }
            *a = *found;
        }
        (largest.reduce_max(), far.reduce_max())
    }
}

/// Inverts a matrix of n rows, by columns, in place; `false` if it is singular or not finite. Uses the heap for more than
/// eight rows.
pub(crate) fn invert(m: &mut [Complex<f64>], n: usize) -> bool {
    if !m.iter().all(|e| e.is_finite()) {
        return false;
    }
    let inverted = match n {
        5 => invert_on_stack::<5>(m),
        6 => invert_on_stack::<6>(m),
        7 => invert_on_stack::<7>(m),
        8 => invert_on_stack::<8>(m),
        _ => invert_complex(m, n),
    };
    inverted && m.iter().all(|e| e.is_finite())
}

/// Inverts a matrix of N rows without use of the heap.
fn invert_on_stack<const N: usize>(m: &mut [Complex<f64>]) -> bool {
    let matrix = SMatrix::<Complex<f64>, N, N>::from_column_slice(m);
    let mut inverse = matrix;
    let inverted = try_invert_to(matrix, &mut inverse);
    m.copy_from_slice(inverse.as_slice());
    inverted
}

saved!([] SlopeNewton { inverses, a });
