//! Settings from a preset, a file and single options, each overriding the one before.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use limpid::{Preset, Settings};
use serde_json::{Map, Value};

#[derive(Debug, Args)]
pub(crate) struct SettingsOptions {
    /// Settings to start from.
    #[arg(long, default_value = "default", value_parser = preset_names())]
    preset: String,
    /// TOML or JSON file with the settings that differ from the preset; `-` is JSON on standard input.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Features to turn on or, with `-` before the name, off, or to give a value, such as
    /// -light_change,near_taps=8,constant_roughness=0.3. docs/features.md lists them.
    #[arg(long, value_name = "[-]NAME[=VALUE],...", value_delimiter = ',', allow_hyphen_values = true)]
    features: Vec<String>,
    /// One setting by its path, such as resolve.stability=0.5. Can be given more than once.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
}

fn preset_names() -> clap::builder::PossibleValuesParser {
    Preset::ALL.iter().map(|(name, _)| *name).collect::<Vec<_>>().into()
}

/// Overrides `base` by `change`, objects entry by entry.
fn merge(base: &mut Value, change: Value) {
    match (base, change) {
        (Value::Object(base), Value::Object(change)) => {
            for (key, value) in change {
                merge(base.entry(key).or_insert(Value::Null), value);
            }
        }
        (base, change) => *base = change,
    }
}

fn read_file(path: &Path) -> Result<Value> {
    if path == Path::new("-") {
        return serde_json::from_reader(std::io::stdin()).context("standard input is not valid JSON");
    }
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let invalid = || format!("{} is not valid", path.display());
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
        serde_json::from_str(&text).with_context(invalid)
    } else {
        toml::from_str(&text).with_context(invalid)
    }
}

/// A value as TOML has it; what is none is a word.
fn parse_value(text: &str) -> Value {
    let parsed = toml::from_str::<Map<String, Value>>(&format!("value = {text}"));
    let value = parsed.ok().and_then(|mut table| table.remove("value"));
    value.unwrap_or_else(|| Value::String(text.to_owned()))
}

fn object(key: &str, value: Value) -> Value {
    Value::Object(Map::from_iter([(key.to_owned(), value)]))
}

/// `a.b=value` as an object.
fn parse_set(option: &str) -> Result<Value> {
    let Some((path, value)) = option.split_once('=') else {
        bail!("expected --set PATH=VALUE, found `{option}`");
    };
    Ok(path.trim().rsplit('.').fold(parse_value(value), |inner, key| object(key, inner)))
}

/// `name`, `-name` or `name=value` as an object. What is off is `false`, or no value where there is one.
fn parse_feature(option: &str, settings: &Value) -> Value {
    let (name, value) = match (option.split_once('='), option.strip_prefix('-')) {
        (Some((name, value)), _) => (name, parse_value(value)),
        (None, Some(name)) if settings["features"][name].is_boolean() => (name, Value::Bool(false)),
        (None, Some(name)) => (name, Value::Null),
        (None, None) => (option, Value::Bool(true)),
    };
    object("features", object(name, value))
}

impl SettingsOptions {
    /// The settings file that was given.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.settings.as_deref()
    }

    pub(crate) fn new(preset: &str, settings: Option<&Path>, set: &[String]) -> Self {
        let (preset, settings) = (preset.to_owned(), settings.map(Path::to_owned));
        Self { preset, settings, features: Vec::new(), set: set.to_vec() }
    }

    pub(crate) fn load(&self) -> Result<Settings> {
        let preset = Preset::ALL.iter().find(|(name, _)| *name == self.preset);
        let (_, preset) = preset.with_context(|| format!("there is no preset `{}`", self.preset))?;
        let mut value = serde_json::to_value(preset.settings())?;
        let mut features = Value::Object(Map::new());
        self.features.iter().for_each(|option| merge(&mut features, parse_feature(option, &value)));
        let mut settings = preset.settings();
        let mut apply = |change: Value, origin: &str| -> Result<()> {
            merge(&mut value, change);
            settings = serde_json::from_value(value.clone()).with_context(|| format!("settings in {origin}"))?;
            settings.validate().with_context(|| format!("settings in {origin}"))
        };
        if let Some(path) = &self.settings {
            apply(read_file(path)?, &path.display().to_string())?;
        }
        apply(features, &format!("--features {}", self.features.join(",")))?;
        for option in &self.set {
            apply(parse_set(option)?, &format!("--set {option}"))?;
        }
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load_with(features: &[&str], set: &[&str]) -> Result<Settings> {
        let owned = |options: &[&str]| options.iter().map(|option| option.to_string()).collect();
        let (features, set) = (owned(features), owned(set));
        SettingsOptions { preset: "reference".to_owned(), settings: None, features, set }.load()
    }

    fn load(set: &[&str]) -> Result<Settings> {
        load_with(&[], set)
    }

    #[test]
    fn features_are_turned_on_and_off() {
        let few = load_with(&["-history_search", "-mirror_parallax", "constant_roughness=0.3"], &[]).unwrap().features;
        assert!(!few.history_search && !few.mirror_parallax && few.edge_repair);
        assert_eq!(few.constant_roughness, Some(0.3));
        // Later ones win, and single settings over features.
        let on = load_with(&["-edge_repair", "edge_repair", "constant_roughness=0.3", "-constant_roughness"], &[]);
        assert_eq!(on.unwrap(), Preset::Reference.settings());
        assert!(load_with(&["-edge_repair"], &["features.edge_repair=true"]).unwrap().features.edge_repair);
        for (features, expected) in [
            (&["-history_serach"][..], "unknown field `history_serach`"),
            (&["constant_roughness=2"], "`features.constant_roughness` is 2, expected 0 to 1"),
            (&["constant_roughness"], "expected f32"),
            (&["-mirror_parallax", "-surface_motion"], "no history to find"),
        ] {
            let message = format!("{:#}", load_with(features, &[]).unwrap_err());
            assert!(message.contains(expected) && message.contains(&features.join(",")), "{message}");
        }
    }

    #[test]
    fn files_are_toml_or_json() {
        let folder = std::env::temp_dir().join(format!("limpid-settings-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let mut settings = Settings::default();
        settings.resolve.stability = 0.25;
        // Everything, as manifest.json has it: `null` where there is no value.
        let whole = serde_json::to_string(&settings).unwrap();
        for (name, text) in [("a.json", whole.as_str()), ("a.toml", "[resolve]\nstability = 0.25\n")] {
            let path = folder.join(name);
            std::fs::write(&path, text).unwrap();
            assert_eq!(SettingsOptions::new("default", Some(&path), &[]).load().unwrap(), settings);
        }
        std::fs::remove_dir_all(&folder).unwrap();
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
