//! Derivatives of runs across kinks, named times, resets of any kind, and jumps.

use crate::gradients::impacts::Floor;
use crate::gradients::runs::Case;
use crate::lagrangians::{SwitchingOne, SwitchingTwo};
use contact_examples::systems::UniformField;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::switching::{Breaks, Control, Impact, Impacts, Surface};
use contact_geom::{Hints, Lagrangian, Parametric, Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::{EndCovector, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Status, Steps, Until};

/// Implements [`Parametric`] for a type with these fields, whose formula is `formula(theta, t, q, v, z)`.
macro_rules! parametric {
    ($system:ident, $n:literal, $($field:ident),+) => {
        impl Parametric<$n> for $system {
            fn parameter_names(&self) -> Vec<String> {
                [$(stringify!($field)),+].map(String::from).into()
            }
            fn parameters(&self) -> Vec<f64> {
                vec![$(self.$field),+]
            }
            fn parameter_count(&self) -> usize {
                [$(stringify!($field)),+].len()
            }
            fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
                let [$($field),+] = *theta else { return None };
                Some($system { $($field),+ })
            }
            fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, $n>, v: &SVector<T, $n>, z: T) -> T {
                formula::$system(theta, t, q, v, z)
            }
        }
    };
}

#[allow(non_snake_case)]
mod formula {
    use super::*;

    pub fn Kinked<T: Scalar>(theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let outside = q[0] - theta[0];
        let spring = T::zero().if_less(outside, outside * theta[1], T::zero());
        v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 - spring - z * 0.1
    }

    pub fn Pushed<T: Scalar>(theta: &[T], t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let (zero, push) = (T::zero(), theta[0]);
        let force = t.if_less(T::from(0.7), zero, t.if_less(T::from(1.35), push, zero));
        v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 + q[0] * force * t
    }

    pub fn Bouncing<T: Scalar>(theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - q[0] * theta[0] - z * 0.05
    }

    pub fn Region<T: Scalar>(theta: &[T], t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let (zero, inside) = (T::zero(), Region::surface([theta[2], theta[3], theta[4]], t, q));
        let potential = inside.if_less(zero, theta[0] * (q[0] * 0.3 + 1.0), zero);
        let mass = inside.if_less(zero, theta[1], T::one());
        dot(v, v) * mass * 0.5 - potential - q[1] * 0.1 - z * 0.05
    }

    pub fn Step<T: Scalar>(theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - T::zero().if_less(q[0], theta[0], T::zero())
    }
}

/// A spring with a further constant force k beyond a distance a.
pub struct Kinked {
    a: f64,
    k: f64,
}

impl Lagrangian<1> for Kinked {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        formula::Kinked(&[self.a, self.k].map(T::from), t, q, v, z)
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0] - self.a);
    }
}

parametric!(Kinked, 1, a, k);

/// The derivative is that of the branch that is taken: across the kink in and out, with the switching function by
/// differences.
#[test]
fn a_kink() {
    let system = SwitchingOne::from(Kinked { a: 0.4, k: 1.5 });
    for (stages, steps) in [(6, 4), (8, 3), (5, 10)] {
        let start = VelocityPoint::new([0.0], [1.0], 0.0);
        let case = Case {
            lagrangian: &system,
            t0: 0.0,
            start,
            from_momentum: false,
            t_end: 2.5,
            steps,
            method: GaussCollocation { stages },
        };
        let (_, tangent, _) = case.agree("kink", 1e-12);
        assert_eq!(tangent.switches.len(), 2);
        case.compare("kink", 1e-12, 1e-6);
    }
}

/// A force between two named times.
pub struct Pushed {
    push: f64,
}

impl Lagrangian<1> for Pushed {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        formula::Pushed(&[T::from(self.push)], t, q, v, z)
    }
}

parametric!(Pushed, 1, push);

/// Steps end at named times, which stay where they are when the times of the run move.
#[test]
fn named_times() {
    let system = SwitchingOne::from(Breaks::new(Pushed { push: 1.5 }, vec![0.7, 1.35]).unwrap());
    for steps in [3, 4, 7] {
        let start = VelocityPoint::new([0.3], [0.2], 0.0);
        let case = Case {
            lagrangian: &system,
            t0: 0.0,
            start,
            from_momentum: true,
            t_end: 2.0,
            steps,
            method: GaussCollocation { stages: 8 },
        };
        case.compare("named times", 1e-12, 1e-8);
    }
}

/// A ball whose resets are not written over scalars: with a restitution that depends on the velocity.
pub struct Bouncing {
    g: f64,
    e: f64,
}

impl Lagrangian<1> for Bouncing {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        formula::Bouncing(&[self.g, self.e].map(T::from), t, q, v, z)
    }
    fn switching_functions(&self, t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0] - 0.1 * t);
    }
    fn at_switch(&self, _index: usize, t: f64, x: &VelocityPoint<1>, rising: bool) -> Control<1> {
        if rising {
            return Control::Continue;
        }
        let v = [-self.e * x.v[0] / (1.0 + 0.1 * x.v[0] * x.v[0]) + 0.1 * t];
        Control::Replace(VelocityPoint { v: v.into(), z: x.z + x.v[0] * t, ..*x })
    }
}

parametric!(Bouncing, 1, g, e);

#[test]
fn resets_by_differences() {
    let system = SwitchingOne::from(Bouncing { g: 1.0, e: 0.9 });
    for steps in [2, 5] {
        let start = VelocityPoint::new([1.0], [0.1], 0.2);
        let case = Case {
            lagrangian: &system,
            t0: 0.0,
            start,
            from_momentum: false,
            t_end: 2.0,
            steps,
            method: GaussCollocation { stages: 6 },
        };
        let (_, tangent, _) = case.agree("reset", 1e-11);
        assert_eq!(tangent.switches.len(), 1);
        case.compare("reset", 1e-11, 1e-6);
    }
}

/// The half plane on the right of a wall.
#[derive(Clone, Copy)]
pub struct Wall;

impl Surface<2> for Wall {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>) -> T {
        q[0]
    }
}

/// A corner of two walls, where both resets occur at one instant: the order does not matter, and the derivative is that
/// of two reflections.
#[test]
fn two_impacts_at_one_instant() {
    let free = UniformField { field: [0.0, 0.0], gamma: 0.0 };
    let system = Impacts::new(Impacts::new(free, Floor, Impact::Elastic), Wall, Impact::Elastic);
    let system = SwitchingTwo::from(system);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0, 1.0], [-1.0, -1.0], 0.0)).unwrap();
    let variables: Vec<_> = Variable::all(&problem).into_iter().take(4).collect();
    for h in [0.3, 1.0, 2.0] {
        let run = problem.by(GaussCollocation { stages: 3 }).steps(Steps::Size(h));
        let tangent = run.tangent(&variables, Until::Time(2.0)).unwrap();
        assert_eq!(tangent.switches.len(), 2);
        for (k, column) in tangent.columns.iter().enumerate() {
            let mut expected = SVector::<f64, 2>::zeros();
            expected[k % 2] = if k < 2 { -1.0 } else { -2.0 };
            assert!((&column.q - expected).norm() <= 1e-13, "h = {h}, {:?}: {:?}", variables[k], column.q);
        }
    }
}

/// A step of the potential, at which the motion is refracted or reflected.
pub struct Step {
    height: f64,
}

impl Lagrangian<1> for Step {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        formula::Step(&[T::from(self.height)], t, q, v, z)
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
}

parametric!(Step, 1, height);

/// The motion from -1 with velocity 1 reaches the step at t = 1, and is at `sqrt(1 - 2 height)` or -1 at t = 2.
#[test]
fn refraction_and_reflection() {
    let variables = [Variable::Position(0), Variable::Velocity(0), Variable::Parameter("height".into())];
    let root = 0.6_f64.sqrt();
    for (height, expected) in [(0.2, [root, 1.0 / root + root, -1.0 / root]), (0.8, [-1.0, -2.0, 0.0])] {
        let system = SwitchingOne::from(Step { height });
        let problem = Problem::new(&system, 0.0, VelocityPoint::new([-1.0], [1.0], 0.0)).unwrap();
        let run = problem.by(GaussCollocation { stages: 3 }).steps(Steps::Size(0.3));
        let tangent = run.tangent(&variables, Until::Time(2.0)).unwrap();
        for (column, expected) in tangent.columns.iter().zip(expected) {
            assert!((column.q[0] - expected).abs() <= 1e-10, "height {height}: {} and {expected}", column.q[0]);
        }
    }
}

/// A region with another potential and another mass: a disk, or for `curvature` 0 a strip, that moves.
pub struct Region {
    height: f64,
    mass: f64,
    radius: f64,
    curvature: f64,
    velocity: f64,
}

impl Region {
    fn surface<T: Scalar>([radius, curvature, velocity]: [T; 3], t: T, q: &SVector<T, 2>) -> T {
        let x = q[0] - t * velocity;
        x * x + q[1] * q[1] * curvature - radius * radius
    }
}

impl Lagrangian<2> for Region {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        formula::Region(&self.parameters().into_iter().map(T::from).collect::<Vec<_>>(), t, q, v, z)
    }
    fn switching_functions(&self, t: f64, x: &VelocityPoint<2>, values: &mut Vec<f64>) {
        values.push(Region::surface([self.radius, self.curvature, self.velocity], t, &x.q));
    }
}

parametric!(Region, 2, height, mass, radius, curvature, velocity);

/// A jump of the potential alone, of the mass alone, and of both, at a surface that is straight or curved, at rest or moving;
/// the motion enters and leaves the region, or is reflected by it.
#[test]
fn jumps_across_surfaces() {
    let jumps = [(0.2, 1.0, 2), (0.0, 1.2, 2), (0.0, 0.8, 2), (0.2, 1.2, 2), (3.0, 1.0, 1), (3.0, 1.2, 1)];
    for (height, mass, switches) in jumps {
        for (curvature, velocity) in [(0.0, 0.0), (0.0, 0.1), (1.0, 0.0), (1.0, 0.1)] {
            let system = SwitchingTwo::from(Region { height, mass, radius: 0.8, curvature, velocity });
            let start = VelocityPoint::new([-1.5, 0.2], [1.3, 0.1], 0.0);
            let method = GaussCollocation { stages: 6 };
            let case = Case { lagrangian: &system, t0: 0.0, start, from_momentum: false, t_end: 3.0, steps: 5, method };
            let name = format!("height {height}, mass {mass}, curvature {curvature}, velocity {velocity}");
            let (_, tangent, _) = case.agree(&name, 1e-11);
            assert_eq!(tangent.switches.len(), switches, "{name}");
            case.compare(&name, 1e-11, 1e-5);
        }
    }
}

/// Impacts that accumulate before the end: the run has a status and no gradient.
#[test]
fn accumulating_impacts() {
    let system = Impacts::new(UniformField { field: [-1.0], gamma: 0.0 }, Floor, Impact::Restitution(0.5));
    let system = SwitchingOne::from(system);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let run = problem.by(GaussCollocation { stages: 3 }).steps(Steps::Size(0.3));
    let found = run.gradient_of(|end| (end.q[0], EndCovector::zero(1)), Until::Time(6.0)).unwrap();
    assert!(found.loss.is_none() && found.outcome.status != Status::Completed, "{}", found.outcome.status);
}
