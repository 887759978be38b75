//! Settings from a preset, a file and single options, each overriding the one before.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use limpid::{Preset, Settings};
use toml::{Table, Value};

#[derive(Debug, Args)]
pub(crate) struct SettingsOptions {
    /// Settings to start from.
    #[arg(long, default_value = "default", value_parser = preset_names())]
    preset: String,
    /// TOML or JSON file with the settings that differ from the preset.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// One setting by its path, such as resolve.stability=0.5. Can be given more than once.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
}

fn preset_names() -> clap::builder::PossibleValuesParser {
    Preset::ALL.iter().map(|(name, _)| *name).collect::<Vec<_>>().into()
}

/// Overrides `base` by `change`, tables entry by entry.
fn merge(base: &mut Table, change: Table) {
    for (key, value) in change {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(base)), Value::Table(change)) => merge(base, change),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

fn read_file(path: &Path) -> Result<Table> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let invalid = || format!("{} is not valid", path.display());
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
        serde_json::from_str(&text).with_context(invalid)
    } else {
        text.parse().with_context(invalid)
    }
}

/// `a.b=value` as a table.
fn parse_set(option: &str) -> Result<Table> {
    let Some((path, value)) = option.split_once('=') else {
        bail!("expected --set PATH=VALUE, found `{option}`");
    };
    // What is no TOML value is a word.
    let parsed = format!("value = {value}").parse::<Table>().ok().and_then(|mut table| table.remove("value"));
    let value = parsed.unwrap_or_else(|| Value::String(value.to_owned()));
    let mut keys = path.trim().rsplit('.');
    let last = keys.next().unwrap_or_default();
    let innermost = Table::from_iter([(last.to_owned(), value)]);
    Ok(keys.fold(innermost, |inner, key| Table::from_iter([(key.to_owned(), Value::Table(inner))])))
}

impl SettingsOptions {
    /// The settings file that was given.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.settings.as_deref()
    }

    pub(crate) fn new(preset: &str, settings: Option<&Path>, set: &[String]) -> Self {
        Self { preset: preset.to_owned(), settings: settings.map(Path::to_owned), set: set.to_vec() }
    }

    pub(crate) fn load(&self) -> Result<Settings> {
        let preset = Preset::ALL.iter().find(|(name, _)| *name == self.preset);
        let (_, preset) = preset.with_context(|| format!("there is no preset `{}`", self.preset))?;
        let mut table = Table::try_from(preset.settings())?;
        let mut check = |change: Table, origin: &str| -> Result<Settings> {
            merge(&mut table, change);
            let settings: Settings = table.clone().try_into().with_context(|| format!("settings in {origin}"))?;
            settings.validate().with_context(|| format!("settings in {origin}"))?;
            Ok(settings)
        };
        let mut settings = preset.settings();
        if let Some(path) = &self.settings {
            settings = check(read_file(path)?, &path.display().to_string())?;
        }
        for option in &self.set {
            settings = check(parse_set(option)?, &format!("--set {option}"))?;
        }
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(set: &[&str]) -> Result<Settings> {
        let set = set.iter().map(|s| s.to_string()).collect();
        SettingsOptions { preset: "reference".to_owned(), settings: None, set }.load()
    }

    #[test]
    fn options_override_the_preset() {
        let settings = load(&[
            "resolve.stability=0.25",
            "coverage.fallback=black",
            "coverage.ray_list.rays_per_quad=one",
            "conventions.motion_scale=[0.5, -0.5]",
        ])
        .unwrap();
        assert_eq!(settings.resolve.stability, 0.25);
        assert_eq!(settings.coverage.fallback, limpid::settings::Fallback::Black);
        assert!(settings.coverage.ray_list.is_some());
        assert_eq!(settings.conventions.motion_scale, glam::Vec2::new(0.5, -0.5));
        // Untouched ones are the preset's.
        assert_eq!(settings.prefilter, Preset::Reference.settings().prefilter);
        assert_eq!(load(&[]).unwrap(), Preset::Reference.settings());
    }

    #[test]
    fn mistakes_are_named() {
        for (option, expected) in [
            ("resolve.stability=2", "`resolve.stability` is 2, expected 0.0 to 1.0"),
            ("resolve.stabilty=0.5", "unknown field `stabilty`"),
            ("coverage.fallback=blue", "unknown variant `blue`"),
            ("stability", "PATH=VALUE"),
        ] {
            let message = format!("{:#}", load(&[option]).unwrap_err());
            assert!(message.contains(expected) && message.contains(option), "{message}");
        }
    }
}
