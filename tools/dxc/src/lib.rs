//! Microsoft's HLSL compiler (DXC), for tests: loads `libdxcompiler` and calls it as C++ would.
//!
//! Made for the Linux library of DXC 1.7, whose `IUnknown` has two destructors after its three methods.

use std::ffi::c_void;
use std::path::Path;

use libloading::Library;

#[repr(C)]
struct Guid(u32, u16, u16, [u8; 8]);

const CLSID_COMPILER: Guid = Guid(0x73e2_2d93, 0xe6ce, 0x47f3, [0xb5, 0xbf, 0xf0, 0x66, 0x4f, 0x39, 0xc1, 0xb0]);
const IID_COMPILER3: Guid = Guid(0x228b_4687, 0x5a6a, 0x4730, [0x90, 0x0c, 0x97, 0x02, 0xb2, 0x20, 0x3f, 0x54]);
const IID_RESULT: Guid = Guid(0x5834_6cda, 0xdde7, 0x4497, [0x94, 0x61, 0x6f, 0x87, 0xaf, 0x5e, 0x06, 0x59]);
const IID_BLOB: Guid = Guid(0x8ba5_fb08, 0x5195, 0x40e2, [0xac, 0x58, 0x0d, 0x98, 0x9c, 0x3a, 0x01, 0x02]);

#[repr(C)]
struct Buffer {
    pointer: *const c_void,
    size: usize,
    encoding: u32,
}

const UTF8: u32 = 65001;
/// What a result can be asked for.
const OUT_OBJECT: u32 = 1;
const OUT_ERRORS: u32 = 2;
const OUT_DISASSEMBLY: u32 = 5;

/// Slots of virtual tables: methods of the base class, then two destructors, then those of the class.
const SLOT_RELEASE: usize = 2;
const SLOT_FIRST: usize = 5;

/// What went wrong.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The library could not be loaded.
    #[error("cannot load DXC: {0}")]
    Load(#[from] libloading::Error),
    /// A call failed.
    #[error("DXC's {call} returned 0x{status:08x}")]
    Call {
        /// Which.
        call: &'static str,
        /// HRESULT.
        status: i32,
    },
}

/// An object with a virtual table, released at the end.
struct Object(*mut c_void);

impl Object {
    /// The function in a slot of the virtual table.
    ///
    /// # Safety
    ///
    /// `F` has to be the type of the function in that slot.
    unsafe fn method<F: Copy>(&self, slot: usize) -> F {
        // SAFETY: an object begins with the pointer to its table; the caller knows slot and type.
        unsafe {
            let table = *self.0.cast::<*const *const c_void>();
            std::mem::transmute_copy(&*table.add(slot))
        }
    }
}

impl Drop for Object {
    fn drop(&mut self) {
        // SAFETY: every object has Release, and nobody uses this reference after.
        unsafe { self.method::<unsafe extern "C" fn(*mut c_void) -> u32>(SLOT_RELEASE)(self.0) };
    }
}

/// The compiler.
pub struct Compiler {
    // Before the library that it lives in.
    compiler: Object,
    _library: Library,
}

/// What came of compiling.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// DXIL container or SPIR-V; empty when there were errors.
    pub object: Vec<u8>,
    /// Errors and warnings.
    pub messages: String,
}

fn check(call: &'static str, status: i32) -> Result<(), Error> {
    if status < 0 { Err(Error::Call { call, status }) } else { Ok(()) }
}

fn wide(text: &str) -> Vec<u32> {
    text.chars().map(u32::from).chain([0]).collect()
}

impl Compiler {
    /// Loads the library.
    ///
    /// # Errors
    ///
    /// If it is not there or has no compiler.
    pub fn load(library: &Path) -> Result<Self, Error> {
        type Create = unsafe extern "C" fn(*const Guid, *const Guid, *mut *mut c_void) -> i32;
        // SAFETY: the library is DXC's; its entry point has this signature.
        unsafe {
            let library = Library::new(library)?;
            let create = library.get::<Create>(b"DxcCreateInstance\0")?;
            let mut compiler = std::ptr::null_mut();
            check("DxcCreateInstance", create(&CLSID_COMPILER, &IID_COMPILER3, &mut compiler))?;
            Ok(Self { compiler: Object(compiler), _library: library })
        }
    }

    /// Compiles a text with arguments as the command line has them.
    ///
    /// # Errors
    ///
    /// If the compiler itself fails; errors in the text are in [`Compiled::messages`].
    pub fn compile(&self, text: &str, arguments: &[&str]) -> Result<Compiled, Error> {
        type Compile = unsafe extern "C" fn(
            *mut c_void,
            *const Buffer,
            *const *const u32,
            u32,
            *mut c_void,
            *const Guid,
            *mut *mut c_void,
        ) -> i32;
        let arguments: Vec<_> = arguments.iter().map(|argument| wide(argument)).collect();
        let pointers: Vec<_> = arguments.iter().map(|argument| argument.as_ptr()).collect();
        let source = Buffer { pointer: text.as_ptr().cast(), size: text.len(), encoding: UTF8 };
        let mut result = std::ptr::null_mut();
        // SAFETY: IDxcCompiler3's first method; everything that is pointed to outlives the call.
        unsafe {
            let compile = self.compiler.method::<Compile>(SLOT_FIRST);
            let count = pointers.len() as u32;
            let none = std::ptr::null_mut();
            check(
                "Compile",
                compile(self.compiler.0, &source, pointers.as_ptr(), count, none, &IID_RESULT, &mut result),
            )?;
        }
        let result = Object(result);
        let messages = String::from_utf8_lossy(&output(&result, OUT_ERRORS)).trim_end_matches('\0').to_owned();
        Ok(Compiled { object: output(&result, OUT_OBJECT), messages })
    }

    /// A DXIL container as text.
    ///
    /// # Errors
    ///
    /// If it is none.
    pub fn disassemble(&self, object: &[u8]) -> Result<String, Error> {
        type Disassemble = unsafe extern "C" fn(*mut c_void, *const Buffer, *const Guid, *mut *mut c_void) -> i32;
        let buffer = Buffer { pointer: object.as_ptr().cast(), size: object.len(), encoding: 0 };
        let mut result = std::ptr::null_mut();
        // SAFETY: IDxcCompiler3's second method.
        unsafe {
            let disassemble = self.compiler.method::<Disassemble>(SLOT_FIRST + 1);
            check("Disassemble", disassemble(self.compiler.0, &buffer, &IID_RESULT, &mut result))?;
        }
        let text = output(&Object(result), OUT_DISASSEMBLY);
        Ok(String::from_utf8_lossy(&text).trim_end_matches('\0').to_owned())
    }
}

/// An output of a result; empty if it has none.
fn output(result: &Object, kind: u32) -> Vec<u8> {
    type GetOutput = unsafe extern "C" fn(*mut c_void, u32, *const Guid, *mut *mut c_void, *mut *mut c_void) -> i32;
    let mut blob = std::ptr::null_mut();
    // SAFETY: IDxcResult adds HasOutput and GetOutput to the three methods of IDxcOperationResult. A blob's
    // methods are GetBufferPointer and GetBufferSize.
    unsafe {
        let get = result.method::<GetOutput>(SLOT_FIRST + 4);
        if get(result.0, kind, &IID_BLOB, &mut blob, std::ptr::null_mut()) < 0 || blob.is_null() {
            return Vec::new();
        }
        let blob = Object(blob);
        let pointer = blob.method::<unsafe extern "C" fn(*mut c_void) -> *const u8>(SLOT_FIRST)(blob.0);
        let size = blob.method::<unsafe extern "C" fn(*mut c_void) -> usize>(SLOT_FIRST + 1)(blob.0);
        if pointer.is_null() || size == 0 {
            return Vec::new();
        }
        std::slice::from_raw_parts(pointer, size).to_vec()
    }
}
