//! The matrix exponential, with the quadratic form that is integrated along it.

use contact_geom::nalgebra::{DMatrix, DVector};
use discrete_herglotz::{InputError, StepError};

/// The number of terms of the series. The k-th is below `1/k!`, so that the last is far below the rounding of the
/// first.
const TERMS: i32 = 24;

/// The distance from one beyond which a diagonal element of E is computed directly, and not as one plus that of
/// `E - 1`.
pub(super) const FAR: f64 = 0.5;

/// The matrix `E = e^A`, its diagonal minus one, and the form `G = int_0^1 e^(r (1 - s)) e^(A s)^T S e^(A s) ds`.
pub(super) struct Evolution {
    pub e: DMatrix<f64>,
    /// The diagonal of `E - 1`, stored separately because E loses its digits where it is small.
    pub d: DVector<f64>,
    pub g: DMatrix<f64>,
}

impl Evolution {
    /// Computes them from A, S and r; `size` is a norm of A without its last column, which is only a source term.
    ///
    /// # Errors
    /// [`InputError::FirstStep`] where they overflow.
    pub fn over(a: &DMatrix<f64>, s: &DMatrix<f64>, r: f64, size: f64) -> Result<Self, InputError> {
        let non_finite = InputError::FirstStep(StepError::NonFinite);
        let finite = |m: &DMatrix<f64>| m.iter().all(|e| e.is_finite());
        // G contains two factors of E, so that its series converges like that of 2 |A| + |r|.
        let doublings = (2.0 * size + r.abs()).log2().ceil().max(0.0);
        if !(doublings.is_finite() && finite(a) && finite(s)) {
            return Err(non_finite);
        }
        let short = (-doublings).exp2();
        let mut evolution = Self::series(&(a * short), &(s * short), r * short);
        let mut r = r * short;
        for _ in 0..doublings as u32 {
            evolution.double(r);
            r *= 2.0;
        }
        if finite(&evolution.e) && finite(&evolution.g) { Ok(evolution) } else { Err(non_finite) }
    }

    /// Computes them by the series in the time, for `2 |A| + |r|` of at most one.
    fn series(a: &DMatrix<f64>, s: &DMatrix<f64>, r: f64) -> Self {
        let identity = DMatrix::identity(a.nrows(), a.nrows());
        let minus_one = a * (2..=TERMS).rev().fold(identity.clone(), |sum, k| &identity + a * sum / f64::from(k));
        // G' = r G + R with R = E^T S E, so that R' = A^T R + R A.
        let (mut moved, mut terms) = (s.clone(), vec![s.clone()]);
        for (i, k) in (2..=TERMS).enumerate() {
            moved = (a.tr_mul(&moved) + &moved * a) / f64::from(k - 1);
            terms.push((&terms[i] * r + &moved) / f64::from(k));
        }
        // Sum from the smallest term.
        let g = terms.iter().rev().fold(s * 0.0, |sum, term| sum + term);
        Evolution { d: minus_one.diagonal(), e: minus_one + identity, g }
    }

    /// Doubles the time; `e^r` is the growth of the action over the time before doubling.
    fn double(&mut self, r: f64) {
        let n = self.d.len();
        self.g = &self.g * r.exp() + self.e.tr_mul(&(&self.g * &self.e));
        let mut square = &self.e * &self.e;
        for i in 0..n {
            let cross: f64 = (0..n).filter(|k| *k != i).map(|k| self.e[(i, k)] * self.e[(k, i)]).sum();
            let d = self.d[i] * (2.0 + self.d[i]) + cross;
            // Near one, the entry is computed from E - 1; far from one, where it may decay to zero, it is computed
            // directly.
            if d.abs() < FAR {
                (self.d[i], square[(i, i)]) = (d, 1.0 + d);
            } else {
                self.d[i] = square[(i, i)] - 1.0;
            }
        }
        self.e = square;
    }
}
