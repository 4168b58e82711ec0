//! Modified Hamiltonians of splittings as series of Jacobi brackets.

use super::ModifiedDefect;
use crate::{InputError, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, ContactHamiltonian, Dual, HamiltonianDerivatives, PhasePoint, Scalar};

/// The largest degree of a [`BracketSeries`]: brackets of seven functions.
pub const MAX_BRACKET_DEGREE: usize = 7;

/// The two parts of a Hamiltonian `H = A + B` that a splitting composes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitPart {
    /// The part A.
    A,
    /// The part B.
    B,
}

/// A term `coefficient {w_1, {w_2, ... {w_(n-1), w_n}}}` of a [`BracketSeries`], where each `w_i` is A or B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BracketTerm {
    degree: usize,
    /// The functions: bit i of the number is set where `w_(i+1)` is B.
    word: u8,
    /// The coefficient.
    pub coefficient: f64,
}

impl BracketTerm {
    /// The number n of the functions.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The function of index i, from 0, of the bracket.
    pub fn part(&self, i: usize) -> SplitPart {
        if self.word >> i & 1 == 0 { SplitPart::A } else { SplitPart::B }
    }
}

/// The bracket, such as `{A, {A, B}}`.
impl std::fmt::Display for BracketTerm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for i in 0..self.degree {
            let name = if self.part(i) == SplitPart::A { "A" } else { "B" };
            write!(f, "{}", if i + 1 == self.degree { name.to_owned() } else { format!("{{{name}, ") })?;
        }
        write!(f, "{}", "}".repeat(self.degree - 1))
    }
}

/// The modified Hamiltonian `H~ = sum_n h^(n-1) H_n` of a composition of the exact flows of two autonomous contact
/// Hamiltonians A and B, where `H_n` is a sum of Jacobi brackets of n of them.
///
/// The pullbacks of functions by the flows are `exp(a h X_A)`, `exp(b h X_B)`, so that their product, in the order in
/// which the flows are taken, is the pullback by the composition. The logarithm of the product is a series of words in
/// `X_A` and `X_B`, and a Lie element by the Baker-Campbell-Hausdorff theorem; by the theorem of Dynkin, Specht and
/// Wever it remains the same if each word of length n is replaced by `1/n` times its nested Lie bracket. Since `X_{f,g}
/// = [X_f, X_g]`, the Jacobi brackets of A and B have the same coefficients. See Hairer, Lubich and Wanner, Geometric
/// Numerical Integration (2006), sections III.4 and IX.4, for the series of symplectic splittings.
///
/// ```
/// use discrete_herglotz::hamiltonian::{BracketSeries, SplitPart::{A, B}};
/// let strang = BracketSeries::new(&[(A, 0.5), (B, 1.0), (A, 0.5)], 3)?;
/// let terms: Vec<_> = strang.terms().iter().filter(|t| t.degree() == 3).collect();
/// assert_eq!(terms[0].to_string(), "{A, {A, B}}");
/// assert!((terms[0].coefficient + 1.0 / 24.0).abs() < 1e-15);
/// assert!(terms[1].to_string() == "{B, {A, B}}" && (terms[1].coefficient + 1.0 / 12.0).abs() < 1e-15);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BracketSeries {
    terms: Vec<BracketTerm>,
    degree: usize,
}

/// The coefficients of a series in words of two letters: those of length n, indexed by their bits.
type Words = Vec<Vec<f64>>;

/// The product of two series, without words longer than those that they have.
fn product(x: &Words, y: &Words) -> Words {
    let mut product: Words = x.iter().map(|words| vec![0.0; words.len()]).collect();
    for (n, words) in product.iter_mut().enumerate() {
        for k in 0..=n {
            // The first k letters are the low bits.
            for (word, sum) in words.iter_mut().enumerate() {
                *sum += x[k][word & ((1 << k) - 1)] * y[n - k][word >> k];
            }
        }
    }
    product
}

impl BracketSeries {
    /// The series up to a degree of a composition, whose flows are listed in the order in which they are taken, with
    /// their times in units of h: `[(A, 1/2), (B, 1), (A, 1/2)]` for the Strang splitting. Terms that vanish
    /// identically are left out.
    ///
    /// # Errors
    /// [`InputError::Count`] for a degree of 0 or beyond [`MAX_BRACKET_DEGREE`]; [`InputError::Span`] for a time that
    /// is not finite, or is so long that the coefficients overflow.
    pub fn new(composition: &[(SplitPart, f64)], degree: usize) -> Result<Self, InputError> {
        if !(1..=MAX_BRACKET_DEGREE).contains(&degree) {
            let what = "the degree of the series of brackets, at most 7,";
            return Err(InputError::Count { what, least: 1, found: degree });
        }
        if let Some((_, span)) = composition.iter().find(|(_, time)| !time.is_finite()) {
            return Err(InputError::Span { span: *span });
        }
        let zero: Words = (0..=degree).map(|n| vec![0.0; 1 << n]).collect();
        let mut one = zero.clone();
        one[0][0] = 1.0;
        let mut all = one.clone();
        for (part, time) in composition {
            let mut flow = zero.clone();
            let mut coefficient = 1.0;
            for (n, words) in flow.iter_mut().enumerate() {
                if n > 0 {
                    coefficient *= time / n as f64;
                }
                let last = words.len() - 1;
                words[if *part == SplitPart::A { 0 } else { last }] = coefficient;
            }
            all = product(&all, &flow);
        }
        all[0][0] = 0.0;
        // The logarithm of 1 + all.
        let (mut power, mut logarithm, mut sizes) = (one, zero.clone(), zero);
        for k in 1..=degree {
            power = product(&power, &all);
            let factor = if k % 2 == 1 { 1.0 } else { -1.0 } / k as f64;
            for ((sums, sizes), words) in logarithm.iter_mut().zip(&mut sizes).zip(&power) {
                for ((sum, size), word) in sums.iter_mut().zip(sizes).zip(words) {
                    *sum += factor * word;
                    *size += (factor * word).abs();
                }
            }
        }
        let terms = brackets(&logarithm, &sizes);
        if terms.iter().all(|term| term.coefficient.is_finite()) {
            return Ok(BracketSeries { terms, degree });
        }
        let longest = composition.iter().map(|(_, time)| time.abs()).fold(0.0, f64::max);
        Err(InputError::Span { span: longest })
    }

    /// The terms, in the order of their degrees.
    pub fn terms(&self) -> &[BracketTerm] {
        &self.terms
    }

    /// The value `sum_(n <= k) h^(n-1) H_n` of the series, truncated to the degree k or to its own, at a state.
    ///
    /// The nested bracket of `w_1, ..., w_n` is the mixed derivative at 0 of `w_n(phi_(n-1)(... phi_1(x))) / (sigma_1
    /// ... sigma_(n-1))` in the times of the flows `phi_i` of the `w_i` with their factors, because `{f, g}` is the
    /// derivative of `(g o phi) / sigma` along the flow of f. To first order in each time the flow is a step of Euler's
    /// method, so that nested dual numbers give it without any flow.
    pub fn value<const N: usize>(
        &self,
        a: &impl ContactHamiltonian<N>,
        b: &impl ContactHamiltonian<N>,
        x: &PhasePoint<N>,
        h: f64,
        k: usize,
    ) -> f64 {
        self.sum(&self.brackets(a, b, x, k), h, k)
    }

    /// The brackets of the terms up to a degree at a state.
    fn brackets<const N: usize>(
        &self,
        a: &impl ContactHamiltonian<N>,
        b: &impl ContactHamiltonian<N>,
        x: &PhasePoint<N>,
        k: usize,
    ) -> Vec<f64> {
        self.terms.iter().take_while(|term| term.degree <= k).map(|term| term.value(a, b, x)).collect()
    }

    /// The series up to the degree k with these brackets.
    fn sum(&self, brackets: &[f64], h: f64, k: usize) -> f64 {
        let terms = self.terms.iter().zip(brackets).filter(|(term, _)| term.degree <= k);
        terms.map(|(term, bracket)| term.coefficient * h.powi(term.degree as i32 - 1) * bracket).sum()
    }

    /// The defects `|H~_k o Phi - sigma_d H~_k| / |H~_k|` of one step `Phi`, their mean over some states, for several
    /// step sizes and for all k up to the degree of the series: a table for a plot. They decrease as `h^(k+1)`, for a
    /// symmetric composition as `h^(k+2)` where k is odd. `step` returns the state after a step of length h, and its
    /// factor.
    ///
    /// # Errors
    /// [`InputError::Count`] without a state; [`InputError::FirstStep`] where a step fails, or where a value is not
    /// finite.
    pub fn defects<const N: usize>(
        &self,
        a: &impl ContactHamiltonian<N>,
        b: &impl ContactHamiltonian<N>,
        states: &[PhasePoint<N>],
        steps: &[f64],
        step: impl Fn(&PhasePoint<N>, f64) -> Result<(PhasePoint<N>, f64), StepError>,
    ) -> Result<Vec<ModifiedDefect>, InputError> {
        if states.is_empty() {
            return Err(InputError::Count { what: "states", least: 1, found: 0 });
        }
        let all = |x: &PhasePoint<N>| self.brackets(a, b, x, self.degree);
        let at_states: Vec<Vec<f64>> = states.iter().map(all).collect();
        let mut found = Vec::with_capacity(steps.len() * self.degree);
        for &h in steps {
            let mut defects = vec![0.0; self.degree];
            for (x, before) in states.iter().zip(&at_states) {
                let (y, sigma) = step(x, h).map_err(InputError::FirstStep)?;
                let after = all(&y);
                for (k, defect) in (1..).zip(&mut defects) {
                    let [before, after] = [before, &after].map(|brackets| self.sum(brackets, h, k));
                    *defect += ((after - sigma * before) / before).abs() / states.len() as f64;
                }
            }
            if !defects.iter().all(|defect| defect.is_finite()) {
                return Err(InputError::FirstStep(StepError::NonFinite));
            }
            found.extend((1..).zip(defects).map(|(k, defect)| ModifiedDefect { k, h, defect }));
        }
        Ok(found)
    }

    /// The degree up to which the series is known.
    pub fn degree(&self) -> usize {
        self.degree
    }
}

/// The nested brackets of a Lie element, given by its words. Those that end in twice the same function vanish, and
/// those that end in `{B, A}` are the negative of those that end in `{A, B}`.
fn brackets(logarithm: &Words, sizes: &Words) -> Vec<BracketTerm> {
    let mut terms = Vec::new();
    for (degree, (words, sizes)) in logarithm.iter().zip(sizes).enumerate().skip(1) {
        for (word, coefficient) in words.iter().enumerate() {
            let mut coefficient = coefficient / degree as f64;
            let mut size = sizes[word];
            if degree > 1 {
                // The last two letters are the highest bits: A, then B.
                let (before, last) = (1 << (degree - 2), 1 << (degree - 1));
                if word & before != 0 || word & last == 0 {
                    continue;
                }
                coefficient -= words[word ^ before ^ last] / degree as f64;
                size += sizes[word ^ before ^ last];
            }
            // What the rounding of the coefficients leaves of zero.
            if coefficient.abs() > 64.0 * f64::EPSILON * size {
                terms.push(BracketTerm { degree, word: word as u8, coefficient });
            }
        }
    }
    terms
}

/// A number with several infinitesimals, each of square zero.
trait Infinitesimals: Scalar {
    /// Their number.
    const COUNT: usize;
    /// The one of index k.
    fn infinitesimal(k: usize) -> Self;
    /// The coefficient of the product of those of index below k.
    fn mixed(self, k: usize) -> f64;
}

impl Infinitesimals for f64 {
    const COUNT: usize = 0;
    fn infinitesimal(_k: usize) -> Self {
        f64::NAN
    }
    fn mixed(self, _k: usize) -> f64 {
        self
    }
}

/// A number with one more infinitesimal.
type With<T> = Dual<T, SVector<T, 1>>;

impl<T: Infinitesimals> Infinitesimals for With<T> {
    const COUNT: usize = T::COUNT + 1;
    fn infinitesimal(k: usize) -> Self {
        if k == T::COUNT {
            Dual { re: T::zero(), d: SVector::from_element(T::one()) }
        } else {
            Dual::constant(T::infinitesimal(k))
        }
    }
    fn mixed(self, k: usize) -> f64 {
        if k > T::COUNT { self.d[0].mixed(T::COUNT) } else { self.re.mixed(k) }
    }
}

type Two = With<With<f64>>;
type Four = With<With<Two>>;
type Six = With<With<Four>>;

impl BracketTerm {
    /// The value of the bracket without the coefficient at a state.
    pub fn value<const N: usize>(
        &self,
        a: &impl ContactHamiltonian<N>,
        b: &impl ContactHamiltonian<N>,
        x: &PhasePoint<N>,
    ) -> f64 {
        match self.degree {
            0..=3 => self.mixed_derivative::<Two, N>(a, b, x),
            4 | 5 => self.mixed_derivative::<Four, N>(a, b, x),
            _ => self.mixed_derivative::<Six, N>(a, b, x),
        }
    }

    fn mixed_derivative<T: Infinitesimals, const N: usize>(
        &self,
        a: &impl ContactHamiltonian<N>,
        b: &impl ContactHamiltonian<N>,
        x: &PhasePoint<N>,
    ) -> f64 {
        let mut point = PhasePoint { q: x.q.map(T::from), p: x.p.map(T::from), z: T::from(x.z) };
        let mut over_sigma = T::one();
        for i in 0..self.degree - 1 {
            let (f, d): (T, ChartVector<N, T>) = match self.part(i) {
                SplitPart::A => a.with_gradient(T::zero(), &point),
                SplitPart::B => b.with_gradient(T::zero(), &point),
            };
            let time = T::infinitesimal(i);
            over_sigma += over_sigma * d.z * time;
            let z = point.z + (point.p.dot(&d.y) - f) * time;
            let p = SVector::from_fn(|j, _| point.p[j] - (d.x[j] + point.p[j] * d.z) * time);
            point = PhasePoint { q: SVector::from_fn(|j, _| point.q[j] + d.y[j] * time), p, z };
        }
        let PhasePoint { q, p, z } = point;
        let last = match self.part(self.degree - 1) {
            SplitPart::A => a.value(T::zero(), &q, &p, z),
            SplitPart::B => b.value(T::zero(), &q, &p, z),
        };
        (last * over_sigma).mixed(self.degree - 1)
    }
}
