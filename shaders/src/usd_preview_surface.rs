use kilauea_bsdf::{Layers, f0_from_ior};
use kilauea_shading::prelude::*;

parameters! {
    /// The preview surface of the USD specification 2.6: a diffuse base or a metal or glass, under
    /// a specular interface, under a clear coat.
    pub struct PreviewInputs {
        /// Albedo of a dielectric, or reflectance of a metal.
        diffuse_color: Spectrum = ("diffuseColor", Spectrum::splat(0.18), 0.0..=1.0),
        /// Radiance emitted from both sides, in nits.
        emissive_color: Spectrum = ("emissiveColor", Spectrum::BLACK),
        /// 1 takes `specularColor`, 0 takes `metallic`.
        use_specular_workflow: f32 = ("useSpecularWorkflow", 0.0),
        /// Reflectance at normal incidence, in the specular workflow.
        specular_color: Spectrum = ("specularColor", Spectrum::BLACK),
        /// 1 is a metal, 0 a dielectric, in the metallic workflow.
        metallic: f32 = ("metallic", 0.0, 0.0..=1.0),
        /// Of the reflection; refraction has none. Its square is GGX's alpha.
        roughness: f32 = ("roughness", 0.5, 0.0..=1.0),
        /// Amount of a clear coat over everything else.
        clearcoat: f32 = ("clearcoat", 0.0, 0.0..=1.0),
        /// Roughness of the clear coat.
        clearcoat_roughness: f32 = ("clearcoatRoughness", 0.01, 0.0..=1.0),
        /// See `opacityMode`.
        opacity: f32 = ("opacity", 1.0, 0.0..=1.0),
        /// Transparent: `1 - opacity` of the base is clear glass under the reflection.
        /// Presence: `1 - opacity` of the surface is not there.
        opacity_mode: f32 = ("opacityMode", 0.0, &["transparent", "presence"]),
        /// Above 0: the surface is solid where opacity reaches it and not there elsewhere.
        opacity_threshold: f32 = ("opacityThreshold", 0.0),
        /// Index of refraction.
        ior: f32 = ("ior", 1.5),
        /// Normal in tangent space; taken from textures only.
        normal: Vec3 = ("normal", Vec3::Z),
        /// Not rendered.
        displacement: f32 = ("displacement", 0.0),
        /// For renderers that trace no rays; ignored.
        occlusion: f32 = ("occlusion", 1.0),
    }
}

/// Layers with the inputs of UsdPreviewSurface, so that no light is gained or lost between them.
#[derive(Clone, Debug)]
pub struct UsdPreviewSurface {
    inputs: PreviewInputs,
    opacity_mode: OpacityMode,
}

/// What `opacity` does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OpacityMode {
    Transparent,
    Presence,
    Threshold,
}

impl SurfaceShader for UsdPreviewSurface {
    const NAME: &'static str = "UsdPreviewSurface";

    fn declaration() -> Declaration {
        PreviewInputs::declaration()
    }

    fn compile(inputs: &mut ShaderInputs<'_>) -> Result<Self, ShaderError> {
        let read = PreviewInputs::read(inputs)?;
        let opacity_mode = if read.opacity_threshold.constant().is_none_or(|t| t > 0.0) {
            OpacityMode::Threshold
        } else if read.opacity_mode.constant() == Some(1.0) {
            OpacityMode::Presence
        } else {
            OpacityMode::Transparent
        };
        Ok(Self {
            inputs: read,
            opacity_mode,
        })
    }

    fn bsdf(&self, surface: &Surface<'_>) -> Bsdf {
        let layers = self.layers(surface);
        let ns = surface.reflecting_normal(self.normal(surface));
        Bsdf::layered(Frame::from_z(ns), surface.ng, &layers)
    }

    fn emission(&self, surface: &Surface<'_>) -> Spectrum {
        self.inputs.emissive_color.at(surface).max(0.0)
    }

    fn opacity(&self, surface: &Surface<'_>) -> f32 {
        let opacity = || self.inputs.opacity.at(surface).clamp(0.0, 1.0);
        match self.opacity_mode {
            OpacityMode::Transparent => 1.0,
            OpacityMode::Presence => opacity(),
            OpacityMode::Threshold => {
                let is_there = opacity() >= self.inputs.opacity_threshold.at(surface);
                f32::from(u8::from(is_there))
            }
        }
    }

    fn is_opaque(&self) -> bool {
        let opacity = self.inputs.opacity.constant();
        match self.opacity_mode {
            OpacityMode::Transparent => true,
            OpacityMode::Presence => opacity.is_some_and(|o| o >= 1.0),
            OpacityMode::Threshold => opacity
                .zip(self.inputs.opacity_threshold.constant())
                .is_some_and(|(o, threshold)| o.clamp(0.0, 1.0) >= threshold),
        }
    }

    fn is_emissive(&self) -> bool {
        let constant = self.inputs.emissive_color.constant();
        constant.is_none_or(|emission| !emission.max(0.0).is_black())
    }

    fn constant_emission(&self) -> Option<Spectrum> {
        self.inputs.emissive_color.constant().map(|e| e.max(0.0))
    }

    fn mean_emission(&self, textures: &TextureStore) -> Spectrum {
        if !self.is_emissive() {
            return Spectrum::BLACK;
        }
        let mean = self.inputs.emissive_color.mean(textures);
        match mean.map(|mean| mean.max(0.0)) {
            Some(mean) if !mean.is_black() => mean,
            _ => Spectrum::ONE,
        }
    }
}

impl UsdPreviewSurface {
    fn layers(&self, surface: &Surface<'_>) -> Layers {
        let inputs = &self.inputs;
        let color = inputs.diffuse_color.at(surface).clamp(0.0, 1.0);
        let ior = inputs.ior.at(surface);
        let opacity = match self.opacity_mode {
            OpacityMode::Transparent => inputs.opacity.at(surface).clamp(0.0, 1.0),
            OpacityMode::Presence | OpacityMode::Threshold => 1.0,
        };
        let (f0, f90, dielectric) = if inputs.use_specular_workflow.at(surface) == 0.0 {
            let metallic = inputs.metallic.at(surface).clamp(0.0, 1.0);
            let specular = Spectrum::ONE.lerp(color, metallic);
            let f0 = (specular * f0_from_ior(ior)).lerp(specular, metallic);
            (f0, specular, 1.0 - metallic)
        } else {
            (inputs.specular_color.at(surface), Spectrum::ONE, 1.0)
        };
        Layers {
            diffuse: color * (dielectric * opacity),
            f0,
            f90,
            roughness: inputs.roughness.at(surface),
            coat: inputs.clearcoat.at(surface),
            coat_roughness: inputs.clearcoat_roughness.at(surface),
            transmission: dielectric * (1.0 - opacity),
            transmission_tint: Spectrum::ONE,
            ior,
        }
    }

    fn normal(&self, surface: &Surface<'_>) -> Vec3 {
        match self.inputs.normal.texture_st(surface) {
            Some(st) => surface.mapped_normal(self.inputs.normal.at(surface), st),
            None => surface.ns,
        }
    }
}
