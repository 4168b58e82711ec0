//! Impacts on surfaces.

use crate::evaluation::At;
use crate::node::Inputs;
use crate::resets::{Change, Direction, FormulaReset, NO_RESETS};
use crate::tape::Tape;
use crate::{Formula, FormulaError, FormulaLagrangian, Graph, Id};
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::SVector;
use contact_geom::switching::{Control, Impact};

/// An impact with the normal of its surface as a tape.
#[derive(Clone, Debug)]
pub(crate) struct DerivedImpact {
    law: Impact,
    /// `g_q`, and `g_t`.
    pub normal: Tape,
}

impl DerivedImpact {
    /// The impact on a surface over `n` coordinates; `None` if it is too large.
    pub fn new(graph: &mut Graph, (law, surface): (Impact, Id), n: usize, limit: usize) -> Option<Self> {
        let mut variables: Vec<Id> = (0..n).map(|i| graph.position(i as u32)).collect();
        variables.push(graph.time());
        let slopes = graph.gradient(surface, &variables, limit)?;
        Some(DerivedImpact { law, normal: Tape::new(graph, &slopes, n)? })
    }

    /// The state after the impact.
    pub fn control<const N: usize>(
        &self,
        lagrangian: &FormulaLagrangian<N>,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Control<N> {
        let (mut normal, mut rate) = (SVector::<f64, N>::zeros(), 0.0);
        let results = &mut [normal.as_mut_slice(), std::slice::from_mut(&mut rate)];
        self.normal.evaluate::<f64, N>(At::new(t, &x.q, &x.v, x.z), results);
        // A state that does not exist is refused as one that is not finite.
        let to = self.law.after(lagrangian, t, x, (&normal, rate));
        let to = to.unwrap_or(VelocityPoint { v: SVector::repeat(f64::NAN), ..*x });
        match self.law.factor() {
            Some(factor) => Control::Conformal { to, factor },
            None => Control::Replace(to),
        }
    }
}

impl Formula {
    /// The same formula with impacts on a surface: where the function `when` of t and the coordinates falls to 0, the
    /// momentum changes along its gradient by a law, which conserves energy, or multiplies the normal velocity or the
    /// contact form by a number. It counts as one of the [resets](Self::with_reset), and `rest` is that of
    /// [`Reset`](crate::Reset).
    ///
    /// ```
    /// use contact_geom::{Lagrangian, VelocityPoint, switching::{Control, Impact}};
    /// use formula_lagrangian::Formula;
    /// let thrown = Formula::parse("(x'^2 + y'^2)/2 - 9.81*y", &["x", "y"], &[])?;
    /// // A slope of 45 degrees: the normal velocity is reversed.
    /// let l = thrown.with_impact("y - x", Impact::Elastic, None)?.lagrangian::<2>()?;
    /// let falling = VelocityPoint::new([0.0, 0.0], [0.0, -2.0], 0.0);
    /// let Control::Conformal { to, factor } = l.at_switch(0, 0.0, &falling, false) else { panic!() };
    /// assert!((to.v[0] + 2.0).abs() < 1e-15 && to.v[1].abs() < 1e-15 && factor == 1.0);
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`with_reset`](Self::with_reset); [`FormulaError::Impact`] if the function depends on velocities or z,
    /// or if the number of the law is outside its range.
    pub fn with_impact(&self, when: &str, law: Impact, rest: Option<&[(&str, &str)]>) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_RESETS.0, NO_RESETS.1)?;
        self.check_has_no_constraints()?;
        match law {
            Impact::Restitution(e) if !(0.0..=1.0).contains(&e) => {
                return Err(FormulaError::Impact { why: "has a restitution outside of 0 to 1; give one within" });
            }
            Impact::Conformal(factor) if !(factor > 0.0 && factor <= 1.0) => {
                return Err(FormulaError::Impact {
                    why: "has a conformal factor that is not positive and at most 1; give one that is",
                });
            }
            _ => {}
        }
        let mut formula = self.clone();
        let surface = self.parse_beside(&mut formula.graph, when, None)?;
        let rest = rest.map(|rest| self.assignments(&mut formula.graph, rest)).transpose()?;
        if formula.graph.is_constant(surface) {
            return Err(FormulaError::Impact { why: "has a constant in place of a surface" });
        }
        if !formula.graph.inputs(surface).within(Inputs::TIME.and(Inputs::POSITION)) {
            return Err(FormulaError::Impact {
                why: "has a function of velocities or z in place of a surface; give a function of t and the \
                      coordinates, or assign new values by a reset",
            });
        }
        let change = Change::Impact(law);
        formula.resets.push(FormulaReset { when: surface, direction: Direction::Falling, change, rest });
        formula.sized()
    }

    /// Whether an impact multiplies the contact form by a factor other than 1, so that `L_z` alone does not determine
    /// the conformal factor of a motion.
    pub fn has_conformal_impacts(&self) -> bool {
        let factor = |reset: &FormulaReset| match reset.change {
            Change::Impact(law) => law.factor(),
            Change::Assignment(_) => None,
        };
        self.resets.iter().filter_map(factor).any(|factor| factor != 1.0)
    }

    /// Whether a reset preserves no contact form, as all do but elastic and conformal impacts.
    pub fn has_noncontact_resets(&self) -> bool {
        self.resets.iter().any(|reset| match reset.change {
            Change::Impact(law) => law.factor().is_none(),
            Change::Assignment(_) => true,
        })
    }
}
