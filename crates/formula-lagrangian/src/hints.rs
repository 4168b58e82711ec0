//! Corrections for the notation of other languages.

use crate::names::Block;

/// The correction for a conditional in another notation.
pub(crate) const CHOICE: &str = "write `if(a < b, then, otherwise)`";

/// The correction for a function of other languages.
pub(crate) fn instead_of_function(name: &str) -> Option<&'static str> {
    Some(match name.to_lowercase().as_str() {
        "where" | "piecewise" | "ifelse" | "select" | "cond" => CHOICE,
        "heaviside" | "step" | "theta_step" | "unitstep" => "write `if(t > 1, 1, 0)` for a step at 1",
        "floor" | "ceil" | "round" | "mod" | "fmod" | "frac" => {
            "it is discontinuous; write each piece with `if(a < b, then, otherwise)`"
        }
        "interp" | "interp1d" | "spline" | "cubicspline" | "table" => {
            "give the samples as a table and write its name, or write its pieces with `if(a < b, then, otherwise)`"
        }
        "polyval" | "poly" | "polynomial" => "write the polynomial out, as in `c0 + x*(c1 + x*c2)`",
        "log10" => "write `ln(x)/ln(10)`",
        "log2" => "write `ln(x)/ln(2)`",
        "cot" => "write `1/tan(x)`",
        "sec" => "write `1/cos(x)`",
        "csc" => "write `1/sin(x)`",
        "square" | "sqr" => "write `x^2`",
        "cbrt" => "write `sign(x)*abs(x)^(1/3)`",
        "norm" => "write `sqrt(sum(i, 0, n-1, q[i]^2))`, or `hypot(x, y)`",
        "dot" | "inner" => {
            "write `sum(i, 0, n-1, q[i]*v[i])` for a product of vectors, and `x'` for the velocity of `x`"
        }
        "diff" | "derivative" | "deriv" | "ddt" => "write `x'` for the velocity of `x`",
        _ => return None,
    })
}

/// The correction for a name of other languages.
pub(crate) fn instead_of_name(name: &str) -> Option<&'static str> {
    Some(match name {
        "e" | "E" | "euler" => "write `exp(x)` for a power of Euler's number, or `exp(1)`",
        "inf" | "infinity" | "nan" => "the numbers of a formula must be finite",
        "and" | "or" | "not" | "else" => CHOICE,
        "lambda" | "def" | "return" => "pass the Python function itself to `solve`, not its text",
        _ => return None,
    })
}

/// The velocity, in the notation of this language, for a name that other languages give to it: `xdot`, `x_dot`, `dx`,
/// `vx`, `v_x` and similar ones.
pub(crate) fn velocity_of(name: &str, blocks: &[Block]) -> Option<String> {
    const BEFORE: [&str; 6] = ["dot_", "v_", "d_", "v", "d", "D"];
    const AFTER: [&str; 8] = ["_dot", "dot", "_prime", "prime", "_t", "_p", "p", "d"];
    let of = |base: &str| blocks.iter().find(|block| block.name == base);
    let before = BEFORE.iter().filter_map(|part| name.strip_prefix(part)).find_map(of);
    let block = before.or_else(|| AFTER.iter().filter_map(|part| name.strip_suffix(part)).find_map(of))?;
    Some(if block.count.is_some() { format!("{}'[0]", block.name) } else { format!("{}'", block.name) })
}

/// The correction for a character that has no meaning.
pub(crate) fn instead_of_character(c: char) -> Option<&'static str> {
    Some(match c {
        '@' => "a product of vectors is written `sum(i, 0, n-1, q[i]*v[i])`",
        '&' | '|' | '!' | '?' | ':' | '~' | '\u{2264}' | '\u{2265}' => CHOICE,
        '%' => "a remainder is discontinuous; write each piece with `if(a < b, then, otherwise)`",
        '{' | '}' => "use round brackets: `(` and `)`",
        '\\' | '$' => "write `sin(x)`, `x/y`, `x'` in place of TeX",
        '\u{b2}' => "write `^2`",
        '\u{b3}' => "write `^3`",
        '\u{221a}' => "write `sqrt(x)`",
        '"' => "a formula cannot contain strings",
        _ => return None,
    })
}
