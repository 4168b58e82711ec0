//! Invalid and extreme numbers, and the report on what functions return for them.

use crate::lagrangians::One;
use contact_geom::Lagrangian;
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{ChartVector, DiscretePoint, Dual, PhasePoint, Scalar, Structure, VelocityPoint};
use discrete_herglotz::{State, Vector};

/// The values that replace a coordinate, a time or a step.
pub const EXTREME: [f64; 16] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    f64::MIN_POSITIVE,
    5e-324,
    -5e-324,
    1e-300,
    f64::EPSILON,
    -1.0,
    1e16,
    1e150,
    -1e200,
    f64::MAX,
    -f64::MAX,
];

/// An ordinary value of each coordinate.
pub const BASE: [f64; 3] = [0.3, 0.7, 0.2];

/// Triples with an extreme value in one coordinate, or in all.
pub fn triples() -> Vec<ChartVector<1>> {
    let of = |c: [f64; 3]| ChartVector { x: [c[0]].into(), y: [c[1]].into(), z: c[2] };
    let mut all = vec![of(BASE)];
    for value in EXTREME {
        all.extend((0..3).map(|i| of(std::array::from_fn(|j| if i == j { value } else { BASE[j] }))));
        all.push(of([value; 3]));
    }
    all
}

/// Times with triples, one of which is ordinary.
pub fn places() -> Vec<(f64, ChartVector<1>)> {
    let tame = triples()[0];
    EXTREME.iter().map(|t| (*t, tame)).chain(triples().into_iter().map(|x| (0.4, x))).collect()
}

/// The size of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// Finite, and far from overflow in any power that a formula takes.
    Tame,
    /// Finite; products may overflow.
    Huge,
    /// Infinite or not a number.
    Bad,
}

pub fn grade(numbers: &impl Numbers) -> Grade {
    let all = numbers.numbers();
    if !all.iter().all(|x| x.is_finite()) {
        Grade::Bad
    } else if all.iter().any(|x| x.abs() > 1e10) {
        Grade::Huge
    } else {
        Grade::Tame
    }
}

/// The failed checks of each entry point.
#[derive(Default)]
pub struct Report {
    pub entries: String,
    found: Vec<String>,
    checks: usize,
}

impl Report {
    pub fn check(&mut self, good: bool, what: impl FnOnce() -> String) {
        self.checks += 1;
        if !good {
            let text = format!("{}: {}", self.entries, what());
            self.found.push(text);
        }
    }

    /// A formula: it returns a number that is not finite for a NaN, or refuses it, and is finite for ordinary input.
    /// For infinite input it may be finite: `e^x` vanishes at minus infinity.
    pub fn formula<E: std::fmt::Display>(
        &mut self,
        input: &(impl Numbers + std::fmt::Debug),
        output: Result<impl Numbers, E>,
    ) {
        let output = match output {
            Ok(output) => output.numbers(),
            Err(error) => return self.check(!error.to_string().is_empty(), || "an error without words".into()),
        };
        let finite = output.iter().all(|x| x.is_finite());
        let good = match grade(input) {
            Grade::Tame => finite,
            Grade::Huge => true,
            Grade::Bad => !finite || !input.numbers().iter().any(|x| x.is_nan()),
        };
        self.check(good, || format!("{input:?} leads to {output:?}"));
    }

    /// An entry point that refuses input that is not finite, and returns finite numbers or an error.
    pub fn entry_point<E: std::fmt::Display>(
        &mut self,
        input: &(impl Numbers + std::fmt::Debug),
        output: Result<impl Numbers, E>,
    ) {
        match output {
            Ok(output) => {
                let output = output.numbers();
                let good = grade(input) != Grade::Bad && output.iter().all(|x| x.is_finite());
                self.check(good, || format!("{input:?} leads to {output:?}"));
            }
            Err(error) => self.check(!error.to_string().is_empty(), || "an error without words".into()),
        }
    }

    pub fn end(self) {
        assert!(self.checks > 500, "only {} checks", self.checks);
        for found in &self.found {
            println!("{found}");
        }
        assert!(self.found.is_empty(), "{} of {} checks fail", self.found.len(), self.checks);
    }
}

/// The result of a function that does not fail.
pub fn fine<T>(value: T) -> Result<T, String> {
    Ok(value)
}

/// All numbers in a value.
pub trait Numbers {
    fn numbers(&self) -> Vec<f64>;
}

impl Numbers for () {
    fn numbers(&self) -> Vec<f64> {
        Vec::new()
    }
}

impl Numbers for f64 {
    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }
}

impl<const R: usize, const C: usize> Numbers for SMatrix<f64, R, C> {
    fn numbers(&self) -> Vec<f64> {
        self.iter().copied().collect()
    }
}

impl Numbers for DMatrix<f64> {
    fn numbers(&self) -> Vec<f64> {
        self.iter().copied().collect()
    }
}

impl<const N: usize> Numbers for ChartVector<N> {
    fn numbers(&self) -> Vec<f64> {
        (0..2 * N + 1).map(|i| self.component(i)).collect()
    }
}

impl<const N: usize> Numbers for VelocityPoint<N> {
    fn numbers(&self) -> Vec<f64> {
        ChartVector::from(*self).numbers()
    }
}

impl<const N: usize> Numbers for PhasePoint<N> {
    fn numbers(&self) -> Vec<f64> {
        ChartVector::from(*self).numbers()
    }
}

impl Numbers for Vector {
    fn numbers(&self) -> Vec<f64> {
        self.to_vec()
    }
}

impl Numbers for State {
    fn numbers(&self) -> Vec<f64> {
        self.q.iter().chain(&self.p).copied().chain([self.z]).collect()
    }
}

impl<const N: usize> Numbers for DiscretePoint<N> {
    fn numbers(&self) -> Vec<f64> {
        ChartVector::from(*self).numbers()
    }
}

impl<const M: usize> Numbers for Dual<f64, SVector<f64, M>> {
    fn numbers(&self) -> Vec<f64> {
        self.d.iter().copied().chain([self.re]).collect()
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    fn numbers(&self) -> Vec<f64> {
        self.iter().flat_map(T::numbers).collect()
    }
}

impl<T: Numbers> Numbers for Option<T> {
    fn numbers(&self) -> Vec<f64> {
        self.iter().flat_map(T::numbers).collect()
    }
}

impl<A: Numbers, B: Numbers> Numbers for (A, B) {
    fn numbers(&self) -> Vec<f64> {
        [self.0.numbers(), self.1.numbers()].concat()
    }
}

impl<A: Numbers, B: Numbers, C: Numbers> Numbers for (A, B, C) {
    fn numbers(&self) -> Vec<f64> {
        [self.0.numbers(), self.1.numbers(), self.2.numbers()].concat()
    }
}

/// A system whose `W`, force and rate depend on t, q, v and z.
#[derive(Clone, Copy, Debug)]
pub struct Everything;

pub const EVERYTHING: One = One::Everything(Everything);

impl Lagrangian<1> for Everything {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let (q, v) = (q[0], v[0]);
        let inertia = q.cos() * z.cos() * (t.cos() * 0.1 + 0.4) + 1.0;
        v * v * inertia * 0.5 + v.powi(4) * 0.02 - q.versine() * (t.sin() * 0.2 + 1.0) - z * (q.sin() * 0.05 + 0.1)
    }
}

/// A pendulum that declares its structure.
#[derive(Clone, Copy, Debug)]
pub struct Claiming;

pub const CLAIMING: One = One::Claiming(Claiming);

impl Lagrangian<1> for Claiming {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - q[0].versine() * (t.cos() * 0.1 + 1.0) - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { z_affine: true, constant_rate: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}
