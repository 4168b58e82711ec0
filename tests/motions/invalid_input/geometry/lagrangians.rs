//! Invalid input to Lagrangians: their derivatives, fields, declared structure and closed motions.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EVERYTHING, EXTREME, Report, fine, places, triples};
use contact_examples::systems::{
    CoupledInZ, FreeParticle, HarmonicOscillator, Kepler, LaneEmden, Pendulum, UniformField,
};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::statements::{ActionSquared, AnyForce};
use contact_geom::{
    Derivatives, Dual, Force, ForceStructure, Forced, Lagrangian, Regularity, Scalar, Statement, Structure,
    VelocityDrag, VelocityPoint, WithoutClosedDerivatives, check_closed_derivatives, herglotz_field, legendre,
    legendre_jacobian, regularity, statements,
    support::{derived_gradient, derived_hessian, gradient_rounding, herglotz_rates, legendre_polynomials},
};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &["legendre", "legendre_jacobian", "herglotz_field", "herglotz_rates", "gradient_rounding"],
        run: herglotz,
    },
    InputTest { entries: &["legendre_polynomials"], run: polynomials },
    InputTest { entries: &["regularity", "Regularity::of", "Regularity::condition"], run: regularities },
    InputTest {
        entries: &[
            "derived_gradient",
            "derived_hessian",
            "check_closed_derivatives",
            "Lagrangian::value",
            "Derivatives::along",
            "Derivatives::with_gradient",
            "Derivatives::with_gradient_and_force",
            "Derivatives::with_force",
            "Derivatives::force",
            "Derivatives::rate",
            "Derivatives::mass_matrix",
            "Derivatives::gradient",
            "Derivatives::hessian",
        ],
        run: lagrangians,
    },
    InputTest {
        entries: &[
            "Lagrangian::applied_force",
            "Lagrangian::force_structure",
            "Lagrangian::has_force",
            "Force::value",
            "Force::structure",
            "ForceStructure::of_positions",
            "ForceStructure::is_of_positions",
            "ForceStructure::plus",
        ],
        run: forces,
    },
    InputTest { entries: &["Structure::defects"], run: structures },
    InputTest {
        entries: &["statements::residual", "statements::known_hamiltonian", "statements::conformal_flow"],
        run: residuals,
    },
    InputTest {
        entries: &[
            "FreeParticle::solution",
            "FreeParticle::velocity_through",
            "HarmonicOscillator::solution",
            "HarmonicOscillator::velocity_through",
            "UniformField::solution",
            "UniformField::velocity_through",
            "LaneEmden::solution",
        ],
        run: closed_forms,
    },
    InputTest { entries: &["Lagrangian::dt_dtau"], run: time_transformations },
];

fn herglotz(report: &mut Report) {
    for (t, x) in places() {
        let at = VelocityPoint::from(x);
        report.formula(&(t, x), fine(legendre(&EVERYTHING, t, &at)));
        report.formula(&(t, x), fine(legendre_jacobian(&EVERYTHING, t, &at)));
        report.formula(&(t, x), herglotz_field(&EVERYTHING, t, &at));
        report.formula(&(t, x), herglotz_rates(&EVERYTHING, t, &at));
        report.formula(&(t, x), herglotz_field(&WithoutClosedDerivatives(EVERYTHING), t, &at));
        let (of_value, of_gradient) = gradient_rounding(&EVERYTHING, t, &at);
        // Sizes are not negative, and may be NaN.
        let entries = (0..3).map(|i| of_gradient.component(i)).chain([of_value]);
        report.check(entries.into_iter().all(|e| !(e < 0.0)), || format!("{t}, {x:?}: {of_value}, {of_gradient:?}"));
    }
}

/// A Lagrangian that is linear in the velocity.
struct Linear;

impl Lagrangian<1> for Linear {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * q[0]
    }
}

fn regularities(report: &mut Report) {
    let refused = herglotz_field(&Linear, 0.4, &triples()[0].into()).err().map(|error| error.to_string());
    let says = refused.as_ref().is_some_and(|error| error.contains("choose a regular Lagrangian"));
    report.check(says, || format!("a singular W: {refused:?}"));

    for (t, x) in places() {
        let w = regularity(&EVERYTHING, t, &x.into());
        report.formula(&(t, x), fine((w.smallest, w.condition())));
    }
    for value in EXTREME {
        let w = Regularity::of(DMatrix::from_row_slice(2, 2, &[1.0, value, 0.5, 2.0]));
        let good = w.condition() >= 1.0 && (value.is_finite() || w.condition() == f64::INFINITY);
        report.check(good, || format!("{value}: {w:?}"));
    }
    let none = Regularity::of(DMatrix::zeros(0, 0)).condition();
    report.check(none.is_nan() || none >= 1.0, || format!("of an empty matrix {none}"));
}

fn lagrangians(report: &mut Report) {
    for (t, x) in places() {
        let at = VelocityPoint::from(x);
        let l = EVERYTHING;
        report.formula(&(t, x), fine(l.value(t, &at.q, &at.v, at.z)));
        report.formula(&(t, x), fine(l.with_gradient(t, &at)));
        report.formula(&(t, x), fine(l.with_gradient_and_force(t, &at)));
        report.formula(&(t, x), fine(l.with_force(t, &at)));
        report.formula(&(t, x), fine(l.force(t, &at)));
        report.formula(&(t, x), fine(l.rate(t, &at)));
        report.formula(&(t, x), fine(l.mass_matrix(t, &at)));
        report.formula(&(t, x), fine(l.gradient(t, &at)));
        report.formula(&(t, x), fine(derived_gradient(&l, t, &at)));
        for h in [l.hessian(t, &at), derived_hessian(&l, t, &at)] {
            report.formula(&(t, x), fine((h.qq, (h.qv, h.vv), ((h.qz, h.vz), h.zz))));
        }
        let moving = VelocityPoint {
            q: at.q.map(|re| Dual { re, d: SVector::from([1.0]) }),
            v: at.v.map(Dual::constant),
            z: Dual::constant(at.z),
        };
        report.formula(&(t, x), fine(l.along(t, &moving)));
        let (gradient, hessian) = check_closed_derivatives(&l, t, &at);
        report.check(gradient.is_none() && hessian.is_none(), || "closed derivatives of what has none".into());
        // A NaN in the comparison of a closed form is not lost.
        let (gradient, _) = check_closed_derivatives(&Pendulum::default(), t, &at);
        // The pendulum's derivatives do not depend on time and action.
        if t.is_finite() && x.z.is_finite() {
            report.formula(&(x.x, x.y), fine(gradient));
        }
    }
}

/// A force is not lost where it is not a number, and its structure is that of its coefficients.
fn forces(report: &mut Report) {
    for (t, x) in places() {
        let at = VelocityPoint::from(x);
        for force in
            [AnyForce(0.4).value(t, &at), Forced { lagrangian: EVERYTHING, force: AnyForce(0.4) }.applied_force(t, &at)]
        {
            report.formula(&(t, x), fine(force));
        }
        report.formula(&(t, x), herglotz_field(&Forced { lagrangian: EVERYTHING, force: AnyForce(0.4) }, t, &at));
    }
    for c in EXTREME {
        let drag = VelocityDrag { linear: SVector::<f64, 1>::new(c), quadratic: c };
        let moved = drag.value(0.0, &VelocityPoint::new([0.1], [0.5], 0.0));
        report.check(c.is_finite() || !moved[0].is_finite(), || format!("a drag of {c} is {moved}"));
        let forced = Forced { lagrangian: EVERYTHING, force: drag };
        report.check(forced.has_force() && forced.force_structure() == drag.structure() || c.is_nan(), || {
            format!("the drag {c} is lost")
        });
        let still = drag.structure().is_of_positions();
        report.check(still == (c == 0.0), || format!("a drag of {c} depends on positions alone"));
        let twice = drag.structure().plus(ForceStructure::of_positions());
        report.check(twice == drag.structure() || c.is_nan(), || format!("{twice:?}"));
    }
}

/// The defects of a declared structure at places where L may not be defined.
fn structures(report: &mut Report) {
    let all = Structure {
        autonomous: true,
        z_free: true,
        z_affine: true,
        constant_rate: true,
        separable: true,
        quadratic: true,
        constant_mass: true,
    };
    for (t, x) in places() {
        // Where L is not defined there are no defects; elsewhere every property has one.
        let Some(defects) = all.defects(&EVERYTHING, t, &x.into()) else { continue };
        report.check(t.is_finite() && x.is_finite(), || format!("claims are judged at t = {t}, {x:?}"));
        let defects: Vec<_> = defects.collect();
        report.check(defects.len() == 7, || format!("{} defects", defects.len()));
        for defect in defects {
            report.check(defect.size >= 0.0, || {
                format!("{} at t = {t}, {x:?} has the defect {}", defect.claim, defect.size)
            });
        }
    }
}

fn residuals(report: &mut Report) {
    // The system has no explicit time, symmetry or Hamiltonian in closed form.
    let without = [Statement::HamiltonianField, Statement::LegendreTransformation, Statement::Noether];
    for (t, x) in places() {
        let has_nan = x.to_vector().iter().any(|c| c.is_nan());
        for statement in Statement::ALL {
            let known = statements::STATEMENTS.contains(&statement);
            let residual = statements::residual(statement, &CoupledInZ::default(), t, &x.into());
            let good = match &residual {
                Ok(None) => !known || without.contains(&statement),
                Ok(Some(r)) => known && (!has_nan || !(*r <= 1e-3) || statement == Statement::Regularity),
                Err(_) => known,
            };
            report.check(good, || format!("statement {statement} at t = {t}, {x:?}: {residual:?}"));
        }
    }
    report.check(statements::known_hamiltonian::<1, _>(&Pendulum::default()).is_some(), || "no Hamiltonian".into());
    let flow = ActionSquared { c: 0.4 };
    for t in EXTREME {
        let residual = statements::conformal_flow(&flow, t, &triples()[0], &[(0.0, t)]);
        report.check(!t.is_nan() || !residual.as_ref().is_ok_and(|r| *r <= 1e-3), || format!("t = {t}: {residual:?}"));
    }
}

fn closed_forms(report: &mut Report) {
    let (free, oscillator) = (FreeParticle { gamma: -0.1 }, HarmonicOscillator { gamma: -0.1 });
    let field = UniformField::<1> { gamma: -0.1, field: [0.5] };
    for x in triples() {
        let at = VelocityPoint::from(x);
        report.formula(&x, fine(free.solution(0.4, &at)));
        report.formula(&x, fine(oscillator.solution(0.4, &at)));
        report.formula(&x, fine(field.solution(0.4, &at)));
        // Where no velocity or more than one joins the points, none is returned.
        for through in [free.velocity_through(x.x[0], x.y[0], 0.4), oscillator.velocity_through(x.x[0], x.y[0], 0.4)] {
            report.entry_point(&(x.x, x.y), through.ok_or("none"));
        }
        report.entry_point(&(x.x, x.y), field.velocity_through(&x.x, &x.y, 0.4).ok_or("none"));
    }
    let start = VelocityPoint::new([0.3], [0.7], 0.2);
    for t in EXTREME {
        report.formula(
            &t,
            fine(oscillator.solution(t, &start)).map(|x| (x, if t < 0.0 && t.is_infinite() { f64::NAN } else { 0.0 })),
        );
        report.entry_point(&t, free.velocity_through(0.1, 0.2, t).ok_or("none"));
        report.entry_point(&t, oscillator.velocity_through(0.1, 0.2, t).ok_or("none"));
        for n in [0, 1, 2, 5, u8::MAX] {
            report.formula(&t, LaneEmden { n }.solution(t).ok_or("none"));
        }
    }
}

fn time_transformations(report: &mut Report) {
    let kepler = Kepler::<2>::default();
    for value in EXTREME {
        let q = SVector::from([value, 0.3]);
        report.formula(&value, fine(kepler.dt_dtau(&q)));
    }
}

/// Polynomials of any degree into buffers of any length.
fn polynomials(report: &mut Report) {
    for x in EXTREME {
        for s in [0, 1, 2, 3, 9, usize::MAX] {
            let [_, p1, p2, ..]: [f64; 4] = legendre_polynomials(s, x);
            report.check(p1.to_bits() == x.to_bits(), || format!("P_1({x}) = {p1}"));
            let second = if s < 2 { 1.0 } else { (3.0 * x * x - 1.0) / 2.0 };
            report.check(p2.to_bits() == second.to_bits() || p2.is_nan() && second.is_nan(), || {
                format!("P_2({x}) = {p2}")
            });
            let ([], [one]): ([f64; 0], [f64; 1]) = (legendre_polynomials(s, x), legendre_polynomials(s, x));
            report.check(one == 1.0, || format!("P_0({x}) = {one}"));
        }
    }
}
