//! The instructions of a compiled kernel. Each works on all invocations of a workgroup at once.

/// Where an instruction finds a 32-bit value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operand {
    /// The same for every kernel run.
    Const(u32),
    /// A scalar register: the same for every invocation of the workgroup.
    Scalar(u32),
    /// A lane register: one value an invocation.
    Lane(u32),
}

/// Operations on one value. Booleans are 0 or all ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unary {
    Copy,
    Not,
    NegF,
    NegI,
    AbsF,
    AbsI,
    SignF,
    SignI,
    Floor,
    Ceil,
    Round,
    Trunc,
    Fract,
    Sqrt,
    InverseSqrt,
    Exp,
    Exp2,
    Log,
    Log2,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Asinh,
    Acosh,
    Atanh,
    SaturateF,
    IntToFloat,
    UintToFloat,
    FloatToInt,
    FloatToUint,
    BoolToInt,
    BoolToFloat,
    IntToBool,
    FloatToBool,
    IsNan,
    IsInf,
    CountOneBits,
    CountLeadingZeros,
    CountTrailingZeros,
    ReverseBits,
    FirstLeadingBitI,
    FirstLeadingBitU,
    FirstTrailingBit,
    FrexpFraction,
    FrexpExponent,
    QuantizeToF16,
    /// Low half of the word, as the name says.
    HalfToFloat,
    HighHalfToFloat,
    LowSnorm16,
    HighSnorm16,
    LowUnorm16,
    HighUnorm16,
    Unorm8(u8),
    Snorm8(u8),
    Int8(u8),
    Uint8(u8),
    ToSnorm16,
    ToUnorm16,
    ToSnorm8,
    ToUnorm8,
    ToHalf,
}

/// Operations on two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binary {
    AddF,
    SubF,
    MulF,
    DivF,
    RemF,
    MinF,
    MaxF,
    AddI,
    SubI,
    MulI,
    DivI,
    RemI,
    MinI,
    MaxI,
    DivU,
    RemU,
    MinU,
    MaxU,
    And,
    AndNot,
    Or,
    Xor,
    ShiftLeft,
    ShiftRightI,
    ShiftRightU,
    EqF,
    NeF,
    LtF,
    LeF,
    EqI,
    NeI,
    LtI,
    LeI,
    LtU,
    LeU,
    Pow,
    Atan2,
    Step,
    Ldexp,
    /// Low half of the first, low half of the second above it.
    Pack16,
}

/// What an atomic operation does with the value in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Atomic {
    Load,
    Store,
    Add,
    Subtract,
    And,
    Xor,
    Or,
    MinI,
    MaxI,
    MinU,
    MaxU,
    Exchange,
}

/// Memory with addresses: in words, or in half words for half floats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Memory {
    /// Shared by the workgroup.
    Workgroup,
    /// A bound buffer, by its place among the program's bindings.
    Buffer(u32),
    /// Half floats in a bound buffer. In registers they are floats.
    Halves(u32),
}

/// A value with a name given by the API.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BuiltIn {
    LocalId(u8),
    LocalIndex,
    GlobalId(u8),
    WorkgroupId(u8),
    WorkgroupCount(u8),
    SubgroupSize,
    SubgroupCount,
    SubgroupId,
    /// Index in the subgroup.
    SubgroupLane,
}

/// How values of a subgroup become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fold {
    pub(crate) op: Binary,
    /// For no values.
    pub(crate) identity: u32,
    /// Whether each step rounds to half floats.
    pub(crate) is_half: bool,
}

/// What the active invocations of a subgroup do together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Subgroup {
    /// A word of the bits of those whose value is true.
    Ballot(u8),
    Reduce(Fold),
    Inclusive(Fold),
    Exclusive(Fold),
    BroadcastFirst,
    /// The value of the invocation at an index of the subgroup.
    Shuffle,
    ShuffleXor,
    ShuffleUp,
    ShuffleDown,
    /// The value of the invocation at an index of each four.
    QuadBroadcast,
}

/// Where the level of detail of a sample comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SampleLod {
    Exact(Operand),
    /// Derivatives of both coordinates along `x`, then along `y`.
    Gradient([Operand; 4]),
}

/// A texture looked up with a sampler.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sample {
    /// The components that are wanted.
    pub(crate) to: [Option<u32>; 4],
    pub(crate) texture: u32,
    pub(crate) sampler: u32,
    pub(crate) at: [Operand; 2],
    /// In texels.
    pub(crate) offset: [i32; 2],
    pub(crate) lod: SampleLod,
    /// What texels are compared with.
    pub(crate) reference: Option<Operand>,
    /// The component of four texels that is wanted rather than a filtered value.
    pub(crate) gather: Option<usize>,
    /// Whether the coordinate stays half a texel inside.
    pub(crate) clamp_to_edge: bool,
    pub(crate) mask: Option<u32>,
}

/// One instruction. `mask` is a lane register with all ones for the invocations that take part; none means all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Op {
    Unary {
        op: Unary,
        to: Operand,
        a: Operand,
    },
    Binary {
        op: Binary,
        to: Operand,
        a: Operand,
        b: Operand,
    },
    /// `condition ? a : b`.
    Select {
        to: Operand,
        condition: Operand,
        a: Operand,
        b: Operand,
    },
    Fma {
        to: Operand,
        a: Operand,
        b: Operand,
        c: Operand,
    },
    /// Writes a variable where the mask allows.
    Assign {
        to: Operand,
        a: Operand,
        mask: Option<u32>,
    },
    BuiltIn {
        to: Operand,
        value: BuiltIn,
    },
    /// One of consecutive registers.
    ReadIndexed {
        to: Operand,
        base: Operand,
        stride: u32,
        count: u32,
        index: Operand,
    },
    WriteIndexed {
        base: Operand,
        stride: u32,
        count: u32,
        index: Operand,
        a: Operand,
        mask: Option<u32>,
    },
    /// One of some constants.
    Table {
        to: Operand,
        table: u32,
        stride: u32,
        offset: u32,
        index: Operand,
    },
    Load {
        to: Operand,
        memory: Memory,
        address: Operand,
        offset: u32,
        /// Only for checks.
        mask: Option<u32>,
    },
    Store {
        memory: Memory,
        address: Operand,
        offset: u32,
        a: Operand,
        mask: Option<u32>,
    },
    Atomic {
        op: Atomic,
        /// The value before.
        to: Option<u32>,
        memory: Memory,
        address: Operand,
        offset: u32,
        a: Operand,
        /// The value that memory must hold for an exchange to happen.
        compare: Option<Operand>,
        mask: Option<u32>,
    },
    /// Number of elements of a runtime-sized array; offset and stride in bytes.
    ArrayLength {
        to: Operand,
        buffer: u32,
        offset: u32,
        stride: u32,
    },
    /// The components of a texel that are wanted.
    TextureLoad {
        to: [Option<u32>; 4],
        texture: u32,
        x: Operand,
        y: Operand,
        level: Operand,
        /// Only for checks.
        mask: Option<u32>,
    },
    TextureSample(Box<Sample>),
    TextureStore {
        texture: u32,
        x: Operand,
        y: Operand,
        texel: [Operand; 4],
        mask: Option<u32>,
    },
    TextureSize {
        to: [Operand; 2],
        texture: u32,
        level: Operand,
    },
    TextureLevels {
        to: Operand,
        texture: u32,
    },
    Subgroup {
        op: Subgroup,
        to: u32,
        a: Operand,
        index: Operand,
        mask: Option<u32>,
    },
    /// All invocations are always at the same instruction: only checks look at it.
    Barrier {
        mask: Option<u32>,
        /// Whether it orders accesses to workgroup memory.
        orders_workgroup: bool,
    },
    Jump {
        to: usize,
    },
    /// Jumps when a scalar is false.
    JumpIfFalse {
        condition: Operand,
        to: usize,
    },
    /// Jumps when no invocation of a mask is active.
    JumpIfNone {
        mask: u32,
        to: usize,
    },
    /// Jumps when some are.
    JumpIfAny {
        mask: u32,
        to: usize,
    },
}
