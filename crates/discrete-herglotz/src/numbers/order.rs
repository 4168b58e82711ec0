//! The order of items by a number.

/// The items in ascending or descending order of a number; those with equal numbers keep their order. The sort itself is
/// compiled once, for numbers, and not again for each type of items.
///
/// ```
/// use discrete_herglotz::support::sorted;
/// let crossings = [(2.0, "b"), (1.0, "a"), (2.0, "c")];
/// let names: Vec<_> = sorted(&crossings, |(t, _)| *t, false).iter().map(|(_, name)| *name).collect();
/// assert_eq!(names, ["a", "b", "c"]);
/// assert_eq!(sorted(&crossings, |(t, _)| *t, true)[2].1, "a");
/// ```
pub fn sorted<T: Clone>(items: &[T], key: impl Fn(&T) -> f64, descending: bool) -> Vec<T> {
    let keys: Vec<f64> = items.iter().map(key).collect();
    order_of(&keys, descending).into_iter().map(|i| items[i].clone()).collect()
}

/// The indices of numbers in ascending or descending order; equal ones keep their order.
fn order_of(keys: &[f64], descending: bool) -> Vec<usize> {
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by(|a, b| {
        let ascending = keys[*a].total_cmp(&keys[*b]);
        if descending { ascending.reverse() } else { ascending }
    });
    order
}
