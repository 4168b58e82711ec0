//! A system of many coordinates.

use sparse_herglotz::SparseSystem;

/// A system of any number of coordinates as a sum of local terms: a [`Lattice`](crate::Lattice) or
/// [`Bodies`](crate::Bodies), ready to be run.
///
/// ```
/// use herglotz_runtime::{SiteMotion, Boundary, Lattice, Start, Steps};
/// let chain = Lattice {
///     site: "x'^2/2 - (1 - cos(x)) + gamma*z".into(),
///     bond: Some("-k*(xr - xl)^2/2".into()),
///     sizes: vec![100],
///     boundary: Boundary::Periodic,
///     parameters: vec![("k".into(), 4.0), ("gamma".into(), -0.1)],
///     ..Lattice::default()
/// };
/// let q: Vec<f64> = (0..100).map(|i| (0.2 * std::f64::consts::PI * f64::from(i)).sin()).collect();
/// let start = Start::new(0.0, q, vec![0.0; 100], 0.0);
/// let motion = SiteMotion::new(start, 10.0, "strang".parse().unwrap(), Steps::Size(0.1));
/// let (outcome, rows) = chain.system()?.record(&motion)?;
/// assert_eq!((outcome.steps, rows.len()), (100, 101));
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
pub struct SiteSystem {
    pub(super) system: SparseSystem,
    /// The number of sites or bodies, and of components at each.
    pub(super) sites: usize,
    pub(super) components: usize,
    /// The mass of each coordinate, in the order of the sparse system.
    pub(super) masses: Vec<f64>,
    /// Whether all coordinates interact, so that the matrices of a step are full.
    pub(super) full: bool,
}

impl SiteSystem {
    /// The number of coordinates. In a start and in rows, the components of one site or body follow each other.
    pub fn dimension(&self) -> usize {
        self.sites * self.components
    }

    /// Reorders from the order of users (the components of each place together) to that of the sparse system (each
    /// component of all places), in which neighbours are contiguous in memory.
    pub(super) fn inward(&self, x: &[f64]) -> Vec<f64> {
        let (n, d) = (self.sites, self.components);
        (0..n * d).map(|k| x.get(k % n * d + k / n).copied().unwrap_or(f64::NAN)).collect()
    }

    /// The inverse reordering, appended to a row.
    pub(super) fn outward(&self, x: &[f64], row: &mut Vec<f64>) {
        let (n, d) = (self.sites, self.components);
        row.extend((0..n * d).map(|k| x.get(k % d * n + k / d).copied().unwrap_or(f64::NAN)));
    }
}
