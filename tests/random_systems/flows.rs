//! Flows of discrete Lagrangians: each step solves its equations, is conformally contact, and can be taken backward.

use super::problem::Problem;
use super::random_numbers::RandomNumbers;
use super::verdict::{Checked, Kind, Verdict, Wrong, ended, ensure, refused};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, DiscreteJet, DiscretePoint, PhasePoint, legendre,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{
    DiscreteLagrangian, DiscreteStep,
    rules::{Flow, Method},
    solve::Solver,
    theory::{DiscretePath, legendre_minus, legendre_plus},
};

pub fn flow<const N: usize>(problem: &Problem<N>, random: &mut RandomNumbers) -> Checked {
    let Problem { system, t0, start, .. } = problem;
    let method = random.pick(Method::ALL);
    let (h, steps) = (random.scale(1e-4, 1.0), 1 + random.below(40));
    let state = legendre(system, *t0, start);
    let ld = match method.discretise(system, h, *t0, &state) {
        Ok(ld) => ld,
        Err(error) => return Ok(refused(&error)),
    };
    let mut flow = match Flow::with_guess(&ld, *t0, state, start.v) {
        Ok(flow) => flow,
        Err(error) => return Ok(refused(&error)),
    };
    let mut rows = vec![(*t0, state)];
    let taken = (0..steps).try_for_each(|_| flow.step().map(|step| rows.push((step.t, step.to))));
    let finite = rows.iter().all(|(t, x)| t.is_finite() && x.check().is_ok());
    ensure(finite, Kind::NotFinite, || format!("{method}: {:?}", rows.last()))?;
    for pair in rows.windows(2) {
        step_solves_its_equations(&ld, pair[0].0, &pair[0].1, &pair[1].1).map_err(|wrong| named(wrong, method))?;
    }
    if rows.len() > 1 {
        let k = random.below(rows.len() - 1);
        let guess = (rows[k + 1].1.q - rows[k].1.q) / h;
        is_conformal(&ld, rows[k].0, &rows[k].1, &guess).map_err(|wrong| named(wrong, method))?;
        let points = rows.iter().map(|(_, x)| x.q).collect();
        let path = DiscretePath::new(points).map_err(|e| Wrong { kind: Kind::RoutesDiffer, what: e.to_string() })?;
        if let Ok(residuals) = path.herglotz_residuals(&ld, *t0, state.z) {
            let finite = residuals.iter().flatten().all(|r| r.is_finite());
            ensure(finite, Kind::NotFinite, || format!("{method}: residuals {residuals:?}"))?;
        }
        // Backward to the start of the last step, or to another point from which a step ends at the same state.
        let to = *flow.state();
        if flow.step_back().is_ok() {
            let back = *flow.state();
            let t = rows[0].0 + (rows.len() - 2) as f64 * h;
            ensure(back.check().is_ok(), Kind::NotFinite, || format!("{method}: back to {back:?}"))?;
            step_solves_its_equations(&ld, t, &back, &to)
                .map_err(|wrong| named(wrong, format_args!("{method}, back")))?;
        }
        if let Ok(again) = Flow::from_points(&ld, *t0, DiscretePoint { q0: rows[0].1.q, q1: rows[1].1.q, z0: state.z })
        {
            let finite = again.state().check().is_ok();
            ensure(finite, Kind::NotFinite, || format!("{method}: from points {:?}", again.state()))?;
        }
    }
    Ok(taken.map_or_else(|cause| ended(&cause), |()| Verdict::Right))
}

fn named(wrong: Wrong, name: impl std::fmt::Display) -> Wrong {
    Wrong { what: format!("{name}: {}", wrong.what), ..wrong }
}

/// Checks the discrete Herglotz equations of a step, `F-L_d` at its start and `F+L_d` at its end, up to the rounding of
/// the positions times the derivative of the momenta by the positions.
pub fn step_solves_its_equations<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    from: &PhasePoint<N>,
    to: &PhasePoint<N>,
) -> Result<(), Wrong> {
    let x = DiscretePoint { q0: from.q, q1: to.q, z0: from.z };
    let (Ok(jet), Ok(minus), Ok(plus)) = (ld.second_jet(t, &x), legendre_minus(ld, t, &x), legendre_plus(ld, t, &x))
    else {
        return Ok(());
    };
    let max = |m: &[f64]| max_abs_or_nan(m.iter().copied());
    let slope = max(jet.d11.as_slice()) + max(jet.d12.as_slice()) + max(jet.d22.as_slice());
    let by_action = max(jet.d1z.as_slice()) + max(jet.d2z.as_slice()) + jet.dzz.abs();
    let DiscreteJet { value, d1, d2, dz, .. } = jet.first;
    let (places, momenta) = (max(from.q.as_slice()) + max(to.q.as_slice()), max(d1.as_slice()) + max(d2.as_slice()));
    let sigma = jet.first.sigma();
    let actions = from.z.abs() + to.z.abs() + value.abs();
    let sizes = momenta * (1.0 + dz.abs()) + slope * places + by_action * actions * (1.0 + momenta);
    // 1e3 roundings of each term: Newton's method ends some units above round-off, and L has up to a dozen terms. The
    // rounding of one equation moves the solution by its inverse, and the other equation by its derivative.
    let condition = max_or_nan(1.0, slope / jet.regularity().smallest) * max_or_nan(1.0, 1.0 / sigma);
    // The change of the equations by the rounding of the time, far from t = 0.
    let later = t + 16.0 * f64::EPSILON * t.abs();
    let (Ok(minus_later), Ok(plus_later)) = (legendre_minus(ld, later, &x), legendre_plus(ld, later, &x)) else {
        return Ok(());
    };
    let of_time = max((minus_later.p - minus.p).as_slice()) + max((plus_later.p - plus.p).as_slice());
    let bound = (1e3 * f64::EPSILON * sizes + of_time) * condition + f64::MIN_POSITIVE;
    let of_time = (plus_later.z - plus.z).abs() + of_time * places;
    let bound_z = (1e3 * f64::EPSILON * (actions + momenta * places) + of_time) * condition * max_or_nan(1.0, sigma)
        + f64::MIN_POSITIVE;
    let (at_start, at_end) = (max((minus.p - from.p).as_slice()), max((plus.p - to.p).as_slice()));
    let action = (plus.z - to.z).abs();
    // Where the derivatives overflow there is no bound.
    let applies = bound.is_finite() && bound_z.is_finite();
    let good = at_start <= bound && at_end <= bound && action <= bound_z;
    ensure(!applies || good, Kind::Residual, || {
        format!(
            "h = {:.1e}, sigma {sigma:.1e}, slope {slope:.1e}, smallest {:.1e}: {at_start:.1e}, {at_end:.1e} for {bound:.1e}; \
             {action:.1e} for {bound_z:.1e}; {from:?} to {to:?}",
            ld.step_size(),
            jet.regularity().smallest
        )
    })
}

/// Checks that a step scales the contact form by its sigma_d, by differences of the step in all coordinates of its
/// start.
pub fn is_conformal<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    from: &PhasePoint<N>,
    guess: &SVector<f64, N>,
) -> Result<(), Wrong> {
    let take = |from: &PhasePoint<N>| ld.forward(t, from, guess, &mut Solver::default());
    let Ok(DiscreteStep { end, sigma, .. }) = take(from) else { return Ok(()) };
    let start = ChartVector::from(*from);
    let mut worst = 0.0f64;
    let end_at = ChartVector::from(end);
    for i in 0..ChartVector::<N>::DIMENSION {
        // The third root of round-off is the best step for differences of the third order, in units of the coordinates
        // of the same kind.
        let like = |x: &ChartVector<N>| match i / N {
            0 => max_abs_or_nan(x.x.iter().copied()),
            1 => max_abs_or_nan(x.y.iter().copied()),
            _ => x.z.abs(),
        };
        let unit = max_or_nan(start.component(i).abs(), 1e-2 * max_or_nan(like(&start), like(&end_at)));
        let step = 6e-6 * if unit == 0.0 { 1e-2 } else { unit };
        let aside = |s: f64| take(&start.plus(ChartVector::from_fn(|j| if i == j { s } else { 0.0 })).into());
        let (Ok(up), Ok(down), Ok(up_2), Ok(down_2)) =
            (aside(step), aside(-step), aside(2.0 * step), aside(-2.0 * step))
        else {
            return Ok(());
        };
        let difference =
            |a: &PhasePoint<N>, b: &PhasePoint<N>| ChartVector::from(*a).minus((*b).into()).scale(0.5 / step);
        let (narrow, wide) = (difference(&up.end, &down.end), difference(&up_2.end, &down_2.end).scale(0.5));
        // Where two differences disagree the step is not smooth at this scale, and nothing is asserted.
        let off = narrow.minus(wide);
        if off.amax() > 1e-4 * narrow.amax() {
            return Ok(());
        }
        let unit = |j: usize| f64::from(u8::from(i == j));
        let direction = ChartVector::<N>::from_fn(unit);
        let at_end = narrow.z - end.p.dot(&narrow.x);
        let at_start = sigma * (direction.z - from.p.dot(&direction.x));
        // The noise of the differences, which is the difference of two of them, or the rounding of the ends; the terms
        // may be smaller than it.
        let rounding = 8.0 * (f64::EPSILON * (end.z.abs() + end.p.abs().dot(&end.q.abs())) + f64::MIN_POSITIVE) / step;
        let noise = off.z.abs() + end.p.abs().dot(&off.x.abs()) + rounding;
        let size = narrow.z.abs() + end.p.abs().dot(&narrow.x.abs()) + at_start.abs();
        let defect = ((at_end - at_start).abs() - 4.0 * noise) / size;
        worst = max_or_nan(worst, if size == 0.0 { 0.0 } else { defect });
    }
    ensure(worst <= 1e-3, Kind::NotConformal, || format!("defect {worst:.1e}, sigma_d = {sigma:e} at {from:?}"))
}
