/// Makes [`crate::Shader`] out of the list of shaders: static dispatch, no virtual call.
macro_rules! shaders {
    ($($shader:ident),+ $(,)?) => {
        /// The compiled surface shader of one material.
        #[derive(Clone, Debug)]
        pub struct Shader {
            kind: Kind,
            inputs: kilauea_shading::InputSummary,
        }

        #[derive(Clone, Debug)]
        enum Kind {
            $($shader(Box<$shader>),)+
        }

        impl Shader {
            /// Names of all shaders.
            pub const NAMES: &'static [&'static str] =
                &[$(<$shader as kilauea_shading::SurfaceShader>::NAME),+];

            /// Compiles the surface shader of a material.
            pub fn compile(
                material: &kilauea_scene::Material,
            ) -> Result<Self, kilauea_shading::ShaderError> {
                let mut inputs = kilauea_shading::ShaderInputs::new(material);
                let kind = match material.shader.as_str() {
                    $(<$shader as kilauea_shading::SurfaceShader>::NAME => {
                        Kind::$shader(Box::new(kilauea_shading::SurfaceShader::compile(&mut inputs)?))
                    })+
                    _ => {
                        return Err(kilauea_shading::ShaderError::UnknownShader {
                            material: material.path.clone(),
                            shader: material.shader.clone(),
                            known: Self::NAMES.join(", "),
                        });
                    }
                };
                Ok(Self {
                    kind,
                    inputs: inputs.finish(),
                })
            }

            /// What each shader declares, by name.
            pub fn declarations() -> Vec<(&'static str, kilauea_shading::Declaration)> {
                vec![$((
                    <$shader as kilauea_shading::SurfaceShader>::NAME,
                    <$shader as kilauea_shading::SurfaceShader>::declaration(),
                ),)+]
            }

            /// The primvars it reads, in slot order.
            #[inline]
            pub fn primvars(&self) -> &[String] {
                &self.inputs.primvars
            }

            /// The textures that it looks up.
            #[inline]
            pub fn lookups(&self) -> &kilauea_shading::Lookups {
                &self.inputs.lookups
            }

            /// Authored inputs that the shader does not have.
            #[inline]
            pub fn ignored_inputs(&self) -> &[String] {
                &self.inputs.ignored
            }

            /// Each constant outside its declared range, with its value and the range.
            #[inline]
            pub fn out_of_range(&self) -> &[String] {
                &self.inputs.out_of_range
            }

            /// See [`kilauea_shading::SurfaceShader::bsdf`].
            #[inline]
            pub fn bsdf(&self, surface: &kilauea_shading::Surface<'_>) -> kilauea_bsdf::Bsdf {
                match &self.kind {
                    $(Kind::$shader(s) => kilauea_shading::SurfaceShader::bsdf(&**s, surface),)+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::shade`].
            #[inline]
            pub fn shade<S: kilauea_shading::Shade>(
                &self,
                cx: S,
            ) -> impl Future<Output = kilauea_shading::Scattered> {
                match &self.kind {
                    $(Kind::$shader(s) => ShadeOf::$shader {
                        shade: kilauea_shading::SurfaceShader::shade(&**s, cx),
                    },)+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::emission`].
            #[inline]
            pub fn emission(
                &self,
                surface: &kilauea_shading::Surface<'_>,
            ) -> kilauea_math::Spectrum {
                match &self.kind {
                    $(Kind::$shader(s) => kilauea_shading::SurfaceShader::emission(&**s, surface),)+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::opacity`].
            #[inline]
            pub fn opacity(&self, surface: &kilauea_shading::Surface<'_>) -> f32 {
                match &self.kind {
                    $(Kind::$shader(s) => kilauea_shading::SurfaceShader::opacity(&**s, surface),)+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::interior`].
            #[inline]
            pub fn interior(&self) -> Option<kilauea_shading::Medium> {
                match &self.kind {
                    $(Kind::$shader(s) => kilauea_shading::SurfaceShader::interior(&**s),)+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::is_opaque`].
            #[inline]
            pub fn is_opaque(&self) -> bool {
                match &self.kind {
                    $(Kind::$shader(s) => kilauea_shading::SurfaceShader::is_opaque(&**s),)+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::is_emissive`].
            #[inline]
            pub fn is_emissive(&self) -> bool {
                match &self.kind {
                    $(Kind::$shader(s) => kilauea_shading::SurfaceShader::is_emissive(&**s),)+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::constant_emission`].
            pub fn constant_emission(&self) -> Option<kilauea_math::Spectrum> {
                match &self.kind {
                    $(Kind::$shader(s) => {
                        kilauea_shading::SurfaceShader::constant_emission(&**s)
                    })+
                }
            }

            /// See [`kilauea_shading::SurfaceShader::mean_emission`].
            pub fn mean_emission(
                &self,
                textures: &kilauea_shading::TextureStore,
            ) -> kilauea_math::Spectrum {
                match &self.kind {
                    $(Kind::$shader(s) => {
                        kilauea_shading::SurfaceShader::mean_emission(&**s, textures)
                    })+
                }
            }
        }

        pin_project_lite::pin_project! {
            /// The shade of one of the shaders. Each has a future of its own type, here called as
            /// the shader.
            #[project = ShadeOfProjection]
            enum ShadeOf<$($shader),+> {
                $($shader { #[pin] shade: $shader },)+
            }
        }

        impl<Output, $($shader: Future<Output = Output>),+> Future for ShadeOf<$($shader),+> {
            type Output = Output;

            #[inline]
            fn poll(
                self: std::pin::Pin<&mut Self>,
                task: &mut std::task::Context<'_>,
            ) -> std::task::Poll<Output> {
                match self.project() {
                    $(ShadeOfProjection::$shader { shade } => shade.poll(task),)+
                }
            }
        }
    };
}

pub(crate) use shaders;
