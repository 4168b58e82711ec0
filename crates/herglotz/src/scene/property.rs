//! What is proved of the system of a scene.

use super::{BodyScene, Scene};
use crate::runtime::FormulaSymmetry;

/// A property of a system that can be proved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Property {
    /// Its name.
    pub name: &'static str,
    /// Whether it is proved.
    pub is_proved: bool,
    /// Its meaning.
    pub meaning: &'static str,
}

/// Properties by name, whether they are proved, and meaning.
fn properties<const K: usize>(all: [(&'static str, bool, &'static str); K]) -> Vec<Property> {
    all.map(|(name, is_proved, meaning)| Property { name, is_proved, meaning }).to_vec()
}

impl Scene {
    /// The properties that can be proved from the formula.
    pub fn properties(&self) -> Vec<Property> {
        let smooth = self.system.is_smooth();
        if let Some(structure) = self.system.hamiltonian_structure() {
            return properties([
                ("smooth", smooth, "H has neither kinks nor jumps"),
                ("autonomous", structure.autonomous, "H does not depend on t"),
                ("z_free", structure.z_free, "H does not depend on z: no dissipation"),
                ("z_affine", structure.z_affine, "H = H0(t, q, p) - gamma(t) z"),
                ("constant_rate", structure.constant_rate, "H_z is constant"),
                ("separable", structure.separable, "H = T(p) + V(t, q) + f(t, z)"),
                ("polynomial", structure.degree.is_some(), "H is a polynomial in the momenta"),
                ("homogeneous", structure.homogeneous, "p . H_p = H: H is homogeneous of degree one in the momenta"),
            ]);
        }
        let structure = self.system.structure();
        properties([
            ("smooth", smooth, "L has neither kinks nor jumps"),
            ("autonomous", structure.autonomous, "L does not depend on t"),
            ("z_free", structure.z_free, "L does not depend on z: no dissipation"),
            ("z_affine", structure.z_affine, "L = L0(t, q, v) + gamma(t) z"),
            ("constant_rate", structure.has_constant_rate(), "L_z is constant"),
            ("separable", structure.separable, "L = v.Mv/2 - V(t, q) + f(t, z), M constant"),
            ("quadratic", structure.quadratic, "the equation of motion is linear"),
            ("constant_mass", structure.constant_mass, "W = L_vv is constant"),
        ])
    }

    /// The momenta of the symmetries that are recognised, as formulas. Without forces each is multiplied by the conformal factor
    /// along a motion.
    pub fn momenta(&self) -> Vec<String> {
        self.system.symmetries().iter().map(|symmetry| self.momentum(symmetry)).collect()
    }

    fn momentum(&self, symmetry: &FormulaSymmetry) -> String {
        let formula = self.system.formula();
        let (names, momenta) = (formula.coordinates(), formula.momenta());
        let name = |of: &[String], i: usize| of.get(i).cloned().unwrap_or_default();
        let terms: Vec<String> = match symmetry {
            FormulaSymmetry::Translation(moved) => moved.iter().map(|i| name(&momenta, *i)).collect(),
            FormulaSymmetry::Rotation(pairs) => pairs
                .iter()
                .map(|(i, j)| {
                    let [(x, p_x), (y, p_y)] = [*i, *j].map(|k| (name(&names, k), name(&momenta, k)));
                    format!("{x}*{p_y} - {y}*{p_x}")
                })
                .collect(),
        };
        terms.join(" + ")
    }
}

impl BodyScene {
    /// The properties that can be proved of a rigid body.
    pub fn properties(&self) -> Vec<Property> {
        let body = &self.body;
        properties([
            ("autonomous", true, "L does not depend on t"),
            ("z_free", body.gamma == 0.0, "L does not depend on z: no dissipation"),
            ("z_affine", true, "L = L0(R, omega) + gamma z"),
            ("constant_rate", true, "L_z is constant"),
            ("free", body.mass == 0.0 || body.gravity == [0.0; 3], "no torque acts"),
        ])
    }
}
