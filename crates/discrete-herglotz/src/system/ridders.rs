//! Derivatives of functions that are not written over scalars.

/// The number of differences, each over half the distance of the one before.
const LEVELS: i32 = 7;

/// The first distance, in units of the scale of the argument.
pub(crate) const FIRST_DISTANCE: f64 = 0.0625;

/// The derivative at 0 of a function with several components, by central differences that are extrapolated to distance 0
/// (Ridders 1982). Each component is the entry of the table of extrapolation that differs least from its neighbours: for a
/// smooth function about ten digits, the round-off of the function divided by the last distances. Distances at which
/// the function is `None` are left out; `None` if fewer than two are left.
pub(crate) fn derivative(scale: f64, mut f: impl FnMut(f64) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
    let mut best: Option<Vec<(f64, f64)>> = None;
    let mut before: Vec<Vec<f64>> = Vec::new();
    for level in 0..LEVELS {
        let distance = FIRST_DISTANCE * scale * 2.0_f64.powi(-level);
        let (Some(after), Some(earlier)) = (f(distance), f(-distance)) else {
            before.clear();
            continue;
        };
        let central = after.iter().zip(&earlier).map(|(a, b)| (a - b) / (2.0 * distance)).collect();
        let mut row: Vec<Vec<f64>> = vec![central];
        for (order, coarse) in before.iter().enumerate() {
            let factor = 4.0_f64.powi(order as i32 + 1) - 1.0;
            let fine = &row[order];
            let better: Vec<f64> =
                fine.iter().zip(coarse).map(|(fine, coarse)| fine + (fine - coarse) / factor).collect();
            let best = best.get_or_insert_with(|| vec![(f64::INFINITY, f64::NAN); better.len()]);
            for (i, (error, value)) in best.iter_mut().enumerate() {
                let apart = (better[i] - fine[i]).abs() + (better[i] - coarse[i]).abs();
                if apart < *error {
                    (*error, *value) = (apart, better[i]);
                }
            }
            row.push(better);
        }
        before = row;
    }
    let best: Vec<f64> = best?.into_iter().map(|(_, value)| value).collect();
    best.iter().all(|x| x.is_finite()).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::derivative;

    #[test]
    fn smooth_functions_to_ten_digits() {
        let found = derivative(1.0, |x| Some(vec![x.exp(), (3.0 * x + 1.0).sin(), 2.0 * x])).unwrap();
        for (found, expected) in found.into_iter().zip([1.0, 3.0 * 1.0_f64.cos(), 2.0]) {
            assert!((found - expected).abs() <= 1e-10, "{found} and {expected}");
        }
    }

    /// The function is not defined at the first distances.
    #[test]
    fn distances_outside_of_the_domain_are_left_out() {
        let found = derivative(1.0, |x| (x > -0.02).then(|| vec![(0.02 + x).sqrt()])).unwrap();
        assert!((found[0] - 0.5 / 0.02_f64.sqrt()).abs() <= 1e-7);
        assert_eq!(derivative(1.0, |_| None), None);
    }
}
