//! Derivatives that are computed in blocks equal those that are computed along all directions at once.

use crate::{
    ChartVector, Derivatives, Dual, Lagrangian, Scalar, Structure, VelocityPoint,
    support::{derived_gradient, herglotz_rates, seed},
};
use nalgebra::SVector;

/// The dimension. Neither N nor `2N + 1` is a multiple of the block size.
const N: usize = 11;

/// A Lagrangian with second derivatives of every kind and no symmetry between the coordinates.
struct Generic;

impl Lagrangian<N> for Generic {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let mut sum = z * z * 0.1 + z * (q[0] + v[N - 1]).sin() * 0.2 - z * t * 0.3;
        for i in 0..N {
            let j = (i + 1) % N;
            sum += v[i] * v[i] * (q[i] * q[j] * 0.1 + t.cos() * 0.2 + (1.0 + i as f64)) * 0.5;
            sum += v[i] * v[j] * 0.1 + (q[i] * q[j]).sin() + v[i] * q[j] * z * 0.05;
        }
        sum
    }
    fn structure(&self) -> Structure {
        Structure::default()
    }
}

/// The same Lagrangian, with its derived gradient declared as a closed one.
struct Closed;

impl Lagrangian<N> for Closed {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        Generic.value(t, q, v, z)
    }
    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        Some(derived_gradient(&Generic, t, x))
    }
}

fn point() -> (f64, VelocityPoint<N>) {
    let x = VelocityPoint {
        q: SVector::from_fn(|i, _| 0.3 + 0.1 * i as f64),
        v: SVector::from_fn(|i, _| 0.7 - 0.2 * i as f64),
        z: 0.4,
    };
    (0.6, x)
}

/// The tolerance for sums of some twenty terms of size one to ten that are added in a different order.
const CLOSE: f64 = 200.0 * f64::EPSILON;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= CLOSE * (1.0 + b.abs())
}

#[test]
fn derivatives_are_those_of_all_directions_at_once() {
    fn compare(l: &impl Lagrangian<N>) {
        let (t, x) = point();
        let once = seed(&ChartVector::from(x));
        let first = l.value(Dual::from(t), &once.x, &once.y, once.z);
        let twice = seed(&once);
        let second = l.value(Dual::from(t), &twice.x, &twice.y, twice.z).d;
        let (value, g) = l.with_gradient(t, &x);
        let (of_force, force) = l.with_force(t, &x);
        assert!(close(value, first.re) && close(of_force, first.re));
        for i in 0..=2 * N {
            assert!(
                close(g.component(i), first.d.component(i)) && close(l.gradient(t, &x).component(i), g.component(i))
            );
        }
        let (h, w) = (l.hessian(t, &x), l.mass_matrix(t, &x));
        for i in 0..N {
            assert!(close(force[i], g.x[i]));
            for j in 0..N {
                let (of_q, of_v) = (second.x[i].d, second.y[i].d);
                assert!(close(h.qq[(i, j)], of_q.x[j]) && close(h.qv[(i, j)], of_q.y[j]), "{i}, {j}");
                assert!(close(h.vv[(i, j)], of_v.y[j]) && close(w[(i, j)], of_v.y[j]), "{i}, {j}");
            }
            assert!(close(h.qz[i], second.x[i].d.z) && close(h.vz[i], second.y[i].d.z));
        }
        assert!(close(h.zz, second.z.d.z));
        // W a = L_q + L_v L_z - (L_vq v + L_vz L + L_vt).
        let (xi, rate) = herglotz_rates(l, t, &x).unwrap();
        let in_time = {
            let still = VelocityPoint { q: x.q.map(Dual::from), v: x.v.map(Dual::from), z: Dual::from(x.z) };
            l.gradient(Dual { re: t, d: SVector::<f64, 1>::new(1.0) }, &still).y
        };
        for i in 0..N {
            let left = w.row(i).transpose().dot(&xi.y);
            let drift = h.qv.column(i).dot(&x.v) + h.vz[i] * value + in_time[i].d[0];
            assert!(close(left, g.x[i] + g.y[i] * g.z - drift), "{i}: {left}");
        }
        assert_eq!((xi.x, rate), (x.v, g.z));
        assert!(close(xi.z, value));
    }
    compare(&Generic);
    compare(&Closed);
}
