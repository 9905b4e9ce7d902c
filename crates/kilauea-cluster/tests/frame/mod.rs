//! A small frame with everything that workers may disagree about, rendered alone and by workers.
#![allow(dead_code, reason = "each test uses a part")]

pub(crate) mod elsewhere;
pub(crate) mod kills;

use std::path::PathBuf;
use std::time::Duration;

use kilauea_cluster::{ClusterJob, ClusterOptions, ClusterResult, WorkerKind};
use kilauea_film::Image;
use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_mesh::CurveType;
use kilauea_scene::{
    Channel, FinalGathering, GlobalIllumination, Input, Integrator, Light, LightShape, Node,
    PhotonSettings, RenderSettings, Scene, Wrap,
};
use kilauea_tests::{
    Curves, Mesh, Picture, Placements, Points, Stage, TileFile, glass, light, matte, rect_light,
    with_opacity,
};

/// A scene, the settings to render it with, and the image on its floor, which is a file.
pub(crate) struct Shot {
    pub(crate) stage: Stage,
    pub(crate) settings: RenderSettings,
    _image: TileFile,
}

impl Shot {
    /// A glass and a glossy ball, hair, a cut-out, instances, and an image on the floor.
    pub(crate) fn new() -> Self {
        let image = TileFile::new([8, 8], |x, y| {
            let is_light = (x + y) % 2 == 0;
            [if is_light { 0.8 } else { 0.1 }, 0.3, 0.2]
        });
        let mut stage = Stage::sphere_on_floor();
        stage.textures.push(image.source());
        let floor = &mut stage.materials[0];
        floor.nodes.extend([
            Node::Primvar {
                name: "st".into(),
                fallback: [0.3, 0.6, 0.0, 0.0],
            },
            Node::UvTexture {
                texture: 0,
                st: floor.nodes.len() as u32,
                wrap_s: Wrap::Repeat,
                wrap_t: Wrap::Mirror,
                scale: [1.0; 4],
                bias: [0.0; 4],
                fallback: [0.5; 4],
            },
        ]);
        let node = floor.nodes.len() as u32 - 1;
        for input in floor.inputs.values_mut() {
            *input = Input {
                node,
                channel: Channel::Rgb,
            };
        }
        stage.materials.push(glass(&[]));
        stage
            .materials
            .push(with_opacity(matte([0.2, 0.6, 0.3]), 0.5));
        let place = DAffine3::from_translation(DVec3::new(0.9, 0.3, 0.6));
        let place = place * DAffine3::from_scale(DVec3::splat(0.3));
        stage
            .meshes
            .push(Mesh::cube().placed(place).with_material(2));
        stage.prototypes.push("/Prototype".into());
        let small = DAffine3::from_scale(DVec3::splat(0.15));
        let cube = Mesh::cube().in_prototype(1).with_material(3).placed(small);
        stage.meshes.push(cube);
        stage.instances.push(Placements {
            parent: 0,
            prototype: 1,
            parent_from_prototype: [DVec3::new(-0.8, 0.2, 0.5), DVec3::new(0.2, 0.2, 0.9)]
                .map(DAffine3::from_translation)
                .to_vec(),
            primvar: None,
            later: Vec::new(),
        });
        let strand = [[-0.9, 0.0, 0.2], [-0.8, 0.5, 0.3], [-0.9, 1.0, 0.1]];
        stage
            .curves
            .push(Curves::new(CurveType::Cubic, &strand, 0.05));
        stage.points.push(Points::new(&[[0.5, 0.2, 0.9]], 0.15));
        stage.lights.push(rect_light(0.5, 0.5, 2.0));
        stage.lights.push(Light {
            radiance: Spectrum::new(0.1, 0.2, 0.3),
            ..light(LightShape::Dome, DMat4::IDENTITY)
        });
        let settings = RenderSettings {
            // Six tiles, some of them narrow.
            resolution: [72, 40],
            samples_per_pixel: 6,
            max_depth: 5,
            // Given, so that photons are traced whether they pay or not.
            photons: PhotonSettings {
                radius: Some(0.05),
                ..PhotonSettings::default()
            },
            ..Stage::settings()
        };
        Self {
            stage,
            settings,
            _image: image,
        }
    }

    /// A shot whose paths end early with irradiance from photons, whether that pays or not.
    pub(crate) fn gathering() -> Self {
        Self::new().with(|s| {
            s.integrator = Integrator::Kilauea;
            s.gi = GlobalIllumination::Consistent;
            s.photons = PhotonSettings {
                emitted_per_sample: Some(500),
                final_gathering: FinalGathering::Always,
                ..s.photons
            };
        })
    }

    /// A shot of which the camera sees photons, whether that pays or not.
    pub(crate) fn with_photons_seen() -> Self {
        Self::new().with(|s| {
            s.integrator = Integrator::Path;
            s.gi = GlobalIllumination::Exact;
            s.photons.emitted_per_sample = Some(2000);
        })
    }

    /// Fails where workers made another picture than one process did, or no photon was seen.
    pub(crate) fn check_photons_seen(&self, alone: &Picture, result: &ClusterResult, what: &str) {
        self.check(alone, result, what);
        let (ours, theirs) = (&alone.stats, &result.frame.stats);
        assert!(ours.photons.stored > 100, "{what}: {:?}", ours.photons);
        assert_eq!(ours.photons.stored, theirs.photons.stored, "{what}");
        assert_eq!(theirs.shared_passes, ["photons", "splats"], "{what}");
    }

    /// The same shot with so many samples that rendering it takes a second or more.
    pub(crate) fn long() -> Self {
        let mut shot = Self::new();
        shot.settings.samples_per_pixel = 48;
        shot
    }

    pub(crate) fn with(mut self, change: impl FnOnce(&mut RenderSettings)) -> Self {
        change(&mut self.settings);
        self
    }

    pub(crate) fn scene(&self) -> Scene {
        self.stage.scene(self.settings.resolution)
    }

    /// As one process renders it.
    pub(crate) fn alone(&self) -> Picture {
        Picture::render(&self.stage.prepare(&self.settings), self.settings.clone())
    }

    /// Starts workers.
    pub(crate) fn start(&self, options: ClusterOptions) -> ClusterJob {
        ClusterJob::start(&self.scene(), &self.settings, options).expect("the shot is sound")
    }

    /// The pixels of what workers rendered.
    pub(crate) fn image(&self, result: &ClusterResult) -> Image {
        result.frame.film.to_image(self.scene().origin_world)
    }

    /// Fails where workers made another picture.
    pub(crate) fn check(&self, alone: &Picture, result: &ClusterResult, what: &str) {
        let picture = Picture {
            image: self.image(result),
            stats: result.frame.stats.clone(),
        };
        assert!(picture.stats.is_complete, "{what}");
        alone.check_same_bits(&picture, what);
        let (ours, theirs) = (&alone.stats.rays, &picture.stats.rays);
        assert_eq!(ours.camera, theirs.camera, "{what}");
        assert_eq!(ours.shadow, theirs.shadow, "{what}");
        assert_eq!(ours.indirect, theirs.indirect, "{what}");
    }

    /// Fails where workers made another picture than one process did, or paths looked nothing up.
    pub(crate) fn check_gathering(&self, alone: &Picture, result: &ClusterResult, what: &str) {
        self.check(alone, result, what);
        let (ours, theirs) = (&alone.stats, &result.frame.stats);
        assert!(
            ours.final_gather.records > 100,
            "{what}: nothing is looked up"
        );
        assert_eq!(ours.final_gather, theirs.final_gather, "{what}");
        let is_shared = theirs.shared_passes.iter().any(|pass| pass == "irradiance");
        assert!(is_shared, "{what}: {:?}", theirs.shared_passes);
    }
}

/// The integrators, by name.
pub(crate) fn integrators() -> [(&'static str, Integrator, GlobalIllumination); 3] {
    [
        ("path", Integrator::Path, GlobalIllumination::Exact),
        ("kilauea", Integrator::Kilauea, GlobalIllumination::Exact),
        ("photons", Integrator::Path, GlobalIllumination::Consistent),
    ]
}

/// Workers of whom none seems dead because the machine is busy.
pub(crate) fn options(n_workers: u32, kind: WorkerKind) -> ClusterOptions {
    ClusterOptions {
        dead_after: Duration::from_mins(1),
        ..ClusterOptions::new(n_workers, kind)
    }
}

/// Workers in processes of their own.
pub(crate) fn processes() -> WorkerKind {
    WorkerKind::Processes {
        program: PathBuf::from(env!("CARGO_BIN_EXE_kilauea-worker")),
        arguments: Vec::new(),
    }
}

/// Waits for the first results.
pub(crate) fn wait_for_progress(job: &ClusterJob, fraction: f64) {
    while job.progress().0 < fraction && !job.wait(Duration::from_millis(2)) {}
}

/// Sends a signal to a process, by name.
pub(crate) fn signal(name: &str, pid: u32) {
    let status = std::process::Command::new("kill")
        .args([format!("-{name}"), pid.to_string()])
        .status();
    assert!(status.is_ok(), "kill is missing");
}
