//! Processes in which RADV believes in a GPU.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use limpid::Settings;

use super::Cost;

/// A generation of AMD's GPUs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Generation {
    /// Name on the command line, which all versions of RADV know unless `other_name` says otherwise.
    pub name: &'static str,
    /// Name in other versions of RADV.
    pub other_name: Option<&'static str>,
    /// Architecture and some product with it.
    pub description: &'static str,
}

const fn generation(name: &'static str, other_name: Option<&'static str>, description: &'static str) -> Generation {
    Generation { name, other_name, description }
}

/// What is asked about unless other GPUs are named.
pub const GENERATIONS: &[Generation] = &[
    generation("polaris10", None, "GCN 4, Radeon RX 480"),
    generation("vega10", None, "GCN 5, Radeon RX Vega 64"),
    generation("navi10", None, "RDNA 1, Radeon RX 5700"),
    generation("navi21", None, "RDNA 2, Radeon RX 6800"),
    generation("navi31", Some("gfx1100"), "RDNA 3, Radeon RX 7900"),
];

/// Folders in which Vulkan's loader looks for drivers on Linux.
const FOLDERS: &[&str] = &["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d"];

/// RADV, by the file that tells Vulkan's loader about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Driver(PathBuf);

impl Driver {
    /// The driver of a manifest, or the installed one.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn find(manifest: Option<&Path>) -> Result<Self> {
        if let Some(path) = manifest {
            std::fs::metadata(path).with_context(|| format!("cannot read the driver's manifest {}", path.display()))?;
            return Ok(Self(path.to_owned()));
        }
        let files = FOLDERS.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
        let is_radv = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            name.starts_with("radeon_icd") && name.ends_with(".json")
        };
        let Some(path) = files.map(|entry| entry.path()).find(is_radv) else {
            bail!(
                "RADV, Mesa's Vulkan driver for AMD GPUs, is not installed: no radeon_icd*.json in {}. \
                 On Debian and Ubuntu: apt-get install mesa-vulkan-drivers. --driver FILE names one elsewhere",
                FOLDERS.join(", ")
            );
        };
        Ok(Self(path))
    }
}

/// What to compile.
#[derive(Debug, Clone)]
pub struct Job<'a> {
    /// The `limpid` command.
    pub program: &'a Path,
    /// Settings.
    pub settings: &'a Settings,
    /// Folder with kernels, in place of those built in.
    pub kernels: Option<&'a Path>,
}

impl Job<'_> {
    /// Compiles for a GPU by its name.
    ///
    /// # Errors
    ///
    /// When the driver does not know it or cannot tell what it compiled.
    pub fn run(&self, driver: &Driver, gpu: &str) -> Result<Cost> {
        let known = GENERATIONS.iter().find(|generation| generation.name == gpu);
        let other_name = known.and_then(|generation| generation.other_name);
        let mut cost = match (self.run_as(driver, gpu), other_name) {
            (Err(_), Some(other)) => self.run_as(driver, other)?,
            (cost, _) => cost?,
        };
        cost.gpu = gpu.to_owned();
        Ok(cost)
    }

    fn run_as(&self, driver: &Driver, family: &str) -> Result<Cost> {
        let mut command = Command::new(self.program);
        command.args(["cost", "--this-device", "--json", "--settings", "-"]);
        if let Some(folder) = self.kernels {
            command.arg("--kernels").arg(folder);
        }
        command
            .env("RADV_FORCE_FAMILY", family)
            // The second is the loader's older name for the first.
            .env("VK_DRIVER_FILES", &driver.0)
            .env("VK_ICD_FILENAMES", &driver.0)
            .env_remove("VK_ADD_DRIVER_FILES")
            // A shader from the cache has no statistics.
            .env("MESA_SHADER_CACHE_DISABLE", "true")
            // Mesa's layer that sorts devices wants a display.
            .env("NODEVICE_SELECT", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let cannot_start = || format!("cannot start {}", self.program.display());
        let mut child = command.spawn().with_context(cannot_start)?;
        if let Some(mut stdin) = child.stdin.take() {
            // A child that ended early says why on standard error.
            let _ = stdin.write_all(&serde_json::to_vec(self.settings)?);
        }
        let output = child.wait_with_output().with_context(cannot_start)?;
        if !output.status.success() {
            let errors = String::from_utf8_lossy(&output.stderr);
            bail!("RADV as `{family}` failed ({}): {}", output.status, errors.trim());
        }
        serde_json::from_slice(&output.stdout).with_context(|| format!("RADV as `{family}` gave no JSON"))
    }
}
