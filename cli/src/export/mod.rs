//! Exports on disk: written whole or not at all, and compared.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use limpid::export::{File, MANIFEST};

/// How a folder differs from an export.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Differences {
    /// Files that are not there.
    pub missing: Vec<String>,
    /// Files with other content.
    pub changed: Vec<String>,
    /// Files that the export does not have.
    pub extra: Vec<String>,
}

impl Differences {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.missing.is_empty() && self.changed.is_empty() && self.extra.is_empty()
    }
}

/// Paths of all files below a folder, with `/`.
fn files_below(folder: &Path) -> Result<BTreeSet<String>> {
    let mut found = BTreeSet::new();
    let mut open = vec![(folder.to_owned(), String::new())];
    while let Some((folder, prefix)) = open.pop() {
        let entries = fs::read_dir(&folder).with_context(|| format!("cannot read the folder {}", folder.display()))?;
        for entry in entries {
            let entry = entry.with_context(|| format!("cannot read the folder {}", folder.display()))?;
            let path = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                open.push((entry.path(), path + "/"));
            } else {
                found.insert(path);
            }
        }
    }
    Ok(found)
}

/// Compares a folder with what an export would write.
///
/// # Errors
///
/// If the folder cannot be read.
pub fn compare(files: &[File], folder: &Path) -> Result<Differences> {
    let mut differences = Differences::default();
    let mut found = files_below(folder)?;
    for file in files {
        if !found.remove(&file.path) {
            differences.missing.push(file.path.clone());
            continue;
        }
        let path = folder.join(&file.path);
        if fs::read(&path).with_context(|| format!("cannot read {}", path.display()))? != file.bytes {
            differences.changed.push(file.path.clone());
        }
    }
    differences.extra = found.into_iter().collect();
    Ok(differences)
}

/// Refuses a folder that replacing would lose something of.
fn check_replaceable(folder: &Path, force: bool) -> Result<()> {
    let found = files_below(folder)?;
    if found.is_empty() {
        return Ok(());
    }
    let path = folder.display();
    if !force {
        bail!("{path} exists; use --force to replace an earlier export, --out to write elsewhere, --check to compare");
    }
    let text = fs::read_to_string(folder.join(MANIFEST)).unwrap_or_default();
    let manifest: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let (true, Some(listed)) = (manifest["limpid_version"].is_string(), manifest["files"].as_array()) else {
        bail!("{path} is no earlier export: it has no {MANIFEST} of limpid's; nothing was replaced");
    };
    let listed: BTreeSet<_> = listed.iter().filter_map(|file| file["path"].as_str()).collect();
    if let Some(foreign) = found.iter().find(|path| *path != MANIFEST && !listed.contains(path.as_str())) {
        bail!("{path} contains {foreign}, which is not of the earlier export; move it away first");
    }
    Ok(())
}

/// A path beside another, for temporary use.
fn sibling(folder: &Path, purpose: &str) -> Result<PathBuf> {
    let name = folder.file_name().with_context(|| format!("{} names no folder", folder.display()))?;
    Ok(folder.with_file_name(format!(".{}.{purpose}-{}", name.to_string_lossy(), std::process::id())))
}

fn write_all(files: &[File], folder: &Path) -> Result<()> {
    for file in files {
        let path = folder.join(&file.path);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).with_context(|| format!("cannot create the folder {}", parent.display()))?;
        fs::write(&path, &file.bytes).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// Writes an export as a folder: into a new one beside it first, which then takes its place. When anything fails,
/// what was there stays.
///
/// # Errors
///
/// If the folder holds anything and `force` is not set, or anything that is not of an earlier export.
pub fn write(files: &[File], folder: &Path, force: bool) -> Result<()> {
    let folder = &std::path::absolute(folder).with_context(|| format!("{} is no path", folder.display()))?;
    let exists = folder.exists();
    if exists {
        check_replaceable(folder, force)?;
    }
    let (fresh, old) = (sibling(folder, "new")?, sibling(folder, "old")?);
    let result = write_all(files, &fresh).and_then(|()| {
        if exists {
            fs::rename(folder, &old).with_context(|| format!("cannot move {} away", folder.display()))?;
        }
        fs::rename(&fresh, folder).or_else(|error| {
            if exists {
                fs::rename(&old, folder).with_context(|| format!("the earlier export is in {}", old.display()))?;
            }
            Err(error).with_context(|| format!("cannot create {}", folder.display()))
        })
    });
    if result.is_err() {
        let _ = fs::remove_dir_all(&fresh);
    } else if exists {
        fs::remove_dir_all(&old).with_context(|| format!("cannot remove {}", old.display()))?;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, text: &str) -> File {
        File { path: path.to_owned(), bytes: text.as_bytes().to_vec() }
    }

    fn export(version: &str) -> Vec<File> {
        let manifest = r#"{"limpid_version": "1", "files": [{"path": "a/b.txt"}]}"#;
        vec![file("a/b.txt", version), file(MANIFEST, manifest)]
    }

    #[test]
    fn folders_are_replaced_whole_or_not_at_all() {
        let root = std::env::temp_dir().join(format!("limpid-export-unit-{}", std::process::id()));
        let out = root.join("out");
        let text = || fs::read_to_string(out.join("a/b.txt")).unwrap();
        write(&export("one"), &out, false).unwrap();
        assert!(write(&export("two"), &out, false).unwrap_err().to_string().contains("--force"));
        assert_eq!(text(), "one");
        write(&export("two"), &out, true).unwrap();
        assert_eq!(text(), "two");
        assert!(compare(&export("two"), &out).unwrap().is_empty());
        assert_eq!(compare(&export("three"), &out).unwrap().changed, ["a/b.txt"]);

        // A file of somebody else's is never lost.
        fs::write(out.join("a/mine.txt"), "mine").unwrap();
        assert_eq!(compare(&export("two"), &out).unwrap().extra, ["a/mine.txt"]);
        let error = write(&export("three"), &out, true).unwrap_err().to_string();
        assert!(error.contains("a/mine.txt"), "{error}");
        fs::remove_file(out.join("a/mine.txt")).unwrap();
        // Nor a folder that is no export.
        let other = root.join("other");
        fs::create_dir(&other).unwrap();
        fs::write(other.join("precious"), "").unwrap();
        assert!(write(&export("three"), &other, true).unwrap_err().to_string().contains("no earlier export"));
        // A failure half way leaves the earlier export, and no litter.
        let broken = vec![file("a", "a file"), file("a/b.txt", "and a folder of the same name")];
        assert!(write(&broken, &out, true).is_err());
        assert_eq!(text(), "two");
        let names: Vec<_> = fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names.len(), 2, "{names:?}");
        // An empty folder may be filled.
        fs::remove_file(other.join("precious")).unwrap();
        write(&export("one"), &other, false).unwrap();
        fs::remove_dir_all(&root).unwrap();
    }
}
