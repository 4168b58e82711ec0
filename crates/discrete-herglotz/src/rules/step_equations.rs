//! The step equations of a quadrature rule, with derivatives of L only along the directions that a Newton step needs.

use crate::integration::Node;
use crate::solve::unknowns::Unknowns;
pub(crate) use crate::system::mass_matrix::BLOCK;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Dual, Lagrangian, VelocityPoint, numbers::AugmentedVector};

/// The sums over the nodes in the step equations.
pub(crate) struct Sums<const N: usize> {
    /// `sum w L`.
    pub value: f64,
    /// `p0 + sum w dL[l_i]`; with an applied force f, `dL[l_i] + h (1 - a) f_i` is in the place of `dL[l_i]`.
    pub residual: SVector<f64, N>,
    /// `sum w d2L[l_i, r_j]` for the velocity directions.
    pub right: SMatrix<f64, N, N>,
    /// The same for the direction of the end action.
    pub right_z: SVector<f64, N>,
    /// `sum w dL[r_j]`.
    pub slope: AugmentedVector<N>,
}

/// One node with the point at which L is evaluated.
pub(crate) struct Frame<'a, const N: usize> {
    pub node: Node,
    pub h: f64,
    pub p: &'a SVector<f64, N>,
    pub t: f64,
    pub at: &'a VelocityPoint<N>,
}

impl<const N: usize> Frame<'_, N> {
    /// Adds the part of the sums with one block of left directions from `left` and one of right directions from
    /// `right`.
    #[inline(always)]
    pub fn accumulate<U: Unknowns, const A: usize, L: Lagrangian<N>>(
        &self,
        lagrangian: &L,
        left: usize,
        right: usize,
        sums: &mut Sums<N>,
    ) {
        let Node { weight, place, action } = self.node;
        let h = self.h;
        type LeftDual<U, const A: usize> = Dual<Dual<f64, U>, SVector<Dual<f64, U>, A>>;
        let constant = |re: f64| -> LeftDual<U, A> { Dual::constant(Dual::constant(re)) };
        let mut x = VelocityPoint { q: self.at.q.map(constant), v: self.at.v.map(constant), z: constant(self.at.z) };
        for j in right..N.min(right + U::LEN) {
            x.q[j].re.d = U::unit(j - right, h * place);
            x.v[j].re.d = U::unit(j - right, 1.0);
        }
        if (right..right + U::LEN).contains(&N) {
            x.z.re.d = U::unit(N - right, action);
        }
        for i in left..N.min(left + A) {
            x.q[i].d[i - left] = Dual::constant(h * (1.0 - place));
            x.v[i].d[i - left] = Dual::constant(-1.0);
            x.z.d[i - left] = Dual::constant(h * (1.0 - action) * self.p[i]);
        }
        let mut l = lagrangian.along(Dual::constant(self.t), &x);
        if const { L::HINTS.forced } {
            let at = VelocityPoint { q: x.q.map(|e| e.re), v: x.v.map(|e| e.re), z: x.z.re };
            let force = lagrangian.applied_force(Dual::constant(self.t), &at);
            for i in left..N.min(left + A) {
                l.d[i - left] += force[i] * (h * (1.0 - place));
            }
        }
        if left == 0 && right == 0 {
            sums.value += weight * l.re.re;
        }
        for i in left..N.min(left + A) {
            let row = l.d[i - left];
            if right == 0 {
                sums.residual[i] += weight * row.re;
            }
            for j in right..N.min(right + U::LEN) {
                sums.right[(i, j)] += weight * row.d.get(j - right);
            }
            if (right..right + U::LEN).contains(&N) {
                sums.right_z[i] += weight * row.d.get(N - right);
            }
        }
        if left == 0 {
            for j in right..N.min(right + U::LEN) {
                sums.slope.x[j] += weight * l.re.d.get(j - right);
            }
            if (right..right + U::LEN).contains(&N) {
                sums.slope.z += weight * l.re.d.get(N - right);
            }
        }
    }

    /// All blocks of a large system; never inlined, so that small systems do not reserve its stack.
    #[inline(never)]
    pub fn by_blocks(&self, lagrangian: &impl Lagrangian<N>, unknowns: usize, sums: &mut Sums<N>) {
        for left in (0..N).step_by(BLOCK) {
            for right in (0..unknowns).step_by(BLOCK) {
                self.accumulate::<SVector<f64, BLOCK>, BLOCK, _>(lagrangian, left, right, sums);
            }
        }
    }
}

/// `L`, `L_q + f` with the applied force f, and `L_z` at a node, as needed at the end of a step.
#[inline(always)]
pub(crate) fn rates_at<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    t: f64,
    at: &VelocityPoint<N>,
) -> (f64, SVector<f64, N>, f64) {
    let (value, mut force, rate) = lagrangian_rates(lagrangian, t, at);
    if const { L::HINTS.forced } {
        force += lagrangian.applied_force(t, at);
    }
    (value, force, rate)
}

/// `L`, `L_q` and `L_z` at a node.
#[inline(always)]
fn lagrangian_rates<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    at: &VelocityPoint<N>,
) -> (f64, SVector<f64, N>, f64) {
    if const { N > BLOCK } {
        return rates_by_blocks(lagrangian, t, at);
    }
    let constant = |re: f64| -> Dual<f64, AugmentedVector<N>> { Dual::constant(re) };
    let mut x = VelocityPoint { q: at.q.map(constant), v: at.v.map(constant), z: constant(at.z) };
    for i in 0..N {
        x.q[i].d.x[i] = 1.0;
    }
    x.z.d.z = 1.0;
    let l = lagrangian.along(t, &x);
    (l.re, l.d.x, l.d.z)
}

/// [`lagrangian_rates`] for a large system.
#[inline(never)]
fn rates_by_blocks<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    at: &VelocityPoint<N>,
) -> (f64, SVector<f64, N>, f64) {
    let constant = |re: f64| -> Dual<f64, AugmentedVector<BLOCK>> { Dual::constant(re) };
    let (mut value, mut force, mut rate) = (0.0, SVector::zeros(), 0.0);
    for start in (0..N).step_by(BLOCK) {
        let mut x = VelocityPoint { q: at.q.map(constant), v: at.v.map(constant), z: constant(at.z) };
        for i in start..N.min(start + BLOCK) {
            x.q[i].d.x[i - start] = 1.0;
        }
        x.z.d.z = 1.0;
        let l = lagrangian.along(t, &x);
        for i in start..N.min(start + BLOCK) {
            force[i] = l.d.x[i - start];
        }
        (value, rate) = (l.re, l.d.z);
    }
    (value, force, rate)
}
