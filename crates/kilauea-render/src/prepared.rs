//! A scene with all that is computed before its first ray.

use kilauea_scene::{Camera, Scene};
use kilauea_texture::TextureStore;
use std::sync::Arc;
use std::time::Instant;

use crate::RenderError;
use crate::geometry::Geometry;
use crate::light::Lights;
use crate::needs::SceneNeeds;
use crate::set::{MemberBytes, Set, SetPlan};
use crate::stats::SceneSize;

/// A scene that is ready to be rendered any number of times.
pub struct PreparedScene {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Where it is seen from: the scene's own camera, or the one that was set since.
    pub camera: Camera,
    /// Surfaces.
    pub geometry: Geometry,
    /// Lights.
    pub lights: Lights,
    /// Images.
    pub textures: TextureStore,
    /// What the scene uses.
    pub needs: SceneNeeds,
    /// What was found wrong and left out.
    pub warnings: Vec<String>,
    /// How long this took.
    pub build_secs: f64,
    /// Of the whole scene; what its placements and lights add is not in it.
    pub size: SceneSize,
    /// Who holds the surfaces, if they are not in `geometry`.
    pub set: Option<Set>,
}

/// Choices made before the first ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrepareOptions {
    /// Bound on the texture tiles in memory.
    pub texture_memory_bytes: u64,
    /// Whether rays skip the code for what the scene does not have: instances, motion, curves,
    /// points, masks. False runs the general walk (tests, benchmarks).
    pub specialize_rays: bool,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self {
            texture_memory_bytes: 1 << 30,
            specialize_rays: true,
        }
    }
}

impl PreparedScene {
    /// Validates the scene, compiles shaders, builds the tree and the lights.
    pub fn new(scene: Scene, options: &PrepareOptions) -> Result<Self, RenderError> {
        let start = Instant::now();
        scene.validate()?;
        let size = SceneSize::of(&scene);
        let scene = Arc::new(scene);
        let geometry = Geometry::build(Arc::clone(&scene), options)?;
        Ok(Self::around((scene, geometry, None), size, options, start))
    }

    /// The same, with the surfaces spread over the members of a set. The images are equal.
    pub fn spread(
        scene: &Scene,
        plan: &SetPlan,
        options: &PrepareOptions,
    ) -> Result<Self, RenderError> {
        let start = Instant::now();
        scene.validate()?;
        let size = SceneSize::of(scene);
        let (left, geometry, set) = Set::new(scene, plan, options)?;
        Ok(Self::around(
            (left, geometry, Some(set)),
            size,
            options,
            start,
        ))
    }

    /// Adds to surfaces all that they are rendered with.
    pub(crate) fn around(
        (scene, geometry, set): (Arc<Scene>, Geometry, Option<Set>),
        size: SceneSize,
        options: &PrepareOptions,
        start: Instant,
    ) -> Self {
        let (textures, texture_errors) =
            TextureStore::open(&scene.textures, options.texture_memory_bytes);
        let mut warnings: Vec<String> = texture_errors.iter().map(ToString::to_string).collect();
        for (material, shader) in scene.materials.iter().zip(geometry.shaders()) {
            for input in shader.ignored_inputs() {
                warnings.push(format!("{}: inputs:{input} is not known", material.path));
            }
            for remark in shader.out_of_range() {
                warnings.push(format!("{}: {remark}", material.path));
            }
        }
        warnings.extend(geometry.left_out());
        warnings.extend(set.iter().flat_map(Set::left_out));
        let camera = scene.camera.clone();
        let lights = Lights::new(&scene, &camera, &geometry, &textures);
        for prim_idx in lights.unsampled_prims() {
            let path = scene.prim_path(prim_idx);
            let what = "emits and moves: its light is found by chance only";
            warnings.push(format!("{path}: {what}"));
        }
        let needs = SceneNeeds::of(&scene, &camera, &geometry, &lights);
        Self {
            scene,
            camera,
            geometry,
            lights,
            textures,
            needs,
            warnings,
            build_secs: start.elapsed().as_secs_f64(),
            size,
            set,
        }
    }

    /// Has the scene seen from elsewhere.
    ///
    /// # Errors
    /// A number of the camera is not finite.
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), RenderError> {
        camera.check()?;
        if self.lights.depend_on_camera() {
            self.lights = Lights::new(&self.scene, &camera, &self.geometry, &self.textures);
        }
        self.needs = SceneNeeds::of(&self.scene, &camera, &self.geometry, &self.lights);
        self.camera = camera;
        Ok(())
    }

    /// Bytes that each member of the set holds; none where all is here.
    pub fn member_bytes(&self) -> Vec<MemberBytes> {
        let own = || MemberBytes::of(&self.scene, &self.geometry);
        let bytes = self.set.as_ref().map(|set| set.bytes(own()));
        bytes.unwrap_or_default()
    }
}
