//! Runs limpid, and any other compute kernel that naga can read, on the CPU alone.
//!
//! [`Executor`] compiles the IR of a validated naga module once to a flat list of instructions, each of which
//! works on all invocations of a workgroup; workgroups run in parallel.
//!
//! ```
//! use limpid_cpu::{Binding, Buffer, Executor};
//!
//! let source = "
//!     @group(0) @binding(0) var<storage, read_write> numbers: array<f32>;
//!     @compute @workgroup_size(64)
//!     fn double(@builtin(global_invocation_id) id: vec3<u32>) {
//!         if id.x < arrayLength(&numbers) {
//!             numbers[id.x] *= 2.0;
//!         }
//!     }";
//! let module = naga::front::wgsl::parse_str(source)?;
//! let mut validator = naga::valid::Validator::new(Default::default(), Default::default());
//! let executor = Executor::new(&module, &validator.validate(&module)?, "double")?;
//!
//! let numbers = Buffer::new((0..100).map(|i| (i as f32).to_bits()));
//! executor.dispatch([2, 1, 1], &[Binding::buffer(0, 0, &numbers)])?;
//! assert_eq!(f32::from_bits(numbers.read()[21]), 42.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Numbers
//!
//! `f32` arithmetic is that of IEEE 754, rounded to the nearest, denormals included; mathematical functions are made
//! of it and give the same bits on every machine.
//!
//! `f16` values (`enable f16;`) are computed in `f32`: each operator, conversion and built-in function as a whole, such
//! as `dot` or a product of matrices, rounds its result once to the nearest `f16`, ties to even. That is exactly
//! IEEE 754 for `+`, `-`, `*`, `/`, `sqrt`, comparisons, conversions and rounding functions; `fma` and the others
//! may differ from it in the last place. In naga 30 `frexp` of an `f16` gives a 16-bit exponent, which is not
//! supported; its fraction is.
//!
//! # Subgroups
//!
//! A subgroup has [`SUBGROUP_SIZE`] invocations or what [`Executor::with_subgroup_size`] says. naga 30 wants
//! `Capabilities::SUBGROUP` and [`subgroup_stages`](naga::valid::Validator::subgroup_stages) for them, and source
//! without the line `enable subgroups;`.

#![forbid(unsafe_code)]

mod check;
mod compile;
mod denoiser;
mod error;
mod eval;
mod executor;
mod inexact;
mod layout;
mod machine;
mod math;
mod op;
mod probe;
mod registers;
mod resource;
mod sampler;

pub use check::{Fault, FaultKind};
pub use denoiser::{Denoiser, Inputs, PrevGbuffer};
pub use error::{CompileError, DispatchError, Error};
pub use executor::{Binding, Executor};
pub use probe::{Event, EventKind, OutputError, Probe};
pub use resource::{Buffer, TexelFormat, Texture};
pub use sampler::{AddressMode, BorderColor, Compare, Filter, Sampler};

/// Invocations that one instruction works on at a time.
pub(crate) const LANES: usize = 64;

/// Invocations of a subgroup, unless [`Executor::with_subgroup_size`] says otherwise.
pub const SUBGROUP_SIZE: u32 = 32;
