//! Tests of the algebraic order conditions of every scheme.

use super::SplittingScheme;

/// A sum with the sum of the absolute values of its terms, which bounds the effect of the round-off of the
/// coefficients.
#[derive(Clone, Copy)]
struct Sized {
    value: f64,
    size: f64,
}

/// A residual in units of its round-off.
fn in_roundings(found: Sized, exact: f64) -> f64 {
    (found.value - exact).abs() / (f64::EPSILON * (found.size + exact.abs()))
}

/// The tolerance of the residuals in units of round-off: products of up to `order` coefficients and their sums.
const ROUNDINGS: f64 = 4.0;

/// The coefficients of the words of one length in the letters A and B of `prod exp(k_i B) exp(d_i A)`, as an element of
/// the free associative algebra: `words[n][w]` for the word of length `n` whose letters are the bits of `w`.
fn words(scheme: &SplittingScheme, length: usize) -> Vec<Vec<Sized>> {
    let zero = Sized { value: 0.0, size: 0.0 };
    let mut words: Vec<Vec<Sized>> = (0..=length).map(|n| vec![zero; 1 << n]).collect();
    words[0][0] = Sized { value: 1.0, size: 1.0 };
    let mut multiply = |letter: usize, a: f64| {
        for n in (1..=length).rev() {
            for w in 0..1 << n {
                // The last k letters of the word come from the exponential, as long as they are its letter.
                let (mut power, mut rest) = (1.0, w);
                for k in 1..=n {
                    if rest & 1 != letter {
                        break;
                    }
                    rest >>= 1;
                    power *= a / k as f64;
                    let before = words[n - k][rest];
                    words[n][w].value += power * before.value;
                    words[n][w].size += power.abs() * before.size;
                }
            }
        }
    };
    let (drifts, kicks) = scheme.coefficients();
    multiply(1, kicks[0]);
    for (drift, kick) in drifts.iter().zip(&kicks[1..]) {
        multiply(0, *drift);
        multiply(1, *kick);
    }
    words
}

/// The largest residual, in units of round-off, of the words of this length against `exp(A + B)`.
fn word_residual(words: &[Vec<Sized>], length: usize) -> f64 {
    let exact = (1..=length).map(|k| 1.0 / k as f64).product();
    words[length].iter().map(|&found| in_roundings(found, exact)).fold(0.0, f64::max)
}

/// A Nyström tree of order `n`: its elementary weight at each kick, and the factor of `s^(n - 1)` in that of the exact
/// flow.
struct Tree {
    weight: Vec<Sized>,
    exact: f64,
    order: usize,
}

/// The largest residual, in units of round-off, of the conditions of this order for `y'' = f(y)`: for the velocity, of
/// the trees of this order, and for the position, of the trees of one order less.
///
/// The kicks and their times define a Nyström method: `v1 = v0 + h sum k_i f_i`, and
/// `Y_i = y0 + c_i h v0 + h^2 sum_j k_j (c_i - c_j) f_j`.
fn nystrom_residual(scheme: &SplittingScheme, order: usize) -> f64 {
    let (drifts, kicks) = scheme.coefficients();
    let times: Vec<f64> = (0..kicks.len()).map(|i| drifts[..i].iter().sum()).collect();
    let sum = |terms: &mut dyn Iterator<Item = (f64, Sized)>| {
        terms.fold(Sized { value: 0.0, size: 0.0 }, |sum, (a, b)| Sized {
            value: sum.value + a * b.value,
            size: sum.size + a.abs() * b.size,
        })
    };
    let mut worst = in_roundings(Sized { value: times[kicks.len() - 1], size: 3.0 }, 1.0);
    // The branches of a vertex: the velocity y', and each smaller tree, integrated twice.
    let leaf = times.iter().map(|c| Sized { value: *c, size: 1.0 }).collect();
    let mut branches = vec![Tree { weight: leaf, exact: 1.0, order: 1 }];
    for n in 1..=order {
        let trees = bouquets(&branches, n - 1, kicks.len());
        for tree in &trees {
            let at = |factor: &dyn Fn(usize) -> f64| {
                sum(&mut (0..kicks.len()).map(|i| (kicks[i] * factor(i), tree.weight[i])))
            };
            if n == order {
                worst = worst.max(in_roundings(at(&|_| 1.0), tree.exact / n as f64));
            } else if n == order - 1 {
                worst = worst.max(in_roundings(at(&|i| 1.0 - times[i]), tree.exact / (n * (n + 1)) as f64));
            }
        }
        branches.extend(trees.into_iter().map(|tree| {
            Tree {
                weight: (0..kicks.len())
                    .map(|i| sum(&mut (0..i).map(|j| (kicks[j] * (times[i] - times[j]), tree.weight[j]))))
                    .collect(),
                exact: tree.exact / (n * (n + 1)) as f64,
                order: n + 1,
            }
        }));
    }
    worst
}

/// All products of branches whose orders sum to `order`, each as a vertex with these branches.
fn bouquets(branches: &[Tree], order: usize, kicks: usize) -> Vec<Tree> {
    if order == 0 {
        return vec![Tree { weight: vec![Sized { value: 1.0, size: 1.0 }; kicks], exact: 1.0, order: 1 }];
    }
    let mut found = Vec::new();
    // The remaining branches have indices up to that of this one, so that each multiset occurs once.
    for (i, branch) in branches.iter().enumerate().filter(|(_, b)| b.order <= order) {
        for rest in bouquets(&branches[..=i], order - branch.order, kicks) {
            let product = |(a, b): (&Sized, &Sized)| Sized { value: a.value * b.value, size: a.size * b.size };
            found.push(Tree {
                weight: rest.weight.iter().zip(&branch.weight).map(product).collect(),
                exact: rest.exact * branch.exact,
                order: rest.order + branch.order,
            });
        }
    }
    found
}

/// Every composition agrees with `exp(A + B)` on all words up to its order, and not on the words with one letter more.
#[test]
fn compositions_have_their_order() {
    for scheme in SplittingScheme::ALL.iter().filter(|s| !s.is_nystrom()) {
        let order = scheme.order() as usize;
        let words = words(scheme, order + 1);
        for length in 1..=order {
            let residual = word_residual(&words, length);
            assert!(residual <= ROUNDINGS, "{}: words of {length}, {residual}", scheme.name());
        }
        let beyond = word_residual(&words, order + 1);
        assert!(beyond > 1e3 * ROUNDINGS, "{}: words of {}, {beyond}", scheme.name(), order + 1);
    }
}

/// Every scheme satisfies the conditions of the Nyström trees up to its order, and not those of the next order.
#[test]
fn every_scheme_has_its_order_on_nystrom_trees() {
    for scheme in &SplittingScheme::ALL {
        let order = scheme.order() as usize;
        for n in 1..=order {
            let residual = nystrom_residual(scheme, n);
            assert!(residual <= ROUNDINGS, "{}: trees of {n}, {residual}", scheme.name());
        }
        let beyond = nystrom_residual(scheme, order + 1);
        assert!(beyond > 1e3 * ROUNDINGS, "{}: trees of {}, {beyond}", scheme.name(), order + 1);
    }
}

/// A Runge-Kutta-Nyström splitting has a lower order without its hypothesis.
#[test]
fn nystrom_schemes_need_their_hypothesis() {
    for scheme in [SplittingScheme::BLANES_MOAN_6, SplittingScheme::BLANES_MOAN_6_LONG, SplittingScheme::BLANES_CASAS_8]
    {
        let order = scheme.order() as usize;
        let worst = (1..=order).map(|n| word_residual(&words(&scheme, order), n)).fold(0.0, f64::max);
        assert!(worst > 1e3 * ROUNDINGS, "{}: {worst}", scheme.name());
    }
}

/// The entries of the table agree with the coefficients of each scheme.
#[test]
fn the_table_is_consistent() {
    for scheme in &SplittingScheme::ALL {
        let (drifts, kicks) = scheme.coefficients();
        assert_eq!(kicks.len(), drifts.len() + 1, "{}", scheme.name());
        let reversed: Vec<f64> = kicks.iter().rev().copied().collect();
        assert_eq!(kicks, reversed, "{}: symmetry of the kicks", scheme.name());
        let reversed: Vec<f64> = drifts.iter().rev().copied().collect();
        assert_eq!(drifts, reversed, "{}: symmetry of the drifts", scheme.name());
        // The force at the start of a step is that at the end of the previous one.
        let evaluations = kicks.iter().filter(|k| **k != 0.0).count() - usize::from(kicks[0] != 0.0);
        assert_eq!(evaluations, scheme.stages(), "{}", scheme.name());
        assert_eq!(scheme.substeps().is_none(), scheme.is_nystrom(), "{}", scheme.name());
        assert!(!scheme.source().is_empty());
    }
}
