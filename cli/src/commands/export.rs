//! `limpid export`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use limpid::Settings;
use limpid::emit::{
    Checks, GlslDialect, GlslOptions, HlslOptions, MslOptions, ShaderModel, SpirvOptions, SpirvVersion, WgslOptions,
};
use limpid::export::{File, Options, Target, bundle_from, manifest_schema};
use limpid::kernel::Sources;

use super::settings::SettingsOptions;
use crate::export;

/// Writes shaders, tables and documents for engines that do not link Rust.
///
/// The folder gets one file for each pass and language, INTEGRATION.md for each language, limpid.h for C and C++, and
/// manifest.json, which describes everything. The same input gives the same bytes.
#[derive(Debug, Args)]
pub(super) struct Export {
    /// Languages: hlsl, spirv, msl, glsl, wgsl. All if not given.
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = target_names())]
    target: Vec<String>,
    /// Folder to write to.
    #[arg(long, value_name = "DIR", required_unless_present_any = ["list", "stdout", "schema"])]
    out: Option<PathBuf>,
    #[command(flatten)]
    settings: SettingsOptions,
    /// Replace an earlier export. Nothing else is ever replaced.
    #[arg(long)]
    force: bool,
    /// Write nothing; fail if the folder is not what would be written.
    #[arg(long, requires = "out", conflicts_with_all = ["force", "watch"])]
    check: bool,
    /// Kernels to use in the place of those built in: a folder such as kernels/.
    #[arg(long, value_name = "DIR")]
    kernels: Option<PathBuf>,
    /// Write again whenever the settings file or one of --kernels changes.
    #[arg(long, requires = "out", conflicts_with_all = ["list", "stdout"])]
    watch: bool,
    /// Write nothing; list the files with their sizes.
    #[arg(long)]
    list: bool,
    /// Print one shader: of the language and pass that are given, or the single file.
    #[arg(long)]
    stdout: bool,
    /// The pass that --stdout prints.
    #[arg(long, requires = "stdout", value_name = "NAME")]
    pass: Option<String>,
    /// All passes of a language in one file, each behind a macro such as LIMPID_PREFILTER (hlsl, msl, glsl).
    #[arg(long)]
    single_file: bool,
    /// Print the JSON schema of manifest.json.
    #[arg(long)]
    schema: bool,
    #[command(flatten)]
    languages: LanguageOptions,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum HlslModel {
    #[value(name = "5.1")]
    V5_1,
    #[value(name = "6.0")]
    V6_0,
    #[value(name = "6.2-16bit")]
    V6_2Half,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Dialect {
    #[value(name = "opengl")]
    OpenGl,
    Vulkan,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Version {
    #[value(name = "1.0")]
    V1_0,
    #[value(name = "1.1")]
    V1_1,
    #[value(name = "1.2")]
    V1_2,
    #[value(name = "1.3")]
    V1_3,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Languages")]
struct LanguageOptions {
    /// HLSL shader model.
    #[arg(long, default_value = "6.0")]
    hlsl_shader_model: HlslModel,
    /// HLSL space of what you supply; what limpid owns is in the next.
    #[arg(long, default_value_t = 0, value_name = "N")]
    hlsl_space: u32,
    /// Number of the first HLSL register of each class.
    #[arg(long, default_value_t = 0, value_name = "N")]
    hlsl_register_base: u32,
    /// Put the root signature on HLSL entry points.
    #[arg(long)]
    hlsl_root_signature: bool,
    /// Add [[vk::binding]] and [[vk::image_format]] to HLSL, for DXC's -spirv.
    #[arg(long)]
    hlsl_vk_binding: bool,
    /// Version of SPIR-V.
    #[arg(long, default_value = "1.3")]
    spirv_version: Version,
    /// Keep names in SPIR-V, for debuggers.
    #[arg(long)]
    spirv_names: bool,
    /// Check indices, loops and divisions in SPIR-V.
    #[arg(long)]
    spirv_robust: bool,
    /// SPIR-V descriptor set of what you supply; what limpid owns is in the next.
    #[arg(long, default_value_t = 0, value_name = "N")]
    spirv_set: u32,
    /// Number of the first binding of each SPIR-V set.
    #[arg(long, default_value_t = 0, value_name = "N")]
    spirv_binding_base: u32,
    /// Index of the first Metal buffer.
    #[arg(long, default_value_t = 0, value_name = "N")]
    msl_buffer_base: u32,
    /// Index of the first Metal texture.
    #[arg(long, default_value_t = 0, value_name = "N")]
    msl_texture_base: u32,
    /// GLSL for OpenGL or for Vulkan.
    #[arg(long, default_value = "opengl")]
    glsl_dialect: Dialect,
    /// GLSL set of what you supply, for Vulkan; what limpid owns is in the next.
    #[arg(long, default_value_t = 0, value_name = "N")]
    glsl_set: u32,
    /// Number of the first GLSL binding of each set or kind.
    #[arg(long, default_value_t = 0, value_name = "N")]
    glsl_binding_base: u32,
    /// WGSL group of what you supply; what limpid owns is in the next.
    #[arg(long, default_value_t = 0, value_name = "N")]
    wgsl_group: u32,
    /// Number of the first binding of each WGSL group.
    #[arg(long, default_value_t = 0, value_name = "N")]
    wgsl_binding_base: u32,
}

fn target_names() -> clap::builder::PossibleValuesParser {
    Target::ALL.iter().map(|target| target.name()).collect::<Vec<_>>().into()
}

impl LanguageOptions {
    fn options(&self, targets: Vec<Target>, single_file: bool) -> Options {
        let shader_model = match self.hlsl_shader_model {
            HlslModel::V5_1 => ShaderModel::V5_1,
            HlslModel::V6_0 => ShaderModel::V6_0,
            HlslModel::V6_2Half => ShaderModel::V6_2Half,
        };
        let version = match self.spirv_version {
            Version::V1_0 => SpirvVersion::V1_0,
            Version::V1_1 => SpirvVersion::V1_1,
            Version::V1_2 => SpirvVersion::V1_2,
            Version::V1_3 => SpirvVersion::V1_3,
        };
        let dialect = match self.glsl_dialect {
            Dialect::OpenGl => GlslDialect::OpenGl,
            Dialect::Vulkan => GlslDialect::Vulkan,
        };
        Options {
            targets,
            single_file,
            hlsl: HlslOptions {
                shader_model,
                first_space: self.hlsl_space,
                first_register: self.hlsl_register_base,
                root_signature: self.hlsl_root_signature,
                vk_binding: self.hlsl_vk_binding,
            },
            spirv: SpirvOptions {
                version,
                debug_names: self.spirv_names,
                checks: if self.spirv_robust { Checks::Robust } else { Checks::Unchecked },
                first_set: self.spirv_set,
                first_binding: self.spirv_binding_base,
            },
            msl: MslOptions { first_buffer: self.msl_buffer_base, first_texture: self.msl_texture_base },
            glsl: GlslOptions { dialect, first_set: self.glsl_set, first_binding: self.glsl_binding_base },
            wgsl: WgslOptions { first_group: self.wgsl_group, first_binding: self.wgsl_binding_base },
        }
    }
}

/// When a file, or one of those in a folder, was changed last.
fn modified(path: &Path) -> Result<SystemTime> {
    let fail = || format!("cannot watch {}", path.display());
    let metadata = std::fs::metadata(path).with_context(fail)?;
    let mut latest = metadata.modified().with_context(fail)?;
    if metadata.is_dir() {
        for entry in std::fs::read_dir(path).with_context(fail)? {
            latest = latest.max(modified(&entry.with_context(fail)?.path())?);
        }
    }
    Ok(latest)
}

impl Export {
    fn targets(&self) -> Vec<Target> {
        match &self.target[..] {
            [] => Target::ALL.to_vec(),
            names => names.iter().filter_map(|name| Target::by_name(name)).collect(),
        }
    }

    fn files(&self, settings: &Settings) -> Result<Vec<File>> {
        let sources = self.kernels.clone().map_or(Sources::BuiltIn, Sources::Folder);
        Ok(bundle_from(settings, &self.languages.options(self.targets(), self.single_file), &sources)?)
    }

    pub(super) fn run(&self) -> Result<()> {
        if self.schema {
            return super::print(&manifest_schema());
        }
        let files = self.files(&self.settings.load()?)?;
        if self.list {
            let lines = files.iter().map(|file| format!("{:>8}  {}\n", file.bytes.len(), file.path));
            return super::print(&lines.collect::<String>());
        }
        if self.stdout {
            return self.print_shader(&files);
        }
        let out = self.out.as_deref().context("--out is missing")?;
        if self.check {
            return check(&files, out);
        }
        export::write(&files, out, self.force)?;
        eprintln!("wrote {} files to {}", files.len(), out.display());
        if self.watch { self.watch(out) } else { Ok(()) }
    }

    fn print_shader(&self, files: &[File]) -> Result<()> {
        let &[target] = &self.targets()[..] else {
            bail!("--stdout prints one shader, expected one --target");
        };
        let name = match (&self.pass, self.single_file) {
            (None, true) => "limpid",
            (Some(pass), false) => pass,
            _ => bail!("--stdout prints one shader, expected either --pass NAME or --single-file"),
        };
        let path = format!("{}/{name}.{}", target.name(), target.ending());
        let ending = format!(".{}", target.ending());
        let Some(file) = files.iter().find(|file| file.path == path) else {
            let passes = files.iter().filter_map(|file| file.path.strip_suffix(&ending)?.split('/').nth(1));
            bail!("there is no pass `{name}`; there are {}", passes.collect::<Vec<_>>().join(", "));
        };
        match std::io::stdout().write_all(&file.bytes) {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
            _ => Ok(()),
        }
    }

    /// Writes again when what it is made from changes; what is wrong with it is printed, and the last export stays.
    fn watch(&self, out: &Path) -> Result<()> {
        let watched: Vec<_> = self.settings.file().into_iter().chain(self.kernels.as_deref()).collect();
        let latest = || watched.iter().map(|path| modified(path)).collect::<Result<Vec<_>>>();
        if watched.is_empty() {
            bail!("--watch needs something to watch: --settings FILE or --kernels DIR");
        }
        let mut last = latest()?;
        eprintln!(
            "watching {}",
            watched.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" and ")
        );
        loop {
            std::thread::sleep(Duration::from_millis(300));
            // Editors replace files: for a moment there may be none.
            let now = latest().unwrap_or_else(|_| last.clone());
            if now == last {
                continue;
            }
            last = now;
            let written = self
                .settings
                .load()
                .and_then(|settings| self.files(&settings))
                .and_then(|files| export::write(&files, out, true));
            match written {
                Ok(()) => eprintln!("wrote {}", out.display()),
                Err(error) => eprintln!("error: {error:#}"),
            }
        }
    }
}

fn check(files: &[File], out: &Path) -> Result<()> {
    let differences = export::compare(files, out)?;
    if differences.is_empty() {
        return Ok(());
    }
    let lines =
        [("missing", differences.missing), ("changed", differences.changed), ("not of the export", differences.extra)];
    let lines: Vec<_> = lines
        .into_iter()
        .flat_map(|(what, paths)| paths.into_iter().map(move |path| format!("\n  {what}: {path}")))
        .collect();
    bail!("{} is out of date:{}", out.display(), lines.concat())
}
