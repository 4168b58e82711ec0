//! A solved step as a curve, whose defect in Herglotz' equations is sampled between the nodes.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

mod between;
mod comparison;
mod sample;

use crate::Vector;
use crate::gauss::dense::SolvedStep;
use crate::gauss::resolution::defect_sample::{DefectSample, SAMPLE_SETS};
use crate::gauss::stages::stage_values::CondensedStages;
use crate::gauss::system::CollocationSystem;
use crate::gauss::tables::condensed::Condensed;
use crate::integration::StageVectors;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use between::MAX_STAGES_OF_TWO;
pub(crate) use between::PointSets;
use contact_geom::Scalar;
use pulp::{Simd, WithSimd};
pub(crate) use sample::SampleKernel;

/// The set of sample points next to the ends of the step.
pub(crate) const ENDS: usize = SAMPLE_SETS;

impl dyn CollocationSystem + '_ {
    /// The largest defect of a curve over a number of sets of sample points between its nodes, `None` for 0. A kink or a
    /// jump that no switching function shows may lie beyond the outermost of them, so that the ends count too if the
    /// system may have one.
    pub(crate) fn defect_of(
        &self,
        arch: Instructions,
        curve: &Curve,
        transformed: bool,
        sets: usize,
    ) -> Option<DefectSample> {
        let at = |sets| self.sample_defect(arch, curve, transformed, sets);
        let mut between = (sets > 0).then(|| at(PointSets::One(0)))?;
        let mut set = 1;
        while set < sets {
            let by_two = curve.s <= MAX_STAGES_OF_TWO && set + 1 < sets;
            let (now, next) = if by_two { (PointSets::Two(set), set + 2) } else { (PointSets::One(set), set + 1) };
            (between, set) = (between.and(at(now)), next);
        }
        Some(if self.has_cones() { between.with_ends(at(PointSets::One(ENDS))) } else { between })
    }
}

/// A solved step: its start, and the polynomials through its stages `V`, `rho L_q`, `rho L_z` and L. With a time
/// transformation they are polynomials in tau, each multiplied by the rate dt/dtau.
pub(crate) struct Curve {
    pub s: usize,
    pub t: f64,
    pub h: f64,
    pub q: Vector,
    pub p: Vector,
    pub z: f64,
    pub v: StageVectors,
    pub force: StageVectors,
    pub rate: Stages,
    pub l: Stages,
    /// Whether z is part of the stage equations; if not, `l` holds L at `z = 0`.
    pub acts: bool,
    /// The rates of the time transformation at the start and at the end.
    pub rates: [f64; 2],
}

impl Curve {
    /// A curve with its start, and stages that are 0 until they are set. Inlined, since it is large: it is made in its place.
    #[inline(always)]
    pub fn new(s: usize, t: f64, h: f64, q: &[f64], p: &[f64], z: f64) -> Self {
        let zero = || StageVectors::from_elem(Stages::ZERO, q.len());
        Curve {
            s,
            t,
            h,
            q: q.into(),
            p: p.into(),
            z,
            v: zero(),
            force: zero(),
            rate: Stages::ZERO,
            l: Stages::ZERO,
            acts: true,
            rates: [1.0; 2],
        }
    }

    /// Sets the stages from the accelerations and positions of a condensed step.
    pub fn of_accelerations(
        &mut self,
        system: &dyn CollocationSystem,
        step: &SolvedStep<'_>,
        table: &Condensed,
        [a, x]: [&[Stages]; 2],
    ) {
        (self.acts, self.z) = (false, 0.0);
        let arch = Instructions::new();
        arch.dispatch(FromAccelerations { curve: self, step, table, a });
        let solved = CondensedStages { table, t: self.t, v0: &step.from.y, a, x, v: &mut self.v };
        self.l = system.stage_values(arch, solved);
    }
}

/// The forces and rates at the stages of a condensed step from its accelerations.
struct FromAccelerations<'b, 'r> {
    curve: &'b mut Curve,
    step: &'b SolvedStep<'r>,
    table: &'b Condensed,
    a: &'b [Stages],
}

impl WithSimd for FromAccelerations<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let FromAccelerations { curve, step, table, a } = self;
        let n = a.len();
        for r in 0..blocks::<S>(table.s) {
            let rho = table.inverse_rho.block::<S>(r).recip();
            curve.rate.set(r, rho * table.gamma);
            for i in 0..n {
                let mut force = Lanes::<S>::splat(0.0);
                for j in 0..n {
                    let mass = match step.mass {
                        Some(mass) => mass[(i, j)],
                        None => f64::from(u8::from(i == j)),
                    };
                    force = a[j].block::<S>(r).mul_add(Lanes::splat(mass), force);
                }
                curve.force[i].set(r, force * rho);
            }
        }
    }
}
