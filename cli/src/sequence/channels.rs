//! Which channel of an EXR file holds what.

/// The names, in the files of a sequence, of the channels a frame is made of.
///
/// A name is found as it stands, or as part name, dot and channel name in a multi-part file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChannelNames {
    /// Noisy radiance: `reflection.R`, `.G`, `.B`.
    pub radiance: [String; 3],
    /// Length of the reflection ray: `reflection.A`.
    pub hit_distance: String,
    /// World-space normal: `normal.X`, `.Y`, `.Z`. Frames may lack all three as long as the names are the default ones:
    /// normals are 0 then.
    pub normal: [String; 3],
    /// Perceptual roughness: `roughness`.
    pub roughness: String,
    /// Linear view depth: `Z`.
    pub depth: String,
    /// Motion in uv: `motion.X`, `.Y`.
    pub motion: [String; 2],
    /// World-space motion of what the reflection ray hit: `hit_motion.X`, `.Y`, `.Z`. Frames may lack all three as
    /// long as the names are the default ones.
    pub hit_motion: [String; 3],
    /// Converged radiance: `reference.R`, `.G`, `.B`. Frames may lack all three as long as the
    /// names are the default ones.
    pub reference: [String; 3],
}

/// Why an option `key=name` was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChannelOptionError {
    /// There is no `=`.
    #[error("channel option `{option}`: expected key=name")]
    NoName {
        /// The option.
        option: String,
    },
    /// There is nothing of that name to choose a channel for.
    #[error("channel option `{option}`: unknown key `{key}`, expected one of {}", KEYS.join(", "))]
    UnknownKey {
        /// The option.
        option: String,
        /// The part before `=`.
        key: String,
    },
    /// A wrong number of channels is listed.
    #[error("channel option `{option}`: expected one name or {expected} with commas, found {found}")]
    WrongCount {
        /// The option.
        option: String,
        /// The number of channels of the key.
        expected: usize,
        /// The number of names.
        found: usize,
    },
}

const KEYS: [&str; 8] =
    ["radiance", "hit_distance", "normal", "roughness", "depth", "motion", "hit_motion", "reference"];

impl Default for ChannelNames {
    fn default() -> Self {
        Self {
            radiance: with_suffixes("reflection", ["R", "G", "B"]),
            hit_distance: "reflection.A".to_owned(),
            normal: with_suffixes("normal", ["X", "Y", "Z"]),
            roughness: "roughness".to_owned(),
            depth: "Z".to_owned(),
            motion: with_suffixes("motion", ["X", "Y"]),
            hit_motion: with_suffixes("hit_motion", ["X", "Y", "Z"]),
            reference: with_suffixes("reference", ["R", "G", "B"]),
        }
    }
}

impl ChannelNames {
    /// Applies one option `key=name`; the keys are the names of the fields.
    ///
    /// For a single channel the name is the channel's: `depth=ViewLayer.Depth.Z`. For a colour or
    /// vector it is what stands before `.R .G .B`, `.X .Y .Z` or `.X .Y`: `radiance=Combined`; an
    /// empty name means plain `R`, `G`, `B`. Channels with other endings are listed one by one:
    /// `normal=N.R,N.G,N.B`.
    pub fn set(&mut self, option: &str) -> Result<(), ChannelOptionError> {
        let Some((key, name)) = option.split_once('=') else {
            return Err(ChannelOptionError::NoName { option: option.to_owned() });
        };
        match key {
            "radiance" => self.radiance = group(option, name, ["R", "G", "B"])?,
            "hit_distance" => self.hit_distance = name.to_owned(),
            "normal" => self.normal = group(option, name, ["X", "Y", "Z"])?,
            "roughness" => self.roughness = name.to_owned(),
            "depth" => self.depth = name.to_owned(),
            "motion" => self.motion = group(option, name, ["X", "Y"])?,
            "hit_motion" => self.hit_motion = group(option, name, ["X", "Y", "Z"])?,
            "reference" => self.reference = group(option, name, ["R", "G", "B"])?,
            _ => {
                return Err(ChannelOptionError::UnknownKey { option: option.to_owned(), key: key.to_owned() });
            }
        }
        Ok(())
    }

    /// The default names with every option applied in turn, see [`ChannelNames::set`].
    pub fn parse<S: AsRef<str>>(options: impl IntoIterator<Item = S>) -> Result<Self, ChannelOptionError> {
        let mut names = Self::default();
        for option in options {
            names.set(option.as_ref())?;
        }
        Ok(names)
    }
}

fn group<const N: usize>(option: &str, name: &str, suffixes: [&str; N]) -> Result<[String; N], ChannelOptionError> {
    let names: Vec<&str> = name.split(',').collect();
    if let [prefix] = names[..] {
        return Ok(with_suffixes(prefix, suffixes));
    }
    let wrong_count = ChannelOptionError::WrongCount { option: option.to_owned(), expected: N, found: names.len() };
    <[&str; N]>::try_from(names).map(|names| names.map(|name| name.trim().to_owned())).map_err(|_| wrong_count)
}

fn with_suffixes<const N: usize>(prefix: &str, suffixes: [&str; N]) -> [String; N] {
    suffixes.map(|suffix| match prefix {
        "" => suffix.to_owned(),
        prefix => format!("{prefix}.{suffix}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_name_channels() {
        let options = ["depth=ViewLayer.Depth.Z", "radiance=", "normal=N.R,N.G,N.B", "motion=Vector"];
        let names = ChannelNames::parse(options).unwrap();
        assert_eq!(names.depth, "ViewLayer.Depth.Z");
        assert_eq!(names.radiance, ["R", "G", "B"]);
        assert_eq!(names.normal, ["N.R", "N.G", "N.B"]);
        assert_eq!(names.motion, ["Vector.X", "Vector.Y"]);
        assert_eq!(names.hit_distance, "reflection.A");
    }

    #[test]
    fn wrong_options_are_explained() {
        let message = |option| ChannelNames::parse([option]).unwrap_err().to_string();
        assert_eq!(
            message("albedo=A"),
            "channel option `albedo=A`: unknown key `albedo`, expected one of radiance, \
             hit_distance, normal, roughness, depth, motion, hit_motion, reference"
        );
        assert_eq!(message("depth"), "channel option `depth`: expected key=name");
        assert_eq!(
            message("motion=A,B,C"),
            "channel option `motion=A,B,C`: expected one name or 2 with commas, found 3"
        );
    }
}
