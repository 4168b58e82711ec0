//! The linear oscillator `q'' = -omega^2 q + gamma q'`, whose motion is known.

use crate::lagrangians::One;
use crate::second_derivatives::systems::Oscillator;
use contact_geom::nalgebra::SVector;
use contact_geom::{Dual, Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::Variable;
use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};

/// `(q, v)` at the time t: `q = e^(gamma t / 2) (q0 cos + (v0 - gamma q0 / 2) sin / w)` with the angle `w t`, where
/// `w^2 = omega^2 - gamma^2 / 4`.
fn motion<T: Scalar>([q0, v0, omega, gamma, t]: [T; 5]) -> [T; 2] {
    let half = gamma * 0.5;
    let w = (omega * omega - half * half).sqrt();
    let (decay, b) = ((half * t).exp(), (v0 - half * q0) / w);
    let (cos, sin) = ((w * t).cos(), (w * t).sin());
    let q = decay * (q0 * cos + b * sin);
    [q, half * q + decay * w * (b * cos - q0 * sin)]
}

type Along = Dual<f64, SVector<f64, 5>>;

/// The second derivatives of the closed form, by nested dual numbers.
fn second_derivatives(x: [f64; 5]) -> [[[f64; 5]; 5]; 2] {
    let number = |i: usize| {
        let unit = |i: usize| SVector::<f64, 5>::from_fn(|j, _| f64::from(u8::from(i == j)));
        let d = SVector::<Along, 5>::from_fn(|j, _| Dual::from(f64::from(u8::from(i == j))));
        Dual { re: Dual { re: x[i], d: unit(i) }, d }
    };
    motion(std::array::from_fn(number)).map(|of| std::array::from_fn(|i| std::array::from_fn(|j| of.d[i].d[j])))
}

/// Steps of 16 stages over a quarter of a period are exact to round-off, which is amplified by the numbers of steps and of
/// oscillations twice, once for each derivative in omega: `1e4 eps`. The motion is linear in the start.
#[test]
fn a_linear_oscillator() {
    let (x, t) = ([0.8, -0.3, 1.3, -0.2], 7.0);
    let oscillator = One::from(Oscillator { omega: x[2], gamma: x[3] });
    let problem = Problem::new(&oscillator, 0.0, VelocityPoint::new([x[0]], [x[1]], 0.1)).unwrap();
    let parameter = |name: &str| Variable::Parameter(name.into());
    let variables =
        [Variable::Position(0), Variable::Velocity(0), parameter("omega"), parameter("gamma"), Variable::EndTime];
    let run = problem.by(GaussCollocation { stages: 16 }).steps(Steps::Count(8));
    let end = run.second_tangent(&variables, Until::Time(t)).unwrap().end.unwrap();
    let expected = second_derivatives([x[0], x[1], x[2], x[3], t]);
    let size = expected.as_flattened().as_flattened().iter().fold(0.0, |m, x| if x.abs() > m { x.abs() } else { m });
    assert!(size > 10.0, "{size}");
    for i in 0..5 {
        for j in 0..5 {
            let second = &end.second[i][j];
            for (found, expected) in [second.q[0], second.v[0]].into_iter().zip([expected[0][i][j], expected[1][i][j]])
            {
                let apart = (found - expected).abs() / size;
                assert!(apart <= 1e4 * f64::EPSILON, "{i}, {j}: {found} and {expected}, apart {apart:e}");
            }
            if i < 2 && j < 2 {
                assert_eq!((second.q[0], second.v[0], second.p[0]), (0.0, 0.0, 0.0), "{i}, {j}");
            }
        }
    }
}
