use assembled_herglotz::systems::{FputBond, fput_chain};
use assembled_herglotz::{AssembledSplitting, State};
use discrete_herglotz::SplittingScheme;
use std::time::Instant;

fn by_hand(scheme: &SplittingScheme, gamma: f64, h: f64, steps: usize, y: &[f64], n: usize) -> Vec<f64> {
    let (drifts, kicks) = scheme.coefficients();
    let mut q = vec![0.0; n + 2];
    q[1..=n].copy_from_slice(&y[..n]);
    let mut v = y[n..2 * n].to_vec();
    let s = scheme.stages();
    for k in 0..=steps * s {
        let i = (k + s - 1) % s;
        let hb = if k == 0 { kicks[0] } else if i == s - 1 { kicks[s] + if k == steps * s { 0.0 } else { kicks[0] } } else { kicks[i + 1] } * h;
        let hb = if k == 0 { hb * h } else { hb };
        if k > 0 {
            let g = (gamma * drifts[i] * h).exp_m1();
            let d = g / gamma;
            for (q, v) in q[1..=n].iter_mut().zip(&mut v) { *q = d.mul_add(*v, *q); *v = g.mul_add(*v, *v); }
        }
        for (w, v) in q.windows(3).zip(&mut v) {
            let (r0, r1) = (w[1] - w[0], w[2] - w[1]);
            *v += hb * ((r1 + r1 * r1 * r1) - (r0 + r0 * r0 * r0));
        }
    }
    let mut y = q[1..=n].to_vec();
    y.extend(v);
    y
}

fn main() {
    let bytes = std::fs::read("/work/shared/peers/refs/P4.bin").unwrap();
    let x: Vec<f64> = bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let n = 1000;
    let (y0, y1) = (&x[6..6 + 2 * n + 1], &x[6 + 2 * n + 1..]);
    println!("{:?}", &x[..6]);
    let chain = fput_chain(n, FputBond { alpha: 0.0, beta: 1.0 }, -0.01).unwrap();
    let error = |y: &[f64]| {
        let (mut e, mut r) = (0.0, 0.0);
        for i in 0..2 * n { e += (y[i] - y1[i]).powi(2); r += y1[i].powi(2); }
        f64::sqrt(e / r)
    };
    for (scheme, hs) in [(SplittingScheme::STRANG, [1.0, 0.5]), (SplittingScheme::BLANES_MOAN_6, [4.0, 2.0])] {
        for h in hs {
            let steps = (100.0 / h) as usize;
            let h = 100.0 / steps as f64;
            let (mut best, mut hand, mut act) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
            let (mut e, mut eh, mut ez) = (0.0, 0.0, 0.0);
            for _ in 0..200 {
                let start = State { t: 0.0, q: &y0[..n], v: &y0[n..2 * n], z: 0.0 };
                let mut m = AssembledSplitting::new(&chain, &scheme, h, start).unwrap();
                let clock = Instant::now();
                m.advance(steps).unwrap();
                let s = m.state();
                let all: Vec<f64> = s.q.iter().chain(s.v).copied().collect();
                best = best.min(clock.elapsed().as_secs_f64());
                e = error(&all);
                let mut m = AssembledSplitting::new(&chain, &scheme, h, start).unwrap().with_action();
                let clock = Instant::now();
                m.advance(steps).unwrap();
                let s = m.state();
                act = act.min(clock.elapsed().as_secs_f64());
                ez = (s.z - y1[2 * n]).abs() / x[5];
                let clock = Instant::now();
                let all = by_hand(&scheme, -0.01, h, steps, y0, n);
                hand = hand.min(clock.elapsed().as_secs_f64());
                eh = error(&all);
            }
            println!("{} h {h}: {:.1} us ({e:.1e}), hand {:.1} us ({eh:.1e}), ratio {:.2}; z {:.1} us {ez:.1e}", scheme.name(), best * 1e6, hand * 1e6, best / hand, act * 1e6);
        }
    }
    let n = 1_000_000;
    let chain = fput_chain(n, FputBond { alpha: 0.0, beta: 1.0 }, -0.01).unwrap();
    let q: Vec<f64> = (0..n).map(|i| (0.001 * i as f64).sin()).collect();
    let v = vec![0.0; n];
    let mut m = AssembledSplitting::new(&chain, &SplittingScheme::STRANG, 0.1, State { t: 0.0, q: &q, v: &v, z: 0.0 }).unwrap();
    let (mut a, mut b) = (q.clone(), v.clone());
    let (mut best, mut copy) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..10 {
        let clock = Instant::now();
        for _ in 0..20 { a.copy_from_slice(&q); b.copy_from_slice(&v); std::hint::black_box((&mut a, &mut b)); }
        copy = copy.min(clock.elapsed().as_secs_f64() / 20.0);
        let clock = Instant::now();
        m.advance(20).unwrap();
        best = best.min(clock.elapsed().as_secs_f64() / 20.0);
    }
    println!("1e6: stage {:.3} ms, copy {:.3} ms, ratio {:.2}, threads {}", best * 1e3, copy * 1e3, best / copy, rayon::current_num_threads());
}
