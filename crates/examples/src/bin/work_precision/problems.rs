//! The problems: Lagrangians, initial values, durations, and reference solutions.

use contact_examples::systems::{HarmonicOscillator, Kepler, Pendulum, QuadraticInZ};
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::SVector;

/// The Lagrangian of P1.
pub const OSCILLATOR: HarmonicOscillator = HarmonicOscillator { gamma: -0.05 };

/// The Lagrangian of P2.
pub const PENDULUM: Pendulum = Pendulum { gamma: -0.01 };

/// The Lagrangian of P3.
pub const KEPLER: Kepler<2> = Kepler { mu: 1.0, gamma: -1e-4 };

/// The Lagrangian of P6.
pub const QUADRATIC: QuadraticInZ = QuadraticInZ { c: 0.1 };

/// The drag of P7, of `-c |v| v`, and its gravity.
pub const DRAG: f64 = 0.02;
/// See [`DRAG`].
pub const GRAVITY: f64 = 9.81;

/// The equations of motion of a problem. Lagrangians differ in type and dimension, so that code that uses one matches on
/// this enum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum System {
    /// [`OSCILLATOR`].
    Oscillator,
    /// [`PENDULUM`].
    Pendulum,
    /// [`KEPLER`].
    Kepler,
    /// [`QUADRATIC`].
    Quadratic,
    /// A projectile with quadratic drag.
    Projectile,
    /// A double pendulum with a torque on its upper rod and friction in both joints.
    DoublePendulum,
}

/// A Lagrangian as text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Text {
    /// The formula.
    pub formula: &'static str,
    /// The names of the coordinates.
    pub coordinates: &'static [&'static str],
    /// The parameters.
    pub parameters: &'static [(&'static str, f64)],
}

/// An initial value problem from t = 0, with its solution at the final time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Problem {
    /// The name in tables and arguments.
    pub name: &'static str,
    /// A description for titles.
    pub title: &'static str,
    /// The equations of motion.
    pub system: System,
    /// The Lagrangian as text, of a problem that is solved by it; without one it is solved by a Rust type.
    pub text: Option<Text>,
    /// The final time, a whole number of time units.
    pub duration: f64,
    /// The initial values, in the order q, v, z.
    pub start: &'static [f64],
    /// The final state in the same order.
    pub end: &'static [f64],
    /// The smallest root mean square of (q, v) towards the end of the motion; absolute tolerances are relative to it.
    pub amplitude: f64,
    /// The largest |z| during the last `max(7, T/100)` time units; errors of z are relative to it.
    pub z_scale: f64,
}

// The final states are those of the initial values and parameters as doubles, rounded once: P1 from its closed form with
// 60 digits, P2, P3 and P6 by heyoka's Taylor method with 200 bits, where the result with 113 bits agrees to all digits of
// a double, P7 and P8 by extrapolation with 45 digits and two step sizes. The scales are taken from 2001 states near the
// end of the motion, those of P7 and P8 from about fifty.

const P1: Problem = Problem {
    name: "P1",
    title: "oscillator with drag",
    system: System::Oscillator,
    text: None,
    duration: 1000.0,
    start: &[1.0, 0.0, 0.0],
    end: &[1.1176166148212974e-11, -8.528426017237838e-12, -4.765755307569616e-23],
    amplitude: 9.940842882958946e-12,
    z_scale: 7.605478932373426e-23,
};

const P2: Problem = Problem {
    name: "P2",
    title: "pendulum with drag",
    system: System::Pendulum,
    text: None,
    duration: 1000.0,
    start: &[1.0, 1.0, 0.0],
    end: &[0.004560418507931897, 0.008546936292288776, -0.00033535425469830894],
    amplitude: 0.006850092588860796,
    z_scale: 0.00040832851245717816,
};

const P3: Problem = Problem {
    name: "P3",
    title: "Kepler problem with drag, e = 0.5",
    system: System::Kepler,
    text: None,
    duration: 2000.0,
    start: &[0.5, 0.0, 0.0, 1.7320508075688772, 0.0],
    end: &[-0.2355933153366884, 0.5741404019857265, -1.3045801099719607, 0.16965896370899058, 3366.2793866404986],
    amplitude: 0.6141731794526933,
    z_scale: 3366.279386640823,
};

const P6: Problem = Problem {
    name: "P6",
    title: "oscillator with drag proportional to the action",
    system: System::Quadratic,
    text: None,
    duration: 100.0,
    start: &[1.0, 0.0, 1.0],
    end: &[0.14829686459424563, 0.07506619014502397, 0.17297124462440955],
    amplitude: 0.11753061931125197,
    z_scale: 0.1849479143126594,
};

const P7: Problem = Problem {
    name: "P7",
    title: "projectile with quadratic drag",
    system: System::Projectile,
    text: Some(Text {
        formula: "force[x] = -c*hypot(x', y')*x'; force[y] = -c*hypot(x', y')*y'; (x'^2 + y'^2)/2 - g*y",
        coordinates: &["x", "y"],
        parameters: &[("c", DRAG), ("g", GRAVITY)],
    }),
    duration: 10.0,
    start: &[0.0, 0.0, 30.0, 40.0, 0.0],
    end: &[69.42065569058012, -105.96245379504258, 0.5841062809625457, -22.08018703052202, 3640.152627459584],
    amplitude: 27.078195286156504,
    z_scale: 3640.152627459584,
};

const P8: Problem = Problem {
    name: "P8",
    title: "driven double pendulum with friction in its joints",
    system: System::DoublePendulum,
    text: Some(Text {
        formula: "between = 0.15*(y' - x'); force[x] = 0.5*cos(0.9*t) - 0.1*x' + between; force[y] = -between;
            x'^2 + y'^2/2 + cos(x - y)*x'*y' - 2*(1 - cos(x)) - (1 - cos(y))",
        coordinates: &["x", "y"],
        parameters: &[],
    }),
    duration: 30.0,
    start: &[1.0, 1.2, 0.0, 0.0, 0.0],
    end: &[-0.4244868335807294, -0.5752155421335514, -0.11401599554278855, 0.12724615709823112, -1.0927409786712012],
    amplitude: 0.34486251604226437,
    z_scale: 1.8689066380006523,
};

/// The problem P1 by its Lagrangian as text, and so on.
const P1F: Problem = P1.by("P1f", "x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", OSCILLATOR.gamma)]);
const P2F: Problem = P2.by("P2f", "theta'^2/2 - 1 + cos(theta) + gamma*z", &["theta"], &[("gamma", PENDULUM.gamma)]);
const P3F: Problem = P3.by(
    "P3f",
    "(x'^2 + y'^2)/2 + mu/sqrt(x^2 + y^2) + gamma*z",
    &["x", "y"],
    &[("mu", KEPLER.mu), ("gamma", KEPLER.gamma)],
);
const P6F: Problem = P6.by("P6f", "x'^2/2 - x^2/2 - c*z^2/2", &["x"], &[("c", QUADRATIC.c)]);

/// The problems. A name with an `f` is that of a problem that is solved by a type and here by its Lagrangian as text.
pub const PROBLEMS: [Problem; 10] = [P1, P2, P3, P6, P7, P8, P1F, P2F, P3F, P6F];

impl Problem {
    /// The same problem by a Lagrangian as text.
    const fn by(
        self,
        name: &'static str,
        formula: &'static str,
        coordinates: &'static [&'static str],
        parameters: &'static [(&'static str, f64)],
    ) -> Self {
        Problem { name, text: Some(Text { formula, coordinates, parameters }), ..self }
    }

    /// Whether `L_v = v`, so that momenta are velocities.
    pub fn has_unit_mass(&self) -> bool {
        self.system != System::DoublePendulum
    }

    /// Whether the equation of motion depends on z, so that the problem cannot be solved without the action.
    pub fn needs_z(&self) -> bool {
        self.system == System::Quadratic
    }

    /// The largest relative tolerance with which the motion keeps its character: with a larger one, the orbit of P3
    /// collapses.
    pub fn coarsest_tolerance(&self) -> f64 {
        if self.system == System::Kepler { 2e-6 } else { 1.0 }
    }

    /// The number of components of (q, v).
    pub fn components(&self) -> usize {
        self.start.len() - 1
    }

    /// The initial values as a point, for the dimension of the problem.
    pub fn point<const N: usize>(&self) -> VelocityPoint<N> {
        let component = |i: usize| self.start.get(i).copied().unwrap_or(f64::NAN);
        VelocityPoint {
            q: SVector::from_fn(|i, _| component(i)),
            v: SVector::from_fn(|i, _| component(N + i)),
            z: component(2 * N),
        }
    }

    /// The error of a final state `q, v` or `q, v, z`: the 2-norm of the error of (q, v), relative to the norm of the
    /// solution.
    pub fn error(&self, state: &[f64]) -> f64 {
        let pairs = || state.iter().zip(self.end).take(self.components());
        let error: f64 = pairs().map(|(found, true_one)| (found - true_one).powi(2)).sum();
        let size: f64 = pairs().map(|(_, true_one)| true_one.powi(2)).sum();
        (error / size).sqrt()
    }

    /// The error of z in a final state, relative to the scale of the problem; `None` for a state without z.
    pub fn error_z(&self, state: &[f64]) -> Option<f64> {
        let (found, true_one) = state.iter().zip(self.end).nth(self.components())?;
        Some((found - true_one).abs() / self.z_scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The solution of P1 at a time: `e^(-gamma t) L` without its term in z is `-(cos 2wt + B sin 2wt)/2`, which has an
    /// elementary integral.
    fn oscillator(t: f64) -> [f64; 3] {
        let gamma = OSCILLATOR.gamma;
        let w = (1.0 - 0.25 * gamma * gamma).sqrt();
        let b = -0.5 * gamma / w;
        let (sin, cos) = (w * t).sin_cos();
        let (sin_2, cos_2) = (2.0 * w * t).sin_cos();
        let decay = (0.5 * gamma * t).exp();
        [decay * (cos + b * sin), -decay * sin / w, decay * decay * (b * (cos_2 - 1.0) - sin_2) / (4.0 * w)]
    }

    #[test]
    fn the_reference_of_p1_is_its_closed_form() {
        let problem = PROBLEMS[0];
        let end = oscillator(problem.duration);
        // A phase of about 1000 is rounded to 1e-13 in doubles.
        assert!(problem.error(&end) < 1e-12, "{:e}", problem.error(&end));
        assert!(problem.error_z(&end).is_some_and(|e| e < 1e-12));
        assert_eq!(oscillator(0.0).to_vec(), problem.start);
    }

    #[test]
    fn errors_are_relative_to_the_solution_and_to_the_scale_of_z() {
        for problem in PROBLEMS {
            assert_eq!(problem.error(problem.end), 0.0);
            assert_eq!(problem.error_z(problem.end), Some(0.0));
            let doubled: Vec<f64> = problem.end.iter().map(|x| 2.0 * x).collect();
            assert!((problem.error(&doubled) - 1.0).abs() < 1e-15);
            let mut off = problem.end.to_vec();
            off[problem.components()] += problem.z_scale;
            assert_eq!(problem.error(&off), 0.0, "z has no part in the error of (q, v)");
            assert!(problem.error_z(&off).is_some_and(|e| (e - 1.0).abs() < 1e-12));
            assert_eq!(problem.error_z(&off[..problem.components()]), None);
        }
    }

    #[test]
    fn a_start_is_a_point_of_its_dimension() {
        let kepler = PROBLEMS[2].point::<2>();
        assert_eq!((kepler.q[0], kepler.v[1], kepler.z), (0.5, 3f64.sqrt(), 0.0));
        assert!(PROBLEMS[2].point::<3>().z.is_nan(), "of another dimension");
    }
}
