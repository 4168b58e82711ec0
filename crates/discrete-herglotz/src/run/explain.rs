//! What a plan computes and skips, in words.

use super::plan::Engine;
use super::{Integrator, Plan};
use crate::{GaussRoute, Method};
use contact_geom::Lagrangian;
use std::fmt::{Display, Formatter};

/// One line of a plan: something that could be computed, whether it is, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// What it is about.
    pub what: &'static str,
    /// Whether it is computed.
    pub computed: bool,
    /// Why, or how.
    pub why: String,
}

impl<L: Lagrangian<N>, const N: usize> Plan<'_, L, N> {
    /// What is computed, and what is not.
    pub fn items(&self) -> Vec<Item> {
        let structure = self.problem.structure;
        let drag = structure.is_affine_in_z();
        let mut items = Vec::new();
        let mut say = |what, computed, why: &str| items.push(Item { what, computed, why: why.into() });
        match (&self.engine, &self.integrator) {
            (_, Integrator::Clocked { .. }) => {
                say(
                    "time step",
                    true,
                    "the clock's rate follows the motion: equal steps of its time, a shorter one at the end",
                );
                say("iteration", true, "velocities, actions, factors and rates of the stages, to round-off");
                let why =
                    if structure.constant_mass { "W is constant: inverted once" } else { "at the stages, once a step" };
                say("mass matrix", !structure.constant_mass, why);
                say("Jacobian", false, "the iteration needs gradients alone");
                say("Newton's method", false, "steps whose iteration does not contract are refused");
            }
            (Engine::Gauss(_), _) => {
                let route = self.route.unwrap_or(GaussRoute::General);
                match route {
                    GaussRoute::Linear => {
                        say("iteration", false, "L is quadratic: the step is one matrix, made once");
                        say("forces", false, "the matrix holds them");
                    }
                    GaussRoute::Condensed => {
                        say("iteration", true, "the accelerations of the stages alone, to round-off");
                        say("mass matrix", false, "W is constant: inverted once");
                        say("integrating factor", false, "gamma is constant: its stages are computed once");
                        say(
                            "Jacobian",
                            false,
                            "one factorisation for a linear force, renewed where the force's slope has changed",
                        );
                    }
                    GaussRoute::ConstantMass | GaussRoute::General => {
                        say(
                            "iteration",
                            true,
                            "velocities, actions and integrating factors of the stages, to round-off",
                        );
                        let constant = route == GaussRoute::ConstantMass;
                        let why = if constant { "W is constant: inverted once" } else { "at the stages, once a step" };
                        say("mass matrix", !constant, why);
                        say("Jacobian", false, "the iteration needs gradients alone");
                    }
                }
                if route != GaussRoute::Linear {
                    say("Newton's method", false, "only in steps whose iteration does not contract");
                }
            }
            (_, Integrator::Discrete(Method::Strang) | Integrator::Composition(Method::Strang, _)) => {
                say("Newton's method", false, "each step is explicit: forces only");
                say("Jacobian", false, "no equation is solved");
            }
            (Engine::Discrete(_), _) => {
                say("Newton's method", true, "each step is implicit in q1");
                say("Jacobian", true, "second derivatives of L at each iterate");
            }
            (_, Integrator::Composition(..)) => {
                say("Newton's method", true, "each substep is implicit in q1");
                say("Jacobian", true, "second derivatives of L at each iterate");
            }
            _ => {
                say("Newton's method", false, "each step is explicit: forces only");
                say("Jacobian", false, "no equation is solved");
                say("shared kicks", false, "the last force of a step is the first of the next");
            }
        }
        let implicit = matches!(self.integrator, Integrator::Discrete(_) | Integrator::Composition(..));
        match (self.needs.action, self.z_decouples) {
            (true, _) => say("action z", true, "requested"),
            (false, true) => say("action z", false, "L = L0 + gamma z: it does not act back, and is not requested"),
            (false, false) if implicit => say("action z", true, "the flow of a discrete Lagrangian carries it"),
            (false, false) if drag => say("action z", true, "the stages of this route carry it"),
            (false, false) => say("action z", true, "it drives the motion"),
        }
        let rate = match (self.needs.conformal_factor, self.constant_rate) {
            (false, true) => (false, "sigma_d is the same in every step, and the product is not requested"),
            (true, true) => (true, "requested; sigma_d is the same in every step: a power at the end"),
            (true, false) => (true, "requested, and different in every step: a product along the run"),
            (false, false) => (false, "the product is not requested; each step checks that its own is positive"),
        };
        say("conformal factor", rate.0, rate.1);
        let clock = if structure.autonomous { "L does not depend on it" } else { "L depends on it" };
        say("time at the stages", !structure.autonomous, clock);
        items
    }
}

impl<L: Lagrangian<N>, const N: usize> Display for Plan<'_, L, N> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Plan { problem, count, h, integrator, t_end, .. } = self;
        let (t0, items) = (problem.t0, self.items());
        let of = if let Integrator::Clocked { .. } = integrator { " of the clock's time" } else { "" };
        writeln!(f, "{count} steps of {h}{of} by {integrator}, t = {t0} .. {t_end}")?;
        for (title, computed) in [("computed", true), ("skipped", false)] {
            writeln!(f, "{title}:")?;
            for item in items.iter().filter(|item| item.computed == computed) {
                writeln!(f, "  {}: {}", item.what, item.why)?;
            }
        }
        Ok(())
    }
}
