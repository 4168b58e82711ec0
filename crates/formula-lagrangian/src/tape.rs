//! Straight-line register code, compiled from a graph.

use crate::node::Inputs;
use crate::{Function, Graph, Id, Node, Operation};
use contact_geom::table::Table;

/// One instruction: it writes to the register `to` a function of the registers `a` and `b` and of `extra`, which holds
/// a constant by its bits, an exponent, or two more registers. An instruction has two machine words, so that reading
/// the program does not limit its speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Instruction {
    pub code: Code,
    pub to: u16,
    pub a: u16,
    pub b: u16,
    pub extra: u64,
}

/// The operand that stands for the result of the previous instruction, which need not be loaded from memory.
pub(crate) const PREVIOUS: u16 = u16::MAX;

/// The operation of an instruction, with `k` the constant and `c`, `d` the registers in `extra`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Code {
    Add,
    Sub,
    Mul,
    Div,
    /// `a b + c`, with the product and the sum rounded separately, as in Rust code.
    MulAdd,
    /// `c - a b`, rounded in the same way.
    MulSub,
    /// `a + k`.
    AddConstant,
    /// `k - a`.
    ConstantSub,
    /// `a k`.
    MulConstant,
    /// `a / k`.
    DivConstant,
    /// `k / a`.
    ConstantDiv,
    /// `a k + b`, with the product and the sum rounded separately.
    MulConstantAdd,
    /// `b - a k`, rounded in the same way.
    MulConstantSub,
    /// `a b k`, evaluated from the left.
    ScaledProduct,
    Function(Function),
    Min,
    Max,
    Atan2,
    Hypot,
    /// `a^k`.
    Power,
    /// `a^n`, with n in `extra`.
    Powi,
    Select,
    /// A derivative of a table at `a`, with the index of the table and the order in `extra`.
    Table,
    /// The constant itself.
    Constant,
}

impl Instruction {
    /// The registers `c` and `d`.
    #[inline(always)]
    pub fn third_and_fourth(&self) -> [u16; 2] {
        [self.extra as u16, (self.extra >> 16) as u16]
    }

    /// The constant.
    #[inline(always)]
    pub fn constant(&self) -> f64 {
        f64::from_bits(self.extra)
    }

    /// The index of the table, and the order of its derivative.
    #[inline(always)]
    pub fn table_and_order(&self) -> (usize, usize) {
        (self.extra as u32 as usize, (self.extra >> 32) as usize)
    }

    /// Replaces operands by [`PREVIOUS`] if they are the register that the previous instruction has written.
    fn follow(&mut self, written: u16) {
        let [c, d] = self.third_and_fourth();
        let follow = |operand: u16| if operand == written { PREVIOUS } else { operand };
        let after = |c: u16, d: u16| u64::from(follow(c)) | u64::from(follow(d)) << 16;
        match self.code {
            Code::Constant => {}
            Code::Select | Code::MulAdd | Code::MulSub => {
                (self.a, self.b, self.extra) = (follow(self.a), follow(self.b), after(c, d))
            }
            _ => (self.a, self.b) = (follow(self.a), follow(self.b)),
        }
    }
}

/// The location of a result.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub register: u16,
    /// Whether the result is the negative of the register, as for most forces, which are negative slopes.
    pub negative: bool,
}

/// The first registers of the inputs of each kind; `None` for inputs that are not read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InputRegisters {
    pub q: Option<u16>,
    pub v: Option<u16>,
    pub z: Option<u16>,
    pub t: Option<u16>,
}

/// Straight-line code that computes nodes of a graph. The inputs that it reads are in the first registers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    pub code: Vec<Instruction>,
    pub results: Vec<Place>,
    /// The number of registers.
    pub registers: usize,
    pub inputs: InputRegisters,
    /// The tables of the graph, if one of them is read.
    pub tables: Vec<Table>,
    /// The indices of the instructions with a constant, and the nodes of these constants.
    constants: Vec<(usize, Id)>,
}

/// The state of the compilation: the assignment of nodes to registers.
struct Builder<'g> {
    graph: &'g Graph,
    tape: Tape,
    /// The register of each node that has one.
    place: Vec<Option<u16>>,
    /// The number of remaining reads of each node.
    uses: Vec<u32>,
    free: Vec<u16>,
}

impl Tape {
    /// The code for nodes of a graph over `dimension` coordinates; `None` if it needs more registers or constants than
    /// can be numbered.
    pub fn new(graph: &Graph, nodes: &[Id], dimension: usize) -> Option<Self> {
        let last = nodes.iter().map(|id| id.index() + 1).max().unwrap_or(0);
        let mut uses = vec![0_u32; last];
        for id in nodes {
            // One more than the number of readers, so that the registers of results are not reused.
            uses[id.index()] += 1;
        }
        for i in (0..last).rev() {
            if uses[i] > 0 && !graph.is_constant(Id(i as u32)) {
                for a in graph.node(Id(i as u32)).operands() {
                    uses[a.index()] += 1;
                }
            }
        }
        let reads = nodes.iter().fold(Inputs::NONE, |all, id| all.and(graph.inputs(*id)));
        let mut registers = 0;
        let mut of = |kind: Inputs, count: usize| {
            let first = u16::try_from(registers).ok().filter(|_| reads.meets(kind));
            registers += first.map_or(0, |_| count);
            first
        };
        let (q, v) = (of(Inputs::POSITION, dimension), of(Inputs::VELOCITY, dimension));
        let inputs = InputRegisters { q, v, z: of(Inputs::ACTION, 1), t: of(Inputs::TIME, 1) };
        let tape = Tape { registers, inputs, ..Tape::default() };
        let (place, free) = (vec![None; last], Vec::new());
        let mut builder = Builder { graph, tape, place, uses, free };
        let results: Vec<(Id, bool)> = nodes.iter().map(|id| builder.without_sign(*id)).collect();
        for (id, _) in &results {
            builder.compute(*id)?;
        }
        for (id, negative) in results {
            let register = builder.register(id)?;
            builder.tape.results.push(Place { register, negative });
        }
        let mut tape = builder.tape;
        for i in 1..tape.code.len() {
            let written = tape.code[i - 1].to;
            tape.code[i].follow(written);
        }
        Some(tape)
    }

    /// Sets the constants for other values of the parameters, from the values of all nodes of the graph.
    pub fn set_constants(&mut self, values: &[f64]) {
        for (instruction, source) in &self.constants {
            if let Some(instruction) = self.code.get_mut(*instruction) {
                instruction.extra = values.get(source.index()).copied().unwrap_or(f64::NAN).to_bits();
            }
        }
    }
}

impl Tape {
    /// The nodes of its constants, which are numbered anew in this order: [`set_constants`](Self::set_constants) then takes
    /// their values alone.
    pub fn take_constants(&mut self) -> Vec<Id> {
        let numbered = self.constants.iter_mut().enumerate();
        numbered.map(|(i, (_, source))| std::mem::replace(source, Id(i as u32))).collect()
    }
}

impl Builder<'_> {
    /// Emits the code for a node and for all nodes on which it depends, without recursion. Operands come before the
    /// nodes that read them.
    fn compute(&mut self, root: Id) -> Option<()> {
        let mut stack = vec![(root, false)];
        while let Some((id, ready)) = stack.pop() {
            if self.graph.is_constant(id) || self.place[id.index()].is_some() {
                continue;
            }
            if ready {
                self.write(id)?;
                continue;
            }
            stack.push((id, true));
            // The operand that was built last usually has the deepest subexpression. It is computed last, directly
            // before its reader.
            let mut operands: Vec<Id> = self.parts(id).into_iter().flatten().collect();
            operands.sort_unstable_by(|a, b| b.cmp(a));
            stack.extend(operands.into_iter().map(|a| (a, false)));
        }
        Some(())
    }

    /// A result without a change of sign, and whether there is one. A constant keeps its sign.
    fn without_sign(&mut self, id: Id) -> (Id, bool) {
        match self.graph.node(id) {
            Node::Unary(Function::Neg, a) if !self.graph.is_constant(id) => {
                // One more reader, which is never released, so that the register is kept.
                self.uses[a.index()] += 1;
                (a, true)
            }
            _ => (id, false),
        }
    }

    /// The factors of a product that has only one reader, so that it can be fused with this reader.
    fn product(&self, id: Id) -> Option<(Id, Id)> {
        match self.graph.node(id) {
            Node::Binary(Operation::Mul, a, b)
                if self.uses[id.index()] == 1 && self.place[id.index()].is_none() && !self.graph.is_constant(id) =>
            {
                Some((a, b))
            }
            _ => None,
        }
    }

    /// The operands of a node that must be in registers when its instruction is emitted.
    fn parts(&self, id: Id) -> [Option<Id>; 4] {
        let node = self.graph.node(id);
        if let Some(([x, y], c)) = self.fused(node) {
            return [Some(x), Some(y), Some(c), None];
        }
        if let Some(([x, y], _)) = self.scaled(node) {
            return [Some(x), Some(y), None, None];
        }
        let mut operands = node.operands();
        std::array::from_fn(|_| operands.next())
    }

    /// For a sum with a product, or a difference that subtracts a product: its factors, and the other term.
    fn fused(&self, node: Node) -> Option<([Id; 2], Id)> {
        let of = |product: Id, other: Id| {
            let (x, y) = self.product(product).filter(|_| product != other && !self.graph.is_constant(other))?;
            Some(([x, y], other))
        };
        match node {
            Node::Binary(Operation::Add, a, b) => of(b, a).or_else(|| of(a, b)),
            Node::Binary(Operation::Sub, a, b) => of(b, a),
            _ => None,
        }
    }

    /// For the product of two registers and a constant: the two factors, and the constant.
    fn scaled(&self, node: Node) -> Option<([Id; 2], Id)> {
        let constant = |id: Id| self.graph.is_constant(id);
        let (product, k) = match node {
            Node::Binary(Operation::Mul, a, k) if constant(k) => (a, k),
            Node::Binary(Operation::Mul, k, a) if constant(k) => (a, k),
            _ => return None,
        };
        let (x, y) = self.product(product).filter(|(x, y)| !constant(*x) && !constant(*y))?;
        Some(([x, y], k))
    }

    fn allocate(&mut self) -> Option<u16> {
        if let Some(register) = self.free.pop() {
            return Some(register);
        }
        let register = u16::try_from(self.tape.registers).ok().filter(|register| *register < PREVIOUS)?;
        self.tape.registers += 1;
        Some(register)
    }

    fn emit(&mut self, code: Code, to: u16, [a, b]: [u16; 2], extra: u64) {
        self.tape.code.push(Instruction { code, to, a, b, extra });
    }

    /// Records that the next instruction contains the value of a constant node.
    fn note_constant(&mut self, id: Id) {
        self.tape.constants.push((self.tape.code.len(), id));
    }

    /// The register of a node that is an input, is computed, or is a constant. A constant is first loaded into a
    /// register.
    fn register(&mut self, id: Id) -> Option<u16> {
        let InputRegisters { q, v, z, t } = self.tape.inputs;
        let input = match self.graph.node(id) {
            Node::Position(i) => Some((q, i)),
            Node::Velocity(i) => Some((v, i)),
            Node::Action => Some((z, 0)),
            Node::Time => Some((t, 0)),
            _ => None,
        };
        if let Some((first, i)) = input {
            return u16::try_from(i).ok().and_then(|i| first?.checked_add(i));
        }
        if let Some(place) = self.place[id.index()] {
            return Some(place);
        }
        let to = self.allocate()?;
        self.note_constant(id);
        self.emit(Code::Constant, to, [0, 0], self.number(id));
        self.place[id.index()] = Some(to);
        Some(to)
    }

    /// The bits of a node that is a number; the bits of parameters are set later.
    fn number(&self, id: Id) -> u64 {
        self.graph.as_number(id).unwrap_or(f64::NAN).to_bits()
    }

    /// Records one read of a node; its register is free after the last read.
    fn release(&mut self, id: Id) {
        let uses = &mut self.uses[id.index()];
        *uses = uses.saturating_sub(1);
        let is_input = matches!(self.graph.node(id), Node::Position(_) | Node::Velocity(_) | Node::Action | Node::Time);
        if *uses == 0
            && !is_input
            && let Some(place) = self.place[id.index()].take()
        {
            self.free.push(place);
        }
    }

    /// Emits the instruction of a node whose operands are available.
    fn write(&mut self, id: Id) -> Option<()> {
        let node = self.graph.node(id);
        if matches!(node, Node::Position(_) | Node::Velocity(_) | Node::Action | Node::Time) {
            return Some(());
        }
        let constant = |id: Id| self.graph.is_constant(id);
        let (code, read, slot) = if let Some(([x, y], c)) = self.fused(node) {
            let (scaled, product) = match node {
                Node::Binary(Operation::Sub, ..) => (Code::MulConstantSub, Code::MulSub),
                _ => (Code::MulConstantAdd, Code::MulAdd),
            };
            match (constant(x), constant(y)) {
                (_, true) => (scaled, vec![x, c], Some(y)),
                (true, _) => (scaled, vec![y, c], Some(x)),
                _ => (product, vec![x, y, c], None),
            }
        } else if let Some(([x, y], k)) = self.scaled(node) {
            (Code::ScaledProduct, vec![x, y], Some(k))
        } else {
            match node {
                Node::Binary(Operation::Add, a, b) if constant(b) => (Code::AddConstant, vec![a], Some(b)),
                Node::Binary(Operation::Add, a, b) if constant(a) => (Code::AddConstant, vec![b], Some(a)),
                Node::Binary(Operation::Sub, a, b) if constant(a) => (Code::ConstantSub, vec![b], Some(a)),
                Node::Binary(Operation::Mul, a, b) if constant(b) => (Code::MulConstant, vec![a], Some(b)),
                Node::Binary(Operation::Mul, a, b) if constant(a) => (Code::MulConstant, vec![b], Some(a)),
                Node::Binary(Operation::Div, a, b) if constant(b) => (Code::DivConstant, vec![a], Some(b)),
                Node::Binary(Operation::Div, a, b) if constant(a) => (Code::ConstantDiv, vec![b], Some(a)),
                Node::Binary(Operation::Power, a, b) => (Code::Power, vec![a], Some(b)),
                Node::Binary(operation, a, b) => {
                    let code = match operation {
                        Operation::Add => Code::Add,
                        Operation::Sub => Code::Sub,
                        Operation::Mul => Code::Mul,
                        Operation::Div => Code::Div,
                        Operation::Min => Code::Min,
                        Operation::Max => Code::Max,
                        Operation::Atan2 => Code::Atan2,
                        Operation::Hypot => Code::Hypot,
                        Operation::Power => Code::Power,
                    };
                    (code, vec![a, b], None)
                }
                Node::Unary(f, a) => (Code::Function(f), vec![a], None),
                Node::Powi(a, 3) => {
                    // The square is computed in a register of its own, then the cube.
                    let from = self.register(a)?;
                    let square = self.allocate()?;
                    self.emit(Code::Mul, square, [from, from], 0);
                    self.free.push(square);
                    self.release(a);
                    let to = self.allocate()?;
                    self.emit(Code::Mul, to, [square, from], 0);
                    self.place[id.index()] = Some(to);
                    return Some(());
                }
                Node::Powi(a, n) => {
                    let from = self.register(a)?;
                    self.release(a);
                    let to = self.allocate()?;
                    self.emit(Code::Powi, to, [from, 0], u64::from(n as u32));
                    self.place[id.index()] = Some(to);
                    return Some(());
                }
                Node::Select(all) => (Code::Select, all.to_vec(), None),
                Node::Table { table, order, argument } => {
                    if self.tape.tables.is_empty() {
                        self.tape.tables = self.graph.tables().to_vec();
                    }
                    let from = self.register(argument)?;
                    self.release(argument);
                    let to = self.allocate()?;
                    self.emit(Code::Table, to, [from, 0], u64::from(table) | u64::from(order) << 32);
                    self.place[id.index()] = Some(to);
                    return Some(());
                }
                _ => return None,
            }
        };
        let mut registers = Vec::with_capacity(4);
        for a in &read {
            registers.push(self.register(*a)?);
        }
        for a in node.operands() {
            if self.product(a).is_some() && !read.contains(&a) {
                self.graph.node(a).operands().for_each(|factor| self.release(factor));
            } else {
                self.release(a);
            }
        }
        let to = self.allocate()?;
        let operand = |i: usize| registers.get(i).copied().unwrap_or(0);
        let extra = match slot {
            Some(slot) => {
                self.note_constant(slot);
                self.number(slot)
            }
            None => u64::from(operand(2)) | u64::from(operand(3)) << 16,
        };
        self.emit(code, to, [operand(0), operand(1)], extra);
        self.place[id.index()] = Some(to);
        Some(())
    }
}
