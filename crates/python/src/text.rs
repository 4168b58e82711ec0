//! Graphs as texts in the formula language.

use formula_lagrangian::{Function, Graph, Id, Node, Operation};
use std::collections::HashMap;
use std::fmt::Write;

/// The names of the variables that a graph refers to by index.
pub struct Names {
    pub coordinates: Vec<String>,
    /// The velocities, or the momenta of a Hamiltonian.
    pub velocities: Vec<String>,
    pub parameters: Vec<String>,
    pub tables: Vec<String>,
    /// The name of the action.
    pub action: String,
}

/// The nesting depth of brackets above which a subexpression gets a name: a quarter of what the parser accepts.
const MAX_DEPTH: usize = 50;

/// The text of a node. Subexpressions that are used more than once or are deeply nested become definitions before it.
pub fn text(graph: &Graph, root: Id, names: &Names) -> String {
    // Operands have smaller indices than the nodes that use them, so sorting puts them first.
    let mut uses: HashMap<Id, usize> = HashMap::new();
    let mut order = Vec::new();
    let mut open = vec![root];
    while let Some(id) = open.pop() {
        let count = uses.entry(id).or_insert(0);
        *count += 1;
        if *count == 1 {
            order.push(id);
            open.extend(graph.node(id).operands());
        }
    }
    order.sort_unstable();
    let mut definitions = String::new();
    let (mut written, mut count): (HashMap<Id, (String, usize)>, usize) = (HashMap::new(), 0);
    for id in order {
        let node = graph.node(id);
        let mut depth = 0;
        let mut of = |id: Id| {
            let (text, inside) = written.get(&id).map_or(("0", 0), |(text, depth)| (text.as_str(), *depth));
            depth = depth.max(inside + 1);
            text.to_owned()
        };
        let mut text = expression(&node, &mut of, names);
        let leaf = node.operands().next().is_none();
        if id != root && !leaf && (uses.get(&id).is_some_and(|uses| *uses > 1) || depth > MAX_DEPTH) {
            count += 1;
            let name = format!("_{count}");
            let _ = writeln!(definitions, "{name} = {text}");
            (text, depth) = (name, 0);
        }
        written.insert(id, (text, depth));
    }
    let (last, _) = written.remove(&root).unwrap_or_default();
    definitions + &last
}

/// A number with all its digits.
fn number(x: f64) -> String {
    if x.is_sign_negative() { format!("({x:?})") } else { format!("{x:?}") }
}

/// A node, in brackets unless it is a single word or a call.
fn expression(node: &Node, of: &mut dyn FnMut(Id) -> String, names: &Names) -> String {
    let name = |from: &[String], i: u32| from.get(i as usize).cloned().unwrap_or_else(|| "?".to_owned());
    match *node {
        Node::Number(bits) => number(f64::from_bits(bits)),
        Node::Parameter(i) => name(&names.parameters, i),
        Node::Position(i) => name(&names.coordinates, i),
        Node::Velocity(i) => name(&names.velocities, i),
        Node::Action => names.action.clone(),
        Node::Time => "t".to_owned(),
        Node::Unary(Function::Neg, a) => format!("(-{})", of(a)),
        Node::Unary(function, a) => format!("{}({})", function_name(function), of(a)),
        Node::Binary(operation, a, b) => {
            let (a, b) = (of(a), of(b));
            match operation {
                Operation::Add => format!("({a} + {b})"),
                Operation::Sub => format!("({a} - {b})"),
                Operation::Mul => format!("({a}*{b})"),
                Operation::Div => format!("({a}/{b})"),
                Operation::Min => format!("min({a}, {b})"),
                Operation::Max => format!("max({a}, {b})"),
                Operation::Atan2 => format!("atan2({a}, {b})"),
                Operation::Hypot => format!("hypot({a}, {b})"),
                Operation::Power => format!("pow({a}, {b})"),
            }
        }
        Node::Powi(a, n) => format!("({}^({n}))", of(a)),
        Node::Select([a, b, c, d]) => format!("if({} < {}, {}, {})", of(a), of(b), of(c), of(d)),
        // A traced function has no derivatives of tables.
        Node::Table { table, argument, .. } => format!("{}({})", name(&names.tables, table), of(argument)),
    }
}

fn function_name(function: Function) -> &'static str {
    match function {
        Function::Neg => "-",
        Function::Recip => "recip",
        Function::Sqrt => "sqrt",
        Function::Abs => "abs",
        Function::Sign => "sign",
        Function::Sin => "sin",
        Function::Cos => "cos",
        Function::Tan => "tan",
        Function::Versine => "versine",
        Function::Atan => "atan",
        Function::Sinh => "sinh",
        Function::Cosh => "cosh",
        Function::Tanh => "tanh",
        Function::Asinh => "asinh",
        Function::Acosh => "acosh",
        Function::Atanh => "atanh",
        Function::Exp => "exp",
        Function::ExpM1 => "expm1",
        Function::Ln => "ln",
        Function::Ln1p => "ln1p",
    }
}
