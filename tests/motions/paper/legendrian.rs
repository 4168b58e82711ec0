//! The graphs of conformally contact maps are Legendrian: those of the flows of all systems, and those of flows of
//! contact Hamiltonians that have no Lagrangian. Statement 48.

use crate::common::bounded;
use crate::paper::table::{EXACT_TOLERANCE, Row, along_motions_of_every_system};
use contact_geom::nalgebra::SVector;
use contact_geom::support::seed;
use contact_geom::{
    ChartVector, ContactHamiltonian, LegendrianDefect, PhasePoint, Scalar, Statement, legendrian_defect,
};
use exact_lagrangian::contact_flow;

/// The statement about the graph of the flow.
pub const ALONG_MOTIONS: &[Row] = &[Row::new(Statement::LegendrianGraph, EXACT_TOLERANCE)];

#[test]
fn statements_along_motions_of_every_system() {
    along_motions_of_every_system(ALONG_MOTIONS);
}

/// Contact Hamiltonians that depend on all variables, with `H_pp` of rank two, zero and one.
#[derive(Clone, Copy, Debug)]
enum Plane {
    Regular,
    Linear,
    Homogeneous,
}

impl ContactHamiltonian<2> for Plane {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        let square = p[0] * p[0] + p[1] * p[1] * 2.0;
        match self {
            Plane::Regular => square * 0.5 + (q[0] - q[1] * 0.5).sin() * (z * 0.3 + 1.0) + z * z * 0.1 + t.sin() * q[1],
            Plane::Linear => p[0] * (q[1] + z * 0.3) + p[1] * q[0].sin() + q[0] * z + z * z * 0.1,
            Plane::Homogeneous => square.sqrt() * (q[0].sin() * q[1] * 0.3 + 1.0) + p[0] * z * 0.2,
        }
    }
}

/// The graphs of the flows of three kinds of contact Hamiltonians are Legendrian; with another factor, and after a
/// shear of the momenta, they are not.
#[test]
fn flows_without_a_lagrangian() {
    let x = ChartVector { x: [0.3, -0.4].into(), y: [0.7, 0.2].into(), z: 0.25 };
    let x0: PhasePoint<2, _> = seed(&x).into();
    for plane in [Plane::Regular, Plane::Linear, Plane::Homogeneous] {
        for h in [0.1, 1.0, -0.7] {
            let motion = contact_flow(&plane, 0.2.into(), &x0, h.into()).unwrap();
            let LegendrianDefect { form, closure } = legendrian_defect(&x0, &motion.end, motion.ln_sigma);
            // The derivatives of the flow are below 10.
            bounded(form, 1e-14).and(bounded(closure, 1e-14)).unwrap_or_else(|e| panic!("{plane:?}, {h}: {e}"));
            let other_factor = legendrian_defect(&x0, &motion.end, motion.ln_sigma * 1.1 + 0.01);
            let sheared = PhasePoint { p: motion.end.p + motion.end.q.map(|e| e * 0.01), ..motion.end };
            let other_map = legendrian_defect(&x0, &sheared, motion.ln_sigma);
            assert!(other_factor.form > 1e-4 && other_factor.closure > 1e-4, "{plane:?}, {h}: {other_factor:?}");
            // A shear by a gradient keeps `dp ^ dq`, but not the form.
            assert!(other_map.form > 1e-4, "{plane:?}, {h}: {other_map:?}");
        }
    }
}
