//! Gravitating bodies.

use super::system::SiteSystem;
use crate::RuntimeError;
use sparse_herglotz::systems::Gravitation;
use sparse_herglotz::{Difference, Potential, SparseSystem};

/// Bodies in the plane or in space with Newtonian gravitation of each pair and linear drag, `L = sum m_i |v_i|^2/2 +
/// sum_(i<j) G m_i m_j/|q_i - q_j| + gamma z`. Total and angular momentum decay as `e^(gamma t)`.
///
/// ```
/// use herglotz_runtime::{SiteMotion, Bodies, Start, Steps};
/// let pair = Bodies { masses: vec![1.0, 1e-3], dimensions: 2, g: 1.0, gamma: -1e-3 }.system()?;
/// let start = Start::new(0.0, [0.0, 0.0, 1.0, 0.0], [0.0, -1e-3, 0.0, 1.0], 0.0);
/// let motion = SiteMotion::new(start, 1.0, "blanes_moan_6".parse().unwrap(), Steps::Size(0.05));
/// println!("{:?}", pair.run(&motion, &mut ())?.q);
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Bodies {
    /// The mass of each body.
    pub masses: Vec<f64>,
    /// The dimension of space: 2 or 3.
    pub dimensions: usize,
    /// The gravitational constant.
    pub g: f64,
    /// The rate of the drag, negative for dissipation.
    pub gamma: f64,
}

impl Bodies {
    /// The sparse system.
    ///
    /// # Errors
    /// [`RuntimeError::Argument`] for fewer than two bodies, an invalid mass, or another number of dimensions;
    /// [`RuntimeError::NotFinite`] for `G` and `gamma`.
    pub fn system(&self) -> Result<SiteSystem, RuntimeError> {
        self.check()?;
        let Bodies { masses, dimensions, g, gamma } = self;
        let n = masses.len();
        let each: Vec<f64> = (0..n * dimensions).filter_map(|k| masses.get(k % n).copied()).collect();
        let make =
            || Ok::<_, RuntimeError>(SparseSystem::new(n * dimensions)?.with_masses(each.clone()).with_drag(*gamma));
        let system = match dimensions {
            2 => attracting::<2, 4>(make()?, masses, *g)?,
            _ => attracting::<3, 6>(make()?, masses, *g)?,
        };
        Ok(SiteSystem { system, sites: n, components: *dimensions, masses: each, full: true })
    }

    /// Refuses what is no system of bodies.
    pub(super) fn check(&self) -> Result<(), RuntimeError> {
        let Bodies { masses, dimensions, g, gamma } = self;
        if masses.len() < 2 {
            return Err(RuntimeError::argument(
                "masses",
                format!("has {} bodies; at least 2 are required", masses.len()),
            ));
        }
        if let Some((i, m)) = masses.iter().enumerate().find(|(_, m)| !(**m > 0.0 && m.is_finite())) {
            return Err(RuntimeError::argument(
                "masses",
                format!("has {m} for body {i}; it must be a positive finite number"),
            ));
        }
        for (what, value) in [("G", *g), ("gamma", *gamma)] {
            if !value.is_finite() {
                return Err(RuntimeError::NotFinite { what: what.into(), value });
            }
        }
        if !matches!(dimensions, 2 | 3) {
            return Err(RuntimeError::argument(
                "q0",
                format!("has {dimensions} components for each body; it must have 2 or 3"),
            ));
        }
        Ok(())
    }
}

/// Adds the attraction of each pair.
fn attracting<const D: usize, const K: usize>(
    system: SparseSystem,
    masses: &[f64],
    g: f64,
) -> Result<SparseSystem, RuntimeError>
where
    Difference<Gravitation>: Potential<K, 1>,
{
    let n = masses.len();
    // Pairs are ordered by the difference of their indices, so that consecutive pairs have consecutive coordinates in
    // memory.
    let pairs = (1..n).flat_map(|apart| {
        masses.iter().zip(masses.iter().skip(apart)).enumerate().map(move |(i, m)| (i, i + apart, m))
    });
    let elements = pairs.map(|(i, j, (a, b))| {
        let sites: [usize; K] = std::array::from_fn(|k| k % D * n + if k < D { i } else { j });
        (sites, [g * a * b])
    });
    Ok(system.with_potential(Difference(Gravitation), elements)?)
}
