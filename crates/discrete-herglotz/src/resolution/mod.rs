//! Whether a step resolves the motion.
//!
//! A step of given size has an error that its method does not report: a step that is longer than a period of the
//! motion, or that passes a jump of the force, ends in a state that looks like any other. The following measures detect
//! such steps. Each compares a defect with a threshold of [`thresholds`]; a defect above one, in units of its
//! threshold, flags the step as unresolved.
//!
//! Steps of a given size:
//!
//! | Measure | Taken of | Reason |
//! |---|---|---|
//! | Two second differences of the velocity with opposite directions, [`monitor`] | every step of a discrete Lagrangian and of Gauss collocation with one or two stages, every substep of a composition, every drift of a splitting that was requested to check | An oscillation that is not resolved alternates; it needs only velocities, which every method has |
//! | A single large second difference, [`monitor`] | the same steps, and those of Gauss collocation with more stages in a run | A jump of the force causes one as well, but so does a smooth force: the interval is suspect, and the next two measures decide |
//! | Half steps, `run/checks/half_steps.rs` | suspect intervals; for methods other than Gauss collocation with at least three stages, also every step whose number is a power of two, and the last | The difference is the error of the step itself, and the measure needs no property of the method; it costs two steps |
//! | Acceleration jump, `run/checks/acceleration_jump.rs` | suspect intervals, except for Gauss collocation with at least three stages | Half steps that begin on the same side of a jump agree with the step |
//! | Tail of the stage polynomials, `gauss/resolution/tail.rs` | every step of Gauss collocation with at least three stages whose predictor was poor | If a polynomial of their degree approximates the motion, the Legendre coefficients of the stages decrease geometrically |
//! | Defect sample, `gauss/resolution/defect_sample.rs` | the last step of Gauss collocation in a run, every step of a trial run, every part of a divided step | Between the nodes the collocation polynomial does not satisfy the equations by construction; it costs as many evaluations as a step |
//! | Error of the conformal factor, [`monitor::factor_defect`], `gauss/resolution/tail.rs` | quadrature rules, Gauss collocation | Drag within a step need not show in the velocities; splittings have the exact factor |
//! | Energy drift, `run/checks/energy_drift.rs` | runs of autonomous systems, if the action and the conformal factor are known | Steps that each pass the other measures may still gain energy in the long run |
//! | Claims, `run/checks/claims.rs` | runs of a Lagrangian whose claims are not proved | Steps that rely on a false claim solve other equations, which all measures above take for right |
//! | Rest, `run/checks/rest.rs` | all runs | The motion has decayed until products of its numbers underflow, so that defects relative to it are undefined |
//!
//! Members of an ensemble in SIMD lanes are checked by one bound on the second differences of the velocity, or on the
//! tail of the stage polynomials (`ensemble/splitting.rs`, `ensemble/gauss/step.rs`), and by the energies of their
//! ends; a member that exceeds a bound is suspect, and has a run of its own with all measures. Paths of a
//! boundary-value problem are checked by the second differences of their velocities and by the effect of the truncation
//! error (`boundary/path_check.rs`).
//!
//! For a requested accuracy the steps are not given but found: trial runs with k, 2k and k + 1 steps must agree, and
//! every step of them is sampled for its defect (`run/accuracy`). Their result is an error, so that the final run
//! repeats only the checks of claims and rest, and those that collocation steps include.

pub(crate) mod monitor;
pub(crate) mod thresholds;
