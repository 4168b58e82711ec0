//! Tables in expressions.

use crate::names::NamedTable;
use crate::{Formula, FormulaError, FormulaNames, Graph, Id, Node};
use contact_geom::table::Table;

impl Graph {
    /// The value of a table at a node. The table becomes one of the graph's [`tables`](Self::tables).
    ///
    /// ```
    /// use contact_geom::table::{Interpolation, Table};
    /// use formula_lagrangian::Graph;
    /// let mut graph = Graph::new();
    /// let table = Table::new(&[0.0, 1.0], &[0.0, 2.0], Interpolation::Linear)?;
    /// let t = graph.time();
    /// let drive = graph.interpolate(&table, t);
    /// let slope = graph.gradient(drive, &[t], 100).unwrap_or_default();
    /// assert_eq!((graph.tables().len(), slope.len()), (1, 1));
    /// # Ok::<(), contact_geom::table::TableError>(())
    /// ```
    pub fn interpolate(&mut self, table: &Table, argument: Id) -> Id {
        let index = self.add_table(table);
        self.lookup(index, 0, argument)
    }

    /// The index of a table, which is added unless the graph has it.
    pub(crate) fn add_table(&mut self, table: &Table) -> u32 {
        let known = self.tables().iter().position(|other| other == table);
        let index = known.unwrap_or(self.tables().len());
        if known.is_none() {
            self.push_table(table.clone());
        }
        index as u32
    }

    /// A derivative of a table of the graph at a node.
    pub(crate) fn lookup(&mut self, table: u32, order: u8, argument: Id) -> Id {
        let Some(of) = self.tables().get(table as usize) else { return self.number(f64::NAN) };
        if usize::from(order) > of.degree() {
            return self.number(0.0);
        }
        match self.as_number(argument) {
            Some(x) => {
                let value = of.derivative(usize::from(order), x);
                self.number(value)
            }
            None => self.intern(Node::Table { table, order, argument }),
        }
    }
}

impl Formula {
    /// Parses a text as [`parse`](Self::parse), in which tables are functions by their names, such as `drive(t)`. Their
    /// times become [breaks](contact_geom::Lagrangian::breaks) if the argument is an affine function of t such as
    /// `2*t - t0`, and otherwise one switching function each. A table is constant beyond its samples.
    ///
    /// ```
    /// use contact_geom::{Lagrangian, table::{Interpolation, Table}};
    /// use formula_lagrangian::Formula;
    /// let drive = Table::new(&[0.0, 1.0, 3.0], &[0.0, 2.0, 0.0], Interpolation::Linear)?;
    /// let text = "x'^2/2 - x^2/2 + x*drive(t - 1)";
    /// let formula = Formula::parse_with_tables(text, &["x"], &[], &[("drive", drive)])?;
    /// assert_eq!(formula.lagrangian::<1>()?.breaks(), [1.0, 2.0, 4.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`parse`](Self::parse), and [`FormulaError::Name`] if the name of a table is invalid.
    pub fn parse_with_tables(
        text: &str,
        coordinates: &[&str],
        parameters: &[(&str, f64)],
        tables: &[(&str, Table)],
    ) -> Result<Self, FormulaError> {
        Self::parse_lagrangian(text, &FormulaNames { tables, ..FormulaNames::new(coordinates, parameters) })
    }

    /// The same formula with one more table for the texts that are parsed with it later: forces, resets, and other
    /// expressions.
    ///
    /// # Errors
    /// [`FormulaError::Name`] if the name is invalid.
    pub fn with_table(&self, name: &str, table: &Table) -> Result<Self, FormulaError> {
        let mut formula = self.clone();
        formula.add_table(name, table)?;
        Ok(formula)
    }

    pub(crate) fn add_table(&mut self, name: &str, table: &Table) -> Result<(), FormulaError> {
        self.names.check(name)?;
        let index = self.graph.add_table(table);
        self.names.tables.push(NamedTable { name: name.to_owned(), index });
        Ok(())
    }

    /// The tables by their names, in the order in which they were given.
    pub fn tables(&self) -> impl Iterator<Item = (&str, &Table)> {
        let of = |index: u32| self.graph.tables().get(index as usize);
        self.names.tables.iter().filter_map(move |table| Some((table.name.as_str(), of(table.index)?)))
    }
}
