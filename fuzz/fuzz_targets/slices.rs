//! Functions that take raw numbers: points, paths, axes, splines, small linear systems. Accepted input is finite.

#![no_main]

use contact_examples::systems::Pendulum;
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{DiscretePoint, PhasePoint, Regularity, Symmetry, VelocityPoint, numbers::{max_or_nan, max_abs_or_nan}};
use discrete_herglotz::{rules::Midpoint, solve::Solver, theory::DiscretePath};
use exact_lagrangian::principle::{Curve, SplineCurve};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let numbers: Vec<f64> = data
        .chunks_exact(8)
        .map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap_or_default()))
        .collect();
    let (a, b) = numbers.split_at(numbers.len() / 2);
    let z = numbers.first().copied().unwrap_or_default();
    let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());

    let fits = a.len() == 2 && b.len() == 2 && finite(&numbers);
    assert_eq!(VelocityPoint::<2>::from_slices(a, b, z).is_ok(), fits);
    assert_eq!(PhasePoint::<2>::from_slices(a, b, z).is_ok(), fits);
    assert_eq!(DiscretePoint::<2>::from_slices(a, b, z).is_ok(), fits);

    let any_nan = numbers.iter().any(|x| x.is_nan());
    assert_eq!(max_abs_or_nan(numbers.iter().copied()).is_nan(), any_nan);
    assert_eq!(numbers.iter().copied().fold(0.0, max_or_nan).is_nan(), any_nan);

    if let [x, y, z, ..] = numbers[..] {
        if let Ok(Symmetry::Axis(unit)) = Symmetry::<3>::axis([x, y, z]) {
            assert!((unit.norm() - 1.0).abs() < 1e-6);
        }
    }

    let points: Vec<SVector<f64, 1>> = numbers.iter().map(|q| SVector::from([*q])).collect();
    match DiscretePath::new(points) {
        Ok(path) => {
            assert!(numbers.len() >= 2 && finite(&numbers));
            if let Ok(ld) = Midpoint::new(Pendulum::default(), 0.1) {
                let actions = path.actions(&ld, 0.0, 0.0);
                assert!(actions.is_err() || actions.is_ok_and(|z| z.len() == path.steps() + 1));
                let _ = path.herglotz_residuals(&ld, 0.0, 0.0);
                let _ = path.action_differential(&ld, 0.0, 0.0);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }

    let positions: Vec<SVector<f64, 1>> = b.iter().map(|q| SVector::from([*q])).collect();
    if let Ok(curve) = SplineCurve::new(a, &positions, None) {
        assert!(finite(&numbers) && a.windows(2).all(|t| t[0] < t[1]));
        let _ = curve.at(z);
    }

    if let Ok(entries) = <[f64; 9]>::try_from(numbers.get(..9).unwrap_or_default()) {
        let matrix = SMatrix::<f64, 3, 3>::from_row_slice(&entries);
        for mut solver in [Solver::on_the_stack(), Solver::by_faer()] {
            let mut right = SVector::from([1.0, -2.0, 0.5]);
            if solver.solve(&mut matrix.clone_owned(), &mut right).is_ok() {
                assert!(right.iter().all(|x| x.is_finite()) && finite(&entries));
            }
        }
        let condition = Regularity::of(DMatrix::from_row_slice(3, 3, &entries)).condition();
        assert!(condition >= 1.0 - 1e-12 || condition.is_nan());
    }
});
