//! Statement 28 (section 4.1): `T pi (Gamma) = xi_L o pi`, the flows are pi-related, and the flow keeps to `M_L`.

use crate::common::over_motions;
use contact_geom::systems::CoupledInZ;
use contact_geom::{Statement, VelocityPoint};
use exact_lagrangian::{ExtendedPoint, NonHolonomic};

/// Along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(Statement::ProjectedFlow);
}

/// Off `M_L` the flow of Chetaev's equations keeps `Phi` constant, and the defect shows it.
#[test]
fn off_the_constraint() {
    let system = CoupledInZ::default();
    let chetaev = NonHolonomic::new(&system);
    let x = VelocityPoint::new([0.3], [0.6], 0.2);
    let on = chetaev.lift(0.1, &x);
    let start = ExtendedPoint { w: on.w + 0.1, ..on };
    let motion = chetaev.flow(0.1, &start, 0.7).unwrap();
    let end = motion.end;
    let phi = end.w - chetaev.lift(0.8, &end.project()).w;
    assert!((phi - 0.1).abs() < 1e-14, "{phi}");
    assert!((0.02..=0.1).contains(&motion.defect), "{}", motion.defect);
    // z' = w off it too: by Gauss' formula with two nodes, an error of h^4.
    let h = 1e-3;
    let short = chetaev.flow(0.1, &start, h).unwrap();
    assert!(((short.end.z - start.z) / h - 0.5 * (start.w + short.end.w)).abs() < 1e-6);
}
