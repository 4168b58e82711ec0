//! Defects of modified Hamiltonians as text and as JSON, for `herglotz check --modified`.

use crate::output::{json, short, table};
use herglotz::runtime::ModifiedDefect;

/// The largest order that the program prints.
pub(crate) const MOST: usize = 6;

pub(crate) fn of_json(found: &[ModifiedDefect]) -> serde_json::Value {
    let row = |of: &ModifiedDefect| serde_json::json!({ "k": of.k, "h": json(of.h), "defect": json(of.defect) });
    found.iter().map(row).collect()
}

/// One row for each order, one column for each step size, and the slope between the two smallest ones.
pub(crate) fn in_words(found: &[ModifiedDefect]) -> String {
    let of_order = |k: usize| found.iter().filter(move |of| of.k == k);
    let mut header = vec!["k".to_owned()];
    header.extend(of_order(1).map(|of| format!("h = {}", short(of.h))));
    header.push("slope".to_owned());
    let mut rows = vec![header];
    for k in 1..=MOST {
        let of_k: Vec<_> = of_order(k).collect();
        let mut row = vec![k.to_string()];
        row.extend(of_k.iter().map(|of| format!("{:.1e}", of.defect)));
        let slope = match of_k[..] {
            [.., long, short] => (long.defect / short.defect).ln() / (long.h / short.h).ln(),
            _ => f64::NAN,
        };
        row.push(format!("{slope:.2}"));
        rows.push(row);
    }
    format!(
        "the steps are those of a modified Hamiltonian H~_k = H + O(h^order) to O(h^(k+1)): the largest |H~_k(x1) - \
         sigma_d H~_k(x0)| relative to |H~_k|, which falls with the slope k + 1 until round-off\n{}",
        table(&rows)
    )
}
