//! Impacts on surfaces.

use crate::evaluation::At;
use crate::tape::Tape;
use crate::{Graph, Id};
use contact_geom::nalgebra::{DMatrix, DVector};
use contact_geom::switching::Impact;

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

    /// Replaces the velocity and the action of a state `(q, v, z)` by those after the impact; `at` is L with `L_v` and `L_vv`
    /// at a velocity and an action. The velocity is NaN where there is no state after it.
    pub fn replace(
        &self,
        at: impl Fn(&[f64], f64) -> (f64, DVector<f64>, DMatrix<f64>),
        t: f64,
        (q, v, z): (&[f64], &mut [f64], &mut f64),
    ) {
        let (mut normal, mut rate) = (DVector::zeros(q.len()), 0.0);
        let results = &mut [normal.as_mut_slice(), std::slice::from_mut(&mut rate)];
        self.normal.evaluate::<f64, 0>(At { t, q, v, z: *z }, results);
        let before = (&DVector::from_column_slice(v), *z);
        match self.law.after_at(|v, z| at(v.as_slice(), z), before, (&normal, rate)) {
            Some((after, action)) => {
                v.copy_from_slice(after.as_slice());
                *z = action;
            }
            None => v.fill(f64::NAN),
        }
    }

    /// The factor by which the contact form is multiplied, if the law is contact.
    pub fn factor(&self) -> Option<f64> {
        self.law.factor()
    }
}
