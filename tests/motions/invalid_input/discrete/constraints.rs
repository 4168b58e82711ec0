//! Invalid input to motions under constraints: starts that are not finite or off the constraint are refused, and steps are
//! finite or an error.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report};
use contact_examples::systems::constrained::{KnifeEdge, RigidPendulum};
use contact_geom::{PhasePoint, VelocityPoint};
use discrete_herglotz::constraints::{
    Constrained, ConstrainedMethod, ConstrainedStart, ConstraintError, ContactLobatto, DragRattle, LagrangeDAlembert,
    Nonholonomic, OffConstraint,
};
use discrete_herglotz::{InputError, Integrator, Problem, SplittingScheme, Stepper, Steps, Until, rules::Rule};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "Constrained::new",
            "ConstrainedStart::new",
            "ConstrainedStart::resolved",
            "ContactLobatto::constrained_motion",
            "ContactLobatto::multipliers",
            "ContactLobatto::new",
            "ContactLobatto::velocity_point",
            "DragRattle::constrained_motion",
            "DragRattle::impulse",
            "DragRattle::multipliers",
            "DragRattle::new",
            "DragRattle::velocity_point",
            "Integrator::constraint_force",
        ],
        run: pendulums,
    },
    InputTest { entries: &["ContactLobatto::step", "DragRattle::step"], run: steps },
    InputTest {
        entries: &[
            "LagrangeDAlembert::new",
            "Nonholonomic::impulse",
            "Nonholonomic::new",
            "Nonholonomic::velocity_point",
        ],
        run: knife_edges,
    },
];

const PENDULUM: RigidPendulum<2> = RigidPendulum { gravity: 9.81, gamma: -0.1 };
type Rattle = DragRattle<RigidPendulum<2>, RigidPendulum<2>, 2, 1>;
type Lobatto = ContactLobatto<RigidPendulum<2>, RigidPendulum<2>, 2, 1>;

fn rattle(system: RigidPendulum<2>, h: f64, start: &ConstrainedStart<2>) -> Result<Rattle, InputError> {
    DragRattle::new(system, system, &SplittingScheme::STRANG, h, start)
}

fn lobatto(system: RigidPendulum<2>, h: f64, start: &ConstrainedStart<2>) -> Result<Lobatto, InputError> {
    ContactLobatto::new(system, system, 3, h, start)
}

/// The numbers of a motion after ten steps: its state, and what the constraints do.
fn by_rattle(motion: Result<Rattle, InputError>) -> Result<Vec<f64>, String> {
    let mut motion = motion.map_err(|e| e.to_string())?;
    motion.advance(10).map_err(|e| e.to_string())?;
    let (of, impulse) = (motion.constrained_motion(), motion.impulse());
    let (of, impulse) = (of.map_err(|e| e.to_string())?, impulse.map_err(|e| e.to_string())?);
    let multipliers = motion.multipliers().map_err(|e| e.to_string())?;
    let vectors = [motion.state().p.fixed(), motion.velocity_point().q, of.acceleration];
    let numbers = vectors.iter().flat_map(|x| x.iter().copied());
    Ok(numbers.chain([motion.state().z, impulse[0], multipliers[0], of.multipliers[0]]).collect())
}

fn by_lobatto(motion: Result<Lobatto, InputError>) -> Result<Vec<f64>, String> {
    let mut motion = motion.map_err(|e| e.to_string())?;
    motion.advance(10).map_err(|e| e.to_string())?;
    let of = motion.constrained_motion().map_err(|e| e.to_string())?;
    let multipliers = motion.multipliers().map_err(|e| e.to_string())?;
    let vectors = [motion.state().p.fixed(), motion.velocity_point().q, of.acceleration];
    let numbers = vectors.iter().flat_map(|x| x.iter().copied());
    Ok(numbers.chain([motion.state().z, multipliers[0], of.multipliers[0]]).collect())
}

/// The end of a run by RATTLE from the resolved start, and the force of the constraint there.
fn by_run(system: RigidPendulum<2>, h: f64, start: &ConstrainedStart<2>) -> Result<Vec<f64>, String> {
    let at = start.resolved(&system, &system).map_err(|e| e.to_string())?;
    let problem = Problem::new(&system, start.t, at).map_err(|e| e.to_string())?;
    let rattle = Constrained::new(&system, ConstrainedMethod::Rattle(SplittingScheme::STRANG));
    let run = problem.by(rattle).steps(Steps::Size(h.abs())).run(Until::After(10.0 * h)).map_err(|e| e.to_string())?;
    let end = VelocityPoint { q: run.q.fixed(), v: run.p.fixed(), z: 0.0 };
    let force = rattle.constraint_force(&&system, run.t, &end).map_err(|e| e.to_string())?;
    Ok(run.q.iter().chain(&run.p).chain(&force).copied().chain(run.z).collect())
}

fn pendulums(report: &mut Report) {
    let base = [0.6, -0.8, 0.4, 0.3, 0.2];
    let at = |c: [f64; 5]| VelocityPoint::new([c[0], c[1]], [c[2], c[3]], c[4]);
    for value in EXTREME {
        for i in 0..5 {
            let c: [f64; 5] = std::array::from_fn(|j| if i == j { value } else { base[j] });
            for off_constraint in [OffConstraint::Refuse, OffConstraint::Project] {
                let start = ConstrainedStart { off_constraint, ..ConstrainedStart::new(at(c)) };
                report.entry_point(&c.to_vec(), by_rattle(rattle(PENDULUM, 0.01, &start)));
                report.entry_point(&c.to_vec(), by_lobatto(lobatto(PENDULUM, 0.01, &start)));
                report.entry_point(&c.to_vec(), by_run(PENDULUM, 0.01, &start));
            }
        }
        let start = ConstrainedStart::new(at(base));
        let later = ConstrainedStart { t: value, ..start };
        report.entry_point(&value, by_rattle(rattle(PENDULUM, 0.01, &later)));
        report.entry_point(&value, by_lobatto(lobatto(PENDULUM, 0.01, &later)));
        report.entry_point(&value, by_rattle(rattle(PENDULUM, value, &start)));
        report.entry_point(&value, by_run(PENDULUM, value, &start));
        report.entry_point(&value, by_lobatto(lobatto(PENDULUM, value, &start)));
        for system in [RigidPendulum { gravity: value, ..PENDULUM }, RigidPendulum { gamma: value, ..PENDULUM }] {
            report.entry_point(&value, by_rattle(rattle(system, 0.01, &start)));
            report.entry_point(&value, by_lobatto(lobatto(system, 0.01, &start)));
        }
    }
    let off = ConstrainedStart::new(at([0.6, -0.7, 0.0, 0.0, 0.0]));
    let named = matches!(
        rattle(PENDULUM, 0.01, &off),
        Err(InputError::Constraint(ConstraintError::OffConstraint { index: 0, .. }))
    );
    report.check(named, || "a start off the constraint by RATTLE".into());
    let named = matches!(
        lobatto(PENDULUM, 0.01, &off),
        Err(InputError::Constraint(ConstraintError::OffConstraint { index: 0, .. }))
    );
    report.check(named, || "a start off the constraint by Lobatto's method".into());
    for stages in [0, 1, 9, usize::MAX] {
        let refused = ContactLobatto::new(PENDULUM, PENDULUM, stages, 0.01, &ConstrainedStart::new(at(base)));
        report.check(matches!(refused, Err(InputError::Constraint(ConstraintError::Stages { .. }))), || {
            format!("{stages} stages")
        });
    }
}

/// The maps of one step, at states that need not be on the constraint.
fn steps(report: &mut Report) {
    let start = ConstrainedStart::new(VelocityPoint::new([0.6, -0.8], [0.4, 0.3], 0.2));
    let (Ok(rattle), Ok(lobatto)) = (rattle(PENDULUM, 0.01, &start), lobatto(PENDULUM, 0.01, &start)) else {
        return report.check(false, || "a good start is refused".into());
    };
    let base = [0.6, -0.8, 0.4, 0.3, 0.2];
    for value in EXTREME {
        for i in 0..5 {
            let c: [f64; 5] = std::array::from_fn(|j| if i == j { value } else { base[j] });
            let from = PhasePoint::new([c[0], c[1]], [c[2], c[3]], c[4]);
            report.entry_point(&c.to_vec(), rattle.step(0.0, &from).map(|step| (step.end, step.impulse)));
            let by_lobatto = lobatto.step(0.0, &from, &from.p);
            report.entry_point(&c.to_vec(), by_lobatto.map(|step| (step.end, step.velocity, step.sigma)));
        }
    }
}

fn knife_edges(report: &mut Report) {
    let motion = |system: KnifeEdge, h: f64, start: &ConstrainedStart<3>| -> Result<Vec<f64>, String> {
        let rule = |h| Rule::MIDPOINT.of(system, h);
        let motion = Nonholonomic::new(system, system, rule, &SplittingScheme::STRANG, h, start);
        let mut motion = motion.map_err(|e| e.to_string())?;
        motion.advance(10).map_err(|e| e.to_string())?;
        let (q, p) = (motion.velocity_point().q, motion.state().p);
        Ok(q.iter().chain(p.iter()).copied().chain([motion.state().z, motion.impulse()[0]]).collect())
    };
    // The end of a run, and the force of the constraint there.
    let by_run = |h: f64, t: f64, at: VelocityPoint<3>| -> Result<Vec<f64>, String> {
        let system = KnifeEdge { slope: 0.3, gamma: -0.1 };
        let problem = Problem::new(&system, t, at).map_err(|e| e.to_string())?;
        let by = LagrangeDAlembert::<_, 1>::new(&system, SplittingScheme::STRANG);
        let run = problem.by(by).steps(Steps::Size(h.abs())).run(Until::After(10.0 * h)).map_err(|e| e.to_string())?;
        let end = VelocityPoint { q: run.q.fixed(), v: run.p.fixed(), z: 0.0 };
        let force = by.constraint_force(&system, run.t, &end).map_err(|e| e.to_string())?;
        Ok(run.q.iter().chain(&run.p).chain(&force).copied().chain(run.z).collect())
    };
    let at = |c: [f64; 7]| VelocityPoint::new([c[0], c[1], c[2]], [c[3], c[4], c[5]], c[6]);
    let system = KnifeEdge { slope: 0.3, gamma: -0.1 };
    let base = [0.1, -0.2, 0.0, 0.5, 0.0, 0.7, 0.2];
    for value in EXTREME {
        for i in 0..7 {
            let c: [f64; 7] = std::array::from_fn(|j| if i == j { value } else { base[j] });
            for off_constraint in [OffConstraint::Refuse, OffConstraint::Project] {
                let start = ConstrainedStart { off_constraint, ..ConstrainedStart::new(at(c)) };
                report.entry_point(&c.to_vec(), motion(system, 0.01, &start));
            }
            report.entry_point(&c.to_vec(), by_run(0.01, 0.0, at(c)));
        }
        let start = ConstrainedStart::new(at(base));
        report.entry_point(&value, motion(system, value, &start));
        report.entry_point(&value, by_run(value, 0.0, at(base)));
        report.entry_point(&value, by_run(0.01, value, at(base)));
        report.entry_point(&value, motion(system, 0.01, &ConstrainedStart { t: value, ..start }));
        report.entry_point(&value, motion(KnifeEdge { gamma: value, ..system }, 0.01, &start));
    }
}
