use kilauea_math::{DAffine3, DVec3};
use kilauea_mesh::{
    AssembleOptions, Axis, ImplicitKind, ImplicitShape, InstancesPayload, Payloads, Primvar,
    PrimvarInterpolation, assemble,
};
use kilauea_render::{Conditions, PrepareOptions, PreparedScene, RenderJob};
use kilauea_scene::{
    Camera, FilterKind, Light, Material, RenderSettings, Scene, TextureSource, Visibility,
};
use std::sync::Arc;

use crate::{Curves, Mesh, Picture, Points, matte, perspective, preview, wall_light};

/// A scene under construction.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Names of prototypes; entry 0 is the world.
    pub prototypes: Vec<String>,
    /// Polygon meshes.
    pub meshes: Vec<Mesh>,
    /// Spheres in the world.
    pub spheres: Vec<Sphere>,
    /// Curves.
    pub curves: Vec<Curves>,
    /// Points.
    pub points: Vec<Points>,
    /// Placements of prototypes.
    pub instances: Vec<Placements>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Images.
    pub textures: Vec<TextureSource>,
    /// Lights.
    pub lights: Vec<Light>,
    /// The camera.
    pub camera: Camera,
}

/// A sphere, tessellated to the size of pixels.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// World space.
    pub center: [f64; 3],
    /// World space.
    pub radius: f64,
    /// Index into [`Stage::materials`].
    pub material: u32,
}

/// A prototype placed any number of times.
#[derive(Clone, Debug)]
pub struct Placements {
    /// The prototype that holds them.
    pub parent: u32,
    /// The prototype that is placed.
    pub prototype: u32,
    /// One per instance.
    pub parent_from_prototype: Vec<DAffine3>,
    /// Name and values of a primvar of three floats per instance.
    pub primvar: Option<(String, Vec<f32>)>,
    /// The transforms at later motion keys.
    pub later: Vec<Vec<DAffine3>>,
}

impl Stage {
    /// Nothing but a camera.
    pub fn new(camera: Camera) -> Self {
        Self {
            prototypes: vec![String::new()],
            meshes: Vec::new(),
            spheres: Vec::new(),
            curves: Vec::new(),
            points: Vec::new(),
            instances: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            lights: Vec::new(),
            camera,
        }
    }

    /// A glossy sphere on a floor, without a light.
    pub fn sphere_on_floor() -> Self {
        let mut stage = Self::new(perspective([0.0, 1.2, 3.0], [0.0, 0.4, 0.0], 0.5));
        stage.materials = vec![
            matte([0.7, 0.6, 0.5]),
            preview(&[("diffuseColor", &[0.2, 0.4, 0.8]), ("roughness", &[0.3])]),
        ];
        stage.meshes.push(Mesh::floor(2.0));
        stage.spheres.push(Sphere {
            center: [0.0, 0.5, 0.0],
            radius: 0.5,
            material: 1,
        });
        stage
    }

    /// The same beside a red wall, and closer.
    pub fn sphere_beside_wall() -> Self {
        let mut stage = Self::sphere_on_floor();
        stage.camera = perspective([0.0, 1.2, 3.0], [0.0, 0.4, 0.0], 0.4);
        stage.materials.push(matte([0.8, 0.3, 0.2]));
        let wall = [
            [-1.0, 0.0, -1.0],
            [-1.0, 0.0, 1.0],
            [-1.0, 2.0, 1.0],
            [-1.0, 2.0, -1.0],
        ];
        stage.meshes.push(Mesh::polygon(&wall).with_material(2));
        stage
    }

    /// A box around the camera with lights of radiance one half that cover its walls. With walls of
    /// albedo one half radiance is one everywhere.
    pub fn box_of_light(wall: Material) -> Self {
        let mut stage = Self::new(perspective([0.3, 0.2, 0.5], [0.0, 0.0, -1.0], 1.0));
        stage.meshes.push(Mesh::cube());
        stage.materials.push(wall);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for side in [-1.0, 1.0] {
                stage.lights.push(wall_light(axis * side));
            }
        }
        stage
    }

    /// Settings that tests start from: 16 by 16 pixels, 64 samples, one thread, the box filter.
    pub fn settings() -> RenderSettings {
        RenderSettings {
            resolution: [16, 16],
            samples_per_pixel: 64,
            threads: 1,
            filter: FilterKind::Box,
            texture_memory_bytes: 64 << 20,
            ..RenderSettings::default()
        }
    }

    /// The scene that the engine gets.
    pub fn scene(&self, resolution: [u32; 2]) -> Scene {
        let options = AssembleOptions {
            resolution,
            ..AssembleOptions::default()
        };
        let assembled = assemble(self.payloads(), &options).expect("the stage is sound");
        assert_eq!(assembled.warnings, [""; 0]);
        assembled.scene
    }

    /// The scene, ready for rendering.
    pub fn prepare(&self, settings: &RenderSettings) -> Arc<PreparedScene> {
        let scene = self.scene(settings.resolution);
        let prepared = PreparedScene::new(scene, &PrepareOptions::default());
        let prepared = prepared.expect("the scene is sound");
        assert_eq!(prepared.warnings, [""; 0]);
        Arc::new(prepared)
    }

    /// The scene with whatever is wrong in it, and what was said of that.
    pub fn prepare_damaged(&self, settings: &RenderSettings) -> (Arc<PreparedScene>, Vec<String>) {
        let options = AssembleOptions {
            resolution: settings.resolution,
            ..AssembleOptions::default()
        };
        let assembled = assemble(self.payloads(), &options).expect("the records are sound");
        let prepared = PreparedScene::new(assembled.scene, &PrepareOptions::default());
        let prepared = prepared.expect("what is broken is left out");
        let warnings = [&assembled.warnings[..], &prepared.warnings[..]].concat();
        (Arc::new(prepared), warnings)
    }

    /// Why the engine refuses the scene; none where it does not.
    pub fn refusal(&self) -> Option<String> {
        let assembled = match assemble(self.payloads(), &AssembleOptions::default()) {
            Ok(assembled) => assembled,
            Err(error) => return Some(error.to_string()),
        };
        let prepared = PreparedScene::new(assembled.scene, &PrepareOptions::default());
        prepared.err().map(|error| error.to_string())
    }

    /// Renders whatever there is with [`Self::settings`] after `change`; returns the warnings too.
    pub fn render_damaged(
        &self,
        change: impl FnOnce(&mut RenderSettings),
    ) -> (Picture, Vec<String>) {
        let mut settings = Self::settings();
        change(&mut settings);
        let (prepared, mut warnings) = self.prepare_damaged(&settings);
        let picture = Picture::render_damaged(&prepared, settings);
        warnings.extend_from_slice(&picture.stats.warnings[prepared.warnings.len()..]);
        (picture, warnings)
    }

    /// Renders with [`Self::settings`] after `change`.
    pub fn render(&self, change: impl FnOnce(&mut RenderSettings)) -> Picture {
        let mut settings = Self::settings();
        change(&mut settings);
        Picture::render(&self.prepare(&settings), settings)
    }

    fn payloads(&self) -> Payloads<'_> {
        let spheres = self.spheres.iter().map(|sphere| ImplicitShape {
            path: "/Sphere",
            prototype: 0,
            prototype_from_mesh: DAffine3::from_translation(DVec3::from_array(sphere.center)),
            kind: ImplicitKind::Sphere,
            axis: Axis::Y,
            dimensions: [sphere.radius, 0.0, 0.0],
            material: sphere.material,
            left_handed: false,
            double_sided: true,
            primvars: Vec::new(),
            visibility: Visibility::ALL,
        });
        let instances = self.instances.iter().map(|placements| InstancesPayload {
            path: "/Instances",
            parent: placements.parent,
            prototype: placements.prototype,
            parent_from_prototype: placements.parent_from_prototype.clone(),
            later_parent_from_prototype: placements.later.clone(),
            visibility: Visibility::ALL,
            primvars: placements
                .primvar
                .iter()
                .map(|(name, values)| Primvar {
                    name,
                    width: 3,
                    interpolation: PrimvarInterpolation::Uniform,
                    values,
                    indices: None,
                })
                .collect(),
        });
        Payloads {
            prototypes: self.prototypes.clone(),
            meshes: self.meshes.iter().map(Mesh::payload).collect(),
            implicits: spheres.collect(),
            curves: self.curves.iter().map(Curves::payload).collect(),
            points: self.points.iter().map(Points::payload).collect(),
            instances: instances.collect(),
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            lights: self.lights.clone(),
            camera: self.camera.clone(),
        }
    }
}

impl Picture {
    /// Renders a frame to its end.
    pub fn render(prepared: &Arc<PreparedScene>, settings: RenderSettings) -> Self {
        Self::render_under(Conditions::default(), prepared, settings)
    }

    /// Renders a frame to its end under the conditions of an experiment.
    pub fn render_under(
        conditions: Conditions,
        prepared: &Arc<PreparedScene>,
        settings: RenderSettings,
    ) -> Self {
        let job = RenderJob::start_under(conditions, Arc::clone(prepared), settings);
        Self::finish(job.expect("the settings are sound"), prepared)
    }

    /// Renders a frame in which rays and samples may be invalid.
    pub fn render_damaged(prepared: &Arc<PreparedScene>, settings: RenderSettings) -> Self {
        let job = RenderJob::start(Arc::clone(prepared), settings).expect("the settings are sound");
        let result = job.finish().expect("nothing fails");
        Self {
            image: result.film.to_image(prepared.scene.origin_world),
            stats: result.stats,
        }
    }

    /// Waits for a frame.
    pub fn finish(job: RenderJob, prepared: &PreparedScene) -> Self {
        let result = job.finish().expect("nothing fails");
        assert_eq!(result.stats.invalid_samples, 0);
        assert_eq!(result.stats.invalid_rays, 0);
        Self {
            image: result.film.to_image(prepared.scene.origin_world),
            stats: result.stats,
        }
    }
}
