//! The accuracy of free bodies near the separatrix, where roundings grow, beside the closed form.

use super::accuracy::accurate;
use super::closed_form::{FreeBody, turn};
use crate::pairs::random::Random;
use herglotz_runtime::{Body, BodyMotion};
use std::f64::consts::TAU;

const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// The error of a motion by accuracy: that of the attitude, or of the momentum relative to its size.
fn error_of(moments: [f64; 3], request: &BodyMotion) -> Result<f64, String> {
    let body = Body { inertia: Body::principal(moments), ..Body::default() };
    let found = body.run(request, &mut ()).map_err(|error| error.to_string())?;
    let (attitude, omega) = FreeBody::new(moments, request.attitude, request.omega).after(request.end);
    let norm = |x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let momentum = |omega: [f64; 3]| std::array::from_fn(|i| moments[i] * omega[i]);
    let off = norm(std::array::from_fn(|i| momentum(omega)[i] - found.momentum[i])) / norm(momentum(request.omega));
    Ok(turn(attitude, found.attitude).max(off))
}

/// An answer is within the accuracy, or refused since roundings grow.
fn check(moments: [f64; 3], request: &BodyMotion, accuracy: f64, may_refuse: bool) {
    let case = format!("{moments:?}, {:?}, {:?} to {} at {accuracy:e}", request.attitude, request.omega, request.end);
    match error_of(moments, request) {
        Ok(error) => assert!(error <= accuracy, "{case}: {error:e}"),
        Err(refused) => assert!(may_refuse && refused.contains("the roundings grow"), "{case}: {refused}"),
    }
}

/// Free bodies are those of the closed form, to the round-off of 1000 steps.
#[test]
fn regular_motions_are_those_of_the_closed_form() {
    let attitude = [0.5, 0.5, -0.5, 0.5];
    for omega in [[1.0, 0.3, 0.2], [0.2, -0.3, -1.0], [-0.5, 1.0, -0.3], [0.3, -1.0, 0.5], [0.7, 0.1, 0.9]] {
        for moments in [[3.0, 5.0, 7.0], [7.0, 5.0, 3.0]] {
            for (end, bound) in [(1.0, 1e-14), (300.0, 4e-12)] {
                let request = BodyMotion { attitude, ..accurate(omega, end, 1e-11) };
                let error = error_of(moments, &request).unwrap();
                assert!(error <= bound, "{moments:?}, {omega:?} to {end}: {error:e}");
            }
        }
    }
}

/// All trial runs have the rounding of the momentum at the start in common, and agreed on an end that was wrong.
#[test]
fn roundings_that_runs_have_in_common() {
    let attitude = [0.6, 0.0, 0.8, 0.0];
    for (omega, end, accuracy) in [
        ([0.9743777208753026, 0.22491788959940645, 0.397788034719112], 64.51056432091765, 6.9e-9),
        ([0.26773522623429763, -0.9634925265061839, 0.10930245813759801], 213.70173742899254, 3.3e-8),
    ] {
        let request = BodyMotion { attitude, ..accurate(omega, end, accuracy) };
        check([4.0, 5.0, 8.0], &request, accuracy, true);
        // A shorter time is not refused.
        check([4.0, 5.0, 8.0], &BodyMotion { end: 0.25 * end, ..request }, accuracy, false);
    }
    for (small, end) in [([1e-6, 1e-6], 200.0), ([1e-9, 1e-9], 200.0), ([0.0, 1e-8], 100.0)] {
        for accuracy in [1e-6, 1e-9] {
            check([3.0, 5.0, 7.0], &accurate([small[0], 1.0, small[1]], end, accuracy), accuracy, true);
        }
    }
}

/// A steady rotation about the middle axis has no roundings that grow.
#[test]
fn a_steady_rotation_about_the_middle_axis() {
    let body = Body { inertia: Body::principal([3.0, 5.0, 7.0]), ..Body::default() };
    let found = body.run(&accurate([0.0, 1.0, 0.0], 200.0, 1e-10), &mut ()).unwrap();
    let exact = [f64::cos(100.0), 0.0, f64::sin(100.0), 0.0];
    assert!(turn(exact, found.attitude) <= 1e-10, "{:?}", found.attitude);
}

/// Starts at all distances from the separatrix.
#[test]
fn answers_are_within_the_accuracy_or_refused() {
    for case in 0..60 {
        let mut random = Random::of(11, case);
        let moments = [[3.0, 5.0, 7.0], [7.0, 5.0, 3.0], [4.0, 5.0, 8.0]][random.below(3)];
        let [i1, i2, i3]: [f64; 3] = moments;
        let attitude = [IDENTITY, [0.5, 0.5, -0.5, 0.5], [0.6, 0.0, 0.8, 0.0]][random.below(3)];
        let small = [0, 1].map(|_| random.sign() * 10.0_f64.powf(random.between(-7.0, -1.0)));
        // On the separatrix I_1 (I_2 - I_1) omega_1^2 = I_3 (I_3 - I_2) omega_3^2.
        let slope = (i1 * (i2 - i1) / (i3 * (i3 - i2))).sqrt();
        let (sin, cos) = random.between(0.0, TAU).sin_cos();
        let kind = random.below(3);
        let omega = match kind {
            0 => [small[0], random.sign(), small[1]],
            1 => [cos, sin, cos * slope * (1.0 + small[0])],
            // Away from it.
            _ => [cos, 0.5 * sin, cos * slope * if random.chance(0.5) { 0.5 } else { 2.0 } + 0.2_f64.copysign(cos)],
        };
        let away = kind == 2 && difference(moments, omega) >= 0.1;
        let accuracy = 10.0_f64.powf(random.between(-10.0, -6.0));
        let request = BodyMotion { attitude, ..accurate(omega, random.between(1.0, 300.0), accuracy) };
        check(moments, &request, accuracy, !away);
    }
}

/// The distance from the separatrix: `L^2 - 2 E I_2` relative to the larger of its two terms.
fn difference([i1, i2, i3]: [f64; 3], [w1, _, w3]: [f64; 3]) -> f64 {
    let [a, b] = [(i1 * (i2 - i1) * w1 * w1).abs(), (i3 * (i3 - i2) * w3 * w3).abs()];
    (a - b).abs() / a.max(b)
}
