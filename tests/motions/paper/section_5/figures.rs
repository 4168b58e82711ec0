//! The exact series of the paper's figures against numbers that were computed with 60 digits.

use contact_examples::systems::{FreeParticle, HarmonicOscillator};
use contact_geom::{Energy, SmoothFunction, VelocityPoint};

/// The paper's drag and step; the start is `q(0) = 0, q(h) = 1, z(0) = 0`.
const GAMMA: f64 = -0.05;
const H: f64 = 0.5;

/// Index `k`, then `q`, `z` and `log H` at `t = k h`, with 60 digits in mpmath from the formulas
/// `q = v0 (e^(gamma t) - 1)/gamma`, `z = e^(gamma t) v0^2/2 (e^(gamma t) - 1)/gamma`, `log H = log(v0^2/2) + gamma t`.
const FREE_PARTICLE: [(u32, f64, f64, f64); 4] = [
    (1, 1.0, 0.987_552_082_790_806_7, 0.693_095_097_497_876_6),
    (7, 6.502_325_119_903_212, 5.526_937_044_017_871, 0.543_095_097_497_876_6),
    (50, 28.898_042_160_018_57, 8.383_351_760_648_076, -0.531_904_902_502_123_4),
    (99, 37.093_306_868_474_59, 3.161_069_766_301_877_6, -1.756_904_902_502_123_5),
];

/// The same for the oscillator: `q = B e^(gamma t/2) sin(w t)` with `q(h) = 1`, `z = q v/2`.
const OSCILLATOR: [(u32, f64, f64, f64); 4] = [
    (1, 1.0, 0.902_797_743_855_418_7, 0.777_133_219_908_401_6),
    (7, -0.677_016_756_853_642_2, 0.607_933_728_849_081_5, 0.627_133_219_908_401_6),
    (25, -0.108_535_883_522_579_16, -0.083_793_982_926_355_18, 0.177_133_219_908_401_54),
    (49, -0.684_187_819_661_454, -0.319_854_008_827_580_74, -0.422_866_780_091_598_5),
];

fn compare(expected: f64, computed: f64, size: f64, what: &str) {
    assert!((expected - computed).abs() <= 1e-13 * size, "{what}: {computed} instead of {expected}");
}

/// Within 1e-13, relative to the value; for the oscillator, which passes through zero, relative to the amplitude.
#[test]
fn against_sixty_digits() {
    let free = FreeParticle { gamma: GAMMA };
    let v0 = free.velocity_through(0.0, 1.0, H).unwrap_or(f64::NAN);
    for (k, q, z, log_h) in FREE_PARTICLE {
        let x = free.solution(f64::from(k) * H, &VelocityPoint::new([0.0], [v0], 0.0));
        compare(q, x.q[0], q, "q");
        compare(z, x.z, z, "z");
        compare(log_h, Energy(&free).value(0.0, &x.into()).ln(), 1.0, "log H");
    }
    let oscillator = HarmonicOscillator { gamma: GAMMA };
    let v0 = oscillator.velocity_through(0.0, 1.0, H).unwrap_or(f64::NAN);
    for (k, q, z, log_h) in OSCILLATOR {
        let x = oscillator.solution(f64::from(k) * H, &VelocityPoint::new([0.0], [v0], 0.0));
        compare(q, x.q[0], 1.0, "q");
        compare(z, x.z, 1.0, "z");
        compare(log_h, Energy(&oscillator).value(0.0, &x.into()).ln(), 1.0, "log H");
    }
}
