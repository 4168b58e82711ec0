//! Critical paths between given ends: against the discrete Herglotz equations, the differential of the action, the flow
//! and closed forms. (`scale --case path` compares them with Newton's method on a sparse factorisation.)

pub mod conjugate_points;
pub mod end_conditions;
mod equations;
mod exact_paths;
pub mod forces;
mod several_paths;

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{MaxAbsOrNan, MaxOrNan, max_abs_or_nan};
use contact_geom::{DiscretePoint, Lagrangian, PhasePoint};
use discrete_herglotz::DiscreteLagrangian;
use discrete_herglotz::boundary::{CriticalPath, End, PathStatus};
use discrete_herglotz::rules::{AnyDiscreteLagrangian, Method};
use discrete_herglotz::theory::{discrete_action, discrete_flow};

const EPS: f64 = f64::EPSILON;

fn at<const N: usize>(q: [f64; N]) -> End<N> {
    End::Position(q.into())
}

fn largest_of<const N: usize>(v: &[SVector<f64, N>]) -> f64 {
    max_abs_or_nan(v.iter().map(MaxAbsOrNan::max_abs_or_nan))
}

/// The size of the terms of the discrete Herglotz equations along a path: the momenta, and the change of a momentum by
/// the rounding of the positions.
fn size<D: DiscreteLagrangian<N>, const N: usize>(ld: &D, t0: f64, path: &CriticalPath<N>) -> f64 {
    let of = |k: usize| {
        let x = DiscretePoint { q0: path.points[k], q1: path.points[k + 1], z0: path.actions[k] };
        let jet = ld.second_jet(t0 + k as f64 * ld.step_size(), &x).unwrap();
        jet.first.d1.max_abs_or_nan()
            + jet.first.d2.max_abs_or_nan()
            + jet.d12.max_abs_or_nan() * N as f64 * largest_of(&path.points)
    };
    max_abs_or_nan((0..path.points.len() - 1).map(of))
}

/// Checks that every path that is found must pass: the discrete Herglotz equations, `dA_d`, the action, the flow.
fn check<D: DiscreteLagrangian<N>, const N: usize>(ld: &D, (t0, z0): (f64, f64), found: &CriticalPath<N>, units: f64) {
    assert_eq!(found.status, PathStatus::Found, "{}", found.status);
    let path = found.path().unwrap();
    // Each of the three positions of an equation is rounded, and the equation is a sum of a few terms: some units in
    // the last place of the largest. `units` is 1 for closed forms, and larger where L_d is itself the result of an
    // iteration.
    let bound = 16.0 * units * EPS * size(ld, t0, found);
    let residuals = path.herglotz_residuals(ld, t0, z0).unwrap();
    assert!(largest_of(&residuals) <= bound, "residual {:e} of {bound:e}", largest_of(&residuals));
    assert!((largest_of(&residuals) <= found.residual * 1.01 + bound) && found.residual <= bound);
    // The differential of A_d is the residual times the product of the later sigma_d, below 1 with damping.
    // With forces the path is not critical for it.
    let steps = path.steps();
    if !ld.has_forces() {
        let differential = path.action_differential(ld, t0, z0).unwrap();
        assert!(largest_of(&differential[1..steps]) <= bound.max_or_nan(bound * (-found.log_factor).exp()));
    }
    // The action is the sum of its recursion, up to the rounding of another order of summation.
    let action = discrete_action(ld, t0, path.points(), z0).unwrap();
    assert!(
        (action - found.action()).abs() <= 16.0 * EPS * units * max_abs_or_nan(found.actions.iter().copied()),
        "{action}"
    );
    // The flow from the first two points: an error in the second one grows like the distance of neighbouring motions.
    let h = ld.step_size();
    let mut x = DiscretePoint { q0: found.points[0], q1: found.points[1], z0 };
    let mut worst: f64 = 0.0;
    for k in 0..steps - 1 {
        x = discrete_flow(ld, t0 + k as f64 * h, &x).unwrap();
        worst = worst.max_or_nan((x.q1 - found.points[k + 2]).max_abs_or_nan());
    }
    // The error of the first velocity is eps q / h, and grows along the span, by `e^span` where motions separate (with
    // rates of about one).
    let span = h * steps as f64;
    let growth = span * span.exp() / h;
    assert!(worst <= 64.0 * units * EPS * largest_of(&found.points).max_or_nan(1.0) * growth, "flow {worst:e}");
}

fn by<L: Lagrangian<N>, const N: usize>(method: Method, system: L, h: f64) -> AnyDiscreteLagrangian<L, N> {
    let origin = PhasePoint { q: SVector::repeat(0.1), p: SVector::repeat(0.1), z: 0.0 };
    method.discretise(system, h, 0.0, &origin).unwrap()
}
