//! How a motion leaves a surface on which it is.
//!
//! The sign of a switching function just after a point decides. Where the function is smooth along the motion, its
//! changes before and after the point give it. At a corner of the surface, as of `min(x, y)`, the function has a kink
//! there, and only its changes after the point count.

use crate::switching::local_motion::LocalMotion;
use crate::switching::surfaces::{Surfaces, sign};
use crate::{Point, System};
use contact_geom::numbers::max_or_nan;

/// The part of a step over which a motion on a surface is followed, forward and backward, to find the side to which it
/// goes: the Taylor polynomial of the motion is exact enough, and changes are far above their round-off.
pub(super) const DEPARTURE: f64 = 1e-5;

/// The factor of the times over which a motion is followed further, where the function does not change before.
const LONGER: f64 = 100.0;

/// The part of the change by the second derivative, over [`DEPARTURE`], below which a rate is none: the motion would
/// return to the surface within 1e-12 of a step.
const MIN_RATE: f64 = 1e-7;

/// The part of the changes over [`DEPARTURE`] by which they differ from those of a smooth function at a kink: the terms of
/// third and fourth order of a function that varies a hundred times within a step are 1e-6 of them.
const MIN_KINK: f64 = 1e-5;

/// The number of roundings of a function above which the sign of a change is known, for the sums of several values.
const NOTICEABLE: f64 = 4.0;

/// The largest number of halvings of [`DEPARTURE`], down to the round-off of the time.
const MAX_HALVINGS: i32 = 40;

/// The ratio of two even parts of a function, over a time and over half of it, below which they are those of a kink at the
/// point, 2, and not those of one beside it or of a smooth function, 4.
const MAX_KINK_RATIO: f64 = 2.5;

/// The ratio of the changes over a time and over half of it below which they are those by a rate, 2, and not those by
/// a second derivative, 4.
const MAX_RATE_RATIO: f64 = 3.0;

/// How a motion leaves a surface on which it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Departure {
    /// The sign that the function takes.
    pub side: f64,
    /// The rate of the function.
    pub rate: f64,
    /// Whether the rate is not zero up to round-off; otherwise the function changes by its second derivative.
    pub with_rate: bool,
    /// Whether the surface has a corner at the point.
    pub at_corner: bool,
    /// The sign of the function on the same motion before the point; 0 if that is not known.
    pub before: f64,
}

impl Departure {
    /// Whether the motion would have come to a corner from beyond the side on which it is: it has been turned back from one
    /// part of the surface, or starts there.
    pub fn is_turned(&self, side: f64) -> bool {
        self.at_corner && self.before * side <= 0.0
    }
}

impl Surfaces {
    /// The side to which a motion that is on a surface, up to a tolerance for the function, goes next; `None` if it is
    /// not on the surface, or stays on it to second order. `h` is the length of a step.
    pub fn departure(
        &mut self,
        system: &dyn System,
        index: usize,
        (t, x): (f64, &Point),
        h: f64,
        tolerance: f64,
    ) -> Option<Departure> {
        let here = self.value(system, index, (t, x));
        if here.is_nan() || here.abs() > tolerance {
            return None;
        }
        let motion = LocalMotion::at(system, t, x);
        // The change of a motion that is pressed onto the surface from rest may be round-off over a short time.
        let times = [1.0, LONGER, LONGER * LONGER].map(|factor| factor * DEPARTURE * h);
        times.into_iter().find_map(|dt| self.departure_within(system, index, &motion, (t, x, here), h, dt))
    }

    /// The same by the motion within a time dt before and after the point, at which the function has the value `here`.
    fn departure_within(
        &mut self,
        system: &dyn System,
        index: usize,
        motion: &LocalMotion<'_>,
        (t, x, here): (f64, &Point, f64),
        h: f64,
        dt: f64,
    ) -> Option<Departure> {
        let mut after = |dt: f64| self.value(system, index, (t + dt, &motion.after(dt))) - here;
        let [(later, earlier), (near_later, near_earlier)] = [dt, 0.5 * dt].map(|dt| (after(dt), after(-dt)));
        // The change by the rate, without that by the third derivative, and the change by the second derivative.
        let odd = (8.0 * (near_later - near_earlier) - (later - earlier)) / 6.0;
        let even = 0.5 * (later + earlier);
        // What a smooth function does not have, up to third order.
        let of_even = (later + earlier - 4.0 * (near_later + near_earlier)).abs();
        let of_odd = (later - earlier - 2.0 * (near_later - near_earlier)).abs();
        let rounding = self.rounding(system, index, (t, x), dt);
        if max_or_nan(of_even, of_odd) > max_or_nan(rounding, MIN_KINK * (later.abs() + earlier.abs())) {
            // At a corner two functions are compared, each with the round-off of the point.
            let noise = NOTICEABLE * self.rounding(system, index, (t, x), h);
            let after = |dt: f64| self.value(system, index, (t + dt, &motion.after(dt))) - here;
            return departure_near_kink(after, dt, noise);
        }
        let departure = |side: f64, rate: f64, with_rate: bool| {
            Some(Departure { side, rate, with_rate, at_corner: false, before: 0.0 })
        };
        match (odd.abs() > max_or_nan(rounding, MIN_RATE * even.abs()), even.abs() > 0.0) {
            (true, _) => departure(sign(odd), odd / dt, true),
            (false, true) => departure(sign(even), 0.0, false),
            (false, false) => None,
        }
    }

    /// A time and a position a little after a point on a surface, as near to it as the function is beyond the surface by
    /// more than round-off: there the surface has the one normal of the part through which the motion goes. `None` if the
    /// motion does not go beyond it.
    pub fn beyond(&mut self, system: &dyn System, index: usize, (t, x): (f64, &Point), h: f64) -> Option<(f64, Point)> {
        let (motion, side) = (LocalMotion::at(system, t, x), self.side(index));
        let noise = NOTICEABLE * self.rounding(system, index, (t, x), h);
        let times = (0..=MAX_HALVINGS).rev().map(|k| DEPARTURE * h * f64::powi(0.5, k));
        let mut points = times.map(|dt| (t + dt, motion.after(dt)));
        points.find(|(t, x)| side * self.value(system, index, (*t, x)) < -noise)
    }

    /// Whether the next flight of a motion from a surface lasts longer than twice a time, but for flights that are longer
    /// than [`DEPARTURE`]: at some later time it is off the surface, on its side.
    pub fn flies_longer(
        &mut self,
        system: &dyn System,
        index: usize,
        (t, x): (f64, &Point),
        h: f64,
        time: f64,
    ) -> bool {
        let (motion, side, shortest) = (LocalMotion::at(system, t, x), self.side(index), 2.0 * time.abs());
        let longest = max_or_nan(shortest, DEPARTURE * h.abs());
        let noise = NOTICEABLE * self.rounding(system, index, (t, x), h);
        let times = (0..=MAX_HALVINGS).map(|k| longest * f64::powi(0.5, k)).take_while(|dt| *dt >= shortest);
        let mut times = times.map(|dt| dt.copysign(h));
        times.any(|dt| side * self.value(system, index, (t + dt, &motion.after(dt))) > noise)
    }
}

/// The departure where the function, whose change after a time is `after`, has a kink within the time dt. The sign at the
/// shortest time after which a change is more than round-off decides.
fn departure_near_kink(mut after: impl FnMut(f64) -> f64, dt: f64, noise: f64) -> Option<Departure> {
    let (mut side, mut before, mut since) = (0.0, 0.0, dt);
    let (mut at_corner, mut last_even) = (false, f64::NAN);
    for dt in (0..=MAX_HALVINGS).map(|k| dt * f64::powi(0.5, k)) {
        let [later, earlier] = [dt, -dt].map(&mut after);
        let even = later + earlier;
        if later.abs() > noise && sign(later) != side {
            (side, since) = (sign(later), dt);
        }
        if earlier.abs() > noise {
            before = sign(earlier);
        }
        if even.abs() > noise {
            at_corner = last_even.abs() < MAX_KINK_RATIO * even.abs();
            last_even = even;
        }
        // Written so that a NaN ends the search.
        if !(later.abs() > noise || even.abs() > noise) {
            break;
        }
    }
    let (whole, half) = (after(since), after(0.5 * since));
    let with_rate = whole.abs() < MAX_RATE_RATIO * half.abs();
    let rate = if with_rate { whole / since } else { 0.0 };
    // The motion comes from the side to which it goes, or along the surface.
    let at_corner = at_corner || side * before >= 0.0;
    (side != 0.0).then_some(Departure { side, rate, with_rate, at_corner, before })
}
