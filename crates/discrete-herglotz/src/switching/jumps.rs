//! Jumps of a Lagrangian between two points of a motion.

use super::corner::{Corner, corner};
use super::{
    step_curve::{StepCurve, TimedState},
    surfaces::{Surfaces, sign},
};
use crate::gauss::StepStart;
use crate::integration::OfTyped;
use crate::integration::state_at;
use crate::{Point, System, TypedSystem};
use contact_geom::{VelocityPoint, numbers::max_abs_or_nan};

/// Whether the Lagrangian jumps between two points of a motion, across a zero of one of its [switching
/// functions](contact_geom::Lagrangian::switching_functions). There the motion has a corner and is not the flow of a vector field.
///
/// The motion between the points is approximated by the cubic Hermite curve through both points with their velocities.
pub fn jumps_between<const N: usize>(
    lagrangian: &dyn TypedSystem<N>,
    [from, to]: [(f64, VelocityPoint<N>); 2],
) -> bool {
    jumps(&OfTyped(lagrangian), (from.0, &from.1.into()), (to.0, &to.1.into()))
}

/// The same for a system whose number of coordinates is known at run time.
fn jumps(system: &dyn System, from: (f64, &Point), to: (f64, &Point)) -> bool {
    let of = |t: f64, x: &Point| TimedState {
        t,
        state: state_at(system, t, x),
        v: x.v.clone(),
        rests: StepStart::zeros(x.q.len()),
    };
    let curve = StepCurve::new(system, [of(from.0, from.1), of(to.0, to.1)], None);
    let mut surfaces = Surfaces::at(system, from.0, &curve.from.argument(system), curve.span());
    let max_displacement = curve.span() * max_abs_or_nan(from.1.v.iter().copied());
    let parts = curve.parts();
    for part in 1..=parts {
        let ends = [part - 1, part].map(|part| part as f64 / parts as f64);
        let (t, x) = curve.at(ends[1]);
        for index in 0..surfaces.sides.len() {
            let after = sign(surfaces.value(system, index, (t, &x)));
            if surfaces.side(index) * after < 0.0 {
                let estimate = surfaces.change(system, &curve, index, ends).estimate;
                let (t, x) = curve.at(estimate);
                if !matches!(
                    corner(system, &mut surfaces, index, &TimedState::of_argument(system, t, &x), max_displacement),
                    Ok(Corner::Continuous)
                ) {
                    return true;
                }
            }
            if let Some(side) = surfaces.sides.get_mut(index).filter(|_| after != 0.0) {
                *side = after;
            }
        }
    }
    false
}
