//! The layers an image can have. A new one is a variant of [`Aov`] and a row of [`TABLE`].

use std::fmt;
use std::str::FromStr;

use crate::PixelSample;

/// A layer (arbitrary output variable) of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "each is described by its row of the table")]
pub enum Aov {
    Beauty,
    Z,
    N,
    P,
    Albedo,
    DirectDiffuse,
    IndirectDiffuse,
    DirectSpecular,
    IndirectSpecular,
    Emission,
    SampleCount,
    Variance,
    PrimId,
    InstanceId,
}

/// One row of [`TABLE`].
pub(crate) struct AovRow {
    pub(crate) aov: Aov,
    pub(crate) name: &'static str,
    /// Names that husk, Karma, RenderMan, Arnold and Cycles users write; light path expressions
    /// among them. Compared without regard to case.
    pub(crate) aliases: &'static [&'static str],
    /// Names of the channels in the file, as OpenEXR tools group them: `layer.channel`.
    pub(crate) channels: &'static [&'static str],
    pub(crate) rule: Rule,
    /// Whether half precision is enough when asked for; everything else is 32 bit float. Ids and
    /// counts are floats too, as husk and Nuke have them: exact to 2^24, and -1 stays -1.
    pub(crate) half_allowed: bool,
    pub(crate) doc: &'static str,
}

/// How the samples of a pixel become its value. `read` gives as many numbers as there are
/// channels, then zeros.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rule {
    /// Their average.
    Mean { read: fn(&PixelSample) -> [f32; 3] },
    /// That of the sample nearest to the pixel center, the first among equals; `empty` where
    /// there are no samples.
    Nearest {
        read: fn(&PixelSample) -> [f32; 3],
        empty: f32,
    },
    /// From the sums that the beauty needs in any case.
    Statistic,
}

pub(crate) const TABLE: [AovRow; 14] = [
    AovRow {
        aov: Aov::Beauty,
        name: "beauty",
        aliases: &[
            "C", "Ci", "Cf", "color", "rgba", "rgb", "combined", "C.*", "LPE:C.*",
        ],
        channels: &["R", "G", "B", "A"],
        rule: Rule::Statistic,
        half_allowed: true,
        doc: "radiance, premultiplied by the opacity A",
    },
    AovRow {
        aov: Aov::Z,
        name: "Z",
        aliases: &["depth", "Pz", "cameraDepth", "linearDepth"],
        channels: &["Z"],
        rule: Rule::Nearest {
            read: |s| [s.z, 0.0, 0.0],
            empty: f32::INFINITY,
        },
        half_allowed: false,
        doc: "distance along the viewing axis, scene units; infinite where nothing is hit",
    },
    AovRow {
        aov: Aov::N,
        name: "N",
        aliases: &["normal", "Nn", "hitN"],
        channels: &["N.X", "N.Y", "N.Z"],
        rule: Rule::Mean {
            read: |s| s.n.to_array(),
        },
        half_allowed: false,
        doc: "shading normal, world space; an average, so shorter than one at edges",
    },
    AovRow {
        aov: Aov::P,
        name: "P",
        aliases: &["position", "hitP", "worldPosition"],
        channels: &["P.X", "P.Y", "P.Z"],
        rule: Rule::Nearest {
            // Infinity marks a miss until the film adds the origin.
            read: |s| {
                if s.z.is_finite() {
                    s.p.to_array()
                } else {
                    [f32::INFINITY; 3]
                }
            },
            empty: f32::INFINITY,
        },
        half_allowed: false,
        doc: "position, world space, scene units; zero where nothing is hit",
    },
    AovRow {
        aov: Aov::Albedo,
        name: "albedo",
        aliases: &["diffuse_albedo", "Denoising Albedo"],
        channels: &["albedo.R", "albedo.G", "albedo.B"],
        rule: Rule::Mean {
            read: |s| s.albedo.to_array(),
        },
        half_allowed: true,
        doc: "reflectance of the first hit",
    },
    AovRow {
        aov: Aov::DirectDiffuse,
        name: "direct_diffuse",
        aliases: &[
            "directdiffuse",
            "diffuse_direct",
            "DiffDir",
            "C<RD>L",
            "LPE:C<RD>L",
        ],
        channels: &["direct_diffuse.R", "direct_diffuse.G", "direct_diffuse.B"],
        rule: Rule::Mean {
            read: |s| s.direct_diffuse.to_array(),
        },
        half_allowed: true,
        doc: "light scattered once, by a diffuse lobe",
    },
    AovRow {
        aov: Aov::IndirectDiffuse,
        name: "indirect_diffuse",
        aliases: &[
            "indirectdiffuse",
            "diffuse_indirect",
            "DiffInd",
            "C<RD>.+L",
            "LPE:C<RD>.+L",
        ],
        channels: &[
            "indirect_diffuse.R",
            "indirect_diffuse.G",
            "indirect_diffuse.B",
        ],
        rule: Rule::Mean {
            read: |s| s.indirect_diffuse.to_array(),
        },
        half_allowed: true,
        doc: "light that a diffuse lobe scatters towards the camera after other scatterings",
    },
    AovRow {
        aov: Aov::DirectSpecular,
        name: "direct_specular",
        aliases: &[
            "directspecular",
            "specular_direct",
            "directglossyreflection",
            "GlossDir",
            "C<RG>L",
            "LPE:C<RG>L",
        ],
        channels: &[
            "direct_specular.R",
            "direct_specular.G",
            "direct_specular.B",
        ],
        rule: Rule::Mean {
            read: |s| s.direct_specular.to_array(),
        },
        half_allowed: true,
        doc: "light scattered once, by a specular or glossy lobe",
    },
    AovRow {
        aov: Aov::IndirectSpecular,
        name: "indirect_specular",
        aliases: &[
            "indirectspecular",
            "specular_indirect",
            "indirectglossyreflection",
            "GlossInd",
            "C<RG>.+L",
            "LPE:C<RG>.+L",
        ],
        channels: &[
            "indirect_specular.R",
            "indirect_specular.G",
            "indirect_specular.B",
        ],
        rule: Rule::Mean {
            read: |s| s.indirect_specular.to_array(),
        },
        half_allowed: true,
        doc: "light that a specular or glossy lobe scatters towards the camera after others",
    },
    AovRow {
        aov: Aov::Emission,
        name: "emission",
        aliases: &["emit", "directemission", "CO"],
        channels: &["emission.R", "emission.G", "emission.B"],
        rule: Rule::Mean {
            read: |s| s.emission.to_array(),
        },
        half_allowed: true,
        doc: "light emitted by what the camera sees",
    },
    AovRow {
        aov: Aov::SampleCount,
        name: "sample_count",
        aliases: &["samplecount", "samples", "Debug Sample Count"],
        channels: &["sample_count"],
        rule: Rule::Statistic,
        half_allowed: false,
        doc: "samples taken",
    },
    AovRow {
        aov: Aov::Variance,
        name: "variance",
        aliases: &[],
        channels: &["variance"],
        rule: Rule::Statistic,
        half_allowed: false,
        doc: "estimated variance of the beauty's luminance, that is of the mean, not of a sample; \
              infinite below two samples",
    },
    AovRow {
        aov: Aov::PrimId,
        name: "primId",
        aliases: &["id", "prim_id"],
        channels: &["primId"],
        rule: Rule::Nearest {
            read: |s| [s.prim_id as f32, 0.0, 0.0],
            empty: -1.0,
        },
        half_allowed: false,
        doc: "prim of the first hit; -1 where nothing is hit",
    },
    AovRow {
        aov: Aov::InstanceId,
        name: "instanceId",
        aliases: &["instance_id", "instance"],
        channels: &["instanceId"],
        rule: Rule::Nearest {
            read: |s| [s.instance_id as f32, 0.0, 0.0],
            empty: -1.0,
        },
        half_allowed: false,
        doc: "instance of the first hit; -1 where there is none",
    },
];

impl Aov {
    /// Every layer, in the order in which images hold them.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.aov)
    }

    /// The name on the command line, in settings, and of the layer in files.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Names of the channels in files.
    pub fn channels(self) -> &'static [&'static str] {
        self.row().channels
    }

    /// What the layer holds, in which units.
    pub fn doc(self) -> &'static str {
        self.row().doc
    }

    pub(crate) fn row(self) -> &'static AovRow {
        &TABLE[self as usize]
    }
}

impl fmt::Display for Aov {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Aov {
    type Err = UnknownAov;

    /// A layer by its own name or by the one that other renderers use.
    fn from_str(name: &str) -> Result<Self, UnknownAov> {
        let is = |known: &str| known.eq_ignore_ascii_case(name);
        TABLE
            .iter()
            .find(|row| is(row.name) || row.aliases.iter().any(|alias| is(alias)))
            .map(|row| row.aov)
            .ok_or_else(|| UnknownAov(name.to_owned()))
    }
}

/// No layer has that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no layer is called `{0}`; there are {known}", known = known_names())]
pub struct UnknownAov(pub String);

fn known_names() -> String {
    TABLE.map(|row| row.name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn rows_are_in_the_order_of_the_variants() {
        for (idx, row) in TABLE.iter().enumerate() {
            assert_eq!(row.aov as usize, idx, "{}", row.name);
        }
    }

    #[test]
    fn no_name_or_channel_stands_for_two_layers() {
        let mut names = HashSet::new();
        let mut channels = HashSet::new();
        for row in &TABLE {
            for name in row.aliases.iter().chain([&row.name]) {
                assert!(names.insert(name.to_lowercase()), "{name}");
                assert_eq!(name.parse(), Ok(row.aov));
            }
            for channel in row.channels {
                assert!(channels.insert(channel), "{channel}");
            }
        }
    }

    #[test]
    fn an_unknown_name_is_told_what_there_is() {
        let error = "beuaty".parse::<Aov>().unwrap_err().to_string();
        assert!(
            error.contains("`beuaty`") && error.contains("direct_diffuse"),
            "{error}"
        );
    }
}
