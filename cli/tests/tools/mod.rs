//! Compilers that tests call where they are installed.

#![allow(dead_code, reason = "every test uses its part")]

use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

/// A folder of its own for a test, removed at the end.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("limpid-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub(crate) fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Says that a test skips a tool, or fails where tools are required.
pub(crate) fn skip(what: &str) {
    assert!(std::env::var_os("LIMPID_REQUIRE_TOOLS").is_none(), "{what}");
    // Past the harness, which keeps to itself what a passing test prints.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {what}");
}

/// Whether a program is there; says so if not.
pub(crate) fn has(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok();
    if !found {
        skip(&format!("{program} is not installed"));
    }
    found
}

/// Runs a program that has to succeed; what it printed.
pub(crate) fn run(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output().unwrap_or_else(|e| panic!("{program}: {e}"));
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {text}");
    text
}

/// Microsoft's compiler, from the library that `LIMPID_DXC` names.
pub(crate) fn dxc() -> Option<limpid_dxc::Compiler> {
    let Some(library) = std::env::var_os("LIMPID_DXC") else {
        skip("LIMPID_DXC does not name libdxcompiler");
        return None;
    };
    Some(limpid_dxc::Compiler::load(&PathBuf::from(library)).unwrap())
}

/// Compiles HLSL; nothing but the missing signature may be remarked on.
pub(crate) fn compile_hlsl(compiler: &limpid_dxc::Compiler, text: &str, arguments: &[&str]) -> Vec<u8> {
    let compiled = compiler.compile(text, arguments).unwrap();
    let unsigned = "warning: DXIL.dll not found.  Resulting DXIL will not be signed for use in release environments.";
    let messages = compiled.messages.replace(unsigned, "");
    assert!(messages.trim().is_empty() && !compiled.object.is_empty(), "{arguments:?}: {messages}\n{text}");
    compiled.object
}
