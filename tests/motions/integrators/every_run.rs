//! All features of a run, by integrators without a name in the table: the exact flow, and a user's discrete Lagrangian.

use crate::common::observers::{Each, StopsAt};
use crate::lagrangians::{One, one};
use contact_examples::systems::{OneCoordinate, Pendulum, QuadraticInZ, System};
use contact_geom::{DiscretePoint, Lagrangian, Scalar, VelocityPoint, numbers::max_abs_or_nan};
use discrete_herglotz::{
    Checkpoint, CustomMethod, DiscreteLagrangian, Event, Events, Integrator, Outcome, Problem, ResumeState, Rows, Run,
    Status, StepError, StepView, Steps, Until,
};
use exact_lagrangian::ExactFlow;

/// The midpoint of the positions and of the actions, as a user would write it: `z1` by twelve fixed-point iterations.
struct Own<L> {
    lagrangian: L,
    h: f64,
}

impl<L: Lagrangian<1>> DiscreteLagrangian<1> for Own<L> {
    fn step_size(&self) -> f64 {
        self.h
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
        let (q, v) = ((x.q0 + x.q1) * T::from(0.5), (x.q1 - x.q0) * T::from(1.0 / self.h));
        let mut change = T::zero();
        for _ in 0..12 {
            change = self.lagrangian.value(T::from(t + 0.5 * self.h), &q, &v, x.z0 + change * 0.5) * self.h;
        }
        Ok(change)
    }
}

/// Every feature of a run, for one integrator on one system.
fn everything(known: OneCoordinate, integrator: impl for<'a> Integrator<'a, One, 1> + Clone, order: i32) {
    let name = integrator.info().name;
    let (system, initial) = (&one(known), known.initial());
    let problem = Problem::new(system, 0.25, initial).unwrap();
    let of = |problem: &Problem<'_, One, 1>, until: f64| -> Outcome {
        problem.by(integrator.clone()).steps(Steps::Size(0.05)).run(Until::Time(until)).unwrap()
    };
    let error = |order: i32| f64::powi(0.15, order) + 1e-12;
    let whole = of(&problem, 3.25);
    assert_eq!(whole.status, Status::Completed, "{name}");

    // Backward.
    let back = of(&Problem::new(system, whole.t, &whole).unwrap(), 0.25);
    assert!((back.q[0] - initial.q[0]).abs() <= 1e-12, "{name}: back at {}", back.q[0]);

    // Rows at times; between steps they are as accurate as at the ends: the energy decays as the conformal factor.
    let mut rows = Rows::at([0.25, 0.3, 1.111, 2.0, 3.25]).unwrap().with_energy().with_conformal_factor();
    let observed = problem.by(integrator.clone()).steps(Steps::Size(0.05)).observe(&mut rows).with_conformal_factor();
    assert_eq!(observed.run(Until::Time(3.25)).unwrap().state(), whole.state(), "{name}");
    let kept = |row: &discrete_herglotz::Row| row.energy.unwrap() / row.log_factor.unwrap().exp();
    let off = max_abs_or_nan(rows.rows.iter().map(|row| kept(row) / kept(&rows.rows[0]) - 1.0));
    assert!(rows.rows.len() == 5 && off <= error(order), "{name}: {off:e}");

    // Events, and a run that ends in one of them.
    let top = initial.q[0];
    let mut passes = Events::new([Event::new(|_, x| x.q[0] - 0.5 * top).terminal()]);
    let stopped =
        problem.by(integrator.clone()).steps(Steps::Size(0.05)).observe(&mut passes).run(Until::Time(9.0)).unwrap();
    assert!(matches!(stopped.status, Status::Stopped { by: "an event", .. }), "{name}: {:?}", stopped.status);
    assert!((stopped.q[0] - 0.5 * top).abs() <= 8.0 * f64::EPSILON, "{name}");

    // A run that an observer stops, and its continuation from an earlier checkpoint, which is the same to the last bit.
    let path = std::env::temp_dir().join(format!("every_run_{name}_{}.checkpoint", known.name()));
    let mut saved = Checkpoint::every(7, &path).unwrap();
    let mut seen = 0;
    let mut last = Each(|at: &StepView<'_>| seen = at.k);
    let mut enough = StopsAt(30, "the user");
    let run = || -> Run<'_, '_, Problem<'_, One, 1>> { problem.by(integrator.clone()).steps(Steps::Size(0.05)) };
    let run_to_30 = run().observe(&mut saved).observe(&mut last).observe(&mut enough);
    let cut = run_to_30.run(Until::Time(3.25)).unwrap();
    assert_eq!((cut.status, seen), (Status::Stopped { step: 30, t: cut.t, by: "the user" }, 30), "{name}");
    let resumed = run().resume(ResumeState::read(&path).unwrap()).run(Until::Time(3.25)).unwrap();
    assert_eq!(resumed, whole, "{name}");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn by_the_exact_flow() {
    everything(Pendulum { gamma: -0.1 }.into(), ExactFlow, 16);
    everything(QuadraticInZ::default().into(), ExactFlow, 16);
}

#[test]
fn by_a_users_discrete_lagrangian() {
    fn of(lagrangian: OneCoordinate) {
        everything(lagrangian, CustomMethod::new("own", 2, move |h| Ok(Own { lagrangian, h })), 2);
    }
    of(Pendulum { gamma: -0.1 }.into());
    of(QuadraticInZ::default().into());
}

/// A run may start from a velocity or a momentum; the velocity of the outcome is that of its momentum.
#[test]
fn starts() {
    let pendulum = one(Pendulum { gamma: -0.1 });
    let start = VelocityPoint::new([1.0], [0.3], 0.2);
    let by_velocity = Problem::new(&pendulum, 0.0, start).unwrap();
    let by_momentum = Problem::new(&pendulum, 0.0, contact_geom::legendre(&pendulum, 0.0, &start)).unwrap();
    let end =
        |problem: &Problem<'_, One, 1>| problem.by(ExactFlow).steps(Steps::Count(3)).run(Until::Time(1.0)).unwrap();
    assert_eq!(end(&by_velocity), end(&by_momentum));
    let outcome = end(&by_velocity);
    assert!((outcome.v.unwrap()[0] - outcome.p[0]).abs() <= f64::EPSILON);
}
