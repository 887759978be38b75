//! `limpid-dxc LIBRARY FILE OUT ARGUMENTS...`: compiles a file; prints messages and, of DXIL, the disassembly.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [library, file, out, rest @ ..] = &arguments[..] else {
        eprintln!("usage: limpid-dxc LIBRARY FILE OUT ARGUMENTS...");
        return ExitCode::from(2);
    };
    match compile(library, file, out, &rest.iter().map(String::as_str).collect::<Vec<_>>()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn compile(library: &str, file: &str, out: &str, arguments: &[&str]) -> Result<bool, Box<dyn std::error::Error>> {
    let compiler = limpid_dxc::Compiler::load(Path::new(library))?;
    let compiled = compiler.compile(&std::fs::read_to_string(file)?, arguments)?;
    eprint!("{}", compiled.messages);
    if compiled.object.is_empty() {
        return Ok(false);
    }
    std::fs::write(out, &compiled.object)?;
    if compiled.object.starts_with(b"DXBC") {
        print!("{}", compiler.disassemble(&compiled.object)?);
    }
    Ok(true)
}
