//! The damped wave equation by finite elements.

use crate::{AssembledSystem, AssemblyError, FIXED, Potential};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The elastic energy of a linear triangle, `c^2/2 |grad q|^2 A`: its parameters are the three entries beside the diagonal of the stiffness
/// matrix, `V = -k_01 (q_0 - q_1)^2/2 - k_12 (q_1 - q_2)^2/2 - k_20 (q_2 - q_0)^2/2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Membrane;

impl Potential<3, 3> for Membrane {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, q: &SVector<T, 3>, k: &[T; 3]) -> T {
        let square = |a: T, b: T| (a - b) * (a - b);
        (square(q[0], q[1]) * k[0] + square(q[1], q[2]) * k[1] + square(q[2], q[0]) * k[2]) * -0.5
    }

    #[inline(always)]
    fn gradient<T: Scalar>(&self, _t: T, q: &SVector<T, 3>, k: &[T; 3]) -> SVector<T, 3> {
        let (a, b, c) = ((q[1] - q[0]) * k[0], (q[2] - q[1]) * k[1], (q[0] - q[2]) * k[2]);
        SVector::from([a - c, b - a, c - b])
    }
}

/// A triangulation of a plane domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh<'a> {
    /// The nodes.
    pub nodes: &'a [[f64; 2]],
    /// The nodes of each triangle, in either sense.
    pub triangles: &'a [[usize; 3]],
    /// Whether each node is held at 0; the others are unknowns, counted in the order of the nodes.
    pub held: &'a [bool],
}

/// The damped wave equation `q_tt = c^2 Laplace q + gamma q_t` on a triangulated domain, by linear finite elements with lumped masses; free
/// edges unless their nodes are held.
///
/// # Errors
/// [`AssemblyError::Length`] where `held` is not as long as the nodes; [`AssemblyError::OutOfRange`] where a triangle names a node that there is
/// none of; [`AssemblyError::Parameters`] for a triangle without area; [`AssemblyError::Unknowns`] where all nodes are held.
/// A free node of no triangle has no mass, which the integrators refuse.
pub fn membrane(mesh: Mesh, speed: f64, gamma: f64) -> Result<AssembledSystem, AssemblyError> {
    let nodes = mesh.nodes.len();
    if mesh.held.len() != nodes {
        return Err(AssemblyError::Length { what: "held", found: mesh.held.len(), expected: nodes });
    }
    let mut unknowns = 0;
    let number: Vec<usize> = mesh
        .held
        .iter()
        .map(|held| {
            if *held {
                return FIXED;
            }
            unknowns += 1;
            unknowns - 1
        })
        .collect();
    let mut masses = vec![0.0; unknowns];
    let mut elements = Vec::with_capacity(mesh.triangles.len());
    for (element, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(&unknown) = triangle.iter().find(|i| **i >= nodes) {
            return Err(AssemblyError::OutOfRange { list: 0, element, unknown, last: nodes.saturating_sub(1) });
        }
        let [a, b, c] = triangle.map(|i| mesh.nodes[i]);
        let side = |from: [f64; 2], to: [f64; 2]| [to[0] - from[0], to[1] - from[1]];
        let (ab, bc, ca) = (side(a, b), side(b, c), side(c, a));
        let area = 0.5 * (ab[0] * bc[1] - ab[1] * bc[0]).abs();
        if !(area > 0.0 && area.is_finite()) {
            return Err(AssemblyError::Parameters {
                what: "the area of a triangle",
                value: area,
                remedy: "mend the mesh",
            });
        }
        // The product of the gradients of two hat functions is that of the sides opposite to their nodes, by (2A)^2; times A.
        let entry = |x: [f64; 2], y: [f64; 2]| speed * speed * (x[0] * y[0] + x[1] * y[1]) / (4.0 * area);
        elements.push((triangle.map(|i| number[i]), [entry(bc, ca), entry(ca, ab), entry(ab, bc)]));
        for i in *triangle {
            if let Some(mass) = masses.get_mut(number[i]) {
                *mass += area / 3.0;
            }
        }
    }
    AssembledSystem::new(unknowns)?.with_masses(masses).with_drag(gamma).with_potential(Membrane, elements)
}
