//! Lagrangians and contact Hamiltonians that are given as text, for all integrators.
//!
//! A formula is parsed into an expression graph, on which its first and second derivatives are computed symbolically.
//! Both are compiled to straight-line register code, which is evaluated on floating-point numbers, dual numbers and the
//! vector lanes of the integrators alike. The structure of L (separable, affine in z, ...) is proved from the graph, so
//! that integrators do not probe it. In units of the time for the Rust type of the same Lagrangian, a run takes 1.3 to
//! 1.6 with a splitting, and 0.7 to 2.2 with Gauss collocation.
//!
//! ```
//! use contact_geom::VelocityPoint;
//! use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
//! use formula_lagrangian::Formula;
//!
//! let formula = Formula::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)])?;
//! let pendulum = formula.lagrangian::<1>()?;
//! let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
//! let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.5));
//! println!("{}", run.plan(Until::Time(50.0))?); // checks of the structure: the structure is proved from the formula of L
//! println!("theta = {}", run.run(Until::Time(50.0))?.q[0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The language
//!
//! | Written | Meaning |
//! |---|---|
//! | `x`, `x'` | a coordinate by its name, and its velocity |
//! | `q[0]`, `v[0]` | the coordinate with the index 0 and its velocity, whatever its name; indices start from 0 |
//! | `u[i]`, `u'[i]` | entries of an array, given as the coordinate `"u[3]"` |
//! | `p_x`, `p[0]` | in a [Hamiltonian](#hamiltonians), the momentum of a coordinate, in place of its velocity |
//! | `z`, `t`, `pi`, `n` | the action, or its [name](FormulaNames::action), the time, 3.14159..., the number of coordinates |
//! | `r = sqrt(x^2 + y^2)` | a definition, on its own line or followed by `;`. The last line is the value L, with or without `L =`; the value of an output column may have any name |
//! | `force[x] = -c*x'` | a line before L: the force on a coordinate, by its name or its index: `force[u[2]]`, `force[q[0]]`, `force[0]` |
//! | `force[u[i]] = -c*u'[i]` | the forces on all entries of an array, if `i` has no other meaning; also `force[q[i]]` for all coordinates |
//! | `rayleigh = c/2*x'^2` | a line before L: Rayleigh's dissipation function R, whose force `-dR/dv` is added |
//! | `drive(t)` | a table that is given by name, at any argument |
//! | `+ - * /`, `^` or `**` | powers have the highest precedence and are right-associative: `-x^2` is `-(x^2)`, `2^3^2` is `2^9` |
//! | `sum(i, 1, n-1, (q[i] - q[i-1])^2)` | the sum over i from 1 to n - 1; an empty sum is 0 |
//! | `if(a < b, c, d)` | c if a < b, else d; also with `>` |
//! | `sqrt exp expm1 ln log log1p ln1p recip` | roots, exponentials, natural logarithms, `1/x` |
//! | `sin cos tan asin acos atan versine sinh cosh tanh asinh acosh atanh` | `versine` is `1 - cos`, without cancellation |
//! | `atan2(y, x)`, `hypot(x, y)`, `pow(x, a)` | functions of two numbers |
//! | `abs sign`, `min(a, b, ...)`, `max(a, b, ...)` | with kinks or jumps, as `if`, `atan2` and `hypot` |
//! | `# ...` | a comment |
//!
//! In expressions that belong to a Lagrangian, such as output columns and resets, energy and momenta have names as well;
//! see [`Expression`].
//!
//! A line continues after an operator and within brackets. The names `n`, `q`, `v` and `pi` may also be given to
//! coordinates and parameters, which then take precedence.
//!
//! `x^a` is a product for an integer a, a power of the square root for half of an odd integer, and `e^(a ln x)` if a
//! depends on the state. `0*x` is 0, even if x is infinite. This and the collection of powers of two are the only
//! rearrangements; [`Graph`] gives the exact rules.
//!
//! # Hamiltonians
//!
//! [`Formula::parse_hamiltonian`] parses a contact Hamiltonian `H(t, q, p, z)`, with `q' = H_p`, `p' = -H_q - p H_z`,
//! `z' = p . H_p - H`. The momentum of `x` is `p_x`, or has a [name of its own](FormulaNames::momenta). The last line is
//! the value H, with or without `H =`. There are no velocities, forces, breaks and resets, and kinks and jumps are not
//! located. In the expressions that belong to it `x'` is `H_p`, and `energy` is H. [`FormulaHamiltonian`] is evaluated by
//! the same code as [`FormulaLagrangian`].
//!
//! ```
//! use contact_geom::{OfHamiltonian, PhasePoint};
//! use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
//! use formula_lagrangian::{Formula, FormulaNames};
//! let h = Formula::parse_hamiltonian("-p_x*x^3 + k*z", &FormulaNames::new(&["x"], &[("k", 0.5)]))?;
//! let h = OfHamiltonian(h.hamiltonian::<1>()?);
//! let problem = Problem::of_hamiltonian(&h, 0.0, PhasePoint::new([1.0], [2.0], 0.0))?;
//! let outcome = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.1)).run(Until::Time(1.0))?;
//! assert!((outcome.q[0] - 1.0 / 3.0_f64.sqrt()).abs() < 1e-14); // x' = -x^3
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Forces
//!
//! The equations of motion are `d/dt L_v - L_q - L_z L_v = f(t, q, v, z)`, `zdot = L`. The forces f are lines of the
//! text, or are given by a program: [`Formula::with_force`], [`Formula::with_rayleigh`], [`Formula::with_force_nodes`].
//! Coordinates without a force have the force 0. The lines are read in order, so that forces and L share the
//! definitions before them. Where a coordinate, a parameter or a definition is named `force`, `force[...]` is an entry
//! of that.
//!
//! ```
//! use contact_geom::{ForceStructure, Lagrangian};
//! use formula_lagrangian::Formula;
//! let text = "
//!     speed = sqrt(x'^2 + y'^2)
//!     force[x] = -c*speed*x'
//!     force[y] = -c*speed*y' + sin(t)
//!     L = speed^2/2 - 9.81*y";
//! let thrown = Formula::parse(text, &["x", "y"], &[("c", 0.1)])?.lagrangian::<2>()?;
//! assert!(matches!(thrown.force_structure(), ForceStructure::Drag { quadratic: 0.1, .. }));
//! # Ok::<(), formula_lagrangian::FormulaError>(())
//! ```
//!
//! # Kinks and jumps
//!
//! [`FormulaLagrangian::is_smooth`] returns whether there are any, in L and in the forces. No structure is claimed in
//! coordinates on which a kink or a jump depends. The derivative of a jump is taken to be 0.
//!
//! Kinks and jumps at zeros of affine functions of time, as `if(t > t1, a, b)`, are at known times, which are
//! [breaks](contact_geom::Lagrangian::breaks); so are the samples of a table at an argument like `t` or `2*t - t1`
//! ([`Formula::parse_with_tables`]) and the times of [`Formula::with_breaks`]. All others are at the zeros of
//! [switching functions](contact_geom::Lagrangian::switching_functions): the arguments of `abs` and `sign`, the
//! differences whose sign decides `min`, `max` and `if`, and for a table at another argument its distance from each
//! sample. [`Formula::with_reset`] adds functions at whose zeros the state is replaced.
//!
//! # Constraints
//!
//! [`Formula::with_constraints`] adds holonomic constraints `c(q) = 0`: equations such as `x^2 + y^2 = l^2`, or
//! expressions that vanish. They are smooth functions of the coordinates and parameters, without velocities, t and the
//! action, and there are fewer of them than coordinates. [`FormulaLagrangian`] is then also a
//! [`Constraint`](contact_geom::constraints::Constraint) for the integrators of constrained motions.
//!
//! ```
//! use contact_geom::VelocityPoint;
//! use discrete_herglotz::constraints::{Constrained, ConstrainedMethod};
//! use discrete_herglotz::{Problem, SplittingScheme, Steps, Until};
//! use formula_lagrangian::Formula;
//! let free = Formula::parse("(x'^2 + y'^2)/2 - 9.81*y", &["x", "y"], &[])?;
//! let l = free.with_constraints(&["x^2 + y^2 = 1"])?.lagrangian::<2>()?;
//! let problem = Problem::new(&l, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0))?;
//! let rattle = Constrained::<_, 2>::new(&l, ConstrainedMethod::Rattle(SplittingScheme::KAHAN_LI_8));
//! let outcome = problem.by(rattle).steps(Steps::Count(100)).run(Until::Time(1.0))?;
//! assert!((outcome.q.norm() - 1.0).abs() < 1e-15);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Bounds
//!
//! A text has at most [`LONGEST_TEXT`] bytes, a nesting depth of at most [`DEEPEST_NESTING`], and at most
//! [`MOST_NODES`] nodes. There are at most [`MOST_COORDINATES`] coordinates. Steps do not allocate if a formula needs
//! at most 256 registers, including its `2 n + 2` inputs.

mod breaks;
mod composition;
mod cones;
mod constraints;
mod contact;
mod degrees;
mod derivatives;
mod derived;
mod derived_reset;
mod drag;
mod error;
mod evaluation;
mod explicit;
mod expression;
mod expression_gradient;
mod forces;
mod formula;
mod formula_derivatives;
mod formula_forces;
mod formula_resets;
mod formula_texts;
mod friction;
mod functions;
mod graph;
mod hamiltonian;
mod hints;
mod impacts;
mod lagrangian;
mod limits;
mod modes;
mod names;
mod node;
mod parametric;
mod parametric_nodes;
mod parser;
mod quantities;
mod resets;
mod rotation;
mod structure;
mod substitution;
mod symbol;
mod symmetry;
mod tables;
mod tape;
mod token;
mod translation;

pub use composition::Inputs;
pub use contact_geom::support::nearest_name;
pub use error::{FormulaError, MOST_COORDINATES, ParseError};
pub use expression::Expression;
pub use expression_gradient::ExpressionGradient;
pub use formula::Formula;
pub use formula_derivatives::FormulaDerivatives;
pub use friction::Friction;
pub use graph::Graph;
pub use hamiltonian::FormulaHamiltonian;
pub use lagrangian::FormulaLagrangian;
pub use limits::{DEEPEST_NESTING, LONGEST_TEXT, MOST_NODES};
pub use names::FormulaNames;
pub use node::{Function, Id, Node, Operation};
pub use resets::{Direction, Reset, ResetNodes, Variable};
pub use substitution::substitute;
pub use symbol::{Operand, Symbol, Symbols};
pub use symmetry::FormulaSymmetry;
