//! Jumps of a Lagrangian between two points of a motion.

use super::corner::{Corner, corner};
use super::surfaces::{StepCurve, Surfaces, TimedState, sign};
use crate::System;
use crate::gauss::StepStart;
use crate::integration::state_of;
use contact_geom::{VelocityPoint, numbers::max_abs_or_nan};

/// Whether the Lagrangian jumps between two points of a motion, across a zero of one of its [switching
/// functions](contact_geom::Lagrangian::switching_functions). There the motion has a corner and is not the flow of a vector field.
///
/// The motion between the points is approximated by the cubic Hermite curve through both points with their velocities.
pub fn jumps_between<const N: usize>(lagrangian: &dyn System<N>, [from, to]: [(f64, VelocityPoint<N>); 2]) -> bool {
    let of = |(t, x): (f64, VelocityPoint<N>)| TimedState {
        t,
        state: state_of(lagrangian, t, &x),
        v: x.v,
        rests: StepStart::ZERO,
    };
    let curve = StepCurve { from: of(from), to: of(to), dense: None };
    let mut surfaces = Surfaces::at(lagrangian, from.0, &from.1, curve.span());
    let max_displacement = curve.span() * max_abs_or_nan(from.1.v.iter().copied());
    let parts = curve.parts();
    for part in 1..=parts {
        let ends = [part - 1, part].map(|part| part as f64 / parts as f64);
        let (t, x) = curve.at(ends[1]);
        for index in 0..surfaces.sides.len() {
            let after = sign(surfaces.value(lagrangian, index, (t, &x)));
            if surfaces.side(index) * after < 0.0 {
                let estimate = surfaces.change(lagrangian, &curve, index, ends).estimate;
                if !matches!(
                    corner(lagrangian, &mut surfaces, index, &of(curve.at(estimate)), max_displacement),
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
