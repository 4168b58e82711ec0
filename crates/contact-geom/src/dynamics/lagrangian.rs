//! Lagrangians L(t, q, v, z).

use crate::switching::Control;
use crate::{
    ChartVector, Defect, ForceStructure, Hessian, PhasePoint, Scalar, SlicesVisitor, Structure, VelocityPoint, vector,
};
use nalgebra::{SMatrix, SVector};

/// What integrators may rely on at compile time about a Lagrangian: code for what is `false` here is not compiled.
///
/// ```
/// use contact_geom::Hints;
/// const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };
/// assert!(HINTS.switching_functions && !HINTS.time_transformation);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hints {
    /// Whether it has a time transformation: [`Lagrangian::dt_dtau`] is overridden.
    pub time_transformation: bool,
    /// Whether it has [switching functions](Lagrangian::switching_functions).
    pub switching_functions: bool,
    /// Whether the [structure](Lagrangian::structure) and all closed derivatives are provided and derived from the formula of L, as by the
    /// crate `formula-lagrangian`. They are then not checked numerically, and automatic differentiation is not compiled.
    pub proved: bool,
    /// Whether an evaluation has a large fixed cost, so that batches of evaluations are preferred.
    pub interpreted: bool,
    /// Whether there may be an [applied force](Lagrangian::applied_force), as in [`Forced`](crate::Forced).
    pub forced: bool,
    /// Whether it is given by a contact Hamiltonian, as [`OfHamiltonian`](crate::OfHamiltonian): its motions are computed
    /// from the Hamiltonian and the momenta, and `W = L_vv` need not exist.
    pub hamiltonian: bool,
    /// Whether it is written over slices: [`Lagrangian::over_slices`] is overridden.
    pub over_slices: bool,
    /// Whether states may be replaced: [`Lagrangian::at_switch`] is overridden. One that is given by a contact Hamiltonian
    /// is then refused.
    pub resets: bool,
}

impl Hints {
    /// Nothing to rely on.
    pub const NONE: Hints = Hints {
        time_transformation: false,
        switching_functions: false,
        proved: false,
        interpreted: false,
        forced: false,
        hamiltonian: false,
        over_slices: false,
        resets: false,
    };

    /// What may be relied on for a Lagrangian that is one of several, as in [`lagrangian_enum`](crate::lagrangian_enum).
    ///
    /// ```
    /// use contact_geom::Hints;
    /// let switching = Hints { switching_functions: true, proved: true, ..Hints::NONE };
    /// assert_eq!(Hints::of_any(&[switching, Hints::NONE]), Hints { proved: false, ..switching });
    /// assert_eq!(Hints::of_any(&[switching, switching]), switching);
    /// ```
    ///
    /// # Panics
    /// Where one of them is given by a contact Hamiltonian; at compile time in constants.
    pub const fn of_any(several: &[Hints]) -> Hints {
        let mut any = Hints { proved: !several.is_empty(), ..Hints::NONE };
        let mut i = 0;
        while i < several.len() {
            let Hints {
                time_transformation,
                switching_functions,
                proved,
                interpreted,
                forced,
                hamiltonian,
                resets,
                ..
            } = several[i];
            assert!(!hamiltonian, "a Lagrangian that is given by a contact Hamiltonian needs a type of its own");
            any.time_transformation |= time_transformation;
            any.switching_functions |= switching_functions;
            any.proved &= proved;
            any.interpreted |= interpreted;
            any.forced |= forced;
            any.resets |= resets;
            i += 1;
        }
        any
    }
}

/// A Lagrangian of Herglotz' variational principle, `L : R x TQ x R -> R`, written once as a generic function.
///
/// An implementation needs [`value`](Self::value); [`structure`](Self::structure) makes its motions faster to compute.
/// All else is optional: closed derivatives (`closed_*`), switching functions, a time transformation.
///
/// The motion makes the final value of the action critical, where `zdot = L(t, q, qdot, z)`. With the usual sign
/// convention a dissipative term is `gamma z` with `gamma < 0`. All derivatives are obtained by evaluating `value` on
/// dual numbers. A Lagrangian with closed forms may override [`closed_gradient`](Self::closed_gradient), which saves
/// vector fields, forms and steps one level of differentiation, or [`closed_hessian`](Self::closed_hessian), which is
/// used for W, forms and second jets. [`check_closed_derivatives`](crate::check_closed_derivatives) compares such
/// closed forms with automatic differentiation.
///
/// Annotate `value`, and the functions that it calls, with `#[inline(always)]`: integrators evaluate several stages at
/// once in a SIMD register, and a function that is not inlined into their kernels is ten times slower.
///
/// ```
/// use contact_geom::{nalgebra::SVector, Derivatives, Lagrangian, Scalar, VelocityPoint};
/// struct Damped;
/// impl Lagrangian<1> for Damped {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
///         v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 - z * 0.1
///     }
/// }
/// let x = VelocityPoint::new([1.0], [2.0], 0.0);
/// assert_eq!(Damped.gradient(0.0, &x).y[0], 2.0); // L_v
/// ```
pub trait Lagrangian<const N: usize> {
    /// What integrators may rely on at compile time; see [`Hints`]. By default nothing.
    const HINTS: Hints = Hints::NONE;

    /// The value `L(t, q, v, z)`.
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T;

    /// The declared structure of this Lagrangian; see [`Structure`]. The default makes no claims.
    fn structure(&self) -> Structure {
        Structure::default()
    }

    /// The partial derivatives `(L_q, L_v, L_z)` in closed form; `None`, the default, where a closed form is not
    /// provided.
    fn closed_gradient<T: Scalar>(&self, _t: T, _x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        None
    }

    /// The second partial derivatives in closed form; `None`, the default, where a closed form is not provided.
    fn closed_hessian<T: Scalar>(&self, _t: T, _x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        None
    }

    /// The value with the gradient, in closed form. Override it where the two share work that the compiler cannot
    /// detect; the default evaluates each of them separately.
    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        self.closed_gradient(t, x).map(|gradient| (self.value(t, &x.q, &x.v, x.z), gradient))
    }

    /// `L_q` alone, in closed form. Override it where it is less work than the gradient and the compiler cannot detect
    /// that.
    #[inline(always)]
    fn closed_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SVector<T, N>> {
        self.closed_gradient(t, x).map(|gradient| gradient.x)
    }

    /// The value with `L_q`, in closed form. Override it where the two share work that the compiler cannot detect; the
    /// default evaluates each of them separately.
    #[inline(always)]
    fn closed_with_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, SVector<T, N>)> {
        self.closed_force(t, x).map(|force| (self.value(t, &x.q, &x.v, x.z), force))
    }

    /// `L_z` alone, in closed form. Override it where it is less work than the gradient and the compiler cannot detect
    /// that; splitting methods evaluate it at several times of each step where it depends on time.
    #[inline(always)]
    fn closed_rate<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<T> {
        self.closed_gradient(t, x).map(|gradient| gradient.z)
    }

    /// `W = L_vv` alone, in closed form. Override it where it is less work than all second derivatives and the compiler
    /// cannot detect that.
    #[inline(always)]
    fn closed_mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SMatrix<T, N, N>> {
        self.closed_hessian(t, x).map(|hessian| hessian.vv)
    }

    /// The force `f(t, q, v, z)` of the Lagrange-d'Alembert-Herglotz equations `d/dt L_v - L_q - L_z L_v = f`; see
    /// [`Force`](crate::Force) and [`Forced`](crate::Forced), which provides it and sets [`Hints::forced`]. By default
    /// there is none.
    #[inline(always)]
    fn applied_force<T: Scalar>(&self, _t: T, _x: &VelocityPoint<N, T>) -> SVector<T, N> {
        vector!(|_| T::zero())
    }

    /// What integrators may rely on about the applied force. Default: `General` if
    /// [`Hints::forced`] is set, otherwise `None`.
    fn force_structure(&self) -> ForceStructure<N> {
        if Self::HINTS.forced { ForceStructure::General } else { ForceStructure::None }
    }

    /// Whether there is an applied force.
    #[inline(always)]
    fn has_force(&self) -> bool {
        Self::HINTS.forced && self.force_structure() != ForceStructure::None
    }

    /// The switching functions `g_i(t, q, v, z)`, at whose zeros L has a kink or a jump: appends their values at a
    /// point, always in the same number and order. A run ends a step at each zero that its motion crosses, so that
    /// integrators keep their order; where L itself jumps across a surface in the positions, the motion is refracted or
    /// reflected according to the Weierstrass-Erdmann corner conditions (the momentum changes along the normal, the
    /// energy does not change). By default there are none: L is smooth.
    ///
    /// Set [`Hints::switching_functions`] as well. For example, a spring that only pushes,
    /// `q.if_less(0, q^2/2, 0)`, has the single switching function q.
    ///
    /// For a Lagrangian that is given by a contact Hamiltonian, they are functions of `(t, q, p, z)`, and the point has the
    /// momentum in the place of the velocity, which may jump where they are zero.
    fn switching_functions(&self, _t: f64, _x: &VelocityPoint<N>, _values: &mut Vec<f64>) {}

    /// What happens at a zero of the switching function with this index, at a point of the motion; `rising` is whether
    /// the function increases along the run. By default the motion [continues](Control::Continue).
    fn at_switch(&self, _index: usize, _t: f64, _x: &VelocityPoint<N>, _rising: bool) -> Control<N> {
        Control::Continue
    }

    /// What happens where replacements at the zero of this switching function accumulate: at the limit of their times,
    /// as for a ball that comes to rest by infinitely many impacts. By default the run ends there with a status that
    /// names the time; a [`Control::Replace`] continues it.
    fn at_accumulation(&self, _index: usize, _t: f64, _x: &VelocityPoint<N>) -> Control<N> {
        Control::Continue
    }

    /// The times at which L or the applied force has a kink or a jump in time, in ascending order: steps end there. Set
    /// [`Hints::switching_functions`] as well. By default there are none.
    fn breaks(&self) -> &[f64] {
        &[]
    }

    /// Whether L or the applied force contains a norm, or another root, that may vanish along the motion, as
    /// `sqrt(x^2 + y^2)` at the origin. Its derivative jumps there, at a point of the cone and not on a surface, so that
    /// it is no zero of a switching function: searches for an accuracy also examine the ends of steps. `false` by
    /// default.
    fn has_cones(&self) -> bool {
        false
    }

    /// The rate `g(q) = dt/dtau` of a time transformation, in whose time tau steps of equal length suit this motion, for
    /// autonomous Lagrangians. It must be positive and should decrease where the motion gets faster. Set
    /// [`Hints::time_transformation`] as well; by default tau is the time itself.
    ///
    /// It is the transformation of Poincaré and Levi-Civita: on T\*(Q x R) x R with coordinates `(q, t, p, p_t, z)` the
    /// contact Hamiltonian `K = g(q) (H(q, p, z) + p_t)` has, on the surface `K = 0`, the motion of H in the time tau,
    /// and the surface is invariant since `K' = -K R(K)` with the Reeb field R. A contact method of fixed step size for
    /// K is therefore a method of variable step size for H; see Hairer, "Variable time step integration with symplectic
    /// methods", Appl. Numer. Math. 25 (1997).
    #[inline(always)]
    fn dt_dtau<T: Scalar>(&self, _q: &SVector<T, N>) -> T {
        T::one()
    }

    /// The contact Hamiltonian at a state with its derivatives `(H_q, H_p, H_z)`, where this Lagrangian is given by one;
    /// see [`Hints::hamiltonian`]. By default it is not.
    #[inline(always)]
    fn hamiltonian_with_gradient<T: Scalar>(&self, _t: T, _x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        None
    }

    /// The second derivatives of that contact Hamiltonian, with p in the place of v.
    fn hamiltonian_hessian(&self, _t: f64, _x: &PhasePoint<N>) -> Option<Hessian<N>> {
        None
    }

    /// The first claim on that contact Hamiltonian that is false at a state.
    fn hamiltonian_defect(&self, _t: f64, _x: &PhasePoint<N>) -> Option<Defect> {
        None
    }

    /// Visits the same Lagrangian as a [`ScalarSystem`](crate::ScalarSystem), for which integrators are compiled once,
    /// whatever its number of coordinates; see [`Hints::over_slices`]. `None`, the default, for a Lagrangian that is not one.
    fn over_slices<V: SlicesVisitor>(&self, _visitor: V) -> Option<V::Output> {
        None
    }
}

/// A Lagrangian without its closed derivatives: all derivatives are found by automatic differentiation, to compare the
/// cost.
#[derive(Clone, Copy, Debug)]
pub struct WithoutClosedDerivatives<L>(pub L);

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for WithoutClosedDerivatives<L> {
    const HINTS: Hints =
        Hints { proved: false, interpreted: false, hamiltonian: false, over_slices: false, ..L::HINTS };

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    forward_lagrangian!(of_force, self => self.0);
    forward_lagrangian!(of_switches, self => self.0);
    fn structure(&self) -> Structure {
        self.0.structure()
    }
    #[inline(always)]
    fn dt_dtau<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        self.0.dt_dtau(q)
    }
}

/// Methods of [`Lagrangian`] that are those of another Lagrangian, given as an expression of `self`: `all` of them but
/// `HINTS`, or all but those on forces and switching functions (`of_value`).
macro_rules! forward_lagrangian {
    (all, $self:ident => $to:expr) => {
        $crate::dynamics::lagrangian::forward_lagrangian!(of_value, $self => $to);
        $crate::dynamics::lagrangian::forward_lagrangian!(of_force, $self => $to);
        $crate::dynamics::lagrangian::forward_lagrangian!(of_switches, $self => $to);
        fn structure(&$self) -> $crate::Structure {
            $to.structure()
        }
    };
    (of_value, $self:ident => $to:expr) => {
        #[inline(always)]
        fn value<T: $crate::Scalar>(&$self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
            $to.value(t, q, v, z)
        }
        #[inline(always)]
        fn closed_gradient<T: $crate::Scalar>(
            &$self,
            t: T,
            x: &$crate::VelocityPoint<N, T>,
        ) -> Option<$crate::ChartVector<N, T>> {
            $to.closed_gradient(t, x)
        }
        #[inline(always)]
        fn closed_hessian<T: $crate::Scalar>(
            &$self,
            t: T,
            x: &$crate::VelocityPoint<N, T>,
        ) -> Option<$crate::Hessian<N, T>> {
            $to.closed_hessian(t, x)
        }
        #[inline(always)]
        fn closed_with_gradient<T: $crate::Scalar>(
            &$self,
            t: T,
            x: &$crate::VelocityPoint<N, T>,
        ) -> Option<(T, $crate::ChartVector<N, T>)> {
            $to.closed_with_gradient(t, x)
        }
        #[inline(always)]
        fn closed_force<T: $crate::Scalar>(&$self, t: T, x: &$crate::VelocityPoint<N, T>) -> Option<SVector<T, N>> {
            $to.closed_force(t, x)
        }
        #[inline(always)]
        fn closed_with_force<T: $crate::Scalar>(
            &$self,
            t: T,
            x: &$crate::VelocityPoint<N, T>,
        ) -> Option<(T, SVector<T, N>)> {
            $to.closed_with_force(t, x)
        }
        #[inline(always)]
        fn closed_rate<T: $crate::Scalar>(&$self, t: T, x: &$crate::VelocityPoint<N, T>) -> Option<T> {
            $to.closed_rate(t, x)
        }
        #[inline(always)]
        fn closed_mass_matrix<T: $crate::Scalar>(
            &$self,
            t: T,
            x: &$crate::VelocityPoint<N, T>,
        ) -> Option<SMatrix<T, N, N>> {
            $to.closed_mass_matrix(t, x)
        }
        #[inline(always)]
        fn dt_dtau<T: $crate::Scalar>(&$self, q: &SVector<T, N>) -> T {
            $to.dt_dtau(q)
        }
        #[inline(always)]
        fn hamiltonian_with_gradient<T: $crate::Scalar>(
            &$self,
            t: T,
            x: &$crate::PhasePoint<N, T>,
        ) -> Option<(T, $crate::ChartVector<N, T>)> {
            $to.hamiltonian_with_gradient(t, x)
        }
        fn hamiltonian_hessian(&$self, t: f64, x: &$crate::PhasePoint<N>) -> Option<$crate::Hessian<N>> {
            $to.hamiltonian_hessian(t, x)
        }
        fn hamiltonian_defect(&$self, t: f64, x: &$crate::PhasePoint<N>) -> Option<$crate::Defect> {
            $to.hamiltonian_defect(t, x)
        }
    };
    (of_force, $self:ident => $to:expr) => {
        #[inline(always)]
        fn applied_force<T: $crate::Scalar>(&$self, t: T, x: &$crate::VelocityPoint<N, T>) -> SVector<T, N> {
            $to.applied_force(t, x)
        }
        fn force_structure(&$self) -> $crate::ForceStructure<N> {
            $to.force_structure()
        }
    };
    (of_switches, $self:ident => $to:expr) => {
        fn switching_functions(&$self, t: f64, x: &$crate::VelocityPoint<N>, values: &mut Vec<f64>) {
            $to.switching_functions(t, x, values);
        }
        fn at_switch(&$self, index: usize, t: f64, x: &$crate::VelocityPoint<N>, rising: bool) -> $crate::switching::Control<N> {
            $to.at_switch(index, t, x, rising)
        }
        fn at_accumulation(&$self, index: usize, t: f64, x: &$crate::VelocityPoint<N>) -> $crate::switching::Control<N> {
            $to.at_accumulation(index, t, x)
        }
        fn breaks(&$self) -> &[f64] {
            $to.breaks()
        }
        fn has_cones(&$self) -> bool {
            $to.has_cones()
        }
    };
}
pub(crate) use forward_lagrangian;

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for &L {
    const HINTS: Hints = L::HINTS;

    forward_lagrangian!(all, self => (**self));
    fn over_slices<V: SlicesVisitor>(&self, visitor: V) -> Option<V::Output> {
        (**self).over_slices(visitor)
    }
}
