//! Nonholonomic motions: closed forms, order, and what the discrete equations keep and lose.

// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

#[path = "nonholonomic/runs.rs"]
mod runs;

use contact_examples::systems::constrained::{ChaplyginSleigh, KnifeEdge, RollingDisc};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{MaxAbsOrNan, MaxOrNan};
use contact_geom::{Energy, Lagrangian, PhasePoint, SmoothFunction, VelocityPoint, constraints::Distribution};
use discrete_herglotz::InputError;
use discrete_herglotz::constraints::{ConstrainedStart, ConstraintError, Nonholonomic, OffConstraint};
use discrete_herglotz::{
    DiscreteLagrangian, SplittingScheme, Stepper,
    rules::{Quadrature, Rule},
};

/// The slope of three errors that fall by halving steps.
fn slope(errors: &[f64]) -> f64 {
    (errors[0] / errors[2]).log2() / 2.0
}

/// The motion by the midpoint rule.
fn motion<S, const N: usize, const M: usize>(
    system: S,
    scheme: &SplittingScheme,
    h: f64,
    start: VelocityPoint<N>,
) -> Nonholonomic<S, S, Quadrature<S>, N, M>
where
    S: Lagrangian<N> + Distribution<N, M> + Copy,
    Quadrature<S>: DiscreteLagrangian<N>,
{
    let start = ConstrainedStart { off_constraint: OffConstraint::Project, ..ConstrainedStart::new(start) };
    Nonholonomic::new(system, system, |h| Rule::MIDPOINT.of(system, h), scheme, h, &start).unwrap()
}

/// The velocity along the blade and the angular velocity of the sleigh with `k = 1/2`, `a = 1`, and its direction.
fn sleigh(gamma: f64, t: f64, c: f64, phase: f64) -> [f64; 3] {
    let (rate, tau) = ((gamma * t).exp(), if gamma == 0.0 { t } else { (gamma * t).exp_m1() / gamma });
    let at = 0.5 * c * tau + phase;
    let gudermann = |x: f64| 2.0 * (0.5 * x).tanh().atan();
    let turned = 2f64.sqrt() * (gudermann(at) - gudermann(phase));
    [rate * c * at.tanh(), rate * c / 2f64.sqrt() / at.cosh(), turned]
}

/// Chaplygin's sleigh follows its closed form, damped by the change of time, with order 2 and with the order of the
/// composition.
#[test]
fn sleigh_follows_its_closed_form() {
    for gamma in [0.0, -0.1] {
        let system = ChaplyginSleigh { mass: 1.0, arm: 1.0, inertia: 1.0, gamma };
        let (c, phase) = (1.5, -1.0);
        let [u, w, _] = sleigh(0.0, 0.0, c, phase);
        let start = VelocityPoint::new([0.0; 3], [u, 0.0, w], 0.1);
        let error = |scheme: &SplittingScheme, count: usize| {
            let mut motion = motion::<_, 3, 1>(system, scheme, 4.0 / count as f64, start);
            motion.advance(count).unwrap();
            let x = motion.velocity_point();
            let (s, c0) = x.q[2].sin_cos();
            let [u, w, turned] = sleigh(gamma, 4.0, c, phase);
            let off = [x.v[0] * c0 + x.v[1] * s - u, x.v[2] - w, x.q[2] - turned];
            off.iter().fold(0.0, |m, x| f64::max_or_nan(m, x.abs()))
        };
        for (scheme, count) in
            [(SplittingScheme::STRANG, 40), (SplittingScheme::SUZUKI_4, 20), (SplittingScheme::KAHAN_LI_8, 24)]
        {
            let errors = [1, 2, 4].map(|m| error(&scheme, m * count));
            println!("sleigh {gamma} {}: {errors:?} {}", scheme.name(), slope(&errors));
            if scheme.order() < 8 {
                assert!((slope(&errors) - f64::from(scheme.order())).abs() < 0.15, "{}", scheme.name());
            } else {
                // 96 * 17 substeps with the round-off of numbers of order one.
                assert!(errors[2] < 1e-11, "{errors:?}");
            }
        }
    }
}

/// The knife edge on a slope returns to its height after each half turn, by the closed form.
#[test]
fn knife_edge_follows_its_closed_form() {
    let system = KnifeEdge { slope: 1.3, gamma: 0.0 };
    let w = 1.7;
    let error = |count: usize| {
        let start = VelocityPoint::new([0.0; 3], [0.0, 0.0, w], 0.0);
        let mut motion = motion::<_, 3, 1>(system, &SplittingScheme::STRANG, 3.0 / count as f64, start);
        motion.advance(count).unwrap();
        let (q, turned) = (motion.state().q.fixed::<3>(), w * 3.0);
        let x = system.slope * turned.sin().powi(2) / (2.0 * w * w);
        let y = system.slope * (turned - 0.5 * (2.0 * turned).sin()) / (2.0 * w * w);
        (q - SVector::from([x, y, turned])).max_abs_or_nan()
    };
    let errors = [60, 120, 240].map(error);
    assert!((slope(&errors) - 2.0).abs() < 0.15, "{errors:?}");
}

/// The rolling disc moves on its circle in the time tau, and the momentum of its heading, the horizontal symmetry, is
/// multiplied by `sigma_d` in each step, to round-off.
#[test]
fn rolling_disc_follows_its_circle() {
    let gamma = -0.2;
    let system = RollingDisc { radius: 0.5, mass: 2.0, spin_inertia: 0.3, turn_inertia: 0.2, gamma };
    let (spin, turn) = (2.0, 1.5);
    let start = VelocityPoint::new([0.0, 0.0, 0.0, 0.3], [0.0, 0.0, spin, turn], 0.0);
    let start =
        VelocityPoint { v: SVector::from([0.5 * spin * 0.3f64.cos(), 0.5 * spin * 0.3f64.sin(), spin, turn]), ..start };
    let error = |count: usize| {
        let mut motion = motion::<_, 4, 2>(system, &SplittingScheme::SUZUKI_4, 2.0 / count as f64, start);
        let mut momentum = motion.state().p[3];
        for _ in 0..count {
            motion.advance(1).unwrap();
            momentum *= motion.sigma();
            let off = (motion.state().p[3] - momentum).abs();
            // A momentum is computed from two positions: their rounding, divided by the substeps of 0.01, in 200 substeps.
            assert!(off < 1e-12, "{off:e}");
        }
        let tau = (2.0 * gamma).exp_m1() / gamma;
        let (heading, radius) = (0.3 + turn * tau, 0.5 * spin / turn);
        let x = radius * (heading.sin() - 0.3f64.sin());
        let y = -radius * (heading.cos() - 0.3f64.cos());
        (motion.state().q.fixed::<4>() - SVector::from([x, y, spin * tau, heading])).max_abs_or_nan()
    };
    let errors = [10, 20, 40].map(error);
    assert!((slope(&errors) - 4.0).abs() < 0.15, "{errors:?}");
}

/// A step with h and one with -h give the start again, to the round-off of a few steps.
#[test]
fn steps_are_reversible() {
    let system = ChaplyginSleigh { mass: 1.0, arm: 0.7, inertia: 0.4, gamma: -0.3 };
    let start = VelocityPoint::new([0.2, -0.1, 0.4], [1.0, 0.5, 1.1], 0.3);
    let mut forward = motion::<_, 3, 1>(system, &SplittingScheme::STRANG, 0.2, start);
    let from = (forward.state().fixed::<3>(), forward.velocity_point());
    forward.advance(5).unwrap();
    let mut back = motion::<_, 3, 1>(system, &SplittingScheme::STRANG, -0.2, forward.velocity_point());
    back.advance(5).unwrap();
    let end = back.state().fixed::<3>();
    let off = (end.q - from.0.q)
        .max_abs_or_nan()
        .max_or_nan((end.p - from.0.p).max_abs_or_nan())
        .max_or_nan((end.z - from.0.z).abs());
    assert!(off < 1e-13, "{off:e}");
    assert!((forward.state().q.fixed::<3>() - from.0.q).max_abs_or_nan() > 0.5);
}

/// The energy is dissipated, `E' = L_z E`, with the order of the method; the contact form is not scaled.
#[test]
fn energy_is_dissipated_and_contact_is_lost() {
    let gamma = -0.3;
    let system = ChaplyginSleigh { mass: 1.0, arm: 0.7, inertia: 0.4, gamma };
    let start = VelocityPoint::new([0.2, -0.1, 0.4], [1.0, 0.5, 1.1], 0.3);
    // The kinetic energy, a constant times e^(2 gamma t), minus gamma z: E is dissipated with e^(gamma t).
    let energy = |x: &VelocityPoint<3>| Energy(&system).value(0.0, &(*x).into());
    let error = |count: usize| {
        let mut motion = motion::<_, 3, 1>(system, &SplittingScheme::STRANG, 4.0 / count as f64, start);
        let first = energy(&motion.velocity_point());
        motion.advance(count).unwrap();
        (energy(&motion.velocity_point()) - (4.0 * gamma).exp() * first).abs()
    };
    let errors = [40, 80, 160].map(error);
    assert!((slope(&errors) - 2.0).abs() < 0.15, "{errors:?}");
    // Two nearby starts: the difference of the final states is not scaled by sigma under eta, by more than a thousand
    // times the error of difference quotients.
    let by = 1e-5;
    let end = |s: f64| -> [PhasePoint<3>; 2] {
        let turned = 0.4 + s;
        let v = SVector::from([turned.cos(), turned.sin(), 1.1]);
        let mut motion = motion::<_, 3, 1>(
            system,
            &SplittingScheme::STRANG,
            0.1,
            VelocityPoint { q: [0.2, -0.1, turned].into(), v, z: 0.3 },
        );
        let from = motion.state().fixed();
        motion.advance(10).unwrap();
        [from, motion.state().fixed()]
    };
    let (ends, at) = ([end(-by), end(by)], end(0.0));
    let eta = |k: usize| {
        let [a, b] = [ends[0][k], ends[1][k]];
        ((b.z - a.z) - at[k].p.dot(&(b.q - a.q))) / (2.0 * by)
    };
    let defect = eta(1) - gamma.exp() * eta(0);
    assert!(defect.abs() > 1e-2, "{defect:e}");
}

/// A velocity outside of the distribution is refused, or projected on request.
#[test]
fn velocities_outside_of_the_distribution_are_refused() {
    let system = KnifeEdge { slope: 1.0, gamma: 0.0 };
    let start = ConstrainedStart::new(VelocityPoint::new([0.0; 3], [1.0, 0.2, 1.0], 0.0));
    let rule = |h| Rule::MIDPOINT.of(system, h);
    let off = Nonholonomic::new(system, system, rule, &SplittingScheme::STRANG, 0.1, &start).err();
    assert!(
        matches!(off, Some(InputError::Constraint(ConstraintError::OffVelocity { distance })) if (distance - 0.2).abs() < 1e-12),
        "{off:?}"
    );
    let motion = motion::<_, 3, 1>(system, &SplittingScheme::STRANG, 0.1, start.at);
    assert_eq!(motion.velocity_point().v[1], 0.0);
}

/// The sleigh stays at rest.
#[test]
fn sleigh_stays_at_rest() {
    let system = ChaplyginSleigh { mass: 1.0, arm: 0.7, inertia: 0.4, gamma: -0.3 };
    let start = VelocityPoint::new([0.2, -0.1, 0.4], [0.0; 3], 0.3);
    let mut motion = motion::<_, 3, 1>(system, &SplittingScheme::STRANG, 0.1, start);
    motion.advance(20).unwrap();
    assert_eq!(motion.state().q, start.q);
}
