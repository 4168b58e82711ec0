//! Parameters of Lagrangians and of forces, with respect to which motions can be differentiated.

use crate::dynamics::nearest_name::nearest_name;
use crate::numbers::dot;
use crate::switching::BreakRate;
use crate::{Force, Forced, Lagrangian, PhasePoint, Scalar, VelocityDrag, VelocityPoint};
use nalgebra::SVector;
use thiserror::Error;

/// A Lagrangian with named parameters `theta`, which can be evaluated for any values of them, over any [`Scalar`]: that
/// is how motions are differentiated with respect to them.
///
/// All methods have defaults for a Lagrangian without parameters: `impl Parametric<1> for Mine {}`. A Lagrangian with
/// parameters implements all of them but [`force_at`](Self::force_at). A formula that is generic over the type of its
/// coefficients ([`ScalarOver`](crate::numbers::ScalarOver)) is written once for [`Lagrangian::value`] and
/// [`value_at`](Self::value_at).
///
/// ```
/// use contact_geom::{nalgebra::SVector, Lagrangian, Parametric, Scalar, numbers::{Coefficient, ScalarOver}};
/// #[derive(Clone)]
/// struct Spring { k: f64, gamma: f64 }
/// impl Spring {
///     #[inline(always)]
///     fn formula<C: Coefficient, T: ScalarOver<C>>([k, gamma]: [C; 2], q: T, v: T, z: T) -> T {
///         v * v * 0.5 - q * q * (k * 0.5) + z * gamma
///     }
/// }
/// impl Lagrangian<1> for Spring {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
///         Self::formula([self.k, self.gamma], q[0], v[0], z)
///     }
/// }
/// impl Parametric<1> for Spring {
///     fn parameter_names(&self) -> Vec<String> {
///         ["k", "gamma"].map(String::from).into()
///     }
///     fn parameters(&self) -> Vec<f64> {
///         vec![self.k, self.gamma]
///     }
///     fn parameter_count(&self) -> usize {
///         2
///     }
///     fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
///         let [k, gamma] = *theta else { return None };
///         Some(Spring { k, gamma })
///     }
///     #[inline(always)]
///     fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
///         Self::formula([theta[0], theta[1]], q[0], v[0], z)
///     }
/// }
/// let spring = Spring { k: 2.0, gamma: -0.1 };
/// assert_eq!(spring.value_at(&[4.0, 0.0], 0.0, &[1.0].into(), &[0.0].into(), 0.0), -2.0);
/// assert_eq!(spring.parameter_index("gama").unwrap_err().nearest.as_deref(), Some("gamma"));
/// ```
pub trait Parametric<const N: usize>: Lagrangian<N> {
    /// The names of the parameters, without repetition; by default there are none.
    fn parameter_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Their number.
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        0
    }

    /// The same Lagrangian with other values of the parameters; `None` where their number is wrong, and by default.
    fn with_parameters(&self, _theta: &[f64]) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// The value `L(t, q, v, z; theta)`, for as many values as there are names.
    #[inline(always)]
    fn value_at<T: Scalar>(&self, _theta: &[T], t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.value(t, q, v, z)
    }

    /// The [applied force](Lagrangian::applied_force) `f(t, q, v, z; theta)`. By default the force does not depend on
    /// the parameters.
    #[inline(always)]
    fn force_at<T: Scalar>(&self, _theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        self.applied_force(t, x)
    }

    /// The contact Hamiltonian `H(t, q, p, z; theta)` by which this Lagrangian is given; see
    /// [`Hints::hamiltonian`](crate::Hints::hamiltonian). `None`, the default, where it is not given by one.
    #[inline(always)]
    fn hamiltonian_at<T: Scalar>(&self, _theta: &[T], _t: T, _x: &PhasePoint<N, T>) -> Option<T> {
        None
    }

    /// The [switching function](Lagrangian::switching_functions) with this index, for any values of the parameters.
    /// `None`, the default, where it is not written over scalars: it is then differentiated by differences, to about ten
    /// digits.
    fn switching_function_at<T: Scalar>(
        &self,
        _theta: &[T],
        _index: usize,
        _t: T,
        _x: &VelocityPoint<N, T>,
    ) -> Option<T> {
        None
    }

    /// The state with which the state is replaced at a zero of the switching function with this index
    /// ([`at_switch`](Lagrangian::at_switch)), for any values of the parameters. `None`, the default, where it is not
    /// written over scalars: it is then differentiated by differences, to about ten digits.
    fn state_after_switch_at<T: Scalar>(
        &self,
        _theta: &[T],
        _index: usize,
        _t: T,
        _x: &VelocityPoint<N, T>,
    ) -> Option<VelocityPoint<N, T>> {
        None
    }

    /// The [times of kinks and jumps](Lagrangian::breaks) with their derivatives in the parameter with this index. A time
    /// at which there are several kinks or jumps that move differently occurs once for each of their rates. `None`, the
    /// default: the derivatives are found by differences of the times for nearby parameters, to about ten digits.
    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        let _ = parameter;
        None
    }

    /// The index of a parameter.
    ///
    /// # Errors
    /// [`UnknownParameter`] if there is none of this name.
    fn parameter_index(&self, name: &str) -> Result<usize, UnknownParameter> {
        let names = self.parameter_names();
        names.iter().position(|known| known == name).ok_or_else(|| UnknownParameter::new(name, names))
    }
}

/// A name that is not that of a parameter.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there is no parameter `{name}`{}", self.remedy())]
pub struct UnknownParameter {
    /// The name.
    pub name: String,
    /// The nearest name of a parameter, if it is close enough to be intended.
    pub nearest: Option<String>,
    /// The names of all parameters.
    pub known: Vec<String>,
}

impl UnknownParameter {
    /// The error of a name that is not among these.
    pub fn new(name: &str, known: Vec<String>) -> Self {
        let nearest = nearest_name(name, known.iter().map(String::as_str)).map(str::to_owned);
        UnknownParameter { name: name.to_owned(), nearest, known }
    }
}

impl UnknownParameter {
    fn remedy(&self) -> String {
        match (&self.nearest, self.known.as_slice()) {
            (Some(nearest), _) => format!("; did you mean `{nearest}`?"),
            (None, []) => "; the Lagrangian has no parameters".to_owned(),
            (None, known) => format!("; the parameters are {}", known.join(", ")),
        }
    }
}

/// A force with named parameters; see [`Parametric`]. All methods have defaults for a force without parameters.
pub trait ParametricForce<const N: usize>: Force<N> {
    /// The names of the parameters, without repetition.
    fn parameter_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Their number.
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        0
    }

    /// The same force with other values of the parameters; `None` where their number is wrong, and by default.
    fn with_parameters(&self, _theta: &[f64]) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// The force `f(t, q, v, z; theta)`, for as many values as there are names.
    #[inline(always)]
    fn value_at<T: Scalar>(&self, _theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        self.value(t, x)
    }
}

/// `linear[i]` and `quadratic`.
impl<const N: usize> ParametricForce<N> for VelocityDrag<N> {
    fn parameter_names(&self) -> Vec<String> {
        indexed_names("linear", N).chain(["quadratic".to_owned()]).collect()
    }
    fn parameters(&self) -> Vec<f64> {
        self.linear.iter().copied().chain([self.quadratic]).collect()
    }
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        N + 1
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let (quadratic, linear) = theta.split_last()?;
        (linear.len() == N).then(|| VelocityDrag { linear: SVector::from_fn(|i, _| linear[i]), quadratic: *quadratic })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        // The differential of the root at rest is that along a direction of constant sign.
        let speed = dot(x.v, x.v).sqrt() * theta[N];
        SVector::from_fn(|i, _| -(x.v[i] * (speed + theta[i])))
    }
}

/// The parameters of the Lagrangian, then those of the force; a name of the force that the Lagrangian has too is
/// preceded by `force.`.
impl<const N: usize, L: Parametric<N>, F: ParametricForce<N>> Parametric<N> for Forced<L, F> {
    fn parameter_names(&self) -> Vec<String> {
        let mut names = self.lagrangian.parameter_names();
        for name in self.force.parameter_names() {
            let name = if names.contains(&name) { format!("force.{name}") } else { name };
            names.push(name);
        }
        names
    }
    fn parameters(&self) -> Vec<f64> {
        self.lagrangian.parameters().into_iter().chain(self.force.parameters()).collect()
    }
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        self.lagrangian.parameter_count() + self.force.parameter_count()
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let (own, of_force) = theta.split_at_checked(self.lagrangian.parameter_count())?;
        Some(Forced { lagrangian: self.lagrangian.with_parameters(own)?, force: self.force.with_parameters(of_force)? })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.lagrangian.value_at(&theta[..self.lagrangian.parameter_count()], t, q, v, z)
    }
    #[inline(always)]
    fn force_at<T: Scalar>(&self, theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let (own, of_force) = theta.split_at(self.lagrangian.parameter_count());
        let force = self.force.value_at(of_force, t, x);
        if const { L::HINTS.forced } {
            return force + self.lagrangian.force_at(own, t, x);
        }
        force
    }
    #[inline(always)]
    fn hamiltonian_at<T: Scalar>(&self, theta: &[T], t: T, x: &PhasePoint<N, T>) -> Option<T> {
        self.lagrangian.hamiltonian_at(&theta[..self.lagrangian.parameter_count()], t, x)
    }
    /// Those of the Lagrangian; they do not depend on the parameters of the force.
    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        if parameter < self.lagrangian.parameter_count() {
            return self.lagrangian.break_rates(parameter);
        }
        let times = self.lagrangian.breaks();
        Some(times.iter().map(|time| BreakRate { time: *time, rate: 0.0 }).collect())
    }
    fn switching_function_at<T: Scalar>(&self, theta: &[T], index: usize, t: T, x: &VelocityPoint<N, T>) -> Option<T> {
        self.lagrangian.switching_function_at(&theta[..self.lagrangian.parameter_count()], index, t, x)
    }
    fn state_after_switch_at<T: Scalar>(
        &self,
        theta: &[T],
        index: usize,
        t: T,
        x: &VelocityPoint<N, T>,
    ) -> Option<VelocityPoint<N, T>> {
        self.lagrangian.state_after_switch_at(&theta[..self.lagrangian.parameter_count()], index, t, x)
    }
}

/// The names `name[0]`, `name[1]`, ... of the entries of an array.
pub fn indexed_names(name: &str, length: usize) -> impl Iterator<Item = String> {
    (0..length).map(move |i| format!("{name}[{i}]"))
}
