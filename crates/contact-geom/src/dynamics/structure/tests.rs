//! Structure claims: false claims are detected in any units, true claims hold to the rounding of their terms, and there
//! is no result where L is not defined.

use super::*;
use crate::{ChartVector, Hessian, Scalar, check_closed_derivatives};
use nalgebra::SVector;

/// `v^2/2 - q^2/2` plus one more term, in given units of action, time and length.
struct Scaled {
    term: Term,
    claims: Structure,
    /// The units of the action, the time and the length.
    units: [f64; 3],
}

/// The additional term, which may violate a claim.
#[derive(Clone, Copy, Debug)]
enum Term {
    /// No additional term.
    Nothing,
    /// A force `0.5 cos(0.7 t)`.
    Force,
    /// `-0.3 z cos t`.
    DragInTime,
    /// `-0.05 z^2`.
    NonlinearDrag,
    /// `-0.05 z`.
    Drag,
    /// A wall `(q/1.5)^40`.
    Wall,
    /// `q v^3`.
    Magnetic,
    /// `1e-9 v`.
    LinearInVelocity,
    /// `v^2 sin t`.
    MassInTime,
    /// `q^2 sin(t)^2 + q^2 cos(t)^2 - q^2`, which is zero up to rounding.
    Cancelling,
}

impl Lagrangian<1> for Scaled {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let [action, time, length] = self.units;
        let (t, q, v, z) = (t / time, q[0] / length, v[0] * (time / length), z / action);
        let more = match self.term {
            Term::Nothing => T::zero(),
            Term::Force => q * (t * 0.7).cos() * 0.5,
            Term::DragInTime => z * t.cos() * -0.3,
            Term::NonlinearDrag => z * z * -0.05,
            Term::Drag => z * -0.05,
            Term::Wall => (q / 1.5).powi(40),
            Term::Magnetic => q * v.powi(3),
            Term::LinearInVelocity => v * 1e-9,
            Term::MassInTime => v * v * t.sin(),
            Term::Cancelling => {
                let (s, c) = t.sin_cos();
                q * q * s * s + q * q * c * c - q * q
            }
        };
        (v * v * 0.5 - q * q * 0.5 + more) * (action / time)
    }
    fn structure(&self) -> Structure {
        self.claims
    }
}

/// A time and a point in the given units.
fn point([action, time, length]: [f64; 3], q: f64) -> (f64, VelocityPoint<1>) {
    (0.4 * time, VelocityPoint::new([q * length], [0.7 * length / time], 0.3 * action))
}

const NOTHING: Structure = Structure {
    autonomous: false,
    z_free: false,
    z_affine: false,
    constant_rate: false,
    separable: false,
    quadratic: false,
    constant_mass: false,
};

/// Units from 1e-40 to 1e40, for which third derivatives of L stay in the range of a double.
fn all_units() -> impl Iterator<Item = [f64; 3]> {
    let sizes = [1e-40, 1e-12, 1.0, 1e12, 1e40];
    sizes.into_iter().flat_map(move |a| sizes.into_iter().flat_map(move |t| sizes.map(|l| [a, t, l])))
}

#[test]
fn a_false_claim_is_seen_in_all_units() {
    let autonomous = Structure { autonomous: true, ..NOTHING };
    let constant_rate = Structure { constant_rate: true, ..NOTHING };
    let z_affine = Structure { z_affine: true, ..NOTHING };
    let z_free = Structure { z_free: true, ..NOTHING };
    let quadratic = Structure { quadratic: true, ..NOTHING };
    let separable = Structure { separable: true, ..NOTHING };
    let constant_mass = Structure { constant_mass: true, ..NOTHING };
    let cases = [
        (Term::Force, autonomous, 1.3),
        (Term::DragInTime, autonomous, 1.3),
        (Term::DragInTime, constant_rate, 1.3),
        (Term::NonlinearDrag, z_affine, 1.3),
        (Term::NonlinearDrag, constant_rate, 1.3),
        (Term::Drag, z_free, 1.3),
        (Term::NonlinearDrag, quadratic, 1.3),
        // Far from the wall, where its potential is 1e-46 of the oscillator's energy.
        (Term::Wall, quadratic, 0.1),
        (Term::Magnetic, separable, 1.3),
        (Term::LinearInVelocity, separable, 1.3),
        (Term::Magnetic, constant_mass, 1.3),
        (Term::MassInTime, constant_mass, 1.3),
        (Term::MassInTime, separable, 1.3),
    ];
    for (term, claims, q) in cases {
        for units in all_units() {
            let (t, x) = point(units, q);
            let defects: Vec<_> = claims.defects(&Scaled { term, claims, units }, t, &x).unwrap().collect();
            // One claim is made. Its derivative does not cancel, but each product adds to the size of the terms, so
            // that the relative size may be well below one.
            assert!(matches!(defects[..], [Defect { size, .. }] if size > 1e-3), "{term:?} {units:?}: {defects:?}");
        }
    }
}

#[test]
fn a_true_claim_holds_to_the_rounding_of_its_terms() {
    let all = Structure {
        autonomous: true,
        z_free: true,
        z_affine: true,
        constant_rate: true,
        separable: true,
        quadratic: true,
        constant_mass: true,
    };
    for term in [Term::Nothing, Term::Cancelling] {
        for units in all_units() {
            let (t, x) = point(units, 1.3);
            let defects: Vec<_> = all.defects(&Scaled { term, claims: all, units }, t, &x).unwrap().collect();
            assert_eq!(defects.len(), 7);
            // The size of the terms bounds the rounding error in units of epsilon.
            assert!(defects.iter().all(|d| d.size <= f64::EPSILON), "{term:?} {units:?}: {defects:?}");
        }
    }
}

/// A Lagrangian whose closed gradient is multiplied by a factor in one entry, and its closed Hessian in the block of
/// `L_vv`.
struct Closed {
    gradient: f64,
    hessian: f64,
}

impl Lagrangian<2> for Closed {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        (v[0] * v[0] + v[1] * v[1] - q[0] * q[0] * q[1] - z * z) * 0.5e-12
    }
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<2, T>) -> Option<ChartVector<2, T>> {
        let gradient = ChartVector {
            x: SVector::from([-x.q[0] * x.q[1], x.q[0] * x.q[0] * -0.5 * self.gradient]),
            y: x.v,
            z: -x.z,
        };
        Some(gradient.scale(T::from(1e-12)))
    }
    fn closed_hessian<T: Scalar>(&self, _t: T, x: &VelocityPoint<2, T>) -> Option<Hessian<2, T>> {
        use nalgebra::SMatrix;
        let scale = T::from(1e-12);
        let zero = T::zero();
        Some(Hessian {
            qq: SMatrix::<T, 2, 2>::new(-x.q[1], -x.q[0], -x.q[0], zero) * scale,
            qv: SMatrix::from_element(zero),
            vv: SMatrix::<T, 2, 2>::identity() * scale * T::from(self.hessian),
            qz: SVector::from_element(zero),
            vz: SVector::from_element(zero),
            zz: -scale,
        })
    }
}

#[test]
fn a_wrong_closed_derivative_is_seen() {
    let x = VelocityPoint::new([0.7, -0.2], [0.4, 0.9], 0.3);
    let sizes = |gradient, hessian| {
        let system = Closed { gradient, hessian };
        let of_claims: Vec<_> = NOTHING.defects(&system, 0.0, &x).unwrap().collect();
        assert_eq!([of_claims[0].claim, of_claims[1].claim], ["closed_gradient", "closed_hessian"]);
        let (g, h) = check_closed_derivatives(&system, 0.0, &x);
        let sizes = [g.unwrap(), h.unwrap()];
        assert_eq!(sizes, [of_claims[0].size, of_claims[1].size]);
        sizes
    };
    assert!(sizes(1.0, 1.0).iter().all(|size| *size <= f64::EPSILON));
    // A wrong sign in one of five components.
    assert!(sizes(-1.0, 1.0)[0] > 0.01);
    assert!(sizes(1.0, -1.0)[1] > 0.01);
    assert!(sizes(1.0, 1.0 + 1e-9)[1] > 1e-11);
    // A closed form that is NaN or infinite where the value is smooth.
    assert_eq!(sizes(f64::NAN, 1.0), [f64::INFINITY, sizes(1.0, 1.0)[1]]);
    assert_eq!(sizes(1.0, f64::INFINITY)[1], f64::INFINITY);
}

/// `v^2/2 + q^(3/2) + z`.
struct Root;

impl Lagrangian<1> for Root {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].powf(1.5) + z
    }
}

#[test]
fn where_a_lagrangian_is_not_defined_nothing_is_said() {
    let claims = Structure { z_free: true, quadratic: true, constant_mass: true, ..NOTHING };
    let at = |q: f64| claims.defects(&Root, 0.0, &VelocityPoint::new([q], [0.5], 0.0));
    // Outside the domain, at its boundary, where derivatives are infinite, and where they overflow.
    for q in [-1.0, 0.0, 1e300] {
        assert!(at(q).is_none(), "{q:e}: {:?}", at(q).unwrap().collect::<Vec<_>>());
    }
    let sizes: Vec<_> = at(1e-5).unwrap().map(|d| (d.claim, d.size > 0.01)).collect();
    assert_eq!(sizes, [("z_free", true), ("quadratic", true), ("constant_mass", false)]);
    assert!(NOTHING.defects(&Root, 0.0, &VelocityPoint::new([1.0], [0.5], 0.0)).is_some_and(|d| d.count() == 0));
    assert!(NOTHING.defects(&Root, 0.0, &VelocityPoint::new([-1.0], [0.5], 0.0)).is_none());
}
