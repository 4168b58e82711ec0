//! Exact discrete Lagrangians of all quadratic Lagrangians, by the matrix exponential.

mod evolution;
#[cfg(test)]
mod tests;

use crate::map::conjugate::Fold;
use crate::map::exponential::singular_values;
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{Derivatives, DiscretePoint, GeometryError, Lagrangian, Regularity, Scalar, VelocityPoint};
use discrete_herglotz::{DiscreteLagrangian, InputError, StepError, checks::check_unforced};
use evolution::Evolution;

/// The exact discrete Lagrangian of `L = L2(q, v) + gamma z`, where L2 is an autonomous polynomial of degree two. L2
/// may be inhomogeneous and gyroscopic, with any frequencies, and the drag is arbitrary.
///
/// Herglotz' equation `(W v + C^T q + g)' = K q + C v + f + gamma (W v + C^T q + g)`, with `K = L_qq`, `C = L_qv`,
/// `W = L_vv`, `f = L_q(0)` and `g = L_v(0)`, is linear in `x = (q, v, 1)`. Hence x evolves by a matrix
/// `E(t) = e^(A t)`, and the action by a quadratic form: with `L2 = x.S x`, `z(h) = e^(gamma h) z0 + x0.G x0` where
/// `G = int_0^h e^(gamma (h - s)) E(s)^T S E(s) ds`. Both are computed on construction: by their series over a short
/// time, and then by doubling the time, `E(2t) = E(t)^2` and `G(2t) = e^(gamma t) G(t) + E(t)^T G(t) E(t)`. Zero drag,
/// critical drag and short steps need no special treatment. The initial velocity of the motion from `q0` to `q1` is
/// linear in `(q1 - q0, q0, 1)`.
///
/// The error is some units of round-off times the condition number of the motion. It is relative to the value, also for
/// small h, up to the rounding of `q1 - q0`; the same holds for the derivatives. Memory is allocated on construction
/// only.
///
/// ```
/// use contact_examples::systems::UniformField;
/// use contact_geom::DiscretePoint;
/// use discrete_herglotz::DiscreteLagrangian;
/// use exact_lagrangian::QuadraticExact;
///
/// let ld = QuadraticExact::new(&UniformField { field: [-1.0], gamma: 0.0 }, 0.5)?;
/// // Up from 0 with velocity 1 for a time 0.5: v^2/2 - q has the integral h/2 - h^2 + h^3/3.
/// let action = ld.value(0.0, &DiscretePoint::new([0.0], [0.375], 0.0))?;
/// assert!((action - (0.25 - 0.25 + 0.125 / 3.0)).abs() < 1e-16);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct QuadraticExact<const N: usize> {
    h: f64,
    /// `e^(gamma h)`, and that minus one.
    sigma: f64,
    sigma_m1: f64,
    /// The displacement `q1 - q0` and the velocity `v1`; for a coordinate that is not in `stays`, `q1` itself.
    displacement: Affine<N>,
    velocity: Affine<N>,
    /// The coordinates for which `dq1/dq0` is so close to one that `dq1/dq0 - 1` is stored to keep its digits.
    stays: [bool; N],
    /// The inverse of `dq1/dv0`.
    inverse: SMatrix<f64, N, N>,
    /// G: its quadratic part in q and v (`qv` counted twice), its linear part and its constant.
    qq: SMatrix<f64, N, N>,
    qv: SMatrix<f64, N, N>,
    vv: SMatrix<f64, N, N>,
    q: SVector<f64, N>,
    v: SVector<f64, N>,
    one: f64,
}

/// An affine function of `(q, v)`.
#[derive(Clone, Copy, Debug)]
struct Affine<const N: usize> {
    q: SMatrix<f64, N, N>,
    v: SMatrix<f64, N, N>,
    one: SVector<f64, N>,
}

/// The tolerance for derivatives that are zero according to a claim, relative to the size of their terms: some thousand
/// units of round-off, for Lagrangians whose constants are themselves rounded.
const CLAIM_TOLERANCE: f64 = 1e-12;

impl<const N: usize> QuadraticExact<N> {
    /// The exact discrete Lagrangian of a Lagrangian that is declared autonomous and quadratic in its
    /// [`structure`](Lagrangian::structure).
    ///
    /// # Errors
    /// [`InputError::Dimension`] for `N = 0`; [`InputError::Step`] unless h is positive and finite;
    /// [`InputError::Unclaimed`] and [`InputError::FalseClaim`] where L is not of the form; [`InputError::Geometry`]
    /// where W is singular to round-off; [`InputError::FirstStep`] where the motion overflows, and at a conjugate
    /// point, to within some roundings of h, K and gamma, where two positions do not determine the motion;
    /// [`InputError::Hypothesis`] where a motion has decayed below the smallest number, so that the positions do not
    /// determine its velocity.
    pub fn new(lagrangian: &impl Lagrangian<N>, h: f64) -> Result<Self, InputError> {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if !(h > 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        check_unforced(lagrangian, "the exact discrete Lagrangian")?;
        check_claims(lagrangian)?;
        let Equations { gamma, unit, rate, form, size } = Equations::of(lagrangian, h)?;
        let n = 2 * N;
        let Evolution { e, d, g } = Evolution::over(&rate, &form, gamma * h, size)?;

        let block =
            |i: usize, j: usize, scale: f64| SMatrix::<f64, N, N>::from_fn(|k, l| e[(i * N + k, j * N + l)] * scale);
        let column = |i: usize, scale: f64| SVector::<f64, N>::from_fn(|k, _| e[(i * N + k, n)] * scale);
        let mut displacement = Affine { q: block(0, 0, 1.0), v: block(0, 1, unit), one: column(0, 1.0) };
        let stays = std::array::from_fn(|i| d[i].abs() < evolution::FAR);
        (0..N).filter(|i| stays[*i]).for_each(|i| displacement.q[(i, i)] = d[i]);
        let velocity = Affine { q: block(1, 0, 1.0 / unit), v: block(1, 1, 1.0), one: column(1, 1.0 / unit) };
        let Regularity { smallest, largest } = singular_values(&block(0, 1, 1.0));
        // The effect on dq1/dw0 of the rounding of h, with respect to which its derivative is dw1/dw0, and of the
        // doublings; and that of the rounding of K and of the drag, which is larger near critical drag. The latter is
        // measured by changing both in opposite directions, by so much that the velocity keeps some correct digits
        // where the step is accepted.
        let nearby = DMatrix::from_fn(n + 1, n + 1, |i, j| match (i / N, j / N) {
            (1, 0) => rate[(i, j)] * (1.0 + 64.0 * f64::EPSILON),
            (1, 1) => rate[(i, j)] * (1.0 - 64.0 * f64::EPSILON),
            _ => rate[(i, j)],
        });
        let moved = Evolution::over(&nearby, &form, gamma * h, size)?.e - &e;
        let rounding = 8.0 * f64::EPSILON * (size * row_sum(&velocity.v)).max(N as f64 * largest)
            + row_sum(&SMatrix::<f64, N, N>::from_fn(|i, j| moved[(i, N + j)]));
        let conjugate = InputError::FirstStep(StepError::ConjugatePoint { smallest: smallest * unit });
        if Fold::of(&displacement.v, &velocity.v, h).decayed {
            return Err(InputError::Hypothesis {
                hypothesis: "a motion that stays above the smallest positive number",
            });
        }
        if smallest <= rounding {
            return Err(conjugate);
        }
        let inverse = inverse_times(&displacement.v, &SMatrix::identity()).map_err(|_| conjugate)?;
        let form =
            |i: usize, j: usize, scale: f64| SMatrix::<f64, N, N>::from_fn(|k, l| g[(i * N + k, j * N + l)] * scale);
        let linear = |i: usize, scale: f64| SVector::<f64, N>::from_fn(|k, _| g[(i * N + k, n)] * (2.0 * scale));
        Ok(QuadraticExact {
            h,
            sigma: (gamma * h).exp(),
            sigma_m1: (gamma * h).exp_m1(),
            displacement,
            velocity,
            stays,
            inverse,
            qq: form(0, 0, 1.0),
            qv: form(0, 1, 2.0 * unit),
            vv: form(1, 1, unit) * unit,
            q: linear(0, 1.0),
            v: linear(1, unit),
            one: g[(n, n)],
        })
    }

    /// The motion after the time h: `(q1, v1, z1)`. NaN where the start is NaN, infinite where the motion overflows.
    pub fn motion<T: Scalar>(&self, start: &VelocityPoint<N, T>) -> VelocityPoint<N, T> {
        let (q, v) = (&start.q, &start.v);
        VelocityPoint {
            q: self.staying(q) + self.displacement.at(q, v),
            v: self.velocity.at(q, v),
            z: start.z * self.sigma + self.form(q, v),
        }
    }

    /// The positions of the coordinates in `stays`, 0 for the others, whose `q1` may have decayed and would be lost in
    /// a sum with `q0`.
    fn staying<T: Scalar>(&self, q: &SVector<T, N>) -> SVector<T, N> {
        SVector::from_fn(|i, _| if self.stays[i] { q[i] } else { T::zero() })
    }

    /// Whether the action no longer depends on the positions: the drag has reduced all of its terms below the smallest
    /// normal number, and `-z0` alone is not a discrete Lagrangian.
    fn is_lost(&self) -> bool {
        let nothing = |e: &f64| e.abs() < f64::MIN_POSITIVE;
        let form = [self.qq, self.qv, self.vv].iter().all(|m| m.iter().all(nothing));
        nothing(&self.sigma) && form && [self.q, self.v].iter().all(|c| c.iter().all(nothing))
    }

    /// `x.G x` at `x = (q, v, 1)`.
    fn form<T: Scalar>(&self, q: &SVector<T, N>, v: &SVector<T, N>) -> T {
        let mut sum = T::from(self.one);
        for i in 0..N {
            let (mut by_q, mut by_v) = (T::from(self.q[i]), T::from(self.v[i]));
            for j in 0..N {
                by_q += q[j] * self.qq[(i, j)] + v[j] * self.qv[(i, j)];
                by_v += v[j] * self.vv[(i, j)];
            }
            sum += q[i] * by_q + v[i] * by_v;
        }
        sum
    }
}

impl<const N: usize> DiscreteLagrangian<N> for QuadraticExact<N> {
    fn step_size(&self) -> f64 {
        self.h
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        if self.is_lost() {
            return Err(StepError::SigmaVanished { sigma: self.sigma });
        }
        let still = SVector::from_element(T::zero());
        // The displacement is formed first: it may have few digits, and no more must be lost.
        let by_velocity = (x.q1 - self.staying(&x.q0)) - self.displacement.at(&x.q0, &still);
        let v0 = times(&self.inverse, &by_velocity);
        let value = x.z0 * self.sigma_m1 + self.form(&x.q0, &v0);
        // A position that is not finite makes the value so, unless the form does not contain it.
        let finite = t.is_finite() && value.extent().is_finite() && v0.iter().all(|v| v.extent().is_finite());
        if finite { Ok(value) } else { Err(StepError::NonFinite) }
    }
}

impl<const N: usize> Affine<N> {
    /// The value at `(q, v)`.
    fn at<T: Scalar>(&self, q: &SVector<T, N>, v: &SVector<T, N>) -> SVector<T, N> {
        let linear = times(&self.q, q) + times(&self.v, v);
        SVector::from_fn(|i, _| linear[i] + self.one[i])
    }
}

/// Herglotz' equations and the action as matrices.
struct Equations {
    gamma: f64,
    /// The time unit of the velocities `w = unit v`.
    unit: f64,
    /// The matrix A of the linear equation of `(q, w, 1)` and the form S, over the time h.
    rate: DMatrix<f64>,
    form: DMatrix<f64>,
    /// The norm of A without its last column.
    size: f64,
}

impl Equations {
    fn of<const N: usize>(lagrangian: &impl Lagrangian<N>, h: f64) -> Result<Self, InputError> {
        let origin = VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z: 0.0 };
        let constant = lagrangian.value(0.0, &origin.q, &origin.v, 0.0);
        let (first, second) = (lagrangian.gradient(0.0, &origin), lagrangian.hessian(0.0, &origin));
        let (c, gamma) = (second.qv, first.z);
        let mut acceleration = Affine {
            q: over_mass(&second.vv, &(second.qq + c.transpose() * gamma))?,
            v: over_mass(&second.vv, &(c - c.transpose()))?,
            one: over_mass(&second.vv, &(first.x + first.y * gamma))?,
        };
        // This is W^-1 gamma W without rounding.
        (0..N).for_each(|i| acceleration.v[(i, i)] += gamma);

        // Velocities are scaled as w = unit v, where the unit is h or, if it is shorter, the inverse of the highest
        // frequency. Then A has no entries much larger than needed, and the short time of the series is not shorter
        // than a fast oscillation requires.
        let stretch = (h * row_sum(&acceleration.q).sqrt()).log2().ceil().max(0.0).exp2();
        let unit = h / stretch;
        let n = 2 * N;
        let part = |k: usize| (k / N, k % N);
        let rate = DMatrix::from_fn(n + 1, n + 1, |i, j| match (part(i), part(j)) {
            ((0, i), (1, j)) if i == j => stretch,
            ((1, i), (0, j)) => h * unit * acceleration.q[(i, j)],
            ((1, i), (1, j)) => h * acceleration.v[(i, j)],
            ((1, i), (2, _)) => h * unit * acceleration.one[i],
            _ => 0.0,
        });
        let form = DMatrix::from_fn(n + 1, n + 1, |i, j| match (part(i), part(j)) {
            ((0, i), (0, j)) => 0.5 * h * second.qq[(i, j)],
            ((0, i), (1, j)) => 0.5 * stretch * c[(i, j)],
            ((1, i), (0, j)) => 0.5 * stretch * c[(j, i)],
            ((1, i), (1, j)) => 0.5 * stretch / unit * second.vv[(i, j)],
            ((0, i), (2, _)) | ((2, _), (0, i)) => 0.5 * h * first.x[i],
            ((1, i), (2, _)) | ((2, _), (1, i)) => 0.5 * stretch * first.y[i],
            _ => h * constant,
        });
        let size = rate.view((0, 0), (n, n)).row_iter().map(|r| r.abs().sum()).fold(0.0, f64::max);
        Ok(Equations { gamma, unit, rate, form, size })
    }
}

/// The product of a matrix of numbers with a vector over any scalar.
fn times<T: Scalar, const N: usize>(m: &SMatrix<f64, N, N>, x: &SVector<T, N>) -> SVector<T, N> {
    SVector::from_fn(|i, _| (0..N).fold(T::zero(), |sum, j| sum + x[j] * m[(i, j)]))
}

/// The maximum row sum norm.
fn row_sum<const N: usize>(m: &SMatrix<f64, N, N>) -> f64 {
    m.row_iter().map(|r| r.abs().sum()).fold(0.0, f64::max)
}

/// `a^-1 b`, column by column.
fn inverse_times<const N: usize, const M: usize>(
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, M>,
) -> Result<SMatrix<f64, N, M>, contact_geom::support::linear::SingularMatrix> {
    let mut solution = *b;
    for j in 0..M {
        let mut column = b.column(j).into_owned();
        solve(&mut a.clone_owned(), &mut column)?;
        solution.set_column(j, &column);
    }
    Ok(solution)
}

/// `W^-1 b`; refuses a W that is singular to round-off, independent of the units of the coordinates.
fn over_mass<const N: usize, const M: usize>(
    w: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, M>,
) -> Result<SMatrix<f64, N, M>, InputError> {
    let (what, remedy) = ("W = L_vv", "use a regular Lagrangian");
    let unit = SVector::<f64, N>::from_fn(|i, _| w.row(i).amax().sqrt());
    let scaled = SMatrix::<f64, N, N>::from_fn(|i, j| w[(i, j)] / (unit[i] * unit[j]));
    let Regularity { smallest, largest } = singular_values(&scaled);
    if smallest <= 4.0 * N as f64 * f64::EPSILON * largest {
        let pivot = smallest / largest;
        return Err(GeometryError::Singular { what, pivot, remedy }.into());
    }
    inverse_times(w, b).map_err(|e| e.of(what, remedy).into())
}

/// Refuses a Lagrangian that is not declared autonomous and quadratic, or one of whose claims is false at a generic
/// point.
fn check_claims<const N: usize>(lagrangian: &impl Lagrangian<N>) -> Result<(), InputError> {
    let structure = lagrangian.structure();
    for (made, claim) in [(structure.autonomous, "autonomous"), (structure.quadratic, "quadratic")] {
        if !made {
            return Err(InputError::Unclaimed { claim });
        }
    }
    let generic = |i: usize| 0.3 + (((i + 1) * (i + 1)) as f64 * std::f64::consts::SQRT_2).fract();
    let x = VelocityPoint {
        q: SVector::from_fn(|i, _| generic(i)),
        v: SVector::from_fn(|i, _| generic(N + i)),
        z: generic(2 * N),
    };
    let mut defects =
        structure.defects(lagrangian, 0.7, &x).ok_or(GeometryError::Undefined { what: "the Lagrangian" })?;
    match defects.find(|d| d.size > CLAIM_TOLERANCE) {
        Some(defect) => Err(InputError::FalseClaim { claim: defect.claim, size: defect.size }),
        None => Ok(()),
    }
}
