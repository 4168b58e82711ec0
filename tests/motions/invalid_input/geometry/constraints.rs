//! Invalid input to constraints: their formulas propagate a NaN, and a singular system of multipliers is refused.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report, fine};
use contact_examples::systems::constrained::{ChaplyginSleigh, FourBar, ParallelCranks, RigidPendulum};
use contact_geom::VelocityPoint;
use contact_geom::constraints::{
    ConstraintDerivatives, DistributionDerivatives, Redundancy, constrained_motion, nonholonomic_motion,
};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::{independent_rows, least_norm, restricted};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "ConstraintDerivatives::along",
            "ConstraintDerivatives::force_slope",
            "ConstraintDerivatives::with_jacobian",
            "constrained_motion",
        ],
        run: holonomic,
    },
    InputTest { entries: &["DistributionDerivatives::rates", "nonholonomic_motion"], run: distribution },
    InputTest { entries: &["independent_rows", "least_norm", "restricted", "Redundancy::imposed"], run: rows },
    InputTest { entries: &["FourBar::closed_at", "ParallelCranks::at"], run: mechanisms },
];

/// States of the plane with an extreme value in one coordinate.
fn states() -> Vec<VelocityPoint<2>> {
    let of = |c: [f64; 5]| VelocityPoint::new([c[0], c[1]], [c[2], c[3]], c[4]);
    let base = [0.6, -0.8, 0.4, 0.3, 0.2];
    let with = |i: usize, x: f64| of(std::array::from_fn(|j| if i == j { x } else { base[j] }));
    [of(base)].into_iter().chain(EXTREME.into_iter().flat_map(|x| (0..5).map(move |i| with(i, x)))).collect()
}

const PENDULUM: RigidPendulum<2> = RigidPendulum { gravity: 9.81, gamma: -0.1 };

fn holonomic(report: &mut Report) {
    for x in states() {
        let (c, g) = PENDULUM.with_jacobian(&x.q);
        report.formula(&x.q, fine((c, g)));
        report.formula(&(x.q, x.v), fine(PENDULUM.along(&x.q, &x.v).to_vec()));
        let found = constrained_motion(&PENDULUM, &PENDULUM, 0.0, &x, Redundancy::LeastNorm);
        report.formula(&(x.q, x.v), found.map(|motion| (motion.acceleration, motion.multipliers)));
    }
    for value in EXTREME {
        report.formula(&value, fine(PENDULUM.force_slope(&SVector::from([0.6, -0.8]), &SVector::from([value]))));
    }
}

fn distribution(report: &mut Report) {
    let sleigh = ChaplyginSleigh { mass: 1.0, arm: 0.2, inertia: 0.5, gamma: -0.1 };
    for value in EXTREME {
        for i in 0..6 {
            let c: [f64; 6] = std::array::from_fn(|j| if i == j { value } else { 0.3 + 0.1 * j as f64 });
            let (q, v) = (SVector::from([c[0], c[1], c[2]]), SVector::from([c[3], c[4], c[5]]));
            let (rates, slopes) = sleigh.rates(&q, &v);
            // The condition depends on the direction and the velocity, not on the place of the blade.
            let input = vec![c[2], c[3], c[4], c[5]];
            report.formula(&input, fine((rates, slopes)));
            let motion = nonholonomic_motion(&sleigh, &sleigh, 0.0, &VelocityPoint { q, v, z: 0.1 });
            report.formula(&input, motion.map(|motion| (motion.acceleration, motion.multipliers)));
        }
    }
}

fn rows(report: &mut Report) {
    for value in EXTREME {
        for i in 0..6 {
            let mut matrix = SMatrix::<f64, 2, 3>::new(1.0, 0.2, 0.3, 0.1, 1.0, -0.4);
            matrix[i] = value;
            let independent = independent_rows(&matrix);
            // No row of a matrix that is not finite is left out.
            let all = independent == [true; 2];
            let imposed = [Redundancy::LeastNorm, Redundancy::Refuse].map(|of| of.imposed(1, &matrix));
            report.check(imposed == [independent, [true, false]], || format!("{matrix:?} has {imposed:?}"));
            report.check(all || matrix.iter().all(|x| x.is_finite()), || format!("{matrix:?} has {independent:?}"));
            let found = least_norm(&matrix, &[true, false], &SVector::from([1.0, 0.0]));
            report.formula(&matrix, found.map_err(|e| format!("{e:?}")));
        }
        for i in 0..4 {
            let mut matrix = SMatrix::<f64, 2, 2>::new(1.0, 0.2, 0.2, 2.0);
            matrix[i] = value;
            report.formula(&matrix, fine(restricted(matrix, &[true; 2])));
        }
    }
}

fn mechanisms(report: &mut Report) {
    let four_bar = FourBar { base: 3.0, crank: 1.0, coupler: 2.5, rocker: 2.0, gravity: 9.81, gamma: -0.1 };
    for angle in EXTREME {
        report.formula(&angle, fine(four_bar.closed_at(angle)));
        report.formula(&angle, fine(ParallelCranks::at(angle)));
    }
}
