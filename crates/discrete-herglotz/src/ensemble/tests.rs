use crate::ensemble::*;
use crate::numbers::instructions::Instructions;
use crate::numbers::simd_batch::SimdBatch;
use crate::test_lagrangians::{InPlane, OnLine};
use crate::{Ensemble, GaussCollocation, SplittingScheme, Steps, Until};
use contact_examples::systems::{Kepler, Pendulum};
use contact_geom::Lagrangian;
use contact_geom::{Scalar, VelocityPoint};
use pulp::{Arch, Simd, WithSimd};

/// All instruction sets that the processor has.
fn instruction_sets() -> Vec<Instructions> {
    let mut sets = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    {
        sets.extend(pulp::x86::V3::try_new().map(Arch::V3));
        sets.extend(pulp::x86::V4::try_new().map(Arch::V4));
    }
    sets.into_iter().map(Instructions::only).collect()
}

/// Evaluates sine and cosine, for as many arguments at a time as there are lanes.
struct Evaluate<'a>(&'a [f64]);

impl WithSimd for Evaluate<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let mut out = Vec::new();
        for x in self.0.chunks(SimdBatch::<S, 2>::COUNT) {
            let (sin, cos) = SimdBatch::<S, 2>::from_lanes(|i| x[i.min(x.len() - 1)]).sin_cos();
            out.extend((0..x.len()).map(|i| [sin.lanes()[i], cos.lanes()[i]]));
        }
        out
    }
}

/// Sine and cosine in lanes agree with the standard library, whose error is at most half a unit in the last place, up
/// to 2 units in the last place and the `1e-33 x` that the two parts of pi omit, at arguments of all sizes and near
/// multiples of pi/2. They are bitwise the same in all instruction sets, and NaN beyond the range of the argument
/// reduction.
#[test]
fn sines_of_all_widths_are_the_same() {
    let mut arguments = vec![0.0, -0.0];
    let mut random = 0.5;
    for k in 0..40_000 {
        random = (random + 0.618_033_988_749_894_9f64).fract();
        arguments.push((2.0 * random - 1.0) * 10f64.powi(k % 22 - 16));
        let multiple = f64::from(k * 7) * std::f64::consts::FRAC_PI_2;
        arguments.extend([multiple, multiple.next_up(), -multiple, f64::from(k) * std::f64::consts::FRAC_PI_2]);
    }
    let beyond = [5e5, -1e6, f64::INFINITY, f64::NAN];
    arguments.extend(beyond);
    let ulp = |b: f64| b.abs().next_up() - b.abs();
    let within = |x: f64, a: f64, b: f64| (a - b).abs() <= 2.0 * ulp(b) + 1e-33 * x.abs();
    let sets: Vec<Vec<[f64; 2]>> =
        instruction_sets().into_iter().map(|set| set.dispatch(Evaluate(&arguments))).collect();
    for set in &sets {
        assert_eq!(set.len(), arguments.len());
        for (i, (x, found)) in arguments.iter().zip(set).enumerate() {
            assert_eq!(found.map(f64::to_bits), sets[0][i].map(f64::to_bits), "{x:e}");
            if beyond.iter().any(|b| b.to_bits() == x.to_bits()) {
                assert!(found.iter().all(|y| y.is_nan()), "{x:e}: {found:?}");
                continue;
            }
            for (y, exact) in found.iter().zip([x.sin(), x.cos()]) {
                assert!(within(*x, *y, exact), "{x:e}: {y:e}, not {exact:e}");
            }
        }
    }
}

/// The results of all members in the lanes of one instruction set.
fn ends<const N: usize>(
    lagrangian: &(impl Lagrangian<N> + Sync),
    start: impl Fn(usize) -> VelocityPoint<N> + Sync + Copy,
    by: BatchKernel,
    set: Instructions,
) -> Vec<Member> {
    let of = Ensemble::new(lagrangian, 0.0, 61, start).steps(Steps::Count(12)).threads(1).only(set);
    let of = match by {
        BatchKernel::Splitting(scheme) => of.by(scheme),
        BatchKernel::Gauss { stages } => of.by(GaussCollocation { stages }),
    };
    let mut all = Vec::new();
    let tally = of.run(Until::Time(3.0), |member| all.push(member.clone())).unwrap();
    assert_eq!((tally.batch_kernel, tally.completed), (61, 61));
    all
}

/// The results of both kernels are bitwise the same for all register widths, although members are placed in different
/// lanes.
#[test]
fn members_in_all_widths_are_the_same() {
    let pendulum = OnLine::from(Pendulum { gamma: -0.1 });
    let pendula = |i: usize| VelocityPoint::new([0.03 * i as f64], [1.0 - 0.02 * i as f64], 0.1);
    let orbits = |i: usize| VelocityPoint::new([1.0 + 0.003 * i as f64, 0.0], [0.1, 1.0], 0.0);
    let kepler = InPlane::from(Kepler::default());
    for by in [
        BatchKernel::Splitting(SplittingScheme::BLANES_CASAS_8),
        BatchKernel::Splitting(SplittingScheme::KAHAN_LI_6),
        BatchKernel::Gauss { stages: 5 },
    ] {
        let sets = instruction_sets();
        let first = (ends(&pendulum, pendula, by, sets[0]), ends(&kepler, orbits, by, sets[0]));
        for set in &sets[1..] {
            assert_eq!(ends(&pendulum, pendula, by, *set), first.0, "{by:?}, {set:?}");
            assert_eq!(ends(&kepler, orbits, by, *set), first.1, "{by:?}, {set:?}");
        }
    }
}
