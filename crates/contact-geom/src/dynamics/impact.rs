//! Impacts on surfaces.

use crate::dynamics::lagrangian::forward_lagrangian;
use crate::dynamics::law_derivatives::LawDerivatives;
use crate::number::linear::solve;
use crate::switching::Control;
use crate::{ChartVector, Dual, Hints, Lagrangian, Scalar, VelocityPoint};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector, SMatrix, SVector};

/// The largest number of Newton iterations for the state after an impact. The energy is convex along the normal, so
/// that they converge from the reflected velocity; bisection would need as many.
const MAX_ITERATIONS: usize = 60;

/// The number of iterations after the velocity has converged, each of which gives one more order of derivatives of dual
/// numbers: two for second derivatives, and one for the round-off.
const MAX_EXTRA_ITERATIONS: usize = 3;

/// A surface `g(t, q) = 0` that bounds the motions with `g >= 0`, written once as a generic function.
pub trait Surface<const N: usize> {
    /// The value `g(t, q)`, positive where motions are admitted.
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>) -> T;

    /// The normal `g_q` and the rate `g_t`.
    fn normal<T: Scalar>(&self, t: T, q: &SVector<T, N>) -> (SVector<T, N>, T) {
        normal_of(|time, moving| self.value(time, moving), t, q)
    }

    /// The names of the parameters of the surface; by default there are none. A surface with parameters implements this
    /// method and the three below.
    fn parameter_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The same surface with other values of the parameters; `None` where their number is wrong, and by default.
    fn with_parameters(&self, _theta: &[f64]) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// The value `g(t, q; theta)`, for as many values as there are names.
    fn value_at<T: Scalar>(&self, _theta: &[T], t: T, q: &SVector<T, N>) -> T {
        self.value(t, q)
    }
}

/// The gradient of a function of the time and the position: in the position, and in the time.
pub(super) fn normal_of<T: Scalar, const N: usize>(
    value: impl Fn(Dual<T, ChartVector<N, T>>, &SVector<Dual<T, ChartVector<N, T>>, N>) -> Dual<T, ChartVector<N, T>>,
    t: T,
    q: &SVector<T, N>,
) -> (SVector<T, N>, T) {
    let mut moving = q.map(Dual::<T, ChartVector<N, T>>::constant);
    let mut time = Dual::<T, ChartVector<N, T>>::constant(t);
    for i in 0..N {
        moving[i].d.x[i] = T::one();
    }
    time.d.z = T::one();
    let g = value(time, &moving);
    (g.d.x, g.d.z)
}

/// The law of an impact on a surface `g(t, q) = 0`.
///
/// At an impact the position is continuous, and the momentum changes along the normal. With `lambda` the factor of the
/// law,
///
/// `p+ = lambda p- + mu g_q`, `z+ = lambda z-`,
///
/// and mu follows from the energy or from the normal velocity. For the first and the third law the form `dz - p dq +
/// H dt` on the surface is multiplied by lambda: on it `g_q . dq + g_t dt = 0`, so that
/// `-p+ . dq + H+ dt = lambda (-p- . dq + H- dt)` if and only if `H+ = lambda H- - mu g_t`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Impact {
    /// The energy is conserved on a surface at rest, `H+ = H- - mu g_t`: strictly contact, `lambda = 1`.
    Elastic,
    /// Newton's law: the normal velocity relative to the surface is multiplied by `-e`, the tangential momentum is
    /// conserved. Not contact unless e = 1.
    Restitution(f64),
    /// The conformally contact law with the factor `lambda` between 0 and 1, `H+ = lambda H- - mu g_t`. On a surface at
    /// rest where the potential vanishes, the restitution is `sqrt(lambda)` at normal incidence.
    Conformal(f64),
}

impl Impact {
    /// The factor by which the law multiplies the contact form; `None` if it is not contact.
    pub fn factor(self) -> Option<f64> {
        match self {
            Impact::Elastic => Some(1.0),
            Impact::Restitution(e) => (e == 1.0).then_some(1.0),
            Impact::Conformal(factor) => Some(factor),
        }
    }

    /// The state after an impact on a surface with the normal `g_q` and the rate `g_t`. `None` if there is no state with
    /// which the motion leaves the surface: the law takes more energy than the motion has, `L_vv` is singular, or a
    /// number is not finite.
    pub fn after<T: Scalar, const N: usize>(
        self,
        lagrangian: &impl Lagrangian<N>,
        t: T,
        x: &VelocityPoint<N, T>,
        normal: (&SVector<T, N>, T),
    ) -> Option<VelocityPoint<N, T>> {
        self.after_with(T::from(self.coefficient()), lagrangian, t, x, normal)
    }

    /// The coefficient of restitution, or the factor of the conformal law; 1 for an elastic impact.
    pub(super) fn coefficient(self) -> f64 {
        match self {
            Impact::Elastic => 1.0,
            Impact::Restitution(coefficient) | Impact::Conformal(coefficient) => coefficient,
        }
    }

    /// The velocity and the action after an impact, for vectors whose length may be known at run time: `at` is the function
    /// of a velocity and an action that has L, `L_v` and `L_vv`, at the time and the position of the impact. `None` as for
    /// [`after`](Self::after).
    pub fn after_at<T: Scalar, D: Dim>(
        self,
        at: impl Fn(&OVector<T, D>, T) -> (T, OVector<T, D>, OMatrix<T, D, D>),
        before: (&OVector<T, D>, T),
        normal: (&OVector<T, D>, T),
    ) -> Option<(OVector<T, D>, T)>
    where
        DefaultAllocator: Allocator<D> + Allocator<D, D>,
    {
        self.solved(T::from(self.coefficient()), at, before, normal)
    }

    /// The state after an impact with another coefficient, for the derivatives of a Lagrangian.
    pub(super) fn after_with<T: Scalar, const N: usize>(
        self,
        coefficient: T,
        lagrangian: &impl LawDerivatives<N, T>,
        t: T,
        x: &VelocityPoint<N, T>,
        normal: (&SVector<T, N>, T),
    ) -> Option<VelocityPoint<N, T>> {
        let at = |v: &SVector<T, N>, z: T| {
            let y = VelocityPoint { q: x.q, v: *v, z };
            let (value, slope) = lagrangian.value_and_gradient(t, &y);
            (value, slope.y, lagrangian.mass(t, &y))
        };
        let (v, z) = self.solved(coefficient, at, (&x.v, x.z), normal)?;
        Some(VelocityPoint { q: x.q, v, z })
    }

    /// See [`after_at`](Self::after_at).
    fn solved<T: Scalar, D: Dim>(
        self,
        coefficient: T,
        at: impl Fn(&OVector<T, D>, T) -> (T, OVector<T, D>, OMatrix<T, D, D>),
        (v, z): (&OVector<T, D>, T),
        (normal, rate): (&OVector<T, D>, T),
    ) -> Option<(OVector<T, D>, T)>
    where
        DefaultAllocator: Allocator<D> + Allocator<D, D>,
    {
        let one = T::one();
        let (factor, restitution) = match self {
            Impact::Elastic => (one, one),
            Impact::Restitution(_) => (one, coefficient),
            Impact::Conformal(_) => (coefficient, coefficient.sqrt()),
        };
        let by_energy = !matches!(self, Impact::Restitution(_));
        let (before, p, w) = at(v, z);
        let energy = v.dot(&p) - before;
        let approach = normal.dot(v) + rate;
        let z = z * factor;
        let divided = |w: &OMatrix<T, D, D>, by: &OVector<T, D>| {
            let (mut w, mut by) = (w.clone(), by.clone());
            solve(&mut w, &mut by).ok().map(|_| by)
        };
        // The reflected velocity, for the mass matrix before the impact.
        let across = divided(&w, normal)?;
        let mut mu = -approach * (restitution + factor) / normal.dot(&across);
        let mut y = v * factor + across * mu;
        let (mut converged, mut last) = (0, f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            let (value, momentum, w) = at(&y, z);
            let residual = &momentum - &p * factor - normal * mu;
            let (along, across) = (divided(&w, &residual)?, divided(&w, normal)?);
            // The terms of the law, its derivative in the velocity, and that in mu.
            let (of_law, direction, of_mu) = if by_energy {
                ([y.dot(&momentum), -value, -energy * factor, mu * rate], w * &y, rate)
            } else {
                ([normal.dot(&y), rate, approach * restitution, T::zero()], normal.clone(), T::zero())
            };
            let sum = of_law.iter().fold(T::zero(), |sum, term| sum + *term);
            let slope = direction.dot(&across) + of_mu;
            let change = (direction.dot(&along) - sum) / slope;
            let largest = |v: &OVector<T, D>| v.iter().fold(0.0, |m: f64, v| m.max(v.pivot_size()));
            // A slow motion in a high potential has an energy whose round-off is larger than that of its velocity.
            let terms: f64 = of_law.iter().map(|term| term.pivot_size()).sum();
            let of_terms = terms * largest(&across) / slope.pivot_size();
            let step = across * change - along;
            mu += change;
            y += &step;
            let (size, of) = (largest(&step), largest(&y));
            if !(size.is_finite() && mu.extent().is_finite()) {
                return None;
            }
            if size <= f64::EPSILON * of || size >= last && size <= 64.0 * f64::EPSILON * of.max(of_terms) {
                converged += 1;
            }
            if converged == MAX_EXTRA_ITERATIONS {
                let departure = normal.dot(&y) + rate;
                return (departure.re() * approach.re() <= 0.0).then_some((y, z));
            }
            last = size;
        }
        None
    }
}

/// A Lagrangian whose motions are bounded by a [`Surface`], on which they rebound by the law of an [`Impact`].
#[derive(Clone, Copy, Debug)]
pub struct Impacts<L, S> {
    /// The Lagrangian.
    pub lagrangian: L,
    /// The surface.
    pub surface: S,
    /// The law.
    pub law: Impact,
}

impl<L, S> Impacts<L, S> {
    /// A Lagrangian with impacts on a surface.
    pub fn new(lagrangian: L, surface: S, law: Impact) -> Self {
        Impacts { lagrangian, surface, law }
    }
}

impl<const N: usize, L: Lagrangian<N>, S: Surface<N>> Lagrangian<N> for Impacts<L, S> {
    const HINTS: Hints = Hints { switching_functions: true, resets: true, over_slices: false, ..L::HINTS };

    forward_lagrangian!(of_value, self => self.lagrangian);
    forward_lagrangian!(of_force, self => self.lagrangian);

    fn structure(&self) -> crate::Structure {
        self.lagrangian.structure()
    }
    fn switching_functions(&self, t: f64, x: &VelocityPoint<N>, values: &mut Vec<f64>) {
        values.push(self.surface.value(t, &x.q));
        self.lagrangian.switching_functions(t, x, values);
    }
    fn at_switch(&self, index: usize, t: f64, x: &VelocityPoint<N>, rising: bool) -> Control<N> {
        let Some(index) = index.checked_sub(1) else {
            if rising {
                return Control::Continue;
            }
            let (normal, rate) = self.surface.normal(t, &x.q);
            // A state that does not exist is refused as one that is not finite.
            let to = self.law.after(&self.lagrangian, t, x, (&normal, rate));
            let to = to.unwrap_or(VelocityPoint { v: SVector::repeat(f64::NAN), ..*x });
            return match self.law.factor() {
                Some(factor) => Control::Conformal { to, factor },
                None => Control::Replace(to),
            };
        };
        self.lagrangian.at_switch(index, t, x, rising)
    }
    fn at_accumulation(&self, index: usize, t: f64, x: &VelocityPoint<N>) -> Control<N> {
        index.checked_sub(1).map_or(Control::Continue, |index| self.lagrangian.at_accumulation(index, t, x))
    }
    fn breaks(&self) -> &[f64] {
        self.lagrangian.breaks()
    }
    fn has_cones(&self) -> bool {
        self.lagrangian.has_cones()
    }
}
