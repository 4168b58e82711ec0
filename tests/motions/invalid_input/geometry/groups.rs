//! Invalid input to Lie groups and rigid bodies: formulas propagate a NaN, and bodies that do not exist are refused.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report, fine};
use contact_geom::groups::{
    GroupError, GroupLagrangian, GroupPotential, Inertia, LieGroup, NoPotential, RigidBody, Rotation, Rotations,
    UniformGravity,
};
use contact_geom::nalgebra::{Matrix3, SMatrix, SVector};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "LieGroup::adjoint",
            "LieGroup::bracket",
            "LieGroup::coadjoint",
            "LieGroup::cobracket",
            "LieGroup::compose",
            "LieGroup::dexp",
            "LieGroup::dexp_gradient",
            "LieGroup::dexp_inverse",
            "LieGroup::dexp_inverse_transposed",
            "LieGroup::dexp_transposed",
            "LieGroup::exp",
            "LieGroup::inverse",
            "LieGroup::log",
            "Rotation::apply",
            "Rotation::apply_inverse",
            "Rotation::matrix",
            "Rotation::normalised",
            "Rotation::quaternion",
        ],
        run: rotations,
    },
    InputTest { entries: &["LieGroup::check", "Rotation::from_quaternion"], run: quaternions },
    InputTest {
        entries: &["Inertia::about", "Inertia::new", "Inertia::principal", "RigidBody::moving", "RigidBody::new"],
        run: bodies,
    },
    InputTest {
        entries: &[
            "GroupLagrangian::partials",
            "GroupLagrangian::solve_mass",
            "GroupPotential::with_gradient",
            "RigidBody::energy",
            "RigidBody::momentum",
            "RigidBody::rotating",
            "RigidBody::velocity",
        ],
        run: energies,
    },
];

/// Vectors with an extreme entry, or with three.
fn vectors() -> Vec<SVector<f64, 3>> {
    let base = [0.3, -0.7, 0.2];
    let with = |i: usize, x: f64| SVector::from_fn(|j, _| if i == j { x } else { base[j] });
    let each = |x: f64| (0..3).map(move |i| with(i, x)).chain([SVector::repeat(x)]);
    [base.into()].into_iter().chain(EXTREME.into_iter().flat_map(each)).collect()
}

fn rotations(report: &mut Report) {
    type G = Rotations;
    let (g, eta) = (G::exp(&SVector::from([0.4, 0.1, -0.9])), SVector::from([0.5, 0.2, -0.3]));
    for xi in vectors() {
        report.formula(&xi, fine(G::exp(&xi).quaternion().to_vec()));
        report.formula(&xi, fine(vec![G::adjoint(&g, &xi), G::coadjoint(&g, &xi), g.apply(&xi), g.apply_inverse(&xi)]));
        report.formula(&xi, fine(vec![G::bracket(&xi, &eta), G::cobracket(&xi, &eta)]));
        report.formula(&xi, fine(vec![G::dexp(&xi, &eta), G::dexp_transposed(&xi, &eta)]));
        report.formula(&xi, fine(vec![G::dexp(&eta, &xi), G::dexp_inverse(&eta, &xi)]));
        // Its angle is less than 2 pi for ordinary input, where the inverse exists.
        report.formula(&xi, fine(vec![G::dexp_inverse(&xi, &eta), G::dexp_inverse_transposed(&xi, &eta)]));
        report.formula(&xi, fine(G::dexp_gradient(&xi, &eta, &eta)));
        let moved = Rotation { w: 0.4, u: xi };
        report.formula(&xi, fine(vec![G::log(&moved), G::log(&G::inverse(&moved))]));
        report.formula(&xi, fine(G::compose(&moved, &g).quaternion().to_vec()));
        report.formula(&xi, fine(moved.matrix()));
        report.formula(&xi, fine(moved.normalised().quaternion().to_vec()));
    }
}

fn quaternions(report: &mut Report) {
    for value in EXTREME {
        for i in 0..4 {
            let mut q = [0.5; 4];
            q[i] = value;
            report.entry_point(&q.to_vec(), Rotation::from_quaternion(q).map(|g| g.quaternion().to_vec()));
            let g = Rotation { w: q[0], u: SVector::from([q[1], q[2], q[3]]) };
            report.entry_point(&q.to_vec(), Rotations::check(&g));
        }
    }
}

fn bodies(report: &mut Report) {
    let finite = |inertia: Result<Inertia, GroupError>| {
        inertia.map(|inertia| (*inertia.matrix(), *inertia.axes(), *inertia.moments()))
    };
    let good = Matrix3::new(2.0, 0.1, 0.0, 0.1, 2.5, 0.2, 0.0, 0.2, 3.0);
    for value in EXTREME {
        for i in 0..9 {
            let mut matrix = good;
            matrix[i] = value;
            matrix[(i % 3) * 3 + i / 3] = value;
            report.entry_point(&matrix, finite(Inertia::new(matrix)));
            let body = RigidBody::<_, 3>::new(matrix, NoPotential, 0.0);
            report.entry_point(&matrix, body.map(|body| body.velocity(&SVector::from([1.0, 2.0, 3.0]))));
        }
        let moments = [2.0, value, 2.5];
        report.entry_point(&moments.to_vec(), finite(Inertia::principal(moments)));
        let Ok(inertia) = Inertia::new(good) else { return report.check(false, || "a good tensor is refused".into()) };
        report.entry_point(&value, finite(inertia.about(value, [0.1, 0.2, 0.3])));
        report.entry_point(&value, finite(inertia.about(1.0, [0.1, value, 0.3])));
        let unit = SVector::<f64, 6>::repeat(1.0);
        report.entry_point(&value, RigidBody::moving(&inertia, value, NoPotential, 0.0).map(|b| b.velocity(&unit)));
        report.entry_point(&value, RigidBody::moving(&inertia, 1.0, NoPotential, value).map(|b| b.gamma()));
    }
}

fn energies(report: &mut Report) {
    let gravity = UniformGravity { weight: [0.0, 0.1, -9.81], centre: [0.2, 0.5, 0.1] };
    let good = SMatrix::<f64, 3, 3>::new(2.0, 0.1, 0.0, 0.1, 2.5, 0.2, 0.0, 0.2, 3.0);
    let body = Inertia::new(good).and_then(|inertia| RigidBody::rotating(&inertia, gravity, -0.1));
    let Ok(body) = body else { return report.check(false, || "a good body is refused".into()) };
    let (g, eta) = (Rotations::exp(&SVector::from([0.4, 0.1, -0.9])), SVector::from([0.5, 0.2, -0.3]));
    let of = |g: &Rotation, xi: &SVector<f64, 3>, z: f64| {
        let partials = GroupLagrangian::<Rotations, 3>::partials(&body, 0.0, g, xi, z);
        (partials.value, vec![partials.force, partials.momentum], partials.rate)
    };
    for xi in vectors() {
        report.formula(&xi, fine(of(&g, &xi, 0.3)));
        report.formula(&xi, fine(vec![body.momentum(&xi), body.velocity(&xi)]));
        report.formula(&xi, fine(body.energy::<Rotations>(&g, &xi, 0.3)));
        let solved = GroupLagrangian::<Rotations, 3>::solve_mass(&body, 0.0, &g, &eta, 0.3, &xi);
        report.formula(&xi, solved.map_err(|e| format!("{e:?}")));
        let moved = Rotation { w: 0.4, u: xi };
        report.formula(&xi, fine(GroupPotential::<Rotations, 3>::with_gradient(&gravity, &moved)));
    }
    for z in EXTREME {
        report.formula(&z, fine(of(&g, &eta, z)));
        report.formula(&z, fine(body.energy::<Rotations>(&g, &eta, z)));
    }
}
