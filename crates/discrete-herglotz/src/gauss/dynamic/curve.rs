//! A solved step as a curve, whose defect in Herglotz' equations is sampled between the nodes.

use crate::gauss::dynamic::dense::{Solved, SolvedStep};
use crate::gauss::dynamic::system::{CollocationSystem, Typed};
use crate::gauss::tables::condensed::Condensed;
use crate::numbers::registers::Stages;
use contact_geom::Lagrangian;

/// To be written.
pub(crate) trait SampleKernel {
    fn sample_defect(&self, arch: crate::numbers::instructions::Instructions, curve: &Curve, transformed: bool, set: usize) -> crate::gauss::DefectSample;
}

impl<L: Lagrangian<N>, const N: usize> SampleKernel for Typed<'_, L, N> {
    fn sample_defect(&self, _: crate::numbers::instructions::Instructions, _: &Curve, _: bool, _: usize) -> crate::gauss::DefectSample { crate::gauss::DefectSample::default() }
}

/// A solved step: its start, and the polynomials through its stages `V`, `rho L_q`, `rho L_z` and L. With a time
/// transformation they are polynomials in tau, each multiplied by the rate dt/dtau.
pub(crate) struct Curve {
    pub s: usize,
    pub t: f64,
    pub h: f64,
    pub q: Vec<f64>,
    pub p: Vec<f64>,
    pub z: f64,
    pub v: Vec<Stages>,
    pub force: Vec<Stages>,
    pub rate: Stages,
    pub l: Stages,
    /// Whether z is part of the stage equations; if not, `l` holds L at `z = 0`.
    pub acts: bool,
    /// The rates of the time transformation at the start and at the end.
    pub rates: [f64; 2],
}

impl Curve {
    pub fn new(s: usize, t: f64, h: f64, q: &[f64], p: &[f64], z: f64) -> Self { Curve { s, t, h, q: q.to_vec(), p: p.to_vec(), z, v: vec![Stages::ZERO; q.len()], force: vec![Stages::ZERO; q.len()], rate: Stages::ZERO, l: Stages::ZERO, acts: true, rates: [1.0; 2] } }
    /// Sets the stages of a step that has momenta and actions.
    pub fn of_solved(&mut self, _solved: &Solved) {
    }

    /// Sets the stages from the accelerations and positions of a condensed step.
    pub fn of_accelerations(
        &mut self,
        _system: &dyn CollocationSystem,
        _step: &SolvedStep<'_>,
        _table: &Condensed,
        [_a, _x]: [&[Stages]; 2],
    ) {
        todo!()
    }
}
