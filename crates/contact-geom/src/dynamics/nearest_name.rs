//! Names that were probably meant.

/// The name that is nearest to a given one, if it is close enough to be intended: at most three characters differ, and
/// at most a third of them. A single letter is near to itself in the other case only.
///
/// ```
/// assert_eq!(contact_geom::support::nearest_name("keplr", ["pendulum", "kepler"]), Some("kepler"));
/// assert_eq!(contact_geom::support::nearest_name("lattice", ["pendulum", "kepler"]), None);
/// assert_eq!(contact_geom::support::nearest_name("k", ["x", "K"]), Some("K"));
/// assert_eq!(contact_geom::support::nearest_name("k", ["x"]), None);
/// ```
pub fn nearest_name<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let near = known.into_iter().map(|other| (distance(name, other), other)).min_by_key(|(distance, _)| *distance);
    let limit = match name.chars().count() {
        0 | 1 => 0,
        count => count.div_ceil(3).min(3),
    };
    near.filter(|(distance, _)| *distance <= limit).map(|(_, other)| other)
}

/// The number of characters to change, insert or delete, or of neighbouring characters to exchange (Damerau-Levenshtein
/// distance), for the first characters of long names. Case is ignored.
fn distance(a: &str, b: &str) -> usize {
    // The time grows with the product of the lengths.
    const MAX_COMPARED_CHARACTERS: usize = 40;
    let letters = |s: &str| s.chars().take(MAX_COMPARED_CHARACTERS).flat_map(char::to_lowercase).collect::<Vec<_>>();
    let (x, y) = (letters(a), letters(b));
    let mut rows: Vec<Vec<usize>> = vec![(0..=y.len()).collect()];
    for i in 1..=x.len() {
        let mut row = vec![i];
        for j in 1..=y.len() {
            let above = &rows[i - 1];
            let mut least = (above[j] + 1).min(row[j - 1] + 1).min(above[j - 1] + usize::from(x[i - 1] != y[j - 1]));
            if i > 1 && j > 1 && x[i - 1] == y[j - 2] && x[i - 2] == y[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    // Names that differ only in case have distance 0.
    rows.last().and_then(|row| row.last().copied()).unwrap_or(usize::MAX)
}
