//! Straight code in registers, made of a graph.

use crate::node::Inputs;
use crate::{Function, Graph, Id, Node, Operation};

/// One instruction: what is written to the register `to`, of the registers `a` and `b` and of what is in `extra`: a constant by its
/// bits, an exponent, or two registers more. In two words, so that a program is read as fast as it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Instruction {
    pub code: Code,
    pub to: u16,
    pub a: u16,
    pub b: u16,
    pub extra: u64,
}

/// The operand that is the result of the instruction before: it does not have to come from memory.
pub(crate) const PREVIOUS: u16 = u16::MAX;

/// What an instruction does, with `k` the constant and `c`, `d` the registers in `extra`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Code {
    Add,
    Sub,
    Mul,
    Div,
    /// `a b + c`, each rounded, as Rust code is.
    MulAdd,
    /// `c - a b`, likewise.
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
    /// `a k + b`, each rounded.
    MulConstantAdd,
    /// `b - a k`, likewise.
    MulConstantSub,
    /// `a b k`, from the left.
    ScaledProduct,
    Function(Function),
    Min,
    Max,
    Atan2,
    Hypot,
    /// `a^k`.
    Power,
    /// `a^n`, n in `extra`.
    Powi,
    Select,
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

    /// Reads what was last written to a register where that is an operand.
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

/// Where a result is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub register: u16,
    /// Whether it is the negative of what is there: as most forces are, of slopes.
    pub negative: bool,
}

/// The first registers of the inputs of each kind; `None` of those that are not read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InputRegisters {
    pub q: Option<u16>,
    pub v: Option<u16>,
    pub z: Option<u16>,
    pub t: Option<u16>,
}

/// Straight code that computes some nodes of a graph: the inputs that it reads are in the first registers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tape {
    pub code: Vec<Instruction>,
    pub results: Vec<Place>,
    /// How many registers there are.
    pub registers: usize,
    pub inputs: InputRegisters,
    /// The instructions with a constant, and the nodes of these.
    constants: Vec<(usize, Id)>,
}

/// How nodes are placed in registers.
struct Builder<'g> {
    graph: &'g Graph,
    tape: Tape,
    /// The register of each node that is in one.
    place: Vec<Option<u16>>,
    /// How often each node is still read.
    uses: Vec<u32>,
    free: Vec<u16>,
}

impl Tape {
    /// The code for nodes of a graph over `dimension` coordinates; `None` where it needs more registers or constants than can be
    /// numbered.
    pub fn new(graph: &Graph, nodes: &[Id], dimension: usize) -> Option<Self> {
        let last = nodes.iter().map(|id| id.index() + 1).max().unwrap_or(0);
        let mut uses = vec![0_u32; last];
        for id in nodes {
            // One more than all readers: results stay.
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

    /// Takes the constants for other values of the parameters: those of all nodes of the graph.
    pub fn set_constants(&mut self, values: &[f64]) {
        for (instruction, source) in &self.constants {
            if let Some(instruction) = self.code.get_mut(*instruction) {
                instruction.extra = values.get(source.index()).copied().unwrap_or(f64::NAN).to_bits();
            }
        }
    }
}

impl Builder<'_> {
    /// Writes the code for a node and for all that it is made of, without recursion: operands first, the one with more of them
    /// foremost in time.
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
            // What was built last is deepest as a rule: it is written last, next to its reader.
            let mut operands: Vec<Id> = self.parts(id).into_iter().flatten().collect();
            operands.sort_unstable_by(|a, b| b.cmp(a));
            stack.extend(operands.into_iter().map(|a| (a, false)));
        }
        Some(())
    }

    /// A result without its sign, and whether it has one. As a constant it has none.
    fn without_sign(&mut self, id: Id) -> (Id, bool) {
        match self.graph.node(id) {
            Node::Unary(Function::Neg, a) if !self.graph.is_constant(id) => {
                // One reader more, for good: its register is kept.
                self.uses[a.index()] += 1;
                (a, true)
            }
            _ => (id, false),
        }
    }

    /// The factors of a node that becomes a part of the sum that it is read by alone.
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

    /// The operands that are registers when a node is written.
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

    /// A sum with a product, or a number less a product, as the factors and the other term.
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

    /// A product of two registers times a constant, as the factors and that.
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

    /// The next instruction has the value of a constant node in it.
    fn note_constant(&mut self, id: Id) {
        self.tape.constants.push((self.tape.code.len(), id));
    }

    /// The register of a node that is an input, is computed, or is a constant, which is put there.
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

    /// The bits of a node that is a number; those of a parameter are set later.
    fn number(&self, id: Id) -> u64 {
        self.graph.as_number(id).unwrap_or(f64::NAN).to_bits()
    }

    /// Says that a node was read once; its register is free after the last time.
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

    /// Writes the instruction of a node whose operands are there.
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
                    // The square has a register of its own, then the cube.
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
