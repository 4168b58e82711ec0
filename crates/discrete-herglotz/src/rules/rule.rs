//! The table of quadrature rules.

use crate::InputError;
use crate::rules::{Node, Quadrature};
use contact_geom::Lagrangian;

/// A quadrature rule for the action of one step: a line of the table, or a rule of a user's own.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use discrete_herglotz::rules::{Node, Rule};
/// /// Simpson's rule; of order 2, since the velocity of a step is constant.
/// const SIMPSON: Rule = Rule {
///     name: "simpson",
///     order: 2,
///     nodes: &[
///         Node { weight: 1.0 / 6.0, place: 0.0, action: 0.0 },
///         Node { weight: 2.0 / 3.0, place: 0.5, action: 0.5 },
///         Node { weight: 1.0 / 6.0, place: 1.0, action: 1.0 },
///     ],
/// };
/// assert!(SIMPSON.is_symmetric());
/// let ld = SIMPSON.of::<1, _>(Pendulum { gamma: -0.1 }, 0.1)?;
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// The name in tables, in lower case with underscores.
    pub name: &'static str,
    /// The order of the flow.
    pub order: u32,
    /// The nodes.
    pub nodes: &'static [Node],
}

impl Rule {
    /// The rectangle rule, of order 1 and explicit in z: `L_d = h L(t, q0, (q1 - q0)/h, z0)` with
    /// `sigma_d = 1 + h L_z`.
    ///
    /// For the free particle it is the discrete Lagrangian of the first example of the paper,
    /// `(q1 - q0)^2/(2h) + h gamma z0`.
    pub const RECTANGLE: Rule =
        Rule { name: "rectangle", order: 1, nodes: &[Node { weight: 1.0, place: 0.0, action: 0.0 }] };

    /// The midpoint rule of the paper (section 5), of order 1 and explicit in z:
    /// `L_d = h L(t + h/2, (q0 + q1)/2, (q1 - q0)/h, z0)` with `sigma_d = 1 + h L_z`.
    ///
    /// It is symmetric in q but takes z at the left end, which reduces the order to 1: for a linear drag its conformal
    /// factor is `1 + h gamma` instead of `e^(gamma h)`.
    pub const LEFT_MIDPOINT: Rule =
        Rule { name: "left_midpoint", order: 1, nodes: &[Node { weight: 1.0, place: 0.5, action: 0.0 }] };

    /// The symmetric midpoint rule, of order 2 and implicit in z:
    /// `z1 = z0 + h L(t + h/2, (q0 + q1)/2, (q1 - q0)/h, (z0 + z1)/2)` with
    /// `sigma_d = (1 + h L_z/2)/(1 - h L_z/2)`.
    ///
    /// It is the midpoint rule of Vermeeren, Bravetti and Seri on `Q x Q x R^2`, solved for `z1`.
    pub const MIDPOINT: Rule =
        Rule { name: "midpoint", order: 2, nodes: &[Node { weight: 1.0, place: 0.5, action: 0.5 }] };

    /// The symmetric trapezoidal rule, of order 2 and implicit in z, with `u = (q1 - q0)/h`:
    /// `z1 = z0 + h/2 L(t, q0, u, z0) + h/2 L(t + h, q1, u, z1)` and
    /// `sigma_d = (1 + h L_z(t, q0, u, z0)/2)/(1 - h L_z(t + h, q1, u, z1)/2)`.
    ///
    /// For `v^2/2 - V(q) + gamma z` it is the contact version of the Stoermer-Verlet method.
    pub const TRAPEZOIDAL: Rule = Rule {
        name: "trapezoidal",
        order: 2,
        nodes: &[Node { weight: 0.5, place: 0.0, action: 0.0 }, Node { weight: 0.5, place: 1.0, action: 1.0 }],
    };

    /// The table of the rules.
    pub const ALL: [Rule; 4] = [Rule::RECTANGLE, Rule::LEFT_MIDPOINT, Rule::MIDPOINT, Rule::TRAPEZOIDAL];

    /// Whether the rule is symmetric (equal to its adjoint): its nodes are invariant under reflection in time.
    pub fn is_symmetric(&self) -> bool {
        self.nodes.iter().all(|node| self.nodes.contains(&node.reflected()))
    }

    /// Whether, for L that depends on z, the action at the end of a step is defined implicitly; otherwise it is an
    /// explicit function of `(q0, q1, z0)`.
    pub fn is_implicit_in_z(&self) -> bool {
        self.nodes.iter().any(|node| node.action != 0.0)
    }

    /// The discrete Lagrangian of the rule for a Lagrangian, or a reference to one, with the time step `h`.
    ///
    /// # Errors
    /// [`InputError::Step`] unless `h` is finite and not 0 (it is negative for steps backward in time),
    /// [`InputError::Dimension`] if `N = 0`.
    pub fn of<const N: usize, L: Lagrangian<N>>(self, lagrangian: L, h: f64) -> Result<Quadrature<L>, InputError> {
        Quadrature::new(self, lagrangian, h)
    }
}
