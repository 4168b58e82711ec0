//! Attacks on contact-geom. Its formulas are pointwise: what is not a number is handed on or refused, never lost.

use super::numbers::{Everything, HOSTILE, Report, fine, places, triples};
use super::{Attack, Exceptions};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::statements::{ActionSquared, AnyFunction};
use contact_geom::systems::{CoupledInZ, FreeParticle, HarmonicOscillator, Kepler, LaneEmden, Pendulum, UniformField};
use contact_geom::{
    Border, Clock, Conformality, ContactForm, Darboux, DiscreteJet, DiscretePoint, Dual, Energy, EtaMinus, EtaPlus,
    Form, HerglotzField, InfinitesimalConformality, Lagrangian, LagrangianForm, Larger, Largest, Module,
    OneParameterGroup, PhasePoint, Regularity, Scalar, SecondDiscreteJet, Smooth, SmoothFunction, Structure, Symmetry,
    Triple, ValueOnly, VelocityPoint, check_closed_derivatives, conformal_factor_along, conformality,
    conformality_with_jacobian, derivative_along, derived_gradient, derived_hessian, dissipation_defect, generic,
    hamiltonian_vector_field, herglotz_field, herglotz_rates, infinitesimal_conformality, jacobi_bracket, larger,
    largest, legendre, legendre_jacobian, lie_bracket, lie_derivative, linear, regularity, seed, statements,
};

pub const EXCEPTIONS: Exceptions = &[
    ("Lagrangian::closed_*", "the implementor's, and nothing by default"),
    ("Lagrangian::structure", "the implementor's, and takes no number"),
    ("OneParameterGroup::act", "the implementor's; that of Symmetry is attacked with what calls it"),
    ("SystemVisitor::*", "the implementor's"),
    ("System::*", "the implementor's: constants and samples"),
    ("ClosedFlow::*", "the implementor's"),
    ("systems::*", "walk the catalogue, and take no number"),
    ("Chain::free", "takes no number"),
    ("Duffing::forced", "takes no number"),
    ("Lienard::initial", "takes no number"),
    ("VanDerPol::initial", "takes no number"),
    ("Structure::has_constant_rate", "takes no number"),
    ("Structure::is_affine_in_z", "takes no number"),
    ("Triple::from_fn", "the caller's function"),
    ("$name::new", "holds what it is given; check() and every start look at it"),
];

pub const ATTACKS: &[Attack] = &[
    Attack { on: &["Symmetry::rotation", "Symmetry::axis"], run: symmetries },
    Attack {
        on: &[
            "OneParameterGroup::generator",
            "OneParameterGroup::tangent_lift",
            "OneParameterGroup::on_velocities",
            "OneParameterGroup::on_discrete",
            "OneParameterGroup::velocity_generator",
            "OneParameterGroup::momentum",
            "OneParameterGroup::symmetry_defect",
        ],
        run: groups,
    },
    Attack {
        on: &[
            "ContactForm::eta",
            "ContactForm::d_eta",
            "ContactForm::volume",
            "ContactForm::reeb",
            "ContactForm::flat",
            "ContactForm::sharp",
            "generic::volume",
            "generic::reeb",
            "generic::flat",
            "generic::sharp",
        ],
        run: forms,
    },
    Attack {
        on: &[
            "DiscreteJet::new",
            "DiscreteJet::with_sigma",
            "DiscreteJet::sigma",
            "SecondDiscreteJet::legendre_minus_jacobian",
            "SecondDiscreteJet::legendre_plus_jacobian",
            "SecondDiscreteJet::regularity",
        ],
        run: jets,
    },
    Attack {
        on: &[
            "hamiltonian_vector_field",
            "derivative_along",
            "jacobi_bracket",
            "dissipation_defect",
            "lie_bracket",
            "lie_derivative",
            "infinitesimal_conformality",
            "conformal_factor_along",
        ],
        run: fields,
    },
    Attack { on: &["conformality", "conformality_with_jacobian"], run: pullbacks },
    Attack {
        on: &["Smooth::at", "Smooth::with_jacobian", "SmoothFunction::value", "SmoothFunction::differential"],
        run: smooth,
    },
    Attack { on: &["legendre", "legendre_jacobian", "herglotz_field", "herglotz_rates"], run: herglotz },
    Attack { on: &["regularity", "Regularity::of", "Regularity::condition"], run: regularities },
    Attack {
        on: &[
            "derived_gradient",
            "derived_hessian",
            "check_closed_derivatives",
            "Lagrangian::value",
            "Lagrangian::along",
            "Lagrangian::with_gradient",
            "Lagrangian::with_force",
            "Lagrangian::mass_matrix",
            "Lagrangian::gradient",
            "Lagrangian::hessian",
        ],
        run: lagrangians,
    },
    Attack { on: &["larger", "largest", "Larger::larger", "Largest::largest"], run: maxima },
    Attack { on: &["SingularMatrix::of", "linear::solve", "linear::solve_in_kernel"], run: systems_of_equations },
    Attack {
        on: &[
            "Triple::dot",
            "Triple::scale",
            "Triple::plus",
            "Triple::minus",
            "Triple::component",
            "Triple::to_vector",
            "Triple::amax",
            "Triple::is_finite",
            "seed",
        ],
        run: coordinates,
    },
    Attack { on: &["$name::from_slices", "$name::check"], run: points },
    Attack { on: &["Structure::defects"], run: structures },
    Attack {
        on: &["statements::residual", "statements::known_hamiltonian", "statements::conformal_flow"],
        run: residuals,
    },
    Attack {
        on: &[
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
    Attack { on: &["Kepler::clock", "Clock::rate"], run: clocks },
    Attack {
        on: &["$Dual::constant", "Module::null", "Module::each", "Module::join", "Module::scaled", "Module::combined"],
        run: differentials,
    },
    Attack {
        on: &[
            "Scalar::re",
            "Scalar::pivot_size",
            "Scalar::abs",
            "Scalar::signum",
            "Scalar::max",
            "Scalar::min",
            "Scalar::if_less",
            "Scalar::extent",
            "Scalar::recip",
            "Scalar::sqrt",
            "Scalar::powi",
            "Scalar::powf",
            "Scalar::exp",
            "Scalar::exp_m1",
            "Scalar::ln",
            "Scalar::ln_1p",
            "Scalar::sin_cos",
            "Scalar::sin",
            "Scalar::cos",
            "Scalar::sin_versine",
            "Scalar::versine",
            "Scalar::tan",
            "Scalar::sinh",
            "Scalar::cosh",
            "Scalar::tanh",
            "Scalar::atan",
        ],
        run: functions,
    },
];

/// Indices that are no plane, axes that have no direction.
fn symmetries(report: &mut Report) {
    for (i, j) in [(0, 0), (0, 2), (2, 0), (usize::MAX, 0), (usize::MAX, usize::MAX)] {
        report.check(Symmetry::<2>::rotation(i, j).is_err(), || format!("rotation({i}, {j})"));
    }
    for value in HOSTILE {
        for axis in [[value, 0.0, 0.0], [1.0, value, 0.0], [value; 3]] {
            let unit = |s: Symmetry<3>| match s {
                Symmetry::Axis(a) => (a.norm() - 1.0).abs() <= 8.0 * f64::EPSILON,
                _ => false,
            };
            let made = Symmetry::<3>::axis(axis);
            let refused = !axis.iter().all(|a| a.is_finite()) || axis == [0.0; 3];
            // The length of a huge axis overflows, that of a subnormal one has few digits: either is refused.
            report.check(if refused { made.is_err() } else { made.is_err() || made.is_ok_and(unit) }, || {
                format!("axis({axis:?}) is {made:?}")
            });
        }
    }
}

fn groups(report: &mut Report) {
    let group = Symmetry::Scaling(SVector::from([0.7]));
    for s in HOSTILE {
        report.formula(&s, fine(group.act(s, &SVector::from([0.3]))));
        report.formula(&s, fine(group.tangent_lift(s, &SVector::from([0.3]), &SVector::from([0.5]))));
    }
    for x in triples() {
        let at = VelocityPoint::from(x);
        report.formula(&x, fine(group.on_velocities(0.2, &at)));
        report.formula(&x, fine(group.on_discrete(0.2, &x)));
        report.formula(&x.x, fine(group.generator(&x.x)));
        report.formula(&(x.x, x.y), fine(group.velocity_generator(&at)));
        report.formula(&(x.x, x.y), fine(group.momentum(&x.x, &x.y)));
        report.formula(&x, fine(group.symmetry_defect(&Everything, 0.4, &at)));
    }
}

/// Closed forms and generic ones, on T*Q x R, on TQ x R and on Q x Q x R.
fn forms(report: &mut Report) {
    fn one(report: &mut Report, form: &impl ContactForm<1>, x: &Triple<1>, of: &Triple<1>) {
        report.formula(&of.y, form.eta(x));
        report.formula(&(*of, *of), form.flat(x, of));
        report.formula(&(*of, *of), form.sharp(x, of));
        report.formula(&(*of, *of), generic::flat(form, x, of));
        report.formula(&(*of, *of), generic::sharp(form, x, of));
        report.formula(&of.y, generic::reeb(form, x));
        report.formula(&of.y, generic::volume(form, x));
    }
    let upward = Triple { x: [0.0].into(), y: [0.0].into(), z: 1.0 };
    for x in triples() {
        one(report, &Darboux, &x, &x);
        one(report, &Form(Darboux), &x, &x);
        // That of Darboux coordinates is the same everywhere.
        report.check(Darboux.reeb(&x) == Ok(upward) && Darboux.volume(&x).is_ok_and(|v| v.abs() == 1.0), || {
            format!("{x:?}")
        });
    }
    for (t, x) in places() {
        let form = LagrangianForm { lagrangian: &Everything, t };
        let input = (t, x);
        report.formula(&input, form.eta(&x));
        report.formula(&input, form.d_eta(&x));
        report.formula(&input, form.volume(&x));
        report.formula(&input, form.reeb(&x));
        report.formula(&input, form.flat(&x, &x));
        report.formula(&input, form.sharp(&x, &x));
        report.formula(&input, generic::volume(&form, &x));
        report.formula(&input, generic::sharp(&form, &x, &x));
    }
    let jets = |x: &DiscretePoint<1>| Ok(second_jet([x.q0[0], x.q1[0], x.z0]));
    for x in triples() {
        report.formula(&x, EtaMinus(jets).eta(&x));
        report.formula(&x, EtaPlus(jets).eta(&x));
        report.formula(&x, EtaMinus(jets).sharp(&x, &x));
        report.formula(&x, EtaPlus(jets).sharp(&x, &x));
    }
}

/// A jet all of whose entries depend on three numbers.
fn second_jet([a, b, c]: [f64; 3]) -> SecondDiscreteJet<1> {
    let sum = a + 2.0 * b + 3.0 * c;
    let one = |x: f64| SVector::<f64, 1>::from([x]);
    let matrix = |x: f64| SMatrix::<f64, 1, 1>::from([[x]]);
    SecondDiscreteJet {
        first: DiscreteJet::new(sum, one(a + sum), one(b - sum), 0.1 * sum),
        d11: matrix(1.0 + sum),
        d12: matrix(-2.0 + 0.1 * sum),
        d22: matrix(1.5 - sum),
        d1z: one(0.1 * sum),
        d2z: one(0.2 - 0.1 * sum),
        dzz: 0.3 * sum,
    }
}

fn jets(report: &mut Report) {
    for x in triples() {
        let jet = second_jet([x.x[0], x.y[0], x.z]);
        report.formula(&x, fine(jet.first.sigma()));
        report.formula(&x, fine(jet.legendre_minus_jacobian()));
        report.formula(&x, fine(jet.legendre_plus_jacobian()));
        let condition = jet.regularity().condition();
        report.check(condition >= 1.0 || condition.is_nan(), || format!("{x:?}: condition {condition}"));
    }
    for sigma in HOSTILE {
        let jet = DiscreteJet::new(0.0, SVector::from([1.0]), SVector::from([1.0]), 0.0).with_sigma(sigma);
        report.check(jet.sigma().to_bits() == sigma.to_bits(), || format!("sigma {sigma} becomes {}", jet.sigma()));
    }
}

fn fields(report: &mut Report) {
    let (f, g) = (AnyFunction(0.8), AnyFunction(1.3));
    for x in triples() {
        report.formula(&x, hamiltonian_vector_field(&Darboux, &f, 0.4, &x));
        report.formula(&x, fine(derivative_along(&f, 0.4, &x, &x)));
        report.formula(&x, jacobi_bracket(&Darboux, &f, &g, 0.4, &x));
        report.formula(&x, dissipation_defect(&Darboux, &f, &g, 0.4, &x));
    }
    for (t, x) in places() {
        let field = HerglotzField { lagrangian: &Everything, t };
        let form = LagrangianForm { lagrangian: &Everything, t };
        report.formula(&(t, x), lie_bracket(&field, &field, &x).and_then(|b| field.at(&x).map(|f| (b, f))));
        report.formula(&(t, x), lie_derivative(&form, &field, &x));
        let found = infinitesimal_conformality(&form, &field, &x);
        report.formula(&(t, x), found.map(|InfinitesimalConformality { rate, defect }| (rate, defect)));
    }
    let path = |_: f64| Triple { x: [0.3].into(), y: [0.7].into(), z: 0.2 };
    for value in HOSTILE {
        let factor = conformal_factor_along(&Darboux, &f, path, &[(0.1, value), (0.2, 0.5)]);
        report.check(factor.as_ref().is_ok_and(|s| value.is_finite() || !s.is_finite() || *s == 0.0), || {
            format!("a weight {value} leads to {factor:?}")
        });
    }
    report.check(conformal_factor_along(&Darboux, &f, path, &[]).is_ok_and(|s| s == 1.0), || "no quadrature".into());
}

fn pullbacks(report: &mut Report) {
    let numbers = |c: Conformality<1>| (c.sigma, c.defect);
    for (t, x) in places() {
        let map = contact_geom::Legendre { lagrangian: &Everything, t };
        let source = LagrangianForm { lagrangian: &Everything, t };
        report.formula(&(t, x), conformality(&source, &Darboux, &map, &x).map(numbers));
    }
    for (rows, columns) in [(0, 0), (3, 2), (2, 3), (4, 4)] {
        let jacobian = DMatrix::zeros(rows, columns);
        let x = triples()[0];
        let refused = conformality_with_jacobian(&Darboux, &Darboux, &x, &x, &jacobian).is_err();
        report.check(refused, || format!("a Jacobian of {rows} x {columns}"));
    }
    for value in HOSTILE {
        let x = triples()[0];
        let jacobian =
            DMatrix::from_fn(3, 3, |i, j| if i == 1 && j == 1 { value } else { f64::from(u8::from(i == j)) });
        let jacobian = jacobian.map(|e| e * value);
        report.formula(&value, conformality_with_jacobian(&Darboux, &Darboux, &x, &x, &jacobian).map(numbers));
    }
}

fn smooth(report: &mut Report) {
    for (t, x) in places() {
        let field = HerglotzField { lagrangian: &Everything, t };
        report.formula(&(t, x), field.at(&x));
        report.formula(&(t, x), field.with_jacobian(&x));
        report.formula(&(t, x), fine(Energy(&Everything).value(t, &x)));
        report.formula(&(t, x), fine(Energy(&Everything).differential(t, &x)));
    }
}

fn herglotz(report: &mut Report) {
    for (t, x) in places() {
        let at = VelocityPoint::from(x);
        report.formula(&(t, x), fine(legendre(&Everything, t, &at)));
        report.formula(&(t, x), fine(legendre_jacobian(&Everything, t, &at)));
        report.formula(&(t, x), herglotz_field(&Everything, t, &at));
        report.formula(&(t, x), herglotz_rates(&Everything, t, &at));
        report.formula(&(t, x), herglotz_field(&ValueOnly(Everything), t, &at));
    }
}

fn regularities(report: &mut Report) {
    for (t, x) in places() {
        let w = regularity(&Everything, t, &x.into());
        report.formula(&(t, x), fine((w.smallest, w.condition())));
    }
    for value in HOSTILE {
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
        let l = Everything;
        report.formula(&(t, x), fine(l.value(t, &at.q, &at.v, at.z)));
        report.formula(&(t, x), fine(l.with_gradient(t, &at)));
        report.formula(&(t, x), fine(l.with_force(t, &at)));
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

fn maxima(report: &mut Report) {
    for a in HOSTILE {
        for b in HOSTILE {
            let most = larger(a, b);
            let good = if a.is_nan() || b.is_nan() { most.is_nan() } else { most >= a && most >= b };
            report.check(good, || format!("larger({a}, {b}) = {most}"));
            report.check(a.larger(b).to_bits() == most.to_bits() || most.is_nan(), || format!("{a}.larger({b})"));
            let most = SVector::from([a, 1.0, b]).largest();
            report.check(most.is_nan() == (a.is_nan() || b.is_nan()), || format!("[{a}, 1, {b}].largest() = {most}"));
            let most = largest([a, 1.0, b]);
            let good = if a.is_nan() || b.is_nan() { most.is_nan() } else { most >= a.abs() && most >= b.abs() };
            report.check(good, || format!("largest([{a}, 1, {b}]) = {most}"));
        }
    }
    report.check(largest([]) == 0.0, || "the largest of nothing".into());
}

/// Matrices that are singular, nearly so or not finite.
fn systems_of_equations(report: &mut Report) {
    for value in HOSTILE {
        for matrix in
            [[1.0, value, 0.5, 2.0], [value, 0.0, 0.0, value], [value, value, value, value], [value, 1.0, 1.0, value]]
        {
            for right in [[1.0, 1.0], [value, 1.0]] {
                let solve = |kernel: bool| {
                    let (mut a, mut b) = (SMatrix::<f64, 2, 2>::from_row_slice(&matrix), SVector::from(right));
                    let done =
                        if kernel { linear::solve_in_kernel(&mut a, &mut b) } else { linear::solve(&mut a, &mut b) };
                    done.map(|determinant| (determinant, b)).map_err(|e| e.of("the matrix", "take another"))
                };
                let input = (SVector::from(matrix), SVector::from(right));
                // A pivot may be so small that the solution overflows: those who solve look at it.
                if value == 0.0 || value.abs() > 1e-290 || value.is_nan() {
                    report.formula(&input, solve(false).map(|(_, b)| b));
                }
                let same = match (solve(false), solve(true)) {
                    (Ok((_, a)), Ok((_, b))) => {
                        a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
                    }
                    (a, b) => a.is_err() && b.is_err(),
                };
                report.check(same, || format!("{matrix:?}: not the same in a kernel"));
            }
        }
    }
    let mut none = (DMatrix::<f64>::zeros(0, 0), contact_geom::nalgebra::DVector::<f64>::zeros(0));
    report.check(linear::solve(&mut none.0, &mut none.1).is_ok_and(|d| d == 1.0), || "an empty system".into());
}

fn coordinates(report: &mut Report) {
    let one = triples()[0];
    for x in triples() {
        report.formula(&x, fine(x.dot(&one)));
        report.formula(&x, fine(x.scale(2.0)));
        report.formula(&x, fine(x.plus(one)));
        report.formula(&x, fine(x.minus(one)));
        report.formula(&x.x, fine(seed(&x).x[0].re));
        let most = largest((0..3).map(|i| x.component(i)));
        report.check(most.is_nan() || x.amax() == most, || format!("{x:?}: amax {}", x.amax()));
        let finite = (0..3).all(|i| x.component(i).is_finite());
        report.check(x.is_finite() == finite, || format!("{x:?}: is_finite"));
        let vector = x.to_vector();
        report.check((0..3).all(|i| vector[i].to_bits() == x.component(i).to_bits()), || format!("{x:?} as a vector"));
        report.check(x.component(3) == 0.0 && x.component(usize::MAX) == 0.0, || "beyond the last".into());
    }
}

fn points(report: &mut Report) {
    for x in triples() {
        let (a, b) = ([x.component(0)], [x.component(1)]);
        report.door(&x, VelocityPoint::<1>::from_slices(&a, &b, x.z));
        report.door(&x, PhasePoint::<1>::from_slices(&a, &b, x.z));
        report.door(&x, DiscretePoint::<1>::from_slices(&a, &b, x.z));
        report.door(&x, VelocityPoint::from(x).check());
        report.door(&x, PhasePoint::from(x).check());
        report.door(&x, DiscretePoint::from(x).check());
    }
    for wrong in [&[][..], &[1.0, 2.0], &[f64::NAN; 7]] {
        let refused = PhasePoint::<1>::from_slices(wrong, &[1.0], 0.0).is_err()
            && PhasePoint::<1>::from_slices(&[1.0], wrong, 0.0).is_err();
        report.check(refused, || format!("{} entries for one coordinate", wrong.len()));
    }
}

/// Claims at a place that is none: each is as wrong as can be.
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
        // Where L is not defined nothing is said; elsewhere every claim gets a number.
        let Some(defects) = all.defects(&Everything, t, &x.into()) else { continue };
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
    for (t, x) in places() {
        for statement in statements::STATEMENTS.into_iter().chain([0, 5, 1000, u32::MAX]) {
            let known = statements::STATEMENTS.contains(&statement);
            let residual = statements::residual(statement, &CoupledInZ::default(), t, &x.into());
            // The system does not know the time, nor a symmetry or a Hamiltonian in closed form.
            let good = match &residual {
                Ok(None) => !known || [3, 9, 12].contains(&statement),
                Ok(Some(r)) => known && (!x.to_vector().iter().any(|c| c.is_nan()) || !(*r <= 1e-3) || statement == 7),
                Err(_) => known,
            };
            report.check(good, || format!("statement {statement} at t = {t}, {x:?}: {residual:?}"));
        }
    }
    report.check(statements::known_hamiltonian::<1, _>(&Pendulum::default()).is_some(), || "no Hamiltonian".into());
    let flow = ActionSquared { c: 0.4 };
    for t in HOSTILE {
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
        // Where there is none or not one, there is none.
        for through in [free.velocity_through(x.x[0], x.y[0], 0.4), oscillator.velocity_through(x.x[0], x.y[0], 0.4)] {
            report.door(&(x.x, x.y), through.ok_or("none"));
        }
        report.door(&(x.x, x.y), field.velocity_through(&x.x, &x.y, 0.4).ok_or("none"));
    }
    let start = VelocityPoint::new([0.3], [0.7], 0.2);
    for t in HOSTILE {
        report.formula(
            &t,
            fine(oscillator.solution(t, &start)).map(|x| (x, if t < 0.0 && t.is_infinite() { f64::NAN } else { 0.0 })),
        );
        report.door(&t, free.velocity_through(0.1, 0.2, t).ok_or("none"));
        report.door(&t, oscillator.velocity_through(0.1, 0.2, t).ok_or("none"));
        for n in [0, 1, 2, 5, u8::MAX] {
            report.formula(&t, LaneEmden { n }.solution(t).ok_or("none"));
        }
    }
}

fn clocks(report: &mut Report) {
    let clock = Kepler::<2>::default().clock();
    for value in HOSTILE {
        report.formula(&value, fine(clock.rate(&SVector::from([value, 0.3]))));
    }
}

fn differentials(report: &mut Report) {
    type D = Dual<f64, SVector<f64, 1>>;
    let null: SVector<f64, 1> = Module::<f64>::null();
    report.check(D::constant(1.0).d == null, || "a constant's differential".into());
    for value in HOSTILE {
        report.formula(&value, fine(D::constant(value)));
        let border = Border::<1> { x: SVector::from([value]), z: 1.0 };
        let numbers = |b: Border<1>| (b.x, b.z);
        report.formula(&value, fine(numbers(border.each(|a| a + 1.0))));
        report.formula(&value, fine(numbers(border.join(border, |a, b| a + b))));
        report.formula(&value, fine(numbers(border.scaled(2.0))));
        report.formula(&value, fine(numbers(border.combined(2.0, border, 0.5))));
        // A number that is none is not lost where its factor vanishes.
        report.formula(&value, fine(numbers(border.scaled(0.0)).0));
    }
}

/// The elementary functions on duals: a NaN stays one, and tame arguments in the domain give finite values and slopes.
fn functions(report: &mut Report) {
    type D = Dual<f64, SVector<f64, 1>>;
    type Function = fn(D) -> D;
    // On the whole line.
    let whole: [(&str, Function); 18] = [
        ("abs", |x| x.abs()),
        ("signum", |x| x.signum()),
        ("max", |x| x.max(D::from(0.5))),
        ("min", |x| x.min(D::from(0.5))),
        ("if_less", |x| x.if_less(D::from(0.5), x * x, x)),
        ("powi(0)", |x| x.powi(0)),
        ("powi(3)", |x| x.powi(3)),
        ("exp", |x| x.exp()),
        ("exp_m1", |x| x.exp_m1()),
        ("sin_cos", |x| x.sin_cos().0 + x.sin_cos().1),
        ("sin", |x| x.sin()),
        ("cos", |x| x.cos()),
        ("versine", |x| x.versine()),
        ("sin_versine", |x| x.sin_versine().0 + x.sin_versine().1),
        ("sinh", |x| x.sinh()),
        ("cosh", |x| x.cosh()),
        ("tanh", |x| x.tanh()),
        ("atan", |x| x.atan()),
    ];
    // Elsewhere than where they are defined they are not numbers.
    let partly: [(&str, Function); 7] = [
        ("recip", |x| x.recip()),
        ("sqrt", |x| x.sqrt()),
        ("powf", |x| x.powf(1.5)),
        ("powi(-2)", |x| x.powi(-2)),
        ("ln", |x| x.ln()),
        ("ln_1p", |x| x.ln_1p()),
        ("tan", |x| x.tan()),
    ];
    for value in HOSTILE {
        let x = D { re: value, d: SVector::from([1.0]) };
        report.check(x.re().to_bits() == value.to_bits(), || format!("re of {value}"));
        report.check(value.is_nan() || x.pivot_size() == value.abs(), || format!("size of {value} as a pivot"));
        report.check(
            x.extent() >= value.abs() && x.extent() >= 1.0 || value.is_nan() && x.extent() == f64::INFINITY,
            || format!("extent of {value} is {}", x.extent()),
        );
        let slope = D { re: 1.0, d: SVector::from([value]) };
        report.check(value.is_finite() || slope.extent() == f64::INFINITY, || format!("extent of a slope {value}"));
        for (name, f) in whole {
            let y = f(x);
            let kept = !value.is_nan() || y.re.is_nan() && y.d[0].is_nan() || name == "powi(0)";
            // At large arguments they may overflow.
            let finite = value.abs() > 100.0 || value.is_nan() || y.re.is_finite() && y.d[0].is_finite();
            report.check(kept && finite, || format!("{name} of {value} is {y:?}"));
        }
        for (name, f) in partly {
            let y = f(x);
            report.check(!value.is_nan() || y.re.is_nan() && y.d[0].is_nan(), || format!("{name} of {value} is {y:?}"));
        }
    }
}
