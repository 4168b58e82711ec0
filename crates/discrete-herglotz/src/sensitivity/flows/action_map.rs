//! The derivative of the flow of an action that is a polynomial of degree two.

use super::exponential_integrals::{length, moment};
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::splitting::Riccati;
use crate::{Components, State, Vector};
use contact_geom::nalgebra::DMatrix;

/// Applies the flow of `f(z) = b z + c z^2` over a time s to a state, `z -> phi(z)`, `p -> phi'(z) p`, with its derivatives;
/// `coefficients` are those of `(b, c)` in each parameter.
///
/// With the integral l of `e^(b u)` over s, and `D = 1 - c l z`, it is `phi = e^(b s) z / D` and `phi' = e^(b s) / D^2`.
pub(super) fn linearise(
    Riccati { b, c }: Riccati,
    s: f64,
    coefficients: Option<&[[f64; 2]]>,
    state: &mut State,
) -> SubFlow {
    let (p, z, n) = (&state.p, state.z, state.q.len());
    let (growth, l) = ((b * s).exp(), length(b, s));
    let below = 1.0 - c * l * z;
    let below = if below > 0.0 { below } else { f64::NAN };
    let slope = growth / (below * below);
    let image = growth * z / below;
    let state_map = TangentMatrix {
        pp: DMatrix::from_diagonal_element(n, n, slope),
        pz: p * (2.0 * slope * c * l / below),
        zz: slope,
        ..TangentMatrix::identity(n)
    };
    let mut sources = Vec::new();
    if let Some(coefficients) = coefficients {
        let source = |of_image: f64, of_slope: f64| Components { x: Vector::zeros(n), y: p * of_slope, z: of_image };
        let lasts = moment(b, s);
        for [db, dc] in coefficients {
            // The change of -D/z.
            let bend = dc * l + c * lasts * db;
            let stretch = s * db;
            sources.push(source(image * (stretch + bend * z / below), slope * (stretch + 2.0 * bend * z / below)));
        }
        sources.push(source(0.0, 0.0));
        sources.push(source((b + c * image) * image, (b + 2.0 * c * image) * slope));
    }
    (state.p, state.z) = (p * slope, image);
    SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
}
