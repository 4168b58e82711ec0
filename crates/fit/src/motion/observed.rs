//! Observed quantities of a motion.

use discrete_herglotz::sensitivity::{EndCovector, Loss, MotionState, StateDerivative};

/// A quantity of a motion that was measured.
pub enum Observed<'a, const N: usize> {
    /// A coordinate.
    Position(usize),
    /// A velocity.
    Velocity(usize),
    /// A momentum.
    Momentum(usize),
    /// The action.
    Action,
    /// Any function of the state; see [`Observed::function`].
    Function(Box<dyn Observable<N> + Send + Sync + 'a>),
}

impl<'a, const N: usize> Observed<'a, N> {
    /// A function of the state, written as a loss of the end of a run: once, generic in the scalar.
    ///
    /// ```
    /// use contact_geom::Scalar;
    /// use discrete_herglotz::sensitivity::{EndState, Loss};
    /// struct Height { length: f64 }
    /// impl Loss<1> for Height {
    ///     fn value<T: Scalar>(&self, state: &EndState<1, T>) -> T {
    ///         state.q[0].cos() * -self.length
    ///     }
    /// }
    /// let observed = herglotz_fit::Observed::function(Height { length: 0.3 });
    /// # let _ = observed;
    /// ```
    pub fn function(f: impl Loss<N> + Send + Sync + 'a) -> Self {
        Observed::Function(Box::new(f))
    }

    /// The coordinate that it has an index of.
    pub(crate) fn index(&self) -> Option<usize> {
        match self {
            Observed::Position(i) | Observed::Velocity(i) | Observed::Momentum(i) => Some(*i),
            Observed::Action | Observed::Function(_) => None,
        }
    }

    /// The value at a state, and its derivatives along tangents of the state.
    pub(crate) fn at(&self, state: &MotionState, columns: &[StateDerivative], out: &mut Vec<f64>) -> f64 {
        out.clear();
        match self {
            Observed::Position(i) => {
                out.extend(columns.iter().map(|c| c.q[*i]));
                state.q[*i]
            }
            Observed::Velocity(i) => {
                out.extend(columns.iter().map(|c| c.v[*i]));
                state.v[*i]
            }
            Observed::Momentum(i) => {
                out.extend(columns.iter().map(|c| c.p[*i]));
                state.p[*i]
            }
            Observed::Action => {
                out.extend(columns.iter().map(|c| c.z));
                state.z
            }
            Observed::Function(f) => {
                let (value, d) = f.differentiate(state);
                out.extend(columns.iter().map(|c| c.dot(&d)));
                value
            }
        }
    }
}

/// A function of the state of a motion with its partial derivatives. Every [`Loss`] is one.
pub trait Observable<const N: usize> {
    /// The value and its partial derivatives.
    fn differentiate(&self, state: &MotionState) -> (f64, EndCovector);
}

impl<T: Loss<N>, const N: usize> Observable<N> for T {
    fn differentiate(&self, state: &MotionState) -> (f64, EndCovector) {
        state.differentiate(self)
    }
}
