//! Statement 5 (section 2.1, corrected): the conformal factor of the flow is `sigma_t = exp(int_0^t a)`, `a = -R(H)`.

use crate::common::oracle::motion_with_derivative;
use crate::common::{on_random, within};
use contact_examples::systems::{FreeParticle, HarmonicOscillator, System, SystemVisitor, visit_catalogue};
use contact_geom::statements::{ActionSquared, ClosedFlow, conformal_flow};
use contact_geom::{ChartVector, LagrangianForm, support::conformality_with_jacobian};

/// The error of the oracle: its relative tolerance of 3e-14 a step, over some tens of steps, times the growth of the
/// variational equation (up to 1e2 on the samples).
const ORACLE: f64 = 1e-10;

/// Gauss' quadrature with ten nodes on `[0, t]`, which is exact to round-off for the rates of the closed flows.
fn gauss(t: f64) -> Vec<(f64, f64)> {
    let half = [
        (0.148_874_338_981_631_21, 0.295_524_224_714_752_87),
        (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
        (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
        (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
        (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    ];
    half.iter().flat_map(|&(x, w)| [(0.5 * t * (1.0 - x), 0.5 * t * w), (0.5 * t * (1.0 + x), 0.5 * t * w)]).collect()
}

fn along_closed_flow(flow: &impl ClosedFlow) {
    on_random(&format!("statement 5 on {}", flow.name()), 4, |u| {
        let x = ChartVector::from_fn(|i| 2.0 * u[i] - 1.0);
        let t = 0.1 + u[3];
        let residual = conformal_flow(flow, t, &x, &gauss(t)).map_err(|e| e.to_string())?;
        within(residual)
    });
}

/// Along the flows that are known in closed form, one of them nonlinear in z.
#[test]
fn along_closed_flows() {
    along_closed_flow(&FreeParticle::default());
    along_closed_flow(&HarmonicOscillator::default());
    along_closed_flow(&HarmonicOscillator { gamma: -2.5 });
    along_closed_flow(&ActionSquared { c: 0.4 });
}

/// Along the motion of every system, integrated with its variational equation by another library.
#[test]
fn along_every_motion() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for k in 0..4 {
                let u: Vec<f64> = (0..2 * N + 2).map(|i| (0.37 + 0.618 * (i + 3 * k) as f64).fract()).collect();
                let (t, start) = system.sample(&u);
                let (end, jacobian, sigma) = motion_with_derivative(system, t, &start, 0.3);
                let form = |t| LagrangianForm { lagrangian: system, t };
                let measured =
                    conformality_with_jacobian(&form(t), &form(t + 0.3), &start.into(), &end.into(), &jacobian);
                let ok = measured.is_ok_and(|m| m.defect < ORACLE && (m.sigma - sigma).abs() < ORACLE * sigma);
                assert!(ok, "statement 5 on {}: {measured:?}, exp int L_z = {sigma}", system.name());
            }
        }
    }
    visit_catalogue(&mut Visitor);
}
