//! Lyapunov exponents as text and as JSON, for `herglotz check --lyapunov`.

use crate::output::{json, short, table};
use herglotz::runtime::LyapunovExponents;

pub(crate) fn of_json(found: &LyapunovExponents) -> serde_json::Value {
    let all = |exponents: &[f64]| exponents.iter().copied().map(json).collect::<Vec<_>>();
    serde_json::json!({
        "status": found.status.to_string(),
        "t": json(found.t),
        "steps": found.steps,
        "exponents": all(&found.exponents),
        "of_second_half": all(&found.of_second_half),
        "pairs": found.pairs.iter().map(|pair| all(pair)).collect::<Vec<_>>(),
        "rate": json(found.rate),
        "pairing_defect": found.pairing_defect.map(json),
        "volume_defect": found.volume_defect.map(json),
    })
}

pub(crate) fn in_words(found: &LyapunovExponents) -> String {
    let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    let mut exponents = vec![words(&["exponent", "of the second half"])];
    let halves = found.exponents.iter().zip(&found.of_second_half);
    exponents.extend(halves.map(|(exponent, second)| vec![short(*exponent), short(*second)]));
    let mut parts = vec![
        format!("Lyapunov exponents of {} steps to t = {} ({}):", found.steps, short(found.t), found.status),
        table(&exponents),
    ];
    let rate = short(found.rate);
    if let Some(defect) = found.pairing_defect {
        let mut pairs = vec![words(&["pair", "", "sum", "ln(sigma_d)/h"])];
        let row = |[a, b]: &[f64; 2]| vec![short(*a), short(*b), short(a + b), rate.clone()];
        pairs.extend(found.pairs.iter().map(row));
        parts.push(format!("{}\nthe sums of the pairs are ln(sigma_d)/h to {defect:.1e}", table(&pairs)));
    } else {
        parts.push(format!("ln(sigma_d)/h is {rate}; pairs have this sum only for constant L_z, without a force and with contact resets"));
    }
    if let Some(defect) = found.volume_defect {
        parts.push(format!("the sum of all is n + 1 times ln(sigma_d)/h to {defect:.1e}"));
    }
    parts.extend(found.contradiction().map(|contradiction| format!("warning: {contradiction}")));
    parts.join("\n")
}
