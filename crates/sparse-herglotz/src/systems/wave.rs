//! The damped wave equation, discretised by finite elements.

use crate::{FIXED, LocalLagrangian, Potential, SparseError, SparseSystem};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The elastic energy of a linear triangle, `c^2/2 |grad q|^2 A`. Its parameters are the three off-diagonal entries of
/// the stiffness matrix: `V = -k_01 (q_0 - q_1)^2/2 - k_12 (q_1 - q_2)^2/2 - k_20 (q_2 - q_0)^2/2`.
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
    /// The nodes of each triangle, in either orientation.
    pub triangles: &'a [[usize; 3]],
    /// Whether each node is held at 0; the others are unknowns, counted in the order of the nodes.
    pub held: &'a [bool],
}

/// The kinetic energy of a linear triangle with its consistent mass matrix,
/// `A/12 (v_0^2 + v_1^2 + v_2^2 + v_0 v_1 + v_1 v_2 + v_2 v_0)`. Its parameter is the area A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConsistentMass;

impl LocalLagrangian<3, 1> for ConsistentMass {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 3>, v: &SVector<T, 3>, _z: T, area: &[T; 1]) -> T {
        let sum = v[0] + v[1] + v[2];
        (sum * sum + v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) * area[0] * (1.0 / 24.0)
    }
}

/// The damped wave equation `q_tt = c^2 Laplace q + gamma q_t` on a triangulated domain, by linear finite elements with
/// lumped masses. The boundary is free except at held nodes.
///
/// # Errors
/// [`SparseError::Length`] if `held` and the nodes differ in length; [`SparseError::OutOfRange`] if a triangle
/// refers to a node that does not exist; [`SparseError::Parameters`] for a triangle of zero or non-finite area;
/// [`SparseError::Unknowns`] if all nodes are held. A free node that belongs to no triangle has no mass; the
/// integrators reject it.
pub fn membrane(mesh: Mesh, speed: f64, gamma: f64) -> Result<SparseSystem, SparseError> {
    let triangles = Triangles::new(mesh, speed)?;
    let mut masses = vec![0.0; triangles.unknowns];
    for ((nodes, _), area) in triangles.elements.iter().zip(&triangles.areas) {
        for i in nodes {
            if let Some(mass) = masses.get_mut(*i) {
                *mass += area / 3.0;
            }
        }
    }
    let system = SparseSystem::new(triangles.unknowns)?.with_masses(masses).with_drag(gamma);
    system.with_potential(Membrane, triangles.elements)
}

/// The same equation with the consistent mass matrix of the finite elements. The error of the frequencies has the
/// opposite sign. The mass matrix is sparse instead of diagonal, so that only [`SparseGauss`](crate::SparseGauss)
/// applies.
///
/// # Errors
/// Those of [`membrane`].
pub fn consistent_membrane(mesh: Mesh, speed: f64, gamma: f64) -> Result<SparseSystem, SparseError> {
    let Triangles { unknowns, elements, areas } = Triangles::new(mesh, speed)?;
    let masses: Vec<_> = elements.iter().zip(areas).map(|((nodes, _), area)| (*nodes, [area])).collect();
    let system = SparseSystem::new(unknowns)?.with_drag(gamma).with_potential(Membrane, elements)?;
    system.with_term(ConsistentMass, masses)
}

/// The triangles of a mesh.
struct Triangles {
    unknowns: usize,
    /// The unknowns of each triangle, and its parameters as a [`Membrane`].
    elements: Vec<([usize; 3], [f64; 3])>,
    areas: Vec<f64>,
}

impl Triangles {
    fn new(mesh: Mesh, speed: f64) -> Result<Self, SparseError> {
        let nodes = mesh.nodes.len();
        if mesh.held.len() != nodes {
            return Err(SparseError::Length { what: "held", found: mesh.held.len(), expected: nodes });
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
        let (mut elements, mut areas) = (Vec::with_capacity(mesh.triangles.len()), Vec::new());
        for (element, triangle) in mesh.triangles.iter().enumerate() {
            if let Some(&unknown) = triangle.iter().find(|i| **i >= nodes) {
                return Err(SparseError::OutOfRange { list: 0, element, unknown, last: nodes.saturating_sub(1) });
            }
            let [a, b, c] = triangle.map(|i| mesh.nodes[i]);
            let side = |from: [f64; 2], to: [f64; 2]| [to[0] - from[0], to[1] - from[1]];
            let (ab, bc, ca) = (side(a, b), side(b, c), side(c, a));
            let area = 0.5 * (ab[0] * bc[1] - ab[1] * bc[0]).abs();
            if !(area > 0.0 && area.is_finite()) {
                return Err(SparseError::Parameters {
                    what: "the area of a triangle",
                    value: area,
                    remedy: "correct the mesh",
                });
            }
            // The inner product of the gradients of two hat functions is that of the sides opposite their nodes,
            // divided by (2A)^2. Its integral has a factor A.
            let entry = |x: [f64; 2], y: [f64; 2]| speed * speed * (x[0] * y[0] + x[1] * y[1]) / (4.0 * area);
            elements.push((triangle.map(|i| number[i]), [entry(bc, ca), entry(ca, ab), entry(ab, bc)]));
            areas.push(area);
        }
        Ok(Triangles { unknowns, elements, areas })
    }
}
