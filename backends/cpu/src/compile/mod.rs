//! From naga's IR to a flat list of instructions.
//!
//! Functions are inlined; composite values become one register a scalar. What is the same for all invocations of
//! a workgroup lives in scalar registers. Control flow that is not becomes masks: a lane register with all ones
//! for the invocations that take part. Which variables and which loops and functions need that is found by
//! assuming none do, and compiling again with what turned out otherwise.

mod expression;
mod flow;
mod function;
mod globals;
mod image;
mod loops;
mod math;
mod memory;
mod packing;
mod subgroup;
mod uses;

use std::collections::{HashMap, HashSet};

use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{Expression, Function, GlobalVariable, Handle, LocalVariable, Module, TypeInner};

use crate::error::CompileError;
use crate::inexact::Inexact;
use crate::layout::scalar_count;
use crate::op::{Binary, Memory, Op, Operand, Unary};
use crate::registers::Registers;

/// A resource that a kernel binds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BindingSlot {
    pub(crate) name: String,
    pub(crate) group: u32,
    pub(crate) binding: u32,
    pub(crate) kind: SlotKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SlotKind {
    Buffer { writable: bool },
    Texture { writable: bool },
    Sampler { comparison: bool },
}

impl SlotKind {
    pub(crate) fn is_writable(self) -> bool {
        matches!(self, Self::Buffer { writable: true } | Self::Texture { writable: true })
    }
}

/// A kernel ready to run.
#[derive(Debug, Clone)]
pub(crate) struct Code {
    pub(crate) ops: Vec<Op>,
    /// Where in the source each instruction comes from.
    pub(crate) spans: Vec<naga::Span>,
    /// The lane register that tells which invocations are active at each instruction; none for all.
    pub(crate) masks: Vec<Option<u32>>,
    pub(crate) lane_registers: u32,
    pub(crate) scalar_registers: u32,
    pub(crate) tables: Vec<Vec<u32>>,
    pub(crate) workgroup_words: u32,
    pub(crate) workgroup_size: [u32; 3],
    /// A divisor of `LANES`.
    pub(crate) subgroup_size: u32,
    /// Errors to add to functions.
    pub(crate) inexact: Option<Inexact>,
    pub(crate) bindings: Vec<BindingSlot>,
}

/// What has been found not to be uniform, by the order of compilation.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
struct Facts {
    varying_variables: HashSet<u32>,
    divergent_flows: HashSet<u32>,
}

/// A variable of a function, of the module, or for the result of a function.
struct Variable {
    number: u32,
    varying: bool,
    /// Divergent constructs around its declaration.
    depth: u32,
    base: u32,
    count: u32,
}

#[derive(Clone)]
enum Root {
    Variable(usize),
    Memory(Memory),
}

/// What a pointer points to.
#[derive(Clone)]
struct Place {
    root: Root,
    inner: TypeInner,
    /// From the root: bytes in a buffer, scalars elsewhere. Distances too.
    offset: u32,
    /// Index, distance between elements, and number of elements where it is known.
    dynamic: Vec<(Operand, u32, Option<u32>)>,
}

#[derive(Clone)]
enum Value {
    Data(Vec<Operand>),
    Place(Place),
    /// A texture or sampler, by its binding.
    Resource(u32),
}

/// One function at one place that it is called from.
struct Inlined<'a> {
    function: &'a Function,
    info: &'a FunctionInfo,
    arguments: Vec<Value>,
    values: Vec<Option<Value>>,
    remaining_uses: Vec<u32>,
    defined_in_loop: Vec<u32>,
    wanted_components: HashMap<Handle<Expression>, [bool; 4]>,
    locals: HashMap<Handle<LocalVariable>, usize>,
    flow: u32,
    divergent: bool,
    entry_depth: u32,
    result: Option<usize>,
    /// The value of a function whose only `return` is its last statement.
    direct_result: Option<Vec<Operand>>,
    single_return: bool,
    end_jumps: Vec<usize>,
}

struct LoopContext {
    flow: u32,
    divergent: bool,
    entry_depth: u32,
    is_switch: bool,
    /// Invocations that left by `break`, and those that wait for the continuing block.
    break_mask: u32,
    continue_mask: u32,
    break_jumps: Vec<usize>,
    continue_jumps: Vec<usize>,
}

struct Compiler<'a> {
    module: &'a Module,
    info: &'a ModuleInfo,
    ops: Vec<Op>,
    spans: Vec<naga::Span>,
    masks: Vec<Option<u32>>,
    /// Where in the source the compiler is.
    span: naga::Span,
    registers: Registers,
    scalars: u32,
    tables: Vec<Vec<u32>>,
    bindings: Vec<BindingSlot>,
    globals: HashMap<Handle<GlobalVariable>, Value>,
    workgroup_words: u32,
    facts: Facts,
    variables: Vec<Variable>,
    next_flow: u32,
    mask: Option<u32>,
    /// Number of divergent constructs around.
    depth: u32,
    loops: Vec<LoopContext>,
    loop_depth: u32,
}

type Result<T> = std::result::Result<T, CompileError>;

fn unsupported<T>(construct: impl Into<String>) -> Result<T> {
    // The compiler knows where; see `compile`.
    Err(CompileError::Unsupported { construct: construct.into(), offset: None })
}

/// Compiles the entry point of a validated module.
pub(crate) fn compile(module: &Module, info: &ModuleInfo, entry_point: &str) -> Result<Code> {
    let index = module
        .entry_points
        .iter()
        .position(|entry| entry.name == entry_point && entry.stage == naga::ShaderStage::Compute)
        .ok_or_else(|| CompileError::EntryPoint { name: entry_point.to_owned() })?;
    if let Some((handle, _)) = module.overrides.iter().next() {
        let error = unsupported("an override without a value (specialise the module first)");
        return error.map_err(|error| error.at(module.overrides.get_span(handle)));
    }
    let mut facts = Facts::default();
    loop {
        let mut compiler = Compiler::new(module, info, facts.clone());
        let entry = &module.entry_points[index];
        let compiled = compiler.globals().and_then(|()| compiler.entry_point(entry, info.get_entry_point(index)));
        compiled.map_err(|error| error.at(compiler.span))?;
        // Every round finds at least one fact more, of finitely many.
        if compiler.facts == facts {
            return Ok(Code {
                ops: compiler.ops,
                spans: compiler.spans,
                masks: compiler.masks,
                lane_registers: compiler.registers.count(),
                scalar_registers: compiler.scalars,
                tables: compiler.tables,
                workgroup_words: compiler.workgroup_words,
                workgroup_size: entry.workgroup_size,
                subgroup_size: crate::SUBGROUP_SIZE,
                inexact: None,
                bindings: compiler.bindings,
            });
        }
        facts = compiler.facts;
    }
}

impl<'a> Compiler<'a> {
    fn new(module: &'a Module, info: &'a ModuleInfo, facts: Facts) -> Self {
        Self {
            module,
            info,
            ops: Vec::new(),
            spans: Vec::new(),
            masks: Vec::new(),
            span: naga::Span::UNDEFINED,
            registers: Registers::default(),
            scalars: 0,
            tables: Vec::new(),
            bindings: Vec::new(),
            globals: HashMap::new(),
            workgroup_words: 0,
            facts,
            variables: Vec::new(),
            next_flow: 0,
            mask: None,
            depth: 0,
            loops: Vec::new(),
            loop_depth: 0,
        }
    }

    fn count(&self, inner: &TypeInner) -> Result<u32> {
        let type_name = || match inner.scalar() {
            Some(scalar) => number_name(scalar),
            None => format!("values of type {inner:?}"),
        };
        scalar_count(self.module, inner).map_or_else(|| unsupported(type_name()), Ok)
    }

    fn emit(&mut self, op: Op) {
        self.ops.push(op);
        self.spans.push(self.span);
        self.masks.push(self.mask);
    }

    fn scalar(&mut self) -> Operand {
        self.scalars += 1;
        Operand::Scalar(self.scalars - 1)
    }

    /// A register for a result: a scalar if all that it is made of is uniform.
    fn result(&mut self, operands: &[Operand]) -> Operand {
        if operands.iter().any(|operand| matches!(operand, Operand::Lane(_))) {
            Operand::Lane(self.registers.allocate())
        } else {
            self.scalar()
        }
    }

    fn retain(&mut self, operands: &[Operand]) {
        for operand in operands {
            if let Operand::Lane(register) = operand {
                self.registers.retain(*register);
            }
        }
    }

    fn release(&mut self, operands: &[Operand]) {
        for operand in operands {
            if let Operand::Lane(register) = operand {
                self.registers.release(*register);
            }
        }
    }

    /// A new variable, uniform until it is found not to be.
    fn declare(&mut self, count: u32) -> usize {
        let number = self.variables.len() as u32;
        let varying = self.facts.varying_variables.contains(&number);
        let base = if varying {
            self.registers.allocate_block(count)
        } else {
            self.scalars += count;
            self.scalars - count
        };
        self.variables.push(Variable { number, varying, depth: self.depth, base, count });
        self.variables.len() - 1
    }

    fn variable_operand(&self, index: usize, scalar: u32) -> Operand {
        let variable = &self.variables[index];
        let register = variable.base + scalar.min(variable.count.saturating_sub(1));
        if variable.varying { Operand::Lane(register) } else { Operand::Scalar(register) }
    }

    fn mark_varying(&mut self, index: usize) {
        let number = self.variables[index].number;
        self.facts.varying_variables.insert(number);
    }

    /// Sets a variable where it is declared, for all invocations.
    fn initialize(&mut self, index: usize, operands: &[Operand]) {
        for (scalar, &a) in operands.iter().enumerate() {
            if matches!(a, Operand::Lane(_)) && !self.variables[index].varying {
                self.mark_varying(index);
                return;
            }
            let to = self.variable_operand(index, scalar as u32);
            self.emit(Op::Unary { op: Unary::Copy, to, a });
        }
    }

    /// Sets one scalar of a variable for the invocations that are active.
    fn assign(&mut self, index: usize, scalar: u32, a: Operand) {
        let variable = &self.variables[index];
        if !variable.varying && (self.depth > variable.depth || matches!(a, Operand::Lane(_))) {
            self.mark_varying(index);
            return;
        }
        let to = self.variable_operand(index, scalar);
        let mask = if self.variables[index].varying { self.mask } else { None };
        self.emit(Op::Assign { to, a, mask });
    }

    fn unary(&mut self, op: Unary, a: Operand) -> Operand {
        if let Operand::Const(a) = a {
            return Operand::Const(crate::eval::unary(op, a));
        }
        let to = self.result(&[a]);
        self.emit(Op::Unary { op, to, a });
        to
    }

    fn binary(&mut self, op: Binary, a: Operand, b: Operand) -> Operand {
        if let (Operand::Const(a), Operand::Const(b)) = (a, b) {
            return Operand::Const(crate::eval::binary(op, a, b));
        }
        let to = self.result(&[a, b]);
        self.emit(Op::Binary { op, to, a, b });
        to
    }

    fn select(&mut self, condition: Operand, a: Operand, b: Operand) -> Operand {
        if let Operand::Const(condition) = condition {
            let chosen = if condition != 0 { a } else { b };
            self.retain(&[chosen]);
            return chosen;
        }
        let to = self.result(&[condition, a, b]);
        self.emit(Op::Select { to, condition, a, b });
        to
    }

    /// As `binary`, for a first operand that is of no further use.
    fn fold(&mut self, op: Binary, a: Operand, b: Operand) -> Operand {
        let to = self.binary(op, a, b);
        self.release(&[a, b]);
        to
    }
}

fn number_name(scalar: naga::Scalar) -> String {
    format!("{}-bit numbers ({:?})", 8 * scalar.width, scalar.kind)
}
