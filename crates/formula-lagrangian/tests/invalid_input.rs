//! Random texts, and random changes of valid texts: each gives a value or an error, and never panics.

use crate::random::Random;
use contact_geom::{Lagrangian, VelocityPoint};
use formula_lagrangian::{Direction, Formula, Reset};

const WORDS: [&str; 51] = [
    "x",
    "y",
    "x'",
    "y'",
    "z",
    "t",
    "a",
    "gamma",
    "pi",
    "n",
    "q[",
    "v[",
    "]",
    "(",
    ")",
    "+",
    "-",
    "*",
    "/",
    "^",
    "**",
    ",",
    "=",
    "<",
    ">",
    "'",
    ";",
    "\n",
    "#",
    "0",
    "1",
    "2",
    "0.5",
    "1e308",
    "1e-308",
    "3.5",
    "sum(i,0,3,",
    "sum(",
    "i",
    "sin(",
    "sqrt(",
    "ln(",
    "atan2(",
    "if(",
    "force[",
    "force[x]=",
    "rayleigh=",
    "min(",
    "\u{3b8}",
    "\u{1f600}",
    ".",
];

const GOOD: [&str; 7] = [
    "force[x] = -a*x'*abs(x'); force[y] = n*sin(t)\nrayleigh = y'^4 ; L = x'^2 + y'^2",
    "(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2) + gamma*z",
    "r = hypot(x, y)\nr'2 = 3; x'^2",
    "sum(i, 0, n-1, v[i]^2)/2 - sum(i, 1, n-1, (q[i] - q[i-1])^4)",
    "x'^2*(2 + sin(y)) - if(x < y, x^2, a^y) + max(x, y, 3)",
    "exp(-x^2)*tanh(y') + atan2(x, y)^3 - asin(0.1*x)",
    "# comment\nu = x^-1.5 ; w = u**2 \n L = w*x'^2 - log1p(abs(y)) + y'^2*cosh(t)",
];

/// Parses a text and applies all operations to the result. Returns whether the text is valid.
fn attack(text: &str) -> bool {
    match Formula::parse(text, &["x", "y"], &[("a", 1.5), ("gamma", -0.1)]) {
        Ok(formula) => {
            let lagrangian = formula.lagrangian::<2>().unwrap();
            let x = VelocityPoint::new([0.5, -0.25], [1.0, 2.0], 0.1);
            let _ = (lagrangian.applied_force(0.3, &x), lagrangian.force_structure(), lagrangian.breaks());
            match formula.expression(text) {
                Ok(expression) => drop(expression.at(0.3, x.q.as_slice(), x.v.as_slice(), x.z)),
                Err(_) => assert!(formula.has_forces(), "{text}"),
            }
            // The same text as that of a force and of a reset.
            let then = [("x'", text)];
            let _ = formula.with_force(text, text);
            let _ =
                formula.with_reset(Reset { when: text, direction: Direction::Both, then: &then, rest: Some(&then) });
            true
        }
        Err(error) => {
            assert!(error.to_string().len() < 1000, "{error}");
            false
        }
    }
}

#[test]
fn random_words() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut good = 0;
    for _ in 0..50_000 {
        let length = 1 + random.below(12);
        let text: String = (0..length).map(|_| WORDS[random.below(WORDS.len())]).collect();
        good += usize::from(attack(&text));
    }
    // Not all texts are rejected at the first word.
    assert!(good > 500, "{good}");
}

#[test]
fn changes_of_good_texts() {
    let mut random = Random(0xd1b5_4a32_d192_ed03);
    let mut good = 0;
    for k in 0..50_000 {
        let mut text: Vec<char> = GOOD[k % GOOD.len()].chars().collect();
        for _ in 0..1 + random.below(3) {
            let (at, from) = (random.below(text.len()), random.below(text.len()));
            match random.below(5) {
                0 => drop(text.remove(at)),
                1 => text.insert(at, text[from]),
                2 => text.swap(at, from),
                3 => text[at] = char::from_u32(random.below(0x300) as u32).unwrap_or('\u{fffd}'),
                _ => {
                    let word = WORDS[random.below(WORDS.len())];
                    text.splice(at..at, word.chars());
                }
            }
        }
        good += usize::from(attack(&text.into_iter().collect::<String>()));
    }
    assert!(good > 2_000, "{good}");
}

/// Random bytes, most of which are not valid text.
#[test]
fn random_bytes() {
    let mut random = Random(0x1234_5678_9abc_def1);
    let mut good = 0;
    for _ in 0..50_000 {
        let length = random.below(24);
        // Half of the bytes are printable, so that some texts are parsed beyond the first byte.
        let byte = |random: &mut Random| if random.below(2) == 0 { random.below(256) } else { 32 + random.below(95) };
        let bytes: Vec<u8> = (0..length).map(|_| byte(&mut random) as u8).collect();
        good += usize::from(attack(&String::from_utf8_lossy(&bytes)));
    }
    // At least single digits and names are valid.
    assert!(good > 10, "{good}");
}
