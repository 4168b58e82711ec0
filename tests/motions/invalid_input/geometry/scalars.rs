//! Invalid input to scalars, coordinates and matrices.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report, fine, triples};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{
    DiscretePoint, Dual, PhasePoint, Scalar, VelocityPoint,
    numbers::{AugmentedVector, MaxAbsOrNan, MaxOrNan, TangentVector, dot, max_abs_or_nan, max_or_nan},
    support::{linear, seed},
    vector,
};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "max_or_nan",
            "max_abs_or_nan",
            "MaxOrNan::max_or_nan",
            "MaxAbsOrNan::max_abs_or_nan",
            "vector_of",
            "dot",
        ],
        run: maxima,
    },
    InputTest {
        entries: &["SingularMatrix::of", "linear::solve", "linear::solve_in_kernel"],
        run: systems_of_equations,
    },
    InputTest {
        entries: &[
            "ChartVector::dot",
            "ChartVector::scale",
            "ChartVector::plus",
            "ChartVector::minus",
            "ChartVector::component",
            "ChartVector::to_vector",
            "ChartVector::amax",
            "ChartVector::is_finite",
            "seed",
        ],
        run: coordinates,
    },
    InputTest { entries: &["$name::from_slices", "$name::check"], run: points },
    InputTest {
        entries: &[
            "$Dual::constant",
            "TangentVector::null",
            "TangentVector::each",
            "TangentVector::join",
            "TangentVector::scaled",
            "TangentVector::combined",
        ],
        run: differentials,
    },
    InputTest {
        entries: &[
            "Scalar::re",
            "Scalar::apart",
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
            "Scalar::along_slope",
            "Scalar::slope_power",
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

fn maxima(report: &mut Report) {
    for a in EXTREME {
        for b in EXTREME {
            let most = max_or_nan(a, b);
            let good = if a.is_nan() || b.is_nan() { most.is_nan() } else { most >= a && most >= b };
            report.check(good, || format!("max_or_nan({a}, {b}) = {most}"));
            report
                .check(a.max_or_nan(b).to_bits() == most.to_bits() || most.is_nan(), || format!("{a}.max_or_nan({b})"));
            let most = SVector::from([a, 1.0, b]).max_abs_or_nan();
            report.check(most.is_nan() == (a.is_nan() || b.is_nan()), || format!("[{a}, 1, {b}].largest() = {most}"));
            let most = max_abs_or_nan([a, 1.0, b]);
            let good = if a.is_nan() || b.is_nan() { most.is_nan() } else { most >= a.abs() && most >= b.abs() };
            report.check(good, || format!("largest([{a}, 1, {b}]) = {most}"));
        }
    }
    report.check(max_abs_or_nan([]) == 0.0, || "the largest of nothing".into());
    for a in EXTREME {
        let x: SVector<f64, 3> = vector!(|i| if i == 1 { a } else { 0.0 });
        report.check(x[1].to_bits() == a.to_bits() && x[0] == 0.0 && x[2] == 0.0, || format!("vector_of: {x}"));
        let (product, expected) = (dot(x, x), x[0] * x[0] + a * a + x[2] * x[2]);
        report.check(product == expected || product.is_nan() && expected.is_nan(), || format!("dot: {product}"));
    }
}

/// Matrices that are singular, nearly singular or not finite.
fn systems_of_equations(report: &mut Report) {
    for value in EXTREME {
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
                // A pivot may be so small that the solution overflows, which the callers check.
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
        let most = max_abs_or_nan((0..3).map(|i| x.component(i)));
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
        report.entry_point(&x, VelocityPoint::<1>::from_slices(&a, &b, x.z));
        report.entry_point(&x, PhasePoint::<1>::from_slices(&a, &b, x.z));
        report.entry_point(&x, DiscretePoint::<1>::from_slices(&a, &b, x.z));
        report.entry_point(&x, VelocityPoint::from(x).check());
        report.entry_point(&x, PhasePoint::from(x).check());
        report.entry_point(&x, DiscretePoint::from(x).check());
    }
    let read = VelocityPoint::<2>::from_slices(&[1.0, 2.0], &[3.0, 4.0], 5.0);
    report.check(read == Ok(VelocityPoint::new([1.0, 2.0], [3.0, 4.0], 5.0)), || format!("{read:?}"));
    for wrong in [&[][..], &[1.0, 2.0], &[f64::NAN; 7]] {
        let refused = PhasePoint::<1>::from_slices(wrong, &[1.0], 0.0).is_err()
            && PhasePoint::<1>::from_slices(&[1.0], wrong, 0.0).is_err();
        report.check(refused, || format!("{} entries for one coordinate", wrong.len()));
    }
}

fn differentials(report: &mut Report) {
    type D = Dual<f64, SVector<f64, 1>>;
    let null: SVector<f64, 1> = TangentVector::<f64>::null();
    report.check(D::constant(1.0).d == null, || "a constant's differential".into());
    for value in EXTREME {
        report.formula(&value, fine(D::constant(value)));
        let border = AugmentedVector::<1> { x: SVector::from([value]), z: 1.0 };
        let numbers = |b: AugmentedVector<1>| (b.x, b.z);
        report.formula(&value, fine(numbers(border.each(|a| a + 1.0))));
        report.formula(&value, fine(numbers(border.join(border, |a, b| a + b))));
        report.formula(&value, fine(numbers(border.scaled(2.0))));
        report.formula(&value, fine(numbers(border.combined(2.0, border, 0.5))));
        // A NaN is not lost where its factor vanishes.
        report.formula(&value, fine(numbers(border.scaled(0.0)).0));
    }
}

/// The elementary functions on duals: a NaN is returned, and ordinary arguments in the domain give finite values and
/// slopes.
fn functions(report: &mut Report) {
    type D = Dual<f64, SVector<f64, 1>>;
    type Function = fn(D) -> D;
    // Functions that are defined on the whole line.
    let whole: [(&str, Function); 19] = [
        ("apart", |x| D::apart(|| x.exp())),
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
    // Functions that are defined on a part of the line.
    let partly: [(&str, Function); 9] = [
        ("along_slope", |x| x.along_slope(x.recip())),
        ("slope_power", |x| x.slope_power(-1.0) + x.slope_power(0.5)),
        ("recip", |x| x.recip()),
        ("sqrt", |x| x.sqrt()),
        ("powf", |x| x.powf(1.5)),
        ("powi(-2)", |x| x.powi(-2)),
        ("ln", |x| x.ln()),
        ("ln_1p", |x| x.ln_1p()),
        ("tan", |x| x.tan()),
    ];
    for value in EXTREME {
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
