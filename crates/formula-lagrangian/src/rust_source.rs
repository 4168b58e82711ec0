//! Output of a Lagrangian as Rust source.

use crate::derived::Derived;
use crate::drag::ProvedForce;
use crate::node::Inputs;
use crate::{FormulaError, FormulaLagrangian, Function, Graph, Id, Node, Operation};
use contact_geom::Structure;
use std::fmt::{Display, Formatter, Write};

/// The keywords of Rust, which cannot be names of fields.
const KEYWORDS: [&str; 51] = [
    "as", "async", "await", "break", "const", "continue", "crate", "dyn", "else", "enum", "extern", "false", "fn",
    "for", "gen", "if", "impl", "in", "let", "loop", "match", "mod", "move", "mut", "pub", "ref", "return", "self",
    "Self", "static", "struct", "super", "trait", "true", "type", "unsafe", "use", "where", "while", "abstract",
    "become", "box", "do", "final", "macro", "override", "priv", "typeof", "unsized", "virtual", "yield",
];

/// The source of the functions that are not methods of `Scalar`, which is included where they are used.
const ATAN2: &str = include_str!("rust_source/atan2.txt");
const HYPOT: &str = include_str!("rust_source/hypot.txt");
const ASINH: &str = include_str!("rust_source/asinh.txt");
const ACOSH: &str = include_str!("rust_source/acosh.txt");
const ATANH: &str = include_str!("rust_source/atanh.txt");

impl<const N: usize> FormulaLagrangian<N> {
    /// The source of a file with this Lagrangian as a type. The parameters are its fields; value, gradient, force and
    /// structure are exactly those of the formula. Switching functions and breaks are not written. It needs the crate
    /// `contact-geom`.
    ///
    /// ```
    /// use formula_lagrangian::Formula;
    /// let formula = Formula::parse("x'^2/2 - k*x^2/2", &["x"], &[("k", 2.0)])?;
    /// assert!(formula.lagrangian::<1>()?.to_rust("Spring")?.contains("impl Lagrangian<1> for Spring"));
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::Name`] if `name` is not a valid name of a type; [`FormulaError::NotInRust`] if the formula has
    /// tables, resets or constraints.
    pub fn to_rust(&self, name: &str) -> Result<String, FormulaError> {
        let letters =
            name.chars().all(|c| c.is_ascii_alphanumeric()) && name.starts_with(|c: char| c.is_ascii_uppercase());
        if !letters || KEYWORDS.contains(&name) {
            return Err(FormulaError::Name {
                name: name.to_owned(),
                why: "is not a valid name of a Rust type, such as `MySystem`",
            });
        }
        if !self.derived.formula.graph.tables().is_empty() {
            return Err(FormulaError::NotInRust { what: "tables" });
        }
        if self.resets() > 0 {
            return Err(FormulaError::NotInRust { what: "resets" });
        }
        if self.derived.formula.constraints() > 0 {
            return Err(FormulaError::NotInRust { what: "constraints" });
        }
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = self.derived.write_rust(&mut text, name);
        Ok(text)
    }
}

impl Derived {
    fn write_rust(&self, out: &mut String, name: &str) -> std::fmt::Result {
        let (graph, root, n) = (&self.formula.graph, self.formula.root, self.formula.dimension());
        let fields: Vec<String> = self.formula.parameters().map(|(name, _)| field(name)).collect();
        let coordinates = self.formula.coordinates().join(", ");
        writeln!(
            out,
            "//! A Lagrangian of the coordinates {coordinates}, made from its formula by formula-lagrangian.\n"
        )?;
        writeln!(out, "use contact_geom::nalgebra::SVector;")?;
        let forced = self.applied.is_some();
        let [structure, hints] = if forced { ["ForceStructure, ", "Hints, "] } else { [""; 2] };
        writeln!(
            out,
            "use contact_geom::{{ChartVector, {structure}{hints}Lagrangian, Scalar, Structure, VelocityPoint}};\n"
        )?;
        writeln!(out, "/// The Lagrangian with its parameters.\n#[derive(Clone, Copy, Debug, PartialEq)]")?;
        if fields.is_empty() {
            writeln!(out, "pub struct {name};\n")?;
        } else {
            writeln!(out, "pub struct {name} {{")?;
            for ((parameter, value), field) in self.formula.parameters().zip(&fields) {
                writeln!(out, "    /// The parameter {parameter}, {value} in the formula.\n    pub {field}: f64,")?;
            }
            writeln!(out, "}}\n")?;
        }
        writeln!(out, "impl Lagrangian<{n}> for {name} {{")?;
        if forced {
            writeln!(out, "    const HINTS: Hints = Hints {{ forced: true, ..Hints::NONE }};\n")?;
        }
        writeln!(out, "    #[inline(always)]")?;
        let vector = format!("&SVector<T, {n}>");
        let value = Body { graph, results: &[root], fields: &fields, point: "" };
        let [t, q, v, z] = value.names(&["t", "q", "v", "z"]);
        writeln!(out, "    fn value<T: Scalar>(&self, {t}: T, {q}: {vector}, {v}: {vector}, {z}: T) -> T {{")?;
        write!(out, "{value}")?;
        writeln!(out, "        {}\n    }}\n", value.number(root))?;

        let body = Body { graph, results: &self.partials, fields: &fields, point: "x." };
        let [t, x, ..] = body.names(&["t", "x", "x", "x"]);
        writeln!(out, "    #[inline(always)]")?;
        let triple = format!("Option<ChartVector<{n}, T>>");
        writeln!(out, "    fn closed_gradient<T: Scalar>(&self, {t}: T, {x}: &VelocityPoint<{n}, T>) -> {triple} {{")?;
        write!(out, "{body}")?;
        // The derivatives with respect to all of q come first, including coordinates beyond those of the formula.
        let first_velocity = self.partials.len() / 2;
        let part = |from: usize| {
            let ids = self.partials.iter().skip(from).take(n);
            ids.map(|id| body.number(*id)).collect::<Vec<_>>().join(", ")
        };
        let z = self.partials.last().map(|id| body.number(*id)).unwrap_or_default();
        writeln!(
            out,
            "        let (l_q, l_v) = (SVector::from([{}]), SVector::from([{}]));",
            part(0),
            part(first_velocity)
        )?;
        writeln!(out, "        Some(ChartVector {{ x: l_q, y: l_v, z: {z} }})\n    }}\n")?;

        let Structure { autonomous, z_affine, constant_rate, quadratic, constant_mass, .. } = self.structure;
        // The present values of parameters are not used here, since the fields can be changed.
        let separable = self.unforced.separable;
        let z_free = !graph.inputs(root).meets(Inputs::ACTION);
        writeln!(out, "    fn structure(&self) -> Structure {{\n        Structure {{")?;
        let claims = [
            ("autonomous", autonomous),
            ("z_free", z_free),
            ("z_affine", z_affine),
            ("constant_rate", constant_rate),
            ("separable", separable),
            ("quadratic", quadratic),
            ("constant_mass", constant_mass),
        ];
        for (claim, _) in claims.iter().filter(|(_, made)| *made) {
            writeln!(out, "            {claim}: true,")?;
        }
        writeln!(out, "            ..Structure::default()\n        }}\n    }}")?;
        let force = Body { graph, results: &self.applied_nodes, fields: &fields, point: "x." };
        if forced {
            self.write_force(out, &force, n)?;
        }
        writeln!(out, "}}")?;
        let uses = |of: &dyn Fn(Node) -> bool| body.uses(of) || value.uses(of) || force.uses(of);
        let operation = |of| uses(&|node| matches!(node, Node::Binary(o, ..) if o == of));
        let function = |of| uses(&|node| matches!(node, Node::Unary(f, _) if f == of));
        let [asinh, acosh, atanh] = [Function::Asinh, Function::Acosh, Function::Atanh].map(function);
        let helpers = [
            (operation(Operation::Atan2), ATAN2),
            (operation(Operation::Hypot) || asinh, HYPOT),
            (asinh, ASINH),
            (acosh, ACOSH),
            (atanh, ATANH),
        ];
        for (_, helper) in helpers.iter().filter(|(used, _)| *used) {
            write!(out, "\n{helper}")?;
        }
        Ok(())
    }

    /// The methods for the applied force.
    fn write_force(&self, out: &mut String, force: &Body<'_>, n: usize) -> std::fmt::Result {
        let list = |body: &Body<'_>, of: &dyn Fn(&Body<'_>, Id) -> String| {
            body.results.iter().map(|id| of(body, *id)).collect::<Vec<_>>().join(", ")
        };
        let [t, x, ..] = force.names(&["t", "x", "x", "x"]);
        writeln!(out, "\n    #[inline(always)]")?;
        let arguments = format!("&self, {t}: T, {x}: &VelocityPoint<{n}, T>");
        writeln!(out, "    fn applied_force<T: Scalar>({arguments}) -> SVector<T, {n}> {{")?;
        write!(out, "{force}")?;
        writeln!(out, "        SVector::from([{}])\n    }}\n", list(force, &|body, id| body.number(id)))?;
        if let ProvedForce::Drag { linear, quadratic } = &self.proved_force {
            let results: Vec<Id> = linear.iter().map(|c| c.node).collect();
            let (linear, quadratic) = (Body { results: &results, ..*force }, quadratic.node);
            let all: Vec<Id> = results.iter().copied().chain([quadratic]).collect();
            writeln!(out, "    fn force_structure(&self) -> ForceStructure<{n}> {{")?;
            write!(out, "{}", Body { results: &all, ..*force })?;
            let (linear, quadratic) = (list(&linear, &|body, id| body.operand(id)), force.operand(quadratic));
            writeln!(
                out,
                "        ForceStructure::Drag {{ linear: SVector::from([{linear}]), quadratic: {quadratic} }}\n    }}"
            )
        } else {
            writeln!(
                out,
                "    fn force_structure(&self) -> ForceStructure<{n}> {{\n        ForceStructure::General\n    }}"
            )
        }
    }
}

/// The name of a parameter's field.
fn field(name: &str) -> String {
    if KEYWORDS.contains(&name) { format!("{name}_") } else { name.to_owned() }
}

/// The statements that compute given nodes.
struct Body<'a> {
    graph: &'a Graph,
    results: &'a [Id],
    fields: &'a [String],
    /// The prefix of q, v and z.
    point: &'a str,
}

impl Body<'_> {
    /// The nodes that are computed, in order.
    fn nodes(&self) -> impl Iterator<Item = Id> {
        let mut needed: Vec<bool> = Vec::new();
        for result in self.results {
            let of_one = self.graph.needed(*result);
            needed.resize(needed.len().max(of_one.len()), false);
            needed.iter_mut().zip(of_one).for_each(|(all, one)| *all |= one);
        }
        needed.into_iter().enumerate().filter(|(_, needed)| *needed).map(|(i, _)| Id(i as u32))
    }

    fn uses(&self, of: impl Fn(Node) -> bool) -> bool {
        self.nodes().any(|id| of(self.graph.node(id)))
    }

    /// The names of the arguments, with an underscore before those that are not used.
    fn names(&self, names: &[&str; 4]) -> [String; 4] {
        let inputs = self.results.iter().fold(Inputs::NONE, |all, id| all.and(self.graph.inputs(*id)));
        names.map(|name| {
            let of = match name {
                "t" => Inputs::TIME,
                "q" => Inputs::POSITION,
                "v" => Inputs::VELOCITY,
                "z" => Inputs::ACTION,
                _ => Inputs::POSITION.and(Inputs::VELOCITY).and(Inputs::ACTION),
            };
            if inputs.meets(of) { name.to_owned() } else { format!("_{name}") }
        })
    }

    /// A node as an operand, of type f64 if it is constant.
    fn operand(&self, id: Id) -> String {
        match self.graph.node(id) {
            Node::Number(bits) => literal(f64::from_bits(bits)),
            Node::Parameter(i) => format!("self.{}", self.fields.get(i as usize).map_or("", String::as_str)),
            Node::Position(i) => format!("{}q[{i}]", self.point),
            Node::Velocity(i) => format!("{}v[{i}]", self.point),
            Node::Action => format!("{}z", self.point),
            Node::Time => "t".to_owned(),
            _ => format!("a{}", id.index()),
        }
    }

    /// A node on the right of an operator.
    fn right_operand(&self, id: Id) -> String {
        let operand = self.operand(id);
        if operand.starts_with('-') { format!("({operand})") } else { operand }
    }

    /// A node as an expression of type T.
    fn number(&self, id: Id) -> String {
        let operand = self.operand(id);
        if self.graph.is_constant(id) { format!("T::from({operand})") } else { operand }
    }

    /// The right-hand side of the statement of a node; `None` for a node that is an operand by itself.
    fn right(&self, id: Id) -> Option<String> {
        let (o, n, constant) = (|id| self.operand(id), |id| self.number(id), |id| self.graph.is_constant(id));
        let r = |id| self.right_operand(id);
        // All operands are of type T if the node is.
        let all = |ids: [Id; 2]| if constant(id) { ids.map(o) } else { ids.map(n) };
        Some(match self.graph.node(id) {
            Node::Unary(Function::Neg, a) => format!("-{}", o(a)),
            Node::Unary(f, a) => format!("{}({})", method(f), o(a)),
            Node::Powi(a, 3) => format!("{0} * {0} * {0}", o(a)),
            Node::Powi(a, n) => format!("Scalar::powi({}, {n})", o(a)),
            Node::Select([a, b, c, d]) => {
                let ([a, b], [c, d]) = (all([a, b]), all([c, d]));
                format!("Scalar::if_less({a}, {b}, {c}, {d})")
            }
            Node::Binary(operation, a, b) => {
                let both = !constant(id) && constant(a);
                match operation {
                    Operation::Add if both => format!("{} + {}", o(b), r(a)),
                    Operation::Add => format!("{} + {}", o(a), r(b)),
                    Operation::Sub if both => format!("-{} + {}", o(b), r(a)),
                    Operation::Sub => format!("{} - {}", o(a), r(b)),
                    Operation::Mul if both => format!("{} * {}", o(b), r(a)),
                    Operation::Mul => format!("{} * {}", o(a), r(b)),
                    Operation::Div if both => format!("{} / {}", n(a), r(b)),
                    Operation::Div => format!("{} / {}", o(a), r(b)),
                    Operation::Power => format!("Scalar::powf({}, {})", o(a), o(b)),
                    Operation::Min | Operation::Max | Operation::Atan2 | Operation::Hypot => {
                        let [a, b] = all([a, b]);
                        let function = match operation {
                            Operation::Min => "Scalar::min",
                            Operation::Max => "Scalar::max",
                            Operation::Atan2 => "atan2",
                            _ => "hypot",
                        };
                        format!("{function}({a}, {b})")
                    }
                }
            }
            _ => return None,
        })
    }
}

impl Display for Body<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        for id in self.nodes() {
            if let Some(right) = self.right(id) {
                let of = if self.graph.is_constant(id) { "f64" } else { "T" };
                writeln!(f, "        let a{}: {of} = {right};", id.index())?;
            }
        }
        Ok(())
    }
}

/// A number as a Rust literal, exactly.
fn literal(x: f64) -> String {
    match x {
        _ if x.is_nan() => "f64::NAN".to_owned(),
        f64::INFINITY => "f64::INFINITY".to_owned(),
        f64::NEG_INFINITY => "f64::NEG_INFINITY".to_owned(),
        _ => format!("{x:?}"),
    }
}

/// The method of a function, or the name of its included source.
fn method(function: Function) -> &'static str {
    match function {
        Function::Neg => "Scalar::neg",
        Function::Recip => "Scalar::recip",
        Function::Sqrt => "Scalar::sqrt",
        Function::Abs => "Scalar::abs",
        Function::Sign => "Scalar::signum",
        Function::Sin => "Scalar::sin",
        Function::Cos => "Scalar::cos",
        Function::Tan => "Scalar::tan",
        Function::Versine => "Scalar::versine",
        Function::Atan => "Scalar::atan",
        Function::Sinh => "Scalar::sinh",
        Function::Cosh => "Scalar::cosh",
        Function::Tanh => "Scalar::tanh",
        Function::Asinh => "asinh",
        Function::Acosh => "acosh",
        Function::Atanh => "atanh",
        Function::Exp => "Scalar::exp",
        Function::ExpM1 => "Scalar::exp_m1",
        Function::Ln => "Scalar::ln",
        Function::Ln1p => "Scalar::ln_1p",
    }
}
