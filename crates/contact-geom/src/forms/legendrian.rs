//! Legendrian graphs of conformally contact maps.

use crate::numbers::{TangentVector, max_or_nan};
use crate::{ChartVector, Dual, PhasePoint};

/// A number with its derivatives along the `2N + 1` parameters of a submanifold.
pub type OnParameters<const N: usize> = Dual<f64, ChartVector<N>>;

/// How far a submanifold of `M x M x R`, `M = T*Q x R`, is from a Legendrian one of `Theta = eta1 - e^r eta0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegendrianDefect {
    /// The largest component of the pullback of `Theta`, relative to the size of its terms.
    pub form: f64,
    /// The largest component of the pullback of `d Theta = d eta1 - e^r dr ^ eta0 - e^r d eta0`, relative to the size
    /// of its terms. It vanishes where the pullback of `Theta` vanishes in a neighbourhood.
    pub closure: f64,
}

impl LegendrianDefect {
    /// The larger of the two; NaN where one of them is NaN.
    pub fn largest(&self) -> f64 {
        max_or_nan(self.form, self.closure)
    }
}

/// The Legendrian defect of a submanifold at a point `(x0, x1, r)`, given with its derivatives along the `2N + 1`
/// parameters.
///
/// `Theta` is a contact form on `M x M x R`, of dimension `4N + 3`. A map of M is conformally contact with the factor
/// sigma exactly if its graph `(x, Phi(x), ln sigma(x))`, of dimension `2N + 1`, is Legendrian: the pullback of `Theta`
/// to it is `Phi* eta - sigma eta`. The parameters are the coordinates of x, or those of any chart of M.
///
/// ```
/// use contact_geom::{legendrian_defect, support::seed, ChartVector, PhasePoint};
/// let x0: PhasePoint<1, _> = seed(&ChartVector { x: [0.3].into(), y: [0.7].into(), z: 0.2 }).into();
/// // (q, 2 p, 2 z) has the factor 2.
/// let x1 = PhasePoint { q: x0.q, p: x0.p + x0.p, z: x0.z + x0.z };
/// assert!(legendrian_defect(&x0, &x1, 2f64.ln().into()).largest() < 1e-15);
/// assert!(legendrian_defect(&x0, &x1, 0f64.into()).form > 0.1); // another factor
/// ```
pub fn legendrian_defect<const N: usize>(
    x0: &PhasePoint<N, OnParameters<N>>,
    x1: &PhasePoint<N, OnParameters<N>>,
    r: OnParameters<N>,
) -> LegendrianDefect {
    let sigma = r.re.exp();
    // `dz - p dq` and the sum of the magnitudes of its terms.
    let eta = |x: &PhasePoint<N, OnParameters<N>>| {
        let (mut form, mut size) = (x.z.d, x.z.d.each(f64::abs));
        for (q, p) in x.q.iter().zip(&x.p) {
            form = form.minus(q.d.scale(p.re));
            size = size.plus(q.d.scale(p.re).each(f64::abs));
        }
        (form, size)
    };
    let ((eta0, size0), (eta1, size1)) = (eta(x0), eta(x1));
    let relative = |part: f64, size: f64| if part == 0.0 { 0.0 } else { part / size };
    let form = eta1.minus(eta0.scale(sigma)).amax();
    let size = size1.plus(size0.scale(sigma)).amax();
    let (mut closure, mut terms) = (0.0, 0.0);
    let add = |sum: &mut f64, sizes: &mut f64, factor: f64, a: &ChartVector<N>, b: &ChartVector<N>, i, j| {
        let [first, second] = [a.component(i) * b.component(j), a.component(j) * b.component(i)];
        *sum += factor * (first - second);
        *sizes += (factor * first).abs() + (factor * second).abs();
    };
    for i in 0..ChartVector::<N>::DIMENSION {
        for j in 0..i {
            let (mut sum, mut sizes) = (0.0, 0.0);
            // `d eta = dq ^ dp`.
            for (x, factor) in [(x1, 1.0), (x0, -sigma)] {
                for (q, p) in x.q.iter().zip(&x.p) {
                    add(&mut sum, &mut sizes, factor, &q.d, &p.d, i, j);
                }
            }
            add(&mut sum, &mut sizes, -sigma, &r.d, &eta0, i, j);
            (closure, terms) = (max_or_nan(closure, sum.abs()), max_or_nan(terms, sizes));
        }
    }
    LegendrianDefect { form: relative(form, size), closure: relative(closure, terms) }
}
