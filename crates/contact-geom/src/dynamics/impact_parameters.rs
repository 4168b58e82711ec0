//! The parameters of impacts and of their surfaces.

use crate::dynamics::impact::{Impact, Impacts, Surface, normal_of};
use crate::dynamics::law_derivatives::AtParameters;
use crate::switching::BreakRate;
use crate::{Parametric, PhasePoint, Scalar, VelocityPoint};
use nalgebra::SVector;

impl Impact {
    /// The name of its parameter: `restitution` for Newton's law, `factor` for the conformal one; an elastic impact has
    /// none.
    pub fn parameter_name(self) -> Option<&'static str> {
        match self {
            Impact::Elastic => None,
            Impact::Restitution(_) => Some("restitution"),
            Impact::Conformal(_) => Some("factor"),
        }
    }

    /// The same law with another value of its parameter.
    fn with_coefficient(self, coefficient: f64) -> Self {
        match self {
            Impact::Elastic => Impact::Elastic,
            Impact::Restitution(_) => Impact::Restitution(coefficient),
            Impact::Conformal(_) => Impact::Conformal(coefficient),
        }
    }
}

/// The parameters of the Lagrangian, of the law, and of the surface, each of them as a slice.
struct Parts<'a, T> {
    lagrangian: &'a [T],
    law: &'a [T],
    surface: &'a [T],
}

impl<L, S> Impacts<L, S> {
    fn parts<'a, T, const N: usize>(&self, theta: &'a [T]) -> Option<Parts<'a, T>>
    where
        L: Parametric<N>,
    {
        let (lagrangian, rest) = theta.split_at_checked(self.lagrangian.parameter_count())?;
        let (law, surface) = rest.split_at_checked(usize::from(self.law.parameter_name().is_some()))?;
        Some(Parts { lagrangian, law, surface })
    }
}

/// The parameters of the Lagrangian, then that of the law, `restitution` or `factor`, then those of the surface. A name
/// of the law that the Lagrangian has too is preceded by `impact.`, one of the surface by `surface.`.
impl<const N: usize, L: Parametric<N>, S: Surface<N> + Clone> Parametric<N> for Impacts<L, S> {
    fn parameter_names(&self) -> Vec<String> {
        let mut names = self.lagrangian.parameter_names();
        let of_law = self.law.parameter_name().map(|name| ("impact", name.to_owned()));
        let of_surface = self.surface.parameter_names().into_iter().map(|name| ("surface", name));
        for (of, name) in of_law.into_iter().chain(of_surface) {
            let name = if names.contains(&name) { format!("{of}.{name}") } else { name };
            names.push(name);
        }
        names
    }
    fn parameters(&self) -> Vec<f64> {
        let of_law = self.law.parameter_name().map(|_| self.law.coefficient());
        self.lagrangian.parameters().into_iter().chain(of_law).chain(self.surface.parameters()).collect()
    }
    fn parameter_count(&self) -> usize {
        let of_law = usize::from(self.law.parameter_name().is_some());
        self.lagrangian.parameter_count() + of_law + self.surface.parameters().len()
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let Parts { lagrangian, law, surface } = self.parts::<_, N>(theta)?;
        let of_surface = match surface {
            [] if self.surface.parameters().is_empty() => self.surface.clone(),
            _ => self.surface.with_parameters(surface)?,
        };
        Some(Impacts {
            lagrangian: self.lagrangian.with_parameters(lagrangian)?,
            surface: of_surface,
            law: law.first().map_or(self.law, |coefficient| self.law.with_coefficient(*coefficient)),
        })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.lagrangian.value_at(&theta[..self.lagrangian.parameter_count()], t, q, v, z)
    }
    #[inline(always)]
    fn force_at<T: Scalar>(&self, theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        self.lagrangian.force_at(&theta[..self.lagrangian.parameter_count()], t, x)
    }
    #[inline(always)]
    fn hamiltonian_at<T: Scalar>(&self, theta: &[T], t: T, x: &PhasePoint<N, T>) -> Option<T> {
        self.lagrangian.hamiltonian_at(&theta[..self.lagrangian.parameter_count()], t, x)
    }
    /// Those of the Lagrangian; they do not depend on the other parameters.
    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        if parameter < self.lagrangian.parameter_count() {
            return self.lagrangian.break_rates(parameter);
        }
        let times = self.lagrangian.breaks();
        Some(times.iter().map(|time| BreakRate { time: *time, rate: 0.0 }).collect())
    }
    fn switching_function_at<T: Scalar>(&self, theta: &[T], index: usize, t: T, x: &VelocityPoint<N, T>) -> Option<T> {
        let Parts { lagrangian, surface, .. } = self.parts::<_, N>(theta)?;
        match index.checked_sub(1) {
            None => Some(self.surface.value_at(surface, t, &x.q)),
            Some(index) => self.lagrangian.switching_function_at(lagrangian, index, t, x),
        }
    }
    fn state_after_switch_at<T: Scalar>(
        &self,
        theta: &[T],
        index: usize,
        t: T,
        x: &VelocityPoint<N, T>,
    ) -> Option<VelocityPoint<N, T>> {
        let Parts { lagrangian: own, law, surface } = self.parts::<_, N>(theta)?;
        if let Some(index) = index.checked_sub(1) {
            return self.lagrangian.state_after_switch_at(own, index, t, x);
        }
        let value = |time, moving: &SVector<_, N>| {
            let theta: Vec<_> = surface.iter().map(|theta| crate::Dual::constant(*theta)).collect();
            self.surface.value_at(&theta, time, moving)
        };
        let (normal, rate) = normal_of(value, t, &x.q);
        let coefficient = law.first().copied().unwrap_or(T::one());
        let lagrangian = AtParameters { lagrangian: &self.lagrangian, theta: own };
        self.law.after_with(coefficient, &lagrangian, t, x, (&normal, rate))
    }
}
