//! Section 3: every statement for every system and every discretisation.

use contact_examples::systems::System;
use contact_examples::{Checks, Subject, fractions};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, GeometryError, Statement, VelocityPoint, legendre};
use discrete_herglotz::statements::{STATEMENTS, residual};
use discrete_herglotz::{
    DiscreteLagrangian, InputError,
    rules::{Method, Quadrature, Rule},
    theory::{DiscretePath, derived_jet},
};

/// The time steps at which discretisations are checked, a factor of ten apart.
pub const STEPS: [f64; 2] = [0.1, 0.01];

/// The points at which each statement is checked for each system, discretisation and step.
const SAMPLES: usize = 16;

/// The point of Q x Q x R of the straight step through a point of TQ x R, which is in its middle: inside the domain of
/// the system's Lagrangian like the point itself.
pub fn straight_step<const N: usize>(x: &VelocityPoint<N>, h: f64) -> DiscretePoint<N> {
    let half = x.v * (0.5 * h);
    DiscretePoint { q0: x.q - half, q1: x.q + half, z0: x.z }
}

/// Checks a system with all methods whose hypothesis it meets, and what is said of rules on Q x Q x R^2 with all rules.
pub fn check<const N: usize, S: System<N>>(system: &S, checks: &mut Checks) {
    for h in STEPS {
        for method in Method::applicable(&system.structure()) {
            with_method(method, system, h, checks);
        }
        for rule in Rule::ALL {
            with_rule(rule, system, h, checks);
        }
    }
}

/// The times and points at which a system is checked.
fn points<const N: usize, S: System<N>>(system: &S, h: f64) -> Vec<(f64, DiscretePoint<N>)> {
    let point = |i| {
        let (t, x) = system.sample(&fractions(i, 2 * N + 2));
        (t, straight_step(&x, h))
    };
    (0..SAMPLES).map(point).collect()
}

/// The statements of section 3 that hold for every discrete Lagrangian.
fn with_method<const N: usize, S: System<N>>(method: Method, system: &S, h: f64, checks: &mut Checks) {
    let subject = |statement| Subject::discrete(statement, system.name(), method.name(), h);
    let t0 = system.initial_time();
    let ld = match method.discretise(system, h, t0, &legendre(system, t0, &system.initial())) {
        Ok(ld) => ld,
        Err(error) => return checks.record(&subject(STATEMENTS[0]), Err(error)),
    };
    let symmetries = system.symmetries();
    let points = points(system, h);
    for statement in STATEMENTS {
        let subject = subject(statement);
        for (t, x) in &points {
            checks.record(&subject, residual(statement, &ld, &symmetries, *t, x));
        }
    }
}

/// Statements 16 and 41, on rules alone.
fn with_rule<const N: usize, S: System<N>>(rule: Rule, system: &S, h: f64, checks: &mut Checks) {
    let subject = |statement| Subject::discrete(statement, system.name(), rule.name, h);
    let ld = match rule.of(system, h) {
        Ok(ld) => ld,
        Err(error) => return checks.record(&subject(Statement::VermeerenBravettiSeri), Err(error)),
    };
    for (t, x) in points(system, h) {
        checks.record(&subject(Statement::VermeerenBravettiSeri), equivalent_conditions(&ld, t, &x).map(Some));
        checks.record(&subject(Statement::ExtendedRules), momenta_from_both_spaces(&ld, t, &x).map(Some));
    }
}

/// Statement 16: the condition of Vermeeren, Bravetti and Seri and the discrete Herglotz equations hold together.
///
/// On a path that solves neither, their residuals differ by the factor `1 - S_z1` of the later step, which does not
/// vanish; so they vanish together. Relative to the momenta that cancel in them.
fn equivalent_conditions<const N: usize, S: System<N>>(
    ld: &Quadrature<&S>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, InputError> {
    let h = DiscreteLagrangian::<N>::step_size(ld);
    let stride = x.q1 - x.q0;
    // Of changing speed: a path at constant speed solves the equations where no force acts.
    let points = (0..5).map(|k| x.q0 + stride * (f64::from(k) + 0.1 * (1.7 * f64::from(k)).sin())).collect();
    let path = DiscretePath::<N>::new(points)?;
    let herglotz = path.herglotz_residuals(ld, t, x.z0).map_err(InputError::FirstStep)?;
    let extended = path.extended_residuals(ld, t, x.z0).map_err(InputError::FirstStep)?;
    let z = path.actions(ld, t, x.z0).map_err(InputError::FirstStep)?;
    let mut worst: f64 = 0.0;
    for (k, (herglotz, extended)) in herglotz.iter().zip(&extended).enumerate() {
        let step = |k: usize| {
            let at = DiscretePoint { q0: path.points()[k], q1: path.points()[k + 1], z0: z[k] };
            ld.extended_jet(t + k as f64 * h, &at, z[k + 1])
        };
        let (before, after) = (step(k), step(k + 1));
        let factor = 1.0 - after.z1;
        if factor == 0.0 {
            return Ok(f64::INFINITY);
        }
        worst = worst.max((extended - herglotz * factor).amax() / after.s1.amax().max(before.s2.amax()));
    }
    Ok(worst)
}

/// Statement 41, its first half: a rule on Q x Q x R^2 gives `p0 = -S_1/(1 + S_z0)`, `p1 = S_2/(1 - S_z1)` and the
/// factor `(1 + S_z0)/(1 - S_z1)`, and these are the momenta and sigma_d of the L_d on Q x Q x R that solves it for
/// `z1`, its derivatives taken from its value alone.
fn momenta_from_both_spaces<const N: usize, S: System<N>>(
    ld: &Quadrature<&S>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let jet = derived_jet(ld, t, x)?;
    let s = ld.extended_jet(t, x, x.z0 + jet.value);
    let apart = |a: SVector<f64, N>, b: SVector<f64, N>| (a - b).amax() / a.amax().max(b.amax());
    let start = apart(-s.s1 / (1.0 + s.z0), -jet.d1 / jet.sigma());
    let end = apart(s.s2 / (1.0 - s.z1), jet.d2);
    let sigma = ((1.0 + s.z0) / (1.0 - s.z1) - jet.sigma()).abs() / jet.sigma().abs();
    let action = (s.value - jet.value).abs() / (x.z0.abs() + jet.value.abs());
    Ok(start.max(end).max(sigma).max(action))
}
