//! The bundle and its manifest.

use std::collections::HashMap;

use glam::UVec2;
use limpid::export::{MANIFEST, Options, Target, bundle, manifest_schema};
use limpid::{Plan, Settings};
use proptest::prelude::*;
use serde_json::Value;
use sha2::{Digest, Sha256};

mod any_settings;
use any_settings::any_settings;

fn manifest(settings: &Settings) -> Value {
    let files = bundle(settings, &Options::default()).unwrap();
    serde_json::from_slice(&files.iter().find(|file| file.path == MANIFEST).unwrap().bytes).unwrap()
}

/// Value of an expression of the manifest: sums of products of numbers, names and expressions in parentheses.
struct Expression<'a> {
    rest: &'a str,
    size: UVec2,
}

impl Expression<'_> {
    fn of(text: &str, size: UVec2) -> u64 {
        let mut expression = Expression { rest: text, size };
        let value = expression.sum();
        assert_eq!(expression.rest, "", "{text}");
        value
    }

    fn skip(&mut self, symbol: &str) -> bool {
        let rest = self.rest.trim_start().strip_prefix(symbol);
        rest.is_some_and(|rest| {
            self.rest = rest.trim_start();
            true
        })
    }

    fn sum(&mut self) -> u64 {
        let mut value = self.product();
        while self.skip("+") {
            value += self.product();
        }
        value
    }

    fn product(&mut self) -> u64 {
        let mut value = self.factor();
        loop {
            if self.skip("*") {
                value *= self.factor();
            } else if self.skip("/") {
                value /= self.factor();
            } else {
                return value;
            }
        }
    }

    fn factor(&mut self) -> u64 {
        if self.skip("(") {
            let value = self.sum();
            assert!(self.skip(")"), "{}", self.rest);
            return value;
        }
        let end = self.rest.find(|c: char| !c.is_alphanumeric()).unwrap_or(self.rest.len());
        let word = &self.rest[..end];
        self.rest = self.rest[end..].trim_start();
        match word {
            "width" => self.size.x.into(),
            "height" => self.size.y.into(),
            number => number.parse().unwrap(),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// A reader that evaluates the manifest's expressions allocates and dispatches what the plan says.
    #[test]
    fn the_manifest_says_what_the_plan_says(settings in any_settings(), x in 1u32..5000, y in 1u32..5000) {
        let size = UVec2::new(x, y);
        let (plan, _) = Plan::new(&settings, size).unwrap();
        let manifest = manifest(&settings);
        let entries = manifest["resources"].as_array().unwrap();
        let copies: HashMap<_, _> = entries.iter().map(|e| (e["name"].as_str().unwrap(), e["copies"].as_u64().unwrap())).collect();
        for resource in &plan.resources {
            let entry = entries.iter().find(|entry| entry["name"] == resource.name.as_str()).unwrap();
            let bytes = entry["bytes"].as_str().map_or(0, |text| Expression::of(text, size));
            prop_assert_eq!(bytes * copies[resource.name.as_str()], resource.bytes(size), "{}", resource.name);
        }
        prop_assert_eq!(entries.len(), plan.resources.len());
        let total = |which: &str| Expression::of(manifest["memory"][which].as_str().unwrap(), size);
        prop_assert_eq!(total("persistent"), plan.memory().persistent);
        prop_assert_eq!(total("transient"), plan.memory().transient);
        for (entry, pass) in manifest["passes"].as_array().unwrap().iter().zip(&plan.passes) {
            prop_assert_eq!(entry["name"].as_str().unwrap(), &pass.name);
            for (entry, bound) in entry["bindings"].as_array().unwrap().iter().zip(&pass.bindings) {
                prop_assert_eq!(entry["variable"].as_str().unwrap(), &bound.variable);
                prop_assert!(copies.contains_key(entry["resource"].as_str().unwrap()));
                prop_assert!(entry["copy"] != "previous" || copies[entry["resource"].as_str().unwrap()] == 2);
                prop_assert_eq!(&entry["spirv"]["set"], &entry["wgsl"]["group"]);
            }
            if let Some(text) = entry["grid"]["x"].as_str() {
                prop_assert!(Expression::of(text, size) >= 1);
            }
        }
        prop_assert_eq!(serde_json::from_value::<Settings>(manifest["settings"].clone()).unwrap(), settings);
    }
}

/// Checks that every key of a value is a property of its schema, and that nothing required is missing.
fn check(value: &Value, schema: &Value, root: &Value, path: &str) {
    if let Some(name) = schema["$ref"].as_str() {
        return check(value, root.pointer(&name[1..]).unwrap(), root, path);
    }
    for list in ["anyOf", "oneOf"] {
        if let Some(choices) = schema[list].as_array() {
            let fits = |choice: &&Value| {
                let quiet = std::panic::catch_unwind(|| check(value, choice, root, path));
                quiet.is_ok()
            };
            assert!(choices.iter().any(|choice| fits(&choice)), "{path}: {value} fits none");
            return;
        }
    }
    if let Some(constant) = schema.get("const") {
        assert_eq!(value, constant, "{path}");
    }
    let types = match &schema["type"] {
        Value::String(ty) => vec![ty.as_str()],
        Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    let found = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    assert!(types.is_empty() || types.contains(&found), "{path}: {found} is not {types:?}");
    for name in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        assert!(value.get(name).is_some(), "{path} has no {name}");
    }
    if let (Some(object), Some(properties)) = (value.as_object(), schema["properties"].as_object()) {
        for (name, value) in object {
            let property = properties.get(name).unwrap_or_else(|| panic!("{path}.{name} is not in the schema"));
            check(value, property, root, &format!("{path}.{name}"));
        }
    }
    for (index, value) in value.as_array().into_iter().flatten().enumerate() {
        check(value, &schema["items"], root, &format!("{path}[{index}]"));
    }
}

#[test]
fn the_manifest_follows_its_schema_and_names_every_file() {
    let mut settings = Settings::default();
    settings.coverage.ray_list = Some(limpid::settings::RayList::default());
    let files = bundle(&settings, &Options::default()).unwrap();
    assert_eq!(files, bundle(&settings, &Options::default()).unwrap(), "the same again");
    let manifest = manifest(&settings);
    let schema: Value = serde_json::from_str(&manifest_schema()).unwrap();
    check(&manifest, &schema, &schema, "manifest");
    let listed: Vec<_> = manifest["files"].as_array().unwrap().iter().map(|f| f["path"].as_str().unwrap()).collect();
    let written: Vec<_> = files.iter().map(|file| file.path.as_str()).filter(|path| *path != MANIFEST).collect();
    assert_eq!(listed, written);
    for pass in manifest["passes"].as_array().unwrap() {
        for shader in pass["shaders"].as_object().unwrap().values() {
            assert!(listed.contains(&shader["file"].as_str().unwrap()), "{shader}");
        }
    }
    for (entry, file) in manifest["files"].as_array().unwrap().iter().zip(files.iter().filter(|f| f.path != MANIFEST)) {
        let digest: String = Sha256::digest(&file.bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!((entry["sha256"].as_str(), entry["size"].as_u64()), (Some(&*digest), Some(file.bytes.len() as u64)));
    }
}

#[test]
fn every_setting_has_another_hash_and_options_that_do_not_fit_are_refused() {
    let hash = |settings: &Settings| limpid::export::settings_hash(settings);
    let mut settings = Settings::default();
    let default = hash(&settings);
    settings.resolve.stability = 0.5;
    assert_ne!(hash(&settings), default);
    let options = Options { targets: vec![Target::Spirv], single_file: true, ..Options::default() };
    let message = bundle(&settings, &options).unwrap_err().to_string();
    assert!(message.contains("single file") && message.contains("spirv has no preprocessor"), "{message}");
    settings.resolve.stability = 7.0;
    assert!(bundle(&settings, &Options::default()).unwrap_err().to_string().contains("resolve.stability"));
}

/// How a few files look, one of each kind.
#[test]
fn a_few_files() {
    let settings = Settings::default();
    let files = bundle(&settings, &Options::default()).unwrap();
    for path in [
        "hlsl/fill.hlsl",
        "msl/fill.metal",
        "glsl/fill.comp",
        "wgsl/fill.wgsl",
        "hlsl/indirect_args.hlsl",
        "wgsl/indirect_args.wgsl",
    ] {
        let file = files.iter().find(|file| file.path == path).unwrap();
        let text = std::str::from_utf8(&file.bytes).unwrap();
        // Other defaults, or another version, are no other text.
        let text = text
            .replace(&limpid::export::settings_hash(&settings), "HASH")
            .replace(env!("CARGO_PKG_VERSION"), "VERSION");
        insta::assert_snapshot!(path.replace(['/', '.'], "_"), text);
    }
}
