//! Declared structure that holds at the start of a motion, and not along it.

use crate::common::draws::Draws;
use crate::lagrangians::One;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use discrete_herglotz::{AnyIntegrator, InputError, Problem, Status, Steps, Until};

/// The term that a bump at `10 < q < 16` changes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bumped {
    Drag,
    Mass,
    Force,
}

/// A body on a slope with a bump.
#[derive(Clone, Copy, Debug)]
pub struct Bump {
    of: Bumped,
    /// Its centre and half width.
    at: f64,
    half: f64,
    height: f64,
    /// Whether it has a jump at its edges.
    plateau: bool,
    slope: f64,
}

impl Lagrangian<1> for Bump {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let u = (q[0] - self.at) * self.half.recip();
        let room = -(u * u) + 1.0;
        let zero = T::from(0.0);
        // A smooth function, or a constant.
        let inside = if self.plateau { T::from(1.0) } else { (-(room.recip()) + 1.0).exp() };
        let bump = zero.if_less(room, inside, zero) * self.height;
        let kinetic = v[0] * v[0] * 0.5;
        let rest = q[0] * self.slope + z * -0.05;
        match self.of {
            Bumped::Drag => kinetic + rest - bump * z,
            Bumped::Mass => kinetic * (bump + 1.0) + rest,
            Bumped::Force => kinetic + rest - bump,
        }
    }
    fn structure(&self) -> Structure {
        let all = Structure {
            autonomous: true,
            z_affine: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        };
        if self.of == Bumped::Force { Structure { quadratic: true, ..all } } else { all }
    }
}

#[test]
fn claims_that_are_false_beyond_the_start_are_found_along_the_motion() {
    let (mut silent, mut seen, mut other) = (Vec::new(), 0, 0);
    let integrators: Vec<_> = AnyIntegrator::all();
    for case in 0..500 {
        let mut draws = Draws::of(case);
        let of = [Bumped::Drag, Bumped::Mass, Bumped::Force][(draws.next() * 3.0) as usize];
        let bump = Bump {
            of,
            at: 13.0,
            half: 3.0,
            height: draws.between(0.2, 2.0),
            plateau: of != Bumped::Force && draws.next() < 0.3,
            slope: draws.between(0.0, 0.5),
        };
        let start = VelocityPoint::new([draws.between(-1.0, 1.0)], [draws.between(1.5, 5.0)], 0.0);
        let system = One::from(bump);
        let problem = Problem::new(&system, 0.0, start).unwrap();
        let integrator = integrators[(draws.next() * integrators.len() as f64) as usize];
        if integrator.check(&system).is_err() {
            continue;
        }
        let span = draws.between(15.0, 60.0);
        let run = if draws.next() < 0.4 {
            problem.by(integrator).accuracy(1e-9)
        } else {
            let stages = if let AnyIntegrator::Gauss { stages } = integrator { stages as f64 } else { 1.0 };
            problem.by(integrator).steps(Steps::Size(stages * f64::exp(draws.between(-6.0, -0.7))))
        };
        match run.run(Until::Time(span)) {
            Ok(end) => match end.status {
                Status::FalseClaim { .. } => seen += 1,
                Status::Completed if end.q[0] > 11.0 && end.unresolved.is_none() => {
                    silent.push((case, bump, integrator.to_string(), end.steps, end.q[0]))
                }
                _ => other += 1,
            },
            Err(InputError::FalseClaim { .. }) => seen += 1,
            Err(_) => other += 1,
        }
    }
    assert!(silent.is_empty() && seen > 300, "{seen} seen, {other} others; silent: {silent:#?}");
}
