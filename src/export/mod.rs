//! Everything that an engine needs to run a plan without this crate: shaders as text or SPIR-V, a manifest, a C header,
//! and a page that says how to put them to work. As data, so that a `build.rs` can call it; `limpid export` writes it
//! to disk.
//!
//! ```
//! use limpid::Settings;
//! use limpid::export::{Options, Target, bundle};
//!
//! let options = Options { targets: vec![Target::Hlsl], ..Options::default() };
//! for file in bundle(&Settings::default(), &options)? {
//!     println!("{} {} bytes", file.path, file.bytes.len());
//! }
//! # Ok::<(), limpid::Error>(())
//! ```

mod c_header;
mod describe;
mod formats;
mod hlsl_header;
mod integration;
mod manifest;

use std::collections::BTreeMap;

use glam::UVec2;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

pub use manifest::*;

use crate::emit::{GlslOptions, HlslOptions, MslOptions, Note, SpirvOptions, WgslOptions};
use crate::kernel::{Kernel, Sources};
use crate::plan::Pass;
use crate::resource::{Copy, Kind};
use crate::{Error, Plan, Settings};

/// A language to export.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// HLSL, for Direct3D 12.
    Hlsl,
    /// SPIR-V, for Vulkan.
    Spirv,
    /// Metal Shading Language.
    Msl,
    /// GLSL.
    Glsl,
    /// WGSL.
    Wgsl,
}

impl Target {
    /// All, in the order in which they are written.
    pub const ALL: &[Target] = &[Target::Hlsl, Target::Spirv, Target::Msl, Target::Glsl, Target::Wgsl];

    /// Name on the command line and of the folder.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hlsl => "hlsl",
            Self::Spirv => "spirv",
            Self::Msl => "msl",
            Self::Glsl => "glsl",
            Self::Wgsl => "wgsl",
        }
    }

    /// Ending of its files.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Hlsl => "hlsl",
            Self::Spirv => "spv",
            Self::Msl => "metal",
            Self::Glsl => "comp",
            Self::Wgsl => "wgsl",
        }
    }

    /// The target of that name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|target| target.name() == name)
    }
}

/// What to export and how.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Languages.
    pub targets: Vec<Target>,
    /// All passes of a language in one file, each behind a macro such as `LIMPID_PREFILTER`. Not for SPIR-V and
    /// WGSL, which have no preprocessor.
    pub single_file: bool,
    /// HLSL.
    pub hlsl: HlslOptions,
    /// SPIR-V.
    pub spirv: SpirvOptions,
    /// Metal Shading Language.
    pub msl: MslOptions,
    /// GLSL.
    pub glsl: GlslOptions,
    /// WGSL.
    pub wgsl: WgslOptions,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            targets: Target::ALL.to_vec(),
            single_file: false,
            hlsl: HlslOptions::default(),
            spirv: SpirvOptions::default(),
            msl: MslOptions::default(),
            glsl: GlslOptions::default(),
            wgsl: WgslOptions::default(),
        }
    }
}

/// A file of the bundle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Path below the folder of the export, with `/`.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

impl File {
    fn text(path: impl Into<String>, text: String) -> Self {
        Self { path: path.into(), bytes: text.into_bytes() }
    }
}

/// Name of the manifest.
pub const MANIFEST: &str = "manifest.json";

/// A plan and what its exports share.
pub(crate) struct Export<'a> {
    settings: &'a Settings,
    options: &'a Options,
    plan: Plan,
    kernels: Vec<Kernel>,
    settings_hash: String,
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A short name for settings: 16 digits of the SHA-256 of their JSON.
pub fn settings_hash(settings: &Settings) -> String {
    // Settings are numbers, words and arrays: they always have a JSON.
    sha256(&serde_json::to_vec(settings).unwrap_or_default())[..16].to_owned()
}

/// All files of an export, sorted by path; the manifest names the others with their hashes. The same input gives the
/// same bytes.
///
/// # Errors
///
/// [`Error::Setting`]; [`Error::Export`] for options that do not go together.
pub fn bundle(settings: &Settings, options: &Options) -> Result<Vec<File>, Error> {
    bundle_from(settings, options, &Sources::BuiltIn)
}

/// The same with kernels from other sources.
///
/// # Errors
///
/// As [`bundle`]; [`Error::Kernel`] with file and line for mistakes in the sources.
pub fn bundle_from(settings: &Settings, options: &Options, sources: &Sources) -> Result<Vec<File>, Error> {
    let export = Export::new(settings, options, sources)?;
    let mut files = Vec::new();
    for &target in Target::ALL.iter().filter(|target| options.targets.contains(target)) {
        files.extend(export.shaders(target)?);
        files.push(File::text(format!("{}/INTEGRATION.md", target.name()), export.integration(target)));
    }
    if options.targets.contains(&Target::Hlsl) {
        files.push(File::text("hlsl/limpid.hlsli", export.hlsl_header()?));
    }
    files.push(File::text("limpid.h", export.c_header()?));
    files.sort_by(|a, b| a.path.cmp(&b.path));
    let manifest = serde_json::to_string_pretty(&export.manifest(&files))
        .map_err(|error| Error::Export { option: "manifest", report: error.to_string() })?;
    files.push(File::text(MANIFEST, manifest + "\n"));
    files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}

impl<'a> Export<'a> {
    fn new(settings: &'a Settings, options: &'a Options, sources: &Sources) -> Result<Self, Error> {
        let unfit = options.targets.iter().find(|target| matches!(target, Target::Spirv | Target::Wgsl));
        if let (true, Some(target)) = (options.single_file, unfit) {
            let report =
                format!("{} has no preprocessor to choose a pass with, expected hlsl, msl or glsl", target.name());
            return Err(Error::Export { option: "single file", report });
        }
        // The size is only for totals, which the manifest gives as expressions.
        let (plan, kernels) = Plan::from_sources(settings, UVec2::new(1920, 1080), sources)?;
        Ok(Self { settings, options, plan, kernels, settings_hash: settings_hash(settings) })
    }

    fn passes(&self) -> impl Iterator<Item = (&Pass, &Kernel)> {
        self.plan.passes.iter().zip(&self.kernels)
    }

    /// What a heading says about each variable.
    fn note(&self, pass: &Pass) -> Note {
        let resources: BTreeMap<_, _> = pass
            .bindings
            .iter()
            .map(|bound| {
                let resource = self.plan.resource(&bound.resource);
                let what = match resource.map(|resource| resource.kind) {
                    Some(Kind::Texture { format, .. }) => format!(", {}", formats::names(format).webgpu),
                    Some(Kind::Buffer { stride, .. }) => format!(", stride {stride}"),
                    Some(Kind::Constants) => ", constants".to_owned(),
                    Some(Kind::Input) => ", yours".to_owned(),
                    None => String::new(),
                };
                let copy = match bound.copy {
                    Copy::Previous => ", last frame's copy",
                    Copy::Current if resource.is_some_and(|resource| resource.ping_pong) => ", this frame's copy",
                    Copy::Current => "",
                };
                (bound.variable.clone(), format!("{}{what}{copy}", bound.resource))
            })
            .collect();
        Note { settings: Some(self.settings_hash.clone()), resources }
    }

    fn shader(&self, target: Target, pass: &Pass, kernel: &Kernel) -> Result<Vec<u8>, Error> {
        let note = self.note(pass);
        let options = self.options;
        Ok(match target {
            Target::Hlsl => kernel.hlsl_with(&options.hlsl, &note)?.into_bytes(),
            Target::Msl => kernel.msl_with(&options.msl, &note)?.into_bytes(),
            Target::Glsl => kernel.glsl_with(&options.glsl, &note)?.into_bytes(),
            Target::Wgsl => kernel.wgsl_with(&options.wgsl, &note)?.into_bytes(),
            Target::Spirv => kernel.spirv(&options.spirv)?.into_iter().flat_map(u32::to_le_bytes).collect(),
        })
    }

    /// Path of a pass's shader.
    fn path(&self, target: Target, pass: &str) -> String {
        let name = if self.options.single_file { "limpid" } else { pass };
        format!("{}/{name}.{}", target.name(), target.ending())
    }

    fn shaders(&self, target: Target) -> Result<Vec<File>, Error> {
        let mut files = Vec::new();
        for (pass, kernel) in self.passes() {
            files.push(File { path: self.path(target, &pass.name), bytes: self.shader(target, pass, kernel)? });
        }
        if !self.options.single_file {
            return Ok(files);
        }
        let version = "#version 450\n";
        let mut text = if target == Target::Glsl { version.to_owned() } else { String::new() };
        for (file, (pass, _)) in files.iter().zip(self.passes()) {
            let text_of_pass = String::from_utf8_lossy(&file.bytes).replacen(version, "", 1);
            text += &format!("#ifdef {0}\n\n{text_of_pass}\n#endif // {0}\n\n", pass_macro(&pass.name));
        }
        Ok(vec![File::text(self.path(target, ""), text.trim_end().to_owned() + "\n")])
    }
}

/// The macro that chooses a pass of a single file.
fn pass_macro(pass: &str) -> String {
    format!("LIMPID_{}", pass.to_uppercase())
}
