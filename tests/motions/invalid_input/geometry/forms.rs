//! Invalid input to contact forms, to the fields and brackets that belong to them, and to groups.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EVERYTHING, EXTREME, Report, fine, places, triples};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::statements::AnyFunction;
use contact_geom::{
    ChartVector, Conformality, ContactForm, Darboux, DiscreteJet, DiscretePoint, Energy, EtaMinus, EtaPlus, Form,
    HerglotzField, LagrangianForm, OneParameterGroup, SecondDiscreteJet, Smooth, SmoothFunction, Symmetry,
    VelocityPoint, conformality,
    hamiltonian::{
        InfinitesimalConformality, conformal_factor_along, derivative_along, dissipation_defect,
        hamiltonian_vector_field, infinitesimal_conformality, jacobi_bracket, lie_bracket, lie_derivative,
    },
    support::{conformality_with_jacobian, generic},
};

pub const TESTS: &[InputTest] = &[
    InputTest { entries: &["Symmetry::rotation", "Symmetry::rotations", "Symmetry::axis"], run: symmetries },
    InputTest {
        entries: &[
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
    InputTest {
        entries: &[
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
    InputTest {
        entries: &[
            "DiscreteJet::new",
            "DiscreteJet::with_sigma",
            "DiscreteJet::sigma",
            "SecondDiscreteJet::legendre_minus_jacobian",
            "SecondDiscreteJet::legendre_plus_jacobian",
            "SecondDiscreteJet::regularity",
        ],
        run: jets,
    },
    InputTest {
        entries: &[
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
    InputTest { entries: &["conformality", "conformality_with_jacobian"], run: pullbacks },
    InputTest {
        entries: &["Smooth::at", "Smooth::with_jacobian", "SmoothFunction::value", "SmoothFunction::differential"],
        run: smooth,
    },
];

/// Indices that define no plane, and axes without a direction.
fn symmetries(report: &mut Report) {
    for (i, j) in [(0, 0), (0, 2), (2, 0), (usize::MAX, 0), (usize::MAX, usize::MAX)] {
        report.check(Symmetry::<2>::rotation(i, j).is_err(), || format!("rotation({i}, {j})"));
        report.check(Symmetry::<2>::rotations(&[(i, j)]).is_err(), || format!("rotations({i}, {j})"));
    }
    for planes in [[(0, 1), (0, 2)], [(0, 1), (2, 1)], [(0, 1), (1, 0)], [(0, 1), (0, 1)]] {
        report.check(Symmetry::<4>::rotations(&planes).is_err(), || format!("rotations({planes:?})"));
    }
    // A plane beyond the coordinates, which the constructor would refuse, is not rotated.
    let turned = Symmetry::<2>::Rotations([Some(usize::MAX), None]).act(0.3, &SVector::from([1.0, 2.0]));
    report.check(turned == SVector::from([1.0, 2.0]), || format!("{turned}"));
    for value in EXTREME {
        for axis in [[value, 0.0, 0.0], [1.0, value, 0.0], [value; 3]] {
            let unit = |s: Symmetry<3>| match s {
                Symmetry::Axis(a) => (a.norm() - 1.0).abs() <= 8.0 * f64::EPSILON,
                _ => false,
            };
            let made = Symmetry::<3>::axis(axis);
            let refused = !axis.iter().all(|a| a.is_finite()) || axis == [0.0; 3];
            // The length of a huge axis overflows, and that of a subnormal one has few digits: either is refused.
            report.check(if refused { made.is_err() } else { made.is_err() || made.is_ok_and(unit) }, || {
                format!("axis({axis:?}) is {made:?}")
            });
        }
    }
}

fn groups(report: &mut Report) {
    let group = Symmetry::Scaling(SVector::from([0.7]));
    for s in EXTREME {
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
        report.formula(&x, fine(group.symmetry_defect(&EVERYTHING, 0.4, &at)));
    }
}

/// Closed forms and generic ones, on T*Q x R, on TQ x R and on Q x Q x R.
fn forms(report: &mut Report) {
    fn one(report: &mut Report, form: &impl ContactForm<1>, x: &ChartVector<1>, of: &ChartVector<1>) {
        report.formula(&of.y, form.eta(x));
        report.formula(&(*of, *of), form.flat(x, of));
        report.formula(&(*of, *of), form.sharp(x, of));
        report.formula(&(*of, *of), generic::flat(form, x, of));
        report.formula(&(*of, *of), generic::sharp(form, x, of));
        report.formula(&of.y, generic::reeb(form, x));
        report.formula(&of.y, generic::volume(form, x));
    }
    let upward = ChartVector { x: [0.0].into(), y: [0.0].into(), z: 1.0 };
    for x in triples() {
        one(report, &Darboux, &x, &x);
        one(report, &Form(Darboux), &x, &x);
        // The Reeb field and the volume of Darboux coordinates are constant.
        report.check(Darboux.reeb(&x) == Ok(upward) && Darboux.volume(&x).is_ok_and(|v| v.abs() == 1.0), || {
            format!("{x:?}")
        });
    }
    for (t, x) in places() {
        let form = LagrangianForm { lagrangian: &EVERYTHING, t };
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
    for sigma in EXTREME {
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
        let field = HerglotzField { lagrangian: &EVERYTHING, t };
        let form = LagrangianForm { lagrangian: &EVERYTHING, t };
        report.formula(&(t, x), lie_bracket(&field, &field, &x).and_then(|b| field.at(&x).map(|f| (b, f))));
        report.formula(&(t, x), lie_derivative(&form, &field, &x));
        let found = infinitesimal_conformality(&form, &field, &x);
        report.formula(&(t, x), found.map(|InfinitesimalConformality { rate, defect }| (rate, defect)));
    }
    let path = |_: f64| ChartVector { x: [0.3].into(), y: [0.7].into(), z: 0.2 };
    for value in EXTREME {
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
        let map = contact_geom::Legendre { lagrangian: &EVERYTHING, t };
        let source = LagrangianForm { lagrangian: &EVERYTHING, t };
        report.formula(&(t, x), conformality(&source, &Darboux, &map, &x).map(numbers));
    }
    for (rows, columns) in [(0, 0), (3, 2), (2, 3), (4, 4)] {
        let jacobian = DMatrix::zeros(rows, columns);
        let x = triples()[0];
        let refused = conformality_with_jacobian(&Darboux, &Darboux, &x, &x, &jacobian).is_err();
        report.check(refused, || format!("a Jacobian of {rows} x {columns}"));
    }
    for value in EXTREME {
        let x = triples()[0];
        let jacobian =
            DMatrix::from_fn(3, 3, |i, j| if i == 1 && j == 1 { value } else { f64::from(u8::from(i == j)) });
        let jacobian = jacobian.map(|e| e * value);
        report.formula(&value, conformality_with_jacobian(&Darboux, &Darboux, &x, &x, &jacobian).map(numbers));
    }
}

fn smooth(report: &mut Report) {
    for (t, x) in places() {
        let field = HerglotzField { lagrangian: &EVERYTHING, t };
        report.formula(&(t, x), field.at(&x));
        report.formula(&(t, x), field.with_jacobian(&x));
        report.formula(&(t, x), fine(Energy(&EVERYTHING).value(t, &x)));
        report.formula(&(t, x), fine(Energy(&EVERYTHING).differential(t, &x)));
    }
}
