//! Statements 16 (section 3, remark) and 41 (section 6): the condition of Vermeeren, Bravetti and Seri on `Q x Q x R^2`
//! is equivalent to the discrete Herglotz equation, and their rules are discrete Lagrangians on Q x Q x R with the same
//! momenta.

use crate::common::{around, on_random, step_from, within};
use contact_examples::systems::{System, SystemVisitor, visit_catalogue};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    DiscretePoint, Statement,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use discrete_herglotz::{
    DiscreteLagrangian,
    rules::Rule,
    theory::{DiscretePath, legendre_minus, legendre_plus},
};

fn with_rule<const N: usize, S: System<N>>(rule: Rule, system: &S) {
    on_random(&format!("{} with {}", system.name(), rule.name), 2 * N + 3, |u| {
        let (t, v) = system.sample(&u[1..]);
        let h = step_from(u[0]);
        let x = around(&v, h);
        let ld = rule.of(system, h).map_err(|e| e.to_string())?;

        // Statement 41: z1 = z0 + S, and the momenta through S are those of L_d.
        let jet = ld.jet(t, &x).map_err(|e| e.to_string())?;
        let s = ld.extended_jet(t, &x, x.z0 + jet.value);
        let (p0, p1) = (s.s1 / -(1.0 + s.z0), s.s2 / (1.0 - s.z1));
        let minus = legendre_minus(&ld, t, &x).map_err(|e| e.to_string())?;
        let plus = legendre_plus(&ld, t, &x).map_err(|e| e.to_string())?;
        let size = minus.p.max_abs_or_nan().max_or_nan(plus.p.max_abs_or_nan());
        let momenta = (p0 - minus.p).max_abs_or_nan().max_or_nan((p1 - plus.p).max_abs_or_nan()) / size;
        let action = (s.value - jet.value).abs() / (1.0 + jet.value.abs());
        within(momenta.max_or_nan(action)).map_err(|e| format!("statement {}: {e}", Statement::ExtendedRules))?;

        // Statement 16: the two residuals on a path that is no solution.
        let stride = x.q1 - x.q0;
        let points: Vec<SVector<f64, N>> = (0..6).map(|k| x.q0 + stride * (1.3 * f64::from(k)).sin()).collect();
        let path = DiscretePath::new(points).map_err(|e| e.to_string())?;
        let herglotz = path.herglotz_residuals(&ld, t, x.z0).map_err(|e| e.to_string())?;
        let extended = path.extended_residuals(&ld, t, x.z0).map_err(|e| e.to_string())?;
        let z = path.actions(&ld, t, x.z0).map_err(|e| e.to_string())?;
        let mut worst: f64 = 0.0;
        for k in 0..4 {
            // They differ by the factor 1 - S_z1 of the later step, which is not zero.
            let at = DiscretePoint { q0: path.points()[k + 1], q1: path.points()[k + 2], z0: z[k + 1] };
            let factor = 1.0 - ld.extended_jet(t + (k + 1) as f64 * h, &at, z[k + 2]).z1;
            worst = worst.max_or_nan(
                (extended[k] / factor - herglotz[k]).max_abs_or_nan() / size.max_or_nan(herglotz[k].max_abs_or_nan()),
            );
        }
        within(worst).map_err(|e| format!("statement {}: {e}", Statement::VermeerenBravettiSeri))
    });
}

/// With every rule, on every system.
#[test]
fn with_every_rule() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            Rule::ALL.into_iter().for_each(|rule| with_rule(rule, system));
        }
    }
    visit_catalogue(&mut Visitor);
}
