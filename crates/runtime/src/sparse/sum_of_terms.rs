//! Lattices and bodies as formulas, for all that systems with a formula have.

use super::bodies::Bodies;
use super::lattice::{Boundary, Lattice, NOT_AFFINE};
use crate::RuntimeError;
use formula_lagrangian::{Formula, substitute};
use std::cell::Cell;

/// The Lagrangian of a system of many coordinates as text, with the names and the parameters that it is over.
#[derive(Clone, Debug, PartialEq)]
pub struct SumOfTerms {
    /// The Lagrangian.
    pub lagrangian: String,
    /// The coordinates, in the order of a start: `x[4]` for the four sites of a lattice with one coordinate, else `x_0`,
    /// `y_0`, `x_1`, ...
    pub coordinates: Vec<String>,
    /// The parameters with their values.
    pub parameters: Vec<(String, f64)>,
}

impl SumOfTerms {
    /// The formula.
    ///
    /// # Errors
    /// Those of [`Formula::parse`], also for more coordinates than a formula may have.
    pub fn formula(&self) -> Result<Formula, RuntimeError> {
        let coordinates: Vec<&str> = self.coordinates.iter().map(String::as_str).collect();
        let parameters: Vec<(&str, f64)> = self.parameters.iter().map(|(name, x)| (name.as_str(), *x)).collect();
        Ok(Formula::parse(&self.lagrangian, &coordinates, &parameters)?)
    }
}

impl Lattice {
    /// The Lagrangian of the whole lattice as one text, `L = sum_sites l + sum_bonds b`, in which the term in z counts once. Its
    /// sites may be more general than those of [`system`](Self::system): masses may depend on x, and bonds on velocities.
    ///
    /// ```
    /// use herglotz_runtime::Lattice;
    /// let chain = Lattice {
    ///     site: "x'^2/2 + cos(x) + gamma*z".into(),
    ///     bond: Some("-(xr - xl)^2/2".into()),
    ///     sizes: vec![4],
    ///     parameters: vec![("gamma".into(), -0.1)],
    ///     ..Lattice::default()
    /// };
    /// assert_eq!(chain.sum_of_terms()?.formula()?.dimension(), 4);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// [`RuntimeError::Part`] with the formula and the position in it; [`RuntimeError::Argument`] for a site that is not
    /// affine in z, or whose rate depends on x, for forces in the texts, and as for [`system`](Self::system).
    pub fn sum_of_terms(&self) -> Result<SumOfTerms, RuntimeError> {
        let sites = self.sites()?;
        let (site, _) = self.parts()?;
        if !site.derivatives()?.proved().is_affine_in_z() {
            return Err(RuntimeError::argument("site", NOT_AFFINE));
        }
        let names = self.place_names();
        // z counts in the first site.
        let mut terms = vec![names.site(self, "0", Some("z"))?];
        if sites > 1 {
            let others = names.site(self, &names.index, None)?;
            terms.push(format!("sum({}, 1, {}, {others})", names.index, sites - 1));
        }
        for along in 0..self.sizes.len() {
            names.bonds(self, along, sites, &mut terms)?;
        }
        let coordinates = match self.coordinates.as_slice() {
            [name] => vec![format!("{name}[{sites}]")],
            several => (0..sites).flat_map(|i| several.iter().map(move |name| format!("{name}_{i}"))).collect(),
        };
        Ok(SumOfTerms { lagrangian: terms.join(" +\n"), coordinates, parameters: self.parameters.clone() })
    }

    /// Names of the indices of sums that no text of the lattice has.
    fn place_names(&self) -> PlaceNames {
        let texts = [self.site.as_str(), self.bond.as_deref().unwrap_or_default()];
        let is_used = |name: &str| {
            texts.iter().any(|text| text.contains(name)) || self.parameters.iter().any(|(other, _)| other == name)
        };
        let free = |name: &str| {
            let mut name = name.to_owned();
            while is_used(&name) {
                name.push('_');
            }
            name
        };
        PlaceNames { index: free("i_"), inner: free("k_"), components: self.coordinates.len() }
    }
}

/// Names of the coordinates of a site in the text of a lattice.
struct PlaceNames {
    /// The index of a site in a sum, and that within a block of sites.
    index: String,
    inner: String,
    components: usize,
}

impl PlaceNames {
    /// Component c at a site, or its velocity.
    fn at(&self, name: &str, c: usize, site: &str, is_velocity: bool) -> String {
        let d = self.components;
        match (d, is_velocity) {
            (1, false) => format!("{name}[{site}]"),
            (1, true) => format!("{name}'[{site}]"),
            (_, false) => format!("q[{d}*({site}) + {c}]"),
            (_, true) => format!("v[{d}*({site}) + {c}]"),
        }
    }

    /// The Lagrangian of a site, with the action in the place of z, or without it.
    fn site(&self, lattice: &Lattice, site: &str, action: Option<&str>) -> Result<String, RuntimeError> {
        self.part("site", lattice, &lattice.site, &|name, is_velocity| {
            if name == "z" {
                return Some(action.unwrap_or("0").to_owned());
            }
            let c = lattice.coordinates.iter().position(|other| other == name)?;
            Some(self.at(name, c, site, is_velocity))
        })
    }

    /// The Lagrangian of a bond between two sites; a wall is `None`.
    fn bond(&self, lattice: &Lattice, text: &str, ends: [Option<&str>; 2]) -> Result<String, RuntimeError> {
        self.part("bond", lattice, text, &|name, is_velocity| {
            let of_side = |(c, own): (usize, &String)| {
                ["l", "r"].iter().zip(ends).find_map(|(side, site)| {
                    let is_it = name.strip_suffix(side) == Some(own.as_str());
                    is_it.then(|| site.map_or("0".to_owned(), |site| self.at(own, c, site, is_velocity)))
                })
            };
            lattice.coordinates.iter().enumerate().find_map(of_side)
        })
    }

    /// A part in brackets.
    fn part(
        &self,
        part: &'static str,
        lattice: &Lattice,
        text: &str,
        of: &dyn Fn(&str, bool) -> Option<String>,
    ) -> Result<String, RuntimeError> {
        let of_all = Cell::new(None);
        let is_parameter = |name: &str| lattice.parameters.iter().any(|(other, _)| other == name);
        let found = substitute(text, &|name, is_velocity| {
            let own = of(name, is_velocity);
            if let Some(shared) = ["q", "v", "n"].into_iter().find(|shared| own.is_none() && *shared == name) {
                // Of a parameter, it hides what the coordinates are written by where a site has several.
                if !is_parameter(name) || self.components > 1 && name != "n" {
                    of_all.set(Some(shared));
                }
            }
            own
        });
        match (found, of_all.get()) {
            (Ok(_), Some(name)) => Err(RuntimeError::argument(
                part,
                format!(
                    "uses `{name}`, which is that of all sites in the Lagrangian of the whole lattice: write coordinates by their \
                     names, and give another name to a parameter"
                ),
            )),
            (Ok(text), None) => Ok(format!("({text})")),
            (Err(error), _) => Err(RuntimeError::Part { part, error: Box::new(error.into()) }),
        }
    }

    /// Adds the bonds along a direction: those within its rows, and those between or beyond the ends.
    fn bonds(
        &self,
        lattice: &Lattice,
        along: usize,
        sites: usize,
        terms: &mut Vec<String>,
    ) -> Result<(), RuntimeError> {
        let Some(text) = &lattice.bond else { return Ok(()) };
        let size = lattice.sizes.get(along).copied().unwrap_or(1);
        let stride: usize = lattice.sizes.iter().skip(along + 1).product();
        let (block, outer) = (size * stride, sites / (size * stride).max(1));
        let (i, k) = (&self.index, &self.inner);
        let first = format!("{block}*{i} + {k}");
        let next = format!("{first} + {stride}");
        let last = format!("{first} + {}", block - stride);
        let mut add = |count: usize, ends: [Option<&str>; 2]| {
            if count > 0 {
                let bond = self.bond(lattice, text, ends)?;
                terms.push(format!("sum({i}, 0, {}, sum({k}, 0, {}, {bond}))", outer - 1, count - 1));
            }
            Ok::<(), RuntimeError>(())
        };
        add(block - stride, [Some(&first), Some(&next)])?;
        match lattice.boundary {
            Boundary::Periodic => add(stride, [Some(&last), Some(&first)]),
            Boundary::Free => Ok(()),
            Boundary::Fixed => {
                add(stride, [None, Some(&first)])?;
                add(stride, [Some(&last), None])
            }
        }
    }
}

impl Bodies {
    /// The Lagrangian as text, with the masses `m_0`, `m_1`, ..., `G` and `gamma` as parameters, and the coordinates `x_0`,
    /// `y_0`, ....
    ///
    /// ```
    /// use herglotz_runtime::Bodies;
    /// let pair = Bodies { masses: vec![1.0, 0.5], dimensions: 2, g: 1.0, gamma: -0.1 };
    /// assert_eq!(pair.sum_of_terms()?.coordinates, ["x_0", "y_0", "x_1", "y_1"]);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`system`](Self::system).
    pub fn sum_of_terms(&self) -> Result<SumOfTerms, RuntimeError> {
        self.check()?;
        let (n, axes) = (self.masses.len(), ["x", "y", "z"].iter().take(self.dimensions));
        let square = |of: &dyn Fn(&str) -> String| {
            axes.clone().map(|axis| format!("{}^2", of(axis))).collect::<Vec<_>>().join(" + ")
        };
        let mut terms: Vec<String> =
            (0..n).map(|i| format!("m_{i}*({})/2", square(&|axis| format!("{axis}_{i}'")))).collect();
        for i in 0..n {
            for j in i + 1..n {
                let distance = square(&|axis| format!("({axis}_{i} - {axis}_{j})"));
                terms.push(format!("G*m_{i}*m_{j}/sqrt({distance})"));
            }
        }
        terms.push("gamma*z".to_owned());
        let masses = self.masses.iter().enumerate().map(|(i, m)| (format!("m_{i}"), *m));
        Ok(SumOfTerms {
            lagrangian: terms.join(" + "),
            coordinates: (0..n).flat_map(|i| axes.clone().map(move |axis| format!("{axis}_{i}"))).collect(),
            parameters: masses.chain([("G".to_owned(), self.g), ("gamma".to_owned(), self.gamma)]).collect(),
        })
    }
}
