//! What impacts do to the contact form: statements, on random systems.

use crate::common::draws::Draws;
use contact_geom::nalgebra::SVector;
use contact_geom::switching::{Impact, Surface};
use contact_geom::{ChartVector, Derivatives, Dual, Lagrangian, Scalar, VelocityPoint};

/// A Lagrangian that is nonlinear in all its arguments, with a mass matrix of the positions.
struct Nonlinear;

impl Lagrangian<2> for Nonlinear {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let kinetic = v[0] * v[0] * (q[1].cos() + 3.0) * 0.5 + v[1] * v[1] * 0.7 + v[0] * v[1] * 0.3;
        kinetic - (q[0] * q[1]).sin() * 0.4 + t.cos() * q[0] * 0.2 + z * 0.1 - z * z * 0.05
    }
}

/// A curved surface that moves.
struct Moving;

impl Surface<2> for Moving {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>) -> T {
        q[1] - q[0].sin() * 0.3 - t * 0.1
    }
}

/// A point of the surface at which the motion arrives.
fn arrival(draws: &mut Draws) -> (f64, VelocityPoint<2>) {
    let (t, x) = (draws.between(-1.0, 1.0), draws.between(-1.0, 1.0));
    let v = [draws.between(-1.0, 1.0), draws.between(-3.0, -1.0)];
    (t, VelocityPoint::new([x, 0.3 * x.sin() + 0.1 * t], v, draws.between(-1.0, 1.0)))
}

fn energy(t: f64, x: &VelocityPoint<2>) -> f64 {
    let (value, slope) = Nonlinear.with_gradient(t, x);
    x.v.dot(&slope.y) - value
}

/// Newton's law is not contact: on some vector the form differs by more than a tenth.
#[test]
fn the_law_of_newton_is_not_contact() {
    let (t, x) = arrival(&mut Draws::of(3));
    let (normal, rate) = Moving.normal(t, &x.q);
    let y = Impact::Restitution(0.5).after(&Nonlinear, t, &x, (&normal, rate)).unwrap();
    let dq = SVector::from([0.0, -rate / normal[1]]);
    let form = |x: &VelocityPoint<2>| -Nonlinear.gradient(t, x).y.dot(&dq) + energy(t, x);
    assert!((form(&y) - form(&x)).abs() > 0.1);
    let [before, after] = [x, y].map(|x| normal.dot(&x.v) + rate);
    assert!((after + 0.5 * before).abs() <= 8.0 * f64::EPSILON * before.abs());
}

/// At normal incidence on a surface at rest with a vanishing potential the conformal law has the restitution
/// `sqrt(lambda)`.
#[test]
fn the_conformal_law_has_the_restitution_of_the_root() {
    let free = contact_examples::systems::FreeParticle { gamma: 0.0 };
    struct Wall;
    impl Surface<1> for Wall {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>) -> T {
            q[0]
        }
    }
    let x = VelocityPoint::new([0.0], [-2.0], 0.5);
    let normal = Wall.normal(0.0, &x.q);
    let y = Impact::Conformal(0.64).after(&free, 0.0, &x, (&normal.0, normal.1)).unwrap();
    assert!((y.v[0] - 1.6).abs() <= 4.0 * f64::EPSILON && (y.z - 0.32).abs() <= f64::EPSILON);
}

type Number = Dual<f64, ChartVector<2>>;

/// The flow of `L = |v|^2/2 - y` for a time, over dual numbers.
fn flight(x: &VelocityPoint<2, Number>, t: Number) -> VelocityPoint<2, Number> {
    let v = SVector::from([x.v[0], x.v[1] - t]);
    let q = SVector::from([x.q[0] + x.v[0] * t, x.q[1] + x.v[1] * t - t * t * 0.5]);
    // The integral of |v|^2/2 - y.
    let rate = x.v.dot(&x.v) * 0.5 - x.q[1];
    VelocityPoint { q, v, z: x.z + rate * t - x.v[1] * t * t + t * t * t * (1.0 / 3.0) }
}

struct Field;

impl Lagrangian<2> for Field {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        v.dot(v) * 0.5 - q[1]
    }
}

struct Ground;

impl Surface<2> for Ground {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>) -> T {
        q[1]
    }
}

/// The flow with an impact in it, `Phi(q0, p0, z0)` after a fixed time, satisfies `Phi* eta = lambda eta`. The time of
/// the impact depends on the start; the derivatives are those of dual numbers.
#[test]
fn the_flow_through_an_impact_is_conformally_contact() {
    for (law, factor) in [(Impact::Elastic, 1.0), (Impact::Conformal(0.7), 0.7)] {
        for case in 0..64 {
            let draws = &mut Draws::of(case);
            let q = [draws.between(-1.0, 1.0), draws.between(0.5, 1.5)];
            let p = [draws.between(-1.0, 1.0), draws.between(-1.0, 1.0)];
            let mut seeds = [q[0], q[1], p[0], p[1], draws.between(-1.0, 1.0)].map(Number::constant);
            for i in 0..2 {
                (seeds[i].d.x[i], seeds[2 + i].d.y[i]) = (1.0, 1.0);
            }
            seeds[4].d.z = 1.0;
            let start = VelocityPoint::new([seeds[0], seeds[1]], [seeds[2], seeds[3]], seeds[4]);
            let hit = start.v[1] + (start.v[1] * start.v[1] + start.q[1] * 2.0).sqrt();
            let at = flight(&start, hit);
            let (normal, rate) = Ground.normal(Number::constant(0.0), &at.q);
            let after = law.after(&Field, Number::constant(0.0), &at, (&normal, rate)).unwrap();
            let end = flight(&after, -hit + 4.0);
            // eta = dz - p dq at the end, as a covector at the start.
            let eta = |z: &Number, p: [f64; 2], q: [&Number; 2]| {
                let of = |part: fn(&ChartVector<2>) -> [f64; 5]| {
                    let [z, a, b] = [z, q[0], q[1]].map(|n| part(&n.d));
                    std::array::from_fn::<f64, 5, _>(|i| z[i] - p[0] * a[i] - p[1] * b[i])
                };
                of(|d| [d.x[0], d.x[1], d.y[0], d.y[1], d.z])
            };
            let pulled = eta(&end.z, [end.v[0].re, end.v[1].re], [&end.q[0], &end.q[1]]);
            let expected = eta(&start.z, p, [&start.q[0], &start.q[1]]).map(|e| factor * e);
            for (found, expected) in pulled.iter().zip(expected) {
                // The derivatives are of size ten; some tens of operations.
                assert!((found - expected).abs() <= 2e-13, "{law:?}, case {case}: {found} for {expected}");
            }
        }
    }
}

/// A slow impact where the potential is high has a state, although the round-off of its energy is larger than that of its
/// velocity.
#[test]
fn a_slow_impact_in_a_high_potential_has_a_state() {
    struct High(f64);
    impl Lagrangian<1> for High {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
            v[0] * v[0] * 0.65 - q[0].cos() * self.0
        }
    }
    let mut draws = Draws::of(17);
    for _ in 0..2000 {
        let height = 10.0_f64.powf(draws.between(-1.0, 6.0));
        let (wall, approach) = (draws.between(-1.0, 1.0), -(10.0_f64.powf(draws.between(-3.0, 0.0))));
        let x = VelocityPoint::new([draws.between(0.0, 1.0)], [wall + approach], 0.0);
        let y = Impact::Elastic.after(&High(height), 0.0, &x, (&SVector::from([1.0]), -wall)).unwrap();
        // The round-off of the energies, and of the impulse that moves with the wall, over the slope of the energy.
        let (of_energy, slope) =
            (2.0 * (height + 2.0 * x.v[0].powi(2)) + 2.6 * (approach * wall).abs(), 1.3 * approach);
        let bound = 8.0 * f64::EPSILON * (x.v[0].abs() + wall.abs() + of_energy / slope.abs());
        assert!((y.v[0] - (wall - approach)).abs() <= bound, "{height} {wall} {approach}: {}", y.v[0]);
    }
}
