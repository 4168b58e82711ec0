//! Invalid input to motions on Lie groups: starts and steps that are not finite are refused, and a step that fails leaves
//! the state before it.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report};
use contact_geom::groups::{GroupError, Inertia, RigidBody, Rotation, Rotations, UniformGravity};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, numbers::MaxAbsOrNan};
use discrete_herglotz::SplittingScheme;
use discrete_herglotz::groups::{
    DenseGroupMotion, GroupBreaks, GroupDerivatives, GroupEnds, GroupGauss, GroupIntegrator, GroupMotion, GroupRows,
    GroupRun, GroupState, RigidBodySplitting, group_steps,
};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "GroupIntegrator::step",
            "GroupMotion::advance",
            "GroupMotion::log_factor",
            "GroupMotion::new",
            "GroupMotion::spatial_momentum",
            "GroupMotion::state",
            "GroupState::check",
        ],
        run: starts,
    },
    InputTest {
        entries: &[
            "DenseGroupMotion::at",
            "DenseGroupMotion::new",
            "DenseGroupMotion::span",
            "GroupBreaks::new",
            "GroupDerivatives::contact_defect",
            "GroupDerivatives::gradients",
            "GroupDerivatives::new",
            "GroupDerivatives::of_rows_with_parameters",
            "GroupDerivatives::with_parameters",
            "GroupEnds::search",
            "GroupGauss::virtual_work",
            "GroupIntegrator::step_by",
            "GroupMotion::advance_by",
            "GroupMotion::restore",
            "GroupRun::run",
            "groups::group_steps",
        ],
        run: runs,
    },
    InputTest { entries: &["GroupGauss::new", "RigidBodySplitting::new"], run: methods },
];

fn body(gamma: f64) -> Result<RigidBody<UniformGravity, 3>, GroupError> {
    let gravity = UniformGravity { weight: [0.0, 0.0, -9.81], centre: [0.0, 0.5, 0.0] };
    RigidBody::rotating(&Inertia::principal([1.0, 0.5, 1.0])?, gravity, gamma)
}

/// A start from a quaternion, a momentum and an action.
fn start(c: [f64; 8]) -> GroupState<Rotations, 3> {
    let g = Rotation { w: c[0], u: SVector::from([c[1], c[2], c[3]]) };
    GroupState { g, momentum: SVector::from([c[4], c[5], c[6]]), z: c[7] }
}

const GOOD: [f64; 8] = [1.0, 0.0, 0.0, 0.0, 0.3, 2.0, -0.4, 0.1];

/// Ten steps: all numbers of the motion at their end.
fn advanced(
    t: f64,
    from: GroupState<Rotations, 3>,
    method: &impl GroupIntegrator<Rotations, 3>,
) -> Result<Vec<f64>, GroupError> {
    let mut motion = GroupMotion::<Rotations, 3>::new(t, from)?;
    motion.advance(method, 10)?;
    let end = motion.state();
    end.check()?;
    let momenta = end.momentum.iter().chain(motion.spatial_momentum().iter());
    Ok(momenta.copied().chain(end.g.quaternion()).chain([end.z, motion.t(), motion.log_factor()]).collect())
}

fn starts(report: &mut Report) {
    let method = body(-0.1).and_then(|body| GroupGauss::new::<Rotations, 3>(body, 3, 0.05));
    let splitting = body(-0.1).and_then(|body| RigidBodySplitting::new(body, SplittingScheme::STRANG, 0.05));
    let (Ok(method), Ok(splitting)) = (method, splitting) else {
        return report.check(false, || "good methods are refused".into());
    };
    for value in EXTREME {
        for i in 0..8 {
            let c: [f64; 8] = std::array::from_fn(|j| if i == j { value } else { GOOD[j] });
            report.entry_point(&c.to_vec(), start(c).check());
            report.entry_point(&c.to_vec(), advanced(0.0, start(c), &method));
            report.entry_point(&c.to_vec(), advanced(0.0, start(c), &splitting));
        }
        report.entry_point(&value, advanced(value, start(GOOD), &method));
    }
    // A body that turns by more than the chart has in a step: refused, at the start of the step.
    let fast = start([1.0, 0.0, 0.0, 0.0, 0.0, 100.0, 0.0, 0.0]);
    let Ok(mut motion) = GroupMotion::<Rotations, 3>::new(0.0, fast) else {
        return report.check(false, || "a good start is refused".into());
    };
    let failed = motion.advance(&method, 1);
    report.check(failed.is_err() && motion.state() == fast && motion.t() == 0.0, || format!("{failed:?}"));
}

fn methods(report: &mut Report) {
    for value in EXTREME {
        let gauss = body(-0.1).and_then(|body| GroupGauss::new::<Rotations, 3>(body, 2, value));
        report.entry_point(&value, gauss.and_then(|method| advanced(0.0, start(GOOD), &method)));
        let splitting = body(-0.1).and_then(|body| RigidBodySplitting::new(body, SplittingScheme::STRANG, value));
        report.entry_point(&value, splitting.and_then(|method| advanced(0.0, start(GOOD), &method)));
        let drag = body(value).and_then(|body| GroupGauss::new::<Rotations, 3>(body, 2, 0.05));
        report.entry_point(&value, drag.and_then(|method| advanced(0.0, start(GOOD), &method)));
    }
    for stages in [0, 17, usize::MAX] {
        let refused = body(-0.1).and_then(|body| GroupGauss::new::<Rotations, 3>(body, stages, 0.1));
        report.check(matches!(refused, Err(GroupError::Stages { .. })), || format!("{stages} stages"));
    }
    let unsymmetric = Inertia::principal([1.0, 2.0, 2.5]).and_then(|inertia| {
        let gravity = UniformGravity { weight: [0.0, 0.0, -1.0], centre: [0.0, 0.5, 0.0] };
        RigidBodySplitting::new(RigidBody::rotating(&inertia, gravity, 0.0)?, SplittingScheme::BLANES_MOAN_6, 0.1)
    });
    let named = matches!(unsymmetric, Err(GroupError::NeedsComposition { .. }));
    report.check(named, || "a Nyström scheme for a body without symmetry".into());
}

/// The momentum and the action of a state, which is checked.
fn numbers_of(state: &GroupState<Rotations, 3>) -> Result<Vec<f64>, GroupError> {
    state.check()?;
    Ok(state.momentum.iter().copied().chain([state.z]).collect())
}

/// Steps of other lengths, times of rows, saved numbers, spans and accuracies.
fn runs(report: &mut Report) {
    let method = |h: f64| body(-0.1).and_then(|body| GroupGauss::new::<Rotations, 3>(body, 3, h));
    let motion = GroupMotion::<Rotations, 3>::new(0.0, start(GOOD));
    let (Ok(gauss), Ok(motion)) = (method(0.05), motion) else {
        return report.check(false, || "good methods and starts are refused".into());
    };
    let numbers = |motion: &GroupMotion<Rotations, 3>| -> Result<Vec<f64>, GroupError> {
        let mut all = numbers_of(&motion.state())?;
        all.push(motion.t());
        Ok(all)
    };
    for value in EXTREME {
        let mut moved = motion.clone();
        let step = moved.advance_by(&gauss, value);
        report.entry_point(&value, step.and_then(|()| numbers(&moved)));
        let mut moved = motion.clone();
        let run = GroupRun { rows: GroupRows::At(vec![value]), ..GroupRun::new(10) };
        report.entry_point(&value, run.run(&mut moved, &gauss, &mut ()).and_then(|_| numbers(&moved)));
        let steps = group_steps(&motion, value, 1e-3, 2, method);
        report.entry_point(&value, steps.map(|steps| vec![steps.h, steps.error]));
        let steps = group_steps(&motion, 0.5, value, 2, method);
        report.entry_point(&value, steps.map(|steps| vec![steps.h, steps.error]));
        for i in 0..8 {
            let c: [f64; 8] = std::array::from_fn(|j| if i == j { value } else { GOOD[j] });
            let GroupState { g: g1, momentum, z } = start(c);
            let ends = GroupEnds::<Rotations, 3> { t0: 0.0, g0: start(GOOD).g, g1, z0: z, steps: 3 };
            let found = ends.search(&gauss, &momentum);
            report.entry_point(
                &c.to_vec(),
                found.map(|found| vec![found.residual, found.start.momentum.sum(), found.end.z]),
            );
        }
        for i in 0..8 {
            let c: [f64; 8] = std::array::from_fn(|j| if i == j { value } else { GOOD[j] });
            let numbers = |found: GroupDerivatives<Rotations, 3>| {
                let (at_start, in_parameters) = found.gradients(&ChartVector::from_fn(|_| 1.0));
                let all = found.in_start.iter().chain(in_parameters.iter()).copied();
                all.chain([at_start.max_abs_or_nan(), found.contact_defect(), found.log_factor]).collect::<Vec<_>>()
            };
            let found = GroupDerivatives::with_parameters(&gauss, 0.0, &start(c), 3);
            report.entry_point(&c.to_vec(), found.map(numbers));
            report.entry_point(
                &c.to_vec(),
                gauss.virtual_work(value, &start(GOOD)).map(|work| work.to_vector().as_slice().to_vec()),
            );
            report.entry_point(
                &c.to_vec(),
                gauss.virtual_work(0.0, &start(c)).map(|work| work.to_vector().as_slice().to_vec()),
            );
            let dense = DenseGroupMotion::new(gauss.clone(), 0.0, &start(c), 3);
            report.entry_point(&c.to_vec(), dense.and_then(|dense| numbers_of(&dense.at(0.07)?)));
        }
        let divided = GroupBreaks::new(gauss.clone(), vec![0.15, value]).and_then(|by| {
            let mut motion = GroupMotion::new(0.0, start(GOOD))?;
            motion.advance(&by, 3)?;
            numbers_of(&motion.state())
        });
        report.entry_point(&value, divided);
        let found = GroupDerivatives::new(&gauss, value, &start(GOOD), 3);
        report.entry_point(&value, found.map(|found| found.in_start.iter().copied().collect::<Vec<_>>()));
        let found = GroupDerivatives::of_rows_with_parameters(&gauss, 0.0, &start(GOOD), &[(2, value)]);
        let of_rows =
            |found: Vec<GroupDerivatives<Rotations, 3>>| found[0].in_parameters.iter().copied().collect::<Vec<_>>();
        report.entry_point(&value, found.map(of_rows));
        let dense = DenseGroupMotion::new(gauss.clone(), value, &start(GOOD), 3);
        report.entry_point(&value, dense.map(|dense| dense.span().to_vec()));
        let dense = DenseGroupMotion::new(gauss.clone(), 0.0, &start(GOOD), 3);
        report.entry_point(&value, dense.and_then(|dense| numbers_of(&dense.at(value)?)));
        let ends = GroupEnds::<Rotations, 3> { t0: value, g0: start(GOOD).g, g1: start(GOOD).g, z0: 0.0, steps: 3 };
        report.entry_point(&value, ends.search(&gauss, &start(GOOD).momentum).map(|found| vec![found.residual]));
        // The last three numbers are a velocity, which need not be known.
        for i in 0..23 {
            let mut saved = motion.save();
            saved[i] = value;
            let restored = GroupMotion::<Rotations, 3>::restore(&saved);
            report.entry_point(
                &value,
                restored.and_then(|mut moved| {
                    moved.advance(&gauss, 2)?;
                    numbers(&moved)
                }),
            );
        }
    }
}
