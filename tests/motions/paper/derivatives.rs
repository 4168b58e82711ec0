//! Derivatives by dual numbers against another library, and the function that checks closed derivatives.

use crate::common::{on_random, within};
use contact_examples::systems::{Pendulum, System, SystemVisitor, visit_catalogue};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, Derivatives, Dual, Hessian, Lagrangian, Scalar, VelocityPoint, WithoutClosedDerivatives,
    check_closed_derivatives,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use num_dual::HyperDual64;

/// All second derivatives, and with them all first derivatives, of every Lagrangian against hyper-dual numbers of
/// another library.
#[test]
fn against_num_dual() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            on_random(system.name(), 2 * N + 2, |u| {
                let (t, x) = system.sample(u);
                let (g, h) = (system.gradient(t, &x), system.hessian(t, &x));
                let size = 1.0
                    + g.max_abs_or_nan()
                        .max_or_nan(h.qq.max_abs_or_nan())
                        .max_or_nan(h.qv.max_abs_or_nan())
                        .max_or_nan(h.vv.max_abs_or_nan());
                for i in 0..=2 * N {
                    for j in i..=2 * N {
                        let along = |k: usize, re: f64| {
                            let unit = |at: usize| f64::from(u8::from(at == k));
                            HyperDual64::new(re, unit(i), unit(j), 0.0)
                        };
                        let l = system.value(
                            HyperDual64::from(t),
                            &SVector::from_fn(|k, _| along(k, x.q[k])),
                            &SVector::from_fn(|k, _| along(N + k, x.v[k])),
                            along(2 * N, x.z),
                        );
                        let second = match (i, j) {
                            _ if j < N => h.qq[(i, j)],
                            _ if i < N && j < 2 * N => h.qv[(i, j - N)],
                            _ if i < N => h.qz[i],
                            _ if j < 2 * N => h.vv[(i - N, j - N)],
                            _ if i < 2 * N => h.vz[i - N],
                            _ => h.zz,
                        };
                        let defect = (l.eps1 - g.component(i)).abs().max_or_nan((l.eps1eps2 - second).abs()) / size;
                        within(defect).map_err(|e| format!("{i}, {j}: {e}"))?;
                    }
                }
                Ok(())
            });
        }
    }
    visit_catalogue(&mut Visitor);
}

/// A number with its first and second derivative.
type Second = Dual<Dual<f64, SVector<f64, 1>>, SVector<Dual<f64, SVector<f64, 1>>, 1>>;

/// The elementary functions that no system of the catalogue uses, by the identities between them.
#[test]
fn elementary_functions() {
    on_random("elementary functions", 1, |u| {
        let x = Dual {
            re: Dual { re: 0.1 + u[0], d: SVector::<f64, 1>::new(1.0) },
            d: SVector::<_, 1>::new(Dual::from(1.0)),
        };
        let one = Dual::from(1.0);
        let pairs = [
            (x.sinh(), (x.exp() - (-x).exp()) * 0.5),
            (x.cosh(), (x.exp() + (-x).exp()) * 0.5),
            (x.tanh(), x.sinh() / x.cosh()),
            (x.exp_m1(), x.exp() - 1.0),
            (x.ln_1p(), (x + 1.0).ln()),
            (x.atan().tan(), x),
            (x.recip(), one / x),
            (x.powf(1.5), x * x.sqrt()),
            (x.powi(-3), one / (x * x * x)),
            (x.powi(0), one),
        ];
        for (k, (a, b)) in pairs.iter().enumerate() {
            let size = |x: &Second| x.re.re.abs().max_or_nan(x.re.d[0].abs()).max_or_nan(x.d[0].d[0].abs());
            let defect = size(&(*a - *b)) / (1.0 + size(b));
            if defect > 64.0 * f64::EPSILON {
                return Err(format!("{k}: {defect:e}"));
            }
        }
        Ok(())
    });
}

/// Closed derivatives that are right pass the check, and wrong ones fail it; without closed derivatives there is
/// nothing to check.
#[test]
fn closed_derivatives() {
    struct Closed {
        error: f64,
    }
    impl Lagrangian<1> for Closed {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            v[0] * v[0] * 0.5 + q[0].cos() - z * z * 0.1
        }
        fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<1, T>) -> Option<ChartVector<1, T>> {
            Some(ChartVector { x: -x.q.map(T::sin), y: x.v * T::from(1.0 + self.error), z: x.z * -0.2 })
        }
        fn closed_hessian<T: Scalar>(&self, _t: T, x: &VelocityPoint<1, T>) -> Option<Hessian<1, T>> {
            let zero = T::zero();
            Some(Hessian {
                qq: SVector::from([-x.q[0].cos()]),
                qv: SVector::from([zero]),
                vv: SVector::from([T::from(1.0 - self.error)]),
                qz: SVector::from([zero]),
                vz: SVector::from([zero]),
                zz: T::from(-0.2),
            })
        }
    }
    let x = VelocityPoint::new([0.7], [0.4], 0.3);
    let right = check_closed_derivatives(&Closed { error: 0.0 }, 0.0, &x);
    assert!(matches!(right, (Some(g), Some(h)) if g < 1e-15 && h < 1e-15), "{right:?}");
    let wrong = check_closed_derivatives(&Closed { error: 1e-3 }, 0.0, &x);
    assert!(matches!(wrong, (Some(g), Some(h)) if g > 1e-4 && h > 1e-4), "{wrong:?}");
    let value_only = WithoutClosedDerivatives(Pendulum::default());
    assert_eq!(check_closed_derivatives(&value_only, 0.0, &x), (None, None));
    assert_eq!(value_only.gradient(0.0, &x), Pendulum::default().gradient(0.0, &x));
}
