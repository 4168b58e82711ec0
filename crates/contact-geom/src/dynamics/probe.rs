//! The derivatives of a Lagrangian at one point along a few directions, each with the size of its terms.

use crate::number::rounded::Rounded;
use crate::{Dual, Lagrangian, VelocityPoint, numbers::max_abs_or_nan};
use nalgebra::{SMatrix, SVector};

/// A number with its derivatives along one direction of TQ x R, and in time.
pub(crate) type Moving = Dual<Rounded, SVector<Rounded, 2>>;
/// The same with its first derivatives along a direction of q, a direction of v, and z.
pub(crate) type First = Dual<Moving, SVector<Moving, 3>>;
/// The same with its second derivatives, by a second set of such directions.
pub(crate) type Second = Dual<First, SVector<First, 3>>;

/// A point with directions without special symmetry: a non-zero form vanishes on them only by coincidence. One
/// evaluation of L on nested duals with a few directions therefore replaces the computation of whole matrices, for any
/// N.
///
/// Each direction is as long as the coordinates are large, so that derivatives overflow only where L does.
pub(crate) struct Probe<const N: usize> {
    t: f64,
    x: VelocityPoint<N>,
    /// The lengths of the directions of q, v, z and t.
    lengths: [f64; 4],
}

/// One of the three directions through a coordinate.
#[derive(Clone, Copy)]
enum Along {
    Inner,
    Outer,
    Line,
}

impl<const N: usize> Probe<N> {
    pub fn new(t: f64, x: &VelocityPoint<N>) -> Self {
        let length = |size: f64| if size == 0.0 { 1.0 } else { size };
        let [q, v] = [&x.q, &x.v].map(|c| length(max_abs_or_nan(c.iter().copied())));
        Probe { t, x: *x, lengths: [q, v, length(x.z.abs()), length(t.abs())] }
    }

    /// The same position, action and directions at velocity zero.
    pub fn at_rest(&self) -> Self {
        Probe { x: VelocityPoint { v: SVector::zeros(), ..self.x }, ..*self }
    }

    /// The component of a direction at coordinate `i` of the group `kind`: 0 for q, 1 for v, 2 for z.
    fn direction(&self, along: Along, kind: usize, i: usize) -> f64 {
        let golden = 0.618_033_988_749_894_9;
        let index = (along as usize * (2 * N + 1) + kind * N + i) as f64;
        self.lengths[kind] * (0.3 + ((index * index + 1.0) * golden).fract())
    }

    /// A coordinate as a dual number, with its components of all directions.
    fn seed(&self, kind: usize, i: usize, value: f64) -> Second {
        let along = |direction| Rounded::from(self.direction(direction, kind, i));
        let mut moving = Moving::constant(value.into());
        moving.d[0] = along(Along::Line);
        let mut first = First::constant(moving);
        first.d[kind] = Moving::constant(along(Along::Inner));
        let mut second = Second::constant(first);
        second.d[kind] = First::constant(Moving::constant(along(Along::Outer)));
        second
    }

    /// The time as a dual number, with its derivative in time only.
    fn clock(&self) -> Moving {
        let mut clock = Moving::constant(self.t.into());
        clock.d[1] = self.lengths[3].into();
        clock
    }

    /// The value of L with its derivatives.
    pub fn value(&self, lagrangian: &impl Lagrangian<N>) -> Second {
        let [q, v] =
            [(0, &self.x.q), (1, &self.x.v)].map(|(kind, c)| c.map_with_location(|i, _, c| self.seed(kind, i, c)));
        let clock = Second::constant(First::constant(self.clock()));
        lagrangian.value(clock, &q, &v, self.seed(2, 0, self.x.z))
    }

    /// The defect of the closed gradient, compared with the derivatives of the value `l`: the largest relative
    /// difference of the derivatives along the directions, and of their derivatives. `None` where there is no closed
    /// gradient.
    pub fn closed_gradient(&self, lagrangian: &impl Lagrangian<N>, l: &Second) -> Option<f64> {
        let [q, v] =
            [(0, &self.x.q), (1, &self.x.v)].map(|(kind, c)| c.map_with_location(|i, _, c| self.seed(kind, i, c).re));
        let x = VelocityPoint { q, v, z: self.seed(2, 0, self.x.z).re };
        let closed = lagrangian.closed_gradient(First::constant(self.clock()), &x)?;
        let sum = |kind: usize, part: &SVector<First, N>| {
            (0..N).fold(First::constant(Moving::from(0.0)), |sum, i| {
                sum + part[i] * self.direction(Along::Outer, kind, i)
            })
        };
        let along = [sum(0, &closed.x), sum(1, &closed.y), closed.z * self.direction(Along::Outer, 2, 0)];
        Some(max_abs_or_nan(along.iter().zip(&l.d).flat_map(|(closed, derived)| {
            let parts = |a: &First| [a.re, a.d[0], a.d[1], a.d[2]].map(|m| entries(&m));
            let pairs = parts(closed).into_iter().flatten().zip(parts(derived).into_iter().flatten());
            pairs.map(|(closed, derived)| mismatch(closed, derived))
        })))
    }

    /// The defect of the closed second derivatives, likewise. It is not inlined, since the matrices need much stack
    /// space.
    #[inline(never)]
    pub fn closed_hessian(&self, lagrangian: &impl Lagrangian<N>, l: &Second) -> Option<f64> {
        let x = VelocityPoint { q: self.x.q.map(Rounded::from), v: self.x.v.map(Rounded::from), z: self.x.z.into() };
        let closed = lagrangian.closed_hessian(self.t.into(), &x)?;
        let (a, b) = (Along::Inner, Along::Outer);
        let vector = |along, kind| SVector::<Rounded, N>::from_fn(|i, _| self.direction(along, kind, i).into());
        let number = |along| Rounded::from(self.direction(along, 2, 0));
        let form = |m: &SMatrix<Rounded, N, N>, left, right| vector(b, left).dot(&(m * vector(a, right)));
        let along = [
            (form(&closed.qq, 0, 0), 0, 0),
            (form(&closed.qv, 0, 1), 0, 1),
            (form(&closed.vv, 1, 1), 1, 1),
            (vector(b, 0).dot(&closed.qz) * number(a), 0, 2),
            (vector(b, 1).dot(&closed.vz) * number(a), 1, 2),
            (number(b) * closed.zz * number(a), 2, 2),
        ];
        Some(max_abs_or_nan(along.into_iter().map(|(closed, i, j)| mismatch(closed, l.d[i].d[j].re))))
    }
}

/// A number with its derivatives along the line and in time.
pub(crate) fn entries(m: &Moving) -> [Rounded; 3] {
    [m.re, m.d[0], m.d[1]]
}

/// The difference of a closed derivative from the derived one, relative to the terms of both. It is infinite where only
/// the closed one is not finite, and NaN where the derived one is not finite.
fn mismatch(closed: Rounded, derived: Rounded) -> f64 {
    let relative = (closed - derived).relative();
    if relative.is_nan() && derived.relative().is_finite() { f64::INFINITY } else { relative }
}

/// The defects of the closed gradient and of the closed Hessian of a Lagrangian at a point: the largest difference from
/// the derived ones, relative to the size of its terms. `None` where there is no closed form; NaN where L is not
/// smooth.
///
/// A correct closed form gives a few units of round-off, a wrong one a number of order one, independent of the units.
/// The derivatives are compared along directions without special symmetry. Call this function in tests of a Lagrangian,
/// at several points.
pub fn check_closed_derivatives<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> (Option<f64>, Option<f64>) {
    let probe = Probe::new(t, x);
    let l = probe.value(lagrangian);
    (probe.closed_gradient(lagrangian, &l), probe.closed_hessian(lagrangian, &l))
}
