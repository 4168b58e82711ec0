//! Arrays from a function of the index, for code that is compiled for each Lagrangian and number of coordinates.

/// The array of the values of a function of the index; for at least one of them. It is a loop, a fifth of the code of
/// `std::array::from_fn`, which is compiled again for each closure.
#[inline(always)]
pub(crate) fn from_fn<T: Copy, const N: usize>(mut of: impl FnMut(usize) -> T) -> [T; N] {
    let mut values = [of(0); N];
    for (i, value) in values.iter_mut().enumerate().skip(1) {
        *value = of(i);
    }
    values
}
